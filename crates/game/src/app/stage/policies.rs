//! The policies that come with the game, and those of files.

use bevy::prelude::*;
use bevy_marathon::{PolicyAsset, spec_of_role};
use marathon_learn::{Policy as Net, checksum};
use marathon_physics::budget;
use marathon_runs::{TaskConfig, policy_file};
use std::path::Path;
use std::sync::Arc;

/// Policies that come with the game.
const FILES: [&[u8]; 16] = [
    marathon_policies::bytes("hopper.safetensors"),
    marathon_policies::bytes("walker2d.safetensors"),
    marathon_policies::bytes("humanoid.safetensors"),
    marathon_policies::bytes("ant.safetensors"),
    marathon_policies::bytes("MarathonManWalk.safetensors"),
    marathon_policies::bytes("MarathonManRun.safetensors"),
    marathon_policies::bytes("MarathonManBackflip.safetensors"),
    marathon_policies::bytes("HumanoidStyleWalk.safetensors"),
    marathon_policies::bytes("HumanoidStyleRun.safetensors"),
    marathon_policies::bytes("MarathonManSteer.safetensors"),
    marathon_policies::bytes("AntController.safetensors"),
    marathon_policies::bytes("TerrainWalker2d.safetensors"),
    marathon_policies::bytes("HopperController.safetensors"),
    marathon_policies::bytes("WalkerController.safetensors"),
    marathon_policies::bytes("MarathonManController.safetensors"),
    marathon_policies::bytes("TerrainMarathonMan.safetensors"),
];

/// The policies that come with the game, decoded once.
#[derive(Resource, Clone)]
pub struct ShippedPolicies(Arc<[Shipped]>);

struct Shipped {
    policy: PolicyAsset,
    bytes: &'static [u8],
}

impl ShippedPolicies {
    /// Decodes the policies.
    pub fn decode() -> Self {
        let decode = |bytes: &&'static [u8]| {
            let policy = Net::from_bytes(Path::new("built in"), bytes).ok()?;
            Some(Shipped { policy: policy.into(), bytes })
        };
        ShippedPolicies(FILES.iter().filter_map(decode).collect())
    }

    /// The policy that comes with an agent.
    pub fn policy(&self, agent: &str) -> Option<&PolicyAsset> {
        self.find(agent).map(|shipped| &shipped.policy)
    }

    /// The policy that comes with an agent, and its name in the table of the longest runs; `file` is the name of its file.
    pub fn named(&self, agent: &str, file: &str) -> Option<(PolicyAsset, String)> {
        self.find(agent).map(|shipped| (shipped.policy.clone(), name_of(Path::new(file), shipped.bytes)))
    }

    /// The agents that have a policy, in the order in which a key goes through them.
    pub fn agents(&self) -> impl Iterator<Item = &str> + Clone {
        self.0.iter().map(|shipped| shipped.policy.0.meta().agent.as_str())
    }

    fn find(&self, agent: &str) -> Option<&Shipped> {
        self.0.iter().find(|shipped| shipped.policy.0.meta().agent == agent)
    }
}

/// The name of a policy in the table of the longest runs: the end of its path, and the start of its checksum.
fn name_of(path: &Path, bytes: &[u8]) -> String {
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    // files of all runs have the same name
    let folder = path.parent().and_then(Path::file_name).filter(|_| file.starts_with("policy"));
    let folder = folder.map(|folder| format!("{}/", folder.to_string_lossy())).unwrap_or_default();
    format!("{folder}{file} {}", &checksum(bytes)[..8])
}

/// Reads the policy of a role from a file, and names it.
///
/// # Errors
/// The text names the remedy.
pub fn read_file(path: &Path, task_config: &TaskConfig, role: usize) -> Result<(PolicyAsset, String), String> {
    let policy =
        task_config.factory().and_then(|factory| policy_file::read(path, spec_of_role(factory.spec(), role).as_ref()));
    let policy = policy.map_err(|e| e.to_string())?;
    let bytes = budget::read(path, &budget::POLICY_FILE).map_err(|e| format!("{}: {e}", path.display()))?;
    Ok((policy.into(), name_of(path, &bytes)))
}
