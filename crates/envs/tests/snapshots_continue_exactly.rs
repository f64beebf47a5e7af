//! An environment that is saved, restored and continued equals one that never stopped, for any number of threads and
//! any width.

use std::sync::Arc;

use crate::common::{go_on, isas, make, play};
use marathon_envs::memory::Average;
use marathon_envs::{
    Agent, Autoreset, BLOCK, BlockStep, Facts, ModelSource, Obs, Part, Registry, ResetNoise, Senses, Start, Step,
    Terms, VecEnv, VecEnvOptions, factory, names,
};
use marathon_physics::lanes::{Isa, Real};

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

        // in the same environment, and in new ones with other seeds, threads and widths
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

/// A block's bytes hold the complete agents, so another block of another shard can load them.
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
    assert!(b.load(0, &bytes[1..bytes.len() - 2]).is_err(), "one byte too few");
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
    let longer = [&good[..], &[0]].concat();
    let [older, newer] = [b"MRTHNv02", b"MRTHNv99"].map(|mark| [mark, &good[8..]].concat());
    for (bytes, complaint) in [
        (&good[..good.len() - 1], "it is damaged or cut short: its checksum is"),
        (&longer, "it is damaged or cut short: its checksum is"),
        (&[], "it has 0 bytes, expected a snapshot of an environment"),
        (b"something else altogether", "it does not begin with the mark of an environment"),
        (&older, "its format is 'MRTHNv02', expected 'MRTHNv03': it was saved by another version of Marathon"),
        (&newer, "its format is 'MRTHNv99', expected 'MRTHNv03': it was saved by another version of Marathon"),
        (&other_agent, "it has 3 agents of 'Walker2d-v0', expected 3 of 'Hopper-v0'"),
        (&other_number, "it has 4 agents of 'Hopper-v0', expected 3 of 'Hopper-v0'"),
    ] {
        let error = env.load(bytes).unwrap_err().to_string();
        assert!(error.contains(complaint), "{error}");
        assert_eq!(env.save(), good);
    }
}

#[test]
fn a_damaged_byte_is_found_wherever_it_is() {
    let mut env = make("hopper", 3, 1, None, Autoreset::SameStep);
    play(&mut env, 5, 0.5, |_, _| {});
    let good = env.save();
    let mut bytes = good.clone();
    for at in 0..good.len() {
        bytes[at] ^= 1 << (at % 8);
        assert!(env.load(&bytes).is_err(), "byte {at} of {} is not what was saved", good.len());
        bytes[at] = good[at];
    }
    assert!(env.save() == good, "nothing has changed");
}

/// A snapshot with a valid checksum but invalid blocks is rejected, and the environment does not change.
#[test]
fn blocks_that_do_not_fit_are_refused_and_change_nothing() {
    let mut env = make("hopper", 20, 1, None, Autoreset::SameStep);
    play(&mut env, 5, 0.5, |_, _| {});
    let good = env.save();
    let sealed = |body: &[u8]| [&good[..8], &crc32fast::hash(body).to_le_bytes(), body].concat();
    let body = &good[12..];
    assert!(sealed(body) == good);
    let marks: Vec<usize> = (0..body.len()).filter(|at| body[*at..].starts_with(b"MRTHNb04")).collect();
    assert_eq!(marks.len(), 2, "a block for every sixteen agents");
    let mut older = body.to_vec();
    older[marks[1]..][..8].copy_from_slice(b"MRTHNb03");
    let mut unmarked = body.to_vec();
    unmarked.drain(marks[1]..marks[1] + 8);
    for (body, complaint) in [
        (&body[..body.len() - 1], "it ends too early"),
        (&[body, &[0]].concat(), "it has 1 bytes after its end"),
        (
            &older,
            "the format of its agents is 'MRTHNb03', expected 'MRTHNb04': it was saved by another version of Marathon",
        ),
        (&unmarked, "it does not begin with the mark of a block of agents"),
    ] {
        // a state other than the saved one
        play(&mut env, 3, 0.5, |_, _| {});
        let before = env.save();
        let error = env.load(&sealed(body)).unwrap_err().to_string();
        assert!(error.contains(complaint), "{error}");
        assert!(env.save() == before, "nothing has changed");
    }
}

