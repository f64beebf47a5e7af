//! Events in the motion of a character: steps, flights, falls and skills, once per decision.

use super::event::Event;
use crate::pose;
use marathon_envs::{AgentState, Spec};
use marathon_physics::Model;
use marathon_render::{Pose, Scene};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Shortest time in the air that counts as a flight, s. The tasks with a jump and `marathon eval` use it too: steps leave the ground
/// for moments.
const FLIGHT: f64 = 0.1;
/// Part of the acceleration of gravity with which the center of mass must fall in a flight. The feet of a character that lies are in
/// the air, too.
const FALLS_FREELY: f64 = 0.5;
/// Value from which a button or a flag of the task is on.
const ON: f64 = 0.5;

/// Feet, flags and buttons of a kind of character.
#[derive(Clone, Debug)]
pub(crate) struct Detector {
    model: Arc<Model>,
    /// Geoms of the feet.
    feet: Vec<usize>,
    /// Indices of the infos `rising` and `skill`.
    rising: Option<usize>,
    skill: Option<usize>,
    /// Indices of the buttons in the command.
    buttons: Vec<usize>,
    dt: f64,
}

/// Progress of a character.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Progress {
    /// Decisions in the air.
    aloft: u64,
    /// Upward speed of the center of mass at take-off, m/s.
    takeoff: f64,
    /// Whether it gets up.
    pub rising: bool,
    /// Number of the active skill in the command.
    pub skill: Option<usize>,
}

/// A decision and its results.
pub(crate) struct Decided<'a> {
    /// Configuration and velocity before.
    pub before: [&'a [f64]; 2],
    /// The command that it observed.
    pub command: &'a [f64],
    /// The state after.
    pub after: &'a dyn Fn() -> AgentState,
    /// Feet on the ground in the decision before and in this one, a bit each.
    pub feet: [u32; 2],
    /// Infos of the task about the state after.
    pub info: &'a [f32],
    /// Vertical gravity, m/s^2.
    pub gravity: f64,
    /// Whether it has the strength to act.
    pub acts: bool,
    /// Whether it is the first decision of an episode, or the first one with strength.
    pub first: bool,
    /// Whether the task failed.
    pub failed: bool,
}

impl Detector {
    pub fn new(model: &Arc<Model>, spec: Option<&Spec>, feet: &[Arc<str>], dt: f64) -> Self {
        let geom = |name: &Arc<str>| model.geoms.iter().position(|geom| *geom.name == **name);
        let command = spec.map_or(&[][..], |spec| &spec.command);
        Detector {
            model: model.clone(),
            // a foot without a geom keeps its number
            feet: feet.iter().map(|name| geom(name).unwrap_or(usize::MAX)).collect(),
            rising: spec.and_then(Spec::rising),
            skill: spec.and_then(Spec::skill),
            buttons: (0..command.len()).filter(|i| command[*i].is_button()).collect(),
            dt,
        }
    }

    /// Finds the events of a decision.
    pub fn detect(&self, progress: &mut Progress, decided: &Decided<'_>, events: &mut Vec<Event>) {
        self.steps(decided, events);
        self.flights(progress, decided, events);
        self.skills(progress, decided, events);
        self.falls(progress, decided, events);
    }

    /// Feet that touch or leave the ground.
    fn steps(&self, decided: &Decided<'_>, events: &mut Vec<Event>) {
        let [were, are] = decided.feet;
        if were == are {
            return;
        }
        let after = (decided.after)();
        let Ok(pose) = Scene::pose_from_qpos(&self.model, &after.qpos) else { return };
        for (foot, geom) in self.feet.iter().enumerate().take(32).filter(|(foot, _)| (were ^ are) >> foot & 1 == 1) {
            let down = are >> foot & 1 == 1;
            let [qpos, qvel] = if down { decided.before } else { [&after.qpos[..], &after.qvel] };
            let around = pose::around(&self.model, qpos, qvel);
            let (Some(around), Some(shape), Some(place)) = (around, self.model.geoms.get(*geom), pose.geoms.get(*geom))
            else {
                continue;
            };
            let speed = length(pose::velocity(&around, |pose| pose.geoms[*geom].pos));
            events.push(Event::Foot { foot, down, point: pose::lowest(shape, place), speed });
        }
    }

