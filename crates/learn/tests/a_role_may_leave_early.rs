//! A role that finishes before the episode learns only from its own part. Its episodes are as long as that part. A
//! failure ends its last decision without a further value, and later events do not affect its values. The other roles
//! keep learning. Interruptions and threads do not change the result.

use std::sync::Arc;

use crate::common::silent;
use marathon_envs::{Agent, Facts, Obs, Registry, RoleFacts, Senses, ShardFactory, Terms, names};
use marathon_learn::{Checkpoint, Control, IterationStats, Snapshot, TrainConfig, train};
use marathon_physics::lanes::{Isa, Real};

const MODEL: &str = r#"
<mujoco model="relay">
  <worldbody>
    <body name="ball" pos="0 0 1"><joint name="slide" type="slide" axis="1 0 0" damping="1"/><geom size="0.1"/></body>
  </worldbody>
  <actuator><motor name="first" joint="slide"/><motor name="second" joint="slide"/></actuator>
</mujoco>"#;

/// Decisions of the first role, and of the whole episode.
const PART: usize = 10;
const WHOLE: usize = 40;

/// Two roles take turns. The first earns 1 for each of its decisions, the second something else later.
#[derive(Clone, Copy)]
struct Relay {
    /// Whether the first role has failed when it leaves.
    fails: bool,
}

impl Agent for Relay {
    fn facts(&self) -> Facts {
        let role = |name: &str| RoleFacts {
            name: name.into(),
            observations: names(["clock"]),
            actions: names([name]),
            reward_terms: names([name]),
            intermittent: true,
        };
        Facts {
            id: "Relay-v0".into(),
            summary: "two take turns".into(),
            model: MODEL.into(),
            max_episode_steps: WHOLE,
            actions: names(["first", "second"]),
            reward_terms: names(["first", "second"]),
            memory: 1,
            roles: vec![role("first"), role("second")],
            termination_reward: None,
            ..Facts::default()
        }
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.group("clock");
        out.scalar(s.memory(0));
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        let ones = T::lit(1.0);
        terms.add("first", 1.0, ones);
        let theirs = terms.keep(s.memory(0).lt(T::lit(PART as f64 + 0.5)));
        terms.add("second", -50.0, theirs);
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        s.terminate_never()
    }

    #[inline(always)]
    fn remember<T: Real>(&self, _: &Senses<T>, memory: &mut [T]) {
        memory[0] += T::lit(1.0);
    }

    #[inline(always)]
    fn decides<T: Real>(&self, s: &Senses<T>, role: usize) -> T::Mask {
        let first = s.memory(0).lt(T::lit(PART as f64 - 0.5));
        if role == 0 { first } else { T::not(first) }
    }

    #[inline(always)]
    fn leaves<T: Real>(&self, s: &Senses<T>, role: usize) -> [T::Mask; 2] {
        let late = |decision: usize| s.memory(0).lt(T::lit(decision as f64 - 0.5));
        let now = if role == 0 { T::and(late(PART + 1), T::not(late(PART))) } else { T::none() };
        if self.fails { [now, T::none()] } else { [T::none(), now] }
    }
}

fn relay(fails: bool) -> Arc<dyn ShardFactory> {
    let mut registry = Registry::empty();
    registry.register(Arc::new(Relay { fails })).unwrap();
    registry.shards("Relay-v0", Isa::best()).unwrap()
}

fn config(iterations: u64) -> TrainConfig {
    TrainConfig::default().with(|c| {
        c.run.agents = 32;
        // rollouts end within parts, and after them
        c.run.horizon = 14;
        c.run.total_steps = iterations * c.run.rollout_steps();
        c.run.threads = 1;
        c.network.critic_hidden = Some(vec![32]);
        c.rewards[0].gamma = 0.9;
    })
}

#[test]
fn its_episodes_are_its_parts() {
    for fails in [true, false] {
        let mut ended = 0;
        let mut watch = |stats: &IterationStats, _: &Snapshot<'_>| {
            ended += stats.episodes;
            if stats.episodes > 0 {
                assert_eq!((stats.length_mean, stats.learned.return_mean), (Some(PART as f64), Some(PART as f64)));
                assert_eq!(stats.fall_fraction, Some(f64::from(u8::from(fails))));
            }
            Control::Continue
        };
        // 280 decisions are seven episodes of each agent
        train(&*relay(fails), Isa::best(), &config(20), None, &mut watch).unwrap();
        assert_eq!(ended, 7 * 32);
    }
}

#[test]
fn its_values_know_its_part_alone() {
    let output = train(&*relay(true), Isa::best(), &config(1500), None, &mut silent).unwrap();
    let last = output.last.unwrap();
    // the remaining return is known: 1 for each remaining decision
    assert!(last.learned.explained_variance > 0.97, "{}", last.learned.explained_variance);
    let others = &last.others[0].1;
    assert!(others.explained_variance > 0.9, "{}", others.explained_variance);
}

#[test]
fn interruptions_and_threads_change_nothing() {
    let whole = train(&*relay(true), Isa::best(), &config(12), None, &mut silent).unwrap();
    for stop in 1..12 {
        let mut watch = |stats: &IterationStats, _: &Snapshot<'_>| match stats.iteration {
            n if n < stop => Control::Continue,
            _ => Control::Stop,
        };
        let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
        let part = train(&*relay(true), Isa::best(), &config(12), None, &mut watch).unwrap();
        part.checkpoint.save(folder.path()).unwrap();
        let checkpoint = Checkpoint::load(folder.path()).unwrap();
        let config = config(12).with(|c| c.run.threads = 2);
        let resumed = train(&*relay(true), Isa::best(), &config, Some(checkpoint), &mut silent).unwrap();
        let numbers = |stats: &Option<IterationStats>| {
            let stats = stats.as_ref().unwrap();
            (stats.episodes, stats.length_mean, stats.learned.value_loss.to_bits(), stats.others[0].1.kl.to_bits())
        };
        assert_eq!((&resumed.policy, &resumed.others), (&whole.policy, &whole.others), "interrupted after {stop}");
        assert_eq!(numbers(&resumed.last), numbers(&whole.last), "interrupted after {stop}");
    }
}
