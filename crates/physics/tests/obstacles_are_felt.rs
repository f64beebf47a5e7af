//! Obstacles of an agent act as static geoms of the model do, and those that move push and carry.

use marathon_physics::lanes::Isa;
use marathon_physics::model::HField;
use marathon_physics::spec::{self, Geom, ModelSpec};
use marathon_physics::{AgentState, Batch, BatchOptions, Model, Obstacle, ObstacleShape};
use std::sync::Arc;

type Done = Result<(), Box<dyn std::error::Error>>;

/// A body of one geom that falls, above a floor or not.
fn world(geom: &str, floor: bool) -> Result<ModelSpec, Box<dyn std::error::Error>> {
    let floor = if floor { r#"<geom name="floor" type="plane" size="0 0 1"/>"# } else { "" };
    let text = format!(
        r#"<mujoco><option timestep="0.002"/><asset><mesh name="wedge" vertex="-.1 -.1 -.1 .1 -.1 -.1 -.1 .1 -.1 .1 .1 -.1 0 0 .2"/></asset>
        <worldbody>{floor}<body name="b" pos="0.03 0.02 0.5" euler="20 35 10"><freejoint/><geom name="g" {geom}/></body></worldbody></mujoco>"#
    );
    Ok(ModelSpec::from_xml_str(&text, "falls")?)
}

fn shapes() -> [ObstacleShape; 4] {
    [
        ObstacleShape::Sphere { radius: 0.3 },
        ObstacleShape::Capsule { radius: 0.2, half_length: 0.3 },
        ObstacleShape::Box { half_size: [0.4, 0.3, 0.1] },
        ObstacleShape::HField(Arc::new(hills())),
    ]
}

/// Hills of 5 x 4 cells.
fn hills() -> HField {
    let data = (0..30).map(|k| ((k * k * 7 + k * 3) % 11) as f32 / 10.0).collect();
    HField { name: String::new(), nrow: 5, ncol: 6, size: [0.6, 0.5, 0.15, 0.2], data }
}

/// The same solid as a geom of the model.
fn fixed(obstacle: &Obstacle) -> Geom {
    let geom = match obstacle.shape.clone() {
        ObstacleShape::Sphere { radius } => Geom::sphere(radius),
        ObstacleShape::Capsule { radius, half_length } => {
            Geom::sphere(1.0).set("type", "capsule").set("size", [radius, half_length])
        }
        ObstacleShape::Box { half_size } => Geom::cuboid(half_size),
        ObstacleShape::HField(_) => Geom::hfield("hills"),
    };
    geom.pos(obstacle.pos).quat(obstacle.quat)
}

fn double(model: &Model, agents: usize) -> Result<Batch, Box<dyn std::error::Error>> {
    Ok(Batch::new(model, &BatchOptions { agents, isa: Isa::F64, ..BatchOptions::default() })?)
}

#[test]
fn an_obstacle_acts_as_a_static_geom() -> Done {
    let kinds =
        ["sphere", "capsule", "cylinder", "ellipsoid", "box"].map(|kind| format!(r#"type="{kind}" size=".1 .15 .2""#));
    for geom in kinds.iter().map(String::as_str).chain([r#"type="mesh" mesh="wedge""#]) {
        for shape in shapes() {
            let turn = [0.9, 0.1, -0.2, 0.3].map(|x: f64| x / 0.95_f64.sqrt());
            let obstacle = Obstacle { quat: turn, ..Obstacle::new(shape.clone(), [0.0, 0.0, 0.0]) };
            let mut with_geom = world(geom, false)?;
            if matches!(obstacle.shape, ObstacleShape::HField(_)) {
                // a file lists the rows from the largest y on
                let HField { nrow, ncol, size, data, .. } = hills();
                let data: Vec<f64> = data.chunks(ncol).rev().flatten().map(|x| f64::from(*x)).collect();
                with_geom.add(spec::HField::new("hills", nrow, ncol, size).elevation(&data))?;
            }
            with_geom.add_to("world", fixed(&obstacle))?;
            let mut with_obstacles = world(geom, false)?;
            with_obstacles.add_obstacles()?;
            let (mut a, mut b) = (double(&with_geom.compile()?, 1)?, double(&with_obstacles.compile()?, 1)?);
            b.set_obstacles(0, std::slice::from_ref(&obstacle));
            let mut touched = false;
            // between hulls and prisms, the search may take another way out after the last digit differs
            let searched = ["cylinder", "ellipsoid", "mesh"].iter().any(|kind| geom.contains(kind));
            let steps = if searched && matches!(shape, ObstacleShape::HField(_)) { 115 } else { 250 };
            for step in 0..steps {
                a.step(&[], 1);
                b.step(&[], 1);
                touched |= b.qvel(0)[..2].iter().any(|v| v.abs() > 1e-3);
                let apart = a.qpos(0).iter().zip(b.qpos(0)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(apart < 1e-9, "{geom} on {shape:?}, step {step}: {apart:e}");
            }
            assert!(touched, "{geom} has not touched {shape:?}");
        }
    }
    Ok(())
}

#[test]
fn everyone_has_obstacles_of_their_own() -> Done {
    let mut spec = world(r#"type="capsule" size=".1 .15""#, true)?;
    spec.add_obstacles()?;
    let model = spec.compile()?;
    let shapes = shapes();
    let of = |agent: usize| -> Vec<Obstacle> {
        (0..agent % 4)
            .map(|k| {
                let at = [0.05 * agent as f64 - 0.2, 0.1 * k as f64, 0.05];
                Obstacle {
                    velocity: [0.1 * k as f64, 0.0, 0.02],
                    angular_velocity: [0.0, 0.3, 1.0],
                    ..Obstacle::new(shapes[(agent + k) % 4].clone(), at)
                }
            })
            .collect()
    };
    let run = |agents: &[usize], isa: Isa| -> Result<Vec<AgentState>, Box<dyn std::error::Error>> {
        let mut batch = Batch::new(&model, &BatchOptions { agents: agents.len(), isa, ..BatchOptions::default() })?;
        for (slot, agent) in agents.iter().enumerate() {
            batch.set_obstacles(slot, &of(*agent));
        }
        for _ in 0..50 {
            batch.step(&[], 5);
        }
        Ok((0..agents.len()).map(|a| batch.agent_state(a)).collect())
    };
    let all: Vec<usize> = (0..20).collect();
    let together = run(&all, Isa::best())?;
    for isa in Isa::ALL.into_iter().filter(|isa| *isa != Isa::F64 && isa.supported()) {
        assert_eq!(run(&all, isa)?, together, "{}", isa.name());
    }
    for agent in all {
        assert_eq!(run(&[agent], Isa::best())?[0], together[agent], "agent {agent} alone");
    }
    Ok(())
}

#[test]
fn none_change_nothing() -> Done {
    let spec = world(r#"type="box" size=".1 .15 .2""#, true)?;
    let mut open = spec.clone();
    open.add_obstacles()?.add_obstacles()?;
    let (closed, open) = (spec.compile()?, open.compile()?);
    assert_eq!((open.geoms.len(), open.bodies.len()), (closed.geoms.len() + 1, closed.bodies.len()));
    let options = BatchOptions { agents: 3, ..BatchOptions::default() };
    let (mut a, mut b) = (Batch::new(&closed, &options)?, Batch::new(&open, &options)?);
    b.set_obstacles(1, &[Obstacle::new(shapes()[0].clone(), [0.0, 0.0, 0.2])]);
    for _ in 0..100 {
        a.step(&[], 4);
        b.step(&[], 4);
    }
    for agent in [0, 2] {
        assert_eq!((a.qpos(agent), a.qvel(agent)), (b.qpos(agent), b.qvel(agent)));
    }
    assert_ne!(a.qpos(1), b.qpos(1));
    b.set_obstacles(1, &[]);
    assert!(b.obstacles(1).is_empty());
    Ok(())
}

#[test]
fn what_moves_carries_and_lifts() -> Done {
    let mut spec = world(r#"type="box" size=".2 .2 .1""#, false)?;
    spec.add_obstacles()?;
    let model = spec.compile()?;
    let mut batch = double(&model, 3)?;
    let level = [0.0, 0.0, 0.2, 1.0, 0.0, 0.0, 0.0];
    let platform = |velocity: [f64; 3], spin: f64| {
        let shape = ObstacleShape::Box { half_size: [1.0, 1.0, 0.1] };
        [Obstacle { velocity, angular_velocity: [0.0, 0.0, spin], ..Obstacle::new(shape, [0.0; 3]) }]
    };
    for (agent, (velocity, spin)) in
        [([0.5, 0.0, 0.0], 0.0), ([0.0, 0.0, 0.3], 0.0), ([0.0; 3], 1.0)].into_iter().enumerate()
    {
        batch.reset(agent, &level, &[0.0; 6]);
        batch.set_obstacles(agent, &platform(velocity, spin));
    }
    for _ in 0..500 {
        batch.step(&[], 1);
    }
    let (along, up, around) = (batch.qpos(0), batch.qpos(1), batch.qpos(2));
    assert!((along[0] - 0.5).abs() < 0.05 && (batch.qvel(0)[0] - 0.5).abs() < 0.01, "{along:?}");
    assert!((up[2] - 0.5).abs() < 0.01 && (batch.qvel(1)[2] - 0.3).abs() < 0.01, "{up:?}");
    let angle = 2.0 * around[6].atan2(around[3]);
    assert!((angle - 1.0).abs() < 0.1 && (batch.qvel(2)[5] - 1.0).abs() < 0.05, "{around:?}");
    let [moved] = &batch.obstacles(0)[..] else { return Err("one obstacle".into()) };
    assert!((moved.pos[0] - 0.5).abs() < 1e-9);
    assert_eq!(batch.bodies(0)[1].contacts, 4, "a platform is ground");
    Ok(())
}

#[test]
fn a_wall_is_no_ground() -> Done {
    let mut spec = world(r#"type="sphere" size=".1""#, false)?;
    spec.add_obstacles()?;
    let mut batch = double(&spec.compile()?, 1)?;
    // pressed against the side of a box
    batch.reset(0, &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], &[0.0; 6]);
    batch.push(0, 1, [50.0, 0.0, 41.1], [0.0; 3]);
    batch.set_obstacles(0, &[Obstacle::new(ObstacleShape::Box { half_size: [0.5; 3] }, [0.6, 0.0, 0.0])]);
    for _ in 0..100 {
        batch.step(&[], 1);
    }
    assert!(batch.qvel(0)[0].abs() < 1e-3, "{:?}", batch.qvel(0));
    assert_eq!(batch.bodies(0)[1].contacts, 0);
    Ok(())
}

#[test]
fn states_have_the_obstacles() -> Done {
    let mut spec = world(r#"type="capsule" size=".1 .15""#, true)?;
    let closed = spec.compile()?;
    spec.add_obstacles()?;
    let model = spec.compile()?;
    let options = BatchOptions { agents: 2, ..BatchOptions::default() };
    let mut batch = Batch::new(&model, &options)?;
    let moving = |shape, x| Obstacle {
        velocity: [0.2, 0.1, 0.0],
        angular_velocity: [0.5, 0.2, 0.1],
        ..Obstacle::new(shape, [x, 0.0, 0.1])
    };
    let [ball, _, cuboid, field] = shapes();
    batch.set_obstacles(1, &[moving(ball, 0.1), moving(field, 0.0), moving(cuboid, -0.4)]);
    batch.step(&[], 60);
    let state = batch.agent_state(1);
    let mut bytes = Vec::new();
    state.write_to(&mut bytes);
    let (read, rest) = AgentState::read_from(&model, &bytes).ok_or("a state")?;
    assert!(read == state && rest.is_empty() && read.fits(&model));
    let mut other = Batch::new(&model, &options)?;
    other.set_agent_state(0, &read);
    batch.step(&[], 100);
    other.step(&[], 100);
    assert_eq!(batch.agent_state(1), other.agent_state(0));
    // another model, fewer bytes, another shape, too many
    assert!(AgentState::read_from(&closed, &bytes).is_none() && !state.fits(&closed));
    assert!(AgentState::read_from(&model, &bytes[..bytes.len() - 1]).is_none());
    // in the middle is the field: its kind, 17 numbers, the sides of its grid, and 30 elevations
    let (one, grid) = (18 * 8, 16 + 30 * 4);
    let at = bytes.len() - 3 * one - grid;
    let sides = at + 2 * one;
    for (place, byte) in [(at + 7, 0x7f), (at - 4, 255), (at - 3, 255), (sides, 1), (sides + 7, 255)] {
        let mut wrong = bytes.clone();
        wrong[place] = byte;
        assert!(AgentState::read_from(&model, &wrong).is_none(), "byte {place}");
    }
    Ok(())
}

#[test]
fn a_file_names_their_geom() -> Done {
    let mut spec = world(r#"type="sphere" size=".1""#, true)?;
    spec.add_obstacles()?;
    let model = spec.compile()?;
    assert_eq!(model.obstacles.map(|g| model.geoms[g].name.as_str()), Some("obstacles"));
    let read = ModelSpec::from_xml_str(&spec.to_xml(), "falls")?.compile()?;
    assert_eq!(read, model);
    let with = |data: &str, geom: &str| {
        let text = format!(
            r#"<mujoco><worldbody>{geom}<body><freejoint/><geom name="ball" size=".1"/></body></worldbody>
            <custom><text name="marathon_obstacles" data="{data}"/></custom></mujoco>"#
        );
        Model::from_xml_str(&text, "m.xml").map(|m| m.obstacles).map_err(|e| e.to_string())
    };
    let marker = r#"<geom name="marker" size=".01"/>"#;
    assert_eq!(with("marker", marker), Ok(Some(0)));
    assert!(with("maker", marker).is_err_and(|e| e.contains("marker") && e.contains("m.xml:2")));
    assert!(with("ball", marker).is_err_and(|e| e.contains("'ball' is no sphere of the world")));
    assert!(with("marker", r#"<geom name="marker" type="box" size="1 1 1"/>"#).is_err());
    Ok(())
}

#[test]
fn wrong_numbers_are_named() {
    let [ball, _, _, field] = shapes().map(|shape| Obstacle::new(shape, [0.0; 3]));
    assert_eq!((ball.out_of_range(), field.out_of_range()), (None, None));
    let flat = Obstacle::new(ObstacleShape::Box { half_size: [0.1, 0.0, 0.1] }, [0.0; 3]);
    assert_eq!(flat.out_of_range(), Some(("half size", 0.0, "a length above 0")));
    let lost = Obstacle { pos: [f64::INFINITY, 0.0, 0.0], ..ball.clone() };
    assert_eq!(lost.out_of_range().map(|(name, ..)| name), Some("pos"));
    let unturned = Obstacle { quat: [0.0; 4], ..ball };
    assert_eq!(unturned.out_of_range().map(|(name, ..)| name), Some("quat"));
    let field = |change: fn(&mut HField)| {
        let mut field = hills();
        change(&mut field);
        Obstacle::new(ObstacleShape::HField(Arc::new(field)), [0.0; 3]).out_of_range()
    };
    assert_eq!(field(|f| f.nrow = 1), Some(("side of its field", 1.0, "at least 2 points")));
    assert_eq!(field(|f| f.ncol = 5), Some(("field of this many elevations", 30.0, "one per row and column")));
    assert_eq!(field(|f| f.data[3] = -2.0), Some(("elevation", -2.0, "a number above the base and below 1e8")));
    assert_eq!(field(|f| f.size[1] = 0.0), Some(("size of its field", 0.0, "a length above 0")));
}
