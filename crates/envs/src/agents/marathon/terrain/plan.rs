//! Courses that teach: an agent draws each piece of its next course from its [bank](super::bank), or makes a new one, and
//! learns from the outcome of the last course which pieces are worth a place in the bank.
//!
//! | piece of a course | `sfl`, `plr` | `accel` |
//! |---|---|---|
//! | from the bank | 50 % | 80 % |
//! | fresh: sizes of the whole range | 15 % | |
//! | easy: sizes up to a random share of a quarter of `difficulty` | 35 % | 20 % |
//!
//! | rule | enters the bank after an episode |
//! |---|---|
//! | `sfl` | twice the most learnable one of eight fresh pieces, before any trial |
//! | `plr` | one of the fresh pieces that were tried |
//! | `accel` | edits of up to three replayed pieces, and one of the easy pieces that were tried |
//!
//! Until the bank is full, pieces from it are rarer: at most the share of its records that are in use.
//!
//! An episode has one failed piece at most. The piece in which the torso was 0.25 s before a fall has failed, or the one
//! half a meter ahead of a figure that makes no new meter. The pieces before it are passed. If the time is up, or the
//! course is left, the last piece has no outcome.
//!
//! The return of a piece is the way made on it, in m, discounted with a time constant of 1 s.

use marathon_physics::lanes::Real;

use super::bank::{self, Bank, Record, Rule};
use super::pieces::{Piece, PieceKind};
use super::profile::{LEVEL_TO, Profile};
use super::{AT, HURT};
use crate::episode_rng::EpisodeRng;

/// Pieces of a course with an outcome. Later ones are ground to run on.
const PIECES: usize = 40;
/// Slots of the memory, after those of every course: seed of the course, place to which a fall is charged, whether no new
/// meter has come for too long, starts of pieces that the torso has reached, next start, return on the present piece and
/// its discount.
const SEED: usize = super::MEMORY;
const CAUSE: usize = SEED + 1;
const STUCK: usize = SEED + 2;
const REACHED: usize = SEED + 3;
const NEXT: usize = SEED + 4;
const EARNED: usize = SEED + 5;
const DISCOUNT: usize = SEED + 6;
/// Starts of the pieces along x, and the end of the last one, m.
const STARTS: usize = SEED + 7;
/// Returns of the pieces that are over, m.
const RETURNS: usize = STARTS + PIECES + 1;
const BANK: usize = RETURNS + PIECES;
pub(super) const MEMORY: usize = BANK + bank::SLOTS;

/// Time between the cause of a fall and the fall, s.
const REACTION: f64 = 0.25;
/// How far ahead of the torso the obstacle is that a figure does not pass, m.
const AHEAD: f64 = 0.5;
/// Time constant of the discount, s.
const HORIZON: f64 = 1.0;
/// Largest size of an easy piece as a share of the difficulty.
const EASY: f64 = 0.25;
/// Most children after an episode of `accel`; new pieces after one of `sfl`, and fresh ones from which each is chosen.
const CHILDREN: usize = 3;
const NEWCOMERS: usize = 2;
const CANDIDATES: usize = 8;
/// Number of seeds of courses. Lanes store them in single precision.
const SEEDS: usize = 1 << 24;
/// A place that no figure reaches, m.
const NEVER: f64 = 1e6;

/// Where a piece of a course comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    Bank(usize),
    Fresh,
    Easy,
}

/// How an agent chooses the pieces of its courses.
#[derive(Clone, Copy, Debug)]
pub(super) struct Teacher {
    pub rule: Rule,
    pub kinds: &'static [PieceKind],
    pub difficulty: f64,
}

impl Teacher {
    /// The pieces of the course with a seed, without end. They depend on the bank and the seed only.
    fn pieces<'a>(&'a self, bank: &'a Bank, seed: f64) -> impl Iterator<Item = (Source, Piece)> + 'a {
        let mut random = EpisodeRng::numbered(seed as u64);
        let probabilities = bank.probabilities(self.rule);
        let [replayed, fresh] = match self.rule {
            Rule::Sfl | Rule::Plr => [0.5, 0.3],
            Rule::Accel => [0.8, 0.0],
        };
        let replayed = bank.fill().min(replayed);
        std::iter::repeat_with(move || {
            let from_bank = random.uniform(0.0, 1.0) < replayed;
            if from_bank
                && let Some(i) = bank.draw(&probabilities, &mut random)
                && let Some(Record { piece, .. }) = bank.get(i)
            {
                return (Source::Bank(i), *piece);
            }
            let source = if random.uniform(0.0, 1.0) < fresh { Source::Fresh } else { Source::Easy };
            // fresh pieces have sizes of the full range
            let share = if source == Source::Fresh { 1.0 } else { random.uniform(0.0, EASY) };
            (source, Piece::random(self.kinds, share * self.difficulty, &mut random))
        })
    }

