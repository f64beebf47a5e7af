//! Random streams: one per agent, sixteen side by side.
//!
//! Every agent has its own xoshiro128++ generator (Blackman and Vigna, "Scrambled linear pseudorandom number
//! generators", 2021), seeded from the run's seed and the agent's number. Its noise therefore depends only on the seed,
//! the agent and the step. The loops over `[u32; 16]` become vector instructions inside [`Real::enter`].

use crate::lanes::BLOCK;
use crate::lanes::mirror;
use marathon_physics::lanes::Real;

/// Stream numbers for different purposes.
const ACTIONS: u64 = 1 << 62;
/// Shuffles of rollouts.
pub const SHUFFLES: u64 = 1 << 63;
/// Initial parameters.
pub const PARAMETERS: u64 = 3 << 61;
/// Batches from a replay.
pub const SAMPLES: u64 = 1 << 61;
/// Actions of a distilled student.
pub const EXPLORATION: u64 = 3 << 60;
/// Initial parameters of reward signals, two streams for each.
pub const SIGNALS: u64 = PARAMETERS + 1;
/// Demonstrations that go with an update's samples.
const DEMONSTRATIONS: u64 = 7 << 60;

/// Seeds of all roles but the first.
const ROLES: u64 = 5 << 60;

/// Seed for all random numbers of role `i` of a run. The first role uses the run's seed.
pub fn seed_of_role(seed: u64, i: usize) -> u64 {
    if i == 0 { seed } else { SplitMix::new(seed, ROLES | i as u64).word() }
}

/// Seed for drawing demonstrations for minibatch `batch` of a run.
pub fn seed_of_demonstrations(seed: u64, batch: u64) -> u64 {
    SplitMix::new(SplitMix::new(seed, DEMONSTRATIONS).word(), batch).word()
}

/// SplitMix64: a stream of well-mixed words from any seed.
#[derive(Clone, Debug)]
pub struct SplitMix(u64);

impl SplitMix {
    /// A stream for a seed and a purpose or place. Different arguments give unrelated streams.
    pub fn new(seed: u64, stream: u64) -> Self {
        // differs from other generators with the same seed
        let mut mix = SplitMix(seed ^ 0x6c65_6172_6e65_7221);
        SplitMix(mix.word() ^ stream.wrapping_mul(0xd134_2543_de82_ef95))
    }
    /// The position in the stream, for saving.
    pub fn state(&self) -> u64 {
        self.0
    }
    /// The inverse of [`SplitMix::state`].
    pub fn from_state(state: u64) -> Self {
        SplitMix(state)
    }
    /// The next word.
    pub fn word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = self.0;
        let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
    /// A number below `n`, by multiplication and shift (bias below n / 2^64).
    pub fn below(&mut self, n: usize) -> usize {
        ((self.word() as u128 * n as u128) >> 64) as usize
    }
    /// Shuffles a list (Fisher and Yates).
    pub fn shuffle<T>(&mut self, list: &mut [T]) {
        for i in (1..list.len()).rev() {
            list.swap(i, self.below(i + 1));
        }
    }
}

/// Streams of the sixteen agents of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    state: [[u32; BLOCK]; 4],
}

impl Noise {
    /// Numbers of the state, as saved.
    pub const WORDS: usize = 4 * BLOCK;

    /// Streams of agents `16 * block ..`.
    pub fn new(seed: u64, block: usize) -> Self {
        let mut state = [[0; BLOCK]; 4];
        for lane in 0..BLOCK {
            let mut mix = SplitMix::new(seed, ACTIONS | (block * BLOCK + lane) as u64);
            for word in &mut state {
                word[lane] = mix.word() as u32;
            }
            // the state must not be zero
            state[0][lane] |= 1;
        }
        Self { state }
    }

    /// Repeats the first streams in the other lanes, for a block with fewer agents than lanes.
    pub fn mirrored(mut self, agents: usize) -> Self {
        mirror::rows(self.state.as_flattened_mut(), agents);
        self
    }

    /// Streams for a block of an update's batch.
    pub fn of(seed: u64, update: u64, block: u64) -> Self {
        Self::new(SplitMix::new(seed, update | SAMPLES).word(), block as usize)
    }

