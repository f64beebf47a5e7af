//! Results of a command tracking measurement as text and as a picture.

use super::{CommandTracking, EARLY, Minutes, PROMPT, SETTLED, STANDING, Stand, UP};
use crate::error::RunError;
use crate::report::chart::Chart;
use std::fmt::Write;
use std::path::Path;

impl CommandTracking {
    /// The results as tables.
    pub fn table(&self) -> String {
        // one function: the rows of a table in order
        let CommandTracking { agents, minutes, stand, .. } = self;
        let Minutes { without_fall, early_falls, falls_per_minute, velocity_error, settled_error, slide } = minutes;
        let Stand { still, falls, drift, speed } = stand;
        let number = |x: &Option<f64>, unit: &str| x.map_or("-".into(), |x| format!("{x:.2} {unit}"));
        let seconds = |time: &Option<f64>| number(time, "s");
        let mut out = format!(
            "a minute of random commands: {without_fall} of {agents} without a fall, {falls_per_minute:.2} falls per minute, \
             {early_falls} in the first {EARLY} s\n  \
             velocity {velocity_error:.2} m/s off, {settled_error:.2} from {SETTLED} s after a command on; soles slide {:.1} cm\n",
            1e2 * slide
        );
        let _ = write!(
            out,
            "standing on command for {STANDING} s: {still} of {agents} are still, {falls} fall; drift {}, parts {}\n\n\
             {:>14} {:>8} {:>8} {:>10} {:>10} {:>9}\n",
            number(drift, "m"),
            number(speed, "m/s"),
            "speed",
            "to 63 %",
            "to 90 %",
            "overshoot",
            "error",
            "falls"
        );
        for r in &self.responses {
            let _ = writeln!(
                out,
                "{:>5.2} to {:>5.2} {:>8} {:>8} {:>6.2} m/s {:>10} {:>2} of {:>3}",
                r.from,
                r.to,
                seconds(&r.to_63),
                seconds(&r.to_90),
                r.overshoot,
                number(&r.error, "m/s"),
                r.falls,
                r.agents
            );
        }
        for t in &self.turns {
            let _ = write!(
                out,
                "\nturns of {:.2} rad/s at {:.2} m/s: {:.2} rad/s at {:.2} m/s, {} of {} fall",
                t.turn, t.speed, t.reached_turn, t.reached_speed, t.falls, t.agents
            );
        }
        for j in &self.jumps {
            let _ = write!(
                out,
                "\njumping on command at {:.2} m/s: {} of {} are off the ground within {PROMPT} s, {} on the way up; half of them within {}, on the way up {}; {} high, {} fall",
                j.speed,
                j.prompt,
                j.agents,
                j.thrown,
                seconds(&j.latency),
                seconds(&j.thrown_latency),
                number(&j.height, "m"),
                j.falls
            );
        }
        if let Some(flip) = &self.backflip {
            let _ = write!(out, "\nbackflips on command: {} of {} land on their feet", flip.landed, flip.agents);
        }
        for p in &self.pushes {
            let _ = write!(
                out,
                "\npushed by {:.2} m/s: {} of {} fall, the others recover in {}",
                p.velocity,
                p.falls,
                p.agents,
                seconds(&p.recovery)
            );
        }
        for p in &self.players {
            let _ = write!(
                out,
                "\nplayer, {}: {} of {} fall, {:.2} falls per minute",
                p.name, p.falls, p.agents, p.falls_per_minute
            );
        }
        if let Some(r) = &self.rise {
            let _ = write!(
                out,
                "\npushed over: {} of {} are up again within {UP} s, half of them within {}",
                r.prompt,
                r.agents,
                seconds(&r.time)
            );
        }
        out
    }

    /// Draws the responses.
    ///
    /// # Errors
    /// If the picture cannot be written.
    pub fn draw(&self, path: &Path) -> Result<(), RunError> {
        let line = |r: &super::Response| {
            let points = r.speeds.iter().enumerate().map(|(i, speed)| ((i + 1) as f64 * self.dt, *speed));
            (format!("{} m/s, {} before", r.to, r.from), points.collect())
        };
        Chart::Times("median speed after a command, m/s", self.responses.iter().map(line).collect()).draw(path)
    }
}
