//! Sums over a rollout, block by block. Totals are taken in the order of the blocks, so they do not depend on the
//! workers.

/// Sums over the episodes that ended in a block, and over its rewards.
#[derive(Clone, Debug, Default)]
pub struct BlockSums {
    /// Episodes ended.
    pub episodes: f64,
    /// Their returns (undiscounted, unscaled).
    pub returns: f64,
    /// Their lengths in decisions.
    pub lengths: f64,
    /// Their mean forward speeds, m per decision.
    pub speeds: f64,
    /// Episodes that ended in a terminal state.
    pub falls: f64,
    /// Agents whose state stopped being finite.
    pub diverged: f64,
    /// Decisions made.
    pub decisions: f64,
    /// Sum of each reward term over the rollout.
    pub terms: Vec<f64>,
    /// Discounted returns: deviations from the center and their squares.
    pub discounted: (f64, f64),
    /// Observations: deviations from the mean and their squares.
    pub observations: Vec<(f64, f64)>,
    /// Advantages and their squares.
    pub advantages: (f64, f64),
    /// Value targets of the task's reward and their squares.
    pub targets: (f64, f64),
    /// Errors of the values against them, and their squares.
    pub errors: (f64, f64),
    /// Sum of each reward over the rollout, except the task's.
    pub rewards: Vec<f64>,
    /// Sum of each metric of the task's own over the rollout.
    pub metrics: Vec<f64>,
}

impl BlockSums {
    /// Adds the sums of another block or rollout.
    pub fn add(&mut self, other: &BlockSums) {
        fn pair(a: &mut (f64, f64), b: &(f64, f64)) {
            a.0 += b.0;
            a.1 += b.1;
        }
        self.episodes += other.episodes;
        self.returns += other.returns;
        self.lengths += other.lengths;
        self.speeds += other.speeds;
        self.falls += other.falls;
        self.diverged += other.diverged;
        self.decisions += other.decisions;
        self.terms.resize(other.terms.len(), 0.0);
        self.terms.iter_mut().zip(&other.terms).for_each(|(a, b)| *a += b);
        self.observations.resize(other.observations.len(), (0.0, 0.0));
        self.observations.iter_mut().zip(&other.observations).for_each(|(a, b)| pair(a, b));
        pair(&mut self.discounted, &other.discounted);
        pair(&mut self.advantages, &other.advantages);
        pair(&mut self.targets, &other.targets);
        pair(&mut self.errors, &other.errors);
        self.rewards.resize(other.rewards.len(), 0.0);
        self.rewards.iter_mut().zip(&other.rewards).for_each(|(a, b)| *a += b);
        self.metrics.resize(other.metrics.len(), 0.0);
        self.metrics.iter_mut().zip(&other.metrics).for_each(|(a, b)| *a += b);
    }

    /// Multiplies all sums by a factor.
    pub fn scale(&mut self, factor: f64) {
        let Self { episodes, returns, lengths, speeds, falls, diverged, decisions, terms, .. } = self;
        let Self { discounted, observations, advantages, targets, errors, rewards, metrics, .. } = self;
        let scalars = [episodes, returns, lengths, speeds, falls, diverged, decisions].into_iter();
        let pairs = observations.iter_mut().chain([discounted, advantages, targets, errors]);
        let all = scalars.chain(terms).chain(rewards).chain(metrics).chain(pairs.flat_map(|(a, b)| [a, b]));
        all.for_each(|x| *x *= factor);
    }
}

/// Sums over a whole rollout, added up in the order of the blocks.
#[derive(Clone, Debug, Default)]
pub struct Totals {
    /// Number of samples.
    pub samples: f64,
    /// The sums.
    pub sums: BlockSums,
}

impl Totals {
    /// Adds the totals of another rollout.
    pub fn add(&mut self, other: &Totals) {
        self.samples += other.samples;
        self.sums.add(&other.sums);
    }
    /// Mean and variance of the advantages.
    pub fn advantage(&self) -> (f64, f64) {
        self.moments(self.sums.advantages)
    }
    /// Fraction of the variance of the task's value targets that the value function predicted.
    pub fn explained_variance(&self) -> f64 {
        1.0 - self.moments(self.sums.errors).1 / self.moments(self.sums.targets).1.max(1e-12)
    }
    fn moments(&self, (sum, square): (f64, f64)) -> (f64, f64) {
        let decisions = self.sums.decisions.max(1.0);
        let mean = sum / decisions;
        (mean, (square / decisions - mean * mean).max(0.0))
    }
}
