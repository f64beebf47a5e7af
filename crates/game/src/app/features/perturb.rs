//! Perturbations: pushes, balls, and other gravity and friction.

use crate::app::audio::{PlaySound, Sound};
use crate::app::input::actions::{Action, ActionPressed};
use crate::app::input::pointer::{Gesture, Pointer};
use crate::app::mode::{AppSet, Mode};
use crate::app::stage::actors::{Actor, Focus};
use crate::app::stage::rods::{Picked, Picking, Rod, nearest_on, rods};
use crate::app::stage::scenario::LoadScenario;
use crate::app::ui::hints::{KeyHints, ModeKeys};
use crate::app::ui::theme::{Hud, UiSet, panel};
use bevy::prelude::*;
use bevy_egui::egui::{RichText, Slider};
use bevy_egui::{EguiContexts, EguiPrimaryContextPass};
use bevy_marathon::look::FollowCamera;
use bevy_marathon::{Anatomy, Episode, Marathon, MarathonSystems, Part, Physique, Push, Ragdoll, RagdollState, Track};
use marathon_physics::{Model, Variation};

/// Seconds that a push lasts.
const PUSH_SECONDS: f64 = 0.1;
/// Radius of a ball, m.
const BALL_RADIUS: f32 = 0.11;
/// Speed at which it is thrown, relative to its target and without the part that gravity takes, m/s.
const BALL_SPEED: f32 = 11.0;
/// Seconds that a ball exists.
const BALL_LIFE: f32 = 6.0;
/// Part of the speed that is left after a bounce.
const BOUNCE: f32 = 0.55;
/// Acceleration of balls, m/s^2.
const GRAVITY: f32 = 9.81;
/// Steps of a ball per tick: at its speed it must not pass through an arm.
const BALL_STEPS: u32 = 8;

/// Speed of an impact from which on it is heard, and from which on it is loudest, m/s.
const HEARD: f32 = 0.5;
const LOUD: f32 = 8.0;