    /// Flights that end on a foot.
    fn flights(&self, progress: &mut Progress, decided: &Decided<'_>, events: &mut Vec<Event>) {
        let (aloft, grounded) = (progress.aloft, decided.feet[1] != 0);
        if self.feet.is_empty() || !decided.acts || progress.rising {
            progress.aloft = 0;
        } else if !grounded {
            if aloft == 0 {
                let AgentState { qpos, qvel } = (decided.after)();
                progress.takeoff = self.rise(&qpos, &qvel);
            }
            progress.aloft += 1;
        } else {
            progress.aloft = 0;
            let seconds = aloft as f64 * self.dt;
            // half of a decision against rounding
            if seconds < FLIGHT - 0.5 * self.dt {
                return;
            }
            let [qpos, qvel] = decided.before;
            let rise = self.rise(qpos, qvel);
            // the first and the last decision of a flight are part of it
            let falling = decided.gravity * (seconds - self.dt);
            if rise - progress.takeoff <= FALLS_FREELY * falling.min(0.0) && rise < 0.0 {
                events.push(Event::Landed { speed: -rise, seconds });
            }
        }
    }

    /// Upward speed of the center of mass, m/s.
    fn rise(&self, qpos: &[f64], qvel: &[f64]) -> f64 {
        pose::around(&self.model, qpos, qvel).map_or(0.0, |around| pose::velocity(&around, |pose| pose.com)[2])
    }

    /// Buttons that take effect. A task with the info `skill` says which one does. In others, a skill is active
    /// while its button is pressed, and until a foot is on the ground.
    fn skills(&self, progress: &mut Progress, decided: &Decided<'_>, events: &mut Vec<Event>) {
        let active = match self.skill {
            Some(skill) => {
                let number = decided.info.get(skill).map_or(0, |number| *number as usize);
                number.checked_sub(1).and_then(|number| self.buttons.get(number).copied())
            }
            None => {
                let pressed = |button: &usize| decided.command.get(*button).is_some_and(|x| *x >= ON);
                let flies = progress.skill.filter(|_| decided.feet[1] == 0);
                self.buttons.iter().copied().find(pressed).or(flies)
            }
        };
        progress.turn_to(active.filter(|_| decided.acts && !decided.failed), events);
    }

    /// Falls, and their ends.
    fn falls(&self, progress: &mut Progress, decided: &Decided<'_>, events: &mut Vec<Event>) {
        let flag = self.rising.and_then(|rising| decided.info.get(rising));
        let rises = decided.acts && flag.is_some_and(|x| f64::from(*x) > ON);
        let fell = decided.failed || rises && !decided.first;
        if decided.acts && fell && !progress.rising {
            events.push(Event::Fell { prone: self.is_prone(&(decided.after)()) });
        }
        if decided.acts && progress.rising && !rises && !decided.failed {
            events.push(Event::GotUp);
        }
        progress.rising = rises;
    }

    /// Whether the forward axis of the root points down.
    fn is_prone(&self, state: &AgentState) -> bool {
        let root = self.model.joints.first().map_or(0, |joint| joint.body);
        let pose: Option<Pose> = Scene::pose_from_qpos(&self.model, &state.qpos).ok();
        let turn = pose.and_then(|pose| pose.bodies.get(root).map(|body| body.quat));
        turn.is_some_and(|[w, x, y, z]| x * z - w * y < 0.0)
    }
}

impl Progress {
    /// Ends the active skill and begins another one, if they differ.
    pub fn turn_to(&mut self, skill: Option<usize>, events: &mut Vec<Event>) {
        if self.skill != skill {
            events.extend(self.skill.map(|button| Event::Skill { button, on: false }));
            events.extend(skill.map(|button| Event::Skill { button, on: true }));
            self.skill = skill;
        }
    }
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}
