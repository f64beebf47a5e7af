//! Saved, restored and continued equals never having stopped, for any number of threads and any width.

mod common;

use common::{go_on, isas, make, play};
use marathon_envs::{Autoreset, BLOCK, BlockStep, factory};
use marathon_physics::lanes::Isa;

const BEFORE: usize = 37;
const AFTER: usize = 90;

#[test]
fn a_restored_environment_continues_with_the_same_bits() {
    for id in marathon_envs::ids() {
        let mut env = make(&id, 20, 1, None, Autoreset::SameStep);
        let mut out = play(&mut env, BEFORE, 0.8, |_, _| {});
        let snapshot = env.save();
        let mut uninterrupted = Vec::new();
        go_on(&mut env, &mut out, BEFORE, AFTER, 0.8, |_, step| uninterrupted.push(step.clone()));

        // in the same environment, and in new ones that have other seeds, threads and widths
        let mut others = vec![env, make(&id, 20, 2, None, Autoreset::SameStep)];
        if id.ends_with("-v0") || id == "Humanoid-v5" {
            others.extend(
                isas().filter(|isa| *isa != Isa::F64).map(|isa| make(&id, 20, 1, Some(isa), Autoreset::SameStep)),
            );
        }
        for mut other in others {
            other.load(&snapshot).unwrap();
            assert_eq!(other.save(), snapshot, "{id}: saving what was loaded");
            let mut out = other.buffers();
            let mut again = Vec::new();
            go_on(&mut other, &mut out, BEFORE, AFTER, 0.8, |_, step| again.push(step.clone()));
            assert!(again == uninterrupted, "{id}: the restored environment went another way");
        }
    }
}

/// A block's bytes hold the agents themselves, so they may be loaded into another block of another shard.
#[test]
fn a_block_can_move() {
    let factory = factory("ant", Isa::best()).unwrap();
    let spec = factory.spec().clone();
    let mut a = factory.shard(0, 2, 1);
    let mut b = factory.shard(7, 1, 99);
    let mut obs = vec![0.0; spec.obs * BLOCK];
    a.reset(1, 0xffff, &mut obs);
    let mut bytes = vec![42];
    a.save(1, &mut bytes);
    bytes.push(43);
    assert_eq!(b.load(0, &bytes[1..]).unwrap(), [43]);
    assert!(b.load(0, &bytes[2..bytes.len() - 1]).is_none(), "one byte too few");
    assert!(b.load(0, &bytes[1..bytes.len() - 1]).unwrap().is_empty());

    let action = vec![0.25; spec.act * BLOCK];
    let (mut here, mut there) = (BlockStep::default(), BlockStep::default());
    let mut obs_there = obs.clone();
    for _ in 0..30 {
        a.step(1, &action, &mut obs, &mut here);
        b.step(0, &action, &mut obs_there, &mut there);
        a.reset(1, here.terminated | here.truncated, &mut obs);
        b.reset(0, there.terminated | there.truncated, &mut obs_there);
        assert_eq!(obs, obs_there);
        assert_eq!(here.reward, there.reward);
    }
}

#[test]
fn a_wrong_snapshot_is_refused_and_changes_nothing() {
    let mut env = make("hopper", 3, 1, None, Autoreset::SameStep);
    play(&mut env, 5, 0.5, |_, _| {});
    let good = env.save();
    let other_agent = make("walker", 3, 1, None, Autoreset::SameStep).save();
    let other_number = make("hopper", 4, 1, None, Autoreset::SameStep).save();
    for (bytes, complaint) in [
        (&good[..good.len() - 1], "bytes, expected"),
        (&[], "it does not begin like one of 3 agents of 'Hopper-v0'"),
        (&other_agent, "it does not begin like"),
        (&other_number, "it does not begin like"),
    ] {
        let error = env.load(bytes).unwrap_err().to_string();
        assert!(error.contains(complaint), "{error}");
        assert_eq!(env.save(), good);
    }
}
