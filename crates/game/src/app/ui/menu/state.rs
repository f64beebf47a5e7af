//! The open menus, their effect on time and keys, and the scenarios that they start.

use crate::app::input::actions::{Action, ActionPressed, KeysFor};
use crate::app::input::control::ControlSet;
use crate::app::input::read::ReadSet;
use crate::app::input::rebind::{RebindSet, Rebinding};
use crate::app::mode::AppSet;
use crate::app::stage::scenario::{LoadScenario, Scenario};
use crate::app::ui::menu::setup::Draft;
use crate::app::ui::question::{AtStake, Question, ReportSet};
use bevy::prelude::*;

/// A screen of the menus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Screen {
    /// The first thing that a player sees.
    Main,
    /// The game stands still.
    Pause,
    /// Mode, agent, policy, ground.
    Setup,
    /// Assault courses.
    Courses,
    /// Recordings.
    Replays,
    /// Settings.
    Settings,
    /// Keys and buttons.
    Keys,
}

impl Screen {
    /// All screens.
    pub const ALL: [Screen; 7] =
        [Screen::Main, Screen::Pause, Screen::Setup, Screen::Courses, Screen::Replays, Screen::Settings, Screen::Keys];
}

/// A window of a feature is open: buttons are for its items, and the menu key closes it.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Overlay(pub bool);

/// The open screens, each over the one before it.
#[derive(Resource, Default)]
pub struct Menu {
    pub(super) open: Vec<Screen>,
    /// The screen has just appeared.
    pub(super) fresh: bool,
    pub(super) draft: Option<Draft>,
    /// The recordings that a screen lists.
    pub(super) replays: Option<Vec<std::path::PathBuf>>,
    /// The scenario that waits for an answer.
    pub(super) asked: Option<Scenario>,
    /// The scenario that the next frame loads.
    started: Option<Scenario>,
    /// The menu has stopped time.
    holds: bool,
}

impl Menu {
    /// The screen on top.
    pub fn screen(&self) -> Option<Screen> {
        self.open.last().copied()
    }

    /// Whether a screen is open.
    pub fn is_open(&self) -> bool {
        !self.open.is_empty()
    }

    /// Opens a screen over the others. One that is already open comes to the top.
    pub fn show(&mut self, screen: Screen) {
        self.open.retain(|open| *open != screen);
        self.open.push(screen);
        self.enter();
    }

    /// Goes back to the screen below, or to the game.
    pub fn back(&mut self) {
        self.open.pop();
        self.enter();
    }

    /// Closes all screens.
    pub fn close(&mut self) {
        self.open.clear();
        self.enter();
    }

    /// Closes the menu, and loads a scenario in the next frame.
    pub fn start(&mut self, scenario: Scenario) {
        self.close();
        self.started = Some(scenario);
    }

    fn enter(&mut self) {
        (self.fresh, self.draft, self.replays) = (true, None, None);
    }
}

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Menu>()
        .init_resource::<Overlay>()
        .add_systems(
            PreUpdate,
            (report.in_set(ReportSet), cancel_rebinding.before(RebindSet).before(ReadSet), direct_keys.before(ReadSet)),
        )
        .add_systems(
            Update,
            (toggle, start.before(ControlSet), hold_time.after(toggle).after(ControlSet)).in_set(AppSet::Input),
        );
}

fn report(menu: Res<Menu>, mut at_stake: ResMut<AtStake>) {
    at_stake.menu = menu.is_open();
}

/// Only the screen of the keys binds any.
fn cancel_rebinding(menu: Res<Menu>, mut rebinding: ResMut<Rebinding>) {
    if menu.screen() != Some(Screen::Keys) && *rebinding != Rebinding::Idle {
        rebinding.cancel();
    }
}

/// A menu and a question have the keys and buttons.
fn direct_keys(menu: Res<Menu>, question: Res<Question>, overlay: Res<Overlay>, mut keys_for: ResMut<KeysFor>) {
    let wanted = match (question.0.is_some() || overlay.0, menu.is_open()) {
        (true, _) => KeysFor::Question,
        (false, true) => KeysFor::Menu,
        (false, false) => KeysFor::Game,
    };
    keys_for.set_if_neq(wanted);
}

/// The menu key pauses the game, and goes back in a menu.
fn toggle(mut actions: MessageReader<ActionPressed>, overlay: Res<Overlay>, mut menu: ResMut<Menu>) {
    for _ in actions.read().filter(|action| action.0 == Action::Menu && !overlay.0) {
        if menu.is_open() { menu.back() } else { menu.show(Screen::Pause) }
    }
}

/// Loads the scenario that the menu has started.
fn start(
    mut menu: ResMut<Menu>,
    mut scenario: ResMut<Scenario>,
    mut loads: MessageWriter<LoadScenario>,
    mut time: ResMut<Time<Virtual>>,
) {
    if menu.started.is_some()
        && let Some(started) = menu.started.take()
    {
        // new characters move at once
        time.unpause();
        menu.holds = false;
        *scenario = started;
        loads.write(LoadScenario);
    }
}

/// Time stands still while the pause menu is open. It goes on afterward, unless the player has paused it before.
fn hold_time(mut menu: ResMut<Menu>, mut time: ResMut<Time<Virtual>>) {
    let holds = menu.open.contains(&Screen::Pause);
    if holds && !time.is_paused() {
        time.pause();
        menu.holds = true;
    } else if !holds && menu.holds {
        time.unpause();
        menu.holds = false;
    }
}
