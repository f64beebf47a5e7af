//! The bars of locked feet: they stand still while they carry weight, the knees do not pop, and the physics does not notice.
#![cfg(feature = "window")]

use crate::common;
use bevy::asset::UnapprovedPathMode;
use bevy::log::LogPlugin;
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::settings::WgpuSettings;
use bevy::time::TimeUpdateStrategy;
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;
use bevy_marathon::axes::to_game;
use bevy_marathon::look::{Dressed, FootLock, UnfitSkin};
use bevy_marathon::prelude::*;
use std::error::Error;
use std::path::Path;
use std::time::Duration;

/// Frames per second.
const RATE: f32 = 60.0;
/// Heel and toes of Marathon Man's feet in the frame of a foot, m.
const SOLE: [[f64; 3]; 3] = [[-0.045, 0.0, -0.06], [0.165, 0.03, -0.06], [0.165, -0.03, -0.06]];
/// Height above its median height in contact from which on a foot has left the ground, m.
const LIFTED: f32 = 0.004;
/// Contact is settled from so many frames after the touch to so many frames before the foot leaves the ground.
const SETTLED: [usize; 2] = [6, 3];

/// Walk, run, walk in a circle, stop: seconds, and values of the command.
const COURSE: [Section; 5] = [
    ("stand", 1.0, [("speed", 0.0), ("turn", 0.0)]),
    ("walk", 8.0, [("speed", 1.4), ("turn", 0.0)]),
    ("run", 8.0, [("speed", 3.0), ("turn", 0.0)]),
    ("turn", 8.0, [("speed", 1.2), ("turn", 1.0)]),
    ("stop", 3.0, [("speed", 0.0), ("turn", 0.0)]),
];

/// Name, seconds and values of a part of the course.
type Section = (&'static str, f32, [(&'static str, f64); 2]);

/// Bones of a leg: thigh, shin and foot.
type LegNames = [&'static str; 3];

/// A leg in a frame.
#[derive(Clone, Debug)]
struct Seen {
    part: &'static str,
    contact: bool,
    /// Points of the sole.
    sole: Vec<Vec3>,
    /// Angle inside the knee, degrees.
    knee: f32,
}

/// Measures of a character in a part of the course.
#[derive(Debug, Default)]
struct Measures {
    /// Level speeds of settled feet, m/s.
    slides: Vec<f32>,
}

fn windowless() -> App {
    let file_path = common::assets().display().to_string();
    let assets = AssetPlugin { file_path, unapproved_path_mode: UnapprovedPathMode::Allow, ..default() };
    let window = WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() };
    let render = RenderPlugin { render_creation: WgpuSettings { backends: None, ..default() }.into(), ..default() };
    let plugins = DefaultPlugins.set(assets).set(window).set(render).disable::<WinitPlugin>().disable::<LogPlugin>();
    let mut app = App::new();
    app.add_plugins(plugins).add_plugins((MarathonPlugin, SkinPlugin));
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs_f32(1.0 / RATE)));
    app.finish();
    app.cleanup();
    app
}

/// Marathon Man in a skin, with locked feet or without.
fn spawn(app: &mut App, skin: &Path, lock: FootLock) -> Entity {
    let world = app.world_mut();
    let policy = world.resource_mut::<Assets<PolicyAsset>>().add(common::policy("MarathonManController"));
    let file = skin.display().to_string();
    let scene = world.resource::<AssetServer>().load(GltfAssetLabel::Scene(0).from_asset(file));
    let restart = Restart { on_time_up: false, ..default() };
    let parts = (Ragdoll::agent("MarathonManController"), CharacterPolicy(policy), restart, Skin::new(scene), lock);
    world.spawn(parts).id()
}

