//! Marathon Man in a player's hands: he observes all that the steered figure does, and more; a button begins a skill where he is
//! and as he faces, whose clip then leads him and pays him; the skill ends by itself; and who falls gets up, unless the clips of
//! that are left out, or the episode is one that a fall ends.

mod common;

use common::{begun, options};
use marathon_envs::{Step, VecEnv, factory, registry};
use marathon_physics::lanes::Isa;
use std::f64::consts::FRAC_PI_2;

const ID: &str = "MarathonManController-v0";
const AGENTS: usize = 16;
/// Most decisions of the jump, and of the backflip, which waits for up to 80 until he stands as the clip does.
const JUMP: usize = 39;
const BACKFLIP: usize = 80 + 66;
/// Numbers of the command, and of what is told: which skill is on, and whether it is one of getting up.
const COMMAND: usize = 5;
const INFO: usize = 4;
const SKILL: usize = 2;
const RISING: usize = 3;

fn made(list: &[(&str, &str)]) -> (VecEnv, Step) {
    begun(ID, AGENTS, 11, list)
}

/// Lets the servos follow what leads him.
fn go(env: &mut VecEnv, step: &mut Step) {
    let actions = vec![0.0; AGENTS * env.spec().act];
    env.step(&actions, &mut step.as_mut()).unwrap();
}

fn told(step: &Step, agent: usize, i: usize) -> f32 {
    step.info[agent * INFO + i]
}

fn tell(env: &mut VecEnv, command: [f64; COMMAND]) {
    (0..AGENTS).for_each(|agent| env.set_command(agent, Some(&command)).unwrap());
}

/// Where a part of the observation is.
fn part(env: &VecEnv, name: &str) -> std::ops::Range<usize> {
    env.spec().observations.iter().find(|group| group.name == name).expect("it observes that").range.clone()
}

/// Where the velocity is that he is to have by now: behind the command, and the sine and cosine of its direction.
fn target_of(env: &VecEnv) -> usize {
    part(env, "command").start + 4
}

#[test]
fn he_observes_what_the_steered_figure_does_first() {
    let [own, steered] = [ID, "MarathonManSteer-v0"].map(|id| factory(id, Isa::best()).unwrap().spec().clone());
    assert!(own.obs > steered.obs && own.observations.starts_with(&steered.observations));
    let names: Vec<&str> = own.command.iter().map(|range| range.name.as_str()).collect();
    assert_eq!(names, ["speed", "left", "turn", "jump", "backflip"]);
    assert_eq!(own.command.iter().filter(|range| range.is_button()).count(), 2);
}

/// However slowly he is told to go, his gait is one that lifts the feet; at rest it is none.
#[test]
fn who_creeps_lifts_his_feet() {
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
            // whoever lags behind is to go faster than he is told
            let expected = expected.max(x.hypot(y));
            assert!((pace - expected).abs() < 1e-3, "told {speed} {left} {turn}: {pace}, expected {expected}");
        }
    }
}

/// The policy was trained on backflip commands without speed or turn, so a backflip hides all other commands.
#[test]
fn a_backflip_goes_before_all_other_commands() {
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

/// Where he is told to go, the velocity that he is to have by now aims beyond the command by half of what he lacks, and by 0.5 m/s at
/// most, but never beyond 3 m/s. At rest it is none.
#[test]
fn who_lags_behind_is_urged() {
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

/// What a button begins has the length of its piece of the clip, and he is paid for being like it.
#[test]
fn a_button_begins_a_skill_that_ends_by_itself() {
    for (button, number, length) in [(3, 1.0, JUMP), (4, 2.0, BACKFLIP)] {
        let (mut env, mut step) = made(&[("start", "first")]);
        tell(&mut env, [0.0; COMMAND]);
        // the first decisions do not count: somebody may just have landed
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
                    // from a stand into the midst of a clip
                    let gap = &step.obs[agent * env.spec().obs..][next.clone()];
                    assert!(on[agent] > 1 || gap.iter().any(|x| x.abs() > 0.2), "{gap:?}");
                } else if on[agent] > 0 {
                    lengths.push((on[agent], skill));
                    on[agent] = 0;
                }
            }
        }
        let whole = lengths.iter().filter(|(n, skill)| *n == length && *skill == 0.0).count();
        // servos alone do not always land, but nobody is in the skill any longer than it is
        // who topples before he is slow enough to turn over has begun nothing
        let toppled = toppled.iter().filter(|toppled| **toppled).count();
        assert!(lengths.iter().all(|(n, _)| *n <= length) && lengths.len() + toppled == AGENTS, "{lengths:?}");
        assert!(toppled <= usize::from(button == 4), "{toppled}");
        assert!(button == 4 || whole > 0, "{lengths:?}");
    }
}

