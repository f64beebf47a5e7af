//! A ragdoll that a motion clip moves: where the clip is, and the way of the pose into it.
//!
//! The difference between the ragdoll and the clip at the start fades like a critically damped spring, in place and velocity
//! ("inertialization": D. Bollo, GDC 2018; D. Holden, "Spring-It-On", 2021).

use crate::pose::heading;
use marathon_envs::AgentState;
use marathon_motion::{Clip, Cycle};
use marathon_physics::Model;
use marathon_physics::model::JointType;
use marathon_physics::spatial::{integrate_quat, quat_conjugate, quat_mul, quat_to_rotvec};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Shortest half-life, s: a shorter one counts as a jump.
const SHORTEST: f64 = 1e-3;

/// A clip that plays.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Playing {
    /// `None` after a snapshot from bytes, until the component gives it.
    #[serde(skip)]
    pub clip: Option<Arc<Clip>>,
    time: f64,
    speed: f64,
    half_life: f64,
    /// How the clip is moved and turned to where the ragdoll was.
    pos: [f64; 2],
    yaw: f64,
    /// Difference at the start, per degree of freedom, and its rate of change.
    offset: Vec<f64>,
    rate: Vec<f64>,
    /// Seconds since the start.
    elapsed: f64,
}

impl Playing {
    /// A clip from a time on, s, at a speed.
    pub fn new(clip: Arc<Clip>, time: f64, speed: f64, half_life: f64) -> Self {
        Playing {
            clip: Some(clip),
            time,
            speed,
            half_life,
            pos: [0.0; 2],
            yaw: 0.0,
            offset: Vec::new(),
            rate: Vec::new(),
            elapsed: 0.0,
        }
    }

    /// Whether its numbers are those of a model.
    pub fn fits(&self, model: &Model) -> bool {
        let numbers = [self.time, self.speed, self.half_life, self.pos[0], self.pos[1], self.yaw, self.elapsed];
        let all = || numbers.iter().chain(&self.offset).chain(&self.rate);
        (self.offset.len(), self.rate.len()) == (model.nv, model.nv) && all().all(|x| x.is_finite())
    }

    /// Whether a clip that does not loop has come to an end.
    pub fn is_over(&self) -> bool {
        let over = |clip: &Arc<Clip>| match clip.cycle() {
            Some(_) => false,
            None if self.speed < 0.0 => self.time <= 0.0,
            None => self.time >= clip.duration(),
        };
        self.clip.as_ref().is_some_and(over)
    }

    /// Moves the clip to where a ragdoll is, and notes how its pose differs.
    pub fn start(&mut self, model: &Model, qpos: &[f64], qvel: &[f64]) {
        let Some((clip_qpos, _)) = self.clip_state(model) else { return };
        if let Some(free) = root(model) {
            self.yaw = heading(model, qpos) - heading(model, &clip_qpos);
            let (sin, cos) = (libm::sin(self.yaw), libm::cos(self.yaw));
            let [x, y] = [clip_qpos[free], clip_qpos[free + 1]];
            self.pos = [qpos[free] - (cos * x - sin * y), qpos[free + 1] - (sin * x + cos * y)];
        } else if model.joints.first().is_some_and(|joint| joint.kind == JointType::Slide) {
            self.pos = [qpos[0] - clip_qpos[0], 0.0];
        }
        let Some((clip_qpos, clip_qvel)) = self.clip_state(model) else { return };
        self.offset = vec![0.0; model.nv];
        self.rate = qvel.iter().zip(&clip_qvel).map(|(own, clip)| own - clip).collect();
        for joint in &model.joints {
            let (at, dof) = (joint.qpos_adr, joint.dof_adr);
            let (slides, turn) = parts(joint.kind);
            for i in 0..slides {
                self.offset[dof + i] = qpos[at + i] - clip_qpos[at + i];
            }
            if turn {
                let [own, clip] = [qpos, &clip_qpos[..]].map(|q| quat(q, at + slides));
                let way = quat_to_rotvec(&quat_mul(&quat_conjugate(&clip), &own));
                self.offset[dof + slides..dof + slides + 3].copy_from_slice(&way);
            }
        }
    }

    /// State of the clip at its time, where it plays.
    fn clip_state(&self, model: &Model) -> Option<(Vec<f64>, Vec<f64>)> {
        let clip = self.clip.as_ref()?;
        let time = if clip.cycle().is_some() { self.time } else { self.time.clamp(0.0, clip.duration()) };
        let (mut qpos, mut qvel) = (vec![0.0; model.nq], vec![0.0; model.nv]);
        clip.qpos(time, &mut qpos);
        clip.qvel(time, &mut qvel);
        qvel.iter_mut().for_each(|v| *v *= self.speed);
        Cycle { pos: self.pos, yaw: self.yaw }.advance(clip.layout(), &mut qpos, 1);
        if root(model).is_some() {
            let (sin, cos) = (libm::sin(self.yaw), libm::cos(self.yaw));
            let [x, y] = [qvel[0], qvel[1]];
            (qvel[0], qvel[1]) = (cos * x - sin * y, sin * x + cos * y);
        }
        Some((qpos, qvel))
    }

