//! Reference gaits for every speed, from standing through walking to running.
//!
//! # Mechanism
//!
//! The joint angles of the walking and the running clip are Fourier series over the gait cycle. Both series start at
//! the same event: the right hip is farthest ahead of the left one. Interpolating the coefficients therefore gives a
//! valid gait in between. The stride length is interpolated too, and speed divided by stride length gives the cycle
//! frequency. Below walking speed, the amplitudes of the walk shrink toward the standing pose.
//!
//! No clip steps aside or turns on the spot, so [`Footwork`] edits the gait. Shorter strides turn a walk into a march on
//! the spot. Hips that swing sideways or twist keep the standing foot in place while the pelvis moves.

use std::f64::consts::TAU;
use std::sync::{Arc, LazyLock};

use marathon_motion::Clip;
use marathon_physics::lanes::Real;

use super::body::{self, FIRST_QPOS, JOINTS};
use super::clips::{self, STAND};

/// Harmonics of a series.
const HARMONICS: usize = 6;
/// Coefficients of a series: the mean, then cosine and sine of each harmonic.
const TERMS: usize = 1 + 2 * HARMONICS;
/// Samples per cycle that the series are computed from.
const SAMPLES: usize = 64;
/// Hinges that swing and twist the legs, as indices into [`JOINTS`].
const RIGHT_HIP_X: usize = body::hinge("right_hip_x");
const RIGHT_HIP_Z: usize = body::hinge("right_hip_z");
const LEFT_HIP_X: usize = body::hinge("left_hip_x");
const LEFT_HIP_Z: usize = body::hinge("left_hip_z");
/// Length of the leg that swings sideways, from the hip to the sole, m.
const LEG: f64 = 0.81;
/// How much wider the feet stand in a step to a side, as a fraction of their swing. Without it, they would cross.
const WIDENING: f64 = 0.6;
/// Share of a knee's flexion that the hip takes so that the foot stays below it. The ankle takes the rest. From the lengths
/// of shin and thigh, 0.36 and 0.39 m.
const HIP_PER_KNEE: f64 = 0.48;

/// Lowest speed of a walk, and of a run above it, m/s.
const LEAST_SPEED: f64 = 0.2;

/// A gait cycle of a clip.
#[derive(Debug)]
struct Stride {
    /// Series of each hinge, in the order of `qpos`.
    series: [[f64; TERMS]; JOINTS.len()],
    /// Stride length: distance per cycle, m.
    length: f64,
    /// Speed, m/s.
    speed: f64,
}

/// Gaits for all speeds.
#[derive(Debug)]
pub struct Gaits {
    /// Angles of the standing pose, rad.
    stand: [f64; JOINTS.len()],
    walk: Stride,
    run: Stride,
    /// Walking on the spot.
    march: Stride,
}

/// How a gait differs from going straight on.
#[derive(Clone, Copy, Debug)]
pub struct Footwork<T> {
    /// Stride length as a fraction of that of the gait's speed, 0 to 1.
    stride: T,
    /// Amplitude with which the hips swing the feet sideways, rad.
    swing: T,
    /// Amplitude with which the hips twist the feet, rad.
    twist: T,
}

impl<T: Real> Footwork<T> {
    /// Straight on with full strides.
    #[inline(always)]
    pub fn straight() -> Self {
        Footwork { stride: T::lit(1.0), swing: T::zero(), twist: T::zero() }
    }

    /// Strides of a fraction of their length, a velocity to the left, m/s, and a turn rate, rad/s, at a number of cycles per
    /// second. A foot that swings with amplitude `a` moves with `2 pi frequency a` in the middle of its stance.
    #[inline(always)]
    pub fn new(stride: T, left: T, turn: T, frequency: T) -> Self {
        let per_rate = T::lit(1.0 / TAU).div(frequency);
        Footwork { stride, swing: left * per_rate * T::lit(1.0 / LEG), twist: turn * per_rate }
    }
}

/// A phase of the gait at a speed, for each lane.
pub struct Moment<T> {
    /// Cosine and sine of each harmonic.
    waves: [T; 2 * HARMONICS],
    /// Blending weights of standing, walking, running and marching.
    shares: [T; 4],
    /// Abduction added to both hips, rad.
    aside: T,
    /// Inward rotation added to both hips, rad.
    twist: T,
}

/// The gaits of the clips that ship with the crate.
pub fn gaits() -> &'static Arc<Gaits> {
    static GAITS: LazyLock<Arc<Gaits>> =
        LazyLock::new(|| Gaits::of(&shipped("walk"), &shipped("run")).expect("the clips are gaits").into());
    &GAITS
}

