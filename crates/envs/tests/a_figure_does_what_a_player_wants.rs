//! Marathon Man under a player's control.
//!
//! - It observes everything that the steered task does, and more.
//! - A button starts a skill at the character's position and heading. The skill's clip guides and rewards the
//!   character, and the skill ends by itself.
//! - After a fall, the character gets up. The episode ends instead if the getting-up clips are excluded or the episode
//!   is mortal.

use crate::common::{self, begun, options};
use marathon_envs::agents::marathon::marathon_man::gait::{Footwork, gaits};
use marathon_envs::{Step, VecEnv, factory, registry};
use marathon_physics::lanes::Isa;
use std::f64::consts::{FRAC_PI_2, TAU};

const ID: &str = "MarathonManController-v0";
const AGENTS: usize = 16;
/// Most decisions of the jump.
const JUMP: usize = 39;
/// Most decisions of the backflip, which waits up to 80 of them for the clip's first pose.
const BACKFLIP: usize = 80 + 66;
/// The hinges that swing the legs sideways, right and left.
const HIPS_X: [usize; 2] = [4, 10];
/// Size of the command.
const COMMAND: usize = 5;
/// Size of `info`, and its slots of the active skill and of getting up.
const INFO: usize = 4;
const SKILL: usize = 2;
const RISING: usize = 3;

fn made(list: &[(&str, &str)]) -> (VecEnv, Step) {
    begun(ID, AGENTS, 11, list)
}

/// Steps without offsets, so that the servos follow the reference pose.
fn go(env: &mut VecEnv, step: &mut Step) {
    let actions = vec![0.0; AGENTS * env.spec().act];
    env.step(&actions, &mut *step).unwrap();
}

fn told(step: &Step, agent: usize, i: usize) -> f32 {
    step.info[agent * INFO + i]
}

fn tell(env: &mut VecEnv, command: [f64; COMMAND]) {
    (0..AGENTS).for_each(|agent| env.set_command(agent, Some(&command)).unwrap());
}

/// Range of a group of the observation.
fn part(env: &VecEnv, name: &str) -> std::ops::Range<usize> {
    env.spec().observations.iter().find(|group| group.name == name).expect("it observes that").range.clone()
}

/// Start of the target velocity in the observation: after the command, and the sine and cosine of its direction.
fn target_of(env: &VecEnv) -> usize {
    part(env, "command").start + 4
}

#[test]
fn the_steered_observation_comes_first() {
    let [own, steered] = [ID, "MarathonManSteer-v0"].map(|id| factory(id, Isa::best()).unwrap().spec().clone());
    assert!(own.obs > steered.obs && own.observations.starts_with(&steered.observations));
    let names: Vec<&str> = own.command.iter().map(|range| range.name.as_str()).collect();
    assert_eq!(names, ["speed", "left", "turn", "jump", "backflip"]);
    assert_eq!(own.command.iter().filter(|range| range.is_button()).count(), 2);
}

/// In a step to a side, the hips swing the feet so that the standing one keeps its place.
#[test]
fn side_steps_swing_the_hips() {
    // slow enough that the gait has no share of the run, whose hips swing, too
    for left in [0.4, -0.4] {
        let (mut env, mut step) = made(&[("start", "first")]);
        tell(&mut env, [0.0, left, 0.0, 0.0, 0.0]);
        let (gait, target, next) = (part(&env, "gait").start, target_of(&env), part(&env, "next_pose").start);
        let (angles, n, dt) = (part(&env, "joint_positions").start, env.spec().obs, env.spec().dt);
        let mut largest = 0.0f64;
        for _ in 0..30 {
            go(&mut env, &mut step);
            for agent in (0..AGENTS).filter(|agent| told(&step, *agent, RISING) == 0.0).collect::<Vec<_>>() {
                let at = |i: usize| f64::from(step.obs[agent * n + i]);
                let (pace, aside) = (at(gait), at(target + 1));
                // short, quick steps
                let cadence = pace.max(at(target).hypot(aside)).max(2.5 * aside.abs());
                let phase = at(gait + 2).atan2(at(gait + 1)) / TAU + gaits().frequency(cadence) * dt;
                let angle = |aside, hinge| {
                    let footwork = Footwork::new(0.0, aside, 0.0, gaits().frequency(cadence));
                    gaits().angle(&gaits().moment(phase, pace, footwork, 0.0), hinge)
                };
                for hinge in HIPS_X {
                    let (got, expected) = (at(next + hinge) + at(angles + hinge), angle(aside, hinge));
                    assert!((got - expected).abs() < 1e-3, "{left}: {got} rad, expected {expected}");
                    largest = largest.max((expected - angle(0.0, hinge)).abs());
                }
            }
        }
        assert!(largest > 0.05, "{largest} rad");
    }
}

