//! Features of ML-Agents that Marathon lacks: refused where they would change what is learned, noted where they are
//! harmless.

use super::behavior::Notes;
use crate::error::{ConfigError, Place};
use crate::section::{Entry, Range, Section};
use marathon_learn::{
    ActionStd, Activation, Algorithm, Form, Imitation, Init, LrSchedule, NetworkConfig, Novelty, Ppo, Ratio,
    RewardConfig, RewardKind, Sac, Schedule, StatisticsConfig, TrainConfig,
};

/// Keys of a network's section.
pub const NETWORK: [&str; 8] = [
    "normalize",
    "hidden_units",
    "num_layers",
    "vis_encode_type",
    "memory",
    "goal_conditioning_type",
    "deterministic",
    "max_num_agents",
];

/// The settings that a trainer starts from: those of ML-Agents for PPO, which is meant where none is named, and those of
/// OpenAI Baselines for the two that ML-Agents has not.
///
/// # Errors
/// If the entry names a trainer that is not here.
pub fn trainer(entry: Option<Entry<'_>>) -> Result<TrainConfig, ConfigError> {
    let Some(entry) = entry else { return Ok(ml_agents()) };
    match entry.word(&Algorithm::NAMES).map(|i| Algorithm::NAMES[i]) {
        Ok("ppo") => Ok(ml_agents()),
        Ok("sac") => Ok(ml_agents_sac()),
        Ok(name) => Ok(TrainConfig::of(name).expect("the name of an algorithm")),
        Err(_) => Err(ConfigError::Unsupported {
            feature: "this trainer",
            found: entry.node.describe(),
            expected: format!("one of {}", Algorithm::NAMES.join(", ")),
            place: entry.place,
        }),
    }
}

/// SAC with ML-Agents' defaults, which [`convert`](super::convert) completes, and networks as for PPO.
fn ml_agents_sac() -> TrainConfig {
    TrainConfig::sac().with(|config| {
        config.run.agents = 16;
        config.network = NetworkConfig { initialization: Init::Orthogonal, ..network() };
        config.statistics.normalize_observations = false;
        config.statistics.observation_clip = 5.0;
        config.algorithm = Algorithm::Sac(Sac { lr: 3e-4, value_lr: 3e-4, ..Default::default() });
    })
}

/// PPO with ML-Agents' defaults, and with what it does without saying so in a file.
fn ml_agents() -> TrainConfig {
    let ppo = Ppo {
        epochs: 3,
        lr: 3e-4,
        lr_schedule: LrSchedule::Linear,
        entropy_coef: Schedule::constant(5e-3),
        ratio: Ratio::PerAction,
        action_clip: 3.0,
        // neither the deviation nor the gradient is bounded: far out
        action_std: ActionStd { init_log: 0.0, min: Schedule::constant(1e-3), max: 1e3 },
        max_grad_norm: 1e9,
        // PyTorch's
        adam_epsilon: 1e-8,
        // ML-Agents means to bound the value's change by epsilon, but reads the returns where it stored the old values
        // (`RewardSignalUtil.value_estimates_key` of 1.1.0): nothing is bounded
        value_clip: None,
        ..Default::default()
    };
    TrainConfig {
        network: network(),
        statistics: StatisticsConfig {
            normalize_observations: false,
            follow_statistics: true,
            // normalized observations lie within this
            observation_clip: 5.0,
            scale_rewards: false,
            ..Default::default()
        },
        algorithm: Algorithm::Ppo(ppo),
        ..Default::default()
    }
}

/// ML-Agents' networks.
fn network() -> NetworkConfig {
    NetworkConfig {
        hidden: vec![128; 2],
        critic_hidden: None,
        activation: Activation::Swish,
        initialization: Init::MlAgents,
    }
}

/// Refuses a feature that is asked for by a key with any value.
///
/// # Errors
/// If the key is there.
pub fn refuse(entry: Option<Entry<'_>>, feature: &'static str, expected: &str) -> Result<(), ConfigError> {
    match entry {
        Some(Entry { place, node, .. }) => {
            Err(ConfigError::Unsupported { place, feature, found: node.describe(), expected: expected.into() })
        }
        None => Ok(()),
    }
}

/// Refuses a feature that is asked for by `true`.
///
/// # Errors
/// If it is, or if the value is no truth value.
pub fn off(section: &Section<'_>, key: &str, feature: &'static str) -> Result<(), ConfigError> {
    match section.set(key) {
        Some(entry) if entry.flag()? => refuse(Some(entry), feature, "false"),
        _ => Ok(()),
    }
}

/// An encoder of pictures, which no agent here sees.
///
/// # Errors
/// If the value is unknown to ML-Agents too.
pub fn visual(network: &Section<'_>, notes: &mut Notes) -> Result<(), ConfigError> {
    if let Some(entry) = network.set("vis_encode_type")
        && entry.word(&["simple", "nature_cnn", "resnet", "match3", "fully_connected"])? != 0
    {
        notes.ignored(&entry, "the agents see no pictures");
    }
    Ok(())
}

/// Acting while learning.
///
/// # Errors
/// If the value is no truth value.
pub fn threaded(top: &Section<'_>, notes: &mut Notes) -> Result<(), ConfigError> {
    if let Some(entry) = top.set("threaded")
        && entry.flag()?
    {
        notes.ignored(&entry, "acting and learning take turns, each on all threads");
    }
    Ok(())
}

