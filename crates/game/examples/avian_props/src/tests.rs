//! The boxes fall because the hopper runs into them, and the hopper feels the boxes.

use super::*;
use bevy::time::TimeUpdateStrategy;
use std::time::Duration;

/// How far each box has gone, m, and the hopper along its track; `hit` counts contacts between them.
struct Outcome {
    boxes: Vec<f32>,
    hopper: Option<f64>,
    hit: usize,
}

#[derive(Resource, Default)]
struct Hits(usize);

fn count(mut hits: ResMut<Hits>, collisions: Collisions, shadows: Query<&Shadow>, bricks: Query<&Brick>) {
    let both = |a, b| shadows.contains(a) && bricks.contains(b);
    let pairs = collisions.iter().map(|pair| (pair.collider1, pair.collider2));
    hits.0 += pairs.filter(|(a, b)| both(*a, *b) || both(*b, *a)).count();
}

/// Four seconds, of which the hopper takes about one to the wall.
fn play(hopper: bool, wall: bool) -> Outcome {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin, assets(), MarathonPlugin, PropsPlugin))
        .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs_f64(1.0 / 60.0)))
        .init_resource::<Hits>()
        .add_systems(FixedPostUpdate, count.after(PhysicsSystems::Last));
    if wall {
        app.add_systems(Startup, build_wall);
    }
    app.finish();
    app.cleanup();
    if hopper {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../../assets/policies/hopper.safetensors");
        let policy = marathon_learn::Policy::load(path.as_ref()).expect("it comes with the project");
        let policy = Policy(app.world_mut().resource_mut::<Assets<PolicyAsset>>().add(policy));
        // lying where it has fallen: a second attempt would hide the first
        let restart = Restart { after_fall: f64::INFINITY, on_time_up: false };
        app.world_mut().spawn((Ragdoll::agent("hopper"), policy, restart));
    }
    (0..240).for_each(|_| app.update());
    let world = app.world_mut();
    let mut bricks = world.query::<(&Brick, &Position)>();
    let mut runners = world.query::<&Episode>();
    Outcome {
        boxes: bricks.iter(world).map(|(brick, position)| position.0.distance(brick.0)).collect(),
        hopper: runners.iter(world).next().map(|episode| episode.distance),
        hit: world.resource::<Hits>().0,
    }
}

#[test]
fn boxes_and_hopper_feel_each_other() {
    let [alone, free, both] = [(false, true), (true, false), (true, true)].map(|(hopper, wall)| play(hopper, wall));
    assert!(alone.hit == 0 && alone.boxes.iter().all(|way| *way < 0.01), "a wall by itself stands: {:?}", alone.boxes);
    let struck = both.boxes.iter().filter(|way| **way > 0.5 * EDGE).count();
    assert!(both.hit > 0 && struck >= 3, "{} contacts; the boxes went {:?} m", both.hit, both.boxes);
    let [free, held] = [free.hopper, both.hopper].map(|way| way.unwrap_or_default());
    assert!(free > f64::from(WALL) + 2.0, "without a wall it gets further: {free} m");
    assert!(held < free - 0.3 && held > 2.0, "{held} m with the wall, {free} m without it");
}
