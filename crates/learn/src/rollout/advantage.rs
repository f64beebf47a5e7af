//! Generalized advantage estimation (Schulman et al., "High-dimensional continuous control using generalized advantage
//! estimation", 2016), sixteen agents at a time.

use super::data::{Rewards, Rollout};
use crate::lanes::BLOCK;
use crate::lanes::f32_lanes;
use marathon_physics::lanes::{Isa, Kernel, Real};
use std::marker::PhantomData;

/// Fills the advantages `A = sum (gamma lambda)^k delta_{t+k}` with `delta_t = r_t + gamma V_{t+1} - V_t`, cut off at
/// the end of an episode, the value targets `A + V`, and their sums. With several streams of rewards, each has its own
/// values, and the advantages of all are added up.
///
/// Agents that do not decide at an item keep their last action. As in ML-Agents, their rewards there are added to that
/// decision's reward, undiscounted. Rewards before the first decision of a rollout are left out, because the last value
/// of the previous rollout has predicted them.
///
/// `gamma` has the discount per decision of each stream; `lambda` is the decay of the estimator.
pub fn estimate(isa: Isa, gamma: &[f64], lambda: f64, rollout: &mut Rollout) {
    let mut rows = rollout.rewards();
    let intermittent = rows.decided.iter().any(|decided| *decided != !0);
    f32_lanes!(isa, T => <T as Real>::enter(Estimate::<T> {
        rows: &mut rows,
        intermittent,
        gamma,
        lambda,
        lanes: PhantomData,
    }));
    let blocks = rows.sums.len();
    for (b, sums) in rows.sums.iter_mut().enumerate() {
        let (mut a, mut aa, mut r, mut rr, mut e, mut ee) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for item in (b..rows.done.len()).step_by(blocks) {
            let row = item * rows.streams * BLOCK..(item * rows.streams + 1) * BLOCK;
            let of_task = rows.target[row.clone()].iter().zip(&rows.value[row]);
            let advantages = &rows.advantage[item * BLOCK..(item + 1) * BLOCK];
            for (i, (advantage, (target, value))) in advantages.iter().zip(of_task).enumerate() {
                if rows.decided[item] >> i & 1 == 0 {
                    continue;
                }
                let (advantage, target) = (*advantage as f64, *target as f64);
                a += advantage;
                aa += advantage * advantage;
                r += target;
                rr += target * target;
                // the error of a value is its advantage, which is not known separately for several streams
                let error = if rows.streams == 1 { advantage } else { target - *value as f64 };
                e += error;
                ee += error * error;
            }
        }
        sums.advantages = (a, aa);
        sums.targets = (r, rr);
        sums.errors = (e, ee);
    }
}

struct Estimate<'a, 'b, T> {
    rows: &'a mut Rewards<'b>,
    /// Whether agents skip decisions.
    intermittent: bool,
    gamma: &'a [f64],
    lambda: f64,
    lanes: PhantomData<T>,
}

