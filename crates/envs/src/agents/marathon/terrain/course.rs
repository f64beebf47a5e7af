//! Courses: height profiles of the ground along x, constant along y. For a figure in space, a course is extended to a
//! height field.
//!
//! A course is level near the start and then consists of random pieces. Everything that makes a piece hard scales with
//! the difficulty, 0 to 1. At 0, every course is level.

use super::pieces::PieceKind;
use super::profile::Profile;
pub use super::profile::{CELL, FARTHEST, FROM, LEVEL_TO, POINTS, TO};
use crate::agent::options::Choice;
use crate::episode_rng::EpisodeRng;

/// Depth of a gap, m.
const DEPTH: f64 = 0.6;
/// Distance between the rows of a field, m.
pub const ROW: f64 = 0.5;
/// Largest obliqueness of the pieces of a field: m along x per m to the side.
const OBLIQUE: f64 = 0.3;
/// Distance over which a field becomes oblique, m.
const BECOMES: f64 = 8.0;
/// Largest height of a field's bumps, m.
const UNEVEN: f64 = 0.08;
/// Points along x from one bump to the next.
const KNOT: usize = 5;

/// Kind of ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Level ground.
    Flat,
    /// Slopes of up to 19 degrees, 1 to 4 m long.
    Slopes,
    /// Single steps up and down of up to 25 cm.
    Steps,
    /// Flights of three to eight stairs up to 16 cm high, up and down again.
    Stairs,
    /// Gaps up to 90 cm wide.
    Gaps,
    /// Stones up to 12 cm high, one every 20 cm.
    Rubble,
    /// Boxes across the track, up to 35 cm high.
    Boxes,
    /// Pieces of all those above.
    Mixed,
    /// The original's ground: each meter is up to 1 m higher or lower than the one before, in steps of 0.1 m (21
    /// choices).
    Meters,
    /// Handmade for experiment 001: bumps up to 77 cm high.
    Bumps,
    /// Handmade for experiment 002: blocks.
    Blocks,
    /// Built by an adversary while the figure runs.
    Adversary,
}

impl Choice for Kind {
    const EXPECTED: &'static str =
        "flat, slopes, steps, stairs, gaps, rubble, boxes, mixed, meters, bumps, blocks or adversary";
    const NAMED: &'static [(Self, &'static str)] = &[
        (Kind::Flat, "flat"),
        (Kind::Slopes, "slopes"),
        (Kind::Steps, "steps"),
        (Kind::Stairs, "stairs"),
        (Kind::Gaps, "gaps"),
        (Kind::Rubble, "rubble"),
        (Kind::Boxes, "boxes"),
        (Kind::Mixed, "mixed"),
        (Kind::Meters, "meters"),
        (Kind::Bumps, "bumps"),
        (Kind::Blocks, "blocks"),
        (Kind::Adversary, "adversary"),
    ];
}

/// Kinds of the pieces in a mixed course.
const MIX: [Kind; 6] = [Kind::Slopes, Kind::Steps, Kind::Stairs, Kind::Gaps, Kind::Rubble, Kind::Boxes];
/// Length, height and distance to the next bump, m. The original's terrain is a sculpture, of which only the largest
/// height is known.
const BUMPS: [[f64; 3]; 6] =
    [[2.0, 0.15, 1.0], [3.0, 0.4, 0.0], [1.5, 0.2, 2.0], [4.0, 0.77, 1.0], [1.0, 0.1, 0.0], [1.0, 0.15, 1.5]];
/// The same for blocks.
const BLOCKS: [[f64; 3]; 5] = [[0.6, 0.1, 3.0], [1.2, 0.2, 2.0], [0.4, 0.3, 4.0], [2.0, 0.25, 1.5], [0.8, 0.15, 2.5]];

impl Kind {
    /// Elevations of a course's points, m above the start.
    pub fn elevations(self, difficulty: f64, random: &mut EpisodeRng) -> Vec<f64> {
        let mut course = Course { profile: Profile::start(), difficulty, random };
        let mut piece = 0;
        while !course.profile.is_full() {
            course.add(self, piece);
            piece += 1;
        }
        course.profile.finish()
    }

    /// Kinds of the pieces that levels with a bank draw for this course. Empty if the course has no random pieces.
    pub(super) fn pieces(self) -> &'static [PieceKind] {
        match self {
            Kind::Slopes => &[PieceKind::Slope],
            Kind::Steps => &[PieceKind::Step],
            Kind::Stairs => &[PieceKind::Stairs],
            Kind::Gaps => &[PieceKind::Gap],
            Kind::Rubble => &[PieceKind::Rubble],
            Kind::Boxes => &[PieceKind::Box],
            Kind::Mixed => &PieceKind::ALL,
            _ => &[],
        }
    }

    /// Heights of a field for a figure in space, m above the start, in rows of increasing y. A field of two rows is a
    /// course, constant along y. With more rows, random pieces are oblique and have bumps that differ along y.
    pub fn field(self, difficulty: f64, rows: usize, random: &mut EpisodeRng) -> Vec<f32> {
        let course = self.elevations(difficulty, random);
        let uneven = MIX.contains(&self) || self == Kind::Mixed;
        extend(&course, uneven.then_some(difficulty), rows, random)
    }
}

