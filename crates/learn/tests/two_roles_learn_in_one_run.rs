//! Two learners in one run: a runner that is rewarded for staying at home, and an opponent that pushes it away. Each
//! role has its own policy, statistics and settings, and random streams that do not depend on the other's. If the
//! opponent's actions have no effect, the runner learns to the bit what it learns alone. A role that skips decisions
//! keeps its last action. Threads, widths and interruptions do not change any role's bits.

use std::sync::Arc;

use crate::common::silent;
use marathon_envs::{
    Agent, BLOCK, BlockStep, EnvError, Facts, Obs, Part, Registry, ResetNoise, RoleFacts, Senses, Shard, ShardFactory,
    Spec, Start, Terms, names,
};
use marathon_learn::{
    Activation, Algorithm, Checkpoint, Control, Error, EvalOptions, IterationStats, Policy, RoleConfig, Sac, Snapshot,
    TrainConfig, TrainOutput, evaluate_roles, train,
};
use marathon_physics::lanes::{Isa, Real};

/// Two balls that slide in a plane.
const MODEL: &str = r#"
<mujoco model="tag">
  <option timestep="0.01"/>
  <default>
    <joint type="slide" damping="1"/>
    <geom type="sphere" size="0.15" mass="1"/>
  </default>
  <worldbody>
    <body name="runner" pos="0 0 0.2">
      <joint name="runner_x" axis="1 0 0"/>
      <joint name="runner_y" axis="0 1 0"/>
      <geom name="runner"/>
    </body>
    <body name="opponent" pos="0.4 0.1 0.2">
      <joint name="opponent_x" axis="1 0 0"/>
      <joint name="opponent_y" axis="0 1 0"/>
      <geom name="opponent"/>
    </body>
  </worldbody>
  <actuator>
    <motor name="run_x" joint="runner_x" gear="1.5"/>
    <motor name="run_y" joint="runner_y" gear="1.5"/>
    <motor name="push_x" joint="opponent_x" gear="6"/>
    <motor name="push_y" joint="opponent_y" gear="6"/>
  </actuator>
</mujoco>"#;

const PARTS: [&str; 2] = ["runner", "opponent"];
const RUNNER: Part = Part::named(&PARTS, "runner");
const OPPONENT: Part = Part::named(&PARTS, "opponent");

/// Decisions of the runner per decision of a slow opponent.
const PERIOD: f64 = 4.0;

#[derive(Clone, Copy, Default)]
struct Tag {
    /// The opponent skips decisions.
    slow: bool,
}

impl Agent for Tag {
    fn facts(&self) -> Facts {
        let role = |name: &str, seen: &[&str], moves: &[&str], earns: &[&str], intermittent| RoleFacts {
            name: name.into(),
            observations: names(seen),
            actions: names(moves),
            reward_terms: names(earns),
            intermittent,
        };
        Facts {
            id: "Tag-v0".into(),
            summary: "a runner that stays at home, and an opponent that pushes it away".into(),
            model: MODEL.into(),
            frame_skip: 4,
            max_episode_steps: 100,
            actions: names(["run_x", "run_y", "push_x", "push_y"]),
            reward_terms: names(["home", "far", "close"]),
            parts: names(PARTS),
            memory: 1,
            roles: vec![
                role("runner", &["home", "runner", "opponent"], &["run_x", "run_y"], &["home"], false),
                role("opponent", &["runner", "opponent"], &["push_x", "push_y"], &["far", "close"], self.slow),
            ],
            termination_reward: None,
            ..Facts::default()
        }
    }

    fn reset(&self, start: &mut Start) {
        start.add_noise(ResetNoise { joint_position: 0.15, joint_velocity: 0.1, root_velocity: 0.0 });
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.group("home");
        out.scalar(distance(s.position(RUNNER), [T::zero(); 3]));
        for (name, part) in [("runner", RUNNER), ("opponent", OPPONENT)] {
            out.group(name);
            let (p, v) = (s.position(part), s.linear_velocity(part));
            [p[0], p[1], v[0], v[1]].into_iter().for_each(|x| out.scalar(x));
        }
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        let away = distance(s.position(RUNNER), [T::zero(); 3]);
        terms.add("home", -1.0, away);
        terms.add("far", 1.0, away);
        terms.add("close", -0.2, distance(s.position(RUNNER), s.position(OPPONENT)));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        s.terminate_never()
    }

