//! A study writes a table, a picture and a page with its command. If a study needs programs of other projects, it names the
//! missing ones and how to get them before it trains. It checks its output folder first.

use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

/// The program, to be run in `folder`.
fn studies(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_marathon-studies"));
    command.current_dir(folder).args(args);
    command
}

/// Runs the program, which must succeed; returns its stdout.
fn succeed(folder: &Path, args: &[&str]) -> String {
    let output = studies(folder, args).output().expect("the program starts");
    assert!(output.status.success(), "{args:?}: {}", stderr(&output));
    String::from_utf8(output.stdout).expect("stdout is text")
}

/// Runs the program, which must fail with `code`; returns its stderr.
fn fail(folder: &Path, code: i32, args: &[&str]) -> String {
    let output = studies(folder, args).output().expect("the program starts");
    assert_eq!(output.status.code(), Some(code), "{args:?}: {}", stderr(&output));
    assert!(output.stdout.is_empty(), "{args:?} writes on stdout: {}", String::from_utf8_lossy(&output.stdout));
    stderr(&output)
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_page_has_its_command_and_its_files() {
    let folder = tempfile::tempdir().unwrap();
    for study in ["multi-env", "concurrency"] {
        let text = succeed(folder.path(), &[study, "--seeds", "1", "--steps", "2000", "--out", "pages"]);
        let file = |extension: &str| folder.path().join("pages").join(format!("{study}.{extension}"));
        let page = std::fs::read_to_string(file("md")).unwrap();
        assert!(text.starts_with(page.trim_end()), "stdout has the page: {text}");
        assert!(
            page.contains(&format!(
                "cargo run --release -p marathon-studies -- {study} --seeds 1 --steps 2000 --threads 1"
            )),
            "{page}"
        );
        assert!(page.contains(&format!("({study}.png)")) && std::fs::metadata(file("png")).unwrap().len() > 1000);
        let rows = std::fs::read_to_string(file("csv")).unwrap();
        let table = page.lines().filter(|line| line.starts_with('|')).count();
        assert_eq!(rows.lines().count() + 1, table, "{page}\n{rows}");
    }
}

/// A study of clips keeps its runs and continues with them.
#[test]
fn a_study_of_clips_makes_no_run_twice() {
    let folder = tempfile::tempdir().unwrap();
    let words = ["style-transfer", "--clips", "walk,kick", "--seeds", "2", "--steps", "4096", "--keep", "kept"];
    let study = || succeed(folder.path(), &[&words[..], &["--out", "pages"]].concat());
    let page = study();
    assert!(
        page.contains("marathon-studies -- style-transfer --seeds 2 --steps 4096 --threads 1 --clips walk,kick"),
        "{page}"
    );
    let rows = std::fs::read_to_string(folder.path().join("pages/style-transfer.csv")).unwrap();
    let lines: Vec<&str> = rows.lines().skip(1).collect();
    // a number that both seeds share appears once, others for each seed
    assert!(lines.len() == 2, "{rows}");
    for (line, clip) in lines.iter().zip(["walk", "kick"]) {
        assert!(line.starts_with(&format!("{clip},2,\"4,096\",")), "{rows}");
        let of_each = |cell: &str| cell.split_once(" (").is_some_and(|(_, each)| each.split(", ").count() == 2);
        assert!(line.split('"').any(of_each), "both seeds are in the row: {rows}");
    }
    let policy = folder.path().join("kept/MarathonManKick-v0-2/policy.safetensors");
    let made = std::fs::metadata(&policy).unwrap().modified().unwrap();
    assert_eq!(study(), page);
    assert_eq!(std::fs::metadata(&policy).unwrap().modified().unwrap(), made);
    // the small files beside the runs are enough for the page; those of another configuration are refused
    for task in ["MarathonManWalk-v0-1", "MarathonManWalk-v0-2", "MarathonManKick-v0-1", "MarathonManKick-v0-2"] {
        std::fs::remove_dir_all(folder.path().join("kept").join(task)).unwrap();
    }
    let kept = succeed(folder.path(), &[&words[..], &["--kept-only", "--out", "pages"]].concat());
    assert_eq!(kept.replace(" --kept-only", ""), page);
    let error = fail(folder.path(), 1, &[&words[..5], &["--steps", "8192", "--keep", "kept"]].concat());
    assert!(error.contains("MarathonManWalk-v0-1.json") && error.contains("run.config"), "{error}");
    let error = fail(folder.path(), 1, &["style-transfer", "--clips", "run", "--kept-only", "--keep", "kept"]);
    assert!(error.contains("none of these clips"), "{error}");
    let error = fail(folder.path(), 2, &["style-transfer", "--clips", "wlak"]);
    assert!(error.contains("did you mean 'walk'?"), "{error}");
}

/// A study of courses trains on each ground, also on that of an adversary, and evaluates the runners on new courses, made by
/// hand and fresh ones.
#[test]
fn a_study_of_courses_judges_every_runner() {
    let folder = tempfile::tempdir().unwrap();
    let words =
        ["assault-course", "--tasks", "TerrainHopper", "--grounds", "flat,adversary", "--seeds", "1", "--fresh", "16"];
    let study = |more: &[&str]| {
        succeed(folder.path(), &[&words[..], &["--steps", "8192", "--keep", "kept", "--out", "pages"], more].concat())
    };
    let page = study(&[]);
    assert!(page.contains("--tasks TerrainHopper --grounds flat,adversary --fresh 16"), "{page}");
    let rows = std::fs::read_to_string(folder.path().join("pages/assault-course.csv")).unwrap();
    let lines: Vec<&str> = rows.lines().skip(1).collect();
    for (line, start) in
        lines.iter().zip(["Hopper,flat,yes", "Hopper,flat,no", "Hopper,adversary,yes", "Hopper,adversary,no"])
    {
        assert!(line.starts_with(start) && line.matches(" m; ").count() == 8, "{rows}");
    }
    assert_eq!(lines.len(), 4, "{rows}");
    assert!(folder.path().join("kept/TerrainHopper-adversary-heights-1/policy-builder.safetensors").is_file());
    // each runner has its own builder
    assert!(folder.path().join("kept/TerrainHopper-flat-blind-1/adversary/policy-builder.safetensors").is_file());
    assert_eq!(study(&["--kept-only"]).replace(" --kept-only", ""), page);
    let error = fail(folder.path(), 2, &["assault-course", "--grounds", "flt"]);
    assert!(error.contains("did you mean 'flat'?"), "{error}");
}

#[test]
fn json_is_all_that_is_printed_if_it_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["concurrency", "--seeds", "1", "--steps", "2000", "--out", "pages", "--json"];
    let record: serde_json::Value = serde_json::from_str(&succeed(folder.path(), &args)).unwrap();
    assert_eq!(record["name"], "concurrency");
    assert!(folder.path().join("pages/concurrency.md").is_file());
}

