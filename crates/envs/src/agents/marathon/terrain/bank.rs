//! The bank of an agent: pieces of courses with their outcomes. It lies in the agent's memory and is carried from episode
//! to episode. Bits therefore do not depend on threads, and checkpoints contain it.
//!
//! For each kind of piece, the bank has a *skill*: the size that the figure passes half of the time. A piece is expected to
//! be passed with e = 1 / (1 + exp((size - skill) / 0.1)). Every outcome moves the skill by 0.05 times the surprise, as
//! Elo's ratings of chess players. A record has a pass rate p = (s + 2 e) / (n + 2) from n trials and s passes. Older
//! trials count less.
//!
//! | rule | score of a record | draws by score; by age |
//! |---|---|---|
//! | `sfl`, `accel` | learnability p (1 - p) + 0.05 / sqrt(n + 1) | in proportion, 80 %; 20 % |
//! | `plr` | regret: best return on the piece minus its mean return, with one more return of 0 in the mean | 1 / rank, 70 %; 30 % |
//!
//! Sources: Rutherford and others, "No regrets" (sampling for learnability, 2024); Jiang and others, "Prioritized level
//! replay" (2021) and "Replay-guided adversarial environment design" (maximum Monte Carlo regret, 2021); Parker-Holder and
//! others, "Evolving curricula with regret-based environment design" (ACCEL, 2022).

use super::pieces::{self, Piece, PieceKind};
use crate::episode_rng::EpisodeRng;

/// Number of records.
pub(super) const RECORDS: usize = 24;
/// Slots of a record: its piece, trials, passes, best return, sum of returns and age.
const RECORD: usize = pieces::SLOTS + 5;
/// Slots of a bank: its records and its skills.
pub(super) const SLOTS: usize = RECORDS * RECORD + KINDS;
const KINDS: usize = PieceKind::ALL.len();
/// Share of a trial's weight that remains after another trial: half after eight.
const KEPT: f64 = 0.917_004_043_204_671_2;
/// Weight of what is not known yet.
const UNKNOWN: f64 = 0.05;
/// Trials after which a record may be replaced, and after which it may have a child.
const TRIED: f64 = 0.5;
const KNOWN: f64 = 1.5;
/// Skill before the first trial, its largest change by a trial, and the range of sizes over which the probability to pass
/// falls from 0.73 to 0.27.
const NOVICE: f64 = 0.1;
const RATE: f64 = 0.05;
const WIDTH: f64 = 0.1;
/// Weight of a skill in a pass rate, in trials.
const PRIOR: f64 = 2.0;

/// How records are scored and where new ones come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// Sampling for learnability.
    Sfl,
    /// Prioritized level replay.
    Plr,
    /// Edited levels.
    Accel,
}

/// A value in single precision, in which lanes store the memory.
fn single(x: f64) -> f64 {
    f64::from(x as f32)
}

/// A piece with its outcomes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Record {
    pub piece: Piece,
    /// Trials and passes, with older ones weighted less.
    trials: f64,
    passes: f64,
    /// Best return on the piece, and sum of the returns with the weights of the trials.
    best: f64,
    sum: f64,
    /// Episodes since the last trial.
    age: f64,
}

impl Record {
    /// A record without trials.
    pub fn new(piece: Piece) -> Self {
        Record { piece, trials: 0.0, passes: 0.0, best: 0.0, sum: 0.0, age: 0.0 }
    }

    /// Adds the outcome of a trial.
    pub fn charge(&mut self, passed: bool, earned: f64) {
        self.best = if self.trials == 0.0 { earned } else { self.best.max(earned) };
        self.trials = KEPT * self.trials + 1.0;
        self.passes = KEPT * self.passes + f64::from(u8::from(passed));
        self.sum = KEPT * self.sum + earned;
        self.age = 0.0;
    }

    /// Regret: the best return minus the mean, with one more return of 0 in the mean.
    fn regret(&self) -> f64 {
        self.best - self.sum / (self.trials + 1.0)
    }
}

/// The records of an agent, and for each kind of piece its skill: the size that it passes half of the time.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Bank {
    records: [Option<Record>; RECORDS],
    skills: [f64; KINDS],
}