/// A creature that uses everything a snapshot must include: muscles with a delay, its own ground, and starts that need
/// physics.
const MODEL: &str = r#"
<mujoco model="beetle">
  <option timestep="0.005"/>
  <asset>
    <hfield name="hills" nrow="5" ncol="5" size="3 3 0.3 0.1"/>
  </asset>
  <worldbody>
    <geom name="ground" type="hfield" hfield="hills"/>
    <body name="shell" pos="0 0 0.5">
      <freejoint/>
      <geom name="shell" size="0.15"/>
      <body name="leg" pos="0.2 0 0">
        <joint name="hip" axis="0 1 0" range="-60 60" damping="0.2"/>
        <geom name="leg" type="capsule" fromto="0 0 0 0.3 0 -0.2" size="0.05"/>
      </body>
      <body name="tail" pos="-0.2 0 0">
        <joint name="root" axis="0 1 0" range="-60 60" damping="0.2"/>
        <geom name="tail" type="capsule" fromto="0 0 0 -0.3 0 -0.2" size="0.05"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <general name="hip" joint="hip" dyntype="filter" dynprm="0.2" gainprm="8" ctrlrange="-1 1" ctrllimited="true"/>
    <general name="root" joint="root" dyntype="integrator" gainprm="3" ctrlrange="-1 1" ctrllimited="true"/>
  </actuator>
</mujoco>"#;

#[derive(Clone)]
struct Beetle;

impl Agent for Beetle {
    fn facts(&self) -> Facts {
        Facts {
            id: "Beetle-v0".into(),
            model: ModelSource::Text(MODEL.into()),
            frame_skip: 4,
            max_episode_steps: 60,
            reward_terms: names(["speed"]),
            parts: names(["shell"]),
            memory: Average::SLOTS,
            termination_reward: None,
            ..Facts::default()
        }
    }

    fn reset(&self, start: &mut Start) {
        start.add_noise(ResetNoise { joint_position: 0.3, joint_velocity: 0.5, root_velocity: 0.5 });
        start.settle = 7;
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let shell = Part::named(&["shell"], "shell");
        out.vector(s.position(shell));
        out.vector(s.linear_velocity(shell));
        out.joint_velocities(s);
        out.scalar(s.memory(Average::MEAN));
    }

    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        Average::update(memory, s.velocity(Part::named(&["shell"], "shell")));
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        terms.add("speed", 1.0, s.velocity(Part::named(&["shell"], "shell")));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        s.terminate_never()
    }
}

fn beetles() -> Registry {
    let mut registry = Registry::default();
    registry.register(Arc::new(Beetle)).unwrap_or_else(|e| panic!("{e}"));
    registry
}

fn beetle(agents: usize, seed: u64, threads: usize, isa: Option<Isa>) -> VecEnv {
    let options = VecEnvOptions { agents, seed, threads, isa, ..Default::default() };
    VecEnv::from_registry(&beetles(), "Beetle-v0", &options).unwrap_or_else(|e| panic!("{e}"))
}

/// Sets commands, pushes, variations and ground of some agents.
fn make_different(env: &mut VecEnv) {
    let mut own = env.unvaried().clone();
    own.mass.fill(1.7);
    own.friction = 0.4;
    own.strength.fill(0.6);
    own.gravity = [0.3, 0.0, -6.0];
    for agent in [1, 17, 30] {
        env.vary(agent, &own).expect("a sound variation");
    }
    for agent in [2, 18, 33] {
        env.push(agent, 1, [4.0, 1.0, 2.0], [0.1, 0.0, 0.2]).expect("a body that there is");
    }
    for agent in [3, 19, 39] {
        let hills: Vec<f32> = (0..25).map(|k| 0.04 * (k % 7) as f32).collect();
        env.set_ground(agent, 0, &hills).expect("the field's grid");
    }
}

