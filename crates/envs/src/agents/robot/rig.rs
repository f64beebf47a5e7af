//! The facts about a robot that the task derives from its model.

use std::fmt;
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use marathon_motion::kinematics::Pose;
use marathon_physics::model::{JointType, Model};
use marathon_physics::spec::{Keyframe, Kind, ModelSpec};

use super::arguments::{Gait, RobotArguments, Task};
use super::edits;
use super::hold::Hold;
use super::knees;
use super::legs::{legs, moves_sideways};
use super::servos::{self, Drive};
use super::stance::{self, Foot, Root, Stance, counted};
use crate::agent::ModelSource;
use crate::error::EnvError;

/// Name of the task.
pub const ID: &str = "Robot-v0";
/// The shipped model.
const QUADRUPED: &str = marathon_assets::text("agents/quadruped.xml");
/// Stiffness of new servos as a multiple of their largest torque per radian: first, and if a robot with three feet or more sinks.
/// Of a robot on two feet, each leg has to carry all the weight, so it has the second from the start.
const STIFFNESS: [f64; 2] = [2.0, 4.0];
/// Number of feet of such a robot.
const BIPED: usize = 2;
/// Number of feet from which a robot stands without balance.
const STABLE: usize = 3;
/// Standard deviations of the joints around the standing pose, rad: legs ahead, legs to a side, others.
const SPREADS: [f64; 3] = [0.3, 0.15, 0.15];

/// A robot that is ready to learn.
#[derive(Clone, Debug)]
pub struct Rig {
    /// The model with a floor, servos and the keyframe `spawn`.
    pub source: ModelSource,
    /// The same, compiled.
    pub model: Model,
    /// The root body.
    pub body: usize,
    /// Its joints.
    pub root: Root,
    /// Its axes ahead and up in the standing pose, in its own frame.
    pub axes: [[f64; 3]; 2],
    /// Height of the root above the ground, m.
    pub height: f64,
    /// Height of the ground, m.
    pub ground: f64,
    /// The standing pose.
    pub qpos: Vec<f64>,
    /// The feet, and when each of them steps, in turns of the clock.
    pub feet: Vec<(Foot, f64)>,
    /// Whether a clock times the steps.
    pub clock: bool,
    /// Geoms of the robot that should not touch the ground.
    pub shell: Vec<usize>,
    /// Coordinates and velocities of the joints but those of the root: hinges and slides.
    pub joints: Vec<[usize; 2]>,
    /// The effect of each action.
    pub drives: Vec<Drive>,
    /// Standard deviation of each servo's joint around the standing pose, rad.
    pub spreads: Vec<f64>,
    /// Fastest commands: ahead and to a side, m/s, and turn rate, rad/s.
    pub fastest: [f64; 3],
    /// Steps per second of each foot.
    pub step_rate: f64,
    /// Height of a step, m.
    pub step_height: f64,
    /// Physics steps per decision.
    pub frame_skip: usize,
    /// Acceleration of gravity, m/s^2.
    pub gravity: f64,
    /// The robot after a second in which the servos held the standing pose; only with three feet or more.
    pub hold: Option<Hold>,
    /// The changes of the model.
    changes: Changes,
}

/// Choices of the rig for the list of findings.
#[derive(Clone, Debug)]
struct Changes {
    /// Where the standing pose comes from.
    pose: String,
    /// Motors that became servos.
    replaced: usize,
    /// Geoms of feet whose contacts became hard.
    hardened: usize,
}

