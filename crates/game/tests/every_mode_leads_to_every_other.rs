//! Every mode of the menu can follow every mode. After each transition, characters and policy are those of the new mode. The
//! screen shows no error, and nothing of the former mode is left.

use crate::devices;
use crate::windowless::{self, frames};
use bevy::input::ButtonState;
use bevy::prelude::*;
use bevy_marathon::prelude::*;
use marathon_game::app::{
    Actor, GhostAt, Imitation, LoadedPolicy, Menu, Mode, Notifications, Perturbations, PlayRecording, Playback,
    PolicySource, PuppetKind, Recorder, Recording, RemoteSource, Row, Scenario, ShippedPolicies, Steering, TrainingRun,
    switch_mode,
};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// The game with a table of its own, in a folder in which it can save policies.
fn game(folder: &Path, words: &[&str]) -> App {
    let table = folder.join("runs.sqlite").display().to_string();
    let words = [words, &["--threads", "1", "--table", &table]].concat();
    windowless::game(&words, Duration::from_millis(20), |_| ())
}

/// Switches to a mode as the menu does, and lets the characters come.
fn switch(app: &mut App, mode: Mode) {
    let mut scenario = app.world().resource::<Scenario>().clone();
    switch_mode(&mut scenario, mode, &app.world().resource::<ShippedPolicies>().clone());
    app.world_mut().resource_mut::<Menu>().start(scenario);
    frames(app, 5);
}

/// A recording of a hopper.
fn recording(folder: &Path) -> Result<PathBuf, Box<dyn Error>> {
    let task_config = TaskConfig::named("hopper")?;
    let spec = task_config.factory()?.spec().clone();
    let mut recording = Recording::new(task_config, Ground::Level, spec.dt, vec![0.0; 3]);
    for frame in 0..50 {
        recording.push(&Row {
            qpos: &vec![0.0; spec.nq],
            numbers: [frame as f32; 5],
            terms: &vec![0.0; spec.reward_terms.len()],
            action: &vec![0.0; spec.act],
            command: &vec![0.0; spec.command.len()],
            grounds: &Arc::default(),
            untimed: false,
        });
    }
    let path = folder.join("some.replay");
    recording.save(&path)?;
    Ok(path)
}

/// A hopper that another program moves.
fn remote_source() -> Result<RemoteSource, Box<dyn Error>> {
    let spec = TaskConfig::named("hopper")?.factory()?.spec().clone();
    let (model, dt) = (Arc::new(marathon_envs::agent("hopper")?.model()?), spec.dt);
    Ok(RemoteSource::new(PuppetKind::new(model, Some(Arc::new(spec)), dt), 1))
}

/// Describes what is wrong in a mode.
fn faults(app: &mut App, mode: Mode) -> Vec<String> {
    let mut faults = Vec::new();
    let mut check = |fine: bool, fault: &str| {
        if !fine {
            faults.push(fault.to_string());
        }
    };
    let mut actors = app.world_mut().query_filtered::<(Entity, &Actor), With<Anatomy>>();
    let actors: Vec<Entity> = actors.iter(app.world()).map(|(entity, _)| entity).collect();
    let with = |app: &App, has: fn(&EntityRef) -> bool| actors.iter().all(|actor| has(&app.world().entity(*actor)));
    let world = app.world();
    let (scenario, loaded) = (world.resource::<Scenario>(), world.resource::<LoadedPolicy>());

    check(*world.resource::<State<Mode>>() == mode, "the state is another one");
    check(scenario.mode == mode, "the scenario has another mode");
    check(actors.len() == if mode == Mode::Testbed { 1 } else { scenario.agents }, "the number of characters is wrong");
    let simulated = !matches!(mode, Mode::Replay | Mode::Outside);
    check(with(app, |actor| actor.contains::<RagdollState>()) == simulated, "the characters are simulated or not");
    let errors: Vec<String> =
        world.resource::<Notifications>().0.iter().filter(|note| note.error).map(|note| note.text.clone()).collect();
    check(errors.is_empty(), &format!("errors: {errors:?}"));

    let source = match mode {
        Mode::Learn => PolicySource::Trainer,
        Mode::Testbed => PolicySource::Nothing,
        _ => PolicySource::Shipped,
    };
    check(!simulated || scenario.source == source, "the source of the policy is wrong");
    // without a policy, the servos of a follower of any clip are enough
    let needs_policy = matches!(mode, Mode::Watch | Mode::Push | Mode::Course | Mode::Learn) && errors.is_empty();
    check(!needs_policy || loaded.policy.is_some(), "there is no policy");
    check(simulated || loaded.policy.is_none(), "a policy is left");

    check(world.contains_resource::<TrainingRun>() == (mode == Mode::Learn), "the training run");
    check(world.contains_resource::<Playback>() == (mode == Mode::Replay), "the playback");
    check(world.contains_resource::<RemoteSource>() == (mode == Mode::Outside), "the remote source");
    check(!world.contains_resource::<Recorder>(), "a recording is left");
    let imitation = *world.resource::<Imitation>();
    let shown = Imitation { ghost: GhostAt::Inside, errors: true };
    let expected = if mode == Mode::Imitate { shown } else { Imitation::default() };
    check(imitation == expected || mode == Mode::Learn, "ghost and errors");
    check(mode != Mode::Course || *world.resource::<Perturbations>() == Perturbations::default(), "the physics");
    let free = |actor: &EntityRef| actor.get::<AgentCommand>().is_none_or(|command| command.values().is_none());
    check(with(app, free), "a character is still steered");
    check(!world.resource::<Menu>().is_open(), "the menu is open");
    faults
}