/// A field of a course. With a difficulty and more than two rows, it is oblique and has bumps.
pub(super) fn extend(course: &[f64], difficulty: Option<f64>, rows: usize, random: &mut EpisodeRng) -> Vec<f32> {
    let Some(difficulty) = difficulty.filter(|_| rows > 2) else {
        let row = course.iter().map(|z| *z as f32);
        return (0..rows).flat_map(|_| row.clone()).collect();
    };
    let oblique = random.around_zero(OBLIQUE * difficulty);
    let knots_in_row = POINTS.div_ceil(KNOT) + 1;
    let knots: Vec<f64> = (0..rows * knots_in_row).map(|_| random.uniform(0.0, UNEVEN * difficulty)).collect();
    let first = (LEVEL_TO - FROM) / CELL;
    let mut field = Vec::with_capacity(rows * POINTS);
    for (row, knots) in knots.chunks_exact(knots_in_row).enumerate() {
        let aside = oblique * ROW * (row as f64 - 0.5 * (rows - 1) as f64) / CELL;
        for point in 0..POINTS {
            let from_start = point as f64 - first;
            // the obliqueness grows from 0 at the start
            let share = (from_start * CELL / BECOMES).clamp(0.0, 1.0);
            let (knot, part) = (point / KNOT, (point % KNOT) as f64 / KNOT as f64);
            let bump = (1.0 - part) * knots[knot] + part * knots[knot + 1];
            let z = between(course, point as f64 + share * aside);
            field.push((z + bump * (from_start * CELL).clamp(0.0, 1.0)) as f32);
        }
    }
    field
}

/// Height between two points of a course. Outside, the height of the nearest end.
fn between(course: &[f64], at: f64) -> f64 {
    let at = at.clamp(0.0, (course.len() - 1) as f64);
    let (i, part) = ((at as usize).min(course.len() - 2), at - libm::floor(at));
    if at as usize > i { course[i + 1] } else { (1.0 - part) * course[i] + part * course[i + 1] }
}

/// A course under construction.
struct Course<'a> {
    profile: Profile,
    difficulty: f64,
    random: &'a mut EpisodeRng,
}

