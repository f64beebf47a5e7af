//! The boxes fall because the hopper runs into them, and the hopper feels the boxes.

use super::*;
use bevy::time::TimeUpdateStrategy;
use std::time::Duration;

/// Where each box ends and how far it has gone, m, in the order of their starts, and the hopper along its track; `hit` counts
/// contacts between them.
struct Outcome {
    boxes: Vec<(Vec3, f32)>,
    hopper: Option<f64>,
    hit: usize,
}

impl Outcome {
    /// Boxes that have gone half an edge or more.
    fn struck(&self) -> usize {
        self.boxes.iter().filter(|(_, way)| *way > 0.5 * EDGE).count()
    }
    /// How far along the track the boxes have gone in the mean, m.
    fn along(&self) -> f32 {
        self.boxes.iter().map(|(at, _)| at.x - WALL).sum::<f32>() / self.boxes.len() as f32
    }
}

#[derive(Resource, Default)]
struct Hits(usize);

fn count(mut hits: ResMut<Hits>, collisions: Collisions, shadows: Query<&Shadow>, bricks: Query<&Brick>) {
    let both = |a, b| shadows.contains(a) && bricks.contains(b);
    let pairs = collisions.iter().map(|pair| (pair.collider1, pair.collider2));
    hits.0 += pairs.filter(|(a, b)| both(*a, *b) || both(*b, *a)).count();
}

/// Where a box stood.
#[derive(Component)]
struct Start(Vec3);

fn remember(mut commands: Commands, new: Query<(Entity, &Transform), Added<Brick>>) {
    for (brick, at) in &new {
        commands.entity(brick).insert(Start(at.translation));
    }
}

/// Four seconds in so many frames, of which the hopper takes about one to the wall.
fn play(hopper: bool, wall: bool, frames: u32) -> Outcome {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin, assets(), MarathonPlugin, PropsPlugin))
        .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs(4) / frames))
        .init_resource::<Hits>()
        .add_systems(FixedPostUpdate, count.after(PhysicsSystems::Last));
    if wall {
        app.add_systems(Startup, (build_wall, remember).chain());
    }
    app.finish();
    app.cleanup();
    if hopper {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../../assets/policies/hopper.safetensors");
        let policy = marathon_learn::Policy::load(path.as_ref()).expect("it comes with the project");
        let policy = CharacterPolicy(app.world_mut().resource_mut::<Assets<PolicyAsset>>().add(policy));
        // lying where it has fallen: a second attempt would hide the first
        let restart = Restart { after_fall: f64::INFINITY, on_time_up: false };
        app.world_mut().spawn((Ragdoll::agent("hopper"), policy, restart));
    }
    // no time passes in the first frame
    (0..=frames).for_each(|_| app.update());
    let world = app.world_mut();
    let mut bricks = world.query::<(&Start, &Position)>();
    let mut runners = world.query::<&Episode>();
    let mut bricks: Vec<_> = bricks.iter(world).map(|(start, at)| (start.0, at.0)).collect();
    bricks.sort_by(|(a, _), (b, _)| a.to_array().map(f32::to_bits).cmp(&b.to_array().map(f32::to_bits)));
    Outcome {
        boxes: bricks.into_iter().map(|(start, at)| (at, at.distance(start))).collect(),
        hopper: runners.iter(world).next().map(|episode| episode.distance),
        hit: world.resource::<Hits>().0,
    }
}

#[test]
fn boxes_and_hopper_feel_each_other() {
    let [alone, free, both] =
        [(false, true), (true, false), (true, true)].map(|(hopper, wall)| play(hopper, wall, 240));
    assert!(
        alone.hit == 0 && alone.boxes.iter().all(|(_, way)| *way < 0.01),
        "a wall by itself stands: {:?}",
        alone.boxes
    );
    assert!(both.hit > 0 && both.struck() >= 3, "{} contacts; boxes and their ways: {:?}", both.hit, both.boxes);
    assert!(both.along() > 0.5 * EDGE, "boxes are knocked forwards: {:?}", both.boxes);
    let [free, held] = [free.hopper, both.hopper].map(|way| way.unwrap_or_default());
    assert!(free > f64::from(WALL) + 2.0, "without a wall it gets further: {free} m");
    assert!(held < free - 0.3 && held > 2.0, "{held} m with the wall, {free} m without it");
}

/// A slow computer shows few frames of many ticks each, a fast one many for each tick: the boxes are hit alike.
#[test]
fn frames_do_not_hit() {
    // both divide four seconds into whole nanoseconds: as many ticks for both
    let [smooth, slow] = [1000, 16].map(|frames| play(true, true, frames));
    assert_eq!((slow.hit, slow.struck()), (smooth.hit, smooth.struck()));
    for ((a, _), (b, _)) in smooth.boxes.iter().zip(&slow.boxes) {
        assert!(a.distance(*b) < 0.05, "{:?}, in slow frames {:?}", smooth.boxes, slow.boxes);
    }
}