    /// The state as numbers.
    pub fn words(&self) -> impl Iterator<Item = u32> + '_ {
        self.state.iter().flatten().copied()
    }
    /// The inverse of [`Noise::words`].
    pub fn from_words(words: &[u32; Self::WORDS]) -> Self {
        let mut state = [[0; BLOCK]; 4];
        state.as_flattened_mut().copy_from_slice(words);
        Self { state }
    }

    /// Sixteen random words.
    #[inline(always)]
    fn next(&mut self) -> [u32; BLOCK] {
        let [s0, s1, s2, s3] = &mut self.state;
        let mut out = [0; BLOCK];
        for i in 0..BLOCK {
            out[i] = s0[i].wrapping_add(s3[i]).rotate_left(7).wrapping_add(s0[i]);
            let t = s1[i] << 9;
            s2[i] ^= s0[i];
            s3[i] ^= s1[i];
            s1[i] ^= s2[i];
            s0[i] ^= s3[i];
            s2[i] ^= t;
            s3[i] = s3[i].rotate_left(11);
        }
        out
    }

    /// Uniform in [0, 1), multiples of 2^-24.
    #[inline(always)]
    fn uniform(&mut self) -> [f32; BLOCK] {
        let bits = self.next();
        let mut out = [0.0; BLOCK];
        for i in 0..BLOCK {
            out[i] = (bits[i] >> 8) as f32 * (1.0 / 16_777_216.0);
        }
        out
    }

    /// Fills rows with standard normal numbers (Box and Muller).
    #[inline(always)]
    pub fn normals<T: Real<Scalar = f32>>(&mut self, out: &mut [[f32; BLOCK]]) {
        for pair in out.chunks_mut(2) {
            let (u, v) = (self.uniform(), self.uniform());
            for lane in (0..BLOCK).step_by(T::LANES) {
                // 1 - u is in (0, 1]
                let u = T::lit(1.0) - T::load(&u[lane..]);
                let radius = (u.ln() * T::lit(-2.0)).max(T::zero()).sqrt();
                let (sin, cos) = (T::load(&v[lane..]) * T::lit(std::f64::consts::TAU)).sin_cos();
                (radius * cos).store(&mut pair[0][lane..]);
                if let Some(second) = pair.get_mut(1) {
                    (radius * sin).store(&mut second[lane..]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::f32_lanes;
    use marathon_physics::lanes::{Isa, Kernel};

    struct Draw<'a>(&'a mut Noise, &'a mut [[f32; BLOCK]]);
    impl<T: Real<Scalar = f32>> Kernel<T> for Draw<'_> {
        type Output = ();
        #[inline(always)]
        fn run(self) {
            self.0.normals::<T>(self.1)
        }
    }

    fn draw(isa: Isa, seed: u64, block: usize, n: usize) -> Vec<[f32; BLOCK]> {
        let (mut noise, mut out) = (Noise::new(seed, block), vec![[0.0; BLOCK]; n]);
        f32_lanes!(isa, T => <T as Real>::enter(Draw(&mut noise, &mut out)));
        out
    }

    #[test]
    fn streams_do_not_depend_on_the_vector_width() {
        let want = draw(Isa::F32, 5, 3, 101);
        for isa in [Isa::X4, Isa::X8, Isa::X16] {
            assert!(!isa.supported() || draw(isa, 5, 3, 101) == want, "{}", isa.name());
        }
    }

    #[test]
    fn moments_are_those_of_the_normal_distribution() {
        let x: Vec<f64> = draw(Isa::best(), 1, 0, 20_000).as_flattened().iter().map(|x| *x as f64).collect();
        let moment = |p: i32| x.iter().map(|x| x.powi(p)).sum::<f64>() / x.len() as f64;
        // five standard errors each
        assert!(moment(1).abs() < 9e-3 && (moment(2) - 1.0).abs() < 0.013, "{} {}", moment(1), moment(2));
        assert!(moment(3).abs() < 0.035 && (moment(4) - 3.0).abs() < 0.09, "{} {}", moment(3), moment(4));
        // neighboring agents, seeds and steps are uncorrelated
        let corr = |y: &[f64]| x.iter().zip(y).map(|(a, b)| a * b).sum::<f64>() / y.len() as f64;
        assert!(corr(&x[1..]).abs() < 9e-3 && corr(&x[16..]).abs() < 9e-3 && corr(&x[32..]).abs() < 9e-3);
        let y: Vec<f64> = draw(Isa::best(), 2, 0, 20_000).as_flattened().iter().map(|x| *x as f64).collect();
        assert!(corr(&y).abs() < 9e-3);
    }

    #[test]
    fn shuffles_are_permutations() {
        let mut list: Vec<usize> = (0..1000).collect();
        SplitMix::new(3, 4).shuffle(&mut list);
        assert!(list.iter().enumerate().filter(|(i, x)| i == *x).count() < 10);
        list.sort();
        assert_eq!(list, (0..1000).collect::<Vec<_>>());
    }
}