/// Every command to move, however slow, has a gait that lifts the feet. A stop command has none.
#[test]
fn slow_commands_still_lift_the_feet() {
    let cases = [([0.3, 0.0, 0.0], 0.8), ([0.0, -0.5, 0.0], 0.8), ([0.1, 0.0, 0.0], 0.4), ([0.0; 3], 0.0)];
    for ([speed, left, turn], expected) in cases.into_iter().chain([([0.0, 0.0, FRAC_PI_2], 0.6 * FRAC_PI_2)]) {
        let (mut env, mut step) = made(&[("start", "first")]);
        tell(&mut env, [speed, left, turn, 0.0, 0.0]);
        (0..12).for_each(|_| go(&mut env, &mut step));
        let (pace, target, obs) = (part(&env, "gait").start, target_of(&env), env.spec().obs);
        let up: Vec<usize> = (0..AGENTS).filter(|agent| told(&step, *agent, RISING) == 0.0).collect();
        assert!(up.len() > AGENTS / 2, "{up:?}");
        for agent in up {
            let [pace, x, y] = [pace, target, target + 1].map(|i| f64::from(step.obs[agent * obs + i]));
            // a character that lags behind is sped up beyond the command
            let expected = expected.max(x.hypot(y));
            assert!((pace - expected).abs() < 1e-3, "told {speed} {left} {turn}: {pace}, expected {expected}");
        }
    }
}

/// The policy was trained on backflip commands without speed or turn, so a backflip hides all other commands.
#[test]
fn a_backflip_overrides_all_other_commands() {
    let story = |command: [f64; COMMAND]| {
        let (mut env, mut step) = made(&[("start", "first")]);
        let mut seen = Vec::new();
        for decision in 0..60 {
            let held = decision >= 20;
            tell(&mut env, if held { command } else { [1.0, 0.0, 0.5, 0.0, 0.0] });
            go(&mut env, &mut step);
            seen.push((step.obs.clone(), step.reward.clone(), step.info.clone()));
        }
        (seen, part(&env, "command"), part(&env, "buttons"), env.spec().obs)
    };
    let (alone, command, buttons, obs) = story([0.0, 0.0, 0.0, 0.0, 1.0]);
    let (beside, ..) = story([2.5, 0.8, -FRAC_PI_2, 1.0, 1.0]);
    assert_eq!(alone, beside);
    // without the button, the observation shows the commanded values
    let (without, ..) = story([2.5, 0.8, -FRAC_PI_2, 1.0, 0.0]);
    for (seen, expected) in [(&beside, [0.0, 0.0, 0.0, 0.0, 1.0]), (&without, [2.5, 0.8, -FRAC_PI_2, 1.0, 0.0])] {
        for row in seen.last().unwrap().0.chunks_exact(obs) {
            let told = [
                row[command.start],
                row[buttons.start],
                row[command.start + 1],
                row[buttons.start + 1],
                row[buttons.start + 2],
            ];
            assert_eq!(told, expected.map(|x| x as f32));
        }
    }
}

/// Under a command to move, the target velocity overshoots the command by half of the velocity error. The overshoot is
/// at most 0.5 m/s, and the target never exceeds 3 m/s. A stop command has no target velocity.
#[test]
fn the_target_velocity_overshoots_the_command() {
    for (speed, expected) in
        [(2.0, 2.2..2.501), (2.8, 2.5..3.001), (3.0, 2.5..3.001), (0.2, 0.0..0.701), (0.0, 0.0..0.001)]
    {
        let (mut env, mut step) = made(&[("start", "first")]);
        tell(&mut env, [speed, 0.0, 0.0, 0.0, 0.0]);
        (0..25).for_each(|_| go(&mut env, &mut step));
        let (target, obs) = (target_of(&env), env.spec().obs);
        let up: Vec<usize> = (0..AGENTS).filter(|agent| told(&step, *agent, RISING) == 0.0).collect();
        assert!(up.len() > AGENTS / 2, "{up:?}");
        for agent in up {
            let [x, y] = [target, target + 1].map(|i| f64::from(step.obs[agent * obs + i]));
            assert!(expected.contains(&x.hypot(y)), "told {speed}: {x} {y}");
        }
    }
}

