//! Environments with the policies that act in them.

use crate::abi::respond;
use crate::answer::{Answer, Failure, Request, numbers};
use crate::hash;
use crate::objects::{Kind, ask, keep, with};
use crate::task_info;
use marathon_envs::options::OF_LEARNING;
use marathon_envs::{
    AgentState, AnyAgent, Autoreset, NamedClip, Options, Registry, Role, Step, VecEnv, VecEnvOptions, WithModel,
};
use marathon_learn::policy::options;
use marathon_learn::{BlockPolicy, Policy};
use marathon_physics::{Isa, Model};
use marathon_viewer::Poses;
use serde::Deserialize;
use serde_json::json;
use std::ptr::null;
use std::sync::Arc;

/// An environment of one task.
pub struct Env {
    env: VecEnv,
    model: Model,
    step: Step,
    actions: Vec<f32>,
    info: Vec<f32>,
    actors: Vec<Actor>,
    poses: Poses,
}

/// A policy in the role that it has.
struct Actor {
    policy: BlockPolicy<Arc<Policy>>,
    role: Role,
    index: usize,
    obs: Vec<f32>,
    chosen: Vec<f32>,
    decides: Vec<bool>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct EnvRequest {
    agent: String,
    agents: usize,
    seed: u64,
    #[serde(with = "options")]
    options: Options,
    autoreset: String,
    max_episode_steps: Option<usize>,
    model: Option<String>,
    files: serde_json::Value,
}

impl Default for EnvRequest {
    fn default() -> Self {
        EnvRequest {
            agent: String::new(),
            agents: 1,
            seed: 0,
            options: Options::new(),
            autoreset: "same_step".into(),
            max_episode_steps: None,
            model: None,
            files: json!([]),
        }
    }
}

/// Reads a policy: Marathon's own file, or ONNX.
pub fn read_policy(bytes: &[u8], env: Option<&VecEnv>) -> Result<Policy, Failure> {
    let name = "policy".as_ref();
    // a tensor file starts with the length of its header, then a brace; an ONNX file with the field of its version
    match bytes {
        [_, _, _, _, _, _, _, _, b'{', ..] => Ok(Policy::from_bytes(name, bytes)?),
        [0x08, ..] => Ok(Policy::from_onnx(name, bytes, env.map(VecEnv::spec))?),
        _ => Err("policy: the bytes are neither those of a .safetensors file nor those of an ONNX model".into()),
    }
}

impl Kind for Env {
    const NAME: &'static str = "environment";
}

impl Env {
    fn new(mut request: Request) -> Result<Self, Failure> {
        let fields: EnvRequest = request.fields()?;
        let registry = marathon_envs::registry::global();
        let policy = match request.take_file("policy") {
            Some(bytes) => Some(read_policy(&bytes, None)?),
            None => None,
        };
        // the task as it was in training, without what only helped to learn
        let mut options =
            policy.as_ref().map(|policy| policy.meta().options.clone().without(&OF_LEARNING)).unwrap_or_default();
        fields.options.iter().for_each(|(name, value)| options.set(name, value.clone()));
        if let Some(bytes) = request.take_file("clip") {
            options.set("clip", NamedClip::parse("clip.motion", &bytes)?);
        }
        let agent = registry.agent(&fields.agent)?.with_options(&options)?;
        let agent: Arc<dyn AnyAgent> = match fields.model {
            Some(text) => Arc::new(WithModel::new(agent, marathon_envs::ModelSource::Text(text.into()))),
            None => agent,
        };
        let model = agent.model()?;
        let mut own = Registry::empty();
        own.register(agent)?;
        let name = own.ids().remove(0);
        let autoreset = match fields.autoreset.as_str() {
            "same_step" => Autoreset::SameStep,
            "disabled" => Autoreset::Disabled,
            other => return Err(format!("autoreset is '{other}', expected same_step or disabled").into()),
        };
        let (agents, seed) = (fields.agents, fields.seed);
        let max_episode_steps = match fields.max_episode_steps {
            // no end by time: more decisions than a page makes
            Some(0) => Some(u32::MAX as usize),
            other => other,
        };
        let settings =
            VecEnvOptions { agents, seed, threads: 1, isa: None, autoreset, max_episode_steps, ..Default::default() };
        let env = VecEnv::from_registry(&own, &name, &settings)?;
        let mut env = Env {
            step: env.buffers(),
            actions: vec![0.0; agents * env.spec().act],
            info: vec![0.0; agents * env.spec().info.len()],
            actors: Vec::new(),
            poses: Poses::new(&model, agents),
            model,
            env,
        };
        if let Some(policy) = policy {
            env.set_policy(policy)?;
        }
        env.reset(Some(seed))?;
        Ok(env)
    }