    /// The state after `seconds` more.
    pub fn advance(&mut self, model: &Model, seconds: f64) -> Option<AgentState> {
        self.time += self.speed * seconds;
        self.elapsed += seconds;
        let (mut qpos, mut qvel) = self.clip_state(model)?;
        let stiffness = 2.0 * std::f64::consts::LN_2 / self.half_life.max(SHORTEST);
        let (t, fade) = (self.elapsed, libm::exp(-stiffness * self.elapsed));
        let way = |x: f64, v: f64| fade * (x + (v + x * stiffness) * t);
        let offset: Vec<f64> = self.offset.iter().zip(&self.rate).map(|(x, v)| way(*x, *v)).collect();
        for ((qvel, x), v) in qvel.iter_mut().zip(&self.offset).zip(&self.rate) {
            *qvel += fade * (v - (v + x * stiffness) * stiffness * t);
        }
        for joint in &model.joints {
            let (at, dof) = (joint.qpos_adr, joint.dof_adr);
            let (slides, turn) = parts(joint.kind);
            for i in 0..slides {
                qpos[at + i] += offset[dof + i];
            }
            if let (true, [a, b, c]) = (turn, &offset[dof + slides..(dof + slides + 3).min(model.nv)]) {
                let turned = integrate_quat(&quat(&qpos, at + slides), &[*a, *b, *c], 1.0);
                qpos[at + slides..at + slides + 4].copy_from_slice(&turned);
            }
        }
        Some(AgentState { qpos, qvel })
    }
}

/// Address of the position of a free root.
fn root(model: &Model) -> Option<usize> {
    model.joints.first().filter(|joint| joint.kind == JointType::Free).map(|joint| joint.qpos_adr)
}

/// Coordinates of a joint that add up, and whether a quaternion follows.
fn parts(kind: JointType) -> (usize, bool) {
    match kind {
        JointType::Free => (3, true),
        JointType::Ball => (0, true),
        JointType::Slide | JointType::Hinge => (1, false),
    }
}

fn quat(q: &[f64], at: usize) -> [f64; 4] {
    [q[at], q[at + 1], q[at + 2], q[at + 3]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use marathon_motion::{About, Layout};
    use std::path::Path;

    type Done = Result<(), Box<dyn std::error::Error>>;

    /// A body with an arm, and a clip in which it goes ahead at 1 m/s and turns its arm.
    fn clip() -> Result<(Model, Arc<Clip>), Box<dyn std::error::Error>> {
        let text = "<mujoco><worldbody><body name='b'><freejoint name='root'/><geom size='.1'/><body name='a'>\
            <joint name='arm' axis='0 1 0'/><geom size='.1' pos='.3 0 0'/></body></body></worldbody></mujoco>";
        let model = Model::from_xml_str(text, "arm")?;
        let frames: Vec<Vec<f64>> =
            (0..11).map(|i| vec![0.1 * f64::from(i), 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.05 * f64::from(i)]).collect();
        let clip = Clip::new(Path::new("go"), About::default(), Layout::of(&model), 0.1, None, &frames)?;
        Ok((model, Arc::new(clip)))
    }

    #[test]
    fn a_pose_moves_into_the_clip_without_a_jump() -> Done {
        let (model, clip) = clip()?;
        let mut playing = Playing::new(clip, 0.0, 1.0, 0.1);
        // turned by a quarter, elsewhere, with another arm, at rest
        let half = 0.5_f64.sqrt();
        let qpos = [4.0, -2.0, 1.3, half, 0.0, 0.0, half, -0.6];
        playing.start(&model, &qpos, &[0.0; 7]);
        let first = playing.advance(&model, 1e-6).ok_or("a state")?;
        assert!(first.qpos.iter().zip(qpos).all(|(a, b)| (a - b).abs() < 1e-5), "{:?}", first.qpos);
        assert!(first.qvel.iter().all(|v| v.abs() < 1e-3), "{:?}", first.qvel);
        // positions are the integral of velocities
        let mut before = playing.advance(&model, 0.1).ok_or("a state")?.qpos;
        for _ in 0..20 {
            let state = playing.advance(&model, 1e-4).ok_or("a state")?;
            for (i, dof) in [(0, 0), (1, 1), (2, 2), (7, 6)] {
                let rate = (state.qpos[i] - before[i]) / 1e-4;
                assert!((rate - state.qvel[dof]).abs() < 0.02, "{i}: {rate} and {}", state.qvel[dof]);
            }
            before = state.qpos;
        }
        // half a second later it is where the clip has it, along its own forward axis
        let state = playing.advance(&model, 0.7).ok_or("a state")?;
        let time = playing.elapsed;
        assert!((state.qpos[0] - 4.0).abs() < 0.02 && (state.qpos[1] + 2.0 - time).abs() < 0.02, "{:?}", state.qpos);
        assert!((state.qpos[2] - 1.0).abs() < 0.01 && (state.qpos[7] - 0.5 * time).abs() < 0.02, "{:?}", state.qpos);
        assert!((state.qvel[1] - 1.0).abs() < 0.05 && state.qvel[0].abs() < 0.05, "{:?}", state.qvel);
        assert!(!playing.is_over());
        playing.advance(&model, 1.0);
        assert!(playing.is_over());
        Ok(())
    }
}
