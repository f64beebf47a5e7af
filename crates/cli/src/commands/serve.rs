//! `marathon serve`: shows a policy, or a run while it learns, in a browser.

use crate::args::ServeArgs;
use crate::error::CliError;
use marathon_envs::{Spec, VecEnvOptions, registry};
use marathon_learn::Policy;
use marathon_physics::Model;
use marathon_runs::report::csv::History;
use marathon_runs::terminal::{interrupt, note, print_json, say};
use marathon_runs::{Play, PolicySource, RunFile, TaskConfig, text};
use marathon_viewer::{Frame, Poses, Viewer, facts, find_page};
use serde_json::{Value, json};
use std::path::Path;
use std::time::{Duration, Instant, SystemTime};

/// Maximum number of agents side by side.
const MAX_AGENTS: usize = 64;
/// Time between two looks at the run's folder.
const LOOK: Duration = Duration::from_secs(1);
/// Time between two looks for a tab while none watches.
const IDLE: Duration = Duration::from_millis(50);
/// Lag behind real time that is made up for. A longer one is dropped.
const LAG: Duration = Duration::from_millis(200);
/// Most points of a curve.
const POINTS: usize = 400;

/// Serves until Ctrl-C.
///
/// # Errors
/// If there is no such policy or run, the page is missing, or the port is taken.
pub fn run(args: &ServeArgs, json: bool) -> Result<(), CliError> {
    if !(1..=MAX_AGENTS).contains(&args.agents) {
        return Err(CliError::Usage(format!("--agents is {}, expected 1 to {MAX_AGENTS}", args.agents)));
    }
    let mut folder = Folder::new(&args.source);
    // errors of the policy come before the address
    let mut first = if folder.waits() { None } else { Some(folder.load()?) };
    let page = find_page(args.page.as_deref())?;
    let viewer = Viewer::start(&page, args.port)?;
    interrupt::install("leaving")?;
    if json {
        print_json(&json!({ "url": viewer.url() }));
    } else {
        say(format!("{}\nopen this address in a browser on this computer; Ctrl-C ends", viewer.url()));
    }
    if first.is_none() {
        note(format!("{}: waiting for the run's first checkpoint", args.source.policy.display()));
    }
    let mut time = 0.0;
    while !interrupt::requested() {
        let loaded = match first.take() {
            Some(loaded) => loaded,
            None => match folder.wait(&viewer)? {
                Some(loaded) => loaded,
                None => break,
            },
        };
        time = loaded.play(args, &viewer, &mut folder, time)?;
    }
    Ok(())
}

/// Where the policies come from.
struct Folder<'a> {
    source: &'a PolicySource,
    /// Time at which the policy that was read last was written.
    seen: Option<SystemTime>,
    /// Size of the table of progress that was read last, bytes.
    progress: u64,
    total: Option<u64>,
}

/// Policies of all roles and their task.
struct Loaded {
    policies: Vec<Policy>,
    spec: Spec,
    model: Model,
}

impl<'a> Folder<'a> {
    fn new(source: &'a PolicySource) -> Self {
        let run = RunFile::read(&source.policy.join("run.json")).ok();
        Folder { source, seen: None, progress: 0, total: run.map(|run| run.config.run.total_steps) }
    }

    /// Whether this is a run without a policy yet.
    fn waits(&self) -> bool {
        self.total.is_some() && self.written().is_none()
    }

    /// When the present policy was written.
    fn written(&self) -> Option<SystemTime> {
        let given = &self.source.policy;
        let path = if given.is_dir() { given.join("policy.safetensors") } else { given.clone() };
        path.metadata().and_then(|file| file.modified()).ok()
    }

    /// Whether there is a newer policy than the last one read.
    fn is_newer(&self) -> bool {
        self.written().is_some_and(|written| self.seen != Some(written))
    }

    fn load(&mut self) -> Result<Loaded, CliError> {
        self.seen = self.written();
        let (policies, factory) = self.source.load_all()?;
        let spec = factory.spec().clone();
        let model = registry::global().agent_with(&spec.id, &spec.options)?.model()?;
        Ok(Loaded { policies, spec, model })
    }

