//! Configuration files of the trainer, in the schema of ML-Agents: bytes in, the trainer's configuration and notes out.
//!
//! Nothing here reads a file or knows a command line, so that a browser can use it, too.
//!
//! The way of a file: `document` makes a tree of the YAML text, `current` or `legacy` finds the agent's sections in
//! it (`behavior`, `names`) and refuses what is misspelled or missing here (`features`), `settings` reads
//! ML-Agents' keys with its defaults, `convert` turns them into the trainer's configuration and adds what the
//! `marathon:` section says. `section` is what all of them read values with.
//!
//! `docs/configs.md` has the tables.

mod behavior;
mod convert;
mod current;
mod document;
mod error;
mod features;
mod legacy;
mod names;
mod parse;
mod section;
mod settings;

pub use error::ConfigError;
pub use parse::{parse, parse_roles};

use marathon_envs::options::Value;
use marathon_learn::TrainConfig;

/// For Gymnasium's own tasks.
const GYMNASIUM: (&str, &str) = ("gymnasium-fast.yaml", include_str!("../../../assets/configs/gymnasium-fast.yaml"));

/// For dm_control's suite.
const DM_CONTROL: (&str, &str) = ("dm_control-fast.yaml", include_str!("../../../assets/configs/dm_control-fast.yaml"));

/// For figures in a plane that are told how fast to go.
const CONTROLLER: (&str, &str) = ("controller-fast.yaml", include_str!("../../../assets/configs/controller-fast.yaml"));

/// File of the Ant told where to go.
const ANT_CONTROLLER: (&str, &str) =
    ("ant_controller-fast.yaml", include_str!("../../../assets/configs/ant_controller-fast.yaml"));

/// For figures that run over uneven ground.
const TERRAIN: (&str, &str) = ("terrain-fast.yaml", include_str!("../../../assets/configs/terrain-fast.yaml"));

/// For an adversary that builds the ground of a runner that does not learn, and the name of the adversary's role.
const ADVERSARY: (&str, &str) =
    ("terrain-adversary.yaml", include_str!("../../../assets/configs/terrain-adversary.yaml"));
const BUILDER: &str = "builder";

/// For Marathon Man and his clips.
const MARATHON_MAN: (&str, &str) =
    ("marathon_man-fast.yaml", include_str!("../../../assets/configs/marathon_man-fast.yaml"));

/// For Marathon Man told where to go.
const MARATHON_MAN_STEER: (&str, &str) =
    ("marathon_man_steer-fast.yaml", include_str!("../../../assets/configs/marathon_man_steer-fast.yaml"));
/// For Marathon Man on assault courses.
const MARATHON_MAN_TERRAIN: (&str, &str) =
    ("marathon_man_terrain-fast.yaml", include_str!("../../../assets/configs/marathon_man_terrain-fast.yaml"));
/// For Marathon Man in a player's hands.
const MARATHON_MAN_CONTROLLER: (&str, &str) =
    ("marathon_man_controller-fast.yaml", include_str!("../../../assets/configs/marathon_man_controller-fast.yaml"));

/// For the paper's Humanoid and Walker in the style of a person.
const IN_STYLE: (&str, &str) = ("in_style-fast.yaml", include_str!("../../../assets/configs/in_style-fast.yaml"));

