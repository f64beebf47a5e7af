//! Steps, landings, skills, falls and blows of characters are messages. An app can make a character limp, weaken its limbs
//! and give it its strength back.

use crate::common::{app, policy, run_until};
use bevy::prelude::*;
use bevy_marathon::prelude::*;
use marathon_physics::Model;
use std::sync::Arc;
use std::time::Duration;

const FRAME: Duration = Duration::from_millis(10);

/// All messages of a character, in their order.
#[derive(Resource, Default, Debug, PartialEq)]
struct Heard {
    steps: Vec<FootContact>,
    landed: Vec<Landed>,
    fell: Vec<Fell>,
    got_up: Vec<GotUp>,
    skills: Vec<(String, bool)>,
    hits: Vec<HitReceived>,
}

#[expect(clippy::too_many_arguments, reason = "a system names what it reads")]
fn hear(
    mut heard: ResMut<Heard>,
    mut steps: MessageReader<FootContact>,
    mut landed: MessageReader<Landed>,
    mut fell: MessageReader<Fell>,
    mut got_up: MessageReader<GotUp>,
    mut started: MessageReader<SkillStarted>,
    mut ended: MessageReader<SkillEnded>,
    mut hits: MessageReader<HitReceived>,
) {
    heard.steps.extend(steps.read());
    heard.landed.extend(landed.read());
    heard.fell.extend(fell.read());
    heard.got_up.extend(got_up.read());
    heard.skills.extend(started.read().map(|skill| (skill.skill.clone(), true)));
    heard.skills.extend(ended.read().map(|skill| (skill.skill.clone(), false)));
    heard.hits.extend(hits.read());
}

/// An app with a character of an agent and its policy, which begins standing.
fn app_with(agent: &str, frame: Duration, more: impl Bundle) -> (App, Entity) {
    let mut app = app(frame);
    app.init_resource::<Heard>().add_systems(FixedUpdate, hear.after(MarathonSystems::Report));
    let policy = policy(agent);
    let task_config = TaskConfig::of_policy(policy.meta()).starting_first().expect("the agent exists");
    let policy = CharacterPolicy(app.world_mut().resource_mut::<Assets<PolicyAsset>>().add(policy));
    let character = app.world_mut().spawn((Ragdoll::agent(agent).with_task_config(task_config), policy, more)).id();
    (app, character)
}

/// A command of an agent with these numbers, from the first decision on.
fn command(agent: &str, numbers: &[(&str, f64)]) -> Result<AgentCommand, Box<dyn std::error::Error>> {
    let mut command = AgentCommand::new(&marathon_envs::registry::agent(agent)?.facts().command);
    for (name, value) in numbers {
        command.set(name, *value)?;
    }
    Ok(command)
}

fn frames(app: &mut App, seconds: f64) {
    (0..(seconds / FRAME.as_secs_f64()).round() as usize).for_each(|_| app.update());
}

fn heard(app: &App) -> &Heard {
    app.world().resource::<Heard>()
}

fn mode(app: &App, character: Entity) -> RagdollMode {
    *app.world().get(character).expect("it is there")
}

/// Height of a body of a character, m.
fn height(app: &App, character: Entity, body: &str) -> f32 {
    let part = app.world().get::<Anatomy>(character).and_then(|anatomy| anatomy.part(body)).expect("it has this body");
    app.world().get::<GlobalTransform>(part).expect("it has a place").translation().y
}

/// Pushes a body of a character, N s.
fn blow(app: &mut App, ragdoll: Entity, body: &str, impulse: Vec3) {
    let anatomy = app.world().get::<Anatomy>(ragdoll).expect("it is simulated");
    let body = anatomy.model.bodies.iter().position(|b| b.name == body).expect("it has this body");
    app.world_mut().write_message(Push { ragdoll, body, force: impulse / 0.1, at: None, seconds: 0.1 });
}

/// An episode without a time limit.
fn untimed() -> Restart {
    Restart { on_time_up: false, ..default() }
}

