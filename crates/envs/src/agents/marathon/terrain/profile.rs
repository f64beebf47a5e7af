//! The height profile of a course under construction.

/// Distance between the points of a course, m.
pub const CELL: f64 = 0.1;
/// Start of a course, m.
pub const FROM: f64 = -6.0;
/// End of a course, m.
pub const TO: f64 = 106.0;
/// Points of a course.
pub const POINTS: usize = ((TO - FROM) / CELL) as usize + 1;
/// End of the level ground around the start, m. The original's first six meters are level.
pub const LEVEL_TO: f64 = 5.0;
/// Largest height difference from the start, without gaps and single obstacles, m.
pub const FARTHEST: f64 = 4.0;

/// A height profile that grows along x.
pub(super) struct Profile {
    points: Vec<f64>,
    /// Height at the present end, m above the start.
    pub height: f64,
}

impl Profile {
    /// The level ground around the start.
    pub fn start() -> Self {
        let mut profile = Profile { points: Vec::with_capacity(POINTS), height: 0.0 };
        profile.level(LEVEL_TO - FROM);
        profile
    }

    /// Whether the course is complete.
    pub fn is_full(&self) -> bool {
        self.points.len() >= POINTS
    }

    /// The points of the complete course.
    pub fn finish(mut self) -> Vec<f64> {
        self.points.truncate(POINTS);
        self.points
    }

    /// Place of the present end along x, m.
    pub fn end(&self) -> f64 {
        FROM + CELL * self.points.len() as f64
    }

    /// Level ground.
    pub fn level(&mut self, length: f64) {
        self.slope(length, 0.0);
    }

    /// A slope at least one point long.
    pub fn slope(&mut self, length: f64, rise: f64) {
        let points = (length / CELL).round();
        for i in 1..=points as usize {
            self.points.push(self.height + rise * i as f64 / points);
        }
        self.height += if points > 0.0 { rise } else { 0.0 };
    }

    /// Ground that is higher or lower than its surroundings.
    pub fn beside(&mut self, length: f64, height: f64) {
        self.height += height;
        self.level(length);
        self.height -= height;
    }

    /// A smooth bump, u^2 (1 - u)^2. Its slope is 0 at both ends.
    pub fn bump(&mut self, length: f64, height: f64) {
        let points = (length / CELL).round();
        for i in 1..=points as usize {
            let u = i as f64 / points;
            let half = u * (1.0 - u);
            self.points.push(self.height + 16.0 * height * half * half);
        }
    }
}
