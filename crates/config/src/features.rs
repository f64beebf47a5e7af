//! Features of ML-Agents that Marathon lacks: refused where they would change what is learned, noted where they are
//! harmless.

use super::behavior::Notes;
use super::error::{ConfigError, Place};
use super::section::{Entry, Range, Section};
use marathon_learn::{
    Activation, Algorithm, Deviations, Form, Imitation, Init, Moving, NetworkConfig, Novelty, Ppo, Ratio, RewardConfig,
    RewardKind, Sac, Schedule, StatisticsConfig, TrainConfig,
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

/// Features that a file asks for and lets go again, under `marathon: without:`.
pub struct Without<'a> {
    names: Vec<&'static str>,
    file_has_list: Option<Entry<'a>>,
}

/// What may be let go: the name in the list, and in messages.
const FEATURES: [(&str, &str); 5] = [
    ("curiosity", "curiosity"),
    ("rnd", "random network distillation"),
    ("gail", "imitation by GAIL"),
    ("behavioral_cloning", "behavioral cloning"),
    ("memory", "recurrent memory"),
];

impl<'a> Without<'a> {
    /// Reads the list.
    ///
    /// # Errors
    /// If it is no list of known features.
    pub fn read(marathon: &Section<'a>) -> Result<Self, ConfigError> {
        let Some(entry) = marathon.set("without") else {
            return Ok(Without { names: Vec::new(), file_has_list: None });
        };
        let all = FEATURES.map(|(name, _)| name);
        let items = entry.items(&format!("a list of some of {}", all.join(", ")))?;
        let names: Result<Vec<_>, _> = items.iter().map(|item| item.word(&all).map(|i| all[i])).collect();
        Ok(Without { names: names?, file_has_list: Some(entry) })
    }

    /// Whether the file says that a feature that an entry asks for may be left out; then it is noted.
    pub fn leaves_out(&self, name: &str, asks: &Entry<'_>, notes: &mut Notes) -> bool {
        let Some((_, feature)) = FEATURES.into_iter().find(|(n, _)| *n == name && self.names.contains(n)) else {
            return false;
        };
        let line = self.file_has_list.as_ref().map_or(0, |entry| entry.place.line);
        notes.about(asks, &format!("asks for {feature}, which is left out as line {line} allows"));
        true
    }

    /// Refuses a feature that an entry asks for, or notes that it is left out.
    ///
    /// # Errors
    /// Unless the file itself says that the feature may be left out.
    pub fn feature(&self, name: &str, asks: &Entry<'_>, off: &str, notes: &mut Notes) -> Result<(), ConfigError> {
        if self.leaves_out(name, asks, notes) {
            return Ok(());
        }
        let (name, feature) = FEATURES.into_iter().find(|(n, _)| *n == name).expect("a feature of the table");
        Err(ConfigError::Unsupported {
            place: asks.place.clone(),
            feature,
            found: asks.node.describe(),
            expected: format!("{off}, or 'marathon: {{without: [{name}]}}' beside it to train without"),
        })
    }
}

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
        schedule: Schedule::Linear,
        entropy_coef: Moving::still(5e-3),
        ratio: Ratio::PerAction,
        deviations: Deviations {
            action_clip: 3.0,
            init_log_std: 0.0,
            // neither the deviation nor the gradient is bounded: far out
            min_std: Moving::still(1e-3),
            max_std: 1e3,
        },
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
        actor_hidden: vec![128; 2],
        critic_hidden: vec![128; 2],
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
    without: &Without<'_>,
    notes: &mut Notes,
) -> Result<(Section<'a>, Vec<RewardConfig>), ConfigError> {
    let signals = top.section("reward_signals")?;
    let mut others = Vec::new();
    let Some(whole) = top.set("reward_signals") else { return Ok((signals, others)) };
    signals.only(&["extrinsic", "curiosity", "rnd", "gail", "amp"])?;
    for name in ["curiosity", "rnd", "gail", "amp"] {
        let Some(entry) = signals.set(name) else { continue };
        // a reward of strength zero is switched off
        let section = signals.section(name)?;
        if section.number("strength", Range::NotNegative, 1.0)? == 0.0 {
            continue;
        }
        match name {
            _ if without.leaves_out(name, &entry, notes) => {}
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
