//! Constant facts of an agent: model, names and timing.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use marathon_motion::Clip;
use marathon_physics::mjcf::MjcfError;
use marathon_physics::spec::ModelSpec;

use super::{CommandRange, RoleFacts};

/// Name of the metric for the distance along +x.
pub(crate) const FORWARD: &str = "forward";

/// Constant facts of an agent. [`Facts::default`] holds the values of most of the suite's agents.
#[derive(Clone, Debug)]
pub struct Facts {
    /// Registry name with a version, such as `Hopper-v0`.
    pub id: String,
    /// One line for listings.
    pub summary: String,
    /// The model. If it has a keyframe named `spawn`, episodes start from its pose and velocity.
    pub model: ModelSource,
    /// Physics steps per decision.
    pub frame_skip: usize,
    /// Decisions after which an episode is truncated.
    pub max_episode_steps: usize,
    /// Length of the observation. `None` accepts any length.
    pub observation: Option<usize>,
    /// Names of the model's actuators, in order; they are the action. If empty, all actuators of the model are used.
    pub actions: Vec<String>,
    /// Meaning and bounds of an action.
    pub controls: Controls,
    /// Names of the reward's terms, in the order in which `step_reward` adds them.
    pub reward_terms: Vec<String>,
    /// Names of the numbers of [`Agent::info`](crate::Agent::info). Two names have a meaning for tools:
    /// [`rising`](crate::Spec::rising) and [`skill`](crate::Spec::skill).
    pub info: Vec<String>,
    /// Numbers per decision that measure success: names of `info`, and `forward`, the distance along +x in the
    /// decision, m. Training reports may show their means.
    pub metrics: Vec<String>,
    /// Geoms that the agent uses, see [`Part`].
    pub parts: Vec<String>,
    /// Bodies that the agent uses, see [`Body`].
    pub bodies: Vec<String>,
    /// Geoms that may touch the ground.
    pub feet: Vec<String>,
    /// Geoms with a touch sensor, in the order of the observation.
    pub touch: Vec<String>,
    /// Sites with a touch sensor, see [`Senses::touch_force`](crate::Senses::touch_force).
    pub touch_sites: Vec<String>,
    /// The numbers of the command, see [`Agent::command`](crate::Agent::command).
    pub command: Vec<CommandRange>,
    /// The roles, if there are several. Empty: one role has all observations, actions and rewards.
    pub roles: Vec<RoleFacts>,
    /// Motion clips of the model's joints. Each agent follows one of them. With clips, the first
    /// [`Following::SLOTS`](crate::Following::SLOTS) of the memory hold the clip and the position in it.
    pub clips: Vec<Arc<Clip>>,
    /// Whether the clips advance with the episode ([`Senses::follow`](crate::Senses::follow)). If not, they only supply
    /// start states and demonstrations.
    pub follows_clips: bool,
    /// Size of the agent's memory per lane, see [`Agent::remember`](crate::Agent::remember).
    pub memory: usize,
    /// Quantities of the physics that the agent reads.
    pub view: View,
    /// Reward of a decision that ends in failure. It replaces all terms. With `None`, the terms count.
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

/// A list of names for [`Facts`].
pub fn names<S: AsRef<str>>(list: impl IntoIterator<Item = S>) -> Vec<String> {
    list.into_iter().map(|name| name.as_ref().to_string()).collect()
}

/// Source of an agent's model.
#[derive(Clone, Debug)]
pub enum ModelSource {
    /// MJCF text that refers to no other files.
    Text(Cow<'static, str>),
    /// An MJCF file.
    File(PathBuf),
    /// An MJCF file with changes.
    Edited {
        /// The file.
        path: PathBuf,
        /// The model with the changes.
        spec: Arc<ModelSpec>,
    },
    /// A model that could not be made. Its users get the error.
    Broken(Box<MjcfError>),
}

impl PartialEq for ModelSource {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (ModelSource::Text(a), ModelSource::Text(b)) => a == b,
            (ModelSource::File(a), ModelSource::File(b)) => a == b,
            (ModelSource::Edited { path: a, spec: x }, ModelSource::Edited { path: b, spec: y }) => {
                a == b && x.to_xml() == y.to_xml()
            }
            (ModelSource::Broken(a), ModelSource::Broken(b)) => a == b,
            _ => false,
        }
    }
}

impl ModelSource {
    /// The text, if it is not in a file.
    pub fn text(&self) -> Option<&str> {
        match self {
            ModelSource::Text(text) => Some(text),
            ModelSource::File(_) | ModelSource::Edited { .. } | ModelSource::Broken(_) => None,
        }
    }

