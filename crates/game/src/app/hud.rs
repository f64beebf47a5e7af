//! Text and bars over the picture: who runs how fast, what it is rewarded for, how learning goes, which keys there are.

use crate::app::args::Mode;
use crate::app::hints::Hints;
use crate::app::keys::Bindings;
use crate::app::learn::{Filmed, Lesson};
use crate::app::notes::{Note, Notes};
use crate::app::replay::Recorder;
use crate::app::show::{Actor, Focus, Show};
use crate::app::steer::{Steering, controls};
use crate::look::{FollowCamera, velocity_told};
use crate::ragdoll::{AgentCommand, Anatomy, Episode};
use crate::simulate::Marathon;
use bevy::input::gamepad::Gamepad;
use bevy::prelude::*;
use bevy_egui::EguiContexts;
use bevy_egui::egui::{
    self, Align2, Area, Color32, CornerRadius, FontFamily, FontId, Frame, Id, Margin, Painter, Pos2, Rect, RichText,
    Sense, Stroke, Ui,
};
use marathon_envs::{CommandRange, Spec, options::Value};
use std::collections::VecDeque;

/// Decisions that the reward's curve shows.
const SHOWN: usize = 240;
/// How fast the scale of a bar forgets, per decision.
const FORGET: f32 = 0.998;

pub(super) const CARD: Color32 = Color32::from_rgba_premultiplied(12, 16, 22, 205);
pub(super) const TEXT: Color32 = Color32::from_rgb(236, 240, 244);
pub(super) const FAINT: Color32 = Color32::from_rgb(158, 170, 182);
pub(super) const ACCENT: Color32 = Color32::from_rgb(255, 158, 64);
pub(super) const BAD: Color32 = Color32::from_rgb(255, 106, 96);
/// Relative error of the measured time factor above which the screen shows it.
const OFF_PACE: f32 = 0.1;
/// Commanded speed above which the screen shows the speed in the command's direction, m/s.
const TOLD: f64 = 0.1;
/// Colors of the reward's terms.
const TERMS: [Color32; 8] = [
    Color32::from_rgb(86, 180, 233),
    Color32::from_rgb(120, 200, 120),
    Color32::from_rgb(240, 180, 60),
    Color32::from_rgb(230, 110, 100),
    Color32::from_rgb(190, 140, 230),
    Color32::from_rgb(90, 205, 195),
    Color32::from_rgb(235, 140, 190),
    Color32::from_rgb(190, 190, 120),
];

/// Size of a picture in which text and bars are as large as they are meant, points; in a smaller one they shrink.
const FULL: [f32; 2] = [1000.0, 600.0];
/// Smallest scale at which they can be read.
const SMALLEST: f32 = 0.66;
/// Widths below which the key hints and the reward bars are hidden, and height below which the bars are hidden, so that
/// they do not cover the character, points.
const ROOM: [f32; 3] = [640.0, 900.0, 320.0];
/// Height of the reward's bars with what is below them, and of each, points.
const REWARDS: [f32; 2] = [120.0, 20.0];
/// Distance of the reward's bars from the lower edge, and of those above a time line, points.
const LIFT: [f32; 2] = [44.0, 92.0];
/// Width from which on a time line fits beside them, points.
const BESIDE: f32 = 1200.0;

/// What is drawn over the picture.
#[derive(Resource, Clone, Copy, Debug)]
pub struct Hud {
    /// Anything at all.
    pub on: bool,
    /// All keys.
    pub help: bool,
}

/// The reward of the character in focus over time.
#[derive(Resource, Default)]
pub struct Monitor {
    whose: Option<Entity>,
    decisions: u64,
    terms: VecDeque<Vec<f32>>,
    /// Largest size of each term of late.
    peaks: Vec<f32>,
    /// Decisions of everybody at the last look, and how many there are per second.
    looked: (f32, u64),
    rate: f32,
    pace: Pace,
}

