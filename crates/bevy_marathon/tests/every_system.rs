//! The systems of the plugin, one by one, in an app without a window.

use crate::common::{self, Log, app, policy, run_until};
use bevy::prelude::*;
use bevy_marathon::axes::to_game;
use bevy_marathon::prelude::*;
use marathon_render::Scene;
use std::time::Duration;

const FRAME: Duration = Duration::from_millis(10);

fn with_policy(app: &mut App, agent: &str) -> CharacterPolicy {
    CharacterPolicy(app.world_mut().resource_mut::<Assets<PolicyAsset>>().add(policy(agent)))
}

fn frames(app: &mut App, seconds: f64) {
    for _ in 0..(seconds / FRAME.as_secs_f64()).round() as usize {
        app.update();
    }
}

#[test]
fn a_ragdoll_runs_and_its_feet_are_heard() {
    let mut app = app(FRAME);
    let policy = with_policy(&mut app, "hopper");
    let ragdoll = app.world_mut().spawn((Ragdoll::agent("hopper"), policy)).id();
    frames(&mut app, 5.0);
    let episode = app.world().get::<Episode>(ragdoll).expect("it is there").clone();
    assert!(episode.distance > 5.0 && episode.speed > 1.0, "{episode:?}");
    let anatomy = app.world().get::<Anatomy>(ragdoll).expect("it has been built").clone();
    assert_eq!(&*anatomy.feet[0], "foot");
    assert_eq!(episode.terms.len(), anatomy.spec.as_ref().map_or(0, |s| s.reward_terms.len()));
    let feet = &app.world().resource::<Log>().feet;
    let foot: Vec<bool> = feet.iter().filter(|f| f.foot == 0).map(|f| f.down).collect();
    assert!(foot.len() > 6, "it has taken steps: {foot:?}");
    assert!(foot.windows(2).all(|w| w[0] != w[1]), "down and up take turns");
    // its parts are where the physics says, at most a decision ago
    let torso = anatomy.part("torso").or(anatomy.parts.get(1).copied()).expect("it has bodies");
    let at = app.world().get::<GlobalTransform>(torso).expect("it has a place").translation();
    let state = app.world().get::<RagdollState>(ragdoll).copied().expect("it is simulated");
    let qpos = app.world().resource::<Marathon>().state(&state).expect("it has a state").qpos;
    let body = anatomy.parts.iter().position(|p| *p == torso).expect("it is a part");
    let newest = Scene::pose_from_qpos(&anatomy.model, &qpos).expect("a sound state").bodies[body].pos;
    assert!(at.distance(to_game(newest)) < 0.25, "{at} and {newest:?}");
}

#[test]
fn frames_move_smoothly_between_decisions() {
    let mut app = app(Duration::from_millis(4));
    let policy = with_policy(&mut app, "hopper");
    let ragdoll = app.world_mut().spawn((Ragdoll::agent("hopper"), policy)).id();
    for _ in 0..300 {
        app.update();
    }
    let part = app.world().get::<Anatomy>(ragdoll).expect("it has been built").parts[1];
    let (mut still, mut longest) = (0, 0.0_f32);
    let mut last = None;
    for _ in 0..200 {
        app.update();
        let at = app.world().get::<GlobalTransform>(part).expect("it has a place").translation();
        if let Some(last) = last {
            let step = at.distance(last);
            still += usize::from(step == 0.0);
            longest = longest.max(step);
        }
        last = Some(at);
    }
    // decisions come every 20 ms, frames every 4: none may show the same state as the one before, none may jump
    assert_eq!(still, 0, "frames that stood still");
    assert!(longest < 0.004 * 8.0, "the longest step was {longest} m");
}

/// Where the torso is at the end of each tick.
#[derive(Resource, Default)]
struct Ticks(Vec<Vec3>);

fn follow(marathon: Res<Marathon>, time: Res<Time>, mut ticks: ResMut<Ticks>, ragdolls: Query<&RagdollState>) {
    let places = ragdolls.iter().filter_map(|ragdoll| marathon.places(ragdoll, time.elapsed()));
    ticks.0.extend(places.map(|places| places[1].translation));
}

