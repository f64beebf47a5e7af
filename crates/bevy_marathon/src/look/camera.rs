//! A camera that follows a ragdoll, smoothly, or circles it.

use crate::look::quality::{HORIZON, Quality};
use crate::plugin::MarathonSystems;
use crate::ragdoll::{Anatomy, Episode, Part};
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::prelude::*;
use std::f32::consts::{FRAC_PI_2, PI};

/// Seconds in which the camera makes up two thirds of the way, sideways and up; a gait's bounce must not shake it.
const EASE: [f32; 2] = [0.18, 0.55];
/// The same for turns and zoom.
const EASE_TURN: f32 = 0.15;
/// Speed of the target, m/s, up to which the camera looks ahead.
const FASTEST: f32 = 12.0;
/// Radians per second of [`CameraMode::Orbit`].
const ORBIT_SPEED: f32 = 0.25;
/// Largest turn rate with which [`CameraMode::Chase`] gets behind its target, rad/s; it is that at a right angle.
const CHASE_SPEED: f32 = 0.9;
/// Speed from which on it turns that fast, m/s; at rest it does not turn.
const CHASE_FROM: f32 = 1.0;
/// Seconds for which it does not turn by itself after [`FollowCamera::turn`].
const CHASE_PAUSE: f32 = 2.5;
/// Cosine of the tilt up to which a target counts as upright.
const UPRIGHT: f32 = 0.7;

/// Moves [`FollowCamera`]s. The app decides what input turns them.
#[derive(Clone, Copy, Debug, Default)]
pub struct FollowCameraPlugin;

impl Plugin for FollowCameraPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<FollowCamera>();
        app.add_systems(
            RunFixedMainLoop,
            follow.in_set(RunFixedMainLoopSystems::AfterFixedMainLoop).after(MarathonSystems::Show),
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
    /// Behind it. It turns slowly to where the target faces while the target moves, but not around for one that comes towards it.
    Chase,
    /// Around it, slowly.
    Orbit,
    /// Where it was put.
    Free,
}

impl CameraMode {
    /// The next one.
    pub fn next(self) -> Self {
        match self {
            CameraMode::Side => CameraMode::Chase,
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
            CameraMode::Free => "free",
        }
    }

    /// The angle about the vertical at which it looks, if it has one.
    fn yaw(self) -> Option<f32> {
        match self {
            CameraMode::Side => Some(-0.42),
            CameraMode::Chase => Some(-FRAC_PI_2),
            CameraMode::Orbit | CameraMode::Free => None,
        }
    }
}

/// A 3-D camera that follows a ragdoll.
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
    /// The angles and the distance it is on the way to.
    pub goal: [f32; 3],
    /// It has arrived somewhere before; the first time it jumps.
    settled: bool,
    /// It is to get behind its target at once.
    align: bool,
    /// Seconds until it turns by itself again.
    pause: f32,
}

impl Default for FollowCamera {
    fn default() -> Self {
        FollowCamera {
            target: None,
            mode: CameraMode::Side,
            yaw: -0.42,
            pitch: 0.2,
            distance: 5.0,
            focus: Vec3::Y,
            ahead: 0.0,
            goal: [-0.42, 0.2, 5.0],
            settled: false,
            align: false,
            pause: 0.0,
        }
    }
}

impl FollowCamera {
    /// A camera that follows an entity.
    pub fn following(target: Entity) -> Self {
        FollowCamera { target: Some(target), ..default() }
    }

    /// Turns it about what it follows. [`CameraMode::Side`] then no longer keeps to its side, and [`CameraMode::Chase`] waits before
    /// it turns by itself.
    pub fn turn(&mut self, yaw: f32, pitch: f32) {
        if self.mode == CameraMode::Side {
            self.mode = CameraMode::Free;
        }
        self.pause = CHASE_PAUSE;
        self.goal[0] += yaw;
        self.goal[1] = (self.goal[1] + pitch).clamp(-0.05, 1.45);
    }

    /// Moves it closer (below 1) or away.
    pub fn zoom(&mut self, factor: f32) {
        self.goal[2] = (self.goal[2] * factor).clamp(0.8, 60.0);
    }

    /// Looks from where a mode looks.
    pub fn set_mode(&mut self, mode: CameraMode) {
        self.mode = mode;
        (self.align, self.pause) = (mode == CameraMode::Chase, 0.0);
        if let Some(yaw) = mode.yaw() {
            self.face(yaw);
        }
    }

    /// Turns to an angle, the short way round.
    fn face(&mut self, yaw: f32) {
        let turns = ((self.goal[0] - yaw) / (2.0 * PI)).round();
        self.goal[0] = yaw + turns * 2.0 * PI;
    }

    /// Gets behind a target that faces an angle about the vertical, rad, and moves at a speed, m/s.
    fn chase(&mut self, heading: f32, speed: f32, dt: f32) {
        let yaw = heading - FRAC_PI_2;
        if self.align {
            self.align = false;
            self.face(yaw);
        }
        self.pause = (self.pause - dt).max(0.0);
        if self.pause == 0.0 {
            // one that comes towards it is seen from the front
            self.goal[0] += CHASE_SPEED * (yaw - self.goal[0]).sin() * (speed / CHASE_FROM).min(1.0) * dt;
        }
    }

