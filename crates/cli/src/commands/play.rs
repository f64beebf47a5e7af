//! `marathon play`: starts the game, which is a separate program because of its size.

use crate::args::PlayArgs;
use crate::error::CliError;
use marathon_runs::terminal::say;
use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Name of the game's program.
const GAME: &str = "marathon-game";

/// Starts the game and waits for its end.
///
/// # Errors
/// If the program is missing or ends with an error, which it has printed itself.
pub fn run(args: &PlayArgs) -> Result<(), CliError> {
    let Some(game) = program() else {
        // the help of the game, which a test compares
        if args.words.iter().any(|word| word == "--help" || word == "-h") {
            say(include_str!("play_help.txt").trim_end());
            return Ok(());
        }
        return Err(CliError::Game(format!(
            "the game is not built: '{GAME}' is neither beside this program nor on the search path.\n\
             In the project's folder: cargo build --release -p {GAME}   (about 15 minutes on two cores, once)\n\
             Debian and Ubuntu need beforehand: apt install pkg-config libudev-dev libasound2-dev\n\
             and to show a window: libvulkan1 mesa-vulkan-drivers libxkbcommon-x11-0 libx11-xcb1 libxcursor1 libxi6 \
             libxrandr2\n\
             Without it, `marathon render` draws policies."
        )));
    };
    let shown = game.display().to_string();
    let status = Command::new(&game).args(&args.words).status();
    match status.map_err(|e| CliError::Game(format!("{shown}: cannot be started: {e}")))?.code() {
        Some(0) => Ok(()),
        Some(code) => Err(CliError::Game(format!("{GAME} ended with code {code}"))),
        None => Err(CliError::Game(format!("{GAME} was ended by a signal"))),
    }
}

/// The game's program, beside this one or on the search path.
pub fn program() -> Option<PathBuf> {
    let own = env::current_exe().ok();
    let path = env::var_os("PATH").unwrap_or_default();
    find(own.iter().filter_map(|exe| exe.parent().map(Path::to_path_buf)).chain(env::split_paths(&path)))
}

/// The program in the first folder that has it.
fn find(folders: impl Iterator<Item = PathBuf>) -> Option<PathBuf> {
    let name = format!("{GAME}{}", env::consts::EXE_SUFFIX);
    folders.map(|folder| folder.join(&name)).find(|path| path.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_one_on_the_way_is_taken() -> std::io::Result<()> {
        let [none, first, second] = [tempfile::tempdir()?, tempfile::tempdir()?, tempfile::tempdir()?];
        let name = format!("{GAME}{}", env::consts::EXE_SUFFIX);
        for folder in [&first, &second] {
            std::fs::write(folder.path().join(&name), "")?;
        }
        let paths = || [&none, &first, &second].map(|folder| folder.path().to_path_buf()).into_iter();
        assert_eq!(find(paths()), Some(first.path().join(&name)));
        assert_eq!(find(paths().take(1)), None);
        Ok(())
    }
}
