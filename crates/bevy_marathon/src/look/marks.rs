//! Debug marks: contacts and their forces, joints and their limits, axes, targets, and commands.

use crate::axes::to_game;
use crate::look::joint_places;
use crate::marathon::{Marathon, RagdollState};
use crate::pose;
use crate::ragdoll::{Anatomy, Episode, Part, Target};
use crate::track::Track;
use bevy::platform::cell::SyncCell;
use bevy::prelude::*;
use marathon_envs::CommandRange;
use marathon_physics::lanes::Isa;
use marathon_physics::model::{JointType, Sensor, SensorObject, SensorType};
use marathon_physics::{Batch, BatchOptions, Model};
use std::collections::VecDeque;
use std::f32::consts::TAU;
use std::sync::Arc;

/// Length of the arrow of a force as large as the body's weight, m.
const WEIGHT_ARROW: f32 = 0.7;
/// Fields of a contact sensor (found, force, place) and the reduction that sums all contacts of a geom.
const FIELDS: i32 = 1 | 2 | 16;
const SUM: i32 = 3;

const CONTACT: Color = Color::srgb(1.0, 0.25, 0.2);
const FORCE: Color = Color::srgb(1.0, 0.75, 0.1);
const JOINT: Color = Color::srgb(0.2, 0.95, 0.95);
const LIMIT: Color = Color::srgb(1.0, 0.35, 0.75);
const TARGET: Color = Color::srgb(0.3, 1.0, 0.4);
const TOLD: Color = Color::srgb(0.35, 0.8, 1.0);
const OWN: Color = Color::srgb(0.8, 0.8, 0.8);
/// Length of the arrow of a meter per second, m, and radius of the arc of a turn, m.
const SPEED_ARROW: f64 = 0.5;
const TURN_ARC: f64 = 0.7;
/// Time of a turn that its arc shows, s.
const TURN_TIME: f64 = 0.5;

/// Draws what the [`Marks`] of a ragdoll ask for, and [`Target`]s.
#[derive(Clone, Copy, Debug, Default)]
pub struct MarksPlugin;

impl Plugin for MarksPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<Marks>()
            .init_resource::<Probe>()
            .add_systems(Startup, in_front)
            .add_systems(PostUpdate, (contacts, joints, told, targets).after(TransformSystems::Propagate));
    }
}

/// Marks to draw for a ragdoll.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
pub struct Marks {
    /// Where it touches the ground, and how hard.
    pub contacts: bool,
    /// Its joints: axes, ranges and where in them they are.
    pub joints: bool,
    /// A ring around it on the ground.
    pub ring: bool,
    /// The commanded and the actual velocity, and the commanded turn in half a second, on the ground.
    pub command: bool,
}

/// One more simulation of a ragdoll, which tells forces: those of the real one are not kept between steps.
#[derive(Resource, Default)]
struct Probe(Option<(Arc<Model>, SyncCell<Batch>)>);

fn in_front(mut store: ResMut<GizmoConfigStore>) {
    let (config, _) = store.config_mut::<DefaultGizmoConfigGroup>();
    config.depth_bias = -0.9;
    config.line.width = 2.5;
}

/// The model with a sensor for the contacts of each of its moving geoms.
fn with_sensors(model: &Model) -> Model {
    let mut model = model.clone();
    model.sensors = (0..model.geoms.len())
        .filter(|g| model.bodies[model.geoms[*g].body].weld_id != 0)
        .enumerate()
        .map(|(i, geom)| Sensor {
            name: String::new(),
            element: "contact".into(),
            kind: SensorType::Contact,
            object: SensorObject::Geom(geom),
            reference: SensorObject::None,
            intprm: [FIELDS, SUM, 1],
            adr: 7 * i,
            dim: 7,
            cutoff: 0.0,
        })
        .collect();
    model
}

