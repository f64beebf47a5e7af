//! Questions before something is lost: a key that would discard a policy asks first, and so does the end of the game.

use crate::app::input::actions::{Action, ActionPressed, ActionRequested};
use crate::app::input::bindings::Bindings;
use crate::app::input::rebind::RebindSet;
use crate::app::input::scripted;
use crate::app::mode::Mode;
use crate::app::ui::theme::{FAINT, TEXT, UiSet, text};
use bevy::ecs::system::SystemParam;
use bevy::prelude::*;
use bevy::window::WindowCloseRequested;
use bevy_egui::egui::{self, Align2, Button, Window};
use bevy_egui::{EguiContexts, EguiPrimaryContextPass};

/// A request that needs a confirmation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// An action.
    Action(Action),
    /// Start the selection in the menu.
    Start,
}

/// The question on the screen.
#[derive(Resource, Default)]
pub struct Question(pub Option<(Asked, String)>);

/// Results that could be lost now. [`ReportSet`] updates them in each frame.
#[derive(Resource, Clone, Copy, Debug, Default)]
pub struct AtStake {
    /// Seconds of training since the policy was saved.
    pub training: Option<f64>,
    /// Length of the recording that is being made, s.
    pub recording: Option<f64>,
    /// Whether the menu is open.
    pub menu: bool,
}

/// The systems that update [`AtStake`].
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ReportSet;

/// Discards the policies that are not saved: the user has agreed.
#[derive(Message, Clone, Copy, Debug, PartialEq, Eq)]
pub struct DiscardPolicy;

/// Starts the selection in the menu: the user has agreed.
#[derive(Message, Clone, Copy, Debug, PartialEq, Eq)]
pub struct StartConfirmed;

/// Adds the question without its window.
pub(in crate::app) fn gate_plugin(app: &mut App) {
    app.init_resource::<Question>()
        .init_resource::<AtStake>()
        .add_message::<DiscardPolicy>()
        .add_message::<StartConfirmed>()
        .configure_sets(PreUpdate, ReportSet.before(gate))
        .add_systems(PreUpdate, gate.after(RebindSet).after(scripted::request_actions));
}

/// Adds the window of the question.
pub(super) fn plugin(app: &mut App) {
    app.add_systems(EguiPrimaryContextPass, draw.in_set(UiSet::Windows));
}

impl AtStake {
    /// Describes an unsaved policy that is being trained.
    fn unsaved(&self) -> Option<String> {
        let seconds = self.training?;
        Some(format!("The policy has learned for {seconds:.0} s and is not saved."))
    }

    /// Describes what the end of the game would interrupt; `None` if there is nothing.
    pub fn at_the_end(&self) -> Option<String> {
        let recorded =
            self.recording.map(|seconds| format!("A recording of {seconds:.1} s is running. It will be saved."));
        let lines: Vec<String> = recorded.into_iter().chain(self.unsaved()).collect();
        (!lines.is_empty()).then(|| lines.join("\n"))
    }

    /// Describes what the menu's selection would discard.
    pub fn at_a_start(&self) -> Option<String> {
        self.unsaved()
    }

    /// Describes what an action would discard.
    fn of(&self, action: Action, learns: bool) -> Option<String> {
        match action {
            Action::Quit => self.at_the_end().or_else(|| self.menu.then(|| "The menu is open.".into())),
            Action::Learn | Action::Restart | Action::NextAgent if learns => self.unsaved(),
            _ => None,
        }
    }
}

/// An answer to the question.
enum Answer {
    Yes,
    Save,
    Back,
}

/// The messages that an answer sends.
#[derive(SystemParam)]
pub struct Answers<'w> {
    actions: MessageWriter<'w, ActionPressed>,
    discards: MessageWriter<'w, DiscardPolicy>,
    starts: MessageWriter<'w, StartConfirmed>,
}

impl Answers<'_> {
    fn send(&mut self, asked: Asked, answer: &Answer) {
        match answer {
            Answer::Back => return,
            Answer::Save => {
                self.actions.write(ActionPressed(Action::Save));
            }
            Answer::Yes => {}
        }
        // the trainer goes on: a policy that it makes after the answer is not saved
        self.discards.write(DiscardPolicy);
        match asked {
            Asked::Action(action) => {
                self.actions.write(ActionPressed(action));
            }
            Asked::Start => {
                self.starts.write(StartConfirmed);
            }
        }
    }
}

