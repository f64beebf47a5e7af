//! Assault courses: a policy runs, one leads a runner oneself, or one builds the ground ahead of a policy. Runs that have ended
//! enter the [table](table) of the longest.

mod builder;
mod choice;
mod runs;
mod screen;
mod table;

pub use builder::{MOST_STEPS, Site, Step, builds};
pub use choice::{Choice, Part, check, choose, has_own, suit, suits};
pub use runs::{Runs, check as check_table};
pub use screen::List;
pub use table::{Course, KEPT, Place, ROWS, Run, Table, default_path, listing};

use crate::app::args::{Args, Mode};
use crate::app::show::Show;
use crate::app::weather::Weather;
use crate::plugin::MarathonSystems;
use bevy::prelude::*;

/// Everything about assault courses but the picture's text.
pub(super) fn lay_out(app: &mut App, args: &Args) {
    app.insert_resource(Runs::new(args))
        .init_resource::<Step>()
        .init_resource::<List>()
        .add_systems(FixedUpdate, (runs::follow, runs::referee).chain().after(MarathonSystems::Report))
        .add_systems(Update, (enter, builder::choose, builder::hold, screen::obey, screen::play).chain())
        .add_systems(PostUpdate, builder::mark.after(TransformSystems::Propagate));
}

pub(super) use screen::{card, list};

/// A course begins as it is: nobody has changed gravity, and no step is chosen.
fn enter(show: Res<Show>, mut weather: ResMut<Weather>, mut step: ResMut<Step>, mut runs: ResMut<Runs>) {
    if !show.is_changed() || show.mode != Mode::Course {
        return;
    }
    weather.set_if_neq(Weather::default());
    step.set_if_neq(Step::default());
    runs.enter(&show);
}
