//! Policies can build on others. One policy learns the behavior of several in a fraction of the time that each of them
//! took. A run that starts from a policy acts like that policy, though it observes more. Policies that do not fit are
//! refused by name.

use marathon_envs::options::Value;
use marathon_learn::{Control, EvalOptions, Policy, evaluate};
use marathon_runs::distill::{DistillOptions, Distilled, distill};
use marathon_runs::{LearnOptions, RunOptions, Session, Task, TaskConfig, TaskOptions, imitation, policy_file};
use std::path::PathBuf;

fn shipped(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../assets/policies").join(format!("{name}.safetensors"))
}

fn man(options: &[(&str, &str)]) -> TaskConfig {
    let given = options.iter().map(|(name, value)| (name.to_string(), value.parse().unwrap())).collect();
    TaskConfig::named("MarathonMan").unwrap().with(&TaskOptions { given }).unwrap()
}

/// Half a minute of processor time teaches a walk and a run to one network. Each took minutes alone.
#[test]
fn one_policy_walks_and_runs() {
    let teachers = [shipped("MarathonManWalk"), shipped("MarathonManRun"), shipped("MarathonManRun")];
    let options = DistillOptions { hidden: vec![96, 96], steps: 700_000, agents: 16, ..Default::default() };
    let mut rounds: Vec<Distilled> = Vec::new();
    let task = man(&[("future", "1"), ("start", "adaptive")]);
    let policy = distill(task, &teachers, &options, &mut |now| {
        rounds.push(*now);
        Control::Continue
    })
    .unwrap();
    let (first, last) = (rounds[8].loss, rounds[rounds.len() - 1].loss);
    assert!(last < 0.25 * first, "the loss has fallen from {first} to {last} only");
    assert_eq!(policy.meta().options.get("clip"), Some(&Value::Text("walk,run".into())));
    assert_eq!(policy.meta().options.get("max_target"), Some(&Value::Number(1.0)), "that of the teachers");
    // 5 s from the first frame; an untrained character falls within half a second
    let done = imitation::from_beginning(&policy, &EvalOptions { episodes: 16, ..Default::default() }).unwrap();
    let seconds: Vec<f64> = done.iter().map(|clip| clip.seconds).collect();
    assert!(seconds.len() == 2 && seconds.iter().all(|s| *s > 10.0), "he goes on for {seconds:?} s");
}

/// The actions of teachers must mean the same.
#[test]
fn teachers_with_other_servos_are_refused() {
    let teachers = [shipped("MarathonManWalk"), shipped("MarathonManBackflip")];
    let wrong = distill(man(&[]), &teachers, &DistillOptions::default(), &mut |_| Control::Stop).err();
    let text = wrong.expect("an error").to_string();
    assert!(text.contains("max_target=1") && text.contains("MarathonManBackflip.safetensors max_target=3"), "{text}");
    let options = DistillOptions { hidden: vec![8], steps: 1, agents: 16, ..Default::default() };
    let forced = distill(man(&[("max_target", "3")]), &teachers, &options, &mut |_| Control::Continue).unwrap();
    assert_eq!(forced.meta().options.get("max_target"), Some(&Value::Number(3.0)));
}

/// The same seed gives the same policy for any number of threads; another seed gives another one.
#[test]
fn threads_change_nothing() {
    let learned = |threads: usize, seed: u64| {
        let options =
            DistillOptions { hidden: vec![16], steps: 20_000, agents: 32, threads, seed, ..Default::default() };
        distill(TaskConfig::named("hopper").unwrap(), &[shipped("hopper")], &options, &mut |_| Control::Continue)
            .unwrap()
    };
    let one = learned(1, 3);
    assert!(one == learned(2, 3) && one != learned(1, 4));
}

/// A small network does what a larger one does.
#[test]
fn a_smaller_policy_hops_as_far() {
    let path = shipped("hopper");
    let options = DistillOptions { hidden: vec![48, 48], steps: 3_000_000, agents: 128, ..Default::default() };
    let student = distill(TaskConfig::named("hopper").unwrap(), std::slice::from_ref(&path), &options, &mut |_| {
        Control::Continue
    })
    .unwrap();
    let factory = TaskConfig::named("hopper").unwrap().factory().unwrap();
    let of = |policy: &Policy| {
        let isa = marathon_physics::lanes::Isa::best();
        evaluate(&*factory, isa, policy, &EvalOptions { episodes: 64, ..Default::default() }).unwrap().return_mean
    };
    let (own, theirs) = (of(&student), of(&policy_file::read(&path, None).unwrap()));
    assert!(own > 0.9 * theirs, "{own} of {theirs}");
}

