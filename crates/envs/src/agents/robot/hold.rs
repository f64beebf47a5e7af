//! Whether the servos of a robot hold its standing pose. Robots with two legs or fewer fall without balance and are not judged.

use marathon_physics::model::Model;
use marathon_physics::{Group, Readings, Sim, SimError, SimOptions, Work};

use super::servos::Drive;

/// Time of the test, s.
const TIME: f64 = 1.0;
/// Part of its height that a robot has to keep, and the largest tilt, degrees.
const LEAST: (f64, f64) = (0.6, 45.0);

/// A robot after a second in which its servos held the standing pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hold {
    /// Height of the root, as a part of that in the standing pose.
    pub height: f64,
    /// Angle between the root's up axis then and at the start, degrees.
    pub tilt: f64,
}

impl Hold {
    /// Simulates the second.
    ///
    /// # Errors
    /// If the model uses something that cannot be simulated.
    pub fn of(model: &Model, body: usize, qpos: &[f64], ground: f64, drives: &[Drive]) -> Result<Hold, SimError> {
        let sim = Sim::<f64>::new(model, SimOptions::default())?;
        let (mut group, mut work) = (Group::new(&sim), Work::new(&sim));
        group.reset_lane(&sim, 0, qpos, &vec![0.0; model.nv]);
        for (ctrl, drive) in group.ctrl.iter_mut().zip(drives) {
            *ctrl = match drive {
                Drive::Servo(servo) => servo.center,
                Drive::Direct([center, _]) => *center,
            };
        }
        // the height, and the world's up axis in the root's axes
        let read = |group: &Group<f64>, work: &Work<f64>| {
            let readings = Readings { sim: &sim, group, work };
            (readings.body_pos(body)[2] - ground, readings.body_axes(body).map(|axis| axis[2]))
        };
        sim.refresh(&mut work, &group);
        let (before, first) = read(&group, &work);
        sim.step(&mut work, &mut group, (TIME / model.opt.timestep).round() as usize);
        let (after, last) = read(&group, &work);
        let cos: f64 = first.iter().zip(last).map(|(a, b)| a * b).sum();
        Ok(Hold { height: after / before, tilt: libm::acos(cos.clamp(-1.0, 1.0)).to_degrees() })
    }

    /// Whether the robot still stands.
    pub fn stands(&self) -> bool {
        self.height > LEAST.0 && self.tilt < LEAST.1
    }
}
