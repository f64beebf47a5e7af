//! A character that is saved and restored, or that sleeps and wakes up, continues with the bits that it would have had. No other
//! character changes a bit.

use crate::common::{app, policy, run_until};
use bevy::prelude::*;
use bevy_marathon::prelude::*;
use std::time::Duration;

/// A stream of random numbers for the test (splitmix64).
struct Random(u64);

impl Random {
    fn below(&mut self, limit: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (x ^ (x >> 31)) % limit
    }
}

/// An app in which a tick is a decision of this agent, and some characters of it.
fn crowd(agent: &str, number: u64) -> (App, Vec<Entity>) {
    let dt = marathon_envs::factory(agent, marathon_physics::lanes::Isa::best()).expect("it is an agent").spec().dt;
    let mut app = app(Duration::from_secs_f64(dt));
    app.insert_resource(Time::<Fixed>::from_duration(Duration::from_secs_f64(dt)));
    let policy = policy(agent);
    let policy = CharacterPolicy(app.world_mut().resource_mut::<Assets<PolicyAsset>>().add(policy));
    let spawn = |i| app.world_mut().spawn((Ragdoll::agent(agent).with_seed(3, i), policy.clone())).id();
    let all: Vec<Entity> = (0..number).map(spawn).collect();
    run_until(&mut app, 9, "the characters", |world| world.get::<RagdollState>(all[0]).is_some());
    (app, all)
}

fn key(app: &App, ragdoll: Entity) -> RagdollState {
    *app.world().get::<RagdollState>(ragdoll).expect("it is simulated")
}

/// Everything that can be read of a character, bit by bit.
fn bits(app: &App, ragdoll: Entity) -> Vec<u64> {
    let state = app.world().resource::<Marathon>().state(&key(app, ragdoll)).expect("it has a state");
    let episode = app.world().get::<Episode>(ragdoll).expect("it has an episode");
    let mut bits: Vec<u64> =
        state.qpos.iter().chain(&state.qvel).chain(&episode.command).map(|x| x.to_bits()).collect();
    bits.extend(episode.action.iter().chain(&episode.info).map(|x| u64::from(x.to_bits())));
    bits.extend([episode.number, episode.decisions, episode.total.to_bits(), u64::from(episode.feet)]);
    bits
}

/// Whether a free body is upside down, as in the middle of a backflip.
fn is_upside_down(app: &App, ragdoll: Entity) -> bool {
    let state = app.world().resource::<Marathon>().state(&key(app, ragdoll)).expect("it has a state");
    let [x, y] = [state.qpos[4], state.qpos[5]];
    1.0 - 2.0 * (x * x + y * y) < -0.5
}

/// The inputs of a character at a tick of its own life: it runs, turns, jumps, flips, and is pushed.
fn play(app: &mut App, number: usize, ragdoll: Entity, tick: usize) {
    let phase = tick + 13 * number;
    if let Some(mut command) = app.world_mut().get_mut::<AgentCommand>(ragdoll)
        && phase.is_multiple_of(20)
    {
        let flips = (phase / 20).is_multiple_of(3);
        for (name, value) in [("speed", if flips { 0.0 } else { 2.0 }), ("turn", 0.5), ("jump", 0.0), ("backflip", 0.0)]
        {
            command.set(name, value).expect("it takes this command");
        }
        match (flips, phase / 20 % 3) {
            (true, _) => command.set("backflip", 1.0).expect("it flips"),
            (_, 1) => command.set("jump", 1.0).expect("it jumps"),
            _ => {}
        }
    }
    if phase % 31 == 5 {
        let force = Vec3::new(40.0, 0.0, if number.is_multiple_of(2) { 60.0 } else { -60.0 });
        app.world_mut().write_message(Push { ragdoll, body: 1, force, at: None, seconds: 0.3 });
    }
}

