//! Arguments of the task for any model.

use super::stance::AUTO;
use crate::agent::options::{Choice, OptionValue, Scale, Value};

/// The robot's goal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// Follow commanded velocities.
    Velocity,
    /// Stand.
    Stand,
}

impl Choice for Task {
    const EXPECTED: &'static str = "velocity or stand";
    const NAMED: &'static [(Self, &'static str)] = &[(Task::Velocity, "velocity"), (Task::Stand, "stand")];
}

/// Timing of the steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gait {
    /// A clock gives each foot its time.
    Clock,
    /// The robot chooses.
    Free,
}

impl Choice for Gait {
    const EXPECTED: &'static str = "clock or free";
    const NAMED: &'static [(Self, &'static str)] = &[(Gait::Clock, "clock"), (Gait::Free, "free")];
}

/// A number that follows from the model unless a caller gives it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Auto(pub Option<f64>);

impl Auto {
    /// The given number, or the one that follows from the model.
    pub fn or(self, found: f64) -> f64 {
        self.0.unwrap_or(found)
    }
}

impl OptionValue for Auto {
    const EXPECTED: &'static str = "auto, or a finite number, 0 or more";
    fn value(&self) -> Value {
        self.0.map_or(Value::Text(AUTO.into()), Value::Number)
    }
    fn read(value: &Value) -> Option<Self> {
        match value {
            Value::Text(text) if text == AUTO => Some(Auto(None)),
            value => Scale::read(value).map(|Scale(number)| Auto(Some(number))),
        }
    }
}

crate::options! {
    /// Arguments of the task for any model.
    pub struct RobotArguments {
        /// MJCF file of the robot. Default: a quadruped that comes with Marathon.
        xml_file: String = String::new(),
        /// Goal: follow commanded velocities (`velocity`), or `stand`.
        task: Task = Task::Velocity,
        /// Fastest commanded speed ahead, m/s. `auto`: 0.6 sqrt(g H), or 0.4 sqrt(g H) on two legs. H is the height of the root.
        speed: Auto = Auto(None),
        /// Fastest commanded speed to a side, m/s. `auto`: half of `speed`; 0 if no leg moves sideways.
        side_speed: Auto = Auto(None),
        /// Fastest commanded turn rate, rad/s. `auto`: 1; 0 if no leg moves sideways.
        turn_rate: Auto = Auto(None),
        /// Timing of the steps: by a `clock`, or `free`.
        gait: Gait = Gait::Clock,
        /// Steps per second of each foot. `auto`: 0.33 sqrt(g / H), between 1 and 2.5.
        step_rate: Auto = Auto(None),
        /// Height of a step, m. `auto`: 0.2 H, between 0.02 and 0.1.
        step_height: Auto = Auto(None),
        /// Keyframe with the standing pose. `auto`: `spawn`, `knees_bent`, `home`, `stand` or the first one; the reference
        /// pose of a model without keyframes, or of any with `reference`.
        pose: String = AUTO.into(),
        /// Bodies that are the feet, separated by commas. `auto`: the ends of the limbs that reach the ground. `none`: no
        /// feet, as on wheels.
        feet: String = AUTO.into(),
        /// Stiffness of the servos that replace motors, as a multiple of their largest torque per radian. `auto`: 2, or 4 on two
        /// feet. A robot with three feet or more also has 4 if it cannot stand with 2. 0 keeps the motors: their torque is the action.
        stiffness: Auto = Auto(None),
        /// Change of a servo's target by an action of 1, rad. `auto`: the change that takes half of the largest torque, between
        /// 0.15 and 0.6; 0.6 on two feet, if servos replace motors.
        action_scale: Auto = Auto(None),
        /// Tilt of the root that ends the episode, degrees.
        fall_tilt: Scale = Scale(70.0),
    }
}
