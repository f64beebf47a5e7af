//! Gymnasium's MuJoCo tasks, version 5. Policies, returns and start distributions carry over in both directions.
//!
//! Everything is Gymnasium's (1.4): models, physics steps per decision, integrator, observations, keyword arguments,
//! reward terms under the keys of its `info`, and terminations. Starts have the same distributions but come from
//! another generator. `tests/a_gymnasium_return_agrees_with_gymnasium.rs` checks all of it.
//!
//! Observations after a step are as in Gymnasium. `qpos` and `qvel` belong to the present state. Derived quantities
//! (positions and velocities of bodies, inertias, contact forces) belong to the state from which the last physics step
//! computed its forces.

pub mod ant;
pub mod half_cheetah;
pub mod hopper;
pub mod humanoid;
pub mod humanoid_standup;
pub mod inverted_double_pendulum;
pub mod inverted_pendulum;
pub mod pusher;
pub mod reacher;
pub mod swimmer;
pub mod walker2d;

use std::sync::Arc;

use marathon_physics::Model;
use marathon_physics::lanes::Real;

use crate::agent::senses::clamp;
use crate::agent::{Body, Controls, Facts, ModelSource, Obs, Senses, Start, View};
use crate::any_agent::AnyAgent;

/// All tasks, in the order of listings.
pub fn all() -> Vec<Arc<dyn AnyAgent>> {
    vec![
        Arc::new(hopper::Hopper::default()),
        Arc::new(walker2d::Walker2d::default()),
        Arc::new(half_cheetah::HalfCheetah::default()),
        Arc::new(ant::Ant::default()),
        Arc::new(humanoid::Humanoid::default()),
        Arc::new(humanoid_standup::HumanoidStandup::default()),
        Arc::new(swimmer::Swimmer::default()),
        Arc::new(inverted_pendulum::InvertedPendulum::default()),
        Arc::new(inverted_double_pendulum::InvertedDoublePendulum::default()),
        Arc::new(reacher::Reacher::default()),
        Arc::new(pusher::Pusher::default()),
    ]
}

/// The models that ship with Gymnasium, by their names in `xml_file`.
const MODELS: [(&str, &str); 11] = [
    ("hopper.xml", marathon_assets::text("gymnasium/hopper.xml")),
    ("walker2d_v5.xml", marathon_assets::text("gymnasium/walker2d.xml")),
    ("half_cheetah.xml", marathon_assets::text("gymnasium/half_cheetah.xml")),
    ("ant.xml", marathon_assets::text("gymnasium/ant.xml")),
    ("humanoid.xml", marathon_assets::text("gymnasium/humanoid.xml")),
    ("humanoidstandup.xml", marathon_assets::text("gymnasium/humanoidstandup.xml")),
    ("swimmer.xml", marathon_assets::text("gymnasium/swimmer.xml")),
    ("inverted_pendulum.xml", marathon_assets::text("gymnasium/inverted_pendulum.xml")),
    ("inverted_double_pendulum.xml", marathon_assets::text("gymnasium/inverted_double_pendulum.xml")),
    ("reacher.xml", marathon_assets::text("gymnasium/reacher.xml")),
    ("pusher_v5.xml", marathon_assets::text("gymnasium/pusher.xml")),
];

/// Facts that the tasks share.
fn facts(id: &str, summary: &str, xml_file: &str, frame_skip: usize) -> Facts {
    let built_in = MODELS.iter().find(|(name, _)| *name == xml_file);
    Facts {
        id: id.into(),
        summary: summary.into(),
        model: built_in.map_or_else(|| ModelSource::File(xml_file.into()), |(_, text)| (*text).into()),
        frame_skip,
        max_episode_steps: 1000,
        controls: Controls::Raw,
        view: View { of_last_step: true, ..View::default() },
        termination_reward: None,
        ..Facts::default()
    }
}

/// Rejects a model with fewer coordinates or velocities than the task uses.
fn has(model: &Model, nq: usize, nv: usize) -> Result<(), String> {
    for (what, found, least) in [("coordinates", model.nq, nq), ("velocities", model.nv, nv)] {
        if found < least {
            return Err(format!("its model has {found} {what}, expected at least {least}"));
        }
    }
    Ok(())
}