/// The measured time factor: game time over real time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Pace {
    /// The time factor set when the measurement began; 0 while paused.
    wanted: f32,
    /// Real and game seconds since the measurement began.
    seconds: [f64; 2],
    /// The last measured factor, if it was measured at the same setting.
    measured: Option<f32>,
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
    fn told(&self, wanted: f32) -> String {
        match self.measured.filter(|measured| self.wanted == wanted && (measured / wanted - 1.0).abs() > OFF_PACE) {
            Some(measured) => format!("time x{measured:.2} (slow frames, x{wanted} asked)"),
            None => format!("time x{wanted}"),
        }
    }
}

/// Takes in the newest decision of the focus.
pub fn watch(focus: Res<Focus>, mut monitor: ResMut<Monitor>, actors: Query<(Entity, &Actor, &Episode)>) {
    let Some((entity, _, episode)) = actors.iter().find(|(_, a, _)| a.0 == focus.0) else { return };
    if monitor.whose != Some(entity) {
        let Monitor { looked, rate, pace, .. } = *monitor;
        *monitor = Monitor { whose: Some(entity), looked, rate, pace, ..default() };
    }
    if monitor.decisions == episode.decisions || episode.terms.is_empty() {
        return;
    }
    monitor.decisions = episode.decisions;
    monitor.peaks.resize(episode.terms.len(), 1e-3);
    for (peak, x) in monitor.peaks.iter_mut().zip(&episode.terms) {
        *peak = (*peak * FORGET).max(x.abs());
    }
    monitor.terms.push_back(episode.terms.clone());
    if monitor.terms.len() > SHOWN {
        monitor.terms.pop_front();
    }
}

/// Measures the decisions per second of all characters, and the time factor.
pub fn clock(
    (time, game): (Res<Time<Real>>, Res<Time<Virtual>>),
    marathon: Res<Marathon>,
    mut monitor: ResMut<Monitor>,
) {
    let wanted = if game.is_paused() { 0.0 } else { game.relative_speed() };
    monitor.pace.take_in(wanted, time.delta_secs_f64(), game.delta_secs_f64());
    let now = time.elapsed_secs();
    let (then, before) = monitor.looked;
    if now - then >= 1.0 {
        monitor.rate = (marathon.decisions() - before) as f32 / (now - then);
        monitor.looked = (now, marathon.decisions());
    }
}

/// Makes text and bars as large as the picture allows.
pub fn fit(mut contexts: EguiContexts, cameras: Query<&Camera, With<FollowCamera>>) -> Result {
    let ctx = contexts.ctx_mut()?;
    if let Some(size) = cameras.iter().next().and_then(Camera::logical_viewport_size) {
        ctx.set_zoom_factor((size.x / FULL[0]).min(size.y / FULL[1]).clamp(SMALLEST, 1.0));
    }
    Ok(())
}

/// A dark card for text.
pub fn card() -> Frame {
    Frame::new().fill(CARD).corner_radius(CornerRadius::same(8)).inner_margin(Margin::symmetric(12, 9))
}

fn font(size: f32) -> FontId {
    FontId::new(size, FontFamily::Proportional)
}

pub(super) fn text(size: f32, color: Color32, words: impl Into<String>) -> RichText {
    RichText::new(words).size(size).color(color)
}

/// Text that does not break, which would make the card jump.
pub(super) fn line(ui: &mut Ui, words: RichText) {
    ui.add(egui::Label::new(words).extend());
}

/// A number with a sign of its own width, so that it does not jump.
fn spaced(x: f32) -> String {
    format!("{x:+.2}").replace('-', "\u{2212}")
}

