//! Pieces of a course as parameter vectors: a kind, up to six numbers and the seed of a layout. They can be drawn, edited,
//! stored in an agent's memory and laid on a course.
//!
//! | kind | numbers with their bounds at difficulty 1; those marked * scale with the difficulty |
//! |---|---|
//! | slope | length 1 to 4 m; slope* -0.5 to 0.5; level ground after it 0 to 1 m |
//! | step | height* -0.4 to 0.4 m; level ground after it 0.4 to 2 m |
//! | stairs | stairs up 2 to 10; rise* 0.04 to 0.24 m; tread 0.22 to 0.5 m; up or down first; level ground after each flight 0.4 to 2 m |
//! | gap | width* 0.1 to 1.4 m; depth 0.3 to 1 m; level ground after it 0.8 to 4 m |
//! | rubble | stones 4 to 20; height* 0 to 0.18 m; length of a stone 0.1 to 0.4 m; level ground after it 0.5 to 1.5 m |
//! | box | height* 0.05 to 0.55 m; length 0.2 to 2 m; level ground after it 0.8 to 4 m |

use super::profile::{FARTHEST, Profile};
use crate::episode_rng::EpisodeRng;

/// Most numbers of a piece.
const MOST: usize = 6;
/// Slots that a piece takes in an agent's memory: kind, numbers and seed.
pub(super) const SLOTS: usize = MOST + 2;
/// Seeds lie below this. Single precision, in which lanes store them, counts up to it.
const SEEDS: usize = 1 << 24;
/// Most numbers that an edit changes, and the largest change in the number's steps.
const EDITS: usize = 2;
const STRIDE: f64 = 3.0;
/// Share of edits that change a size. The others change any number.
const SIZES: f64 = 0.5;
/// Share of edits that mirror a piece that can be mirrored.
const MIRRORED: f64 = 0.1;
/// Share of edits that keep the seed: the same layout, a little different in size.
const SAME_SEED: f64 = 0.5;

/// Kind of a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PieceKind {
    Slope,
    Step,
    Stairs,
    Gap,
    Rubble,
    Box,
}

/// A number of a piece.
struct Number {
    /// Bounds at difficulty 1.
    bounds: [f64; 2],
    /// Step of an edit. 1 for whole numbers.
    step: f64,
    /// Meaning.
    role: Role,
}

/// Meaning of a number.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Role {
    /// A size that scales with the difficulty.
    Size,
    /// A length or depth that does not.
    Length,
    /// A whole number.
    Count,
    /// -1 or 1.
    Side,
}

const fn number(role: Role, low: f64, high: f64, step: f64) -> Number {
    Number { bounds: [low, high], step, role }
}

impl PieceKind {
    /// All kinds.
    pub const ALL: [PieceKind; 6] =
        [PieceKind::Slope, PieceKind::Step, PieceKind::Stairs, PieceKind::Gap, PieceKind::Rubble, PieceKind::Box];

    /// The numbers.
    const fn numbers(self) -> &'static [Number] {
        use Role::{Count, Length, Side, Size};
        match self {
            PieceKind::Slope => {
                const { &[number(Length, 1.0, 4.0, 0.25), number(Size, -0.5, 0.5, 0.04), number(Length, 0.0, 1.0, 0.1)] }
            }
            PieceKind::Step => const { &[number(Size, -0.4, 0.4, 0.03), number(Length, 0.4, 2.0, 0.1)] },
            PieceKind::Stairs => {
                const {
                    &[
                        number(Count, 2.0, 10.0, 1.0),
                        number(Size, 0.04, 0.24, 0.01),
                        number(Length, 0.22, 0.5, 0.02),
                        number(Side, -1.0, 1.0, 2.0),
                        number(Length, 0.4, 2.0, 0.1),
                    ]
                }
            }
            PieceKind::Gap => {
                const { &[number(Size, 0.1, 1.4, 0.06), number(Length, 0.3, 1.0, 0.05), number(Length, 0.8, 4.0, 0.2)] }
            }
            PieceKind::Rubble => {
                const {
                    &[
                        number(Count, 4.0, 20.0, 2.0),
                        number(Size, 0.0, 0.18, 0.01),
                        number(Length, 0.1, 0.4, 0.05),
                        number(Length, 0.5, 1.5, 0.1),
                    ]
                }
            }
            PieceKind::Box => {
                const { &[number(Size, 0.05, 0.55, 0.03), number(Length, 0.2, 2.0, 0.1), number(Length, 0.8, 4.0, 0.2)] }
            }
        }
    }

    /// The number whose sign mirrors the piece up and down.
    const fn side(self) -> Option<usize> {
        match self {
            PieceKind::Slope => Some(1),
            PieceKind::Step => Some(0),
            PieceKind::Stairs => Some(3),
            PieceKind::Gap | PieceKind::Rubble | PieceKind::Box => None,
        }
    }
}

/// A piece of a course.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    kind: PieceKind,
    numbers: [f64; MOST],
    /// Seed of the layout, for the stones of rubble.
    seed: f64,
}

