//! Questions before something is lost: a key that would end a recording or throw away a policy asks first.

use crate::app::args::Mode;
use crate::app::hud::{FAINT, TEXT, text};
use crate::app::keys::{Bindings, Deed, Do, Pressed};
use crate::app::learn::Lesson;
use crate::app::menu::Menu;
use crate::app::replay::Recorder;
use crate::app::show::Show;
use bevy::ecs::system::SystemParam;
use bevy::prelude::*;
use bevy::window::WindowCloseRequested;
use bevy_egui::EguiContexts;
use bevy_egui::egui::{self, Align2, Button, Window};

/// An action that needs a confirmation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// The action of a key.
    Deed(Deed),
    /// Start the selection in the menu.
    Start,
}

/// The question on the screen.
#[derive(Resource, Default)]
pub struct Question(pub Option<(Asked, String)>);

/// The results that an action could lose.
#[derive(SystemParam)]
pub struct Stakes<'w> {
    lesson: Option<Res<'w, Lesson>>,
    recorder: Option<Res<'w, Recorder>>,
}

impl Stakes<'_> {
    /// Describes an unsaved policy that is being trained.
    fn unsaved(&self) -> Option<String> {
        let seconds = self.lesson.as_ref()?.unsaved()?;
        Some(format!("The policy has learned for {seconds:.0} s and is not saved."))
    }

    /// Describes the results that quitting would interrupt; `None` if there are none.
    pub fn at_the_end(&self) -> Option<String> {
        let recorded = self.recorder.as_ref().map(|recorder| {
            let seconds = recorder.seconds();
            format!("A recording of {seconds:.1} s is running. It will be saved.")
        });
        let lines: Vec<String> = recorded.into_iter().chain(self.unsaved()).collect();
        (!lines.is_empty()).then(|| lines.join("\n"))
    }

    /// Describes the results that the menu's selection would discard.
    pub fn at_a_start(&self) -> Option<String> {
        self.unsaved()
    }

    /// Describes the results that an action would discard while the menu is open and while a policy is being trained.
    fn of(&self, deed: Deed, menu: bool, learns: bool) -> Option<String> {
        match deed {
            Deed::Quit => self.at_the_end().or_else(|| menu.then(|| "The menu is open.".into())),
            Deed::Learn | Deed::Restart | Deed::NextAgent if learns => self.unsaved(),
            _ => None,
        }
    }

    /// Allows unsaved results to be discarded.
    fn discard(&self) {
        if let Some(lesson) = &self.lesson {
            lesson.discard();
        }
    }
}

/// An answer to the question.
enum Answer {
    Yes,
    Save,
    Back,
}

/// Passes on actions that lose nothing, and asks about the others. Pressing the same key again means yes, and the menu
/// key means no.
pub fn gate(
    mut pressed: MessageReader<Pressed>,
    mut deeds: MessageWriter<Do>,
    mut question: ResMut<Question>,
    stakes: Stakes<'_>,
    show: Option<Res<Show>>,
    mut menu: Option<ResMut<Menu>>,
) {
    let learns = show.is_some_and(|show| show.mode == Mode::Learn);
    for Pressed(deed) in pressed.read() {
        let open = menu.as_ref().is_some_and(|menu| menu.open);
        match &question.0 {
            Some((asked, _)) => {
                let answer = match deed {
                    Deed::Menu => Answer::Back,
                    Deed::Save => Answer::Save,
                    deed if *asked == Asked::Deed(*deed) => Answer::Yes,
                    _ => {
                        deeds.write(Do(*deed));
                        continue;
                    }
                };
                let asked = *asked;
                question.0 = None;
                settle(asked, &answer, &stakes, &mut deeds, menu.as_deref_mut());
            }
            None => match stakes.of(*deed, open, learns) {
                Some(text) => question.0 = Some((Asked::Deed(*deed), text)),
                None => {
                    deeds.write(Do(*deed));
                }
            },
        }
    }
}

fn settle(
    asked: Asked,
    answer: &Answer,
    stakes: &Stakes<'_>,
    deeds: &mut MessageWriter<'_, Do>,
    menu: Option<&mut Menu>,
) {
    match answer {
        Answer::Back => return,
        Answer::Save => {
            deeds.write(Do(Deed::Save));
        }
        Answer::Yes => stakes.discard(),
    }
    match (asked, menu) {
        (Asked::Deed(deed), _) => {
            deeds.write(Do(deed));
        }
        (Asked::Start, Some(menu)) => menu.agreed = true,
        (Asked::Start, None) => {}
    }
}

/// Draws the question.
pub fn draw(
    mut contexts: EguiContexts,
    mut question: ResMut<Question>,
    bindings: Res<Bindings>,
    stakes: Stakes<'_>,
    mut deeds: MessageWriter<Do>,
    mut menu: ResMut<Menu>,
) -> Result {
    let Some((asked, words)) = question.0.clone() else { return Ok(()) };
    // the results may have been saved since the question appeared
    let savable = stakes.unsaved().is_some();
    let (title, does) = match asked {
        Asked::Deed(Deed::Quit) => ("Quit?", "Quit"),
        _ => ("Go on?", "Go on"),
    };
    let key = |deed: Deed| format!("  ({})", bindings.key(deed));
    let again = match asked {
        Asked::Deed(deed) => key(deed),
        Asked::Start => String::new(),
    };
    let ctx = contexts.ctx_mut()?.clone();
    let mut answer = None;
    let window = Window::new(title).anchor(Align2::CENTER_CENTER, [0.0, 0.0]).collapsible(false).resizable(false);
    window.order(egui::Order::Foreground).show(&ctx, |ui| {
        ui.label(text(15.0, TEXT, words));
        ui.add_space(8.0);
        ui.horizontal(|ui| {
            let mut offer = |label: String, choice: Answer| {
                if ui.add(Button::new(text(14.0, TEXT, label))).clicked() {
                    answer = Some(choice);
                }
            };
            if savable {
                offer(format!("Save first{}", key(Deed::Save)), Answer::Save);
                offer(format!("{does} without saving{again}"), Answer::Yes);
            } else {
                offer(format!("{does}{again}"), Answer::Yes);
            }
            offer(format!("Back{}", key(Deed::Menu)), Answer::Back);
        });
        if savable {
            ui.label(text(12.0, FAINT, "A saved policy plays again; its training does not go on."));
        }
    });
    if let Some(answer) = answer {
        question.0 = None;
        settle(asked, &answer, &stakes, &mut deeds, Some(&mut *menu));
    }
    Ok(())
}

/// The window's close button acts like the quit key. A second click quits and saves everything that can be saved.
pub fn close(
    mut requests: MessageReader<WindowCloseRequested>,
    mut question: ResMut<Question>,
    stakes: Stakes<'_>,
    mut exit: MessageWriter<AppExit>,
) {
    if requests.read().count() == 0 {
        return;
    }
    let asked = matches!(question.0, Some((Asked::Deed(Deed::Quit), _)));
    match stakes.at_the_end().filter(|_| !asked) {
        Some(text) => question.0 = Some((Asked::Deed(Deed::Quit), text)),
        None => {
            info!("bye");
            exit.write(AppExit::Success);
        }
    }
}
