// one file: the list of readings that agents can take
//! An agent's perception, and the paper's library of bonuses and penalties.
//!
//! The names are those of the original's `MarathonAgent` (`GetForwardBonus`, `GetEffort`, ...) in Rust's casing. As in
//! the original, orientations are compared by angle, not by cosine. A bonus falls linearly from its maximum at 0 to its
//! negative at 180 degrees. World axes: +x forward, +y left, +z up.

use std::f64::consts::{FRAC_1_PI, FRAC_2_PI};
use std::ops::Range;

use marathon_physics::Readings;
use marathon_physics::lanes::Real;

use super::bindings::Bindings;
use super::reference::{Frame, Reference, center_of_mass};
use super::{Body, Motors, Part};

/// Speed at which [`Senses::velocity`] is 1, m/s.
pub const MAX_SPEED: f64 = 4.0;
/// Penalty per joint driven at its limit.
pub const AT_LIMIT_PENALTY: f64 = 0.2;
/// Largest forward and upright bonus.
pub const MAX_BONUS: f64 = 0.5;

/// An agent's state after a decision, with one value per lane.
pub struct Senses<'a, T: Real> {
    pub(crate) readings: Readings<'a, T>,
    pub(crate) bindings: &'a Bindings<T>,
    /// The clips that the agent follows.
    pub(crate) reference: Option<&'a Reference<T>>,
    /// The action, see [`Facts::controls`](crate::Facts::controls).
    pub(crate) action: &'a [T],
    /// The command that applies to the present call.
    pub(crate) command: &'a [T],
    pub(crate) memory: &'a [T],
    /// Whether an episode has just begun. There has been no physics step with contacts yet.
    pub(crate) fresh: bool,
    /// Lanes whose episode has reached its time limit.
    pub(crate) last: T::Mask,
    /// Seconds between decisions.
    pub(crate) dt: f64,
}

