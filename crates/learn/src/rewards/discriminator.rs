// one file: the loss and its second derivatives mirror each other
//! Imitation by a discriminator: a network learns to distinguish the agent's decisions from demonstrated ones. The
//! reward is high where it fails.
//!
//! [`Form::Amp`] is "AMP: Adversarial motion priors" (Peng et al., 2021): the network `d` takes two consecutive
//! observations. [`Form::Gail`] is "Generative adversarial imitation learning" (Ho and Ermon, 2016) with ML-Agents'
//! reward: it takes one.
//!
//! ```text
//! amp    loss: (d(demonstrated) - 1)^2 + (d(own) + 1)^2        reward: max(0, 1 - (d - 1)^2 / 4)
//! gail   loss: -ln D(demonstrated) - ln(1 - D(own))            reward: -ln(1 - D)         D = sigmoid(d)
//! both   loss: + gradient_penalty / 2 |grad d(demonstrated)|^2 + logit_decay |weights of the last layer|^2
//! ```
//!
//! Each decision of a minibatch is paired with a demonstrated one, drawn by the indices of the minibatch and the
//! decision. Demonstrations are normalized with the current statistics of the agent's observations.

use super::kernels::place;
use super::{Minibatch, Purpose, Reward, RewardModel, Step};
use crate::error::Error;
use crate::lanes::BLOCK;
use crate::lanes::buffer::Blocks;
use crate::lanes::f32_lanes;
use crate::lanes::noise::{SplitMix, seed_of_demonstrations};
use crate::nets::activation::Activation;
use crate::nets::init;
use crate::nets::mlp::{CHUNK, Mlp, Tape};
use crate::nets::penalty::PenaltySpace;
use crate::optim::sum::Add;
use marathon_envs::{Demonstrations, Spec};
use marathon_physics::hint::nearest;
use marathon_physics::lanes::{Isa, Kernel, Real};
use serde::{Deserialize, Serialize};
use std::marker::PhantomData;
use std::ops::Range;
use std::sync::Arc;

/// Input of a discriminator, and the reward from its output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Form {
    /// Two observations in a row; least squares.
    #[default]
    Amp,
    /// One observation; logistic.
    Gail,
}

impl Form {
    /// Name of the reward in configurations and reports.
    pub fn name(self) -> &'static str {
        match self {
            Form::Amp => "amp",
            Form::Gail => "gail",
        }
    }
}

/// Settings of imitation. The defaults are those of AMP for a character with clips.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Imitation {
    /// Input and reward of the discriminator. In files it is the name of the reward.
    #[serde(skip)]
    pub form: Form,
    /// Widths of the discriminator's hidden layers.
    pub hidden: Vec<usize>,
    /// Their activation.
    pub activation: Activation,
    /// Learning rate.
    pub lr: f64,
    /// Named parts of the observation that it sees. None means all. Commands and phases are not part of a style.
    pub observations: Vec<String>,
    /// Whether it also sees the action.
    pub actions: bool,
    /// Weight of the gradient penalty at demonstrations.
    pub gradient_penalty: f64,
    /// Weight of the squared weights of the last layer.
    pub logit_decay: f64,
    /// Fraction of each minibatch that it learns from. It needs fewer samples than the policy.
    pub share: f64,
    /// File of demonstrations. Without it, the task's own demonstrations are used.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub demonstrations: Option<String>,
}

impl Default for Imitation {
    fn default() -> Self {
        Self {
            form: Form::Amp,
            hidden: vec![128, 64],
            activation: Activation::Relu,
            lr: 3e-4,
            observations: Vec::new(),
            actions: false,
            gradient_penalty: 10.0,
            logit_decay: 0.05,
            share: 0.25,
            demonstrations: None,
        }
    }
}

impl Imitation {
    /// Checks every field.
    ///
    /// # Errors
    /// Names the field, its value and the values that are valid.
    pub fn validate(&self) -> Result<(), Error> {
        for (field, x) in [("gradient_penalty", self.gradient_penalty), ("logit_decay", self.logit_decay)] {
            if !((x as f32).is_finite() && x >= 0.0) {
                return Err(Error::config(field, x, "a number not below 0"));
            }
        }
        match self.share > 0.0 && self.share <= 1.0 {
            true => Ok(()),
            false => Err(Error::config("share", self.share, "a number above 0 and at most 1")),
        }
    }

