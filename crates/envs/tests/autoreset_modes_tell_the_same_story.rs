//! An agent has the same trajectory, bit for bit, in all autoreset modes: reset within the step that ended its episode,
//! at the next step, or by the caller.

use crate::common::{action, make};
use marathon_envs::{Autoreset, Step, VecEnv, VecEnvOptions};

const AGENTS: usize = 21;
const STEPS: usize = 160;
const LIMIT: usize = 40;

/// Events of an agent, in order.
#[derive(Clone, Debug, PartialEq)]
enum Event {
    Begin(Vec<f32>),
    Decision { obs: Vec<f32>, reward: f32, terms: Vec<f32>, forward: f32, terminated: bool, truncated: bool },
}

struct Diary {
    events: Vec<Vec<Event>>,
    /// Number of decisions of each agent. Its next action depends on it.
    decisions: Vec<usize>,
}

impl Diary {
    fn new(env: &VecEnv, first: &[f32]) -> Self {
        let begin = |row: &[f32]| vec![Event::Begin(row.to_vec())];
        Diary { events: first.chunks_exact(env.spec().obs).map(begin).collect(), decisions: vec![0; env.agents()] }
    }

    fn actions(&self, env: &VecEnv) -> Vec<f32> {
        let mut actions = vec![0.0; env.agents() * env.spec().act];
        for (i, row) in actions.chunks_exact_mut(env.spec().act).enumerate() {
            action(i, self.decisions[i], 0.9, row);
        }
        actions
    }

    fn begin(&mut self, agent: usize, obs: &[f32]) {
        let first = row(obs, agent, self.events.len()).to_vec();
        self.events[agent].push(Event::Begin(first));
    }

    fn decide(&mut self, agent: usize, out: &Step) {
        let n = self.events.len();
        self.decisions[agent] += 1;
        self.events[agent].push(Event::Decision {
            obs: row(&out.final_obs, agent, n).to_vec(),
            reward: out.reward[agent],
            terms: row(&out.terms, agent, n).to_vec(),
            forward: out.forward[agent],
            terminated: out.terminated[agent],
            truncated: out.truncated[agent],
        });
    }
}

fn row(array: &[f32], i: usize, n: usize) -> &[f32] {
    let columns = array.len() / n;
    &array[i * columns..(i + 1) * columns]
}

fn ended(out: &Step, agent: usize) -> bool {
    out.terminated[agent] || out.truncated[agent]
}

/// Runs a mode and records every agent's events. Halfway, a snapshot passes through another environment.
fn diary(id: &str, mode: Autoreset, threads: usize) -> Vec<Vec<Event>> {
    let options = VecEnvOptions {
        agents: AGENTS,
        threads,
        autoreset: mode,
        max_episode_steps: Some(LIMIT),
        ..Default::default()
    };
    let mut env = VecEnv::new(id, &options).unwrap();
    assert_eq!(env.spec().max_episode_steps, LIMIT);
    let mut out = env.buffers();
    env.reset(Some(3), &mut out.obs).unwrap();
    let mut diary = Diary::new(&env, &out.obs);
    for step in 0..STEPS {
        if step == STEPS / 2 {
            let snapshot = env.save();
            env = VecEnv::new(id, &options).unwrap();
            env.load(&snapshot).unwrap();
        }
        let before = out.clone();
        env.step(&diary.actions(&env), &mut out).unwrap();
        for i in 0..AGENTS {
            if mode == Autoreset::NextStep && step > 0 && ended(&before, i) {
                assert!(!ended(&out, i) && out.reward[i] == 0.0 && out.forward[i] == 0.0 && !out.diverged[i]);
                assert!(row(&out.terms, i, AGENTS).iter().all(|x| *x == 0.0));
                diary.begin(i, &out.obs);
            } else {
                diary.decide(i, &out);
                if mode == Autoreset::SameStep && ended(&out, i) {
                    diary.begin(i, &out.obs);
                }
            }
        }
        if mode == Autoreset::Disabled {
            let mask: Vec<bool> = (0..AGENTS).map(|i| ended(&out, i)).collect();
            env.reset_agents(&mask, &mut out.obs).unwrap();
            (0..AGENTS).filter(|i| mask[*i]).for_each(|i| diary.begin(i, &out.obs));
        }
    }
    diary.events
}

#[test]
fn every_mode_gives_the_same_lives() {
    for id in ["hopper", "ant"] {
        let reference = diary(id, Autoreset::Disabled, 1);
        let begins = reference.iter().flatten().filter(|e| matches!(e, Event::Begin(_))).count();
        let truncated =
            reference.iter().flatten().filter(|e| matches!(e, Event::Decision { truncated: true, .. })).count();
        assert!(begins > 2 * AGENTS && truncated > 0, "{id}: {begins} episodes, {truncated} truncated");
        for (mode, threads) in [(Autoreset::SameStep, 1), (Autoreset::NextStep, 1), (Autoreset::NextStep, 2)] {
            for (agent, (a, b)) in diary(id, mode, threads).iter().zip(&reference).enumerate() {
                // a mode that spends steps on resets covers fewer events
                let n = a.len().min(b.len());
                assert!(n > STEPS / 2 && a[..n] == b[..n], "{id}, {mode:?}: agent {agent} lived another life");
            }
        }
    }
}

/// With its own seed, an agent equals the only agent of an environment with that seed.
#[test]
fn an_agent_can_have_a_seed_of_its_own() {
    let mut many = make("walker", 19, 2, None, Autoreset::SameStep);
    let mut out = many.buffers();
    many.reset(Some(1), &mut out.obs).unwrap();
    let before = out.obs.clone();
    let mut mask = vec![false; 19];
    mask[17] = true;
    many.reseed_agent(17, 42, 0).unwrap();
    many.reset_agents(&mask, &mut out.obs).unwrap();

    let mut alone = make("walker", 1, 1, None, Autoreset::SameStep);
    let mut first = alone.buffers();
    alone.reset(Some(42), &mut first.obs).unwrap();
    let columns = first.obs.len();
    assert_eq!(out.obs[17 * columns..18 * columns], first.obs);
    assert_eq!(out.obs[..17 * columns], before[..17 * columns]);
    assert!(many.reseed_agent(19, 0, 0).is_err());
}

/// After a state is set, its observation is that of an episode that begins there.
#[test]
fn a_state_that_was_set_can_be_observed() {
    let mut env = make("humanoid", 18, 1, None, Autoreset::SameStep);
    let mut out = env.buffers();
    env.reset(Some(1), &mut out.obs).unwrap();
    let (first, state) = (out.obs.clone(), env.state(17).unwrap());
    let actions = vec![0.5; 18 * env.spec().act];
    for _ in 0..5 {
        env.step(&actions, &mut out).unwrap();
    }
    env.set_state(17, &state).unwrap();
    let mut mask = vec![false; 18];
    mask[17] = true;
    let stepped = out.obs.clone();
    env.observe(&mask, &mut out.obs).unwrap();
    let columns = env.spec().obs;
    assert_eq!(out.obs[17 * columns..], first[17 * columns..]);
    assert_eq!(out.obs[..17 * columns], stepped[..17 * columns]);
}