#[test]
fn teachers_that_do_not_fit_are_refused() {
    let learn = |task: TaskConfig, teachers: &[PathBuf]| {
        distill(task, teachers, &DistillOptions::default(), &mut |_| Control::Stop).unwrap_err().to_string()
    };
    let text = learn(TaskConfig::named("walker").unwrap(), &[shipped("hopper")]);
    assert!(text.contains("hopper.safetensors") && text.contains("actions") && text.contains("Walker2d-v0"), "{text}");
    // Marathon Man with a clip has no commands
    let text = learn(man(&[]), &[shipped("MarathonManSteer")]);
    assert!(
        text.contains("observation") && text.contains("'command' of 6 numbers") && text.contains("phase (4)"),
        "{text}"
    );
    assert!(learn(man(&[]), &[]).contains("teacher is not given"));
}

/// A run of Marathon Man that also observes a later frame starts from the walk of one that does not: it first acts
/// alike.
#[test]
fn a_run_starts_from_a_policy_that_observes_less() {
    let folder = tempfile::tempdir().unwrap();
    let path = shipped("MarathonManWalk");
    let task = || Task::named("MarathonMan").unwrap();
    let options = |from: PathBuf| RunOptions {
        learn: LearnOptions { steps: Some(20_000), threads: Some(1), ..Default::default() },
        task: TaskOptions { given: vec![("future".into(), "1".parse().unwrap())] },
        initialize_from: Some(from),
        out: Some(folder.path().join("run")),
        ..Default::default()
    };
    let (session, _) = Session::open(Some(task()), &options(path.clone()), None, false).unwrap();
    let outcome = session.carry_out(false, &mut |_| Control::Continue).unwrap();
    let (old, new) = (policy_file::read(&path, None).unwrap(), outcome.policy);
    assert_eq!((old.meta().obs, new.meta().obs), (89, 119));
    let agreement = |policy: &Policy| {
        let (mut apart, mut own) = (0.0, 0.0);
        for i in 0..64 {
            // values near its observations
            let obs: Vec<f32> = (0..119)
                .map(|k| {
                    let (mean, std) = (old.normalizer().mean(), old.normalizer().std());
                    let wave = ((i * 119 + k) as f32 * 0.7).sin();
                    mean.get(k).map_or(wave, |mean| mean + 0.5 * wave * std[k])
                })
                .collect();
            for (a, b) in policy.act(&obs).iter().zip(old.act(&obs[..89])) {
                apart += (a - b) * (a - b);
                own += b * b;
            }
        }
        (apart / own).sqrt()
    };
    assert!(agreement(&new) < 0.5, "{} of the actions' size", agreement(&new));
    drop(outcome.folder);
    let wrong = Session::open(Some(task()), &options(shipped("MarathonManBackflip")), None, true);
    let text = wrong.err().unwrap().to_string();
    assert!(
        text.contains("hidden layers") && text.contains("[128, 128]") && text.contains("[64, 64] or narrower"),
        "{text}"
    );
}

/// With two roles, the first one starts from the policy. If only its value function learns, it plays like the policy,
/// while the other role learns against it.
#[test]
fn a_role_may_play_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let path = shipped("TerrainWalker2d");
    let config = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../assets/configs/terrain-adversary.yaml");
    let options = RunOptions {
        learn: LearnOptions { steps: Some(100_000), threads: Some(1), config: Some(config), ..Default::default() },
        initialize_from: Some(path.clone()),
        out: Some(folder.path().join("run")),
        ..Default::default()
    };
    let task = Task::named("TerrainWalker2d").unwrap();
    let (session, _) = Session::open(Some(task), &options, None, false).unwrap();
    let outcome = session.carry_out(false, &mut |_| Control::Continue).unwrap();
    let (old, new) = (policy_file::read(&path, None).unwrap(), outcome.policy);
    // and from the policy of such a run
    let again = RunOptions { initialize_from: Some(folder.path().join("run")), out: None, ..options };
    drop(outcome.folder);
    let (session, _) = Session::open(Some(Task::named("TerrainWalker2d").unwrap()), &again, None, true).unwrap();
    assert_eq!(session.run.initialize_from, again.initialize_from);
    let [(name, builder)] = &outcome.others[..] else { panic!("one other role") };
    assert!(name == "builder" && builder.meta().act == 1);
    // the statistics have changed, and the first layer with them
    assert_ne!(new.params(), old.params());
    let (second, _) = old.net().layers().nth(1).expect("it has hidden layers");
    assert_eq!(new.params()[second.start..], old.params()[second.start..]);
    // typical observations: larger ones are clipped, and constant inputs stay constant
    let usual = old.normalizer().mean().iter().zip(old.normalizer().std());
    let varied = |k: usize, std: f32| if std < 2e-4 { 0.0 } else { std * (k as f32).sin() };
    let obs: Vec<f32> = usual.enumerate().map(|(k, (mean, std))| mean + varied(k, *std)).collect();
    let (a, b) = (old.act(&obs), new.act(&obs));
    assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-3), "{a:?} {b:?}");
}
