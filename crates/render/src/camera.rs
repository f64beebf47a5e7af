//! The camera, and a camera that follows a character.

use glam::DVec3;

use crate::scene::{Frame, Scene};

/// A pinhole camera, z up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Position, m.
    pub eye: [f64; 3],
    /// Point in the middle of the picture, m.
    pub target: [f64; 3],
    /// Vertical field of view, degrees.
    pub fovy: f64,
}

/// An orthonormal view frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Basis {
    pub eye: DVec3,
    pub right: DVec3,
    pub up: DVec3,
    pub forward: DVec3,
    /// Tangent of half the vertical field of view.
    pub slope: f64,
}

impl Camera {
    pub(crate) fn basis(&self) -> Basis {
        let eye = DVec3::from_array(self.eye);
        let forward = (DVec3::from_array(self.target) - eye).try_normalize().unwrap_or(DVec3::Y);
        // looking straight down or up, the picture's top points along +y
        let right = forward.cross(DVec3::Z).try_normalize().unwrap_or(DVec3::X);
        let up = right.cross(forward);
        let slope = half_angle_slope(self.fovy);
        Basis { eye, right, up, forward, slope }
    }
}

/// `tan(fovy / 2)` for `fovy` in degrees, clamped to possible angles.
fn half_angle_slope(fovy: f64) -> f64 {
    libm::tan(fovy.clamp(1.0, 150.0).to_radians() / 2.0)
}

/// Follows the agents along x from the side, slightly elevated, and along y if they stray far from their start.
///
/// The tracker is a critically damped second-order filter on position and velocity. It ignores the bobbing of a gait
/// and has no lag at constant speed.
#[derive(Clone, Debug)]
pub struct Follow {
    /// Vertical field of view, degrees.
    pub fovy: f64,
    /// Angle above the horizon, degrees.
    pub elevation: f64,
    /// Angle about z, degrees: 0 looks along +y (x to the right), positive angles turn the camera ahead of the
    /// character.
    pub azimuth: f64,
    /// Factor on the distance. Below 1 is closer.
    pub zoom: f64,
    aspect: f64,
    radius: f64,
    row: f64,
    /// First position of the agents along y, m.
    first: Option<f64>,
    state: Option<State>,
}

#[derive(Clone, Copy, Debug)]
struct State {
    x: Tracker,
    /// Distance of the agents from their first position, beyond [`STRAYED`], m.
    y: Tracker,
    z: Tracker,
    spread: Tracker,
}

/// Distance along y within which the camera does not move, m: characters sway.
const STRAYED: f64 = 1.0;

#[derive(Clone, Copy, Debug)]
struct Tracker {
    value: f64,
    rate: f64,
    /// Target at the end of the last step.
    target: f64,
}

impl Tracker {
    fn start(value: f64) -> Self {
        Self { value, rate: 0.0, target: value }
    }

    /// Moves toward `target` with natural frequency `omega`, 1/s.
    fn advance(&mut self, target: f64, omega: f64, dt: f64) {
        // explicit steps are stable and smooth for omega * h well below 1
        let steps = (omega * dt / 0.1).ceil().clamp(1.0, 1000.0);
        let h = dt / steps;
        for i in 0..steps as usize {
            // the target moves evenly within the step; a fixed target would pull the camera ahead
            let error = self.target + (target - self.target) * (i as f64 / steps) - self.value;
            self.value += h * (self.rate + 2.0 * omega * error);
            self.rate += h * omega * omega * error;
        }
        self.target = target;
    }
}

impl Follow {
    /// Creates a camera for frames of `agents` agents and pictures of `width` x `height` pixels.
    pub fn new(scene: &Scene, agents: usize, width: usize, height: usize) -> Self {
        let row = scene.spacing().abs() * agents.saturating_sub(1) as f64;
        // look down more steeply on a row, so that the front does not hide the back
        let elevation = if row > 0.0 { 20.0 } else { 10.0 };
        Self {
            fovy: 32.0,
            elevation,
            azimuth: 9.0,
            zoom: 1.0,
            aspect: width.max(1) as f64 / height.max(1) as f64,
            radius: scene.radius(),
            row,
            first: None,
            state: None,
        }
    }

    /// The camera for `frame`, `dt` seconds after the previous one.
    ///
    /// The first call jumps to the agents. So does a call after more than a second, or back in time.
    pub fn update(&mut self, frame: &Frame, dt: f64) -> Camera {
        let agents = frame.agents();
        let (mut low, mut high, mut y, mut z) = (f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0);
        for agent in agents {
            low = low.min(agent.com[0]);
            high = high.max(agent.com[0]);
            y += agent.com[1] / agents.len() as f64;
            z += agent.com[2] / agents.len() as f64;
        }
        if agents.is_empty() {
            (low, high, z) = (0.0, 0.0, self.radius);
        }
        let (x, spread) = (0.5 * (low + high), high - low);
        let strayed = if agents.is_empty() { 0.0 } else { y - *self.first.get_or_insert(y) };
        let aside = (strayed.abs() - STRAYED).max(0.0).copysign(strayed);

        if !(0.0..=1.0).contains(&dt) {
            self.state = None;
        }
        let state = match &mut self.state {
            Some(state) => {
                state.x.advance(x, 4.0, dt);
                state.y.advance(aside, 4.0, dt);
                state.z.advance(z, 0.8, dt);
                state.spread.advance(spread, 1.0, dt);
                *state
            }
            None => {
                let [x, y, z, spread] = [x, aside, z, spread].map(Tracker::start);
                *self.state.insert(State { x, y, z, spread })
            }
        };
        self.look([state.x.value, state.y.value, state.z.value], state.spread.value)
    }

    fn look(&self, [x, y, z]: [f64; 3], spread: f64) -> Camera {
        // far enough that the agent fills about two thirds of the height, and the group fits the width
        let slope = half_angle_slope(self.fovy);
        let high = 1.5 * self.radius / slope;
        let wide = (0.5 * spread + 1.4 * self.radius) / (slope * self.aspect);
        let distance = self.zoom * high.max(wide.min(4.0 * high)) + 0.75 * self.row;

        let (elevation, azimuth) = (self.elevation.to_radians(), self.azimuth.to_radians());
        let flat = distance * libm::cos(elevation);
        let target = [x, 0.4 * self.row + y, z - 0.05 * self.radius];
        let eye = [
            target[0] + flat * libm::sin(azimuth),
            target[1] - flat * libm::cos(azimuth),
            target[2] + distance * libm::sin(elevation),
        ];
        Camera { eye, target, fovy: self.fovy }
    }
}
