//! Bars of the reward's terms in the last decision, and their curves.

use crate::app::mode::Mode;
use crate::app::stage::actors::{Actor, Focus};
use crate::app::ui::status;
use crate::app::ui::theme::{FAINT, Hud, TEXT, UiSet, card, font, panel_id, spaced, text};
use bevy::prelude::*;
use bevy_egui::egui::{self, Align2, Area, Color32, Id, Painter, Pos2, Rect, Sense, Stroke};
use bevy_egui::{EguiContexts, EguiPrimaryContextPass};
use bevy_marathon::{Anatomy, Episode, MarathonSystems};
use std::collections::VecDeque;

/// Decisions that the curves show.
const SHOWN: usize = 240;
/// Decay of a bar's scale per decision.
const DECAY: f32 = 0.998;
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

/// Smallest width and height of the picture in which the bars do not cover the character, points.
const ROOM: [f32; 2] = [900.0, 320.0];
/// Height of the curves with the heading, and of each bar, points.
const HEIGHT: [f32; 2] = [120.0, 20.0];
/// Distance of the bars from the lower edge, and from the lower edge if a time line is below them, points.
const LIFT: [f32; 2] = [44.0, 92.0];
/// Width from which on a time line fits beside them, points.
const BESIDE: f32 = 1200.0;

/// The reward of the character in focus over time.
#[derive(Resource, Default)]
pub struct Monitor {
    whose: Option<Entity>,
    decisions: u64,
    terms: VecDeque<Vec<f32>>,
    /// Largest recent size of each term.
    peaks: Vec<f32>,
}

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Monitor>()
        .add_systems(FixedUpdate, watch.after(MarathonSystems::Report))
        .add_systems(EguiPrimaryContextPass, draw.in_set(UiSet::Hud).after(status::draw));
}

/// Takes in the newest decision of the focus.
fn watch(focus: Res<Focus>, mut monitor: ResMut<Monitor>, actors: Query<(Entity, &Actor, &Episode)>) {
    let Some((entity, _, episode)) = actors.iter().find(|(_, a, _)| a.0 == focus.0) else { return };
    if monitor.whose != Some(entity) {
        *monitor = Monitor { whose: Some(entity), ..default() };
    }
    if monitor.decisions == episode.decisions || episode.terms.is_empty() {
        return;
    }
    monitor.decisions = episode.decisions;
    monitor.peaks.resize(episode.terms.len(), 1e-3);
    for (peak, x) in monitor.peaks.iter_mut().zip(&episode.terms) {
        *peak = (*peak * DECAY).max(x.abs());
    }
    monitor.terms.push_back(episode.terms.clone());
    if monitor.terms.len() > SHOWN {
        monitor.terms.pop_front();
    }
}

/// Draws the bars where they cover neither the character nor the panel of the mode.
pub fn draw(
    mut contexts: EguiContexts,
    (hud, mode, focus): (Res<Hud>, Res<State<Mode>>, Res<Focus>),
    monitor: Res<Monitor>,
    actors: Query<(&Actor, &Anatomy, &Episode)>,
) -> Result {
    // on a course the player looks at the ground ahead
    if !hud.is_full() || *mode == Mode::Course {
        return Ok(());
    }
    let Some((_, anatomy, episode)) = actors.iter().find(|(actor, ..)| actor.0 == focus.0) else { return Ok(()) };
    let Some(spec) = &anatomy.spec else { return Ok(()) };
    let ctx = contexts.ctx_mut()?.clone();
    let room = ctx.content_rect().size();
    let has_panel = matches!(mode.get(), Mode::Push | Mode::Learn);
    let panel = has_panel.then(|| ctx.memory(|memory| memory.area_rect(panel_id()))).flatten();
    let lift = LIFT[usize::from(*mode == Mode::Replay && room.x < BESIDE)];
    let free = room.y - lift - panel.map_or(0.0, |panel| panel.bottom());
    let height = HEIGHT[0] + HEIGHT[1] * spec.reward_terms.len() as f32;
    if room.x > ROOM[0] && room.y > ROOM[1] && free > height {
        rewards(&ctx, &monitor, &spec.reward_terms, episode, lift);
    }
    Ok(())
}

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
