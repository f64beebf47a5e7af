//! The builder trains the same policies as the command, writes only to given paths, and refuses unknown names.

use marathon_rl::prelude::*;

#[test]
fn a_run_without_a_folder_gives_the_policy_of_one_with_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    let trainer = || Trainer::new("hopper").unwrap().steps(40_000).seed(3).agents(16).threads(1);
    let alone = trainer().run().unwrap();
    assert!(alone.folder.is_none() && alone.steps >= 40_000);

    let path = folder.path().join("run");
    let kept = trainer().folder(&path).run().unwrap();
    let (a, b) = (folder.path().join("a.safetensors"), folder.path().join("b.safetensors"));
    alone.policy.save(&a).unwrap();
    kept.policy.save(&b).unwrap();
    assert_eq!(std::fs::read(&a).unwrap(), std::fs::read(&b).unwrap());
    assert_eq!(std::fs::read(path.join("policy.safetensors")).unwrap(), std::fs::read(&b).unwrap());

    let read = Policy::load(&a).unwrap();
    let options = EvalOptions { episodes: 4, ..Default::default() };
    assert_eq!(evaluate(&read, &options).unwrap(), evaluate(&alone.policy, &options).unwrap());
}

#[test]
fn a_stopped_run_is_resumed_to_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let trainer = || Trainer::new("hopper").unwrap().steps(40_000).agents(16);
    let whole = trainer().run().unwrap();

    let path = folder.path().join("run");
    let mut iterations = 0;
    let stop = |_: &IterationStats| {
        iterations += 1;
        if iterations == 3 { Control::Stop } else { Control::Continue }
    };
    let part = trainer().folder(&path).on_iteration(stop).run().unwrap();
    assert!(part.evaluation.is_none() && part.steps < whole.steps);
    // the folder stays locked as long as its run is held
    drop(part);
    let resumed = Trainer::resume(&path).run().unwrap();
    let (a, b) = (folder.path().join("a.safetensors"), folder.path().join("b.safetensors"));
    whole.policy.save(&a).unwrap();
    resumed.policy.save(&b).unwrap();
    assert_eq!(std::fs::read(&a).unwrap(), std::fs::read(&b).unwrap());
}

#[test]
fn what_does_not_exist_is_refused_with_the_nearest_name() {
    let error = |result: marathon_rl::Result<Outcome>| result.err().expect("an error").to_string();
    let misspelled = Trainer::new("hoper").err().expect("an error").to_string();
    assert!(misspelled.contains("hoper") && misspelled.to_lowercase().contains("hopper-v0"), "{misspelled}");
    let wrong = error(Trainer::new("Hopper-v5").unwrap().option("ctrl_cost_wieght", 0.1).run());
    assert!(wrong.contains("ctrl_cost_weight"), "{wrong}");
    let wrong = error(Trainer::new("hopper").unwrap().set("ppo.lrr", 1e-4).run());
    assert!(wrong.contains("ppo.lrr") && wrong.contains("lr"), "{wrong}");
    assert!(error(Trainer::resume("no/such/run").run()).contains("no/such/run"));
}
