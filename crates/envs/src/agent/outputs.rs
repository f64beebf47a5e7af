//! Where an agent writes to: its observation and the terms of its reward.

use marathon_physics::lanes::Real;

use super::{Part, Senses};

/// An observation in the making.
pub struct Obs<'a, T> {
    values: &'a mut [T],
    len: usize,
    groups: Option<&'a mut Vec<(&'static str, usize)>>,
}

impl<'a, T: Real> Obs<'a, T> {
    /// `groups` also records names and where they begin, at registration.
    #[inline(always)]
    pub(crate) fn new(values: &'a mut [T], groups: Option<&'a mut Vec<(&'static str, usize)>>) -> Self {
        Obs { values, len: 0, groups }
    }

    /// How many numbers have been written, those beyond the end included.
    #[inline(always)]
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Names the numbers that follow, up to the next name: [`Spec::observations`](crate::Spec::observations). Observations
    /// without any names are called `observation`.
    #[inline(always)]
    pub fn group(&mut self, name: &'static str) {
        if let Some(groups) = &mut self.groups {
            groups.push((name, self.len));
        }
    }

    /// Appends one number.
    #[inline(always)]
    pub fn scalar(&mut self, x: T) {
        // a wrong length is found when the agent is registered, by counting
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

    /// Appends 1 per touch sensor that touches the ground and 0 per one that does not (`SensorIsInTouch`).
    #[inline(always)]
    pub fn touch_sensors(&mut self, s: &Senses<T>) {
        for i in 0..s.touch_count() {
            self.scalar(T::masked(s.touch(i), T::lit(1.0)));
        }
    }

    /// Appends a quaternion x, y, z, w per actuated pair of bodies (`JointRotations`), see [`Senses::joint_rotation`].
    #[inline(always)]
    pub fn joint_rotations(&mut self, s: &Senses<T>) {
        for i in 0..s.joint_rotation_count() {
            let [x, y, z, w] = s.joint_rotation(i);
            self.vector([x, y, z]);
            self.scalar(w);
        }
    }

    /// Appends how far the ground is above the center of a part, m, mostly negative, at points `[ahead, left]` of it by its
    /// heading, see [`Senses::ground_near`].
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

/// The terms of a reward in the making; the reward is their sum.
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

    /// Adds `weight * value` to the reward under a name, which must be the next of the agent's
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

    /// Keeps what has been added in some lanes only; returns its sum in the others: what is earned in a part of the episode that
    /// is another role's.
    #[inline(always)]
    pub fn keep(&mut self, lanes: T::Mask) -> T {
        let others = T::masked(T::not(lanes), self.sum());
        let len = self.len.min(self.values.len());
        self.values[..len].iter_mut().for_each(|term| *term = T::masked(lanes, *term));
        others
    }

    /// Sum of the terms that have been added: what an opponent's reward may be the inverse of.
    #[inline(always)]
    pub fn sum(&self) -> T {
        let mut sum = T::zero();
        for term in &self.values[..self.len.min(self.values.len())] {
            sum += *term;
        }
        sum
    }
}