impl<T: Real> Senses<'_, T> {
    // ------------------------------------------------------------------------------------------------ perception

    /// Position of a part's center in the world, m.
    #[inline(always)]
    pub fn position(&self, part: Part) -> [T; 3] {
        self.readings.geom_pos(self.bindings.parts[part.0].geom)
    }

    /// Velocity of a part's center, world axes, m/s.
    #[inline(always)]
    pub fn linear_velocity(&self, part: Part) -> [T; 3] {
        self.readings.geom_velocity(self.bindings.parts[part.0].geom)
    }

    /// The axis of a part that pointed forward (+x) in the spawn pose.
    #[inline(always)]
    pub fn forward(&self, part: Part) -> [T; 3] {
        let part = &self.bindings.parts[part.0];
        turn(&self.readings.body_axes(part.body), &part.forward)
    }

    /// The axis of a part that pointed up (+z) in the spawn pose.
    #[inline(always)]
    pub fn up(&self, part: Part) -> [T; 3] {
        let part = &self.bindings.parts[part.0];
        turn(&self.readings.body_axes(part.body), &part.up)
    }

    /// Axes of the body that a part belongs to (columns x, y, z).
    #[inline(always)]
    pub fn axes(&self, part: Part) -> [[T; 3]; 3] {
        self.readings.body_axes(self.bindings.parts[part.0].body)
    }

    /// Angular velocity of the body that a part belongs to, world axes, rad/s.
    #[inline(always)]
    pub fn angular_velocity(&self, part: Part) -> [T; 3] {
        self.readings.body_angular_velocity(self.bindings.parts[part.0].body)
    }

    /// Center of mass of all moving bodies, m, with the model's masses.
    #[inline(always)]
    pub fn center_of_mass(&self) -> [T; 3] {
        center_of_mass(&self.readings, &self.bindings.mass_shares)[0]
    }

    /// Velocity of the center of mass, m/s.
    #[inline(always)]
    pub fn center_of_mass_velocity(&self) -> [T; 3] {
        center_of_mass(&self.readings, &self.bindings.mass_shares)[1]
    }

    /// Lanes in which this decision is the last one of the time limit, for rewards at the end of an episode. An episode
    /// that ends earlier has no such decision.
    #[inline(always)]
    pub fn time_is_up(&self) -> T::Mask {
        self.last
    }

    /// Number of touch sensors.
    #[inline(always)]
    pub fn touch_count(&self) -> usize {
        self.bindings.touch.len()
    }

    /// Whether touch sensor `i` touches the ground at the end of the decision. False at the start of an episode.
    #[inline(always)]
    pub fn touch(&self, i: usize) -> T::Mask {
        if self.fresh { T::none() } else { self.readings.touching(self.bindings.touch[i]) }
    }

    /// Whether a part touched the ground in any physics step of the decision. False at the start of an episode.
    #[inline(always)]
    pub fn touched_ground(&self, part: Part) -> T::Mask {
        if self.fresh { T::none() } else { self.readings.touched(self.bindings.parts[part.0].geom) }
    }

    /// Force on touch site `i` of [`Facts::touch_sites`](crate::Facts::touch_sites), N: the value of MuJoCo's touch
    /// sensor at the last physics step. At the start of an episode, it is the value without controls.
    #[inline(always)]
    pub fn touch_force(&self, i: usize) -> T {
        self.readings.touch_forces()[i]
    }

    /// Number of actuated pairs of bodies.
    #[inline(always)]
    pub fn joint_rotation_count(&self) -> usize {
        self.bindings.pairs.len()
    }

    /// Orientation of the parent relative to the child, `inverse(R_child) R_parent`, for the `i`-th actuated pair of
    /// bodies in the order of the actuators. The quaternion is `[x, y, z, w]` with `w >= 0`. A joint with several axes
    /// is one pair.
    #[inline(always)]
    pub fn joint_rotation(&self, i: usize) -> [T; 4] {
        let [w, x, y, z] = self.bindings.pairs[i].rotation(&self.readings);
        let flip = w.lt(T::zero());
        // the inverse of a unit quaternion has the opposite vector part
        [T::select(flip, x, -x), T::select(flip, y, -y), T::select(flip, z, -z), T::select(flip, -w, w)]
    }

    /// Number of motors that drive a joint.
    #[inline(always)]
    pub fn motor_count(&self) -> usize {
        self.bindings.motors.len()
    }

    /// Velocity of the joint that motor `i` drives: rad/s divided by pi (half turns per second) for a hinge, m/s for a
    /// slide. (The original differentiated an Euler angle that wrapped; this is the intended value.)
    #[inline(always)]
    pub fn joint_velocity(&self, i: usize) -> T {
        let motor = &self.bindings.motors[i];
        self.readings.qvel(motor.dof) * T::splat(motor.velocity_scale)
    }

    /// Length of the action.
    #[inline(always)]
    pub fn action_count(&self) -> usize {
        self.action.len()
    }

    /// Component `i` of the action, clipped to [-1, 1] unless the agent takes it [raw](crate::Controls::Raw).
    #[inline(always)]
    pub fn action(&self, i: usize) -> T {
        self.action[i]
    }

    /// Height of the ground at a point in the world, m. The ground consists of planes and level height fields, with the
    /// agent's own heights. Outside of it, the nearest point counts. It is 0 if the model has no ground.
    #[inline(always)]
    pub fn ground_height(&self, x: T, y: T) -> T {
        self.readings.ground_height(&self.bindings.grounds, x, y)
    }

    /// Height of the ground `ahead` of a part's center and to its `left`, m, relative to its
    /// [heading](Senses::heading).
    #[inline(always)]
    pub fn ground_near(&self, part: Part, [ahead, left]: [f64; 2]) -> T {
        let ([x, y, _], [c, s]) = (self.position(part), self.heading(part));
        let (ahead, left) = (T::lit(ahead), T::lit(left));
        self.ground_height(s.neg_mul_add(left, c.mul_add(ahead, x)), c.mul_add(left, s.mul_add(ahead, y)))
    }

    /// Heading of a part: cosine and sine of the angle from +x to its forward axis along the ground. If the axis is
    /// vertical, the heading is +x.
    #[inline(always)]
    pub fn heading(&self, part: Part) -> [T; 2] {
        let [x, y, _] = self.forward(part);
        let length = hypot(x, y);
        let level = T::lit(1e-6).lt(length);
        let scale = T::select(level, length, T::lit(1.0)).recip();
        [T::select(level, x * scale, T::lit(1.0)), T::masked(level, y * scale)]
    }

    /// Number `i` of the command, see [`Facts::command`](crate::Facts::command). For an observation, it is the command
    /// that applies from now on. For everything else, it is the one under which the last decision was made.
    #[inline(always)]
    pub fn command(&self, i: usize) -> T {
        self.command[i]
    }

    /// Number `i` of the agent's memory, see [`Agent::remember`](crate::Agent::remember).
    #[inline(always)]
    pub fn memory(&self, i: usize) -> T {
        self.memory[i]
    }

    /// The frame of the agent's clip `ahead` decisions from now, at most [`MOST_AHEAD`](super::reference::MOST_AHEAD).
    /// 0 is the present frame.
    ///
    /// # Panics
    /// If the facts name no clips, or `ahead` is too large.
    #[inline(always)]
    pub fn reference(&self, ahead: usize) -> Frame<'_, T> {
        self.followed().frame(self.memory, ahead)
    }

    /// The same for a memory that [`Agent::remember`](crate::Agent::remember) is changing.
    #[inline(always)]
    pub fn reference_of(&self, memory: &[T], ahead: usize) -> Frame<'_, T> {
        self.followed().frame(memory, ahead)
    }

    /// The row range of clip `i` in the table of all clips, see [`Start::clips`](crate::Start::clips).
    #[inline(always)]
    pub fn clip_rows(&self, i: usize) -> Range<usize> {
        self.followed().timeline.clips[i].rows.clone()
    }

    /// Advances the clip by one decision. Call it once in [`Agent::remember`](crate::Agent::remember).
    #[inline(always)]
    pub fn follow(&self, memory: &mut [T]) {
        self.followed().advance(memory);
    }

    /// Lanes in which the clip has ended. A looping clip never ends.
    #[inline(always)]
    pub fn clip_over(&self) -> T::Mask {
        self.followed().over(self.memory)
    }

    #[inline(always)]
    fn followed(&self) -> &Reference<T> {
        self.reference.expect("the facts name clips")
    }

    /// Index of a body, for the [readings](Senses::readings).
    #[inline(always)]
    pub fn body(&self, body: Body) -> usize {
        self.bindings.bodies[body.0]
    }

    /// Contact wrench on a body, see [`Readings::cfrc_ext`]: torque, N m, and force, N. Zero at the start of an
    /// episode.
    #[inline(always)]
    pub fn contact_wrench(&self, body: usize) -> [T; 6] {
        if self.fresh { [T::zero(); 6] } else { self.readings.cfrc_ext(body) }
    }

    /// Whether an episode has just begun, with no physics step so far.
    #[inline(always)]
    pub fn fresh(&self) -> bool {
        self.fresh
    }

    /// Seconds between decisions.
    #[inline(always)]
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// The physics: every coordinate, velocity, body and geom of the model, by index.
    #[inline(always)]
    pub fn readings(&self) -> &Readings<'_, T> {
        &self.readings
    }

    // -------------------------------------------------------------------------------------------- helper library

    /// `GetVelocity`: forward velocity of a part in units of 4 m/s.
    #[inline(always)]
    pub fn velocity(&self, part: Part) -> T {
        self.linear_velocity(part)[0] * T::lit(1.0 / MAX_SPEED)
    }

    /// The normalized velocity of the `-v1` agents: forward velocity over `fastest` (m/s), clamped to [0, 1].
    #[inline(always)]
    pub fn normalized_velocity(&self, part: Part, fastest: f64) -> T {
        unit(self.linear_velocity(part)[0] * T::lit(1.0 / fastest))
    }

    /// `GetDirectionBonus`: `max` if the unit vectors coincide, falling linearly with the angle to `-max` at 180
    /// degrees. (At exactly 180 degrees, the original jumps back to `max`.)
    #[inline(always)]
    pub fn direction_bonus(&self, axis: [T; 3], direction: [T; 3], max: f64) -> T {
        angle(axis, direction).neg_mul_add(T::lit(2.0 * max * FRAC_1_PI), T::lit(max))
    }

    /// `GetForwardBonus`: 0.5 - angle / 180 degrees, with the angle between a part's forward axis and +x. It detects
    /// pitch and yaw, not roll.
    #[inline(always)]
    pub fn forward_bonus(&self, part: Part) -> T {
        self.forward_bonus_of(part, MAX_BONUS)
    }

    /// The forward bonus with a maximum other than 0.5.
    #[inline(always)]
    pub fn forward_bonus_of(&self, part: Part, max: f64) -> T {
        self.direction_bonus(self.forward(part), world::<T>(0), max)
    }

    /// `GetUprightBonus`: 0.5 - angle / 180 degrees, with the angle between a part's up axis and +z. It detects pitch
    /// and roll, not yaw.
    #[inline(always)]
    pub fn upright_bonus(&self, part: Part) -> T {
        self.upright_bonus_of(part, MAX_BONUS)
    }

    /// The upright bonus with a maximum other than 0.5.
    #[inline(always)]
    pub fn upright_bonus_of(&self, part: Part, max: f64) -> T {
        self.direction_bonus(self.up(part), world::<T>(2), max)
    }

    /// `GetLeftBonus`: angle of a part's forward axis out of the sagittal plane to the left, divided by 180 degrees. It
    /// is 0 when straight, at most 0.5, and negative to the right.
    #[inline(always)]
    pub fn left_bonus(&self, part: Part) -> T {
        let [x, y, z] = self.forward(part);
        y.atan2(hypot(x, z)) * T::lit(FRAC_1_PI)
    }

    /// `GetRightBonus`: the negative of [`Senses::left_bonus`].
    #[inline(always)]
    pub fn right_bonus(&self, part: Part) -> T {
        -self.left_bonus(part)
    }

    /// Elevation of a part's forward axis above the horizon, in quarter turns. For a thigh, this is the flexion of the
    /// hip.
    #[inline(always)]
    pub fn flexion(&self, part: Part) -> T {
        let [x, y, z] = self.forward(part);
        z.atan2(hypot(x, y)) * T::lit(FRAC_2_PI)
    }

    /// `GetHeight`: height of a part's center above 0, m. (The original searches for the lowest foot and finds none,
    /// which leaves the height above 0.)
    #[inline(always)]
    pub fn height(&self, part: Part) -> T {
        self.position(part)[2]
    }

    /// `GetHeightPenality`: distance of a part below `height`, clamped to [0, height].
    #[inline(always)]
    pub fn height_penalty(&self, part: Part, height: f64) -> T {
        clamp(T::lit(height) - self.height(part), 0.0, height)
    }

    /// `GetEffort`: sum of squared actions, except those of the motors in `ignore`.
    #[inline(always)]
    pub fn effort(&self, ignore: Motors) -> T {
        let mut sum = T::zero();
        for (i, a) in self.action.iter().enumerate() {
            if !ignore.contains(i) {
                sum = a.mul_add(*a, sum);
            }
        }
        sum
    }

    /// Mean of squared actions, except those of the motors in `ignore`.
    #[inline(always)]
    pub fn effort_mean(&self, ignore: Motors) -> T {
        self.effort(ignore) * T::lit(1.0 / self.counted(ignore))
    }

    /// `GetEffortSum`: sum of the actions' absolute values, except those of the motors in `ignore`.
    #[inline(always)]
    pub fn effort_sum(&self, ignore: Motors) -> T {
        let mut sum = T::zero();
        for (i, a) in self.action.iter().enumerate() {
            if !ignore.contains(i) {
                sum += a.abs();
            }
        }
        sum
    }

    /// `GetJointsAtLimitPenality`: 0.2 for each motor at full action, |a| >= 1, except those in `ignore`. As in the
    /// original, the test uses the action, not the joint's angle.
    #[inline(always)]
    pub fn joints_at_limit_penalty(&self, ignore: Motors) -> T {
        let mut sum = T::zero();
        for (i, a) in self.action.iter().enumerate() {
            if !ignore.contains(i) {
                sum += T::select(a.abs().lt(T::lit(1.0)), T::zero(), T::lit(AT_LIMIT_PENALTY));
            }
        }
        sum
    }

    /// `TerminateNever`.
    #[inline(always)]
    pub fn terminate_never(&self) -> T::Mask {
        T::none()
    }

    /// `TerminateOnNonFootHitTerrain`: lanes in which a geom that is not in [`Facts::feet`](crate::Facts::feet) touched
    /// the ground in any physics step of the decision.
    #[inline(always)]
    pub fn terminate_on_non_foot_contact(&self) -> T::Mask {
        let mut hit = T::none();
        if !self.fresh {
            for geom in &self.bindings.not_feet {
                hit = T::or(hit, self.readings.touched(*geom));
            }
        }
        hit
    }

    #[inline(always)]
    fn counted(&self, ignore: Motors) -> f64 {
        let mut n = 0;
        for i in 0..self.action.len() {
            n += usize::from(!ignore.contains(i));
        }
        n.max(1) as f64
    }
}