impl Bank {
    /// Reads a bank from an agent's memory.
    pub fn read(slots: &[f64]) -> Self {
        let record = |slots: &[f64]| {
            let (piece, rest) = slots.split_at(pieces::SLOTS);
            let piece = Piece::read(piece)?;
            let &[trials, passes, best, sum, age] = rest else { return None };
            Some(Record { piece, trials, passes, best, sum, age })
        };
        let records = std::array::from_fn(|i| record(&slots[i * RECORD..(i + 1) * RECORD]));
        // memory is zero at first
        Bank { records, skills: std::array::from_fn(|i| slots[RECORDS * RECORD + i] + NOVICE) }
    }

    /// Writes the bank into an agent's memory, in single precision as lanes store it.
    pub fn write(&self, slots: &mut [f64]) {
        let (records, skills) = slots.split_at_mut(RECORDS * RECORD);
        for (slot, skill) in skills.iter_mut().zip(self.skills) {
            *slot = single(skill - NOVICE);
        }
        for (slots, record) in records.chunks_exact_mut(RECORD).zip(&self.records) {
            slots.fill(0.0);
            if let Some(Record { piece, trials, passes, best, sum, age }) = record {
                let (at, rest) = slots.split_at_mut(pieces::SLOTS);
                piece.write(at);
                rest.copy_from_slice(&[*trials, *passes, *best, *sum, *age].map(single));
            }
        }
    }

    /// A record.
    pub fn get(&self, i: usize) -> Option<&Record> {
        self.records[i].as_ref()
    }

    /// Estimate of the probability to pass a piece, by the skill.
    fn expected(&self, piece: &Piece) -> f64 {
        1.0 / (1.0 + libm::exp((piece.size() - self.skills[piece.kind() as usize]) / WIDTH))
    }

    /// Estimate of the probability to pass the piece of a record, by its trials and the skill.
    pub fn pass_rate(&self, record: &Record) -> f64 {
        (record.passes + PRIOR * self.expected(&record.piece)) / (record.trials + PRIOR)
    }

    /// Score of a record under a rule.
    pub fn score(&self, record: &Record, rule: Rule) -> f64 {
        if rule == Rule::Plr {
            return record.regret();
        }
        let p = self.pass_rate(record);
        p * (1.0 - p) + UNKNOWN / libm::sqrt(record.trials + 1.0)
    }

    /// Whether an edit of a record's piece is worth a try.
    pub fn can_have_a_child(&self, i: usize) -> bool {
        let can = |record: &Record| record.trials > KNOWN && (0.3..0.9).contains(&self.pass_rate(record));
        self.get(i).is_some_and(can)
    }

    /// Adjusts the skill to the outcome of a trial.
    pub fn learn(&mut self, piece: &Piece, passed: bool) {
        let surprise = f64::from(u8::from(passed)) - self.expected(piece);
        self.skills[piece.kind() as usize] += RATE * surprise;
    }

    /// Share of the records in use.
    pub fn fill(&self) -> f64 {
        self.records.iter().flatten().count() as f64 / RECORDS as f64
    }

    /// Probability of each record to be drawn. Records that are not in use have none.
    pub fn probabilities(&self, rule: Rule) -> [f64; RECORDS] {
        let by_score = match rule {
            Rule::Sfl | Rule::Accel => self.normalized(|_, record| self.score(record, rule)),
            Rule::Plr => self.normalized(|i, record| 1.0 / self.rank(i, record) as f64),
        };
        let by_age = self.normalized(|_, record| record.age + 1.0);
        let old = if rule == Rule::Plr { 0.3 } else { 0.2 };
        std::array::from_fn(|i| (1.0 - old) * by_score[i] + old * by_age[i])
    }

    /// Rank of a record's regret, 1 for the largest. Of equal ones, the first is higher.
    fn rank(&self, i: usize, record: &Record) -> usize {
        let own = record.regret();
        let higher = |(k, other): (usize, &Option<Record>)| {
            other.as_ref().map(Record::regret).is_some_and(|score| score > own || score == own && k < i)
        };
        1 + self.records.iter().enumerate().filter(|record| higher((record.0, record.1))).count()
    }

