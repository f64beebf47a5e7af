//! Draws the screen on top, and does what the player chooses there.

use crate::app::input::actions::{Action, ActionRequested};
use crate::app::input::bindings::Bindings;
use crate::app::input::device::DeviceInUse;
use crate::app::input::rebind::Rebinding;
use crate::app::settings::resolution::ShowSet;
use crate::app::settings::values::Settings;
use crate::app::stage::policies::ShippedPolicies;
use crate::app::stage::recording::PlayRecording;
use crate::app::stage::scenario::Scenario;
use crate::app::ui::menu::choice::Choice;
use crate::app::ui::menu::pictures::Pictures;
use crate::app::ui::menu::setup::Draft;
use crate::app::ui::menu::state::{Menu, Screen};
use crate::app::ui::menu::window::Items;
use crate::app::ui::menu::{courses, home, keys, options, replays, setup, window};
use crate::app::ui::question::{self, Asked, AtStake, Question, StartConfirmed};
use crate::app::ui::theme::UiSet;
use bevy::ecs::system::SystemParam;
use bevy::prelude::*;
use bevy_egui::egui::{self, Color32};
use bevy_egui::{EguiContexts, EguiPrimaryContextPass};

/// Widths of the screens, points.
const WIDTHS: [f32; 2] = [660.0, 580.0];

pub(super) fn plugin(app: &mut App) {
    app.add_systems(EguiPrimaryContextPass, draw.in_set(UiSet::Windows).after(ShowSet).before(question::draw));
}

/// The resources and messages that choices change.
#[derive(SystemParam)]
struct Effects<'w> {
    question: ResMut<'w, Question>,
    at_stake: Res<'w, AtStake>,
    exit: MessageWriter<'w, AppExit>,
    replays: MessageWriter<'w, PlayRecording>,
    requests: MessageWriter<'w, ActionRequested>,
}

impl Effects<'_> {
    fn apply(&mut self, menu: &mut Menu, choice: Choice) {
        match choice {
            Choice::Stay => {}
            Choice::Show(screen) => menu.show(screen),
            Choice::Back => menu.back(),
            Choice::Close => menu.close(),
            Choice::Start(scenario) => match self.at_stake.at_a_start() {
                Some(text) => {
                    menu.asked = Some(scenario);
                    self.question.0 = Some((Asked::Start, text));
                }
                None => menu.start(scenario),
            },
            Choice::Replay(path) => {
                menu.close();
                self.replays.write(PlayRecording(path));
            }
            Choice::Do(action) => {
                menu.close();
                self.requests.write(ActionRequested(action));
            }
            Choice::Quit => match self.at_stake.at_the_end() {
                Some(text) => self.question.0 = Some((Asked::Action(Action::Quit), text)),
                None => drop(self.exit.write(AppExit::Success)),
            },
        }
    }
}

/// Draws the screen on top.
#[expect(clippy::too_many_arguments, reason = "a system names what it uses")]
fn draw(
    mut contexts: EguiContexts,
    mut menu: ResMut<Menu>,
    (scenario, shipped): (Res<Scenario>, Res<ShippedPolicies>),
    (mut bindings, mut rebinding): (ResMut<Bindings>, ResMut<Rebinding>),
    mut settings: ResMut<Settings>,
    (device, mut pictures): (Res<DeviceInUse>, ResMut<Pictures>),
    mut confirmations: MessageReader<StartConfirmed>,
    mut effects: Effects<'_>,
) -> Result {
    let confirmed = confirmations.read().count() > 0;
    if confirmed && let Some(scenario) = menu.asked.take() {
        menu.start(scenario);
    }
    let Some(screen) = menu.screen() else { return Ok(()) };
    let ctx = contexts.ctx_mut()?.clone();
    dim(&ctx);
    let mut items = Items { fresh: std::mem::take(&mut menu.fresh) && effects.question.0.is_none() };
    let mut choice = Choice::Stay;
    let (title, width) = match screen {
        Screen::Main => ("Marathon", WIDTHS[0]),
        Screen::Pause => ("Paused", 260.0),
        Screen::Setup => ("Change the scene", WIDTHS[1]),
        Screen::Courses => ("Courses", WIDTHS[1]),
        Screen::Replays => ("Replays", WIDTHS[1]),
        Screen::Settings => ("Settings", WIDTHS[1]),
        Screen::Keys => ("Keys and buttons", WIDTHS[1]),
    };
    window::show(&ctx, title, width, |ui| {
        choice = match screen {
            Screen::Main => home::main(ui, &mut items, &mut pictures, &scenario, &shipped),
            Screen::Pause => home::pause(ui, &mut items),
            Screen::Setup => {
                let draft = menu.draft.get_or_insert_with(|| Draft::new(scenario.clone()));
                match setup::draw(ui, &mut items, draft, &shipped) {
                    true => Choice::Start(draft.scenario.clone()),
                    false => Choice::Stay,
                }
            }
            Screen::Courses => {
                let draft = menu.draft.get_or_insert_with(|| Draft::new(courses::first(&scenario, &shipped)));
                courses::draw(ui, &mut items, &mut draft.scenario, &shipped)
            }
            Screen::Replays => replays::draw(ui, &mut items, menu.replays.get_or_insert_with(replays::list)),
            Screen::Settings => options::draw(ui, &mut items, &mut settings),
            Screen::Keys => keys::draw(ui, &mut items, &mut bindings, &mut rebinding, device.device),
        };
        if !matches!(screen, Screen::Main | Screen::Pause) {
            ui.add_space(6.0);
            if items.button(ui, "Back").clicked() {
                choice = Choice::Back;
            }
        }
    });
    if screen == Screen::Keys {
        keys::draw_conflict(&ctx, &mut bindings, &mut rebinding);
    }
    effects.apply(&mut menu, choice);
    Ok(())
}

/// Darkens the picture behind a menu.
fn dim(ctx: &egui::Context) {
    ctx.layer_painter(egui::LayerId::background()).rect_filled(ctx.content_rect(), 0.0, Color32::from_black_alpha(110));
}
