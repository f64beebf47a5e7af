//! What is on stage: which characters, moved by what, and who of them is in focus.

use crate::app::args::{Args, Mode};
use crate::app::course::{self, Choice};
use crate::app::error::GameError;
use crate::app::imitate::{FOLLOWER, follows_clip};
use crate::app::notes::Notes;
use crate::app::policies::{read_opponent, read_policy, shipped};
use crate::asset::{PolicyAsset, RagdollPrefab};
use crate::ground::Ground;
use crate::herd::part_of;
use crate::look::{FollowCamera, Marks, Tint};
use crate::ragdoll::{AgentCommand, Anatomy, Held, LaidGround, Opponent, Policy, Ragdoll, Restart};
use bevy::prelude::*;
use marathon_envs::registry;
use marathon_physics::Model;
use marathon_physics::hint::nearest;
use marathon_render::Scene;
use marathon_runs::folder::policy_path;
use marathon_runs::{Flags, RunError, Setting, policy_file};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

/// Ragdolls side by side before the next row begins behind.
const ROW: usize = 16;
/// Distance between rows, m.
const ROW_SPACING: f32 = 4.0;
/// Seconds between looks at a policy's file.
const WATCH: f32 = 0.5;
/// Seconds that a fallen character lies when somebody looks on.
const LIE: f64 = 1.2;

/// What is on stage. Who changes it calls [`Show::again`].
#[derive(Resource, Clone, Debug)]
pub struct Show {
    /// What is done with the characters.
    pub mode: Mode,
    /// Registry name of the agent; unused by the test bed.
    pub agent: String,
    /// Arguments of its task that somebody has chosen, over those that the policy notes. Those of another agent do not count.
    pub chosen: Setting,
    /// What moves them.
    pub source: Source,
    /// How many.
    pub agents: usize,
    /// What they run on; unused by the test bed and on assault courses.
    pub ground: Ground,
    /// The assault course, and what the player does there.
    pub course: Choice,
    /// Seed of their starts.
    pub seed: u64,
    /// Model of the test bed.
    pub model: Option<PathBuf>,
    /// Raised when the stage is to be set anew.
    pub(super) version: u64,
}

/// What moves the characters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// The policy that comes with the agent.
    Shipped,
    /// A file, read again when it changes.
    File(PathBuf),
    /// The trainer in the window.
    Trainer,
    /// Nothing.
    Nothing,
}

/// A character of the show, and its number.
#[derive(Component, Clone, Copy, Debug)]
pub struct Actor(pub usize);

/// Number of the character that the camera follows.
#[derive(Resource, Default)]
pub struct Focus(pub usize);

/// The policy of the show, and when its file was written.
#[derive(Resource, Default)]
pub struct Script {
    /// The asset that all actors have.
    pub policy: Option<Handle<PolicyAsset>>,
    /// The task on stage.
    pub setting: Setting,
    /// What it stands on.
    pub ground: Ground,
    /// The policies of the task's roles, by file and checksum.
    pub names: [Option<String>; 2],
    /// The version of the current show.
    pub(super) version: u64,
    written: Option<SystemTime>,
    looked: f32,
}