/// A clip that comes with the crate.
fn shipped(name: &'static str) -> Arc<Clip> {
    clips::shipped(name).expect("the clip comes with the crate")
}

/// Phase of a looping clip at which the right hip is farthest ahead of the left one.
pub fn beginning(clip: &Clip) -> f64 {
    let [right, left] = ["right_hip_y", "left_hip_y"].map(|name| series(clip, 0.0, body::hinge(name)));
    let [cos, sin] = [1, 2].map(|i| right[i] - left[i]);
    // a standing clip has no first harmonic
    if cos.hypot(sin) < 0.05 { 0.0 } else { libm::atan2(sin, cos) / TAU }
}

/// The Fourier series of a hinge over a clip's cycle that starts at the phase `from`.
fn series(clip: &Clip, from: f64, hinge: usize) -> [f64; TERMS] {
    let mut pose = vec![0.0; clip.layout().nq()];
    let mut out = [0.0; TERMS];
    for sample in 0..SAMPLES {
        let share = sample as f64 / SAMPLES as f64;
        clip.qpos((share + from).rem_euclid(1.0) * clip.duration(), &mut pose);
        let angle = pose[FIRST_QPOS + hinge] / SAMPLES as f64;
        out[0] += angle;
        for k in 1..=HARMONICS {
            let wave = TAU * k as f64 * share;
            out[2 * k - 1] += 2.0 * angle * libm::cos(wave);
            out[2 * k] += 2.0 * angle * libm::sin(wave);
        }
    }
    out
}

impl Stride {
    fn of(clip: &Clip) -> Result<Stride, String> {
        if clip.layout() != shipped(STAND).layout() {
            return Err("a clip of another character, expected one of Marathon Man".into());
        }
        let [x, y] = clip.cycle().ok_or("a clip that ends, expected one that loops")?.pos;
        let (length, seconds) = (x.hypot(y), clip.duration());
        if length < LEAST_SPEED * seconds {
            return Err(format!("a clip of {:.2} m/s, expected at least {LEAST_SPEED} m/s", length / seconds));
        }
        let from = beginning(clip);
        let series = std::array::from_fn(|hinge| series(clip, from, hinge));
        Ok(Stride { series, length, speed: length / seconds })
    }

    /// The gait with the same lift of the feet and no stride: hips and ankles only make up for the knees.
    fn on_the_spot(&self) -> Stride {
        let mut series = self.series;
        for (hinge, joint) in JOINTS.iter().enumerate() {
            // the sway of trunk and legs from side to side stays
            if joint.name.ends_with("knee") || joint.name.ends_with("_x") {
                continue;
            }
            series[hinge][1..].fill(0.0);
            let from_knee = match joint.name {
                name if name.ends_with("hip_y") => -HIP_PER_KNEE,
                name if name.ends_with("ankle_y") => HIP_PER_KNEE - 1.0,
                _ => continue,
            };
            let knee = if joint.name.starts_with("right") { "right_knee" } else { "left_knee" };
            let knee = self.series[body::hinge(knee)];
            for (out, x) in series[hinge][1..].iter_mut().zip(&knee[1..]) {
                *out = from_knee * x;
            }
        }
        Stride { series, length: 0.0, ..*self }
    }
}

impl Gaits {
    /// The gaits between a walk and a run.
    ///
    /// # Errors
    /// If a clip does not loop or move on, or the run is not faster than the walk.
    pub fn of(walk: &Clip, run: &Clip) -> Result<Self, String> {
        let standing = shipped(STAND);
        let mut pose = vec![0.0; standing.layout().nq()];
        standing.qpos(0.0, &mut pose);
        let stand = std::array::from_fn(|i| pose[FIRST_QPOS + i]);
        let [walk, run] = [(walk, "walk"), (run, "run")].map(|(clip, name)| {
            Stride::of(clip).map_err(|error| format!("option {name} is '{}', {error}", clip.about().name))
        });
        let (walk, run) = (walk?, run?);
        if run.speed < walk.speed + LEAST_SPEED {
            let speeds = format!("{:.2} and {:.2} m/s", walk.speed, run.speed);
            return Err(format!(
                "options walk and run are clips of {speeds}, expected a run that is faster than the walk"
            ));
        }
        Ok(Gaits { stand, march: walk.on_the_spot(), walk, run })
    }

    /// Blending weights of standing, walking and running at a speed.
    #[inline(always)]
    fn shares<T: Real>(&self, speed: T) -> [T; 3] {
        let (walk, run) = (self.walk.speed, self.run.speed);
        let (zero, one) = (T::zero(), T::lit(1.0));
        let moving = (speed * T::lit(1.0 / walk)).min(one);
        let running = ((speed - T::lit(walk)) * T::lit(1.0 / (run - walk))).max(zero).min(one);
        [one - moving, moving - running, running]
    }

