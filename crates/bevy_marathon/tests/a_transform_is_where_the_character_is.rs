//! The transform of a ragdoll goes along with the character, and moves it.

use crate::common::{TICK, app, controller, run, state};
use bevy::prelude::*;
use bevy_marathon::prelude::*;

type Done = Result<(), Box<dyn std::error::Error>>;

fn character(app: &mut App, place: Transform) -> Entity {
    let command = MoveDirection::new(0.6 * (place.rotation * Vec3::X));
    controller(app, (command, Collides::ALL, place))
}

fn get<T: Component + Clone>(app: &App, entity: Entity) -> T {
    app.world().get::<T>(entity).expect("it has one").clone()
}

/// Checks a transform against the pose, and the bodies against the physics.
fn check(app: &App, entity: Entity, parent: Transform) -> Done {
    let (place, pose) = (get::<GlobalTransform>(app, entity).compute_transform(), get::<CharacterPose>(app, entity));
    let track = parent * get::<Track>(app, entity).place();
    let below = track.rotation.inverse() * (pose.position - place.translation);
    assert!(below.xz().length() < 1e-4 && below.y > 0.5, "{below}");
    let start = track.rotation.inverse() * (place.translation - track.translation);
    assert!(start.y.abs() < 1e-4, "on the plane of the track: {start}");
    assert!((place.rotation * Vec3::X).distance(pose.forward()) < 1e-3, "{} and {}", place.rotation, pose.heading);
    let (anatomy, key) = (get::<Anatomy>(app, entity), get::<RagdollState>(app, entity));
    let time = app.world().resource::<Time<Fixed>>();
    let places = app.world().resource::<Marathon>().places(&key, time.elapsed() + time.overstep()).ok_or("places")?;
    for (part, local) in anatomy.parts.iter().zip(places) {
        let (shown, at) = (get::<GlobalTransform>(app, *part).translation(), (track * local).translation);
        assert!(shown.distance(at) < 1e-4, "{shown} and {at}");
    }
    Ok(())
}

#[test]
fn it_goes_along_and_what_is_attached_too() -> Done {
    let mut app = app(TICK);
    let frame = Transform::from_xyz(-4.0, 2.0, 1.0).with_rotation(Quat::from_rotation_y(-0.7));
    let parent = app.world_mut().spawn(frame).id();
    let start = Transform::from_xyz(3.0, 0.0, -2.0).with_rotation(Quat::from_rotation_y(0.4));
    let walker = character(&mut app, start);
    app.world_mut().entity_mut(walker).insert(ChildOf(parent));
    let tag = app.world_mut().spawn((Transform::from_xyz(0.0, 2.0, 0.0), ChildOf(walker))).id();
    app.update();
    check(&app, walker, frame)?;
    run(&mut app, 4.0);
    check(&app, walker, frame)?;
    let way = get::<Transform>(&app, walker).translation - start.translation;
    assert!(way.length() > 2.0, "it walks: {way}");
    assert_eq!(get::<Track>(&app, walker).place(), start);
    let (tag, walker) = (get::<GlobalTransform>(&app, tag), get::<GlobalTransform>(&app, walker));
    assert!((tag.translation() - walker.translation() - 2.0 * Vec3::Y).length() < 1e-4);
    Ok(())
}

#[test]
fn set_by_the_app_it_moves_the_character_and_nothing_else() -> Done {
    let (mut app, mut twin) = (app(TICK), app(TICK));
    let start = Transform::from_xyz(3.0, 0.0, -2.0).with_rotation(Quat::from_rotation_y(0.4));
    let (walker, other) = (character(&mut app, start), character(&mut twin, start));
    // no command, so that the direction of the world does not matter
    for (app, walker) in [(&mut app, walker), (&mut twin, other)] {
        app.world_mut().entity_mut(walker).remove::<MoveDirection>();
        run(app, 2.0);
    }
    let goal = Transform::from_xyz(-20.0, 1.0, 7.0).with_rotation(Quat::from_rotation_y(-2.0));
    app.world_mut().entity_mut(walker).insert(goal);
    app.update();
    twin.update();
    check(&app, walker, Transform::IDENTITY)?;
    let shown = get::<Transform>(&app, walker);
    // it has gone on for a frame
    assert!(shown.translation.distance(goal.translation) < 0.1, "{shown:?}");
    assert!(shown.rotation.angle_between(goal.rotation) < 0.1, "{shown:?}");
    run(&mut app, 2.0);
    run(&mut twin, 2.0);
    assert_eq!(state(&app, walker), state(&twin, other), "the physics computes the same bits");
    // it begins its next episode at the start of the moved track
    app.world_mut().write_message(RestartNow { ragdoll: walker });
    run(&mut app, 0.1);
    let (now, track) = (get::<Transform>(&app, walker), get::<Track>(&app, walker).place());
    assert!(now.translation.distance(track.translation) < 0.2, "{now:?} and {track:?}");
    assert!(track.translation.distance(start.translation) > 10.0);
    Ok(())
}

#[test]
fn a_flip_does_not_turn_it() -> Done {
    let mut app = app(TICK);
    let man = character(&mut app, Transform::IDENTITY);
    app.world_mut().entity_mut(man).remove::<MoveDirection>();
    run(&mut app, 2.0);
    app.world_mut().get_mut::<AgentCommand>(man).ok_or("a command")?.set("backflip", 1.0)?;
    let (mut before, mut lowest) = (get::<Transform>(&app, man).rotation, 1.0_f32);
    for _ in 0..150 {
        app.update();
        let now = get::<Transform>(&app, man).rotation;
        // it rolls a little while it is upside down; the forward axis makes half a turn there
        assert!(now.angle_between(before) < 1.0, "{before} to {now} in a frame");
        before = now;
        let (anatomy, parts) = (get::<Anatomy>(&app, man), get::<GlobalTransform>(&app, man));
        let root = get::<GlobalTransform>(&app, anatomy.parts[1]);
        lowest = lowest.min((parts.rotation().inverse() * (root.rotation() * Vec3::Y)).y);
    }
    assert!(lowest < -0.7, "it has been upside down: {lowest}");
    Ok(())
}