    #[inline(always)]
    fn remember<T: Real>(&self, _: &Senses<T>, memory: &mut [T]) {
        let next = memory[0] + T::lit(1.0);
        memory[0] = T::masked(next.lt(T::lit(PERIOD)), next);
    }

    #[inline(always)]
    fn decides<T: Real>(&self, s: &Senses<T>, role: usize) -> T::Mask {
        match role {
            1 if self.slow => s.memory(0).lt(T::lit(0.5)),
            _ => T::not(T::none()),
        }
    }
}

/// Distance of two positions in the plane, m, at most 1.
#[inline(always)]
fn distance<T: Real>(a: [T; 3], b: [T; 3]) -> T {
    let (x, y) = (a[0] - b[0], a[1] - b[1]);
    x.mul_add(x, y * y).sqrt().min(T::lit(1.0))
}

fn tag(slow: bool, isa: Isa) -> Arc<dyn ShardFactory> {
    let mut registry = Registry::empty();
    registry.register(Arc::new(Tag { slow })).unwrap();
    registry.shards("Tag-v0", isa).unwrap()
}

/// Effect of the opponent's actions.
#[derive(Clone, Copy, PartialEq)]
enum Opponent {
    /// No effect.
    Powerless,
    /// There is no such role.
    Absent,
}

/// The task with another opponent.
struct Without {
    task: Arc<dyn ShardFactory>,
    spec: Spec,
    opponent: Opponent,
}

impl Without {
    fn new(opponent: Opponent) -> Self {
        let task = tag(false, Isa::best());
        let whole = task.spec();
        let spec = match opponent {
            Opponent::Powerless => whole.clone(),
            Opponent::Absent => whole.of_role(&whole.roles[0]),
        };
        Self { spec, task, opponent }
    }
}

impl ShardFactory for Without {
    fn spec(&self) -> &Spec {
        &self.spec
    }
    fn shard(&self, first: usize, blocks: usize, seed: u64) -> Box<dyn Shard> {
        let shard = self.task.shard(first, blocks, seed);
        let whole = vec![0.0; self.task.spec().obs * BLOCK];
        Box::new(WithoutShard { shard, spec: self.spec.clone(), opponent: self.opponent, whole })
    }
}

struct WithoutShard {
    shard: Box<dyn Shard>,
    spec: Spec,
    opponent: Opponent,
    whole: Vec<f32>,
}

impl WithoutShard {
    fn see(&self, obs: &mut [f32]) {
        let n = obs.len();
        obs.copy_from_slice(&self.whole[..n]);
    }
}

impl Shard for WithoutShard {
    fn spec(&self) -> &Spec {
        &self.spec
    }
    fn blocks(&self) -> usize {
        self.shard.blocks()
    }
    fn reset(&mut self, block: usize, mask: u16, obs: &mut [f32]) {
        let n = obs.len();
        self.whole[..n].copy_from_slice(obs);
        self.shard.reset(block, mask, &mut self.whole);
        self.see(obs);
    }
    fn step(&mut self, block: usize, action: &[f32], obs: &mut [f32], out: &mut BlockStep) {
        let mut all = vec![0.0; 4 * BLOCK];
        all[..2 * BLOCK].copy_from_slice(&action[..2 * BLOCK]);
        self.shard.step(block, &all, &mut self.whole, out);
        if self.opponent == Opponent::Absent {
            out.terms.truncate(BLOCK);
        }
        self.see(obs);
    }
    fn save(&self, block: usize, bytes: &mut Vec<u8>) {
        self.shard.save(block, bytes);
    }
    fn load<'a>(&mut self, block: usize, bytes: &'a [u8]) -> Result<&'a [u8], EnvError> {
        self.shard.load(block, bytes)
    }
}

fn config() -> TrainConfig {
    TrainConfig::default().with(|c| {
        c.run.agents = 48;
        c.run.horizon = 30;
        c.run.total_steps = 4 * 48 * 30;
        c.network.hidden = vec![13, 8];
        c.network.critic_hidden = Some(vec![16]);
        c.run.threads = 1;
    })
}

/// With separate settings for the opponent.
fn with_roles() -> TrainConfig {
    config().with(|c| {
        let mut own = RoleConfig::from(c.clone());
        own.network.hidden = vec![9];
        own.network.activation = Activation::Relu;
        own.algorithm = Algorithm::A2c(Default::default());
        c.roles.insert("opponent".into(), own);
    })
}

fn run(task: &dyn ShardFactory, config: &TrainConfig) -> TrainOutput {
    train(task, Isa::best(), config, None, &mut silent).unwrap()
}