    /// Weights of the records, with the sum 1.
    fn normalized(&self, weight: impl Fn(usize, &Record) -> f64) -> [f64; RECORDS] {
        let weights: [f64; RECORDS] =
            std::array::from_fn(|i| self.records[i].as_ref().map_or(0.0, |record| weight(i, record).max(1e-6)));
        let sum: f64 = weights.iter().sum();
        weights.map(|weight| if sum > 0.0 { weight / sum } else { 0.0 })
    }

    /// Draws a record that is in use, given the probabilities.
    pub fn draw(&self, probabilities: &[f64; RECORDS], random: &mut EpisodeRng) -> Option<usize> {
        let mut left = random.uniform(0.0, 1.0);
        let used = || self.records.iter().enumerate().filter(|(_, record)| record.is_some()).map(|(i, _)| i);
        let drawn = used().find(|i| {
            left -= probabilities[*i];
            left < 0.0
        });
        // the probabilities may sum to a little less than 1
        drawn.or_else(|| used().next_back())
    }

    /// Adds the outcome of a trial to a record.
    pub fn charge(&mut self, i: usize, passed: bool, earned: f64) {
        if let Some(record) = &mut self.records[i] {
            record.charge(passed, earned);
        }
    }

    /// Makes all records an episode older.
    pub fn grow_older(&mut self) {
        self.records.iter_mut().flatten().for_each(|record| record.age += 1.0);
    }

