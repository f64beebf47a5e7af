//! Reference gaits for every speed, from standing through walking to running.
//!
//! # Mechanism
//!
//! The joint angles of the walking and the running clip are Fourier series over the gait cycle. Both series start at
//! the same event: the right hip is farthest ahead of the left one. Interpolating the coefficients therefore gives a
//! valid gait in between. The stride length is interpolated too, and speed divided by stride length gives the cycle
//! frequency. Below walking speed, the amplitudes of the walk shrink toward the standing pose.

use std::f64::consts::TAU;
use std::sync::LazyLock;

use marathon_motion::Clip;
use marathon_physics::lanes::Real;

use super::body::{FIRST_QPOS, JOINTS};
use super::clips::{self, STAND};

/// Harmonics of a series.
const HARMONICS: usize = 6;
/// Coefficients of a series: the mean, then cosine and sine of each harmonic.
const TERMS: usize = 1 + 2 * HARMONICS;
/// Samples per cycle that the series are computed from.
const SAMPLES: usize = 64;

/// A gait cycle of a clip.
struct Stride {
    /// Series of each hinge, in the order of `qpos`.
    series: [[f64; TERMS]; JOINTS.len()],
    /// Stride length: distance per cycle, m.
    length: f64,
    /// Speed, m/s.
    speed: f64,
}

/// Gaits for all speeds.
pub struct Gaits {
    /// Angles of the standing pose, rad.
    stand: [f64; JOINTS.len()],
    walk: Stride,
    run: Stride,
}

/// A phase of the gait at a speed, for each lane.
pub struct Moment<T> {
    /// Cosine and sine of each harmonic.
    waves: [T; 2 * HARMONICS],
    /// Blending weights of standing, walking and running.
    shares: [T; 3],
}

/// The gaits of the clips that ship with the crate.
pub fn gaits() -> &'static Gaits {
    static GAITS: LazyLock<Gaits> = LazyLock::new(|| {
        let clip = |name| clips::shipped(name).expect("the clip comes with the crate");
        let mut pose = vec![0.0; clip(STAND).layout().nq()];
        clip(STAND).qpos(0.0, &mut pose);
        let stand = std::array::from_fn(|i| pose[FIRST_QPOS + i]);
        Gaits { stand, walk: Stride::of(&clip("walk")), run: Stride::of(&clip("run")) }
    });
    &GAITS
}

/// Phase of a looping clip at which the right hip is farthest ahead of the left one.
pub fn beginning(clip: &Clip) -> f64 {
    let hip = |name: &str| JOINTS.iter().position(|joint| joint.name == name).expect("the character has hips");
    let (right, left) = (series(clip, 0.0, hip("right_hip_y")), series(clip, 0.0, hip("left_hip_y")));
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
    fn of(clip: &Clip) -> Stride {
        let from = beginning(clip);
        let [x, y] = clip.cycle().expect("a gait loops").pos;
        let length = x.hypot(y);
        let series = std::array::from_fn(|hinge| series(clip, from, hinge));
        Stride { series, length, speed: length / clip.duration() }
    }
}

impl Gaits {
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

    /// The gait at a phase (0 to 1) and a speed, m/s. Angles are extrapolated by `lead` seconds at their velocities.
    #[inline(always)]
    pub fn moment<T: Real>(&self, phase: T, speed: T, lead: f64) -> Moment<T> {
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
        Moment { waves, shares: self.shares(speed) }
    }

    /// Angle of a hinge, rad.
    #[inline(always)]
    pub fn angle<T: Real>(&self, at: &Moment<T>, hinge: usize) -> T {
        let [stand, walk, run] = at.shares;
        let (w, r) = (&self.walk.series[hinge], &self.run.series[hinge]);
        let mixed = |i: usize| run.mul_add(T::lit(r[i]), walk * T::lit(w[i]));
        let mut angle = stand.mul_add(T::lit(self.stand[hinge]), mixed(0));
        for (i, wave) in at.waves.iter().enumerate() {
            angle = mixed(1 + i).mul_add(*wave, angle);
        }
        angle
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
                let (now, soon) = (gaits.moment(phase, stride.speed, 0.0), gaits.moment(phase, stride.speed, 0.1));
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
            assert!((gaits.angle(&gaits.moment(0.3, 0.0, 0.1), hinge) - stand).abs() < 1e-12);
        }
        let mut last = (0.0, [0.0; JOINTS.len()]);
        for step in 0..=320 {
            let speed = f64::from(step) * 0.01;
            let at = gaits.moment(0.1, speed, 0.0);
            let pose: [f64; JOINTS.len()] = std::array::from_fn(|hinge| gaits.angle(&at, hinge));
            let frequency = gaits.frequency(speed);
            if step > 0 {
                assert!((frequency - last.0).abs() < 0.02 && frequency >= last.0 - 1e-12, "{speed} m/s");
                assert!(pose.iter().zip(&last.1).all(|(a, b)| (a - b).abs() < 0.03), "{speed} m/s");
            }
            last = (frequency, pose);
        }
    }
}
