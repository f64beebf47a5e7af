//! Characters touch obstacles of the app and each other.

use crate::common::{TICK, app, controller, run};
use bevy::prelude::*;
use bevy_marathon::prelude::*;

type Done = Result<(), Box<dyn std::error::Error>>;

/// A ball of 1 kg.
fn ball(app: &mut App) -> Result<Handle<RagdollPrefab>, Box<dyn std::error::Error>> {
    let text = r#"<mujoco model="ball"><option timestep="0.002"/><worldbody><geom type="plane" size="0 0 1"/>
        <body pos="0 0 0.2"><freejoint/><geom size="0.2" mass="1" solref="0.01 1"/></body></worldbody></mujoco>"#;
    let mut spec = marathon_physics::spec::ModelSpec::from_xml_str(text, "ball")?;
    spec.add_obstacles()?;
    Ok(app.world_mut().resource_mut::<Assets<RagdollPrefab>>().add(RagdollPrefab::from(spec.compile()?)))
}

/// A walker that the tests send along +x of the world.
fn walker(app: &mut App, place: Vec3, collides: Collides) -> Entity {
    let way = MoveDirection::new(Vec3::X * 0.5);
    controller(app, (way, collides, Transform::from_translation(place)))
}

fn place(app: &App, entity: Entity) -> Vec3 {
    app.world().get::<CharacterPose>(entity).map_or(Vec3::NAN, |pose| pose.position)
}

fn put(app: &mut App, entity: Entity, qpos: &[f64], qvel: &[f64]) -> Done {
    let key = *app.world().get::<RagdollState>(entity).ok_or("it has entered")?;
    let state = marathon_envs::AgentState { qpos: qpos.to_vec(), qvel: qvel.to_vec() };
    Ok(app.world_mut().resource_mut::<Marathon>().set_state(&key, &state)?)
}

#[test]
fn a_wall_stops_who_feels_it() -> Done {
    let mut app = app(TICK);
    let wall = Obstacle::Cuboid { half_size: Vec3::new(0.2, 1.0, 3.0) };
    app.world_mut().spawn((wall, Transform::from_xyz(2.0, 1.0, 0.0)));
    let feels = walker(&mut app, Vec3::ZERO, Collides::ALL);
    let ghost = walker(&mut app, Vec3::Z, Collides::default());
    run(&mut app, 6.0);
    let [stopped, through] = [feels, ghost].map(|entity| place(&app, entity).x);
    assert!(stopped > 0.8 && stopped < 1.8, "{stopped}");
    assert!(through > 2.5, "{through}");
    assert!(app.world().get::<Unfit>(feels).is_none());
    Ok(())
}

#[test]
fn who_feels_nothing_moves_as_before() -> Done {
    let run_with = |collides: Collides| {
        let mut app = app(TICK);
        app.world_mut().spawn((Obstacle::Sphere { radius: 1.0 }, Transform::from_xyz(0.0, 0.0, 50.0)));
        let walker = walker(&mut app, Vec3::ZERO, collides);
        run(&mut app, 2.0);
        let key = *app.world().get::<RagdollState>(walker).expect("it has entered");
        app.world().resource::<Marathon>().state(&key).map(|state| state.qpos)
    };
    assert_eq!(run_with(Collides::ALL), run_with(Collides::default()));
    Ok(())
}

#[test]
fn a_platform_that_moves_carries() -> Done {
    let mut app = app(TICK);
    let prefab = ball(&mut app)?;
    // a body of another engine, moved at every tick; its parent turns the axes
    let frame =
        app.world_mut().spawn(Transform::from_xyz(1.0, 0.0, 0.0).with_rotation(Quat::from_rotation_y(1.0))).id();
    let half_size = Vec3::new(1.0, 0.1, 0.5);
    let platform = app
        .world_mut()
        .spawn((Obstacle::Cuboid { half_size }, Transform::from_xyz(0.0, 1.0, 0.0), ChildOf(frame)))
        .id();
    let rider =
        app.world_mut().spawn((Ragdoll::prefab(prefab), Collides::ALL, Transform::from_xyz(1.0, 0.0, 0.0))).id();
    app.add_systems(FixedUpdate, move |mut all: Query<&mut Transform, With<Obstacle>>, time: Res<Time<Fixed>>| {
        let Ok(mut place) = all.get_mut(platform) else { return };
        place.translation.x = 0.25 * (time.elapsed_secs() - 0.5).max(0.0);
    });
    app.update();
    put(&mut app, rider, &[0.0, 0.0, 1.3, 1.0, 0.0, 0.0, 0.0], &[0.0; 6])?;
    run(&mut app, 3.0);
    let way = place(&app, rider) - Vec3::new(1.0, 1.3, 0.0);
    let along = Quat::from_rotation_y(1.0) * Vec3::X;
    // a ball rolls on what moves under it, but is taken along
    assert!(way.y.abs() < 0.02 && way.dot(along) > 0.1 && way.cross(along).length() < 0.05, "{way}");
    Ok(())
}

