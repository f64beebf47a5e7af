//! What a study has found, and its files.

use super::Options;
use crate::console::note;
use crate::error::CliError;
use marathon_envs::ShardFactory;
use marathon_envs::registry;
use marathon_learn::{
    Control, EvalOptions, Evaluation, IterationStats, Players, Snapshot, TrainConfig, evaluate, train_with,
    write_atomic,
};
use marathon_physics::lanes::Isa;
use marathon_runs::report::chart::Chart;
use marathon_runs::text;
use serde::{Deserialize, Serialize};

/// A table with a picture.
#[derive(Serialize)]
pub struct Record {
    /// Name of the files and of the command.
    pub name: &'static str,
    /// Heading.
    pub title: &'static str,
    /// What was measured and how, a paragraph or more.
    pub about: String,
    /// Heads of the columns.
    pub columns: Vec<&'static str>,
    /// Cells, as they are written.
    pub rows: Vec<Vec<String>>,
    /// Words of the command beside seeds, steps and threads.
    pub words: String,
    /// Versions of other people's programs that took part.
    pub versions: Vec<String>,
    /// The picture.
    #[serde(skip)]
    pub chart: Chart,
}

/// Episodes that a policy is judged by.
pub const EPISODES: usize = 100;

/// One training.
#[derive(Serialize, Deserialize)]
pub struct Run {
    /// Steps and mean returns of the episodes on the way.
    pub curve: Vec<(f64, f64)>,
    /// Agent-steps, and seconds that passed and of all processors.
    pub steps: u64,
    pub wall: f64,
    pub cpu: f64,
    /// Agent-steps per second of time passed, without start and end of a program.
    pub rate: f64,
    /// The best actions at the end.
    pub eval: Evaluation,
}

impl Run {
    /// Mean return of the episodes that ended in the last tenth of the steps, with exploration.
    pub fn last_tenth(&self) -> f64 {
        let late = self.curve.iter().filter(|(x, _)| *x > 0.9 * self.steps as f64).map(|p| p.1);
        spread(late).0
    }

    /// Tells that it is done.
    pub fn note(&self, who: &str) {
        let Run { steps, wall, cpu, eval, .. } = self;
        note(format!(
            "{who}: {} steps, {wall:.1} s, {cpu:.1} s of processor time, return {:.0}, {:.2} m/s",
            text::thousands(*steps),
            eval.return_mean,
            eval.speed_mean
        ));
    }
}

/// Trains an agent and evaluates it.
///
/// # Errors
/// If it cannot be trained.
pub fn train_one(agent: &str, config: &TrainConfig) -> Result<Run, CliError> {
    train_on(&*registry::factory(agent, Isa::best())?, config, None)
}

/// Trains on environments, whose rollouts others may play, and evaluates the policy.
///
/// # Errors
/// If that fails.
pub fn train_on(
    factory: &dyn ShardFactory,
    config: &TrainConfig,
    players: Option<&mut dyn Players>,
) -> Result<Run, CliError> {
    let isa = Isa::best();
    let (mut curve, mut clocks) = (Vec::new(), (0, 0.0, 0.0));
    let mut observer = |stats: &IterationStats, _: &Snapshot<'_>| {
        clocks = (stats.steps, stats.wall_seconds, stats.cpu_seconds);
        curve.extend(stats.learned.return_mean.map(|mean| (stats.steps as f64, mean)));
        Control::Continue
    };
    let output = train_with(players, factory, isa, config, None, &mut observer)?;
    let options = EvalOptions { episodes: EPISODES, threads: config.run.threads, ..Default::default() };
    let eval = evaluate(factory, isa, &output.policy, &options)?;
    let (steps, wall, cpu) = clocks;
    let run = Run { curve, steps, wall, cpu, rate: steps as f64 / wall, eval };
    run.note(&format!("{} {} seed {}", factory.spec().id, config.algorithm.name(), config.run.seed));
    Ok(run)
}

/// One training for each seed.
///
/// # Errors
/// If one fails.
pub fn each_seed(seeds: u64, one: impl FnMut(u64) -> Result<Run, CliError>) -> Result<Vec<Run>, CliError> {
    (1..=seeds).map(one).collect()
}

