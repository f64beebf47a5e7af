//! The policies of a show: those that come with the game, and those of files.

use crate::app::args::Mode;
use crate::app::course::Part;
use crate::app::show::{Show, Source, file_stem};
use crate::asset::PolicyAsset;
use crate::herd::part_of;
use marathon_learn::{Policy as Net, checksum};
use marathon_physics::budget;
use marathon_runs::{Setting, policy_file};
use std::path::Path;

/// Policies that come with the game.
const SHIPPED: [&[u8]; 14] = [
    include_bytes!("../../../../assets/policies/hopper.safetensors"),
    include_bytes!("../../../../assets/policies/walker2d.safetensors"),
    include_bytes!("../../../../assets/policies/humanoid.safetensors"),
    include_bytes!("../../../../assets/policies/ant.safetensors"),
    include_bytes!("../../../../assets/policies/MarathonManWalk.safetensors"),
    include_bytes!("../../../../assets/policies/MarathonManRun.safetensors"),
    include_bytes!("../../../../assets/policies/MarathonManBackflip.safetensors"),
    include_bytes!("../../../../assets/policies/MarathonManSteer.safetensors"),
    include_bytes!("../../../../assets/policies/AntController.safetensors"),
    include_bytes!("../../../../assets/policies/TerrainWalker2d.safetensors"),
    include_bytes!("../../../../assets/policies/HopperController.safetensors"),
    include_bytes!("../../../../assets/policies/WalkerController.safetensors"),
    include_bytes!("../../../../assets/policies/MarathonManController.safetensors"),
    include_bytes!("../../../../assets/policies/TerrainMarathonMan.safetensors"),
];

/// The policy that comes with an agent.
pub fn shipped(agent: &str) -> Option<Net> {
    shipped_file(agent).map(|(policy, _)| policy)
}

/// The policy that comes with an agent, and its file.
fn shipped_file(agent: &str) -> Option<(Net, &'static [u8])> {
    let policies =
        SHIPPED.iter().filter_map(|bytes| Some((Net::from_bytes(Path::new("built in"), bytes).ok()?, *bytes)));
    policies.into_iter().find(|(policy, _)| policy.meta().agent == agent)
}

/// What a policy is called in the table of the longest runs: the end of its path, and the start of its checksum.
fn name_of(path: &Path, bytes: &[u8]) -> String {
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    // all runs have files of the same name
    let folder = path.parent().and_then(Path::file_name).filter(|_| file.starts_with("policy"));
    let folder = folder.map(|folder| format!("{}/", folder.to_string_lossy())).unwrap_or_default();
    format!("{folder}{file} {}", &checksum(bytes)[..8])
}

/// Agents that a policy comes with, in the order in which a key goes through them.
pub fn shipped_agents() -> Vec<String> {
    SHIPPED
        .iter()
        .filter_map(|b| Net::from_bytes(Path::new("built in"), b).ok())
        .map(|p| p.meta().agent.clone())
        .collect()
}

/// The policy of a show, with its name; the text of an error names the remedy.
pub fn read_policy(show: &Show, setting: &Setting) -> Result<Option<(PolicyAsset, String)>, String> {
    let shipped = || {
        let name = format!("{}.safetensors", file_stem(&show.agent));
        shipped_file(&show.agent).map(|(policy, bytes)| (policy.into(), name_of(Path::new(&name), bytes)))
    };
    match &show.source {
        Source::Nothing | Source::Trainer => Ok(None),
        Source::File(path) => read_file(path, setting, 0).map(Some),
        Source::Shipped if show.mode == Mode::Testbed => Ok(None),
        // its servos alone follow the clip for a while
        Source::Shipped if show.mode == Mode::Imitate => Ok(shipped()),
        Source::Shipped => match shipped() {
            Some(policy) => Ok(Some(policy)),
            None => {
                let name = &show.agent;
                Err(format!("no policy comes with {name}; `marathon train {name}` makes one, or learn live (menu)"))
            }
        },
    }
}

/// The policy of the task's second role, which runs write beside that of the first, if there is one and nobody plays the role.
pub fn read_opponent(show: &Show, setting: &Setting) -> Result<Option<(PolicyAsset, String)>, String> {
    let Source::File(path) = &show.source else { return Ok(None) };
    if show.mode == Mode::Course && show.course.part == Part::Build {
        return Ok(None);
    }
    let factory = setting.factory().map_err(|e| e.to_string())?;
    let Some(role) = factory.spec().roles.get(1) else { return Ok(None) };
    let [stem, end] = [path.file_stem(), path.extension()].map(|part| part.unwrap_or_default().to_string_lossy());
    let beside = path.with_file_name(format!("{stem}-{}.{end}", role.name));
    if beside.exists() { read_file(&beside, setting, 1).map(Some) } else { Ok(None) }
}

/// The policy of a role in a file.
fn read_file(path: &Path, setting: &Setting, role: usize) -> Result<(PolicyAsset, String), String> {
    let policy = setting.factory().and_then(|factory| policy_file::read(path, part_of(factory.spec(), role).as_ref()));
    let policy = policy.map_err(|e| e.to_string())?;
    let bytes = budget::read(path, &budget::POLICY_FILE).map_err(|e| format!("{}: {e}", path.display()))?;
    Ok((policy.into(), name_of(path, &bytes)))
}
