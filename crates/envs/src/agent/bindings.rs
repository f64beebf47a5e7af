//! Resolves an agent's names to indices of its model, once per environment. Errors name what does not match.

use marathon_physics::hint::among;
use marathon_physics::lanes::Real;
use marathon_physics::model::{Actuator, JointType, Model};
use marathon_physics::{Group, MeasurePlan, Readings, Sim, SimOptions, Work};

use super::Facts;
use crate::error::EnvError;

/// Name of the keyframe that holds the start pose and velocity.
const SPAWN: &str = "spawn";

/// The parts of the resolution that do not depend on the lane type.
pub(crate) struct Blueprint {
    pub model: Model,
    /// Start pose, length `nq`.
    pub spawn: Vec<f64>,
    /// Start velocity, length `nv`.
    pub spawn_velocity: Vec<f64>,
    /// Actuated joints that the reset adds noise to.
    pub joints: Vec<SpawnJoint>,
    /// Degrees of freedom that carry the root's linear velocity.
    pub root_dofs: Vec<usize>,
}

/// An actuated joint at the start of an episode.
pub(crate) struct SpawnJoint {
    pub qpos: usize,
    pub dof: usize,
    pub range: Option<[f64; 2]>,
}

/// A body part: its geom, the geom's body, and the axes of that body that point forward and up in the spawn pose.
pub(crate) struct PartFrame<C> {
    pub geom: usize,
    pub body: usize,
    pub forward: [C; 3],
    pub up: [C; 3],
}

/// A joint of an actuated pair of bodies.
enum PairJoint<C> {
    Hinge { qpos: usize, q0: C, axis: [C; 3] },
    Ball { qpos: usize },
}

/// A body with actuated joints, relative to its parent.
pub(crate) struct Pair<C> {
    /// Orientation in the parent at rest. `None` if it equals the parent's.
    rest: Option<[C; 4]>,
    joints: Vec<PairJoint<C>>,
}

/// The joint that a motor drives.
pub(crate) struct Motor<C> {
    pub dof: usize,
    pub velocity_scale: C,
}

/// Limit on the physics steps per decision.
const MOST_FRAME_SKIP: usize = 1000;

/// The indices that [`Senses`](crate::Senses) uses.
pub(crate) struct Bindings<T: Real> {
    pub parts: Vec<PartFrame<T::Scalar>>,
    pub bodies: Vec<usize>,
    /// Geoms with touch sensors.
    pub touch: Vec<usize>,
    /// Quantities to compute after every decision: those of the agent's view, and the sites with touch sensors.
    pub measure: MeasurePlan,
    /// Geoms that may touch the ground.
    pub feet: Vec<usize>,
    /// Geoms that must not touch the ground.
    pub not_feet: Vec<usize>,
    /// Planes and level height fields of the world that can be touched. Planes come first.
    pub grounds: Vec<usize>,
    pub pairs: Vec<Pair<T::Scalar>>,
    pub motors: Vec<Motor<T::Scalar>>,
    /// Moving bodies with mass, and their fraction of the total mass.
    pub mass_shares: Vec<(usize, T::Scalar)>,
    /// Coordinates of the root that move the agent along +x, and their factors.
    pub along_x: Vec<(usize, T::Scalar)>,
}

impl Blueprint {
    /// Compiles the model of an agent.
    pub fn model(facts: &Facts) -> Result<Model, EnvError> {
        let compiled = facts.model.spec(&facts.id).and_then(|spec| spec.compile());
        compiled.map_err(|source| EnvError::Model { id: facts.id.clone(), source: Box::new(source) })
    }

    pub fn new(facts: &Facts) -> Result<Blueprint, EnvError> {
        let wrong = |problem: String| EnvError::Agent { id: facts.id.clone(), problem };
        let model = Self::model(facts)?;
        for (what, n) in [
            ("frame_skip", facts.frame_skip),
            ("max_episode_steps", facts.max_episode_steps),
            ("observation", facts.observation.unwrap_or(1)),
            ("the number of actuators", model.nu),
            ("the number of reward terms", facts.reward_terms.len()),
        ] {
            if n == 0 {
                return Err(wrong(format!("{what} is 0, expected at least 1")));
            }
        }
        if facts.frame_skip > MOST_FRAME_SKIP {
            return Err(wrong(format!("frame_skip is {}, expected at most {MOST_FRAME_SKIP}", facts.frame_skip)));
        }
        let found: Vec<_> = model.actuators.iter().map(|a| a.name.as_str()).collect();
        if !facts.actions.is_empty() && found != facts.actions {
            return Err(wrong(format!(
                "its actions are {:?}, but the actuators of its model are {found:?}",
                facts.actions
            )));
        }
        let (spawn, spawn_velocity) = match model.keyframes.iter().find(|k| k.name == SPAWN) {
            Some(key) => (key.qpos.clone(), key.qvel.clone()),
            None => (model.qpos0.clone(), vec![0.0; model.nv]),
        };
        let mut joints: Vec<SpawnJoint> = Vec::new();
        for joint in model.actuators.iter().filter_map(Actuator::joint) {
            let j = &model.joints[joint];
            let scalar = matches!(j.kind, JointType::Hinge | JointType::Slide);
            if scalar && joints.iter().all(|known| known.dof != j.dof_adr) {
                joints.push(SpawnJoint { qpos: j.qpos_adr, dof: j.dof_adr, range: j.limited.then_some(j.range) });
            }
        }
        let mut root_dofs = Vec::new();
        for j in &model.joints {
            match j.kind {
                JointType::Free => root_dofs.extend(j.dof_adr..j.dof_adr + 3),
                JointType::Slide if joints.iter().all(|known| known.dof != j.dof_adr) => root_dofs.push(j.dof_adr),
                _ => {}
            }
        }
        Ok(Blueprint { model, spawn, spawn_velocity, joints, root_dofs })
    }
}

