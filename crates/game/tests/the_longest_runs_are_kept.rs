//! The table of the longest runs: runs have places on their course, the best keep their replays, and what is one too many goes. A
//! file that is no table, damaged, or a later version's is left as it is, with one line that names it and the remedy.

use bevy_marathon::Ground;
use marathon_game::app::{Course, KEPT, ROWS, Recording, Row, Run, Table};
use marathon_runs::TaskConfig;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

fn course(kind: &str) -> Course {
    Course { agent: "Hopper-v0".into(), kind: kind.into(), difficulty: 0.5, role: "watch".into() }
}

fn run(kind: &str, episode: u64, distance: f64) -> Run {
    Run {
        course: course(kind),
        options: String::new(),
        draw: [u64::MAX, 0, episode],
        runner: "hopper.safetensors 01234567".into(),
        builder: "seed".into(),
        distance,
        seconds: 4.0,
        slowest: 1.0,
        ended: "fell".into(),
        date: String::new(),
        version: String::new(),
        replay: None,
    }
}

/// A recording of one frame that can be told from others.
fn recording(mark: f64) -> Result<Recording, Box<dyn Error>> {
    let task_config = TaskConfig::named("hopper")?;
    let spec = task_config.factory()?.spec().clone();
    let mut recording = Recording::new(task_config, Ground::Level, spec.dt, vec![0.0; 3]);
    recording.push(&Row {
        qpos: &vec![mark; spec.nq],
        numbers: [0.0; 5],
        terms: &vec![0.0; spec.reward_terms.len()],
        action: &vec![0.0; spec.act],
        command: &[],
        grounds: &Arc::default(),
        untimed: false,
    });
    Ok(recording)
}

/// Replays beside a table.
fn replays(table: &Path) -> Vec<PathBuf> {
    let folder = table.with_file_name("runs-replays");
    std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect()
}

#[test]
fn runs_have_places_on_their_course() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    // its folder is made
    let path = folder.path().join("new/runs.sqlite");
    let mut table = Table::open(&path)?;
    assert_eq!(table.place(&course("boxes"), f64::INFINITY)?, None);
    let mut place = |run: &Run| -> Result<_, Box<dyn Error>> {
        let place = table.add(run, &recording(run.distance)?)?;
        Ok((place.rank, place.of))
    };
    assert_eq!(place(&run("boxes", 1, 10.0))?, (1, 1));
    assert_eq!(place(&run("boxes", 2, 30.0))?, (1, 2));
    assert_eq!(place(&run("boxes", 3, 20.0))?, (2, 3));
    // the same run again, to the bit
    assert_eq!(place(&run("boxes", 3, 20.0))?, (2, 3));
    // another that came as far shares the place
    assert_eq!(place(&run("boxes", 4, 20.0))?, (2, 4));
    assert_eq!(place(&run("stairs", 1, 5.0))?, (1, 1));
    // another program's eyes see the same
    let table = Table::open(&path)?;
    assert_eq!(table.courses()?, [course("boxes"), course("stairs")]);
    let longest = table.longest(&course("boxes"), 3)?;
    assert_eq!(longest.iter().map(|run| run.distance).collect::<Vec<_>>(), [30.0, 20.0, 20.0]);
    assert_eq!(longest[0].draw, [u64::MAX, 0, 2]);
    assert_eq!(longest[0].version, env!("CARGO_PKG_VERSION"));
    let replay = longest[0].replay.as_ref().ok_or("it has one")?;
    assert_eq!(Recording::load(replay)?, recording(30.0)?);
    let standing = table.place(&course("boxes"), f64::INFINITY)?.ok_or("it stands")?;
    assert_eq!((standing.longest, standing.shortest, standing.of), (30.0, 10.0, 4));
    Ok(())
}

#[test]
fn the_best_time_is_kept_among_longer_runs() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let mut table = Table::open(&folder.path().join("runs.sqlite"))?;
    let recording = recording(0.0)?;
    let best = |table: &Table| table.place(&course("boxes"), f64::INFINITY).map(|place| place.and_then(|p| p.fastest));
    // a run that ends before the finish has no time to compare
    table.add(&run("boxes", 1, 100.0), &recording)?;
    assert_eq!(best(&table)?, None);
    let through = |seed, distance, seconds| Run { ended: "through".into(), seconds, ..run("boxes", seed, distance) };
    for (seed, seconds) in [(2, 40.0), (3, 31.5), (4, 33.0)] {
        table.add(&through(seed, 104.0, seconds), &recording)?;
    }
    assert_eq!(best(&table)?, Some(31.5));
    // many runs that went farther do not push it out
    for seed in 10..10 + ROWS as u64 + 5 {
        table.add(&through(seed, 105.0, 50.0), &recording)?;
    }
    assert_eq!(best(&table)?, Some(31.5));
    Ok(())
}

