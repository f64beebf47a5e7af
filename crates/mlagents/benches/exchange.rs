//! Cost of one exchange of 16 hoppers for the player: `cargo bench --workspace --bench exchange`.
//!
//! Processor time of the player's thread, the kernel's share included: reading and decoding the actions, the simulation,
//! encoding and sending the infos. The trainer is another thread that always answers the same.

#[path = "../tests/common/mod.rs"]
mod common;

use common::{close, listen, reset, step};
use cpu_time::ThreadTime;
use marathon_envs::{VecEnv, VecEnvOptions};
use marathon_mlagents::{BehaviorOptions, Log, Player, PlayerOptions};
use std::thread;

const AGENTS: usize = 16;
const EXCHANGES: usize = 4000;
const ROUNDS: usize = 9;

fn main() {
    let (port, accept) = listen();
    let trainer = thread::spawn(move || {
        let mut trainer = accept();
        trainer.greet(1, 1);
        trainer.answer(&reset(Vec::new()));
        let order = step("Hopper-v0?team=0", AGENTS, &[0.1, -0.2, 0.3, -0.4]);
        for _ in 0..ROUNDS * EXCHANGES {
            trainer.receive();
            trainer.answer(&order);
        }
        trainer.receive();
        trainer.answer(&close());
    });
    let behavior = BehaviorOptions { agents: AGENTS, ..Default::default() };
    let options = PlayerOptions { port, behaviors: vec![behavior], ..Default::default() };
    let mut player = Player::connect(&options, Log::to_stderr()).expect("a trainer");

    let mut env = VecEnv::new("Hopper-v0", &VecEnvOptions { agents: AGENTS, ..Default::default() }).expect("hoppers");
    let mut out = env.buffers();
    env.reset(Some(1), &mut out.obs).expect("a start");
    let actions: Vec<f32> = [0.1, -0.2, 0.3, -0.4].repeat(AGENTS);

    let (mut whole, mut physics) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        whole.push(each(|| {
            player.advance().expect("a decision");
        }));
        physics.push(each(|| env.step(&actions, &mut out).expect("a decision")));
    }
    player.run().expect("a goodbye");
    trainer.join().expect("the trainer is content");
    let median = |list: &mut Vec<f64>| {
        list.sort_by(f64::total_cmp);
        list[ROUNDS / 2]
    };
    println!("{AGENTS} hoppers: {:.1} us of processor time per exchange", median(&mut whole));
    println!("of them the simulation: {:.1} us", median(&mut physics));
}

/// Microseconds of processor time that one call takes.
fn each(mut call: impl FnMut()) -> f64 {
    let begun = ThreadTime::now();
    for _ in 0..EXCHANGES {
        call();
    }
    begun.elapsed().as_secs_f64() * 1e6 / EXCHANGES as f64
}
