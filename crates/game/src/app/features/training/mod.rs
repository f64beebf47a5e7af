//! Learning beside the picture: the newest policy of a trainer moves the characters.

mod run;

pub use run::{TrainingOptions, TrainingRun, settings};

use crate::app::input::actions::{Action, ActionPressed};
use crate::app::input::control::ControlSet;
use crate::app::mode::{AppSet, Mode};
use crate::app::notifications::Notifications;
use crate::app::pacing::IsVideo;
use crate::app::stage::loaded::LoadedPolicy;
use crate::app::stage::policies::ShippedPolicies;
use crate::app::stage::scenario::{LoadScenario, PolicySource, Scenario};
use crate::app::stage::spawn::spawn;
use crate::app::ui::hints::{KeyHints, ModeKeys};
use crate::app::ui::question::{AtStake, DiscardPolicy, ReportSet};
use crate::app::ui::theme::{ACCENT, FAINT, Hud, TEXT, UiSet, font, panel, text};
use bevy::prelude::*;
use bevy_egui::egui::{self, Align2, Color32, Pos2, Sense, Stroke};
use bevy_egui::{EguiContexts, EguiPrimaryContextPass};
use bevy_marathon::PolicyAsset;
use run::Point;

/// Seconds between two lines of the log.
const LOG: f32 = 5.0;

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<TrainingOptions>()
        .add_systems(PreUpdate, report.in_set(ReportSet))
        .add_systems(Update, (discard, control).chain().in_set(AppSet::Input).after(ControlSet))
        .add_systems(
            Update,
            (
                sync_run.run_if(in_state(Mode::Learn)),
                follow_pause,
                keep_pace.run_if(resource_exists::<IsVideo>),
                apply_policy,
                log,
            )
                .chain()
                .in_set(AppSet::Simulate)
                .after(spawn),
        )
        .add_systems(OnExit(Mode::Learn), finish)
        .add_systems(Last, keep_at_exit.run_if(on_message::<AppExit>))
        .add_systems(EguiPrimaryContextPass, draw.run_if(in_state(Mode::Learn)).in_set(UiSet::Panels));
}

pub(super) fn key_hints(hints: &mut KeyHints) {
    const KEYS: ModeKeys = ModeKeys {
        useful: &[Action::Menu, Action::Pause, Action::Faster, Action::Save, Action::Restart, Action::Learn],
        own: &[Action::Save],
        names: &[(Action::Restart, "learn anew"), (Action::Learn, "watch again")],
        ..ModeKeys::COMMON
    };
    hints.add(|scenario| scenario.mode == Mode::Learn, &KEYS);
}

fn report(run: Option<Res<TrainingRun>>, mut at_stake: ResMut<AtStake>) {
    at_stake.training = run.and_then(|run| run.unsaved());
}

/// The user has agreed to lose the policy.
fn discard(mut discards: MessageReader<DiscardPolicy>, run: Option<Res<TrainingRun>>) {
    if discards.read().count() > 0
        && let Some(run) = run
    {
        run.discard();
    }
}

/// Saves, restarts and ends the run.
fn control(
    mut commands: Commands,
    mut actions: MessageReader<ActionPressed>,
    mut scenario: ResMut<Scenario>,
    shipped: Res<ShippedPolicies>,
    mut loads: MessageWriter<LoadScenario>,
    run: Option<Res<TrainingRun>>,
    mut notes: ResMut<Notifications>,
) {
    for ActionPressed(action) in actions.read() {
        match (action, &run) {
            (Action::Save, Some(run)) => run.save("", &mut notes),
            (Action::Restart, Some(run)) if scenario.mode == Mode::Learn => {
                run.finish(&mut notes);
                commands.remove_resource::<TrainingRun>();
                notes.say("from random weights again");
                loads.write(LoadScenario);
            }
            (Action::Learn, _) => {
                let learning = scenario.mode == Mode::Learn;
                scenario.mode = if learning { Mode::Watch } else { Mode::Learn };
                scenario.play(if learning { PolicySource::Shipped } else { PolicySource::Trainer }, &shipped);
                loads.write(LoadScenario);
            }
            _ => {}
        }
    }
}

/// The trainer stands still with time.
fn follow_pause(run: Option<Res<TrainingRun>>, time: Res<Time<Virtual>>, mut before: Local<bool>) {
    let Some(run) = run else {
        *before = false;
        return;
    };
    if *before != time.is_paused() {
        *before = time.is_paused();
        run.pause(*before);
    }
}

/// Starts the run for the task of the scenario, and ends the run for another one.
fn sync_run(
    mut commands: Commands,
    mut loads: MessageReader<LoadScenario>,
    (scenario, loaded): (Res<Scenario>, Res<LoadedPolicy>),
    run: Option<Res<TrainingRun>>,
    mut options: ResMut<TrainingOptions>,
    mut notes: ResMut<Notifications>,
    mut failed: Local<bool>,
) {
    if loads.read().count() > 0 {
        *failed = false;
    }
    let wanted = scenario.source == PolicySource::Trainer;
    let fits = run.as_ref().is_some_and(|run| run.is_for(&loaded.task_config, scenario.ground) && !run.is_discarded());
    if let Some(run) = run.filter(|_| !(wanted && fits)) {
        run.finish(&mut notes);
        commands.remove_resource::<TrainingRun>();
    }
    if wanted && !fits && !*failed {
        match TrainingRun::start(&loaded.task_config, scenario.ground, &options) {
            Ok(run) => {
                info!("learning {} from random weights, seed {}", scenario.agent, options.seed);
                commands.insert_resource(run);
            }
            Err(error) => {
                *failed = true;
                notes.error(error);
            }
        }
        options.seed += 1;
    }
}

