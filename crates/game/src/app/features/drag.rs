//! Dragging: a spring with a damper pulls a limb to the cursor while the left button is held. Its force is limited and shown.

use crate::app::input::pointer::{Gesture, Pointer};
use crate::app::mode::{AppSet, Mode};
use crate::app::stage::rods::{Picked, Picking};
use crate::app::ui::theme::{ACCENT, CARD, Hud, UiSet, font};
use bevy::math::primitives::InfinitePlane3d;
use bevy::prelude::*;
use bevy_egui::egui::{self, Align2, LayerId, Order, Pos2};
use bevy_egui::{EguiContexts, EguiPrimaryContextPass};
use bevy_marathon::{Anatomy, Marathon, MarathonSystems, Push, RagdollState, Track};
use marathon_physics::Model;
use std::time::Duration;

/// Largest force, as a factor of the character's weight: enough to lift it by a hand.
const MOST: f32 = 1.6;
/// Length of the spring at which it has the largest force, m.
const REACH: f32 = 0.35;
/// Damping as a share of the critical one of the whole character.
const DAMPING: f32 = 0.5;
/// Shares of the stiffest spring and damper that stay stable when a force holds over a whole decision: the explicit Euler method
/// needs k dt^2 / m and c dt / m to be small for the mass m of the limb.
const STABLE: [f32; 2] = [0.15, 0.35];
/// Gravity that weights are measured with, m/s^2.
const GRAVITY: f32 = 9.81;

/// A limb that is being dragged.
#[derive(Resource, Clone, Copy, Debug)]
pub struct Dragged {
    ragdoll: Entity,
    body: usize,
    /// The held point in the frame of the body.
    grip: Vec3,
    /// The held point in the world, as the last decision left it.
    held: Vec3,
    /// Where the cursor is, in the plane through the first hit that faces the camera.
    goal: Vec3,
    /// The force of the last decision, N.
    force: Vec3,
    /// Time of the last decision.
    until: Duration,
}

impl Dragged {
    /// The force on the limb, N.
    pub fn force(&self) -> Vec3 {
        self.force
    }
}

pub(super) fn plugin(app: &mut App) {
    app.add_systems(Update, (hold, draw_spring).chain().in_set(AppSet::Present))
        .add_systems(FixedUpdate, pull.run_if(resource_exists::<Dragged>).before(MarathonSystems::Admit))
        .add_systems(EguiPrimaryContextPass, label.run_if(resource_exists::<Dragged>).in_set(UiSet::Hud));
}

/// Takes hold of a limb, moves the goal with the cursor, and lets go.
fn hold(
    mut commands: Commands,
    (pointer, mode): (Res<Pointer>, Res<State<Mode>>),
    picking: Picking<'_, '_>,
    anatomies: Query<&Anatomy>,
    parts: Query<&GlobalTransform>,
    dragged: Option<ResMut<Dragged>>,
    mut missed: Local<bool>,
) {
    // runs on a course are compared, and other programs move the rest
    let allowed = mode.is_simulated() && *mode != Mode::Course;
    let (Gesture::Drag(from), true) = (pointer.gesture, allowed) else {
        *missed = false;
        if dragged.is_some() {
            commands.remove_resource::<Dragged>();
        }
        return;
    };
    let Some(mut dragged) = dragged else {
        // a drag that begins beside the character never holds it
        if *missed {
            return;
        }
        let picked = picking.at(from);
        *missed = picked.is_none();
        let Some(Picked { ragdoll, body, at, .. }) = picked else { return };
        let part = anatomies.get(ragdoll).ok().and_then(|anatomy| parts.get(*anatomy.parts.get(body)?).ok());
        let Some(part) = part else { return };
        let grip = part.affine().inverse().transform_point3(at);
        let (force, until) = (Vec3::ZERO, Duration::ZERO);
        commands.insert_resource(Dragged { ragdoll, body, grip, held: at, goal: at, force, until });
        return;
    };
    if !anatomies.contains(dragged.ragdoll) {
        commands.remove_resource::<Dragged>();
        return;
    }
    let ray = pointer.cursor.and_then(|cursor| picking.ray(cursor));
    let (Some(ray), Some(forward)) = (ray, picking.forward()) else { return };
    if let Some(distance) = ray.intersect_plane(dragged.goal, InfinitePlane3d { normal: forward }) {
        dragged.goal = ray.get_point(distance);
    }
}