/// A skill started by a button has the length of its clip section, and its reward is similarity to the clip.
#[test]
fn a_button_begins_a_skill_that_ends_by_itself() {
    for (button, number, length) in [(3, 1.0, JUMP), (4, 2.0, BACKFLIP)] {
        let (mut env, mut step) = made(&[("start", "first")]);
        tell(&mut env, [0.0; COMMAND]);
        // skip the first decisions, because some characters are still landing
        for _ in 0..12 {
            go(&mut env, &mut step);
        }
        let mut command = [0.0; COMMAND];
        command[button] = 1.0;
        tell(&mut env, command);
        let (mut on, mut lengths) = ([0; AGENTS], Vec::new());
        let (mut begun, mut toppled) = ([false; AGENTS], [false; AGENTS]);
        let next = part(&env, "next_pose");
        for decision in 0..length + 8 {
            go(&mut env, &mut step);
            if decision == 11 {
                tell(&mut env, [0.0; COMMAND]);
            }
            for agent in 0..AGENTS {
                let skill = told(&step, agent, SKILL);
                begun[agent] |= skill == number;
                toppled[agent] |= !begun[agent] && told(&step, agent, RISING) > 0.5;
                if skill == number {
                    on[agent] += 1;
                    // the skill starts in the middle of a clip, from standing
                    let gap = &step.obs[agent * env.spec().obs..][next.clone()];
                    assert!(on[agent] > 1 || gap.iter().any(|x| x.abs() > 0.2), "{gap:?}");
                } else if on[agent] > 0 {
                    lengths.push((on[agent], skill));
                    on[agent] = 0;
                }
            }
        }
        let whole = lengths.iter().filter(|(n, skill)| *n == length && *skill == 0.0).count();
        // without a policy, some characters do not land, but no skill takes longer than its clip;
        // a character that topples before it is slow enough for a backflip starts none
        let toppled = toppled.iter().filter(|toppled| **toppled).count();
        assert!(lengths.iter().all(|(n, _)| *n <= length) && lengths.len() + toppled == AGENTS, "{lengths:?}");
        assert!(toppled <= usize::from(button == 4), "{toppled}");
        assert!(button == 4 || whole > 0, "{lengths:?}");
    }
}

/// Starting within a skill, with the clip's velocities, the character is similar to the clip.
#[test]
fn similarity_to_the_clip_is_rewarded() {
    let model = marathon_envs::agent("MarathonManController-v0").unwrap().model().unwrap();
    // a jump is rewarded for its pose and for the target velocity only
    for (clip, worth) in [("jump", 0.65), ("backflip", 1.0), ("getup_facedown", 0.5), ("getup_faceup", 0.5)] {
        let (mut env, mut step) = made(&[("clip", clip)]);
        go(&mut env, &mut step);
        let names = &env.spec().reward_terms;
        let of = |agent: usize, i: usize| f64::from(step.terms[agent * names.len() + i]);
        let [skill, leap] = ["skill", "leap"].map(|term| names.iter().position(|name| name == term).unwrap());
        let mut likeness: Vec<f64> = (0..AGENTS).map(|agent| of(agent, skill) / worth).collect();
        likeness.sort_by(f64::total_cmp);
        assert!(likeness[AGENTS / 2] > 0.8 && likeness[AGENTS - 1] <= 1.0, "{clip}: {likeness:?}");
        // a character that stands at the end of getting up is up
        let paid = |i: &usize| (0..AGENTS).any(|agent| told(&step, agent, SKILL) > 0.5 && of(agent, *i) != 0.0);
        let paid: Vec<&str> = (0..names.len()).filter(paid).map(|i| names[i].as_str()).collect();
        // a jump earns 5 per meter of the lower foot's height, up to 1.5; getting up earns up to 0.3 for the height of
        // the butt
        let expected = match clip {
            "jump" => vec!["velocity", "pace", "drift", "skill", "leap"],
            "backflip" => vec!["skill"],
            _ => vec!["skill", "rise"],
        };
        assert_eq!(paid, expected);
        let rise = names.iter().position(|name| name == "rise").unwrap();
        for agent in (0..AGENTS).filter(|agent| clip.starts_with("getup") && told(&step, *agent, RISING) > 0.5) {
            let height = f64::from(step.obs[agent * env.spec().obs + part(&env, "height").start]);
            let expected = 0.3 * (height / 0.75).clamp(0.0, 1.0);
            assert!((of(agent, rise) - expected).abs() < 1e-4, "{agent}: {} {expected}", of(agent, rise));
        }
        let feet = ["right_right_foot", "left_left_foot"];
        for agent in (0..AGENTS).filter(|_| clip == "jump") {
            let state = env.state(agent).unwrap();
            let low =
                feet.map(|foot| common::center(&model, &state, foot)[2]).into_iter().fold(f64::INFINITY, f64::min);
            let expected = 5.0 * (low - 0.06).clamp(0.0, 0.3);
            assert!((of(agent, leap) - expected).abs() < 1e-3, "{agent}: {} {expected}", of(agent, leap));
        }
    }
}

