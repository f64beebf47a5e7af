//! Films of the last ten seconds: a key keeps them.
//!
//! The game remembers the exact states of the last seconds. A key writes them as a recording, and a second process of the game
//! draws it, so that this one does not stall. The film is an MP4 if `ffmpeg` is there, otherwise a GIF.

use crate::app::files::{file_stem, free_name};
use crate::app::input::actions::{Action, ActionPressed};
use crate::app::input::control::ControlSet;
use crate::app::mode::{AppSet, Mode};
use crate::app::notifications::Notifications;
use crate::app::stage::actors::Actor;
use crate::app::stage::loaded::LoadedPolicy;
use crate::app::stage::recording::Recording;
use crate::app::stage::recording::tape::Tape;
use crate::app::stage::scenario::LoadScenario;
use crate::app::stage::skin::SkinChoice;
use bevy::prelude::*;
use bevy_marathon::look::{CameraMode, FollowCamera};
use bevy_marathon::{Anatomy, Episode, Marathon, MarathonSystems, RagdollState, Track};
use std::ffi::OsString;
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread::JoinHandle;

/// Length of a film, s.
const SECONDS: f64 = 10.0;
/// Memory for the last seconds, bytes; crowds have shorter films.
const MEMORY: usize = 64 << 20;
/// Size and frames per second of an MP4 and of a GIF, whose frames are large.
const MP4: [&str; 2] = ["1280x720", "30"];
const GIF: [&str; 2] = ["480x270", "15"];

/// The program that draws films: this one, unless it is part of another.
#[derive(Resource, Clone, Debug, Default)]
pub struct FilmProgram(pub Option<PathBuf>);

/// The last seconds of the characters.
#[derive(Resource, Default)]
pub struct FilmReel {
    tape: Option<Tape>,
    /// Films that are being drawn.
    drawing: Vec<JoinHandle<Result<PathBuf, String>>>,
}

impl FilmReel {
    /// The recording of the last seconds, if there is one.
    pub fn last_seconds(&self) -> Option<Recording> {
        let mut recording = self.tape.as_ref()?.recording.clone();
        recording.drop_front(recording.frames().saturating_sub(most_frames(&recording)));
        (recording.frames() > 1).then_some(recording)
    }

    /// Whether a film is being drawn.
    pub fn is_drawing(&self) -> bool {
        !self.drawing.is_empty()
    }
}

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<FilmReel>()
        .init_resource::<FilmProgram>()
        .add_systems(
            Update,
            (
                keep.in_set(AppSet::Input).after(ControlSet),
                rewind.run_if(on_message::<LoadScenario>).in_set(AppSet::Simulate),
                report.in_set(AppSet::Present),
            ),
        )
        .add_systems(FixedUpdate, remember.after(MarathonSystems::Report));
}

/// Frames of a film.
fn most_frames(recording: &Recording) -> usize {
    (SECONDS / recording.dt).round() as usize + 1
}

/// Forgets the characters before.
fn rewind(mut reel: ResMut<FilmReel>) {
    reel.tape = None;
}

/// Appends the decisions since the last tick, and forgets those that are too old.
fn remember(
    mut reel: ResMut<FilmReel>,
    (mode, loaded): (Res<State<Mode>>, Res<LoadedPolicy>),
    marathon: Res<Marathon>,
    actors: Query<(&Actor, &RagdollState, &Episode, &Anatomy, &Track)>,
) {
    if *mode == Mode::Testbed {
        return;
    }
    let mut all: Vec<_> = actors.iter().collect();
    all.sort_by_key(|(actor, ..)| actor.0);
    let Some((.., anatomy, _)) = all.first() else { return };
    let tracks = all.iter().map(|(.., track)| track.place());
    let tape = reel.tape.get_or_insert_with(|| Tape::new(&loaded, anatomy.dt, tracks));
    let rows: Vec<_> = all.iter().map(|(_, state, episode, anatomy, _)| (*state, *episode, *anatomy)).collect();
    tape.append(&marathon, &rows);
    let (frames, most) = (tape.recording.frames(), most_frames(&tape.recording));
    // twice as many are kept, so that moving them costs little
    if frames > 2 * most {
        tape.recording.drop_front(frames - most);
    } else if tape.recording.bytes() > MEMORY {
        tape.recording.drop_front(frames / 2);
    }
}

