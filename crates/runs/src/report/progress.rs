//! Progress of a run on stderr: a bar in a terminal, otherwise a line now and then.

use crate::text::{duration, short, thousands};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use marathon_learn::IterationStats;
use std::io::{IsTerminal, Write, stderr};
use std::time::{Duration, Instant};

/// Seconds between two measurements of a run's speed.
const WINDOW: f64 = 1.0;

/// Shows progress.
pub struct Progress {
    bar: Option<ProgressBar>,
    total: u64,
    /// Steps between lines, and steps at which the next line is due.
    every: u64,
    due: u64,
    rate: Rate,
    shown: Episodes,
    waiting: Episodes,
    /// The task's metrics in the last iteration.
    metrics: String,
}

/// Means over episodes.
#[derive(Clone, Copy, Default)]
struct Episodes {
    count: f64,
    returns: f64,
    lengths: f64,
    speeds: f64,
}

/// Steps per second, recently and since the start.
struct Rate {
    start: (Instant, u64),
    last: (Instant, u64),
    recent: Option<f64>,
}

impl Rate {
    fn update(&mut self, steps: u64) {
        let (then, before) = self.last;
        let seconds = then.elapsed().as_secs_f64();
        if seconds >= WINDOW {
            self.recent = Some((steps - before) as f64 / seconds);
            self.last = (Instant::now(), steps);
        }
    }
    fn overall(&self, steps: u64) -> f64 {
        (steps - self.start.1) as f64 / self.start.0.elapsed().as_secs_f64().max(1e-9)
    }
}

/// A bar for `total` steps, if stderr is a terminal.
pub fn bar(total: u64) -> Option<ProgressBar> {
    stderr().is_terminal().then(|| {
        let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr_with_hz(10));
        let style = ProgressStyle::with_template("{wide_bar:.cyan/dim} {percent:>3}%  {msg}");
        bar.set_style(style.expect("the template is a constant").progress_chars("━╸─"));
        bar.enable_steady_tick(Duration::from_millis(200));
        bar
    })
}

impl Progress {
    /// Progress of a run of `total` steps, `done` of which are done.
    pub fn new(total: u64, done: u64, every: u64) -> Self {
        let bar = bar(total);
        if let Some(bar) = &bar {
            bar.set_position(done);
        }
        let start = (Instant::now(), done);
        let rate = Rate { start, last: start, recent: None };
        let (shown, waiting) = Default::default();
        Self { bar, total, every, due: done.saturating_add(every), rate, shown, waiting, metrics: String::new() }
    }

    /// Updates the display after an iteration.
    pub fn update(&mut self, stats: &IterationStats) {
        self.rate.update(stats.steps);
        self.waiting.add(stats);
        self.metrics = stats.metrics.iter().map(|(name, x)| format!("  {name} {x:.2}")).collect();
        match &self.bar {
            Some(bar) => {
                // enough episodes for a stable mean
                if self.waiting.count >= 32.0 || self.shown.count == 0.0 {
                    self.shown = std::mem::take(&mut self.waiting);
                }
                bar.set_position(stats.steps.min(self.total));
                bar.set_message(self.line(stats.steps));
            }
            None if stats.steps >= self.due => {
                self.due = (stats.steps / self.every + 1).saturating_mul(self.every);
                if self.waiting.count > 0.0 {
                    self.shown = std::mem::take(&mut self.waiting);
                }
                let of = format!("{} of {}", thousands(stats.steps), thousands(self.total));
                // stderr may be closed
                let _ = writeln!(stderr(), "{of:>25} steps  {}", self.line(stats.steps));
            }
            None => {}
        }
    }

    fn line(&self, steps: u64) -> String {
        let rate = self.rate.overall(steps);
        let left = self.total.saturating_sub(steps) as f64 / rate.max(1e-9);
        let rate = short(self.rate.recent.unwrap_or(rate));
        let Episodes { count, returns, lengths, speeds } = self.shown;
        let episodes = if count > 0.0 {
            let [r, l, v] = [returns, lengths, speeds].map(|x| x / count);
            format!("return {r:6.1}  length {l:4.0}  {v:5.2} m/s")
        } else {
            "no episode has ended yet".into()
        };
        format!("{rate:>6} steps/s  {episodes}{}  ETA {:>6}", self.metrics, duration(left))
    }

    /// Removes the bar.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Shows progress of a distillation: a bar in a terminal, otherwise a line now and then.
pub struct Rounds {
    bar: Option<ProgressBar>,
    total: u64,
    due: u64,
}

impl Rounds {
    /// Decisions between two lines without a terminal.
    const EVERY: u64 = 1_000_000;

    /// Progress of `total` decisions.
    pub fn new(total: u64) -> Self {
        Rounds { bar: bar(total), total, due: Self::EVERY }
    }

    /// Updates the display after a round. `loss` and `failures` are those of the round.
    pub fn update(&mut self, steps: u64, loss: f64, failures: f64) {
        let line = format!("loss {loss:.5}  failures {:.3} % of decisions", 100.0 * failures);
        match &self.bar {
            Some(bar) => {
                bar.set_position(steps);
                bar.set_message(line);
            }
            None if steps >= self.due => {
                self.due = (steps / Self::EVERY + 1).saturating_mul(Self::EVERY);
                // stderr may be closed
                let _ = writeln!(stderr(), "{:>12} of {} decisions  {line}", thousands(steps), thousands(self.total));
            }
            None => {}
        }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

impl Episodes {
    fn add(&mut self, stats: &IterationStats) {
        let n = stats.episodes as f64;
        if let (Some(r), Some(l), Some(v)) = (stats.learned.return_mean, stats.length_mean, stats.speed_mean) {
            self.count += n;
            self.returns += n * r;
            self.lengths += n * l;
            self.speeds += n * v;
        }
    }
}