    /// The most learnable one of some fresh pieces.
    fn learnable(&self, bank: &Bank, random: &mut EpisodeRng) -> Record {
        let mut fresh = || Record::new(Piece::random(self.kinds, self.difficulty, random));
        let (mut best, score) = (fresh(), |record: &Record| bank.score(record, self.rule));
        for _ in 1..CANDIDATES {
            let other = fresh();
            best = if score(&other) > score(&best) { other } else { best };
        }
        best
    }

    /// The bank after an episode that has left the memory `previous`.
    fn settle(&self, previous: &[f64], random: &mut EpisodeRng) -> Bank {
        let before = Bank::read(&previous[BANK..]);
        let mut bank = before.clone();
        if previous[SEED] == 0.0 {
            return bank;
        }
        bank.grow_older();
        let (mut newcomers, mut replayed) = (Vec::new(), Vec::new());
        for (i, ((source, piece), passed)) in self.pieces(&before, previous[SEED]).zip(outcomes(previous)).enumerate() {
            let present = previous[REACHED] as usize;
            let earned = match (i + 1).cmp(&present) {
                std::cmp::Ordering::Less => previous[RETURNS + i],
                std::cmp::Ordering::Equal => previous[EARNED],
                std::cmp::Ordering::Greater => 0.0,
            };
            bank.learn(&piece, passed);
            match source {
                Source::Bank(record) => {
                    bank.charge(record, passed, earned);
                    replayed.push(record);
                }
                new if (new == Source::Easy) == (self.rule == Rule::Accel) && self.rule != Rule::Sfl => {
                    let mut record = Record::new(piece);
                    record.charge(passed, earned);
                    newcomers.push(record);
                }
                _ => {}
            }
        }
        if self.rule == Rule::Accel {
            replayed.retain(|i| bank.can_have_a_child(*i));
            for _ in 0..CHILDREN.min(replayed.len()) {
                let parent = replayed.swap_remove(random.whole(0, replayed.len() - 1));
                // another child may have taken its place
                if let Some(record) = bank.get(parent).filter(|_| bank.can_have_a_child(parent)) {
                    let child = record.piece.edited(bank.pass_rate(record), self.difficulty, random);
                    bank.admit(Record::new(child), self.rule, Some(parent));
                }
            }
        }
        match self.rule {
            Rule::Sfl => (0..NEWCOMERS).for_each(|_| bank.admit(self.learnable(&bank, random), self.rule, None)),
            // one of them: the others' places are needed until pieces are known well enough
            _ if !newcomers.is_empty() => {
                let record = newcomers.swap_remove(random.whole(0, newcomers.len() - 1));
                bank.admit(record, self.rule, None);
            }
            _ => {}
        }
        bank
    }

    /// Draws the course of an episode and writes its variables into `memory`. `previous`: the memory at the end of the
    /// last episode. Returns the course's points and its difficulty: the mean size of its pieces.
    pub fn draw(&self, previous: &[f64], memory: &mut [f64], random: &mut EpisodeRng) -> (Vec<f64>, f64) {
        self.settle(previous, random).write(&mut memory[BANK..]);
        // drawn from what the memory holds, so that the pieces can be found again after the episode
        let bank = Bank::read(&memory[BANK..]);
        let seed = random.whole(1, SEEDS - 1) as f64;
        let mut profile = Profile::start();
        let (mut sizes, mut count) = (0.0, 0);
        let starts = &mut memory[STARTS..=STARTS + PIECES];
        starts.fill(NEVER);
        for (_, piece) in self.pieces(&bank, seed) {
            if let Some(start) = starts.get_mut(count) {
                *start = profile.end();
            }
            if profile.is_full() {
                break;
            }
            (sizes, count) = (sizes + piece.size(), count + 1);
            piece.lay(&mut profile);
        }
        memory[SEED] = seed;
        memory[NEXT] = LEVEL_TO;
        (profile.finish(), sizes / count as f64)
    }
}

