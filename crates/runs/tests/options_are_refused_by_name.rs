//! An invalid option is refused by its name, in the spelling of each front end: `steps` for a caller of the library,
//! `--steps` for a user of the command.

use marathon_runs::{Flags, LearnOptions, RunError, RunOptions, Session, Task, VideoOptions};

/// The text of a refusal with plain names.
#[track_caller]
fn refused(result: Result<(), RunError>) -> String {
    let error = result.expect_err("a refusal");
    assert!(error.is_usage());
    error.to_string()
}

#[test]
fn options_that_do_not_go_together_are_refused_by_their_names() {
    let learn = LearnOptions { algo: Some("ppp".into()), ..Default::default() };
    assert_eq!(refused(learn.validate()), "algo is ppp, expected one of ppo, a2c, acktr, sac");
    let learn = LearnOptions { algo: Some("a2c".into()), config: Some("a.yaml".into()), ..Default::default() };
    assert!(refused(learn.validate()).starts_with("algo and a configuration exclude each other"));
    let new = |set: fn(&mut RunOptions)| {
        let mut options = RunOptions { resume: Some("runs/a".into()), ..Default::default() };
        set(&mut options);
        refused(options.validate())
    };
    for (text, name) in [
        (new(|o| o.learn.config = Some("a.yaml".into())), "config"),
        (new(|o| o.learn.algo = Some("sac".into())), "algo"),
        (new(|o| o.learn.seed = Some(1)), "seed"),
        (new(|o| o.agents = Some(16)), "agents"),
        (new(|o| o.initialize_from = Some("b".into())), "initialize_from"),
        (new(|o| o.out = Some("b".into())), "out"),
    ] {
        assert_eq!(text, format!("{name} is for new runs, not for one that resume continues"));
    }
    let more = LearnOptions { steps: Some(9), threads: Some(2), ..Default::default() };
    let options = RunOptions { learn: more, resume: Some("runs/a".into()), processes: 2, ..Default::default() };
    assert!(options.validate().is_ok());
}

#[test]
fn videos_have_a_length_and_a_rate() {
    assert!(VideoOptions::default().validate().is_ok());
    for (name, video) in [
        ("seconds", VideoOptions { seconds: Some(-1.0), ..Default::default() }),
        ("seconds", VideoOptions { seconds: Some(f64::NAN), ..Default::default() }),
        ("fps", VideoOptions { fps: Some(0.0), ..Default::default() }),
        ("start", VideoOptions { start: 1e9, ..Default::default() }),
    ] {
        let text = refused(video.validate());
        assert!(text.starts_with(&format!("{name} is ")) || text.starts_with(&format!("{name} asks for ")), "{text}");
    }
}

#[test]
fn a_front_end_spells_options_and_advice() {
    let complete = RunError::Complete { folder: "runs/a".into(), steps: 4096 };
    let told = |error: &RunError| [error.to_string(), error.spelled(&Flags("marathon"))];
    let both = "runs/a: the run is complete with 4,096 steps; to train longer, set more, such as";
    assert_eq!(told(&complete), [format!("{both} steps 8,192"), format!("{both} --steps 8,192")]);
    let [plain, flags] = told(&RunError::HoldsRun("my runs".into()));
    assert!(plain.starts_with("out 'my runs' already holds a run; continue it by resuming 'my runs',"), "{plain}");
    assert!(
        flags.starts_with("--out 'my runs' already holds a run; continue it by `marathon train --resume 'my runs'`,")
    );
    let cause = Box::new(RunError::NewRunOnly { name: "seed" });
    let stopped = RunError::Stopped { cause, folder: "runs/a".into(), steps: 9000, saved: Some(8000) };
    let [plain, flags] = told(&stopped);
    assert!(
        plain.starts_with("seed is for new runs") && flags.starts_with("--seed is for new runs"),
        "the cause is spelled, too: {flags}"
    );
    assert!(
        flags.ends_with("has 8,000 of 9,000 steps: fix the problem and continue by `marathon train --resume runs/a`"),
        "{flags}"
    );
}

#[test]
fn a_run_without_files_or_command_line_begins_from_plain_options() {
    let learn = LearnOptions { steps: Some(20_000), seed: Some(3), threads: Some(1), ..Default::default() };
    let options = RunOptions { learn, agents: Some(16), ..Default::default() };
    let open = |task, options| Session::open(task, options, None, true);
    let (session, notes) = open(Some(Task::named("hopper").unwrap()), &options).unwrap();
    let config = &session.run.config;
    assert_eq!((session.run.agent.as_str(), notes.len(), session.folder.is_none()), ("Hopper-v0", 0, true));
    assert_eq!((config.run.total_steps, config.run.seed, config.run.threads, config.run.agents), (20_000, 3, 1, 16));
    let text = |result: Result<(Session, Vec<String>), RunError>| result.err().expect("a refusal").to_string();
    assert_eq!(text(open(None, &options)), "task is missing, expected a task or a run to resume");
    let resume = RunOptions { resume: Some("no/such/run".into()), ..Default::default() };
    assert_eq!(text(open(None, &resume)), "no/such/run: resume: found no such folder, expected the folder of a run");
    let given = Some(marathon_config::default_for("hopper"));
    assert!(text(Session::open(None, &resume, given, true)).starts_with("config is for new runs"));
    let sac = LearnOptions { algo: Some("sac".into()), ..Default::default() };
    let options = RunOptions { learn: sac, processes: 2, ..Default::default() };
    assert!(
        text(open(Some(Task::named("hopper").unwrap()), &options)).starts_with("processes is 2, expected 0 with sac")
    );
}
