//! `marathon render`: a policy in pictures.

use crate::args::RenderArgs;
use crate::console::{print_json, say};
use crate::error::CliError;
use crate::interrupt;
use marathon_envs::{Autoreset, VecEnvOptions, registry};
use marathon_learn::Policy;
use marathon_render::{Corner, Follow, Format, Recorder, Renderer, Scene, status_line};
use marathon_runs::text::unsigned_zero;
use marathon_runs::{Play, text};
use serde::Serialize;
use std::path::PathBuf;

/// Seconds that are still shown after the last agent has fallen.
const AFTERMATH: f64 = 1.0;
/// Seconds over which the speed in the captions is averaged.
const SPEED_WINDOW: f64 = 0.5;
/// Most agents side by side.
const MAX_AGENTS: usize = 64;

/// How a scene is shot.
struct Shot {
    format: Format,
    width: usize,
    height: usize,
    /// Seconds.
    length: f64,
    /// Frames of a strip; as many as the length holds for films.
    frames: usize,
    fps: f64,
}

/// What was shown.
#[derive(Serialize)]
struct Report {
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
}

/// Plays a policy with its best actions and films it.
///
/// # Errors
/// If there is no such policy, an option makes no sense, or the picture cannot be written.
pub fn run(args: &RenderArgs, json: bool) -> Result<(), CliError> {
    let shot = Shot::new(args)?;
    let (policy, factory) = args.source.load()?;
    let spec = factory.spec();
    interrupt::install("leaving without a picture")?;
    let scene = Scene::new(&registry::agent(&spec.id)?.model()?);
    let renderer = Renderer::new(shot.width, shot.height)?;
    let mut camera = Follow::new(&scene, args.agents, shot.width, shot.height);
    let mut recorder = Recorder::create(&args.out, shot.fps, shot.columns())?;

    let mut stage = Stage::new(&policy, args)?;
    for _ in 0..(args.film.start / spec.dt).round() as usize {
        stage.step()?;
    }
    let (begun, from) = (stage.seconds(), stage.distance());
    let times = shot.times(spec.dt);
    let (mut shown, mut decision) = (0, 0);
    for time in times {
        while decision < time {
            stage.step()?;
            decision += 1;
            // the camera sees every decision, also those between the frames of a strip
            camera.update(&scene.frame(&stage.poses()?)?, spec.dt);
        }
        let frame = scene.frame(&stage.poses()?)?;
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
    let report = Report {
        out: args.out.clone(),
        agent: spec.id.clone(),
        agents: args.agents,
        frames: shown,
        width: shot.width,
        height: shot.height,
        seconds,
        distance_mean: distance,
        speed_mean: distance / seconds.max(spec.dt),
        falls: stage.fallen.iter().filter(|f| f.is_some()).count(),
    };
    if json {
        print_json(&report);
    } else {
        say(report.line());
    }
    Ok(())
}

impl Shot {
    fn new(args: &RenderArgs) -> Result<Self, CliError> {
        let format = Format::of(&args.out)?;
        let (seconds, fps, width) = match format {
            Format::Png => (2.0, 25.0, 240),
            Format::Gif => (8.0, 25.0, 480),
            Format::Mp4 => (8.0, 50.0, 960),
        };
        let width = args.width.unwrap_or(width);
        let height = args.height.unwrap_or(match format {
            Format::Png => width * 4 / 3,
            // video encoders want even sides
            _ => width * 9 / 16 / 2 * 2,
        });
        let (length, fps) = (args.film.seconds.unwrap_or(seconds), args.film.fps.unwrap_or(fps));
        let frames = args.frames.unwrap_or(8);
        let usage = |text: String| Err(CliError::Usage(text));
        args.film.validate()?;
        if !(1..=1000).contains(&frames) {
            return usage(format!("--frames is {frames}, expected 1 to 1000"));
        }
        if !(1..=MAX_AGENTS).contains(&args.agents) {
            return usage(format!("--agents is {}, expected 1 to {MAX_AGENTS}", args.agents));
        }
        match format {
            Format::Png if args.film.fps.is_some() => usage("--fps is for .gif and .mp4; a .png has --frames".into()),
            Format::Gif | Format::Mp4 if args.frames.is_some() => {
                usage("--frames is for .png; a film has --seconds and --fps".into())
            }
            _ => Ok(Self { format, width, height, length, frames, fps }),
        }
    }

    /// Frames in a row of a strip.
    fn columns(&self) -> usize {
        self.frames.div_ceil(self.frames.div_ceil(8))
    }

    /// The decisions at which frames are taken, in ascending order.
    fn times(&self, dt: f64) -> Vec<usize> {
        match self.format {
            Format::Png => {
                let gap = self.length / (self.frames.max(2) - 1) as f64;
                (0..self.frames).map(|i| (i as f64 * gap / dt).round() as usize).collect()
            }
            _ => {
                let count = (self.length * self.fps).round().max(1.0) as usize;
                (0..count).map(|i| (i as f64 / (self.fps * dt)).round() as usize).collect()
            }
        }
    }
}

/// Agents that play on after they fall, so that one sees how.
struct Stage<'a> {
    play: Play<'a>,
    /// Seconds between decisions.
    dt: f64,
    decisions: usize,
    /// Distance of each agent, m; it stands still after a fall.
    distances: Vec<f64>,
    /// Distances of the last decisions, the newest at the end, for the speed.
    recent: Vec<f64>,
    /// When each agent fell, decisions.
    fallen: Vec<Option<usize>>,
}