/// Saves random characters, plays on, and restores them, so often. Each tick of each life must have the bits of an
/// undisturbed run. Returns how many times one was seen upside down.
fn restores_keep_bits(agent: &str, restores: usize) -> usize {
    const TICKS: usize = 260;
    let all_bits = |app: &App, all: &[Entity]| all.iter().map(|ragdoll| bits(app, *ragdoll)).collect::<Vec<_>>();
    let (mut undisturbed, all) = crowd(agent, 18);
    let mut expected = vec![all_bits(&undisturbed, &all)];
    let mut upside_down = 0;
    for tick in 0..TICKS {
        all.iter().enumerate().for_each(|(i, ragdoll)| play(&mut undisturbed, i, *ragdoll, tick));
        undisturbed.update();
        upside_down += all.iter().filter(|ragdoll| is_upside_down(&undisturbed, **ragdoll)).count();
        expected.push(all_bits(&undisturbed, &all));
    }
    let ends = expected.last().expect("it has run");
    assert!(ends.iter().enumerate().all(|(i, bits)| *bits != expected[TICKS - 1][i]), "they move");

    let mut random = Random(7);
    let mut restored = 0;
    while restored < restores {
        let (mut app, all) = crowd(agent, 18);
        let mut lives = vec![0; all.len()];
        let mut saved: Vec<(usize, usize, RagdollSnapshot, Option<AgentCommand>)> = Vec::new();
        while lives.iter().all(|tick| *tick < TICKS) && restored < restores {
            for (i, ragdoll) in all.iter().enumerate() {
                play(&mut app, i, *ragdoll, lives[i]);
            }
            app.update();
            for (i, tick) in lives.iter_mut().enumerate() {
                *tick += 1;
                assert_eq!(bits(&app, all[i]), expected[*tick][i], "{agent} {i}, tick {tick}, {restored} restores");
            }
            for _ in 0..2 {
                let i = random.below(18) as usize;
                let key = key(&app, all[i]);
                let snapshot = app.world_mut().resource_mut::<Marathon>().save(&key).expect("it is simulated");
                saved.push((i, lives[i], snapshot, app.world().get::<AgentCommand>(all[i]).cloned()));
            }
            if saved.len() > 12 {
                for _ in 0..2 {
                    let (i, tick, snapshot, command) = saved.swap_remove(random.below(saved.len() as u64) as usize);
                    // every other one goes through bytes
                    let snapshot = match restored % 2 {
                        0 => snapshot,
                        _ => RagdollSnapshot::from_bytes(&snapshot.to_bytes()).expect("its own bytes"),
                    };
                    let key = key(&app, all[i]);
                    app.world_mut().resource_mut::<Marathon>().restore(&key, &snapshot).expect("the same character");
                    if let Some(command) = command {
                        app.world_mut().entity_mut(all[i]).insert(command);
                    }
                    lives[i] = tick;
                    restored += 1;
                }
            }
        }
    }
    upside_down
}

#[test]
fn a_thousand_restores_of_jumping_and_flipping_men_change_no_bit() {
    let upside_down = restores_keep_bits("MarathonManController", 1000);
    assert!(upside_down > 50, "they flip: upside down {upside_down} times");
}

#[test]
fn restored_ants_change_no_bit() {
    restores_keep_bits("ant", 300);
}

/// A tick of the fixed clock, as Bevy runs it.
fn tick(app: &mut App) {
    let step = app.world().resource::<Time<Fixed>>().timestep();
    app.world_mut().resource_mut::<Time<Fixed>>().advance_by(step);
    let time = app.world().resource::<Time<Fixed>>().as_generic();
    app.insert_resource(time);
    app.world_mut().run_schedule(FixedUpdate);
}

