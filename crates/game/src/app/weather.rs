//! What one does to characters: pushes, balls, other gravity and friction.

use crate::app::args::Mode;
use crate::app::keys::{Deed, Do};
use crate::app::show::{Actor, Focus, Show};
use crate::axes::{to_game, turn_to_game};
use crate::look::FollowCamera;
use crate::plugin::MarathonSystems;
use crate::ragdoll::{Anatomy, Episode, Part, Physique, Push, Ragdoll};
use crate::simulate::{Marathon, RagdollState};
use bevy::prelude::*;
use bevy::window::PrimaryWindow;
use bevy_egui::input::EguiWantsInput;
use marathon_physics::model::{Geom, GeomType};
use marathon_physics::{Model, Variation};

/// Seconds that a push lasts.
const PUSH_SECONDS: f64 = 0.1;
/// Radius of a ball, m.
const BALL_RADIUS: f32 = 0.11;
/// Speed at which it is thrown, relative to whom it is thrown at and without what gravity will take, m/s.
const BALL_SPEED: f32 = 11.0;
/// Seconds that it stays.
const BALL_LIFE: f32 = 6.0;
/// Part of the speed that is left after a bounce.
const BOUNCE: f32 = 0.55;
/// What balls fall with, m/s^2.
const GRAVITY: f32 = 9.81;
/// Steps of a ball per tick: at its speed it must not pass through an arm.
const BALL_STEPS: u32 = 8;

/// Circumstances of all characters, as factors of the normal ones.
#[derive(Resource, Clone, Copy, Debug, PartialEq)]
pub struct Weather {
    /// Factor of gravity.
    pub gravity: f32,
    /// Slope that gravity makes of the level ground: degrees uphill.
    pub uphill: f32,
    /// Factor of friction.
    pub friction: f32,
    /// Factor of the motors' strength.
    pub strength: f32,
    /// Change of speed that a push gives the whole body, m/s.
    pub push: f32,
    /// Mass of a ball, kg.
    pub ball: f32,
}

impl Default for Weather {
    fn default() -> Self {
        Weather { gravity: 1.0, uphill: 0.0, friction: 1.0, strength: 1.0, push: 0.6, ball: 1.5 }
    }
}

/// A thrown ball. It bounces off the ground and off characters, which feel it.
#[derive(Component, Clone, Copy, Debug)]
pub struct Ball {
    velocity: Vec3,
    mass: f32,
    left: f32,
}

impl Ball {
    /// Its velocity, m/s.
    pub fn velocity(&self) -> Vec3 {
        self.velocity
    }
}

/// Pushes, balls and circumstances.
#[derive(Clone, Copy, Debug, Default)]
pub struct WeatherPlugin;

impl Plugin for WeatherPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Weather>()
            .add_systems(Update, (change, click, push_focus, throw))
            .add_systems(FixedUpdate, fly.before(MarathonSystems::Admit));
    }
}

/// Gives the characters their circumstances.
fn change(
    mut commands: Commands,
    weather: Res<Weather>,
    actors: Query<(Entity, &Anatomy, Has<Physique>), With<Actor>>,
    new: Query<(), Added<Anatomy>>,
) {
    let normal = Weather { push: weather.push, ball: weather.ball, ..default() };
    for (entity, anatomy, has) in &actors {
        if !(weather.is_changed() || new.contains(entity)) || (*weather == normal && !has) {
            continue;
        }
        let mut variation = Variation::none(&anatomy.model);
        let (sin, cos) = f64::from(weather.uphill).to_radians().sin_cos();
        let down = -variation.gravity[2] * f64::from(weather.gravity);
        variation.gravity = [-down * sin, 0.0, -down * cos];
        variation.friction = f64::from(weather.friction);
        variation.strength.fill(f64::from(weather.strength));
        commands.entity(entity).insert(Physique(variation));
    }
}

/// A shape of a character in the world: a rod with a radius, which a sphere is too; others by the rod within them.
struct Rod {
    ragdoll: Entity,
    body: usize,
    ends: [Vec3; 2],
    radius: f32,
}

