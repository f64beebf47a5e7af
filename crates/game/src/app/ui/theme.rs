//! The look of text and cards, and the order in which they are drawn.

use crate::app::input::actions::KeysFor;
use crate::app::mode::AppSet;
use crate::app::settings::values::{Detail, Settings, TEXT_SIZE};
use bevy::prelude::*;
use bevy_egui::egui::{self, Align2, Area, Color32, CornerRadius, FontFamily, FontId, Frame, Id, Margin, RichText, Ui};
use bevy_egui::{EguiContexts, EguiPrimaryContextPass};
use bevy_marathon::look::FollowCamera;

/// The color of cards.
pub const CARD: Color32 = Color32::from_rgba_premultiplied(12, 16, 22, 205);
/// The color of text.
pub const TEXT: Color32 = Color32::from_rgb(236, 240, 244);
/// The color of less important text.
pub const FAINT: Color32 = Color32::from_rgb(158, 170, 182);
/// The color of what the player looks for.
pub const ACCENT: Color32 = Color32::from_rgb(255, 158, 64);
/// The color of errors and falls.
pub const BAD: Color32 = Color32::from_rgb(255, 106, 96);

/// Size of a picture in which text and bars have their full size, points. They shrink in a smaller one.
const FULL: [f32; 2] = [1000.0, 600.0];
/// Smallest scale at which text can be read.
const SMALLEST: f32 = 0.66;
/// Smallest picture in which larger text fits, points: in a small window, text grows no further.
const LEAST: [f32; 2] = [760.0, 430.0];

/// The text and bars over the picture.
#[derive(Resource, Clone, Copy, Debug)]
pub struct Hud {
    /// Anything at all.
    pub on: bool,
    /// All keys.
    pub help: bool,
    /// How much of it.
    pub detail: Detail,
}

impl Default for Hud {
    fn default() -> Self {
        Hud { on: true, help: false, detail: Detail::Full }
    }
}

impl Hud {
    /// Whether the numbers of task, policy and reward are shown.
    pub fn is_full(&self) -> bool {
        self.on && self.detail == Detail::Full
    }
}

/// The order of drawing.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum UiSet {
    /// Style and scale.
    Prepare,
    /// Text and bars of every mode.
    Hud,
    /// The panel of a feature.
    Panels,
    /// Windows over all of it.
    Windows,
}

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Hud>()
        .add_systems(Update, follow_settings.run_if(resource_changed::<Settings>).in_set(AppSet::Present))
        .configure_sets(EguiPrimaryContextPass, (UiSet::Prepare, UiSet::Hud, UiSet::Panels, UiSet::Windows).chain())
        // a menu is alone on the screen
        .configure_sets(EguiPrimaryContextPass, (UiSet::Hud, UiSet::Panels).run_if(not(resource_equals(KeysFor::Menu))))
        .add_systems(EguiPrimaryContextPass, (style, fit).chain().in_set(UiSet::Prepare));
}

/// Shows as much as the player has chosen. A key may hide it for a while.
fn follow_settings(settings: Res<Settings>, mut hud: ResMut<Hud>) {
    let detail = settings.interface.detail;
    if hud.detail != detail {
        hud.detail = detail;
        hud.on = detail != Detail::Nothing;
    }
}

/// Sets the look of menus and sliders.
fn style(mut contexts: EguiContexts, mut done: Local<bool>) -> Result {
    if *done {
        return Ok(());
    }
    let ctx = contexts.ctx_mut()?;
    ctx.set_visuals(egui::Visuals::dark());
    ctx.global_style_mut(|style| {
        style.interaction.selectable_labels = false;
        // the first picture of a video shows whole windows
        style.animation_time = 0.0;
        style.visuals.window_corner_radius = CornerRadius::same(10);
        style.visuals.override_text_color = Some(Color32::from_rgb(236, 240, 244));
        style.visuals.selection.bg_fill = Color32::from_rgb(190, 96, 20);
        style.spacing.slider_width = 140.0;
    });
    *done = true;
    Ok(())
}

/// Scales text and bars to the picture, and to the size of text that the player has chosen.
fn fit(mut contexts: EguiContexts, settings: Res<Settings>, cameras: Query<&Camera, With<FollowCamera>>) -> Result {
    let ctx = contexts.ctx_mut()?;
    if let Some(size) = cameras.iter().next().and_then(Camera::logical_viewport_size) {
        let fits = (size.x / FULL[0]).min(size.y / FULL[1]).clamp(SMALLEST, 1.0);
        let chosen = settings.interface.text_size.clamp(*TEXT_SIZE.start(), *TEXT_SIZE.end());
        let most = (size.x / LEAST[0]).min(size.y / LEAST[1]).max(fits);
        ctx.set_zoom_factor((fits * chosen).min(most));
    }
    Ok(())
}

/// A dark card for text.
pub fn card() -> Frame {
    Frame::new().fill(CARD).corner_radius(CornerRadius::same(8)).inner_margin(Margin::symmetric(12, 9))
}

/// The name of the area of [`panel`].
pub fn panel_id() -> Id {
    Id::new("panel")
}

/// The name of the area of the card at the upper left.
pub fn status_id() -> Id {
    Id::new("who")
}

/// Draws a card at the upper right: the panel of the current mode. Where there is no room for it, it is below the card at the
/// left.
pub fn panel(ctx: &egui::Context, interactable: bool, draw: impl FnOnce(&mut Ui)) {
    let rect = |id| ctx.memory(|memory| memory.area_rect(id));
    let status = rect(status_id());
    let width = rect(panel_id()).map_or(0.0, |panel| panel.width());
    let crowded = status.filter(|status| status.right() + width + 22.0 > ctx.content_rect().right());
    let top = crowded.map_or(14.0, |status| status.bottom() + 8.0);
    let area = Area::new(panel_id()).anchor(Align2::RIGHT_TOP, [-14.0, top]).interactable(interactable);
    area.show(ctx, |ui| card().show(ui, draw));
}

/// The font of a size.
pub fn font(size: f32) -> FontId {
    FontId::new(size, FontFamily::Proportional)
}

/// Text of a size and color.
pub fn text(size: f32, color: Color32, words: impl Into<String>) -> RichText {
    RichText::new(words).size(size).color(color)
}

/// A line of text that does not break, because a break would change the size of the card.
pub fn line(ui: &mut Ui, words: RichText) {
    ui.add(egui::Label::new(words).extend());
}

/// A number with a sign as wide as a plus, so that it does not move.
pub fn spaced(x: f32) -> String {
    format!("{x:+.2}").replace('-', "\u{2212}")
}
