//! Files with stages: what they say about each stage, and what is refused.

use marathon_config::recipe::{Source, StageKind};
use marathon_config::{Recipe, default_for, parse, recipe_for, shipped};
use std::path::Path;

fn read(text: &str) -> Recipe {
    Recipe::parse(Path::new("a.yaml"), text.as_bytes()).unwrap_or_else(|e| panic!("{text}: {e}"))
}

fn error(text: &str) -> String {
    Recipe::parse(Path::new("a.yaml"), text.as_bytes()).expect_err(text).to_string()
}

#[test]
fn stages_have_settings_over_those_of_the_file() {
    let text = "
task: hopper
run: {agents: 64}
ppo: {lr: 5e-4}
stages:
  one: {steps: 2e6, seed: 3}
  two:
    task: walker
    initialize_from: one
    run: {agents: 32, total_steps: 1e6}
    options: {max_episode_steps: 10}
    seeds: [4, 5]
    pick: lowest falls
    until: return_mean > 500
    or_fail: true
    episodes: 7
  three: {distill: [two, one, two, a.safetensors], hidden: [8], agents: 4, lr: 1e-2, steps: 100k}
  four: {average: [two/policies, three], options: {max_episode_steps: 20}}
";
    let recipe = read(text);
    assert_eq!((recipe.task.as_str(), recipe.stages.len()), ("Hopper-v0", 4));
    let [one, two, three, four] = &recipe.stages[..] else { panic!() };
    assert_eq!((one.seeds.clone(), one.task.as_str(), one.episodes), (vec![3], "Hopper-v0", 100));
    assert_eq!((two.seeds.clone(), two.task.as_str(), two.episodes, two.or_fail), (vec![4, 5], "Walker2d-v0", 7, true));
    let measures = (two.pick.as_ref().unwrap().to_string(), two.until.as_ref().unwrap().to_string());
    assert_eq!(measures, ("lowest falls".into(), "return_mean > 500".into()));
    let settings = |i: usize| {
        let stage = &recipe.stages[i];
        recipe.settings(stage, recipe.base(stage, None).unwrap()).unwrap()
    };
    let (first, second) = (settings(0), settings(1));
    assert_eq!((first.config.run.agents, first.config.run.total_steps), (64, 2_000_000));
    assert_eq!((second.config.run.agents, second.config.run.total_steps), (32, 1_000_000));
    assert_eq!(second.options, [("max_episode_steps".to_string(), "10".parse().unwrap())]);
    assert_eq!(first.config.network, default_for("hopper").config.network);
    let StageKind::Distill { teachers, hidden, agents, lr, .. } = &three.kind else { panic!("{three:?}") };
    let file = Source::File("a.safetensors".into());
    assert_eq!(teachers, &[Source::Stage(1), Source::Stage(0), Source::Stage(1), file]);
    assert_eq!((hidden.clone(), *agents, *lr, three.steps), (Some(vec![8]), Some(4), Some(0.01), Some(100_000)));
    assert_eq!(four.kind, StageKind::Average { policies: vec![Source::Kept(1), Source::Stage(2)] });
    assert_eq!((four.options.len(), four.task.as_str()), (1, "Hopper-v0"));
}

