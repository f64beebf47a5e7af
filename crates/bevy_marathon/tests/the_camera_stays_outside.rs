//! A camera that follows a character is never under the ground or inside a solid, whatever a player does, and it keeps a running
//! character in the middle of its picture.
#![cfg(feature = "render")]

use crate::common;
use bevy::prelude::*;
use bevy_marathon::look::CameraMode;
use bevy_marathon::prelude::*;
use marathon_envs::VecEnvOptions;
use marathon_physics::Model;
use std::f32::consts::{FRAC_PI_3, TAU};
use std::sync::Arc;
use std::time::Duration;

const FRAME: Duration = Duration::from_millis(20);
const PLAYERS: u32 = 4;
/// Half the width of hills and stairs, and thickness of a track, m.
const FIELD: f32 = 30.0;
const BASE: f32 = 8.0;

/// Frames of two minutes; with the variable MARATHON_TEST_LONG, which `tests/long.sh player` sets, those of ten.
fn frames() -> usize {
    let minutes = if std::env::var_os("MARATHON_TEST_LONG").is_some() { 10 } else { 2 };
    minutes * 60 * 50
}

/// A player who presses something else every now and then.
struct Player {
    random: u32,
    character: Entity,
    camera: Entity,
    /// Frames until the next change.
    rest: u32,
    /// Stick, and turn of the camera, rad/s.
    stick: Vec2,
    turn: Vec2,
    jumps: bool,
}

impl Player {
    /// A number from 0 to 1.
    fn next(&mut self) -> f32 {
        self.random = self.random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.random >> 8) as f32 / (1 << 24) as f32
    }

    /// Acts in a frame. Returns the direction of the stick in the world.
    fn act(&mut self, world: &mut World) -> Vec3 {
        if self.rest == 0 {
            self.rest = 10 + (self.next() * 150.0) as u32;
            self.stick = Vec2::from_angle(self.next() * TAU) * (1.3 * self.next() - 0.3).clamp(0.0, 1.0);
            let turns = self.next() < 0.5;
            self.turn = if turns { 6.0 * Vec2::new(self.next() - 0.5, self.next() - 0.5) } else { Vec2::ZERO };
            self.jumps = self.next() < 0.1;
            let (zoom, mode) = (0.4 + 1.4 * self.next(), self.next());
            let mut camera = world.get_mut::<FollowCamera>(self.camera).expect("it is there");
            match mode {
                ..0.1 => camera.zoom(zoom),
                0.1..0.15 => camera.set_mode(CameraMode::Side),
                0.15..0.2 => camera.set_mode(CameraMode::Orbit),
                0.2..0.25 => camera.reduced_motion ^= true,
                0.25..0.6 => camera.set_mode(CameraMode::Chase),
                _ => {}
            }
        }
        self.rest -= 1;
        let mut camera = world.get_mut::<FollowCamera>(self.camera).expect("it is there");
        if self.turn != Vec2::ZERO {
            camera.turn(self.turn.x * FRAME.as_secs_f32(), self.turn.y * FRAME.as_secs_f32());
        }
        let at = world.get::<Transform>(self.camera).expect("it is there");
        let ahead = at.forward().with_y(0.0).normalize_or_zero();
        let right = at.right().with_y(0.0).normalize_or_zero();
        ahead * self.stick.y + right * self.stick.x
    }
}

/// Lets random players play in the world of `spawn` for some minutes each. `act` moves a character in a direction. `check` gets each
/// place of a camera, in the axes of the character's track, and its character.
fn play(
    spawn: impl Fn(&mut World, u32) -> Entity,
    mut act: impl FnMut(&mut World, &Player, Vec3),
    mut check: impl FnMut(&World, Entity, Vec3, f32),
) {
    let mut app = common::app(FRAME);
    app.add_plugins(FollowCameraPlugin);
    let mut players: Vec<Player> = (0..PLAYERS)
        .map(|seed| {
            let character = spawn(app.world_mut(), seed);
            let camera = app.world_mut().spawn(FollowCamera::following(character)).id();
            let (stick, turn) = (Vec2::ZERO, Vec2::ZERO);
            Player { random: seed * 7919 + 1, character, camera, rest: 0, stick, turn, jumps: false }
        })
        .collect();
    (0..5).for_each(|_| app.update());
    for _ in 0..frames() {
        for player in &mut players {
            let way = player.act(app.world_mut());
            act(app.world_mut(), player, way);
        }
        app.update();
        for player in &players {
            let world = app.world();
            let at = world.get::<Transform>(player.camera).expect("it is there").translation;
            assert!(at.is_finite(), "{at}");
            let track = world.get::<Track>(player.character).expect("it is there").place().compute_affine().inverse();
            let camera = world.get::<FollowCamera>(player.camera).expect("it is there");
            check(world, player.character, track.transform_point3(at), camera.distance);
        }
    }
}

