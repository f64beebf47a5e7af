// one file: a reference motion and a moment of it share their columns
//! The motion clips that agents follow, as a constant table with one row per decision.
//!
//! The table is computed once, with the physics' own kinematics. Each agent's memory holds its row, and the position
//! and yaw in the world at which the present lap of the clip began. These are the first [`Following::SLOTS`] slots.
//! Zeros mean the first frame of the first clip at the world's origin. A looping clip continues for any time.

use std::f64::consts::TAU;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use marathon_motion::{Clip, Cycle, Layout};
use marathon_physics::budget;
use marathon_physics::lanes::{MAX_LANES, Real};
use marathon_physics::{Group, Model, Readings, Sim, Work};

use super::Part;
use super::bindings::{Bindings, Blueprint};

/// Farthest that a [`Frame`] can look ahead, decisions.
pub const MOST_AHEAD: usize = 16;

/// Most cycles of a looping clip in a table.
const MOST_CYCLES: usize = 64;

/// Height above the ground up to which a foot of a clip counts as in contact, m. Motion capture is not more precise.
const CONTACT_MARGIN: f64 = 0.01;

/// An agent's state in its clips: the first slots of its memory.
#[derive(Clone, Copy, Debug)]
pub struct Following;

impl Following {
    /// Number of slots: the row in the table of all clips, and where the present lap began.
    pub const SLOTS: usize = 4;
    /// Slot of the row.
    pub const ROW: usize = 0;
    /// Slot of the x at which the present lap began, m.
    pub const X: usize = 1;
    /// Slot of the y, m.
    pub const Y: usize = 2;
    /// Slot of the present lap's yaw, rad.
    pub const YAW: usize = 3;
}

/// Clips sampled at every decision, in double precision. Episodes start from it.
#[derive(Default)]
pub(crate) struct Timeline {
    pub qpos: Vec<Vec<f64>>,
    pub qvel: Vec<Vec<f64>>,
    /// Completed fraction of the clip, or of its cycle, by row.
    pub phase: Vec<f64>,
    /// The rows of each clip.
    pub clips: Vec<Lap>,
}

/// The rows of a clip.
pub(crate) struct Lap {
    pub rows: Range<usize>,
    /// Displacement and yaw over all rows, if the clip loops.
    pub cycle: Option<Cycle>,
}

impl Timeline {
    fn new(clips: &[Arc<Clip>], dt: f64) -> Timeline {
        let mut out = Timeline::default();
        for clip in clips {
            out.add(clip, dt);
        }
        out
    }

    /// Samples a clip. A looping clip is repeated until its length is close to a whole number of decisions. For clips
    /// of 30 or 60 frames per second, the rest is less than a hundredth of a decision. It is spread over all rows.
    fn add(&mut self, clip: &Clip, dt: f64) {
        let (rows, cycles) = rows_of(clip, dt);
        let (step, cycle) = match clip.cycle() {
            None => (dt, None),
            Some(cycle) => (cycles as f64 * clip.duration() / rows as f64, Some(repeated(cycle, cycles))),
        };
        let (nq, nv) = (clip.layout().nq(), clip.layout().nv());
        let first = self.phase.len();
        self.clips.push(Lap { rows: first..first + rows, cycle });
        for row in 0..rows {
            let (time, mut qpos, mut qvel) = (row as f64 * step, vec![0.0; nq], vec![0.0; nv]);
            clip.qpos(time, &mut qpos);
            clip.qvel(time, &mut qvel);
            qvel.iter_mut().for_each(|v| *v *= step / dt);
            self.phase.push(clip.phase(time));
            self.qpos.push(qpos);
            self.qvel.push(qvel);
        }
    }

    /// The clip that a row belongs to.
    pub fn clip_of(&self, row: usize) -> &Lap {
        let after = self.clips.partition_point(|lap| lap.rows.end <= row);
        &self.clips[after.min(self.clips.len() - 1)]
    }
}

/// Number of rows of a clip, and number of cycles if it loops.
fn rows_of(clip: &Clip, dt: f64) -> (usize, usize) {
    let decisions = clip.duration() / dt;
    match clip.cycle() {
        None => ((decisions + 1e-9).floor() as usize + 1, 1),
        Some(_) => {
            let cycles = fitting_cycles(decisions);
            ((cycles as f64 * decisions).round() as usize, cycles)
        }
    }
}

