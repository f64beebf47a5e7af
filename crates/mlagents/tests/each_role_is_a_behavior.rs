//! The trainer sees each role of a task as a behavior with its own part of the observations, actions and rewards, and
//! its own agent numbers. A role that skips decisions has infos when it decides and when an episode ends. In between,
//! its last action stays, and its rewards are summed. The test compares everything with the task in a `VecEnv`.

use crate::common::{FakeTrainer, act, close, listen, reset};
use crate::tag;
use marathon_envs::{Autoreset, Options, Step, VecEnv, VecEnvOptions};
use marathon_mlagents::channels::PARAMETERS;
use marathon_mlagents::wire::{AgentInfo, AgentInfoList, UnityMessage};
use marathon_mlagents::{Behavior, BehaviorOptions, Log, Parameters, Player, PlayerError, PlayerOptions};
use prost::Message;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::thread;

const RUNNER: &str = "Tag-v0?team=0";
const OPPONENT: &str = "Tag-v0.opponent?team=0";
const AGENTS: usize = 5;
const SEED: i32 = 7;

fn tags(agents: usize) -> BehaviorOptions {
    tag::register_tag();
    BehaviorOptions { env: "Tag-v0".into(), agents, ..Default::default() }
}

/// Runs a conversation between a trainer and a player until one of them ends it. Returns the player's log.
fn converse(
    name: &str,
    fresh_ids: bool,
    trainer: impl FnOnce(FakeTrainer) + Send + 'static,
) -> (Result<(), PlayerError>, String) {
    converse_about(tags(AGENTS), name, fresh_ids, trainer)
}

/// The same for any task.
fn converse_about(
    task: BehaviorOptions,
    name: &str,
    fresh_ids: bool,
    trainer: impl FnOnce(FakeTrainer) + Send + 'static,
) -> (Result<(), PlayerError>, String) {
    let (port, accept) = listen();
    let trainer = thread::spawn(move || trainer(accept()));
    let options = PlayerOptions { port, behaviors: vec![task], fresh_ids, ..Default::default() };
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.log"));
    let log = Log::to_file(&path).expect("a log");
    let result = Player::connect(&options, log).and_then(|mut player| player.run());
    trainer.join().expect("the trainer is content");
    (result, std::fs::read_to_string(path).expect("a log"))
}

/// Infos of a behavior.
fn infos(message: &UnityMessage, name: &str) -> Vec<AgentInfo> {
    let rl = message.output.as_ref().and_then(|output| output.rl.as_ref()).expect("infos");
    AgentInfoList::decode(&rl.agent_infos[name][..]).expect("a list").value
}

/// Number of agents of a behavior that wait for an action.
fn waiting(message: &UnityMessage, name: &str) -> usize {
    infos(message, name).iter().filter(|info| !info.done).count()
}

fn numbers(info: &AgentInfo) -> &[f32] {
    &info.observations[0].float_data.as_ref().expect("numbers").data
}

/// Chooses an action for every waiting agent.
fn anything(message: &UnityMessage, side_channel: Vec<u8>) -> UnityMessage {
    let rows = |name| vec![vec![0.3, -0.2]; waiting(message, name)];
    act(&[(RUNNER, rows(RUNNER)), (OPPONENT, rows(OPPONENT))], side_channel)
}

/// An environment parameter message of the trainer.
fn parameter(name: &str, value: f32) -> Vec<u8> {
    let text = [&(name.len() as i32).to_le_bytes()[..], name.as_bytes()].concat();
    let payload = [&text[..], &0i32.to_le_bytes(), &value.to_le_bytes()].concat();
    [&PARAMETERS[..], &(payload.len() as i32).to_le_bytes(), &payload].concat()
}

/// The same task without a trainer.
struct Truth {
    env: VecEnv,
    out: Step,
    actions: Vec<f32>,
    ended: Vec<bool>,
    asked: Vec<bool>,
    earned: Vec<f32>,
}

impl Truth {
    fn new() -> Self {
        let options = VecEnvOptions { agents: AGENTS, autoreset: Autoreset::Disabled, ..Default::default() };
        let env = VecEnv::new("Tag-v0", &options).expect("the task");
        let mut truth = Truth {
            out: env.buffers(),
            actions: vec![0.0; AGENTS * 4],
            ended: vec![false; AGENTS],
            asked: vec![true; AGENTS],
            earned: vec![0.0; AGENTS],
            env,
        };
        truth.reset(Some(SEED as u64));
        truth
    }

