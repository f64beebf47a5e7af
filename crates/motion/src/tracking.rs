//! Measures of how well a simulated motion follows its clip, as used in the literature.

use crate::contact;
use crate::ground::Touch;
use crate::kinematics::Pose;
use crate::retarget::soles;
use glam::DVec3;
use marathon_physics::Model;

/// Height of the pelvis's up axis that a flip crosses on both sides: 60 degrees from upright and from upside down.
const UPRIGHT: f64 = 0.5;

/// Measures motions of a model.
#[derive(Clone, Debug)]
pub struct Tracking<'a> {
    model: &'a Model,
    /// Body at the top of the legs.
    pelvis: usize,
    /// Compared points: bodies, and positions on them.
    points: Vec<(usize, DVec3)>,
    soles: Vec<usize>,
    touches: Vec<Touch>,
}

/// Positions of a pose's points relative to the pelvis, world axes, m.
pub type Places = Vec<DVec3>;

impl<'a> Tracking<'a> {
    /// Prepares the measures for a model. They compare the joints of the AMP paper as far as the model has them: the
    /// origins of all moving bodies, which are at their joints, and the ends of arms and legs, which are the farthest
    /// geoms of bodies without children.
    pub fn new(model: &'a Model) -> Self {
        let soles = soles(model);
        let pelvis = pelvis(model, &soles);
        let mut points = Vec::new();
        for (i, body) in model.bodies.iter().enumerate().skip(1) {
            if body.weld_id == 0 {
                continue;
            }
            if i != pelvis {
                points.push((i, DVec3::ZERO));
            }
            if model.bodies.iter().skip(1).all(|other| other.parent != i) {
                let ends = model.geoms.iter().filter(|geom| geom.body == i).map(|geom| DVec3::from_array(geom.pos));
                let end = ends.max_by(|a, b| a.length().total_cmp(&b.length()));
                points.extend(end.map(|end| (i, end)));
            }
        }
        Tracking { model, pelvis, points, soles, touches: Touch::all(model) }
    }

    /// Positions of the compared points of a pose.
    pub fn places(&self, qpos: &[f64]) -> Places {
        let pose = Pose::of(self.model, qpos);
        let from = pose.pos[self.pelvis];
        self.points.iter().map(|(body, local)| pose.point(*body, *local) - from).collect()
    }

    /// Mean distance of the compared points, relative to the pelvis, after both motions are aligned in time by dynamic
    /// time warping (Sakoe and Chiba, 1978), m. This is the measure of table 3 of the AMP paper (Peng et al., 2021).
    /// `None` without poses.
    pub fn pose_error(&self, played: &[Places], clip: &[Places]) -> Option<f64> {
        let cost = |i: usize, j: usize| {
            let pairs = played[i].iter().zip(&clip[j]);
            pairs.map(|(a, b)| a.distance(*b)).sum::<f64>() / self.points.len() as f64
        };
        if played.is_empty() || clip.is_empty() || self.points.is_empty() {
            return None;
        }
        // for each pair of a row: cost and length of the cheapest path to it
        let mut before: Vec<(f64, usize)> = Vec::new();
        for i in 0..played.len() {
            let mut row: Vec<(f64, usize)> = Vec::with_capacity(clip.len());
            for j in 0..clip.len() {
                let left = j.checked_sub(1).map(|j| row[j]);
                let up = before.get(j).copied();
                let diagonal = j.checked_sub(1).and_then(|j| before.get(j).copied());
                let cheapest = [diagonal, up, left].into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0));
                let (sum, length) = cheapest.unwrap_or((0.0, 0));
                row.push((sum + cost(i, j), length + 1));
            }
            before = row;
        }
        before.last().map(|(sum, length)| sum / *length as f64)
    }

    /// Number of times that the pelvis has been upside down and upright again.
    pub fn flips(&self, frames: &[Vec<f64>]) -> usize {
        let (mut flips, mut upside_down) = (0, false);
        for frame in frames {
            let up = (Pose::of(self.model, frame).quat[self.pelvis] * DVec3::Z).z;
            if up < -UPRIGHT {
                upside_down = true;
            } else if up > UPRIGHT && upside_down {
                upside_down = false;
                flips += 1;
            }
        }
        flips
    }

    /// Foot sliding on level ground, m: for each ground contact of a part of a sole, the distance that its lowest point
    /// moves from start to end. `dt`: seconds between frames.
    pub fn slides(&self, frames: &[Vec<f64>], dt: f64) -> Vec<f64> {
        if frames.is_empty() {
            return Vec::new();
        }
        let poses: Vec<Pose> = frames.iter().map(|frame| Pose::of(self.model, frame)).collect();
        let held = contact::held(self.model, &self.touches, &self.soles, frames, dt);
        let mut out = Vec::new();
        contact::stances(&self.touches, &held, &poses, |_, _, steps| {
            out.push(steps.iter().sum::<DVec3>().length());
        });
        out
    }
}

/// The body at the top of the legs: the last one above all soles, or the first body without soles.
fn pelvis(model: &Model, soles: &[usize]) -> usize {
    let chain = |mut body: usize| {
        let mut chain = Vec::new();
        while body != 0 {
            chain.push(body);
            body = model.bodies[body].parent;
        }
        chain
    };
    let mut chains = soles.iter().map(|sole| chain(*sole));
    let Some(first) = chains.next() else { return 1 };
    let others: Vec<Vec<usize>> = chains.collect();
    first.into_iter().find(|body| others.iter().all(|other| other.contains(body))).unwrap_or(1)
}