impl<T: Real> Bindings<T> {
    pub fn new(facts: &Facts, blueprint: &Blueprint) -> Result<Self, EnvError> {
        let model = &blueprint.model;
        let missing = |role: &str, name: &str, kind: &str, known: Vec<&str>| {
            let problem = format!("{role} '{name}' is not a {kind} of its model{}", among(name, &known));
            EnvError::Agent { id: facts.id.clone(), problem }
        };
        let geom = |role: &str, name: &str| -> Result<usize, EnvError> {
            let known = || model.geoms.iter().filter(|g| g.body != 0).map(|g| g.name.as_str());
            let found = model.geoms.iter().position(|g| g.body != 0 && g.name == name);
            found.ok_or_else(|| missing(role, name, "geom", known().collect()))
        };
        let body = |name: &String| -> Result<usize, EnvError> {
            let known = || model.bodies.iter().map(|b| b.name.as_str());
            let found = model.bodies.iter().position(|b| b.name == *name);
            found.ok_or_else(|| missing("body", name, "body", known().collect()))
        };
        let site = |name: &String| -> Result<usize, EnvError> {
            let known = || model.sites.iter().map(|s| s.name.as_str());
            let found = model.sites.iter().position(|s| s.name == *name);
            found.ok_or_else(|| missing("touch sensor", name, "site", known().collect()))
        };
        let touch_sites = facts.touch_sites.iter().map(site).collect::<Result<Vec<_>, _>>()?;
        let bodies = facts.bodies.iter().map(body).collect::<Result<Vec<_>, _>>()?;
        let axes = spawn_axes(facts, blueprint)?;
        let mut parts = Vec::new();
        for name in &facts.parts {
            let geom = geom("body part", name)?;
            let body = model.geoms[geom].body;
            // a world axis in body coordinates is that component of each body axis
            let local = |world: usize| [0, 1, 2].map(|i| T::scalar(axes[body][i][world]));
            parts.push(PartFrame { geom, body, forward: local(0), up: local(2) });
        }
        let touch = facts.touch.iter().map(|n| geom("touch sensor", n)).collect::<Result<Vec<_>, _>>()?;
        let feet = facts.feet.iter().map(|n| geom("foot", n)).collect::<Result<Vec<_>, _>>()?;
        let moves = |g: usize| model.bodies[model.geoms[g].body].weld_id != 0;
        let not_feet = (0..model.geoms.len()).filter(|g| moves(*g) && !feet.contains(g)).collect();

        let grounds = model.grounds();

        let mut driven: Vec<usize> = Vec::new();
        let mut motors = Vec::new();
        for joint in model.actuators.iter().filter_map(Actuator::joint) {
            let j = &model.joints[joint];
            let rotates = matches!(j.kind, JointType::Hinge | JointType::Ball);
            if rotates && !driven.contains(&j.body) {
                driven.push(j.body);
            }
            let scale = if rotates { std::f64::consts::FRAC_1_PI } else { 1.0 };
            motors.push(Motor { dof: j.dof_adr, velocity_scale: T::scalar(scale) });
        }
        let pairs = driven.iter().map(|b| Pair::new::<T>(model, *b)).collect();

        let mut along_x = Vec::new();
        for j in &model.joints {
            match j.kind {
                JointType::Free if model.bodies[j.body].root_id == first_root(model) => {
                    along_x.push((j.qpos_adr, T::scalar(1.0)));
                }
                JointType::Slide if blueprint.root_dofs.contains(&j.dof_adr) && j.axis[0] != 0.0 => {
                    along_x.push((j.qpos_adr, T::scalar(j.axis[0])));
                }
                _ => {}
            }
        }
        let moving: Vec<usize> =
            (1..model.bodies.len()).filter(|b| model.bodies[*b].weld_id != 0 && model.bodies[*b].mass > 0.0).collect();
        let mass: f64 = moving.iter().map(|b| model.bodies[*b].mass).sum();
        let mass_shares = moving.into_iter().map(|b| (b, T::scalar(model.bodies[b].mass / mass))).collect();
        let view = facts.view;
        let measure = MeasurePlan {
            of_last_step: view.of_last_step,
            centers: view.bodies,
            bodies: view.bodies,
            actuators: view.actuators,
            joints: view.joints,
            touch_sites,
        };
        Ok(Bindings { parts, bodies, touch, measure, feet, not_feet, grounds, pairs, motors, mass_shares, along_x })
    }
}