    fn reset(&mut self, seed: Option<u64>) {
        self.env.reset(seed, &mut self.out.obs).expect("a start");
        self.ended.fill(false);
        self.asked.fill(true);
        self.earned.fill(0.0);
        self.out.reward.fill(0.0);
    }

    /// Chooses by agent and decision: the rows of the runners, and those of the opponents that decide.
    fn choose(&mut self, decision: usize) -> [Vec<Vec<f32>>; 2] {
        let wave = |i: usize, a: usize| ((decision * 7 + i * 3 + a * 5) as f32).sin();
        let mut rows = [Vec::new(), Vec::new()];
        for (i, own) in self.actions.chunks_exact_mut(4).enumerate() {
            for (role, rows) in rows.iter_mut().enumerate().filter(|(role, _)| *role == 0 || self.asked[i]) {
                let row = vec![wave(i, 2 * role), wave(i, 2 * role + 1)];
                own[2 * role..][..2].copy_from_slice(&row);
                rows.push(row);
            }
        }
        rows
    }

    fn step(&mut self) {
        self.env.step(&self.actions, &mut self.out).expect("a decision");
        for (i, earned) in self.earned.iter_mut().enumerate() {
            self.ended[i] = self.out.terminated[i] || self.out.truncated[i];
            *earned += self.out.terms[3 * i + 1] + self.out.terms[3 * i + 2];
        }
        self.env.reset_agents(&self.ended, &mut self.out.obs).expect("a start");
        self.env.decides(1, &mut self.asked).expect("a role");
    }

    /// Compares the messages of both roles.
    fn check(&mut self, message: &UnityMessage) {
        for (role, name) in [RUNNER, OPPONENT].into_iter().enumerate() {
            // home and two balls, or only the balls
            let seen = |all: &[f32], i: usize| all[9 * i + role..9 * (i + 1)].to_vec();
            let mut told = infos(message, name).into_iter();
            for i in 0..AGENTS {
                let reward = if role == 0 { self.out.reward[i] } else { self.earned[i] };
                let expect = |info: Option<AgentInfo>, done: bool, reward: f32, obs: Vec<f32>| {
                    let info = info.expect("an info");
                    assert_eq!(info.id, (role * AGENTS + i) as i32);
                    assert_eq!((info.done, numbers(&info)), (done, &obs[..]));
                    assert_eq!(info.max_step_reached, done && self.out.truncated[i]);
                    assert!((info.reward - reward).abs() < 1e-6, "{name} {i}: {} {reward}", info.reward);
                };
                if self.ended[i] {
                    expect(told.next(), true, reward, seen(&self.out.final_obs, i));
                    expect(told.next(), false, 0.0, seen(&self.out.obs, i));
                } else if role == 0 || self.asked[i] {
                    expect(told.next(), false, reward, seen(&self.out.obs, i));
                }
            }
            assert_eq!(told.next(), None);
        }
        for i in (0..AGENTS).filter(|i| self.asked[*i]) {
            self.earned[i] = 0.0;
        }
    }
}

#[test]
fn roles_see_do_and_earn_what_is_theirs() {
    let (result, log) = converse("roles", false, |mut trainer| {
        trainer.greet(SEED, 1);
        trainer.answer(&reset(Vec::new()));
        let mut truth = Truth::new();
        let mut message = trainer.receive().expect("first observations");
        let brains = &message.output.as_ref().unwrap().initialization.as_ref().unwrap().brain_parameters;
        let told: Vec<_> =
            brains.iter().map(|b| (b.brain_name.as_str(), b.action_spec.as_ref().unwrap().num_continuous)).collect();
        assert_eq!(told, [(RUNNER, 2), (OPPONENT, 2)]);
        truth.check(&message);
        let (mut alone, mut together, mut falls, mut late) = (0, 0, 0, 0);
        for decision in 0..150 {
            if decision == 70 {
                // a reset within episodes: all decide, and earlier rewards are dropped
                trainer.answer(&reset(Vec::new()));
                truth.reset(None);
            } else {
                let [runners, opponents] = truth.choose(decision);
                match opponents.len() {
                    // Python leaves out a behavior without waiting agents
                    0 => trainer.answer(&act(&[(RUNNER, runners)], Vec::new())),
                    _ => trainer.answer(&act(&[(RUNNER, runners), (OPPONENT, opponents)], Vec::new())),
                }
                truth.step();
            }
            message = trainer.receive().expect("a decision");
            truth.check(&message);
            falls += truth.out.terminated.iter().filter(|fell| **fell).count();
            late += truth.out.truncated.iter().filter(|late| **late).count();
            match waiting(&message, OPPONENT) {
                0 => alone += 1,
                n => together += usize::from(n < AGENTS),
            }
        }
        assert!(alone > 3 && together > 50 && falls > 0 && late > 5, "{alone} {together} {falls} {late}");
        trainer.answer(&close());
    });
    result.unwrap();
    assert!(log.contains(&format!("{RUNNER}: agents: 5; observations: 9; actions: 2")), "{log}");
    assert!(log.contains(&format!("{OPPONENT}: agents: 5; observations: 8; actions: 2")), "{log}");
}

