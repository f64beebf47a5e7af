//! The card of the character in focus: its task, its command, its clip, and how fast time passes.

use crate::app::mode::{AppSet, Mode};
use crate::app::stage::actors::{Actor, Focus};
use crate::app::stage::scenario::Scenario;
use crate::app::ui::theme::{ACCENT, BAD, FAINT, Hud, TEXT, UiSet, card, line, spaced, status_id, text};
use bevy::prelude::*;
use bevy_egui::egui::{self, Align2, Area, Color32, Sense, Ui};
use bevy_egui::{EguiContexts, EguiPrimaryContextPass};
use bevy_marathon::look::commanded_velocity;
use bevy_marathon::{AgentCommand, Anatomy, Episode, Marathon};
use marathon_envs::options::OptionValue;
use marathon_envs::{Clips, CommandRange, Spec};

/// Relative error of the measured time factor above which the screen shows it.
const OFF_PACE: f32 = 0.1;
/// Commanded speed above which the screen shows the speed in the command's direction, m/s.
const COMMANDED: f64 = 0.1;

/// Lines that features add to the card in this frame.
#[derive(Resource, Default)]
pub struct StatusLines(pub Vec<(Color32, String)>);

/// Measured rates.
#[derive(Resource, Default)]
pub struct Rates {
    /// Real time of the last measurement, s, and the decisions of all characters then.
    looked: (f32, u64),
    /// Decisions per second.
    decisions: f32,
    pace: Pace,
}

/// The measured time factor: game time over real time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pace {
    /// The time factor set when the measurement began; 0 while paused.
    wanted: f32,
    /// Real and game seconds since the measurement began.
    seconds: [f64; 2],
    /// The last measured factor, if it was measured at the same setting.
    measured: Option<f32>,
}

impl Rates {
    /// The speed of time, and the rates of decisions and frames, for the screen.
    fn text(&self, time: &Time<Virtual>, mode: Mode, fps: f32) -> String {
        let speed = match time.is_paused() {
            true => "paused".into(),
            false => self.pace.text(time.relative_speed()),
        };
        // another program makes the decisions
        let decisions = match mode.is_simulated() {
            true => format!("{:.0} decisions/s   ", self.decisions),
            false => String::new(),
        };
        format!("{speed}   {decisions}{fps:.0} fps")
    }
}

impl Pace {
    /// Adds a frame: the time factor that is set, and the frame's real and game seconds.
    fn take_in(&mut self, wanted: f32, real: f64, game: f64) {
        if wanted != self.wanted {
            *self = Pace { wanted, ..default() };
            // a frame that changes the factor counts for neither setting
            return;
        }
        self.seconds[0] += real;
        self.seconds[1] += game;
        if self.seconds[0] >= 1.0 {
            *self = Pace { wanted, measured: Some((self.seconds[1] / self.seconds[0]) as f32), ..default() };
        }
    }

    /// The factor for the screen: the one that is set, or the measured one if the frames are too slow.
    fn text(&self, wanted: f32) -> String {
        match self.measured.filter(|measured| self.wanted == wanted && (measured / wanted - 1.0).abs() > OFF_PACE) {
            Some(measured) => format!("time x{measured:.2} (slow frames, x{wanted} asked)"),
            None => format!("time x{wanted}"),
        }
    }
}

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Rates>()
        .init_resource::<StatusLines>()
        .add_systems(First, |mut lines: ResMut<StatusLines>| lines.0.clear())
        .add_systems(Update, measure.in_set(AppSet::Present))
        .add_systems(EguiPrimaryContextPass, draw.in_set(UiSet::Hud));
}

/// Measures the decisions per second of all characters, and the time factor.
fn measure((time, game): (Res<Time<Real>>, Res<Time<Virtual>>), marathon: Res<Marathon>, mut rates: ResMut<Rates>) {
    let wanted = if game.is_paused() { 0.0 } else { game.relative_speed() };
    rates.pace.take_in(wanted, time.delta_secs_f64(), game.delta_secs_f64());
    let now = time.elapsed_secs();
    let (then, before) = rates.looked;
    if now - then >= 1.0 {
        rates.decisions = (marathon.decisions() - before) as f32 / (now - then);
        rates.looked = (now, marathon.decisions());
    }
}

