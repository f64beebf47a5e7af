//! Grounds other than the level one: hills, stairs, boards, as height fields in the agent's own model.
//!
//! They are profiles along the track, the same at every distance from it. The first meters are level, so that episodes
//! begin as in training.

use marathon_envs::agents::marathon::terrain::course::{FROM, POINTS, TO};
use marathon_envs::{AnyAgent, EnvError, ModelSource, Options, Registry, WithModel, registry};
use marathon_physics::mjcf::MjcfError;
use marathon_physics::spec::{ElementRef, Geom, HField, Kind, ModelSpec};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Level meters at the start of the track.
const LEVEL: f64 = 4.0;
/// Length of the uneven part, m; beyond it the ground is level again.
const LENGTH: f64 = 120.0;
/// Meters behind the start that the field covers.
const BEHIND: f64 = 2.0;
/// Distance between the points of a profile, m.
const GRID: f64 = 0.1;
/// Half the width of the field, m.
const HALF_WIDTH: f64 = 30.0;
/// Depth of the field's zero level below the level ground, m: two surfaces at the same height would both carry.
const SUNK: f64 = 0.01;

/// Half the width of a [`Ground::Track`], and its thickness below the start's height, m.
pub const TRACK_HALF_WIDTH: f64 = 8.0;
const TRACK_BASE: f64 = 8.0;

/// Shape of a track.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, bevy::reflect::Reflect)]
pub enum Ground {
    /// As in training.
    #[default]
    Level,
    /// Waves eight meters long, which grow to a height of 60 cm.
    Hills,
    /// Flights of stairs up and down: five steps of 6 cm, half a meter deep.
    Stairs,
    /// Boards across the track, 2 to 5 cm high.
    Boards,
    /// Level ground in place of the floor, which [`LaidGround`](crate::LaidGround) shapes: a height field as the assault courses
    /// of the Ant have it.
    Track,
}

impl Ground {
    /// All shapes except [`Ground::Track`], which [`LaidGround`](crate::LaidGround) shapes.
    pub const ALL: [Ground; 4] = [Ground::Level, Ground::Hills, Ground::Stairs, Ground::Boards];

    /// Its name on the screen, on the command line and in recordings.
    pub const fn name(self) -> &'static str {
        match self {
            Ground::Level => "level",
            Ground::Hills => "hills",
            Ground::Stairs => "stairs",
            Ground::Boards => "boards",
            Ground::Track => "track",
        }
    }

    /// The ground of a name.
    pub fn named(name: &str) -> Option<Self> {
        Ground::ALL.into_iter().chain([Ground::Track]).find(|ground| ground.name() == name)
    }

    /// Height at a place of the track, m.
    pub fn height(self, x: f64) -> f64 {
        let (way, end) = (x - LEVEL, LENGTH - LEVEL);
        if !(0.0..end).contains(&way) {
            return 0.0;
        }
        match self {
            Ground::Level | Ground::Track => 0.0,
            Ground::Hills => {
                // growing over 24 m, and back to level ground at the end
                let most = 0.6 * (0.25 + way / 32.0).min((end - way) / 8.0).min(1.0);
                0.5 * most * (1.0 - (TAU * way / 8.0).cos())
            }
            Ground::Stairs => {
                // five up, a landing, five down, a pause
                const UP: [f64; 16] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 5.0, 5.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.0, 0.0, 0.0];
                0.06 * UP[(way / 0.5) as usize % UP.len()]
            }
            Ground::Boards => {
                let number = (way / 1.5) as u64;
                // any order that does not repeat to the eye
                let height = 0.02 + 0.01 * (number.wrapping_mul(2_654_435_761) >> 7 & 3) as f64;
                if way % 1.5 < 0.4 { height } else { 0.0 }
            }
        }
    }

    /// An agent of the registry on this ground.
    ///
    /// # Errors
    /// If there is no such agent, or its model cannot be read.
    pub fn agent(self, name: &str) -> Result<Arc<dyn AnyAgent>, EnvError> {
        self.agent_with(name, &Options::new())
    }

    /// The same with other values for some of its arguments.
    ///
    /// # Errors
    /// The same, or if it does not take an argument or its value.
    pub fn agent_with(self, name: &str, options: &Options) -> Result<Arc<dyn AnyAgent>, EnvError> {
        self.colliding_agent(name, options, false)
    }

    /// The same. If it `collides`, its model has a geom for obstacles.
    pub(crate) fn colliding_agent(
        self,
        name: &str,
        options: &Options,
        collides: bool,
    ) -> Result<Arc<dyn AnyAgent>, EnvError> {
        // an argument may change the model, which the ground becomes a part of
        let agent = registry::agent(name)?.with_options(options)?;
        if self == Ground::Level && !collides {
            return Ok(agent);
        }
        let facts = agent.facts();
        let refused = |source| EnvError::Model { id: facts.id.clone(), source: Box::new(source) };
        let mut spec = facts.model.spec(&facts.id).map_err(refused)?;
        if collides {
            spec.add_obstacles().map_err(refused)?;
        }
        if !self.lay(&mut spec).map_err(refused)? {
            let problem = "its model has no level floor of its own, which a course could replace";
            return Err(EnvError::Agent { id: facts.id, problem: problem.into() });
        }
        Ok(Arc::new(WithModel::new(agent, ModelSource::from(spec))))
    }

    /// A registry that has an agent on this ground, and the arguments that are still to be given to it.
    pub(crate) fn registry(
        self,
        name: &str,
        options: &Options,
        collides: bool,
    ) -> Result<(Registry, Options), EnvError> {
        if self == Ground::Level && !collides {
            return Ok((registry::global(), options.clone()));
        }
        let mut registry = Registry::empty();
        registry.register(self.colliding_agent(name, options, collides)?)?;
        Ok((registry, Options::new()))
    }

    /// Lays this ground into a model. `false`: the model has no floor that it could replace.
    fn lay(self, spec: &mut ModelSpec) -> Result<bool, MjcfError> {
        match self {
            Ground::Level => return Ok(true),
            Ground::Track => return lay_track(spec),
            Ground::Hills | Ground::Stairs | Ground::Boards => {}
        }
        let points = ((LENGTH + BEHIND) / GRID).round() as usize + 1;
        let heights: Vec<f64> = (0..points).map(|i| self.height(i as f64 * GRID - BEHIND)).collect();
        let top = heights.iter().copied().fold(0.0, f64::max);
        // whole tenths of a millimeter
        let row: Vec<f64> = heights.iter().map(|height| (height * 1e4).round() / 1e4).collect();
        let (half, middle) = (0.5 * (LENGTH + BEHIND), 0.5 * (LENGTH - BEHIND));
        let name = self.name();
        let field = HField::new(name, 2, points, [half, HALF_WIDTH, top, 0.5]).elevation(&[&row[..], &row].concat());
        // geoms collide if the contype of one meets the conaffinity of the other: 1 is what every agent's geoms have
        let ground = Geom::hfield(name).name(name).pos([middle, 0.0, -SUNK]).collision(0, 1).rgba([1.0; 4]);
        spec.add(field)?.add_first_to("world", ground)?;
        Ok(true)
    }
}

