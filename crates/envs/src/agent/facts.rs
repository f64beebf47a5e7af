//! Constant facts of an agent: its model, its names, its pace.

use std::borrow::Cow;
use std::path::PathBuf;
use std::sync::Arc;

use marathon_motion::Clip;

use super::{CommandRange, RoleFacts};

/// Name of the metric that is the distance along +x.
pub(crate) const FORWARD: &str = "forward";

/// Constant facts of an agent. What is left to [`Facts::default`] is as the suite's own agents have it.
#[derive(Clone, Debug)]
pub struct Facts {
    /// Registry name with a version, such as `Hopper-v0`.
    pub id: String,
    /// One line for listings.
    pub summary: String,
    /// The model. A keyframe named `spawn`, if there is one, is the pose and the velocity with which episodes start.
    pub model: ModelSource,
    /// Physics steps per decision.
    pub frame_skip: usize,
    /// Decisions after which an episode is truncated.
    pub max_episode_steps: usize,
    /// Length of the observation; `None`: however long it turns out to be.
    pub observation: Option<usize>,
    /// Names of the model's actuators in their order: the action. Empty: whatever actuators the model has.
    pub actions: Vec<String>,
    /// What an action is.
    pub controls: Controls,
    /// Names of the reward's terms in the order in which `step_reward` adds them.
    pub reward_terms: Vec<String>,
    /// Names of the numbers that [`Agent::info`](crate::Agent::info) reports.
    pub info: Vec<String>,
    /// Numbers that tell, decision by decision, how well the task is done: names out of `info`, and `forward`, the distance
    /// moved along +x in the decision, m. Reports of a training may show their means.
    pub metrics: Vec<String>,
    /// Geoms that the agent speaks of, see [`Part`].
    pub parts: Vec<String>,
    /// Bodies that the agent speaks of, see [`Body`].
    pub bodies: Vec<String>,
    /// Geoms that may touch the ground.
    pub feet: Vec<String>,
    /// Geoms with a touch sensor, in the order of the observation.
    pub touch: Vec<String>,
    /// Sites with a touch sensor, see [`Senses::touch_force`](crate::Senses::touch_force).
    pub touch_sites: Vec<String>,
    /// What the agent can be told to do: the numbers of its command, see [`Agent::command`](crate::Agent::command).
    pub command: Vec<CommandRange>,
    /// Who decides in the task, if more than one does; empty: one who has it all.
    pub roles: Vec<RoleFacts>,
    /// Motions of the model's joints, one of which an agent follows. If there are any, the first
    /// [`Following::SLOTS`](crate::Following::SLOTS) of its memory tell where it is in which.
    pub clips: Vec<Arc<Clip>>,
    /// Whether agents go on with their clip ([`Senses::follow`](crate::Senses::follow)). Otherwise clips only tell where
    /// episodes start and what demonstrations show.
    pub follows_clips: bool,
    /// Number of lane variables that the agent keeps from decision to decision, see [`Agent::remember`](crate::Agent::remember).
    pub memory: usize,
    /// What it sees of the physics.
    pub view: View,
    /// Reward of a decision in which the agent failed, in place of all other terms; `None`: the terms count on.
    pub termination_reward: Option<f64>,
}

impl Default for Facts {
    fn default() -> Self {
        Facts {
            id: String::new(),
            summary: String::new(),
            model: ModelSource::Text("".into()),
            frame_skip: 1,
            max_episode_steps: 1000,
            observation: None,
            actions: Vec::new(),
            controls: Controls::Nominal,
            reward_terms: Vec::new(),
            info: Vec::new(),
            metrics: vec![FORWARD.into()],
            parts: Vec::new(),
            bodies: Vec::new(),
            feet: Vec::new(),
            touch: Vec::new(),
            touch_sites: Vec::new(),
            command: Vec::new(),
            roles: Vec::new(),
            clips: Vec::new(),
            follows_clips: true,
            memory: 0,
            view: View::default(),
            termination_reward: Some(-1.0),
        }
    }
}

/// A list of names, for [`Facts`].
pub fn names<S: AsRef<str>>(list: impl IntoIterator<Item = S>) -> Vec<String> {
    list.into_iter().map(|name| name.as_ref().to_string()).collect()
}

/// Where an agent's model comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ModelSource {
    /// MJCF text that refers to no other files.
    Text(Cow<'static, str>),
    /// An MJCF file.
    File(PathBuf),
}

impl ModelSource {
    /// The text, unless it is in a file.
    pub fn text(&self) -> Option<&str> {
        match self {
            ModelSource::Text(text) => Some(text),
            ModelSource::File(_) => None,
        }
    }
}

impl From<&'static str> for ModelSource {
    fn from(text: &'static str) -> Self {
        ModelSource::Text(text.into())
    }
}
impl From<String> for ModelSource {
    fn from(text: String) -> Self {
        ModelSource::Text(text.into())
    }
}

/// What an action is, and what its bounds are ([`Spec::action_low`](crate::Spec::action_low)).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Controls {
    /// A number in [-1, 1] per actuator, clipped to it before anything else sees it: the suite's own agents.
    #[default]
    Nominal,
    /// The actuator's control in its own units, within its `ctrlrange`. It is not clipped: the agent sees and pays for
    /// what was asked for, while the physics clamps what acts. So in Gymnasium and dm_control.
    Raw,
}

