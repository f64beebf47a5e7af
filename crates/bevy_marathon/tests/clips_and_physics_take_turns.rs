//! A motion clip moves a character in place of the physics, and both hand it over to each other without a jump.

use crate::common::{TICK, app, assets, controller, run, state};
use bevy::prelude::*;
use bevy_marathon::MotionClip;
use bevy_marathon::prelude::*;
use marathon_motion::Clip;

type Done = Result<(), Box<dyn std::error::Error>>;

fn character(app: &mut App, place: Vec3) -> Entity {
    controller(app, (MoveDirection::default(), Transform::from_translation(place)))
}

fn clip(app: &mut App, name: &str) -> Result<PlayClip, Box<dyn std::error::Error>> {
    let path = assets().join("motions").join(name);
    let clip = Clip::parse(&path, &std::fs::read(&path)?)?;
    Ok(PlayClip::new(app.world_mut().resource_mut::<Assets<MotionClip>>().add(MotionClip::from(clip))))
}

fn mode(app: &App, entity: Entity) -> RagdollMode {
    *app.world().get::<RagdollMode>(entity).expect("every ragdoll has one")
}

/// Largest change of a joint's angle in the next ticks, rad.
fn largest_step(app: &mut App, entity: Entity, ticks: usize) -> f64 {
    let mut most = 0.0_f64;
    for _ in 0..ticks {
        let before = state(app, entity).0;
        app.update();
        let after = state(app, entity).0;
        most = before.iter().zip(&after).skip(7).map(|(a, b)| (a - b).abs()).fold(most, f64::max);
    }
    most
}

#[test]
fn a_clip_moves_a_character_and_gives_it_back() -> Done {
    let mut app = app(TICK);
    let turned = Quat::from_rotation_y(0.8);
    let walker = character(&mut app, Vec3::new(1.0, 0.0, 2.0));
    app.world_mut().entity_mut(walker).insert(Transform::from_xyz(1.0, 0.0, 2.0).with_rotation(turned));
    run(&mut app, 1.0);
    let play = clip(&mut app, "marathon_man/walk.motion")?;
    let start = *app.world().get::<CharacterPose>(walker).ok_or("a pose")?;
    app.world_mut().entity_mut(walker).insert(play);
    let most = largest_step(&mut app, walker, 20);
    assert!(most < 0.25, "a joint jumps by {most} rad");
    assert_eq!(mode(&app, walker), RagdollMode::Animated);
    run(&mut app, 2.0);
    let now = *app.world().get::<CharacterPose>(walker).ok_or("a pose")?;
    let way = now.position - start.position;
    assert!(way.dot(start.forward()) > 1.5 && way.y.abs() < 0.1, "{way} along {}", start.forward());
    let number = app.world().get::<Episode>(walker).map(|episode| (episode.number, episode.decisions));

    // the physics takes over at the same pose and velocity, and the policy keeps it up
    app.world_mut().entity_mut(walker).remove::<PlayClip>();
    let before = state(&app, walker).1;
    let most = largest_step(&mut app, walker, 4);
    assert!(most < 0.35, "a joint jumps by {most} rad");
    assert_eq!(mode(&app, walker), RagdollMode::Powered);
    let change = (state(&app, walker).1[0] - before[0]).abs();
    assert!(change < 1.0, "its speed changes by {change} m/s");
    run(&mut app, 3.0);
    let up = app.world().get::<CharacterPose>(walker).ok_or("a pose")?.position.y;
    assert!(up > 0.7, "{up} m high");
    let later = app.world().get::<Episode>(walker).map(|episode| (episode.number, episode.decisions));
    let ((episode, decisions), (same, more)) = (number.ok_or("an episode")?, later.ok_or("an episode")?);
    assert!(episode == same && more > decisions, "episode {episode}, then {same}");
    Ok(())
}

#[test]
fn a_clip_that_does_not_loop_ends() -> Done {
    let mut app = app(TICK);
    let fighter = character(&mut app, Vec3::ZERO);
    run(&mut app, 0.5);
    let play = clip(&mut app, "marathon_man/kick.motion")?;
    app.world_mut().entity_mut(fighter).insert(play);
    run(&mut app, 0.3);
    assert_eq!(mode(&app, fighter), RagdollMode::Animated);
    run(&mut app, 6.0);
    assert!(app.world().get::<PlayClip>(fighter).is_none());
    assert_ne!(mode(&app, fighter), RagdollMode::Animated);
    Ok(())
}

#[test]
fn a_limp_character_falls_out_of_its_clip() -> Done {
    let mut app = app(TICK);
    let walker = character(&mut app, Vec3::ZERO);
    run(&mut app, 0.5);
    let play = clip(&mut app, "marathon_man/walk.motion")?;
    app.world_mut().entity_mut(walker).insert(play);
    run(&mut app, 1.0);
    app.world_mut().entity_mut(walker).insert(RagdollMode::Limp);
    run(&mut app, 2.0);
    assert_eq!(mode(&app, walker), RagdollMode::Limp);
    let down = state(&app, walker).0[2];
    assert!(down < 0.6, "{down} m high");
    app.world_mut().entity_mut(walker).insert(RagdollMode::Powered);
    let most = largest_step(&mut app, walker, 20);
    assert!(most < 0.5, "a joint jumps by {most} rad");
    run(&mut app, 1.0);
    assert_eq!(mode(&app, walker), RagdollMode::Animated);
    assert!(state(&app, walker).0[2] > 0.8);
    Ok(())
}

#[test]
fn neighbors_keep_their_bits() -> Done {
    let run_with = |plays: bool| -> Result<_, Box<dyn std::error::Error>> {
        let mut app = app(TICK);
        let (one, other) = (character(&mut app, Vec3::ZERO), character(&mut app, Vec3::Z));
        run(&mut app, 0.5);
        if plays {
            let play = clip(&mut app, "marathon_man/run.motion")?;
            app.world_mut().entity_mut(one).insert(play);
        }
        run(&mut app, 1.0);
        Ok((state(&app, one), state(&app, other)))
    };
    let ((walks, beside), (stands, alone)) = (run_with(true)?, run_with(false)?);
    assert_eq!(beside, alone);
    assert_ne!(walks, stands);
    Ok(())
}

#[test]
fn a_clip_of_another_model_is_refused() -> Done {
    let mut app = app(TICK);
    let walker = character(&mut app, Vec3::ZERO);
    run(&mut app, 0.2);
    for wrong in [
        clip(&mut app, "humanoid/walk.motion")?,
        PlayClip { speed: f64::NAN, ..clip(&mut app, "marathon_man/walk.motion")? },
    ] {
        app.world_mut().entity_mut(walker).insert(wrong);
        run(&mut app, 0.2);
        assert_eq!(mode(&app, walker), RagdollMode::Powered);
    }
    Ok(())
}

#[test]
fn a_saved_animation_continues() -> Done {
    let mut app = app(TICK);
    let walker = character(&mut app, Vec3::ZERO);
    run(&mut app, 0.5);
    let play = clip(&mut app, "marathon_man/walk.motion")?;
    app.world_mut().entity_mut(walker).insert(play);
    run(&mut app, 0.7);
    let key = *app.world().get::<RagdollState>(walker).ok_or("it has entered")?;
    let saved = app.world_mut().resource_mut::<Marathon>().save(&key).ok_or("a snapshot")?;
    run(&mut app, 1.0);
    let first = state(&app, walker);
    app.world_mut().resource_mut::<Marathon>().restore(&key, &saved)?;
    run(&mut app, 1.0);
    assert_eq!(state(&app, walker), first);
    Ok(())
}