    /// Indices of the observation that it sees.
    ///
    /// # Errors
    /// If the observation has no part of that name.
    pub fn sees(&self, spec: &Spec) -> Result<Vec<usize>, Error> {
        if self.observations.is_empty() {
            return Ok((0..spec.obs).collect());
        }
        let mut sees = Vec::new();
        for name in &self.observations {
            let Some(group) = spec.observations.iter().find(|group| group.name == *name) else {
                let names = || spec.observations.iter().map(|group| group.name.as_str());
                let near = nearest(name, names()).map(|near| format!("'{near}', or another of ")).unwrap_or_default();
                let expected =
                    format!("parts of {}'s observation: {near}{}", spec.id, names().collect::<Vec<_>>().join(", "));
                return Err(Error::config(
                    format!("rewards.{}.observations", self.form.name()),
                    format!("'{name}'"),
                    expected,
                ));
            };
            sees.extend(group.range.clone());
        }
        sees.sort_unstable();
        sees.dedup();
        Ok(sees)
    }

    /// Refuses missing demonstrations and those that do not fit a task.
    ///
    /// # Errors
    /// Says what was found and what is valid.
    pub fn check(&self, spec: &Spec, demonstrations: Option<&Demonstrations>) -> Result<(), Error> {
        self.sees(spec)?;
        let what = |found: String, expected: String| Err(Error::Mismatch { what: "imitation".into(), found, expected });
        let Some(all) = demonstrations.filter(|all| all.motions.iter().any(|motion| !motion.is_empty())) else {
            let expected = format!("a .demo file: {} has no motion clips to imitate", spec.id);
            let key = format!("rewards.{}.demonstrations", self.form.name());
            return Err(Error::config(key, "null", expected));
        };
        if all.source != self.demonstrations {
            let name = |source: &Option<String>| match source {
                Some(file) => format!("those of '{file}', which were not read"),
                None => "those of the task's own".into(),
            };
            return what(name(&all.source), name(&self.demonstrations));
        }
        if all.obs_len != spec.obs {
            return what(
                format!("demonstrations of {} observed numbers", all.obs_len),
                format!("{} as {} has", spec.obs, spec.id),
            );
        }
        if self.actions && all.act_len != spec.act {
            let found = if all.act_len == 0 {
                "clips, which have no actions".into()
            } else {
                format!("demonstrations of {} actions", all.act_len)
            };
            return what(found, format!("{} actions as {} has, or use_actions: false", spec.act, spec.id));
        }
        Ok(())
    }
}

/// Demonstrated decisions, restricted to the discriminator's input.
struct Expert {
    /// `[row][feature]`, raw.
    rows: Vec<f32>,
    decisions: Vec<[usize; 2]>,
    motions: Vec<Range<usize>>,
    /// `[decision][act]`.
    actions: Vec<f32>,
}

/// The network with the data that it learns from.
#[derive(Clone)]
pub struct Discriminator {
    net: Mlp,
    settings: Imitation,
    /// Indices of the observation that it sees.
    sees: Vec<usize>,
    /// Length of the action if it sees the action, else 0.
    act: usize,
    /// Factor that maps sampled actions to [-1, 1].
    action_scale: f32,
    seed: u64,
    expert: Option<Arc<Expert>>,
}

/// Work space.
pub struct DiscriminatorSpace<S> {
    own: Blocks<S>,
    expert: Blocks<S>,
    tape: Tape<S>,
    penalty: PenaltySpace<S>,
    gradient: Vec<S>,
}

impl<S: Copy + Default> DiscriminatorSpace<S> {
    /// Inputs for the agent's decisions and for the demonstrated ones.
    pub fn inputs(&mut self) -> [&mut Blocks<S>; 2] {
        [&mut self.own, &mut self.expert]
    }
}

impl Discriminator {
    /// Creates a discriminator that sees the given indices of the observation. Without demonstrations it can give
    /// rewards but not learn.
    pub fn new(settings: &Imitation, sees: Vec<usize>, purpose: Purpose<'_>) -> Self {
        let Purpose { spec: Spec { act, .. }, seed, action_scale, demonstrations } = purpose;
        let act = *act;
        let act = if settings.actions { act } else { 0 };
        let states = if settings.form == Form::Amp { 2 } else { 1 };
        let inputs = states * sees.len() + act;
        let net = Mlp::new(&[&[inputs], &settings.hidden[..], &[1]].concat(), settings.activation);
        let expert = demonstrations.map(|all| {
            let rows = all.obs.chunks_exact(all.obs_len.max(1)).flat_map(|row| sees.iter().map(|i| row[*i])).collect();
            // a motion without decisions cannot be drawn
            let motions = all.motions.iter().filter(|motion| !motion.is_empty()).cloned().collect();
            Arc::new(Expert { rows, decisions: all.decisions.clone(), motions, actions: all.actions.clone() })
        });
        Self { net, settings: settings.clone(), sees, act, action_scale, seed, expert }
    }
    /// Number of parameters.
    pub fn count(&self) -> usize {
        self.net.len()
    }
    /// Work space.
    pub fn space<S: Copy + Default>(&self) -> DiscriminatorSpace<S> {
        DiscriminatorSpace {
            own: self.net.input(),
            expert: self.net.input(),
            tape: self.net.tape(),
            penalty: self.net.penalty_space(),
            gradient: vec![S::default(); self.net.len()],
        }
    }

