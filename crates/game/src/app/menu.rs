//! The menu: mode, agent, policy, how many; keys. And the sliders of the modes that have some.

use crate::app::args::Mode;
use crate::app::ask::{Asked, Question, Stakes};
use crate::app::course;
use crate::app::hud::{Hud, card};
use crate::app::imitate::{FOLLOWER, choose_clip, clip_of, follows_clip};
use crate::app::keys::{Bindings, Deed, Rebinding, keep};
use crate::app::show::{Actor, Show, Source};
use crate::app::weather::Weather;
use crate::ground::Ground;
use crate::ragdoll::{Anatomy, Controls};
use crate::simulate::{Marathon, RagdollState};
use bevy::prelude::*;
use bevy_egui::EguiContexts;
use bevy_egui::egui::{self, Align2, Area, ComboBox, Id, RichText, Slider, Ui};
use marathon_envs::agents::marathon::marathon_man::clips;
use marathon_envs::{AgentState, registry};
use marathon_physics::model::JointType;
use std::path::PathBuf;

/// Title of the menu's window.
const TITLE: &str = "Marathon";
/// Width of the menu, and the free space beside and above it, points.
const WIDTH: f32 = 560.0;
const MARGIN: f32 = 70.0;

/// Whether the menu is open, and what has been chosen in it so far.
#[derive(Resource, Default)]
pub struct Menu {
    /// It is open.
    pub open: bool,
    /// Starts the selection even if something is lost.
    pub(super) agreed: bool,
    choice: Option<Show>,
    /// Policies of runs in the present folder: file, and what it is called.
    runs: Vec<(PathBuf, String)>,
}

impl Menu {
    /// Opens or closes it.
    pub fn toggle(&mut self) {
        self.open = !self.open;
        self.choice = None;
        self.agreed = false;
    }
}

/// Policies of the runs for an agent in the present folder.
fn runs(agent: &str) -> Vec<(PathBuf, String)> {
    let folders = std::fs::read_dir("runs").into_iter().flatten().flatten().map(|entry| entry.path());
    let mut runs: Vec<_> = folders
        .map(|folder| (folder.join("policy.safetensors"), folder.display().to_string()))
        .filter(|(file, _)| marathon_learn::Policy::load(file).is_ok_and(|p| p.meta().agent == agent))
        .collect();
    runs.sort();
    runs
}

