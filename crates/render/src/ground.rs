//! The floor: a checker and distance marks, filtered over each pixel's footprint to avoid flicker.

use std::io::Write;

use glam::DVec3;

use crate::font;
use crate::palette::{self, linear};

/// Layout of the distance marks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Marks {
    pub visible: bool,
    /// Side of a checker square and distance between numbers, m. It is 1 for agents of about human size.
    pub cell: f64,
    /// Decimals of the numbers.
    pub decimals: usize,
    /// Upper edge of the numbers, m. They lie between the camera and the character.
    pub y: f64,
}

impl Marks {
    /// Marks for an agent of the given reach.
    pub fn new(radius: f64, half_width: f64) -> Self {
        // a tenth, one, ten, ... meters, whichever is nearest to the agent's size
        let power = libm::log10((radius / 0.8).max(1e-6)).round();
        let cell = libm::pow(10.0, power);
        let decimals = if power < 0.0 { -power as usize } else { 0 };
        Self { visible: true, cell, decimals, y: -half_width - 0.12 * cell }
    }
}

/// A point on the floor and the size of the pixel there, both in m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footprint {
    pub at: [f64; 2],
    pub size: [f64; 2],
}

/// The floor's paint, prepared for one picture.
pub(crate) struct Ground {
    marks: Marks,
    checker: [DVec3; 2],
    number: DVec3,
    fifth: DVec3,
    start: DVec3,
}

/// Width of a painted line and of one font dot, in cells.
const LINE: f64 = 0.035;
const DOT: [f64; 2] = [0.022, 0.052];
/// Size factor of the numbers at every fifth cell.
const FIFTH: f64 = 1.5;

impl Ground {
    pub fn new(marks: Marks) -> Self {
        Self {
            marks,
            checker: palette::CHECKER.map(linear),
            number: linear(palette::NUMBER),
            fifth: linear(palette::FIFTH_LINE),
            start: linear(palette::START_LINE),
        }
    }

    /// Mean color of the floor, linear light.
    pub fn mean(&self) -> DVec3 {
        0.5 * (self.checker[0] + self.checker[1])
    }

    /// Reflectance over a footprint; `painted` adds the marks.
    pub fn albedo(&self, footprint: Footprint, painted: bool) -> DVec3 {
        let cell = self.marks.cell;
        let at = footprint.at.map(|x| x / cell);
        let size = footprint.size.map(|w| (w / cell).max(1e-4));
        let mut color = self.checker[0].lerp(self.checker[1], checker(at, size));
        if !painted || !self.marks.visible {
            return color;
        }

        // a line at every fifth cell; the one at 0 has its own color
        let nearest = 5.0 * (at[0] / 5.0).round();
        let line = if nearest == 0.0 { self.start } else { self.fifth };
        let width = if nearest == 0.0 { 1.6 * LINE } else { LINE };
        color = color.lerp(line, 0.8 * coverage(at[0] - nearest, size[0], width).min(width / size[0].min(5.0)));

        let number = self.number(at, size);
        if number > 0.0 { color.lerp(self.number, 0.9 * number) } else { color }
    }