    /// The file that it was read from.
    pub fn file(&self) -> Option<&Path> {
        match self {
            ModelSource::Text(_) | ModelSource::Broken(_) => None,
            ModelSource::File(path) | ModelSource::Edited { path, .. } => Some(path),
        }
    }

    /// The model, to edit or compile it. `name` stands for a text in messages.
    ///
    /// # Errors
    /// If a file cannot be read, the model is not well-formed XML, or it could not be made.
    pub fn spec(&self, name: &str) -> Result<ModelSpec, MjcfError> {
        match self {
            ModelSource::Text(text) => ModelSpec::from_xml_str(text, name),
            ModelSource::File(path) => ModelSpec::from_xml_file(path),
            ModelSource::Edited { spec, .. } => Ok(ModelSpec::clone(spec)),
            ModelSource::Broken(error) => Err(MjcfError::clone(error)),
        }
    }
}

/// An edited model as text.
impl From<ModelSpec> for ModelSource {
    fn from(spec: ModelSpec) -> Self {
        spec.to_xml().into()
    }
}

/// An edited model as text, or the error of the edit. Facts have no errors, so the model hands it on.
impl From<Result<ModelSpec, MjcfError>> for ModelSource {
    fn from(spec: Result<ModelSpec, MjcfError>) -> Self {
        spec.map_or_else(|error| ModelSource::Broken(error.into()), Into::into)
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

/// Meaning of an action, and its bounds ([`Spec::action_low`](crate::Spec::action_low)).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Controls {
    /// A number in [-1, 1] per actuator. It is clipped before anything reads it. The suite's own agents use this.
    #[default]
    Nominal,
    /// The actuator's control in its own units, within its `ctrlrange`, as in Gymnasium and dm_control. It is not
    /// clipped: observation and reward use the given value, while the physics clamps it.
    Raw,
}

/// Quantities of the physics that an agent reads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct View {
    /// Whether frames and velocities of bodies, geoms and sites are those from which the last physics step computed its
    /// forces, as MuJoCo's `mj_step` leaves them. They then belong to the state before that step, or to the last stage
    /// of RK4. `qpos` and `qvel` always belong to the present state. At the start of an episode, everything does.
    pub of_last_step: bool,
    /// Whether [`Readings::cinert`](marathon_physics::Readings::cinert), `cvel` and `cfrc_ext` are available.
    pub bodies: bool,
    /// Whether [`Readings::qfrc_actuator`](marathon_physics::Readings::qfrc_actuator) is available.
    pub actuators: bool,
    /// The same and [`Readings::qfrc_constraint`](marathon_physics::Readings::qfrc_constraint). At the start of an
    /// episode, it needs an evaluation of all forces.
    pub joints: bool,
}

/// Noise added to the spawn pose at the start of an episode. Each number is the half width of a uniform distribution
/// around zero. Each degree of freedom is drawn independently.
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
    /// The suite's noise. The original starts from the exact spawn pose, with joint velocities up to 25 rad/s that its
    /// engine limited or canceled at once, and +-0.025 m/s. The values here are a plausible reading of that (0.1 rad/s
    /// and 0.025 m/s). They add 0.01 rad in the joints, so that episodes also differ for a policy that observes
    /// positions only.
    pub const MARATHON: ResetNoise = ResetNoise { joint_position: 0.01, joint_velocity: 0.1, root_velocity: 0.025 };
}

/// A body part, which is a geom by name. In the original, every geom is a separate rigid body.
///
/// A part has the position and velocity of the geom's center and the axes of the geom's body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part(pub(crate) usize);

impl Part {
    /// The part called `name` in an agent's [`Facts::parts`]. In a `const`, an unknown name is a compile error.
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
    /// The body called `name` in an agent's [`Facts::bodies`]. In a `const`, an unknown name is a compile error.
    ///
    /// # Panics
    /// If there is no such name.
    pub const fn named(bodies: &[&str], name: &str) -> Body {
        Body(find(bodies, name))
    }
}

/// A set of motors, used to exclude some from the effort.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Motors(u128);

impl Motors {
    /// No motor.
    pub const NONE: Motors = Motors(0);

    /// The motors with these names in an agent's [`Facts::actions`], at most 128. In a `const`, an unknown name is a
    /// compile error.
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

    /// The motor with an index below 128.
    pub const fn number(motor: usize) -> Motors {
        Motors(1 << motor)
    }

    /// All motors except `first..end`. `end` is at most 127.
    pub const fn except(first: usize, end: usize) -> Motors {
        Motors(!(!0 << first & !(!0 << end)))
    }

    /// All motors from an index on, at most 127.
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
pub(crate) const fn find(list: &[&str], name: &str) -> usize {
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