impl<'a> Stage<'a> {
    fn new(policy: &'a Policy, args: &RenderArgs) -> Result<Self, CliError> {
        let options = VecEnvOptions {
            agents: args.agents,
            seed: args.seed,
            autoreset: Autoreset::Disabled,
            ..Default::default()
        };
        Ok(Self {
            play: Play::new(policy, &options)?,
            dt: policy.meta().control_dt,
            decisions: 0,
            distances: vec![0.0; args.agents],
            recent: vec![0.0],
            fallen: vec![None; args.agents],
        })
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
        self.recent.push(self.distance());
        let keep = (SPEED_WINDOW / self.dt).round() as usize + 1;
        if self.recent.len() > keep {
            self.recent.remove(0);
        }
        Ok(())
    }

    fn poses(&self) -> Result<Vec<Vec<f64>>, CliError> {
        (0..self.fallen.len()).map(|i| Ok(self.play.qpos(i)?)).collect()
    }

    fn seconds(&self) -> f64 {
        self.decisions as f64 * self.dt
    }

    /// Mean distance of the agents, m.
    fn distance(&self) -> f64 {
        self.distances.iter().sum::<f64>() / self.distances.len() as f64
    }

    /// Mean speed of late, m/s.
    fn speed(&self) -> f64 {
        let seconds = (self.recent.len() - 1) as f64 * self.dt;
        if seconds > 0.0 { (self.distance() - self.recent[0]) / seconds } else { 0.0 }
    }

    fn caption(&self) -> Vec<String> {
        let mut lines =
            vec![status_line(self.seconds(), unsigned_zero(self.distance(), 1), unsigned_zero(self.speed(), 1))];
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
    fn line(&self) -> String {
        let bytes = std::fs::metadata(&self.out).map_or(0, |m| m.len());
        let who = if self.agents == 1 { "the agent".into() } else { format!("{} agents", self.agents) };
        let falls = match (self.falls, self.agents) {
            (0, _) => "no fall".into(),
            (_, 1) => "then fell".into(),
            (n, _) => format!("{n} fell"),
        };
        format!(
            "wrote {} ({} frames of {}x{}, {} kB): {who} ran {:.1} m in {:.1} s, {:.2} m/s, {falls}",
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