#[test]
fn what_is_one_too_many_goes() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("runs.sqlite");
    let mut table = Table::open(&path)?;
    let recording = recording(0.0)?;
    let count = ROWS + 20;
    for i in 0..count {
        // longer and longer, but for the shortest, which comes in between
        let distance = if i == 50 { 1.5 } else { 10.0 + i as f64 };
        table.add(&run("boxes", i as u64, distance), &recording)?;
        assert!(
            replays(&path).len() == (i + 1).min(KEPT) || i == 50,
            "{} replays after {i} runs",
            replays(&path).len()
        );
    }
    table.add(&run("stairs", 0, 2.0), &recording)?;
    let all = table.longest(&course("boxes"), 1000)?;
    assert_eq!(all.len(), ROWS + 1);
    assert_eq!((all[0].distance, all[ROWS].distance), (10.0 + (count - 1) as f64, 1.5));
    let kept: Vec<bool> = all.iter().map(|run| run.replay.as_ref().is_some_and(|path| path.exists())).collect();
    assert!(kept[..KEPT].iter().all(|kept| *kept) && !kept[KEPT..].contains(&true));
    assert_eq!(replays(&path).len(), KEPT + 1, "each course has its own");
    // what is too short for a place is in the table for a moment
    let place = table.add(&run("boxes", 999, 2.0), &recording)?;
    assert_eq!((place.rank, replays(&path).len()), (ROWS + 1, KEPT + 1));
    assert_eq!(table.longest(&course("boxes"), 1000)?.len(), ROWS + 1);
    Ok(())
}

#[test]
fn a_table_from_elsewhere_takes_no_other_files_away() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("runs.sqlite");
    let mine = folder.path().join("mine");
    std::fs::write(&mine, "dear")?;
    let mut table = Table::open(&path)?;
    table.add(&run("boxes", 0, 1.0), &recording(0.0)?)?;
    for name in [mine.display().to_string(), "../mine".into()] {
        rusqlite::Connection::open(&path)?.execute("UPDATE runs SET replay = ?1 WHERE distance = 1", [name])?;
        for i in 1..=KEPT as u64 + 1 {
            table.add(&run("boxes", i, 10.0 + i as f64), &recording(0.0)?)?;
        }
        assert!(mine.exists());
    }
    Ok(())
}

/// An untrusted table can only name replays in its own folder, cannot send commands to the terminal, and runs no code.
#[test]
fn a_strangers_table_does_no_harm() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("runs.sqlite");
    let mut table = Table::open(&path)?;
    table.add(&run("boxes", 0, 1.0), &recording(0.0)?)?;
    let own = table.longest(&course("boxes"), 1)?[0].replay.clone();
    assert!(own.is_some_and(|replay| replay.exists()));
    let change = |sql: &str, text: &str| rusqlite::Connection::open(&path)?.execute(sql, [text]);
    for name in ["/etc/passwd", "../mine", "..", ""] {
        change("UPDATE runs SET replay = ?1", name)?;
        assert_eq!(table.longest(&course("boxes"), 1)?[0].replay, None, "{name}");
    }
    change("UPDATE runs SET runner = ?1", "\u{1b}]0;title\u{7} \u{9b}31m\n  1  99 m")?;
    change("UPDATE runs SET course = ?1", "\u{1b}[2J")?;
    let output = game(&["--runs", "--table", &path.display().to_string()])?;
    let text = String::from_utf8(output.stdout)?;
    assert!(text.chars().all(|c| c == '\n' || !c.is_control()), "{text:?}");
    assert!(text.contains("\\u{1b}]0;title") && text.contains("\\n  1  99 m"), "{text}");
    change("UPDATE runs SET runner = ?1, course = 'boxes'", &"long".repeat(100_000))?;
    assert_eq!(table.longest(&course("boxes"), 1)?[0].runner.len(), 100);
    drop(table);
    rusqlite::Connection::open(&path)?
        .execute_batch("CREATE TRIGGER t AFTER INSERT ON runs BEGIN DELETE FROM runs; END")?;
    let error = Table::open(&path).map(drop).expect_err("a trigger").to_string();
    assert!(error.contains("views or triggers") && error.contains("--table FILE"), "{error}");
    Ok(())
}

