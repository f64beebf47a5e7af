//! What the screen tells of runs: a card with the way, the best one and who runs, and the list of the longest, which starts
//! their replays.

use crate::app::args::Mode;
use crate::app::course::builder::{MOST_STEPS, Step, builds};
use crate::app::course::choice::Part;
use crate::app::course::runs::{Runs, course, who};
use crate::app::course::table::{Course, KEPT, Place, Run, Table};
use crate::app::hud::{ACCENT, BAD, FAINT, Hud, TEXT, card as frame, line, text};
use crate::app::keys::{Deed, Do};
use crate::app::notes::Notes;
use crate::app::recording::Recording;
use crate::app::replay::Playback;
use crate::app::show::{Actor, Focus, Script, Show};
use crate::ragdoll::Episode;
use bevy::prelude::*;
use bevy_egui::EguiContexts;
use bevy_egui::egui::{self, Align2, Area, Id, Ui};
use std::path::{Path, PathBuf};

/// Keys that start the replay of the first, the second and so on of the course on stage, while the list is open.
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
    /// It is open.
    pub open: bool,
    /// The courses, that on stage first, each with its longest runs.
    pub courses: Vec<(Course, Vec<Run>)>,
    /// Replay that is to be shown.
    wanted: Option<PathBuf>,
}

impl List {
    /// Shows a replay.
    pub fn play(&mut self, replay: &Path) {
        self.wanted = Some(replay.into());
    }

    fn read(&mut self, runs: &Runs, show: &Show) -> Result<(), crate::app::GameError> {
        self.courses.clear();
        let path = runs.path()?;
        if !path.exists() {
            return Ok(());
        }
        let table = Table::open(&path)?;
        let here = course(show);
        let mut courses = table.courses()?;
        courses.sort_by_key(|course| *course != here);
        for course in courses {
            let longest = table.longest(&course, KEPT)?;
            self.courses.push((course, longest));
        }
        Ok(())
    }
}

/// Opens and closes the list, and takes in keys that choose a replay.
pub fn obey(
    mut deeds: MessageReader<Do>,
    keys: Res<ButtonInput<KeyCode>>,
    (show, runs): (Res<Show>, Res<Runs>),
    mut list: ResMut<List>,
    mut notes: ResMut<Notes>,
) {
    for _ in deeds.read().filter(|deed| deed.0 == Deed::Runs) {
        list.open = !list.open;
        if list.open
            && let Err(error) = list.read(&runs, &show)
        {
            list.open = false;
            notes.error(error.to_string());
        }
    }
    let place = PLACES.iter().position(|key| keys.just_pressed(*key)).filter(|_| list.open);
    if let Some(place) = place {
        let here = course(&show);
        let longest = list.courses.iter().find(|(course, _)| *course == here).map_or(&[][..], |(_, longest)| longest);
        let replay = longest.get(place).and_then(|run| run.replay.clone());
        match replay {
            Some(replay) => list.play(&replay),
            None => notes.say(format!("no run has place {}", place + 1)),
        }
    }
}

/// Starts the replay that is wanted.
pub fn play(mut commands: Commands, mut list: ResMut<List>, mut show: ResMut<Show>, mut notes: ResMut<Notes>) {
    let Some(path) = list.wanted.take() else { return };
    let playback = Recording::load(&path).and_then(|recording| {
        let (agent, agents) = (recording.setting.agent.clone(), recording.agents);
        Ok((agent, agents, Playback::new(recording)?))
    });
    match playback {
        Ok((agent, agents, playback)) => {
            commands.insert_resource(playback);
            (show.mode, show.agent, show.agents) = (Mode::Replay, agent, agents);
            show.again();
            list.open = false;
        }
        Err(error) => notes.error(error.to_string()),
    }
}

/// Draws the card.
pub fn card(
    mut contexts: EguiContexts,
    (hud, show, script): (Res<Hud>, Res<Show>, Res<Script>),
    (runs, step, focus): (Res<Runs>, Res<Step>, Res<Focus>),
    actors: Query<(&Actor, &Episode)>,
) -> Result {
    if !hud.on || show.mode != Mode::Course {
        return Ok(());
    }
    let Some((_, episode)) = actors.iter().find(|(actor, _)| actor.0 == focus.0) else { return Ok(()) };
    let ctx = contexts.ctx_mut()?.clone();
    Area::new(Id::new("course")).anchor(Align2::RIGHT_TOP, [-14.0, 14.0]).interactable(false).show(&ctx, |ui| {
        frame().show(ui, |ui| {
            let course = course(&show);
            ui.horizontal(|ui| {
                ui.label(text(15.0, TEXT, &course.kind).strong());
                ui.label(text(13.0, FAINT, format!("difficulty {}   seed {}", course.difficulty, show.seed)));
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
            let [runner, builder] = who(&show, &script, runs.player());
            line(ui, text(13.0, FAINT, format!("runs: {runner}")));
            if builder != "seed" {
                line(ui, text(13.0, FAINT, format!("builds: {builder}")));
            }
            if builds(&show) {
                let height = 0.1 * f64::from(step.0) * show.course.difficulty;
                let told =
                    format!("next meter: {height:+.2} m   step {:+} of {MOST_STEPS}", step.0).replace('-', "\u{2212}");
                line(ui, text(15.0, ACCENT, told));
            }
            if let Some((run, place)) = &runs.last {
                let color = if place.rank == 1 { ACCENT } else { TEXT };
                let Run { distance, seconds, ended, course, .. } = run;
                let Place { rank, of, shortest, .. } = place;
                // what who builds is after
                let least = course.part == Part::Build.name() && distance <= shortest && *of > 1;
                let least = if least { ", the shortest" } else { "" };
                let told = format!("last: {distance:.1} m, {seconds:.1} s, {ended}: place {rank} of {of}{least}");
                line(ui, text(13.0, color, told));
            }
        });
    });
    Ok(())
}

/// Draws the list.
pub fn list(mut contexts: EguiContexts, mut list: ResMut<List>) -> Result {
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
                    let Course { agent, kind, difficulty, part } = course;
                    ui.horizontal(|ui| {
                        ui.label(text(15.0, TEXT, agent).strong());
                        ui.label(text(13.0, ACCENT, format!("{kind}   difficulty {difficulty}")));
                        ui.label(text(13.0, FAINT, part));
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
    if wanted.is_some() {
        list.wanted = wanted;
    }
    Ok(())
}

/// A run in the list. Returns whether its replay is wanted.
fn row(ui: &mut Ui, place: usize, run: &Run) -> bool {
    ui.label(text(13.0, if place == 1 { ACCENT } else { FAINT }, format!("{place}")));
    ui.label(text(13.0, TEXT, format!("{:.2} m", run.distance)).strong());
    let slow = if run.slowest < 1.0 { format!("   x{}", run.slowest) } else { String::new() };
    ui.label(text(13.0, FAINT, format!("{:.1} s{slow}", run.seconds)));
    ui.label(text(13.0, if run.ended == "fell" { BAD } else { FAINT }, &run.ended));
    let who =
        if run.builder == "seed" { run.runner.clone() } else { format!("{} against {}", run.builder, run.runner) };
    ui.label(text(13.0, TEXT, who));
    ui.label(text(13.0, FAINT, format!("seed {}", run.draw[0])));
    ui.label(text(12.0, FAINT, run.date.get(..10).unwrap_or_default()));
    run.replay.is_some() && ui.button("replay").clicked()
}
