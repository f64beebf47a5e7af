//! Observations, rewards and terminations agree with the documented formulas, computed by independent software.
//!
//! Each of the suite's own agents executes the same actions from the same starts in this engine (double precision) and
//! in MuJoCo. For MuJoCo, `tests/oracle/agents.py` computes observations, reward terms and terminations in plain
//! Python. Agents with commands, and agents on courses, have their own tests:
//! `a_figure_in_a_plane_is_told_how_fast_to_go` and `a_figure_runs_over_ground_of_its_own`.

use crate::common::{self, action, make, oracle};
use marathon_envs::Autoreset;
use marathon_physics::lanes::Isa;
use serde_json::json;

/// Starts per agent.
const EPISODES: usize = 6;
/// Decisions per start: long enough to fall or step, short enough that chaos stays below the tolerance.
const DECISIONS: usize = 25;
/// Observations are stored in single precision.
const TOLERANCE: f64 = 2e-5;
/// Small, medium and large actions. The last one is clipped and has joints at their limit.
const SCALES: [f32; 3] = [0.1, 0.6, 1.3];

#[test]
fn observations_rewards_and_terminations_agree_with_mujoco() {
    let commanded = |id: &String| !marathon_envs::agent(id).unwrap().facts().command.is_empty();
    let of_its_own = |id: &String| commanded(id) || id.starts_with("Terrain");
    let ids: Vec<String> = common::own_agents().into_iter().filter(|id| !of_its_own(id)).collect();
    let mut request = Vec::new();
    let mut ours = Vec::new();
    for id in &ids {
        let facts = marathon_envs::agent(id).unwrap().facts();
        let mut env = make(id, EPISODES, 1, Some(Isa::F64), Autoreset::Disabled);
        let mut out = env.buffers();
        env.reset(Some(3), &mut out.obs).unwrap();
        let act = env.spec().act;
        let mut episodes = Vec::new();
        for agent in 0..EPISODES {
            let state = env.state(agent).unwrap();
            let mut actions = vec![vec![0.0; act]; DECISIONS];
            for (t, row) in actions.iter_mut().enumerate() {
                action(agent, t, SCALES[agent % SCALES.len()], row);
            }
            episodes.push(json!({ "qpos": state.qpos, "qvel": state.qvel, "actions": actions }));
        }
        let mut steps = Vec::new();
        let mut row = vec![0.0; EPISODES * act];
        for t in 0..DECISIONS {
            for (agent, row) in row.chunks_exact_mut(act).enumerate() {
                action(agent, t, SCALES[agent % SCALES.len()], row);
            }
            env.step(&row, &mut out).unwrap();
            steps.push(out.clone());
        }
        request
            .push(json!({ "id": id, "xml": facts.model.text(), "frame_skip": facts.frame_skip, "episodes": episodes }));
        ours.push((env.spec().clone(), steps));
    }
    let answer = oracle("agents.py", &json!({ "agents": request }));

    let (mut touches, mut failures, mut at_limit) = (0, 0, 0);
    for (a, (spec, steps)) in ours.iter().enumerate() {
        for agent in 0..EPISODES {
            let theirs = answer[a][agent].as_array().expect("an episode");
            assert!(!theirs.is_empty());
            for (t, theirs) in theirs.iter().enumerate() {
                let place = format!("{}, episode {agent}, decision {t}", spec.id);
                let step = &steps[t];
                let numbers = |v: &serde_json::Value| -> Vec<f64> {
                    v.as_array().expect("numbers").iter().map(|x| x.as_f64().expect("a number")).collect()
                };
                let obs = &step.obs[agent * spec.obs..][..spec.obs];
                let expected = numbers(&theirs["obs"]);
                assert_eq!(obs.len(), expected.len(), "{place}");
                for (i, (x, y)) in obs.iter().zip(&expected).enumerate() {
                    close(f64::from(*x), *y, &format!("{place}: observation {i}"));
                }
                let n = spec.reward_terms.len();
                let expected = numbers(&theirs["terms"]);
                assert_eq!(n, expected.len(), "{place}");
                for (i, (x, y)) in step.terms[agent * n..][..n].iter().zip(&expected).enumerate() {
                    close(f64::from(*x), *y, &format!("{place}: term {}", spec.reward_terms[i]));
                    at_limit += usize::from(spec.reward_terms[i] == "joints_at_limit" && *y < 0.0);
                }
                close(f64::from(step.reward[agent]), theirs["reward"].as_f64().unwrap(), &format!("{place}: reward"));
                assert_eq!(step.terminated[agent], theirs["terminated"].as_bool().unwrap(), "{place}: terminated");
                failures += usize::from(step.terminated[agent]);
                touches += usize::from(obs[9] == 1.0);
            }
        }
    }
    // the comparison is meaningful only if these cases occurred
    assert!(
        touches > 100 && failures > 5 && at_limit > 20,
        "{touches} touches, {failures} failures, {at_limit} at limit"
    );
}

fn close(ours: f64, theirs: f64, what: &str) {
    assert!((ours - theirs).abs() <= TOLERANCE * (1.0 + theirs.abs()), "{what}: {ours}, MuJoCo has {theirs}");
}
