//! Imitation by a discriminator. The gradient of its loss, including the gradient penalty, equals PyTorch's and finite
//! differences. It teaches a behavior without a task reward. Runs stay deterministic and resumable. Invalid
//! demonstrations are refused.

use crate::common::numbers::{noise, noise_f32, worst};
use crate::common::oracle;
use crate::common::{PuckTask, learning_config, silent, small_config};
use marathon_envs::{BlockStep, Demonstrations, EnvError, ObsGroup, Shard, ShardFactory, Spec};
use marathon_learn::lanes::buffer::Blocks;
use marathon_learn::rewards::Purpose;
use marathon_learn::rewards::discriminator::Discriminator;
use marathon_learn::{
    Activation, BLOCK, Checkpoint, Control, Form, Imitation, IterationStats, RewardConfig, RewardKind, Snapshot,
    TrainConfig, evaluate, train,
};
use marathon_physics::lanes::Isa;
use serde_json::{Value, json};

const BLOCKS: usize = 2;
/// Numbers of the observation that the discriminator sees.
const SEES: usize = 5;

fn discriminator(form: Form, activation: Activation) -> Discriminator {
    let settings = Imitation { form, activation, hidden: vec![9, 7, 6], ..Imitation::default() };
    let spec = Spec { obs: SEES, act: 3, ..Spec::default() };
    let purpose = Purpose { spec: &spec, seed: 1, action_scale: 1.0, demonstrations: None };
    Discriminator::new(&settings, (0..SEES).collect(), purpose)
}

fn inputs(form: Form) -> usize {
    if form == Form::Amp { 2 * SEES } else { SEES }
}

fn cases() -> impl Iterator<Item = (Form, Activation)> {
    [Form::Amp, Form::Gail].into_iter().flat_map(|form| Activation::ALL.map(|activation| (form, activation)))
}

#[test]
fn the_gradient_with_its_penalty_equals_finite_differences() {
    for (form, activation) in cases().filter(|(_, activation)| *activation != Activation::Relu) {
        let nets = discriminator(form, activation);
        let mut space = nets.space::<f64>();
        for (k, blocks) in space.inputs().into_iter().enumerate() {
            for b in 0..BLOCKS {
                blocks.block_mut(b).copy_from_slice(&noise(inputs(form) * BLOCK, 7 + (2 * b + k) as u64));
            }
        }
        let params: Vec<f64> = noise(nets.count(), 3).iter().map(|x| 0.5 * x).collect();
        let mut gradient = vec![0.0; nets.count()];
        let mut loss = |params: &[f64], gradient: &mut [f64]| {
            nets.learn::<f64>(params, BLOCKS, &mut space, gradient);
            (0..BLOCKS * BLOCK).map(|i| nets.loss(params, &space, i / BLOCK, i % BLOCK)).sum::<f64>()
        };
        loss(&params, &mut gradient);
        let mut unused = vec![0.0; nets.count()];
        let error = worst(&gradient, &params, |p| loss(p, &mut unused));
        assert!(error < 1e-7, "{form:?} {}: {error}", activation.name());
    }
}

/// Rows of samples in PyTorch's form.
fn rows(blocks: &Blocks<f32>) -> Vec<Vec<f32>> {
    let lane = |i: usize| blocks.block(i / BLOCK).iter().skip(i % BLOCK).step_by(BLOCK).copied().collect();
    (0..BLOCKS * BLOCK).map(lane).collect()
}

#[test]
fn the_gradient_with_its_penalty_is_pytorchs() {
    let (mut request, mut found) = (Vec::new(), Vec::new());
    for (form, activation) in cases() {
        let nets = discriminator(form, activation);
        let mut space = nets.space::<f32>();
        for (k, blocks) in space.inputs().into_iter().enumerate() {
            for b in 0..BLOCKS {
                blocks.block_mut(b).copy_from_slice(&noise_f32(inputs(form) * BLOCK, 7 + (2 * b + k) as u64));
            }
        }
        let params: Vec<f32> = noise_f32(nets.count(), 3).iter().map(|x| 0.5 * x).collect();
        let mut gradient = vec![0.0; nets.count()];
        nets.learn::<f32>(&params, BLOCKS, &mut space, &mut gradient);
        let [own, expert] = space.inputs().map(|blocks| rows(blocks));
        let Imitation { gradient_penalty, logit_decay, .. } = Imitation::default();
        request.push(json!({
            "form": if form == Form::Amp { "amp" } else { "gail" }, "activation": activation.name(),
            "sizes": [inputs(form), 9, 7, 6, 1], "params": params, "own": own, "expert": expert,
            "gradient_penalty": gradient_penalty, "logit_decay": logit_decay,
        }));
        found.push(((form, activation), gradient));
    }
    let answers = oracle("torch_discriminator.py", &request.into());
    for ((case, gradient), want) in found.iter().zip(answers.as_array().expect("a list")) {
        let want: Vec<f64> = want["gradient"].as_array().into_iter().flatten().filter_map(Value::as_f64).collect();
        assert_eq!(gradient.len(), want.len());
        let size = want.iter().fold(0f64, |m, x| m.max(x.abs()));
        let off = gradient.iter().zip(&want).map(|(a, b)| (f64::from(*a) - b).abs()).fold(0f64, f64::max);
        assert!(size > 1e-2 && off < 1e-5 * size, "{case:?}: off by {off}, largest {size}");
    }
}

