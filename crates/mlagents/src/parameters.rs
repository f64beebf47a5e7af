//! Environment parameters, which a trainer varies by agent and episode.
//!
//! ML-Agents sends a number or a distribution for each parameter, and the player draws. Every draw depends only on the
//! sampler's seed, the parameter's name, the agent and its episode, so training runs are reproducible.

use crate::channels::Sampler;
use fnv::FnvHasher;
use marathon_envs::{CommandRange, VecEnvOptions};
use marathon_physics::{Model, Variation};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::collections::BTreeMap;
use std::hash::Hasher;

/// Target of a parameter.
#[derive(Clone, Debug, PartialEq)]
enum Target {
    /// Factor of all masses and inertias.
    Mass,
    /// Factor of one body's mass and inertia.
    BodyMass(usize),
    /// Factor of the friction.
    Friction,
    /// Factor of all motors' forces.
    Strength,
    /// Factor of one motor's force.
    MotorStrength(usize),
    /// Gravity, m/s^2, in the model's own direction.
    Gravity,
    /// One number of the agents' command.
    Command(usize),
    /// Decisions after which an episode is truncated.
    MaxEpisodeSteps,
    /// An option of the agent.
    Option(String),
}

/// The parameters of an agent.
pub struct Names {
    known: Vec<(String, Target)>,
}

impl Names {
    /// The parameters of an agent with this model, this command and these options. Only numeric options count.
    pub fn new(
        model: &Model,
        actuators: &[String],
        command: &[CommandRange],
        options: &marathon_envs::Options,
    ) -> Self {
        let plain = [
            ("mass", Target::Mass),
            ("friction", Target::Friction),
            ("strength", Target::Strength),
            ("gravity", Target::Gravity),
            ("max_episode_steps", Target::MaxEpisodeSteps),
        ];
        let mut known: Vec<_> = plain.into_iter().map(|(name, target)| (name.to_string(), target)).collect();
        // the world has no mass
        let bodies = model.bodies.iter().enumerate().skip(1);
        known.extend(bodies.map(|(i, body)| (format!("mass.{}", body.name), Target::BodyMass(i))));
        let motors = actuators.iter().enumerate();
        known.extend(motors.map(|(i, name)| (format!("strength.{name}"), Target::MotorStrength(i))));
        let told = command.iter().enumerate();
        known.extend(told.map(|(i, range)| (format!("command.{}", range.name), Target::Command(i))));
        let numbers = options.iter().filter(|(_, value)| matches!(value, marathon_envs::Value::Number(_)));
        known.extend(numbers.map(|(name, _)| (name.to_string(), Target::Option(name.to_string()))));
        Names { known }
    }

    /// All names.
    pub fn iter(&self) -> impl Iterator<Item = &str> {
        self.known.iter().map(|(name, _)| name.as_str())
    }

    /// Whether the parameter exists.
    pub fn contains(&self, name: &str) -> bool {
        self.find(name).is_some()
    }

    fn find(&self, name: &str) -> Option<&Target> {
        self.known.iter().find(|(known, _)| known == name).map(|(_, target)| target)
    }
}

/// The parameters that the trainer has set.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parameters {
    samplers: BTreeMap<String, Sampler>,
}

impl Parameters {
    /// Sets a parameter until the next call. NaN removes it.
    pub fn set(&mut self, name: String, sampler: Sampler) {
        match sampler {
            Sampler::Constant(x) if x.is_nan() => drop(self.samplers.remove(&name)),
            sampler => drop(self.samplers.insert(name, sampler)),
        }
    }

    /// Whether no parameter is set.
    pub fn is_empty(&self) -> bool {
        self.samplers.is_empty()
    }

    /// Draws the variation of an agent for an episode. `None` if no parameter affects it.
    pub fn variation(&self, names: &Names, unvaried: &Variation, agent: u64, episode: u64) -> Option<Variation> {
        let mut own: Option<Variation> = None;
        // values for one part multiply values for all parts
        let mut parts = Vec::new();
        for (name, sampler) in &self.samplers {
            let Some(target) = names.find(name) else { continue };
            if matches!(target, Target::Command(_) | Target::MaxEpisodeSteps | Target::Option(_)) {
                continue;
            }
            let x = f64::from(draw(sampler, name, agent, episode));
            let own = own.get_or_insert_with(|| unvaried.clone());
            match target {
                Target::Mass => own.mass.fill(x),
                Target::Friction => own.friction = x,
                Target::Strength => own.strength.fill(x),
                Target::Gravity => own.gravity = of_length(unvaried.gravity, x),
                _ => parts.push((target, x)),
            }
        }
        if let Some(own) = &mut own {
            for (target, x) in parts {
                match target {
                    Target::BodyMass(i) => own.mass[*i] *= x,
                    Target::MotorStrength(i) => own.strength[*i] *= x,
                    _ => {}
                }
            }
        }
        own
    }

