//! Videos of a policy. Agents keep playing after a fall, so that you see it, and the clip that they follow is their
//! ghost.

use crate::error::CliError;
use clap::ValueEnum;
use marathon_envs::{Autoreset, Spec, VecEnvOptions, registry};
use marathon_learn::Policy;
use marathon_physics::Model;
use marathon_physics::model::JointType;
use marathon_render::{Corner, Follow, Format, Frame, GhostPlace, Recorder, Renderer, Scene, status_line, strip_size};
use marathon_runs::terminal::interrupt;
use marathon_runs::text::unsigned_zero;
use marathon_runs::{Play, TaskConfig, text};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Time shown after the last agent has fallen, s.
const AFTERMATH: f64 = 1.0;
/// Seconds over which the speed in the captions is averaged.
const SPEED_WINDOW: f64 = 0.5;

/// Placement of a ghost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Ghost {
    /// At the clip's position: translucent, overlapping the character.
    Inside,
    /// In the lane behind the character.
    Beside,
}

/// Size and length of a picture.
pub struct Shot {
    pub format: Format,
    /// Pixels of a frame.
    pub width: usize,
    pub height: usize,
    /// Length, s.
    pub length: f64,
    /// Frames of a strip.
    pub frames: usize,
    /// Frames per second of a video.
    pub fps: f64,
}

/// The agents of a video.
pub struct Cast {
    pub agents: usize,
    /// Seed of the environments.
    pub seed: u64,
    /// Time before the picture starts, s.
    pub start: f64,
    /// Placement of the clip as a ghost of each agent.
    pub ghost: Option<Ghost>,
}

/// Properties of the video.
#[derive(Serialize)]
pub struct Report {
    #[serde(serialize_with = "text::path_json")]
    out: PathBuf,
    agent: String,
    agents: usize,
    frames: usize,
    width: usize,
    height: usize,
    seconds: f64,
    distance_mean: f64,
    speed_mean: f64,
    falls: usize,
    /// Mean absolute difference between the angles of the hinges and those of the clip until the falls, rad. Only with
    /// a ghost.
    #[serde(skip_serializing_if = "Option::is_none")]
    joint_error: Option<f64>,
    /// Mean distance between the roots of the agent and the clip until the falls, m. Only with a ghost.
    #[serde(skip_serializing_if = "Option::is_none")]
    root_error: Option<f64>,
}

impl Shot {
    /// Frames per row of a strip.
    pub fn columns(&self) -> usize {
        self.frames.div_ceil(self.frames.div_ceil(8))
    }

    /// Checks before the run starts that the picture is not too large.
    ///
    /// # Errors
    /// If the picture is too large.
    pub fn check(&self) -> Result<(), CliError> {
        if self.format == Format::Png {
            strip_size([self.width, self.height], self.frames, self.columns())?;
        }
        Ok(())
    }

    /// Time of each frame, s, in ascending order.
    pub fn times(&self) -> Vec<f64> {
        match self.format {
            Format::Png => {
                let gap = self.length / (self.frames.max(2) - 1) as f64;
                (0..self.frames).map(|i| i as f64 * gap).collect()
            }
            _ => {
                let count = (self.length * self.fps).round().max(1.0) as usize;
                (0..count).map(|i| i as f64 / self.fps).collect()
            }
        }
    }
}

/// Plays the policies of all roles with their best actions and records them.
///
/// # Errors
/// If a ghost is requested but the agents follow no clip, or the picture cannot be written.
pub fn shoot(policies: &[Policy], spec: &Spec, shot: &Shot, cast: &Cast, out: &Path) -> Result<Report, CliError> {
    shot.check()?;
    let mut stage = Stage::new(policies, spec, cast)?;
    let lanes = if cast.ghost == Some(Ghost::Beside) { 2 * cast.agents } else { cast.agents };
    let renderer = Renderer::new(shot.width, shot.height)?;
    let mut camera = Follow::new(&stage.scene, lanes, shot.width, shot.height);
    let mut recorder = Recorder::create(out, shot.fps, shot.columns())?;
    for _ in 0..(cast.start / spec.dt).round() as usize {
        stage.step()?;
    }
    let (begun, from) = (stage.seconds(), stage.distance());
    let (mut shown, mut decision) = (0, 0);
    for time in shot.times() {
        while decision < (time / spec.dt).round() as usize {
            stage.step()?;
            decision += 1;
            // the camera is updated at every decision, also between the frames of a strip
            camera.update(&stage.frame()?, spec.dt);
        }
        let frame = stage.frame()?;
        let mut image = renderer.render(&frame, &camera.update(&frame, 0.0));
        image.caption(Corner::TopLeft, &stage.caption());
        recorder.push(&image)?;
        shown += 1;
        if interrupt::requested() {
            return Err(CliError::Interrupted("nothing was written".into()));
        }
        if shot.format != Format::Png && stage.all_fallen_for(AFTERMATH) {
            break;
        }
    }
    recorder.finish()?;

    let (seconds, distance) = (stage.seconds() - begun, stage.distance() - from);
    Ok(Report {
        out: out.into(),
        agent: spec.id.clone(),
        agents: cast.agents,
        frames: shown,
        width: shot.width,
        height: shot.height,
        seconds,
        distance_mean: distance,
        speed_mean: distance / seconds.max(spec.dt),
        falls: stage.fallen.iter().filter(|f| f.is_some()).count(),
        joint_error: stage.errors.as_ref().map(|errors| errors.mean()[0]),
        root_error: stage.errors.as_ref().map(|errors| errors.mean()[1]),
    })
}