/// Marathon Man on a ground, steered by the players. `height` is that of the ground at a distance along the track.
fn on_ground(ground: Ground, laid: Option<Vec<f32>>, height: impl Fn(f32) -> f32) {
    let policy = common::policy("MarathonManController");
    let spawn = |world: &mut World, seed: u32| {
        let policy = CharacterPolicy(world.resource_mut::<Assets<PolicyAsset>>().add(policy.clone()));
        let restart = Restart { after_fall: 1.0, on_time_up: false };
        let ragdoll = Ragdoll::agent("MarathonManController").with_seed(u64::from(seed), 0).on(ground);
        let track = Transform::from_xyz(3.0, 0.0, -20.0 * seed as f32);
        let character = world.spawn((ragdoll, policy, restart, track, MoveDirection::default())).id();
        if let Some(laid) = &laid {
            world.entity_mut(character).insert(LaidGround(laid.clone()));
        }
        character
    };
    let act = |world: &mut World, player: &Player, way: Vec3| {
        world.get_mut::<MoveDirection>(player.character).expect("it is there").direction = way;
        if let Some(mut command) = world.get_mut::<AgentCommand>(player.character) {
            command.set("jump", f64::from(u8::from(player.jumps))).expect("it jumps");
        }
    };
    let (mut far, mut lowest, mut places) = (0.0_f32, f32::INFINITY, 0_usize);
    play(spawn, act, |_, _, at, distance| {
        // beside the fields is level ground, or none: a character may run off a narrow track, and fall below its base
        let beside = at.z.abs() > FIELD && ground != Ground::Track;
        let over = at.y - if beside { 0.0 } else { height(at.x) };
        if ground == Ground::Track
            && (at.z.abs() > bevy_marathon::TRACK_HALF_WIDTH as f32 || over.is_infinite() || at.y < -BASE)
        {
            return;
        }
        (far, lowest, places) = (far.max(distance), lowest.min(over), places + 1);
        assert!(over > 0.1, "{ground:?}: {over} m over the ground at {at}");
    });
    println!("{ground:?}: at least {lowest:.2} m over the ground, up to {far:.1} m away, {places} places");
    assert!(far > 3.0 && places > frames(), "{ground:?}: it is {far} m away at most, seen {places} times");
}

#[test]
fn it_is_above_level_ground() {
    on_ground(Ground::Level, None, |_| 0.0);
}

#[test]
fn it_is_above_stairs() {
    on_ground(Ground::Stairs, None, |x| Ground::Stairs.height(f64::from(x)) as f32 - 0.06);
}

#[test]
fn it_is_above_hills() {
    on_ground(Ground::Hills, None, |x| Ground::Hills.height(f64::from(x)) as f32 - 0.02);
}

#[test]
fn it_is_above_a_course() -> Result<(), Box<dyn std::error::Error>> {
    let mut task = TaskConfig::named("TerrainWalker2d-v0")?;
    task.options.set("course", "mixed");
    task.options.set("difficulty", 1.0);
    let mut env = task.vec_env(&VecEnvOptions { agents: 1, seed: 3, ..VecEnvOptions::default() })?;
    env.reset(Some(3), &mut vec![0.0; env.spec().obs])?;
    let laid = env.ground(0, 0)?;
    let elevations = laid.clone();
    on_ground(Ground::Track, Some(laid), move |x| {
        // the first point is at -6 m, and the next ones 10 cm apart; the two rows are alike
        let (at, columns) = ((x + 6.0) / 0.1, elevations.len() / 2);
        if !(0.0..=(columns - 1) as f32).contains(&at) {
            return f32::NEG_INFINITY;
        }
        let point = |i: f32| elevations[i as usize];
        point(at.floor()) + (at - at.floor()) * (point(at.ceil()) - point(at.floor()))
    });
    Ok(())
}

/// Half sides and centers of the walls, m, in MuJoCo's axes; the last two are posts.
const WALLS: [([f32; 3], [f32; 3]); 7] = [
    ([6.0, 0.2, 1.5], [0.0, 4.0, 1.5]),
    ([6.0, 0.2, 1.5], [0.0, -4.0, 1.5]),
    ([0.2, 4.0, 1.5], [6.0, 0.0, 1.5]),
    ([0.2, 4.0, 1.5], [-6.0, 0.0, 1.5]),
    ([0.5, 1.5, 1.0], [2.0, 1.0, 1.0]),
    ([0.1, 0.1, 1.5], [-2.0, 1.0, 1.5]),
    ([0.1, 0.1, 1.5], [-1.0, -2.0, 1.5]),
];

