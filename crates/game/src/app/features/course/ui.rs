//! The panel of a course: distance, best run and names; and the list of the longest runs, which starts their replays.

use crate::app::error::GameError;
use crate::app::features::course::builder::{MOST_STEPS, Step};
use crate::app::features::course::leaderboard::{Course, KEPT, Place, Run, Table};
use crate::app::features::course::runs::{GATES, Runs, course, names};
use crate::app::input::actions::{Action, ActionPressed};
use crate::app::mode::{AppSet, Mode};
use crate::app::notifications::Notifications;
use crate::app::stage::actors::{Actor, Focus};
use crate::app::stage::course::PlayerRole;
use crate::app::stage::loaded::LoadedPolicy;
use crate::app::stage::recording::PlayRecording;
use crate::app::stage::scenario::{LoadScenario, Scenario};
use crate::app::ui::menu::state::Overlay;
use crate::app::ui::theme::{ACCENT, BAD, FAINT, Hud, TEXT, UiSet, line, panel, text};
use bevy::prelude::*;
use bevy_egui::egui::{self, Align2, Ui};
use bevy_egui::{EguiContexts, EguiPrimaryContextPass};
use bevy_marathon::Episode;

/// Keys that start the replay of the first, the second and so on of the course, while the list is open.
const PLACES: [KeyCode; 9] = [
    KeyCode::Digit1,
    KeyCode::Digit2,
    KeyCode::Digit3,
    KeyCode::Digit4,
    KeyCode::Digit5,
    KeyCode::Digit6,
    KeyCode::Digit7,
    KeyCode::Digit8,
    KeyCode::Digit9,
];

/// The list of the longest runs.
#[derive(Resource, Default)]
pub struct List {
    /// Whether it is open.
    pub open: bool,
    /// The courses, each with its longest runs. The course of the scenario is the first.
    pub courses: Vec<(Course, Vec<Run>)>,
}

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<List>()
        .add_systems(Update, control.in_set(AppSet::Input))
        .add_systems(PreUpdate, |list: Res<List>, mut overlay: ResMut<Overlay>| {
            overlay.set_if_neq(Overlay(list.open));
        })
        .add_systems(
            Update,
            close.run_if(on_message::<LoadScenario>).run_if(in_state(Mode::Replay)).in_set(AppSet::Present),
        )
        .add_systems(
            EguiPrimaryContextPass,
            (
                draw.run_if(in_state(Mode::Course)).in_set(UiSet::Panels),
                // below the menus
                draw_list.in_set(UiSet::Panels),
            ),
        );
}

impl List {
    fn read(&mut self, runs: &Runs, scenario: &Scenario) -> Result<(), GameError> {
        self.courses.clear();
        let path = runs.path()?;
        if !path.exists() {
            return Ok(());
        }
        let table = Table::open(&path)?;
        let here = course(scenario);
        let mut courses = table.courses()?;
        courses.sort_by_key(|course| *course != here);
        for course in courses {
            let longest = table.longest(&course, KEPT)?;
            self.courses.push((course, longest));
        }
        Ok(())
    }
}

/// Opens and closes the list. Keys start a replay.
fn control(
    mut actions: MessageReader<ActionPressed>,
    keys: Res<ButtonInput<KeyCode>>,
    (scenario, runs): (Res<Scenario>, Res<Runs>),
    mut list: ResMut<List>,
    mut replays: MessageWriter<PlayRecording>,
    mut notes: ResMut<Notifications>,
) {
    let mut closed = false;
    for ActionPressed(action) in actions.read() {
        closed |= *action == Action::Menu;
        if *action != Action::Runs {
            continue;
        }
        list.open = !list.open;
        if list.open
            && let Err(error) = list.read(&runs, &scenario)
        {
            list.open = false;
            notes.error(error.to_string());
        }
    }
    if list.open && closed {
        list.open = false;
    }
    let place = PLACES.iter().position(|key| keys.just_pressed(*key)).filter(|_| list.open);
    if let Some(place) = place {
        let here = course(&scenario);
        let longest = list.courses.iter().find(|(course, _)| *course == here).map_or(&[][..], |(_, longest)| longest);
        let replay = longest.get(place).and_then(|run| run.replay.clone());
        match replay {
            Some(replay) => {
                replays.write(PlayRecording(replay));
            }
            None => notes.say(format!("no run has place {}", place + 1)),
        }
    }
}

/// A replay closes the list.
fn close(mut list: ResMut<List>) {
    list.open = false;
}