/// A value in single precision. Lanes store the memory in it, so a piece must not have more digits.
fn single(x: f64) -> f64 {
    f64::from(x as f32)
}

impl Piece {
    /// A random piece of one of some kinds. Sizes are drawn within their bounds times the difficulty.
    pub fn random(kinds: &[PieceKind], difficulty: f64, random: &mut EpisodeRng) -> Self {
        let kind = kinds[random.whole(0, kinds.len() - 1)];
        let mut numbers = [0.0; MOST];
        for (x, Number { bounds: [low, high], role, .. }) in numbers.iter_mut().zip(kind.numbers()) {
            *x = single(match role {
                Role::Size => random.uniform(*low, *high) * difficulty,
                Role::Length => random.uniform(*low, *high),
                Role::Count => random.whole(*low as usize, *high as usize) as f64,
                Role::Side => [-1.0, 1.0][random.whole(0, 1)],
            });
        }
        Piece { kind, numbers, seed: seed(random) }
    }

    /// A child that differs in one or two numbers, or is mirrored. It stays within the bounds of the difficulty. A size
    /// grows with the probability `grows`, otherwise it shrinks.
    pub fn edited(&self, grows: f64, difficulty: f64, random: &mut EpisodeRng) -> Self {
        let mut child = *self;
        let all = self.kind.numbers();
        for _ in 0..random.whole(1, EDITS) {
            if let Some(side) = self.kind.side()
                && random.uniform(0.0, 1.0) < MIRRORED
            {
                child.numbers[side] = -child.numbers[side];
                continue;
            }
            let sizes_only = random.uniform(0.0, 1.0) < SIZES;
            // the sides have an edit of their own
            let may = |role: Role| if sizes_only { role == Role::Size } else { role != Role::Side };
            let can = || all.iter().enumerate().filter(|(_, number)| may(number.role));
            let Some((i, number)) = can().nth(random.whole(0, can().count() - 1)) else { continue };
            let up = random.uniform(0.0, 1.0) < if number.role == Role::Size { grows } else { 0.5 };
            let change = number.step * random.uniform(0.0, STRIDE) * if up { 1.0 } else { -1.0 };
            let x = &mut child.numbers[i];
            *x += match number.role {
                // downwards, a size grows to the other side
                Role::Size if *x < 0.0 => -change,
                Role::Count => away_from_zero(change),
                _ => change,
            };
        }
        if random.uniform(0.0, 1.0) >= SAME_SEED {
            child.seed = seed(random);
        }
        child.bounded(difficulty)
    }

    /// The nearest piece within the bounds of a difficulty. A size may be as small as 0.
    fn bounded(mut self, difficulty: f64) -> Self {
        for (x, Number { bounds: [low, high], role, .. }) in self.numbers.iter_mut().zip(self.kind.numbers()) {
            let [low, high] = match role {
                Role::Size => [low.min(0.0) * difficulty, high * difficulty],
                _ => [*low, *high],
            };
            *x = single(x.clamp(low, high));
        }
        self
    }

    /// Kind of the piece.
    pub fn kind(&self) -> PieceKind {
        self.kind
    }

    /// Size of the piece as a share of the largest one at difficulty 1.
    pub fn size(&self) -> f64 {
        let of = |(x, number): (&f64, &Number)| match number.role {
            Role::Size => x.abs() / number.bounds[1],
            _ => 0.0,
        };
        self.numbers.iter().zip(self.kind.numbers()).map(of).fold(0.0, f64::max)
    }

    /// Lays the piece at the end of a profile. A piece that would leave the range of heights is mirrored.
    pub fn lay(&self, profile: &mut Profile) {
        let [a, b, c, d, e, _] = self.numbers;
        let side = |lean: f64| if (profile.height + lean).abs() > FARTHEST { -1.0 } else { 1.0 };
        match self.kind {
            PieceKind::Slope => {
                let rise = a * b;
                profile.slope(a, side(rise) * rise);
                profile.level(c);
            }
            PieceKind::Step => {
                profile.height += side(a) * a;
                profile.level(b);
            }
            PieceKind::Stairs => {
                let first = side(d * a * b) * d;
                for side in [first, -first] {
                    for _ in 0..a as usize {
                        profile.height += side * b;
                        profile.level(c);
                    }
                    profile.level(e);
                }
            }
            PieceKind::Gap => {
                profile.beside(a, -b);
                profile.level(c);
            }
            PieceKind::Rubble => {
                let mut layout = EpisodeRng::numbered(self.seed as u64);
                for _ in 0..a as usize {
                    profile.beside(c, layout.uniform(0.0, b));
                }
                profile.level(d);
            }
            PieceKind::Box => {
                profile.beside(b, a);
                profile.level(c);
            }
        }
    }