/// The entities below a character with these names.
fn bones(app: &App, character: Entity, names: LegNames) -> [Entity; 3] {
    let world = app.world();
    let mut open = vec![character];
    let mut found = [Entity::PLACEHOLDER; 3];
    while let Some(entity) = open.pop() {
        // the parts of the ragdoll have names, too
        if world.get::<Part>(entity).is_some() {
            continue;
        }
        let name = world.get::<Name>(entity).map(|name| name.to_string()).unwrap_or_default();
        if let Some(i) = names.iter().position(|known| *known == name) {
            found[i] = entity;
        }
        open.extend(world.get::<Children>(entity).into_iter().flatten());
    }
    assert!(!found.contains(&Entity::PLACEHOLDER), "{names:?}");
    found
}

/// Both legs of a character over the course.
fn record(app: &mut App, characters: [Entity; 2], legs: [LegNames; 2]) -> Result<[[Vec<Seen>; 2]; 2], Box<dyn Error>> {
    let found = characters.map(|character| legs.map(|names| bones(app, character, names)));
    let mut seen: [[Vec<Seen>; 2]; 2] = Default::default();
    for (part, seconds, values) in COURSE {
        for character in characters {
            let mut command = app.world_mut().get_mut::<AgentCommand>(character).ok_or("it takes commands")?;
            for (name, value) in values {
                command.set(name, value)?;
            }
        }
        for _ in 0..(seconds * RATE) as usize {
            app.update();
            for (character, (found, seen)) in characters.into_iter().zip(found.iter().zip(&mut seen)) {
                for ((bones, side), seen) in found.iter().zip(["left", "right"]).zip(seen) {
                    seen.push(look(app, character, bones, side, part)?);
                }
            }
        }
    }
    Ok(seen)
}

/// A leg in the present frame.
fn look(
    app: &App,
    character: Entity,
    bones: &[Entity; 3],
    side: &str,
    part: &'static str,
) -> Result<Seen, Box<dyn Error>> {
    let world = app.world();
    let anatomy = world.get::<Anatomy>(character).ok_or("an anatomy")?;
    let episode = world.get::<Episode>(character).ok_or("an episode")?;
    let place = |entity: Entity| world.get::<GlobalTransform>(entity).map(GlobalTransform::compute_transform);
    let foot_name = format!("{side}_foot");
    let foot = place(anatomy.part(&foot_name).ok_or("a foot")?).ok_or("a place")?;
    let [hip, knee, ankle] = bones.map(|bone| place(bone).unwrap_or_default().translation);
    // the lock does not turn the foot
    let sole = SOLE.map(|point| ankle + foot.rotation * to_game(point)).to_vec();
    let body = anatomy.model.bodies.iter().position(|body| body.name == foot_name).ok_or("a body")?;
    let bit = |(i, name): (usize, &std::sync::Arc<str>)| {
        let own = anatomy.model.geoms.iter().any(|geom| geom.body == body && *geom.name == **name);
        if own { 1 << i } else { 0_u32 }
    };
    let bits: u32 = anatomy.feet.iter().enumerate().map(bit).sum();
    let knee = (hip - knee).angle_between(ankle - knee).to_degrees();
    Ok(Seen { part, contact: episode.feet & bits != 0, sole, knee })
}

/// Speeds of the lowest point of settled feet in a part of the course.
fn slides(leg: &[Seen], part: &str) -> Measures {
    let [after, before] = SETTLED;
    let lowest = |seen: &Seen| seen.sole.iter().map(|point| point.y).fold(f32::INFINITY, f32::min);
    let mut touching: Vec<f32> = leg.iter().filter(|seen| seen.contact).map(lowest).collect();
    let ground = quantile(&mut touching, 0.5);
    let stands = |i: usize| lowest(&leg[i]) < ground + LIFTED;
    let settled = |i: usize| {
        i >= after && i + before < leg.len() && (i - after..=i + before).all(|i| stands(i) && leg[i].part == part)
    };
    let speed = |i: usize| {
        let lowest = (0..SOLE.len()).min_by(|a, b| leg[i].sole[*a].y.total_cmp(&leg[i].sole[*b].y)).unwrap_or(0);
        (leg[i].sole[lowest] - leg[i - 1].sole[lowest]).xz().length() * RATE
    };
    Measures { slides: (1..leg.len()).filter(|i| settled(*i)).map(speed).collect() }
}