/// The physics of all characters, as factors of the normal one, and the strength of pushes.
#[derive(Resource, Clone, Copy, Debug, PartialEq)]
pub struct Perturbations {
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

impl Default for Perturbations {
    fn default() -> Self {
        Perturbations { gravity: 1.0, uphill: 0.0, friction: 1.0, strength: 1.0, push: 0.6, ball: 1.5 }
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

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Perturbations>()
        .add_systems(
            Update,
            (
                reset.run_if(on_message::<LoadScenario>).run_if(in_state(Mode::Course)),
                change,
                click.run_if(allowed),
                // their actions are read in every mode, so that none waits for the next one
                (push_focus, throw),
            )
                .chain()
                .in_set(AppSet::Present),
        )
        .add_systems(FixedUpdate, fly.before(MarathonSystems::Admit))
        .add_systems(EguiPrimaryContextPass, draw.run_if(in_state(Mode::Push)).in_set(UiSet::Panels));
}

pub(super) fn key_hints(hints: &mut KeyHints) {
    const KEYS: ModeKeys = ModeKeys {
        useful: &[
            Action::Menu,
            Action::Push,
            Action::Throw,
            Action::Boxes,
            Action::Limp,
            Action::Slower,
            Action::Film,
            Action::Restart,
        ],
        mouse: Some(["click: push, drag: pull", "click a limb: push it   drag a limb: pull it   wheel: closer"]),
        ..ModeKeys::COMMON
    };
    hints.add(|scenario| scenario.mode == Mode::Push, &KEYS);
}

/// A course begins with the normal physics: its runs are compared.
fn reset(mut perturbations: ResMut<Perturbations>) {
    perturbations.set_if_neq(Perturbations::default());
}

/// Applies the physics to the characters.
fn change(
    mut commands: Commands,
    perturbations: Res<Perturbations>,
    actors: Query<(Entity, &Anatomy, Has<Physique>), With<Actor>>,
    new: Query<(), Added<Anatomy>>,
) {
    let normal = Perturbations { push: perturbations.push, ball: perturbations.ball, ..default() };
    for (entity, anatomy, has) in &actors {
        if !(perturbations.is_changed() || new.contains(entity)) || (*perturbations == normal && !has) {
            continue;
        }
        let mut variation = Variation::none(&anatomy.model);
        let (sin, cos) = f64::from(perturbations.uphill).to_radians().sin_cos();
        let down = -variation.gravity[2] * f64::from(perturbations.gravity);
        variation.gravity = [-down * sin, 0.0, -down * cos];
        variation.friction = f64::from(perturbations.friction);
        variation.strength.fill(f64::from(perturbations.strength));
        commands.entity(entity).insert(Physique(variation));
    }
}

/// A push that changes the speed of the whole body by `speed`.
fn push_of(model: &Model, speed: f32) -> f32 {
    let mass: f64 = model.bodies.iter().map(|b| b.mass).sum();
    (mass / PUSH_SECONDS) as f32 * speed
}

/// Whether pushes and balls are allowed: runs on a course are compared, and other programs move the rest.
fn allowed(mode: Res<State<Mode>>) -> bool {
    mode.is_simulated() && *mode != Mode::Course
}

/// A click pushes what is under it, away from the camera.
fn click(
    pointer: Res<Pointer>,
    perturbations: Res<Perturbations>,
    picking: Picking<'_, '_>,
    anatomies: Query<&Anatomy>,
    mut pushes: MessageWriter<Push>,
) {
    let Gesture::Click(cursor) = pointer.gesture else { return };
    let Some(Picked { ragdoll, body, at, direction }) = picking.at(cursor) else { return };
    let Ok(anatomy) = anatomies.get(ragdoll) else { return };
    let force = *direction * push_of(&anatomy.model, perturbations.push);
    info!("pushed '{}'", anatomy.model.bodies[body].name);
    pushes.write(Push { ragdoll, body, force, at: Some(at), seconds: PUSH_SECONDS });
}

/// A key pushes the root of the character in focus: forwards and backwards by turns.
fn push_focus(
    mut actions: MessageReader<ActionPressed>,
    (mode, focus): (Res<State<Mode>>, Res<Focus>),
    perturbations: Res<Perturbations>,
    actors: Query<(Entity, &Actor, &Anatomy, &Track)>,
    mut pushes: MessageWriter<Push>,
    mut forwards: Local<bool>,
) {
    for _ in actions.read().filter(|action| action.0 == Action::Push && *mode != Mode::Course) {
        let Some((ragdoll, _, anatomy, track)) = actors.iter().find(|(_, a, ..)| a.0 == focus.0) else { continue };
        let body = anatomy.model.joints.first().map_or(1, |j| j.body);
        *forwards = !*forwards;
        let way = track.direction() * if *forwards { 1.0 } else { -1.0 };
        let force = way * push_of(&anatomy.model, perturbations.push);
        info!("pushed");
        pushes.write(Push { ragdoll, body, force, at: None, seconds: PUSH_SECONDS });
    }
}

/// Throws a ball at the character in focus, a little ahead of it.
#[expect(clippy::too_many_arguments, reason = "a system names what it uses")]
fn throw(
    mut commands: Commands,
    mut actions: MessageReader<ActionPressed>,
    perturbations: Res<Perturbations>,
    camera: Query<(&FollowCamera, &Transform)>,
    actors: Query<(&Actor, &Anatomy, &RagdollState, &Track, &Episode)>,
    (marathon, time): (Res<Marathon>, Res<Time<Fixed>>),
    (mode, focus): (Res<State<Mode>>, Res<Focus>),
    mut meshes: Option<ResMut<Assets<Mesh>>>,
    mut materials: Option<ResMut<Assets<StandardMaterial>>>,
    mut sounds: MessageWriter<PlaySound>,
) {
    for _ in actions.read().filter(|action| action.0 == Action::Throw && *mode != Mode::Course) {
        let Some((camera, at)) = camera.iter().next() else { continue };
        let runner = actors.iter().find(|(actor, ..)| actor.0 == focus.0);
        // where it will be: the camera's focus lags behind, and so do global transforms, by a frame
        let trunk = runner.and_then(|(_, anatomy, state, track, _)| {
            let root = anatomy.model.joints.first().map_or(1, |j| j.body);
            let places = marathon.places(state, time.elapsed() + time.overstep())?;
            Some(track.place().transform_point(places.get(root)?.translation))
        });
        let there = trunk.unwrap_or(camera.focus);
        let moving = runner.map_or(Vec3::ZERO, |(.., track, episode)| track.direction() * episode.speed);
        let from = at.translation + at.rotation * Vec3::new(0.25, -0.15, -0.4);
        let seconds = (from.distance(there) / BALL_SPEED).max(1e-3);
        // aim higher from afar, so that the ball does not fall short
        let velocity = (there - from) / seconds + moving + Vec3::Y * (0.5 * GRAVITY * perturbations.gravity * seconds);
        sounds.write(PlaySound { sound: Sound::Throw, at: Some(from), loudness: 0.7 });
        let mut ball = commands.spawn((
            Name::new("ball"),
            Ball { velocity, mass: perturbations.ball, left: BALL_LIFE },
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
    perturbations: Res<Perturbations>,
    mut balls: Query<(Entity, &mut Ball, &mut Transform), Without<Part>>,
    marathon: Res<Marathon>,
    actors: Query<(Entity, &Anatomy, &RagdollState, &Track, &Episode), With<Ragdoll>>,
    (mut pushes, mut sounds): (MessageWriter<Push>, MessageWriter<PlaySound>),
) {
    if balls.is_empty() {
        return;
    }
    let dt = time.delta_secs() / BALL_STEPS as f32;
    // a frame may have many ticks: where the bodies are in this one is not in their transforms
    let rods = actors.iter().flat_map(|(ragdoll, anatomy, state, track, _)| {
        let places = marathon.places(state, time.elapsed()).unwrap_or_default();
        rods(ragdoll, anatomy, |body| Some(GlobalTransform::from(track.place()) * *places.get(body)?))
    });
    let rods: Vec<Rod> = rods.collect();
    for (entity, mut ball, mut transform) in &mut balls {
        ball.left -= time.delta_secs();
        if ball.left <= 0.0 {
            commands.entity(entity).despawn();
            continue;
        }
        for _ in 0..BALL_STEPS {
            ball.velocity.y -= GRAVITY * perturbations.gravity * dt;
            transform.translation += ball.velocity * dt;
            if transform.translation.y < BALL_RADIUS && ball.velocity.y < 0.0 {
                sounds.write_batch(impact(transform.translation, -ball.velocity.y));
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
                let moving = track.direction() * episode.speed;
                transform.translation += normal * depth;
                let closing = (ball.velocity - moving).dot(normal);
                if closing >= 0.0 {
                    continue;
                }
                sounds.write_batch(impact(transform.translation, -closing));
                // the resistance of the body to a blow, as the contact solver has it
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

/// The sound of a ball that hits something at a speed, m/s.
fn impact(at: Vec3, speed: f32) -> Option<PlaySound> {
    let loudness = (speed / LOUD).powf(1.5).min(1.0);
    (speed > HEARD).then_some(PlaySound { sound: Sound::Impact, at: Some(at), loudness })
}

/// Draws the sliders.
fn draw(mut contexts: EguiContexts, hud: Res<Hud>, mut perturbations: ResMut<Perturbations>) -> Result {
    if !hud.on {
        return Ok(());
    }
    let ctx = contexts.ctx_mut()?.clone();
    let mut now = *perturbations;
    panel(&ctx, true, |ui| {
        ui.label(RichText::new("Physics").size(15.0).strong());
        ui.add(Slider::new(&mut now.gravity, 0.0..=2.5).text("gravity").suffix(" x"));
        ui.add(Slider::new(&mut now.uphill, -20.0..=20.0).text("uphill").suffix(" deg"));
        ui.add(Slider::new(&mut now.friction, 0.05..=2.0).text("friction").suffix(" x"));
        ui.add(Slider::new(&mut now.strength, 0.2..=1.5).text("strength").suffix(" x"));
        ui.add(Slider::new(&mut now.push, 0.1..=3.0).text("push").suffix(" m/s"));
        ui.add(Slider::new(&mut now.ball, 0.2..=10.0).text("ball").suffix(" kg"));
        if ui.button("as usual").clicked() {
            now = Perturbations::default();
        }
    });
    // only a real change marks the resource as changed
    if now != *perturbations {
        *perturbations = now;
    }
    Ok(())
}
