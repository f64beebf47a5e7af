//! Random numbers of episodes.
//!
//! The start of episode `k` of agent `i` under seed `s` is a pure function of (`s`, `i`, `k`). The three numbers are
//! the key of a stream cipher. Agents are therefore independent of each other, and a snapshot stores only numbers that
//! identify the episode.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Separates these streams from others of the same seed.
const DOMAIN: [u8; 8] = *b"marathon";

/// An episode of an agent under a seed. It determines the episode's random numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct EpisodeId {
    pub seed: u64,
    /// Number of the agent in the whole environment.
    pub agent: u64,
    /// Number of the episode, from 1.
    pub episode: u64,
}

/// Source of an episode's random numbers.
pub struct EpisodeRng(ChaCha8Rng);

impl EpisodeRng {
    pub(crate) fn new(id: EpisodeId) -> Self {
        let mut key = [0; 32];
        let parts = [id.seed.to_le_bytes(), id.agent.to_le_bytes(), id.episode.to_le_bytes(), DOMAIN];
        for (bytes, part) in key.chunks_exact_mut(8).zip(parts) {
            bytes.copy_from_slice(&part);
        }
        EpisodeRng(ChaCha8Rng::from_seed(key))
    }

    /// The random numbers for observation `step` of an episode. Each step has a separate stream, also from the start's.
    /// Draws during an episode therefore do not depend on earlier ones.
    pub(crate) fn at(id: EpisodeId, step: u64) -> Self {
        let mut random = EpisodeRng::new(id);
        // the start has stream 0
        random.0.set_stream(step.wrapping_add(1));
        random
    }

    /// The random numbers of a seed that an agent has drawn itself, apart from those of all episodes.
    pub(crate) fn numbered(seed: u64) -> Self {
        // episodes count from 1
        EpisodeRng::new(EpisodeId { seed, agent: u64::MAX, episode: 0 })
    }

    /// Uniform in [-half_width, half_width).
    pub fn around_zero(&mut self, half_width: f64) -> f64 {
        (2.0 * self.unit() - 1.0) * half_width
    }

    /// Uniform in [low, high).
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        (high - low).mul_add(self.unit(), low)
    }

    /// Uniform integer in [low, high].
    pub fn whole(&mut self, low: usize, high: usize) -> usize {
        // of 2^53 values, each integer gets the same number, up to one
        low + (self.unit() * (high - low + 1) as f64) as usize
    }

    /// Normally distributed with mean 0 and standard deviation 1 (the first number of a Box-Muller pair).
    pub fn normal(&mut self) -> f64 {
        // never 0, because its logarithm is not finite
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.unit()));
        radius * libm::cos(std::f64::consts::TAU * self.unit())
    }

    /// Uniform in [0, 1): 53 bits, exact in f64.
    fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_differ_in_seed_agent_and_episode() {
        let first = |seed, agent, episode| EpisodeRng::new(EpisodeId { seed, agent, episode }).around_zero(1.0);
        assert_eq!(first(1, 2, 3), first(1, 2, 3));
        let all = [first(1, 2, 3), first(0, 2, 3), first(1, 0, 3), first(1, 2, 0), first(2, 1, 3)];
        for (i, a) in all.iter().enumerate() {
            assert!(all[..i].iter().all(|b| a != b), "{all:?}");
        }
    }

    #[test]
    fn the_streams_of_an_episode_differ() {
        let id = EpisodeId { seed: 1, agent: 2, episode: 3 };
        let at = |step| EpisodeRng::at(id, step).around_zero(1.0);
        assert_eq!(at(7), at(7));
        let all: Vec<f64> = (0..50).map(at).chain([EpisodeRng::new(id).around_zero(1.0)]).collect();
        for (i, a) in all.iter().enumerate() {
            assert!(all[..i].iter().all(|b| a != b), "{all:?}");
        }
    }

    #[test]
    fn whole_numbers_are_as_likely_as_each_other() {
        let mut rng = EpisodeRng::new(EpisodeId { seed: 7, agent: 0, episode: 1 });
        let mut counts = [0; 5];
        for _ in 0..20_000 {
            counts[rng.whole(3, 7) - 3] += 1;
        }
        // a standard error is 57
        assert!(counts.iter().all(|n| (3770..4230).contains(n)), "{counts:?}");
    }

    #[test]
    fn draws_fill_their_range_evenly() {
        let mut rng = EpisodeRng::new(EpisodeId { seed: 7, agent: 0, episode: 1 });
        let draws: Vec<f64> = (0..20_000).map(|_| rng.around_zero(0.5)).collect();
        assert!(draws.iter().all(|x| (-0.5..0.5).contains(x)));
        let mean = draws.iter().sum::<f64>() / draws.len() as f64;
        let variance = draws.iter().map(|x| x * x).sum::<f64>() / draws.len() as f64;
        // standard errors are 0.002 and 0.0005
        assert!(mean.abs() < 0.01 && (variance - 1.0 / 12.0).abs() < 0.003, "mean {mean}, variance {variance}");
        assert!((0..1000).map(|_| rng.uniform(2.0, 5.0)).all(|x| (2.0..5.0).contains(&x)));
    }

    #[test]
    fn normal_draws_have_the_moments_of_the_normal_distribution() {
        let mut rng = EpisodeRng::new(EpisodeId { seed: 7, agent: 0, episode: 1 });
        let draws: Vec<f64> = (0..100_000).map(|_| rng.normal()).collect();
        let moment = |k: i32| draws.iter().map(|x| x.powi(k)).sum::<f64>() / draws.len() as f64;
        // four standard errors: 0.0032, 0.0045, 0.012, 0.031 each
        for (k, expected, error) in [(1, 0.0, 0.013), (2, 1.0, 0.018), (3, 0.0, 0.05), (4, 3.0, 0.13)] {
            assert!((moment(k) - expected).abs() < error, "moment {k} is {}", moment(k));
        }
    }
}