/// Pulls the limb, once for each decision.
fn pull(
    mut commands: Commands,
    time: Res<Time<Fixed>>,
    marathon: Res<Marathon>,
    mut dragged: ResMut<Dragged>,
    ragdolls: Query<(&RagdollState, &Anatomy, &Track)>,
    mut pushes: MessageWriter<Push>,
) {
    let Ok((state, anatomy, track)) = ragdolls.get(dragged.ragdoll) else { return };
    let Some(history) = marathon.history(state) else { return };
    let new = history.iter().filter(|sample| sample.time > dragged.until);
    let (mut decisions, mut latest, mut fresh) = (0, None, false);
    for sample in new {
        (decisions, latest) = (decisions + 1, Some(sample.time));
        fresh |= sample.fresh && dragged.until > Duration::ZERO;
    }
    let Some(latest) = latest else { return };
    if fresh {
        // a new episode begins elsewhere
        commands.remove_resource::<Dragged>();
        return;
    }
    let places = marathon.places(state, latest.max(time.elapsed())).unwrap_or_default();
    let Some(part) = places.get(dragged.body) else { return };
    let at = (track.place() * *part).transform_point(dragged.grip);
    let dt = anatomy.dt as f32;
    let first = dragged.until == Duration::ZERO;
    let velocity = if first { Vec3::ZERO } else { (at - dragged.held) / (dt * decisions as f32) };
    dragged.force = spring(&anatomy.model, dragged.body, dt, dragged.goal - at, velocity);
    (dragged.held, dragged.until) = (at, latest);
    let seconds = if first { anatomy.dt } else { anatomy.dt * f64::from(decisions) };
    let (ragdoll, body, force) = (dragged.ragdoll, dragged.body, dragged.force);
    pushes.write(Push { ragdoll, body, force, at: Some(at), seconds });
}

/// The force on a point of a body that is `apart` from the cursor and moves, N.
fn spring(model: &Model, body: usize, dt: f32, apart: Vec3, velocity: Vec3) -> Vec3 {
    let mass: f64 = model.bodies.iter().map(|body| body.mass).sum();
    let mass = mass as f32;
    let most = MOST * GRAVITY * mass;
    // the resistance of the body to a blow, as the contact solver has it
    let limb = 1.0 / (model.bodies[body].invweight0[0] as f32).max(1e-6);
    let stiffness = (most / REACH).min(STABLE[0] * limb / (dt * dt));
    let damping = (2.0 * DAMPING * (stiffness * mass).sqrt()).min(STABLE[1] * limb / dt);
    (stiffness * apart - damping * velocity).clamp_length_max(most)
}

/// Draws the spring as a line from the held point to the cursor.
fn draw_spring(dragged: Option<Res<Dragged>>, mut gizmos: Option<Gizmos<'_, '_>>) {
    if let (Some(dragged), Some(gizmos)) = (dragged, &mut gizmos) {
        let color = Color::srgb(1.0, 0.62, 0.25);
        gizmos.line(dragged.held, dragged.goal, color);
        gizmos.sphere(Isometry3d::from_translation(dragged.held), 0.03, color);
    }
}

/// Writes the force beside the cursor.
fn label(mut contexts: EguiContexts, hud: Res<Hud>, dragged: Res<Dragged>, pointer: Res<Pointer>) -> Result {
    let ctx = contexts.ctx_mut()?.clone();
    let (Some(cursor), true) = (pointer.cursor, hud.on) else { return Ok(()) };
    // egui's points are scaled to the picture
    let at = Pos2::new(cursor.x, cursor.y) / ctx.zoom_factor() + egui::vec2(14.0, -8.0);
    let painter = ctx.layer_painter(LayerId::new(Order::Foreground, egui::Id::new("drag")));
    let words = format!("{:.0} N", dragged.force.length());
    let layout = painter.layout_no_wrap(words, font(15.0), ACCENT);
    let place = Align2::LEFT_CENTER.anchor_size(at, layout.size());
    painter.rect_filled(place.expand(4.0), 4.0, CARD);
    painter.galley(place.min, layout, ACCENT);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spring_pulls_to_the_cursor_and_is_limited() -> Result<(), Box<dyn std::error::Error>> {
        let xml = "<mujoco><worldbody><body><freejoint/><geom size='.1' mass='10'/></body></worldbody></mujoco>";
        let model = Model::from_xml_str(xml, "ball")?;
        let pull = |apart, velocity| spring(&model, 1, 0.02, apart, velocity);
        let near = pull(0.1 * Vec3::X, Vec3::ZERO);
        assert!(near.x > 10.0 && near.y == 0.0, "{near}");
        assert!((pull(50.0 * Vec3::X, Vec3::ZERO).x - MOST * GRAVITY * 10.0).abs() < 0.1);
        assert!(pull(0.1 * Vec3::X, Vec3::X).x < near.x, "a moving limb is slowed down");
        // a force that holds over a decision does not make the ball swing up
        let (mut x, mut v) = (0.4_f32, 0.0_f32);
        for _ in 0..200 {
            v += pull(-x * Vec3::X, v * Vec3::X).x / 10.0 * 0.02;
            x += v * 0.02;
        }
        assert!(x.abs() < 0.01 && v.abs() < 0.01, "{x} {v}");
        Ok(())
    }
}