/// The speed that the screen shows. For characters that turn it is the speed in the command's direction, or without a
/// command along the heading. For others it is the speed along the track. Motion backward, or along a
/// backward command, is negative.
fn shown_speed(spec: &Spec, episode: &Episode) -> f32 {
    if !spec.command.iter().any(CommandRange::is_turn) {
        return episode.speed;
    }
    let [ahead, left] = episode.own_velocity;
    match commanded_velocity(&spec.command, &episode.command) {
        Some([a, l, _]) if a.hypot(l) > COMMANDED => {
            let (size, sign) = (a.hypot(l), if a < 0.0 { -1.0 } else { 1.0 });
            (sign / size) as f32 * (a as f32 * ahead + l as f32 * left)
        }
        _ => ahead,
    }
}

/// Draws the card.
#[allow(clippy::type_complexity, reason = "a query names what it reads")]
pub fn draw(
    mut contexts: EguiContexts,
    (hud, scenario, focus): (Res<Hud>, Res<Scenario>, Res<Focus>),
    (rates, lines): (Res<Rates>, Res<StatusLines>),
    (time, frames): (Res<Time<Virtual>>, Res<Time<Real>>),
    mut smooth: Local<f32>,
    actors: Query<(&Actor, &Anatomy, &Episode, Option<&AgentCommand>)>,
) -> Result {
    if !hud.on {
        return Ok(());
    }
    let ctx = contexts.ctx_mut()?.clone();
    let delta = frames.delta_secs();
    *smooth = if *smooth > 0.0 { *smooth + 0.05 * (delta - *smooth) } else { delta };
    let actor = actors.iter().find(|(a, ..)| a.0 == focus.0);
    if let Some((_, anatomy, episode, command)) = actor {
        Area::new(status_id()).anchor(Align2::LEFT_TOP, [14.0, 14.0]).interactable(false).show(&ctx, |ui| {
            card().show(ui, |ui| {
                let of = if scenario.agents > 1 {
                    format!("  {} of {}", focus.0 + 1, scenario.agents)
                } else {
                    String::new()
                };
                let name = anatomy.spec.as_ref().map_or(anatomy.model.name.as_str(), |s| s.id.as_str());
                ui.horizontal(|ui| {
                    ui.label(text(17.0, TEXT, name).strong());
                    ui.label(text(13.0, ACCENT, scenario.mode.name()));
                    ui.label(text(12.0, FAINT, of));
                });
                let goal = match scenario.mode {
                    Mode::Course => scenario.course.role.goal(),
                    mode => mode.goal(),
                };
                line(ui, text(13.0, FAINT, goal));
                if let Some(spec) = &anatomy.spec {
                    ui.horizontal(|ui| {
                        // rounded first: there is no -0.0 m/s
                        let speed = (shown_speed(spec, episode).max(-9.9) * 10.0).round() / 10.0 + 0.0;
                        ui.label(text(30.0, TEXT, format!("{speed:.1}")).strong());
                        ui.label(text(14.0, FAINT, "m/s"));
                        ui.add_space(8.0);
                        let distance = (episode.distance * 10.0).round() / 10.0 + 0.0;
                        ui.label(text(30.0, TEXT, format!("{distance:.1}")).strong());
                        ui.label(text(14.0, FAINT, "m"));
                    });
                }
                let steered = command.is_some_and(|command| command.values().is_some());
                if hud.is_full() {
                    let fps = if *smooth > 0.0 { 1.0 / *smooth } else { 0.0 };
                    numbers(ui, scenario.mode, anatomy, episode, steered);
                    clip(ui, anatomy, episode);
                    line(ui, text(12.0, FAINT, rates.text(&time, scenario.mode, fps)));
                } else if time.is_paused() {
                    line(ui, text(13.0, ACCENT, "paused"));
                }
                for (color, words) in &lines.0 {
                    line(ui, text(13.0, *color, words));
                }
            });
        });
    }
    Ok(())
}

/// The numbers of the episode, and the command.
fn numbers(ui: &mut Ui, mode: Mode, anatomy: &Anatomy, episode: &Episode, steered: bool) {
    let Some(spec) = &anatomy.spec else { return };
    let state = if episode.down { "  fallen" } else { "" };
    let Episode { number, seconds, total, .. } = episode;
    let run = format!("episode {number}   {seconds:.1} s   return {total:.0}{state}");
    line(ui, text(13.0, if episode.down { BAD } else { FAINT }, run));
    for (range, x) in spec.command.iter().zip(&episode.command) {
        let by = match (mode, steered) {
            (Mode::Replay, _) => "",
            (_, true) => "   by you",
            (_, false) => "   by its schedule",
        };
        let words = format!("{}: {} {}{by}", range.name.replace('_', " "), spaced(*x as f32), range.unit);
        line(ui, text(13.0, if steered { ACCENT } else { FAINT }, words));
    }
    adversary(ui, spec, episode);
}

