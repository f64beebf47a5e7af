//! Assault courses: the ground, its difficulty, and what the player does there.

use bevy_marathon::{AgentCommand, Ground, Held, LaidGround};
use clap::ValueEnum;
use marathon_envs::options::Value;
use marathon_envs::{Options, Spec, VecEnvOptions, registry};
use marathon_runs::{RunError, TaskConfig};

/// The agent whose courses are laid below agents without courses of their own. They are the same at every y.
const MODEL: &str = "TerrainWalker2d-v0";
/// The default agent that a player steers.
pub const LED: &str = "AntController-v0";
/// The default agent that a player builds against.
pub const BUILT_AGAINST: &str = "TerrainWalker2d-v0";
/// The kind of a course that the builder's steps make.
pub const BUILT: &str = "adversary";
/// Default kind and difficulty of a course.
const KIND: &str = "mixed";
const DIFFICULTY: f64 = 0.5;

/// The role of the player on an assault course.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum PlayerRole {
    /// Watch: the policy runs.
    #[default]
    Watch,
    /// Steer the runner, with a stick or the arrow keys.
    Run,
    /// Build the ground ahead of the policy, with the mouse or keys.
    Build,
}

impl PlayerRole {
    /// All roles.
    pub const ALL: [PlayerRole; 3] = [PlayerRole::Watch, PlayerRole::Run, PlayerRole::Build];

    /// Its name on the screen, on the command line and in the table.
    pub fn name(self) -> &'static str {
        match self {
            PlayerRole::Watch => "watch",
            PlayerRole::Run => "run",
            PlayerRole::Build => "build",
        }
    }

    /// Its goal, in a line on the screen.
    pub fn goal(self) -> &'static str {
        match self {
            PlayerRole::Watch => "Watch how far the policy gets.",
            PlayerRole::Run => "Reach the finish without a fall, faster than the best time.",
            PlayerRole::Build => "Build ground that stops the runner.",
        }
    }
}

/// An assault course, and the player's role.
#[derive(Clone, Debug, PartialEq)]
pub struct CourseOptions {
    /// The player's role.
    pub role: PlayerRole,
    /// The kind of the ground, in the words of the tasks on courses. A builder's ground is made of steps.
    pub kind: String,
    /// Difficulty, 0 to 1.
    pub difficulty: f64,
}

impl Default for CourseOptions {
    fn default() -> Self {
        CourseOptions { role: PlayerRole::Watch, kind: KIND.into(), difficulty: DIFFICULTY }
    }
}

/// Components of a character on a course, besides its task.
pub struct Equipment {
    /// The course, if the task has none.
    pub laid: Option<LaidGround>,
    /// The first command: stand.
    pub command: Option<AgentCommand>,
    /// The builder's action.
    pub held: Option<Held>,
}

impl CourseOptions {
    /// Takes over the options of the task that the user has chosen.
    pub fn take_from(&mut self, options: &Options) {
        if let Some(Value::Text(kind)) = options.get("course") {
            self.kind.clone_from(kind);
        }
        if let Some(Value::Number(difficulty)) = options.get("difficulty") {
            self.difficulty = difficulty.clamp(0.0, 1.0);
        }
    }

    /// The kind of the ground.
    pub fn kind(&self) -> &str {
        if self.role == PlayerRole::Build { BUILT } else { &self.kind }
    }

    /// Sets this course as an option of the task, if the task takes one. Every episode has this difficulty, unless the user
    /// has chosen other levels.
    pub fn applied(&self, mut task_config: TaskConfig, chosen: Option<&TaskConfig>) -> TaskConfig {
        if has_own(&task_config.agent) {
            task_config.options.set("course", self.kind());
            task_config.options.set("difficulty", self.difficulty);
            if chosen.is_none_or(|chosen| chosen.options.get("levels").is_none()) {
                task_config.options.set("levels", "fixed");
            }
        }
        task_config
    }

    /// The point ahead of the runner that the camera looks at, and its distance, m; `usual` is that of other modes. The player
    /// sees the ground ahead, or the site to build on.
    pub fn view(&self, usual: f32) -> (f32, f32) {
        match self.role {
            PlayerRole::Build => (3.2, usual.max(9.5)),
            PlayerRole::Watch | PlayerRole::Run => (1.2, 1.4 * usual),
        }
    }

    /// Makes the equipment of a character.
    ///
    /// # Errors
    /// If there is no such course.
    pub fn equipment(&self, seed: u64, ground: Ground, spec: &Spec) -> Result<Equipment, RunError> {
        let laid = if ground == Ground::Track { Some(LaidGround(self.elevations(seed)?)) } else { None };
        let stand = || {
            let mut command = AgentCommand::new(&spec.command);
            command.rest();
            command
        };
        let command = (self.role == PlayerRole::Run && !spec.command.is_empty()).then(stand);
        let held = (self.role == PlayerRole::Build).then(|| Held(vec![None; spec.act]));
        Ok(Equipment { laid, command, held })
    }

    /// The course of a seed: that of the first Walker in its first episode.
    fn elevations(&self, seed: u64) -> Result<Vec<f32>, RunError> {
        let mut task_config = TaskConfig::named(MODEL)?;
        task_config.options.set("course", self.kind());
        task_config.options.set("difficulty", self.difficulty);
        let mut env = task_config.vec_env(&VecEnvOptions { agents: 1, seed, ..VecEnvOptions::default() })?;
        let mut obs = vec![0.0_f32; env.spec().obs];
        env.reset(Some(seed), &mut obs)?;
        Ok(env.ground(0, 0)?)
    }
}

/// Whether the task of an agent has courses of its own.
pub fn has_own(agent: &str) -> bool {
    registry::agent(agent).is_ok_and(|agent| agent.has_option("course"))
}

/// Refuses an agent that the player's role on a course is not possible with.
///
/// # Errors
/// The text names an agent that is possible.
pub fn check(course: &CourseOptions, task_config: &TaskConfig) -> Result<(), RunError> {
    let (agent, own) = (&task_config.agent, has_own(&task_config.agent));
    match course.role {
        PlayerRole::Run if task_config.factory()?.spec().command.is_empty() => {
            let problem = format!("run is for agents that take commands, {agent} takes none; {LED} does");
            Err(RunError::option("role", problem))
        }
        PlayerRole::Build if !own => {
            let problem =
                format!("build is for tasks with courses of their own, {agent} has none; {BUILT_AGAINST} has");
            Err(RunError::option("role", problem))
        }
        _ if !own && course.kind() == BUILT => {
            let problem =
                format!("{BUILT} is for tasks with courses of their own, {agent} has none; {BUILT_AGAINST} has");
            Err(RunError::option("course", problem))
        }
        // the tasks know their courses, and the ground knows which floors it can replace
        _ if !own => {
            Ground::Track.agent_with(agent, &task_config.options)?;
            course.elevations(0).map(drop)
        }
        _ => task_config.factory().map(drop),
    }
}
