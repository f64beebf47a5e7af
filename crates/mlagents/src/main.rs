//! `marathon-player`: Marathon's environments behind the door of Unity's players.

fn main() -> std::process::ExitCode {
    marathon_mlagents::main(std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned()))
}