fn contacts(
    marathon: Res<Marathon>,
    mut probe: ResMut<Probe>,
    mut gizmos: Gizmos,
    ragdolls: Query<(&RagdollState, &Anatomy, &Marks, (&GlobalTransform, &Track))>,
) {
    for (key, anatomy, marks, (place, track)) in &ragdolls {
        let track = *place * track.inverse();
        let Some(sample) = marathon.history(key).and_then(VecDeque::back) else { continue };
        if marks.ring
            && let Ok(pose) = marathon_render::Scene::pose_from_qpos(&anatomy.model, &sample.qpos)
        {
            let at = track.transform_point(to_game(pose.com) * Vec3::new(1.0, 0.0, 1.0)) + Vec3::Y * 0.01;
            gizmos.circle(Isometry3d::new(at, Quat::from_rotation_x(TAU / 4.0)), 0.55, Color::srgb(1.0, 1.0, 1.0));
        }
        if !marks.contacts {
            continue;
        }
        if !probe.0.as_ref().is_some_and(|(known, _)| Arc::ptr_eq(known, &anatomy.model)) {
            let options = BatchOptions { isa: Isa::F32, ..default() };
            let Ok(batch) = Batch::new(&with_sensors(&anatomy.model), &options) else { continue };
            probe.0 = Some((anatomy.model.clone(), SyncCell::new(batch)));
        }
        let Some((model, batch)) = &mut probe.0 else { continue };
        let batch = batch.get();
        batch.reset(0, &sample.qpos, &sample.qvel);
        let weight: f64 = model.bodies.iter().map(|b| b.mass).sum::<f64>() * 9.81;
        for values in batch.sensors(0).chunks_exact(7) {
            let [found, force, place] = [&values[..1], &values[1..4], &values[4..7]];
            if !(found[0] > 0.0) {
                continue;
            }
            let at = track.transform_point(to_game([place[0], place[1], place[2]]));
            let force = to_game([force[0], force[1], force[2]]) * (WEIGHT_ARROW / weight as f32);
            // the ground pushes up, whichever of the two the sensor reports
            let force = track.rotation() * if force.y < 0.0 { -force } else { force };
            gizmos.sphere(at, 0.025, CONTACT);
            gizmos.arrow(at, at + force, FORCE).with_tip_length(0.08);
        }
    }
}

fn joints(
    marathon: Res<Marathon>,
    mut gizmos: Gizmos,
    ragdolls: Query<(&RagdollState, &Anatomy, &Marks)>,
    parts: Query<&GlobalTransform, With<Part>>,
) {
    for (key, anatomy, ..) in ragdolls.iter().filter(|(.., marks)| marks.joints) {
        let Some(sample) = marathon.history(key).and_then(VecDeque::back) else { continue };
        let model = &anatomy.model;
        let place = |body: usize| anatomy.parts.get(body).and_then(|p| parts.get(*p).ok());
        // the skeleton: lines from body to body
        for (i, body) in model.bodies.iter().enumerate().skip(1).filter(|(_, b)| b.parent != 0) {
            if let (Some(a), Some(b)) = (place(i), place(body.parent)) {
                gizmos.line(a.translation(), b.translation(), Color::WHITE);
            }
        }
        let sizes = joint_places(model);
        for joint in model.joints.iter().filter(|j| j.kind == JointType::Hinge && model.bodies[j.body].parent != 0) {
            let Some(part) = place(joint.body) else { continue };
            let at = part.transform_point(to_game(joint.pos));
            let axis = (part.rotation() * to_game(joint.axis)).normalize_or(Vec3::Y);
            let size = sizes.iter().find(|(b, ..)| *b == joint.body).map_or(0.06, |(.., r)| 1.6 * *r as f32);
            gizmos.line(at - axis * size, at + axis * size, JOINT);
            if !joint.limited {
                continue;
            }
            // the range is drawn where the body's present position is its middle line
            let q = sample.qpos[joint.qpos_adr] as f32;
            let [low, high] = joint.range.map(|x| x as f32);
            let arm = axis.any_orthonormal_vector();
            let point = |angle: f32| at + Quat::from_axis_angle(axis, angle - q) * arm * size * 1.8;
            let steps = 24;
            let arc = (0..=steps).map(|i| point(low + (high - low) * i as f32 / steps as f32));
            gizmos.linestrip(arc, LIMIT);
            for end in [low, high] {
                gizmos.line(at, point(end), LIMIT);
            }
            gizmos.line(at, point(q), JOINT);
        }
    }
}

