//! A moment of the reference motion, as agents read it.

use super::*;

/// A frame of each agent's clip. It has the quantities of [`Senses`](crate::Senses) in the same axes.
pub struct Frame<'a, T: Real> {
    pub(super) columns: &'a Columns,
    pub(super) rows: [&'a [T::Scalar]; MAX_LANES],
    /// The clip's origin in the world.
    pub(super) origin: [T; 2],
    /// Cosine and sine of the clip's yaw.
    pub(super) turn: [T; 2],
}

impl<T: Real> Frame<'_, T> {
    #[inline(always)]
    fn column(&self, i: usize) -> T {
        column::<T>(&self.rows, i)
    }

    /// A vector of the row in world axes.
    #[inline(always)]
    fn vector(&self, column: usize) -> [T; 3] {
        let ([cos, sin], [x, y]) = (self.turn, [self.column(column), self.column(column + 1)]);
        [sin.neg_mul_add(y, cos * x), sin.mul_add(x, cos * y), self.column(column + 2)]
    }

    #[inline(always)]
    fn point(&self, column: usize) -> [T; 3] {
        let [x, y, z] = self.vector(column);
        [x + self.origin[0], y + self.origin[1], z]
    }

    /// Coordinate `i` of a hinge, slide or ball joint. For a free joint, the value would be in the clip's own frame.
    #[inline(always)]
    pub fn qpos(&self, i: usize) -> T {
        self.column(self.columns.qpos + i)
    }

    /// Velocity `i` of a hinge, slide or ball joint.
    #[inline(always)]
    pub fn qvel(&self, i: usize) -> T {
        self.column(self.columns.qvel + i)
    }

    /// Position of a part's center in the world, m.
    #[inline(always)]
    pub fn position(&self, part: Part) -> [T; 3] {
        self.point(self.columns.parts + 6 * part.0)
    }

    /// Velocity of a part's center, world axes, m/s.
    #[inline(always)]
    pub fn linear_velocity(&self, part: Part) -> [T; 3] {
        self.vector(self.columns.parts + 6 * part.0 + 3)
    }

    /// Axes of the body that a part belongs to (columns x, y, z).
    #[inline(always)]
    pub fn axes(&self, part: Part) -> [[T; 3]; 3] {
        let first = self.columns.bodies + 12 * part.0;
        [self.vector(first), self.vector(first + 3), self.vector(first + 6)]
    }

    /// Angular velocity of the body that a part belongs to, world axes, rad/s.
    #[inline(always)]
    pub fn angular_velocity(&self, part: Part) -> [T; 3] {
        self.vector(self.columns.bodies + 12 * part.0 + 9)
    }

    /// Center of mass, m.
    #[inline(always)]
    pub fn center_of_mass(&self) -> [T; 3] {
        self.point(self.columns.center)
    }

    /// Velocity of the center of mass, m/s.
    #[inline(always)]
    pub fn center_of_mass_velocity(&self) -> [T; 3] {
        self.vector(self.columns.center + 3)
    }

    /// Whether touch site `i` of [`Facts::touch_sites`](crate::Facts::touch_sites) is on level ground.
    #[inline(always)]
    pub fn touch(&self, i: usize) -> T::Mask {
        T::lit(0.5).lt(self.column(self.columns.touch + i))
    }

    /// Lowest height of a part's center in the whole clip, m.
    #[inline(always)]
    pub fn lowest(&self, part: Part) -> T {
        self.column(self.columns.lowest + part.0)
    }

    /// Completed fraction of the clip, or of its cycle, 0 to 1.
    #[inline(always)]
    pub fn phase(&self) -> T {
        self.column(self.columns.phase + 4)
    }

    /// The phase as a continuous encoding: sine and cosine of its angle, and of twice the angle.
    #[inline(always)]
    pub fn phase_angles(&self) -> [T; 4] {
        [0, 1, 2, 3].map(|i| self.column(self.columns.phase + i))
    }

    /// The direction of travel: cosine and sine of its angle from +x. A clip starts facing +x, and the yaw of a lap is
    /// spread evenly. (The body's own heading is undefined in the middle of a flip.)
    #[inline(always)]
    pub fn facing(&self) -> [T; 2] {
        let (sin, cos) = self.column(self.columns.facing).sin_cos();
        let [c, s] = self.turn;
        [s.neg_mul_add(sin, c * cos), s.mul_add(cos, c * sin)]
    }
}
