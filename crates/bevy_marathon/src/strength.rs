//! Strength of a character, limb by limb.

use crate::error::StrengthError;
use crate::limbs::Limbs;
use bevy::prelude::*;
use std::sync::Arc;

/// Largest factor of a strength. Stronger servos are stiffer than the timestep of the physics allows.
const STRONGEST: f64 = 10.0;

/// Strength of a [`Ragdoll`](crate::Ragdoll), as factors of the forces of its actuators: 1 is that of its model, 0 is limp. The factors multiply
/// those of its [`Physique`](crate::Physique). They hold over all episodes.
///
/// ```no_run
/// # use bevy::prelude::*;
/// # use bevy_marathon::prelude::*;
/// fn wound(mut character: Single<&mut LimbStrength>) -> Result {
///     // all actuators of a body, or one actuator, by name
///     character.set("left_larm", 0.2)?;
///     // and all of them together
///     character.whole = 0.8;
///     Ok(())
/// }
/// ```
#[derive(Component, Clone, Debug, PartialEq, Reflect)]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
pub struct LimbStrength {
    /// Factor of all actuators, 0 to 10.
    pub whole: f64,
    /// A factor for each actuator.
    factors: Vec<f64>,
    #[reflect(ignore)]
    limbs: Arc<Limbs>,
}

impl Default for LimbStrength {
    /// As the model has it.
    fn default() -> Self {
        LimbStrength { whole: 1.0, factors: Vec::new(), limbs: Arc::default() }
    }
}

impl LimbStrength {
    /// The strength of a character with this factor of all actuators.
    pub fn of_all(whole: f64) -> Self {
        LimbStrength { whole, ..default() }
    }

    /// Sets the factor of a limb, 0 to 10: of all actuators that move the body of this name, or of the actuator of this name.
    ///
    /// # Errors
    /// If the character has no such limb or is not in the simulation yet, or the factor is out of its range. Then
    /// nothing changes.
    pub fn set(&mut self, name: &str, factor: f64) -> Result<(), StrengthError> {
        let named: Vec<usize> = self.limbs.named(name).collect();
        if named.is_empty() {
            let (name, known) = (name.to_string(), self.limbs.names());
            return Err(match known.is_empty() {
                true => StrengthError::NoLimbs { name },
                false => StrengthError::Unknown { name, known },
            });
        }
        if !(0.0..=STRONGEST).contains(&factor) {
            return Err(StrengthError::OutOfRange { name: name.to_string(), factor, strongest: STRONGEST });
        }
        // reflection can set any number of factors
        self.factors.resize(self.limbs.len(), 1.0);
        named.into_iter().for_each(|actuator| self.factors[actuator] = factor);
        Ok(())
    }

    /// The factor of a limb, without that of the whole character: the smallest, if several actuators move it. `None` if
    /// there is no such limb.
    pub fn get(&self, name: &str) -> Option<f64> {
        let factors = self.limbs.named(name).map(|actuator| self.factors.get(actuator).copied().unwrap_or(1.0));
        factors.reduce(f64::min)
    }

    /// Gives all limbs the strength of the model again. [`whole`](Self::whole) stays.
    pub fn reset(&mut self) {
        self.factors.clear();
    }

    /// The names that [`set`](Self::set) takes: bodies with actuators, then the other actuators. Empty before the character
    /// is in the simulation.
    pub fn names(&self) -> Vec<String> {
        self.limbs.names()
    }

    /// The same for a character with these limbs.
    pub(crate) fn with_limbs(&self, limbs: &Arc<Limbs>) -> Self {
        LimbStrength { limbs: limbs.clone(), ..self.clone() }
    }

    /// Factor of an actuator.
    pub(crate) fn factor(&self, actuator: usize) -> f64 {
        let own = self.factors.get(actuator).copied().unwrap_or(1.0);
        // reflection can set any number
        let factor = self.whole * own;
        if factor.is_nan() { 0.0 } else { factor.clamp(0.0, STRONGEST) }
    }
}