/// The number of cycles whose length is closest to a whole number of decisions. The length is at least [`MOST_AHEAD`]
/// decisions.
fn fitting_cycles(decisions: f64) -> usize {
    let remainder = |cycles: usize| (cycles as f64 * decisions - (cycles as f64 * decisions).round()).abs();
    let least = (MOST_AHEAD as f64 / decisions).ceil().max(1.0) as usize;
    let mut best = least;
    for cycles in least..least + MOST_CYCLES {
        // prefer the shorter of equally good tables
        if remainder(cycles) < remainder(best) - 1e-6 {
            best = cycles;
        }
    }
    best
}

/// Several cycles in sequence.
fn repeated(cycle: Cycle, times: usize) -> Cycle {
    let (sin, cos) = (libm::sin(cycle.yaw), libm::cos(cycle.yaw));
    let mut sum = Cycle::default();
    for _ in 0..times {
        let [x, y] = sum.pos;
        sum.pos = [cos * x - sin * y + cycle.pos[0], sin * x + cos * y + cycle.pos[1]];
        sum.yaw += cycle.yaw;
    }
    sum
}

/// The columns of a row.
struct Columns {
    qpos: usize,
    qvel: usize,
    /// Position and velocity of each part, 6 numbers.
    parts: usize,
    /// Axes and angular velocity of each part's body, 12 numbers.
    bodies: usize,
    /// Center of mass and its velocity.
    center: usize,
    /// Touch sites, 0 or 1.
    touch: usize,
    /// Sine and cosine of the phase's angle and of twice that, then the phase.
    phase: usize,
    /// Yaw of the direction of travel.
    facing: usize,
    /// Row after the clip's last one, and number of the clip's rows if it loops, otherwise 0.
    end: usize,
    /// Displacement x, y and yaw of a lap; zeros if the clip does not loop.
    lap: usize,
    /// Lowest height of each part's center in the clip, m.
    lowest: usize,
    width: usize,
}

/// The clips of an agent as a table in lane precision.
pub(crate) struct Reference<T: Real> {
    pub timeline: Timeline,
    columns: Columns,
    /// `[row][column]`.
    table: Vec<T::Scalar>,
    layout: Layout,
}

impl<T: Real> Reference<T> {
    /// The table of clips for agents that decide every `dt` seconds.
    ///
    /// # Errors
    /// If a clip belongs to another model, or the table exceeds the memory budget.
    pub fn new(clips: &[Arc<Clip>], dt: f64, blueprint: &Blueprint, bindings: &Bindings<T>) -> Result<Self, String> {
        let model = &blueprint.model;
        for clip in clips {
            clip.check_model(Path::new(&clip.about().name), model).map_err(|error| error.to_string())?;
        }
        let columns = Columns::new(model, bindings);
        // each row is in the timeline and in the table, and exists once more during the conversion
        let rows: f64 = clips.iter().map(|clip| rows_of(clip, dt).0 as f64).sum();
        let numbers = model.nq + model.nv + 2 * columns.width;
        let asked = budget::MEMORY.check(size_of::<f64>() as f64 * rows * numbers as f64);
        asked.map_err(|error| {
            let names = if clips.len() == 1 { "the clip".to_string() } else { format!("{} clips", clips.len()) };
            format!("a table of {names} {error}")
        })?;
        let timeline = Timeline::new(clips, dt);
        let sim = Sim::new(model, super::bindings::sim_options()).map_err(|error| error.to_string())?;
        let mut table = Vec::new();
        for lap in &timeline.clips {
            let mut rows = shown(lap, &timeline, &sim, bindings);
            let mut low = vec![f64::INFINITY; bindings.parts.len()];
            for row in &rows {
                for (i, low) in low.iter_mut().enumerate() {
                    *low = low.min(row[columns.parts + 6 * i + 2]);
                }
            }
            let count = lap.rows.len() as f64;
            let (length, [x, y], yaw) = lap.cycle.map_or((0.0, [0.0; 2], 0.0), |lap| (count, lap.pos, lap.yaw));
            for row in &mut rows {
                row.extend([lap.rows.end as f64, length, x, y, yaw]);
                row.extend(&low);
                assert_eq!(row.len(), columns.width);
                table.extend(row.iter().map(|x| T::scalar(*x)));
            }
        }
        Ok(Reference { timeline, columns, table, layout: Layout::of(model) })
    }

    /// Number of rows.
    fn rows(&self) -> usize {
        self.timeline.qpos.len()
    }