/// The puck's task without a reward, and with demonstrations of a controller that holds the puck at the origin.
struct Unrewarded {
    task: PuckTask,
    demonstrations: Option<Demonstrations>,
}

impl Unrewarded {
    fn new(limit: usize) -> Self {
        let mut task = PuckTask::with_limit(limit);
        let part = |name: &str, range| ObsGroup { name: name.into(), range };
        task.spec.observations = vec![part("position", 0..2), part("velocity", 2..4), part("drift", 4..6)];
        let demonstrations = Some(shown(&task));
        Self { task, demonstrations }
    }
}

/// The observation of a controller that knows the puck's target.
fn shown(task: &PuckTask) -> Demonstrations {
    let (mut shard, mut out) = (task.shard(0, 1, 99), BlockStep::default());
    let mut all = Demonstrations { obs_len: 6, act_len: 2, ..Demonstrations::default() };
    let mut obs = vec![0.0; 6 * BLOCK];
    shard.reset(0, !0, &mut obs);
    for step in 0..task.spec.max_episode_steps - 1 {
        let raw = |i: usize, lane: usize| (obs[i * BLOCK + lane] - 7.0) / 30.0;
        let steer = |i: usize| {
            let (axis, lane) = (i / BLOCK, i % BLOCK);
            (-4.0 * raw(axis, lane) - 0.8 * raw(2 + axis, lane) - raw(4 + axis, lane) / 8.0).clamp(-1.0, 1.0)
        };
        let action: Vec<f32> = (0..2 * BLOCK).map(steer).collect();
        let row = |obs: &[f32], lane: usize| obs.iter().skip(lane).step_by(BLOCK).copied().collect::<Vec<_>>();
        (0..BLOCK).for_each(|lane| all.obs.extend(row(&obs, lane)));
        (0..BLOCK).for_each(|lane| all.actions.extend(row(&action, lane)));
        all.decisions.extend((0..BLOCK).map(|lane| [step * BLOCK + lane, (step + 1) * BLOCK + lane]));
        shard.step(0, &action, &mut obs, &mut out);
    }
    (0..BLOCK).for_each(|lane| all.obs.extend(obs.iter().skip(lane).step_by(BLOCK)));
    all.motions.push(0..all.len());
    all
}

impl ShardFactory for Unrewarded {
    fn spec(&self) -> &Spec {
        self.task.spec()
    }
    fn shard(&self, first: usize, blocks: usize, seed: u64) -> Box<dyn Shard> {
        Box::new(NoReward(self.task.shard(first, blocks, seed)))
    }
    fn demonstrations(&self) -> Option<Demonstrations> {
        self.demonstrations.clone()
    }
}

struct NoReward(Box<dyn Shard>);

impl Shard for NoReward {
    fn spec(&self) -> &Spec {
        self.0.spec()
    }
    fn blocks(&self) -> usize {
        self.0.blocks()
    }
    fn reset(&mut self, block: usize, mask: u16, obs: &mut [f32]) {
        self.0.reset(block, mask, obs);
    }
    fn step(&mut self, block: usize, action: &[f32], obs: &mut [f32], out: &mut BlockStep) {
        self.0.step(block, action, obs, out);
        out.reward = [0.0; BLOCK];
        out.terms.fill(0.0);
    }
    fn save(&self, block: usize, bytes: &mut Vec<u8>) {
        self.0.save(block, bytes);
    }
    fn load<'a>(&mut self, block: usize, bytes: &'a [u8]) -> Result<&'a [u8], EnvError> {
        self.0.load(block, bytes)
    }
}

fn imitation(change: impl FnOnce(&mut Imitation)) -> RewardConfig {
    let mut settings = Imitation { hidden: vec![24, 16], lr: 1e-3, share: 0.5, ..Imitation::default() };
    change(&mut settings);
    RewardConfig::new(RewardKind::Imitation(settings))
}

