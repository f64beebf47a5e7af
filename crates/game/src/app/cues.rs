//! What is done at given times, as if keys had been pressed: films of pushes and balls that anyone can make again.

use crate::app::keys::{Deed, Pressed};
use bevy::prelude::*;
use clap::ValueEnum;
use marathon_physics::hint::among;
use std::str::FromStr;

/// A deed at a time: `2.5:throw` on the command line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cue {
    /// Seconds since the start, of the picture's time: pauses and speeds do not change it.
    pub seconds: f32,
    /// What is done.
    pub deed: Deed,
}

impl FromStr for Cue {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (seconds, name) = text.split_once(':').ok_or("expected seconds and a deed, such as 2.5:throw")?;
        let number = seconds.parse().ok().filter(|s: &f32| s.is_finite() && *s >= 0.0);
        let seconds = number.ok_or_else(|| format!("'{seconds}' is no number of seconds, expected one such as 2.5"))?;
        if let Ok(deed) = Deed::from_str(name, true) {
            return Ok(Cue { seconds, deed });
        }
        let values = Deed::value_variants().iter().filter_map(Deed::to_possible_value);
        let names: Vec<String> = values.map(|value| value.get_name().to_string()).collect();
        Err(format!("there is no '{name}'{}", among(name, &names)))
    }
}

/// The cues that are still to come, the last first.
#[derive(Resource)]
pub struct Cues(Vec<Cue>);

impl Cues {
    /// Cues in any order.
    pub fn new(mut cues: Vec<Cue>) -> Self {
        // a stable sort of the reversed keeps the order of those at the same time
        cues.reverse();
        cues.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
        Cues(cues)
    }
}

/// Does what is due.
pub fn perform(time: Res<Time<Real>>, mut cues: ResMut<Cues>, mut pressed: MessageWriter<Pressed>) {
    while let Some(cue) = cues.0.pop_if(|cue| cue.seconds <= time.elapsed_secs()) {
        pressed.write(Pressed(cue.deed));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cues_are_read() {
        let cue = |seconds, deed| Cue { seconds, deed };
        assert_eq!("2.5:throw".parse(), Ok(cue(2.5, Deed::Throw)));
        assert_eq!("0:next-agent".parse(), Ok(cue(0.0, Deed::NextAgent)));
        for (text, part) in [
            ("throw", "2.5:throw"),
            ("x:throw", "'x' is no number"),
            ("-1:throw", "'-1' is no number"),
            ("1:thorw", "did you mean 'throw'"),
        ] {
            let error = text.parse::<Cue>().expect_err(text);
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn each_comes_once_in_its_order() {
        let cue = |seconds, deed| Cue { seconds, deed };
        let mut app = App::new();
        app.init_resource::<Time<Real>>().add_message::<Pressed>().add_systems(Update, perform);
        let cues = vec![cue(2.0, Deed::Quit), cue(1.0, Deed::Push), cue(1.0, Deed::Throw)];
        app.insert_resource(Cues::new(cues));
        let mut done = Vec::new();
        for _ in 0..5 {
            app.world_mut().resource_mut::<Time<Real>>().advance_by(std::time::Duration::from_millis(500));
            app.update();
            done.push(app.world_mut().resource_mut::<Messages<Pressed>>().drain().map(|d| d.0).collect::<Vec<_>>());
        }
        assert_eq!(done, [vec![], vec![Deed::Push, Deed::Throw], vec![], vec![Deed::Quit], vec![]]);
    }
}