#[test]
fn a_tick_knows_the_places_that_a_frame_does_not_show() {
    let run = |frame: Duration| {
        let mut app = app(frame);
        app.init_resource::<Ticks>().add_systems(FixedUpdate, follow.after(MarathonSystems::Report));
        let policy = with_policy(&mut app, "hopper");
        let ragdoll = app.world_mut().spawn((Ragdoll::agent("hopper"), policy)).id();
        for _ in 0..Duration::from_secs(2).div_duration_f64(frame) as usize {
            app.update();
        }
        // at the time of the frame they are what it shows
        let time = app.world().resource::<Time<Fixed>>();
        let now = time.elapsed() + time.overstep();
        let (anatomy, state, track) =
            app.world_mut().query::<(&Anatomy, &RagdollState, &Track)>().single(app.world()).expect("one");
        let places = app.world().resource::<Marathon>().places(state, now).expect("it is simulated");
        assert_eq!(places.len(), anatomy.model.bodies.len());
        for (part, place) in anatomy.parts.iter().zip(&places) {
            assert_eq!(app.world().get::<Transform>(*part), Some(&(track.inverse() * *place)));
        }
        assert!(app.world_mut().despawn(ragdoll));
        std::mem::take(&mut app.world_mut().resource_mut::<Ticks>().0)
    };
    // seven ticks a frame, or two frames a tick
    let (slow, smooth) = (run(Duration::from_millis(125)), run(Duration::from_millis(8)));
    let both = slow.len().min(smooth.len());
    assert!(both > 100 && slow[..both] == smooth[..both], "{} and {} ticks", slow.len(), smooth.len());
    let step = |w: &[Vec3]| w[0].distance(w[1]);
    let (still, longest) = (slow.windows(2).filter(|w| step(w) == 0.0).count(), slow.windows(2).map(step));
    assert!(
        still == 0
            && longest.fold(0.0, |worst, x: f32| if x.is_nan() { f32::INFINITY } else { x.max(worst) }) < 8.0 / 64.0,
        "{still} ticks stood still"
    );
}

#[test]
fn one_without_a_policy_falls_lies_and_gets_up() {
    let mut app = app(FRAME);
    let restart = Restart { after_fall: 0.5, on_time_up: false };
    let ragdoll = app.world_mut().spawn((Ragdoll::agent("walker"), restart)).id();
    run_until(&mut app, 1000, "a fall", |world| !world.resource::<Log>().ended.is_empty());
    let fall = app.world().resource::<Log>().ended[0].clone();
    assert_eq!((fall.ragdoll, fall.end), (ragdoll, End::Fell));
    assert!(app.world().get::<Episode>(ragdoll).is_some_and(|e| e.down), "it lies");
    let mut lying = 0;
    run_until(&mut app, 1000, "a new episode", |world| {
        lying += 1;
        world.resource::<Log>().began.iter().any(|b| b.number == 2)
    });
    let seconds = lying as f64 * FRAME.as_secs_f64();
    assert!((0.45..0.6).contains(&seconds), "it lay for {seconds} s");
}

#[test]
fn a_push_throws_it_over_and_a_new_episode_can_be_asked_for() {
    let mut app = app(FRAME);
    let policy = with_policy(&mut app, "hopper");
    let restart = Restart { after_fall: f64::INFINITY, on_time_up: true };
    let ragdoll = app.world_mut().spawn((Ragdoll::agent("hopper"), policy, restart)).id();
    frames(&mut app, 1.0);
    assert!(app.world().resource::<Log>().ended.is_empty(), "it does not fall by itself");
    let head = app.world().get::<Anatomy>(ragdoll).expect("it has been built").parts[1];
    let at = app.world().get::<GlobalTransform>(head).map(|t| t.translation() + Vec3::Y * 0.2);
    app.world_mut().write_message(Push { ragdoll, body: 1, force: Vec3::new(-400.0, 0.0, 0.0), at, seconds: 0.1 });
    run_until(&mut app, 500, "a fall", |world| world.resource::<Log>().ended.iter().any(|e| e.end == End::Fell));
    frames(&mut app, 1.0);
    assert!(app.world().get::<Episode>(ragdoll).is_some_and(|e| e.down && e.number == 1), "it lies for good");
    app.world_mut().write_message(RestartNow { ragdoll });
    run_until(&mut app, 10, "a new episode", |world| world.get::<Episode>(ragdoll).is_some_and(|e| e.number == 2));
}

#[test]
fn gravity_of_its_own() {
    let mut app = app(FRAME);
    let near = app.world_mut().spawn(Ragdoll::agent("ant")).id();
    let far = app.world_mut().spawn(Ragdoll::agent("ant")).id();
    frames(&mut app, 0.05);
    let model = app.world().get::<Anatomy>(far).expect("it has been built").model.clone();
    let mut variation = Variation::none(&model);
    variation.gravity = [0.0, 0.0, 3.0];
    app.world_mut().entity_mut(far).insert(Physique(variation));
    frames(&mut app, 1.0);
    let height = |app: &App, who: Entity| {
        let part = app.world().get::<Anatomy>(who).expect("it has been built").parts[1];
        app.world().get::<GlobalTransform>(part).expect("it has a place").translation().y
    };
    assert!(height(&app, near) < 1.0 && height(&app, far) > 1.5, "{} {}", height(&app, near), height(&app, far));
}

#[test]
fn it_runs_to_its_target() {
    let mut app = app(FRAME);
    let policy = with_policy(&mut app, "hopper");
    let target = Target { place: Vec3::new(3.0, 0.0, -4.0), radius: 0.3 };
    let start = Transform::from_xyz(0.0, 0.0, 2.0);
    let ragdoll = app.world_mut().spawn((Ragdoll::agent("hopper"), policy, target, start)).id();
    run_until(&mut app, 2000, "arrival", |world| !world.resource::<Log>().reached.is_empty());
    assert_eq!(app.world().resource::<Log>().reached[0], TargetReached { ragdoll, target });
}

