//! Observation, reward and termination of an agent that follows a clip agree with the clip at the agent's present
//! frame.
//!
//! Marathon Man, and the paper's Humanoid and Walker, execute the same actions in this engine (double precision) and in
//! MuJoCo. For MuJoCo, `tests/oracle/imitation.py` computes everything in plain Python. Its clip poses are those of
//! [`Clip::qpos`] at times that never wrap around. The table of the environment wraps around and has to agree with
//! them. One of the clips walks in circles.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use crate::common::{action, make, oracle, play};
use marathon_envs::agents::marathon::marathon_man::clips;
use marathon_envs::{AgentState, Autoreset, Clips, NamedClip, Options, VecEnv, VecEnvOptions};
use marathon_motion::kinematics::Pose;
use marathon_motion::{About, Clip, Cycle};
use marathon_physics::Model;
use marathon_physics::lanes::Isa;
use serde_json::{Value, json};

/// Starts per case.
const EPISODES: usize = 4;
/// Decisions per start: short enough that chaos stays below the tolerance.
const DECISIONS: usize = 25;
/// Observations are stored in single precision.
const TOLERANCE: f64 = 5e-5;
/// Seconds between Marathon Man's decisions.
const DT: f64 = 0.025;
/// Farthest frame that observations look ahead, decisions.
const AHEAD: usize = 16;
/// Sizes of the actions: none, small, medium, and large enough to be clipped.
const SCALES: [f32; EPISODES] = [0.0, 0.1, 0.5, 1.3];

/// A clip that ships with the crate.
fn shipped(name: &str) -> Arc<Clip> {
    clips::shipped(name).unwrap_or_else(|| panic!("there is a clip '{name}'"))
}

/// The walking clip on a circle: each cycle turns to the left.
fn circling() -> Clip {
    let walk = shipped("walk");
    let frames: Vec<Vec<f64>> = (0..walk.frames()).map(|i| walk.frame(i).to_vec()).collect();
    let cycle = walk.cycle().map(|cycle| Cycle { yaw: 0.5, ..cycle });
    let about = About { name: "circling".into(), ..walk.about().clone() };
    Clip::new(Path::new("circling"), about, walk.layout().clone(), walk.dt(), cycle, &frames).expect("a clip")
}

/// A clip of standing still for a second, without a loop.
fn standing() -> Clip {
    let model = marathon_envs::agent("MarathonMan-v0").unwrap().model().unwrap();
    let about = About { name: "standing".into(), model: model.name.clone(), ..About::default() };
    let layout = marathon_motion::Layout::of(&model);
    Clip::new(Path::new("standing"), about, layout, 0.1, None, &vec![model.qpos0; 11]).expect("a clip")
}

fn follow(options: &Options, agents: usize, isa: Option<Isa>) -> VecEnv {
    follow_as("MarathonMan-v0", options, agents, isa)
}

fn follow_as(id: &str, options: &Options, agents: usize, isa: Option<Isa>) -> VecEnv {
    let options = VecEnvOptions {
        agents,
        seed: 3,
        threads: 1,
        isa,
        autoreset: Autoreset::Disabled,
        options: options.clone(),
        ..VecEnvOptions::default()
    };
    VecEnv::new(id, &options).unwrap_or_else(|e| panic!("{e}"))
}

/// A clip sampled at every decision.
struct Cut<'a> {
    clip: &'a Clip,
    rows: usize,
    /// Seconds between decisions, of the environment and of the clip.
    dt: f64,
    step: f64,
}

