//! With `replay_falls_prob`, a fraction of the episodes of commanded figures starts 0.75 to 1.5 s before the figure's last fall,
//! with its pose, velocities and gait. A figure that falls right after its start keeps the state from before the
//! earlier fall. Without `replay_falls_prob`, or before any fall, episodes start as usual.

use crate::common::begun;
use marathon_envs::{AgentState, Step, VecEnv};
use std::ops::RangeInclusive;

const AGENTS: usize = 16;
/// Largest noise of an angle at the start, rad.
const NOISE: f64 = 0.0101;

/// A figure that falls.
#[derive(Clone, Copy)]
struct Figure {
    id: &'static str,
    /// Force that supports its weight, and pushes figures forward that would only stand, N.
    carried: [f64; 3],
    /// Decisions between two stored states.
    apart: usize,
    /// How many numbers of `qpos` are positions along the ground.
    places: usize,
    /// How many numbers of `qpos` (without noise) and of `qvel` are the root's.
    root: [usize; 2],
    /// Decisions after which its state differs from any episode's start. Figures in a plane all start alike.
    alike: usize,
}

impl Figure {
    /// Decisions from the stored state to a fall.
    fn before(self) -> RangeInclusive<usize> {
        self.apart..=2 * self.apart
    }

    /// Decisions of support, long enough to store two states before the fall.
    fn long(self) -> usize {
        2 * self.apart + 10
    }

    /// Whether `start` matches `state` up to the noise of a start.
    fn is_from(self, start: &AgentState, state: &AgentState) -> bool {
        let near = |a: &[f64], b: &[f64], by: f64| a.iter().zip(b).all(|(a, b)| (a - b).abs() < by);
        let Figure { places, root: [qpos, qvel], .. } = self;
        start.qpos[..places].iter().all(|x| *x == 0.0)
            && near(&start.qpos[places..qpos], &state.qpos[places..qpos], 1e-9)
            && near(&start.qpos[qpos..], &state.qpos[qpos..], NOISE)
            && near(&start.qvel[..qvel], &state.qvel[..qvel], 0.0251)
            && near(&start.qvel[qvel..], &state.qvel[qvel..], 10.0 * NOISE)
    }
}

const MARATHON_MAN: Figure = Figure {
    id: "MarathonManSteer-v0",
    carried: [0.0, 0.0, 82.0 * 9.81],
    apart: 30,
    places: 2,
    root: [7, 6],
    alike: 0,
};
const PLAYED: Figure = Figure { id: "MarathonManController-v0", ..MARATHON_MAN };
const WALKER: Figure = Figure {
    id: "WalkerController-v0",
    carried: [20.0, 0.0, 28.5 * 9.81],
    apart: 75,
    places: 1,
    root: [3, 3],
    alike: 38,
};
const HOPPER: Figure = Figure { id: "HopperController-v0", carried: [10.0, 0.0, 12.4 * 9.81], apart: 38, ..WALKER };

/// Runs an episode of each figure. A force supports its weight and stops after some decisions. Returns the states of
/// those that fell, decision by decision, and starts their next episodes.
fn fall(figure: Figure, env: &mut VecEnv, step: &mut Step, after: usize) -> Vec<Option<Vec<AgentState>>> {
    let (stand, actions) = (vec![0.0; env.spec().command.len()], vec![0.0; AGENTS * env.spec().act]);
    if !stand.is_empty() {
        (0..AGENTS).for_each(|agent| env.set_command(agent, Some(&stand)).unwrap());
    }
    let mut ways = vec![Vec::new(); AGENTS];
    let mut fallen = [false; AGENTS];
    for decision in 0..after + 400 {
        let force = if decision < after { figure.carried } else { [0.0; 3] };
        (0..AGENTS).for_each(|agent| env.push(agent, 1, force, [0.0; 3]).unwrap());
        env.step(&actions, &mut *step).unwrap();
        for agent in (0..AGENTS).filter(|agent| !fallen[*agent]).collect::<Vec<_>>() {
            ways[agent].push(env.state(agent).unwrap());
            fallen[agent] = step.terminated[agent];
        }
    }
    env.reset_agents(&fallen, &mut step.obs).unwrap();
    ways.into_iter().zip(fallen).map(|(way, fell)| fell.then_some(way)).collect()
}

fn starts_before_the_fall(figure: Figure, list: &[(&str, &str)]) {
    let (id, apart) = (figure.id, figure.apart);
    let (mut env, mut step) = begun(id, AGENTS, 5, list);
    let ways = fall(figure, &mut env, &mut step, figure.long());
    let mut relived = Vec::new();
    for (agent, way) in ways.iter().enumerate() {
        let Some(way) = way else { continue };
        let start = env.state(agent).unwrap();
        let from: Vec<usize> = (1..way.len()).filter(|ago| figure.is_from(&start, &way[way.len() - 1 - ago])).collect();
        if way.len() > 2 * apart {
            let known = from.iter().any(|ago| figure.before().contains(ago));
            assert!(known, "{id}: agent {agent} starts {from:?} before its fall");
            relived.push((agent, start));
        } else {
            assert!(from.is_empty(), "{id}: agent {agent} has not been up for long enough");
        }
    }
    assert!(relived.len() > AGENTS / 2, "{id}: {} fell", relived.len());
    // after a fall right at the start, the earlier state stays
    let ways = fall(figure, &mut env, &mut step, 5);
    for (agent, before) in relived {
        let Some(way) = &ways[agent] else { continue };
        if way.len() < apart {
            let start = env.state(agent).unwrap();
            let height = figure.places;
            let off = (start.qpos[height] - before.qpos[height]).abs();
            assert!(off < 1e-9, "{id}: agent {agent} starts where it did before");
        }
    }
}

#[test]
fn the_steered_figure_starts_before_its_fall() {
    starts_before_the_fall(MARATHON_MAN, &[("replay_falls_prob", "1")]);
}

#[test]
fn a_figure_under_player_control_starts_before_its_fall() {
    starts_before_the_fall(PLAYED, &[("replay_falls_prob", "1"), ("end_on_fall_prob", "1"), ("clip", "walk,stand")]);
}

#[test]
fn figures_in_a_plane_start_before_their_fall() {
    for figure in [WALKER, HOPPER] {
        starts_before_the_fall(figure, &[("replay_falls_prob", "1")]);
        starts_before_the_fall(figure, &[("replay_falls_prob", "1"), ("commander", "adversary")]);
    }
}

#[test]
fn without_the_option_no_figure_does() {
    for figure in [MARATHON_MAN, WALKER] {
        let (mut env, mut step) = begun(figure.id, AGENTS, 5, &[]);
        let ways = fall(figure, &mut env, &mut step, figure.long());
        for (agent, way) in ways.iter().enumerate() {
            let (start, Some(way)) = (env.state(agent).unwrap(), way) else { continue };
            let off = way.iter().skip(figure.alike).all(|state| !figure.is_from(&start, state));
            assert!(off, "{}: agent {agent}", figure.id);
        }
        assert!(ways.iter().flatten().count() > AGENTS / 2, "{}", figure.id);
    }
}
