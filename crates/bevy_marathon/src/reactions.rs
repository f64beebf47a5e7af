//! Reactions to blows: the limb that is hit and its neighbors lose strength for a moment.

use crate::limbs::Limbs;
use bevy::prelude::*;
use serde::{Deserialize, Serialize};

/// Time without a push after which the next push on a body is another blow, s.
const GAP: f64 = 0.08;
/// Softening below which a blow has been overcome.
const NEGLIGIBLE: f64 = 0.01;

/// Lets blows soften a [`Ragdoll`](crate::Ragdoll): a [`Push`](crate::Push) on a body takes strength from the actuators
/// of the body and of its neighbors, which then comes back. The policy acts all the time. [`HitReceived`](crate::HitReceived) reports
/// the blows.
///
/// Let `v` be the impulse of a blow over the mass of the body. The actuators of the body keep the factor `1 - v / full_speed` of
/// their strength, but at least `softest`. The loss shrinks by `spread` with each joint away from the body.
#[derive(Component, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
pub struct HitReactions {
    /// Change of the velocity of the body at which it is as soft as it gets, m/s.
    pub full_speed: f64,
    /// Smallest factor of the strength, 0 to 1.
    pub softest: f64,
    /// Part of the softening that a joint passes on, 0 to 1.
    pub spread: f64,
    /// Number of joints that the softening passes.
    pub reach: u32,
    /// Time from the end of the push until the strength begins to come back, s.
    pub hold: f64,
    /// Time in which half of the lost strength comes back, s.
    pub half_life: f64,
    /// Smallest factor of the strength of legs while a foot is on the ground, 0 to 1.
    pub softest_leg: f64,
    /// Impulse over the mass of the character from which legs are as soft as all limbs, m/s.
    pub knock_down: f64,
}

impl Default for HitReactions {
    fn default() -> Self {
        HitReactions {
            full_speed: 3.0,
            softest: 0.15,
            spread: 0.6,
            reach: 2,
            hold: 0.08,
            half_life: 0.15,
            softest_leg: 0.5,
            knock_down: 1.0,
        }
    }
}

/// The blows that a character has not overcome.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Blows(Vec<Blow>);

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Blow {
    body: usize,
    /// Strength that it takes from the body, 0 to 1.
    depth: f64,
    /// Whether legs keep the strength to stand.
    stands: bool,
    /// Decisions for which the push still lasts.
    lasts: u64,
    /// Decisions since the push ended.
    age: u64,
}

impl Blows {
    /// Takes a blow on a body: an impulse, N s, over some decisions. Returns whether it is a new blow.
    pub fn strike(
        &mut self,
        (body, impulse, decisions): (usize, f64, u64),
        reactions: Option<&HitReactions>,
        limbs: &Limbs,
        (standing, dt): (bool, f64),
    ) -> bool {
        let depth = reactions.map_or(0.0, |r| {
            let speed = impulse / limbs.body_mass(body).max(f64::MIN_POSITIVE);
            (speed / r.full_speed.max(f64::MIN_POSITIVE)).min(1.0 - r.softest.clamp(0.0, 1.0))
        });
        let stands = standing && reactions.is_some_and(|r| impulse < r.knock_down * limbs.mass);
        let old = self.0.iter().position(|blow| blow.body == body);
        let last = old.map(|old| self.0.swap_remove(old));
        let new = last.as_ref().is_none_or(|last| last.age as f64 * dt > GAP);
        let before = last.as_ref().zip(reactions).map_or(0.0, |(last, r)| last.softening(r, dt));
        let lasts = last.map_or(0, |last| last.lasts).max(decisions);
        self.0.push(Blow { body, depth: depth.max(before), stands, lasts, age: 0 });
        new
    }