    /// Draws an agent's command for an episode, which replaces its schedule. `None` if no parameter sets it. Numbers
    /// without a parameter are at [rest](CommandRange::rest).
    pub fn command(&self, names: &Names, ranges: &[CommandRange], agent: u64, episode: u64) -> Option<Vec<f64>> {
        let mut told: Option<Vec<f64>> = None;
        for (name, sampler) in &self.samplers {
            let Some(Target::Command(i)) = names.find(name) else { continue };
            let x = draw(sampler, name, agent, episode);
            // the setter refuses values out of range
            let x = f64::from(x);
            let x = ranges[*i].fit(x).unwrap_or(x);
            told.get_or_insert_with(|| ranges.iter().map(CommandRange::rest).collect())[*i] = x;
        }
        told
    }

    /// Writes values that all agents of an environment share into `options`: the length of episodes and options of the
    /// agent, drawn for the `reset`th time.
    pub fn configure(&self, names: &Names, reset: u64, options: &mut VecEnvOptions) {
        for (name, sampler) in &self.samplers {
            let x = || draw(sampler, name, u64::MAX, reset);
            match names.find(name) {
                Some(Target::MaxEpisodeSteps) => options.max_episode_steps = Some(x().round().max(1.0) as usize),
                Some(Target::Option(option)) => options.options.set(option, f64::from(x())),
                _ => {}
            }
        }
    }
}

/// Scales a vector to another length. A zero vector becomes downward.
fn of_length(vector: [f64; 3], length: f64) -> [f64; 3] {
    let present = libm::sqrt(vector.iter().map(|x| x * x).sum());
    if present > 0.0 { vector.map(|x| x / present * length) } else { [0.0, 0.0, -length] }
}

/// Draws a value.
fn draw(sampler: &Sampler, name: &str, agent: u64, episode: u64) -> f32 {
    let seed = match sampler {
        Sampler::Constant(x) => return *x,
        Sampler::Uniform { seed, .. } | Sampler::Gaussian { seed, .. } | Sampler::MultiRange { seed, .. } => *seed,
    };
    let mut key = [0; 32];
    let parts = [u64::from(seed as u32), agent, episode, fnv1a(name)];
    for (bytes, part) in key.chunks_exact_mut(8).zip(parts) {
        bytes.copy_from_slice(&part.to_le_bytes());
    }
    let mut random = ChaCha8Rng::from_seed(key);
    // in [0, 1), with the 53 bits of a double
    let mut uniform = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    let between = |[low, high]: [f32; 2], u: f64| (f64::from(low) + (f64::from(high) - f64::from(low)) * u) as f32;
    match sampler {
        Sampler::Constant(x) => *x,
        Sampler::Uniform { min, max, .. } => between([*min, *max], uniform()),
        // Box-Muller
        Sampler::Gaussian { mean, std, .. } => {
            let radius = libm::sqrt(-2.0 * libm::log(1.0 - uniform()));
            let angle = libm::cos(std::f64::consts::TAU * uniform());
            (f64::from(*mean) + f64::from(*std) * radius * angle) as f32
        }
        // the probability of an interval is proportional to its length
        Sampler::MultiRange { ranges, .. } => {
            let width = |[low, high]: [f32; 2]| (f64::from(high) - f64::from(low)).abs();
            let total: f64 = ranges.iter().map(|r| width(*r)).sum();
            let mut at = uniform() * total;
            let chosen = ranges.iter().find(|range| {
                at -= width(**range);
                at < 0.0
            });
            between(*chosen.unwrap_or(&ranges[ranges.len() - 1]), uniform())
        }
    }
}