/// Rollback of the whole simulation, at a timestep that is no multiple of a decision, with all commands replayed.
#[test]
fn rolled_back_ticks_show_the_same_poses() {
    let (mut app, all) = crowd("MarathonManController", 5);
    app.insert_resource(Time::<Fixed>::from_hz(64.0));
    let place = |app: &App, ragdoll: Entity| {
        let now = app.world().resource::<Time<Fixed>>().elapsed();
        app.world().resource::<Marathon>().places(&key(app, ragdoll), now).expect("it is shown")
    };
    let mut random = Random(1);
    for start in (0..400).step_by(8) {
        let clock = *app.world().resource::<Time<Fixed>>();
        let commands: Vec<AgentCommand> =
            all.iter().map(|r| app.world().get::<AgentCommand>(*r).expect("it takes commands").clone()).collect();
        let snapshot = app.world_mut().resource_mut::<Marathon>().save_all();
        assert_eq!(snapshot.len(), 5);
        let ahead = 8 + random.below(8) as usize;
        let mut first = Vec::new();
        for round in 0..2 {
            for step in 0..ahead {
                all.iter().enumerate().for_each(|(i, ragdoll)| play(&mut app, i, *ragdoll, start + step));
                tick(&mut app);
                let now: Vec<_> = all.iter().map(|ragdoll| (place(&app, *ragdoll), bits(&app, *ragdoll))).collect();
                match round {
                    0 => first.push(now),
                    _ => assert!(first[step] == now, "tick {step} after {start}"),
                }
                if round == 1 && step == 7 {
                    break;
                }
            }
            if round == 0 {
                app.insert_resource(clock);
                assert_eq!(app.world_mut().resource_mut::<Marathon>().restore_all(&snapshot).expect("its own"), 5);
                for (ragdoll, command) in all.iter().zip(&commands) {
                    app.world_mut().entity_mut(*ragdoll).insert(command.clone());
                }
                let again = app.world_mut().resource_mut::<Marathon>().save_all();
                assert_eq!(again.checksum(), snapshot.checksum());
            }
        }
    }
}

#[test]
fn wrong_snapshots_are_named_and_change_nothing() {
    let (mut app, all) = crowd("hopper", 2);
    let ant = app.world_mut().spawn(Ragdoll::agent("ant")).id();
    let hills = app.world_mut().spawn(Ragdoll::agent("hopper").on(Ground::Hills)).id();
    app.update();
    let keys = [all[0], ant, hills].map(|ragdoll| key(&app, ragdoll));
    let mut marathon = app.world_mut().resource_mut::<Marathon>();
    let [hopper, other, uphill] = keys.map(|key| marathon.save(&key).expect("it is simulated"));
    let before = marathon.save_all().checksum();
    let good = hopper.to_bytes();
    let complaint = |error: SnapshotError| error.to_string();
    let wrong = marathon.restore(&keys[0], &other).expect_err("another agent");
    assert_eq!(complaint(wrong), "the snapshot is of 'Ant-v0', expected 'Hopper-v0'");
    let wrong = marathon.restore(&keys[0], &uphill).expect_err("another ground");
    let expected = "the snapshot is of 'Hopper-v0' with other task options, another clip or another ground";
    assert_eq!(complaint(wrong), expected);
    let older = [b"MRTHNr00", &good[8..]].concat();
    let mut damaged = good.clone();
    damaged[100] ^= 4;
    for (bytes, expected) in [
        (&older, "the format of the snapshot is 'MRTHNr00', expected 'MRTHNr01': it was saved by another version"),
        (&damaged, "the snapshot is damaged or cut short: its checksum is"),
        (&good[..good.len() - 1].to_vec(), "the snapshot is damaged or cut short: its checksum is"),
        (&b"a picture".to_vec(), "9 bytes that do not begin with the mark 'MRTHNr01' of a ragdoll's snapshot"),
        (&Vec::new(), "0 bytes that do not begin with the mark"),
    ] {
        let error = RagdollSnapshot::from_bytes(bytes).expect_err("wrong bytes").to_string();
        assert!(error.starts_with(expected), "{error}");
    }
    assert_eq!(marathon.save_all().checksum(), before);
    assert!(app.world_mut().despawn(all[0]));
    let mut marathon = app.world_mut().resource_mut::<Marathon>();
    let gone = marathon.restore(&keys[0], &hopper).expect_err("it has left");
    assert_eq!(complaint(gone), "the ragdoll has left the simulation");
}

/// A twin: another ragdoll of the kind, in another batch, takes the state over.
#[test]
fn another_character_of_the_kind_can_take_a_state_over() {
    let (mut app, all) = crowd("hopper", 40);
    (0..60).for_each(|_| app.update());
    let [from, to] = [all[2], all[37]].map(|ragdoll| key(&app, ragdoll));
    let mut marathon = app.world_mut().resource_mut::<Marathon>();
    let snapshot = marathon.save(&from).expect("it is simulated");
    marathon.restore(&to, &snapshot).expect("the same kind");
    for _ in 0..200 {
        app.update();
        assert_eq!(bits(&app, all[2]), bits(&app, all[37]));
    }
}

