//! Readings of all agents at once, in arrays with a row per agent. Reading agent by agent is slower.

use super::Batch;
use super::lanes::LaneBatch;
use super::quantity::{Felt, Quantity};
use crate::algebra::spatial::V3;
use crate::lanes::{Kernel, Real};
use crate::readings::Readings;
use crate::sim::Sim;
use crate::state::{Group, Work};

impl Batch {
    /// Writes readings of all agents, `[agents][width]` each, row-major, on the batch's threads.
    ///
    /// # Panics
    /// If an array does not have `agents * width` entries.
    pub fn gather(&mut self, wanted: &mut [(Quantity, &mut [f64])]) {
        for (quantity, rows) in wanted.iter() {
            assert_eq!(rows.len(), self.agents * quantity.width(&self.model), "a row of {quantity:?} per agent");
        }
        self.inner.gather(wanted);
    }

    /// Writes the heights of the ground, m, `[agents][n]`, at the positions `[x, y]`, m, `[agents][n]` of the world.
    /// See [`Readings::ground_height`](crate::Readings::ground_height). Every agent has its own ground.
    ///
    /// # Panics
    /// If the numbers of heights and positions differ, or are not a multiple of the number of agents.
    pub fn ground_height(&mut self, places: &[[f64; 2]], heights: &mut [f64]) {
        assert_eq!(places.len(), heights.len(), "one height per place");
        assert_eq!(places.len() % self.agents, 0, "as many places for each agent");
        let each = places.len() / self.agents;
        if each > 0 {
            self.inner.ground_height(&self.model.grounds(), places, each, heights);
        }
    }
}

/// Rows of consecutive agents. The first one is the start of a group.
struct Part<'a> {
    quantity: Quantity,
    width: usize,
    rows: &'a mut [f64],
}

impl<T: Real> LaneBatch<T> {
    pub(super) fn gather_rows(&mut self, wanted: &mut [(Quantity, &mut [f64])]) {
        let LaneBatch { sim, groups, works, helpers, felt, .. } = self;
        let share = groups.len().div_ceil(works.len());
        let mut rest: Vec<Part<'_>> = wanted
            .iter_mut()
            .map(|(quantity, rows)| Part { quantity: *quantity, width: quantity.width(sim.model()), rows })
            .filter(|part| part.width > 0)
            .collect();
        let read = |groups: &[Group<T>], felt: &[Felt<T>], work: &mut Work<T>, mut parts: Vec<Part<'_>>| {
            for (i, (group, felt)) in groups.iter().zip(felt).enumerate() {
                read_group(sim, group, felt, work, i, &mut parts);
            }
        };
        let shares = groups.chunks(share).zip(felt.chunks(share)).zip(works);
        let read = &read;
        helpers.run(shares.map(|((groups, felt), work)| {
            // each thread gets the rows of its own agents
            let mut own = Vec::new();
            for part in &mut rest {
                let rows = std::mem::take(&mut part.rows);
                let (mine, others) = rows.split_at_mut(rows.len().min(share * T::LANES * part.width));
                part.rows = others;
                own.push(Part { rows: mine, ..*part });
            }
            move || read(groups, felt, work, own)
        }));
    }
}

impl<T: Real> LaneBatch<T> {
    /// Writes the heights of the ground at `each` positions of every agent.
    pub(super) fn ground_rows(&mut self, grounds: &[usize], places: &[[f64; 2]], each: usize, heights: &mut [f64]) {
        let LaneBatch { sim, groups, works, .. } = self;
        // the ground does not move, so its frames are the same in all groups
        sim.refresh(&mut works[0], &groups[0]);
        let rows = places.chunks(T::LANES * each).zip(heights.chunks_mut(T::LANES * each));
        for (group, (places, heights)) in groups.iter().zip(rows) {
            let readings = Readings::new(sim, group, &works[0]);
            T::enter(Ground { readings, grounds, places, rows: AgentRows { rows: heights, width: each } });
        }
    }
}

/// Heights of the ground at positions of the agents of one group.
struct Ground<'a, T: Real> {
    readings: Readings<'a, T>,
    grounds: &'a [usize],
    places: &'a [[f64; 2]],
    rows: AgentRows<'a>,
}

impl<T: Real> Kernel<T> for Ground<'_, T> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Ground { readings, grounds, places, mut rows } = self;
        for column in 0..rows.width {
            let (mut x, mut y) = (T::zero(), T::zero());
            for (lane, places) in places.chunks_exact(rows.width).enumerate() {
                x.set(lane, T::scalar(places[column][0]));
                y.set(lane, T::scalar(places[column][1]));
            }
            rows.put(column, readings.ground_height(grounds, x, y));
        }
    }
}