/// Rods of all geoms of a character whose bodies are at the given places.
fn rods(ragdoll: Entity, anatomy: &Anatomy, place: impl Fn(usize) -> Option<GlobalTransform>) -> Vec<Rod> {
    let mut rods = Vec::new();
    for geom in anatomy.model.geoms.iter().filter(|g| anatomy.model.bodies[g.body].weld_id != 0) {
        let (Some(part), Some((half, radius))) = (place(geom.body), rod(geom)) else { continue };
        let center = part.transform_point(to_game(geom.pos));
        let along = part.rotation() * (turn_to_game(geom.quat) * Vec3::Y) * half;
        rods.push(Rod { ragdoll, body: geom.body, ends: [center - along, center + along], radius });
    }
    rods
}

fn rod(geom: &Geom) -> Option<(f32, f32)> {
    let [x, y, z] = geom.size.map(|s| s as f32);
    match geom.kind {
        GeomType::Sphere => Some((0.0, x)),
        GeomType::Capsule | GeomType::Cylinder => Some((y, x)),
        GeomType::Ellipsoid | GeomType::Box => {
            let radius = x.min(y).max(0.5 * x.max(y));
            Some(((z - radius).max(0.0), radius))
        }
        GeomType::Plane | GeomType::Hfield | GeomType::Mesh => None,
    }
}

fn nearest_on(rod: &Rod, point: Vec3) -> Vec3 {
    let [a, b] = rod.ends;
    let along = b - a;
    let share = if along.length_squared() > 0.0 { (point - a).dot(along) / along.length_squared() } else { 0.0 };
    a + along * share.clamp(0.0, 1.0)
}

/// The first rod that a ray meets, and where.
fn hit(rods: &[Rod], ray: Ray3d) -> Option<(&Rod, Vec3)> {
    let mut best: Option<(f32, &Rod, Vec3)> = None;
    for rod in rods {
        // the ray's closest approach, by turns: two lines are near each other after a few
        let mut at = nearest_on(rod, ray.origin);
        let mut reach = 0.0;
        for _ in 0..8 {
            reach = (at - ray.origin).dot(*ray.direction).max(0.0);
            at = nearest_on(rod, ray.get_point(reach));
        }
        let distance = ray.get_point(reach).distance(at);
        // a finger is thicker than a ray
        if distance < rod.radius * 1.15 + 0.02 && best.as_ref().is_none_or(|(nearest, ..)| reach < *nearest) {
            best = Some((reach, rod, ray.get_point(reach - rod.radius)));
        }
    }
    best.map(|(_, rod, at)| (rod, at))
}

/// A push that changes the speed of the whole body by `speed`.
fn push_of(model: &Model, speed: f32) -> f32 {
    let mass: f64 = model.bodies.iter().map(|b| b.mass).sum();
    (mass / PUSH_SECONDS) as f32 * speed
}

/// Whether one may meddle: on a course, runs are compared.
fn meddles(show: &Show) -> bool {
    show.mode != Mode::Course
}

/// A click pushes what is under it, away from the camera.
#[expect(clippy::too_many_arguments, reason = "a system names what it uses")]
fn click(
    buttons: Res<ButtonInput<MouseButton>>,
    wants: Option<Res<EguiWantsInput>>,
    show: Res<Show>,
    weather: Res<Weather>,
    window: Query<&Window, With<PrimaryWindow>>,
    camera: Query<(&Camera, &GlobalTransform), With<FollowCamera>>,
    actors: Query<(Entity, &Anatomy), With<Ragdoll>>,
    parts: Query<&GlobalTransform, With<Part>>,
    mut pushes: MessageWriter<Push>,
) {
    let over_ui = wants.is_some_and(|w| w.wants_any_pointer_input());
    if matches!(show.mode, Mode::Replay | Mode::Outside | Mode::Course)
        || over_ui
        || !buttons.just_pressed(MouseButton::Left)
    {
        return;
    }
    let Some(cursor) = window.iter().next().and_then(Window::cursor_position) else { return };
    let Some(ray) = camera.iter().next().and_then(|(c, at)| c.viewport_to_world(at, cursor).ok()) else { return };
    // what is seen is what is clicked at
    let shown = |anatomy: &Anatomy, body: usize| parts.get(*anatomy.parts.get(body)?).ok().copied();
    let rods = actors.iter().flat_map(|(ragdoll, anatomy)| rods(ragdoll, anatomy, |body| shown(anatomy, body)));
    let rods: Vec<Rod> = rods.collect();
    let Some((rod, at)) = hit(&rods, ray) else { return };
    let Ok((_, anatomy)) = actors.get(rod.ragdoll) else { return };
    let force = *ray.direction * push_of(&anatomy.model, weather.push);
    info!("pushed '{}'", anatomy.model.bodies[rod.body].name);
    pushes.write(Push { ragdoll: rod.ragdoll, body: rod.body, force, at: Some(at), seconds: PUSH_SECONDS });
}

