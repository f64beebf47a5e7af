//! A clip goes with the task that follows it: into run folders and policies, and beside other clips of its name.

use marathon_envs::agents::marathon::marathon_man::clips::shipped;
use marathon_envs::{Clips, NamedClip, Value};
use marathon_learn::{Activation, Control, Policy, PolicyMeta};
use marathon_runs::distill::{DistillOptions, distill};
use marathon_runs::{RunFile, RunFolder};
use marathon_runs::{TaskConfig, TaskOptions};
use std::path::{Path, PathBuf};

fn mine(clip: &str) -> NamedClip {
    NamedClip::new("mine", shipped(clip).unwrap())
}

fn man(clips: impl Into<Value>) -> TaskConfig {
    let given = vec![("clip".to_string(), clips.into())];
    TaskConfig::named("MarathonMan").unwrap().with(&TaskOptions { given }).unwrap()
}

/// A policy that has learned nothing, in a file.
fn policy(folder: &Path, name: &str, task: &TaskConfig) -> PathBuf {
    let spec = task.factory().unwrap().spec().clone();
    let meta = PolicyMeta::of(&spec, vec![4], Activation::Tanh);
    let (params, obs) = (vec![0.0; (spec.obs + 1) * 4 + 5 * spec.act], (vec![0.0; spec.obs], vec![1.0; spec.obs]));
    let path = folder.join(name);
    Policy::from_parts(meta, params, obs, vec![0.0; spec.act]).unwrap().save(&path).unwrap();
    path
}

#[test]
fn a_run_folder_and_a_policy_hold_clips_that_were_given_in_memory() {
    let temp = tempfile::tempdir().unwrap();
    let task = man([NamedClip::shipped("walk"), mine("run"), mine("kick")].into_iter().collect::<Clips>());
    let path = temp.path().join("run");
    let run = RunFile::new(&task, &marathon_config::default_for("MarathonMan"));
    RunFolder::create(Some(&path), "MarathonMan").unwrap().begin(&run).unwrap();
    assert!(path.join("mine.motion").is_file() && path.join("mine-2.motion").is_file());
    let (folder, run) = RunFolder::open(&path).unwrap();
    assert_eq!(run.options.get("clip"), Some(&Value::Text("walk,mine.motion,mine-2.motion".into())));
    assert_eq!(folder.task_config(&run).unwrap(), task);

    let policy = Policy::load(&policy(temp.path(), "p.safetensors", &task)).unwrap();
    assert_eq!(policy.meta().options.get("clip"), task.options.get("clip"));
    // other arguments leave the clips, and a name chooses among them
    let with = |name: &str, value: Value| {
        TaskConfig::of_policy(policy.meta()).with(&TaskOptions { given: vec![(name.into(), value)] }).unwrap().options
    };
    assert_eq!(with("start", "first".into()).get("clip"), task.options.get("clip"));
    assert_eq!(
        with("clip", "mine-2.motion".into()).get("clip"),
        man(NamedClip::new("mine-2", shipped("kick").unwrap())).options.get("clip")
    );
}

/// Every option that takes clips takes files, not `clip` alone.
#[test]
fn the_clips_of_a_gait_are_files_too() {
    let temp = tempfile::tempdir().unwrap();
    let file = temp.path().join("amble.motion");
    std::fs::write(&file, shipped("walk").unwrap().to_bytes()).unwrap();
    let with = |name: &str, value: String| {
        let given = vec![(name.to_string(), Value::Text(value))];
        TaskConfig::named("MarathonManController").unwrap().with(&TaskOptions { given })
    };
    let task = with("walk", file.display().to_string()).unwrap();
    assert_eq!(task.options.given_clips()["amble.motion"], &shipped("walk").unwrap());
    let path = temp.path().join("run");
    let run = RunFile::new(&task, &marathon_config::default_for("MarathonManController"));
    RunFolder::create(Some(&path), "MarathonManController").unwrap().begin(&run).unwrap();
    let (folder, run) = RunFolder::open(&path).unwrap();
    assert_eq!(run.options.get("walk"), Some(&Value::Text("amble.motion".into())));
    assert_eq!(folder.task_config(&run).unwrap(), task);
    let missing = temp.path().join("ambel.motion").display().to_string();
    let error = with("run", missing).unwrap_err().to_string();
    assert!(error.contains("ambel.motion") && error.contains("did you mean"), "{error}");
}

#[test]
fn policies_with_clips_of_one_name_teach_one_policy() {
    let temp = tempfile::tempdir().unwrap();
    let teachers =
        ["run", "kick", "run"].map(|clip| policy(temp.path(), &format!("{clip}.safetensors"), &man(mine(clip))));
    let options = DistillOptions { hidden: vec![4], steps: 2_000, agents: 16, ..Default::default() };
    let student =
        distill(TaskConfig::named("MarathonMan").unwrap(), &teachers, &options, &mut |_| Control::Continue).unwrap();
    let given = student.meta().options.given_clips();
    assert_eq!(given.keys().collect::<Vec<_>>(), [&"mine-2.motion", &"mine.motion"]);
    assert_eq!((given["mine.motion"], given["mine-2.motion"]), (&shipped("run").unwrap(), &shipped("kick").unwrap()));
}