    /// Share of the footprint covered by a meter number.
    fn number(&self, at: [f64; 2], size: [f64; 2]) -> f64 {
        let index = at[0].round();
        let scale = if index % 5.0 == 0.0 { FIFTH } else { 1.0 };
        let dot = DOT.map(|d| d * scale);
        // y points away from the viewer, rows of a glyph toward the viewer
        let row = (self.marks.y / self.marks.cell - at[1]) / dot[1];
        let rows = size[1] / dot[1];
        if row < -rows || row > font::HEIGHT as f64 + rows || size[0] > 0.5 {
            return 0.0;
        }

        let mut text = [0_u8; 24];
        let room = text.len();
        let mut rest = &mut text[..];
        // cannot fail: the number of any reachable meter has fewer digits
        let _ = match self.marks.decimals {
            0 => write!(rest, "{}", (index * self.marks.cell) as i64),
            decimals => write!(rest, "{:.decimals$}", index * self.marks.cell + 0.0),
        };
        let length = room - rest.len();
        let text = &text[..length];

        let columns = (length * font::ADVANCE - 1) as f64;
        // next to the line of a fifth cell, else centered on its meter mark
        let shift = if index % 5.0 == 0.0 { -(1.2 * LINE) / dot[0] } else { 0.5 * columns };
        let column = (at[0] - index) / dot[0] + shift;
        let wide = size[0] / dot[0];
        if column < -wide || column > columns + wide {
            return 0.0;
        }
        // exact box filter: overlap of the footprint with every lit dot
        let mut share = 0.0;
        for (place, &character) in text.iter().enumerate() {
            for (x, bits) in font::glyph(char::from(character)).iter().enumerate() {
                let center = (place * font::ADVANCE + x) as f64 + 0.5;
                let across = coverage(column - center, wide, 1.0);
                if across > 0.0 {
                    for y in (0..font::HEIGHT).filter(|y| bits >> y & 1 == 1) {
                        share += across * coverage(row - (y as f64 + 0.5), rows, 1.0);
                    }
                }
            }
        }
        share.min(1.0)
    }
}

/// Share of an interval of length `size` about `x` that lies within `width / 2` of 0.
fn coverage(x: f64, size: f64, width: f64) -> f64 {
    let low = (x - 0.5 * size).max(-0.5 * width);
    let high = (x + 0.5 * size).min(0.5 * width);
    ((high - low) / size).max(0.0)
}

/// Mean of the 0/1 checker of unit squares over a footprint, by the integral of its square waves (Quilez 2016).
fn checker(at: [f64; 2], size: [f64; 2]) -> f64 {
    let wave = |x: f64, w: f64| {
        let triangle = |x: f64| ((x * 0.5) - (x * 0.5).floor() - 0.5).abs();
        2.0 * (triangle(x - 0.5 * w) - triangle(x + 0.5 * w)) / w
    };
    0.5 - 0.5 * wave(at[0], size[0]) * wave(at[1], size[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean over a fine grid of point samples.
    fn sampled(at: [f64; 2], size: [f64; 2], value: impl Fn(f64, f64) -> f64) -> f64 {
        let n = 200;
        let mut sum = 0.0;
        for i in 0..n * n {
            let offset = |k: usize| (k as f64 + 0.5) / n as f64 - 0.5;
            sum += value(at[0] + size[0] * offset(i % n), at[1] + size[1] * offset(i / n));
        }
        sum / (n * n) as f64
    }

    #[test]
    fn checker_is_the_mean_over_the_footprint() {
        let point = |x: f64, y: f64| (x.floor() + y.floor()).rem_euclid(2.0);
        for (at, size) in [([0.3, 0.4], [0.1, 0.1]), ([0.98, 2.1], [0.3, 0.5]), ([-3.7, 1.02], [0.9, 1.7])] {
            let (got, want) = (checker(at, size), sampled(at, size, point));
            let inverse = 1.0 - want;
            assert!((got - want).abs() < 0.02 || (got - inverse).abs() < 0.02, "{at:?}: {got} {want}");
        }
        // neighbors differ, far away the mean remains
        assert!((checker([0.5, 0.5], [0.01, 0.01]) - checker([1.5, 0.5], [0.01, 0.01])).abs() > 0.99);
        assert!((checker([0.5, 0.5], [64.0, 64.0]) - 0.5).abs() < 0.02);
    }

    #[test]
    fn numbers_stand_at_their_meters() {
        let ground = Ground::new(Marks::new(0.8, 0.3));
        let size = [0.005, 0.005];
        let ink = |meter: f64| {
            let mut sum = 0.0;
            for i in 0..40 {
                for j in 0..80 {
                    let at = [meter + (f64::from(i) - 20.0) * 0.01, ground.marks.y - f64::from(j) * 0.01];
                    sum += ground.number(at, size);
                }
            }
            sum
        };
        // '7' has less ink than '8', two digits more than one, and there is none between numbers
        assert!(ink(7.0) > 10.0 && ink(8.0) > 1.2 * ink(7.0) && ink(12.0) > ink(7.0));
        assert_eq!(ground.number([7.5, ground.marks.y - 0.1], size), 0.0);
    }
}