impl Cut<'_> {
    /// Sampled as in the environment, with laps of a whole number of decisions.
    fn new(clip: &Clip, dt: f64) -> Cut<'_> {
        let decisions = clip.duration() / dt;
        if clip.cycle().is_none() {
            return Cut { clip, rows: (decisions + 1e-9).floor() as usize + 1, dt, step: dt };
        }
        let cycles = (1..=64).find(|n| ((*n as f64 * decisions).round() - *n as f64 * decisions).abs() < 0.02);
        let cycles = cycles.expect("clips of 60 frames a second fit") as f64;
        let rows = (cycles * decisions).round();
        Cut { clip, rows: rows as usize, dt, step: cycles * clip.duration() / rows }
    }

    fn at(&self, row: usize) -> Value {
        let Cut { clip, dt, step, .. } = *self;
        // a clip that does not loop stays at its last decision
        let row = if clip.cycle().is_some() { row } else { row.min(self.rows - 1) };
        let layout = clip.layout();
        let (time, mut qpos, mut qvel) = (row as f64 * step, vec![0.0; layout.nq()], vec![0.0; layout.nv()]);
        clip.qpos(time, &mut qpos);
        clip.qvel(time, &mut qvel);
        qvel.iter_mut().for_each(|v| *v *= step / dt);
        let yaw = clip.cycle().map_or(0.0, |cycle| cycle.yaw);
        let facing = yaw * time / clip.duration();
        json!({ "qpos": qpos, "qvel": qvel, "phase": clip.phase(time), "facing": facing })
    }

    /// The row closest to a state, and its distance. The noise of a start is smaller than the distance between two
    /// decisions, except at a standstill.
    fn nearest(&self, state: &AgentState) -> (usize, f64) {
        let away = |row: usize| {
            let moment = self.at(row);
            let there = moment["qpos"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap());
            there.zip(&state.qpos).map(|(a, b)| (a - b).powi(2)).sum::<f64>()
        };
        let all = (0..self.rows).map(|row| (row, away(row)));
        all.min_by(|(_, a), (_, b)| a.total_cmp(b)).expect("a clip has rows")
    }
}

/// Distance of a state from a clip.
fn gap(clip: &Clip, dt: f64, state: &AgentState) -> f64 {
    Cut::new(clip, dt).nearest(state).1
}

/// The clip's frames from a start state on, and the row of that state.
fn moments(clip: &Clip, dt: f64, state: &AgentState) -> (usize, Vec<Value>) {
    let cut = Cut::new(clip, dt);
    let (start, away) = cut.nearest(state);
    assert!(away < 21.0 * 0.01_f64.powi(2) + 1e-9, "the start is in the clip");
    (start, (start..start + DECISIONS + AHEAD + 1).map(|row| cut.at(row)).collect())
}

