//! Rewards in files: a mapping from their kinds to their settings, in the order in which they are learned from.

use super::discriminator::{Form, Imitation};
use super::{RewardConfig, RewardKind};
use serde::de::{DeserializeOwned, Error as _};
use serde::ser::{Error as _, SerializeMap};
use serde::{Deserialize, Deserializer, Serializer};
use serde_json::{Map, Value};
use std::collections::BTreeMap;

type Settings = Map<String, Value>;

/// Of the task's own reward, which has no network.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Nothing {}

/// Writes rewards.
///
/// # Errors
/// Those of the serializer.
pub fn serialize<S: Serializer>(rewards: &[RewardConfig], serializer: S) -> Result<S::Ok, S::Error> {
    let mut map = serializer.serialize_map(Some(rewards.len()))?;
    for reward in rewards {
        let own = match &reward.kind {
            RewardKind::Task => Ok(Value::Object(Settings::new())),
            RewardKind::Curiosity(own) | RewardKind::Rnd(own) => serde_json::to_value(own),
            RewardKind::Imitation(own) => serde_json::to_value(own),
        };
        let mut settings = own.map_err(S::Error::custom)?;
        (settings["strength"], settings["gamma"]) = (reward.strength.into(), reward.gamma.into());
        map.serialize_entry(reward.kind.name(), &settings)?;
    }
    map.end()
}

/// Reads rewards. The task's own is there in any case, another one unless it is `null`.
///
/// # Errors
/// If there is no such reward, or it has no such setting.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<RewardConfig>, D::Error> {
    let mut found = BTreeMap::<String, Option<Settings>>::deserialize(deserializer)?;
    let mut rewards = Vec::new();
    for name in RewardKind::NAMES {
        match found.remove(name).flatten() {
            Some(settings) => rewards.push(read(name, settings).map_err(D::Error::custom)?),
            None if name == "task" => rewards.push(RewardConfig::new(RewardKind::Task)),
            None => {}
        }
    }
    match found.keys().next() {
        None => Ok(rewards),
        Some(other) => Err(D::Error::unknown_field(other, &RewardKind::NAMES)),
    }
}

/// A reward of a kind; errors name the setting.
fn read(name: &str, mut settings: Settings) -> Result<RewardConfig, String> {
    let of = |key: &str, error: serde_json::Error| format!("rewards.{name}{key}: {error}");
    let mut number = |key: &str| -> Result<Option<f64>, String> {
        settings.remove(key).map(serde_json::from_value).transpose().map_err(|error| of(&format!(".{key}"), error))
    };
    let (strength, gamma) = (number("strength")?, number("gamma")?);
    fn own<T: DeserializeOwned>(settings: Settings) -> Result<T, serde_json::Error> {
        serde_json::from_value(Value::Object(settings))
    }
    let imitation = |form, settings| own(settings).map(|own| RewardKind::Imitation(Imitation { form, ..own }));
    let kind = match name {
        "task" => own::<Nothing>(settings).map(|_| RewardKind::Task),
        "curiosity" => own(settings).map(RewardKind::Curiosity),
        "rnd" => own(settings).map(RewardKind::Rnd),
        "gail" => imitation(Form::Gail, settings),
        _ => imitation(Form::Amp, settings),
    };
    let default = RewardConfig::new(kind.map_err(|error| of("", error))?);
    let (strength, gamma) = (strength.unwrap_or(default.strength), gamma.unwrap_or(default.gamma));
    Ok(RewardConfig { strength, gamma, ..default })
}