/// Passes on actions that lose nothing, and asks about the others. Pressing the same key again means yes, and the menu
/// key means no.
fn gate(
    mut requests: MessageReader<ActionRequested>,
    mut answers: Answers<'_>,
    mut question: ResMut<Question>,
    at_stake: Res<AtStake>,
    mode: Option<Res<State<Mode>>>,
) {
    let learns = mode.is_some_and(|mode| *mode == Mode::Learn);
    for ActionRequested(action) in requests.read() {
        match &question.0 {
            Some((asked, _)) => {
                let answer = match action {
                    Action::Menu => Answer::Back,
                    Action::Save => Answer::Save,
                    action if *asked == Asked::Action(*action) => Answer::Yes,
                    _ => {
                        answers.actions.write(ActionPressed(*action));
                        continue;
                    }
                };
                answers.send(*asked, &answer);
                question.0 = None;
            }
            None => match at_stake.of(*action, learns) {
                Some(text) => question.0 = Some((Asked::Action(*action), text)),
                None => {
                    answers.actions.write(ActionPressed(*action));
                }
            },
        }
    }
}

/// Draws the question.
pub fn draw(
    mut contexts: EguiContexts,
    mut question: ResMut<Question>,
    bindings: Res<Bindings>,
    at_stake: Res<AtStake>,
    mut answers: Answers<'_>,
) -> Result {
    let Some((asked, words)) = question.0.clone() else { return Ok(()) };
    // the policy may have been saved since the question appeared
    let savable = at_stake.unsaved().is_some();
    let (title, does) = match asked {
        Asked::Action(Action::Quit) => ("Quit?", "Quit"),
        _ => ("Go on?", "Go on"),
    };
    let key = |action: Action| format!("  ({})", bindings.key(action));
    let again = match asked {
        Asked::Action(action) => key(action),
        Asked::Start => String::new(),
    };
    let ctx = contexts.ctx_mut()?.clone();
    let mut answer = None;
    let window = Window::new(title).anchor(Align2::CENTER_CENTER, [0.0, 0.0]).collapsible(false).resizable(false);
    window.order(egui::Order::Foreground).show(&ctx, |ui| {
        ui.label(text(15.0, TEXT, words));
        ui.add_space(8.0);
        ui.horizontal_wrapped(|ui| {
            let focused = ui.memory(|memory| memory.focused());
            let mut ours = Vec::new();
            let mut offer = |label: String, choice: Answer| {
                let button = ui.add(Button::new(text(14.0, TEXT, label)));
                if button.clicked() {
                    answer = Some(choice);
                }
                ours.push(button);
            };
            if savable {
                offer(format!("Save first{}", key(Action::Save)), Answer::Save);
                offer(format!("{does} without saving{again}"), Answer::Yes);
            } else {
                offer(format!("{does}{again}"), Answer::Yes);
            }
            offer(format!("Back{}", key(Action::Menu)), Answer::Back);
            // a gamepad answers, too
            if !ours.iter().any(|button| Some(button.id) == focused)
                && let Some(last) = ours.last()
            {
                last.request_focus();
            }
        });
        if savable {
            ui.label(text(12.0, FAINT, "A saved policy plays again; its training does not go on."));
        }
    });
    if let Some(answer) = answer {
        question.0 = None;
        answers.send(asked, &answer);
    }
    Ok(())
}

/// The window's close button acts like the quit key. A second click quits and saves everything that can be saved.
pub fn close(
    mut requests: MessageReader<WindowCloseRequested>,
    mut question: ResMut<Question>,
    at_stake: Res<AtStake>,
    mut exit: MessageWriter<AppExit>,
) {
    if requests.read().count() == 0 {
        return;
    }
    let asked = matches!(question.0, Some((Asked::Action(Action::Quit), _)));
    match at_stake.at_the_end().filter(|_| !asked) {
        Some(text) => question.0 = Some((Asked::Action(Action::Quit), text)),
        None => {
            info!("bye");
            exit.write(AppExit::Success);
        }
    }
}