#[test]
fn steps_say_where_and_how_fast() -> Result<(), Box<dyn std::error::Error>> {
    let agent = "MarathonManController";
    // its forward axis is -z of the world
    let track = Transform::from_xyz(3.0, 0.5, -2.0).with_rotation(Quat::from_rotation_y(std::f32::consts::FRAC_PI_2));
    let (mut app, character) = app_with(agent, FRAME, (command(agent, &[("speed", 1.5)])?, untimed(), track));
    frames(&mut app, 5.0);
    let steps: Vec<FootContact> = heard(&app).steps.clone();
    assert!(steps.len() > 12, "{} steps", steps.len());
    assert!(steps.iter().all(|step| step.ragdoll == character && step.point.is_finite()));
    for step in &steps {
        // the soles are near the height of the track
        assert!((-0.03..0.15).contains(&(step.point.y - 0.5)), "{step:?}");
        assert!((step.point.x - 3.0).abs() < 2.5 && (0.0..6.0).contains(&step.speed), "{step:?}");
    }
    let down: Vec<&FootContact> = steps.iter().filter(|step| step.down).collect();
    let far = down.first().zip(down.last()).map_or(0.0, |(first, last)| first.point.z - last.point.z);
    let distance = app.world().get::<Episode>(character).map_or(0.0, |episode| episode.distance as f32);
    assert!(distance > 4.0 && (far - distance).abs() < 1.0, "steps over {far} m of {distance} m");
    // a foot swings faster than the body walks; some of it is left on arrival
    let fastest = steps.iter().map(|step| step.speed).fold(0.0, f32::max);
    assert!(fastest > 0.5, "{fastest} m/s");
    Ok(())
}

#[test]
fn a_jump_and_a_flip_begin_land_and_end_at_any_frame_rate() -> Result<(), Box<dyn std::error::Error>> {
    let agent = "MarathonManController";
    for (button, aloft) in [("jump", 0.2..0.8), ("backflip", 0.14..1.0)] {
        let mut all = Vec::new();
        for frame in [4, 10, 70] {
            let frame = Duration::from_millis(frame);
            // the button stays pressed, so that the motion is the same at every frame rate
            let (mut app, _) = app_with(agent, frame, (command(agent, &[(button, 1.0)])?, untimed()));
            let most = Duration::from_secs(6).div_duration_f64(frame) as usize;
            run_until(&mut app, most, "the end of the skill", |world| world.resource::<Heard>().skills.len() > 1);
            all.push(app.world_mut().remove_resource::<Heard>().ok_or("it listens")?);
        }
        for heard in &all {
            assert_eq!(heard.skills[..2], [(button.to_string(), true), (button.to_string(), false)]);
            let landed = heard.landed.first().ok_or(format!("no landing of a {button}"))?;
            assert!(aloft.contains(&landed.seconds) && (1.0..5.0).contains(&landed.speed), "{button}: {landed:?}");
            assert!(heard.fell.is_empty(), "{button}: {:?}", heard.fell);
        }
        // a long frame has ticks after the end, so the first landings are compared
        assert!(all.iter().all(|heard| heard.landed[0] == all[0].landed[0]), "{button}: {all:?}");
    }
    Ok(())
}

#[test]
fn a_plane_character_without_numbered_skills_tells_its_jump() -> Result<(), Box<dyn std::error::Error>> {
    let agent = "HopperController";
    let (mut app, character) = app_with(agent, FRAME, (command(agent, &[("velocity", 0.0)])?, untimed()));
    frames(&mut app, 1.0);
    assert!(heard(&app).skills.is_empty());
    *app.world_mut().resource_mut::<Heard>() = Heard::default();
    app.world_mut().get_mut::<AgentCommand>(character).ok_or("it takes commands")?.set("jump", 1.0)?;
    run_until(&mut app, 200, "the landing of a jump", |world| !world.resource::<Heard>().landed.is_empty());
    app.world_mut().get_mut::<AgentCommand>(character).ok_or("it takes commands")?.rest();
    frames(&mut app, 2.0);
    assert_eq!(heard(&app).skills, [("jump".into(), true), ("jump".into(), false)]);
    Ok(())
}

