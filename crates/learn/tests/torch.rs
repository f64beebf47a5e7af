//! Networks, losses and gradients agree with PyTorch's to 1e-5, in single precision on every instruction set.

use crate::common::numbers::noise_f32 as noise;
use crate::common::oracle;
use marathon_learn::algorithms::loss::{Loss, LossSums, Objective};
use marathon_learn::lanes::buffer::Blocks;
use marathon_learn::nets::gaussian::Gaussian;
use marathon_learn::nets::mlp::Mlp;
use marathon_learn::rollout::data::Samples;
use marathon_learn::{Activation, BLOCK, Ratio};
use marathon_physics::lanes::{F32x4, Real};
#[cfg(target_arch = "x86_64")]
use marathon_physics::lanes::{F32x8, F32x16};
use serde_json::{Value, json};
use std::marker::PhantomData;

const BLOCKS: usize = 5;
const ACT: usize = 4;

struct Case {
    actor: Mlp,
    critic: Mlp,
    params: [Vec<f32>; 2],
    log_std: Vec<f32>,
    input: Blocks<f32>,
    /// Action, log-probability, advantage, value, target of each block.
    data: Vec<[Vec<f32>; 5]>,
    objective: Objective,
}

impl Case {
    fn new(activation: Activation, ratio: Ratio, value_clip: Option<f64>) -> Self {
        let (actor, critic) = (Mlp::new(&[31, 64, 48, ACT], activation), Mlp::new(&[31, 40, 1], activation));
        let mut input = actor.input();
        for b in 0..BLOCKS {
            input.block_mut(b).copy_from_slice(&noise(31 * BLOCK, 100 + b as u64));
        }
        let row =
            |n: usize, salt: u64, scale: f32| noise(n * BLOCK, salt).iter().map(|x| x * scale).collect::<Vec<_>>();
        let rows = if ratio == Ratio::Joint { 1 } else { ACT };
        let data = (0..BLOCKS as u64).map(|b| {
            let log_prob = row(rows, 30 + b, 1.0).iter().map(|x| x - 1.0 / rows as f32).collect();
            // a mean far from zero: otherwise the mean objective would be the small difference of large sums
            let advantage = row(1, 50 + b, 2.0).iter().map(|x| x + 0.5).collect();
            [row(ACT, 20 + b, 1.0), log_prob, advantage, row(1, 60 + b, 1.0), row(1, 80 + b, 2.0)]
        });
        let scaled = |net: &Mlp, salt| noise(net.len(), salt).iter().map(|x| x * 0.25).collect();
        let objective =
            Objective { ratio, clip: 0.2, value_clip, entropy_coef: 0.01, advantage_mean: 0.0, advantage_scale: 1.0 };
        Self {
            params: [scaled(&actor, 1), scaled(&critic, 2)],
            log_std: noise(ACT, 3).iter().map(|x| x * 0.5 - 0.3).collect(),
            data: data.collect(),
            actor,
            critic,
            input,
            objective,
        }
    }