/// A role whose part ends before the episode is then done, with its observations and rewards up to that point. It has
/// no infos before the next episode.
#[test]
fn a_role_that_leaves_is_done() {
    const ROLES: [&str; 3] =
        ["TerrainWalker2d-v0?team=0", "TerrainWalker2d-v0.builder?team=0", "TerrainWalker2d-v0.reference?team=0"];
    let given = Options::new().with("course", "adversary").with("builder", "regret");
    let task = BehaviorOptions {
        env: "TerrainWalker2d-v0".into(),
        agents: AGENTS,
        options: given.clone(),
        ..Default::default()
    };
    let (result, _) = converse_about(task, "leaves", false, move |mut trainer| {
        trainer.greet(SEED, 1);
        trainer.answer(&reset(Vec::new()));
        let options =
            VecEnvOptions { agents: AGENTS, autoreset: Autoreset::Disabled, options: given, ..Default::default() };
        let mut env = VecEnv::new("TerrainWalker2d-v0", &options).expect("the task");
        let (spec, mut out) = (env.spec().clone(), env.buffers());
        env.reset(Some(SEED as u64), &mut out.obs).expect("a start");
        let mut actions = vec![0.0; AGENTS * spec.act];
        let (mut decides, mut left) = ([[true; AGENTS]; 3], [false; AGENTS]);
        let (mut earned, mut done) = ([[0.0_f32; AGENTS]; 3], [0; 3]);
        let mut message = trainer.receive().expect("first observations");
        for decision in 0..1500 {
            let rows = |role: usize| {
                let asked = (0..AGENTS).filter(|i| decides[role][*i]);
                let wave = |i: usize, a: usize| ((decision * 3 + i * 5 + role + 7 * a) as f32).sin();
                asked
                    .map(|i| (i, (0..spec.roles[role].act.len()).map(|a| wave(i, a)).collect::<Vec<f32>>()))
                    .collect::<Vec<_>>()
            };
            let chosen = [0, 1, 2].map(rows);
            for (role, rows) in spec.roles.iter().zip(&chosen) {
                rows.iter().for_each(|(i, row)| actions[spec.act * i..][role.act.clone()].copy_from_slice(row));
            }
            let told = ROLES.into_iter().zip(chosen).filter(|(_, rows)| !rows.is_empty());
            let told: Vec<_> =
                told.map(|(name, rows)| (name, rows.into_iter().map(|(_, row)| row).collect())).collect();
            trainer.answer(&act(&told, Vec::new()));
            env.step(&actions, &mut out).expect("a decision");
            let over: Vec<bool> = out.terminated.iter().zip(&out.truncated).map(|(a, b)| *a || *b).collect();
            let (mut failed, mut finished) = ([false; AGENTS], [false; AGENTS]);
            env.leaves(0, [&mut failed, &mut finished]).expect("a role");
            env.reset_agents(&over, &mut out.obs).expect("a start");
            message = trainer.receive().expect("a decision");
            for (number, (role, name)) in spec.roles.iter().zip(ROLES).enumerate() {
                env.decides(number, &mut decides[number]).expect("a role");
                let mut told = infos(&message, name).into_iter();
                for i in 0..AGENTS {
                    let terms = &out.terms[spec.reward_terms.len() * i..];
                    earned[number][i] += terms[role.terms.clone()].iter().sum::<f32>();
                    let leaves = number == 0 && (failed[i] || finished[i]);
                    if leaves || over[i] && !(number == 0 && left[i]) {
                        let info = told.next().expect("an end");
                        assert!(
                            info.done && (info.reward - earned[number][i]).abs() < 1e-3,
                            "{name} {i}: {}",
                            info.reward
                        );
                        assert_eq!(info.max_step_reached, if leaves { finished[i] } else { out.truncated[i] });
                        assert_eq!(numbers(&info), &out.final_obs[spec.obs * i..][role.obs.clone()]);
                        done[number] += 1;
                    }
                    if over[i] || leaves {
                        earned[number][i] = 0.0;
                    }
                    if decides[number][i] {
                        assert!(!told.next().expect("a state").done);
                        earned[number][i] = 0.0;
                    }
                }
                assert_eq!(told.next(), None, "{name}, decision {decision}");
            }
            for i in 0..AGENTS {
                left[i] = (left[i] || failed[i] || finished[i]) && !over[i];
            }
        }
        assert!(done[1] == done[2] && done[1] > 5 && (done[1]..=done[1] + AGENTS).contains(&done[0]), "{done:?}");
        assert_eq!(waiting(&message, ROLES[0]), decides[0].iter().filter(|decides| **decides).count());
        trainer.answer(&close());
    });
    result.unwrap();
}

