//! Prompts: the control for something that the player has not done yet, one at a time. A prompt goes once it is done.

use crate::app::input::actions::{Action, ActionPressed, KeysFor, Steer, Steering};
use crate::app::input::bindings::{Bindable, Bindings, Press};
use crate::app::input::device::{Device, DeviceInUse};
use crate::app::mode::{AppSet, Mode};
use crate::app::settings::values::Settings;
use crate::app::stage::actors::{Actor, Focus};
use crate::app::stage::scenario::Scenario;
use crate::app::ui::glyphs::{Glyph, glyph};
use crate::app::ui::theme::{Hud, TEXT, UiSet, card, text};
use bevy::prelude::*;
use bevy_egui::egui::{self, Align2, Area, Id};
use bevy_egui::{EguiContexts, EguiPrimaryContextPass};
use bevy_marathon::{AgentCommand, Anatomy, Episode, Marathon, RagdollState};
use marathon_envs::CommandRange;

/// Distance that counts as a walk, m, and turn that counts as one, rad.
const WALKED: f32 = 1.0;
const TURNED: f32 = 0.8;
/// Share of the greatest speed that counts as a run.
const RUNS: f32 = 0.65;
/// Upward speed of the root that counts as a jump, m/s, and height of its up axis that counts as head over heels.
const JUMPS: f64 = 0.9;
const UPSIDE_DOWN: f64 = -0.3;
/// Seconds after a press in which its jump or flip counts.
const CREDIT: f32 = 3.0;
/// Seconds that a prompt stays after it is done, then until the next one, and that one waits before another has its turn.
const STAYS: f32 = 0.5;
const PAUSE: f32 = 0.5;
const PATIENCE: f32 = 10.0;
/// Height of a glyph, points, and distance of the card from the lower edge as a share of the picture.
const HEIGHT: f32 = 28.0;
const LIFT: f32 = 0.16;

/// Something to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prompt {
    /// Walk.
    Walk,
    /// Turn to the right.
    Turn,
    /// Run.
    Run,
    /// Jump.
    Jump,
    /// Flip.
    Flip,
    /// Throw a ball.
    Throw,
}

impl Prompt {
    /// All prompts, in their order.
    pub const ALL: [Prompt; 6] = [Prompt::Walk, Prompt::Turn, Prompt::Run, Prompt::Jump, Prompt::Flip, Prompt::Throw];

    /// Its name on the screen.
    pub fn name(self) -> &'static str {
        match self {
            Prompt::Walk => "walk",
            Prompt::Turn => "turn",
            Prompt::Run => "run",
            Prompt::Jump => "jump",
            Prompt::Flip => "flip",
            Prompt::Throw => "throw a ball",
        }
    }

    /// The controls that are held together, for a device. None if the device has no control for it.
    pub fn glyphs(self, device: Device, bindings: &Bindings) -> Vec<Glyph> {
        let whats: &[Bindable] = match self {
            Prompt::Walk => &[Bindable::Steer(Steer::MoveAhead)],
            Prompt::Turn => &[Bindable::Steer(Steer::MoveRight)],
            Prompt::Run => &[Bindable::Steer(Steer::Run), Bindable::Steer(Steer::MoveAhead)],
            Prompt::Jump => &[Bindable::Steer(Steer::Jump)],
            Prompt::Flip => &[Bindable::Steer(Steer::Flip)],
            Prompt::Throw => &[Bindable::Action(Action::Throw)],
        };
        let rows = whats.iter().map(|what| bindings.row(*what));
        match (device, self) {
            (Device::Keyboard, _) => rows.map(|row| Glyph::Key(Press::Key(row.key).name())).collect(),
            (Device::Pad, Prompt::Walk) => vec![Glyph::Stick([0.0, 0.5])],
            (Device::Pad, Prompt::Turn) => vec![Glyph::Stick([0.5, 0.0])],
            (Device::Pad, Prompt::Run) => vec![Glyph::Stick([0.0, 1.0])],
            (Device::Pad, _) => {
                let buttons = rows.filter_map(|row| row.button);
                buttons.map(|button| Glyph::Button(button, Press::Button(button).name())).collect()
            }
        }
    }
}

/// The prompt on the screen, and what the player has done.
#[derive(Resource, Default)]
pub struct Prompts {
    done: [bool; 6],
    current: Option<Prompt>,
    /// Seconds that the current prompt is shown, or that none is.
    since: f32,
    /// Seconds since the current one was done.
    over: Option<f32>,
    progress: Progress,
}