#[test]
fn observations_rewards_and_terminations_agree_with_mujoco() {
    let circling = NamedClip::from(circling());
    // the clips with these names, of which one does not come with Marathon
    let named = |names: &str| -> Clips {
        let clip = |name| if name == "circling" { circling.clone() } else { NamedClip::shipped(name) };
        names.split(',').map(clip).collect()
    };
    let mut request = Vec::new();
    let mut ours = Vec::new();
    let mut played = BTreeSet::new();
    let man = "MarathonMan-v0";
    for (id, clip, control, reward, future) in [
        (man, "walk", "pd", "deepmimic", 0),
        (man, "walk", "torque", "paper", 0),
        (man, "circling", "pd", "paper", 3),
        (man, "circling", "pd_range", "deepmimic", 0),
        (man, "backflip", "pd", "deepmimic", 0),
        (man, "backflip", "pd", "paper", 0),
        (man, "run", "servo", "paper", 0),
        (man, "backflip,circling,kick", "pd", "deepmimic", 2),
        ("HumanoidStyleWalk-v0", "", "torque", "deepmimic", 0),
        ("HumanoidStyleRun-v0", "", "torque", "deepmimic", 0),
        ("Walker2dStyleWalk-v0", "", "torque", "deepmimic", 0),
        ("Walker2dStyleRun-v0", "", "torque", "deepmimic", 0),
    ] {
        let mut options = Options::new();
        // servos of the last flip do not bend hips and knees as far as the clip
        let max_target = if clip == "backflip" && reward == "paper" { 1.0 } else { 3.0 };
        if id == man {
            options = options.with("clip", named(clip)).with("control", control).with("reward", reward);
            options = options.with("future", future as f64).with("max_target", max_target);
        }
        let agent = marathon_envs::registry::Registry::default().agent_with(id, &options).unwrap();
        let facts = agent.facts();
        let figure = agent.model().unwrap().name;
        let mut env = follow_as(id, &options, EPISODES, Some(Isa::F64));
        let mut out = env.buffers();
        env.reset(Some(5), &mut out.obs).unwrap();
        let act = env.spec().act;
        let (mut episodes, several) = (Vec::new(), clip.contains(','));
        for agent in 0..EPISODES {
            let state = env.state(agent).unwrap();
            let mut actions = vec![vec![0.0; act]; DECISIONS];
            for (t, row) in actions.iter_mut().enumerate() {
                action(agent, t, SCALES[agent], row);
            }
            let dt = env.spec().dt;
            let clips = facts.clips.iter();
            let clip = clips.min_by(|a, b| gap(a, dt, &state).total_cmp(&gap(b, dt, &state))).unwrap();
            if several {
                played.insert(clip.about().name.clone());
            }
            let (_, moments) = moments(clip, dt, &state);
            episodes.push(json!({ "qpos": state.qpos, "qvel": state.qvel, "actions": actions, "clip": moments }));
        }
        let mut steps = Vec::new();
        let mut row = vec![0.0; EPISODES * act];
        for t in 0..DECISIONS {
            for (agent, row) in row.chunks_exact_mut(act).enumerate() {
                action(agent, t, SCALES[agent], row);
            }
            env.step(&row, &mut out).unwrap();
            steps.push(out.clone());
        }
        let ahead = &[4, 8, 16][..future as usize];
        request.push(json!({
            "figure": figure, "xml": facts.model.text(), "frame_skip": facts.frame_skip, "control": control, "action_scale": 1.0,
            "max_target": max_target, "reward": reward, "distance": 0.5, "future": ahead, "episodes": episodes,
        }));
        ours.push((format!("{id} {clip}, {control}, {reward}"), env.spec().clone(), steps));
    }
    let answer = oracle("imitation.py", &json!({ "cases": request }));

    let (mut touches, mut far, mut decisions) = (0, 0, 0);
    for (case, (name, spec, steps)) in ours.iter().enumerate() {
        for agent in 0..EPISODES {
            let theirs = answer[case][agent].as_array().expect("an episode");
            assert!(!theirs.is_empty());
            for (t, theirs) in theirs.iter().enumerate() {
                let place = format!("{name}, episode {agent}, decision {t}");
                let step = &steps[t];
                for (what, all, n) in [
                    ("obs", &step.obs, spec.obs),
                    ("terms", &step.terms, spec.reward_terms.len()),
                    ("info", &step.info, spec.info.len()),
                ] {
                    let expected = theirs[what].as_array().expect("numbers");
                    assert_eq!(expected.len(), n, "{place}: {what}");
                    for (i, (x, y)) in all[agent * n..][..n].iter().zip(expected).enumerate() {
                        let (x, y) = (f64::from(*x), y.as_f64().expect("a number"));
                        assert!((x - y).abs() <= TOLERANCE * (1.0 + y.abs()), "{place}: {what} {i}: {x}, MuJoCo {y}");
                    }
                }
                let ended = [&theirs["far"], &theirs["fallen"]].map(|x| x.as_bool().unwrap());
                assert_eq!(step.terminated[agent], ended[0] || ended[1], "{place}: terminated");
                far += usize::from(ended[0]);
                let group = spec.observations.iter().find(|group| group.name == "touch").unwrap();
                touches += step.obs[agent * spec.obs..][group.range.clone()].iter().filter(|x| **x == 1.0).count();
                decisions += 1;
            }
        }
    }
    // the comparison is meaningful only if these cases occurred
    assert!(played.len() > 1, "one clip only: {played:?}");
    assert!(touches > 100 && far > 3 && decisions > 300, "{touches} touches, {far} too far, {decisions} decisions");
}