/// A key pushes the root of the character in focus: forwards and backwards by turns.
fn push_focus(
    mut deeds: MessageReader<Do>,
    (show, focus): (Res<Show>, Res<Focus>),
    weather: Res<Weather>,
    actors: Query<(Entity, &Actor, &Anatomy, &Transform)>,
    mut pushes: MessageWriter<Push>,
    mut forwards: Local<bool>,
) {
    for _ in deeds.read().filter(|d| d.0 == Deed::Push && meddles(&show)) {
        let Some((ragdoll, _, anatomy, track)) = actors.iter().find(|(_, a, ..)| a.0 == focus.0) else { continue };
        let body = anatomy.model.joints.first().map_or(1, |j| j.body);
        *forwards = !*forwards;
        let way = track.rotation * Vec3::X * if *forwards { 1.0 } else { -1.0 };
        let force = way * push_of(&anatomy.model, weather.push);
        info!("pushed");
        pushes.write(Push { ragdoll, body, force, at: None, seconds: PUSH_SECONDS });
    }
}

/// Throws a ball at the character in focus, a little ahead of it.
#[expect(clippy::too_many_arguments, reason = "a system names what it uses")]
fn throw(
    mut commands: Commands,
    mut deeds: MessageReader<Do>,
    weather: Res<Weather>,
    camera: Query<(&FollowCamera, &Transform)>,
    actors: Query<(&Actor, &Anatomy, &RagdollState, &Transform, &Episode), Without<FollowCamera>>,
    (marathon, time): (Res<Marathon>, Res<Time<Fixed>>),
    (show, focus): (Res<Show>, Res<Focus>),
    mut meshes: Option<ResMut<Assets<Mesh>>>,
    mut materials: Option<ResMut<Assets<StandardMaterial>>>,
) {
    for _ in deeds.read().filter(|d| d.0 == Deed::Throw && meddles(&show)) {
        let Some((camera, at)) = camera.iter().next() else { continue };
        let runner = actors.iter().find(|(actor, ..)| actor.0 == focus.0);
        // where it will be: the camera's focus lags behind, and so do global transforms, by a frame
        let trunk = runner.and_then(|(_, anatomy, state, track, _)| {
            let root = anatomy.model.joints.first().map_or(1, |j| j.body);
            let places = marathon.places(state, time.elapsed() + time.overstep())?;
            Some(track.transform_point(places.get(root)?.translation))
        });
        let there = trunk.unwrap_or(camera.focus);
        let moving = runner.map_or(Vec3::ZERO, |(.., track, episode)| track.rotation * Vec3::X * episode.speed);
        let from = at.translation + at.rotation * Vec3::new(0.25, -0.15, -0.4);
        let seconds = (from.distance(there) / BALL_SPEED).max(1e-3);
        // what comes from afar flies higher, not past it
        let velocity = (there - from) / seconds + moving + Vec3::Y * (0.5 * GRAVITY * weather.gravity * seconds);
        let mut ball = commands.spawn((
            Name::new("ball"),
            Ball { velocity, mass: weather.ball, left: BALL_LIFE },
            Transform::from_translation(from),
        ));
        if let (Some(meshes), Some(materials)) = (&mut meshes, &mut materials) {
            let color = Color::srgb(0.86, 0.12, 0.16);
            let skin = StandardMaterial { base_color: color, perceptual_roughness: 0.35, ..default() };
            let mesh = meshes.add(Sphere::new(BALL_RADIUS).mesh().uv(24, 16));
            ball.insert((Mesh3d(mesh), MeshMaterial3d(materials.add(skin))));
        }
    }
}