/// Writes the rows of the `i`-th group of `parts`.
fn read_group<T: Real>(
    sim: &Sim<T>,
    group: &Group<T>,
    felt: &Felt<T>,
    work: &mut Work<T>,
    i: usize,
    parts: &mut [Part<'_>],
) {
    if parts.iter().any(|part| part.quantity.is_dynamic()) {
        sim.forward(work, group);
    } else if parts.iter().any(|part| part.quantity.is_frame()) {
        sim.refresh(work, group);
    }
    let readings = Readings::new(sim, group, work);
    for part in parts {
        let own = part.rows.chunks_mut(T::LANES * part.width).nth(i);
        let rows = AgentRows { rows: own.unwrap_or_default(), width: part.width };
        match part.quantity {
            Quantity::Sensors => read_sensors(&readings, rows),
            quantity => T::enter(Read { readings, felt, quantity, rows }),
        }
    }
}

fn read_sensors<T: Real>(readings: &Readings<'_, T>, mut rows: AgentRows<'_>) {
    let mut column = 0;
    for (i, sensor) in readings.sim.model().sensors.iter().enumerate() {
        let values = readings.sensor(i).unwrap_or_else(|| vec![T::lit(f64::NAN); sensor.dim]);
        for x in values {
            rows.put(column, x);
            column += 1;
        }
    }
}

/// Rows of the agents of one group. The last agents may be missing.
struct AgentRows<'a> {
    rows: &'a mut [f64],
    width: usize,
}

impl AgentRows<'_> {
    #[inline(always)]
    fn put<T: Real>(&mut self, column: usize, value: T) {
        let mut lanes = [T::Scalar::default(); 16];
        value.store(&mut lanes[..T::LANES]);
        for (row, x) in self.rows.chunks_exact_mut(self.width).zip(lanes) {
            row[column] = T::widen(x);
        }
    }

    #[inline(always)]
    fn put3<T: Real>(&mut self, column: usize, v: V3<T>) {
        self.put(column, v[0]);
        self.put(column + 1, v[1]);
        self.put(column + 2, v[2]);
    }
}

struct Read<'a, T: Real> {
    readings: Readings<'a, T>,
    felt: &'a Felt<T>,
    quantity: Quantity,
    rows: AgentRows<'a>,
}

impl<T: Real> Kernel<T> for Read<'_, T> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Read { readings: r, felt, quantity, mut rows } = self;
        let (bodies, geoms) = (r.sim.model().bodies.len(), r.sim.model().geoms.len());
        let one = T::lit(1.0);
        match quantity {
            Quantity::Qpos => {
                for i in 0..r.group.qpos.len() {
                    rows.put(i, r.group.qpos[i]);
                }
            }
            Quantity::Qvel => {
                for i in 0..r.group.qvel.len() {
                    rows.put(i, r.group.qvel[i]);
                }
            }
            Quantity::BodyPos => {
                for b in 0..bodies {
                    rows.put3(3 * b, r.body_pos(b));
                }
            }
            Quantity::BodyAxes => {
                for b in 0..bodies {
                    let [x, y, z] = r.body_axes(b);
                    rows.put3(9 * b, x);
                    rows.put3(9 * b + 3, y);
                    rows.put3(9 * b + 6, z);
                }
            }
            Quantity::BodyVelocity => {
                for b in 0..bodies {
                    rows.put3(3 * b, r.body_velocity(b));
                }
            }
            Quantity::BodyAngularVelocity => {
                for b in 0..bodies {
                    rows.put3(3 * b, r.body_angular_velocity(b));
                }
            }
            Quantity::GeomPos => {
                for g in 0..geoms {
                    rows.put3(3 * g, r.geom_pos(g));
                }
            }
            Quantity::GeomVelocity => {
                for g in 0..geoms {
                    rows.put3(3 * g, r.geom_velocity(g));
                }
            }
            Quantity::Touching => {
                for g in 0..geoms {
                    rows.put(g, T::masked(felt.touching[g], one));
                }
            }
            Quantity::Touched => {
                for g in 0..geoms {
                    rows.put(g, T::masked(felt.touched[g], one));
                }
            }
            Quantity::NormalForce => {
                for g in 0..geoms {
                    rows.put(g, felt.normal_force[g]);
                }
            }
            Quantity::Act => {
                for i in 0..r.group.act.len() {
                    rows.put(i, r.group.act[i]);
                }
            }
            Quantity::MocapPos => {
                for (k, pos) in r.group.mocap_pos.iter().enumerate() {
                    rows.put3(3 * k, *pos);
                }
            }
            Quantity::MocapQuat => {
                for (i, x) in r.group.mocap_quat.iter().flatten().enumerate() {
                    rows.put(i, *x);
                }
            }
            Quantity::Qacc => {
                for i in 0..r.group.qvel.len() {
                    rows.put(i, r.qacc(i));
                }
            }
            Quantity::QfrcConstraint => {
                for (i, force) in r.constraint_forces().into_iter().enumerate() {
                    rows.put(i, force);
                }
            }
            Quantity::ActuatorForce => {
                for i in 0..r.group.ctrl.len() {
                    rows.put(i, r.actuator_force(i));
                }
            }
            // evaluated outside this kernel, with a kernel per sensor
            Quantity::Sensors => {}
        }
    }
}