/// [`VecEnv::reference`] is the pose that rewards use. Its distance from the agent equals the reported and observed
/// one, over laps that turn, for agents at different positions, with any vector width.
#[test]
fn the_clip_in_the_world_is_the_one_that_rewards_see() {
    let model = marathon_envs::agent("MarathonMan-v0").unwrap().model().unwrap();
    for isa in [Isa::F64, Isa::best()] {
        let mut env = follow(&Options::new().with("clip", circling()).with("distance", 1e3), 20, Some(isa));
        let (obs, info) = (env.spec().obs, env.spec().info.len());
        let mut out = env.buffers();
        env.reset(Some(2), &mut out.obs).unwrap();
        env.info(&mut out.info).unwrap();
        let first = env.reference(0).unwrap().unwrap();
        let mut farthest = 0.0_f64;
        for t in 0..400 {
            for agent in (0..20).filter(|_| t % 20 == 0) {
                let clip = env.reference(agent).unwrap().expect("it follows a clip");
                let state = env.state(agent).unwrap();
                let [theirs, ours] = [&clip, &state.qpos].map(|qpos| centers(&model, qpos));
                let butt = (0..3).map(|k| (theirs[0][k] - ours[0][k]).powi(2)).sum::<f64>().sqrt();
                let away = |(a, b): (&[f64; 3], &[f64; 3])| {
                    (0..3).map(|k| (a[k] - b[k] - theirs[0][k] + ours[0][k]).powi(2)).sum::<f64>().sqrt()
                };
                let parts = theirs.iter().zip(&ours).map(away).sum::<f64>() / theirs.len() as f64;
                let place: f64 = out.obs[agent * obs + 65..][..3].iter().map(|x| f64::from(*x).powi(2)).sum();
                let reported = f64::from(out.info[agent * info + 1]);
                assert!((butt - place.sqrt()).abs() < 2e-4, "decision {t}: {butt} m, observed {}", place.sqrt());
                assert!((parts - reported).abs() < 2e-4, "decision {t}: {parts} m, reported {reported}");
                farthest = farthest.max(butt);
            }
            env.step(&vec![0.0; 20 * 21], &mut out).unwrap();
        }
        let last = env.reference(0).unwrap().unwrap();
        let way = (last[0] - first[0]).hypot(last[1] - first[1]);
        assert!(way > 1.0 && farthest > 1.0, "the clip has come {way} m, the agents are up to {farthest} m from it");
    }
    for agent in ["Hopper-v0", "MarathonManSteer-v0"] {
        let env = VecEnv::new(agent, &VecEnvOptions::default()).unwrap();
        assert_eq!(env.reference(0).unwrap(), None, "{agent} follows no clip");
        assert!(env.reference(1).is_err(), "there is no agent 1");
    }
}

/// Centers of the parts. The butt's is first.
fn centers(model: &Model, qpos: &[f64]) -> Vec<[f64; 3]> {
    let pose = Pose::of(model, qpos);
    let parts = marathon_envs::agent("MarathonMan-v0").unwrap().facts().parts;
    let center = |name: &String| {
        let geom = model.geoms.iter().find(|geom| geom.name == *name).expect("a part is a geom");
        pose.point(geom.body, geom.pos.into()).to_array()
    };
    parts.iter().map(center).collect()
}