/// Mean and standard deviation, of the population.
pub fn spread(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let n = values.clone().count().max(1) as f64;
    let mean = values.clone().sum::<f64>() / n;
    (mean, (values.map(|x| (x - mean) * (x - mean)).sum::<f64>() / n).sqrt())
}

/// `mean ± deviation`.
pub fn plus_minus((mean, deviation): (f64, f64), decimals: usize) -> String {
    format!("{mean:.decimals$} ± {deviation:.decimals$}")
}

/// The mean of curves at a number of places along the run, each curve being averaged between two of them.
pub fn mean_curve(runs: &[Run], total: u64) -> Vec<(f64, f64)> {
    const PLACES: usize = 100;
    let width = total as f64 / PLACES as f64;
    let at = |i: usize| {
        let (from, to) = (i as f64 * width, (i + 1) as f64 * width);
        let of_run = |run: &Run| {
            let near = run.curve.iter().filter(|(x, _)| (from..to).contains(x)).map(|p| p.1);
            let n = near.clone().count();
            (n > 0).then(|| near.sum::<f64>() / n as f64)
        };
        let known: Vec<f64> = runs.iter().filter_map(of_run).collect();
        (!known.is_empty()).then(|| (from + width / 2.0, known.iter().sum::<f64>() / known.len() as f64))
    };
    (0..PLACES).filter_map(at).collect()
}

impl Record {
    /// Writes the three files and returns the text of the page.
    ///
    /// # Errors
    /// If one cannot be written.
    pub fn save(&self, options: &Options) -> Result<String, CliError> {
        let out = &options.out;
        std::fs::create_dir_all(out).map_err(CliError::io(out, "create folder"))?;
        let file = |extension: &str| out.join(format!("{}.{extension}", self.name));

        let mut table = csv::Writer::from_writer(Vec::new());
        let path = file("csv");
        let bad = |e: csv::Error| CliError::file(&path, "table", e, "rows of equal length");
        table.write_record(&self.columns).map_err(bad)?;
        for row in &self.rows {
            table.write_record(row).map_err(bad)?;
        }
        let bytes = table.into_inner().map_err(|e| CliError::file(&path, "table", e, "a table in memory"))?;
        write_atomic(&path, &bytes)?;
        self.chart.draw(&file("png"))?;

        let line = |cells: Vec<&str>| format!("| {} |\n", cells.join(" | "));
        let mut text = format!("# {}\n\n{}\n\n", self.title, self.about.trim());
        text += &line(self.columns.clone());
        text += &line(vec!["---"; self.columns.len()]);
        for row in &self.rows {
            text += &line(row.iter().map(String::as_str).collect());
        }
        let Options { seeds, threads, .. } = options;
        let steps = options.steps.map_or(String::new(), |steps| format!(" --steps {steps}"));
        text += &format!(
            "\n![{}]({}.png)\n\n```sh\nmarathon study {} --seeds {seeds}{steps} --threads {threads}{}\n```\n\n\
             Marathon {}, {}, {} thread{}, instruction set {}{}. Seconds are processor time of all threads unless said \
             otherwise.\n",
            self.title,
            self.name,
            self.name,
            self.words,
            env!("CARGO_PKG_VERSION"),
            processor(),
            if *threads == 0 { "all".to_string() } else { threads.to_string() },
            if *threads == 1 { "" } else { "s" },
            Isa::best().name(),
            self.versions.iter().map(|v| format!("; {v}")).collect::<String>(),
        );
        write_atomic(&file("md"), text.as_bytes())?;
        Ok(text)
    }
}

/// Name of the processor, as far as the system tells.
fn processor() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    model.map_or_else(|| std::env::consts::ARCH.to_string(), |(_, name)| name.trim().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spreads_and_curves_are_means() {
        assert_eq!(spread([1.0, 3.0].into_iter()), (2.0, 1.0));
        assert_eq!(plus_minus((2.0, 1.04), 1), "2.0 ± 1.0");
        let run = |y: f64| Run {
            curve: vec![(1.0, y), (5.0, y + 2.0), (150.0, 7.0)],
            steps: 1000,
            wall: 1.0,
            cpu: 1.0,
            rate: 1000.0,
            eval: Evaluation::default(),
        };
        // ten steps a place: the first two points fall into one
        assert_eq!(mean_curve(&[run(0.0), run(2.0)], 1000), [(5.0, 2.0), (155.0, 7.0)]);
    }
}
