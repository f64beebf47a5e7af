//! The adversary: a second role that builds the ground ahead of the runner meter by meter, and earns the runner's
//! reward with the opposite sign.
//!
//! It acts whenever the runner reaches a new meter. Its action is one of the original's 21 steps: the next meter is up
//! to 1 m times the difficulty higher or lower than the last one.

use marathon_physics::lanes::Real;

use super::profile::{CELL, FARTHEST, FROM, LEVEL_TO, POINTS};
use super::regret::{REFERENCE, REGRET, SECOND};
use super::runners::Runner;
use super::{BUILT, DIFFICULTY, DUE, SINCE, STEP};
use crate::agent::{Obs, RoleFacts, Senses, Site, names};

/// Names of the roles.
pub(super) const RUNNER: &str = "runner";
pub(super) const BUILDER: &str = "builder";
/// The builder's actuator.
pub(super) const ACTION: &str = "ground";
/// The builder's group of the observation.
pub(super) const SEEN: &str = "site";
/// The builder's term of the reward.
pub(super) const EARNED: &str = "inverse";
/// Number of possible heights of a step up, and of a step down.
const STEPS: f64 = 10.0;
/// Number of ground points that the builder observes.
const POINTS_SEEN: usize = 12;
/// Distance between these points, and of the first one from the torso, m.
const SPACING: f64 = 0.5;

/// The roles. The figure has its own actions, observations and terms. The builder's action is the last of `others`.
/// With `regret`, a reference has the rest of them.
pub(super) fn roles(
    [actions, others]: [&[String]; 2],
    observations: &[&str],
    terms: &[String],
    regret: bool,
) -> Vec<RoleFacts> {
    let runner = RoleFacts {
        name: RUNNER.into(),
        observations: names(observations),
        actions: actions.to_vec(),
        reward_terms: terms.to_vec(),
        intermittent: regret,
    };
    let builder = RoleFacts {
        name: BUILDER.into(),
        observations: names([SEEN]),
        actions: names([ACTION]),
        reward_terms: names([if regret { REGRET } else { EARNED }]),
        intermittent: true,
    };
    let reference = RoleFacts {
        name: REFERENCE.into(),
        actions: others.iter().take(actions.len()).cloned().collect(),
        reward_terms: names([REFERENCE]),
        ..runner.clone()
    };
    [runner, builder].into_iter().chain(regret.then_some(reference)).collect()
}

/// Writes the builder's observation:
///
/// - heights of the ground ahead of the torso, relative to the ground below it, m
/// - height above the ground, velocity and forward axis of the torso
/// - the last step, m, and the time since the last meter, s
/// - with regret, whether the reference runs
#[inline(always)]
pub(super) fn observe<F: Runner, T: Real>(s: &Senses<T>, regrets: bool, out: &mut Obs<T>) {
    let ([x, y, z], [vx, _, vz], [fx, _, fz]) =
        (s.position(F::TORSO), s.linear_velocity(F::TORSO), s.forward(F::TORSO));
    let below = s.ground_height(x, y);
    out.group(SEEN);
    for i in 1..=POINTS_SEEN {
        out.scalar(s.ground_height(x + T::lit(i as f64 * SPACING), y) - below);
    }
    [z - below, vx, vz, fx, fz, s.memory(F::MEMORY + STEP), s.memory(F::MEMORY + SINCE) * T::lit(s.dt())]
        .into_iter()
        .for_each(|x| out.scalar(x));
    if regrets {
        out.scalar(s.memory(F::MEMORY + SECOND));
    }
}

/// Builds the next meter and continues level after it. `first` is the index of the course's first slot.
pub(super) fn build(site: &mut Site, first: usize) {
    let memory = &mut site.memory[first..];
    let difficulty = memory[DIFFICULTY];
    let wanted = site.action.last().copied().unwrap_or(0.0);
    // the runner reaches its next meter before it observes ground that is not built yet
    let start = ((LEVEL_TO + memory[BUILT] - FROM) / CELL).round() as usize;
    let per_meter = (1.0 / CELL).round() as usize;
    for ground in site.grounds.iter_mut().take(1) {
        let Some(from) = ground.get(start.min(POINTS - 1)).copied() else { continue };
        let step = 0.1 * libm::round(STEPS * wanted) * difficulty;
        let to = (f64::from(from) + step).clamp(-FARTHEST, FARTHEST);
        memory[STEP] = to - f64::from(from);
        for row in ground.chunks_exact_mut(POINTS) {
            for (i, z) in row.iter_mut().enumerate().skip(start + 1) {
                let share = ((i - start) as f64 / per_meter as f64).min(1.0);
                *z = (f64::from(from) + share * (to - f64::from(from))) as f32;
            }
        }
    }
    memory[BUILT] += 1.0;
    memory[DUE] = 0.0;
}

#[cfg(test)]
mod tests {
    use super::super::MEMORY;
    use super::*;

    /// Number of the figure's own slots.
    const FIRST: usize = 3;

    fn after(actions: &[f64], difficulty: f64) -> (Vec<f64>, Vec<Vec<f32>>) {
        let (mut memory, mut grounds) = (vec![0.0; FIRST + MEMORY], vec![vec![0.0; 2 * POINTS]]);
        for action in actions {
            memory[FIRST + DUE] = 1.0;
            memory[FIRST + DIFFICULTY] = difficulty;
            let (memory, grounds) = (&mut memory, &mut grounds);
            build(&mut Site { action: &[0.3, *action], memory, grounds, restart: false }, FIRST);
            assert!(memory[FIRST + DUE] == 0.0 && memory[..FIRST] == [0.0; FIRST]);
        }
        (memory.split_off(FIRST), grounds)
    }

    fn height(ground: &[f32], x: f64) -> f64 {
        f64::from(ground[((x - FROM) / CELL).round() as usize])
    }

    #[test]
    fn meters_follow_each_other() {
        let (memory, grounds) = after(&[1.0, -0.32, 0.04], 0.5);
        let ground = &grounds[0];
        // steps of 0.5, -0.15 and 0 m
        let heights = [(4.0, 0.0), (5.0, 0.0), (5.5, 0.25), (6.0, 0.5), (7.0, 0.35), (8.0, 0.35), (100.0, 0.35)];
        for (x, expected) in heights {
            assert!((height(ground, x) - expected).abs() < 1e-6, "{x}: {}", height(ground, x));
        }
        assert_eq!(ground[..POINTS], ground[POINTS..]);
        assert!(memory[STEP].abs() < 1e-6 && memory[BUILT] == 3.0);
    }

    #[test]
    fn ground_stays_within_its_bounds_and_within_the_field() {
        let (memory, grounds) = after(&[1.0; 150], 1.0);
        let most = grounds[0].iter().copied().fold(0.0, f32::max);
        assert!((f64::from(most) - FARTHEST).abs() < 1e-6 && memory[STEP] == 0.0);
        let (_, level) = after(&[1.0; 3], 0.0);
        assert!(level[0].iter().all(|z| *z == 0.0));
    }
}