    /// The frame `ahead` decisions after the agents' present one.
    #[inline(always)]
    pub fn frame(&self, memory: &[T], ahead: usize) -> Frame<'_, T> {
        assert!(ahead <= MOST_AHEAD, "a clip is shown for {MOST_AHEAD} decisions ahead");
        let at = match ahead {
            0 => [0, 1, 2, 3].map(|i| memory[i]),
            _ => self.place(memory, ahead),
        };
        let rows = self.rows_of(at[Following::ROW]);
        let (sin, cos) = at[Following::YAW].sin_cos();
        Frame { columns: &self.columns, rows, origin: [at[Following::X], at[Following::Y]], turn: [cos, sin] }
    }

    /// The agents' place in their clips after `ahead` decisions.
    #[inline(always)]
    fn place(&self, memory: &[T], ahead: usize) -> [T; Following::SLOTS] {
        let [row, x, y, yaw] = [0, 1, 2, 3].map(|i| memory[i]);
        let rows = self.rows_of(row);
        let of_clip = |i: usize| column::<T>(&rows, i);
        let Columns { end, lap, .. } = self.columns;
        let ([end, length], [dx, dy, turn]) = ([end, end + 1].map(of_clip), [lap, lap + 1, lap + 2].map(of_clip));
        let next = row + T::lit(ahead as f64);
        let (past, loops) = (T::not(next.lt(end)), T::zero().lt(length));
        let around = T::and(past, loops);
        let (sin, cos) = yaw.sin_cos();
        [
            T::select(T::and(past, T::not(loops)), end - T::lit(1.0), next - T::masked(around, length)),
            x + T::masked(around, sin.neg_mul_add(dy, cos * dx)),
            y + T::masked(around, sin.mul_add(dx, cos * dy)),
            yaw + T::masked(around, turn),
        ]
    }

    /// The table's row of each agent.
    #[inline(always)]
    fn rows_of(&self, at: T) -> [&[T::Scalar]; MAX_LANES] {
        let mut rows: [&[T::Scalar]; MAX_LANES] = [&[]; MAX_LANES];
        for (lane, row) in rows[..T::LANES].iter_mut().enumerate() {
            // a snapshot may hold any number
            let i = (T::widen(at.get(lane)) as usize).min(self.rows() - 1);
            *row = &self.table[i * self.columns.width..][..self.columns.width];
        }
        rows
    }

    /// `qpos` of the clip in the world, in double precision, for an agent with this memory.
    pub fn qpos(&self, memory: &[f64]) -> Vec<f64> {
        let row = (memory[Following::ROW] as usize).min(self.rows() - 1);
        let mut qpos = self.timeline.qpos[row].clone();
        let moved = Cycle { pos: [memory[Following::X], memory[Following::Y]], yaw: memory[Following::YAW] };
        moved.advance(&self.layout, &mut qpos, 1);
        qpos
    }

    /// Advances the agents' clips by one decision.
    #[inline(always)]
    pub fn advance(&self, memory: &mut [T]) {
        let next = self.place(memory, 1);
        memory[..Following::SLOTS].copy_from_slice(&next);
    }

    /// Lanes in which a clip that does not loop has reached its last row.
    #[inline(always)]
    pub fn over(&self, memory: &[T]) -> T::Mask {
        let rows = self.rows_of(memory[Following::ROW]);
        let [end, length] = [0, 1].map(|i| column::<T>(&rows, self.columns.end + i));
        let last = T::not(memory[Following::ROW].lt(end - T::lit(1.0)));
        T::and(last, T::not(T::zero().lt(length)))
    }
}

impl Columns {
    fn new<T: Real>(model: &Model, bindings: &Bindings<T>) -> Columns {
        let qvel = model.nq;
        let parts = qvel + model.nv;
        let bodies = parts + 6 * bindings.parts.len();
        let center = bodies + 12 * bindings.parts.len();
        let touch = center + 6;
        let phase = touch + bindings.measure.touch_sites.len();
        let facing = phase + 5;
        let end = facing + 1;
        let lap = end + 2;
        let lowest = lap + 3;
        Columns {
            qpos: 0,
            qvel,
            parts,
            bodies,
            center,
            touch,
            phase,
            facing,
            end,
            lap,
            lowest,
            width: lowest + bindings.parts.len(),
        }
    }
}

