//! The scene that a command line asks for.

use crate::app::cli::Args;
use crate::app::error::GameError;
use crate::app::files::exists;
use crate::app::mode::Mode;
use crate::app::stage::clips::{FOLLOWER, follows_clip};
use crate::app::stage::course::{self, CourseOptions};
use crate::app::stage::policies::ShippedPolicies;
use crate::app::stage::scenario::{PolicySource, Scenario};
use bevy_marathon::spec_of_role;
use marathon_envs::registry;
use marathon_physics::Model;
use marathon_runs::folder::policy_path;
use marathon_runs::{RunError, TaskConfig, policy_file};
use std::path::Path;

/// The scenario of a command line.
///
/// # Errors
/// If there is no such agent, file or policy.
pub fn scenario(args: &Args, shipped: &ShippedPolicies) -> Result<Scenario, GameError> {
    let mut scenario = Scenario {
        mode: args.mode,
        agent: String::new(),
        chosen: TaskConfig::default(),
        source: PolicySource::Shipped,
        agents: usize::from(args.agents),
        ground: args.ground,
        course: course_options(args)?,
        seed: args.seed(),
        model: None,
    };
    let what = args.what();
    let path = Path::new(what);
    let is_model = path.extension().is_some_and(|e| e == "xml" || e == "mjcf");
    let robot = registry::robot_options(what).is_some();
    // the file of a robot is a task if it is to learn or has learned, and a model to try otherwise
    if robot && args.policy.is_none() && args.mode != Mode::Learn {
        return testbed(scenario, path, args);
    }
    let given = match (&args.policy, registry::agent(what)) {
        (_, Ok(agent)) => {
            scenario.agent = if robot { what.into() } else { agent.facts().id };
            args.policy.clone()
        }
        (_, Err(error)) if robot => return Err(error.into()),
        (_, Err(_)) if is_model => return testbed(scenario, path, args),
        (None, Err(_)) if path.exists() || what.contains(['/', '.']) => {
            exists(path)?;
            check_is_policy(path)?;
            Some(path.to_path_buf())
        }
        // neither an agent nor a file: the registry's message names the nearest agent
        (_, Err(error)) => return Err(error.into()),
    };
    if let Some(given) = given {
        if scenario.agent.is_empty() {
            let name = match policy_file::task_of(&given)? {
                Some(noted) => noted.agent,
                None => policy_file::read(&given, None)?.meta().agent.clone(),
            };
            scenario.agent = registry::agent(&name)?.facts().id;
        }
        scenario.source = PolicySource::File(policy_path(&given)?);
    }
    if scenario.mode == Mode::Imitate && !follows_clip(&scenario.agent) {
        let problem = format!(
            "imitate is for agents that follow a motion clip, {} follows none; {FOLLOWER} does",
            scenario.agent
        );
        return Err(RunError::option("mode", problem).into());
    }
    scenario.chosen = TaskConfig::named(&scenario.agent)?.with(&args.task)?;
    scenario.agent.clone_from(&scenario.chosen.agent);
    if scenario.mode == Mode::Course {
        scenario.course.take_from(&scenario.chosen.options);
    }
    let task_config = scenario.task_config(shipped)?;
    if scenario.mode == Mode::Course {
        course::check(&scenario.course, &task_config)?;
    }
    match &scenario.source {
        PolicySource::File(path) => {
            drop(policy_file::read(path, spec_of_role(task_config.factory()?.spec(), 0).as_ref())?)
        }
        _ if !args.task.given.is_empty() => drop(task_config.factory()?),
        _ => {}
    }
    if scenario.mode == Mode::Learn {
        scenario.play(PolicySource::Trainer, shipped);
    }
    Ok(scenario)
}

/// The scenario that tries the motors of a model.
fn testbed(scenario: Scenario, model: &Path, args: &Args) -> Result<Scenario, GameError> {
    exists(model)?;
    Model::from_xml_file(model).map_err(Box::new)?;
    if !args.task.given.is_empty() {
        return Err(RunError::option("option", "is for tasks, and a model of the test bed has none").into());
    }
    Ok(Scenario {
        mode: Mode::Testbed,
        model: Some(model.into()),
        source: PolicySource::Nothing,
        agent: "hopper".into(),
        ..scenario
    })
}

/// The course of a command line.
///
/// # Errors
/// If the mode is another one, or the difficulty is not from 0 to 1.
fn course_options(args: &Args) -> Result<CourseOptions, GameError> {
    let named =
        [("course", args.course.is_some()), ("difficulty", args.difficulty.is_some()), ("role", args.role.is_some())];
    if let Some((name, _)) = named.iter().find(|(_, given)| *given && args.mode != Mode::Course) {
        let problem =
            format!("goes with --mode course alone; a task that has such an argument takes --option {name}=VALUE");
        return Err(RunError::option(name, problem).into());
    }
    let own = CourseOptions::default();
    let difficulty = args.difficulty.unwrap_or(own.difficulty);
    if !(0.0..=1.0).contains(&difficulty) {
        return Err(RunError::option("difficulty", format!("is {difficulty}, expected a number from 0 to 1")).into());
    }
    Ok(CourseOptions { role: args.role.unwrap_or_default(), kind: args.course.clone().unwrap_or(own.kind), difficulty })
}

/// Names the option for a file that is not a policy.
fn check_is_policy(path: &Path) -> Result<(), GameError> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
    let (kind, words) = match extension.as_str() {
        "bvh" | "glb" | "gltf" | "vrm" | "vrma" | "motion" => ("a motion", "MarathonMan --mode imitate --option clip="),
        "replay" => ("a recording of the game", "--replay "),
        _ => return Ok(()),
    };
    Err(GameError::Kind { path: path.into(), kind, words })
}
