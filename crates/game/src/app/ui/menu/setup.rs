//! The screen that sets up a scenario: mode, agent, policy, ground, number of characters.

use crate::app::mode::Mode;
use crate::app::stage::clips::{choose_clip, clip_of};
use crate::app::stage::course::PlayerRole;
use crate::app::stage::policies::ShippedPolicies;
use crate::app::stage::scenario::{PolicySource, Scenario};
use crate::app::stage::selection::{fit_to_course, switch_mode};
use crate::app::ui::menu::window::Items;
use bevy_egui::egui::{self, ComboBox, RichText, Slider, Ui};
use bevy_marathon::Ground;
use marathon_envs::agents::marathon::marathon_man::clips;
use marathon_envs::agents::marathon::terrain::course::Kind;
use marathon_envs::options::Choice as _;
use marathon_envs::registry;
use std::path::PathBuf;

/// The selection on the screen, which *Start* loads.
pub struct Draft {
    /// The scenario.
    pub scenario: Scenario,
    /// Policies of runs in the current folder: file and name.
    runs: Vec<(PathBuf, String)>,
    /// The clip, and the scenario that it was looked up for: reading it from a policy's file takes time.
    clip: Option<(Scenario, Option<String>)>,
}

impl Draft {
    /// Begins with a scenario.
    pub fn new(scenario: Scenario) -> Self {
        Draft { runs: runs(&scenario.agent), scenario, clip: None }
    }

    /// The clip that the agent follows, if it follows any clip.
    fn clip(&mut self, shipped: &ShippedPolicies) -> Option<String> {
        let known = self.clip.take().filter(|(scenario, _)| *scenario == self.scenario);
        let known = known.unwrap_or_else(|| (self.scenario.clone(), clip_of(&self.scenario, shipped)));
        self.clip.insert(known).1.clone()
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

/// Draws the screen. Returns whether *Start* was clicked.
pub fn draw(ui: &mut Ui, items: &mut Items, draft: &mut Draft, shipped: &ShippedPolicies) -> bool {
    let before = draft.scenario.agent.clone();
    choose(ui, items, draft, shipped);
    if draft.scenario.agent != before {
        draft.runs = runs(&draft.scenario.agent);
        if matches!(draft.scenario.source, PolicySource::File(_)) {
            draft.scenario.source = PolicySource::Shipped;
        }
    }
    ui.add_space(8.0);
    items.button(ui, "Start").clicked()
}

fn choose(ui: &mut Ui, items: &mut Items, draft: &mut Draft, shipped: &ShippedPolicies) {
    // one function: a table of menu items
    ui.horizontal_wrapped(|ui| {
        for mode in Mode::IN_MENU {
            let label = RichText::new(mode.name()).size(15.0);
            if items.add(ui, egui::Button::selectable(draft.scenario.mode == mode, label)).clicked() {
                switch_mode(&mut draft.scenario, mode, shipped);
            }
        }
    });
    ui.separator();
    ui.label(RichText::new(draft.scenario.mode.goal()).weak());
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
                ui.horizontal_wrapped(|ui| {
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
