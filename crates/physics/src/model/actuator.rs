//! Actuators.

use serde::{Deserialize, Serialize};

/// Target of an actuator's force (MuJoCo `actuator_trntype`, `actuator_trnid`).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Transmission {
    /// A joint, by index. The torque on a ball joint and the wrench on a free joint are given in the body's frame.
    Joint(usize),
    /// A ball or free joint whose torque is given in the parent body's frame; on other joints the same as `Joint`.
    JointInParent(usize),
    /// A tendon, by index.
    Tendon(usize),
    /// A site. Force and torque act at the site, along the axes of the reference site, which takes their opposites.
    /// Without a reference they are along the site's own axes, and the length is 0.
    Site {
        /// The site, by index.
        site: usize,
        /// The reference site, if any.
        reference: Option<usize>,
    },
    /// A rod from a site to a slider, which moves along the z axis of another site. The length is the slider's position.
    SliderCrank {
        /// The site at the end of the crank.
        crank: usize,
        /// The site on whose z axis the slider moves.
        slider: usize,
        /// Length of the rod, m.
        rod: f64,
    },
    /// The contacts of a body, by index. The force is spread over them and pulls along their normals. It has no length.
    Body(usize),
}

/// How an actuator's activation follows its control (MuJoCo `actuator_dyntype`, `actuator_dynprm`).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Dynamics {
    /// No activation: the control itself is the input of the force.
    None,
    /// `act' = ctrl`.
    Integrator,
    /// `act' = (ctrl - act) / time_constant`, Euler steps.
    Filter {
        /// Seconds.
        time_constant: f64,
    },
    /// The same, integrated exactly over a step.
    FilterExact {
        /// Seconds.
        time_constant: f64,
    },
    /// A muscle's activation follows its control, which is clamped to 0 to 1, faster up than down.
    Muscle {
        /// Time constant of activation, s.
        activation: f64,
        /// Time constant of deactivation, s.
        deactivation: f64,
        /// Width of the transition between the two, in units of the control; 0: none.
        smoothing: f64,
    },
}

/// Force of a muscle over its length and velocity (MuJoCo `gainprm`, `biasprm` and `actuator_lengthrange` of a muscle).
///
/// Lengths and velocities are in units of the optimal length, at which the muscle is strongest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Muscle {
    /// Shortest and longest length of the actuator, m or rad.
    pub length_range: [f64; 2],
    /// The same in units of the optimal length.
    pub range: [f64; 2],
    /// Largest active force, N.
    pub force: f64,
    /// Length below which there is no active force.
    pub lmin: f64,
    /// Length above which there is none.
    pub lmax: f64,
    /// Velocity of shortening at which the active force is gone, 1/s.
    pub vmax: f64,
    /// Passive force at `lmax`, as a part of `force`.
    pub fpmax: f64,
    /// Active force while the muscle lengthens fast, as a part of `force`.
    pub fvmax: f64,
}

/// An actuator: `force = gain * input + bias`, where the input is the control or, with [`Dynamics`], the activation;
/// the transmission receives `gear * force`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Actuator {
    /// Name; empty when the file gives none.
    pub name: String,
    /// Target of the force.
    pub transmission: Transmission,
    /// Transmission ratio per degree of freedom of the joint, or per axis of force and torque at a site. Tendons and
    /// slider-cranks only have the first, contacts none.
    pub gear: [f64; 6],
    /// Whether `ctrl` is clamped to `ctrl_range`.
    pub ctrl_limited: bool,
    /// Range of the control signal.
    pub ctrl_range: [f64; 2],
    /// Whether the force is clamped to `force_range`.
    pub force_limited: bool,
    /// Range of the scalar force.
    pub force_range: [f64; 2],
    /// Gain: `gain[0] + gain[1] * length + gain[2] * velocity` (fixed gain: the last two are 0). Length and velocity
    /// are those of the transmission, times the gear.
    pub gain: [f64; 3],
    /// Bias: `bias[0] + bias[1] * length + bias[2] * velocity`; all 0 for a motor.
    pub bias: [f64; 3],
    /// A muscle's active force, in place of `gain`.
    pub gain_muscle: Option<Muscle>,
    /// A muscle's passive force, in place of `bias`.
    pub bias_muscle: Option<Muscle>,
    /// How the activation follows the control.
    pub dynamics: Dynamics,
    /// Index of the activation in `act`, if the actuator has one (MuJoCo `actuator_actadr`).
    pub act: Option<usize>,
    /// Whether the activation is clamped to `act_range`.
    pub act_limited: bool,
    /// Range of the activation.
    pub act_range: [f64; 2],
    /// Whether the force follows the activation at the end of the step instead of at its start (`actearly`).
    pub act_early: bool,
}

impl Actuator {
    /// Joint that the actuator acts on, in either frame; `None` when it acts on something else.
    pub fn joint(&self) -> Option<usize> {
        match self.transmission {
            Transmission::Joint(joint) | Transmission::JointInParent(joint) => Some(joint),
            Transmission::Tendon(_)
            | Transmission::Site { .. }
            | Transmission::SliderCrank { .. }
            | Transmission::Body(_) => None,
        }
    }

    /// The sites of a transmission between two bodies: the one that takes the opposite force first, if any.
    pub(crate) fn sites(&self) -> Option<(Option<usize>, usize)> {
        match self.transmission {
            Transmission::Site { site, reference } => Some((reference, site)),
            Transmission::SliderCrank { crank, slider, .. } => Some((Some(slider), crank)),
            Transmission::Joint(_)
            | Transmission::JointInParent(_)
            | Transmission::Tendon(_)
            | Transmission::Body(_) => None,
        }
    }

    /// Whether the force depends on the velocity of the transmission.
    pub(crate) fn damps(&self) -> bool {
        self.gain[2] != 0.0 || self.bias[2] != 0.0 || self.gain_muscle.is_some()
    }

    /// Whether the force depends on the length or the velocity of the transmission.
    pub(crate) fn is_fed_back(&self) -> bool {
        self.damps() || self.gain[1] != 0.0 || self.bias[1] != 0.0 || self.bias_muscle.is_some()
    }
}
