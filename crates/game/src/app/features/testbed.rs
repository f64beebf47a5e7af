//! The test bed: a slider per motor of any model, and a slider per joint while time is paused.

use crate::app::input::actions::Action;
use crate::app::mode::Mode;
use crate::app::stage::actors::Actor;
use crate::app::ui::hints::{KeyHints, ModeKeys};
use crate::app::ui::theme::{Hud, UiSet, panel};
use bevy::prelude::*;
use bevy_egui::egui::{self, RichText, Slider};
use bevy_egui::{EguiContexts, EguiPrimaryContextPass};
use bevy_marathon::{Anatomy, Controls, Marathon, RagdollState};
use marathon_envs::AgentState;
use marathon_physics::model::JointType;

pub(super) fn plugin(app: &mut App) {
    app.add_systems(EguiPrimaryContextPass, draw.run_if(in_state(Mode::Testbed)).in_set(UiSet::Panels));
}

pub(super) fn key_hints(hints: &mut KeyHints) {
    const KEYS: ModeKeys = ModeKeys {
        useful: &[Action::Menu, Action::Pause, Action::Step, Action::Restart, Action::Joints, Action::Contacts],
        without: &[Action::Record],
        ..ModeKeys::COMMON
    };
    hints.add(|scenario| scenario.mode == Mode::Testbed, &KEYS);
}

/// Draws the sliders.
fn draw(
    mut contexts: EguiContexts,
    hud: Res<Hud>,
    time: Res<Time<Virtual>>,
    mut commands: Commands,
    mut marathon: ResMut<Marathon>,
    mut actors: Query<(Entity, &Anatomy, &RagdollState, Option<&mut Controls>), With<Actor>>,
) -> Result {
    let ctx = contexts.ctx_mut()?.clone();
    let Some((entity, anatomy, key, controls)) = actors.iter_mut().next() else { return Ok(()) };
    let model = anatomy.model.clone();
    let Some(mut controls) = controls else {
        commands.entity(entity).insert(Controls(vec![0.0; model.nu]));
        return Ok(());
    };
    if !hud.on {
        return Ok(());
    }
    panel(&ctx, true, |ui| {
        let height = 0.42 * ctx.content_rect().height();
        ui.label(RichText::new("motors").size(15.0).strong());
        egui::ScrollArea::vertical().id_salt("motors").max_height(height).show(ui, |ui| {
            let mut now = controls.0.clone();
            for (i, (actuator, x)) in model.actuators.iter().zip(&mut now).enumerate() {
                let name = if actuator.name.is_empty() { format!("{i}") } else { actuator.name.clone() };
                let [low, high] = if actuator.ctrl_limited { actuator.ctrl_range } else { [-1.0, 1.0] };
                ui.add(Slider::new(x, low as f32..=high as f32).text(name));
            }
            if now != controls.0 {
                controls.0 = now;
            }
        });
        if ui.button("all to zero").clicked() {
            controls.0.fill(0.0);
        }
        if !time.is_paused() {
            ui.label(RichText::new("joints: pause to pose them").size(12.0).weak());
            return;
        }
        ui.label(RichText::new("joints").size(15.0).strong());
        egui::ScrollArea::vertical().id_salt("joints").max_height(height).show(ui, |ui| {
            let Some(AgentState { mut qpos, qvel }) = marathon.state(key) else { return };
            let before = qpos.clone();
            for joint in model.joints.iter().filter(|j| matches!(j.kind, JointType::Hinge | JointType::Slide)) {
                let [low, high] = match (joint.limited, joint.kind) {
                    (true, _) => joint.range,
                    (false, JointType::Slide) => [-2.0, 2.0],
                    (false, _) => [-3.15, 3.15],
                };
                ui.add(Slider::new(&mut qpos[joint.qpos_adr], low..=high).text(joint.name.as_str()));
            }
            if qpos != before {
                // the lengths are those of the state itself
                let _ = marathon.set_state(key, &AgentState { qpos, qvel: vec![0.0; qvel.len()] });
            }
        });
    });
    Ok(())
}
