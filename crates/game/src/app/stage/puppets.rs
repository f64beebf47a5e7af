//! Characters whose poses come from a recording or from another program.

use crate::app::stage::actors::Actor;
use bevy::prelude::*;
use bevy_marathon::look::{FollowCamera, Marks, Tint};
use bevy_marathon::{Anatomy, Episode, OwnGround, Part, Track, pose};
use marathon_envs::Spec;
use marathon_physics::Model;
use marathon_render::Scene;
use std::sync::Arc;

/// The body and task that all puppets of a scenario share.
#[derive(Clone)]
pub struct Kind {
    /// The body.
    pub model: Arc<Model>,
    /// The task, if there is one.
    pub spec: Option<Arc<Spec>>,
    /// Seconds between two poses.
    pub dt: f64,
    /// Radius of the body, and distance between two of them, m.
    size: [f32; 2],
}

impl Kind {
    /// Puppets of a body.
    pub fn new(model: Arc<Model>, spec: Option<Arc<Spec>>, dt: f64) -> Self {
        let scene = Scene::new(&model);
        Kind { size: [scene.radius() as f32, scene.spacing() as f32], model, spec, dt }
    }

    /// Distance between two puppets side by side, m.
    pub fn spacing(&self) -> f32 {
        self.size[1]
    }

    /// Whether they are on level ground.
    pub fn level(&self) -> bool {
        self.model.hfields.is_empty()
    }
}

/// Spawns puppets at their places.
pub fn spawn(
    commands: &mut Commands,
    kind: &Kind,
    places: impl Iterator<Item = Vec3>,
    cameras: &mut Query<&mut FollowCamera>,
) {
    for (number, place) in places.enumerate() {
        let place = Transform::from_translation(place);
        let here = (Actor(number), place, Track::at(place), Visibility::default());
        let puppet = commands.spawn((here, Marks::default(), Episode::default(), OwnGround::default())).id();
        let parts = pose::spawn_parts(commands, &kind.model, puppet);
        let (model, spec) = (kind.model.clone(), kind.spec.clone());
        commands.entity(puppet).insert(Anatomy { model, spec, parts, feet: Vec::new(), dt: kind.dt });
        if number > 0 {
            commands.entity(puppet).insert(Tint::of_row(number));
        }
    }
    for mut camera in cameras {
        camera.goal[2] = 3.1 * kind.size[0] + 0.6;
        camera.ahead = 0.0;
        camera.jump();
    }
}

/// Moves the parts of a puppet.
pub fn pose(anatomy: &Anatomy, track: &Track, qpos: &[f64], parts: &mut Query<&mut Transform, With<Part>>) {
    pose::put(anatomy, track, pose::places(&anatomy.model, qpos), parts);
}
