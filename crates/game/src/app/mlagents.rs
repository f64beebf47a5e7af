//! ML-Agents' door in the window: `mlagents-learn` trains while one watches.

use crate::app::error::GameError;
use crate::app::feed::{Feed, Shared, Sight, board};
use crate::app::puppets::Kind;
use crate::app::show::Show;
use marathon_mlagents::{Behavior, BehaviorOptions, Log, Player, PlayerOptions, Turn};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Most agents that are shown; all are simulated.
const SHOWN: usize = 16;

/// Finds the trainer and begins to serve it, on a thread of its own that simulates on others.
///
/// # Errors
/// If there is no trainer, or the agent does not exist.
pub fn serve(show: &Show, port: u16, threads: usize) -> Result<Feed, GameError> {
    let setting = show.setting()?;
    let options = setting.options.clone();
    let behavior = BehaviorOptions { env: show.agent.clone(), agents: show.agents, options, ..Default::default() };
    let options = PlayerOptions { port, threads: threads.max(1), behaviors: vec![behavior], ..Default::default() };
    let mut player =
        setting.with_clips(|| -> Result<Player, GameError> { Ok(Player::connect(&options, Log::to_stderr())?) })?;
    let behavior = &player.behaviors()[0];
    let spec = Arc::new(behavior.spec().clone());
    let kind = Kind::new(behavior.model().clone(), Some(spec.clone()), spec.dt);
    let feed = Feed::new(kind, behavior.env().agents().min(SHOWN));
    let (shared, agents) = (feed.shared.clone(), feed.agents);
    let talk = move || {
        let result = talk(&mut player, &shared, agents);
        board(&shared).end = Some(result.map_err(|e| e.to_string()));
    };
    let thread = std::thread::Builder::new().name("marathon-mlagents".into()).spawn(talk);
    thread.map_err(|e| GameError::System(format!("a thread cannot be started: {e}")))?;
    Ok(feed)
}

/// Does what the trainer says until it closes, no faster than its time scale.
fn talk(player: &mut Player, shared: &Shared, agents: usize) -> Result<(), marathon_mlagents::PlayerError> {
    let mut sights = vec![Sight::default(); agents];
    let mut next = Instant::now();
    loop {
        let turn = player.act()?;
        let engine = player.engine();
        let behavior = &player.behaviors()[0];
        match turn {
            Turn::Closed => return Ok(()),
            Turn::Reset => sights.iter_mut().for_each(begin),
            Turn::Step => sights.iter_mut().enumerate().for_each(|(i, s)| take_in(s, behavior, i)),
        }
        let mut board = board(shared);
        board.engine = engine;
        // states cost something: those that nobody sees are not asked for
        if board.taken || board.sights.is_empty() {
            for (i, sight) in sights.iter_mut().enumerate() {
                if let Ok(state) = behavior.env().state(i) {
                    sight.qpos = state.qpos;
                }
            }
            board.sights.clone_from(&sights);
            board.taken = false;
        }
        drop(board);
        let dt = behavior.spec().dt;
        // the trainer may take long to answer: what it has led to is to be seen meanwhile
        player.answer()?;
        if let Some(scale) = engine.time_scale.filter(|scale| *scale > 0.0 && scale.is_finite()) {
            next += Duration::from_secs_f64((dt / f64::from(scale)).min(1.0));
            let now = Instant::now();
            match next.checked_duration_since(now) {
                Some(early) => std::thread::sleep(early),
                // a slow trainer is not made up for by a rush
                None => next = now,
            }
        }
    }
}

fn begin(sight: &mut Sight) {
    let number = sight.episode.number + 1;
    sight.episode = crate::ragdoll::Episode { number, ..Default::default() };
}

fn take_in(sight: &mut Sight, behavior: &Behavior, i: usize) {
    let (last, dt) = (behavior.last(), behavior.spec().dt);
    let terms = behavior.spec().reward_terms.len();
    let episode = &mut sight.episode;
    episode.decisions += 1;
    episode.seconds = episode.decisions as f64 * dt;
    episode.reward = last.reward[i];
    episode.total += f64::from(last.reward[i]);
    episode.distance += f64::from(last.forward[i]);
    episode.speed = last.forward[i] / dt as f32;
    episode.terms.clear();
    episode.terms.extend_from_slice(&last.terms[i * terms..(i + 1) * terms]);
    if last.terminated[i] || last.truncated[i] {
        begin(sight);
    }
}