#[test]
fn one_who_is_pushed_over_gets_up() -> Result<(), Box<dyn std::error::Error>> {
    let agent = "MarathonManController";
    // a push from the front makes it sit down, with the torso bent to either side
    for (impulse, prone) in [(300.0, Some(true)), (-300.0, None)] {
        let (mut app, ragdoll) = app_with(agent, FRAME, (command(agent, &[("speed", 0.0)])?, untimed()));
        frames(&mut app, 1.0);
        assert_eq!((mode(&app, ragdoll), heard(&app).fell.len()), (RagdollMode::Powered, 0));
        blow(&mut app, ragdoll, "torso", Vec3::X * impulse);
        run_until(&mut app, 300, "a fall", |world| !world.resource::<Heard>().fell.is_empty());
        let fall = heard(&app).fell[0];
        assert!(fall.ragdoll == ragdoll && prone.is_none_or(|prone| fall.prone == prone), "{fall:?}");
        app.update();
        assert_eq!(mode(&app, ragdoll), RagdollMode::GettingUp);
        run_until(&mut app, 1000, "standing", |world| !world.resource::<Heard>().got_up.is_empty());
        app.update();
        assert_eq!(mode(&app, ragdoll), RagdollMode::Powered);
        assert!(height(&app, ragdoll, "butt") > 0.7);
        assert_eq!(heard(&app).fell.len(), 1, "{:?}", heard(&app));
        assert!(app.world().get::<Episode>(ragdoll).is_some_and(|episode| episode.number == 1));
    }
    Ok(())
}

#[test]
fn a_limp_character_lies_until_it_has_its_strength_again() -> Result<(), Box<dyn std::error::Error>> {
    let agent = "MarathonManController";
    let (mut app, ragdoll) = app_with(agent, FRAME, (command(agent, &[("speed", 1.0)])?, untimed()));
    frames(&mut app, 1.0);
    app.world_mut().entity_mut(ragdoll).insert(RagdollMode::Limp);
    frames(&mut app, 2.0);
    assert!(height(&app, ragdoll, "butt") < 0.4, "{} m", height(&app, ragdoll, "butt"));
    // longer than the task lets a character lie that tries to get up
    frames(&mut app, 10.0);
    assert_eq!((mode(&app, ragdoll), heard(&app).fell.len()), (RagdollMode::Limp, 0));
    let decisions = app.world().get::<Episode>(ragdoll).map(|episode| episode.decisions);
    app.world_mut().entity_mut(ragdoll).insert(RagdollMode::Powered);
    frames(&mut app, 0.2);
    assert_eq!(mode(&app, ragdoll), RagdollMode::GettingUp);
    run_until(&mut app, 1000, "standing", |world| !world.resource::<Heard>().got_up.is_empty());
    frames(&mut app, 0.1);
    let episode = app.world().get::<Episode>(ragdoll).ok_or("it has an episode")?;
    assert!(episode.number == 1 && Some(episode.decisions) > decisions, "{episode:?}");
    assert_eq!((mode(&app, ragdoll), heard(&app).fell.len()), (RagdollMode::Powered, 0));
    Ok(())
}

#[test]
fn one_whose_task_ends_with_a_fall_begins_again() {
    let (mut app, ragdoll) = app_with("walker2d", FRAME, (untimed(), RagdollMode::Limp));
    // limp from the first decision on
    frames(&mut app, 3.0);
    assert_eq!(mode(&app, ragdoll), RagdollMode::Limp);
    assert!(app.world().get::<Episode>(ragdoll).is_some_and(|episode| (episode.number, episode.decisions) == (1, 0)));
    app.world_mut().entity_mut(ragdoll).insert(RagdollMode::Powered);
    frames(&mut app, 0.3);
    assert_eq!((heard(&app).fell.len(), mode(&app, ragdoll)), (1, RagdollMode::Powered));
    assert!(app.world().get::<Episode>(ragdoll).is_some_and(|episode| episode.number == 2));
    // after a fall it lies limp, and `Powered` begins the next episode
    app.world_mut()
        .entity_mut(ragdoll)
        .insert((Restart { after_fall: f64::INFINITY, on_time_up: false }, RagdollMode::Limp));
    frames(&mut app, 3.0);
    app.world_mut().entity_mut(ragdoll).insert(RagdollMode::Powered);
    frames(&mut app, 1.0);
    assert!(app.world().get::<Episode>(ragdoll).is_some_and(|episode| episode.down));
    assert_eq!(mode(&app, ragdoll), RagdollMode::Limp);
    app.world_mut().entity_mut(ragdoll).insert(RagdollMode::Powered);
    frames(&mut app, 0.2);
    assert!(app.world().get::<Episode>(ragdoll).is_some_and(|episode| episode.number == 3 && !episode.down));
    assert_eq!(mode(&app, ragdoll), RagdollMode::Powered);
}