/// `x` clamped to [low, high].
#[inline(always)]
pub fn clamp<T: Real>(x: T, low: f64, high: f64) -> T {
    x.max(T::lit(low)).min(T::lit(high))
}

/// `x` clamped to [0, 1].
#[inline(always)]
pub fn unit<T: Real>(x: T) -> T {
    clamp(x, 0.0, 1.0)
}

/// Angle between two vectors, rad, from the length of their cross product and their dot product. An arc cosine would
/// lose half of the digits near 0.
#[inline(always)]
pub fn angle<T: Real>(a: [T; 3], b: [T; 3]) -> T {
    let dot = a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]));
    let x = a[1].mul_add(b[2], -(a[2] * b[1]));
    let y = a[2].mul_add(b[0], -(a[0] * b[2]));
    let z = a[0].mul_add(b[1], -(a[1] * b[0]));
    x.mul_add(x, y.mul_add(y, z * z)).sqrt().atan2(dot)
}

/// World axis `i`.
#[inline(always)]
fn world<T: Real>(i: usize) -> [T; 3] {
    let mut v = [T::zero(); 3];
    v[i] = T::lit(1.0);
    v
}

/// Length of a two-dimensional vector.
#[inline(always)]
pub(crate) fn hypot<T: Real>(x: T, y: T) -> T {
    x.mul_add(x, y * y).sqrt()
}

/// A constant vector of a body's frame in world axes, given the body's axes.
#[inline(always)]
fn turn<T: Real>(axes: &[[T; 3]; 3], v: &[T::Scalar; 3]) -> [T; 3] {
    let mut out = [T::zero(); 3];
    for (i, o) in out.iter_mut().enumerate() {
        *o = axes[0][i].mul_add(T::splat(v[0]), axes[1][i].mul_add(T::splat(v[1]), axes[2][i] * T::splat(v[2])));
    }
    out
}