/// Agents in simulation.
struct Stage<'a> {
    play: Play<'a>,
    scene: Scene,
    /// Height fields of the model.
    fields: usize,
    /// Seconds between decisions.
    dt: f64,
    decisions: usize,
    /// Distance of each agent, m. It stays constant after a fall.
    distances: Vec<f64>,
    /// Distances of the last decisions, the newest at the end, for the speed.
    recent: Vec<f64>,
    /// Time at which each agent fell, decisions.
    fallen: Vec<Option<usize>>,
    ghost: Option<Ghost>,
    /// Errors, with a ghost.
    errors: Option<Errors>,
}

/// Differences between the agents and the clip.
struct Errors {
    /// Indices of the hinges in `qpos`.
    hinges: Vec<usize>,
    /// Number of `qpos` entries for the root's position.
    root: usize,
    /// Mean absolute difference of the hinge angles, rad, and distance of the roots, m: current means over the agents.
    now: [f64; 2],
    /// The same for agents that have not fallen, summed over decisions, and their number.
    sum: [f64; 2],
    count: usize,
}

impl Errors {
    fn new(model: &Model) -> Self {
        let hinges = model.joints.iter().filter(|joint| joint.kind == JointType::Hinge).map(|joint| joint.qpos_adr);
        let slides = model.joints.iter().take_while(|joint| joint.kind == JointType::Slide).count();
        let root = if model.joints.first().is_some_and(|joint| joint.kind == JointType::Free) { 3 } else { slides };
        Errors { hinges: hinges.collect(), root, now: [0.0; 2], sum: [0.0; 2], count: 0 }
    }

    /// The differences of an agent.
    fn of(&self, own: &[f64], clip: &[f64]) -> [f64; 2] {
        let gaps = self.hinges.iter().map(|k| (own[*k] - clip[*k]).abs());
        let way = own.iter().zip(clip).take(self.root).map(|(a, b)| (a - b) * (a - b));
        [gaps.sum::<f64>() / self.hinges.len().max(1) as f64, way.sum::<f64>().sqrt()]
    }

    fn mean(&self) -> [f64; 2] {
        self.sum.map(|sum| sum / self.count.max(1) as f64)
    }
}

impl<'a> Stage<'a> {
    fn new(policies: &'a [Policy], spec: &Spec, cast: &Cast) -> Result<Self, CliError> {
        let options = VecEnvOptions {
            agents: cast.agents,
            seed: cast.seed,
            autoreset: Autoreset::Disabled,
            ..Default::default()
        };
        let model = registry::global().agent_with(&spec.id, &spec.options)?.model()?;
        let play = Play::of(
            &TaskConfig::with_training_options(policies[0].meta()),
            &policies.iter().collect::<Vec<_>>(),
            &options,
        )?;
        if cast.ghost.is_some() && play.reference(0)?.is_none() {
            let text =
                format!("--ghost: {} follows no clip, expected an agent that does, such as MarathonMan", spec.id);
            return Err(CliError::Usage(text));
        }
        let mut stage = Self {
            play,
            scene: Scene::new(&model),
            fields: model.hfields.len(),
            dt: spec.dt,
            decisions: 0,
            distances: vec![0.0; cast.agents],
            recent: vec![0.0],
            fallen: vec![None; cast.agents],
            ghost: cast.ghost,
            errors: cast.ghost.map(|_| Errors::new(&model)),
        };
        stage.look_at_grounds()?;
        stage.compare()?;
        Ok(stage)
    }

    /// Updates the ground of the agents.
    fn look_at_grounds(&mut self) -> Result<(), CliError> {
        let (play, fields) = (&mut self.play, self.fields);
        let grounds = (0..self.fallen.len()).map(|agent| play.grounds(agent, fields)).collect::<Result<_, _>>()?;
        self.scene.set_grounds(grounds);
        Ok(())
    }

