//! Playing a policy: agents side by side, controlled by its best actions.

use crate::error::RunError;
use crate::task_config::TaskConfig;
use marathon_envs::{AgentState, Role, Spec, Step, VecEnv, VecEnvOptions};
use marathon_learn::{BlockPolicy, Error, Policy};
use marathon_physics::lanes::Isa;

/// Agents of a policy's task, and the results of their last decision. A decision has two steps: [`Play::decide`]
/// chooses actions, [`Play::step`] carries them out.
pub struct Play<'a> {
    env: VecEnv,
    /// One per role.
    pilots: Vec<Pilot<'a>>,
    actions: Vec<f32>,
    step: Step,
}

/// A role with its policy.
struct Pilot<'a> {
    role: Role,
    policy: BlockPolicy<&'a Policy>,
    /// Its observations and actions, `[agents][..]`, and the agents for which it decides.
    obs: Vec<f32>,
    actions: Vec<f32>,
    decides: Vec<bool>,
}

impl<'a> Play<'a> {
    /// Creates agents at the start of their first episodes, in the task that the policy notes.
    ///
    /// # Errors
    /// If the policy's task does not exist, or the options are invalid.
    pub fn new(policy: &'a Policy, options: &VecEnvOptions) -> Result<Self, RunError> {
        Self::of(&TaskConfig::of_policy(policy.meta()), &[policy], options)
    }

    /// Creates agents in a task with other options. `policies` has one policy per role of the task, in their order.
    ///
    /// # Errors
    /// Like [`Play::new`], and if the number of policies differs from that of the roles.
    pub fn of(task_config: &TaskConfig, policies: &[&'a Policy], options: &VecEnvOptions) -> Result<Self, RunError> {
        let mut env = task_config.vec_env(options)?;
        let mut step = env.buffers();
        env.reset(None, &mut step.obs)?;
        let (roles, n) = (env.spec().deciders(), options.agents);
        if roles.len() != policies.len() {
            let (found, expected) =
                (format!("{} policies", policies.len()), format!("{}, one for each role", roles.len()));
            return Err(Error::Mismatch { what: env.spec().id.clone(), found, expected }.into());
        }
        let pilot = |(role, policy): (Role, &&'a Policy)| Pilot {
            policy: BlockPolicy::new(*policy, Isa::best()),
            obs: vec![0.0; n * role.obs.len()],
            actions: vec![0.0; n * role.act.len()],
            decides: vec![true; n],
            role,
        };
        let pilots = roles.into_iter().zip(policies).map(pilot).collect();
        Ok(Play { pilots, actions: vec![0.0; n * env.spec().act], step, env })
    }

    /// Chooses the best actions, `[agents][act]`, for the current observations. A role that does not decide keeps its
    /// last action.
    pub fn decide(&mut self) -> &[f32] {
        let Self { env, pilots, actions, step } = self;
        if let [pilot] = &mut pilots[..] {
            pilot.policy.act_rows(&step.obs, None, actions);
            return actions;
        }
        let spec = env.spec();
        for (number, Pilot { role, policy, obs, actions: chosen, decides }) in pilots.iter_mut().enumerate() {
            env.decides(number, decides).expect("a role of the task");
            for (own, whole) in obs.chunks_exact_mut(role.obs.len()).zip(step.obs.chunks_exact(spec.obs)) {
                own.copy_from_slice(&whole[role.obs.clone()]);
            }
            policy.act_rows(obs, None, chosen);
            let rows = actions.chunks_exact_mut(spec.act).zip(chosen.chunks_exact(role.act.len()));
            for ((whole, chosen), _) in rows.zip(decides).filter(|(_, decides)| **decides) {
                whole[role.act.clone()].copy_from_slice(chosen);
            }
        }
        actions
    }

    /// Carries out the chosen actions.
    ///
    /// # Errors
    /// If the environments refuse them.
    pub fn step(&mut self) -> Result<&Step, RunError> {
        self.env.step(&self.actions, &mut self.step)?;
        Ok(&self.step)
    }

    /// Observations, rewards and ends of the last decision. Before the first decision, only observations.
    pub fn last(&self) -> &Step {
        &self.step
    }

    /// Generalized positions of an agent.
    ///
    /// # Errors
    /// If there is no such agent.
    pub fn qpos(&self, agent: usize) -> Result<Vec<f64>, RunError> {
        Ok(self.env.state(agent)?.qpos)
    }

    /// Configuration and velocity of an agent.
    ///
    /// # Errors
    /// If there is no such agent.
    pub fn state(&self, agent: usize) -> Result<AgentState, RunError> {
        Ok(self.env.state(agent)?)
    }

    /// Controls of an agent during its last decision; see [`VecEnv::ctrl`].
    ///
    /// # Errors
    /// If there is no such agent.
    pub fn ctrl(&self, agent: usize) -> Result<Vec<f64>, RunError> {
        Ok(self.env.ctrl(agent)?)
    }

    /// Description of the task.
    pub fn spec(&self) -> &Spec {
        self.env.spec()
    }

    /// Ground of an agent: elevations of each of the model's height fields; see [`VecEnv::ground`].
    ///
    /// # Errors
    /// If there is no such agent.
    pub fn grounds(&mut self, agent: usize, fields: usize) -> Result<Vec<Vec<f32>>, RunError> {
        (0..fields).map(|field| Ok(self.env.ground(agent, field)?)).collect()
    }

    /// The last observed command of an agent.
    ///
    /// # Errors
    /// If there is no such agent.
    pub fn command(&mut self, agent: usize) -> Result<Vec<f64>, RunError> {
        Ok(self.env.context(agent)?.command())
    }

    /// Sets an agent's command; see [`VecEnv::set_command`].
    ///
    /// # Errors
    /// If there is no such agent, or it does not take this command.
    pub fn set_command(&mut self, agent: usize, command: Option<&[f64]>) -> Result<(), RunError> {
        Ok(self.env.set_command(agent, command)?)
    }

    /// Pushes a body of an agent with a constant force, N; see [`VecEnv::push`].
    ///
    /// # Errors
    /// If there is no such agent or body.
    pub fn push(&mut self, agent: usize, body: usize, force: [f64; 3]) -> Result<(), RunError> {
        Ok(self.env.push(agent, body, force, [0.0; 3])?)
    }

    /// Feet of an agent that touched the ground during its last decision, a bit each; see [`VecEnv::feet`].
    ///
    /// # Errors
    /// If there is no such agent.
    pub fn feet(&self, agent: usize) -> Result<u32, RunError> {
        Ok(self.env.feet(agent)?)
    }

    /// Generalized positions of the clip that an agent follows, at the current time. `None` if the task follows no
    /// clip.
    ///
    /// # Errors
    /// If there is no such agent.
    pub fn reference(&self, agent: usize) -> Result<Option<Vec<f64>>, RunError> {
        Ok(self.env.reference(agent)?)
    }
}