/// Balls fly, bounce, and push what they hit.
fn fly(
    mut commands: Commands,
    time: Res<Time<Fixed>>,
    weather: Res<Weather>,
    mut balls: Query<(Entity, &mut Ball, &mut Transform), Without<Part>>,
    marathon: Res<Marathon>,
    actors: Query<(Entity, &Anatomy, &RagdollState, &GlobalTransform, &Episode), With<Ragdoll>>,
    mut pushes: MessageWriter<Push>,
) {
    if balls.is_empty() {
        return;
    }
    let dt = time.delta_secs() / BALL_STEPS as f32;
    // a frame may have many ticks: where the bodies are in this one is not in their transforms
    let rods = actors.iter().flat_map(|(ragdoll, anatomy, state, track, _)| {
        let places = marathon.places(state, time.elapsed()).unwrap_or_default();
        rods(ragdoll, anatomy, |body| Some(*track * *places.get(body)?))
    });
    let rods: Vec<Rod> = rods.collect();
    for (entity, mut ball, mut transform) in &mut balls {
        ball.left -= time.delta_secs();
        if ball.left <= 0.0 {
            commands.entity(entity).despawn();
            continue;
        }
        for _ in 0..BALL_STEPS {
            ball.velocity.y -= GRAVITY * weather.gravity * dt;
            transform.translation += ball.velocity * dt;
            if transform.translation.y < BALL_RADIUS && ball.velocity.y < 0.0 {
                transform.translation.y = BALL_RADIUS;
                ball.velocity.y *= -BOUNCE;
                ball.velocity *= Vec3::new(0.96, 1.0, 0.96);
            }
            for rod in &rods {
                let at = nearest_on(rod, transform.translation);
                let apart = transform.translation - at;
                let depth = rod.radius + BALL_RADIUS - apart.length();
                let (Some(normal), true) = (apart.try_normalize(), depth > 0.0) else { continue };
                let Ok((_, anatomy, _, track, episode)) = actors.get(rod.ragdoll) else { continue };
                // the body moves about as the whole character does
                let moving = track.rotation() * Vec3::X * episode.speed;
                transform.translation += normal * depth;
                let closing = (ball.velocity - moving).dot(normal);
                if closing >= 0.0 {
                    continue;
                }
                // what the body weighs against a blow is what the solver of contacts reckons with
                let lightness = anatomy.model.bodies[rod.body].invweight0[0] as f32;
                let impulse = -(1.0 + BOUNCE) * closing / (1.0 / ball.mass + lightness);
                let mass = ball.mass;
                ball.velocity += normal * (impulse / mass);
                let force = -normal * (impulse / anatomy.dt as f32);
                let hit = at + normal * rod.radius;
                pushes.write(Push { ragdoll: rod.ragdoll, body: rod.body, force, at: Some(hit), seconds: anatomy.dt });
                break;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_meet_the_nearest_rod() {
        let rod = |x: f32, body| Rod {
            ragdoll: Entity::PLACEHOLDER,
            body,
            ends: [Vec3::new(x, 0.0, 0.0), Vec3::new(x, 1.0, 0.0)],
            radius: 0.1,
        };
        let rods = [rod(5.0, 1), rod(3.0, 2), rod(4.0, 3)];
        let ray = |y: f32| Ray3d::new(Vec3::new(0.0, y, 0.0), Dir3::X);
        let (first, at) = hit(&rods, ray(0.5)).expect("it is in the way");
        assert!(first.body == 2 && at.distance(Vec3::new(2.9, 0.5, 0.0)) < 0.02, "{at}");
        assert!(hit(&rods, ray(1.3)).is_none());
        // beyond the end, within the cap
        assert!(hit(&rods, ray(1.08)).is_some());
    }
}