/// Draws the panel.
fn draw(
    mut contexts: EguiContexts,
    (hud, scenario, loaded): (Res<Hud>, Res<Scenario>, Res<LoadedPolicy>),
    (runs, step, focus): (Res<Runs>, Res<Step>, Res<Focus>),
    actors: Query<(Entity, &Actor, &Episode)>,
) -> Result {
    if !hud.on {
        return Ok(());
    }
    let Some((ragdoll, _, episode)) = actors.iter().find(|(_, actor, _)| actor.0 == focus.0) else { return Ok(()) };
    let ctx = contexts.ctx_mut()?.clone();
    panel(&ctx, false, |ui| {
        let course = course(&scenario);
        ui.horizontal(|ui| {
            ui.label(text(15.0, TEXT, &course.kind).strong());
            ui.label(text(13.0, FAINT, format!("difficulty {}   seed {}", course.difficulty, scenario.seed)));
        });
        ui.horizontal(|ui| {
            // rounded first: there is no -0.0 m
            ui.label(text(30.0, TEXT, format!("{:.1}", (episode.farthest * 10.0).round() / 10.0 + 0.0)).strong());
            ui.label(text(14.0, FAINT, "m"));
            if let Some(standing) = &runs.standing {
                ui.add_space(8.0);
                ui.label(text(30.0, ACCENT, format!("{:.1}", standing.longest)).strong());
                ui.label(text(14.0, FAINT, "m   best"));
            }
        });
        if !scenario.is_built() {
            times(ui, episode, runs.gates(ragdoll), runs.standing.and_then(|standing| standing.fastest));
        }
        let [runner, builder] = names(&scenario, &loaded, runs.player());
        line(ui, text(13.0, FAINT, format!("runs: {runner}")));
        if builder != "seed" {
            line(ui, text(13.0, FAINT, format!("builds: {builder}")));
        }
        if scenario.is_built() {
            let height = 0.1 * f64::from(step.0) * scenario.course.difficulty;
            let words =
                format!("next meter: {height:+.2} m   step {:+} of {MOST_STEPS}", step.0).replace('-', "\u{2212}");
            line(ui, text(15.0, ACCENT, words));
        }
        if let Some((run, place)) = &runs.last {
            let color = if place.rank == 1 { ACCENT } else { TEXT };
            let Run { distance, seconds, ended, course, .. } = run;
            let Place { rank, of, shortest, .. } = place;
            // the builder looks for the shortest run
            let least = course.role == PlayerRole::Build.name() && distance <= shortest && *of > 1;
            let least = if least { ", the shortest" } else { "" };
            let words = format!("last: {distance:.1} m, {seconds:.1} s, {ended}: place {rank} of {of}{least}");
            line(ui, text(13.0, color, words));
        }
    });
    Ok(())
}

/// The time of the run, the checkpoints that it has passed, and the best time.
fn times(ui: &mut Ui, episode: &Episode, gates: &[f64], fastest: Option<f64>) {
    ui.horizontal(|ui| {
        ui.label(text(20.0, TEXT, format!("{:.1}", episode.seconds)).strong());
        ui.label(text(14.0, FAINT, "s"));
        if let Some(fastest) = fastest {
            ui.add_space(8.0);
            ui.label(text(20.0, ACCENT, format!("{fastest:.1}")).strong());
            ui.label(text(14.0, FAINT, "s   best time"));
        }
    });
    let next = match GATES.get(gates.len()) {
        Some(gate) if gates.len() + 1 == GATES.len() => format!("finish at {gate:.0} m"),
        Some(gate) => format!("checkpoint {} of {} at {gate:.0} m", gates.len() + 1, GATES.len() - 1),
        None => "finished".into(),
    };
    let last = gates.last().map(|at| format!("   last one after {at:.1} s")).unwrap_or_default();
    line(ui, text(13.0, TEXT, format!("{next}{last}")));
}

/// Draws the list.
fn draw_list(mut contexts: EguiContexts, mut list: ResMut<List>, mut replays: MessageWriter<PlayRecording>) -> Result {
    if !list.open {
        return Ok(());
    }
    let ctx = contexts.ctx_mut()?.clone();
    let (mut open, mut wanted) = (true, None);
    egui::Window::new("Longest runs")
        .anchor(Align2::CENTER_CENTER, [0.0, 0.0])
        .collapsible(false)
        .resizable(false)
        .open(&mut open)
        .show(&ctx, |ui| {
            ui.set_width(640.0);
            if list.courses.is_empty() {
                ui.label(text(14.0, FAINT, "no runs yet"));
            }
            let height = 0.6 * ctx.content_rect().height();
            egui::ScrollArea::vertical().max_height(height).show(ui, |ui| {
                for (number, (course, longest)) in list.courses.iter().enumerate() {
                    let Course { agent, kind, difficulty, role } = course;
                    ui.horizontal(|ui| {
                        ui.label(text(15.0, TEXT, agent).strong());
                        ui.label(text(13.0, ACCENT, format!("{kind}   difficulty {difficulty}")));
                        ui.label(text(13.0, FAINT, role));
                    });
                    egui::Grid::new(("runs", number)).num_columns(8).spacing([14.0, 3.0]).show(ui, |ui| {
                        for (i, run) in longest.iter().enumerate() {
                            if row(ui, i + 1, run) {
                                wanted.clone_from(&run.replay);
                            }
                            ui.end_row();
                        }
                    });
                    ui.add_space(8.0);
                }
            });
        });
    list.open = open;
    replays.write_batch(wanted.map(PlayRecording));
    Ok(())
}

/// A run in the list. Returns whether its replay is wanted.
fn row(ui: &mut Ui, place: usize, run: &Run) -> bool {
    ui.label(text(13.0, if place == 1 { ACCENT } else { FAINT }, format!("{place}")));
    ui.label(text(13.0, TEXT, format!("{:.2} m", run.distance)).strong());
    let slow = if run.slowest < 1.0 { format!("   x{}", run.slowest) } else { String::new() };
    ui.label(text(13.0, FAINT, format!("{:.1} s{slow}", run.seconds)));
    ui.label(text(13.0, if run.ended == "fell" { BAD } else { FAINT }, &run.ended));
    let names =
        if run.builder == "seed" { run.runner.clone() } else { format!("{} against {}", run.builder, run.runner) };
    ui.label(text(13.0, TEXT, names));
    ui.label(text(13.0, FAINT, format!("seed {}", run.draw[0])));
    ui.label(text(12.0, FAINT, run.date.get(..10).unwrap_or_default()));
    run.replay.is_some() && ui.button("replay").clicked()
}
