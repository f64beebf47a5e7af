//! Training by `mlagents-learn`, seen in the window.

use crate::app::error::GameError;
use crate::app::features::remote::mailbox::{RemotePose, RemoteSource, Shared, open};
use crate::app::stage::puppets::Kind;
use bevy_marathon::Episode;
use marathon_mlagents::{Behavior, BehaviorOptions, Log, Player, PlayerOptions, Turn};
use marathon_runs::TaskConfig;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Largest number of characters on the screen. All are simulated.
const SHOWN: usize = 16;

/// Connects to the trainer and serves it on a thread, which simulates on other threads.
///
/// # Errors
/// If there is no trainer, or the agent does not exist.
pub fn serve(task_config: &TaskConfig, agents: usize, port: u16, threads: usize) -> Result<RemoteSource, GameError> {
    let options = task_config.options.clone();
    let behavior = BehaviorOptions { env: task_config.agent.clone(), agents, options, ..Default::default() };
    let options = PlayerOptions { port, threads: threads.max(1), behaviors: vec![behavior], ..Default::default() };
    let mut player = Player::connect(&options, Log::to_stderr())?;
    let behavior = &player.behaviors()[0];
    let spec = Arc::new(behavior.spec().clone());
    let kind = Kind::new(behavior.model().clone(), Some(spec.clone()), spec.dt);
    let source = RemoteSource::new(kind, behavior.env().agents().min(SHOWN));
    let (shared, agents) = (source.shared.clone(), source.agents);
    let talk = move || {
        let result = talk(&mut player, &shared, agents);
        open(&shared).end = Some(result.map_err(|e| e.to_string()));
    };
    let thread = std::thread::Builder::new().name("marathon-mlagents".into()).spawn(talk);
    thread.map_err(|e| GameError::System(format!("a thread cannot be started: {e}")))?;
    Ok(source)
}

/// Serves the trainer until it closes, no faster than its time scale.
fn talk(player: &mut Player, shared: &Shared, agents: usize) -> Result<(), marathon_mlagents::PlayerError> {
    let mut poses = vec![RemotePose::default(); agents];
    let mut next = Instant::now();
    loop {
        let turn = player.act()?;
        let engine = player.engine();
        let behavior = &player.behaviors()[0];
        match turn {
            Turn::Closed => return Ok(()),
            Turn::Reset => poses.iter_mut().for_each(begin),
            Turn::Step => poses.iter_mut().enumerate().for_each(|(i, s)| take_in(s, behavior, i)),
        }
        let mut mailbox = open(shared);
        mailbox.engine = engine;
        // states cost time: read only those that are drawn
        if mailbox.taken || mailbox.poses.is_empty() {
            for (i, pose) in poses.iter_mut().enumerate() {
                if let Ok(state) = behavior.env().state(i) {
                    pose.qpos = state.qpos;
                }
            }
            mailbox.poses.clone_from(&poses);
            mailbox.taken = false;
        }
        drop(mailbox);
        let dt = behavior.spec().dt;
        // the trainer may take long to answer, and the picture needs the poses meanwhile
        player.answer()?;
        if let Some(scale) = engine.time_scale.filter(|scale| *scale > 0.0 && scale.is_finite()) {
            next += Duration::from_secs_f64((dt / f64::from(scale)).min(1.0));
            let now = Instant::now();
            match next.checked_duration_since(now) {
                Some(early) => std::thread::sleep(early),
                // time that a slow trainer has lost is not made up for
                None => next = now,
            }
        }
    }
}

fn begin(pose: &mut RemotePose) {
    let number = pose.episode.number + 1;
    pose.episode = Episode { number, ..Default::default() };
}

fn take_in(pose: &mut RemotePose, behavior: &Behavior, i: usize) {
    let (last, dt) = (behavior.last(), behavior.spec().dt);
    let terms = behavior.spec().reward_terms.len();
    let episode = &mut pose.episode;
    episode.decisions += 1;
    episode.seconds = episode.decisions as f64 * dt;
    episode.reward = last.reward[i];
    episode.total += f64::from(last.reward[i]);
    episode.distance += f64::from(last.forward[i]);
    episode.speed = last.forward[i] / dt as f32;
    episode.terms.clear();
    episode.terms.extend_from_slice(&last.terms[i * terms..(i + 1) * terms]);
    if last.terminated[i] || last.truncated[i] {
        begin(pose);
    }
}