#[test]
fn terrain_carries() -> Done {
    let mut app = app(TICK);
    let prefab = ball(&mut app)?;
    // a slope that falls towards +x, turned so that it falls towards -z, and walked on by a controller beside it
    let slope = HeightField::from_fn(Vec2::new(8.0, 4.0), [17, 9], |x, _| 0.1 * (4.0 - x));
    let turned = Transform::from_xyz(1.0, 0.0, 0.0).with_rotation(Quat::from_rotation_y(std::f32::consts::FRAC_PI_2));
    app.world_mut().spawn((Obstacle::HeightField(slope), turned));
    let waves = HeightField::from_fn(Vec2::new(12.0, 4.0), [49, 5], |x, _| 0.03 * (1.0 - (2.0 * x).cos()));
    app.world_mut().spawn((Obstacle::HeightField(waves), Transform::from_xyz(5.0, 0.0, 20.0)));
    let collides = |x: f32, z: f32| (Collides::ALL, Transform::from_xyz(x, 0.0, z));
    let roller = app.world_mut().spawn((Ragdoll::prefab(prefab), collides(1.0, 0.0))).id();
    let walker = walker(&mut app, Vec3::new(0.0, 0.0, 20.0), Collides::ALL);
    app.update();
    put(&mut app, roller, &[0.0, 0.0, 0.62, 1.0, 0.0, 0.0, 0.0], &[0.0; 6])?;
    run(&mut app, 1.5);
    let way = place(&app, roller);
    // 5/7 g sin(a) cos(a) along the slope
    let expected = -0.5 * 5.0 / 7.0 * 9.81 * 0.1 / 1.01 * 1.5 * 1.5;
    assert!((way.z / expected - 1.0).abs() < 0.1 && (way.x - 1.0).abs() < 0.02, "{way}, expected {expected} m along z");
    assert!((way.y - 0.1 * (4.0 + way.z) - 0.2 * 1.01_f32.sqrt()).abs() < 0.02, "{way}");
    run(&mut app, 3.0);
    let walked = place(&app, walker);
    assert!(walked.x > 1.0 && app.world().get::<Unfit>(walker).is_none(), "{walked}");
    Ok(())
}

#[test]
fn two_balls_share_their_momentum() -> Done {
    let mut app = app(TICK);
    let prefab = ball(&mut app)?;
    let mut spawn = |x: f32| {
        app.world_mut().spawn((Ragdoll::prefab(prefab.clone()), Collides::ALL, Transform::from_xyz(x, 0.0, 0.0))).id()
    };
    let (first, second) = (spawn(0.0), spawn(1.0));
    app.update();
    // both fall; each sees the other as a solid that it cannot move, so the sum is kept only roughly
    put(&mut app, first, &[0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0], &[2.0, 0.0, 0.0, 0.0, 0.0, 0.0])?;
    put(&mut app, second, &[0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0], &[0.0; 6])?;
    run(&mut app, 0.45);
    let [a, b] =
        [first, second].map(|entity| app.world().get::<CharacterPose>(entity).map(|pose| pose.linear_velocity.x));
    let (a, b) = (a.ok_or("a pose")?, b.ok_or("a pose")?);
    assert!((a + b - 2.0).abs() < 0.6, "{a} and {b} m/s");
    assert!(b > 0.6 && a < b + 0.1, "{a} and {b} m/s");
    let apart = place(&app, second).x - place(&app, first).x;
    assert!(apart > 0.3, "{apart}");
    Ok(())
}

#[test]
fn walkers_do_not_walk_through_each_other() -> Done {
    let mut app = app(TICK);
    let one = walker(&mut app, Vec3::ZERO, Collides::ALL);
    let other = walker(&mut app, Vec3::new(3.0, 0.0, 0.0), Collides::ALL);
    run(&mut app, 0.1);
    if let Some(mut way) = app.world_mut().get_mut::<MoveDirection>(other) {
        way.direction = Vec3::NEG_X * 0.5;
    }
    for _ in 0..400 {
        app.update();
        let apart = (place(&app, other) - place(&app, one)).with_y(0.0).length();
        assert!(apart > 0.2, "{apart} m apart");
    }
    Ok(())
}

#[test]
fn who_begins_inside_another_passes_through() -> Done {
    let mut app = app(TICK);
    let prefab = ball(&mut app)?;
    let mut spawn = |x: f32| {
        app.world_mut().spawn((Ragdoll::prefab(prefab.clone()), Collides::ALL, Transform::from_xyz(x, 0.0, 0.0))).id()
    };
    let (first, second) = (spawn(0.0), spawn(0.05));
    run(&mut app, 0.5);
    for entity in [first, second] {
        let speed = app.world().get::<CharacterPose>(entity).ok_or("a pose")?.linear_velocity.length();
        assert!(speed < 0.05, "{speed} m/s");
    }
    // apart once, they feel each other
    put(&mut app, first, &[-0.6, 0.0, 0.2, 1.0, 0.0, 0.0, 0.0], &[0.0; 6])?;
    run(&mut app, 0.1);
    put(&mut app, first, &[-0.6, 0.0, 0.2, 1.0, 0.0, 0.0, 0.0], &[3.0, 0.0, 0.0, 0.0, 0.0, 0.0])?;
    run(&mut app, 0.5);
    let pushed = app.world().get::<CharacterPose>(second).ok_or("a pose")?.linear_velocity.x;
    assert!(pushed > 0.5, "{pushed} m/s");
    Ok(())
}

#[test]
fn a_model_without_the_geom_is_refused() -> Done {
    let mut app = app(TICK);
    let text = "<mujoco model='closed'><worldbody><body><freejoint/><geom size='.1'/></body></worldbody></mujoco>";
    let model = marathon_physics::Model::from_xml_str(text, "closed")?;
    let prefab = app.world_mut().resource_mut::<Assets<RagdollPrefab>>().add(RagdollPrefab::from(model));
    let entity = app.world_mut().spawn((Ragdoll::prefab(prefab), Collides::ALL)).id();
    app.update();
    let reason = app.world().get::<Unfit>(entity).map(|unfit| unfit.0.to_string()).ok_or("it is refused")?;
    assert!(reason.contains("'closed' has no geom for obstacles"), "{reason}");
    Ok(())
}
