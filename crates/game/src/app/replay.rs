//! Recordings of runs: states per decision, in a file that can be shown again, scrubbed and filmed.

use crate::app::args::Mode;
use crate::app::error::GameError;
use crate::app::hud::card;
use crate::app::keys::{Deed, Do};
use crate::app::notes::Notes;
use crate::app::puppets::{self, Kind};
use crate::app::show::{Actor, Script, Show, file_stem, free_name};
use crate::ground::Ground;
use crate::look::FollowCamera;
use crate::ragdoll::{Anatomy, Episode, Part};
use crate::simulate::{Marathon, Seat};
use crate::stage;
use bevy::prelude::*;
use bevy_egui::EguiContexts;
use bevy_egui::egui::{Align2, Area, Id, Slider};
use marathon_physics::Model;
use marathon_runs::Setting;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use serde_json::Value;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// Kind of file: the key of the JSON document in its header.
const FORMAT: &str = "marathon-replay";
/// Numbers per agent and frame besides the configuration: distance, speed, reward, return, and whether an episode begins.
const NUMBERS: usize = 5;
/// Seconds that the keys go back and ahead.
const LEAP: f64 = 0.5;
/// Longest recording, frames.
const LONGEST: usize = 60_000;

/// A recorded run.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// The task.
    pub setting: Setting,
    /// What it ran on.
    pub ground: Ground,
    /// Seconds between frames.
    pub dt: f64,
    /// Number of agents.
    pub agents: usize,
    /// Where their tracks begin, `[agents][3]`.
    pub places: Vec<f32>,
    /// Configurations, `[frames][agents][nq]`.
    qpos: Vec<f32>,
    /// See [`NUMBERS`], `[frames][agents][5]`.
    numbers: Vec<f32>,
    /// Terms of the reward, `[frames][agents][terms]`.
    terms: Vec<f32>,
}

impl Recording {
    fn new(setting: Setting, ground: Ground, dt: f64, places: Vec<f32>) -> Self {
        let agents = places.len() / 3;
        Recording { setting, ground, dt, agents, places, qpos: Vec::new(), numbers: Vec::new(), terms: Vec::new() }
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.numbers.len() / (NUMBERS * self.agents.max(1))
    }

    /// Length, s.
    pub fn seconds(&self) -> f64 {
        self.frames().saturating_sub(1) as f64 * self.dt
    }

