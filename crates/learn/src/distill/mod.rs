//! Policy distillation: supervised learning from observations and a teacher's actions.
//!
//! One network learns what several policies do (policy distillation: Rusu et al., 2016), in a fraction of the time that
//! reinforcement learning takes. The caller lets the student play and asks the teachers for their actions in the states
//! that the student reaches (DAgger: Ross, Gordon and Bagnell, 2011). A student that has only seen its teachers' states
//! cannot act in its own.
//!
//! The loss is half the squared distance from the teacher's best action, in the units of the network's output.

mod saved;

pub use saved::Halfway;

use crate::error::Error;
use crate::lanes::BLOCK;
use crate::lanes::buffer::Blocks;
use crate::lanes::noise::{EXPLORATION, PARAMETERS, SAMPLES, SplitMix};
use crate::nets::init::{Init, normal};
use crate::nets::mlp::{CHUNK, Mlp, Tape};
use crate::nets::normalize::{Moments, Normalizer};
use crate::nets::widen::widen;
use crate::optim::adam::Adam;
use crate::policy::{Policy, PolicyMeta, check_widths};
use marathon_physics::lanes::Isa;

/// Constant that Adam adds to the root of the second moment.
const ADAM_EPSILON: f64 = 1e-5;
/// Bound of the normalized observations.
const OBSERVATION_CLIP: f32 = 10.0;

/// A bounded buffer of the latest observations with the teacher's actions.
pub struct Lessons {
    obs_len: usize,
    act_len: usize,
    room: usize,
    obs: Vec<f32>,
    actions: Vec<f32>,
    /// Index of the row that is overwritten next, once the buffer is full.
    next: usize,
}

impl Lessons {
    /// Creates a buffer of `room` rows.
    pub fn new(room: usize, obs_len: usize, act_len: usize) -> Self {
        Self { obs_len, act_len, room: room.max(1), obs: Vec::new(), actions: Vec::new(), next: 0 }
    }
    /// Memory for a number of rows, bytes.
    pub fn memory(rows: f64, obs_len: usize, act_len: usize) -> f64 {
        rows * (obs_len + act_len) as f64 * size_of::<f32>() as f64
    }
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.actions.len() / self.act_len
    }
    /// Whether the buffer is empty.
    pub fn is_empty(&self) -> bool {
        self.actions.is_empty()
    }
    /// Observations of at most `rows` rows. Before the buffer is full, these are the latest ones.
    pub fn latest(&self, rows: usize) -> &[f32] {
        &self.obs[(self.len() - rows.min(self.len())) * self.obs_len..]
    }
    /// Adds rows, `[n][obs]` and `[n][act]`. A full buffer overwrites its oldest rows.
    ///
    /// # Panics
    /// If the lengths do not fit.
    pub fn push(&mut self, obs: &[f32], actions: &[f32]) {
        assert_eq!(obs.len() / self.obs_len, actions.len() / self.act_len, "one action per observation");
        for (obs, action) in obs.chunks_exact(self.obs_len).zip(actions.chunks_exact(self.act_len)) {
            if self.len() < self.room {
                self.obs.extend(obs);
                self.actions.extend(action);
            } else {
                self.obs[self.next * self.obs_len..][..self.obs_len].copy_from_slice(obs);
                self.actions[self.next * self.act_len..][..self.act_len].copy_from_slice(action);
                self.next = (self.next + 1) % self.room;
            }
        }
    }
}

/// A student policy in training.
pub struct Distiller {
    meta: PolicyMeta,
    isa: Isa,
    seed: u64,
    net: Mlp,
    /// Parameters, padded with zeros to whole rows of sixteen.
    params: Vec<f32>,
    adam: Adam,
    updates: u64,
    /// Whether it started from another policy.
    started: bool,
    noise: SplitMix,
    moments: Moments,
    normalizer: Normalizer,
    log_std: Vec<f32>,
    space: Space,
}

struct Space {
    input: Blocks<f32>,
    tape: Tape<f32>,
    targets: Blocks<f32>,
    chunk: Vec<f32>,
    sum: Vec<f32>,
}

impl Distiller {
    /// Creates an untrained policy. `log_std` holds the logarithms of the standard deviations of its actions, which
    /// stay fixed.
    ///
    /// # Errors
    /// If a width is not allowed for a policy.
    pub fn new(mut meta: PolicyMeta, log_std: Vec<f32>, seed: u64, isa: Isa) -> Result<Self, Error> {
        meta.observation_clip = OBSERVATION_CLIP;
        check_widths(&meta)?;
        let sizes = [&[meta.obs], &meta.hidden[..], &[meta.act]].concat();
        let net = Mlp::new(&sizes, meta.activation);
        let mut params = vec![0.0; net.len().next_multiple_of(BLOCK)];
        Init::Orthogonal.policy(&net, &mut params[..net.len()], &mut SplitMix::new(seed, PARAMETERS));
        let space = Space {
            input: net.input(),
            tape: net.tape(),
            targets: Blocks::new(CHUNK, meta.act),
            chunk: vec![0.0; net.len()],
            sum: vec![0.0; params.len()],
        };
        Ok(Self {
            adam: Adam::new(params.len(), ADAM_EPSILON),
            updates: 0,
            started: false,
            noise: SplitMix::new(seed, EXPLORATION),
            moments: Moments::new(meta.obs),
            normalizer: Normalizer::identity(meta.obs, OBSERVATION_CLIP),
            meta,
            isa,
            seed,
            net,
            params,
            log_std,
            space,
        })
    }