/// Two arms of 1 kg, 0.4 m long, which servos hold level.
fn arms(app: &mut App, more: impl Bundle) -> Entity {
    let arm = |side: &str, y: f64| {
        format!(
            "<body name='{side}_arm' pos='0 {y} 0'><joint name='{side}_elbow' axis='0 1 0' damping='0.5'/>\
            <geom type='capsule' fromto='0 0 0 0.4 0 0' size='0.04' mass='1'/></body>"
        )
    };
    let servo = |side: &str| format!("<position name='{side}_servo' joint='{side}_elbow' kp='60' kv='2'/>");
    let text = format!(
        "<mujoco><worldbody><body name='trunk' pos='0 0 2'><geom size='.1' mass='50'/>{}{}</body></worldbody>\
        <actuator>{}{}</actuator></mujoco>",
        arm("left", 0.3),
        arm("right", -0.3),
        servo("left"),
        servo("right")
    );
    let model = Arc::new(Model::from_xml_str(&text, "arms").expect("it is a model"));
    let prefab = app.world_mut().resource_mut::<Assets<RagdollPrefab>>().add(RagdollPrefab { model });
    app.world_mut().spawn((Ragdoll::prefab(prefab), more)).id()
}

/// How far the left and the right arm hang, rad.
fn hang(app: &App, arms: Entity) -> [f64; 2] {
    let state = app.world().get::<RagdollState>(arms).copied().expect("it is simulated");
    let qpos = app.world().resource::<Marathon>().state(&state).expect("it has a state").qpos;
    [qpos[0], qpos[1]]
}

#[test]
fn the_strength_of_a_limb_is_set_by_its_name() -> Result<(), Box<dyn std::error::Error>> {
    let mut app = app(FRAME);
    let arms = arms(&mut app, ());
    let strength = |app: &mut App| app.world_mut().get_mut::<LimbStrength>(arms).expect("it is required").clone();
    let error = strength(&mut app).set("left_arm", 0.5).expect_err("it is not simulated yet");
    assert!(error.to_string().contains("not in the simulation yet"), "{error}");
    frames(&mut app, 1.0);
    let held = hang(&app, arms);
    assert!(held.iter().all(|angle| angle.abs() < 0.1), "{held:?}");
    for (name, factor, expected) in [
        (
            "left_amr",
            0.5,
            "no limb 'left_amr'; did you mean 'left_arm'? known: left_arm, right_arm, left_servo, right_servo",
        ),
        ("trunk", 0.5, "no limb 'trunk'; known: left_arm, right_arm, left_servo, right_servo"),
        ("left_arm", -1.0, "strength of 'left_arm' is -1, expected a factor of 0 to 10"),
        ("left_arm", f64::NAN, "strength of 'left_arm' is NaN, expected a factor of 0 to 10"),
    ] {
        let error = strength(&mut app).set(name, factor).expect_err("it is wrong");
        assert_eq!(error.to_string(), expected);
    }
    let mut set = |name: Option<&str>, factor: f64| -> Result<[f64; 2], StrengthError> {
        let mut strength = app.world_mut().get_mut::<LimbStrength>(arms).expect("it is required");
        match name {
            Some(name) => strength.set(name, factor)?,
            None => strength.whole = factor,
        }
        frames(&mut app, 3.0);
        Ok(hang(&app, arms))
    };
    let [left, right] = set(Some("left_arm"), 0.0)?;
    assert!(left > 1.2 && (right - held[1]).abs() < 1e-3, "the left arm hangs: {left} and {right} rad");
    let [left, right] = set(Some("right_servo"), 0.25)?;
    assert!(left > 1.2 && (2.0 * held[1]..1.0).contains(&right), "the right arm sinks: {left} and {right} rad");
    let hang = set(None, 0.0)?;
    assert!(hang.iter().all(|angle| *angle > 1.2), "{hang:?}");
    app.world_mut().get_mut::<LimbStrength>(arms).expect("it is required").reset();
    app.world_mut().get_mut::<LimbStrength>(arms).expect("it is required").whole = 1.0;
    frames(&mut app, 5.0);
    let again = self::hang(&app, arms);
    assert!(again.iter().zip(held).all(|(again, held)| (again - held).abs() < 1e-3), "{again:?}");
    Ok(())
}