    /// Writes the visible part of a step to a block of its input.
    fn see(&self, step: &Step<'_, f32>, block: &mut [f32]) {
        let states: &[&[f32]] = if self.settings.form == Form::Amp { &[step.obs, step.next] } else { &[step.obs] };
        let rows = states.iter().flat_map(|obs| self.sees.iter().map(|i| &obs[i * BLOCK..(i + 1) * BLOCK]));
        rows.enumerate().for_each(|(at, row)| place(block, at, row));
        let own = &mut block[states.len() * self.sees.len() * BLOCK..];
        for (own, drawn) in own.iter_mut().zip(&step.action[..self.act * BLOCK]) {
            *own = (drawn * self.action_scale).clamp(-1.0, 1.0);
        }
    }

    /// Draws sixteen demonstrated decisions into a block of its input.
    fn draw(&self, expert: &Expert, minibatch: &Minibatch<'_>, random: &mut SplitMix, block: &mut [f32]) {
        let n = self.sees.len();
        for lane in 0..BLOCK {
            let motion = &expert.motions[random.below(expert.motions.len())];
            let decision = motion.start + random.below(motion.len());
            let states = if self.settings.form == Form::Amp { 2 } else { 1 };
            for (k, row) in expert.decisions[decision][..states].iter().enumerate() {
                let row = &expert.rows[row * n..(row + 1) * n];
                for (i, (from, x)) in self.sees.iter().zip(row).enumerate() {
                    block[(k * n + i) * BLOCK + lane] = minibatch.normalizer.number(*from, *x);
                }
            }
            let action = &expert.actions[decision * self.act..(decision + 1) * self.act];
            for (i, a) in action.iter().enumerate() {
                block[(states * n + i) * BLOCK + lane] = *a;
            }
        }
    }

    /// Overwrites `gradient` with that of the loss, summed over the first blocks of the
    /// [inputs](DiscriminatorSpace::inputs). The tape keeps the data for [`Discriminator::loss`].
    pub fn learn<T: Real>(
        &self,
        params: &[T::Scalar],
        blocks: usize,
        space: &mut DiscriminatorSpace<T::Scalar>,
        gradient: &mut [T::Scalar],
    ) {
        let Imitation { form, gradient_penalty, logit_decay, .. } = self.settings;
        let DiscriminatorSpace { own, expert, tape, penalty, gradient: more } = space;
        self.net.forward_on::<T>(params, own, tape, blocks);
        let (d, delta) = tape.output_and_delta();
        T::enter(Verdict::<T> { form, target: -1.0, d, delta, blocks, lanes: PhantomData });
        self.net.backward_on::<T>(params, own, tape, gradient, blocks);
        self.net.penalty_forward::<T>(params, expert, penalty, blocks);
        let (d, delta) = penalty.output_and_delta();
        T::enter(Verdict::<T> { form, target: 1.0, d, delta, blocks, lanes: PhantomData });
        self.net.penalty_backward::<T>(params, expert, (penalty, gradient_penalty), more, blocks);
        let (weights, _) = self.net.layers().last().expect("a network has layers");
        let decay = 2.0 * logit_decay * (blocks * BLOCK) as f64;
        T::enter(Add::<T> { sum: gradient, x: more });
        for (sum, w) in gradient[weights.clone()].iter_mut().zip(&params[weights]) {
            *sum = T::scalar(T::widen(*sum) + decay * T::widen(*w));
        }
    }

    /// Loss of a row after [`Discriminator::learn`], for tests.
    pub fn loss(&self, params: &[f64], space: &DiscriminatorSpace<f64>, block: usize, lane: usize) -> f64 {
        let Imitation { form, gradient_penalty, logit_decay, .. } = self.settings;
        let (own, expert) = (space.tape.output().block(block)[lane], space.penalty.output().block(block)[lane]);
        let verdict = match form {
            Form::Amp => (own + 1.0) * (own + 1.0) + (expert - 1.0) * (expert - 1.0),
            Form::Gail => libm::log1p(libm::exp(own)) + libm::log1p(libm::exp(-expert)),
        };
        let slope = space.penalty.slope().block(block).iter().skip(lane).step_by(BLOCK).map(|x| x * x).sum::<f64>();
        let (weights, _) = self.net.layers().last().expect("a network has layers");
        let weight: f64 = params[weights].iter().map(|w| w * w).sum();
        verdict + 0.5 * gradient_penalty * slope + logit_decay * weight
    }