    /// Waits for the next policy. `None` after Ctrl-C.
    fn wait(&mut self, viewer: &Viewer) -> Result<Option<Loaded>, CliError> {
        while !interrupt::requested() {
            if self.is_newer() {
                return self.load().map(Some);
            }
            self.show_progress(viewer);
            std::thread::sleep(LOOK);
        }
        Ok(None)
    }

    /// Shows the curve of a run that has gone on.
    fn show_progress(&mut self, viewer: &Viewer) {
        let path = self.source.policy.join("progress.csv");
        let size = path.metadata().map_or(0, |file| file.len());
        if size == self.progress {
            return;
        }
        // a row may be incomplete at this moment, and the next look has all of it
        if let Some(curve) = curve(&path, self.total) {
            self.progress = size;
            viewer.curve(&curve);
        }
    }
}

/// The curve in a table of progress.
fn curve(path: &Path, total: Option<u64>) -> Option<Value> {
    let history = History::read(path).ok()?;
    let steps = history.column("steps");
    let every = steps.len().div_ceil(POINTS).max(1);
    let last = steps.len().checked_sub(1)?;
    let thin = |name: &str| {
        let column = history.column(name);
        let points = column.iter().enumerate().filter(|(i, _)| i % every == 0 || *i == last);
        points.map(|(_, value)| json!(value)).collect::<Vec<_>>()
    };
    let total = total.map_or_else(|| json!(steps[last]), |total| json!(total));
    Some(json!({
        "total": total, "steps": thin("steps"), "return_mean": thin("return_mean"), "speed_mean": thin("speed_mean"),
    }))
}

impl Loaded {
    /// Plays in real time until there is a newer policy or Ctrl-C. Returns the time, s.
    fn play(&self, args: &ServeArgs, viewer: &Viewer, folder: &mut Folder<'_>, mut time: f64) -> Result<f64, CliError> {
        let Loaded { policies, spec, model } = self;
        let options = VecEnvOptions { agents: args.agents, seed: args.seed, ..Default::default() };
        let task_config = TaskConfig::with_training_options(policies[0].meta());
        let mut play = Play::of(&task_config, &policies.iter().collect::<Vec<_>>(), &options)?;
        let mut poses = Poses::new(model, args.agents);
        // pages do not blend from one policy to the next
        let mut episodes = vec![(time / spec.dt).round() as u32; args.agents];
        viewer.show(&title(spec, &policies[0]), &facts(model), args.agents, spec.dt);
        lay(viewer, &mut play, model, 0..args.agents)?;
        let (mut next, mut look) = (Instant::now(), Instant::now());
        loop {
            if look <= Instant::now() {
                look = Instant::now() + LOOK;
                folder.show_progress(viewer);
                if interrupt::requested() || folder.is_newer() {
                    return Ok(time);
                }
            }
            if !viewer.is_watched() {
                std::thread::sleep(IDLE);
                continue;
            }
            for agent in 0..args.agents {
                poses.set(model, agent, &play.qpos(agent)?);
            }
            viewer.frame(&Frame { time, episodes: &episodes, poses: &poses });
            play.decide();
            let step = play.step()?;
            let begun: Vec<usize> = (0..args.agents).filter(|&i| step.terminated[i] || step.truncated[i]).collect();
            begun.iter().for_each(|&i| episodes[i] += 1);
            lay(viewer, &mut play, model, begun.into_iter())?;
            time += spec.dt;
            next += Duration::from_secs_f64(spec.dt);
            let now = Instant::now();
            match next.checked_duration_since(now) {
                Some(rest) => std::thread::sleep(rest),
                None if now - next > LAG => next = now,
                None => {}
            }
        }
    }
}

/// Shows the ground of agents, in tasks that have one.
fn lay(
    viewer: &Viewer,
    play: &mut Play<'_>,
    model: &Model,
    agents: impl Iterator<Item = usize>,
) -> Result<(), CliError> {
    if model.hfields.is_empty() {
        return Ok(());
    }
    for agent in agents {
        for (field, elevations) in play.grounds(agent, model.hfields.len())?.iter().enumerate() {
            viewer.ground(agent, field, elevations);
        }
    }
    Ok(())
}

/// The task, and how long the policy has learned.
fn title(spec: &Spec, policy: &Policy) -> String {
    match &policy.meta().training {
        Some(training) => format!("{} after {} decisions", spec.id, text::thousands(training.steps)),
        None => spec.id.clone(),
    }
}