#[test]
fn episodes_start_all_over_the_clip() {
    let clip = shipped("walk");
    let mut env = follow(&Options::new(), 200, None);
    let mut obs = vec![0.0; 200 * env.spec().obs];
    env.reset(Some(1), &mut obs).unwrap();
    let starts: Vec<usize> = (0..200).map(|agent| moments(&clip, DT, &env.state(agent).unwrap()).0).collect();
    let mut different = starts.clone();
    different.sort_unstable();
    different.dedup();
    assert!(different.len() > 30 && *different.last().unwrap() > 120, "{} starts", different.len());

    let mut env = follow(&Options::new().with("start", "first"), 20, None);
    env.reset(Some(1), &mut obs[..20 * env.spec().obs]).unwrap();
    assert!((0..20).all(|agent| moments(&clip, DT, &env.state(agent).unwrap()).0 == 0));
}

/// Half of the adaptive starts after a failure are where the failed episode started if it was short, otherwise in the
/// second before the failure. Of the others, a quarter are at the beginning. The same seed starts alike, regardless of
/// earlier episodes.
#[test]
fn adaptive_starts_are_where_the_agent_has_failed() {
    let still = standing();
    let frames = vec![still.frame(0).to_vec(); 100];
    let (about, layout) = (About { name: "stand on".into(), ..still.about().clone() }, still.layout().clone());
    let looping = Clip::new(Path::new("stand on"), about, layout, 0.1, Some(Cycle::default()), &frames).unwrap();
    let (agents, rows) = (64, 400);
    let mut env = follow(&Options::new().with("clip", looping).with("start", "adaptive"), agents, None);
    let row = |phase: f32| (phase * rows as f32).round() as usize;
    let places = |env: &VecEnv| -> Vec<usize> {
        let mut info = vec![0.0; agents * 3];
        env.info(&mut info).unwrap();
        info.chunks(3).map(|info| row(info[2])).collect()
    };
    for stands in [0, 90] {
        let mut out = env.buffers();
        env.reset(Some(1), &mut out.obs).unwrap();
        let first = out.obs.clone();
        let mut begun: Vec<(usize, usize)> = places(&env).into_iter().map(|place| (0, place)).collect();
        let (mut failures, mut near, mut at_the_beginning) = (0, 0, 0);
        for t in 1..=20 * (stands + 40) {
            let action = |agent: usize| [if t - begun[agent].0 > stands { 1.0 } else { 0.0 }; 21];
            let actions: Vec<f32> = (0..agents).flat_map(action).collect();
            env.step(&actions, &mut out).unwrap();
            let phases: Vec<f32> = out.info.chunks(3).map(|info| info[2]).collect();
            let ended: Vec<bool> = (0..agents).map(|agent| out.terminated[agent] || out.truncated[agent]).collect();
            env.reset_agents(&ended, &mut out.obs).unwrap();
            let places = places(&env);
            for agent in (0..agents).filter(|agent| ended[*agent]) {
                assert!(
                    out.terminated[agent] && (t - begun[agent].0 < 80) == (stands == 0),
                    "fails when its actions are large"
                );
                failures += 1;
                let is_near = match stands {
                    0 => places[agent] == begun[agent].1,
                    _ => (row(phases[agent]) + rows - places[agent]) % rows <= 41,
                };
                near += usize::from(is_near);
                at_the_beginning += usize::from(places[agent] == 0 && !is_near);
                begun[agent] = (t, places[agent]);
            }
        }
        // some of the others are there by chance: from the beginning to the beginning again, and within a second of
        // many
        let share = |count: usize| count as f64 / failures as f64;
        let chance = if stands == 0 { 0.06 } else { 0.04 };
        assert!(failures > 400 && (share(near) - 0.5 - chance).abs() < 0.09, "{near} of {failures}");
        assert!((share(at_the_beginning) - 0.1).abs() < 0.05, "{at_the_beginning} of {failures}");
        env.reset(Some(1), &mut out.obs).unwrap();
        assert_eq!(first, out.obs);
    }
}