/// The commands of another role of the task, if the task reports them: `told_velocity` and the like.
fn adversary(ui: &mut Ui, spec: &Spec, episode: &Episode) {
    for (name, x) in spec.info.iter().zip(&episode.info) {
        if let Some(name) = name.strip_prefix("told_") {
            line(ui, text(13.0, BAD, format!("{}: {}   by its adversary", name.replace('_', " "), spaced(*x))));
        }
    }
}

/// The phase of the clip, and the errors of a character that follows one.
fn clip(ui: &mut Ui, anatomy: &Anatomy, episode: &Episode) {
    let Some(spec) = &anatomy.spec else { return };
    let info = |name: &str| episode.info.get(spec.info.iter().position(|known| known == name)?).copied();
    let Some(phase) = info("phase") else { return };
    const WIDTH: f32 = 190.0;
    ui.horizontal(|ui| {
        let (response, painter) = ui.allocate_painter(egui::vec2(WIDTH, 13.0), Sense::hover());
        let bar = response.rect.shrink2(egui::vec2(0.0, 3.0));
        painter.rect_filled(bar, 3.0, Color32::from_white_alpha(18));
        let over = bar.with_max_x(bar.left() + bar.width() * phase.clamp(0.0, 1.0));
        painter.rect_filled(over, 3.0, ACCENT);
        if let Some(clips) = spec.options.get("clip").and_then(Clips::read) {
            line(ui, text(13.0, TEXT, clips.to_string()));
        }
    });
    let errors = [("joint_error", "joints", "rad"), ("position_error", "parts", "m")];
    let words = errors.iter().filter_map(|(name, what, unit)| Some(format!("{what} {:.2} {unit}", info(name)?)));
    line(ui, text(13.0, FAINT, format!("off by   {}", words.collect::<Vec<_>>().join("   "))));
}

#[cfg(test)]
mod tests {
    use super::*;
    use marathon_runs::TaskConfig;

    #[test]
    fn slow_frames_are_shown() {
        let mut pace = Pace::default();
        let frames = |pace: &mut Pace, wanted: f32, real: f64, game: f64| {
            (0..10).for_each(|_| pace.take_in(wanted, real, game));
            pace.text(wanted)
        };
        assert_eq!(frames(&mut pace, 1.0, 0.2, 0.2), "time x1");
        // a real frame of 0.5 s advances the game by 0.25 s
        assert_eq!(frames(&mut pace, 1.0, 0.5, 0.25), "time x0.50 (slow frames, x1 asked)");
        // a measurement before a change does not apply after it
        assert_eq!(pace.text(2.0), "time x2");
        pace.take_in(2.0, 0.2, 0.4);
        assert_eq!(pace.text(2.0), "time x2");
        assert_eq!(frames(&mut pace, 2.0, 0.2, 0.4), "time x2");
    }

    #[test]
    fn the_speed_has_the_direction_of_the_command() -> Result<(), Box<dyn std::error::Error>> {
        let spec = TaskConfig::named("AntController")?.factory()?.spec().clone();
        let names: Vec<&str> = spec.command.iter().map(|range| range.name.as_str()).collect();
        let speeds = spec.command.iter().filter(|range| range.is_speed()).count();
        assert_eq!(speeds, 2, "{names:?}");
        let shown = |ahead: f64, left: f64, own: [f32; 2]| {
            let mut speeds = [ahead, left].into_iter();
            let mut number =
                |range: &CommandRange| if range.is_speed() { speeds.next().unwrap_or_default() } else { 0.0 };
            let command = spec.command.iter().map(&mut number).collect();
            // along the track, the character moves backward
            let episode = Episode { command, own_velocity: own, speed: -7.0, ..default() };
            shown_speed(&spec, &episode)
        };
        assert_eq!(shown(2.0, 0.0, [1.9, 0.3]), 1.9, "it runs where it faces, wherever that is");
        assert_eq!(shown(-1.0, 0.0, [-0.9, 0.3]), -0.9, "it goes back");
        assert_eq!(shown(0.0, 0.0, [0.1, 0.3]), 0.1, "it stands");
        assert_eq!(shown(0.0, -1.0, [0.1, -0.8]), 0.8, "aside, as commanded");
        assert!((shown(1.0, 1.0, [1.0, 1.0]) - 2.0_f32.sqrt()).abs() < 1e-6);
        let hopper = TaskConfig::named("hopper")?.factory()?.spec().clone();
        assert_eq!(shown_speed(&hopper, &Episode { speed: 1.5, ..default() }), 1.5);
        Ok(())
    }
}