    fn row<'a>(&self, rows: &'a [f32], frame: usize, agent: usize) -> &'a [f32] {
        let columns = rows.len() / (self.frames() * self.agents).max(1);
        let first = (frame * self.agents + agent) * columns;
        &rows[first..first + columns]
    }

    /// The configuration of an agent at a time.
    pub fn pose(&self, model: &Model, agent: usize, seconds: f64) -> Vec<f64> {
        let (a, b, share) = self.between(seconds);
        let wide = |frame| self.row(&self.qpos, frame, agent).iter().map(|x| f64::from(*x)).collect::<Vec<f64>>();
        let fresh = self.row(&self.numbers, b, agent)[4] > 0.5;
        if a == b || fresh {
            wide(if share < 1.0 { a } else { b })
        } else {
            stage::mix(model, &wide(a), &wide(b), share)
        }
    }

    fn between(&self, seconds: f64) -> (usize, usize, f64) {
        let last = self.frames().saturating_sub(1);
        let at = (seconds / self.dt).clamp(0.0, last as f64);
        let a = at.floor() as usize;
        (a, (a + 1).min(last), at - a as f64)
    }

    /// Writes the recording.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), GameError> {
        let bytes = |x: &[f32]| x.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        let (frames, agents) = (self.frames(), self.agents);
        let columns = |x: &[f32]| x.len() / (frames * agents).max(1);
        let tensors = [
            ("places", vec![agents, 3], bytes(&self.places)),
            ("qpos", vec![frames, agents, columns(&self.qpos)], bytes(&self.qpos)),
            ("numbers", vec![frames, agents, NUMBERS], bytes(&self.numbers)),
            ("terms", vec![frames, agents, columns(&self.terms)], bytes(&self.terms)),
        ];
        let broken = |problem: String| GameError::Replay { path: path.into(), problem };
        let mut views = Vec::new();
        for (name, shape, data) in &tensors {
            views.push((*name, TensorView::new(Dtype::F32, shape.clone(), data).map_err(|e| broken(e.to_string()))?));
        }
        // one entry, because several would be written in any order
        let about = serde_json::json!({
            "agent": self.setting.agent, "ground": self.ground.name(), "dt": self.dt, "task": self.setting,
        });
        let meta = HashMap::from([(FORMAT.to_string(), about.to_string())]);
        let file = safetensors::serialize(views, Some(meta)).map_err(|e| broken(e.to_string()))?;
        marathon_learn::write_atomic(path, &file)?;
        Ok(())
    }

    /// Reads a recording.
    ///
    /// # Errors
    /// If the file is not a whole recording of an agent that is known here.
    pub fn load(path: &Path) -> Result<Self, GameError> {
        crate::app::show::exists(path)?;
        let bad = |problem: String| GameError::Replay { path: path.into(), problem };
        let bytes = std::fs::read(path).map_err(|e| bad(format!("cannot be read: {e}")))?;
        let no_recording = |e: &dyn std::fmt::Display| bad(format!("not a recording of the game ({e})"));
        let (_, header) = SafeTensors::read_metadata(&bytes).map_err(|e| no_recording(&e))?;
        let meta = header.metadata().clone().unwrap_or_default();
        let Some(about) = meta.get(FORMAT).and_then(|text| serde_json::from_str::<Value>(text).ok()) else {
            return Err(bad("not a recording of the game, which writes such files by the key R".into()));
        };
        let file = SafeTensors::deserialize(&bytes).map_err(|e| no_recording(&e))?;
        // older recordings have the agent alone
        let setting = match &about["task"] {
            Value::Null => Setting::named(about["agent"].as_str().unwrap_or_default())?,
            task => serde_json::from_value(task.clone()).map_err(|e| bad(format!("its task cannot be read: {e}")))?,
        };
        let spec = setting.factory()?.spec().clone();
        let found = about["ground"].as_str().unwrap_or_default();
        let ground = Ground::named(found).ok_or_else(|| {
            let known = Ground::ALL.map(Ground::name).join(", ");
            bad(format!("its ground is '{found}', expected one of: {known}"))
        })?;
        let dt = about["dt"].as_f64().filter(|dt| *dt > 0.0 && dt.is_finite());
        let dt = dt.ok_or_else(|| bad("it has no 'dt', expected the seconds between its frames".into()))?;
        let read = |name: &str, columns: usize| -> Result<(usize, usize, Vec<f32>), GameError> {
            let tensor = file.tensor(name).map_err(|e| bad(e.to_string()))?;
            let shape = tensor.shape();
            let (frames, agents, found) = match *shape {
                [a, b] => (1, a, b),
                [f, a, b] => (f, a, b),
                _ => (0, 0, 0),
            };
            if tensor.dtype() != Dtype::F32 || found != columns || frames == 0 || agents == 0 {
                return Err(bad(format!("tensor '{name}' has the shape {shape:?}, expected {columns} columns of f32")));
            }
            let numbers: Vec<f32> = tensor.data().as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
            match numbers.iter().position(|x| !x.is_finite()) {
                Some(i) => Err(bad(format!("tensor '{name}', number {i} is {}, expected a finite number", numbers[i]))),
                None => Ok((frames, agents, numbers)),
            }
        };
        let (_, agents, places) = read("places", 3)?;
        let (frames, with_poses, qpos) = read("qpos", spec.nq)?;
        let (others, with_numbers, numbers) = read("numbers", NUMBERS)?;
        let (more, with_terms, terms) = read("terms", spec.reward_terms.len())?;
        if [with_poses, with_numbers, with_terms] != [agents; 3] || [others, more] != [frames; 2] {
            return Err(bad("its tensors are about different numbers of agents or frames".into()));
        }
        Ok(Recording { setting, ground, dt, agents, places, qpos, numbers, terms })
    }
}

/// A recording that is being made.
#[derive(Resource)]
pub struct Recorder {
    recording: Recording,
    /// Time of the newest frame.
    until: Duration,
}

impl Recorder {
    /// Length so far, s.
    pub fn seconds(&self) -> f64 {
        self.recording.seconds()
    }
}

/// A recording that is being shown.
#[derive(Resource)]
pub struct Playback {
    recording: Arc<Recording>,
    kind: Kind,
    /// Time of the picture, s.
    pub at: f64,
    staged: bool,
}

