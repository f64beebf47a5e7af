//! Observations of agents that move exactly as their clips.

use marathon_physics::Work;
use marathon_physics::lanes::Real;

use super::decision::Task;
use super::group::LaneGroup;
use super::task::EpisodeStart;
use crate::agent::Following;
use crate::episode_rng::EpisodeId;
use crate::shard::{AgentState, Demonstrations};

/// Observations of the rows of all clips, each as the start of an episode. The last row of a looping clip is followed
/// by its first.
pub(super) fn demonstrations<T: Real>(task: &Task<T>) -> Option<Demonstrations> {
    let timeline = &task.data.reference.as_ref()?.timeline;
    let rows = timeline.qpos.len();
    let (mut group, mut work) = (LaneGroup::new(&task.data), Work::new(&task.data.sim));
    let mut out = Demonstrations { obs_len: task.data.spec.obs, ..Demonstrations::default() };
    let mut start = EpisodeStart::new();
    for first in (0..rows).step_by(T::LANES) {
        for lane in 0..T::LANES {
            // lanes beyond the end repeat the last row
            let row = (first + lane).min(rows - 1);
            start.state = AgentState { qpos: timeline.qpos[row].clone(), qvel: timeline.qvel[row].clone() };
            start.memory = vec![0.0; task.data.facts.memory];
            start.memory[Following::ROW] = row as f64;
            group.put_at_start(&task.data.sim, lane, &start);
            task.tell(&mut group.commands, lane, EpisodeId { seed: 0, agent: 0, episode: 0 }, 0);
            group.commands.begin(lane);
        }
        task.begin(&mut group, &mut work, u32::MAX >> (32 - T::LANES));
        for lane in 0..T::LANES.min(rows - first) {
            out.obs.extend(group.obs.iter().map(|x| T::widen(x.get(lane)) as f32));
        }
    }
    for clip in &timeline.clips {
        let back = clip.cycle.map(|_| [clip.rows.end - 1, clip.rows.start]);
        let steps = clip.rows.clone().skip(1).map(|row| [row - 1, row]);
        let first = out.decisions.len();
        out.decisions.extend(steps.chain(back));
        out.motions.push(first..out.decisions.len());
    }
    Some(out)
}
