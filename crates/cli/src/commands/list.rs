//! `marathon list`: all agents, or one of them.

use crate::error::CliError;
use marathon_envs::{CommandRange, ObsGroup, OptionInfo, registry};
use marathon_physics::lanes::Isa;
use marathon_runs::terminal::{print_json, say};
use marathon_runs::{TaskConfig, TaskOptions, recipe};
use serde::Serialize;

/// Information about an agent.
#[derive(Serialize)]
struct Entry {
    id: String,
    summary: String,
    observation: usize,
    /// Parts of the observation, with their first index and the index after the last.
    observations: Vec<Part>,
    action: usize,
    action_names: Vec<String>,
    /// Seconds between decisions.
    dt: f64,
    frame_skip: usize,
    max_episode_steps: usize,
    reward_terms: Vec<String>,
    info: Vec<String>,
    /// Metrics of the task.
    metrics: Vec<String>,
    /// Its command.
    command: Vec<Order>,
    /// Lowest and highest action per actuator; null without bounds.
    action_range: Vec<[Option<f32>; 2]>,
    options: Vec<Argument>,
    /// Stages of its recipe, if it has one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    recipe: Vec<String>,
    /// Facts that the task derives from its model, for tasks that take any model.
    #[serde(skip_serializing_if = "Option::is_none")]
    findings: Option<String>,
}

/// A part of an observation.
#[derive(Serialize)]
struct Part {
    name: String,
    range: [usize; 2],
}

/// A number of an agent's command.
#[derive(Serialize)]
struct Order {
    name: String,
    range: [f64; 2],
    unit: String,
}

/// An option of an agent.
#[derive(Serialize)]
struct Argument {
    name: &'static str,
    default: String,
    expected: &'static str,
    about: &'static str,
}

/// Lists the agents, or shows all about one.
///
/// # Errors
/// If the agent does not exist, does not have such options, or cannot be simulated.
pub fn run(agent: Option<&str>, options: &TaskOptions, json: bool) -> Result<(), CliError> {
    let ids = match agent {
        Some(name) => vec![name.into()],
        None => registry::ids(),
    };
    let entries = ids.iter().map(|id| entry(id, options)).collect::<Result<Vec<_>, _>>()?;
    match (&entries[..], agent) {
        _ if json => print_json(&serde_json::json!({ "agents": entries })),
        ([entry], Some(_)) => tell(entry),
        _ => table(&entries),
    }
    Ok(())
}

/// Collects the information about an agent with options, by any of its names.
fn entry(name: &str, options: &TaskOptions) -> Result<Entry, CliError> {
    // a task with options derives the facts of a robot again
    let agent = if options.given.is_empty() {
        registry::agent(name)?
    } else {
        let task = TaskConfig::named(name)?.with(options)?;
        registry::agent(&task.agent)?.with_options(&task.options)?
    };
    let factory = agent.clone().shards(Isa::best())?;
    let spec = factory.spec();
    let range = |(low, high): (&f32, &f32)| [finite(*low), finite(*high)];
    let part = |group: &ObsGroup| Part { name: group.name.clone(), range: [group.range.start, group.range.end] };
    let order = |c: &CommandRange| Order { name: c.name.clone(), range: [c.low, c.high], unit: c.unit.clone() };
    Ok(Entry {
        id: agent.facts().id,
        summary: agent.facts().summary,
        observation: spec.obs,
        observations: spec.observations.iter().map(part).collect(),
        action: spec.act,
        action_names: spec.action_names.clone(),
        dt: spec.dt,
        frame_skip: spec.frame_skip,
        max_episode_steps: spec.max_episode_steps,
        reward_terms: spec.reward_terms.clone(),
        info: spec.info.clone(),
        metrics: spec.metrics.iter().map(|metric| metric.name.clone()).collect(),
        command: spec.command.iter().map(order).collect(),
        action_range: spec.action_low.iter().zip(&spec.action_high).map(range).collect(),
        options: agent.options().into_iter().map(argument).collect(),
        recipe: recipe::of_task(name)
            .map_or_else(Vec::new, |recipe| recipe.stages.into_iter().map(|stage| stage.name).collect()),
        findings: agent.findings(),
    })
}

/// Prints a line per agent.
fn table(entries: &[Entry]) {
    let width = entries.iter().map(|e| e.id.len()).max().unwrap_or(0);
    say(format!("{:width$}  observation  action  decisions/s  episode", "agent"));
    for e in entries {
        let (rate, seconds) = (1.0 / e.dt, e.dt * e.max_episode_steps as f64);
        say(format!(
            "{:width$}  {:>11}  {:>6}  {rate:>11.0}  {seconds:>5.0} s   {}",
            e.id, e.observation, e.action, e.summary
        ));
    }
    say(
        "\nCase does not matter in names; without a version they mean the lowest. `marathon list AGENT` shows one in detail.",
    );
}

/// Prints all about an agent.
fn tell(e: &Entry) {
    say(format!("{}: {}", e.id, e.summary));
    let (rate, seconds) = (1.0 / e.dt, e.dt * e.max_episode_steps as f64);
    say(format!("{rate:.0} decisions/s, episodes of {seconds:.0} s\n\nobservation"));
    for Part { name, range: [start, end] } in &e.observations {
        say(format!("  {:>9}  {name}", format!("{start}..{end}")));
    }
    say("action");
    for (name, [low, high]) in e.action_names.iter().zip(&e.action_range) {
        let end = |x: &Option<f32>| x.map_or("any".to_string(), |x| x.to_string());
        say(format!("  {:>9}  {name}", format!("{}..{}", end(low), end(high))));
    }
    if !e.command.is_empty() {
        say("command");
    }
    for Order { name, range, unit } in &e.command {
        let [low, high] = range.map(short);
        say(format!("  {:>9}  {name} {unit}", format!("{low}..{high}")).trim_end());
    }
    for (what, names) in [("reward", &e.reward_terms), ("info", &e.info), ("metrics", &e.metrics)] {
        if !names.is_empty() {
            say(format!("{what}\n  {}", names.join(", ")));
        }
    }
    if !e.recipe.is_empty() {
        say(format!("stages of its recipe\n  {}", e.recipe.join(", ")));
    }
    if let Some(findings) = &e.findings {
        say("found in the model");
        findings.lines().for_each(|line| say(format!("  {line}")));
    }
    if !e.options.is_empty() {
        say("options");
    }
    for Argument { name, default, about, .. } in &e.options {
        say(format!("  {name} = {default}\n      {about}"));
    }
}

fn argument(info: OptionInfo) -> Argument {
    let OptionInfo { name, value, expected, about, .. } = info;
    Argument { name, default: value.to_string(), expected, about }
}

/// A number with at most three decimals.
fn short(x: f64) -> f64 {
    // no negative zero
    (1e3 * x).round() / 1e3 + 0.0
}

/// JSON has no infinities.
fn finite(x: f32) -> Option<f32> {
    x.is_finite().then_some(x)
}