    /// Factor of the strength of an actuator.
    pub fn factor(&self, actuator: usize, reactions: &HitReactions, limbs: &Limbs, dt: f64) -> f64 {
        let mut factor = 1.0_f64;
        for blow in &self.0 {
            let Some(far) = limbs.distance(actuator, blow.body).filter(|far| *far <= reactions.reach as usize) else {
                continue;
            };
            let spread = (0..far).fold(1.0, |spread, _| spread * reactions.spread.clamp(0.0, 1.0));
            let least = if blow.stands && limbs.is_leg(actuator) { reactions.softest_leg.min(1.0) } else { 0.0 };
            factor = factor.min((1.0 - spread * blow.softening(reactions, dt)).max(least));
        }
        factor
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Forgets all blows.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Lets a decision pass.
    pub fn pass(&mut self, reactions: Option<&HitReactions>, dt: f64) {
        for blow in &mut self.0 {
            match blow.lasts {
                0 => blow.age += 1,
                _ => blow.lasts -= 1,
            }
        }
        let soft = |blow: &Blow| reactions.is_some_and(|r| blow.softening(r, dt) > NEGLIGIBLE);
        self.0.retain(|blow| blow.age as f64 * dt <= GAP || soft(blow));
    }
}

impl Blow {
    /// Strength that its body lacks now, 0 to 1.
    fn softening(&self, reactions: &HitReactions, dt: f64) -> f64 {
        let fades = (self.age as f64 * dt - reactions.hold).max(0.0);
        self.depth * libm::exp2(-fades / reactions.half_life.max(f64::MIN_POSITIVE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use marathon_physics::Model;

    const DT: f64 = 0.01;

    /// Three bodies in a row, of 1 kg each, with a motor between each two.
    fn chain() -> Result<Limbs, Box<dyn std::error::Error>> {
        let open = |name: &str| format!("<body name='{name}'><joint name='{name}'/><geom size='.1' mass='1'/>");
        let motors = "<motor joint='b'/><motor joint='c'/><motor joint='d'/>";
        let bodies = ["a", "b", "c", "d"].map(open).concat() + &"</body>".repeat(4);
        let text = format!("<mujoco><worldbody>{bodies}</worldbody><actuator>{motors}</actuator></mujoco>");
        Ok(Limbs::of(&Model::from_xml_str(&text, "chain")?, &[]))
    }

    #[test]
    fn a_blow_softens_its_limb_and_its_neighbors_for_a_while() -> Result<(), Box<dyn std::error::Error>> {
        let (limbs, r) = (chain()?, HitReactions { reach: 1, ..default() });
        let mut blows = Blows::default();
        assert!(blows.strike((4, 1.5, 2), Some(&r), &limbs, (true, DT)));
        let factors = |blows: &Blows| [0, 1, 2].map(|actuator| blows.factor(actuator, &r, &limbs, DT));
        // half of the speed for all, so half of the strength; 0.6 of that one joint away
        assert_eq!(factors(&blows), [1.0, 1.0 - 0.6 * 0.5, 0.5]);
        // for as long as it lasts, and then for 0.08 s
        (0..2 + 8).for_each(|_| blows.pass(Some(&r), DT));
        assert_eq!(factors(&blows)[2], 0.5);
        (0..15).for_each(|_| blows.pass(Some(&r), DT));
        assert!((factors(&blows)[2] - 0.75).abs() < 1e-9, "{:?}", factors(&blows));
        (0..200).for_each(|_| blows.pass(Some(&r), DT));
        assert!(blows.is_empty() && factors(&blows) == [1.0; 3]);
        // the hardest blow leaves some strength
        blows.strike((4, 1e3, 1), Some(&r), &limbs, (true, DT));
        assert!((factors(&blows)[2] - r.softest).abs() < 1e-9, "{:?}", factors(&blows));
        Ok(())
    }

    #[test]
    fn pushes_in_a_row_are_one_blow() -> Result<(), Box<dyn std::error::Error>> {
        let limbs = chain()?;
        let mut blows = Blows::default();
        let mut told = |wait: usize| {
            (0..wait).for_each(|_| blows.pass(None, DT));
            blows.strike((2, 1.0, 1), None, &limbs, (false, DT))
        };
        assert_eq!([0, 1, 5, 8, 11].map(&mut told), [true, false, false, false, true]);
        Ok(())
    }
}
