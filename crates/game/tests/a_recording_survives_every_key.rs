//! A recording made with R is kept, whatever happens: other keys, other characters, the end of the game.

use crate::windowless::{self, frames};
use clap::ValueEnum;
use marathon_game::app::{Action, Recording, TrainingRun};
use std::error::Error;
use std::path::Path;
use std::time::Duration;

/// The recordings in a folder.
fn recordings(folder: &Path) -> Result<Vec<Recording>, Box<dyn Error>> {
    let files = std::fs::read_dir(folder)?.flatten().map(|entry| entry.path());
    let replays = files.filter(|path| path.extension().is_some_and(|end| end == "replay"));
    Ok(replays.map(|path| Recording::load(&path)).collect::<Result<_, _>>()?)
}

/// The game saves recordings in the current folder. A process has only one, so a single test tries all keys.
#[test]
fn a_recording_survives_every_key() -> Result<(), Box<dyn Error>> {
    let home = std::env::current_dir()?;
    for action in Action::value_variants() {
        let name = action.to_possible_value().ok_or("it has a name")?.get_name().to_string();
        let folder = tempfile::tempdir()?;
        std::env::set_current_dir(folder.path())?;
        let presses = ["0.3:record".to_string(), format!("1.2:{name}"), "2.5:record".into()];
        let presses = presses.iter().flat_map(|press| ["--action", press.as_str()]);
        let words: Vec<&str> = ["hopper", "--agents", "2", "--threads", "1"].into_iter().chain(presses).collect();
        let mut app = windowless::game(&words, Duration::from_millis(20), |_| ());
        frames(&mut app, 150);
        // ends the trainer
        app.world_mut().remove_resource::<TrainingRun>();
        let all = recordings(folder.path()).map_err(|error| format!("{name}: {error}"))?;
        assert!(all.iter().all(|recording| recording.frames() > 1), "{name}");
        // the first recording lasts at least from its start to the key, apart from paused or fast time
        let first = all.iter().find(|recording| recording.task_config.agent == "Hopper-v0" && recording.agents == 2);
        let seconds = first.ok_or_else(|| format!("{name}: it is lost"))?.seconds();
        assert!(seconds > 0.8, "{name}: {seconds} s");
    }
    std::env::set_current_dir(home)?;
    Ok(())
}