/// Hash that separates the streams of parameters with the same seed.
fn fnv1a(text: &str) -> u64 {
    let mut hash = FnvHasher::default();
    hash.write(text.as_bytes());
    hash.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use marathon_envs::{Options, agent};

    fn hopper() -> (Names, Variation) {
        let model = agent("Hopper-v5").unwrap().model().unwrap();
        let actuators: Vec<_> = model.actuators.iter().map(|a| a.name.clone()).collect();
        let options = Options::new().with("ctrl_cost_weight", 0.001).with("xml_file", "hopper.xml");
        (Names::new(&model, &actuators, &[], &options), Variation::none(&model))
    }

    #[test]
    fn parameters_reach_what_they_name() {
        let (names, unvaried) = hopper();
        let mut parameters = Parameters::default();
        assert_eq!(parameters.variation(&names, &unvaried, 0, 1), None);
        for (name, value) in [("mass", 2.0), ("mass.torso", 1.5), ("gravity", 3.7), ("friction", 0.5), ("mas", 9.0)] {
            parameters.set(name.into(), Sampler::Constant(value));
        }
        parameters.set("ctrl_cost_weight".into(), Sampler::Constant(0.25));
        parameters.set("max_episode_steps".into(), Sampler::Constant(99.7));
        let own = parameters.variation(&names, &unvaried, 3, 1).unwrap();
        assert_eq!((own.mass[1], own.mass[2], own.friction), (3.0, 2.0, 0.5));
        assert!((own.gravity[2] + 3.7).abs() < 1e-6 && own.strength == unvaried.strength);
        let mut options = VecEnvOptions::default();
        parameters.configure(&names, 1, &mut options);
        assert_eq!(options.max_episode_steps, Some(100));
        assert_eq!(options.options, Options::new().with("ctrl_cost_weight", 0.25));
        // options that are not numbers are not parameters
        assert!(!names.iter().any(|name| name == "xml_file"));
    }

    #[test]
    fn commands_are_drawn_for_each_agent_and_episode_and_taken_back() {
        let (model, options) = (agent("Hopper-v5").unwrap().model().unwrap(), Options::new());
        let ranges = [CommandRange::new("speed", 0.05..=0.1, "m/s"), CommandRange::new("turn", -1.0..=1.0, "rad/s")];
        let names = Names::new(&model, &[], &ranges, &options);
        let mut parameters = Parameters::default();
        let command = |parameters: &Parameters, agent| parameters.command(&names, &ranges, agent, 1);
        parameters.set("mass".into(), Sampler::Constant(2.0));
        assert_eq!(command(&parameters, 0), None);
        parameters.set("command.turn".into(), Sampler::Uniform { seed: 1, min: -1.0, max: 1.0 });
        let drawn: Vec<_> = (0..2).map(|agent| command(&parameters, agent).unwrap()).collect();
        assert!(drawn[0][0] == 0.05 && drawn[0][1] != drawn[1][1] && drawn[0][1].abs() <= 1.0);
        assert_ne!(parameters.command(&names, &ranges, 0, 2).unwrap(), drawn[0]);
        // 0.1 in single precision is more than 0.1
        parameters.set("command.speed".into(), Sampler::Constant(0.1));
        assert_eq!(command(&parameters, 0).unwrap(), [0.1, drawn[0][1]]);
        // values out of range are refused by the setter
        parameters.set("command.speed".into(), Sampler::Constant(4.0));
        assert_eq!(command(&parameters, 0).unwrap()[0], 4.0);
        for name in ["command.speed", "command.turn"] {
            parameters.set(name.into(), Sampler::Constant(f32::NAN));
        }
        assert_eq!(command(&parameters, 0), None);
        // a command is not a variation
        assert_eq!(parameters.variation(&names, &Variation::none(&model), 0, 1).unwrap().mass[1], 2.0);
    }

    #[test]
    fn samplers_have_the_distributions_that_they_name() {
        let moments = |sampler: &Sampler| {
            let n = 20_000;
            let all: Vec<f64> = (0..n).map(|i| f64::from(draw(sampler, "mass", i % 16, i / 16))).collect();
            let mean = all.iter().sum::<f64>() / n as f64;
            (mean, (all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n as f64).sqrt(), all)
        };
        let (mean, std, all) = moments(&Sampler::Uniform { seed: 1, min: 1.0, max: 3.0 });
        assert!((mean - 2.0).abs() < 0.02 && (std - 2.0 / 12f64.sqrt()).abs() < 0.02);
        assert!(all.iter().all(|x| (1.0..=3.0).contains(x)));
        let (mean, std, _) = moments(&Sampler::Gaussian { seed: 1, mean: -1.0, std: 0.5 });
        assert!((mean + 1.0).abs() < 0.02 && (std - 0.5).abs() < 0.02);
        let (mean, _, all) = moments(&Sampler::MultiRange { seed: 1, ranges: vec![[0.0, 1.0], [9.0, 12.0]] });
        assert!((mean - (0.25 * 0.5 + 0.75 * 10.5)).abs() < 0.1 && all.iter().all(|x| *x <= 1.0 || *x >= 9.0));
    }

    #[test]
    fn draws_depend_on_seed_name_agent_and_episode() {
        let sampler = |seed| Sampler::Uniform { seed, min: 0.0, max: 1.0 };
        let first = draw(&sampler(1), "mass", 2, 3);
        assert_eq!(first, draw(&sampler(1), "mass", 2, 3));
        for other in [
            draw(&sampler(2), "mass", 2, 3),
            draw(&sampler(1), "friction", 2, 3),
            draw(&sampler(1), "mass", 1, 3),
            draw(&sampler(1), "mass", 2, 4),
        ] {
            assert_ne!(first, other);
        }
    }
}