    /// Cycles per second at a speed, m/s. Below walking speed, the frequency is that of the walk. Above it, the stride
    /// length is between those of walk and run.
    #[inline(always)]
    pub fn frequency<T: Real>(&self, speed: T) -> T {
        let [_, _, running] = self.shares(speed);
        let length = running.mul_add(T::lit(self.run.length - self.walk.length), T::lit(self.walk.length));
        speed.max(T::lit(self.walk.speed)).div(length)
    }

    /// The gait at a phase (0 to 1) and a speed, m/s, with its footwork. Angles are extrapolated by `lead` seconds at their
    /// velocities.
    #[inline(always)]
    pub fn moment<T: Real>(&self, phase: T, speed: T, footwork: Footwork<T>, lead: f64) -> Moment<T> {
        let (sin, cos) = (phase * T::lit(TAU)).sin_cos();
        let lead = self.frequency(speed) * T::lit(TAU * lead);
        let mut waves = [T::zero(); 2 * HARMONICS];
        let (mut c, mut s) = (cos, sin);
        for k in 1..=HARMONICS {
            let turn = lead * T::lit(k as f64);
            waves[2 * k - 2] = turn.neg_mul_add(s, c);
            waves[2 * k - 1] = turn.mul_add(c, s);
            (c, s) = (sin.neg_mul_add(s, c * cos), sin.mul_add(c, s * cos));
        }
        let [stand, walk, run] = self.shares(speed);
        let shares =
            [stand, walk * footwork.stride, run * footwork.stride, (walk + run) * (T::lit(1.0) - footwork.stride)];
        // what is abduction of one leg moves the other one to the same side
        let aside = footwork.swing.abs().mul_add(T::lit(WIDENING), -(footwork.swing * waves[0]));
        Moment { waves, shares, aside, twist: footwork.twist * waves[0] }
    }

