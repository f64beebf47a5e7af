//! The walk and the run of a steered Marathon Man can be other clips than those that ship. Their gait replaces the shipped
//! one in what the character observes, and clips that are no gaits are refused.

use std::f64::consts::TAU;
use std::path::Path;

use marathon_envs::agents::marathon::marathon_man::clips;
use marathon_envs::agents::marathon::marathon_man::gait::{Footwork, Gaits, gaits};
use marathon_envs::{Clips, NamedClip, Options, VecEnv, VecEnvOptions};
use marathon_motion::{About, Clip};

const STEER: &str = "MarathonManSteer-v0";
const CONTROLLER: &str = "MarathonManController-v0";
const AGENTS: usize = 4;
/// Indices in the observation: joint angles, gait and next pose.
const ANGLES: usize = 19;
const GAIT: usize = 79;
const NEXT: usize = 82;

/// A shipped clip that is played at another rate.
fn retimed(name: &str, rate: f64) -> Clip {
    let clip = clips::shipped(name).unwrap();
    let rows: Vec<Vec<f64>> = (0..clip.frames()).map(|i| clip.frame(i).to_vec()).collect();
    let (about, layout) = (About { name: "mine".into(), ..clip.about().clone() }, clip.layout().clone());
    Clip::new(Path::new("mine.motion"), about, layout, clip.dt() / rate, clip.cycle(), &rows).unwrap()
}

fn env(id: &str, given: &Options) -> Result<VecEnv, String> {
    let given = given.clone().with("start", "first");
    let options = VecEnvOptions { agents: AGENTS, seed: 3, options: given, ..VecEnvOptions::default() };
    VecEnv::new(id, &options).map_err(|error| error.to_string())
}

/// Observations of agents under a command to walk.
fn walked(id: &str, given: &Options) -> Vec<Vec<f32>> {
    let mut env = env(id, given).unwrap();
    let (mut out, zeros) = (env.buffers(), vec![0.0; AGENTS * env.spec().act]);
    env.reset(Some(3), &mut out.obs).unwrap();
    let mut command = vec![0.0; env.spec().command.len()];
    command[0] = 1.0;
    (0..AGENTS).for_each(|agent| env.set_command(agent, Some(&command)).unwrap());
    let step = |_| {
        env.step(&zeros, &mut out).unwrap();
        out.obs.clone()
    };
    (0..24).map(step).collect()
}

#[test]
fn a_given_clip_replaces_the_shipped_one() {
    for id in [STEER, CONTROLLER] {
        let ours = walked(id, &Options::new());
        let with = |clip: Clip| walked(id, &Options::new().with("walk", NamedClip::from(clip)));
        assert!(with(retimed("walk", 1.0)) == ours, "{id}: the same clip is the same gait");
        assert!(with(retimed("walk", 1.3)) != ours, "{id}: another clip is another gait");
    }
    let (walk, run) = (retimed("walk", 1.3), clips::shipped("run").unwrap());
    let mine = Gaits::of(&walk, &run).unwrap();
    assert!(mine.frequency(0.8) > 1.2 * gaits().frequency(0.8));
    let spec = env(STEER, &Options::new()).unwrap().spec().clone();
    for obs in walked(STEER, &Options::new().with("walk", NamedClip::from(walk))) {
        for row in obs.chunks_exact(spec.obs) {
            let at = |i: usize| f64::from(row[i]);
            let phase = at(GAIT + 2).atan2(at(GAIT + 1)) / TAU + mine.frequency(at(GAIT)) * spec.dt;
            let next = mine.moment(phase, at(GAIT), Footwork::straight(), 0.0);
            for joint in 0..21 {
                let (got, expected) = (at(NEXT + joint) + at(ANGLES + joint), mine.angle(&next, joint));
                assert!((got - expected).abs() < 1e-4, "joint {joint}: {got} rad, expected {expected}");
            }
        }
    }
}

#[test]
fn clips_that_are_no_gaits_are_refused() {
    let refused =
        |option: &str, value: Clips| env(CONTROLLER, &Options::new().with(option, value)).err().expect("refused");
    let named = |option, names| refused(option, Clips::named(names));
    let cases = [
        (named("walk", "wakl"), "option walk is 'wakl', expected a clip that is known; did you mean 'walk'?"),
        (named("walk", "walk,run"), "option walk has 2 clips, expected one"),
        (named("run", "all"), "option run has 16 clips, expected one"),
        (named("run", "kick"), "option run is 'kick', a clip that ends, expected one that loops"),
        (named("walk", "stand"), "option walk is 'stand', a clip of 0.08 m/s, expected at least 0.2 m/s"),
        (named("walk", "run"), "expected a run that is faster than the walk"),
    ];
    for (error, expected) in cases {
        assert!(error.contains(expected), "{error}");
    }
    let layout = marathon_motion::Layout::new([("hip".into(), marathon_motion::JointKind::Hinge)]);
    let about = About { name: "foreign".into(), ..About::default() };
    let foreign = Clip::new(Path::new("foreign"), about, layout, 0.1, None, &[vec![0.0], vec![0.1]]).unwrap();
    let error = refused("walk", [NamedClip::from(foreign)].into_iter().collect());
    assert!(error.contains("foreign") && error.contains("joint"), "{error}");
}