impl Course<'_> {
    /// Adds a piece. `piece` counts from 0.
    fn add(&mut self, kind: Kind, piece: usize) {
        let hard = self.difficulty;
        match kind {
            Kind::Flat | Kind::Adversary => self.profile.level(10.0),
            Kind::Slopes => {
                let length = self.random.uniform(1.0, 4.0);
                let slope = self.signed(0.0, 0.35 * hard);
                self.profile.slope(length, slope * length);
                self.pause(0.0, 1.0);
            }
            Kind::Steps => {
                self.profile.height += self.signed(0.075 * hard, 0.25 * hard);
                self.pause(0.6, 2.0);
            }
            Kind::Stairs => {
                let (count, rise) = (self.random.whole(3, 8), self.random.uniform(0.06, 0.16) * hard);
                let (tread, first) = (self.random.uniform(0.3, 0.5), self.signed(1.0, 1.0).signum());
                for side in [first, -first] {
                    for _ in 0..count {
                        self.profile.height += side * rise;
                        self.profile.level(tread);
                    }
                    self.pause(1.0, 2.0);
                }
            }
            Kind::Gaps => {
                let width = self.random.uniform(0.3, 0.9) * hard;
                self.profile.beside(width, -DEPTH);
                self.pause(1.5, 4.0);
            }
            Kind::Rubble => {
                for _ in 0..self.random.whole(10, 20) {
                    let height = self.random.uniform(0.0, 0.12) * hard;
                    self.profile.beside(0.2, height);
                }
                self.pause(0.5, 1.5);
            }
            Kind::Boxes => {
                let (height, length) = (self.random.uniform(0.1, 0.35) * hard, self.random.uniform(0.3, 1.0));
                self.profile.beside(length, height);
                self.pause(1.5, 4.0);
            }
            Kind::Mixed => {
                let kind = MIX[self.random.whole(0, MIX.len() - 1)];
                self.add(kind, piece);
            }
            Kind::Meters => {
                let steps = self.random.whole(0, 20) as f64 - 10.0;
                let rise = (self.profile.height + 0.1 * steps * hard).clamp(-FARTHEST, FARTHEST) - self.profile.height;
                self.profile.slope(1.0, rise);
            }
            Kind::Bumps => {
                let [length, height, pause] = BUMPS[piece % BUMPS.len()];
                self.profile.bump(length, height * hard);
                self.profile.level(pause);
            }
            Kind::Blocks => {
                let [length, height, pause] = BLOCKS[piece % BLOCKS.len()];
                self.profile.beside(length, height * hard);
                self.profile.level(pause);
            }
        }
    }

    /// Level ground of a random length in a range.
    fn pause(&mut self, least: f64, most: f64) {
        let length = self.random.uniform(least, most);
        self.profile.level(length);
    }

    /// A random number with an absolute value in a range. The sign is random, or leads back if the height is near its
    /// limit.
    fn signed(&mut self, least: f64, most: f64) -> f64 {
        let size = self.random.uniform(least, most);
        let up = match self.profile.height {
            high if high > FARTHEST - 1.5 => false,
            low if low < 1.5 - FARTHEST => true,
            _ => self.random.uniform(0.0, 1.0) < 0.5,
        };
        if up { size } else { -size }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::episode_rng::EpisodeId;

    /// Kinds whose courses are level at first.
    const LEVEL: [Kind; 2] = [Kind::Flat, Kind::Adversary];

    fn elevations(kind: Kind, difficulty: f64, episode: u64) -> Vec<f64> {
        kind.elevations(difficulty, &mut EpisodeRng::new(EpisodeId { seed: 1, agent: 0, episode }))
    }

    #[test]
    fn courses_begin_level_and_end_where_they_should() {
        for (kind, name) in Kind::NAMED {
            for episode in 0..20 {
                let points = elevations(*kind, 1.0, episode);
                assert_eq!(points.len(), POINTS, "{name}");
                let level = ((LEVEL_TO - FROM) / CELL) as usize;
                assert!(points[..level].iter().all(|z| *z == 0.0), "{name}");
                let most = points.iter().fold(0.0f64, |most, z| most.max(z.abs()));
                assert!(most <= FARTHEST + DEPTH, "{name} {most}");
                assert_eq!(most > 0.0, !LEVEL.contains(kind), "{name}");
            }
        }
    }

    /// A field is level at the start. It varies along y if its pieces are random, otherwise not.
    #[test]
    fn fields_are_uneven_to_all_sides() {
        const ROWS: usize = 17;
        for (kind, name) in Kind::NAMED {
            for episode in 0..5 {
                let mut random = EpisodeRng::new(EpisodeId { seed: 1, agent: 0, episode });
                let field = kind.field(1.0, ROWS, &mut random);
                assert_eq!(field.len(), ROWS * POINTS, "{name}");
                let rows: Vec<&[f32]> = field.chunks_exact(POINTS).collect();
                let level = ((LEVEL_TO - FROM) / CELL) as usize;
                assert!(rows.iter().all(|row| row[..level].iter().all(|z| *z == 0.0)), "{name}");
                let random = MIX.contains(kind) || *kind == Kind::Mixed;
                assert_eq!(rows.windows(2).all(|pair| pair[0] == pair[1]), !random, "{name}");
                let course = elevations(*kind, 1.0, episode);
                for (z, own) in rows[ROWS / 2].iter().zip(&course) {
                    let more = f64::from(*z) - own;
                    assert!((-1e-6..=if random { UNEVEN + 1e-6 } else { 1e-6 }).contains(&more), "{name}: {more}");
                }
            }
            let mut random = EpisodeRng::new(EpisodeId { seed: 1, agent: 0, episode: 9 });
            assert!(kind.field(0.0, ROWS, &mut random).iter().all(|z| *z == 0.0), "{name}");
        }
    }

    #[test]
    fn difficulty_makes_courses_rough() {
        let roughness = |kind: Kind, difficulty: f64| {
            let of = |episode| {
                let points = elevations(kind, difficulty, episode);
                points.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum::<f64>()
            };
            (0..20).map(of).sum::<f64>()
        };
        for (kind, name) in Kind::NAMED.iter().filter(|(kind, _)| !LEVEL.contains(kind)) {
            let [none, some, all] = [0.0, 0.5, 1.0].map(|difficulty| roughness(*kind, difficulty));
            assert_eq!(none, 0.0, "{name}");
            // the depth of a gap does not depend on its width
            let least = match kind {
                Kind::Gaps => 0.9,
                Kind::Mixed => 1.2,
                _ => 1.5,
            };
            assert!(all > least * some && some > 0.0, "{name}: {some}, {all}");
        }
    }

    #[test]
    fn only_courses_made_by_hand_repeat() {
        for (kind, name) in Kind::NAMED {
            let by_hand = LEVEL.contains(kind) || [Kind::Bumps, Kind::Blocks].contains(kind);
            assert_eq!(elevations(*kind, 1.0, 1) == elevations(*kind, 1.0, 2), by_hand, "{name}");
        }
    }
}