/// The speed that the screen shows. For characters that turn it is the speed in the command's direction, or without a
/// command along the heading. For others it is the speed along the track. Motion backward, or along a
/// backward command, is negative.
fn shown_speed(spec: &Spec, episode: &Episode) -> f32 {
    if !spec.command.iter().any(CommandRange::is_turn) {
        return episode.speed;
    }
    let [ahead, left] = episode.own_velocity;
    match velocity_told(&spec.command, &episode.command) {
        Some([a, l, _]) if a.hypot(l) > TOLD => {
            let (size, sign) = (a.hypot(l), if a < 0.0 { -1.0 } else { 1.0 });
            (sign / size) as f32 * (a as f32 * ahead + l as f32 * left)
        }
        _ => ahead,
    }
}

/// Draws everything.
#[expect(clippy::too_many_arguments, reason = "a system names what it uses")]
#[allow(clippy::type_complexity, reason = "a system names what it uses")]
pub fn draw(
    mut contexts: EguiContexts,
    hud: Res<Hud>,
    show: Res<Show>,
    (focus, bindings, notes): (Res<Focus>, Res<Bindings>, Res<Notes>),
    (lesson, recorder, filmed): (Option<Res<Lesson>>, Option<Res<Recorder>>, Option<Res<Filmed>>),
    monitor: Res<Monitor>,
    time: Res<Time<Virtual>>,
    frames: Res<Time<Real>>,
    mut smooth: Local<f32>,
    steering: Res<Steering>,
    pads: Query<(), With<Gamepad>>,
    actors: Query<(&Actor, &Anatomy, &Episode, Option<&AgentCommand>)>,
) -> Result {
    let ctx = contexts.ctx_mut()?.clone();
    // the console shows the errors of a film
    if hud.on || filmed.is_none() {
        say(&ctx, &notes, hud.on);
    }
    if !hud.on {
        return Ok(());
    }
    let delta = frames.delta_secs();
    *smooth = if *smooth > 0.0 { *smooth + 0.05 * (delta - *smooth) } else { delta };
    let actor = actors.iter().find(|(a, ..)| a.0 == focus.0);
    let room = ctx.content_rect().size();
    if let Some((_, anatomy, episode, command)) = actor {
        Area::new(Id::new("who")).anchor(Align2::LEFT_TOP, [14.0, 14.0]).interactable(false).show(&ctx, |ui| {
            card().show(ui, |ui| {
                let of = if show.agents > 1 { format!("  {} of {}", focus.0 + 1, show.agents) } else { String::new() };
                let name = anatomy.spec.as_ref().map_or(anatomy.model.name.as_str(), |s| s.id.as_str());
                ui.horizontal(|ui| {
                    ui.label(text(17.0, TEXT, name).strong());
                    ui.label(text(13.0, ACCENT, show.mode.name()));
                    ui.label(text(12.0, FAINT, of));
                });
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
                    let state = if episode.down { "  fallen" } else { "" };
                    let Episode { number, seconds, total, .. } = episode;
                    let run = format!("episode {number}   {seconds:.1} s   return {total:.0}{state}");
                    line(ui, text(13.0, if episode.down { BAD } else { FAINT }, run));
                }
                if let Some(spec) = &anatomy.spec {
                    for (range, x) in spec.command.iter().zip(&episode.command) {
                        let by = match (show.mode, command) {
                            (Mode::Replay, _) => "",
                            (_, Some(_)) => "   by you",
                            (_, None) => "   by its schedule",
                        };
                        let told =
                            format!("{}: {} {}{by}", range.name.replace('_', " "), spaced(*x as f32), range.unit);
                        line(ui, text(13.0, if command.is_some() { ACCENT } else { FAINT }, told));
                    }
                    told_by_another(ui, spec, episode);
                }
                imitation(ui, anatomy, episode);
                let speed = match time.is_paused() {
                    true => "paused".into(),
                    false => monitor.pace.told(time.relative_speed()),
                };
                let fps = if *smooth > 0.0 { 1.0 / *smooth } else { 0.0 };
                // what comes from elsewhere is decided elsewhere
                let decisions = match show.mode {
                    Mode::Replay | Mode::Outside => String::new(),
                    _ => format!("{:.0} decisions/s   ", monitor.rate),
                };
                let rates = format!("{speed}   {decisions}{fps:.0} fps");
                line(ui, text(12.0, FAINT, rates));
                if let Some(recorder) = &recorder {
                    line(ui, text(13.0, BAD, format!("recording {:.1} s", recorder.seconds())));
                }
            });
        });
        // what else stands on the right is what its mode is about
        let above = match show.mode {
            Mode::Push => Some("circumstances"),
            Mode::Learn => Some("learning"),
            _ => None,
        };
        let above = above.and_then(|card| ctx.memory(|memory| memory.area_rect(Id::new(card))));
        let lift = LIFT[usize::from(show.mode == Mode::Replay && room.x < BESIDE)];
        let free = room.y - lift - above.map_or(0.0, |card| card.bottom());
        // on a course one looks at what comes
        let fits = |terms: usize| {
            show.mode != Mode::Course
                && room.x > ROOM[1]
                && room.y > ROOM[2]
                && free > REWARDS[0] + REWARDS[1] * terms as f32
        };
        if let Some(spec) = anatomy.spec.as_ref().filter(|spec| fits(spec.reward_terms.len())) {
            rewards(&ctx, &monitor, &spec.reward_terms, episode, lift);
        }
    }
    if let Some(lesson) = lesson.filter(|_| show.mode == Mode::Learn) {
        learning(&ctx, &lesson);
    }
    if room.x > ROOM[0] || hud.help {
        let ranges = actor.and_then(|(_, anatomy, ..)| anatomy.spec.as_ref()).map_or(&[][..], |spec| &spec.command);
        let controls = if steering.on { controls(ranges) } else { Vec::new() };
        let hints = Hints { bindings: &bindings, steering: *steering, controls, pads: !pads.is_empty() };
        hints.draw(&ctx, &show, hud.help, room);
    }
    Ok(())
}

