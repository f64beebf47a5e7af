//! A player holds the backflip button while still pushing the stick. With the shipped policy, Marathon Man stops and
//! does the backflip, whatever speed, sidestep, turn or jump is commanded.

use marathon_envs::VecEnvOptions;
use marathon_learn::Policy;
use marathon_runs::{Play, TaskConfig};
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

const AGENTS: usize = 50;
/// Number of agents, of 50, that must succeed.
const MOST: usize = 45;
/// Number of decisions in 2 s of running up, and in 6 s with the button.
const RUN_UP: usize = 80;
const HELD: usize = 240;
/// Index of the skill among the task's metrics, and the backflip's number.
const SKILL: usize = 2;
const BACKFLIP: f32 = 2.0;

/// The number of agents that began a backflip within 6 s of the button, and the number of those that landed on their
/// feet.
fn flips(policy: &Policy, going: [f64; 3], jump: f64) -> [usize; 2] {
    let options = VecEnvOptions { agents: AGENTS, seed: 3, threads: 0, ..Default::default() };
    let task_config = TaskConfig::of_policy(policy.meta());
    let mut play = Play::of(&task_config, &[policy], &options).unwrap();
    let info = play.spec().info.len();
    let (mut begun, mut over, mut landed) = ([false; AGENTS], [false; AGENTS], [false; AGENTS]);
    for decision in 0..RUN_UP + HELD {
        let held = decision >= RUN_UP;
        let [speed, left, turn] = going;
        let command = [speed, left, turn, if held { jump } else { 0.0 }, if held { 1.0 } else { 0.0 }];
        (0..AGENTS).for_each(|agent| play.set_command(agent, Some(&command)).unwrap());
        play.decide();
        let step = play.step().unwrap();
        for agent in 0..AGENTS {
            let skill = step.info[agent * info + SKILL];
            if begun[agent] && !over[agent] && skill != BACKFLIP {
                // after a fall, the next skill is getting up
                (over[agent], landed[agent]) = (true, skill < BACKFLIP);
            }
            begun[agent] |= held && skill == BACKFLIP;
        }
    }
    [begun, landed].map(|list| list.into_iter().filter(|x| *x).count())
}

#[test]
fn he_stops_and_turns_over_while_a_speed_is_commanded() {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/policies");
    let policy = Policy::load(&assets.join("MarathonManController.safetensors")).unwrap();
    for (going, jump) in [
        ([0.0; 3], 0.0),
        ([1.5, 0.0, 0.0], 0.0),
        ([3.0, 0.0, 0.0], 0.0),
        ([0.5, 0.8, 0.0], 0.0),
        ([1.5, 0.0, FRAC_PI_2], 0.0),
        ([0.0, 0.0, -FRAC_PI_2], 0.0),
        ([1.5, 0.0, 0.0], 1.0),
    ] {
        let [begun, landed] = flips(&policy, going, jump);
        println!("{going:?}, jump {jump}: {begun} of {AGENTS} turn over, {landed} land on their feet");
        assert!(
            begun >= MOST && landed >= MOST,
            "{going:?}, jump {jump}: {begun} of {AGENTS} turn over, {landed} land"
        );
    }
}