impl Playback {
    /// Shows a recording from its start.
    ///
    /// # Errors
    /// If its agent is not known here.
    pub fn new(recording: Recording) -> Result<Self, GameError> {
        let Setting { agent, options, .. } = &recording.setting;
        let make = || -> Result<_, GameError> { Ok(recording.ground.agent_with(agent, options)?.model()?) };
        let model = Arc::new(recording.setting.with_clips(make)?);
        let spec = Arc::new(recording.setting.factory()?.spec().clone());
        let kind = Kind::new(model, Some(spec), recording.dt);
        Ok(Playback { recording: Arc::new(recording), kind, at: 0.0, staged: false })
    }
}

/// Begins and ends recordings.
pub fn obey(
    mut commands: Commands,
    mut deeds: MessageReader<Do>,
    (show, script): (Res<Show>, Res<Script>),
    recorder: Option<Res<Recorder>>,
    mut notes: ResMut<Notes>,
    actors: Query<(&Actor, &Anatomy, &Transform), With<Seat>>,
) {
    for _ in deeds.read().filter(|d| d.0 == Deed::Record) {
        if let Some(recorder) = &recorder {
            commands.remove_resource::<Recorder>();
            match keep(&recorder.recording) {
                Ok(path) => {
                    let (path, film) = (path.display().to_string(), path.with_extension("mp4").display().to_string());
                    notes.say(format!("saved as {path}; a film of it: marathon-game --replay {path} --record {film}"));
                }
                Err(error) => notes.error(error.to_string()),
            }
            continue;
        }
        if matches!(show.mode, Mode::Testbed | Mode::Replay | Mode::Outside) {
            notes.say("only agents can be recorded");
            continue;
        }
        let mut all: Vec<_> = actors.iter().collect();
        all.sort_by_key(|(actor, ..)| actor.0);
        let Some((_, anatomy, _)) = all.first() else { continue };
        let places = all.iter().flat_map(|(.., t)| t.translation.to_array()).collect();
        let recording = Recording::new(script.setting.clone(), show.ground, anatomy.dt, places);
        commands.insert_resource(Recorder { recording, until: Duration::ZERO });
        notes.say("recording; the same key ends it");
    }
}

/// Saves under the first free name.
fn keep(recording: &Recording) -> Result<PathBuf, GameError> {
    let path = free_name(&file_stem(&recording.setting.agent), "replay");
    recording.save(&path)?;
    Ok(path)
}

/// Takes in the decisions since the last tick.
pub fn record(
    recorder: Option<ResMut<Recorder>>,
    marathon: Res<Marathon>,
    actors: Query<(&Actor, &Seat, &Episode), With<Anatomy>>,
) {
    let Some(mut recorder) = recorder else { return };
    let mut all: Vec<_> = actors.iter().collect();
    all.sort_by_key(|(actor, ..)| actor.0);
    let Recorder { recording, until } = &mut *recorder;
    if all.len() != recording.agents || recording.frames() >= LONGEST {
        return;
    }
    let trails: Vec<_> = all.iter().filter_map(|(_, seat, _)| marathon.resident(**seat)).map(|r| &r.trail).collect();
    let Some(first) = trails.first() else { return };
    let times: Vec<Duration> = first.iter().map(|s| s.time).filter(|t| *t > *until).collect();
    for time in times {
        let stills: Option<Vec<_>> = trails.iter().map(|t| t.iter().rfind(|s| s.time == time)).collect();
        let Some(stills) = stills else { continue };
        *until = time;
        for (still, (_, _, episode)) in stills.iter().zip(&all) {
            recording.qpos.extend(still.qpos.iter().map(|x| *x as f32));
            let fresh = if still.fresh { 1.0 } else { 0.0 };
            let numbers = [episode.distance as f32, episode.speed, episode.reward, episode.total as f32, fresh];
            recording.numbers.extend(numbers);
            recording.terms.extend(&episode.terms);
            // before the first decision there are none
            let columns = recording.numbers.len() / NUMBERS;
            let terms = all.iter().map(|(.., e)| e.terms.len()).max().unwrap_or(0);
            recording.terms.resize(columns * terms, 0.0);
        }
    }
}

/// Puts the recorded characters on stage.
pub fn set_stage(mut commands: Commands, playback: Option<ResMut<Playback>>, mut cameras: Query<&mut FollowCamera>) {
    let Some(mut playback) = playback.filter(|p| !p.staged) else { return };
    playback.staged = true;
    let places = playback.recording.places.as_chunks::<3>().0.iter().map(|place| Vec3::from_array(*place));
    puppets::stage(&mut commands, &playback.kind, places, &mut cameras);
}