    /// Rewards for the network's output on its own input.
    fn reward<T: Real<Scalar = f32>>(
        &self,
        params: &[f32],
        blocks: usize,
        space: &mut DiscriminatorSpace<f32>,
        out: &mut [f32],
    ) {
        self.net.forward_on::<T>(params, &space.own, &mut space.tape, blocks);
        T::enter(Worth::<T> { form: self.settings.form, d: space.tape.output(), out, blocks, lanes: PhantomData });
    }
}

impl Reward for Discriminator {
    fn count(&self) -> usize {
        self.count()
    }
    fn init(&self, params: &mut [f32], random: &mut SplitMix) {
        init::orthogonal(&self.net, params, 1.0, random);
    }
    fn reward_model(&self) -> Box<dyn RewardModel> {
        Box::new(DiscriminatorModel { nets: self.clone(), space: self.space() })
    }
    fn ignores_done(&self) -> bool {
        false
    }
    fn bound(&self) -> f64 {
        f64::INFINITY
    }
}

/// The network with its work space.
struct DiscriminatorModel {
    nets: Discriminator,
    space: DiscriminatorSpace<f32>,
}

impl RewardModel for DiscriminatorModel {
    fn reward(&mut self, isa: Isa, params: &[f32], steps: &[Step<'_, f32>], out: &mut [f32]) {
        for (b, step) in steps.iter().enumerate() {
            self.nets.see(step, self.space.own.block_mut(b));
        }
        f32_lanes!(isa, T => self.nets.reward::<T>(params, steps.len(), &mut self.space, out));
    }

    fn gradient(
        &mut self,
        isa: Isa,
        params: &[f32],
        steps: &[Step<'_, f32>],
        minibatch: &Minibatch<'_>,
        gradient: &mut [f32],
    ) {
        let Self { nets, space } = self;
        let expert = nets.expert.clone().expect("runs without demonstrations are refused");
        let seed = seed_of_demonstrations(nets.seed, minibatch.batch);
        let used = ((steps.len() as f64 * nets.settings.share).ceil() as usize).clamp(1, steps.len());
        for (b, (step, item)) in steps[..used].iter().zip(minibatch.items).enumerate() {
            nets.see(step, space.own.block_mut(b));
            let mut random = SplitMix::new(seed, u64::from(*item));
            nets.draw(&expert, minibatch, &mut random, space.expert.block_mut(b));
        }
        f32_lanes!(isa, T => nets.learn::<T>(params, used, space, gradient));
        // scales up to all samples
        let part = (steps.len() as f64 / used as f64) as f32;
        if part != 1.0 {
            gradient.iter_mut().for_each(|g| *g *= part);
        }
    }
}

/// Derivative of the loss with respect to outputs `d` whose target is 1 or -1.
struct Verdict<'a, T: Real> {
    form: Form,
    target: f64,
    d: &'a Blocks<T::Scalar>,
    delta: &'a mut Blocks<T::Scalar>,
    blocks: usize,
    lanes: PhantomData<T>,
}

impl<T: Real> Kernel<T> for Verdict<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Verdict { form, target, d, delta, blocks, .. } = self;
        let (one, target) = (T::lit(1.0), T::lit(target));
        for b in 0..blocks.min(CHUNK) {
            let verdicts = d.block(b).chunks_exact(T::LANES);
            for (d, delta) in verdicts.zip(delta.block_mut(b).chunks_exact_mut(T::LANES)) {
                let d = T::load(d);
                let slope = match form {
                    Form::Amp => (d - target) * T::lit(2.0),
                    // -target sigmoid(-target d)
                    Form::Gail => -target * (one + (target * d).min(T::lit(30.0)).exp()).recip(),
                };
                slope.store(delta);
            }
        }
    }
}

/// Rewards for outputs `d`, a row of sixteen per block.
struct Worth<'a, T: Real<Scalar = f32>> {
    form: Form,
    d: &'a Blocks<f32>,
    out: &'a mut [f32],
    blocks: usize,
    lanes: PhantomData<T>,
}

impl<T: Real<Scalar = f32>> Kernel<T> for Worth<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let (zero, one) = (T::zero(), T::lit(1.0));
        for b in 0..self.blocks.min(CHUNK) {
            let verdicts = self.d.block(b).chunks_exact(T::LANES);
            for (d, out) in verdicts.zip(self.out[b * BLOCK..].chunks_exact_mut(T::LANES)) {
                let d = T::load(d);
                let worth = match self.form {
                    Form::Amp => (d - one).neg_mul_add((d - one) * T::lit(0.25), one).max(zero),
                    // ln(1 + e^d); ML-Agents holds D below 1 - 1e-7
                    Form::Gail => {
                        let d = d.min(T::lit(16.0));
                        d.max(zero) + (one + (-d.abs()).exp()).ln()
                    }
                };
                worth.store(out);
            }
        }
    }
}