#[test]
fn a_role_that_is_asked_and_says_nothing_rests() {
    let (result, _) = converse("rest", false, |mut trainer| {
        trainer.greet(SEED, 1);
        trainer.answer(&reset(Vec::new()));
        let mut truth = Truth::new();
        trainer.receive();
        for decision in 0..12 {
            let [runners, opponents] = truth.choose(decision);
            // half of the time the opponents get no actions
            let speaks = decision % 2 == 0;
            for (own, _) in truth.actions.chunks_exact_mut(4).zip(&truth.asked).filter(|(_, asked)| **asked && !speaks)
            {
                own[2..].fill(0.0);
            }
            let opponents = Some((OPPONENT, opponents)).filter(|(_, rows)| speaks && !rows.is_empty());
            let chosen: Vec<_> = [(RUNNER, runners)].into_iter().chain(opponents).collect();
            trainer.answer(&act(&chosen, Vec::new()));
            truth.step();
            truth.check(&trainer.receive().expect("a decision"));
        }
        trainer.answer(&close());
    });
    result.unwrap();
}

#[test]
fn actions_for_others_than_those_that_were_asked_are_refused() {
    for (opponents, length) in [(AGENTS, 2), (AGENTS, 3)] {
        let (result, _) = converse(&format!("refused-{length}"), false, move |mut trainer| {
            trainer.greet(SEED, 1);
            trainer.answer(&reset(Vec::new()));
            let mut message = trainer.receive().expect("first observations");
            while waiting(&message, OPPONENT) > 0 {
                trainer.answer(&anything(&message, Vec::new()));
                message = trainer.receive().expect("a decision");
            }
            let rows = |n, length| vec![vec![0.5; length]; n];
            trainer.answer(&act(&[(RUNNER, rows(AGENTS, 2)), (OPPONENT, rows(opponents, length))], Vec::new()));
            trainer.receive();
        });
        let expected = format!("received {opponents} actions of {length} numbers for {OPPONENT}, expected 0 of 2");
        assert_eq!(result.unwrap_err().to_string(), expected);
    }
}

#[test]
fn no_two_agents_have_the_same_number() {
    let (result, _) = converse("fresh", true, |mut trainer| {
        trainer.greet(SEED, 2);
        trainer.answer(&reset(Vec::new()));
        let mut message = trainer.receive().expect("first observations");
        // by behavior, the numbers of the current agents, and of all agents so far
        let mut living: BTreeMap<&str, BTreeSet<i32>> = BTreeMap::new();
        let mut all = BTreeSet::new();
        for _ in 0..80 {
            for name in [RUNNER, OPPONENT] {
                let living = living.entry(name).or_default();
                for info in infos(&message, name) {
                    if info.done {
                        assert!(living.remove(&info.id), "{name} {}", info.id);
                    } else if living.insert(info.id) {
                        assert!(all.insert(info.id), "{name} {}", info.id);
                    }
                }
                assert_eq!(living.len(), 2 * AGENTS);
            }
            trainer.answer(&anything(&message, Vec::new()));
            message = trainer.receive().expect("a decision");
        }
        assert!(all.len() > 8 * AGENTS && all.first() == Some(&0), "{all:?}");
        trainer.answer(&close());
    });
    result.unwrap();
}

