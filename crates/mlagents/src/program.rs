//! The program `marathon-player` as a function.

use crate::args::{Args, Request, parse};
use crate::error::PlayerError;
use crate::log::Log;
use crate::player::Player;
use crate::rpc::RpcError;
use std::process::ExitCode;

/// Plays as the command line says, which excludes the program's own name. A program that has registered its own agents
/// serves them like the built-in ones.
pub fn main(words: impl IntoIterator<Item = String>) -> ExitCode {
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
        // a killed trainer sends nothing more
        Err(PlayerError::Rpc(e @ (RpcError::Io(_) | RpcError::GoAway(_)))) => {
            log.line(format_args!("error: the trainer is gone: {e}"));
            ExitCode::FAILURE
        }
        Err(e) => {
            log.line(format_args!("error: {e}"));
            ExitCode::FAILURE
        }
    }
}