    /// Rows of samples in PyTorch's form.
    fn rows(block: &[f32]) -> impl Iterator<Item = Vec<f32>> + '_ {
        (0..BLOCK).map(|lane| block.iter().skip(lane).step_by(BLOCK).copied().collect())
    }

    fn request(&self) -> Value {
        let matrix = |k: usize| self.data.iter().flat_map(|d| Self::rows(&d[k])).collect::<Vec<_>>();
        let list = |k: usize| self.data.iter().flat_map(|d| d[k].clone()).collect::<Vec<f32>>();
        let obs: Vec<Vec<f32>> =
            (0..BLOCKS).flat_map(|b| Self::rows(self.input.block(b)).collect::<Vec<_>>()).collect();
        json!({
            "activation": self.actor.activation().name(),
            "sizes": {"actor": self.actor.sizes(), "critic": self.critic.sizes()},
            "params": {"actor": self.params[0], "critic": self.params[1]},
            "log_std": self.log_std, "obs": obs, "action": matrix(0), "log_prob": matrix(1), "advantage": list(2),
            "value": list(3), "target": list(4), "clip": self.objective.clip, "value_clip": self.objective.value_clip,
            "entropy_coef": self.objective.entropy_coef, "per_action": self.objective.ratio == Ratio::PerAction,
        })
    }

    fn check<T: Real<Scalar = f32>>(&self, want: &Value) {
        let Objective { ratio, value_clip, .. } = self.objective;
        let place = format!("{} {} {ratio:?} {value_clip:?}", T::ISA, self.actor.activation().name());
        let (mut actor, mut critic) = (self.actor.tape(), self.critic.tape());
        self.actor.forward_on::<T>(&self.params[0], &self.input, &mut actor, BLOCKS);
        self.critic.forward_on::<T>(&self.params[1], &self.input, &mut critic, BLOCKS);
        let means: Vec<Value> =
            (0..BLOCKS).flat_map(|b| Self::rows(actor.output().block(b)).map(Value::from)).collect();
        let values: Vec<f32> = (0..BLOCKS).flat_map(|b| critic.output().block(b).to_vec()).collect();
        agree(&Value::from(means), &want["mean"], &format!("{place}: mean"));
        agree(&values.into(), &want["value"], &format!("{place}: value"));

        let samples: Vec<Samples<'_, f32>> = self
            .data
            .iter()
            .map(|[action, log_prob, advantage, value, target]| Samples {
                decided: !0,
                action,
                log_prob,
                advantage,
                value,
                target,
            })
            .collect();
        let gaussian = Gaussian::new(&self.log_std);
        let mut d_log_std = vec![0.0; ACT];
        let sums: LossSums = T::enter(Loss::<T> {
            objective: self.objective,
            gaussian: &gaussian,
            samples: &samples,
            mean: actor.output_and_delta(),
            value: critic.output_and_delta(),
            d_log_std: &mut d_log_std,
            rows: &mut vec![[0.0; BLOCK]; ACT],
            lanes: PhantomData,
        });
        let n = sums.samples;
        for (name, got) in [
            ("policy_loss", sums.policy / n),
            ("value_loss", sums.value / n),
            ("kl", sums.kl / n),
            ("entropy", gaussian.entropy()),
        ] {
            agree(&got.into(), &want[name], &format!("{place}: {name}"));
        }
        assert!(sums.clipped > 0.1 * n && sums.clipped < 0.9 * n, "both sides of the clip range: {sums:?}");

        let mut gradients = [vec![0.0; self.actor.len()], vec![0.0; self.critic.len()]];
        self.actor.backward_on::<T>(&self.params[0], &self.input, &mut actor, &mut gradients[0], BLOCKS);
        self.critic.backward_on::<T>(&self.params[1], &self.input, &mut critic, &mut gradients[1], BLOCKS);
        let mean = |g: &[f32]| g.iter().map(|x| *x as f64 / n).collect::<Vec<_>>();
        agree(&mean(&gradients[0]).into(), &want["actor_gradient"], &format!("{place}: actor gradient"));
        agree(&mean(&d_log_std).into(), &want["log_std_gradient"], &format!("{place}: log std gradient"));
        agree(&mean(&gradients[1]).into(), &want["critic_gradient"], &format!("{place}: critic gradient"));
    }
}

/// All numbers in a JSON value.
fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(all) => all.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().expect("a number")],
    }
}

/// No number differs by more than 1e-5 of the largest.
fn agree(got: &Value, want: &Value, what: &str) {
    let (got, want) = (numbers(got), numbers(want));
    assert_eq!(got.len(), want.len(), "{what}");
    let size = want.iter().fold(0f64, |m, x| m.max(x.abs()));
    let worst = got.iter().zip(&want).map(|(a, b)| (a - b).abs()).fold(0f64, f64::max);
    assert!(size > 1e-3 && worst < 1e-5 * size, "{what}: off by {worst}, largest {size}");
}

#[test]
fn networks_losses_and_gradients_agree_with_pytorch() {
    let losses = [(Ratio::Joint, None), (Ratio::Joint, Some(0.3)), (Ratio::PerAction, Some(0.3))];
    let cases: Vec<Case> =
        Activation::ALL.into_iter().flat_map(|a| losses.map(|(ratio, clip)| Case::new(a, ratio, clip))).collect();
    let request: Vec<Value> = cases.iter().map(Case::request).collect();
    let answers = oracle("torch_ppo.py", &request.into());
    for (case, want) in cases.iter().zip(answers.as_array().expect("a list")) {
        case.check::<f32>(want);
        case.check::<F32x4>(want);
        #[cfg(target_arch = "x86_64")]
        {
            if F32x8::supported() {
                case.check::<F32x8>(want);
            }
            if F32x16::supported() {
                case.check::<F32x16>(want);
            }
        }
    }
}