/// Moves the recorded characters.
pub fn play(
    playback: Option<ResMut<Playback>>,
    time: Res<Time<Virtual>>,
    mut puppets: Query<(&Actor, &Anatomy, &mut Episode), Without<Seat>>,
    mut parts: Query<&mut Transform, With<Part>>,
) {
    let Some(mut playback) = playback else { return };
    let end = playback.recording.seconds();
    playback.at += time.delta_secs_f64();
    if playback.at > end {
        playback.at = 0.0;
    }
    let (recording, at) = (&playback.recording, playback.at);
    let (now, ..) = recording.between(at);
    for (actor, anatomy, mut episode) in &mut puppets {
        let qpos = recording.pose(&anatomy.model, actor.0, at);
        puppets::pose(anatomy, &qpos, &mut parts);
        let numbers = recording.row(&recording.numbers, now, actor.0);
        episode.number = 1;
        episode.decisions = now as u64;
        episode.seconds = at;
        episode.distance = f64::from(numbers[0]);
        (episode.speed, episode.reward, episode.total) = (numbers[1], numbers[2], f64::from(numbers[3]));
        episode.terms = recording.row(&recording.terms, now, actor.0).to_vec();
    }
}

/// Goes back and ahead, no further than the ends.
pub fn scrub(mut deeds: MessageReader<Do>, playback: Option<ResMut<Playback>>) {
    let Some(mut playback) = playback else {
        deeds.clear();
        return;
    };
    for Do(deed) in deeds.read() {
        let leap = match deed {
            Deed::Back => -LEAP,
            Deed::Ahead => LEAP,
            _ => continue,
        };
        playback.at = (playback.at + leap).clamp(0.0, playback.recording.seconds());
    }
}

/// The time line.
pub fn time_line(mut contexts: EguiContexts, playback: Option<ResMut<Playback>>) -> Result {
    let Some(mut playback) = playback else { return Ok(()) };
    let ctx = contexts.ctx_mut()?.clone();
    let width = (ctx.content_rect().width() * 0.4).max(120.0);
    Area::new(Id::new("time line")).anchor(Align2::CENTER_BOTTOM, [0.0, -48.0]).show(&ctx, |ui| {
        card().show(ui, |ui| {
            ui.spacing_mut().slider_width = width;
            let (mut at, end) = (playback.at, playback.recording.seconds());
            ui.add(Slider::new(&mut at, 0.0..=end.max(0.01)).suffix(" s").fixed_decimals(2));
            if at != playback.at {
                playback.at = at;
            }
        });
    });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Result<Recording, GameError> {
        let setting = Setting::named("hopper")?;
        let spec = setting.factory()?.spec().clone();
        let mut recording = Recording::new(setting, Ground::Level, spec.dt, vec![0.0, 0.0, 0.0, 0.0, 0.0, -2.0]);
        for frame in 0..5 {
            for agent in 0..2 {
                recording.qpos.extend((0..spec.nq).map(|i| (frame * 10 + agent * 100 + i) as f32));
                recording.numbers.extend([frame as f32, 1.0, 2.0, 3.0, if frame == 3 { 1.0 } else { 0.0 }]);
                recording.terms.extend(vec![0.5; spec.reward_terms.len()]);
            }
        }
        Ok(recording)
    }

    #[test]
    fn a_recording_is_read_as_it_was_written() -> Result<(), Box<dyn std::error::Error>> {
        let recording = sample()?;
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("a.replay");
        recording.save(&path)?;
        assert_eq!(Recording::load(&path)?, recording);
        let model = marathon_envs::agent("hopper")?.model()?;
        let pose = |seconds: f64| recording.pose(&model, 1, seconds)[0];
        assert_eq!((pose(0.0), pose(0.5 * recording.dt), pose(99.0)), (100.0, 105.0, 140.0));
        // frame 3 begins an episode: nothing lies between it and the one before
        assert_eq!(pose(2.5 * recording.dt), 120.0);
        Ok(())
    }

    #[test]
    fn what_is_no_recording_is_refused() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("b.replay");
        let whole = {
            sample()?.save(&path)?;
            std::fs::read(&path)?
        };
        let policy = include_bytes!("../../../../assets/policies/hopper.safetensors");
        for bytes in [&b""[..], b"{}", &whole[..whole.len() / 2], policy] {
            std::fs::write(&path, bytes)?;
            let error = Recording::load(&path).map(|_| ()).expect_err("it is no recording").to_string();
            assert!(error.contains("b.replay"), "{error}");
        }
        Ok(())
    }
}