/// What an agent sees of the physics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct View {
    /// Frames and velocities of bodies, geoms and sites are those from which the last physics step computed its forces,
    /// as MuJoCo's `mj_step` leaves them: of the state before it, or of the last stage of RK4. `qpos` and `qvel` are of
    /// the present state in any case. (At the start of an episode all is of the present state.)
    pub of_last_step: bool,
    /// [`Readings::cinert`](marathon_physics::Readings::cinert), `cvel` and `cfrc_ext` can be read.
    pub bodies: bool,
    /// [`Readings::qfrc_actuator`](marathon_physics::Readings::qfrc_actuator) can be read.
    pub actuators: bool,
    /// The same and [`Readings::qfrc_constraint`](marathon_physics::Readings::qfrc_constraint), which at the start of an
    /// episode takes an evaluation of all forces.
    pub joints: bool,
}

/// How far the start of an episode strays from the spawn pose at rest; every number is the half width of a uniform
/// distribution around zero, drawn independently per degree of freedom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResetNoise {
    /// Actuated joints, rad; the result is clamped to the joint's range.
    pub joint_position: f64,
    /// Actuated joints, rad/s.
    pub joint_velocity: f64,
    /// Linear velocity of the root (a free joint, or unactuated slides), m/s.
    pub root_velocity: f64,
}

impl ResetNoise {
    /// The suite's noise. The original starts from the exact spawn pose with joint spins of up to 25 rad/s that its
    /// engine cut or cancelled at once, and +-0.025 m/s; these are the sane reading of it (0.1 rad/s and 0.025 m/s), plus
    /// 0.01 rad in the joints so that no two episodes look alike to a policy that sees positions only.
    pub const MARATHON: ResetNoise = ResetNoise { joint_position: 0.01, joint_velocity: 0.1, root_velocity: 0.025 };
}

/// A body part, which is a geom by name: the original made every geom a rigid body of its own.
///
/// A part has the position and velocity of the geom's center and the axes of the body that the geom belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part(pub(crate) usize);

impl Part {
    /// The part called `name` among an agent's [`Facts::parts`]. Meant for a `const`, where an unknown name is a compile
    /// error.
    ///
    /// # Panics
    /// If there is no such name.
    pub const fn named(parts: &[&str], name: &str) -> Part {
        Part(find(parts, name))
    }
}

/// A body of the model by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Body(pub(crate) usize);

impl Body {
    /// The body called `name` among an agent's [`Facts::bodies`]. Meant for a `const`, where an unknown name is a compile
    /// error.
    ///
    /// # Panics
    /// If there is no such name.
    pub const fn named(bodies: &[&str], name: &str) -> Body {
        Body(find(bodies, name))
    }
}

/// A set of motors, used to leave some out of the effort.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Motors(u128);

impl Motors {
    /// No motor.
    pub const NONE: Motors = Motors(0);

    /// The motors of these names among an agent's [`Facts::actions`], of which it may have 128. Meant for a `const`,
    /// where an unknown name is a compile error.
    ///
    /// # Panics
    /// If there is no such name.
    pub const fn named(actions: &[&str], names: &[&str]) -> Motors {
        let mut set = 0;
        let mut i = 0;
        while i < names.len() {
            set |= 1 << find(actions, names[i]);
            i += 1;
        }
        Motors(set)
    }

    /// The motor of a number, less than 128.
    pub const fn number(motor: usize) -> Motors {
        Motors(1 << motor)
    }

    /// All motors but those from a number on to before another, at most 127.
    pub const fn except(first: usize, end: usize) -> Motors {
        Motors(!(!0 << first & !(!0 << end)))
    }

    /// All motors from a number on, at most 127.
    pub const fn from(first: usize) -> Motors {
        Motors(!0 << first)
    }

    /// Whether motor `i` belongs to the set.
    #[inline(always)]
    pub fn contains(self, i: usize) -> bool {
        i < 128 && self.0 >> i & 1 == 1
    }
}

/// Index of a name, at compile time.
const fn find(list: &[&str], name: &str) -> usize {
    let mut i = 0;
    while i < list.len() {
        if same(list[i].as_bytes(), name.as_bytes()) {
            return i;
        }
        i += 1;
    }
    panic!("this name is not in the list")
}

const fn same(a: &[u8], b: &[u8]) -> bool {
    if a.len() != b.len() {
        return false;
    }
    let mut i = 0;
    while i < a.len() {
        if a[i] != b[i] {
            return false;
        }
        i += 1;
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_indices() {
        const PARTS: [&str; 3] = ["torso", "foot", "toe"];
        const FOOT: Part = Part::named(&PARTS, "foot");
        assert_eq!(FOOT, Part(1));
        const SOME: Motors = Motors::named(&PARTS, &["torso", "toe"]);
        assert!(SOME.contains(0) && !SOME.contains(1) && SOME.contains(2) && !SOME.contains(200));
        assert!(!Motors::from(3).contains(2) && Motors::from(3).contains(3) && Motors::from(3).contains(127));
    }
}
