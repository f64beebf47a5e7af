//! The changes that make a model ready to learn: ground, a time step, and hard feet.

use marathon_physics::mjcf::MjcfError;
use marathon_physics::model::{Integrator, Model};
use marathon_physics::spec::{Geom, Kind, ModelSpec};

use super::stance::{self, Foot};

/// Seconds between decisions.
const DECISION: f64 = 0.02;
/// Longest physics step, s.
const STEP: f64 = 0.005;
/// Least cap on the iterations of the solver.
const CONVERGED: usize = 50;
/// MuJoCo's default impedance of contacts, `solimp`.
const HARD: [f64; 5] = [0.9, 0.95, 0.001, 0.5, 2.0];
/// Least impedance of a foot that counts as hard.
const LEAST_IMPEDANCE: f64 = 0.8;
/// Least sliding friction of a foot.
const LEAST_FRICTION: f64 = 0.6;

/// Sets a time step and solver that suit servos and decisions, and adds ground to a model that has none.
pub fn prepare(spec: &mut ModelSpec, given: &Model) -> Result<(), MjcfError> {
    let still = given.opt.density == 0.0 && given.opt.viscosity == 0.0;
    let implicit = still && given.tendons.iter().all(|tendon| tendon.damping == 0.0);
    let mut option = spec.section_mut("option")?;
    if implicit && given.opt.integrator != Integrator::ImplicitFast {
        option.set("integrator", "implicitfast")?;
    }
    let step = if implicit { STEP } else { given.opt.timestep.min(STEP) };
    // a low cap is tuned to the model's own, shorter steps
    if given.opt.iterations < CONVERGED {
        option.set("iterations", CONVERGED)?.set("ls_iterations", given.opt.ls_iterations.max(CONVERGED))?;
    }
    // a whole number of steps per decision
    option.set("timestep", DECISION / (DECISION / step).ceil())?;
    if !stance::has_ground(given) {
        spec.add_first_to("world", Geom::plane().set("size", [0.0, 0.0, 1.0]).collision(1, 1))?;
    }
    Ok(())
}

/// Physics steps per decision.
pub fn frame_skip(model: &Model) -> usize {
    ((DECISION / model.opt.timestep).round() as usize).max(1)
}

/// Gives feet hard contacts with friction, without which a step has nothing to push against. Returns the number of geoms that it
/// changed. Copies made by `replicate` stay as they are.
pub fn harden(spec: &mut ModelSpec, given: &Model, feet: &[Foot]) -> Result<usize, MjcfError> {
    let mut changed = 0;
    for geom in feet.iter().flat_map(|foot| &foot.geoms).map(|g| &given.geoms[*g]) {
        let Ok(mut part) = spec.get_mut(Kind::Geom, &geom.name) else { continue };
        let mut edited = false;
        if geom.solimp[0] < LEAST_IMPEDANCE {
            part.set("solimp", HARD)?;
            edited = true;
        }
        if geom.margin > 0.0 {
            part.set("margin", 0.0)?.set("gap", 0.0)?;
            edited = true;
        }
        if geom.condim < 3 {
            part.set("condim", 3usize)?;
            edited = true;
        }
        let [slide, spin, roll] = geom.friction;
        if slide < LEAST_FRICTION {
            part.set("friction", [LEAST_FRICTION, spin, roll])?;
            edited = true;
        }
        changed += usize::from(edited);
    }
    Ok(changed)
}
