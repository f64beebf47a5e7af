//! A task for any model: a robot that learns to follow velocity commands, without code.
//!
//! `Robot-v0` takes an MJCF file (`xml_file`). The [rig] derives from it the root, the standing pose, the feet, the servos, and the
//! speeds and steps that suit the robot's size. Motors become servos. Arguments replace what it derives.
//!
//! Lengths are divided by the height H of the root in the standing pose, speeds by sqrt(g H), torques by the strength of the joint,
//! and everything over joints and feet is a mean. So the same weights hold for robots of all sizes (sources: MuJoCo Playground,
//! mjlab, and the generated robots of Bohlinger et al., "One policy to run them all").
//!
//! | observation | content |
//! |---|---|
//! | `command` | commanded speed ahead and to the left, divided by sqrt(g H), and turn rate, rad/s |
//! | `velocity` | velocity of the root in its own axes, divided by sqrt(g H) |
//! | `angular_velocity` | that of the root in its own axes, rad/s |
//! | `up` | the world's up axis in the root's axes |
//! | `joint_positions`, `joint_velocities` | from the standing pose, rad, and a twentieth of the velocity, rad/s |
//! | `last_action` | the last action |
//! | `clock` | sine and cosine of the phase of the steps, 0 at rest; only with a clock |
//!
//! The module `task` lists the terms of the reward. An episode is terminated when the root tilts too far or sinks below half of its
//! height. It lasts 20 seconds.

pub mod arguments;
mod edits;
mod hold;
mod knees;
mod legs;
pub mod rig;
pub mod servos;
pub mod stance;
mod task;

use std::sync::{Arc, OnceLock};

use marathon_physics::Model;
use marathon_physics::lanes::Isa;
use marathon_physics::mjcf::MjcfError;

use crate::agent::options::OptionSet;
use crate::agent::{Agent, Facts, ModelSource, OptionInfo, Options};
use crate::any_agent::AnyAgent;
use crate::error::EnvError;
use crate::shard::AgentShards;
use arguments::RobotArguments;
use rig::Rig;
use task::Robot;

/// Name of the argument that is the model.
pub const MODEL: &str = "xml_file";

/// The task, whose model is an argument. The rig is made when it is first needed.
#[derive(Default)]
pub struct AnyRobot {
    arguments: RobotArguments,
    robot: OnceLock<Result<Arc<Robot>, MjcfError>>,
}

impl AnyRobot {
    /// The robot with these arguments.
    ///
    /// # Errors
    /// If the model cannot be read, or is no robot that moves over the ground.
    pub fn new(arguments: RobotArguments) -> Result<AnyRobot, EnvError> {
        let robot = Arc::new(Robot::new(Rig::new(&arguments)?, arguments.clone()));
        Ok(AnyRobot { arguments, robot: Ok(robot).into() })
    }

    /// The robot, or why the shipped model cannot be read.
    fn robot(&self) -> Result<&Arc<Robot>, MjcfError> {
        let made = self.robot.get_or_init(|| match Rig::new(&self.arguments) {
            Ok(rig) => Ok(Arc::new(Robot::new(rig, self.arguments.clone()))),
            Err(EnvError::Model { source, .. }) => Err(*source),
            Err(error) => panic!("the shipped model is a robot: {error}"),
        });
        made.as_ref().map_err(Clone::clone)
    }

    /// The error of a model that cannot be read.
    fn broken(source: MjcfError) -> EnvError {
        EnvError::Model { id: rig::ID.into(), source: source.into() }
    }
}

impl AnyAgent for AnyRobot {
    fn id(&self) -> String {
        rig::ID.into()
    }

    fn facts(&self) -> Facts {
        match self.robot() {
            Ok(robot) => Agent::facts(&**robot),
            Err(error) => Facts { id: self.id(), model: ModelSource::Broken(error.into()), ..Facts::default() },
        }
    }

    fn model(&self) -> Result<Model, EnvError> {
        Ok(self.robot().map_err(Self::broken)?.rig.model.clone())
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.arguments.infos()
    }

    fn with_options(self: Arc<Self>, options: &Options) -> Result<Arc<dyn AnyAgent>, EnvError> {
        if options.is_empty() {
            return Ok(self);
        }
        crate::any_agent::check(rig::ID, &self.arguments.infos(), options)?;
        Ok(Arc::new(AnyRobot::new(self.arguments.with(options))?))
    }

    fn shards_as(self: Arc<Self>, facts: Facts, isa: Isa) -> Result<Arc<dyn AgentShards>, EnvError> {
        self.robot().map_err(Self::broken)?.clone().shards_as(facts, isa)
    }

    fn findings(&self) -> Option<String> {
        self.robot().ok().map(|robot| robot.rig.to_string())
    }
}