    /// Reads a piece from an agent's memory. `None` if the slots hold none.
    pub fn read(slots: &[f64]) -> Option<Self> {
        let kind = *PieceKind::ALL.get((slots[0] as usize).checked_sub(1)?)?;
        let mut numbers = [0.0; MOST];
        numbers.copy_from_slice(&slots[1..=MOST]);
        Some(Piece { kind, numbers, seed: slots[MOST + 1] })
    }

    /// Writes the piece into an agent's memory.
    pub fn write(&self, slots: &mut [f64]) {
        slots[0] = 1.0 + self.kind as usize as f64;
        slots[1..=MOST].copy_from_slice(&self.numbers);
        slots[MOST + 1] = self.seed;
    }
}

/// The seed of a layout.
fn seed(random: &mut EpisodeRng) -> f64 {
    random.whole(0, SEEDS - 1) as f64
}

/// The next whole number away from 0.
fn away_from_zero(x: f64) -> f64 {
    x.abs().ceil().copysign(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether each number of a piece lies within the bounds of a difficulty. Fresh sizes are at least their lower bound.
    fn is_within(piece: &Piece, difficulty: f64) -> bool {
        piece.numbers.iter().zip(piece.kind.numbers()).all(|(x, number)| {
            let [low, high] = number.bounds;
            match number.role {
                Role::Size => (low.min(0.0) * difficulty - 1e-7..=high * difficulty + 1e-7).contains(x),
                Role::Length => (low - 1e-7..=high + 1e-7).contains(x),
                Role::Count => (low..=high).contains(x) && x.fract() == 0.0,
                Role::Side => x.abs() == 1.0,
            }
        })
    }

    #[test]
    fn pieces_and_their_edits_stay_within_their_bounds() {
        let mut random = EpisodeRng::numbered(1);
        for difficulty in [0.0, 0.3, 1.0] {
            for kind in PieceKind::ALL {
                let mut piece = Piece::random(&[kind], difficulty, &mut random);
                assert!(piece.kind == kind && is_within(&piece, difficulty), "{piece:?}");
                let (mut same, mut seeds) = (0, 0);
                for _ in 0..300 {
                    let child = piece.edited(0.5, difficulty, &mut random);
                    assert!(child.kind == kind && is_within(&child, difficulty), "{piece:?} {child:?}");
                    assert!(child.size() <= difficulty + 1e-6);
                    same += usize::from(child.numbers == piece.numbers);
                    seeds += usize::from(child.seed == piece.seed);
                    piece = child;
                }
                // no size changes on level ground
                let most = if difficulty > 0.0 { 90 } else { 300 };
                assert!(same < most && (100..200).contains(&seeds), "{kind:?}: {same} without a change, {seeds} seeds");
            }
        }
    }

    /// Edits reach the whole range: from the smallest pieces to the largest ones.
    #[test]
    fn edits_can_make_a_piece_large() {
        let mut random = EpisodeRng::numbered(2);
        for kind in PieceKind::ALL {
            let mut largest = Piece::random(&[kind], 0.05, &mut random);
            for _ in 0..400 {
                let child = largest.edited(0.5, 1.0, &mut random);
                largest = if child.size() > largest.size() { child } else { largest };
            }
            assert!(largest.size() > 0.95, "{largest:?}");
        }
    }

    #[test]
    fn a_piece_survives_the_memory_of_a_lane() {
        let mut random = EpisodeRng::numbered(3);
        for _ in 0..100 {
            let piece = Piece::random(&PieceKind::ALL, 0.7, &mut random).edited(0.5, 0.7, &mut random);
            let mut slots = [0.0; SLOTS];
            piece.write(&mut slots);
            assert_eq!(Piece::read(&slots.map(|x| f64::from(x as f32))), Some(piece));
        }
        assert_eq!(Piece::read(&[0.0; SLOTS]), None);
    }

    #[test]
    fn pieces_lie_on_the_course_within_its_range() {
        let mut random = EpisodeRng::numbered(4);
        for difficulty in [0.0, 1.0] {
            for _ in 0..100 {
                let mut profile = Profile::start();
                while !profile.is_full() {
                    let (before, piece) = (profile.end(), Piece::random(&PieceKind::ALL, difficulty, &mut random));
                    piece.lay(&mut profile);
                    let length = profile.end() - before;
                    assert!(length > 0.35 && length < 16.0, "{piece:?}: {length} m");
                }
                let most = profile.finish().into_iter().fold(0.0, |most: f64, z| most.max(z.abs()));
                assert!(most <= FARTHEST + 1.0 && (most > 0.0) == (difficulty > 0.0), "{most}");
            }
        }
    }

    #[test]
    fn rubble_of_one_seed_has_one_layout() {
        let mut random = EpisodeRng::numbered(5);
        let piece = Piece::random(&[PieceKind::Rubble], 1.0, &mut random);
        let laid = |piece: &Piece| {
            let mut profile = Profile::start();
            piece.lay(&mut profile);
            profile.finish()
        };
        assert_eq!(laid(&piece), laid(&piece));
        assert_ne!(laid(&piece), laid(&Piece { seed: piece.seed + 1.0, ..piece }));
    }
}