/// How far the player is.
#[derive(Default)]
struct Progress {
    walked: f32,
    /// Heading when the prompt to turn came, rad.
    heading: Option<f64>,
    /// Seconds since each of the two buttons was pressed.
    pressed: [f32; 2],
}

impl Prompts {
    /// The prompt on the screen.
    pub fn current(&self) -> Option<Prompt> {
        self.current
    }

    /// Whether the player has done something.
    pub fn is_done(&self, prompt: Prompt) -> bool {
        self.done[prompt as usize]
    }

    /// Shows the first prompt that is possible and not done. One that waits too long lets another have its turn.
    fn choose(&mut self, possible: impl Fn(Prompt) -> bool, dt: f32) {
        self.since += dt;
        if let Some(current) = self.current {
            if self.is_done(current) {
                let over = self.over.unwrap_or(0.0) + dt;
                self.over = Some(over).filter(|over| *over < STAYS);
                if self.over.is_none() {
                    (self.current, self.since) = (None, 0.0);
                }
                return;
            }
            if possible(current) && self.since < PATIENCE {
                return;
            }
        } else if self.since < PAUSE {
            return;
        }
        let after = self.current.map_or(0, |current| current as usize + 1);
        let order = Prompt::ALL.iter().cycle().skip(after).take(Prompt::ALL.len());
        let next = order.copied().find(|prompt| possible(*prompt) && !self.is_done(*prompt));
        if next != self.current || self.since >= PATIENCE {
            (self.current, self.since, self.over) = (next, 0.0, None);
        }
        self.progress.heading = None;
    }
}

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Prompts>()
        .add_systems(Update, (notice, choose).chain().in_set(AppSet::Present))
        .add_systems(EguiPrimaryContextPass, draw.in_set(UiSet::Hud));
}

/// Speed, heading, upward speed and uprightness of the root.
struct Root {
    speed: f32,
    heading: f64,
    rises: f64,
    up: f64,
}

/// The root of a character in space; `None` for one in a plane.
fn root(marathon: &Marathon, key: &RagdollState) -> Option<Root> {
    let state = marathon.state(key)?;
    let [w, x, y, z] = *state.qpos.get(3..7)?.first_chunk::<4>()?;
    let [vx, vy, vz] = *state.qvel.get(..3)?.first_chunk::<3>()?;
    Some(Root {
        speed: vx.hypot(vy) as f32,
        heading: (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z)),
        rises: vz,
        up: 1.0 - 2.0 * (x * x + y * y),
    })
}

/// Notices what the player does.
fn notice(
    time: Res<Time<Virtual>>,
    (focus, steering): (Res<Focus>, Res<Steering>),
    marathon: Res<Marathon>,
    mut actions: MessageReader<ActionPressed>,
    mut prompts: ResMut<Prompts>,
    actors: Query<(&Actor, &Anatomy, &RagdollState, &AgentCommand)>,
) {
    let thrown = actions.read().filter(|action| action.0 == Action::Throw).count() > 0;
    let prompts = &mut *prompts;
    prompts.done[Prompt::Throw as usize] |= thrown;
    let actor = actors.iter().find(|(actor, ..)| actor.0 == focus.0 && steering.by_camera);
    let Some((_, anatomy, key, command)) = actor else { return };
    let ranges = anatomy.spec.as_ref().map_or(&[][..], |spec| &spec.command);
    let (Some(values), Some(root)) = (command.values(), root(&marathon, key)) else { return };
    let dt = time.delta_secs();
    let Prompts { done, progress, current, .. } = prompts;
    // a flip moves and turns, too
    let steers = ranges.iter().zip(values).any(|(range, value)| range.is_speed() && value.abs() > 0.1);
    if steers && root.speed > 0.3 {
        progress.walked += root.speed * dt;
    }
    done[Prompt::Walk as usize] |= progress.walked > WALKED;
    if steers && *current == Some(Prompt::Turn) {
        let from = *progress.heading.get_or_insert(root.heading);
        let turned = (root.heading - from).sin().atan2((root.heading - from).cos()).abs();
        done[Prompt::Turn as usize] |= turned as f32 > TURNED;
    }
    let fastest = ranges.iter().find(|range| range.is_speed()).map_or(f64::INFINITY, |range| range.high);
    done[Prompt::Run as usize] |= steers && root.speed > RUNS * fastest as f32;
    let buttons = ranges.iter().zip(values).filter(|(range, _)| range.is_button());
    for (since, (_, value)) in progress.pressed.iter_mut().zip(buttons) {
        *since = if *value > 0.5 { CREDIT } else { *since - dt };
    }
    done[Prompt::Jump as usize] |= progress.pressed[0] > 0.0 && root.rises > JUMPS && root.up > 0.0;
    done[Prompt::Flip as usize] |= progress.pressed[1] > 0.0 && root.up < UPSIDE_DOWN;
}