/// While running, the jump button starts a leap. The gait continues to guide and reward the character for half a
/// second.
#[test]
fn a_jump_while_running_keeps_the_gait() {
    let (mut env, mut step) = made(&[]);
    tell(&mut env, [3.0, 0.0, 0.0, 1.0, 0.0]);
    let names = &env.spec().reward_terms.clone();
    let term = |name: &str| names.iter().position(|known| known == name).unwrap();
    let [gait, skill] = ["gait", "skill"].map(term);
    let later = part(&env, "later_pose");
    // for each agent, the last skill and the duration of the present leap; then the durations of all leaps
    let (mut before, mut lasts, mut lengths, mut jumps) = ([0.0; AGENTS], [0; AGENTS], Vec::new(), 0);
    for decision in 0..60 {
        go(&mut env, &mut step);
        for agent in 0..AGENTS {
            let now = told(&step, agent, SKILL);
            let [of_gait, of_clip] = [gait, skill].map(|i| step.terms[agent * names.len() + i] > 0.0);
            let leaps = now == 1.0 && of_gait;
            if now == 1.0 {
                let seen = &step.obs[agent * env.spec().obs..][later.clone()];
                assert_ne!(of_gait, of_clip, "{agent}, decision {decision}");
                assert_eq!(seen.iter().all(|x| *x == 0.0), leaps, "{agent}, decision {decision}");
                jumps += usize::from(!leaps);
            }
            // a leap follows locomotion, not another skill
            assert!(!leaps || lasts[agent] > 0 || before[agent] == 0.0, "{agent}, decision {decision}");
            if lasts[agent] > 0 && !leaps {
                lengths.push(lasts[agent]);
            }
            lasts[agent] = if leaps { lasts[agent] + 1 } else { 0 };
            before[agent] = now;
        }
    }
    assert!(jumps > 0 && lengths.iter().all(|n| *n <= 20) && lengths.contains(&20), "{jumps} {lengths:?}");
}

/// Getting-up clips play 1.5 times as fast: three of their decisions in two of the character's.
#[test]
fn getting_up_plays_its_clip_faster() {
    let (mut env, mut step) = made(&[("clip", "getup_faceup"), ("start", "first")]);
    let phase = part(&env, "phase").start;
    let mut before: Option<Vec<f64>> = None;
    let mut ways = vec![Vec::new(); AGENTS];
    for _ in 0..60 {
        go(&mut env, &mut step);
        let angle = |agent: usize| {
            let at = agent * env.spec().obs + phase;
            f64::from(step.obs[at]).atan2(f64::from(step.obs[at + 1]))
        };
        let now: Vec<f64> = (0..AGENTS).map(angle).collect();
        for agent in (0..AGENTS).filter(|agent| told(&step, *agent, RISING) > 0.5) {
            if let Some(before) = &before {
                ways[agent].push(now[agent] - before[agent]);
            }
        }
        before = Some(now);
    }
    // a character that still lies in the clip's first pose waits
    let mut led = 0;
    for ways in ways {
        let moving: Vec<f64> = ways.into_iter().skip_while(|way| way.abs() < 1e-6).take(8).collect();
        let least = moving.iter().copied().fold(f64::INFINITY, f64::min);
        if moving.len() == 8 && least > 1e-6 {
            let steps: Vec<f64> = moving.iter().map(|way| way / least).collect();
            let sum: f64 = steps.iter().sum();
            assert!(steps.iter().all(|x| (x - x.round()).abs() < 1e-2) && (sum - 12.0).abs() < 0.1, "{steps:?}");
            led += 1;
        }
    }
    assert!(led > AGENTS / 2, "{led}");
}