impl Show {
    /// What a command line asks for.
    ///
    /// # Errors
    /// If there is no such agent, file or policy.
    pub fn of(args: &Args) -> Result<Self, GameError> {
        let mut show = Show {
            mode: args.mode,
            agent: String::new(),
            chosen: Setting::default(),
            source: Source::Shipped,
            agents: usize::from(args.agents),
            ground: args.ground.into(),
            course: Choice::of(args)?,
            seed: args.seed(),
            model: None,
            version: 1,
        };
        let path = Path::new(&args.what);
        let is_model = path.extension().is_some_and(|e| e == "xml" || e == "mjcf");
        let given = match (&args.policy, registry::agent(&args.what)) {
            (_, Ok(agent)) => {
                show.agent = agent.facts().id;
                args.policy.clone()
            }
            (_, Err(_)) if is_model => {
                exists(path)?;
                Model::from_xml_file(path).map_err(Box::new)?;
                (show.mode, show.model, show.source) = (Mode::Testbed, Some(path.into()), Source::Nothing);
                show.agent = "hopper".into();
                if !args.task.given.is_empty() {
                    return Err(RunError::option("option", "is for tasks, and a model of the test bed has none").into());
                }
                return Ok(show);
            }
            (None, Err(_)) if path.exists() || args.what.contains(['/', '.']) => Some(path.to_path_buf()),
            // neither an agent nor a file: the registry's message names the nearest agent
            (_, Err(error)) => return Err(error.into()),
        };
        if let Some(given) = given {
            if show.agent.is_empty() {
                let name = match policy_file::task_of(&given)? {
                    Some(noted) => noted.agent,
                    None => policy_file::read(&given, None)?.meta().agent.clone(),
                };
                show.agent = registry::agent(&name)?.facts().id;
            }
            show.source = Source::File(policy_path(&given)?);
        }
        if show.mode == Mode::Imitate && !follows_clip(&show.agent) {
            let problem = format!(
                "imitate is for agents that follow a motion clip, {} follows none; {FOLLOWER} does",
                show.agent
            );
            return Err(RunError::option("mode", problem).into());
        }
        show.chosen = Setting::named(&show.agent)?.with(&args.task)?;
        if show.mode == Mode::Course {
            show.course.take_from(&show.chosen.options);
        }
        let setting = show.setting()?;
        if show.mode == Mode::Course {
            course::check(&show.course, &setting)?;
        }
        match &show.source {
            Source::File(path) => drop(policy_file::read(path, part_of(setting.factory()?.spec(), 0).as_ref())?),
            _ if !args.task.given.is_empty() => drop(setting.factory()?),
            _ => {}
        }
        if show.mode == Mode::Learn {
            show.play(Source::Trainer);
        }
        Ok(show)
    }

    /// The task: with the arguments that the policy notes, and over them those that somebody has chosen.
    ///
    /// # Errors
    /// If there is no such agent, or the policy's file cannot be read.
    pub fn setting(&self) -> Result<Setting, RunError> {
        let named = Setting::named(&self.agent)?;
        let noted = match &self.source {
            Source::File(path) => policy_file::task_of(path)?,
            Source::Shipped => shipped(&self.agent).map(|policy| Setting::of(policy.meta())),
            Source::Trainer | Source::Nothing => None,
        };
        let noted = noted.filter(|noted| noted.agent == named.agent).unwrap_or(named);
        let chosen = Some(&self.chosen).filter(|chosen| chosen.agent == noted.agent);
        let setting = chosen.map_or_else(|| noted.clone(), |chosen| noted.clone().overlaid(chosen));
        Ok(match self.mode {
            Mode::Course => self.course.applied(setting, chosen),
            _ => setting,
        })
    }

    /// What the characters stand on.
    pub fn stands_on(&self) -> Ground {
        match self.mode {
            Mode::Course if course::has_own(&self.agent) => Ground::Level,
            Mode::Course => Ground::Track,
            _ => self.ground,
        }
    }

    /// Lets something else move the characters: a file in its own task, anything else in the present one.
    pub fn play(&mut self, source: Source) {
        self.chosen = match source {
            Source::File(_) => Setting::default(),
            // a file that can no longer be read has no task to keep
            _ => self.setting().unwrap_or_default(),
        };
        self.source = source;
    }

    /// Sets the stage anew.
    pub fn again(&mut self) {
        self.version += 1;
    }
}

/// Refuses a file that is not there.
///
/// # Errors
/// If there is no such file; the error names one with a similar name.
pub fn exists(path: &Path) -> Result<(), GameError> {
    if path.exists() {
        return Ok(());
    }
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut others: Vec<String> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    // the first of several that are as near; folders have no order
    others.sort();
    let nearest = nearest(&name, others.iter().map(String::as_str));
    let nearest = nearest.map(|other| folder.join(other).display().to_string());
    Err(GameError::Missing { path: path.into(), nearest })
}

/// What files about an agent are called: its name without the version.
pub fn file_stem(agent: &str) -> String {
    agent.split("-v").next().unwrap_or(agent).to_lowercase()
}

/// The first of `stem-1.extension`, `stem-2.extension` and so on that is not there yet.
pub fn free_name(stem: &str, extension: &str) -> PathBuf {
    let mut number = 1;
    loop {
        let path = PathBuf::from(format!("{stem}-{number}.{extension}"));
        if !path.exists() {
            return path;
        }
        number += 1;
    }
}

