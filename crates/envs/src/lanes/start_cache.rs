//! Starts of episodes that need physics: free of contacts, or settled for some steps.
//!
//! All lanes of a group are prepared at once, including those whose next episode is not due yet. A physics step costs
//! the same for one lane as for all, so preparing lanes one by one would pay for a whole group each time. A start
//! depends on seed, agent and episode only. It does not matter when it is computed, and it is not part of a snapshot.

use marathon_physics::lanes::{Kernel, Real};
use marathon_physics::{Group, Readings, Sim, Work};

use super::decision::{LARGEST, Task};
use super::task::EpisodeStart;
use crate::episode_rng::{EpisodeId, EpisodeRng};
use crate::shard::AgentState;

/// Largest number of draws for a start free of contacts. After that, the last draw is used even with contacts.
const DRAWS: usize = 1000;

/// Starts of the next episodes of a shard's agents.
pub(crate) struct StartCache<T: Real> {
    /// Lanes in which starts are prepared.
    scratch: Option<Group<T>>,
    /// By agent.
    starts: Vec<Option<(EpisodeId, EpisodeStart)>>,
}

impl<T: Real> StartCache<T> {
    /// An empty cache for a number of agents.
    pub fn new(agents: usize) -> Self {
        StartCache { scratch: None, starts: vec![None; agents] }
    }

    /// The start of an agent's episode, if it has been prepared.
    pub fn get(&self, agent: usize, id: EpisodeId) -> Option<&EpisodeStart> {
        self.starts[agent].as_ref().filter(|(known, _)| *known == id).map(|(_, start)| start)
    }

    /// Prepares missing starts of the episodes `ids` of consecutive agents, one per lane.
    pub fn make(&mut self, task: &Task<T>, work: &mut Work<T>, first: usize, ids: &[EpisodeId]) {
        let due: Vec<usize> = (0..T::LANES).filter(|lane| self.get(first + lane, ids[*lane]).is_none()).collect();
        let group = self.scratch.get_or_insert_with(|| Group::new(&task.data.sim));
        // other lanes rest at the spawn pose, so that they do not slow the group down
        let (spawn, at_rest) = (&task.data.blueprint.spawn, vec![0.0; task.data.blueprint.model.nv]);
        for lane in 0..T::LANES {
            group.reset_lane(&task.data.sim, lane, spawn, &at_rest);
        }
        let drawn = draw(task, work, group, &due, ids);
        let mut steps = 0;
        loop {
            for lane in due.iter().copied().filter(|lane| drawn[*lane].settle == steps) {
                let mut state = read(group, lane);
                if !state.qpos.iter().chain(&state.qvel).all(|x| x.abs() < LARGEST) {
                    state = AgentState { qpos: spawn.clone(), qvel: at_rest.clone() };
                }
                // the physics has normalized it already
                self.starts[first + lane] =
                    Some((ids[lane], EpisodeStart { state, normalize: true, ..drawn[lane].clone() }));
            }
            let Some(next) = due.iter().map(|lane| drawn[*lane].settle).filter(|n| *n > steps).min() else { break };
            // single steps, because a lane's bits must not depend on when others have settled
            while steps < next {
                task.data.sim.advance(work, group, 1);
                steps += 1;
            }
        }
        if drawn.iter().any(|start| !start.grounds.is_empty()) {
            // the next starts are drawn on the model's own ground
            self.scratch = None;
        }
    }
}

/// Draws the starts of some lanes until they are accepted. Returns those of all lanes, before settling.
fn draw<T: Real>(
    task: &Task<T>,
    work: &mut Work<T>,
    group: &mut Group<T>,
    due: &[usize],
    ids: &[EpisodeId],
) -> Vec<EpisodeStart> {
    let mut randoms: Vec<EpisodeRng> = ids.iter().map(|id| EpisodeRng::new(*id)).collect();
    let mut drawn = vec![EpisodeStart::new(); T::LANES];
    let mut missing = due.to_vec();
    // a start prepared in advance cannot depend on how the previous episode ends
    let no_past = vec![0.0; task.data.facts.memory];
    for _ in 0..DRAWS {
        let mut doubtful = Vec::new();
        for lane in missing {
            let start = &mut drawn[lane];
            task.draw_start(start, ids[lane], &mut randoms[lane], &no_past);
            group.reset_lane(&task.data.sim, lane, &start.state.qpos, &start.state.qvel);
            for (field, elevations) in &start.grounds {
                group.set_ground(&task.data.sim, lane, *field, elevations);
            }
            if start.free_of_contacts {
                doubtful.push(lane);
            }
        }
        if doubtful.is_empty() {
            break;
        }
        task.data.sim.forward(work, group);
        let touching = T::enter(Touching { sim: &task.data.sim, group, work });
        missing = doubtful.into_iter().filter(|lane| touching >> lane & 1 == 1).collect();
    }
    drawn
}

/// State of a lane.
fn read<T: Real>(group: &Group<T>, lane: usize) -> AgentState {
    let numbers = |v: &[T]| v.iter().map(|x| T::widen(x.get(lane))).collect();
    AgentState { qpos: numbers(&group.qpos), qvel: numbers(&group.qvel) }
}

/// Lanes with any contact, one bit each, after [`Sim::forward`].
struct Touching<'a, T: Real> {
    sim: &'a Sim<T>,
    group: &'a Group<T>,
    work: &'a Work<T>,
}

impl<T: Real> Kernel<T> for Touching<'_, T> {
    type Output = u32;
    #[inline(always)]
    fn run(self) -> u32 {
        let readings = Readings::new(self.sim, self.group, self.work);
        let mut any = T::none();
        for geom in 0..self.sim.model().geoms.len() {
            any = T::or(any, T::or(readings.touching(geom), readings.touching_bodies(geom)));
        }
        T::bits(any)
    }
}
