//! The menu: mode, agent, policy, number of characters, keys.

use crate::app::input::actions::{Action, ActionPressed};
use crate::app::input::bindings::{self, Bindings, Rebinding, keep};
use crate::app::input::control::ControlSet;
use crate::app::mode::{AppSet, Mode};
use crate::app::stage::clips::{choose_clip, clip_of};
use crate::app::stage::course::PlayerRole;
use crate::app::stage::policies::ShippedPolicies;
use crate::app::stage::scenario::{LoadScenario, PolicySource, Scenario};
use crate::app::stage::selection::{fit_to_course, switch_mode};
use crate::app::ui::question::{self, Asked, AtStake, Question, ReportSet, StartConfirmed};
use crate::app::ui::theme::UiSet;
use bevy::prelude::*;
use bevy_egui::egui::{self, Align2, ComboBox, Id, RichText, Slider, Ui};
use bevy_egui::{EguiContexts, EguiPrimaryContextPass};
use bevy_marathon::Ground;
use marathon_envs::agents::marathon::marathon_man::clips;
use marathon_envs::agents::marathon::terrain::course::Kind;
use marathon_envs::options::Choice as _;
use marathon_envs::registry;
use std::path::PathBuf;

/// Title of the menu's window.
const TITLE: &str = "Marathon";
/// Width of the menu, and the free space beside and above it, points.
const WIDTH: f32 = 560.0;
const MARGIN: f32 = 70.0;

/// The menu.
#[derive(Resource, Default)]
pub struct Menu {
    /// Whether it is open.
    pub open: bool,
    draft: Option<Draft>,
    /// The scenario that the next frame loads.
    started: Option<Scenario>,
}

impl Menu {
    /// Opens or closes the menu.
    pub fn toggle(&mut self) {
        self.open = !self.open;
        self.draft = None;
    }

    /// Closes the menu, and loads a scenario in the next frame.
    pub fn start(&mut self, scenario: Scenario) {
        *self = Menu { started: Some(scenario), ..Menu::default() };
    }
}

/// The selection in the menu, which *Start* loads.
struct Draft {
    scenario: Scenario,
    /// Policies of runs in the current folder: file and name.
    runs: Vec<(PathBuf, String)>,
    /// The clip, and the scenario that it was looked up for: reading it from a policy's file takes time.
    clip: Option<(Scenario, Option<String>)>,
}

impl Draft {
    fn new(scenario: Scenario) -> Self {
        Draft { runs: runs(&scenario.agent), scenario, clip: None }
    }

    /// The clip that the agent follows, if it follows any clip.
    fn clip(&mut self, shipped: &ShippedPolicies) -> Option<String> {
        let known = self.clip.take().filter(|(scenario, _)| *scenario == self.scenario);
        let known = known.unwrap_or_else(|| (self.scenario.clone(), clip_of(&self.scenario, shipped)));
        self.clip.insert(known).1.clone()
    }
}

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Menu>()
        .add_systems(
            PreUpdate,
            (report.in_set(ReportSet), cancel_rebinding.after(bindings::read).before(bindings::rebind)),
        )
        .add_systems(Update, (toggle, start.before(ControlSet)).in_set(AppSet::Input))
        .add_systems(EguiPrimaryContextPass, draw.in_set(UiSet::Windows).before(question::draw));
}

fn report(menu: Res<Menu>, mut at_stake: ResMut<AtStake>) {
    at_stake.menu = menu.open;
}

/// A closed menu binds no key.
fn cancel_rebinding(menu: Res<Menu>, mut rebinding: ResMut<Rebinding>) {
    if !menu.open && rebinding.0.is_some() {
        rebinding.0 = None;
    }
}

fn toggle(mut actions: MessageReader<ActionPressed>, mut menu: ResMut<Menu>) {
    for _ in actions.read().filter(|action| action.0 == Action::Menu) {
        menu.toggle();
    }
}

