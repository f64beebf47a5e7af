//! Actuators.

use super::muscle::{MuscleActivation, MuscleSpec};
use crate::lanes::Real;
use crate::model::{Actuator, Dynamics, Model, Transmission};

/// Target of an actuator.
#[derive(Clone, Debug)]
pub(crate) enum TransmissionSpec<C> {
    /// Degrees of freedom and their gears. `qpos` is the coordinate of a scalar joint, for affine gains and biases.
    Joint { dofs: std::ops::Range<usize>, qpos: usize, gear: [C; 6] },
    /// A tendon, and the gear.
    Tendon { index: usize, gear: C },
    /// A drive, which has its own gears.
    Drive(usize),
    /// Contacts, which are found later.
    Adhesion,
}

/// An actuator.
#[derive(Clone, Debug)]
pub(crate) struct ActuatorSpec<C> {
    pub transmission: TransmissionSpec<C>,
    pub ctrl: Option<(C, C)>,
    pub force: Option<(C, C)>,
    pub gain: [C; 3],
    pub bias: [C; 3],
    /// In place of gain and bias. Few actuators are muscles, so they do not lengthen the list.
    pub gain_muscle: Option<Box<MuscleSpec<C>>>,
    pub bias_muscle: Option<Box<MuscleSpec<C>>>,
    /// A full turn in units of the length, and its inverse, for a position servo that turns a site. Of all equivalent
    /// angles, the nearest to the target counts.
    pub turn: Option<[C; 2]>,
    /// Whether it is a plain motor: force = gain * input.
    pub plain: bool,
    pub activation: Option<Activation<C>>,
}

/// How an actuator's activation follows its control.
#[derive(Clone, Debug)]
pub(crate) struct Activation<C> {
    /// Index in `act`.
    pub index: usize,
    /// Rate of change per unit of distance from the control. `None` integrates the control.
    pub rate: Option<C>,
    pub muscle: Option<Box<MuscleActivation<C>>>,
    /// Time that multiplies the rate of change over a step, s.
    pub reach: C,
    pub range: Option<(C, C)>,
    /// Whether the force follows the activation at the end of the step.
    pub early: bool,
}

/// Prepares the actuators.
pub(super) fn actuators<T: Real>(model: &Model) -> Vec<ActuatorSpec<T::Scalar>> {
    let c = T::scalar;
    let flags = &model.opt.flags;
    let range = |on: bool, r: &[f64; 2]| on.then(|| (c(r[0]), c(r[1])));
    let mut drives = 0..;
    let mut spec = |a: &Actuator| {
        let transmission = match a.transmission {
            Transmission::Joint(j) | Transmission::JointInParent(j) => {
                let joint = &model.joints[j];
                let dofs = joint.dof_adr..joint.dof_adr + joint.kind.dofs();
                TransmissionSpec::Joint { dofs, qpos: joint.qpos_adr, gear: a.gear.map(c) }
            }
            Transmission::Tendon(index) => TransmissionSpec::Tendon { index, gear: c(a.gear[0]) },
            // the drives are in the order of their actuators
            Transmission::Site { .. } | Transmission::SliderCrank { .. } => {
                TransmissionSpec::Drive(drives.next().unwrap_or_default())
            }
            Transmission::Body(_) => TransmissionSpec::Adhesion,
        };
        let (dt, tiny) = (model.opt.timestep, 1e-15);
        let rate = match a.dynamics {
            Dynamics::None | Dynamics::Integrator | Dynamics::Muscle { .. } => None,
            Dynamics::Filter { time_constant } | Dynamics::FilterExact { time_constant } => {
                Some(c(1.0 / f64::max(time_constant, tiny)))
            }
        };
        let reach = match a.dynamics {
            Dynamics::FilterExact { time_constant } => {
                let t = f64::max(time_constant, tiny);
                t * (1.0 - libm::exp(-dt / t))
            }
            _ => dt,
        };
        ActuatorSpec {
            transmission,
            ctrl: range(a.ctrl_limited && flags.clampctrl, &a.ctrl_range),
            force: range(a.force_limited, &a.force_range),
            gain: a.gain.map(c),
            bias: a.bias.map(c),
            gain_muscle: a.gain_muscle.as_ref().map(|m| Box::new(MuscleSpec::new::<T>(m))),
            bias_muscle: a.bias_muscle.as_ref().map(|m| Box::new(MuscleSpec::new::<T>(m))),
            turn: full_turn(a).map(|turn| [c(turn), c(1.0 / turn)]),
            plain: !a.is_fed_back() && a.bias == [0.0; 3],
            activation: a.act.map(|index| Activation {
                index,
                rate,
                muscle: match a.dynamics {
                    Dynamics::Muscle { activation, deactivation, smoothing } => {
                        Some(Box::new(MuscleActivation::new::<T>(activation, deactivation, smoothing)))
                    }
                    _ => None,
                },
                reach: c(reach),
                range: range(a.act_limited, &a.act_range),
                early: a.act_early,
            }),
        }
    };
    if flags.actuation { model.actuators.iter().map(&mut spec).collect() } else { Vec::new() }
}

/// A full turn in units of the length of a servo for the orientation of one site relative to another one.
fn full_turn(a: &Actuator) -> Option<f64> {
    let between = matches!(a.transmission, Transmission::Site { reference: Some(_), .. });
    let ([x, y, z, rx, ry, rz], servo) =
        (a.gear, a.gain[1..] == [0.0; 2] && a.gain[0] != 0.0 && a.bias[1] == -a.gain[0]);
    let turn = std::f64::consts::TAU * (rx * rx + ry * ry + rz * rz).sqrt();
    (between && servo && a.gain_muscle.is_none() && [x, y, z] == [0.0; 3] && turn > 1e-20).then_some(turn)
}

/// Bounds of the total actuator force on a degree of freedom.
pub(super) fn joint_force_ranges<T: Real>(model: &Model) -> Vec<(usize, T::Scalar, T::Scalar)> {
    let bounded = |j: &crate::model::Joint| {
        j.actuator_force_range.map(|[low, high]| (j.dof_adr, T::scalar(low), T::scalar(high)))
    };
    model.joints.iter().filter_map(bounded).collect()
}

/// Bounds of the total actuator force on a tendon.
#[derive(Clone, Debug)]
pub(crate) struct TendonForceRange<C> {
    pub tendon: usize,
    pub low: C,
    pub high: C,
    /// The actuators that pull it.
    pub actuators: Vec<usize>,
}

/// Bounds of the total actuator forces on tendons, for those that have any.
pub(super) fn tendon_force_ranges<T: Real>(model: &Model) -> Vec<TendonForceRange<T::Scalar>> {
    if !model.opt.flags.actuation {
        return Vec::new();
    }
    let bounded = |(tendon, t): (usize, &crate::model::Tendon)| {
        let pulls = |(_, a): &(usize, &Actuator)| a.transmission == Transmission::Tendon(tendon);
        let actuators: Vec<usize> = model.actuators.iter().enumerate().filter(pulls).map(|(i, _)| i).collect();
        let [low, high] = t.actuator_force_range.filter(|_| !actuators.is_empty())?.map(T::scalar);
        Some(TendonForceRange { tendon, low, high, actuators })
    };
    model.tendons.iter().enumerate().filter_map(bounded).collect()
}