fn policies(output: &TrainOutput) -> (&[f32], &[f32]) {
    (output.policy.params(), output.others[0].1.params())
}

#[test]
fn each_role_has_a_policy_with_its_own_settings() {
    let output = run(&*tag(false, Isa::best()), &with_roles());
    let [(name, other)] = &output.others[..] else { panic!("one other role") };
    let (meta, opponents) = (output.policy.meta(), other.meta());
    assert_eq!((meta.agent.as_str(), meta.obs, meta.act), ("Tag-v0/runner", 9, 2));
    assert_eq!(
        (name.as_str(), opponents.agent.as_str(), opponents.obs, opponents.act),
        ("opponent", "Tag-v0/opponent", 8, 2)
    );
    // it also plays the single-role task, but no task of another name, and not as another role
    let whole = tag(false, Isa::best()).spec().clone();
    let alone = Spec { id: "Tag-v0".into(), ..whole.of_role(&whole.roles[0]) };
    assert!(output.policy.check(&alone).is_ok() && output.policy.check(&whole.of_role(&whole.roles[0])).is_ok());
    let others = [Spec { id: "Catch-v0".into(), ..alone.clone() }, Spec { obs: 8, ..alone }, whole.clone()];
    assert!(others.iter().all(|spec| output.policy.check(spec).is_err()));
    assert!(output.policy.check(&whole.of_role(&whole.roles[1])).is_err());
    assert_eq!((&meta.hidden[..], &opponents.hidden[..]), (&[13, 8][..], &[9][..]));
    let last = output.last.unwrap();
    let [(_, learned)] = &last.others[..] else { panic!("one other role") };
    assert_eq!((last.learned.reward_terms.len(), learned.reward_terms.len()), (1, 2));
    // the runner's loss is the opponent's gain, except for the opponent's cost of distance
    assert!((last.learned.reward_terms[0] + learned.reward_terms[0]).abs() < 1e-6);
    assert!(learned.reward_terms[1] < 0.0);
}

#[test]
fn an_opponent_whose_actions_come_to_nothing_changes_no_bit() {
    let alone = run(&Without::new(Opponent::Absent), &config());
    let beside = run(&Without::new(Opponent::Powerless), &config());
    assert_eq!(alone.policy, beside.policy.clone());
    assert_eq!(alone.others, []);
    // a powerful opponent does
    assert_ne!(alone.policy.params(), run(&*tag(false, Isa::best()), &config()).policy.params());
}

#[test]
fn threads_and_widths_show_in_no_bit() {
    for slow in [false, true] {
        let want = run(&*tag(slow, Isa::best()), &with_roles());
        let threads = with_roles().with(|c| c.run.threads = 3);
        let many = run(&*tag(slow, Isa::best()), &threads);
        assert_eq!(policies(&want), policies(&many));
        for isa in [Isa::X4, Isa::X8].into_iter().filter(|isa| isa.supported()) {
            let output = train(&*tag(slow, isa), isa, &with_roles(), None, &mut silent).unwrap();
            assert_eq!(policies(&want), policies(&output), "{}", isa.name());
        }
    }
}

#[test]
fn a_run_goes_on_from_its_checkpoint_with_the_same_bits() {
    for config in [with_roles(), with_roles().with(|c| c.run.agents = 4)] {
        let config = config.with(|c| c.run.total_steps = (4 * c.run.agents * c.run.horizon) as u64);
        let task = tag(true, Isa::best());
        let whole = run(&*task, &config);
        let mut once = |_: &IterationStats, _: &Snapshot<'_>| Control::Stop;
        let part = train(&*task, Isa::best(), &config, None, &mut once).unwrap();
        let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
        part.checkpoint.save(folder.path()).unwrap();
        let loaded = Checkpoint::load(folder.path()).unwrap();
        let rest = train(&*task, Isa::best(), &config, Some(loaded), &mut silent).unwrap();
        assert_eq!(policies(&whole), policies(&rest));
    }
}

/// A checkpoint is refused for a task of the same name with other roles.
#[test]
fn a_checkpoint_without_the_role_is_refused() {
    let mut once = |_: &IterationStats, _: &Snapshot<'_>| Control::Stop;
    let two = train(&*tag(false, Isa::best()), Isa::best(), &config(), None, &mut once).unwrap();
    let mut other = Without::new(Opponent::Powerless);
    other.spec.roles[1].name = "pusher".into();
    let error = train(&other, Isa::best(), &config(), Some(two.checkpoint), &mut silent).unwrap_err().to_string();
    assert_eq!(error, "checkpoint: roles but the first is for opponent, expected pusher");
}

