//! Random numbers of episodes.
//!
//! The start of episode `k` of agent `i` under seed `s` is a pure function of (`s`, `i`, `k`): the three are the key of a
//! stream cipher. No agent's luck can depend on another's, and nothing but two numbers belongs to a snapshot.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Tells these streams from others that might be derived from the same seed.
const DOMAIN: [u8; 8] = *b"marathon";

/// Source of an episode's random numbers.
pub(crate) struct EpisodeRng(ChaCha8Rng);

impl EpisodeRng {
    pub fn new(seed: u64, agent: u64, episode: u64) -> Self {
        let mut key = [0; 32];
        for (bytes, part) in
            key.chunks_exact_mut(8).zip([seed.to_le_bytes(), agent.to_le_bytes(), episode.to_le_bytes(), DOMAIN])
        {
            bytes.copy_from_slice(&part);
        }
        EpisodeRng(ChaCha8Rng::from_seed(key))
    }

    /// Uniform in [-half_width, half_width).
    pub fn around_zero(&mut self, half_width: f64) -> f64 {
        // 53 bits, exact in f64
        let unit = (self.0.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64);
        (2.0 * unit - 1.0) * half_width
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_differ_in_seed_agent_and_episode() {
        let first = |s, a, e| EpisodeRng::new(s, a, e).around_zero(1.0);
        assert_eq!(first(1, 2, 3), first(1, 2, 3));
        let all = [first(1, 2, 3), first(0, 2, 3), first(1, 0, 3), first(1, 2, 0), first(2, 1, 3)];
        for (i, a) in all.iter().enumerate() {
            assert!(all[..i].iter().all(|b| a != b), "{all:?}");
        }
    }

    #[test]
    fn draws_fill_their_range_evenly() {
        let mut rng = EpisodeRng::new(7, 0, 1);
        let draws: Vec<f64> = (0..20_000).map(|_| rng.around_zero(0.5)).collect();
        assert!(draws.iter().all(|x| (-0.5..0.5).contains(x)));
        let mean = draws.iter().sum::<f64>() / draws.len() as f64;
        let variance = draws.iter().map(|x| x * x).sum::<f64>() / draws.len() as f64;
        // standard errors are 0.002 and 0.0005
        assert!(mean.abs() < 0.01 && (variance - 1.0 / 12.0).abs() < 0.003, "mean {mean}, variance {variance}");
    }
}