/// What another role of the task has told the character, as far as the task tells it: `told_velocity` and the like.
fn told_by_another(ui: &mut Ui, spec: &Spec, episode: &Episode) {
    for (name, x) in spec.info.iter().zip(&episode.info) {
        if let Some(name) = name.strip_prefix("told_") {
            line(ui, text(13.0, BAD, format!("{}: {}   by its adversary", name.replace('_', " "), spaced(*x))));
        }
    }
}

/// How far the clip is and how near the character is to it, if it follows one.
fn imitation(ui: &mut Ui, anatomy: &Anatomy, episode: &Episode) {
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
        if let Some(Value::Text(clip)) = spec.options.get("clip") {
            line(ui, text(13.0, TEXT, clip.as_str()));
        }
    });
    let errors = [("joint_error", "joints", "rad"), ("position_error", "parts", "m")];
    let told = errors.iter().filter_map(|(name, what, unit)| Some(format!("{what} {:.2} {unit}", info(name)?)));
    line(ui, text(13.0, FAINT, format!("off by   {}", told.collect::<Vec<_>>().join("   "))));
}

/// Bars of the reward's terms, and their curves.
fn rewards(ctx: &egui::Context, monitor: &Monitor, names: &[String], episode: &Episode, lift: f32) {
    if episode.terms.is_empty() {
        return;
    }
    Area::new(Id::new("rewards")).anchor(Align2::RIGHT_BOTTOM, [-14.0, -lift]).interactable(false).show(ctx, |ui| {
        card().show(ui, |ui| {
            const WIDTH: f32 = 270.0;
            ui.set_width(WIDTH);
            ui.horizontal(|ui| {
                ui.label(text(13.0, FAINT, "reward"));
                ui.label(text(15.0, TEXT, spaced(episode.reward)).strong());
            });
            for (i, name) in names.iter().enumerate() {
                let (value, peak) = (episode.terms[i], monitor.peaks.get(i).copied().unwrap_or(1.0));
                let color = TERMS[i % TERMS.len()];
                let (response, painter) = ui.allocate_painter(egui::vec2(WIDTH, 17.0), Sense::hover());
                let row = response.rect;
                let y = row.center().y;
                painter.text(Pos2::new(row.left(), y), Align2::LEFT_CENTER, name.replace('_', " "), font(12.0), TEXT);
                let value_at = Pos2::new(row.right(), y);
                painter.text(value_at, Align2::RIGHT_CENTER, spaced(value), font(12.0), FAINT);
                let (left, right) = (row.left() + 112.0, row.right() - 46.0);
                let middle = 0.5 * (left + right);
                let end = middle + 0.5 * (right - left) * (value / peak.max(1e-6)).clamp(-1.0, 1.0);
                let trough = Rect::from_min_max(Pos2::new(left, y - 4.0), Pos2::new(right, y + 4.0));
                painter.rect_filled(trough, 3.0, Color32::from_white_alpha(18));
                let bar = Rect::from_two_pos(Pos2::new(middle, y - 4.0), Pos2::new(end, y + 4.0));
                painter.rect_filled(bar, 2.0, color);
                painter.line_segment([Pos2::new(middle, y - 6.0), Pos2::new(middle, y + 6.0)], (1.0, FAINT));
            }
            ui.add_space(4.0);
            let (response, painter) = ui.allocate_painter(egui::vec2(WIDTH, 64.0), Sense::hover());
            curves(&painter, response.rect, monitor);
        });
    });
}

