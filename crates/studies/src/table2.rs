//! Table 2: training on the processor and on a GPU.

use crate::args::Options;
use crate::error::StudyError;
use crate::peers::{self, Sb3};
use crate::record::Record;
use crate::statistics::{plus_minus, spread};
use crate::table3::ppo2;
use crate::training::{Run, each_seed, train_one};
use marathon_learn::TrainConfig;
use marathon_runs::report::chart::Chart;

const AGENT: &str = "Hopper-v0";
/// Algorithms, and the paper's times on the processor and on the GPU. The rows of an algorithm share all settings.
const ALGORITHMS: [(Sb3, &str, &str); 2] = [(Sb3::Ppo, "475 s", "1423 s (300%)"), (Sb3::A2c, "291 s", "458 s (158%)")];

/// Trains each seed of each case, also on a GPU if PyTorch finds one.
///
/// # Errors
/// If that fails.
pub fn run(options: &Options) -> Result<Record, StudyError> {
    let gpu = peers::gpu()?;
    let (mut rows, mut bars, mut versions) = (Vec::new(), Vec::new(), Vec::new());
    let wall = |runs: &[Run]| spread(runs.iter().map(|r| r.wall));
    let cpu = |runs: &[Run]| plus_minus(spread(runs.iter().map(|r| r.cpu)), 1);
    for (algorithm, on_cpu, on_gpu) in ALGORITHMS {
        let mut config = if algorithm == Sb3::Ppo { ppo2() } else { TrainConfig::a2c() };
        (config.run.total_steps, config.run.threads) = (options.steps(), options.threads);
        let ours = each_seed(options.seeds, |seed| {
            config.run.seed = seed;
            train_one(AGENT, &config)
        })?;
        let mut theirs = |device| {
            each_seed(options.seeds, |seed| {
                let (run, version) =
                    peers::sb3((AGENT, algorithm), (device, 0.0), (seed, options.steps()), options.keep.as_deref())?;
                versions = vec![version];
                Ok(run)
            })
        };
        let there = theirs("cpu")?;
        let there_gpu = if gpu.is_some() { Some(theirs("cuda")?) } else { None };
        let gpu_cell = |runs: &Option<Vec<Run>>| match runs {
            Some(runs) => format!("{} ({:.0}%)", plus_minus(wall(runs), 1), 100.0 * wall(runs).0 / wall(&there).0),
            None => "no GPU here".into(),
        };
        let name = algorithm.name();
        rows.push(vec![
            format!("Stable-Baselines3's {name}"),
            cpu(&there),
            plus_minus(wall(&there), 1),
            gpu_cell(&there_gpu),
            on_cpu.into(),
            on_gpu.into(),
        ]);
        rows.push(vec![
            format!("Marathon's {name}"),
            cpu(&ours),
            plus_minus(wall(&ours), 1),
            "runs on processors only".into(),
            String::new(),
            String::new(),
        ]);
        bars.push((format!("Stable-Baselines3's {name}"), wall(&there).0));
        bars.push((format!("Marathon's {name}"), wall(&ours).0));
    }
    Ok(Record {
        name: "table2",
        title: "Table 2: processor and GPU",
        about: format!(
            "Seconds to train Hopper-v0 with the settings of OpenAI Baselines, sixteen agents, and networks of two layers \
             of 64: the same environments, agents, decisions, minibatches and passes in both trainers, one thread. The \
             paper found training on the processor to be faster with every trainer that it tried; its percentages are of \
             the time on the processor. GPU: {}.",
            gpu.unwrap_or_else(|| {
                "none, so that the column is empty; with one that PyTorch can use, the same command fills it".into()
            })
        ),
        columns: vec![
            "trainer",
            "processor: seconds of processor time",
            "processor: seconds passed",
            "GPU: seconds passed",
            "paper, processor",
            "paper, GPU",
        ],
        rows,
        words: String::new(),
        versions,
        chart: Chart::Bars("seconds passed on the processor", bars),
    })
}
