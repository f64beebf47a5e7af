//! `marathon export` and `marathon import`: policies to and from ONNX.

use crate::args::{ExportArgs, ImportArgs};
use crate::error::CliError;
use marathon_learn::Policy;
use marathon_runs::terminal::{print_json, say};
use marathon_runs::text::{ancestor, path_word};
use marathon_runs::{TaskOptions, output, policy_file};
use std::path::Path;

/// Writes a policy as ONNX.
///
/// # Errors
/// If there is no such policy, or the file cannot be written.
pub fn export(args: &ExportArgs, json: bool) -> Result<(), CliError> {
    let out = match &args.out {
        Some(out) => out.clone(),
        None if args.policy.is_dir() => args.policy.join("policy.onnx"),
        None => args.policy.with_extension("onnx"),
    };
    output::check(&out, &["onnx"], &[&args.policy])?;
    let (policy, _) = policy_file::load(&args.policy, None, &TaskOptions::default())?;
    save(&policy, &[&args.policy], &out)?;
    tell(&policy, &out, json);
    Ok(())
}

/// Converts an ONNX file to a policy, or rewrites a policy for other options or with a checksum.
///
/// # Errors
/// If the network in the file cannot be a policy of the agent, or the policy cannot be written.
pub fn import(args: &ImportArgs, json: bool) -> Result<(), CliError> {
    let out = match &args.out {
        Some(out) => out.clone(),
        None if policy_file::is_onnx(&args.network) => args.network.with_extension("safetensors"),
        None => {
            return Err(CliError::Usage(format!(
                "--out is missing, expected a file for the policy of {}",
                path_word(&args.network)
            )));
        }
    };
    output::check(&out, &policy_file::ENDINGS, &[&args.network])?;
    let policy = policy_file::load_unsealed(&args.network, args.agent.as_deref(), &args.task)?;
    save(&policy, &[&args.network], &out)?;
    tell(&policy, &out, json);
    Ok(())
}

/// Writes the policy made from `inputs`, files or folders of runs, whose policies are kept.
pub fn save(policy: &Policy, inputs: &[&Path], out: &Path) -> Result<(), CliError> {
    output::check(out, &policy_file::ENDINGS, inputs)?;
    Ok(policy_file::save(policy, out)?)
}

/// Prints a line about the written policy.
pub fn tell(policy: &Policy, out: &Path, json: bool) {
    let meta = policy.meta();
    if json {
        print_json(&serde_json::json!({
            "out": out.to_string_lossy(), "agent": meta.agent, "observation": meta.obs, "action": meta.act, "hidden": meta.hidden,
            "activation": meta.activation, "lineage": meta.lineage,
        }));
    } else {
        let layers: Vec<String> = meta.hidden.iter().map(|n| n.to_string()).collect();
        let network = format!("{} -> {} -> {}", meta.obs, layers.join(" -> "), meta.act).replace(">  ->", ">");
        say(format!("wrote {}: {}, {network}, {}", path_word(out), meta.agent, meta.activation.name()));
        meta.lineage.iter().for_each(|stage| say(format!("  stage {}", ancestor(stage))));
    }
}
