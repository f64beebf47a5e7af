//! `marathon distill`: distills several policies into one.

use crate::args::DistillArgs;
use crate::error::CliError;
use crate::program;
use cpu_time::ProcessTime;
use marathon_learn::Control;
use marathon_runs::distill::{Distilled, resumable};
use marathon_runs::report::progress::Rounds;
use marathon_runs::terminal::{interrupt, note, print_json, say};
use marathon_runs::{TaskConfig, output, policy_file, text};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Output of `--json`.
#[derive(Serialize)]
struct Report {
    #[serde(serialize_with = "text::path_json")]
    out: PathBuf,
    agent: String,
    teachers: usize,
    steps: u64,
    cpu_seconds: f64,
    loss: f64,
    failures: f64,
}

/// Distills the teachers into one policy and writes it. A file next to the policy stores the state for resuming. It is
/// deleted when the policy is complete.
///
/// # Errors
/// If a file is not a policy, a teacher does not fit the task, or the policy cannot be written.
/// [`CliError::Interrupted`] after Ctrl-C, with the current policy written.
pub fn run(args: &DistillArgs, json: bool) -> Result<(), CliError> {
    let read: Vec<&PathBuf> = args.teachers.iter().chain(&args.options.initialize_from).collect();
    output::check(&args.out, &policy_file::ENDINGS, &read)?;
    args.options.validate()?;
    let notes = notes(&args.out);
    let task = TaskConfig::named(&args.agent)?.with(&args.task)?;
    task.check_model(&args.agent, &args.task)?;
    // a missing file is found before the first line
    args.teachers.iter().try_for_each(|teacher| policy_file::read(teacher, None).map(drop))?;
    let options = &args.options;
    interrupt::install("finishing this round and writing the policy")?;
    let verb = if notes.exists() { "continuing" } else { "learning" };
    note(format!(
        "{verb} {} from {}: {} decisions, seed {}",
        task.agent,
        text::counted(args.teachers.len(), "teacher"),
        text::thousands(options.steps),
        options.seed
    ));
    let (mut progress, mut last) = (Rounds::new(options.steps), None);
    let start = ProcessTime::try_now().ok();
    let policy = resumable(task, &args.teachers, options, Some(&notes), &mut |now: &Distilled| {
        last = Some(*now);
        progress.update(now.steps, now.loss, now.failures);
        if interrupt::requested() { Control::Stop } else { Control::Continue }
    })?;
    progress.finish();
    let cpu_seconds = start.map_or(0.0, |start| start.elapsed().as_secs_f64());
    policy_file::save(&policy, &args.out)?;
    let Distilled { steps, loss, failures } = last.unwrap_or(Distilled { steps: 0, loss: 0.0, failures: 0.0 });
    let agent = policy.meta().agent.clone();
    let report =
        Report { out: args.out.clone(), agent, teachers: args.teachers.len(), steps, cpu_seconds, loss, failures };
    if json {
        print_json(&report);
    }
    if interrupt::requested() {
        let (done, out) = (text::thousands(steps), text::path_word(&args.out));
        let advice = format!("{out} holds the current policy, and the same command continues");
        return Err(CliError::Interrupted(format!("{done} decisions are done; {advice}")));
    }
    // the policy is complete
    let _ = std::fs::remove_file(&notes);
    if !json {
        let out = text::path_word(&args.out);
        say(format!("wrote {out}: {} decisions, loss {loss:.5}", text::thousands(steps)));
        say(format!("measure it by    {} eval {out}", program::name()));
    }
    Ok(())
}

/// The file next to the policy that stores the progress.
fn notes(out: &Path) -> PathBuf {
    let mut name = out.file_name().unwrap_or_default().to_os_string();
    name.push(".unfinished");
    out.with_file_name(name)
}