/// Where character `i` stands: in rows, or side by side on tracks that are not level.
pub fn place(i: usize, spacing: f32, level: bool) -> Vec3 {
    if !level {
        return Vec3::new(0.0, 0.0, -spacing * i as f32);
    }
    Vec3::new(-ROW_SPACING * (i / ROW) as f32, 0.0, -spacing * (i % ROW) as f32)
}

/// Sets the stage when the show has changed.
#[expect(clippy::too_many_arguments, reason = "a system names what it uses")]
pub fn set_stage(
    mut commands: Commands,
    show: Res<Show>,
    mut staged: Local<u64>,
    mut focus: ResMut<Focus>,
    mut script: ResMut<Script>,
    mut notes: ResMut<Notes>,
    mut policies: ResMut<Assets<PolicyAsset>>,
    mut prefabs: ResMut<Assets<RagdollPrefab>>,
    actors: Query<Entity, With<Actor>>,
    mut cameras: Query<&mut FollowCamera>,
) {
    if *staged == show.version {
        return;
    }
    *staged = show.version;
    actors.iter().for_each(|actor| commands.entity(actor).despawn());
    focus.0 = 0;
    *script = Script { version: show.version, ..default() };
    if matches!(show.mode, Mode::Replay | Mode::Outside) {
        return;
    }
    let testbed = show.mode == Mode::Testbed;
    let model = match show.model.as_ref().filter(|_| testbed) {
        Some(path) => Model::from_xml_file(path).map_err(|e| e.to_string()),
        None => show
            .setting()
            .and_then(|setting| {
                if show.mode == Mode::Course {
                    course::check(&show.course, &setting)?;
                }
                script.setting = setting;
                body(&script.setting)
            })
            .map_err(|e| e.spelled(&Flags("marathon"))),
    };
    script.ground = show.stands_on();
    let model = match model {
        Ok(model) => Arc::new(model),
        Err(error) => return notes.error(error),
    };
    let ragdoll = if testbed {
        Ragdoll::prefab(prefabs.add(RagdollPrefab { model: model.clone() }))
    } else {
        Ragdoll::agent(&show.agent).on(script.ground).with_setting(script.setting.clone())
    };
    match read_policy(&show, &script.setting) {
        Ok(Some((policy, name))) => {
            script.policy = Some(policies.add(policy));
            script.names[0] = Some(name);
        }
        Ok(None) if show.mode == Mode::Imitate && show.source == Source::Shipped => {
            notes.say(format!("no policy comes with {}: its servos alone follow the clip; learn live (L)", show.agent));
        }
        Ok(None) => {}
        Err(text) => notes.error(text),
    }
    let mut opponent = None;
    match read_opponent(&show, &script.setting) {
        Ok(Some((policy, name))) => {
            opponent = Some(policies.add(policy));
            script.names[1] = Some(name);
        }
        Ok(None) => {}
        Err(text) => notes.error(text),
    }
    let (mut laid, mut command, mut held) = (None, None, None);
    if show.mode == Mode::Course {
        match script
            .setting
            .factory()
            .and_then(|factory| show.course.equipment(show.seed, script.ground, factory.spec()))
        {
            Ok(equipment) => (laid, command, held) = (equipment.laid, equipment.command, equipment.held),
            Err(error) => return notes.error(error.spelled(&Flags("marathon"))),
        }
    }
    if let Source::File(path) = &show.source {
        script.written = written(path);
    }
    if show.source == Source::Trainer {
        // the trainer puts its policies here
        script.policy = Some(policies.reserve_handle());
    }
    let scene = Scene::new(&model);
    let (spacing, radius) = (scene.spacing() as f32, scene.radius() as f32);
    let level = script.ground == Ground::Level && model.hfields.is_empty();
    let after_fall = if show.mode == Mode::Learn { 0.0 } else { LIE };
    for i in 0..if testbed { 1 } else { show.agents } {
        let mut actor = commands.spawn((
            Actor(i),
            ragdoll.clone().with_seed(show.seed, i as u64),
            // a referee ends runs of tasks that know nothing of courses
            Restart { after_fall, on_time_up: script.ground != Ground::Track },
            Transform::from_translation(place(i, spacing, level)),
            Marks::default(),
        ));
        if i > 0 {
            actor.insert(Tint::of_row(i));
        }
        if let Some(policy) = &script.policy {
            actor.insert(Policy(policy.clone()));
        }
        if let Some(opponent) = &opponent {
            actor.insert(Opponent(opponent.clone()));
        }
        if let Some(laid) = &laid {
            actor.insert(LaidGround::clone(laid));
        }
        if let Some(command) = &command {
            actor.insert(AgentCommand::clone(command));
        }
        if let Some(held) = &held {
            actor.insert(Held::clone(held));
        }
    }
    for mut camera in &mut cameras {
        let crowd = (show.agents.min(ROW) as f32 - 1.0) * spacing * 0.28;
        camera.goal[2] = 3.1 * radius + crowd + 0.6;
        camera.ahead = 0.0;
        if show.mode == Mode::Course {
            (camera.ahead, camera.goal[2]) = show.course.view(camera.goal[2]);
        }
        camera.goal[1] = if show.agents > 1 { 0.32 } else { 0.16 };
        camera.jump();
    }
    let who = if testbed { &model.name } else { &show.agent };
    info!("on stage: {} of {who} ({})", show.agents, show.mode.name());
}