#[test]
fn what_is_no_table_is_left_as_it_is() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let file = |name: &str| folder.path().join(name);
    std::fs::write(file("text.sqlite"), "a letter to my aunt, which is long enough to be no empty file".repeat(40))?;
    // a table whose second half is lost
    {
        let mut table = Table::open(&file("whole.sqlite"))?;
        for i in 0..40 {
            table.add(&run("boxes", i, i as f64), &recording(0.0)?)?;
        }
    }
    let whole = std::fs::read(file("whole.sqlite"))?;
    std::fs::write(file("half.sqlite"), &whole[..whole.len() / 2])?;
    let mut damaged = whole.clone();
    damaged[100..].fill(0xa5);
    std::fs::write(file("damaged.sqlite"), damaged)?;
    let other = rusqlite::Connection::open(file("other.sqlite"))?;
    other.execute_batch("CREATE TABLE songs (name TEXT)")?;
    let later = rusqlite::Connection::open(file("later.sqlite"))?;
    later.execute_batch("CREATE TABLE runs (id INTEGER); PRAGMA user_version = 7")?;
    drop((other, later));
    std::fs::create_dir(file("folder.sqlite"))?;
    for (name, parts) in [
        ("text.sqlite", &["not a table of runs"][..]),
        ("half.sqlite", &["damaged"]),
        ("damaged.sqlite", &["damaged"]),
        ("other.sqlite", &["another program"]),
        ("later.sqlite", &["version 7", "knows 1"]),
        ("folder.sqlite", &[]),
    ] {
        let before = std::fs::read(file(name)).ok();
        let used = || {
            let mut table = Table::open(&file(name))?;
            table.courses()?;
            table.longest(&course("boxes"), 100)?;
            table.add(&run("boxes", 1000, 3.0), &recording(0.0).expect("a recording"))
        };
        let error = used().map(drop).expect_err(name).to_string();
        assert!(error.contains(name) && error.contains("--table FILE") && error.lines().count() == 1, "{error}");
        assert!(parts.iter().all(|part| error.contains(part)), "{error}");
        assert_eq!(std::fs::read(file(name)).ok(), before, "{name}");
        let output = game(&["--runs", "--table", &file(name).display().to_string()])?;
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(1) && text.contains(name) && !text.contains("panicked"), "{text}");
    }
    Ok(())
}

fn game(words: &[&str]) -> Result<std::process::Output, std::io::Error> {
    Command::new(env!("CARGO_BIN_EXE_marathon-game")).args(words).output()
}

#[test]
fn two_games_write_at_once() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("runs.sqlite");
    std::thread::scope(|scope| {
        let write = |first: u64| {
            let path = &path;
            move || {
                for i in 0..15 {
                    let mut table = Table::open(path).expect("it opens");
                    table
                        .add(&run("boxes", first + i, i as f64), &recording(0.0).expect("a recording"))
                        .expect("it is added");
                }
            }
        };
        let others = [0, 100].map(|first| scope.spawn(write(first)));
        for other in others {
            other.join().expect("it has written");
        }
    });
    assert_eq!(Table::open(&path)?.longest(&course("boxes"), 1000)?.len(), 30);
    assert_eq!(replays(&path).len(), KEPT);
    Ok(())
}

#[test]
fn the_console_lists_it() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("runs.sqlite");
    let words = ["--runs", "--table", &path.display().to_string()];
    let text = |output: std::process::Output| String::from_utf8(output.stdout);
    assert!(text(game(&words)?)?.contains("no runs yet"));
    Table::open(&path)?.add(&run("boxes", 7, 12.345), &recording(0.0)?)?;
    let told = text(game(&words)?)?;
    for part in ["Hopper-v0", "boxes", "12.3", "hopper.safetensors 01234567", "seed", "run-1.replay"] {
        assert!(told.contains(part), "{told}");
    }
    Ok(())
}