fn curves(painter: &Painter, rect: Rect, monitor: &Monitor) {
    painter.rect_filled(rect, 4.0, Color32::from_black_alpha(90));
    let most = monitor.peaks.iter().copied().fold(1e-3, f32::max);
    let y = |x: f32| rect.center().y - 0.46 * rect.height() * (x / most).clamp(-1.0, 1.0);
    painter.line_segment(
        [Pos2::new(rect.left(), y(0.0)), Pos2::new(rect.right(), y(0.0))],
        (1.0, FAINT.gamma_multiply(0.4)),
    );
    let n = monitor.terms.len();
    for term in 0..monitor.peaks.len() {
        let at = |i: usize| rect.right() - rect.width() * (n - 1 - i) as f32 / (SHOWN - 1) as f32;
        let point = |(i, terms): (usize, &Vec<f32>)| Some(Pos2::new(at(i), y(*terms.get(term)?)));
        let line: Vec<Pos2> = monitor.terms.iter().enumerate().filter_map(point).collect();
        painter.add(egui::Shape::line(line, Stroke::new(1.4, TERMS[term % TERMS.len()])));
    }
}

/// The curve of what is being learned.
fn learning(ctx: &egui::Context, lesson: &Lesson) {
    Area::new(Id::new("learning")).anchor(Align2::RIGHT_TOP, [-14.0, 14.0]).interactable(false).show(ctx, |ui| {
        card().show(ui, |ui| {
            const WIDTH: f32 = 290.0;
            ui.set_width(WIDTH);
            let progress = lesson.progress();
            let state = if progress.paused { "paused" } else { progress.state.as_str() };
            ui.horizontal(|ui| {
                ui.label(text(15.0, TEXT, "learning").strong());
                ui.label(text(13.0, ACCENT, state));
            });
            let last = progress.curve.last().copied().unwrap_or_default();
            ui.label(text(
                13.0,
                FAINT,
                format!(
                    "{:.0} s   {:.2} million steps   return {:.0}",
                    last.seconds,
                    last.steps as f64 / 1e6,
                    last.total
                ),
            ));
            let (response, painter) = ui.allocate_painter(egui::vec2(WIDTH, 90.0), Sense::hover());
            let rect = response.rect;
            painter.rect_filled(rect, 4.0, Color32::from_black_alpha(90));
            let totals = progress.curve.iter().map(|p| p.total);
            let (low, high) = (totals.clone().fold(0.0, f64::min), totals.fold(1.0, f64::max));
            let end = last.seconds.max(20.0);
            let point = |p: &crate::app::learn::Point| {
                let x = rect.left() + rect.width() * (p.seconds / end) as f32;
                let y = rect.bottom() - 4.0 - (rect.height() - 8.0) * ((p.total - low) / (high - low)) as f32;
                Pos2::new(x, y)
            };
            let line: Vec<Pos2> = progress.curve.iter().map(point).collect();
            painter.add(egui::Shape::line(line, Stroke::new(2.0, ACCENT)));
            painter.text(
                rect.left_top() + egui::vec2(4.0, 2.0),
                Align2::LEFT_TOP,
                format!("{high:.0}"),
                font(11.0),
                FAINT,
            );
        });
    });
}