#[test]
fn a_body_of_ones_own_is_loaded_and_driven() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir_in(common::assets())?;
    let arm = "<mujoco><include file='limb.xml'/><actuator><motor joint='elbow' gear='5'/></actuator></mujoco>";
    let limb = "<mujocoinclude><worldbody><body name='arm' pos='0 0 2'><joint name='elbow' axis='0 1 0'/>\
        <geom type='capsule' fromto='0 0 0 0.5 0 0' size='0.05'/></body></worldbody></mujocoinclude>";
    std::fs::write(folder.path().join("arm.xml"), arm)?;
    std::fs::write(folder.path().join("limb.xml"), limb)?;
    let mut app = app(FRAME);
    let name = folder.path().file_name().and_then(|n| n.to_str()).unwrap_or_default().to_string();
    let prefab: Handle<RagdollPrefab> = app.world().resource::<AssetServer>().load(format!("{name}/arm.xml"));
    let ragdoll = app.world_mut().spawn((Ragdoll::prefab(prefab), Controls(vec![4.0]))).id();
    // files are read on another thread
    run_until(&mut app, 2000, "the file", |world| {
        std::thread::sleep(Duration::from_millis(2));
        world.get::<Anatomy>(ragdoll).is_some()
    });
    frames(&mut app, 0.5);
    let state = app.world().get::<RagdollState>(ragdoll).copied().expect("it is simulated");
    let turned = app.world().resource::<Marathon>().state(&state).expect("it has a state").qvel[0];
    assert!(turned > 1.0, "the motor turns it: {turned} rad/s");
    Ok(())
}

#[test]
fn what_cannot_be_simulated_is_told() {
    let mut app = app(FRAME);
    let ragdoll = app.world_mut().spawn(Ragdoll::agent("hoper")).id();
    let wrong = with_policy(&mut app, "ant");
    let other = app.world_mut().spawn((Ragdoll::agent("hopper"), wrong)).id();
    frames(&mut app, 0.1);
    let Unfit(why) = app.world().get::<Unfit>(ragdoll).expect("it cannot be simulated");
    assert!(matches!(**why, RagdollError::Task(_)) && why.to_string().contains("did you mean 'Hopper-v0'"), "{why}");
    // one whose policy does not fit stands without one
    assert!(app.world().get::<Episode>(other).is_some_and(|e| e.action.iter().all(|a| *a == 0.0)));
}

#[test]
fn lanes_are_used_again() {
    let mut app = app(FRAME);
    for round in 0..5 {
        let all: Vec<Entity> = (0..20).map(|_| app.world_mut().spawn(Ragdoll::agent("hopper")).id()).collect();
        frames(&mut app, 0.1);
        assert!(all.iter().all(|e| app.world().get::<Anatomy>(*e).is_some()), "round {round}");
        for ragdoll in all {
            assert!(app.world_mut().despawn(ragdoll));
        }
    }
    let mut parts = app.world_mut().query::<&Part>();
    assert_eq!(parts.iter(app.world()).count(), 0, "the parts go with their ragdoll");
}

#[test]
fn hills_carry_and_the_level_start_is_as_in_training() -> Result<(), Box<dyn std::error::Error>> {
    let mut app = app(FRAME);
    let policy = with_policy(&mut app, "ant");
    let mut spawn = |ground| app.world_mut().spawn((Ragdoll::agent("ant").on(ground), policy.clone())).id();
    let [level, hills] = [Ground::Level, Ground::Hills].map(&mut spawn);
    frames(&mut app, 0.05);
    assert!(app.world().get::<Unfit>(hills).is_none());
    let (mut highest, mut same) = ([0.0_f64; 2], 0);
    for _ in 0..800 {
        app.update();
        let mut states = Vec::new();
        for ragdoll in [level, hills] {
            let key = app.world().get::<RagdollState>(ragdoll).ok_or("it is simulated")?;
            states.push(app.world().resource::<Marathon>().state(key).ok_or("it has a state")?);
        }
        let [a, b] = [&states[0], &states[1]];
        if a.qpos[0] < 2.0 && b.qpos[0] < 2.0 {
            same += usize::from(a == b);
        }
        for (most, state) in highest.iter_mut().zip(&states) {
            *most = most.max(state.qpos[2]);
        }
        let above = b.qpos[2] - Ground::Hills.height(b.qpos[0]);
        assert!(above > 0.1, "{above} m above the hill at {} m", b.qpos[0]);
    }
    assert!(same > 20, "the same bits before the hills begin, {same} times");
    assert!(highest[1] > highest[0] + 0.1, "it has been uphill: {highest:?}");
    Ok(())
}