#[test]
fn missing_programs_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let asked = |study: &str, variable: &str| {
        let args = [study, "--seeds", "1", "--steps", "100"];
        let output = studies(folder.path(), &args).env(variable, "no-such-python").output().unwrap();
        assert_eq!(output.status.code(), Some(1));
        let error = stderr(&output);
        assert!(error.contains("no-such-python: cannot be started") && error.contains(variable), "{error}");
    };
    asked("table2", "MARATHON_PYTHON");
    if cfg!(unix) {
        // the player has to be there first
        let player = Path::new(env!("CARGO_BIN_EXE_marathon-studies")).with_file_name("marathon-player");
        if player.exists() {
            asked("mlagents-agreement", "MARATHON_MLAGENTS_PYTHON");
        }
    }
}

#[test]
fn the_output_folder_is_checked_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("file"), "").unwrap();
    let begun = Instant::now();
    let error = fail(folder.path(), 2, &["table3", "--steps", "1000000000", "--out", "file/pages"]);
    assert!(error.contains("--out is file/pages, but file is a file; expected a folder"), "{error}");
    assert!(begun.elapsed() < Duration::from_secs(60), "no work is done");
}

/// A folder of `reproduce` in which the hopper is done: the results are those of the repository, with `policy` as the policy.
fn done(folder: &Path, policy: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let place = folder.join("hopper");
    std::fs::create_dir_all(place.join("done")).unwrap();
    std::fs::create_dir_all(place.join("run")).unwrap();
    let copy = |from: &str, to: &str| std::fs::copy(root.join(from), place.join(to)).unwrap();
    copy(&format!("assets/policies/{policy}.safetensors"), "run/policy.safetensors");
    copy("docs/images/hopper-gait.png", "hopper-gait.png");
    copy("docs/images/hopper-curve.png", "hopper-curve.png");
    let plan = succeed(&root, &["reproduce", "--list", "hopper"]);
    for (number, command) in plan.lines().skip(1).enumerate() {
        std::fs::write(place.join(format!("done/{number:02}")), command.trim()).unwrap();
    }
}

#[test]
fn a_reproduction_names_what_changed() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let folder = tempfile::tempdir().unwrap();
    let keep = folder.path().to_string_lossy().into_owned();
    done(folder.path(), "hopper");
    let text = succeed(&root, &["reproduce", "hopper", "--keep", &keep]);
    assert_eq!(text.matches("| same |").count(), 3, "{text}");
    assert_eq!(std::fs::read_to_string(folder.path().join("report.md")).unwrap(), text);
    done(folder.path(), "walker2d");
    let text = succeed(&root, &["reproduce", "hopper", "--keep", &keep]);
    let expected =
        "| hopper | assets/policies/hopper.safetensors | changed | return 1692.3 ± 6.0, 0 falls, before: return 833.1";
    assert!(text.contains(expected), "{text}");
    assert_eq!(text.matches("| same |").count(), 2, "{text}");
    // a command that fails
    std::fs::remove_file(folder.path().join("hopper/done/01")).unwrap();
    std::fs::write(folder.path().join("hopper/run/policy.safetensors"), "no policy").unwrap();
    let output = studies(&root, &["reproduce", "hopper", "--keep", &keep]).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stdout).contains("| hopper |  | failed | `"), "{}", stderr(&output));
    assert!(stderr(&output).contains("1 of 1 could not be reproduced"), "{}", stderr(&output));
}

#[test]
fn reproductions_start_in_the_repository() {
    let folder = tempfile::tempdir().unwrap();
    let text = fail(folder.path(), 2, &["reproduce", "hopper"]);
    assert!(text.contains("runs in a clone of the repository"), "{text}");
    assert!(std::fs::read_dir(folder.path()).unwrap().next().is_none(), "nothing is written");
    let text = fail(folder.path(), 2, &["reproduce", "hoper"]);
    assert!(text.contains("did you mean hopper?"), "{text}");
}
