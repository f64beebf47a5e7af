//! A camera that follows a ragdoll, smoothly, circles it, or flies.

use crate::look::obstacle::Obstacles;
use crate::look::orbit::{Motion, Sight};
use crate::look::quality::{HORIZON, Quality};
use crate::obstacle::Obstacle;
use crate::plugin::MarathonSystems;
use crate::ragdoll::{Anatomy, Episode, OwnGround, Part};
use crate::track::Track;
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::prelude::*;
use std::f32::consts::{FRAC_PI_2, FRAC_PI_3, PI};

/// Radians per second of [`CameraMode::Orbit`].
const ORBIT_SPEED: f32 = 0.25;
/// Lowest and highest angle above the ground, rad: -10 and 60 degrees.
const PITCH: [f32; 2] = [-0.1745, FRAC_PI_3];
/// The same for [`CameraMode::Free`].
const FREE_PITCH: f32 = 1.5;
/// Closest and farthest [`FollowCamera::zoom`], m.
const DISTANCE: [f32; 2] = [0.6, 60.0];
/// Growth of the field of view up to a full run, rad: 6 degrees.
const WIDER: f32 = 0.1047;
/// Distance of things that are still drawn, m.
const FAR: f32 = 1000.0;
/// Distances below which a target is not drawn, and from which on it is again, m: from inside, a body hides everything.
const HIDDEN: [f32; 2] = [1.0, 1.1];

/// Moves [`FollowCamera`]s. The app decides what input turns them: turn them before the fixed loop, in
/// [`RunFixedMainLoopSystems::BeforeFixedMainLoop`], so that the same frame shows it.
#[derive(Clone, Copy, Debug, Default)]
pub struct FollowCameraPlugin;

impl Plugin for FollowCameraPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<FollowCamera>();
        app.add_systems(
            RunFixedMainLoop,
            (follow, hide_near)
                .chain()
                .in_set(RunFixedMainLoopSystems::AfterFixedMainLoop)
                .after(MarathonSystems::Show),
        )
        .add_systems(PreUpdate, equip);
    }
}

/// Where a [`FollowCamera`] stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
pub enum CameraMode {
    /// Beside the runner, a little ahead.
    #[default]
    Side,
    /// Behind it. It turns slowly to where the target moves, but not around for one that comes towards it.
    Chase,
    /// Around it, slowly.
    Orbit,
    /// At the angle at which it was put.
    Held,
    /// Anywhere: it follows nothing. [`FollowCamera::fly`] moves it.
    Free,
}

impl CameraMode {
    /// The next one of those that a player chooses.
    pub fn next(self) -> Self {
        match self {
            CameraMode::Side | CameraMode::Held => CameraMode::Chase,
            CameraMode::Chase => CameraMode::Orbit,
            CameraMode::Orbit => CameraMode::Free,
            CameraMode::Free => CameraMode::Side,
        }
    }

    /// Its name on the screen and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            CameraMode::Side => "side",
            CameraMode::Chase => "chase",
            CameraMode::Orbit => "orbit",
            CameraMode::Held => "held",
            CameraMode::Free => "free",
        }
    }

    /// The angle about the vertical at which it looks, if it has one.
    fn yaw(self) -> Option<f32> {
        match self {
            CameraMode::Side => Some(-0.42),
            CameraMode::Chase => Some(-FRAC_PI_2),
            CameraMode::Orbit | CameraMode::Held | CameraMode::Free => None,
        }
    }

    /// The angles above the ground that it may look from, rad.
    fn pitch(self) -> [f32; 2] {
        if self == CameraMode::Free { [-FREE_PITCH, FREE_PITCH] } else { PITCH }
    }
}

/// A 3-D camera that follows a ragdoll. It does not enter the ground and the fixed shapes of the ragdoll's model.
#[derive(Component, Clone, Debug, Reflect)]
#[reflect(Component, Clone, Debug)]
#[require(Camera3d)]
pub struct FollowCamera {
    /// Whom it follows; without one it stands still.
    #[entities]
    pub target: Option<Entity>,
    /// From where.
    pub mode: CameraMode,
    /// Angle about the vertical, rad: 0 looks at a runner's right side.
    pub yaw: f32,
    /// Angle above the ground, rad.
    pub pitch: f32,
    /// Distance, m.
    pub distance: f32,
    /// The point that it looks at, m.
    pub focus: Vec3,
    /// How far ahead of whom it follows that is, m.
    pub ahead: f32,
    /// The angles and the distance it is on the way to. The distance is that of a target at rest.
    pub goal: [f32; 3],
    /// Vertical field of view while the target is at rest, rad. It opens by 6 degrees up to 4 m/s.
    pub field_of_view: f32,
    /// Whether it moves only as its target and the player move it: no turn of its own, and the same distance and field of view at
    /// every speed.
    pub reduced_motion: bool,
    /// Its state between frames.
    #[reflect(ignore)]
    motion: Motion,
    /// It is to get behind its target at once.
    align: bool,
    /// Way to fly in the next frame, in the camera's axes, m.
    flight: Vec3,
}