/// Puts a height field in place of the floor, as the assault courses have it. `false`: there is no such floor.
fn lay_track(spec: &mut ModelSpec) -> Result<bool, MjcfError> {
    let Some(mut floor) = spec.find_mut(Kind::Geom, is_floor) else { return Ok(false) };
    let (half, middle) = (0.5 * (TO - FROM), 0.5 * (TO + FROM));
    floor.unset("size")?.set("type", "hfield")?.set("hfield", "track")?.set("pos", [middle, 0.0, 0.0])?;
    spec.add(HField::new("track", 2, POINTS, [half, TRACK_HALF_WIDTH, 1.0, TRACK_BASE]))?;
    Ok(true)
}

/// Whether a geom is an infinite level plane at height 0.
fn is_floor(geom: ElementRef) -> bool {
    let moved = ["pos", "quat", "axisangle", "euler", "xyaxes", "zaxis"].iter().any(|place| geom.get(place).is_some());
    geom.get("type") == Some("plane") && geom.numbers("size").is_some_and(|size| size.starts_with(&[0.0; 2])) && !moved
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_agent_has_every_ground() -> Result<(), Box<dyn std::error::Error>> {
        for name in ["hopper", "walker", "humanoid", "ant", "Hopper-v5", "walker-run-v0"] {
            let level = registry::agent(name)?.model()?;
            for ground in Ground::ALL.into_iter().filter(|g| *g != Ground::Level) {
                let model = ground.agent(name)?.model()?;
                assert_eq!(
                    (model.nq, model.nu, model.bodies.len()),
                    (level.nq, level.nu, level.bodies.len()),
                    "{name} {ground:?}"
                );
                assert_eq!(model.hfields.len(), level.hfields.len() + 1);
            }
        }
        assert!(Ground::Hills.agent("hoper").is_err());
        Ok(())
    }

    #[test]
    fn a_track_replaces_the_floor() -> Result<(), Box<dyn std::error::Error>> {
        for name in ["hopper", "walker", "ant", "AntController"] {
            let (level, track) = (registry::agent(name)?.model()?, Ground::Track.agent(name)?.model()?);
            assert_eq!((track.nq, track.nu, track.geoms.len()), (level.nq, level.nu, level.geoms.len()), "{name}");
            assert_eq!((track.hfields.len(), track.hfields[0].ncol), (1, POINTS), "{name}");
        }
        assert_eq!(Ground::named("track"), Some(Ground::Track));
        assert!(Ground::Track.agent("Swimmer-v5").is_err_and(|e| e.to_string().contains("no level floor")));
        Ok(())
    }

    #[test]
    fn tracks_begin_and_end_level() {
        for ground in Ground::ALL {
            for x in [-5.0, 0.0, 3.9, LENGTH + 1.0] {
                assert_eq!(ground.height(x), 0.0, "{ground:?} at {x}");
            }
            let most = (0..1200).map(|i| ground.height(0.1 * f64::from(i))).fold(0.0, f64::max);
            assert!(ground == Ground::Level || (0.03..0.7).contains(&most), "{ground:?}: {most}");
            assert_eq!(Ground::named(ground.name()), Some(ground));
        }
    }
}