/// Whether each of the pieces with an outcome was passed, from the first one on. At most the last one was not.
fn outcomes(previous: &[f64]) -> Vec<bool> {
    let [fell, stuck] = [HURT, STUCK].map(|slot| previous[slot] > 0.5);
    let cause = if stuck && !fell { previous[AT] + AHEAD } else { previous[CAUSE] };
    let starts = &previous[STARTS..STARTS + PIECES];
    let reached = starts.iter().take_while(|start| **start <= cause).count();
    let beyond_all = previous[STARTS + PIECES] <= cause;
    let mut outcomes = vec![true; reached];
    if !beyond_all && let Some(last) = outcomes.last_mut() {
        *last = false;
        if !(fell || stuck) {
            outcomes.pop();
        }
    }
    outcomes
}

/// Sets the variables at the start of an episode. `memory`: the course's variables, here and below.
#[inline(always)]
pub(super) fn begin<T: Real>(memory: &mut [T]) {
    memory[CAUSE] = memory[AT];
    memory[DISCOUNT] = T::lit(1.0);
}

/// Updates the variables after a decision. `from`: where the torso was before it. `stuck`: lanes without a new meter for
/// too long.
#[inline(always)]
pub(super) fn remember<T: Real>(memory: &mut [T], from: T, stuck: T::Mask, dt: f64) {
    let (one, half, x) = (T::lit(1.0), T::lit(0.5), memory[AT]);
    let followed = memory[CAUSE] + T::lit((dt / REACTION).min(1.0)) * (x - memory[CAUSE]);
    // the first fall counts
    memory[CAUSE] = T::select(half.lt(memory[HURT]), memory[CAUSE], followed);
    memory[STUCK] = T::masked(stuck, one);
    memory[EARNED] += memory[DISCOUNT] * (x - from);
    memory[DISCOUNT] *= T::lit(libm::exp(-dt / HORIZON));
    let crosses = memory[NEXT].lt(x);
    if !T::any(crosses) {
        return;
    }
    let (earned, reached) = (memory[EARNED], memory[REACHED]);
    let mut next = T::lit(NEVER);
    for i in 0..PIECES {
        let here = T::and(crosses, (reached - T::lit(i as f64)).abs().lt(half));
        if i > 0 {
            memory[RETURNS + i - 1] = T::select(here, earned, memory[RETURNS + i - 1]);
        }
        next = T::select(here, memory[STARTS + i + 1], next);
    }
    let over = T::and(crosses, (reached - T::lit(PIECES as f64)).abs().lt(half));
    memory[RETURNS + PIECES - 1] = T::select(over, earned, memory[RETURNS + PIECES - 1]);
    memory[NEXT] = T::select(crosses, next, memory[NEXT]);
    memory[REACHED] += T::masked(crosses, one);
    memory[EARNED] = T::select(crosses, T::zero(), earned);
    memory[DISCOUNT] = T::select(crosses, one, memory[DISCOUNT]);
}

#[cfg(test)]
mod tests {
    use super::*;

    const RULES: [Rule; 3] = [Rule::Sfl, Rule::Plr, Rule::Accel];

    fn teacher(rule: Rule) -> Teacher {
        Teacher { rule, kinds: &PieceKind::ALL, difficulty: 1.0 }
    }

    /// Memory of an episode, after a run to `x` that ended with a fall or not.
    fn run_to(memory: &mut [f64], x: f64, fell: bool) {
        memory[AT] = 0.0;
        begin(memory);
        while memory[AT] < x {
            let from = memory[AT];
            memory[AT] += 0.04;
            remember(memory, from, f64::none(), 0.01);
        }
        memory[HURT] = f64::from(u8::from(fell));
    }

    fn single(memory: &[f64]) -> Vec<f64> {
        memory.iter().map(|x| f64::from(*x as f32)).collect()
    }

