//! An agent's code behind one dynamic call per decision of a group. Everything around it is compiled once per
//! instruction set instead of once per agent and instruction set.

use marathon_physics::lanes::{Kernel, Real};
use marathon_physics::{Group, Model, Readings, Work};

use super::group::LaneGroup;
use super::perception::{Named, Occasion, Perceived};
use super::task::TaskData;
use crate::agent::{Agent, Ctrl, Obs, Senses, Site, Start, Terms};
use crate::episode_rng::EpisodeRng;

/// An [`Agent`] for one lane type.
pub(crate) trait AgentKernel<T: Real>: Send + Sync {
    /// See [`Agent::fits`].
    fn fits(&self, model: &Model) -> Result<(), String>;
    /// Draws the start of an episode, see [`Agent::reset`].
    fn draw(&self, start: &mut Start);
    /// Draws a command, see [`Agent::command`].
    fn command(&self, random: &mut EpisodeRng, step: usize, out: &mut [f64]) -> usize;
    /// Converts the group's actions into controls, see [`Agent::ctrl`].
    fn control(&self, task: &TaskData<T>, group: &mut LaneGroup<T>);
    /// Lanes whose ground changes now, one bit each, see [`Agent::builds`].
    fn builds(&self, group: &LaneGroup<T>) -> u32;
    /// Changes an agent's ground, see [`Agent::build`].
    fn build(&self, site: &mut Site);
    /// Runs all other functions of the agent: begin or remember, observe, reward, info and termination. One kernel
    /// contains them all, so an agent's code is compiled once per instruction set.
    fn perceive(
        &self,
        task: &TaskData<T>,
        group: &mut LaneGroup<T>,
        work: &Work<T>,
        occasion: Occasion<'_>,
    ) -> Perceived;
}

impl<T: Real, A: Agent> AgentKernel<T> for A {
    fn fits(&self, model: &Model) -> Result<(), String> {
        Agent::fits(self, model)
    }

    fn draw(&self, start: &mut Start) {
        self.reset(start);
    }

    fn command(&self, random: &mut EpisodeRng, step: usize, out: &mut [f64]) -> usize {
        Agent::command(self, random, step, out)
    }

    fn control(&self, task: &TaskData<T>, group: &mut LaneGroup<T>) {
        T::enter(Drive { agent: self, task, group });
    }

    fn builds(&self, group: &LaneGroup<T>) -> u32 {
        T::enter(Ask { agent: self, memory: &group.memory })
    }

    fn build(&self, site: &mut Site) {
        Agent::build(self, site);
    }

    fn perceive(
        &self,
        task: &TaskData<T>,
        group: &mut LaneGroup<T>,
        work: &Work<T>,
        occasion: Occasion<'_>,
    ) -> Perceived {
        T::enter(Perceive { agent: self, task, group, work, occasion })
    }
}

/// The kernel of [`AgentKernel::builds`].
struct Ask<'a, T: Real, A> {
    agent: &'a A,
    memory: &'a [T],
}

impl<T: Real, A: Agent> Kernel<T> for Ask<'_, T, A> {
    type Output = u32;
    #[inline(always)]
    fn run(self) -> u32 {
        T::bits(self.agent.builds(self.memory))
    }
}

/// The kernel of [`AgentKernel::control`].
struct Drive<'a, T: Real, A> {
    agent: &'a A,
    task: &'a TaskData<T>,
    group: &'a mut LaneGroup<T>,
}

impl<T: Real, A: Agent> Kernel<T> for Drive<'_, T, A> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let LaneGroup { physics, memory, action, commands, .. } = self.group;
        let Group { qpos, qvel, ctrl, .. } = physics;
        let reference = self.task.reference.as_ref();
        let command = &commands.present;
        self.agent.ctrl(&mut Ctrl { action, ctrl, memory, command, qpos, qvel, dt: self.task.spec.dt, reference });
    }
}

/// The kernel of [`AgentKernel::perceive`].
struct Perceive<'a, T: Real, A> {
    agent: &'a A,
    task: &'a TaskData<T>,
    group: &'a mut LaneGroup<T>,
    work: &'a Work<T>,
    occasion: Occasion<'a>,
}

impl<T: Real, A: Agent> Kernel<T> for Perceive<'_, T, A> {
    type Output = Perceived;
    #[inline(always)]
    fn run(self) -> Perceived {
        let Perceive { agent, task, group, work, occasion } = self;
        let (fresh, last, term_names, group_names) = match occasion {
            Occasion::Decision { last } => (None, last, None, None),
            Occasion::Start(lanes) => (Some(lanes), 0, None, None),
            Occasion::Rehearsal(Named { terms, groups }) => (Some(!0), 0, Some(terms), Some(groups)),
        };
        let LaneGroup { physics, memory, start, action, commands, obs, terms, info, feet, decides, leaves, .. } = group;
        let mut s = Senses {
            readings: Readings::new(&task.sim, physics, work),
            bindings: &task.bindings,
            reference: task.reference.as_ref(),
            action,
            command: &commands.present,
            memory: &[],
            fresh: fresh.is_some(),
            last: T::from_bits(last & ((1 << T::LANES) - 1)),
            dt: task.spec.dt,
        };
        match fresh {
            None => agent.remember(&s, memory),
            Some(lanes) => {
                // other lanes are in the middle of their episodes
                let on = T::from_bits(lanes & ((1 << T::LANES) - 1));
                agent.begin(&s, start);
                for (m, begun) in memory.iter_mut().zip(start) {
                    *m = T::select(on, *begun, *m);
                    *begun = T::zero();
                }
            }
        }
        s.memory = memory;
        let mut obs = Obs::new(obs, group_names);
        if fresh.is_none() {
            s.command = &commands.next;
        }
        agent.observe(&s, &mut obs);
        s.command = &commands.present;
        let own = task.facts.reward_terms.len();
        agent.step_reward(&s, &mut Terms::new(&mut terms[..own], term_names));
        let mut info = Obs::new(info, None);
        agent.info(&s, &mut info);
        for (lanes, geom) in feet.iter_mut().zip(&task.bindings.feet) {
            let touched = T::bits(s.readings.touched(*geom));
            *lanes = fresh.map_or(touched, |begun| *lanes & !begun);
        }
        for (role, lanes) in decides.iter_mut().enumerate() {
            *lanes = T::bits(agent.decides(&s, role));
        }
        for (role, lanes) in leaves.iter_mut().enumerate() {
            *lanes = agent.leaves(&s, role).map(T::bits);
        }
        Perceived {
            observed: obs.len(),
            reported: info.len(),
            failed: T::bits(agent.terminated(&s)),
            over: T::bits(agent.truncated(&s)),
        }
    }
}