    /// Angle of a hinge, rad.
    #[inline(always)]
    pub fn angle<T: Real>(&self, at: &Moment<T>, hinge: usize) -> T {
        let [stand, walk, run, march] = at.shares;
        let [w, r, m] = [&self.walk, &self.run, &self.march].map(|stride| &stride.series[hinge]);
        let mixed = |i: usize| march.mul_add(T::lit(m[i]), run.mul_add(T::lit(r[i]), walk * T::lit(w[i])));
        let mut angle = stand.mul_add(T::lit(self.stand[hinge]), mixed(0));
        for (i, wave) in at.waves.iter().enumerate() {
            angle = mixed(1 + i).mul_add(*wave, angle);
        }
        match hinge {
            RIGHT_HIP_X | LEFT_HIP_X => angle + at.aside,
            RIGHT_HIP_Z | LEFT_HIP_Z => angle + at.twist,
            _ => angle,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At the clips' speeds, the gaits match the clips up to the error of six harmonics.
    #[test]
    fn the_walk_and_the_run_are_those_of_the_clips() {
        let gaits = gaits();
        for (name, stride) in [("walk", &gaits.walk), ("run", &gaits.run)] {
            let clip = clips::shipped(name).unwrap();
            let from = beginning(&clip);
            let (mut pose, mut velocity) = (vec![0.0; clip.layout().nq()], vec![0.0; clip.layout().nv()]);
            assert!((gaits.frequency(stride.speed) * clip.duration() - 1.0).abs() < 1e-9);
            let mut worst = [0.0f64; 2];
            for i in 0..50 {
                let phase = f64::from(i) / 50.0;
                let time = (phase + from).rem_euclid(1.0) * clip.duration();
                clip.qpos(time, &mut pose);
                clip.qvel(time, &mut velocity);
                let [now, soon] = [0.0, 0.1].map(|lead| gaits.moment(phase, stride.speed, Footwork::straight(), lead));
                for hinge in 0..JOINTS.len() {
                    let angle = gaits.angle(&now, hinge);
                    worst[0] = worst[0].max((angle - pose[FIRST_QPOS + hinge]).abs());
                    let led = pose[FIRST_QPOS + hinge] + 0.1 * velocity[FIRST_QPOS - 1 + hinge];
                    worst[1] = worst[1].max((gaits.angle(&soon, hinge) - led).abs());
                }
            }
            // six harmonics cannot follow a heel strike
            assert!(worst[0] < 0.08 && worst[1] < 0.45, "{name}: {worst:?} rad");
        }
    }

    /// Gaits change continuously with the speed, and the gait at 0 m/s is the standing pose.
    #[test]
    fn gaits_change_evenly_with_the_speed() {
        let gaits = gaits();
        for (hinge, stand) in gaits.stand.iter().enumerate() {
            assert!((gaits.angle(&gaits.moment(0.3, 0.0, Footwork::straight(), 0.1), hinge) - stand).abs() < 1e-12);
        }
        let mut last = (0.0, [0.0; JOINTS.len()]);
        for step in 0..=320 {
            let speed = f64::from(step) * 0.01;
            let at = gaits.moment(0.1, speed, Footwork::straight(), 0.0);
            let pose: [f64; JOINTS.len()] = std::array::from_fn(|hinge| gaits.angle(&at, hinge));
            let frequency = gaits.frequency(speed);
            if step > 0 {
                assert!((frequency - last.0).abs() < 0.02 && frequency >= last.0 - 1e-12, "{speed} m/s");
                assert!(pose.iter().zip(&last.1).all(|(a, b)| (a - b).abs() < 0.03), "{speed} m/s");
            }
            last = (frequency, pose);
        }
    }

    /// Ahead and up from a hip to its ankle in the hip's axes, m, and the pitch of the sole against the trunk, rad.
    fn ankle(pose: &[f64], side: &str) -> [f64; 3] {
        let [hip, knee, ankle] = ["hip_y", "knee", "ankle_y"].map(|name| pose[body::hinge(&format!("{side}_{name}"))]);
        let (thigh, shin) = (0.39, 0.36);
        let at = |f: fn(f64) -> f64| thigh * f(hip) + shin * f(hip + knee);
        [at(f64::sin), -at(f64::cos), hip + knee + ankle]
    }

    /// A pose of the gait at a phase.
    fn pose(phase: f64, speed: f64, footwork: Footwork<f64>) -> Vec<f64> {
        let at = gaits().moment(phase, speed, footwork, 0.0);
        (0..JOINTS.len()).map(|hinge| gaits().angle(&at, hinge)).collect()
    }

    /// Without strides, the feet rise and come down in the same place, level.
    #[test]
    fn a_march_lifts_the_feet_on_the_spot() {
        let range = |stride: f64, of: usize| {
            let places = (0..64).map(|i| {
                let footwork = Footwork::new(stride, 0.0, 0.0, 1.0);
                ankle(&pose(f64::from(i) / 64.0, gaits().walk.speed, footwork), "right")[of]
            });
            places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
        };
        let size = |stride, of| range(stride, of).into_iter().fold(0.0, |low, high| high - low);
        assert!(size(0.0, 0) < 0.06 && size(1.0, 0) > 0.4, "{} m, {} m", size(0.0, 0), size(1.0, 0));
        assert!(size(0.0, 1) > 0.06, "{} m", size(0.0, 1));
        assert!(size(0.0, 2) < 0.1, "{} rad", size(0.0, 2));
    }

    /// In the middle of a stance, the foot moves under the pelvis as fast as the pelvis moves and turns, and the feet never cross.
    #[test]
    fn a_standing_foot_keeps_its_place_in_side_steps_and_turns() {
        let (speed, step) = (1.0, 1e-4);
        for frequency in [0.8, 1.2] {
            let footwork = Footwork::new(0.0, 0.5, 1.0, frequency);
            // the right foot stands in the first half of the cycle, the left one in the second
            for (side, middle, sign) in [("right", 0.25, 1.0), ("left", 0.75, -1.0)] {
                let rate = |name: &str| {
                    let hinge = body::hinge(&format!("{side}_{name}"));
                    let off = |phase| {
                        pose(phase, speed, footwork)[hinge]
                            - pose(phase, speed, Footwork::new(0.0, 0.0, 0.0, 1.0))[hinge]
                    };
                    (off(middle + step) - off(middle - step)) / (2.0 * step) * frequency
                };
                // abduction of the right leg leads to the right, its inward rotation to the left
                assert!((sign * rate("hip_x") * LEG - 0.5).abs() < 1e-3, "{side}: {} m/s", rate("hip_x") * LEG);
                assert!((sign * rate("hip_z") + 1.0).abs() < 1e-3, "{side}: {} rad/s", rate("hip_z"));
            }
        }
        let footwork = Footwork::new(0.0, 0.8, 0.0, 1.1);
        for i in 0..64 {
            let pose = pose(f64::from(i) / 64.0, speed, footwork);
            let [right, left] = ["right_hip_x", "left_hip_x"].map(|name| pose[body::hinge(name)]);
            assert!(0.18 + (right + left) * LEG > 0.0, "the feet cross: {right} rad, {left} rad");
        }
    }
}