impl Rig {
    /// Derives the facts from the model of the arguments.
    ///
    /// # Errors
    /// If the model cannot be read, or is no robot that moves over the ground.
    pub fn new(arguments: &RobotArguments) -> Result<Rig, EnvError> {
        let wrong = |problem: String| EnvError::Agent { id: ID.into(), problem };
        let mjcf = |source| EnvError::Model { id: ID.into(), source: Box::new(source) };
        let file = Some(Path::new(&arguments.xml_file)).filter(|path| !path.as_os_str().is_empty());
        let read = match file {
            Some(path) => ModelSpec::from_xml_file(path),
            None => ModelSpec::from_xml_str(QUADRUPED, "quadruped.xml"),
        };
        let mut spec = read.map_err(mjcf)?;
        // edits refer to these by name
        spec.name_all(Kind::Geom, "geom");
        spec.name_all(Kind::Actuator, "actuator");
        let given = spec.compile().map_err(mjcf)?;
        let root = stance::root(&given).map_err(wrong)?;
        let (qpos, mut pose, chosen) = stance::pose(&given, &arguments.pose).map_err(wrong)?;
        let mut first = stance::stand(&given, root, qpos, &arguments.feet).map_err(wrong)?;
        if !chosen {
            let bent = knees::bend(&given, &mut first.qpos, root.0, first.height, &first.feet);
            if bent > 0 {
                pose += &format!(", {} bent", counted(bent, "straight knee"));
                first = stance::stand(&given, root, first.qpos, &arguments.feet).map_err(wrong)?;
            }
        }
        edits::prepare(&mut spec, &given).map_err(mjcf)?;
        let hardened = edits::harden(&mut spec, &given, &first.feet).map_err(mjcf)?;
        if spec.get(Kind::Keyframe, SPAWN).is_ok() {
            spec.remove(Kind::Keyframe, SPAWN).map_err(mjcf)?;
        }
        spec.add(Keyframe::new(SPAWN).qpos(&first.qpos)).map_err(mjcf)?;
        let source = |spec: ModelSpec| match file {
            Some(path) => ModelSource::Edited { path: path.into(), spec: Arc::new(spec) },
            None => spec.into(),
        };
        let with_servos = |ratio: f64| {
            let mut spec = spec.clone();
            let replaced = servos::replace_motors(&mut spec, first.height, ratio).map_err(mjcf)?;
            let model = spec.compile().map_err(mjcf)?;
            if model.nu == 0 {
                return Err(wrong(
                    "its model has no actuators; add <motor> or <position> elements for its joints".into(),
                ));
            }
            // the numbers of geoms have changed with the ground
            let stance = stance::stand(&model, root, first.qpos.clone(), &arguments.feet).map_err(wrong)?;
            let changes = Changes { pose: pose.clone(), replaced, hardened };
            let rig = Self::found(arguments, source(spec), model, root, stance, changes);
            let quickest = 0.5 / rig.dt();
            match arguments.step_rate.0.filter(|rate| *rate > quickest) {
                Some(rate) => Err(wrong(format!(
                    "step_rate is {rate}, expected at most {quickest}, half of the decisions per second"
                ))),
                None => Ok(rig),
            }
        };
        let stiffness = STIFFNESS[usize::from(first.feet.len() == BIPED)];
        let rig = with_servos(arguments.stiffness.or(stiffness))?;
        let weak = rig.changes.replaced > 0 && rig.hold.is_some_and(|hold| !hold.stands());
        if weak && arguments.stiffness.0.is_none() {
            let stiffer = with_servos(STIFFNESS[1])?;
            if stiffer.hold.is_some_and(|hold| hold.stands()) {
                return Ok(stiffer);
            }
        }
        Ok(rig)
    }

    fn found(
        arguments: &RobotArguments,
        source: ModelSource,
        model: Model,
        (body, root): (usize, Root),
        stance: Stance,
        changes: Changes,
    ) -> Rig {
        let Stance { qpos, height, feet } = stance;
        let [x, y, z] = model.opt.gravity;
        let gravity = (x * x + y * y + z * z).sqrt().max(1e-3);
        let (quickest, slowness) = ((gravity * height).sqrt(), (gravity / height).sqrt());
        let at = Pose::of(&model, &qpos);
        let free = matches!(root, Root::Free { .. });
        let sideways = free && feet.iter().any(|foot| moves_sideways(&model, &at, foot, body));
        let speed = arguments.speed.or(quickest * if feet.len() == BIPED { 0.4 } else { 0.6 });
        let side = if sideways { 0.5 * speed } else { 0.0 };
        let turn = if free && (sideways || feet.is_empty()) { 1.0 } else { 0.0 };
        let fastest = match arguments.task {
            Task::Stand => [0.0; 3],
            Task::Velocity => [speed, arguments.side_speed.or(side), arguments.turn_rate.or(turn)],
        };
        let inverse = at.quat[body].inverse();
        let phases = stance::phases(&feet);
        let standing: Vec<usize> = feet.iter().flat_map(|foot| foot.geoms.clone()).collect();
        let of_foot = |g: usize| feet.iter().any(|foot| model.bodies[model.geoms[g].body].weld_id == foot.body);
        let shell = (0..model.geoms.len())
            .filter(|g| model.bodies[model.geoms[*g].body].root_id == model.bodies[body].root_id && !feet.is_empty())
            .filter(|g| stance::collides(&model, *g))
            .filter(|g| !standing.contains(g) && !of_foot(*g))
            .collect();
        let joints = model.joints.iter().filter(|joint| joint.body != body && joint.kind.dofs() == 1);
        let joints = joints.filter(|joint| model.bodies[joint.body].root_id == model.bodies[body].root_id);
        let joints = joints.map(|joint| [joint.qpos_adr, joint.dof_adr]).collect();
        let wide = changes.replaced > 0 && feet.len() == BIPED;
        let drives = servos::drives(&model, &qpos, height, wide, arguments.action_scale.0);
        let legs = legs(&model, &feet, body).concat();
        let spreads = drives.iter().map(|drive| spread(&model, &at, drive, &legs)).collect();
        let ground = stance::ground_height(&model);
        // what cannot be simulated is refused when the environment is made
        let hold = || Hold::of(&model, body, &qpos, ground, &drives).ok();
        Rig {
            hold: (feet.len() >= STABLE).then(hold).flatten(),
            body,
            root,
            axes: [DVec3::X, DVec3::Z].map(|axis| (inverse * axis).to_array()),
            height,
            ground,
            clock: arguments.gait == Gait::Clock && feet.len() > 1 && arguments.task == Task::Velocity,
            feet: feet.into_iter().zip(phases).collect(),
            shell,
            joints,
            spreads,
            drives,
            fastest,
            step_rate: arguments.step_rate.or((0.33 * slowness).clamp(1.0, 2.5)),
            step_height: arguments.step_height.or((0.2 * height).clamp(0.02, 0.1)),
            frame_skip: edits::frame_skip(&model),
            gravity,
            qpos,
            changes,
            source,
            model,
        }
    }