#[test]
fn errors_name_the_stage_the_key_and_what_is_expected() {
    let stages = |text: &str| error(&format!("task: hopper\nstages:\n  one: {{}}\n  two: {text}\n"));
    for (text, part) in [
        ("{stepz: 5}", "a.yaml:4: stages.two.stepz: unknown key; did you mean 'steps'?"),
        ("{steps: none}", "a.yaml:4: stages.two.steps: found 'none', expected a whole number above 0"),
        (
            "{initialize_from: onne}",
            "found 'onne', expected an earlier stage (one) or a file with the ending .safetensors; did you mean 'one'?",
        ),
        ("{initialize_from: two}", "found 'two', expected an earlier stage (one)"),
        ("{initialize_from: one/policies}", "expected one policy; only 'average' takes all policies of a stage"),
        ("{hidden: [8]}", "stages.two.hidden: unknown key; did you mean 'network.hidden'?"),
        ("{distill: [one], average: [one]}", "expected distill or average in a stage, not both"),
        ("{distill: []}", "found an empty list"),
        ("{distill: one}", "found 'one', expected a list of stages or files"),
        ("{distill: [one], ppo: {lr: 1}}", "stages.two.ppo: unknown key"),
        ("{average: [one]}", "found one policy, expected two or more, or one/policies"),
        ("{average: [one/policies], steps: 3}", "stages.two.steps: unknown key"),
        ("{seed: 1, seeds: [1, 2]}", "expected one of them"),
        ("{seeds: [1, 2]}", "stages.two.pick: found nothing, expected 'lowest' or 'highest' and a measure"),
        ("{seeds: [1, 1], pick: lowest falls}", "found 1 twice, expected each seed once"),
        ("{seeds: [1, x], pick: lowest falls}", "found 'x', expected a whole number"),
        ("{pick: lowest falls}", "found no 'seeds', expected two or more 'seeds' beside it"),
        ("{until: falls}", "stages.two.until: found 'falls', expected a measure, < or >, and a number"),
        ("{or_fail: true}", "found no 'until', expected 'until' beside it"),
        ("{task: hoper}", "found 'hoper', expected the name of a task; `marathon list` shows all; did you mean"),
        ("{ppo: {lr: fast}}", "stages.two.ppo.lr: found 'fast', expected a positive number"),
        ("[]", "stages.two: found a list, expected a mapping"),
    ] {
        let found = stages(text);
        assert!(found.contains(part), "{text}: {found}");
    }
    assert!(error("task: hopper\nstages: {}\n").contains("found no stage, expected one or more"));
    assert!(error("task: hopper\nstages: {a b: {}}\n").contains("expected a name of letters, digits"));
    assert!(error("stages: {a: {}}\n").contains("a.yaml:1: task: found nothing, expected the name of a task"));
    assert!(error("task: hopper\n").contains("expected a file with stages; `marathon train TASK --config a.yaml`"));
    assert!(error("task: hopper\nstags: {a: {}}\n").contains("found no 'stages'"));
    let many: String = (0..100).map(|i| format!("  s{i}: {{}}\n")).collect();
    assert!(error(&format!("task: hopper\nstages:\n{many}")).contains("found 100 stages, expected at most 99"));
    // a file with stages is no configuration of a single run
    let refused = parse(Path::new("a.yaml"), b"task: hopper\nstages: {a: {}}", "hopper").unwrap_err().to_string();
    assert!(
        refused.contains("a.yaml:2: stages: found 'stages'") && refused.contains("`marathon train a.yaml`"),
        "{refused}"
    );
}

#[test]
fn tasks_have_recipes_with_right_settings() {
    let names = ["HopperController", "WalkerController", "AntController", "MarathonManSteer", "MarathonManController"];
    for name in names {
        let recipe = recipe_for(name).unwrap_or_else(|| panic!("{name} has no recipe"));
        for stage in &recipe.stages {
            let StageKind::Train { config, .. } = &stage.kind else { continue };
            let text = config.as_ref().map(|name| shipped(name).unwrap_or_else(|| panic!("{name} does not ship")));
            let config = config.as_ref().zip(text).map(|(name, text)| (Path::new(name), text.as_bytes()));
            let base = recipe.base(stage, config).unwrap();
            recipe.settings(stage, base).unwrap_or_else(|e| panic!("{name}, {}: {e}", stage.name));
        }
    }
    assert_eq!(recipe_for("hoppercontroller-v0").unwrap().task, "HopperController-v0");
    assert!(recipe_for("hopper").is_none());
    // the schedules of 100 million steps, stopped after 80
    let steer = recipe_for("MarathonManSteer").unwrap();
    let stands = &steer.stages[1];
    let base =
        steer.base(stands, Some((Path::new("s"), shipped("marathon_man_steer-steady.yaml").unwrap().as_bytes())));
    assert_eq!(steer.settings(stands, base.unwrap()).unwrap().config.run.total_steps, 100_000_000);
}