/// Executes more decisions and returns all results.
fn story(env: &mut VecEnv, from: usize) -> Vec<Step> {
    let mut out = env.buffers();
    let mut seen = Vec::new();
    go_on(env, &mut out, from, AFTER, 1.0, |_, step| seen.push(step.clone()));
    seen
}

#[test]
fn what_an_agent_has_of_its_own_is_in_the_snapshot() {
    const N: usize = 40;
    let mut env = beetle(N, 11, 1, None);
    let mut out = env.buffers();
    env.reset(Some(5), &mut out.obs).expect("the array fits");
    go_on(&mut env, &mut out, 0, 10, 1.0, |_, _| {});
    make_different(&mut env);
    go_on(&mut env, &mut out, 10, BEFORE, 1.0, |_, _| {});
    let snapshot = env.save();
    let uninterrupted = story(&mut env, BEFORE);

    // each of these inputs matters: without any one of them the agent moves differently
    let mut plain = beetle(N, 11, 1, None);
    plain.reset(Some(5), &mut out.obs).expect("the array fits");
    go_on(&mut plain, &mut out, 0, BEFORE, 1.0, |_, _| {});
    let plain = story(&mut plain, BEFORE);
    let last = |seen: &[Step], agent: usize| seen[5].obs.chunks(9).nth(agent).expect("there are 40").to_vec();
    for agent in 0..N {
        let own = [1, 17, 30, 2, 18, 33, 3, 19, 39].contains(&agent);
        assert_eq!(last(&plain, agent) == last(&uninterrupted, agent), !own, "agent {agent}");
    }

    // into environments with other states, inputs, seeds, threads and widths
    let mut others = vec![env, beetle(N, 2, 3, None)];
    others.extend(isas().filter(|isa| *isa != Isa::F64).map(|isa| beetle(N, 1, 2, Some(isa))));
    for mut other in others {
        let mut out = other.buffers();
        other.reset(None, &mut out.obs).expect("the array fits");
        let mut own = other.unvaried().clone();
        own.mass.fill(0.5);
        other.vary(0, &own).expect("a sound variation");
        other.set_ground(1, 0, &[0.2; 25]).expect("the field's grid");
        go_on(&mut other, &mut out, 0, 3, 0.5, |_, _| {});
        other.push(4, 1, [9.0; 3], [0.0; 3]).expect("a body that there is");
        other.load(&snapshot).unwrap_or_else(|e| panic!("{e}"));
        assert!(other.save() == snapshot, "saving what was loaded");
        assert!(story(&mut other, BEFORE) == uninterrupted, "the restored environment went another way");
    }
}

/// Sixteen agents with their own inputs move to another slot of another shard.
#[test]
fn a_block_moves_with_what_its_agents_have_of_their_own() {
    let shards = beetles().shards("Beetle-v0", Isa::best()).unwrap_or_else(|e| panic!("{e}"));
    let mut a = shards.agent_shard(0, 2, 1);
    let mut b = shards.agent_shard(7, 3, 99);
    let mut obs = vec![0.0; a.spec().obs * BLOCK];
    a.reset(1, 0xffff, &mut obs);
    let mut own = shards.unvaried();
    own.strength.fill(0.3);
    a.context(20).vary(&own).expect("a sound variation");
    a.context(21).push(1, [3.0, 0.0, 1.0], [0.0; 3]).expect("a body that there is");
    a.context(22).set_ground(0, &[0.1; 25]).expect("the field's grid");
    let action = vec![0.25; a.spec().act * BLOCK];
    let (mut here, mut there) = (BlockStep::default(), BlockStep::default());
    let mut obs_there = obs.clone();
    for decision in 0..40 {
        if decision == 10 {
            let mut bytes = Vec::new();
            a.save(1, &mut bytes);
            assert!(b.load(2, &bytes).unwrap_or_else(|e| panic!("{e}")).is_empty());
        }
        a.step(1, &action, &mut obs, &mut here);
        b.step(2, &action, &mut obs_there, &mut there);
        if decision >= 10 {
            assert_eq!(obs, obs_there);
            assert_eq!(here.reward, there.reward);
        }
    }
}