#[test]
fn standing_beside_a_standing_clip_earns_everything_until_it_is_over() {
    let mut env = follow(&Options::new().with("clip", standing()).with("start", "first"), 3, None);
    let mut out = env.buffers();
    env.reset(Some(1), &mut out.obs).unwrap();
    for t in 1..=40 {
        env.step(&[0.0; 3 * 21], &mut out).unwrap();
        assert!(out.reward.iter().all(|r| (0.97..=1.0).contains(r)), "decision {t}: {:?}", out.reward);
        assert!(out.truncated.iter().all(|over| *over == (t == 40)), "a clip of one second has 40 decisions");
        assert!(!out.terminated.contains(&true), "no agent has failed");
    }
}

/// Each agent has its own place in the clip, and lanes begin and end independently.
#[test]
fn agents_are_where_they_are_in_the_clip_whoever_runs_beside_them() {
    let phases = |agents: usize| {
        let mut env = make("MarathonManWalk-v0", agents, 1, None, Autoreset::SameStep);
        let (info, mut phases) = (env.spec().info.len(), Vec::new());
        play(&mut env, 80, 0.4, |_, step| phases.push(step.info[..3 * info].to_vec()));
        phases
    };
    let few = phases(3);
    assert_eq!(few, phases(21));
    assert!(few.iter().all(|row| row[2] != row[5]), "agents are in different places");
}

#[test]
fn an_unknown_clip_is_refused() {
    let refused = |clip: marathon_envs::Value| {
        let options = VecEnvOptions { options: Options::new().with("clip", clip), ..VecEnvOptions::default() };
        VecEnv::new("MarathonMan-v0", &options).map(|_| ()).unwrap_err().to_string()
    };
    let error = refused("wlak".into());
    let expected = "option clip is 'wlak', expected a clip that is known; did you mean 'walk'? known: walk, walk_left";
    assert!(error.contains(expected), "{error}");
    let foreign = Clip::new(
        Path::new("foreign"),
        About { name: "foreign".into(), ..About::default() },
        marathon_motion::Layout::new([("hip".into(), marathon_motion::JointKind::Hinge)]),
        0.1,
        None,
        &[vec![0.0], vec![0.1]],
    );
    let error = refused(foreign.unwrap().into());
    assert!(error.contains("foreign") && error.contains("joint"), "{error}");
}

/// Each environment follows the clip that it was made with. Neither its name nor what was made before decides.
#[test]
fn two_clips_of_one_name_are_followed_side_by_side() {
    let named = |clip: &str| NamedClip::new("mine", shipped(clip));
    let env = |clip: NamedClip| follow(&Options::new().with("clip", clip).with("start", "first"), 2, None);
    let played = |env: &mut VecEnv| {
        let mut out = env.buffers();
        env.reset(Some(4), &mut out.obs).unwrap();
        let action = vec![0.2; 2 * env.spec().act];
        (0..20).for_each(|_| env.step(&action, &mut out).unwrap());
        out.obs
    };
    let own = |clip: &str| played(&mut follow(&Options::new().with("clip", clip).with("start", "first"), 2, None));
    let (walk, run) = (own("walk"), own("run"));
    assert_ne!(walk, run);
    let (mut first, mut second) = (env(named("walk")), env(named("run")));
    assert_eq!((played(&mut first), played(&mut second)), (walk.clone(), run));
    // what an environment says of itself makes it again, whatever has been made since
    let again = VecEnvOptions { agents: 2, options: first.spec().options.clone(), ..VecEnvOptions::default() };
    assert_eq!(played(&mut VecEnv::new("MarathonMan-v0", &again).unwrap()), walk);
    assert_ne!(first.spec().options, second.spec().options);
    // both in one task, where names are all that tells them apart
    let both = env_of_both(named("walk"), named("run"));
    assert_eq!(both.spec().options.get("clip").map(ToString::to_string), Some("'mine.motion,mine-2.motion'".into()));
}

fn env_of_both(a: NamedClip, b: NamedClip) -> VecEnv {
    follow(&Options::new().with("clip", [a, b].into_iter().collect::<Clips>()), 2, None)
}