#[test]
fn parameters_that_would_change_the_roles_are_refused_by_name() {
    let (result, log) = converse("parameters", false, |mut trainer| {
        trainer.greet(SEED, 1);
        trainer.answer(&reset(Vec::new()));
        let mut message = trainer.receive().expect("first observations");
        let mut asked = Vec::new();
        for decision in 0..28 {
            let said = match decision {
                // the opponent decides more often; later changes would remove its role, or the opponent
                5 => parameter("period", 2.0),
                10 => parameter("roles", 0.0),
                12 => [parameter("roles", f32::NAN), parameter("opponent", 0.0)].concat(),
                14 => parameter("opponent", f32::NAN),
                _ => Vec::new(),
            };
            trainer.answer(&anything(&message, said));
            message = trainer.receive().expect("a decision");
            asked.push(waiting(&message, OPPONENT));
        }
        let sum = |range: std::ops::Range<usize>| asked[range].iter().sum::<usize>();
        assert!(sum(0..5) <= 2 * AGENTS && sum(16..28) >= 6 * AGENTS - 2, "{asked:?}");
        trainer.answer(&close());
    });
    result.unwrap();
    let expected = format!(
        "would change the roles of {RUNNER} from runner (9 observations, 2 actions, 1 terms of the reward), opponent (8 \
         observations, 2 actions, 2 terms of the reward) to one role (9 observations, 4 actions, 3 terms of the reward)"
    );
    assert!(log.contains(&expected), "{log}");
    assert!(log.contains(&format!("would change {RUNNER} from 9 observations and 4 actions to 9 and 2")), "{log}");
    assert_eq!(log.matches("warning").count(), 2, "{log}");
}

#[test]
fn the_longest_message_is_foreseen_and_statistics_have_the_roles_names() {
    let mut behavior = Behavior::new(&BehaviorOptions { max_episode_steps: Some(1), ..tags(300) }, 1, 1, 40).unwrap();
    assert_eq!(behavior.names().collect::<Vec<_>>(), [RUNNER, OPPONENT]);
    assert_eq!((behavior.name(), behavior.ids()), (RUNNER, 600));
    let none = Parameters::default();
    behavior.reset(Some(1), &none).unwrap();
    let (mut infos, mut stats) = (BTreeMap::new(), Vec::new());
    behavior.report(&mut infos, &mut stats, None);
    assert!(stats.is_empty());
    behavior.step(&BTreeMap::new(), &none).unwrap();
    behavior.report(&mut infos, &mut stats, None);
    assert!(infos.values().all(|list| AgentInfoList::decode(&**list).unwrap().value.len() == 600));
    let length: usize = infos.iter().map(|(name, list)| name.len() + list.len()).sum();
    let foreseen = behavior.largest();
    assert!(length < foreseen && length > foreseen * 9 / 10, "{length} {foreseen}");
    assert!(behavior.most_agents(foreseen) == 300 && behavior.most_agents(foreseen / 2) < 150);
    let text = String::from_utf8_lossy(&stats);
    for (name, there) in [
        ("Tag-v0/Speed", true),
        ("Tag-v0/Reward/home", true),
        ("Tag-v0.opponent/Reward/far", true),
        ("Tag-v0.opponent/Reward/close", true),
        ("Tag-v0/Reward/far", false),
        ("Tag-v0.opponent/Speed", false),
    ] {
        assert_eq!(text.contains(name), there, "{name}");
    }
}

#[test]
fn a_name_that_a_role_has_is_taken() {
    let hopper = BehaviorOptions { agents: 1, name: Some("Tag-v0.opponent".into()), ..Default::default() };
    for behaviors in [vec![tags(1), hopper.clone()], vec![hopper, tags(1)]] {
        let options = PlayerOptions { behaviors, ..Default::default() };
        let error = Player::connect(&options, Log::to_stderr()).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains("two behaviors are called 'Tag-v0.opponent'"), "{error}");
    }
}