/// One agent moves to another number of another environment, with other neighbors, threads and widths. Neither its new
/// neighbors nor the agent change a bit.
#[test]
fn an_agent_continues_among_others() {
    for id in ["Hopper-v0", "MarathonManController-v0", "Ant-v0"] {
        let mut env = make(id, 20, 1, None, Autoreset::SameStep);
        play(&mut env, BEFORE, 0.8, |_, _| {});
        let saved = env.save_agent(17).expect("there are 20");
        assert_eq!(env.save_agent(17).expect("there are 20"), saved);
        let others = isas().filter(|isa| *isa != Isa::F64).map(|isa| make(id, 40, 2, Some(isa), Autoreset::SameStep));
        for mut other in others {
            play(&mut other, 9, 0.5, |_, _| {});
            let neighbors = [1, 2, 4, 20].map(|agent| other.save_agent(agent).expect("there are 40"));
            other.load_agent(3, &saved).unwrap_or_else(|e| panic!("{e}"));
            assert!(other.save_agent(3).expect("there are 40") == saved, "{id}: saving what was loaded");
            let unchanged = [1, 2, 4, 20].map(|agent| other.save_agent(agent).expect("there are 40"));
            assert!(unchanged == neighbors, "{id}: its neighbors changed");
            // the same actions for both from here on
            let mut here = make(id, 20, 1, None, Autoreset::SameStep);
            play(&mut here, BEFORE, 0.8, |_, _| {});
            let act = env.spec().act;
            let (mut ours, mut theirs) = (here.buffers(), other.buffers());
            for decision in 0..AFTER {
                let action: Vec<f32> = (0..act).map(|k| 0.7 * ((decision * 7 + k * 3) as f32).sin()).collect();
                let at = |agent: usize, agents: usize| {
                    let mut all = vec![0.0; agents * act];
                    all[agent * act..][..act].copy_from_slice(&action);
                    all
                };
                here.step(&at(17, 20), &mut ours).expect("the arrays fit");
                other.step(&at(3, 40), &mut theirs).expect("the arrays fit");
                let n = env.spec().obs;
                assert!(ours.obs[17 * n..18 * n] == theirs.obs[3 * n..4 * n], "{id}: decision {decision}");
                assert_eq!(ours.reward[17].to_bits(), theirs.reward[3].to_bits(), "{id}: decision {decision}");
            }
        }
    }
}

#[test]
fn a_wrong_agent_is_refused_and_changes_nothing() {
    let mut env = make("hopper", 3, 1, None, Autoreset::SameStep);
    play(&mut env, 5, 0.5, |_, _| {});
    let (good, before) = (env.save_agent(1).expect("there are 3"), env.save());
    let walker = make("walker", 1, 1, None, Autoreset::SameStep).save_agent(0).expect("there is one");
    let older = [b"MRTHNa00", &good[8..]].concat();
    for (bytes, complaint) in [
        (&good[..good.len() - 1], "it is damaged or cut short: its checksum is"),
        (&[], "it has 0 bytes, expected a snapshot of an agent"),
        (&before, "it does not begin with the mark of an agent"),
        (&older, "its format is 'MRTHNa00', expected 'MRTHNa01': it was saved by another version of Marathon"),
        (&walker, "it is an agent of 'Walker2d-v0', expected one of 'Hopper-v0'"),
    ] {
        let error = env.load_agent(1, bytes).unwrap_err().to_string();
        assert!(error.contains(complaint), "{error}");
        assert!(env.save() == before, "nothing has changed");
    }
    assert!(env.load_agent(3, &good).unwrap_err().to_string().contains("less than the number of agents"));
    assert!(env.save_agent(3).is_err());
}