/// Steers and records in the current mode, so that a transition has something to end.
fn be_busy(app: &mut App) {
    devices::key(app, KeyCode::ArrowUp, ButtonState::Pressed);
    frames(app, 3);
    devices::key(app, KeyCode::ArrowUp, ButtonState::Released);
    devices::key(app, KeyCode::KeyR, ButtonState::Pressed);
    devices::key(app, KeyCode::KeyR, ButtonState::Released);
    app.world_mut().resource_mut::<Perturbations>().gravity = 0.5;
    frames(app, 5);
    // time passes at its own pace in the next mode
    app.world_mut().resource_mut::<Time<Virtual>>().set_relative_speed(1.0);
}

/// The game saves policies and recordings in the current folder. A process has only one, so a single test walks through all
/// transitions.
#[test]
fn every_mode_leads_to_every_other() -> Result<(), Box<dyn Error>> {
    let (home, folder) = (std::env::current_dir()?, tempfile::tempdir()?);
    std::env::set_current_dir(folder.path())?;
    let replay = recording(folder.path())?;
    let mut all = Vec::new();
    for from in Mode::ALL {
        for to in Mode::IN_MENU {
            let mut app = game(folder.path(), &["hopper"]);
            match from {
                Mode::Replay => {
                    app.world_mut().write_message(PlayRecording(replay.clone()));
                    frames(&mut app, 5);
                }
                Mode::Outside => {
                    app.insert_resource(remote_source()?);
                    windowless::load(&mut app, |scenario| scenario.mode = Mode::Outside);
                    frames(&mut app, 5);
                }
                from => switch(&mut app, from),
            }
            all.extend(faults(&mut app, from).into_iter().map(|fault| format!("{from:?}: {fault}")));
            be_busy(&mut app);
            switch(&mut app, to);
            all.extend(faults(&mut app, to).into_iter().map(|fault| format!("{from:?} to {to:?}: {fault}")));
        }
    }
    std::env::set_current_dir(home)?;
    all.dedup();
    assert!(all.is_empty(), "{}", all.join("\n"));
    Ok(())
}

/// A character that the player has steered is not steered in the next mode.
#[test]
fn an_agent_that_takes_commands_is_released() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let mut app = game(folder.path(), &["AntController"]);
    devices::key(&mut app, KeyCode::ArrowUp, ButtonState::Pressed);
    frames(&mut app, 3);
    devices::key(&mut app, KeyCode::ArrowUp, ButtonState::Released);
    let mut commands = app.world_mut().query::<&AgentCommand>();
    assert_eq!(commands.iter(app.world()).filter(|command| command.values().is_some()).count(), 1);
    assert!(app.world().resource::<Steering>().on);
    for mode in [Mode::Push, Mode::Testbed, Mode::Watch, Mode::Course] {
        switch(&mut app, mode);
        assert_eq!(faults(&mut app, mode), Vec::<String>::new(), "{mode:?}");
    }
    Ok(())
}
