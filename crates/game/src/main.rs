//! The marathon-game app; all of it is in the library.

fn main() -> std::process::ExitCode {
    marathon_game::app::main(std::env::args_os())
}