/// The velocity of a command: ahead and to the left, m/s, and the turn, rad/s. `None` if the command has no number in m/s.
pub fn commanded_velocity(ranges: &[CommandRange], command: &[f64]) -> Option<[f64; 3]> {
    let mut speeds = ranges.iter().zip(command).filter(|(range, _)| range.is_speed()).map(|(_, x)| *x);
    let ahead = speeds.next()?;
    let turn = ranges.iter().zip(command).find(|(range, _)| range.is_turn()).map_or(0.0, |(_, x)| *x);
    Some([ahead, speeds.next().unwrap_or(0.0), turn])
}

#[expect(clippy::type_complexity, reason = "a query names what it reads")]
fn told(
    marathon: Res<Marathon>,
    mut gizmos: Gizmos,
    ragdolls: Query<(&RagdollState, &Anatomy, &Marks, &Episode, (&GlobalTransform, &Track))>,
) {
    for (key, anatomy, _, episode, (place, track)) in ragdolls.iter().filter(|(_, _, marks, ..)| marks.command) {
        let track = *place * track.inverse();
        let ranges = anatomy.spec.as_ref().map_or(&[][..], |spec| &spec.command);
        let Some([ahead, left, turn]) = commanded_velocity(ranges, &episode.command) else { continue };
        let Some(sample) = marathon.history(key).and_then(VecDeque::back) else { continue };
        let Ok(pose) = marathon_render::Scene::pose_from_qpos(&anatomy.model, &sample.qpos) else { continue };
        let heading = pose::heading(&anatomy.model, &sample.qpos);
        let point = |[x, y]: [f64; 2]| {
            let at = to_game([pose.com[0] + x, pose.com[1] + y, 0.0]) * Vec3::new(1.0, 0.0, 1.0);
            track.transform_point(at) + Vec3::Y * 0.02
        };
        let turned = |[ahead, left]: [f64; 2]| {
            let (sin, cos) = heading.sin_cos();
            [ahead * cos - left * sin, ahead * sin + left * cos].map(|x| x * SPEED_ARROW)
        };
        let free = anatomy.model.joints.first().filter(|joint| joint.kind == JointType::Free);
        let own = [sample.qvel[0], free.map_or(0.0, |_| sample.qvel[1])].map(|x| x * SPEED_ARROW);
        for (end, color) in [(own, OWN), (turned([ahead, left]), TOLD)] {
            if end[0].hypot(end[1]) > 0.05 {
                gizmos.arrow(point([0.0; 2]), point(end), color).with_tip_length(0.12);
            }
        }
        if turn != 0.0 {
            let arc = (0..=16).map(|i| {
                let angle = heading + turn * TURN_TIME * f64::from(i) / 16.0;
                point([angle.cos(), angle.sin()].map(|x| x * TURN_ARC))
            });
            gizmos.linestrip(arc, TOLD);
        }
    }
}

fn targets(mut gizmos: Gizmos, targets: Query<&Target>) {
    for target in &targets {
        let at = target.place * Vec3::new(1.0, 0.0, 1.0) + Vec3::Y * 0.02;
        let flat = Quat::from_rotation_x(TAU / 4.0);
        gizmos.circle(Isometry3d::new(at, flat), target.radius, TARGET);
        gizmos.line(at, at + Vec3::Y * 1.5, TARGET);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_read_by_its_units() {
        let ranges = [
            CommandRange::new("jump", 0.0..=1.0, ""),
            CommandRange::new("speed", -3.0..=3.0, "m/s"),
            CommandRange::new("turn", -2.0..=2.0, "rad/s"),
            CommandRange::new("left", -1.0..=1.0, "m/s"),
        ];
        assert_eq!(commanded_velocity(&ranges, &[1.0, 2.0, 0.5, -1.0]), Some([2.0, -1.0, 0.5]));
        assert_eq!(commanded_velocity(&ranges[..2], &[1.0, 2.0]), Some([2.0, 0.0, 0.0]));
        assert_eq!(commanded_velocity(&ranges[..1], &[1.0]), None);
    }
}
