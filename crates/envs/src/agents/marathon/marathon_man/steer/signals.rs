//! Reference signals of a commanded character: direction, target velocity, pace and gait, and what it observes and is
//! rewarded for.

use super::*;

impl Steer {
    /// Angle from the heading to a direction, rad.
    #[inline(always)]
    pub(in super::super) fn off<T: Real>(s: &Senses<T>, direction: [T; 2]) -> T {
        heading::off(s.heading(BUTT), direction)
    }

    /// Commanded direction.
    #[inline(always)]
    pub(in super::super) fn direction<T: Real>(s: &Senses<T>) -> [T; 2] {
        [s.memory(DIRECTION), s.memory(DIRECTION + 1)]
    }

    /// Speed of the center of mass along the ground, m/s.
    #[inline(always)]
    pub(in super::super) fn speed<T: Real>(s: &Senses<T>) -> T {
        let [x, y, _] = s.center_of_mass_velocity();
        hypot(x, y)
    }

    /// Size of the command.
    #[inline(always)]
    pub(in super::super) fn told<T: Real>(s: &Senses<T>) -> T {
        s.command(0).abs() + s.command(1).abs()
    }

    /// Distance between the center of mass's velocity along the ground and another velocity, m/s.
    #[inline(always)]
    pub(in super::super) fn slip<T: Real>(s: &Senses<T>, [x, y]: [T; 2]) -> T {
        let [vx, vy, _] = s.center_of_mass_velocity();
        hypot(vx - x, vy - y)
    }
}

impl Guide {
    /// Advances the commanded direction, the target velocity and the gait by one decision. The command is a velocity
    /// ahead and to the left, and a turn rate.
    #[inline(always)]
    pub(in super::super) fn lead<T: Real>(&self, s: &Senses<T>, memory: &mut [T], [told, left]: [T; 2], turn: T) {
        let limits = self.limits;
        let speed = Steer::speed(s);
        // limit the turn rate to what a body of this speed can follow
        let sharpest = T::lit(MAX_HEADING_ACCELERATION).div(speed.max(T::lit(MAX_HEADING_ACCELERATION / MAX_TURN)));
        let led = turn.max(-sharpest).min(sharpest);
        let by = |angle: T| led.mul_add(T::lit(s.dt()), angle);
        let direction = [memory[DIRECTION], memory[DIRECTION + 1]];
        let direction = heading::turned(s.heading(BUTT), direction, by, MAX_HEADING_LAG);
        memory[DIRECTION..DIRECTION + 2].copy_from_slice(&direction);
        memory[PHASE] = self.next_phase(memory[PHASE], self.cadence(|slot| memory[slot]), s.dt());
        memory[DECISIONS] += T::lit(1.0);
        // limit the target's acceleration, and its speed in sharp turns
        let [acceleration, deceleration] = [limits.acceleration, limits.deceleration].map(|rate| T::lit(rate * s.dt()));
        let sharpest = T::lit(MAX_TURN_ACCELERATION).div(turn.abs().max(T::lit(MAX_TURN_ACCELERATION / MAX_SPEED)));
        let told = told.min(sharpest);
        let slows = told.lt(hypot(memory[TARGET], memory[TARGET + 1]) - T::lit(SLOWING_MARGIN));
        let most = T::select(slows, deceleration, acceleration);
        let beside = [-(left * direction[1]), left * direction[0]];
        let short_of_told = |i: usize, velocity: T| told.mul_add(direction[i], -velocity) + beside[i];
        let [x, y, _] = s.center_of_mass_velocity();
        let lacks = [short_of_told(0, x), short_of_told(1, y)];
        // cap the overshoot at `MAX_SPEED`; a stop command has none
        let asked = hypot(told, left);
        let most_urged = clamp(T::lit(MAX_SPEED) - asked, 1e-6, MAX_OVERSHOOT);
        let overshoot = T::masked(T::lit(MIN_OVERSHOT_COMMAND).lt(asked), T::lit(limits.overshoot));
        let overshoot = overshoot * most_urged.div((hypot(lacks[0], lacks[1]) * overshoot).max(most_urged));
        let missing = [0, 1].map(|i| lacks[i].mul_add(overshoot, short_of_told(i, memory[TARGET + i])));
        let share = most.div(hypot(missing[0], missing[1]).max(most));
        for i in 0..2 {
            memory[TARGET + i] = missing[i].mul_add(share, memory[TARGET + i]);
        }
        let turning = turn.abs() * T::lit(limits.turn_radius);
        let least = (asked.max(turning) * T::lit(MIN_PACE_PER_COMMAND)).min(T::lit(limits.min_pace));
        let pace = hypot(memory[TARGET], memory[TARGET + 1]).max(turning).max(least);
        let pace = speed + clamp(pace - speed, -limits.max_lead, limits.max_lead);
        memory[PACE] += (pace - memory[PACE]).max(-deceleration).min(acceleration);
        if let Some(footwork) = limits.footwork {
            let [left, forward] = heading::beside(s.heading(BUTT), [memory[TARGET], memory[TARGET + 1]]);
            // a body that still moves needs its strides in order to slow down
            let [_, moves] = heading::beside(s.heading(BUTT), [x, y]);
            memory[footwork] = clamp(forward.max(moves).div(memory[PACE].max(T::lit(0.1))), 0.0, 1.0);
            memory[footwork + 1] = left;
            let most = MAX_TWIST_RATE * s.dt();
            memory[footwork + 2] += clamp(led - memory[footwork + 2], -most, most);
        }
    }