    /// Seconds between decisions.
    pub fn dt(&self) -> f64 {
        self.model.opt.timestep * self.frame_skip as f64
    }

    /// The unit of speeds, sqrt(g H), m/s. In this unit, robots of all sizes walk at about the same speed.
    pub fn pace(&self) -> f64 {
        (self.gravity * self.height).sqrt()
    }
}

/// The keyframe that episodes start from.
const SPAWN: &str = "spawn";

/// Standard deviation of a servo's joint around the standing pose, rad. `legs`: joints of legs; without any, all are like them.
fn spread(model: &Model, pose: &Pose, drive: &Drive, legs: &[usize]) -> f64 {
    let [ahead, aside, other] = SPREADS;
    let Drive::Servo(servo) = drive else { return other };
    let joint = model.dofs[servo.dof].joint;
    let pitches = pose.axes[joint].y.abs() > 0.7 || model.joints[joint].kind != JointType::Hinge;
    match (legs.is_empty() || legs.contains(&joint), pitches || legs.is_empty()) {
        (true, true) => ahead,
        (true, false) => aside,
        (false, _) => other,
    }
}

/// Lines of a table.
impl fmt::Display for Rig {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let model = &self.model;
        let name = |body: usize| match model.bodies[body].name.as_str() {
            "" => format!("body {body}"),
            name => name.to_owned(),
        };
        let root = match self.root {
            Root::Free { .. } => "moves freely",
            Root::Planar { .. } => "moves in the plane of x and z",
        };
        writeln!(
            f,
            "root       {}: {root}, {:.3} m above the ground, {:.1} kg",
            name(self.body),
            self.height,
            model.bodies[self.body].subtree_mass
        )?;
        writeln!(f, "pose       {}", self.changes.pose)?;
        let names = self.feet.iter().map(|(foot, phase)| match self.clock {
            true => format!("{} ({phase})", name(foot.body)),
            false => name(foot.body),
        });
        let names: Vec<String> = names.collect();
        let pose = Pose::of(model, &self.qpos);
        let wheels = (1..model.bodies.len()).filter(|body| stance::is_wheel(model, &pose, *body));
        let wheels: Vec<String> = wheels.map(name).collect();
        match names.as_slice() {
            [] if wheels.is_empty() => writeln!(f, "feet       none: it lies on the ground")?,
            [] => writeln!(f, "feet       none: it rolls on {}", wheels.join(", "))?,
            names => writeln!(f, "feet       {}", names.join(", "))?,
        }
        if self.clock {
            writeln!(f, "steps      {:.2} per second, {:.3} m high", self.step_rate, self.step_height)?;
        }
        let servos: Vec<_> =
            self.drives.iter().filter_map(|d| if let Drive::Servo(s) = d { Some(s) } else { None }).collect();
        let span = |of: &dyn Fn(&servos::Servo) -> f64| {
            let (low, high) = servos.iter().fold((f64::INFINITY, 0.0f64), |(a, b), s| (a.min(of(s)), b.max(of(s))));
            if high - low < 0.005 * high { format!("{high:.3}") } else { format!("{low:.3} to {high:.3}") }
        };
        if !servos.is_empty() {
            writeln!(
                f,
                "servos     {} ({} in place of motors): stiffness {}, largest torque {}, action {} rad",
                servos.len(),
                self.changes.replaced,
                span(&|s| s.stiffness),
                span(&|s| s.strength),
                span(&|s| s.scale.abs()),
            )?;
        }
        if servos.len() < self.drives.len() {
            let direct = self.drives.len() - servos.len();
            let whose = if direct == 1 { "actuator whose control" } else { "actuators whose control" };
            writeln!(f, "direct     {direct} {whose} is the action")?;
        }
        if let Some(hold) = self.hold {
            let Hold { height, tilt } = hold;
            let note = match hold.stands() {
                true => "",
                false if height < 0.0 => ": its root falls through the ground, which it cannot touch",
                false => ": too weak to stand still",
            };
            writeln!(f, "stands     {height:.2} of its height and {tilt:.0} degrees off after 1 s{note}")?;
        }
        if self.changes.hardened > 0 {
            writeln!(f, "contacts   made hard at {} of the feet", counted(self.changes.hardened, "geom"))?;
        }
        let [ahead, side, turn] = self.fastest;
        write!(f, "commands   up to {ahead:.2} m/s ahead, {side:.2} m/s to a side, {turn:.2} rad/s")
    }
}