    /// Puts a record where none is, or in the place of the one with the lowest score if its own is not lower. Under rules
    /// that need an estimate, records with few trials stay, and so does `parent`.
    pub fn admit(&mut self, record: Record, rule: Rule, parent: Option<usize>) {
        if let Some(free) = self.records.iter_mut().find(|record| record.is_none()) {
            *free = Some(record);
            return;
        }
        let may_go = |i: usize, known: &Record| Some(i) != parent && (rule == Rule::Plr || known.trials > TRIED);
        let scores = self.records.iter().enumerate().filter_map(|(i, known)| Some((i, known.as_ref()?)));
        let lowest = scores.filter(|(i, known)| may_go(*i, known)).map(|(i, known)| (i, self.score(known, rule)));
        if let Some((i, score)) = lowest.min_by(|a, b| a.1.total_cmp(&b.1))
            && self.score(&record, rule) >= score
        {
            self.records[i] = Some(record);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::pieces::PieceKind;
    use super::*;

    fn piece(seed: u64) -> Piece {
        Piece::random(&PieceKind::ALL, 0.5, &mut EpisodeRng::numbered(seed))
    }

    /// A record with trials of which some are passed, each with a return of 1 or 0.2.
    fn tried(seed: u64, trials: usize, passes: usize) -> Record {
        let mut record = Record::new(piece(seed));
        (0..trials).for_each(|i| record.charge(i < passes, if i < passes { 1.0 } else { 0.2 }));
        record
    }

    fn empty() -> Bank {
        Bank::read(&[0.0; SLOTS])
    }

    #[test]
    fn learnability_prefers_pieces_that_are_passed_half_of_the_time() {
        let score = |passes| empty().score(&tried(1, 10, passes), Rule::Sfl);
        assert!(score(5) > score(0) && score(5) > score(10) && score(2) > score(0));
    }

    /// Outcomes on pieces of a kind say what to expect of others.
    #[test]
    fn skills_predict_what_is_passed() {
        let mut bank = empty();
        let mut random = EpisodeRng::numbered(3);
        for _ in 0..300 {
            let piece = Piece::random(&[PieceKind::Gap], 1.0, &mut random);
            bank.learn(&piece, piece.size() < 0.6);
        }
        let expected = |size: f64| {
            let mut pieces = std::iter::repeat_with(|| Piece::random(&PieceKind::ALL, 1.0, &mut random));
            let piece = pieces.find(|piece| piece.kind() == PieceKind::Gap && (piece.size() - size).abs() < 0.02);
            bank.expected(&piece.unwrap())
        };
        let [small, middle, large] = [0.3, 0.6, 0.9].map(expected);
        assert!(small > 0.85 && large < 0.15 && (0.3..0.7).contains(&middle), "{small} {middle} {large}");
        let others = bank.skills.iter().enumerate().filter(|(i, _)| *i != PieceKind::Gap as usize);
        assert!(others.into_iter().all(|(_, skill)| *skill == NOVICE), "{:?}", bank.skills);
    }

    #[test]
    fn regret_is_the_best_return_minus_the_mean() {
        let record = tried(1, 2, 1);
        let mean = (1.0 * KEPT + 0.2) / (KEPT + 1.0 + 1.0);
        assert!((record.regret() - (1.0 - mean)).abs() < 1e-12);
        // passed always, or never: little to regret
        let [always, never, half] = [10, 0, 5].map(|passes| tried(1, 10, passes).regret());
        assert!(half > 3.0 * always && half > 3.0 * never, "{always} {never} {half}");
    }

    #[test]
    fn probabilities_follow_scores_and_ages() {
        let mut bank = empty();
        for (i, passes) in [0, 5, 10].into_iter().enumerate() {
            bank.records[2 * i] = Some(tried(i as u64, 10, passes));
        }
        for rule in [Rule::Sfl, Rule::Plr, Rule::Accel] {
            let drawn = bank.probabilities(rule);
            assert!((drawn.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{rule:?}");
            assert!(drawn[2] > drawn[0] && drawn[2] > drawn[4] && drawn[1] == 0.0, "{rule:?}: {drawn:?}");
            let mut older = bank.clone();
            older.records[4].as_mut().unwrap().age = 100.0;
            assert!(older.probabilities(rule)[4] > drawn[4] + 0.05, "{rule:?}");
            let mut counts = [0; RECORDS];
            let mut random = EpisodeRng::numbered(7);
            (0..10_000).for_each(|_| counts[bank.draw(&drawn, &mut random).unwrap()] += 1);
            for (count, p) in counts.iter().zip(drawn) {
                // four standard errors
                assert!((f64::from(*count) / 1e4 - p).abs() < 0.02, "{rule:?}: {count} {p}");
            }
        }
        assert_eq!(empty().draw(&empty().probabilities(Rule::Sfl), &mut EpisodeRng::numbered(1)), None);
    }

    #[test]
    fn newcomers_replace_the_record_with_the_lowest_score() {
        let mut bank = empty();
        for i in 0..RECORDS {
            let mut record = Record::new(piece(i as u64));
            (0..10).for_each(|trial| record.charge(i != 3 && trial % 2 == 0, 1.0));
            bank.admit(record, Rule::Sfl, None);
        }
        assert_eq!(bank.fill(), 1.0);
        let newcomer = || tried(99, 6, 6);
        let before = bank.clone();
        bank.admit(newcomer(), Rule::Accel, Some(3));
        assert_eq!(bank, before, "a parent stays, and the others are passed half of the time, which is worth more");
        bank.admit(newcomer(), Rule::Sfl, None);
        let others_stay = (0..RECORDS).all(|i| i == 3 || bank.records[i] == before.records[i]);
        assert!(bank.get(3).unwrap().piece == piece(99) && others_stay);
        // nothing is replaced before its first trial
        bank.records[3] = Some(Record::new(piece(100)));
        bank.admit(newcomer(), Rule::Sfl, None);
        assert!(bank.get(3).unwrap().piece == piece(100));
    }

    #[test]
    fn old_trials_count_less() {
        let mut record = tried(1, 100, 0);
        (0..8).for_each(|_| record.charge(true, 1.0));
        assert!((record.passes - 0.5 * record.trials).abs() < 0.05 * record.trials, "{record:?}");
    }

    #[test]
    fn a_bank_survives_the_memory_of_a_lane() {
        let mut bank = empty();
        (0..10).for_each(|i| bank.admit(tried(i, 7, i as usize % 7), Rule::Plr, None));
        bank.grow_older();
        let mut slots = [0.0; SLOTS];
        bank.write(&mut slots);
        let read = Bank::read(&slots);
        let mut again = [1.0; SLOTS];
        read.write(&mut again);
        assert_eq!(slots, again);
        assert_eq!(slots.map(|x| f64::from(x as f32)), slots);
        assert_eq!(read.get(4).unwrap().piece, bank.get(4).unwrap().piece);
    }
}