/// While it does not decide, the environment gets the actions of the last decision.
#[test]
fn a_slow_role_goes_on_with_its_last_action() {
    struct Watch(Arc<dyn ShardFactory>);
    struct WatchShard(Box<dyn Shard>, Vec<f32>, u64);
    impl ShardFactory for Watch {
        fn spec(&self) -> &Spec {
            self.0.spec()
        }
        fn shard(&self, first: usize, blocks: usize, seed: u64) -> Box<dyn Shard> {
            Box::new(WatchShard(self.0.shard(first, blocks, seed), vec![0.0; blocks * 4 * BLOCK], 0))
        }
    }
    impl Shard for WatchShard {
        fn spec(&self) -> &Spec {
            self.0.spec()
        }
        fn blocks(&self) -> usize {
            self.0.blocks()
        }
        fn reset(&mut self, block: usize, mask: u16, obs: &mut [f32]) {
            self.0.reset(block, mask, obs);
        }
        fn announce(&mut self, actions: &[f32]) {
            // all episodes start together, and last 25 periods
            let fresh = self.2.is_multiple_of(PERIOD as u64);
            for (now, before) in actions.chunks(4 * BLOCK).zip(self.1.chunks(4 * BLOCK)) {
                assert_ne!(now[..2 * BLOCK], before[..2 * BLOCK]);
                assert_eq!(now[2 * BLOCK..] == before[2 * BLOCK..], !fresh, "decision {}", self.2);
            }
            self.1.copy_from_slice(actions);
            self.2 += 1;
        }
        fn step(&mut self, block: usize, action: &[f32], obs: &mut [f32], out: &mut BlockStep) {
            self.0.step(block, action, obs, out);
        }
        fn save(&self, block: usize, bytes: &mut Vec<u8>) {
            self.0.save(block, bytes);
        }
        fn load<'a>(&mut self, block: usize, bytes: &'a [u8]) -> Result<&'a [u8], EnvError> {
            self.0.load(block, bytes)
        }
    }
    run(&Watch(tag(true, Isa::best())), &with_roles());
}

#[test]
fn what_does_not_suit_the_roles_is_refused() {
    let refused = |slow: bool, change: fn(&mut TrainConfig)| -> String {
        let config = with_roles().with(change);
        match train(&*tag(slow, Isa::best()), Isa::best(), &config, None, &mut silent) {
            Err(error @ Error::Config { .. }) => error.to_string(),
            other => panic!("{other:?}"),
        }
    };
    let unknown = refused(false, |c| {
        let own = c.roles.remove("opponent").unwrap();
        c.roles.insert("oponent".into(), own);
    });
    assert_eq!(unknown, "configuration: roles is oponent, expected runner, opponent; did you mean 'opponent'?");
    let sac = refused(true, |c| {
        let own = c.roles.get_mut("opponent").unwrap();
        own.algorithm = Algorithm::Sac(Sac::default());
        own.statistics.scale_rewards = false;
    });
    assert!(sac.contains("sac with 1 rewards for opponent") && sac.contains("does not decide every time"), "{sac}");
}

/// Both learn: the trained opponent pushes an untrained runner far away, and a trained one less far.
#[test]
fn both_learn() {
    for slow in [false, true] {
        let task = tag(slow, Isa::best());
        let config = config().with(|c| {
            c.run.agents = 128;
            c.run.horizon = 50;
            c.run.total_steps = 300_000;
        });
        let output = run(&*task, &config);
        let start = run(&*task, &config.clone().with(|c| c.run.total_steps = 1));
        let play = |runner: &Policy, opponent: &Policy| {
            let options = EvalOptions { episodes: 64, threads: 1, ..Default::default() };
            let both = evaluate_roles(&*task, Isa::best(), &[runner, opponent], &options).unwrap();
            assert!(both[1].return_mean < -both[0].return_mean);
            both[0].return_mean
        };
        let (runner, opponent) = (&output.policy, &output.others[0].1);
        let (calf, novice) = (&start.policy, &start.others[0].1);
        let [before, pushed, both] = [play(calf, novice), play(calf, opponent), play(runner, opponent)];
        println!("slow {slow}: {before:.1}, {pushed:.1}, {both:.1}");
        assert!(pushed < before - 20.0 && both > pushed + 3.0, "{before} {pushed} {both}");
    }
}
