//! Agents under the names of other systems.

use marathon_envs::EnvError;
use marathon_envs::registry;
use marathon_envs::shard::role_id;

/// Names of the paper's scenes and of the repository's later versions, without the agent's own. `(agent, names)`
const BRAINS: [(&str, &[&str]); 4] = [
    ("Hopper", &["DeepMindHopperBrain", "OpenAIHopperBrain", "HopperBrain"]),
    ("Walker2d", &["Walker", "DeepMindWalkerBrain", "OpenAIWalker2dBrain", "OpenAIWalkerBrain", "WalkerBrain"]),
    ("Humanoid", &["DeepMindHumanoidBrain", "OpenAIHumanoidBrain", "HumanoidBrain"]),
    ("Ant", &["OpenAIAntBrain", "DeepMindAntBrain", "AntBrain"]),
];

/// The registered id of an agent's name; the name itself if no agent is registered under it.
pub fn id(agent: &str) -> String {
    marathon_envs::agent(agent).map_or_else(|_| agent.to_string(), |found| found.facts().id)
}

/// Whether a task goes by a name, of this system or another.
///
/// # Errors
/// If none does: the nearest name, if one is close. The path of a model is not the name of a task.
pub fn known(name: &str) -> Result<(), Option<String>> {
    if registry::robot_options(name).is_some() {
        return Err(Some(id("Robot-v0")));
    }
    match registry::agent(name) {
        _ if task(name).is_some() => Ok(()),
        Ok(_) => Ok(()),
        Err(EnvError::UnknownAgent { nearest, .. }) => Err(nearest),
        Err(_) => Err(None),
    }
}

/// An id without its version.
pub fn base(id: &str) -> &str {
    match id.rsplit_once("-v") {
        Some((base, version)) if version.parse::<u32>().is_ok() => base,
        _ => id,
    }
}

/// Names under which a file may speak of an agent, the most particular first.
pub fn accepted(id: &str) -> Vec<&str> {
    let base = base(id);
    let mut names = vec![id];
    if base != id {
        names.push(base);
    }
    let brains = BRAINS.iter().find(|(agent, _)| agent.eq_ignore_ascii_case(base));
    names.extend(brains.map_or(&[][..], |(_, names)| names));
    names
}

/// The agent's own name for one of another system.
pub fn task(name: &str) -> Option<&'static str> {
    let of_agent = |(_, names): &&(&str, &[&str])| names.iter().any(|known| known.eq_ignore_ascii_case(name));
    BRAINS.iter().find(of_agent).map(|(agent, _)| *agent)
}

/// The key among `keys` that speaks of an agent, ignoring case.
pub fn find<'a>(id: &str, keys: impl Iterator<Item = &'a str> + Clone) -> Option<&'a str> {
    first(accepted(id).into_iter(), keys)
}

/// The key among `keys` that speaks of a role of an agent, ignoring case.
pub fn find_role<'a>(id: &str, role: &str, keys: impl Iterator<Item = &'a str> + Clone) -> Option<&'a str> {
    first(accepted(id).into_iter().map(|name| role_id(name, role)), keys)
}

/// The key that is the first of these names that is there.
fn first<'a>(
    mut names: impl Iterator<Item = impl AsRef<str>>,
    keys: impl Iterator<Item = &'a str> + Clone,
) -> Option<&'a str> {
    names.find_map(|name| keys.clone().find(|key| key.eq_ignore_ascii_case(name.as_ref())))
}