/// The body of a task.
fn body(setting: &Setting) -> Result<Model, RunError> {
    setting.with_clips(|| Ok(registry::agent(&setting.agent)?.with_options(&setting.options)?.model()?))
}

fn written(path: &Path) -> Option<SystemTime> {
    std::fs::metadata(path).and_then(|m| m.modified()).ok()
}

/// Reads the policy's file again when it has changed.
pub fn reload(
    time: Res<Time<Real>>,
    mut show: ResMut<Show>,
    mut script: ResMut<Script>,
    mut policies: ResMut<Assets<PolicyAsset>>,
    mut notes: ResMut<Notes>,
) {
    let Source::File(path) = &show.source else { return };
    script.looked += time.delta_secs();
    if script.looked < WATCH {
        return;
    }
    script.looked = 0.0;
    let now = written(path);
    if now.is_none() || now == script.written {
        return;
    }
    script.written = now;
    // one of another run may have been trained for another clip
    if show.setting().is_ok_and(|setting| setting != script.setting) {
        show.again();
        return;
    }
    match read_policy(&show, &script.setting) {
        Ok(Some((policy, name))) => {
            script.names[0] = Some(name);
            let steps = policy.0.meta().training.as_ref().map(|t| t.steps);
            if let Some(handle) = &script.policy {
                let _ = policies.insert(handle.id(), policy);
            }
            let steps = steps.map(|s| format!(" ({:.1} million steps)", s as f64 / 1e6)).unwrap_or_default();
            notes.say(format!("the policy has changed{steps}"));
        }
        Ok(None) => {}
        // half a file, perhaps; the next look finds the whole
        Err(text) => notes.error(text),
    }
}

/// Points the camera at the focus and marks it.
pub fn follow_focus(
    focus: Res<Focus>,
    actors: Query<(Entity, &Actor)>,
    mut cameras: Query<&mut FollowCamera>,
    mut marks: Query<(&Actor, &mut Marks)>,
) {
    let target = actors.iter().find(|(_, actor)| actor.0 == focus.0).map(|(entity, _)| entity);
    for mut camera in &mut cameras {
        if camera.target != target {
            camera.target = target;
        }
    }
    let several = actors.iter().count() > 1;
    for (actor, mut marks) in &mut marks {
        let ring = several && actor.0 == focus.0;
        if marks.ring != ring {
            marks.ring = ring;
        }
    }
}

/// Which marks are drawn about the focus.
#[derive(Resource, Clone, Copy, Debug, Default)]
pub struct Shown {
    /// Contacts and forces.
    pub contacts: bool,
    /// Joints and limits.
    pub joints: bool,
}

/// Draws the marks about the focus alone: one probe is cheap, a crowd of arrows tells nothing.
pub fn show_marks(shown: Res<Shown>, focus: Res<Focus>, mut actors: Query<(&Actor, &mut Marks), With<Anatomy>>) {
    for (actor, mut marks) in &mut actors {
        let on = actor.0 == focus.0;
        let Shown { contacts, joints } = *shown;
        let wanted = Marks { contacts: on && contacts, joints: on && joints, ring: marks.ring, command: on };
        if *marks != wanted {
            *marks = wanted;
        }
    }
}