/// Loads the scenario that the menu has started.
fn start(mut menu: ResMut<Menu>, mut scenario: ResMut<Scenario>, mut loads: MessageWriter<LoadScenario>) {
    if menu.started.is_some()
        && let Some(started) = menu.started.take()
    {
        *scenario = started;
        loads.write(LoadScenario);
    }
}

/// Policies of the runs for an agent in the current folder.
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
#[expect(clippy::too_many_arguments, reason = "a system names what it uses")]
pub fn draw(
    mut contexts: EguiContexts,
    mut menu: ResMut<Menu>,
    (scenario, shipped): (Res<Scenario>, Res<ShippedPolicies>),
    mut bindings: ResMut<Bindings>,
    mut rebinding: ResMut<Rebinding>,
    mut exit: MessageWriter<AppExit>,
    (at_stake, mut question): (Res<AtStake>, ResMut<Question>),
    mut confirmations: MessageReader<StartConfirmed>,
) -> Result {
    let confirmed = confirmations.read().count() > 0;
    if !menu.open {
        return Ok(());
    }
    let ctx = contexts.ctx_mut()?.clone();
    let mut draft = menu.draft.take().unwrap_or_else(|| Draft::new(scenario.clone()));
    let Picked { mut start, quit, reset, open } =
        window(&ctx, &mut draft, &shipped, (&bindings, &mut *rebinding), None);
    if reset {
        *bindings = Bindings::default();
        keep(&bindings);
    }
    if quit {
        match at_stake.at_the_end() {
            Some(text) => question.0 = Some((Asked::Action(Action::Quit), text)),
            None => {
                exit.write(AppExit::Success);
            }
        }
    }
    if let Some(text) = at_stake.at_a_start().filter(|_| start && !confirmed) {
        question.0 = Some((Asked::Start, text));
        start = false;
    }
    if start || confirmed {
        menu.start(draft.scenario);
    } else {
        menu.open = open;
        menu.draft = Some(draft).filter(|_| open);
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
    draft: &mut Draft,
    shipped: &ShippedPolicies,
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
            egui::ScrollArea::vertical().max_height(room.y).show(ui, |ui| {
                let before = draft.scenario.agent.clone();
                choose(ui, draft, shipped);
                if draft.scenario.agent != before {
                    draft.runs = runs(&draft.scenario.agent);
                    if matches!(draft.scenario.source, PolicySource::File(_)) {
                        draft.scenario.source = PolicySource::Shipped;
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

fn choose(ui: &mut Ui, draft: &mut Draft, shipped: &ShippedPolicies) {
    // one function: a table of menu items
    ui.horizontal(|ui| {
        for mode in Mode::IN_MENU {
            let label = RichText::new(mode.name()).size(15.0);
            if ui.selectable_label(draft.scenario.mode == mode, label).clicked() {
                switch_mode(&mut draft.scenario, mode, shipped);
            }
        }
    });
    ui.separator();
    egui::Grid::new("choice").num_columns(2).spacing([16.0, 8.0]).show(ui, |ui| {
        ui.label("Agent");
        let choice = &mut draft.scenario;
        ComboBox::from_id_salt("agent").selected_text(choice.agent.as_str()).width(230.0).show_ui(ui, |ui| {
            for id in registry::ids() {
                let summary = registry::agent(&id).map(|a| a.facts().summary).unwrap_or_default();
                ui.selectable_value(&mut choice.agent, id.clone(), id).on_hover_text(summary);
            }
        });
        ui.end_row();
        let clip = draft.clip(shipped).filter(|_| draft.scenario.mode != Mode::Testbed);
        let choice = &mut draft.scenario;
        if let Some(clip) = clip {
            ui.label("Clip");
            let mut wanted = clip.clone();
            ComboBox::from_id_salt("clip").selected_text(clip.as_str()).width(230.0).show_ui(ui, |ui| {
                let chosen = Some(clip.as_str()).filter(|name| name.ends_with(".motion"));
                for name in clips::names().into_iter().chain(chosen) {
                    ui.selectable_value(&mut wanted, name.into(), name);
                }
            });
            if wanted != clip {
                choose_clip(choice, &wanted);
            }
            ui.end_row();
        }
        if choice.mode == Mode::Course {
            course_rows(ui, choice, shipped);
        }
        if matches!(choice.mode, Mode::Watch | Mode::Push | Mode::Imitate | Mode::Course) {
            ui.label("Policy");
            let name = |source: &PolicySource| match source {
                PolicySource::Shipped => "the one that comes with it".to_string(),
                PolicySource::File(file) => file.display().to_string(),
                PolicySource::Trainer => "being learned".into(),
                PolicySource::Nothing => "none: let it fall".into(),
            };
            let mut wanted = choice.source.clone();
            ComboBox::from_id_salt("policy").selected_text(name(&choice.source)).width(230.0).show_ui(ui, |ui| {
                for source in [PolicySource::Shipped, PolicySource::Nothing] {
                    let label = name(&source);
                    ui.selectable_value(&mut wanted, source, label);
                }
                for (file, label) in &draft.runs {
                    ui.selectable_value(&mut wanted, PolicySource::File(file.clone()), label);
                }
            });
            if wanted != choice.source {
                choice.play(wanted, shipped);
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

/// The rows of an assault course.
fn course_rows(ui: &mut Ui, choice: &mut Scenario, shipped: &ShippedPolicies) {
    ui.label("You");
    ui.horizontal(|ui| {
        let before = choice.course.role;
        for role in PlayerRole::ALL {
            ui.selectable_value(&mut choice.course.role, role, role.name());
        }
        if choice.course.role != before {
            fit_to_course(choice, shipped);
        }
    });
    ui.end_row();
    if choice.course.role != PlayerRole::Build {
        ui.label("Course");
        ComboBox::from_id_salt("course").selected_text(choice.course.kind.as_str()).width(230.0).show_ui(ui, |ui| {
            for (_, name) in Kind::NAMED {
                ui.selectable_value(&mut choice.course.kind, (*name).to_string(), *name);
            }
        });
        ui.end_row();
    }
    ui.label("Difficulty");
    ui.add(Slider::new(&mut choice.course.difficulty, 0.0..=1.0).step_by(0.05));
    ui.end_row();
}

/// Shows the keys, which a click changes. Returns whether to reset all keys.
fn keys(ui: &mut Ui, bindings: &Bindings, rebinding: &mut Rebinding) -> bool {
    // two columns, so that all keys fit a window
    let rows: Vec<_> = bindings.rows().collect();
    let half = rows.len().div_ceil(2);
    egui::Grid::new("bindings").num_columns(6).spacing([14.0, 4.0]).show(ui, |ui| {
        for (i, first) in rows[..half].iter().enumerate() {
            for (action, name, key, button) in [Some(first), rows.get(half + i)].into_iter().flatten() {
                ui.label(*name);
                let waits = rebinding.0 == Some(*action);
                if ui.button(if waits { "press a key" } else { key }).clicked() {
                    rebinding.0 = if waits { None } else { Some(*action) };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::cli::{self, Args};
    use clap::Parser;

    /// The menu's position with all keys, in a window of the given size, for each mode.
    fn places(width: f32, height: f32) -> Result<Vec<(Mode, egui::Rect)>, Box<dyn std::error::Error>> {
        let shipped = ShippedPolicies::decode();
        let scenario = cli::scenario(&Args::parse_from(["marathon-game"]), &shipped)?;
        let mut places = Vec::new();
        for mode in [Mode::Watch, Mode::Imitate, Mode::Course, Mode::Testbed] {
            let ctx = egui::Context::default();
            let mut draft = Draft::new(Scenario { mode, ..scenario.clone() });
            // sizes settle after a few frames
            for _ in 0..6 {
                let screen = egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(width, height));
                ctx.begin_pass(egui::RawInput { screen_rect: Some(screen), ..Default::default() });
                let keys = (&Bindings::default(), &mut Rebinding::default());
                window(&ctx, &mut draft, &shipped, keys, Some(true));
                // nothing is drawn
                ctx.end_pass().textures_delta.clear();
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
