//! A picture without a window: the app's own recorder, called from a program.
//!
//! `cargo run --release -p marathon-game --example headless_png -- ants.png`

use clap::Parser;
use marathon_game::app::{Args, run};

fn main() -> Result<(), marathon_game::app::GameError> {
    let out = std::env::args().nth(1).unwrap_or_else(|| "ants.png".into());
    // the arguments of `marathon-game`, of which there is one more: no window
    let words = ["marathon-game", "ant", "--agents", "5", "--start", "2", "--seconds", "0.1", "--record", &out];
    run(&Args::parse_from(words))?;
    println!("drawn: {out}");
    Ok(())
}
