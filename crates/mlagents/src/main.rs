//! `marathon-player`: Marathon's environments behind the door of Unity's players.

use marathon_mlagents::args::{Args, Request, parse};
use marathon_mlagents::rpc::RpcError;
use marathon_mlagents::{Log, Player, PlayerError};
use std::process::ExitCode;

fn main() -> ExitCode {
    let words = std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned());
    let args = match parse(words) {
        Ok(Request::Play(args)) => args,
        Ok(Request::Print(text)) => {
            print!("{text}");
            return ExitCode::SUCCESS;
        }
        Err(e) => {
            eprintln!("marathon-player: error: {e}");
            return ExitCode::from(2);
        }
    };
    let log = match args.log.as_deref().map_or_else(|| Ok(Log::to_stderr()), Log::to_file) {
        Ok(log) => log,
        Err(e) => {
            eprintln!("marathon-player: error: {e}");
            return ExitCode::FAILURE;
        }
    };
    let Args { player: options, ignored, .. } = args;
    if !ignored.is_empty() {
        log.line(format_args!("no effect here: {}", ignored.join(" ")));
    }
    let end = Player::connect(&options, log.clone()).and_then(|mut player| player.run());
    match end {
        Ok(()) => {
            log.line(format_args!("the trainer has closed"));
            ExitCode::SUCCESS
        }
        // a trainer that was killed says nothing more
        Err(PlayerError::Rpc(e @ (RpcError::Io(_) | RpcError::GoAway(_)))) => {
            log.line(format_args!("the trainer is gone: {e}"));
            ExitCode::SUCCESS
        }
        Err(e) => {
            log.line(format_args!("error: {e}"));
            ExitCode::FAILURE
        }
    }
}