    #[test]
    fn one_piece_is_charged_with_a_fall() {
        let mut memory = vec![0.0; MEMORY];
        teacher(Rule::Sfl).draw(&[0.0; MEMORY], &mut memory, &mut EpisodeRng::numbered(1));
        let starts = memory[STARTS..STARTS + PIECES].to_vec();
        assert!(starts[0] == LEVEL_TO && starts.windows(2).all(|pair| pair[0] < pair[1] || pair[0] == NEVER));
        // 0.25 s at 4 m/s are a meter
        let mut fallen = memory.clone();
        run_to(&mut fallen, starts[4] + 1.5, true);
        let failed = outcomes(&fallen);
        assert_eq!(failed.iter().filter(|passed| !**passed).count(), 1);
        assert!(!failed[failed.len() - 1] && starts[failed.len() - 1] <= starts[4] + 0.5);
        let at_the_end = if starts[5] < starts[4] + 0.5 { 6 } else { 5 };
        assert_eq!(failed.len(), at_the_end);
        // returns of the pieces before it: the way, discounted
        for i in 0..4 {
            let length = starts[i + 1] - starts[i];
            let expected = 4.0 * (1.0 - (-length / 4.0).exp());
            let earned = fallen[RETURNS + i];
            assert!((earned - expected).abs() < 0.07, "piece {i} of {length} m: {earned} {expected}");
        }
        let mut ended = memory.clone();
        run_to(&mut ended, starts[4] + 1.5, false);
        assert_eq!(outcomes(&ended), vec![true; at_the_end - 1], "the last piece has no outcome");
        run_to(&mut memory, 4.0, true);
        assert!(outcomes(&memory).is_empty(), "a fall before the first piece");
    }

    #[test]
    fn a_figure_that_stops_has_failed_at_what_is_ahead() {
        let mut memory = vec![0.0; MEMORY];
        teacher(Rule::Plr).draw(&[0.0; MEMORY], &mut memory, &mut EpisodeRng::numbered(2));
        let start = memory[STARTS + 2];
        run_to(&mut memory, start - 0.3, false);
        memory[STUCK] = 1.0;
        assert_eq!(outcomes(&memory), [true, true, false]);
    }

    /// The bank fills, and its records' trials are those of the pieces that were drawn from it.
    #[test]
    fn outcomes_reach_the_records_of_their_pieces() {
        for rule in RULES {
            let teacher = teacher(rule);
            let (mut previous, mut replayed) = (vec![0.0; MEMORY], 0);
            for episode in 0..300 {
                let mut memory = vec![0.0; MEMORY];
                let (points, difficulty) = teacher.draw(&previous, &mut memory, &mut EpisodeRng::numbered(episode));
                assert!(points.iter().all(|z| z.is_finite()) && (0.0..=1.0).contains(&difficulty));
                // what a lane of single precision keeps leads to the same course
                let mut again = vec![0.0; MEMORY];
                let twin = teacher.draw(&single(&previous), &mut again, &mut EpisodeRng::numbered(episode));
                assert!(twin.0 == points && again == memory, "{rule:?}, episode {episode}");
                run_to(&mut memory, 6.0 + (episode % 23) as f64, episode % 3 > 0);
                memory = single(&memory);
                let before = Bank::read(&memory[BANK..]);
                let from_bank = |(source, _): &(Source, Piece)| matches!(source, Source::Bank(_));
                let pieces = teacher.pieces(&before, memory[SEED]);
                replayed += pieces.take(outcomes(&memory).len()).filter(from_bank).count();
                previous = memory;
            }
            let bank = Bank::read(&previous[BANK..]);
            assert!(bank.fill() == 1.0 && replayed > 200, "{rule:?}: {replayed}");
        }
    }

    /// A figure that passes small pieces only: edits make pieces larger, up to what it can pass.
    #[test]
    fn edits_grow_up_to_what_a_figure_can_pass() {
        let teacher = Teacher { kinds: &[PieceKind::Gap], ..teacher(Rule::Accel) };
        let mut previous = vec![0.0; MEMORY];
        let mut largest: f64 = 0.0;
        for episode in 0..600 {
            let mut memory = vec![0.0; MEMORY];
            teacher.draw(&previous, &mut memory, &mut EpisodeRng::numbered(episode));
            let bank = Bank::read(&memory[BANK..]);
            let mut pieces = teacher.pieces(&bank, memory[SEED]).take(PIECES);
            let stopped = pieces.position(|(_, piece)| piece.size() > 0.6).unwrap_or(PIECES).min(12);
            let x = memory[STARTS + stopped] + 1.1;
            run_to(&mut memory, x, true);
            previous = single(&memory);
            largest = (0..bank::RECORDS).filter_map(|i| bank.get(i)).map(|r| r.piece.size()).fold(largest, f64::max);
        }
        assert!(largest > 0.55 && largest < 0.95, "{largest}");
    }
}