/// Messages; without text and bars, errors alone.
fn say(ctx: &egui::Context, notes: &Notes, all: bool) {
    let shown = |note: &&Note| all || note.error;
    if !notes.0.iter().any(|note| shown(&note)) {
        return;
    }
    Area::new(Id::new("notes")).anchor(Align2::CENTER_TOP, [0.0, 18.0]).interactable(false).show(ctx, |ui: &mut Ui| {
        for note in notes.0.iter().filter(shown) {
            card().show(ui, |ui| {
                ui.set_max_width(560.0);
                ui.label(text(14.0, if note.error { BAD } else { TEXT }, &note.text));
            });
            ui.add_space(4.0);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use marathon_runs::Setting;

    #[test]
    fn slow_frames_are_told() {
        let mut pace = Pace::default();
        let frames = |pace: &mut Pace, wanted: f32, real: f64, game: f64| {
            (0..10).for_each(|_| pace.take_in(wanted, real, game));
            pace.told(wanted)
        };
        assert_eq!(frames(&mut pace, 1.0, 0.2, 0.2), "time x1");
        // a real frame of 0.5 s advances the game by 0.25 s
        assert_eq!(frames(&mut pace, 1.0, 0.5, 0.25), "time x0.50 (slow frames, x1 asked)");
        // a measurement before a change does not apply after it
        assert_eq!(pace.told(2.0), "time x2");
        pace.take_in(2.0, 0.2, 0.4);
        assert_eq!(pace.told(2.0), "time x2");
        assert_eq!(frames(&mut pace, 2.0, 0.2, 0.4), "time x2");
    }

    #[test]
    fn speed_is_told_as_its_command_is() -> Result<(), Box<dyn std::error::Error>> {
        let spec = Setting::named("AntController")?.factory()?.spec().clone();
        let names: Vec<&str> = spec.command.iter().map(|range| range.name.as_str()).collect();
        let speeds = spec.command.iter().filter(|range| range.is_speed()).count();
        assert_eq!(speeds, 2, "{names:?}");
        let told = |ahead: f64, left: f64, own: [f32; 2]| {
            let mut speeds = [ahead, left].into_iter();
            let mut number =
                |range: &CommandRange| if range.is_speed() { speeds.next().unwrap_or_default() } else { 0.0 };
            let command = spec.command.iter().map(&mut number).collect();
            // along the track, the character moves backward
            let episode = Episode { command, own_velocity: own, speed: -7.0, ..default() };
            shown_speed(&spec, &episode)
        };
        assert_eq!(told(2.0, 0.0, [1.9, 0.3]), 1.9, "it runs where it faces, wherever that is");
        assert_eq!(told(-1.0, 0.0, [-0.9, 0.3]), -0.9, "it goes back");
        assert_eq!(told(0.0, 0.0, [0.1, 0.3]), 0.1, "it stands");
        assert_eq!(told(0.0, -1.0, [0.1, -0.8]), 0.8, "aside, as told");
        assert!((told(1.0, 1.0, [1.0, 1.0]) - 2.0_f32.sqrt()).abs() < 1e-6);
        let hopper = Setting::named("hopper")?.factory()?.spec().clone();
        assert_eq!(shown_speed(&hopper, &Episode { speed: 1.5, ..default() }), 1.5);
        Ok(())
    }
}