#[test]
fn a_blow_softens_the_limb_that_it_hits_for_a_while() {
    // how far the arms move with a blow on the left one, and where they are a second later
    let run = |reactions: Option<HitReactions>| {
        let mut app = app(FRAME);
        app.init_resource::<Heard>().add_systems(FixedUpdate, hear.after(MarathonSystems::Report));
        let arms = arms(&mut app, ());
        if let Some(reactions) = reactions {
            app.world_mut().entity_mut(arms).insert(reactions);
        }
        frames(&mut app, 1.0);
        blow(&mut app, arms, "left_arm", Vec3::NEG_Y * 2.0);
        let mut farthest = [0.0_f64; 2];
        for _ in 0..100 {
            app.update();
            let now = hang(&app, arms);
            farthest = std::array::from_fn(|i| farthest[i].max(now[i]));
        }
        frames(&mut app, 2.0);
        let heard = app.world_mut().remove_resource::<Heard>().expect("it listens");
        let [hit] = heard.hits[..] else { panic!("one blow: {heard:?}") };
        assert!(hit.ragdoll == arms && hit.impulse.distance(Vec3::NEG_Y * 2.0) < 1e-4, "{hit:?}");
        (farthest, hang(&app, arms))
    };
    let (stiff, rest) = run(None);
    let (soft, later) = run(Some(HitReactions::default()));
    assert!(soft[0] > 1.2 * stiff[0], "{} rad with reactions, {} without", soft[0], stiff[0]);
    assert!(later.iter().zip(rest).all(|(later, rest)| (later - rest).abs() < 1e-3), "{later:?} and {rest:?}");
    // the trunk is between the arms, two joints away, so the right one gives way a little
    let (near, _) = run(Some(HitReactions { reach: 1, ..default() }));
    assert!(near[1] == stiff[1] && soft[1] > stiff[1], "{} {} {}", near[1], stiff[1], soft[1]);
}

#[test]
fn a_pose_says_where_the_character_is_and_how_it_moves() -> Result<(), Box<dyn std::error::Error>> {
    let agent = "MarathonManController";
    let track = Transform::from_xyz(3.0, 0.5, -2.0).with_rotation(Quat::from_rotation_y(1.0));
    let (mut app, character) = app_with(agent, FRAME, (command(agent, &[("speed", 1.5)])?, untimed(), track));
    frames(&mut app, 3.0);
    let pose = |app: &App| *app.world().get::<CharacterPose>(character).expect("it is simulated");
    let (first, mut way, mut forward) = (pose(&app), Vec3::ZERO, Vec3::ZERO);
    for _ in 0..100 {
        app.update();
        way += pose(&app).linear_velocity * FRAME.as_secs_f32();
        // the torso turns with every step
        forward += pose(&app).forward();
        let root = app.world().get::<Anatomy>(character).and_then(|anatomy| anatomy.part("torso")).ok_or("a torso")?;
        let place = app.world().get::<GlobalTransform>(root).ok_or("a place")?.translation();
        assert!(place.distance(pose(&app).position) < 1e-4, "{place} and {:?}", pose(&app));
    }
    let moved = pose(&app).position - first.position;
    assert!(moved.length() > 1.0 && moved.distance(way) < 0.05, "{moved} and {way}");
    let angle = forward.angle_between(moved.with_y(0.0));
    assert!(angle < 0.5 && forward.y == 0.0, "{angle} rad");
    // it starts along +x of its track
    let angle = forward.angle_between(track.rotation * Vec3::X);
    assert!(angle < 0.6, "{angle} rad");
    assert!(pose(&app).angular_velocity.length() < 10.0);
    Ok(())
}
