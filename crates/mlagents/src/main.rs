//! `marathon-player`: serves Marathon's environments to ML-Agents, as Unity's players do.

fn main() -> std::process::ExitCode {
    marathon_mlagents::main(std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned()))
}