    fn step(&mut self) -> Result<(), CliError> {
        self.play.decide();
        let step = self.play.step()?;
        self.decisions += 1;
        for (i, fallen) in self.fallen.iter_mut().enumerate() {
            if step.terminated[i] && fallen.is_none() {
                *fallen = Some(self.decisions);
            }
            if fallen.is_none() {
                self.distances[i] += f64::from(step.forward[i]);
            }
        }
        // one of several roles may build the ground
        if !self.play.spec().roles.is_empty() {
            self.look_at_grounds()?;
        }
        self.recent.push(self.distance());
        let keep = (SPEED_WINDOW / self.dt).round() as usize + 1;
        if self.recent.len() > keep {
            self.recent.remove(0);
        }
        self.compare()
    }

    /// Measures the differences between the agents and the clip.
    fn compare(&mut self) -> Result<(), CliError> {
        let Some(errors) = &mut self.errors else { return Ok(()) };
        errors.now = [0.0; 2];
        for (i, fallen) in self.fallen.iter().enumerate() {
            let Some(clip) = self.play.reference(i)? else { continue };
            let error = errors.of(&self.play.qpos(i)?, &clip);
            for (k, error) in error.into_iter().enumerate() {
                errors.now[k] += error / self.fallen.len() as f64;
                errors.sum[k] += if fallen.is_none() { error } else { 0.0 };
            }
            errors.count += usize::from(fallen.is_none());
        }
        Ok(())
    }

    fn frame(&self) -> Result<Frame, CliError> {
        let agents = 0..self.fallen.len();
        let poses = agents.clone().map(|i| self.play.qpos(i)).collect::<Result<Vec<_>, _>>()?;
        let place = match self.ghost {
            None => return Ok(self.scene.frame(&poses)?),
            Some(Ghost::Inside) => GhostPlace::Inside,
            Some(Ghost::Beside) => GhostPlace::Beside,
        };
        let clips = agents.map(|i| self.play.reference(i)).collect::<Result<Vec<_>, _>>()?;
        let clips: Vec<Vec<f64>> = clips.into_iter().flatten().collect();
        Ok(self.scene.frame_with_ghosts(&poses, &clips, place)?)
    }

    fn seconds(&self) -> f64 {
        self.decisions as f64 * self.dt
    }

    /// Mean distance of the agents, m.
    fn distance(&self) -> f64 {
        self.distances.iter().sum::<f64>() / self.distances.len() as f64
    }

    /// Recent mean speed, m/s.
    fn speed(&self) -> f64 {
        let seconds = (self.recent.len() - 1) as f64 * self.dt;
        if seconds > 0.0 { (self.distance() - self.recent[0]) / seconds } else { 0.0 }
    }

    fn caption(&self) -> Vec<String> {
        let mut lines = match &self.errors {
            Some(Errors { now: [angle, way], .. }) => {
                vec![format!("{:5.2} s  off by {:4.1} deg {way:5.2} m", self.seconds(), angle.to_degrees())]
            }
            None => {
                let (distance, speed) = (unsigned_zero(self.distance(), 1), unsigned_zero(self.speed(), 1));
                vec![status_line(self.seconds(), distance, speed)]
            }
        };
        let fallen = self.fallen.iter().filter(|f| f.is_some()).count();
        match (&self.fallen[..], fallen) {
            (_, 0) => {}
            ([Some(at)], _) => lines.push(format!("fell at {:.2} s", *at as f64 * self.dt)),
            (all, n) => lines.push(format!("{n} of {} fallen", all.len())),
        }
        lines
    }

    fn all_fallen_for(&self, seconds: f64) -> bool {
        let since = self.fallen.iter().try_fold(0, |last, at| at.map(|at| last.max(at)));
        since.is_some_and(|at| (self.decisions - at) as f64 * self.dt >= seconds)
    }
}

impl Report {
    /// The report in one line.
    pub fn line(&self) -> String {
        let bytes = std::fs::metadata(&self.out).map_or(0, |m| m.len());
        let who = if self.agents == 1 { "the agent".into() } else { format!("{} agents", self.agents) };
        let falls = match (self.falls, self.agents) {
            (0, _) => "no fall".into(),
            (_, 1) => "then fell".into(),
            (n, _) => format!("{n} fell"),
        };
        let errors = self.joint_error.zip(self.root_error);
        let error = errors.map_or(String::new(), |(angle, way)| {
            format!(", off the clip by {:.1} degrees in the joints and {way:.2} m", angle.to_degrees())
        });
        format!(
            "wrote {} ({} frames of {}x{}, {} kB): {who} ran {:.1} m in {:.1} s, {:.2} m/s{error}, {falls}",
            text::path_word(&self.out),
            self.frames,
            self.width,
            self.height,
            bytes.div_ceil(1000),
            unsigned_zero(self.distance_mean, 1),
            self.seconds,
            unsigned_zero(self.speed_mean, 2)
        )
    }
}
