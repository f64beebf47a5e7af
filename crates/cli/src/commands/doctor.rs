//! `marathon doctor`: what this computer offers, and what is missing for each part of Marathon.

use crate::bench::options::{cores, isas};
use crate::commands::play;
use crate::error::CliError;
use marathon_envs::registry;
use marathon_physics::lanes::{F32x4, Isa, Real};
use marathon_runs::python;
use marathon_runs::speed::{env_speed, median};
use marathon_runs::terminal::{print_json, say};
use serde::Serialize;
use std::path::Path;
use std::process::Command;

/// Processor time of the speed measurement, s.
const MEASURE: f64 = 0.5;

/// A part of the computer.
#[derive(Serialize)]
struct Finding {
    name: &'static str,
    found: String,
    /// The parts of Marathon that need it, and how to get it. Empty if nothing is missing.
    missing: String,
}

/// Inspects the computer and prints the findings.
///
/// # Errors
/// None today; all commands return a result.
pub fn run(json: bool) -> Result<(), CliError> {
    let findings = [
        finding(
            "Marathon",
            format!("{} for {}-{}", env!("CARGO_PKG_VERSION"), std::env::consts::ARCH, std::env::consts::OS),
        ),
        finding("processor", processor()),
        instruction_sets(),
        speed(),
        python_of_tests(),
        program(
            "ffmpeg",
            &["-version"],
            "videos as .mp4 need it: https://ffmpeg.org, or `apt install ffmpeg`; .gif and .png do not",
        ),
        game(),
        graphics(),
    ];
    if json {
        print_json(&serde_json::json!({ "findings": findings }));
        return Ok(());
    }
    let width = findings.iter().map(|finding| finding.name.len()).max().unwrap_or(0);
    for Finding { name, found, missing } in &findings {
        say(format!("{name:width$}  {found}"));
        if !missing.is_empty() {
            say(format!("{:width$}  {missing}", ""));
        }
    }
    Ok(())
}

fn finding(name: &'static str, found: String) -> Finding {
    Finding { name, found, missing: String::new() }
}

fn processor() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    format!("{}{} cores", model.map(|(_, name)| format!("{name}, ")).unwrap_or_default(), cores())
}

/// The instruction sets that this program supports here; the fastest one runs everything.
fn instruction_sets() -> Finding {
    let best = Isa::best();
    let known: Vec<&str> = isas(&[]).into_iter().map(Isa::name).collect();
    let vectors = if best == Isa::X4 { format!("{}, ", <F32x4 as Real>::ISA) } else { String::new() };
    let found =
        format!("{} ({vectors}{} agents at a time); available: {}", best.name(), best.lanes(), known.join(", "));
    Finding { name: "instruction set", found, missing: best.obstacle().unwrap_or_default().into() }
}

/// Speed of the hopper's environment on one core, by processor time.
fn speed() -> Finding {
    match registry::factory("hopper", Isa::best()) {
        Ok(factory) => {
            let seconds = median(&env_speed(1, MEASURE, &*factory).samples).cpu_per_step();
            let millions = 1e-6 / seconds;
            finding("speed", format!("{millions:.1} million environment steps of the hopper per second on one core"))
        }
        // a limit of the user may be too small for the model
        Err(error) => Finding { name: "speed", found: "not measured".into(), missing: error.to_string() },
    }
}

fn python_of_tests() -> Finding {
    let path = python::find();
    let package = "import marathon_rl; print('with marathon_rl', marathon_rl.__version__)";
    let package = output(Command::new(&path).args(["-c", package])).unwrap_or("without marathon_rl".into());
    match output(Command::new(&path).arg("--version")) {
        Some(version) => finding("Python", format!("{version} ({}) {package}", path.display())),
        None => Finding {
            name: "Python",
            found: "not found".into(),
            missing: "only the Python package, the comparisons with MuJoCo and the tests need it: https://python.org"
                .into(),
        },
    }
}

/// The first line that a program prints.
fn output(command: &mut Command) -> Option<String> {
    let output = command.output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8_lossy(&output.stdout).lines().next()?.trim().into())
}

fn program(name: &'static str, words: &[&str], missing: &str) -> Finding {
    match output(Command::new(name).args(words)) {
        Some(line) => finding(name, line),
        None => Finding { name, found: "not found".into(), missing: missing.into() },
    }
}

fn game() -> Finding {
    match play::program() {
        Some(path) => finding("game", path.display().to_string()),
        None => Finding {
            name: "game",
            found: "not found".into(),
            missing: "`marathon play` needs it: cargo build --release -p marathon-game".into(),
        },
    }
}

/// The Vulkan loader, without which the game has no window on Linux.
fn graphics() -> Finding {
    if !cfg!(target_os = "linux") {
        return finding("graphics", "part of the system".into());
    }
    let folders = ["/usr/lib", "/usr/lib64", "/usr/lib/x86_64-linux-gnu", "/usr/lib/aarch64-linux-gnu", "/lib"];
    let found = folders.iter().map(|folder| Path::new(folder).join("libvulkan.so.1")).find(|path| path.exists());
    match found {
        Some(path) => finding("graphics", path.display().to_string()),
        None => Finding {
            name: "graphics",
            found: "no Vulkan loader".into(),
            missing: "windows of the game need it: apt install libvulkan1 mesa-vulkan-drivers".into(),
        },
    }
}
