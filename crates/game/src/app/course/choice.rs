//! What one chooses of an assault course: the ground, how difficult it is, and what one does there.

use crate::app::args::{Args, Mode};
use crate::app::error::GameError;
use crate::app::show::{Show, Source};
use crate::ground::Ground;
use crate::ragdoll::{AgentCommand, Held, LaidGround};
use bevy_egui::egui::{ComboBox, Slider, Ui};
use clap::ValueEnum;
use marathon_envs::agents::marathon::terrain::course::Kind;
use marathon_envs::options::Choice as _;
use marathon_envs::options::Value;
use marathon_envs::{CommandRange, Options, Spec, VecEnvOptions, registry};
use marathon_runs::{RunError, Setting};
use std::sync::Arc;

/// Who is whose courses are laid below those that have none of their own: the same at every y.
const MODEL: &str = "TerrainWalker2d-v0";
/// Who is led, and who is built against, if nobody says otherwise.
pub const LED: &str = "AntController-v0";
/// See there.
pub const BUILT_AGAINST: &str = "TerrainWalker2d-v0";
/// The course that the builder's steps make.
pub const BUILT: &str = "adversary";
/// What courses are like if nobody says otherwise.
const KIND: &str = "mixed";
const DIFFICULTY: f64 = 0.5;

/// What the player does on an assault course.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// Looks on: the policy runs.
    #[default]
    Watch,
    /// Leads the runner, by stick or arrow keys.
    Run,
    /// Builds the ground ahead of the policy, by mouse or keys.
    Build,
}

impl Part {
    /// All of them.
    pub const ALL: [Part; 3] = [Part::Watch, Part::Run, Part::Build];

    /// What it is called on the screen, on the command line and in the table.
    pub fn name(self) -> &'static str {
        match self {
            Part::Watch => "watch",
            Part::Run => "run",
            Part::Build => "build",
        }
    }
}

/// An assault course, and the player's part.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// What the player does.
    pub part: Part,
    /// What the ground is made of, as the tasks on courses name it; a builder's is made of steps.
    pub kind: String,
    /// How difficult it is, 0 to 1.
    pub difficulty: f64,
}

impl Default for Choice {
    fn default() -> Self {
        Choice { part: Part::Watch, kind: KIND.into(), difficulty: DIFFICULTY }
    }
}

/// What a character on a course is given.
pub struct Equipment {
    /// The course, if the task has none.
    pub laid: Option<LaidGround>,
    /// To stand, for a start.
    pub command: Option<AgentCommand>,
    /// The builder's action.
    pub held: Option<Held>,
}

impl Choice {
    /// What a command line asks for.
    ///
    /// # Errors
    /// If it does so in another mode, or the difficulty is not from 0 to 1.
    pub fn of(args: &Args) -> Result<Self, GameError> {
        let named = [
            ("course", args.course.is_some()),
            ("difficulty", args.difficulty.is_some()),
            ("part", args.part.is_some()),
        ];
        if let Some((name, _)) = named.iter().find(|(_, given)| *given && args.mode != Mode::Course) {
            let problem =
                format!("goes with --mode course alone; a task that has such an argument takes --option {name}=VALUE");
            return Err(RunError::option(name, problem).into());
        }
        let own = Choice::default();
        let difficulty = args.difficulty.unwrap_or(own.difficulty);
        if !(0.0..=1.0).contains(&difficulty) {
            return Err(
                RunError::option("difficulty", format!("is {difficulty}, expected a number from 0 to 1")).into()
            );
        }
        Ok(Choice { part: args.part.unwrap_or_default(), kind: args.course.clone().unwrap_or(own.kind), difficulty })
    }

    /// Takes over what somebody has chosen as arguments of the task.
    pub fn take_from(&mut self, options: &Options) {
        if let Some(Value::Text(kind)) = options.get("course") {
            self.kind.clone_from(kind);
        }
        if let Some(Value::Number(difficulty)) = options.get("difficulty") {
            self.difficulty = difficulty.clamp(0.0, 1.0);
        }
    }

    /// What the ground is made of.
    pub fn kind(&self) -> &str {
        if self.part == Part::Build { BUILT } else { &self.kind }
    }

    /// A task on this course, if it takes one: as difficult as said in every episode, unless somebody has chosen otherwise.
    pub fn applied(&self, mut setting: Setting, chosen: Option<&Setting>) -> Setting {
        if has_own(&setting.agent) {
            setting.options.set("course", self.kind());
            setting.options.set("difficulty", self.difficulty);
            if chosen.is_none_or(|chosen| chosen.options.get("levels").is_none()) {
                setting.options.set("levels", "fixed");
            }
        }
        setting
    }