    fn reset(&mut self, seed: Option<u64>) -> Result<(), Failure> {
        self.env.reset(seed, &mut self.step.obs)?;
        self.step.reward.fill(0.0);
        self.step.terminated.fill(false);
        self.step.truncated.fill(false);
        self.actions.fill(0.0);
        Ok(())
    }

    fn set_policy(&mut self, policy: Policy) -> Result<(), Failure> {
        let spec = self.env.spec();
        let roles = spec.deciders();
        let fits: Vec<_> = roles.iter().map(|role| policy.check(&spec.of_role(role))).collect();
        let Some(index) = fits.iter().position(Result::is_ok) else {
            // the message for the first role
            return Err(fits.into_iter().find_map(Result::err).map_or("no role".into(), Failure::from));
        };
        let role = roles[index].clone();
        let agents = self.env.agents();
        self.actors.retain(|actor| actor.index != index);
        self.actors.push(Actor {
            obs: vec![0.0; agents * role.obs.len()],
            chosen: vec![0.0; agents * role.act.len()],
            decides: vec![true; agents],
            policy: BlockPolicy::new(Arc::new(policy), Isa::best()),
            role,
            index,
        });
        Ok(())
    }

    /// Lets the policies choose the actions.
    fn act(&mut self) -> Result<(), Failure> {
        let (n_obs, n_act) = (self.env.spec().obs, self.env.spec().act);
        for Actor { policy, role, index, obs, chosen, decides } in &mut self.actors {
            for (row, whole) in obs.chunks_exact_mut(role.obs.len()).zip(self.step.obs.chunks_exact(n_obs)) {
                row.copy_from_slice(&whole[role.obs.clone()]);
            }
            policy.act_rows(obs, None, chosen);
            self.env.decides(*index, decides)?;
            let rows = self.actions.chunks_exact_mut(n_act).zip(chosen.chunks_exact(role.act.len()));
            for ((whole, row), decides) in rows.zip(decides) {
                if *decides {
                    whole[role.act.clone()].copy_from_slice(row);
                }
            }
        }
        Ok(())
    }

    fn step(&mut self, by_policy: bool) -> Result<(), Failure> {
        if by_policy {
            self.act()?;
        }
        Ok(self.env.step(&self.actions, &mut self.step)?)
    }

    /// Numbers of agents and of their observations, which begin a snapshot.
    fn sizes(&self) -> [u32; 2] {
        [self.env.agents() as u32, self.env.spec().obs as u32]
    }

    fn pose(&mut self) -> Result<(), Failure> {
        for agent in 0..self.env.agents() {
            self.poses.set(&self.model, agent, &self.env.state(agent)?.qpos);
        }
        Ok(())
    }