fn quantile(values: &mut [f32], share: f32) -> f32 {
    values.sort_by(f32::total_cmp);
    values.get(((values.len().max(1) - 1) as f32 * share) as usize).copied().unwrap_or(f32::NAN)
}

/// Measures both legs of a skin with and without locked feet.
fn measure(skin: &Path, legs: [LegNames; 2]) -> Result<(), Box<dyn Error>> {
    let mut app = windowless();
    let characters = [FootLock { on: true }, FootLock { on: false }].map(|lock| spawn(&mut app, skin, lock));
    for _ in 0..6000 {
        app.update();
        std::thread::sleep(Duration::from_millis(2));
        if characters.iter().all(|character| app.world().get::<Dressed>(*character).is_some()) {
            break;
        }
        let refused = characters.iter().find_map(|character| app.world().get::<UnfitSkin>(*character));
        assert!(refused.is_none(), "{refused:?}");
    }
    let [locked, free] = record(&mut app, characters, legs)?;
    let mut bad = Vec::new();
    for part in ["walk", "run", "turn", "stop"] {
        let medians = [&locked, &free].map(|both| {
            let mut all: Vec<f32> = both.iter().flat_map(|leg| slides(leg, part).slides).collect();
            let n = all.len();
            (quantile(&mut all, 0.5), quantile(&mut all, 0.9), n)
        });
        println!("{}: {part}: slides {medians:.3?} m/s (median, 90 %, frames) with and without lock", skin.display());
        let [(still, ..), (sliding, ..)] = medians;
        bad.extend((still > 0.02).then(|| format!("{part}: settled feet slide at {still} m/s")));
        assert!(sliding > 0.05 || part == "stop", "{part}: without a lock they slide at {sliding} m/s");
    }
    let (mut pop, mut lifted) = (0.0_f32, 0.0_f32);
    for (locked, free) in locked.iter().zip(&free) {
        let bent: Vec<f32> = locked.iter().zip(free).map(|(a, b)| a.knee - b.knee).collect();
        pop = bent.windows(2).map(|two| (two[1] - two[0]).abs()).fold(pop, f32::max);
        let height = |(a, b): (&Seen, &Seen)| (a.sole[0].y - b.sole[0].y).abs();
        lifted = locked.iter().zip(free).map(height).fold(lifted, f32::max);
    }
    println!("{}: knees pop by {pop:.2} degrees per frame, feet are lifted by {:.1} mm", skin.display(), 1e3 * lifted);
    assert!(bad.is_empty(), "{bad:?}");
    assert!(pop <= 3.0, "a knee pops by {pop} degrees in a frame");
    assert!(lifted <= 0.02, "a foot is lifted by {lifted} m");
    let state = |character: Entity| {
        let world = app.world();
        let state = world.resource::<Marathon>().state(world.get::<RagdollState>(character)?)?;
        Some((state.qpos, state.qvel))
    };
    assert!(state(characters[0]).is_some() && state(characters[0]) == state(characters[1]), "the physics is the same");
    Ok(())
}

#[test]
#[ignore = "not met yet: walking feet slide at 0.17 m/s, and knees jump by 5 degrees in a frame"]
fn those_of_the_skin_that_comes_with_marathon() -> Result<(), Box<dyn Error>> {
    measure(
        Path::new("skins/marathon_man.glb"),
        [["LeftUpLeg", "LeftLeg", "LeftFoot"], ["RightUpLeg", "RightLeg", "RightFoot"]],
    )
}

#[test]
#[ignore = "not met yet: walking feet slide at 0.17 m/s, and knees jump by 5 degrees in a frame"]
fn those_of_a_generated_skin() -> Result<(), Box<dyn Error>> {
    let model = marathon_envs::registry::agent("MarathonManController")?.model()?;
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("man.glb");
    std::fs::write(&file, marathon_skin::skin(&model, &marathon_skin::Options { triangles: 1000 })?.to_glb())?;
    measure(&file, [["left_thigh", "left_shin", "left_foot"], ["right_thigh", "right_shin", "right_foot"]])
}
