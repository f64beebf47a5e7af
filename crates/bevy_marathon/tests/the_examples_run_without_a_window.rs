//! The examples and the looks run in an app without a window and without a graphics card, and the first program of the README is as
//! short as it says.
#![cfg(feature = "window")]

#[allow(dead_code, reason = "its window stays closed")]
#[path = "../examples/animation.rs"]
mod animation;
#[allow(dead_code, reason = "its window stays closed")]
#[path = "../examples/crowd.rs"]
mod crowd;
#[allow(dead_code, reason = "its command line is left out")]
#[path = "../examples/headless_server.rs"]
mod headless_server;
#[allow(dead_code, reason = "its window stays closed")]
#[path = "../examples/hit_reactions.rs"]
mod hit_reactions;
#[allow(dead_code, reason = "its window stays closed")]
#[path = "../examples/obstacles.rs"]
mod obstacles;
#[path = "../examples/own_character.rs"]
mod own_character;
#[allow(dead_code, reason = "its window stays closed")]
#[path = "../examples/ragdoll.rs"]
mod ragdoll;
#[allow(dead_code, reason = "it plays for longer")]
#[path = "../examples/rollback.rs"]
mod rollback;
#[allow(dead_code, reason = "its window stays closed")]
#[path = "../examples/wear_a_skin.rs"]
mod wear_a_skin;

use bevy::app::Plugins;
use bevy::ecs::message::MessageCursor;
use bevy::log::LogPlugin;
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::settings::WgpuSettings;
use bevy::time::TimeUpdateStrategy;
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;
use bevy_marathon::look::{Dressed, UnfitSkin};
use bevy_marathon::prelude::*;
use marathon_physics::Model;
use std::sync::Arc;
use std::time::Duration;

/// Bevy's default plugins and those of an example, after the start.
fn windowless<M>(example: impl Plugins<M>) -> App {
    let assets = AssetPlugin { file_path: concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets").into(), ..default() };
    let window = WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() };
    let render = RenderPlugin { render_creation: WgpuSettings { backends: None, ..default() }.into(), ..default() };
    let plugins = DefaultPlugins.set(assets).set(window).set(render).disable::<WinitPlugin>().disable::<LogPlugin>();
    let mut app = App::new();
    app.add_plugins(plugins).add_plugins(example);
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(10)));
    app.finish();
    app.cleanup();
    app
}

