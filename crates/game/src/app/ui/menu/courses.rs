//! The screen of the assault courses: role, kind, difficulty.

use crate::app::input::actions::Action;
use crate::app::mode::Mode;
use crate::app::stage::course::PlayerRole;
use crate::app::stage::policies::ShippedPolicies;
use crate::app::stage::scenario::Scenario;
use crate::app::stage::selection::{fit_to_course, fresh_start};
use crate::app::ui::menu::choice::Choice;
use crate::app::ui::menu::window::Items;
use crate::app::ui::theme::{FAINT, text};
use bevy_egui::egui::{Button, RichText, Slider, Ui};
use marathon_envs::agents::marathon::terrain::course::Kind;
use marathon_envs::options::Choice as _;

/// The roles in the words of the screen.
const ROLES: [(PlayerRole, &str); 3] =
    [(PlayerRole::Run, "Run it"), (PlayerRole::Watch, "Watch a run"), (PlayerRole::Build, "Build it")];

/// The selection that the screen begins with: that of the scenario, if it is a course.
pub fn first(scenario: &Scenario, shipped: &ShippedPolicies) -> Scenario {
    if scenario.mode == Mode::Course { scenario.clone() } else { fresh_start(scenario, Mode::Course, shipped) }
}

/// Draws the screen.
pub fn draw(ui: &mut Ui, items: &mut Items, choice: &mut Scenario, shipped: &ShippedPolicies) -> Choice {
    let label = |words: &str| RichText::new(words).size(15.0);
    ui.horizontal_wrapped(|ui| {
        for (role, name) in ROLES {
            if items.add(ui, Button::selectable(choice.course.role == role, label(name))).clicked() {
                choice.course.role = role;
                fit_to_course(choice, shipped);
            }
        }
    });
    ui.label(text(13.0, FAINT, choice.course.role.goal()));
    ui.separator();
    if choice.course.role != PlayerRole::Build {
        ui.horizontal_wrapped(|ui| {
            for (_, name) in Kind::NAMED {
                let selected = choice.course.kind == *name;
                if items.add(ui, Button::selectable(selected, label(name))).clicked() {
                    choice.course.kind = (*name).to_string();
                }
            }
        });
    }
    ui.horizontal_wrapped(|ui| {
        ui.label("Difficulty");
        items.add(ui, Slider::new(&mut choice.course.difficulty, 0.0..=1.0).step_by(0.05));
    });
    ui.label(text(12.0, FAINT, format!("Runner: {}", choice.agent)));
    ui.add_space(6.0);
    let mut chosen = Choice::Stay;
    ui.horizontal_wrapped(|ui| {
        if items.button(ui, "Start").clicked() {
            chosen = Choice::Start(choice.clone());
        }
        if items.button(ui, "Longest runs").clicked() {
            chosen = Choice::Do(Action::Runs);
        }
    });
    chosen
}