/// Keeps the last seconds when the key asks for it.
fn keep(
    mut actions: MessageReader<ActionPressed>,
    mut reel: ResMut<FilmReel>,
    (program, skin): (Res<FilmProgram>, Res<SkinChoice>),
    cameras: Query<&FollowCamera>,
    mut notes: ResMut<Notifications>,
) {
    for _ in actions.read().filter(|action| action.0 == Action::Film) {
        if reel.is_drawing() {
            notes.say("a film is being drawn; wait for it");
            continue;
        }
        let Some(recording) = reel.last_seconds() else {
            notes.say("nothing to film: no agent has moved");
            continue;
        };
        let Some(program) = program.0.clone().or_else(|| std::env::current_exe().ok()) else {
            notes.error("the film cannot be drawn: the path of this program is unknown");
            continue;
        };
        let mut words = skin.words();
        // a camera that is not tied to the character stands elsewhere in the film
        let camera = cameras.iter().next().map(|camera| camera.mode).filter(|mode| *mode != CameraMode::Free);
        words.extend(camera.iter().flat_map(|mode| ["--camera".into(), mode.name().into()]));
        notes.say(format!("drawing a film of the last {:.0} s", recording.seconds()));
        reel.drawing.push(std::thread::spawn(move || draw(&program, &recording, &words)));
    }
}

/// Draws a film with a process of its own. Returns its path.
fn draw(program: &Path, recording: &Recording, words: &[OsString]) -> Result<PathBuf, String> {
    let stem = format!("{}-film", file_stem(&recording.task_config.agent));
    let replay = free_name(&stem, "replay");
    recording.save(&replay).map_err(|e| e.to_string())?;
    let quiet = |program: &Path| {
        let mut command = Command::new(program);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        command
    };
    let ffmpeg = quiet(Path::new("ffmpeg")).arg("-version").output().is_ok_and(|output| output.status.success());
    let (extension, [size, fps]) = if ffmpeg { ("mp4", MP4) } else { ("gif", GIF) };
    // the film has the name of its recording
    let film = replay.with_extension(extension);
    let seconds = format!("{:.3}", recording.seconds());
    let mut command = quiet(program);
    command.arg("--replay").arg(&replay).arg("--record").arg(&film).args(words);
    command.args(["--size", size, "--fps", fps, "--seconds", &seconds, "--no-hud"]);
    // a pipe would end with this game, and the film with it
    let mut log = tempfile::tempfile().map_err(|e| e.to_string())?;
    command.stderr(log.try_clone().map_err(|e| e.to_string())?);
    let status = command.status().map_err(|e| format!("{}: {e}", program.display()))?;
    if status.success() {
        return std::path::absolute(&film).or(Ok(film));
    }
    let mut said = Vec::new();
    let _ = log.rewind().and_then(|()| log.read_to_end(&mut said));
    let text = String::from_utf8_lossy(&said);
    let last = text.lines().rfind(|line| !line.trim().is_empty()).unwrap_or("it gave no reason");
    Err(format!("{last}; its states are in {}", replay.display()))
}

/// Reports films that are done.
fn report(mut reel: ResMut<FilmReel>, mut notes: ResMut<Notifications>) {
    if !reel.drawing.iter().any(JoinHandle::is_finished) {
        return;
    }
    for drawing in reel.drawing.extract_if(.., |drawing| drawing.is_finished()) {
        match drawing.join() {
            Ok(Ok(path)) => notes.say(format!("film: {}", path.display())),
            Ok(Err(problem)) => notes.error(format!("the film cannot be drawn: {problem}")),
            Err(_) => notes.error("the film cannot be drawn: its thread has stopped"),
        }
    }
}