    /// Starts from a policy. Number `i` of its observation is number `sees[i]` of the student's.
    ///
    /// # Errors
    /// If the policy's network is wider or has another form.
    pub fn start_from(&mut self, policy: &Policy, sees: &[usize]) -> Result<(), Error> {
        let params = &mut self.params[..self.net.len()];
        widen(&self.net, params, policy.net(), policy.params(), sees)?;
        self.moments.assume(policy.normalizer(), sees);
        self.started = true;
        self.normalizer = Normalizer::new(self.moments.mean32(), self.moments.std(), OBSERVATION_CLIP);
        Ok(())
    }

    /// Adds observations, `[n][obs]`, to the normalization statistics. This is allowed before the first update only,
    /// because it changes the network's output for an observation.
    ///
    /// # Panics
    /// After the first update.
    pub fn see(&mut self, obs: &[f32]) {
        assert_eq!(self.updates, 0, "statistics change before the first update only");
        let n = self.meta.obs;
        let centers: Vec<f32> = self.moments.mean32();
        let mut sums = vec![(0.0, 0.0); n];
        for row in obs.chunks_exact(n) {
            for ((sum, square), (x, center)) in sums.iter_mut().zip(row.iter().zip(&centers)) {
                let d = f64::from(x - center);
                *sum += d;
                *square += d * d;
            }
        }
        self.moments.merge((obs.len() / n) as f64, &sums, f64::INFINITY);
        let before = self.normalizer.clone();
        self.normalizer = Normalizer::new(self.moments.mean32(), self.moments.std(), OBSERVATION_CLIP);
        // keeps what the network learned before
        if self.started {
            self.net.follow(&mut self.params[..self.net.len()], &before, &self.normalizer);
        }
    }

    /// Takes one step of Adam on rows that are drawn from the lessons, a multiple of sixteen. Returns the mean squared
    /// distance between the numbers of an action and the teacher's.
    ///
    /// # Panics
    /// If there are no lessons.
    pub fn learn(&mut self, lessons: &Lessons, rows: usize, lr: f64) -> f64 {
        assert!(!lessons.is_empty(), "no lessons to learn from");
        let mut random = SplitMix::new(SplitMix::new(self.seed, self.updates).word(), SAMPLES);
        self.updates += 1;
        let (blocks, act) = (rows.div_ceil(BLOCK), self.meta.act);
        self.space.sum.fill(0.0);
        let mut loss = 0.0;
        for first in (0..blocks).step_by(CHUNK) {
            let here = CHUNK.min(blocks - first);
            for block in 0..here {
                for lane in 0..BLOCK {
                    self.place(lessons, random.below(lessons.len()), block, lane);
                }
            }
            let Space { input, tape, targets, chunk, sum } = &mut self.space;
            self.net.forward(self.isa, &self.params[..self.net.len()], input, tape, here);
            let (output, delta) = tape.output_and_delta();
            for block in 0..here {
                let pairs = output.block(block).iter().zip(targets.block(block));
                for ((mean, target), delta) in pairs.zip(delta.block_mut(block)) {
                    *delta = mean - target;
                    loss += f64::from(*delta * *delta);
                }
            }
            self.net.backward(self.isa, &self.params[..self.net.len()], input, tape, chunk, here);
            sum.iter_mut().zip(chunk).for_each(|(sum, x)| *sum += *x);
        }
        self.adam.advance();
        let (all, scale) = (0..self.params.len(), 1.0 / (blocks * BLOCK) as f64);
        self.adam.update(self.isa, &mut self.params, all, &self.space.sum, scale, lr);
        loss * scale / act as f64
    }

    /// Copies a row of the lessons into a lane of the work space.
    fn place(&mut self, lessons: &Lessons, row: usize, block: usize, lane: usize) {
        let (obs, act) = (self.meta.obs, self.meta.act);
        let input = self.space.input.block_mut(block);
        for (i, x) in lessons.obs[row * obs..][..obs].iter().enumerate() {
            input[i * BLOCK + lane] = self.normalizer.number(i, *x);
        }
        let targets = self.space.targets.block_mut(block);
        for (i, action) in lessons.actions[row * act..][..act].iter().enumerate() {
            targets[i * BLOCK + lane] = nominal(&self.meta.action_range, i, *action);
        }
    }

    /// Fills a list with standard normal numbers, for sampled actions as in training.
    pub fn draw(&mut self, noise: &mut [f32]) {
        noise.iter_mut().for_each(|x| *x = normal(&mut self.noise) as f32);
    }

    /// Number of network parameters that are not finite.
    pub fn lost(&self) -> usize {
        self.params.iter().filter(|x| !x.is_finite()).count()
    }

    /// Memory for training a student with this policy, bytes.
    pub fn memory(meta: &PolicyMeta) -> f64 {
        let sizes = [&[meta.obs], &meta.hidden[..], &[meta.act]].concat();
        let params: f64 = sizes.windows(2).map(|pair| (pair[0] as f64 + 1.0) * pair[1] as f64).sum();
        let activations: f64 = sizes.iter().map(|size| (2 * CHUNK * BLOCK) as f64 * *size as f64).sum();
        // parameters, two moments, two gradients, and the policy in use
        (6.0 * params + activations) * size_of::<f32>() as f64
    }

    /// The current policy.
    pub fn policy(&self) -> Policy {
        let params = self.params[..self.net.len()].to_vec();
        Policy::assemble(self.meta.clone(), self.net.clone(), params, self.normalizer.clone(), self.log_std.clone())
    }
}

/// Network output that gives an action of the environment.
fn nominal(ranges: &[[f32; 2]], i: usize, action: f32) -> f32 {
    match ranges.get(i) {
        Some([low, high]) => (2.0 * action - low - high) / (high - low),
        None => action,
    }
}