/// The configurations that come with the agents, file and text, by the agent's id or its id without the version.
const FAST: [(&str, (&str, &str)); 49] = [
    ("Hopper-v5", GYMNASIUM),
    ("Walker2d-v5", GYMNASIUM),
    ("HalfCheetah-v5", GYMNASIUM),
    ("Ant-v5", GYMNASIUM),
    ("Humanoid-v5", GYMNASIUM),
    ("hopper-stand", DM_CONTROL),
    ("hopper-hop", DM_CONTROL),
    ("walker-stand", DM_CONTROL),
    ("walker-walk", DM_CONTROL),
    ("walker-run", DM_CONTROL),
    ("humanoid-stand", DM_CONTROL),
    ("humanoid-walk", DM_CONTROL),
    ("humanoid-run", DM_CONTROL),
    ("cheetah-run", DM_CONTROL),
    ("Hopper", ("hopper-fast.yaml", include_str!("../../../assets/configs/hopper-fast.yaml"))),
    ("Walker2d", ("walker2d-fast.yaml", include_str!("../../../assets/configs/walker2d-fast.yaml"))),
    ("Humanoid", ("humanoid-fast.yaml", include_str!("../../../assets/configs/humanoid-fast.yaml"))),
    ("Ant", ("ant-fast.yaml", include_str!("../../../assets/configs/ant-fast.yaml"))),
    ("HopperController", CONTROLLER),
    ("WalkerController", CONTROLLER),
    ("AntController", ANT_CONTROLLER),
    ("TerrainHopper", TERRAIN),
    ("TerrainWalker2d", TERRAIN),
    ("TerrainAnt", TERRAIN),
    ("TerrainMarathonMan", MARATHON_MAN_TERRAIN),
    ("MarathonMan", MARATHON_MAN),
    ("MarathonManWalk", MARATHON_MAN),
    ("MarathonManWalkLeft", MARATHON_MAN),
    ("MarathonManWalkRight", MARATHON_MAN),
    ("MarathonManRun", MARATHON_MAN),
    ("MarathonManBackflip", MARATHON_MAN),
    ("MarathonManSpinKick", MARATHON_MAN),
    ("MarathonManSpin", MARATHON_MAN),
    ("MarathonManCartwheel", MARATHON_MAN),
    ("MarathonManRoll", MARATHON_MAN),
    ("MarathonManJump", MARATHON_MAN),
    ("MarathonManKick", MARATHON_MAN),
    ("MarathonManPunch", MARATHON_MAN),
    ("MarathonManDance", MARATHON_MAN),
    ("MarathonManCrawl", MARATHON_MAN),
    ("MarathonManGetUpFaceDown", MARATHON_MAN),
    ("MarathonManGetUpFaceUp", MARATHON_MAN),
    ("MarathonManSparse", MARATHON_MAN),
    ("MarathonManSteer", MARATHON_MAN_STEER),
    ("MarathonManController", MARATHON_MAN_CONTROLLER),
    ("HumanoidStyleWalk", IN_STYLE),
    ("HumanoidStyleRun", IN_STYLE),
    ("Walker2dStyleWalk", IN_STYLE),
    ("Walker2dStyleRun", IN_STYLE),
];

/// What a file says about the training of an agent.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The trainer's configuration; it is valid.
    pub config: TrainConfig,
    /// Arguments of the task that differ from its defaults.
    pub options: Vec<(String, Value)>,
    /// Steps of a rollout of all agents, where the file says that and not `horizon`: with more agents, each makes fewer
    /// decisions.
    pub buffer: Option<u64>,
    /// Steps between summaries.
    pub summary_freq: u64,
    /// Steps between checkpoints.
    pub checkpoint_interval: u64,
    /// Policies on the way that are kept.
    pub keep_checkpoints: usize,
    /// What the user should know: settings that have no effect here, or not the one that they seem to have.
    pub notes: Vec<String>,
}

impl Default for Loaded {
    /// The trainer's own defaults.
    fn default() -> Self {
        Loaded {
            config: TrainConfig::default(),
            options: Vec::new(),
            buffer: None,
            summary_freq: 50_000,
            checkpoint_interval: 500_000,
            keep_checkpoints: 5,
            notes: Vec::new(),
        }
    }
}

/// The settings that an algorithm starts from, by its name.
///
/// # Panics
/// If there is no such algorithm, which the command line rules out.
pub fn default_of(algorithm: &str) -> Loaded {
    let config = TrainConfig::of(algorithm).expect("the name of an algorithm");
    Loaded { config, ..Loaded::default() }
}

/// The configuration that trains an adversary against a runner of a course, which does not learn.
///
/// # Errors
/// If there is none for the task.
pub fn against(task: &str) -> Result<Loaded, ConfigError> {
    let (path, bytes) = (ADVERSARY.0.as_ref(), ADVERSARY.1.as_bytes());
    let id = names::id(task);
    let mut loaded = parse(path, bytes, &id)?;
    loaded.config.roles = parse_roles(path, bytes, &id, &[BUILDER])?;
    Ok(loaded)
}

/// The configuration that trains an agent fast; the trainer's own defaults for agents that have none.
///
/// # Panics
/// If a configuration that is part of the program is wrong, which a test rules out.
pub fn default_for(agent: &str) -> Loaded {
    let id = names::id(agent);
    let names = [id.as_str(), names::base(&id)];
    let found = names.iter().find_map(|name| FAST.iter().find(|(known, _)| known.eq_ignore_ascii_case(name)));
    match found {
        Some((_, (file, text))) => {
            let loaded =
                parse(file.as_ref(), text.as_bytes(), &id).expect("the program's own configurations are right");
            // their rollouts are made for stretches of a length
            Loaded { buffer: None, ..loaded }
        }
        None => Loaded::default(),
    }
}