/// Another mode ends the run.
fn finish(mut commands: Commands, run: Option<Res<TrainingRun>>, mut notes: ResMut<Notifications>) {
    if let Some(run) = run {
        run.finish(&mut notes);
        commands.remove_resource::<TrainingRun>();
    }
}

/// Makes the trainer wait for a picture that is drawn more slowly than its time passes.
fn keep_pace(run: Option<ResMut<TrainingRun>>, time: Res<Time<Real>>) {
    if let Some(mut run) = run {
        run.keep_pace(time.delta_secs_f64());
    }
}

/// Moves the characters by the newest policy.
fn apply_policy(
    run: Option<ResMut<TrainingRun>>,
    loaded: Res<LoadedPolicy>,
    mut policies: ResMut<Assets<PolicyAsset>>,
) {
    let (Some(mut run), Some(handle)) = (run, &loaded.policy) else { return };
    if let Some(newest) = run.take_newest(!policies.contains(handle.id())) {
        let _ = policies.insert(handle.id(), PolicyAsset(newest));
    }
}

/// Frame times since the last line of the log, s.
#[derive(Default)]
struct Frames(Vec<f32>);

/// Logs every few seconds the progress and how evenly the picture is drawn.
fn log(time: Res<Time<Real>>, run: Option<Res<TrainingRun>>, mut frames: Local<Frames>, mut last: Local<f32>) {
    let Some(run) = run else {
        frames.0.clear();
        *last = time.elapsed_secs();
        return;
    };
    frames.0.push(time.delta_secs());
    if time.elapsed_secs() - *last < LOG {
        return;
    }
    *last = time.elapsed_secs();
    frames.0.sort_unstable_by(f32::total_cmp);
    let share = |share: f32| 1e3 * frames.0[((frames.0.len() - 1) as f32 * share) as usize];
    let (median, most, slowest) = (share(0.5), share(0.95), share(1.0));
    let Point { seconds, steps, total } = run.progress().curve.last().copied().unwrap_or_default();
    info!(
        "learning: {seconds:.0} s, {steps} steps, return {total:.0}; frames of the last {LOG} s: median {median:.0} ms, \
         95 % within {most:.0} ms, slowest {slowest:.0} ms"
    );
    frames.0.clear();
}

/// Saves the trained policy when the game ends, unless the user has discarded it.
fn keep_at_exit(run: Option<Res<TrainingRun>>, mut notes: ResMut<Notifications>) {
    if let Some(run) = run {
        run.finish(&mut notes);
    }
}

/// Draws the learning curve.
fn draw(mut contexts: EguiContexts, hud: Res<Hud>, run: Option<Res<TrainingRun>>) -> Result {
    let Some(run) = run.filter(|_| hud.on) else { return Ok(()) };
    panel(contexts.ctx_mut()?, false, |ui| {
        const WIDTH: f32 = 290.0;
        ui.set_width(WIDTH);
        let progress = run.progress();
        let state = if progress.paused { "paused" } else { progress.state.as_str() };
        ui.horizontal(|ui| {
            ui.label(text(15.0, TEXT, "learning").strong());
            ui.label(text(13.0, ACCENT, state));
        });
        let last = progress.curve.last().copied().unwrap_or_default();
        ui.label(text(
            13.0,
            FAINT,
            format!("{:.0} s   {:.2} million steps   return {:.0}", last.seconds, last.steps as f64 / 1e6, last.total),
        ));
        let (response, painter) = ui.allocate_painter(egui::vec2(WIDTH, 90.0), Sense::hover());
        let rect = response.rect;
        painter.rect_filled(rect, 4.0, Color32::from_black_alpha(90));
        let totals = progress.curve.iter().map(|p| p.total);
        let (low, high) = (totals.clone().fold(0.0, f64::min), totals.fold(1.0, f64::max));
        let end = last.seconds.max(20.0);
        let point = |p: &Point| {
            let x = rect.left() + rect.width() * (p.seconds / end) as f32;
            let y = rect.bottom() - 4.0 - (rect.height() - 8.0) * ((p.total - low) / (high - low)) as f32;
            Pos2::new(x, y)
        };
        let line: Vec<Pos2> = progress.curve.iter().map(point).collect();
        painter.add(egui::Shape::line(line, Stroke::new(2.0, ACCENT)));
        painter.text(rect.left_top() + egui::vec2(4.0, 2.0), Align2::LEFT_TOP, format!("{high:.0}"), font(11.0), FAINT);
    });
    Ok(())
}
