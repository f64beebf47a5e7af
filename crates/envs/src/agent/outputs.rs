//! The outputs of an agent: its observation and the terms of its reward.

use marathon_physics::lanes::Real;

use super::{Part, Senses};

/// An observation under construction.
pub struct Obs<'a, T> {
    values: &'a mut [T],
    len: usize,
    groups: Option<&'a mut Vec<(&'static str, usize)>>,
}

impl<'a, T: Real> Obs<'a, T> {
    /// `groups` also records names and start indices, at registration.
    #[inline(always)]
    pub(crate) fn new(values: &'a mut [T], groups: Option<&'a mut Vec<(&'static str, usize)>>) -> Self {
        Obs { values, len: 0, groups }
    }

    /// How many numbers have been written, including those beyond the end.
    #[inline(always)]
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Names the numbers that follow, up to the next name; see [`Spec::observations`](crate::Spec::observations). An
    /// observation without names is called `observation`.
    #[inline(always)]
    pub fn group(&mut self, name: &'static str) {
        if let Some(groups) = &mut self.groups {
            groups.push((name, self.len));
        }
    }

    /// Appends one number.
    #[inline(always)]
    pub fn scalar(&mut self, x: T) {
        // registration counts the numbers and reports a wrong length
        if self.len < self.values.len() {
            self.values[self.len] = x;
        }
        self.len += 1;
    }

    /// Appends a vector.
    #[inline(always)]
    pub fn vector(&mut self, v: [T; 3]) {
        self.scalar(v[0]);
        self.scalar(v[1]);
        self.scalar(v[2]);
    }

    /// Appends 1 for each touch sensor that touches the ground, otherwise 0 (`SensorIsInTouch`).
    #[inline(always)]
    pub fn touch_sensors(&mut self, s: &Senses<T>) {
        for i in 0..s.touch_count() {
            self.scalar(T::masked(s.touch(i), T::lit(1.0)));
        }
    }

    /// Appends a quaternion x, y, z, w for each actuated pair of bodies (`JointRotations`), see
    /// [`Senses::joint_rotation`].
    #[inline(always)]
    pub fn joint_rotations(&mut self, s: &Senses<T>) {
        for i in 0..s.joint_rotation_count() {
            let [x, y, z, w] = s.joint_rotation(i);
            self.vector([x, y, z]);
            self.scalar(w);
        }
    }

    /// Appends the height of the ground relative to a part's center, m, mostly negative. The points are `[ahead, left]`
    /// of the center, relative to its heading, see [`Senses::ground_near`].
    #[inline(always)]
    pub fn height_scan(&mut self, s: &Senses<T>, part: Part, points: &[[f64; 2]]) {
        let height = s.height(part);
        for point in points {
            self.scalar(s.ground_near(part, *point) - height);
        }
    }

    /// Appends the velocity of every actuated joint (`JointVelocity`), see [`Senses::joint_velocity`].
    #[inline(always)]
    pub fn joint_velocities(&mut self, s: &Senses<T>) {
        for i in 0..s.motor_count() {
            self.scalar(s.joint_velocity(i));
        }
    }
}

/// The terms of a reward under construction. The reward is their sum.
pub struct Terms<'a, T> {
    values: &'a mut [T],
    len: usize,
    names: Option<&'a mut Vec<&'static str>>,
}

impl<'a, T: Real> Terms<'a, T> {
    /// `names` also records the terms, for the check at registration.
    #[inline(always)]
    pub(crate) fn new(values: &'a mut [T], names: Option<&'a mut Vec<&'static str>>) -> Self {
        Terms { values, len: 0, names }
    }

    /// Adds `weight * value` to the reward under a name. It must be the next name of the agent's
    /// [`Facts::reward_terms`](crate::Facts::reward_terms).
    #[inline(always)]
    pub fn add(&mut self, name: &'static str, weight: f64, value: T) {
        if self.len < self.values.len() {
            self.values[self.len] = T::lit(weight) * value;
        }
        self.len += 1;
        if let Some(names) = &mut self.names {
            names.push(name);
        }
    }

    /// Sets the terms to zero outside the lanes, and returns their sum there. It separates rewards of episode parts
    /// that belong to different roles.
    #[inline(always)]
    pub fn keep(&mut self, lanes: T::Mask) -> T {
        let others = T::masked(T::not(lanes), self.sum());
        let len = self.len.min(self.values.len());
        self.values[..len].iter_mut().for_each(|term| *term = T::masked(lanes, *term));
        others
    }

    /// Sum of the terms so far. An opponent may earn its negative.
    #[inline(always)]
    pub fn sum(&self) -> T {
        let mut sum = T::zero();
        for term in &self.values[..self.len.min(self.values.len())] {
            sum += *term;
        }
        sum
    }
}