/// A character that stands before the clip does is up, however far it is from the clip. A lying one is not.
#[test]
fn a_standing_character_is_up() {
    let (standing, _) = made(&[("start", "first")]);
    for clip in ["getup_facedown", "getup_faceup"] {
        let (mut env, mut step) = made(&[("clip", clip), ("start", "first")]);
        for agent in 0..AGENTS / 2 {
            let mut state = env.state(agent).unwrap();
            let stands = standing.state(agent).unwrap();
            (state.qpos, state.qvel) = (stands.qpos, stands.qvel);
            env.set_state(agent, &state).unwrap();
        }
        go(&mut env, &mut step);
        for agent in 0..AGENTS {
            assert_eq!(told(&step, agent, RISING) > 0.5, agent >= AGENTS / 2, "{clip} {agent}");
        }
    }
}

/// Pushes all characters over. Returns whether the episode ended or getting up began, whichever came first.
fn felled(list: &[(&str, &str)]) -> Vec<(bool, bool)> {
    let (mut env, mut step) = made(list);
    tell(&mut env, [0.0; COMMAND]);
    let mut fate = vec![None; AGENTS];
    for decision in 0..60 {
        for agent in 0..AGENTS {
            let force = if decision < 6 { [2500.0, 0.0, 0.0] } else { [0.0; 3] };
            env.push(agent, 1, force, [0.0; 3]).unwrap();
        }
        go(&mut env, &mut step);
        for agent in 0..AGENTS {
            let (ended, rises) = (step.terminated[agent], told(&step, agent, RISING) > 0.5);
            if fate[agent].is_none() && (ended || rises) {
                fate[agent] = Some((ended, rises));
            }
        }
    }
    fate.into_iter().map(|fate| fate.expect("all characters fall")).collect()
}

#[test]
fn a_fall_leads_to_getting_up_or_ends_the_episode() {
    let all = felled(&[("start", "first")]);
    assert!(all.iter().all(|(ended, rises)| !ended && *rises), "{all:?}");
    for list in [[("start", "first"), ("clip", "walk,stand,jump")], [("start", "first"), ("end_on_fall_prob", "1")]] {
        let all = felled(&list);
        assert!(all.iter().all(|(ended, _)| *ended), "{list:?}: {all:?}");
    }
}

/// Without locomotion clips, the end of a skill ends the episode. A character that cannot get up fails in the end.
#[test]
fn a_skill_alone_is_an_episode() {
    let (mut env, mut step) = made(&[("clip", "jump"), ("start", "first")]);
    let (mut truncated, mut over) = (0, [false; AGENTS]);
    for _ in 0..JUMP + 1 {
        go(&mut env, &mut step);
        for agent in (0..AGENTS).filter(|agent| !over[*agent]).collect::<Vec<_>>() {
            truncated += usize::from(step.truncated[agent] && !step.terminated[agent]);
            over[agent] = step.truncated[agent] || step.terminated[agent];
        }
    }
    assert!(over.iter().all(|over| *over) && truncated > 0, "{over:?} {truncated}");
}

#[test]
fn a_clip_without_a_skill_is_refused() {
    let error = registry::factory_with(ID, &options(&[("clip", "walk,backflap")]), Isa::best()).err().unwrap();
    let text = error.to_string();
    assert!(text.contains("'backflap'") && text.contains("did you mean 'backflip'?"), "{text}");
}

/// Observations of a quarter of a second, too short for a fall.
fn seen(list: &[(&str, &str)]) -> Vec<f32> {
    let (mut env, mut step) = made(list);
    let mut all = Vec::new();
    for _ in 0..10 {
        go(&mut env, &mut step);
        all.extend_from_slice(&step.obs);
    }
    all
}

/// `gait_max_target` bounds the servos where the gait leads them, and leaves the skills alone.
#[test]
fn the_gait_may_have_servos_of_a_smaller_range() {
    let walking = |option: &str, limit: &str| seen(&[("clip", "walk,stand"), ("start", "random"), (option, limit)]);
    assert_eq!(walking("gait_max_target", "0.3"), walking("max_target", "0.3"));
    assert_ne!(walking("gait_max_target", "0.3"), walking("gait_max_target", "3"));
    let rising = |option: &str, limit: &str| seen(&[("clip", "getup_faceup"), ("start", "first"), (option, limit)]);
    assert_eq!(rising("gait_max_target", "0.3"), rising("gait_max_target", "3"));
    assert_ne!(rising("max_target", "0.3"), rising("max_target", "3"));
}