    /// The gait's phase after `dt` seconds.
    #[inline(always)]
    pub(super) fn next_phase<T: Real>(&self, phase: T, cadence: T, dt: f64) -> T {
        let next = self.gaits.frequency(cadence).mul_add(T::lit(dt), phase);
        next - next.floor()
    }

    /// Angles of the gait's next pose, shifted by `lead` seconds at their velocities.
    #[inline(always)]
    pub(in super::super) fn next_pose<T: Real>(
        &self,
        memory: impl Fn(usize) -> T,
        dt: f64,
        lead: f64,
    ) -> impl Fn(usize) -> T {
        let gaits = &*self.gaits;
        let (phase, pace) = (memory(PHASE), memory(PACE));
        let next = self.next_phase(phase, self.cadence(&memory), dt);
        let next = gaits.moment(next, pace, self.footwork(memory), lead);
        move |joint| gaits.angle(&next, joint)
    }

    /// Weighted mean squared errors of the joint angles, rad^2, and the joint velocities, rad^2/s^2, against the gait.
    /// The weights are DeepMimic's.
    #[inline(always)]
    pub(super) fn out_of_step<T: Real>(&self, s: &Senses<T>) -> [T; 2] {
        let (gaits, r) = (&*self.gaits, s.readings());
        let [phase, pace] = [PHASE, PACE].map(|slot| s.memory(slot));
        // a lead shifts angles by velocity times lead, so a lead of 1 s yields the velocity
        let footwork = self.footwork(|slot| s.memory(slot));
        let [now, led] = [0.0, 1.0].map(|lead| gaits.moment(phase, pace, footwork, lead));
        let (mut sums, mut total) = ([T::zero(); 2], 0.0);
        for (i, joint) in JOINTS.iter().enumerate() {
            let angle = gaits.angle(&now, i);
            let off = [r.qpos(FIRST_QPOS + i) - angle, r.qvel(FIRST_QPOS - 1 + i) - (gaits.angle(&led, i) - angle)];
            for (sum, off) in sums.iter_mut().zip(off) {
                *sum = (off * off).mul_add(T::lit(joint.weight), *sum);
            }
            total += joint.weight;
        }
        sums.map(|sum| sum * T::lit(1.0 / total))
    }

    /// Writes the observation of the command, the body and the reference signals. Vectors are expressed in the
    /// direction `facing`. `told` is the commanded speed and turn rate. `next` maps a hinge and its next angle in the
    /// gait to the angle to observe.
    #[inline(always)]
    pub(in super::super) fn observe_going<T: Real>(
        &self,
        s: &Senses<T>,
        facing: [T; 2],
        told: [T; 2],
        next: impl Fn(usize, T) -> T,
        out: &mut Obs<T>,
    ) {
        let turned = turned_to(facing);
        out.group("command");
        for x in told {
            out.scalar(x);
        }
        for x in heading::beside(facing, Steer::direction(s)) {
            out.scalar(x);
        }
        let [x, y, _] = turned([s.memory(TARGET), s.memory(TARGET + 1), T::zero()]);
        out.scalar(x);
        out.scalar(y);
        observe_body(s, &ANATOMY, &turned, out);
        out.group("ends");
        for part in END_EFFECTORS {
            out.vector(turned(sub(s.position(part), s.position(BUTT))));
        }
        observe_soles(s, out);
        let (phase, pace) = (s.memory(PHASE), s.memory(PACE));
        let (sin, cos) = (phase * T::lit(TAU)).sin_cos();
        out.group("gait");
        for x in [pace, cos, sin] {
            out.scalar(x);
        }
        let gait = self.next_pose(|slot| s.memory(slot), s.dt(), 0.0);
        out.group("next_pose");
        for i in 0..JOINTS.len() {
            out.scalar(next(i, gait(i)) - s.readings().qpos(FIRST_QPOS + i));
        }
    }

    /// Writes the observation of a character that follows the gait alone. Vectors are expressed in its heading.
    #[inline(always)]
    pub(in super::super) fn observe_along<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let told = [s.command(0), s.command(1)];
        self.observe_going(s, s.heading(BUTT), told, |_, of_gait| of_gait, out);
    }

    /// Adds the reward's terms. `moves` masks the lanes of `velocity` and `pace`, `holds` those of `drift`, and `goes`
    /// those of all other terms. `told` is the size of the command, 0 for standing.
    #[inline(always)]
    pub(in super::super) fn add_terms<T: Real>(
        &self,
        s: &Senses<T>,
        [moves, holds, goes]: [T::Mask; 3],
        told: T,
        terms: &mut Terms<T>,
    ) {
        let slip = Steer::slip(s, [s.memory(TARGET), s.memory(TARGET + 1)]);
        let angle = Steer::off(s, Steer::direction(s));
        let [pose, tempo] = self.out_of_step(s);
        let mut add = |name, weight, counts, x: T| terms.add(name, weight, T::masked(counts, x.exp()));
        add("velocity", 0.3, moves, slip * slip * T::lit(-5.0));
        add("pace", 0.2, moves, slip * slip * T::lit(-0.5));
        add("drift", 0.05, holds, slip * slip * T::lit(-100.0));
        add("heading", 0.2, goes, angle * angle * T::lit(-4.0));
        add("gait", 0.2, goes, pose * T::lit(-5.0));
        add("tempo", 0.05, goes, tempo * T::lit(-1.0));
        let rest = T::and(goes, told.lt(T::lit(0.01)));
        let [shuffles, stirs] = stillness(s, PARTS.len(), STILLNESS_SCALES);
        terms.add("still", 0.3, T::masked(rest, shuffles + stirs));
    }
}