/// Sets the start: the reference configuration at rest, with uniform noise of `scale` on every coordinate and noise on
/// every velocity. Quaternions get noise too, and are not normalized before the first observation.
fn start(start: &mut Start, scale: f64, velocities: Noise) {
    let (qpos0, nv) = (start.model().qpos0.clone(), start.model().nv);
    for (q, q0) in start.qpos.iter_mut().zip(&qpos0) {
        *q = q0 + start.random.around_zero(scale);
    }
    for d in 0..nv {
        start.qvel[d] = match velocities {
            Noise::Uniform => start.random.around_zero(scale),
            Noise::Normal => start.random.normal() * scale,
        };
    }
    start.normalize = false;
}

/// A distribution.
#[derive(Clone, Copy)]
enum Noise {
    /// Uniform in [-scale, scale).
    Uniform,
    /// Normal with standard deviation `scale`.
    Normal,
}

/// Writes the coordinates from `skip` on, under Gymnasium's name.
#[inline(always)]
fn observe_positions<T: Real>(s: &Senses<T>, out: &mut Obs<T>, skip: usize) {
    out.group("qpos");
    super::observe_positions(s, out, skip);
}

/// Writes all velocities.
#[inline(always)]
fn observe_velocities<T: Real>(s: &Senses<T>, out: &mut Obs<T>) {
    out.group("qvel");
    super::observe_velocities(s, out);
}

/// Writes all velocities, clipped to [-10, 10].
#[inline(always)]
fn observe_clipped_velocities<T: Real>(s: &Senses<T>, out: &mut Obs<T>) {
    out.group("qvel");
    for i in 0..s.readings().sim.model().nv {
        out.scalar(clamp(s.readings().qvel(i), -10.0, 10.0));
    }
}

/// Lanes with `low < x < high`.
#[inline(always)]
fn within<T: Real>(x: T, [low, high]: [f64; 2]) -> T::Mask {
    T::and(T::lit(low).lt(x), x.lt(T::lit(high)))
}

/// Difference of coordinate `i` from its reference.
#[inline(always)]
fn from_origin<T: Real>(s: &Senses<T>, i: usize) -> T {
    s.readings().qpos(i) - T::lit(s.readings().sim.model().qpos0[i])
}

/// Length of (x, y).
#[inline(always)]
fn distance<T: Real>([x, y]: [T; 2]) -> T {
    x.mul_add(x, y * y).sqrt()
}

/// The way from one body's frame to another one's, m.
#[inline(always)]
fn way<T: Real>(s: &Senses<T>, from: Body, to: Body) -> [T; 3] {
    let [from, to] = [from, to].map(|body| s.readings().body_pos(s.body(body)));
    [to[0] - from[0], to[1] - from[1], to[2] - from[2]]
}

/// Length of a vector.
#[inline(always)]
fn length<T: Real>([x, y, z]: [T; 3]) -> T {
    x.mul_add(x, y.mul_add(y, z * z)).sqrt()
}

/// Mean velocity of a point between two decisions, stored in an agent's memory.
struct Travel;

impl Travel {
    /// Number of slots: the last position, and the velocity.
    const SLOTS: usize = 4;
    /// Slot of the velocity along x.
    const X_VELOCITY: usize = 2;
    /// Slot of the velocity along y.
    const Y_VELOCITY: usize = 3;

    /// Starts an episode at a point.
    #[inline(always)]
    fn begin<T: Real>(memory: &mut [T], at: [T; 2]) {
        memory[..2].copy_from_slice(&at);
    }

    /// Updates the velocity after a decision that led to a point.
    #[inline(always)]
    fn update<T: Real>(memory: &mut [T], at: [T; 2], dt: f64) {
        for i in 0..2 {
            memory[2 + i] = (at[i] - memory[i]).div(T::lit(dt));
            memory[i] = at[i];
        }
    }
}
