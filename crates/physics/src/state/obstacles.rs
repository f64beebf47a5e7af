//! Sets and reads the obstacles of the agents of a group. Each agent has its own.

use super::group::Group;
use super::obstacle::Obstacle;
use super::solids::Solids;
use crate::lanes::Real;
use crate::sim::Sim;

impl<T: Real> Group<T> {
    /// Sets the obstacles of an agent, until changed. They survive a reset.
    ///
    /// # Panics
    /// If the model has no [geom for obstacles](crate::spec::ModelSpec::add_obstacles), there are more than
    /// [`Obstacle::MOST`], or a number is [out of its range](Obstacle::out_of_range).
    pub fn set_obstacles(&mut self, sim: &Sim<T>, lane: usize, obstacles: &[Obstacle]) {
        assert!(sim.model.obstacles.is_some() || obstacles.is_empty(), "the model has no geom for obstacles");
        assert!(obstacles.len() <= Obstacle::MOST, "at most {} obstacles", Obstacle::MOST);
        let unit = |o: &Obstacle| {
            if let Some((name, found, expected)) = o.out_of_range() {
                panic!("an obstacle has a {name} of {found}, expected {expected}");
            }
            let norm = o.quat.iter().map(|x| x * x).sum::<f64>().sqrt();
            Obstacle { quat: o.quat.map(|x| x / norm), ..o.clone() }
        };
        let obstacles: Vec<Obstacle> = obstacles.iter().map(unit).collect();
        self.put_obstacles(lane, &obstacles);
    }

    /// The same without a change of the quaternions.
    pub(super) fn put_obstacles(&mut self, lane: usize, obstacles: &[Obstacle]) {
        if self.obstacles.is_none() && obstacles.is_empty() {
            return;
        }
        let all = self.obstacles.get_or_insert_with(|| Box::new(Solids::new()));
        if all.own[lane].is_empty() && obstacles.is_empty() {
            return;
        }
        all.set(lane, obstacles);
        if all.is_empty() {
            self.obstacles = None;
        }
    }

    /// The obstacles of an agent, where they are now.
    pub fn obstacles(&self, lane: usize) -> Vec<Obstacle> {
        self.obstacles.as_ref().map_or_else(Vec::new, |all| all.get(lane))
    }

    /// Moves the obstacles by one step.
    #[inline]
    pub(crate) fn move_obstacles(&mut self, dt: T::Scalar) {
        if let Some(all) = &mut self.obstacles {
            all.advance(dt);
        }
    }
}
