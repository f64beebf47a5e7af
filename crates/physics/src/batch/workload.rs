//! The benchmark's workload: agents under random torques, falling and thrashing on the floor.
//!
//! The `mujoco` package runs the same protocol in `marathon bench physics --against mujoco`. It starts in the reference
//! configuration, with hinges off by up to 0.1 rad and velocities up to 0.1, and warms up. It then times steps under
//! controls drawn uniformly from [-1, 1] and held for four steps. Agents are not reset: contacts are many and differ
//! between agents, which is the hard case for lanes.

use crate::lanes::{Isa, Real};
use crate::model::{JointType, Model};
use crate::sim::{Sim, SimError, SimOptions};
use crate::state::{Group, SolverStats, Work};

/// Steps for which a control is held.
pub const HOLD: usize = 4;

/// Size of a workload.
#[derive(Clone, Debug)]
pub struct Workload {
    /// Instruction set.
    pub isa: Isa,
    /// Number of agents, rounded up to whole lane groups.
    pub agents: usize,
    /// Steps before the clock starts.
    pub warmup: usize,
    /// Steps that are timed.
    pub steps: usize,
    /// Seed of the starts and controls.
    pub seed: u64,
    /// Simulation options.
    pub sim: SimOptions,
}

/// Results of a workload.
#[derive(Clone, Debug)]
pub struct Report {
    /// Agents simulated.
    pub agents: usize,
    /// Time of the timed steps by the given clock, s.
    pub seconds: f64,
    /// Counts of the timed steps.
    pub stats: SolverStats,
    /// Largest |qvel| at the end of the timed steps.
    pub max_velocity: f64,
    /// Agents whose state was not finite at the end.
    pub non_finite: usize,
}

impl Workload {
    /// Runs the workload on the calling thread; `clock` returns seconds.
    ///
    /// # Errors
    /// If the model cannot be simulated.
    pub fn run(&self, model: &Model, clock: &dyn Fn() -> f64) -> Result<Report, SimError> {
        with_kernels!(self.isa, T => self.run_lanes::<T>(model, clock))
    }

    fn run_lanes<T: Real>(&self, model: &Model, clock: &dyn Fn() -> f64) -> Result<Report, SimError> {
        let sim = Sim::<T>::new(model, self.sim.clone())?;
        let mut work = Work::new(&sim);
        let mut rng = Uniform(self.seed);
        let mut groups: Vec<Group<T>> = (0..self.agents.div_ceil(T::LANES)).map(|_| Group::new(&sim)).collect();
        for group in &mut groups {
            for lane in 0..T::LANES {
                let mut qpos = model.qpos0.clone();
                for joint in model.joints.iter().filter(|j| j.kind == JointType::Hinge) {
                    qpos[joint.qpos_adr] += 0.1 * rng.next();
                }
                let qvel: Vec<f64> = (0..model.nv).map(|_| 0.1 * rng.next()).collect();
                group.reset_lane(&sim, lane, &qpos, &qvel);
            }
        }
        // controls are drawn in advance, so that drawing is not measured
        let stock: Vec<Vec<T>> = (0..257)
            .map(|_| {
                let mut u = vec![T::zero(); model.nu];
                for x in &mut u {
                    for lane in 0..T::LANES {
                        x.set(lane, T::scalar(rng.next()));
                    }
                }
                u
            })
            .collect();
        let mut advance = |from: usize, to: usize, work: &mut Work<T>| {
            for hold in from / HOLD..to / HOLD {
                for (g, group) in groups.iter_mut().enumerate() {
                    group.ctrl.copy_from_slice(&stock[(hold * 31 + g * 17) % stock.len()]);
                    sim.step(work, group, HOLD);
                }
            }
        };
        advance(0, self.warmup, &mut work);
        let before = work.stats();
        let start = clock();
        advance(self.warmup, self.warmup + self.steps, &mut work);
        let seconds = clock() - start;
        let mut max_velocity = 0.0f64;
        let mut non_finite = 0;
        for group in &groups {
            non_finite += T::bits(T::not(group.finite())).count_ones() as usize;
            for v in &group.qvel {
                for lane in 0..T::LANES {
                    max_velocity = max_velocity.max(T::widen(v.get(lane)).abs());
                }
            }
        }
        let mut stats = work.stats();
        stats.subtract(&before);
        Ok(Report { agents: groups.len() * T::LANES, seconds, stats, max_velocity, non_finite })
    }
}

/// Uniform numbers in [-1, 1) (SplitMix64). A benchmark must not depend on a library's version.
#[derive(Clone, Debug)]
pub struct Uniform(pub u64);

impl Uniform {
    /// The next number.
    #[expect(clippy::should_implement_trait, reason = "an endless stream needs no `Option`")]
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}