impl Default for FollowCamera {
    fn default() -> Self {
        FollowCamera {
            target: None,
            mode: CameraMode::Side,
            yaw: -0.42,
            pitch: 0.26,
            distance: 3.8,
            focus: Vec3::Y,
            ahead: 0.0,
            goal: [-0.42, 0.26, 3.8],
            field_of_view: FRAC_PI_3,
            reduced_motion: false,
            motion: Motion::default(),
            align: false,
            flight: Vec3::ZERO,
        }
    }
}

impl FollowCamera {
    /// A camera that follows an entity.
    pub fn following(target: Entity) -> Self {
        FollowCamera { target: Some(target), ..default() }
    }

    /// Turns it about what it follows, or about itself if it is [free](CameraMode::Free), rad. [`CameraMode::Side`] then no longer
    /// keeps to its side, and [`CameraMode::Chase`] waits before it turns by itself.
    pub fn turn(&mut self, yaw: f32, pitch: f32) {
        if self.mode == CameraMode::Side {
            self.mode = CameraMode::Held;
        }
        self.motion.wait();
        self.align = false;
        let [lowest, highest] = self.mode.pitch();
        self.goal[0] += yaw;
        self.goal[1] = (self.goal[1] + pitch).clamp(lowest, highest);
    }

    /// Moves it closer (below 1) or away.
    pub fn zoom(&mut self, factor: f32) {
        self.goal[2] = (self.goal[2] * factor).clamp(DISTANCE[0], DISTANCE[1]);
    }

    /// Moves a [free](CameraMode::Free) camera, m: to its right, up, and backward along its own axes.
    pub fn fly(&mut self, way: Vec3) {
        self.flight += way;
    }

    /// Looks from where a mode looks.
    pub fn set_mode(&mut self, mode: CameraMode) {
        if (self.mode == CameraMode::Free) != (mode == CameraMode::Free) {
            self.motion.cut();
        }
        self.mode = mode;
        self.align = mode == CameraMode::Chase;
        self.motion.go_on();
        if let Some(yaw) = mode.yaw() {
            self.face(yaw);
        }
        let [lowest, highest] = mode.pitch();
        self.goal[1] = self.goal[1].clamp(lowest, highest);
    }

    /// Turns to an angle, the short way round.
    fn face(&mut self, yaw: f32) {
        let turns = ((self.goal[0] - yaw) / (2.0 * PI)).round();
        self.goal[0] = yaw + turns * 2.0 * PI;
    }

    /// Makes the next frame jump to the target instead of moving there.
    pub fn jump(&mut self) {
        self.motion.cut();
        self.align = self.mode == CameraMode::Chase;
    }

    /// Direction from the point that it looks at to itself.
    fn away(&self) -> Vec3 {
        // the runner's right side is at +z
        Quat::from_rotation_y(self.yaw) * Quat::from_rotation_x(-self.pitch) * Vec3::Z
    }

    /// Takes the angles a part of the way to where they go, for a frame of `dt` seconds.
    fn turn_on(&mut self, dt: f32) {
        if self.mode == CameraMode::Orbit {
            self.goal[0] += ORBIT_SPEED * dt;
        }
        [self.yaw, self.pitch] = self.motion.eased([self.yaw, self.pitch], [self.goal[0], self.goal[1]], dt);
    }

    /// Follows what it sees. Returns where it is and where it looks from there.
    fn orbit(&mut self, sight: &Sight, obstacles: &Obstacles) -> Transform {
        if let Some(to) = self.motion.track(sight, self.focus, obstacles) {
            self.focus = to;
        }
        if self.mode == CameraMode::Chase {
            if let Some(heading) = sight.heading.filter(|_| self.align) {
                self.align = false;
                self.face(heading - FRAC_PI_2);
            }
            if !self.reduced_motion {
                self.goal[0] += self.motion.drift(self.goal[0], sight.dt);
            }
        }
        self.turn_on(sight.dt);
        let away = self.away();
        let wanted = self.goal[2] * if self.reduced_motion { 1.0 } else { self.motion.farther() };
        let (eye, distance) = self.motion.place(self.focus, away, wanted, obstacles, sight.dt);
        self.distance = distance;
        Transform::from_translation(eye).looking_to((self.focus - eye).normalize_or(-away), Vec3::Y)
    }