/// In the midst of a skill, with the clip's own velocities, he is like the clip.
#[test]
fn who_is_like_the_clip_is_paid() {
    let model = marathon_envs::agent("MarathonManController-v0").unwrap().model().unwrap();
    // a jump for its pose alone, and for the velocity that he is to have
    for (clip, worth) in [("jump", 0.65), ("backflip", 1.0), ("getup_facedown", 0.5), ("getup_faceup", 0.5)] {
        let (mut env, mut step) = made(&[("clip", clip)]);
        go(&mut env, &mut step);
        let names = &env.spec().reward_terms;
        let of = |agent: usize, i: usize| f64::from(step.terms[agent * names.len() + i]);
        let [skill, leap] = ["skill", "leap"].map(|term| names.iter().position(|name| name == term).unwrap());
        let mut likeness: Vec<f64> = (0..AGENTS).map(|agent| of(agent, skill) / worth).collect();
        likeness.sort_by(f64::total_cmp);
        assert!(likeness[AGENTS / 2] > 0.8 && likeness[AGENTS - 1] <= 1.0, "{clip}: {likeness:?}");
        // whoever stands at the end of getting up has got up
        let paid = |i: &usize| (0..AGENTS).any(|agent| told(&step, agent, SKILL) > 0.5 && of(agent, *i) != 0.0);
        let paid: Vec<&str> = (0..names.len()).filter(paid).map(|i| names[i].as_str()).collect();
        // a jump is paid for its height, 5 for each meter of the lower foot, up to 1.5; who gets up for that of his butt, up to 0.3
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

/// Whoever is told to jump on the run leaps: his gait goes on leading him, and pays him, for half a second.
#[test]
fn a_jump_on_the_run_goes_on_running() {
    let (mut env, mut step) = made(&[]);
    tell(&mut env, [3.0, 0.0, 0.0, 1.0, 0.0]);
    let names = &env.spec().reward_terms.clone();
    let term = |name: &str| names.iter().position(|known| known == name).unwrap();
    let [gait, skill] = ["gait", "skill"].map(term);
    let later = part(&env, "later_pose");
    // how long each has been on the ground and on the run, and all leaps
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
            // a leap comes after going
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

/// The clips of getting up lead him half as fast again as they were: three of their decisions in two of his.
#[test]
fn getting_up_makes_haste() {
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
    // whoever still lies as the clip does waits
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

/// Who stands before the clip does has got up, however far from the clip he is; who lies has not.
#[test]
fn who_stands_has_got_up() {
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

/// Pushes everybody over, and tells who was still at play before and what became of him.
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
    fate.into_iter().map(|fate| fate.expect("everybody falls")).collect()
}

#[test]
fn who_falls_gets_up_or_has_failed() {
    let all = felled(&[("start", "first")]);
    assert!(all.iter().all(|(ended, rises)| !ended && *rises), "{all:?}");
    for list in [[("start", "first"), ("clip", "walk,stand,jump")], [("start", "first"), ("mortal", "1")]] {
        let all = felled(&list);
        assert!(all.iter().all(|(ended, _)| *ended), "{list:?}: {all:?}");
    }
}

/// Skills alone end their episodes; who cannot get up has failed at last.
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
fn a_clip_that_he_has_no_skill_of_is_refused() {
    let error = registry::factory_with(ID, &options(&[("clip", "walk,backflap")]), Isa::best()).err().unwrap();
    let text = error.to_string();
    assert!(text.contains("'backflap'") && text.contains("did you mean 'backflip'?"), "{text}");
}