impl<T: Real<Scalar = f32>> Kernel<T> for Estimate<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let (rows, intermittent) = (self.rows, self.intermittent);
        let (blocks, streams) = (rows.sums.len(), rows.streams);
        for (b, stream) in (0..blocks).flat_map(|b| (0..streams).map(move |stream| (b, stream))) {
            let gamma = self.gamma[stream];
            let (gamma, decay) = (T::lit(gamma), T::lit(gamma * self.lambda));
            for lane in (0..BLOCK).step_by(T::LANES) {
                let mut next = T::load(&rows.last_value[(b * streams + stream) * BLOCK + lane..]);
                let mut advantage = T::zero();
                // rewards since the last decision
                let mut earned = T::zero();
                for item in (b..rows.done.len()).step_by(blocks).rev() {
                    let at = (item * streams + stream) * BLOCK + lane;
                    // bits above the lanes of this vector are ignored
                    let goes_on = T::not(T::from_bits(rows.done[item] as u32 >> lane));
                    let value = T::load(&rows.value[at..]);
                    let mut reward = T::load(&rows.reward[at..]);
                    let (then, later) = (T::masked(goes_on, next), T::masked(goes_on, advantage));
                    if intermittent {
                        reward += T::masked(goes_on, earned);
                    }
                    let delta = then.mul_add(gamma, reward - value);
                    advantage = later.mul_add(decay, delta);
                    next = value;
                    if intermittent {
                        let decided = T::from_bits(rows.decided[item] as u32 >> lane);
                        advantage = T::select(decided, advantage, later);
                        next = T::select(decided, value, then);
                        earned = T::masked(T::not(decided), reward);
                    }
                    let total = &mut rows.advantage[item * BLOCK + lane..];
                    if stream == 0 {
                        advantage.store(total)
                    } else {
                        (T::load(total) + advantage).store(total)
                    }
                    (advantage + value).store(&mut rows.target[at..]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rollout::sums::BlockSums;
    use marathon_physics::lanes::Isa;

    /// The definition for one agent, in double precision.
    fn reference(reward: &[f64], value: &[f64], last: f64, done: &[bool], gamma: f64, lambda: f64) -> Vec<f64> {
        let n = reward.len();
        let mut out = vec![0.0; n];
        for (t, out) in out.iter_mut().enumerate() {
            let mut weight = 1.0;
            for k in t..n {
                let next = if done[k] {
                    0.0
                } else if k + 1 < n {
                    value[k + 1]
                } else {
                    last
                };
                *out += weight * (reward[k] + gamma * next - value[k]);
                weight *= gamma * lambda;
                if done[k] {
                    break;
                }
            }
        }
        out
    }

    #[test]
    fn estimator_equals_its_definition_on_every_width() {
        let (blocks, horizon, gamma, lambda) = (3, 40, 0.97, 0.9);
        let items = blocks * horizon;
        let noise = |i: usize| ((i * 7919 + 13) % 1013) as f32 / 1013.0 - 0.5;
        let reward: Vec<f32> = (0..items * BLOCK).map(noise).collect();
        let value: Vec<f32> = (0..items * BLOCK).map(|i| noise(i + 5000)).collect();
        let last_value: Vec<f32> = (0..blocks * BLOCK).map(|i| noise(i + 9000)).collect();
        let done: Vec<u16> = (0..items).map(|i| if i % 7 == 3 { (i * 40503 % 65536) as u16 } else { 0 }).collect();
        let decided = vec![!0; items];
        let mut before: Option<Vec<f32>> = None;
        for isa in [Isa::F32, Isa::X4, Isa::X8, Isa::X16].into_iter().filter(|isa| isa.supported()) {
            let (mut advantage, mut target) = (vec![0.0; items * BLOCK], vec![0.0; items * BLOCK]);
            let mut rows = Rewards {
                streams: 1,
                reward: &reward,
                value: &value,
                last_value: &last_value,
                decided: &decided,
                done: &done,
                advantage: &mut advantage,
                target: &mut target,
                sums: &mut vec![BlockSums::default(); blocks],
            };
            f32_lanes!(isa, T => <T as Real>::enter(Estimate::<T> {
                rows: &mut rows, intermittent: false, gamma: &[gamma], lambda, lanes: PhantomData,
            }));
            for (b, lane) in [(0, 0), (1, 5), (2, 15)] {
                let pick =
                    |x: &[f32]| (0..horizon).map(|t| x[(t * blocks + b) * BLOCK + lane] as f64).collect::<Vec<_>>();
                let ended: Vec<bool> = (0..horizon).map(|t| done[t * blocks + b] >> lane & 1 == 1).collect();
                let last = last_value[b * BLOCK + lane] as f64;
                let want = reference(&pick(&reward), &pick(&value), last, &ended, gamma, lambda);
                for ((a, w), (r, v)) in pick(&advantage).iter().zip(&want).zip(pick(&target).iter().zip(&pick(&value)))
                {
                    assert!((a - w).abs() < 1e-5 && (r - w - v).abs() < 1e-5, "{a} {w}");
                }
            }
            assert!(before.is_none_or(|b| b == advantage), "{}", isa.name());
            before = Some(advantage);
        }
    }
}
