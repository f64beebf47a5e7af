//! `marathon skin`: a skin for a character.

use crate::args::SkinArgs;
use crate::error::CliError;
use crate::motion::model;
use marathon_learn::write_atomic;
use marathon_runs::output;
use marathon_runs::terminal::{print_json, say};
use marathon_runs::text::path_word;
use marathon_skin::{MAX_TRIANGLES, MIN_TRIANGLES, Options, skin};
use serde_json::json;

/// Generates the skin of a model and writes it.
///
/// # Errors
/// If there is no such model, it has no suitable geoms, or the file cannot be written.
pub fn run(args: &SkinArgs, json: bool) -> Result<(), CliError> {
    if !(MIN_TRIANGLES..=MAX_TRIANGLES).contains(&args.triangles) {
        let found = args.triangles;
        return Err(CliError::Usage(format!("--triangles is {found}, expected {MIN_TRIANGLES} to {MAX_TRIANGLES}")));
    }
    output::check(&args.out, &["glb"], &[&args.model])?;
    let model = model::load(&args.model)?;
    let skin = skin(&model, &Options { triangles: args.triangles })
        .map_err(|source| CliError::Skin { model: args.model.clone(), source })?;
    let bytes = skin.to_glb();
    write_atomic(&args.out, &bytes)?;
    let (joints, vertices, triangles) = (skin.skeleton.len(), skin.positions.len(), skin.triangles.len());
    if json {
        print_json(&json!({
            "out": args.out.to_string_lossy(), "model": skin.name, "joints": joints, "vertices": vertices,
            "triangles": triangles, "cell": skin.cell, "bytes": bytes.len(),
        }));
    } else {
        let (cell, size) = (1e3 * skin.cell, bytes.len() as f64 / 1e3);
        say(format!(
            "wrote {}: {joints} joints, {triangles} triangles, details from {cell:.0} mm, {size:.0} kB",
            path_word(&args.out)
        ));
    }
    Ok(())
}