    /// Makes the next frame jump to the target instead of moving there.
    pub fn jump(&mut self) {
        self.settled = false;
        self.align = self.mode == CameraMode::Chase;
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

fn follow(
    time: Res<Time<Real>>,
    game: Res<Time<Virtual>>,
    mut cameras: Query<(&mut FollowCamera, &mut Transform, &mut Projection), Without<Part>>,
    ragdolls: Query<(&Anatomy, &Transform, Option<&Episode>), Without<FollowCamera>>,
    parts: Query<&Transform, (With<Part>, Without<FollowCamera>)>,
) {
    // the picture's own time: one looks about while the game's stands still
    let dt = time.delta_secs();
    let pace = if dt > 0.0 { game.delta_secs() / dt } else { 1.0 };
    let ease = |seconds: f32| 1.0 - (-dt / seconds).exp();
    for (mut camera, mut transform, mut projection) in &mut cameras {
        if let Projection::Perspective(p) = &mut *projection
            && p.far < 1000.0
        {
            (p.far, p.fov) = (1000.0, 0.75);
        }
        if let Some((anatomy, track, episode)) = camera.target.and_then(|t| ragdolls.get(t).ok()) {
            let root = anatomy.model.joints.first().map_or(1, |j| j.body);
            if let Some(part) = anatomy.parts.get(root).and_then(|p| parts.get(*p).ok()) {
                // what eases after a runner stays behind by its speed times the easing
                let ahead = episode.map_or(0.0, |e| (e.speed * pace).clamp(-FASTEST, FASTEST) * EASE[0]);
                let to = track.transform_point(part.translation) + track.rotation * (Vec3::X * (ahead + camera.ahead));
                let jump = !camera.settled || camera.focus.distance(to) > 12.0;
                let [side, up] = if jump { [1.0; 2] } else { EASE.map(ease) };
                let focus = camera.focus;
                camera.focus = focus + (to - focus) * Vec3::new(side, up, side);
                camera.settled = true;
                let facing = track.rotation * part.rotation;
                // in a flip, or on the ground, a character faces nowhere
                if camera.mode == CameraMode::Chase && (facing * Vec3::Y).y > UPRIGHT {
                    let forward = facing * Vec3::X;
                    let [ahead, left] = episode.map_or([0.0; 2], |e| e.own_velocity);
                    camera.chase((-forward.z).atan2(forward.x), ahead.hypot(left) * pace, dt);
                }
            }
        }
        if camera.mode == CameraMode::Orbit {
            camera.goal[0] += ORBIT_SPEED * dt;
        }
        let [yaw, pitch, distance] = camera.goal;
        let share = ease(EASE_TURN);
        camera.yaw += (yaw - camera.yaw) * share;
        camera.pitch += (pitch - camera.pitch) * share;
        camera.distance += (distance - camera.distance) * share;
        // the runner's right side is at +z
        let turn = Quat::from_rotation_y(camera.yaw) * Quat::from_rotation_x(-camera.pitch);
        let mut eye = camera.focus + turn * (Vec3::Z * camera.distance);
        eye.y = eye.y.max(0.08);
        *transform = Transform::from_translation(eye).looking_at(camera.focus, Vec3::Y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A camera behind a runner along +x.
    fn chasing() -> FollowCamera {
        let mut camera = FollowCamera::default();
        camera.set_mode(CameraMode::Chase);
        camera.chase(0.0, 0.0, 0.0);
        camera
    }

    #[test]
    fn it_gets_behind_a_target_that_moves() {
        let mut camera = chasing();
        assert_eq!(camera.goal[0], -FRAC_PI_2);
        // a quarter turn to the left, at rest
        (0..600).for_each(|_| camera.chase(FRAC_PI_2, 0.0, 1.0 / 60.0));
        assert_eq!(camera.goal[0], -FRAC_PI_2);
        (0..600).for_each(|_| camera.chase(FRAC_PI_2, 2.0, 1.0 / 60.0));
        assert!(camera.goal[0].abs() < 0.01, "{}", camera.goal[0]);
    }

    #[test]
    fn it_does_not_turn_around_for_one_that_comes_towards_it() {
        let mut camera = chasing();
        (0..120).for_each(|_| camera.chase(PI, 2.0, 1.0 / 60.0));
        assert!((camera.goal[0] + FRAC_PI_2).abs() < 0.01, "{}", camera.goal[0]);
    }

    #[test]
    fn a_hand_on_the_camera_goes_before() {
        let mut camera = chasing();
        camera.turn(1.0, 0.0);
        assert_eq!(camera.mode, CameraMode::Chase);
        let held = camera.goal[0];
        (0..120).for_each(|_| camera.chase(0.0, 2.0, 1.0 / 60.0));
        assert_eq!(camera.goal[0], held);
        (0..600).for_each(|_| camera.chase(0.0, 2.0, 1.0 / 60.0));
        assert!((camera.goal[0] + FRAC_PI_2).abs() < 0.02, "{}", camera.goal[0]);
    }
}