/// Chooses the prompt.
fn choose(
    time: Res<Time<Virtual>>,
    (settings, keys_for, steering): (Res<Settings>, Res<KeysFor>, Res<Steering>),
    (scenario, focus, bindings, device): (Res<Scenario>, Res<Focus>, Res<Bindings>, Res<DeviceInUse>),
    mut prompts: ResMut<Prompts>,
    actors: Query<(&Actor, &Anatomy, &Episode)>,
) {
    let actor = actors.iter().find(|(actor, ..)| actor.0 == focus.0);
    let ranges = actor.and_then(|(_, anatomy, _)| anatomy.spec.as_ref()).map_or(&[][..], |spec| &spec.command);
    let buttons = ranges.iter().filter(|range| CommandRange::is_button(range)).count();
    let useful = settings.interface.prompts
        && *keys_for == KeysFor::Game
        && matches!(scenario.mode, Mode::Watch | Mode::Push)
        && steering.by_camera
        && actor.is_some_and(|(.., episode)| !episode.down);
    let possible = |prompt: Prompt| {
        useful
            && !prompt.glyphs(device.device, &bindings).is_empty()
            && match prompt {
                Prompt::Jump => buttons > 0,
                Prompt::Flip => buttons > 1,
                _ => true,
            }
    };
    prompts.choose(possible, time.delta_secs());
}

/// Draws the prompt.
fn draw(
    mut contexts: EguiContexts,
    (hud, prompts): (Res<Hud>, Res<Prompts>),
    (settings, bindings, device): (Res<Settings>, Res<Bindings>, Res<DeviceInUse>),
) -> Result {
    let Some(prompt) = prompts.current.filter(|_| hud.on) else { return Ok(()) };
    let ctx = contexts.ctx_mut()?.clone();
    let lift = (LIFT * ctx.content_rect().height()).max(64.0);
    let area = Area::new(Id::new("prompt")).anchor(Align2::CENTER_BOTTOM, [0.0, -lift]).interactable(false);
    area.show(&ctx, |ui| {
        card().show(ui, |ui: &mut egui::Ui| {
            ui.horizontal(|ui| {
                for drawing in prompt.glyphs(device.device, &bindings) {
                    glyph(ui, drawing, settings.interface.pad_shapes, HEIGHT);
                }
                let done = if prompts.over.is_some() { "  \u{2714}" } else { "" };
                ui.label(text(18.0, TEXT, format!("{}{done}", prompt.name())));
            });
        });
    });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prompts_come_in_their_order_and_go_once_done() {
        let mut prompts = Prompts::default();
        let step = |prompts: &mut Prompts, seconds: f32| {
            (0..(seconds / 0.05) as usize).for_each(|_| prompts.choose(|prompt| prompt != Prompt::Flip, 0.05));
        };
        step(&mut prompts, 1.0);
        assert_eq!(prompts.current(), Some(Prompt::Walk));
        prompts.done[Prompt::Walk as usize] = true;
        step(&mut prompts, 0.2);
        assert_eq!(prompts.current(), Some(Prompt::Walk), "it shows that it is done");
        step(&mut prompts, 0.5);
        assert_eq!(prompts.current(), None, "a pause");
        step(&mut prompts, 0.6);
        assert_eq!(prompts.current(), Some(Prompt::Turn));
        // one that waits too long lets others have their turn, and one that is not possible does not come
        let mut seen = Vec::new();
        for _ in 0..60 {
            step(&mut prompts, 1.0);
            if prompts.current() != seen.last().copied() {
                seen.extend(prompts.current());
            }
        }
        assert!(seen.starts_with(&[Prompt::Turn, Prompt::Run, Prompt::Jump, Prompt::Throw, Prompt::Turn]), "{seen:?}");
        prompts.done = [true; 6];
        step(&mut prompts, 2.0);
        assert_eq!(prompts.current(), None);
    }
}