#[test]
fn it_teaches_what_no_reward_tells() {
    let plain = train(&Unrewarded::new(64), Isa::best(), &learning_config(), None, &mut silent).unwrap();
    let score = |policy: &_| evaluate(&PuckTask::new(), Isa::best(), policy, &Default::default()).unwrap().return_mean;
    let before = score(&plain.policy);
    for form in [Form::Amp, Form::Gail] {
        let config = learning_config().with(|c| {
            c.statistics.scale_rewards = false;
            c.rewards.push(imitation(|i| (i.form, i.actions, i.gradient_penalty) = (form, form == Form::Gail, 1.0)));
        });
        let output = train(&Unrewarded::new(64), Isa::best(), &config, None, &mut silent).unwrap();
        let after = score(&output.policy);
        println!("{form:?}: {before} -> {after}");
        assert!(before < 20.0 && after > 45.0, "{form:?}: {before} -> {after}");
    }
}

fn small(form: Form) -> TrainConfig {
    let named = |i: &mut Imitation| (i.form, i.observations) = (form, vec!["velocity".into(), "position".into()]);
    small_config().with(|c| c.rewards.push(imitation(named)))
}

fn bits(config: &TrainConfig, isa: Isa) -> Vec<u32> {
    let output = train(&Unrewarded::new(20), isa, config, None, &mut silent).unwrap();
    output.policy.params().iter().chain(output.policy.log_std()).map(|x| x.to_bits()).collect()
}

#[test]
fn neither_threads_nor_vector_width_change_the_policy() {
    for form in [Form::Amp, Form::Gail] {
        let config = small(form);
        let want = bits(&config, Isa::best());
        assert_ne!(want, bits(&small_config(), Isa::best()), "imitation does something");
        for threads in [2, 5] {
            assert_eq!(want, bits(&config.clone().with(|c| c.run.threads = threads), Isa::best()), "{threads} threads");
        }
        for isa in [Isa::F32, Isa::X4, Isa::X8, Isa::X16].into_iter().filter(|isa| isa.supported()) {
            assert_eq!(want, bits(&config, isa), "{}", isa.name());
        }
    }
}

#[test]
fn resumed_run_has_the_bits_of_an_uninterrupted_one() {
    let run = |resume: Option<Checkpoint>, stop_at: u64| {
        let mut observer = |stats: &IterationStats, _: &Snapshot<'_>| match stats.iteration == stop_at {
            true => Control::Stop,
            false => Control::Continue,
        };
        train(&Unrewarded::new(30), Isa::best(), &small(Form::Amp), resume, &mut observer).unwrap()
    };
    let whole = run(None, 0);
    let dir = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    run(None, 2).checkpoint.save(dir.path()).unwrap();
    let resumed = run(Some(Checkpoint::load(dir.path()).unwrap()), 0);
    assert_eq!(resumed.policy.params(), whole.policy.params());
}

#[test]
fn what_cannot_be_imitated_is_refused() {
    let refused = |task: &Unrewarded, change: fn(&mut Imitation), message: &str| {
        let config = small_config().with(|c| c.rewards.push(imitation(change)));
        let error = train(task, Isa::best(), &config, None, &mut silent).err().unwrap().to_string();
        assert!(error.contains(message), "{error}");
    };
    let whole = Unrewarded::new(20);
    refused(&whole, |i| i.share = 0.0, "rewards.amp.share is 0, expected a number above 0 and at most 1");
    refused(&whole, |i| i.gradient_penalty = -1.0, "rewards.amp.gradient_penalty is -1, expected a number not below 0");
    refused(
        &whole,
        |i| i.observations = vec!["velocty".into()],
        "rewards.amp.observations is 'velocty', expected parts of Puck-v0's observation: 'velocity', or another of position",
    );
    let with = |change: fn(&mut Demonstrations)| {
        let mut task = Unrewarded::new(20);
        task.demonstrations.as_mut().into_iter().for_each(change);
        task
    };
    let none = Unrewarded { demonstrations: None, ..Unrewarded::new(20) };
    refused(
        &none,
        |_| {},
        "rewards.amp.demonstrations is null, expected a .demo file: Puck-v0 has no motion clips to imitate",
    );
    refused(
        &whole,
        |i| i.demonstrations = Some("puck.demo".into()),
        "imitation is for those of the task's own, expected those of 'puck.demo'",
    );
    refused(&with(|d| d.motions.clear()), |_| {}, "Puck-v0 has no motion clips to imitate");
    refused(&with(|d| d.act_len = 0), |i| i.actions = true, "clips, which have no actions, expected 2 actions");
    refused(&with(|d| d.obs_len = 3), |_| {}, "demonstrations of 3 observed numbers, expected 6");
}
