//! A Unity player that serves an agent of your own to ML-Agents: `marathon-player` that also knows the Rover of
//! [`rover.rs`](rover.rs).
//!
//! ```sh
//! cargo build --release -p marathon-examples --bin own_player
//! mlagents-learn rover.yaml --env=target/release/own_player --env-args --spawn-env=Rover-v0 --num-spawn-envs=16
//! ```
//!
//! Python tells the rovers their velocity by an environment parameter:
//!
//! ```python
//! parameters = EnvironmentParametersChannel()
//! env = UnityEnvironment("target/release/own_player", additional_args=["--spawn-env=Rover-v0"], side_channels=[parameters])
//! parameters.set_float_parameter("command.velocity", 1.5)     # from the next decision; NaN: their own schedule again
//! ```

mod rover;

use std::process::ExitCode;
use std::sync::Arc;

fn main() -> ExitCode {
    if let Err(error) = marathon_rl::envs::register(Arc::new(rover::Rover)) {
        eprintln!("error: {error}");
        return ExitCode::FAILURE;
    }
    marathon_mlagents::main(std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned()))
}
