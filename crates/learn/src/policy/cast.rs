//! The policies of all roles of a task, acting together.

use super::{BlockPolicy, Policy};
use crate::error::Error;
use crate::lanes::BLOCK;
use marathon_envs::{BlockStep, Role, Spec};
use marathon_physics::lanes::Isa;

/// One policy per role of a task, with work space to act for many blocks.
pub struct Cast<'a> {
    parts: Vec<Part<'a>>,
    /// Length of the full observation and of the full action.
    obs: usize,
    act: usize,
}

/// A role with its policy.
struct Part<'a> {
    role: Role,
    policy: BlockPolicy<&'a Policy>,
    /// Its part of the observations and actions, `[block][..][16]`, unless it has them all.
    obs: Vec<f32>,
    action: Vec<f32>,
    /// Agents whose next action this role chooses: one mask per block.
    decides: Vec<u16>,
}

impl<'a> Cast<'a> {
    /// Creates the cast for `blocks` blocks at the start of their episodes, with policies in the order of the roles.
    ///
    /// # Errors
    /// If the number of policies differs from that of the roles, or a policy is for another task or role.
    pub fn new(spec: &Spec, policies: &[&'a Policy], isa: Isa, blocks: usize) -> Result<Self, Error> {
        let roles = spec.deciders();
        if roles.len() != policies.len() {
            return Err(Error::Mismatch {
                what: format!("the cast of {}", spec.id),
                found: format!("{} roles", policies.len()),
                expected: format!("{}: one policy for each", roles.len()),
            });
        }
        let part = |(role, policy): (Role, &&'a Policy)| {
            policy.check(&spec.of_role(&role))?;
            let room = |n: usize| vec![0.0; blocks * n * BLOCK];
            Ok(Part {
                obs: room(role.obs.len()),
                action: room(role.act.len()),
                policy: BlockPolicy::new(*policy, isa),
                decides: vec![!0; blocks],
                role,
            })
        };
        let parts = roles.into_iter().zip(policies).map(part).collect::<Result<_, Error>>()?;
        Ok(Self { parts, obs: spec.obs, act: spec.act })
    }

    /// The roles.
    pub fn roles(&self) -> impl Iterator<Item = &Role> {
        self.parts.iter().map(|part| &part.role)
    }

    /// The best actions, `[block][act][16]`, for raw observations, `[block][obs][16]`. Actions of roles that do not
    /// decide stay unchanged.
    pub fn act(&mut self, obs: &[f32], action: &mut [f32]) {
        if let [part] = &mut self.parts[..]
            && part.decides.iter().all(|decides| *decides == !0)
        {
            part.policy.act(obs, action);
            return;
        }
        let (obs_row, act_row) = (self.obs * BLOCK, self.act * BLOCK);
        for Part { role, policy, obs: seen, action: chosen, decides } in &mut self.parts {
            let own = role.obs.start * BLOCK..role.obs.end * BLOCK;
            for (seen, whole) in seen.chunks_exact_mut(own.len()).zip(obs.chunks_exact(obs_row)) {
                seen.copy_from_slice(&whole[own.clone()]);
            }
            policy.act(seen, chosen);
            let own = role.act.start * BLOCK..role.act.end * BLOCK;
            let rows = action.chunks_exact_mut(act_row).zip(chosen.chunks_exact(own.len()));
            for ((whole, chosen), decides) in rows.zip(decides) {
                for (i, (to, from)) in whole[own.clone()].iter_mut().zip(chosen).enumerate() {
                    if *decides >> (i % BLOCK) & 1 == 1 {
                        *to = *from;
                    }
                }
            }
        }
    }

    /// Reads from the result of a block's decision which roles decide next. New episodes follow ended ones.
    pub fn follow(&mut self, block: usize, out: &BlockStep) {
        let ended = out.terminated | out.truncated | out.diverged;
        for (i, part) in self.parts.iter_mut().enumerate() {
            part.decides[block] = out.deciding(i) | ended;
        }
    }
}