/// Half of two batches falls asleep, so that the others are gathered in one, and wakes up.
#[test]
fn sleepers_continue_and_the_others_do_not_notice() {
    const NAP: std::ops::Range<usize> = 40..130;
    let (mut plain, all) = crowd("ant", 32);
    let (mut napping, same) = crowd("ant", 32);
    assert_eq!(all, same);
    let sleeps = |i: usize| i.is_multiple_of(2) || i > 27;
    let mut expected = vec![Vec::new(); 32];
    for now in 0..250 {
        for (_, ragdoll) in same.iter().enumerate().filter(|(i, _)| sleeps(*i)) {
            let lod = if NAP.contains(&now) { Lod::Asleep } else { Lod::Full };
            napping.world_mut().entity_mut(*ragdoll).insert(lod);
            if NAP.contains(&now) {
                let push = Push { ragdoll: *ragdoll, body: 1, force: Vec3::Y * 900.0, at: None, seconds: 1.0 };
                napping.world_mut().write_message(push);
            }
        }
        plain.update();
        let before = napping.world().resource::<Marathon>().decisions();
        napping.update();
        let decisions = napping.world().resource::<Marathon>().decisions() - before;
        let awake = (0..32).filter(|i| !(NAP.contains(&now) && sleeps(*i))).count();
        assert_eq!(decisions, awake as u64, "tick {now}");
        for (i, ragdoll) in same.iter().enumerate() {
            expected[i].push(bits(&plain, *ragdoll));
            let own = match now {
                now if sleeps(i) && NAP.contains(&now) => NAP.start - 1,
                now if sleeps(i) && now >= NAP.end => now - NAP.len(),
                now => now,
            };
            assert_eq!(bits(&napping, *ragdoll), expected[i][own], "ant {i}, tick {now}");
        }
    }
    let lanes: Vec<RagdollState> = same.iter().map(|ragdoll| key(&napping, *ragdoll)).collect();
    assert!(
        lanes.iter().enumerate().any(|(i, lane)| format!("{lane:?}") != format!("{:?}", key(&plain, all[i]))),
        "some have moved"
    );
}

#[test]
fn at_half_rate_actions_are_held_and_the_others_do_not_notice() {
    let (mut plain, all) = crowd("ant", 4);
    let (mut half, _) = crowd("ant", 4);
    half.world_mut().entity_mut(all[1]).insert(Lod::HalfRate);
    let mut actions = Vec::new();
    for _ in 0..100 {
        plain.update();
        half.update();
        for other in [0, 2, 3] {
            assert_eq!(bits(&plain, all[other]), bits(&half, all[other]));
        }
        let episode = half.world().get::<Episode>(all[1]).expect("it has an episode");
        actions.push((episode.number, episode.decisions, episode.action.clone()));
    }
    let held = |pair: &&[(u64, u64, Vec<f32>)]| pair[0].0 == pair[1].0 && pair[1].1.is_multiple_of(2);
    let pairs: Vec<_> = actions.windows(2).filter(held).collect();
    assert!(pairs.len() > 40 && pairs.iter().all(|pair| pair[0].2 == pair[1].2), "each action is held once");
    let changed = actions.windows(2).filter(|pair| pair[1].1 % 2 == 1 && pair[0].2 != pair[1].2).count();
    assert!(changed > 40, "{changed} new actions");
}

#[test]
fn the_distance_to_a_camera_sets_the_level() {
    let (mut app, all) = crowd("hopper", 1);
    let by = LodByDistance { half_rate: 10.0, asleep: 30.0, hysteresis: 2.0 };
    let camera = app.world_mut().spawn((by, Transform::default())).id();
    for (distance, expected) in [
        (5.0, Lod::Full),
        (11.5, Lod::HalfRate),
        (9.0, Lod::HalfRate),
        (6.5, Lod::Full),
        (40.0, Lod::Asleep),
        (29.0, Lod::Asleep),
        (27.0, Lod::HalfRate),
        (0.0, Lod::Full),
    ] {
        let mut track = app.world_mut().get_mut::<Transform>(camera).expect("it has a place");
        track.translation = Vec3::new(0.0, 0.0, distance);
        // the hopper stays within a meter of its start meanwhile
        app.update();
        app.update();
        assert_eq!(app.world().get::<Lod>(all[0]), Some(&expected), "{distance} m");
    }
}