    /// All states: `qpos` and `qvel` of each agent.
    fn states(&self) -> Result<Vec<f64>, Failure> {
        let mut numbers = Vec::new();
        for agent in 0..self.env.agents() {
            let state = self.env.state(agent)?;
            numbers.extend(state.qpos);
            numbers.extend(state.qvel);
        }
        Ok(numbers)
    }
}

/// Hash of observations.
fn hash_of(obs: &[f32]) -> u64 {
    hash(obs.iter().map(|x| f64::from(*x)))
}

/// Creates an environment; the answer has the facts of its task and model.
#[unsafe(no_mangle)]
pub extern "C" fn env_new() -> i32 {
    respond(|request| {
        let env = Env::new(request)?;
        let answer = Answer::json(&json!({
            "spec": task_info::spec(env.env.spec()), "model": marathon_viewer::facts(&env.model), "agents": env.env.agents(),
        }))?;
        Ok(answer.about(keep(env)))
    })
}

/// Starts new episodes, with `{"seed": ..}` from a seed.
#[unsafe(no_mangle)]
pub extern "C" fn env_reset(env: usize) -> i32 {
    #[derive(Deserialize)]
    struct Fields {
        seed: Option<u64>,
    }
    ask::<Env>(env, |env, mut request| {
        let Fields { seed } = request.fields()?;
        env.reset(seed)?;
        Answer::done()
    })
}

/// Starts a new episode of one agent.
#[unsafe(no_mangle)]
pub extern "C" fn env_reset_agent(env: usize, agent: usize) -> i32 {
    ask::<Env>(env, |env, _| {
        let mut mask = vec![false; env.env.agents()];
        *mask.get_mut(agent).ok_or_else(|| Failure::from(format!("there is no agent {agent}")))? = true;
        env.env.reset_agents(&mask, &mut env.step.obs)?;
        Answer::done()
    })
}

/// Advances all agents by a decision: the policies', or that of the array of actions.
#[unsafe(no_mangle)]
pub extern "C" fn env_step(env: usize, by_policy: bool) -> i32 {
    ask::<Env>(env, |env, _| {
        env.step(by_policy)?;
        Answer::done()
    })
}

/// Place of an array: 0 actions, 1 observations, 2 rewards, 3 terminated, 4 truncated, 5 infos, 6 poses of the geoms,
/// 7 poses of the bodies. The last three are computed by this call.
#[unsafe(no_mangle)]
pub extern "C" fn env_array(env: usize, which: u32) -> *const u8 {
    let place = with::<Env, _>(env, |env| {
        Ok(match which {
            0 => env.actions.as_ptr().cast(),
            1 => env.step.obs.as_ptr().cast(),
            2 => env.step.reward.as_ptr().cast(),
            3 => env.step.terminated.as_ptr().cast(),
            4 => env.step.truncated.as_ptr().cast(),
            5 => {
                env.env.info(&mut env.info)?;
                env.info.as_ptr().cast()
            }
            6 => {
                env.pose()?;
                env.poses.geoms().as_ptr().cast()
            }
            7 => {
                env.pose()?;
                env.poses.bodies().as_ptr().cast()
            }
            _ => null(),
        })
    });
    place.unwrap_or(null())
}

/// Lets the policy in the file `policy` act.
#[unsafe(no_mangle)]
pub extern "C" fn env_set_policy(env: usize) -> i32 {
    ask::<Env>(env, |env, mut request| {
        let bytes = request.take_file("policy").ok_or_else(|| Failure::from("the policy is missing"))?;
        let policy = read_policy(&bytes, Some(&env.env))?;
        env.set_policy(policy)?;
        Answer::done()
    })
}

/// Sets or releases the command of an agent. Numbers that are missing are at rest, others are clamped to their ranges.
#[unsafe(no_mangle)]
pub extern "C" fn env_command(env: usize, agent: usize) -> i32 {
    #[derive(Deserialize)]
    struct Fields {
        values: Option<serde_json::Map<String, serde_json::Value>>,
    }
    ask::<Env>(env, |env, mut request| {
        let Fields { values } = request.fields()?;
        let Some(values) = values else {
            env.env.set_command(agent, None)?;
            return Answer::done();
        };
        let ranges = &env.env.spec().command;
        let mut command: Vec<f64> = ranges.iter().map(|range| range.rest()).collect();
        for (name, value) in &values {
            let Some(i) = ranges.iter().position(|range| range.name == *name) else {
                let known = ranges.iter().map(|range| range.name.as_str()).collect::<Vec<_>>().join(", ");
                let expected = match known.is_empty() {
                    true => "none: the task takes no commands".into(),
                    false => format!("one of {known}"),
                };
                return Err(format!("no command '{name}', expected {expected}").into());
            };
            let number = value
                .as_f64()
                .ok_or_else(|| Failure::from(format!("command '{name}' is {value}, expected a number")))?;
            command[i] = number.clamp(ranges[i].low, ranges[i].high);
        }
        env.env.set_command(agent, Some(&command))?;
        Answer::done()
    })
}

/// Pushes a body of an agent until changed: force, N, and torque, N m.
#[unsafe(no_mangle)]
pub extern "C" fn env_push(
    env: usize,
    agent: usize,
    body: usize,
    fx: f64,
    fy: f64,
    fz: f64,
    tx: f64,
    ty: f64,
    tz: f64,
) -> i32 {
    ask::<Env>(env, |env, _| {
        env.env.push(agent, body, [fx, fy, fz], [tx, ty, tz])?;
        Answer::done()
    })
}

/// State of an agent: `qpos`, then `qvel`, in double precision.
#[unsafe(no_mangle)]
pub extern "C" fn env_state(env: usize, agent: usize) -> i32 {
    ask::<Env>(env, |env, _| {
        let AgentState { qpos, qvel } = env.env.state(agent)?;
        Ok(Answer::numbers(qpos.iter().chain(&qvel)))
    })
}

/// Sets the state of an agent: the file `state` has `qpos`, then `qvel`.
#[unsafe(no_mangle)]
pub extern "C" fn env_set_state(env: usize, agent: usize) -> i32 {
    ask::<Env>(env, |env, mut request| {
        let numbers = numbers(&request.take_file("state").unwrap_or_default());
        let (nq, nv) = (env.model.nq, env.model.nv);
        if numbers.len() != nq + nv {
            return Err(format!("the state has {} numbers, expected {nq} + {nv}", numbers.len()).into());
        }
        let (qpos, qvel) = numbers.split_at(nq);
        env.env.set_state(agent, &AgentState { qpos: qpos.to_vec(), qvel: qvel.to_vec() })?;
        let mut mask = vec![false; env.env.agents()];
        mask[agent] = true;
        env.env.observe(&mask, &mut env.step.obs)?;
        Answer::done()
    })
}

/// Heights of a height field of an agent, m, in single precision, row by row.
#[unsafe(no_mangle)]
pub extern "C" fn env_ground(env: usize, agent: usize, field: usize) -> i32 {
    ask::<Env>(env, |env, _| Ok(Answer::singles(&env.env.ground(agent, field)?)))
}

/// Sets the heights of a height field of an agent: the file `heights` has them in single precision.
#[unsafe(no_mangle)]
pub extern "C" fn env_set_ground(env: usize, agent: usize, field: usize) -> i32 {
    ask::<Env>(env, |env, mut request| {
        let bytes = request.take_file("heights").unwrap_or_default();
        let heights: Vec<f32> = bytes.as_chunks::<4>().0.iter().map(|x| f32::from_le_bytes(*x)).collect();
        env.env.set_ground(agent, field, &heights)?;
        Answer::done()
    })
}

/// The complete state of all agents: their sizes, the hash of their observations, the observations in single precision, then
/// what [`VecEnv::save`] writes.
#[unsafe(no_mangle)]
pub extern "C" fn env_save(env: usize) -> i32 {
    ask::<Env>(env, |env, _| {
        let sizes = env.sizes().into_iter().flat_map(u32::to_le_bytes);
        let obs = env.step.obs.iter().flat_map(|x| x.to_le_bytes());
        let mut bytes: Vec<u8> = sizes.chain(hash_of(&env.step.obs).to_le_bytes()).chain(obs).collect();
        bytes.extend(env.env.save());
        Ok(Answer::bytes(bytes))
    })
}

/// Restores the file `snapshot`.
#[unsafe(no_mangle)]
pub extern "C" fn env_load(env: usize) -> i32 {
    ask::<Env>(env, |env, mut request| {
        let bytes = request.take_file("snapshot").unwrap_or_default();
        let foreign = || Failure::from("these bytes are not a snapshot of an environment");
        let (sizes, rest) = bytes.split_first_chunk::<8>().ok_or_else(foreign)?;
        let (expected_hash, rest) = rest.split_first_chunk::<8>().ok_or_else(foreign)?;
        let [agents, observations] =
            [0, 4].map(|i| u32::from_le_bytes([sizes[i], sizes[i + 1], sizes[i + 2], sizes[i + 3]]));
        let expected = env.sizes();
        if [agents, observations] != expected {
            return Err(format!(
                "the snapshot has {agents} agents of {observations} observations, expected {} of {}",
                expected[0], expected[1]
            )
            .into());
        }
        let (obs, state) = rest.split_at_checked(size_of_val(&env.step.obs[..])).ok_or_else(foreign)?;
        let obs: Vec<f32> = obs.as_chunks::<4>().0.iter().map(|x| f32::from_le_bytes(*x)).collect();
        if hash_of(&obs) != u64::from_le_bytes(*expected_hash) {
            return Err("the snapshot is damaged: its observations do not have its hash".into());
        }
        env.env.load(state)?;
        env.step.obs.copy_from_slice(&obs);
        Answer::done()
    })
}

/// Hash of all states, as text.
#[unsafe(no_mangle)]
pub extern "C" fn env_hash(env: usize) -> i32 {
    ask::<Env>(env, |env, _| Ok(Answer::hash(env.states()?)))
}

/// Names of all tasks.
#[unsafe(no_mangle)]
pub extern "C" fn agents() -> i32 {
    respond(|_| Answer::json(&marathon_envs::ids()))
}

/// The description in the file `policy`.
#[unsafe(no_mangle)]
pub extern "C" fn policy_info() -> i32 {
    respond(|mut request| {
        let policy = read_policy(&request.take_file("policy").unwrap_or_default(), None)?;
        let meta = policy.meta();
        Answer::json(&json!({
            "agent": marathon_envs::shard::task_of_role(&meta.agent),
            "obs": meta.obs,
            "act": meta.act,
            "options": options::serialize(&meta.options, serde_json::value::Serializer)?,
        }))
    })
}