    /// Flies from a place.
    fn flown(&mut self, from: Vec3, obstacles: &Obstacles, dt: f32) -> Transform {
        self.turn_on(dt);
        let away = self.away();
        let place = Transform::from_translation(from).looking_to(-away, Vec3::Y);
        let to = from + place.rotation * std::mem::take(&mut self.flight);
        let place = place.with_translation(Motion::above_ground(to, obstacles));
        self.focus = place.translation - self.distance * away;
        place
    }
}

/// Gives new cameras what the quality wants.
fn equip(mut commands: Commands, quality: Option<Res<Quality>>, cameras: Query<Entity, Added<FollowCamera>>) {
    let quality = quality.map_or(Quality::Medium, |q| *q);
    for camera in &cameras {
        let fog = DistanceFog {
            color: Color::srgb_from_array(HORIZON),
            falloff: FogFalloff::Linear { start: 25.0, end: 260.0 },
            ..default()
        };
        commands.entity(camera).insert((fog, quality.msaa(), Tonemapping::AcesFitted));
    }
}

/// Places the cameras. The parts of the ragdolls are where this frame shows them.
#[expect(clippy::type_complexity, reason = "a query names what it reads")]
fn follow(
    time: Res<Time<Real>>,
    game: Res<Time<Virtual>>,
    mut cameras: Query<(&mut FollowCamera, &mut Transform, &mut Projection), Without<Part>>,
    ragdolls: Query<(&Anatomy, (&Transform, &Track), Option<&Episode>, Option<&OwnGround>), Without<FollowCamera>>,
    parts: Query<&Transform, (With<Part>, Without<FollowCamera>)>,
    app: Query<(&Obstacle, &GlobalTransform)>,
) {
    for (mut camera, mut transform, mut projection) in &mut cameras {
        let camera = &mut *camera;
        let target = camera.target.and_then(|target| Some((target, ragdolls.get(target).ok()?)));
        let part = |part: Entity| parts.get(part).ok().copied();
        let (mut obstacles, mut sight) = (Obstacles::default(), Sight::nothing(time.delta_secs()));
        if let Some((target, (anatomy, (ragdoll, track), episode, own))) = target {
            let along = |body: Entity| Some(track.own() * part(body)?);
            obstacles = Obstacles::of(anatomy, own, &track.place(), along);
            sight.target(target, anatomy, ragdoll, episode, part);
            sight.lead(track.direction() * camera.ahead);
        }
        obstacles.add(app.iter());
        sight.game_dt = game.delta_secs();
        *transform = match camera.mode {
            CameraMode::Free => camera.flown(transform.translation, &obstacles, sight.dt),
            _ => camera.orbit(&sight, &obstacles),
        };
        let wider = if camera.reduced_motion || camera.mode == CameraMode::Free { 0.0 } else { camera.motion.speed() };
        let fov = camera.field_of_view + WIDER * wider;
        if let Projection::Perspective(now) = &*projection
            && (now.fov, now.far) != (fov, FAR)
            && let Projection::Perspective(lens) = &mut *projection
        {
            (lens.fov, lens.far) = (fov, FAR);
        }
    }
}

/// On a ragdoll: a camera is so close that it is not drawn.
#[derive(Component)]
pub(crate) struct TooNear;

/// Hides the parts of ragdolls that a camera is about to enter, and shows them again.
fn hide_near(
    mut commands: Commands,
    cameras: Query<&FollowCamera>,
    ragdolls: Query<(Entity, &Anatomy, Has<TooNear>)>,
    mut parts: Query<&mut Visibility, With<Part>>,
) {
    for (ragdoll, anatomy, hidden) in &ragdolls {
        let limit = HIDDEN[usize::from(hidden)];
        let close = |camera: &FollowCamera| {
            camera.target == Some(ragdoll) && camera.mode != CameraMode::Free && camera.distance < limit
        };
        let hide = cameras.iter().any(close);
        if hide == hidden {
            continue;
        }
        let bodies = anatomy.parts.iter().zip(&anatomy.model.bodies).filter(|(_, body)| body.weld_id != 0);
        for (part, _) in bodies {
            if let Ok(mut visibility) = parts.get_mut(*part) {
                *visibility = if hide { Visibility::Hidden } else { Visibility::Inherited };
            }
        }
        match hide {
            true => commands.entity(ragdoll).insert(TooNear),
            false => commands.entity(ragdoll).remove::<TooNear>(),
        };
    }
}