#[test]
fn it_is_outside_walls_and_posts() -> Result<(), Box<dyn std::error::Error>> {
    let numbers = |n: [f32; 3]| n.map(|x| x.to_string()).join(" ");
    let wall = |(half, at): &([f32; 3], [f32; 3])| {
        format!("<geom type='box' size='{}' pos='{}'/>", numbers(*half), numbers(*at))
    };
    let walls: String = WALLS.iter().map(wall).collect();
    let text = format!(
        "<mujoco><worldbody><geom type='plane' size='0 0 1'/>{walls}<body pos='0 0 .9'>
           <joint name='x' type='slide' axis='1 0 0' damping='30'/><joint name='y' type='slide' axis='0 1 0' damping='30'/>
           <geom type='capsule' fromto='0 0 -.5 0 0 .5' size='.3' mass='60'/></body></worldbody>
         <actuator><motor joint='x' gear='150'/><motor joint='y' gear='150'/></actuator></mujoco>"
    );
    let model = Arc::new(Model::from_xml_str(&text, "room")?);
    let spawn = |world: &mut World, seed: u32| {
        let prefab = world.resource_mut::<Assets<RagdollPrefab>>().add(RagdollPrefab { model: model.clone() });
        world.spawn((Ragdoll::prefab(prefab).with_seed(u64::from(seed), 0), Controls::default())).id()
    };
    let act = |world: &mut World, player: &Player, way: Vec3| {
        world.get_mut::<Controls>(player.character).expect("it is there").0 = vec![way.x, -way.z];
    };
    let (mut nearest, mut near, mut seen) = (f32::INFINITY, 0, 0);
    play(spawn, act, |_, _, at, distance| {
        let at = [at.x, -at.z, at.y];
        let inside = |(half, center): &([f32; 3], [f32; 3])| {
            (0..3).map(|k| (at[k] - center[k]).abs() - half[k]).fold(f32::NEG_INFINITY, f32::max)
        };
        let clear = WALLS.iter().map(inside).fold(at[2], f32::min);
        (nearest, near, seen) = (nearest.min(clear), near + usize::from(distance < 3.0), seen + 1);
        assert!(clear > 0.04, "{clear} m from a wall at {at:?}");
    });
    println!("walls: at least {nearest:.2} m away; closer than 3 m in {near} of {seen} frames");
    assert!(near > seen / 10, "the walls push it in: {near} of {seen}");
    Ok(())
}

/// A camera that looks at a character which runs along +x at 3 m/s, after some seconds.
fn running(set: impl Fn(&mut FollowCamera)) -> Result<(FollowCamera, f32), Box<dyn std::error::Error>> {
    let text = "<mujoco><option gravity='0 0 0'/><worldbody><body pos='0 0 1'><freejoint/><geom size='.2'/></body></worldbody></mujoco>";
    let mut app = common::app(FRAME);
    app.add_plugins(FollowCameraPlugin);
    let model = Arc::new(Model::from_xml_str(text, "ball")?);
    let prefab = app.world_mut().resource_mut::<Assets<RagdollPrefab>>().add(RagdollPrefab { model });
    let ball = app.world_mut().spawn(Ragdoll::prefab(prefab)).id();
    let mut camera = FollowCamera::following(ball);
    set(&mut camera);
    let camera = app.world_mut().spawn(camera).id();
    (0..3).for_each(|_| app.update());
    let key = *app.world().get::<RagdollState>(ball).ok_or("it is simulated")?;
    let mut marathon = app.world_mut().resource_mut::<Marathon>();
    let mut state = marathon.state(&key).ok_or("a state")?;
    state.qvel[0] = 4.0;
    marathon.set_state(&key, &state)?;
    (0..400).for_each(|_| app.update());
    let Some(Projection::Perspective(lens)) = app.world().get::<Projection>(camera) else {
        return Err("a lens".into());
    };
    Ok((app.world().get::<FollowCamera>(camera).ok_or("a camera")?.clone(), lens.fov))
}

#[test]
fn reduced_motion_leaves_the_camera_as_the_player_turned_it() -> Result<(), Box<dyn std::error::Error>> {
    let set = |reduced: bool| {
        move |camera: &mut FollowCamera| {
            camera.set_mode(CameraMode::Chase);
            camera.reduced_motion = reduced;
            // from the runner's right, and no more hands on it
            camera.turn(1.2, 0.0);
        }
    };
    let (usual, wide) = running(set(false))?;
    let (calm, fov) = running(set(true))?;
    assert!((calm.distance - 3.8).abs() < 0.01 && (fov - FRAC_PI_3).abs() < 1e-6, "{} m, {fov} rad", calm.distance);
    assert!((usual.distance - 4.6).abs() < 0.1 && (wide - fov - 0.1047).abs() < 0.005, "{} m, {wide}", usual.distance);
    // behind one that runs along +x is -90 degrees
    let behind = |camera: &FollowCamera| (camera.yaw + TAU / 4.0).to_degrees().rem_euclid(360.0);
    let away = |angle: f32| angle.min(360.0 - angle);
    assert!(away(behind(&usual)) < 5.0 && away(behind(&calm)) > 40.0, "{} and {}", behind(&usual), behind(&calm));
    Ok(())
}