/// Root body of the first moving tree. If the model has props, this is the agent.
fn first_root(model: &Model) -> usize {
    model.joints.first().map_or(0, |j| model.bodies[j.body].root_id)
}

/// World axes of every body in the spawn pose.
fn spawn_axes(facts: &Facts, blueprint: &Blueprint) -> Result<Vec<[[f64; 3]; 3]>, EnvError> {
    let sim = Sim::<f64>::new(&blueprint.model, sim_options())
        .map_err(|source| EnvError::Sim { id: facts.id.clone(), source })?;
    let mut group = Group::new(&sim);
    group.reset_lane(&sim, 0, &blueprint.spawn, &vec![0.0; blueprint.model.nv]);
    let mut work = Work::new(&sim);
    sim.refresh(&mut work, &group);
    let readings = Readings { sim: &sim, group: &group, work: &work };
    Ok((0..blueprint.model.bodies.len()).map(|b| readings.body_axes(b)).collect())
}

/// Options of all simulations of agents.
pub(crate) fn sim_options() -> SimOptions {
    SimOptions::default()
}

impl<C: Copy> Pair<C> {
    fn new<T: Real<Scalar = C>>(model: &Model, body: usize) -> Self {
        let b = &model.bodies[body];
        let joints = &model.joints[b.joint_start..b.joint_start + b.joint_count];
        Pair {
            rest: (b.quat != [1.0, 0.0, 0.0, 0.0]).then(|| b.quat.map(T::scalar)),
            joints: joints
                .iter()
                .filter_map(|j| match j.kind {
                    JointType::Hinge => Some(PairJoint::Hinge {
                        qpos: j.qpos_adr,
                        q0: T::scalar(model.qpos0[j.qpos_adr]),
                        axis: j.axis.map(T::scalar),
                    }),
                    JointType::Ball => Some(PairJoint::Ball { qpos: j.qpos_adr }),
                    JointType::Slide | JointType::Free => None,
                })
                .collect(),
        }
    }

    /// Orientation of the child in the parent, `[w, x, y, z]`.
    #[inline(always)]
    pub fn rotation<T: Real<Scalar = C>>(&self, readings: &Readings<T>) -> [T; 4] {
        let (zero, half) = (T::zero(), T::lit(0.5));
        let mut q = match &self.rest {
            Some([w, x, y, z]) => [T::splat(*w), T::splat(*x), T::splat(*y), T::splat(*z)],
            None => [T::lit(1.0), zero, zero, zero],
        };
        let mut first = self.rest.is_none();
        for joint in &self.joints {
            let p = match joint {
                PairJoint::Hinge { qpos, q0, axis } => {
                    let (s, c) = ((readings.qpos(*qpos) - T::splat(*q0)) * half).sin_cos();
                    [c, s * T::splat(axis[0]), s * T::splat(axis[1]), s * T::splat(axis[2])]
                }
                PairJoint::Ball { qpos } => {
                    [readings.qpos(*qpos), readings.qpos(*qpos + 1), readings.qpos(*qpos + 2), readings.qpos(*qpos + 3)]
                }
            };
            q = if first { p } else { product(q, p) };
            first = false;
        }
        q
    }
}

/// Product of quaternions `[w, x, y, z]`.
#[inline(always)]
fn product<T: Real>(a: [T; 4], b: [T; 4]) -> [T; 4] {
    let [aw, ax, ay, az] = a;
    let [bw, bx, by, bz] = b;
    [
        az.neg_mul_add(bz, ay.neg_mul_add(by, ax.neg_mul_add(bx, aw * bw))),
        az.neg_mul_add(by, ay.mul_add(bz, ax.mul_add(bw, aw * bx))),
        ax.neg_mul_add(bz, az.mul_add(bx, ay.mul_add(bw, aw * by))),
        ay.neg_mul_add(bx, ax.mul_add(by, az.mul_add(bw, aw * bz))),
    ]
}