/// Runs frames until a condition holds. Files are read on other threads.
fn run_until(app: &mut App, what: &str, done: impl Fn(&mut World) -> bool) {
    for _ in 0..4000 {
        app.update();
        if done(app.world_mut()) {
            return;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    panic!("4000 frames without: {what}");
}

#[test]
fn the_humanoid_runs() {
    let mut app = windowless(ragdoll::humanoid);
    run_until(&mut app, "a humanoid that has run a meter", |world| {
        world.query::<&Episode>().iter(world).any(|episode| episode.farthest > 1.0)
    });
    assert_eq!(app.world_mut().query::<&FollowCamera>().iter(app.world()).count(), 1);
}

#[test]
fn the_walker_goes_back_to_its_clip() {
    let mut app = windowless(animation::stroll);
    let mode = |world: &mut World| world.query::<&RagdollMode>().iter(world).next().copied();
    let mut far = 0.0_f32;
    run_until(&mut app, "a clip", |world| mode(world) == Some(RagdollMode::Animated));
    for wanted in [RagdollMode::Powered, RagdollMode::Animated, RagdollMode::Powered, RagdollMode::Animated] {
        run_until(&mut app, "the next mode", |world| mode(world) == Some(wanted));
        let world = app.world_mut();
        far = world.query::<&CharacterPose>().iter(world).map(|pose| pose.position.length()).fold(far, f32::max);
    }
    assert!(far > 5.0, "{far} m");
}

#[test]
fn the_yard_keeps_its_characters() {
    let mut app = windowless(obstacles::yard);
    run_until(&mut app, "eight characters and boxes", |world| world.query::<&Anatomy>().iter(world).count() == 9);
    let start = app.world().resource::<Time>().elapsed_secs();
    let mut moved = false;
    while app.world().resource::<Time>().elapsed_secs() < start + 20.0 {
        app.update();
        let world = app.world_mut();
        for (part, place) in world.query::<(&Part, &GlobalTransform)>().iter(world) {
            let (at, is_box) = (
                place.translation(),
                world.get::<Ragdoll>(part.ragdoll).is_some_and(|r| r.task_config.is_none() && r.seed == 0),
            );
            assert!(part.body == 0 || at.is_finite() && at.abs().max_element() < 6.5, "{at} at {:?}", part);
            moved |= is_box && part.body == 1 && (at - Vec3::new(0.0, 0.15, 0.33)).length() > 0.1;
        }
    }
    assert!(moved, "nobody has moved a box");
    assert_eq!(app.world_mut().query::<&Unfit>().iter(app.world()).count(), 0);
}

#[test]
fn the_fighter_takes_blows_falls_and_gets_up() {
    let mut app = windowless(hit_reactions::sparring);
    let (mut hits, mut falls, mut rises) = (0, 0, 0);
    let mut cursors = (MessageCursor::default(), MessageCursor::default(), MessageCursor::default());
    for _ in 0..3000 {
        app.update();
        hits += cursors.0.read(app.world().resource::<Messages<HitReceived>>()).count();
        falls += cursors.1.read(app.world().resource::<Messages<Fell>>()).count();
        rises += cursors.2.read(app.world().resource::<Messages<GotUp>>()).count();
        std::thread::sleep(Duration::from_millis(1));
        if hits > 4 && rises > 0 {
            break;
        }
    }
    // the hardest blow throws it over
    assert!(hits > 4 && falls > 0 && rises > 0, "{hits} blows, {falls} falls, {rises} times up");
}

#[test]
fn the_figure_is_worn() {
    let mut app = windowless(wear_a_skin::Dressing("skins/marathon_man.glb".into()));
    run_until(&mut app, "a figure that is worn or refused", |world| {
        world.query_filtered::<(), Or<(With<Dressed>, With<UnfitSkin>)>>().iter(world).count() > 0
    });
    let refused = app.world_mut().query::<&UnfitSkin>().iter(app.world()).next();
    assert!(refused.is_none(), "{refused:?}");
}

const ROBOT: &str = "<mujoco model='robot'><worldbody><geom type='plane' size='5 5 1'/><body name='trunk' pos='0 0 1'><freejoint/>\
    <geom type='box' size='.1 .2 .3' mass='3'/><body name='arm' pos='0 .25 .2'><joint axis='1 0 0'/>\
    <geom type='capsule' fromto='0 0 0 0 .4 0' size='.05'/></body></body></worldbody></mujoco>";
const MESHLESS: &str = "<mujoco model='nothing'><worldbody><body name='dot'><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>\
    <joint axis='0 1 0'/></body></worldbody></mujoco>";

/// Looks of characters whose models are read here.
fn models(app: &mut App, quality: Quality) {
    app.add_plugins((MarathonPlugin, LookPlugin, SkinPlugin, GeneratedSkinPlugin, SceneryPlugin(quality)));
}

fn spawn(world: &mut World, xml: &str) -> Entity {
    let model = Arc::new(Model::from_xml_str(xml, "model.xml").expect("it is a model"));
    let prefab = world.resource_mut::<Assets<RagdollPrefab>>().add(RagdollPrefab { model });
    world.spawn((Ragdoll::prefab(prefab), GeneratedSkin)).id()
}

#[test]
fn a_skin_is_generated_for_a_model_of_your_own() {
    let mut app = windowless(|app: &mut App| models(app, Quality::Medium));
    let robots = [0; 2].map(|_| spawn(app.world_mut(), ROBOT));
    let bare = spawn(app.world_mut(), MESHLESS);
    run_until(&mut app, "two robots in a skin, and a model without one", |world| {
        let dressed = robots.iter().all(|robot| world.get::<Dressed>(*robot).is_some());
        dressed && world.get::<UnfitSkin>(bare).is_some()
    });
    // a skin takes its first pose in the frame after it is put on
    app.update();
    let worn = |app: &App, robot| app.world().get::<Skin>(robot).map(|skin| skin.scene.clone());
    // both models are equal, though they were read twice
    assert!(worn(&app, robots[0]).is_some() && worn(&app, robots[0]) == worn(&app, robots[1]));
    let mut arms = app.world_mut().query::<(&Name, &GlobalTransform, Has<Part>)>();
    let places: Vec<_> = arms.iter(app.world()).filter(|(name, ..)| name.as_str() == "arm").collect();
    let at = |part: bool| places.iter().filter(|(.., is)| *is == part).map(|(_, at, _)| at.translation()).next();
    let (bone, body) = (at(false).expect("a bone"), at(true).expect("a body"));
    assert!(bone.distance(body) < 0.02, "the arm of the skin is at {bone}, that of the physics at {body}");
    app.world_mut().entity_mut(robots[0]).remove::<GeneratedSkin>();
    app.update();
    assert!(worn(&app, robots[0]).is_none(), "it is taken off");
    assert!(worn(&app, robots[1]).is_some(), "the other one keeps it");
}

#[test]
fn discs_below_the_bodies_take_the_place_of_shadows_at_low_quality() {
    let mut app = windowless(|app: &mut App| models(app, Quality::Low));
    spawn(app.world_mut(), ROBOT);
    // above the ground, then fallen onto it
    let discs = |app: &mut App| {
        let mut named = app.world_mut().query::<(&Name, &GlobalTransform)>();
        let discs = named.iter(app.world()).filter(|(name, _)| name.as_str() == "blob shadow");
        discs.map(|(_, at)| (at.translation().y, at.compute_transform().scale.x)).collect::<Vec<_>>()
    };
    for _ in 0..4 {
        app.update();
    }
    let high = discs(&mut app);
    assert_eq!(high.len(), 2, "one for each body");
    for _ in 0..150 {
        app.update();
    }
    let low = discs(&mut app);
    assert!(high.iter().chain(&low).all(|(y, _)| (0.0..0.05).contains(y)), "on the ground: {high:?} {low:?}");
    assert!(low[0].1 < high[0].1, "smaller when the body is near: {high:?} {low:?}");
    app.insert_resource(Quality::Medium);
    app.update();
    app.update();
    assert!(discs(&mut app).is_empty());
}

#[test]
fn the_crowd_walks_and_those_far_away_decide_less() {
    let mut app = windowless(crowd::crowd);
    run_until(&mut app, "64 characters that have been on their way for 3 s", |world| {
        let walks = |episode: &Episode| episode.number > 1 || episode.seconds > 3.0;
        world.query::<&Episode>().iter(world).filter(|episode| walks(episode)).count() == 64
    });
    let world = app.world_mut();
    let levels: Vec<Lod> = world.query::<&Lod>().iter(world).copied().collect();
    assert!(levels.contains(&Lod::Full) && levels.contains(&Lod::HalfRate), "{levels:?}");
    let stood = world.query::<&Episode>().iter(world).filter(|episode| episode.number == 1).count();
    assert!(stood >= 58, "{stood} of 64 have not fallen");
}

#[test]
fn the_rolled_back_peer_has_the_bits_of_the_referee() -> Result<(), Box<dyn std::error::Error>> {
    let outcome = rollback::play(300)?;
    assert!(outcome.same_bits && outcome.rollbacks > 5 && outcome.replayed > 25, "{outcome:?}");
    Ok(())
}

#[test]
fn the_server_stops_after_its_time() {
    assert_eq!(headless_server::server(0.5).run(), AppExit::Success);
}

#[test]
fn the_snail_is_trained_and_played() -> Result<(), Box<dyn std::error::Error>> {
    own_character::main()
}

/// `cargo test --doc` compiles it.
#[test]
fn the_first_program_of_the_readme_has_fifteen_lines_at_most() {
    let readme = include_str!("../README.md");
    let program = readme.split("```").nth(1).expect("it has a block of code");
    assert!(program.contains("fn main()") && program.contains("AgentCommand"), "{program}");
    let lines = program.lines().skip(1).filter(|line| !line.trim().is_empty()).count();
    assert!(lines <= 15, "{lines} lines");
}