/// Draws the menu.
pub fn draw(
    mut contexts: EguiContexts,
    mut menu: ResMut<Menu>,
    mut show: ResMut<Show>,
    mut bindings: ResMut<Bindings>,
    mut rebinding: ResMut<Rebinding>,
    mut exit: MessageWriter<AppExit>,
    (stakes, mut question): (Stakes<'_>, ResMut<Question>),
) -> Result {
    if !menu.open {
        return Ok(());
    }
    let ctx = contexts.ctx_mut()?.clone();
    let fresh = menu.choice.is_none();
    let mut choice = menu.choice.take().unwrap_or_else(|| show.clone());
    if fresh {
        menu.runs = runs(&choice.agent);
    }
    let Menu { runs, .. } = &mut *menu;
    let Picked { start, quit, reset, open } = window(&ctx, &mut choice, runs, (&bindings, &mut *rebinding), None);
    let mut start = start;
    if reset {
        *bindings = Bindings::default();
        keep(&bindings);
    }
    if quit {
        match stakes.at_the_end() {
            Some(text) => question.0 = Some((Asked::Deed(Deed::Quit), text)),
            None => {
                exit.write(AppExit::Success);
            }
        }
    }
    let agreed = std::mem::take(&mut menu.agreed);
    if let Some(text) = stakes.at_a_start().filter(|_| start && !agreed) {
        question.0 = Some((Asked::Start, text));
        start = false;
    }
    if start || agreed {
        choice.again();
        *show = choice;
        menu.open = false;
    } else {
        menu.open = open;
        menu.choice = Some(choice).filter(|_| open);
    }
    Ok(())
}

/// The menu items that were clicked.
struct Picked {
    start: bool,
    quit: bool,
    /// Reset all keys to their defaults.
    reset: bool,
    open: bool,
}

/// The menu's window; `unfold` opens or closes its list of keys.
fn window(
    ctx: &egui::Context,
    choice: &mut Show,
    of_runs: &mut Vec<(PathBuf, String)>,
    (bindings, rebinding): (&Bindings, &mut Rebinding),
    unfold: Option<bool>,
) -> Picked {
    let mut picked = Picked { start: false, quit: false, reset: false, open: true };
    let room = ctx.content_rect().size() - egui::Vec2::splat(MARGIN);
    egui::Window::new(TITLE)
        .id(Id::new(TITLE))
        .anchor(Align2::CENTER_CENTER, [0.0, 0.0])
        .collapsible(false)
        .auto_sized()
        .open(&mut picked.open)
        .show(ctx, |ui| {
            ui.set_width(WIDTH.min(room.x));
            let list = egui::ScrollArea::vertical().max_height(room.y);
            list.show(ui, |ui| {
                let before = choice.agent.clone();
                choose(ui, choice, of_runs);
                if choice.agent != before {
                    *of_runs = runs(&choice.agent);
                    if matches!(choice.source, Source::File(_)) {
                        choice.source = Source::Shipped;
                    }
                }
                ui.add_space(8.0);
                ui.horizontal(|ui| {
                    picked.start = ui.button(RichText::new("  Start  ").size(17.0).strong()).clicked();
                    picked.quit = ui.button(RichText::new("  Quit  ").size(17.0)).clicked();
                });
                ui.add_space(6.0);
                egui::CollapsingHeader::new("Keys").open(unfold).show(ui, |ui| {
                    picked.reset = keys(ui, bindings, rebinding);
                });
            });
        });
    picked
}

fn choose(ui: &mut Ui, choice: &mut Show, runs: &[(PathBuf, String)]) {
    ui.horizontal(|ui| {
        for mode in [Mode::Watch, Mode::Push, Mode::Imitate, Mode::Course, Mode::Learn, Mode::Testbed] {
            let clicked = ui.selectable_label(choice.mode == mode, RichText::new(mode.name()).size(15.0)).clicked();
            if clicked {
                choice.mode = mode;
                match (mode, &choice.source) {
                    (Mode::Learn, _) => choice.play(Source::Trainer),
                    (Mode::Testbed, _) => choice.play(Source::Nothing),
                    (_, Source::File(_)) => {}
                    _ => choice.play(Source::Shipped),
                }
                if mode == Mode::Imitate && !follows_clip(&choice.agent) {
                    choice.agent = FOLLOWER.into();
                }
                if mode == Mode::Course {
                    course::suit(choice);
                }
            }
        }
    });
    ui.separator();
    egui::Grid::new("choice").num_columns(2).spacing([16.0, 8.0]).show(ui, |ui| {
        ui.label("Agent");
        ComboBox::from_id_salt("agent").selected_text(choice.agent.as_str()).width(230.0).show_ui(ui, |ui| {
            for id in registry::ids() {
                let summary = registry::agent(&id).map(|a| a.facts().summary).unwrap_or_default();
                ui.selectable_value(&mut choice.agent, id.clone(), id).on_hover_text(summary);
            }
        });
        ui.end_row();
        if let Some(clip) = clip_of(choice).filter(|_| choice.mode != Mode::Testbed) {
            ui.label("Clip");
            let mut wanted = clip.clone();
            ComboBox::from_id_salt("clip").selected_text(clip.as_str()).width(230.0).show_ui(ui, |ui| {
                let known = clips::all_names();
                // those of files are known by the texts that somebody has chosen
                for name in known.into_iter().filter(|name| !name.ends_with(".motion") || *name == clip) {
                    ui.selectable_value(&mut wanted, name.clone(), name);
                }
            });
            if wanted != clip {
                choose_clip(choice, &wanted);
            }
            ui.end_row();
        }
        if choice.mode == Mode::Course {
            course::choose(ui, choice);
        }
        if matches!(choice.mode, Mode::Watch | Mode::Push | Mode::Imitate | Mode::Course) {
            ui.label("Policy");
            let name = |source: &Source| match source {
                Source::Shipped => "the one that comes with it".to_string(),
                Source::File(file) => file.display().to_string(),
                Source::Trainer => "being learned".into(),
                Source::Nothing => "none: let it fall".into(),
            };
            let mut wanted = choice.source.clone();
            ComboBox::from_id_salt("policy").selected_text(name(&choice.source)).width(230.0).show_ui(ui, |ui| {
                for source in [Source::Shipped, Source::Nothing] {
                    let label = name(&source);
                    ui.selectable_value(&mut wanted, source, label);
                }
                for (file, label) in runs {
                    ui.selectable_value(&mut wanted, Source::File(file.clone()), label);
                }
            });
            if wanted != choice.source {
                choice.play(wanted);
            }
            ui.end_row();
        }
        if choice.mode != Mode::Testbed {
            if choice.mode != Mode::Course {
                ui.label("Ground");
                ui.horizontal(|ui| {
                    for ground in Ground::ALL {
                        ui.selectable_value(&mut choice.ground, ground, ground.name());
                    }
                });
                ui.end_row();
            }
            ui.label("Characters");
            ui.add(Slider::new(&mut choice.agents, 1..=64));
            ui.end_row();
            ui.label("Seed");
            ui.add(egui::DragValue::new(&mut choice.seed));
            ui.end_row();
        }
    });
}

/// Shows the keys, which a click changes. Returns whether to reset all keys.
fn keys(ui: &mut Ui, bindings: &Bindings, rebinding: &mut Rebinding) -> bool {
    // two columns, so that all keys fit a window
    let rows: Vec<_> = bindings.rows().collect();
    let half = rows.len().div_ceil(2);
    egui::Grid::new("bindings").num_columns(6).spacing([14.0, 4.0]).show(ui, |ui| {
        for (i, first) in rows[..half].iter().enumerate() {
            for (deed, name, key, button) in [Some(first), rows.get(half + i)].into_iter().flatten() {
                ui.label(*name);
                let waits = rebinding.0 == Some(*deed);
                if ui.button(if waits { "press a key" } else { key }).clicked() {
                    rebinding.0 = if waits { None } else { Some(*deed) };
                }
                ui.label(button.unwrap_or(""));
            }
            ui.end_row();
        }
    });
    ui.horizontal(|ui| {
        let reset = ui.button("all keys as they come").clicked();
        if reset {
            rebinding.0 = None;
        } else if rebinding.0.is_some() {
            ui.label(RichText::new("Esc leaves it as it is").weak());
        }
        reset
    })
    .inner
}

/// Sliders of the push mode.
pub fn circumstances(
    mut contexts: EguiContexts,
    (show, hud): (Res<Show>, Res<Hud>),
    mut weather: ResMut<Weather>,
) -> Result {
    if show.mode != Mode::Push || !hud.on {
        return Ok(());
    }
    let ctx = contexts.ctx_mut()?.clone();
    let mut now = *weather;
    Area::new(Id::new("circumstances")).anchor(Align2::RIGHT_TOP, [-14.0, 14.0]).show(&ctx, |ui| {
        card().show(ui, |ui| {
            ui.label(RichText::new("circumstances").size(15.0).strong());
            ui.add(Slider::new(&mut now.gravity, 0.0..=2.5).text("gravity").suffix(" x"));
            ui.add(Slider::new(&mut now.uphill, -20.0..=20.0).text("uphill").suffix(" deg"));
            ui.add(Slider::new(&mut now.friction, 0.05..=2.0).text("friction").suffix(" x"));
            ui.add(Slider::new(&mut now.strength, 0.2..=1.5).text("strength").suffix(" x"));
            ui.add(Slider::new(&mut now.push, 0.1..=3.0).text("push").suffix(" m/s"));
            ui.add(Slider::new(&mut now.ball, 0.2..=10.0).text("ball").suffix(" kg"));
            if ui.button("as usual").clicked() {
                now = Weather::default();
            }
        });
    });
    // a change that is none would be taken for one
    if now != *weather {
        *weather = now;
    }
    Ok(())
}

/// Sliders of the test bed: one per motor, and one per joint while the time stands still.
pub fn motors(
    mut contexts: EguiContexts,
    (show, hud): (Res<Show>, Res<Hud>),
    time: Res<Time<Virtual>>,
    mut commands: Commands,
    mut marathon: ResMut<Marathon>,
    mut actors: Query<(Entity, &Anatomy, &RagdollState, Option<&mut Controls>), With<Actor>>,
) -> Result {
    if show.mode != Mode::Testbed {
        return Ok(());
    }
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
    Area::new(Id::new("motors")).anchor(Align2::RIGHT_TOP, [-14.0, 14.0]).show(&ctx, |ui| {
        card().show(ui, |ui| {
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
                    // lengths and numbers come from the state itself
                    let _ = marathon.set_state(key, &AgentState { qpos, qvel: vec![0.0; qvel.len()] });
                }
            });
        });
    });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::args::Args;
    use clap::Parser;

    /// The menu's position with all keys, in a window of the given size, for each mode.
    fn places(width: f32, height: f32) -> Result<Vec<(Mode, egui::Rect)>, Box<dyn std::error::Error>> {
        let show = Show::of(&Args::parse_from(["marathon-game"]))?;
        let mut places = Vec::new();
        for mode in [Mode::Watch, Mode::Imitate, Mode::Course, Mode::Testbed] {
            let (ctx, mut choice) = (egui::Context::default(), Show { mode, ..show.clone() });
            // sizes settle after a few frames
            for _ in 0..6 {
                let screen = egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(width, height));
                ctx.begin_pass(egui::RawInput { screen_rect: Some(screen), ..Default::default() });
                let keys = (&Bindings::default(), &mut Rebinding::default());
                window(&ctx, &mut choice, &mut Vec::new(), keys, Some(true));
                let _ = ctx.end_pass();
            }
            let place = ctx.memory(|memory| memory.area_rect(Id::new(TITLE))).ok_or("the menu is drawn")?;
            places.push((mode, place));
        }
        Ok(places)
    }

    /// Title, tabs and last row are visible; in a small window the list scrolls.
    #[test]
    fn the_menu_with_its_keys_fits_the_window() -> Result<(), Box<dyn std::error::Error>> {
        for (width, height) in [(1280.0, 720.0), (1000.0, 600.0), (727.0, 409.0)] {
            for (mode, place) in places(width, height)? {
                let inside = place.min.x >= 0.0 && place.min.y >= 0.0 && place.max.x <= width && place.max.y <= height;
                assert!(inside, "{mode:?} in {width} x {height}: {place:?}");
            }
        }
        // without scrolling
        let free = places(1280.0, 4000.0)?;
        for ((mode, whole), (_, shown)) in free.into_iter().zip(places(1280.0, 720.0)?) {
            assert!(
                whole.height() <= shown.height() + 1.0,
                "{mode:?}: {} of {} points",
                shown.height(),
                whole.height()
            );
        }
        Ok(())
    }
}
