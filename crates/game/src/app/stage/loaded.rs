//! The policies of the loaded scenario. A policy's file is read again when it changes.

use crate::app::files::file_stem;
use crate::app::mode::Mode;
use crate::app::notifications::Notifications;
use crate::app::stage::course::PlayerRole;
use crate::app::stage::policies::{ShippedPolicies, read_file};
use crate::app::stage::scenario::{LoadScenario, PolicySource, Scenario};
use bevy::prelude::*;
use bevy_marathon::{Ground, PolicyAsset};
use marathon_runs::TaskConfig;
use std::path::Path;
use std::time::SystemTime;

/// Seconds between two looks at the policy's file.
const WATCH: f32 = 0.5;

/// The task of the loaded scenario, and its policies.
#[derive(Resource, Default)]
pub struct LoadedPolicy {
    /// The asset that all actors have.
    pub policy: Option<Handle<PolicyAsset>>,
    /// The task.
    pub task_config: TaskConfig,
    /// The ground.
    pub ground: Ground,
    /// The policies of the task's roles, by file and checksum.
    pub names: [Option<String>; 2],
    /// When the policy's file was written.
    pub written: Option<SystemTime>,
    /// Seconds since the last look at the file.
    looked: f32,
}

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<LoadedPolicy>();
}

/// Reads the policy of a scenario, and names it; the text of an error names the remedy.
pub fn read_policy(
    scenario: &Scenario,
    task_config: &TaskConfig,
    shipped: &ShippedPolicies,
) -> Result<Option<(PolicyAsset, String)>, String> {
    let own = || shipped.named(&scenario.agent, &format!("{}.safetensors", file_stem(&scenario.agent)));
    match &scenario.source {
        PolicySource::Nothing | PolicySource::Trainer => Ok(None),
        PolicySource::File(path) => read_file(path, task_config, 0).map(Some),
        PolicySource::Shipped if scenario.mode == Mode::Testbed => Ok(None),
        // without a policy, the servos alone follow the clip for a while
        PolicySource::Shipped if scenario.mode == Mode::Imitate => Ok(own()),
        PolicySource::Shipped => match own() {
            Some(policy) => Ok(Some(policy)),
            None => {
                let name = &scenario.agent;
                Err(format!("no policy comes with {name}; `marathon train {name}` makes one, or learn live (menu)"))
            }
        },
    }
}

/// Reads the policy of the task's second role, which runs write beside that of the first. `None` if there is no such file, or
/// if the player has that role.
pub fn read_opponent(scenario: &Scenario, task_config: &TaskConfig) -> Result<Option<(PolicyAsset, String)>, String> {
    let PolicySource::File(path) = &scenario.source else { return Ok(None) };
    if scenario.mode == Mode::Course && scenario.course.role == PlayerRole::Build {
        return Ok(None);
    }
    let factory = task_config.factory().map_err(|e| e.to_string())?;
    let Some(role) = factory.spec().roles.get(1) else { return Ok(None) };
    let [stem, end] = [path.file_stem(), path.extension()].map(|part| part.unwrap_or_default().to_string_lossy());
    let beside = path.with_file_name(format!("{stem}-{}.{end}", role.name));
    if beside.exists() { read_file(&beside, task_config, 1).map(Some) } else { Ok(None) }
}

/// When a file was written.
pub fn written(path: &Path) -> Option<SystemTime> {
    std::fs::metadata(path).and_then(|m| m.modified()).ok()
}

/// Reads the policy's file again when it has changed.
pub fn reload(
    time: Res<Time<Real>>,
    (scenario, shipped): (Res<Scenario>, Res<ShippedPolicies>),
    mut loaded: ResMut<LoadedPolicy>,
    mut loads: MessageWriter<LoadScenario>,
    mut policies: ResMut<Assets<PolicyAsset>>,
    mut notes: ResMut<Notifications>,
) {
    let PolicySource::File(path) = &scenario.source else { return };
    loaded.looked += time.delta_secs();
    if loaded.looked < WATCH {
        return;
    }
    loaded.looked = 0.0;
    let now = written(path);
    if now.is_none() || now == loaded.written {
        return;
    }
    loaded.written = now;
    // the policy of another run may have another clip
    if scenario.task_config(&shipped).is_ok_and(|task_config| task_config != loaded.task_config) {
        loads.write(LoadScenario);
        return;
    }
    match read_policy(&scenario, &loaded.task_config, &shipped) {
        Ok(Some((policy, name))) => {
            loaded.names[0] = Some(name);
            let steps = policy.0.meta().training.as_ref().map(|t| t.steps);
            if let Some(handle) = &loaded.policy {
                let _ = policies.insert(handle.id(), policy);
            }
            let steps = steps.map(|s| format!(" ({:.1} million steps)", s as f64 / 1e6)).unwrap_or_default();
            notes.say(format!("the policy has changed{steps}"));
        }
        Ok(None) => {}
        // the file may be half written; the next look finds all of it
        Err(text) => notes.error(text),
    }
}