    /// How far ahead of a runner the camera looks, and from where, m, if it is usually that far away: what comes is to be seen, and
    /// for who builds that is the site.
    pub fn view(&self, usual: f32) -> (f32, f32) {
        match self.part {
            Part::Build => (3.2, usual.max(9.5)),
            Part::Watch | Part::Run => (1.2, 1.4 * usual),
        }
    }

    /// What a character gets beside its task.
    ///
    /// # Errors
    /// If there is no such course.
    pub fn equipment(&self, seed: u64, ground: Ground, spec: &Spec) -> Result<Equipment, RunError> {
        let laid = if ground == Ground::Track { Some(LaidGround(Arc::new(self.elevations(seed)?))) } else { None };
        let stand = || AgentCommand(Some(spec.command.iter().map(CommandRange::rest).collect()));
        let command = (self.part == Part::Run && !spec.command.is_empty()).then(stand);
        let held = (self.part == Part::Build).then(|| Held(vec![None; spec.act]));
        Ok(Equipment { laid, command, held })
    }

    /// The course of a seed: the one that its first Walker would have in its first episode.
    fn elevations(&self, seed: u64) -> Result<Vec<f32>, RunError> {
        let mut setting = Setting::named(MODEL)?;
        setting.options.set("course", self.kind());
        setting.options.set("difficulty", self.difficulty);
        let mut env = setting.vec_env(&VecEnvOptions { agents: 1, seed, ..VecEnvOptions::default() })?;
        let mut obs = vec![0.0_f32; env.spec().obs];
        env.reset(Some(seed), &mut obs)?;
        Ok(env.ground(0, 0)?)
    }
}

/// Whether the task of an agent has courses of its own.
pub fn has_own(agent: &str) -> bool {
    registry::agent(agent).is_ok_and(|agent| agent.has_option("course"))
}

/// Refuses an agent that cannot do the player's part on a course.
///
/// # Errors
/// If it cannot; the text names one that can.
pub fn check(choice: &Choice, setting: &Setting) -> Result<(), RunError> {
    let (agent, own) = (&setting.agent, has_own(&setting.agent));
    match choice.part {
        Part::Run if setting.factory()?.spec().command.is_empty() => {
            let problem = format!("run is for agents that take commands, {agent} takes none; {LED} does");
            Err(RunError::option("part", problem))
        }
        Part::Build if !own => {
            let problem =
                format!("build is for tasks with courses of their own, {agent} has none; {BUILT_AGAINST} has");
            Err(RunError::option("part", problem))
        }
        _ if !own && choice.kind() == BUILT => {
            let problem =
                format!("{BUILT} is for tasks with courses of their own, {agent} has none; {BUILT_AGAINST} has");
            Err(RunError::option("course", problem))
        }
        // the tasks know which courses there are, and the ground whose floor it can replace
        _ if !own => {
            Ground::Track.agent_with(agent, &setting.options)?;
            choice.elevations(0).map(drop)
        }
        _ => setting.factory().map(drop),
    }
}

/// Whether an agent with the policy that comes with it can do the player's part on a show's course.
pub fn suits(show: &Show, agent: &str) -> bool {
    let mut other = show.clone();
    (other.agent, other.source) = (agent.into(), Source::Shipped);
    other.setting().is_ok_and(|setting| check(&other.course, &setting).is_ok())
}

/// Another agent, if the one of a show cannot do the player's part.
pub fn suit(show: &mut Show) {
    let able = show.setting().is_ok_and(|setting| check(&show.course, &setting).is_ok());
    if !able {
        show.agent = if show.course.part == Part::Run { LED.into() } else { BUILT_AGAINST.into() };
        show.play(Source::Shipped);
    }
}

/// The rows of the menu.
pub fn choose(ui: &mut Ui, show: &mut Show) {
    ui.label("You");
    ui.horizontal(|ui| {
        let before = show.course.part;
        for part in Part::ALL {
            ui.selectable_value(&mut show.course.part, part, part.name());
        }
        if show.course.part != before {
            suit(show);
        }
    });
    ui.end_row();
    if show.course.part != Part::Build {
        ui.label("Course");
        ComboBox::from_id_salt("course").selected_text(show.course.kind.as_str()).width(230.0).show_ui(ui, |ui| {
            for (_, name) in Kind::NAMED {
                ui.selectable_value(&mut show.course.kind, (*name).to_string(), *name);
            }
        });
        ui.end_row();
    }
    ui.label("Difficulty");
    ui.add(Slider::new(&mut show.course.difficulty, 0.0..=1.0).step_by(0.05));
    ui.end_row();
}