/// The rewards: returns the section of the task's own, and the others.
///
/// # Errors
/// If there are others, or the task's own is missing or has no strength.
pub fn reward_signals<'a>(
    top: &Section<'a>,
    notes: &mut Notes,
) -> Result<(Section<'a>, Vec<RewardConfig>), ConfigError> {
    let signals = top.section("reward_signals")?;
    let mut others = Vec::new();
    let Some(whole) = top.set("reward_signals") else { return Ok((signals, others)) };
    signals.only(&["extrinsic", "curiosity", "rnd", "gail", "amp"])?;
    for name in ["curiosity", "rnd", "gail", "amp"] {
        if signals.set(name).is_none() {
            continue;
        }
        // a reward of strength zero is switched off
        let section = signals.section(name)?;
        if section.number("strength", Range::NotNegative, 1.0)? == 0.0 {
            continue;
        }
        match name {
            "curiosity" => others.push(novelty_of(RewardKind::Curiosity, &section, notes)?),
            "rnd" => others.push(novelty_of(RewardKind::Rnd, &section, notes)?),
            "gail" => others.push(imitation_of(Form::Gail, &section, notes)?),
            _ => others.push(imitation_of(Form::Amp, &section, notes)?),
        }
    }
    if signals.get("extrinsic").is_none() {
        return Err(ConfigError::Unsupported {
            place: Place { key: format!("{}.extrinsic", whole.place.key), ..whole.place },
            feature: "training without the task's own reward",
            found: "nothing".into(),
            expected: "a section with gamma and strength".into(),
        });
    }
    let extrinsic = signals.section("extrinsic")?;
    extrinsic.only(&["gamma", "strength", "network_settings"])?;
    let strength = extrinsic.number("strength", Range::Positive, 1.0)?;
    if let Some(entry) = extrinsic.get("strength").filter(|_| strength != 1.0 && others.is_empty()) {
        notes.ignored(&entry, "with one reward, its scale does not change the policy's gradient; it is taken as 1");
    }
    if let Some(entry) = extrinsic.set("network_settings") {
        notes.ignored(&entry, "the task's own reward needs no network");
    }
    Ok((extrinsic, others))
}

/// A reward for novelty.
fn novelty_of(
    kind: fn(Novelty) -> RewardKind,
    section: &Section<'_>,
    notes: &mut Notes,
) -> Result<RewardConfig, ConfigError> {
    section.only(&["gamma", "strength", "network_settings", "learning_rate", "encoding_size"])?;
    let defaults = Novelty::default();
    // the name that the width had before version 0.18
    let width = section.count("encoding_size", 1..=4096, 128)?;
    let networks = Novelty {
        hidden: hidden(section, width, notes)?,
        lr: section.number("learning_rate", Range::Positive, defaults.lr)?,
    };
    reward(kind(networks), section)
}

/// A reward for imitation: ML-Agents' keys, and those of [`Imitation`].
fn imitation_of(form: Form, section: &Section<'_>, notes: &mut Notes) -> Result<RewardConfig, ConfigError> {
    const KEYS: [&str; 10] = [
        "gamma",
        "strength",
        "network_settings",
        "learning_rate",
        "demo_path",
        "use_actions",
        "observations",
        "gradient_penalty",
        "logit_decay",
        "share",
    ];
    let mut keys = KEYS.to_vec();
    let mut defaults = Imitation { form, ..Imitation::default() };
    if form == Form::Gail {
        keys.extend(["use_vail", "encoding_size"]);
        // as ML-Agents has them
        (defaults.activation, defaults.share) = (Activation::Swish, 1.0);
    }
    section.only(&keys)?;
    off(section, "use_vail", "a variational bottleneck of the discriminator")?;
    let width = section.count("encoding_size", 1..=4096, 128)?;
    let names = match section.set("observations") {
        None => Vec::new(),
        Some(entry) => {
            let items = entry.items("a list of names of an observation's parts")?;
            items.iter().map(|item| item.word_of_any_kind("a name")).collect::<Result<_, _>>()?
        }
    };
    let settings = Imitation {
        hidden: hidden(section, width, notes)?,
        lr: section.number("learning_rate", Range::Positive, defaults.lr)?,
        observations: names,
        actions: section.flag("use_actions", false)?,
        gradient_penalty: section.number("gradient_penalty", Range::NotNegative, defaults.gradient_penalty)?,
        logit_decay: section.number("logit_decay", Range::NotNegative, defaults.logit_decay)?,
        share: section.number("share", Range::Fraction, defaults.share)?,
        demonstrations: section
            .set("demo_path")
            .map(|entry| entry.word_of_any_kind("the path of a .demo file"))
            .transpose()?,
        ..defaults
    };
    reward(RewardKind::Imitation(settings), section)
}

/// Widths of the hidden layers of a reward's network.
fn hidden(section: &Section<'_>, width: u64, notes: &mut Notes) -> Result<Vec<usize>, ConfigError> {
    let network = section.section("network_settings")?;
    network.only(&NETWORK)?;
    let width = network.count("hidden_units", 1..=4096, width)? as usize;
    let layers = network.count("num_layers", 1..=64, 2)? as usize;
    visual(&network, notes)?;
    for key in ["normalize", "memory", "goal_conditioning_type", "deterministic", "max_num_agents"] {
        if let Some(entry) = network.set(key) {
            notes.ignored(&entry, "the network of a signal sees what the policy sees, and is a plain one");
        }
    }
    Ok(vec![width; layers])
}

/// A reward with the strength and the discount of its section.
fn reward(kind: RewardKind, section: &Section<'_>) -> Result<RewardConfig, ConfigError> {
    let defaults = RewardConfig::new(kind);
    Ok(RewardConfig {
        strength: section.number("strength", Range::Positive, defaults.strength)?,
        gamma: section.number("gamma", Range::Fraction, defaults.gamma)?,
        ..defaults
    })
}