/// Contents of a clip's rows, without the columns that depend on the whole clip.
fn shown<T: Real>(lap: &Lap, timeline: &Timeline, sim: &Sim<f64>, bindings: &Bindings<T>) -> Vec<Vec<f64>> {
    let model = sim.model();
    let (mut group, mut work) = (Group::new(sim), Work::new(sim));
    let shares: Vec<(usize, f64)> = bindings.mass_shares.iter().map(|(b, x)| (*b, T::widen(*x))).collect();
    let mut rows = Vec::new();
    for i in lap.rows.clone() {
        let (qpos, qvel, phase) = (&timeline.qpos[i], &timeline.qvel[i], timeline.phase[i]);
        group.reset_lane(sim, 0, qpos, qvel);
        sim.refresh(&mut work, &group);
        let r = Readings::new(sim, &group, &work);
        let mut row = [qpos.as_slice(), qvel].concat();
        for part in &bindings.parts {
            row.extend(r.geom_pos(part.geom));
            row.extend(r.geom_velocity(part.geom));
        }
        for part in &bindings.parts {
            row.extend(r.body_axes(part.body).as_flattened());
            row.extend(r.body_angular_velocity(part.body));
        }
        let [position, velocity] = center_of_mass(&r, &shares);
        row.extend(position);
        row.extend(velocity);
        for site in &bindings.measure.touch_sites {
            row.push(f64::from(u8::from(set_down(model, &r, *site))));
        }
        let angle = TAU * phase;
        for angle in [angle, 2.0 * angle] {
            row.extend([libm::sin(angle), libm::cos(angle)]);
        }
        row.push(phase);
        // the yaw of a lap is spread evenly over its rows
        let done = (i - lap.rows.start) as f64;
        row.push(lap.cycle.map_or(0.0, |cycle| cycle.yaw * done / lap.rows.len() as f64));
        rows.push(row);
    }
    rows
}

/// A column of each agent's row.
#[inline(always)]
fn column<T: Real>(rows: &[&[T::Scalar]; MAX_LANES], column: usize) -> T {
    let mut lanes = [T::Scalar::default(); MAX_LANES];
    for (x, row) in lanes.iter_mut().zip(&rows[..T::LANES]) {
        *x = row[column];
    }
    T::load(&lanes[..T::LANES])
}

/// Whether a touch site of a clip is on the ground, which is level.
fn set_down(model: &Model, readings: &Readings<f64>, site: usize) -> bool {
    readings.site_pos(site)[2] < model.sites[site].size[0] + CONTACT_MARGIN
}

/// Center of mass and its velocity, from the mass fractions of the moving bodies.
#[inline(always)]
pub(crate) fn center_of_mass<T: Real>(r: &Readings<T>, shares: &[(usize, T::Scalar)]) -> [[T; 3]; 2] {
    let mut sums = [[T::zero(); 3]; 2];
    for (body, share) in shares {
        let share = T::splat(*share);
        for (sum, of_body) in sums.iter_mut().zip([r.body_com(*body), r.body_com_velocity(*body)]) {
            for (sum, x) in sum.iter_mut().zip(of_body) {
                *sum = x.mul_add(share, *sum);
            }
        }
    }
    sums
}

/// A frame of each agent's clip. It has the quantities of [`Senses`](crate::Senses) in the same axes.
pub struct Frame<'a, T: Real> {
    columns: &'a Columns,
    rows: [&'a [T::Scalar]; MAX_LANES],
    /// The clip's origin in the world.
    origin: [T; 2],
    /// Cosine and sine of the clip's yaw.
    turn: [T; 2],
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn laps_are_whole_numbers_of_decisions() {
        for (seconds, cycles, rows) in [(38.0 / 30.0, 3, 152.0), (0.8, 1, 32.0), (1.75, 1, 70.0), (0.05, 8, 16.0)] {
            let decisions = seconds / 0.025;
            let found = fitting_cycles(decisions);
            assert_eq!(found, cycles, "{seconds} s");
            assert!((found as f64 * decisions - rows).abs() < 1e-6);
        }
    }

    #[test]
    fn cycles_add_up() {
        let quarter = Cycle { pos: [1.0, 0.0], yaw: TAU / 4.0 };
        let round = repeated(quarter, 4);
        assert!(round.pos.iter().all(|x| x.abs() < 1e-12) && (round.yaw - TAU).abs() < 1e-12);
        let half = repeated(quarter, 2);
        assert!((half.pos[0] - 1.0).abs() < 1e-12 && (half.pos[1] - 1.0).abs() < 1e-12);
    }
}
