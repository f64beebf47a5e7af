//! Evaluation of a policy with its best actions.

use crate::error::Error;
use crate::lanes::BLOCK;
use crate::policy::evaluation::Evaluation;
use crate::policy::{Cast, Policy};
use marathon_envs::{BlockStep, Metric, Role, ShardFactory, Spec};
use marathon_physics::lanes::Isa;

/// Most agents that play side by side.
const MAX_SLOTS: usize = 1024;

/// How to evaluate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EvalOptions {
    /// Number of episodes.
    pub episodes: usize,
    /// Seed of the environments.
    pub seed: u64,
    /// Threads; 0 means one per processor. The result does not depend on it.
    pub threads: usize,
}

impl Default for EvalOptions {
    fn default() -> Self {
        Self { episodes: 64, seed: 1_000_003, threads: 0 }
    }
}

#[derive(Clone, Default)]
struct Episode {
    /// Sums of the task's own metrics.
    metrics: Vec<f64>,
    total: f64,
    length: f64,
    distance: f64,
    fell: bool,
    diverged: bool,
}

/// Plays episodes with the policy's best actions.
///
/// Agents play side by side, and each plays a number of episodes that is fixed before the start: counting whatever ends
/// first would favor short episodes.
///
/// # Errors
/// If the policy is for another task or the processor lacks the instruction set.
pub fn evaluate(
    factory: &dyn ShardFactory,
    isa: Isa,
    policy: &Policy,
    options: &EvalOptions,
) -> Result<Evaluation, Error> {
    Ok(evaluate_roles(factory, isa, &[policy], options)?.swap_remove(0))
}

/// The same with a policy for each role of the task; returns how each did.
///
/// # Errors
/// The same, and if there is not one policy for each role.
pub fn evaluate_roles(
    factory: &dyn ShardFactory,
    isa: Isa,
    policies: &[&Policy],
    options: &EvalOptions,
) -> Result<Vec<Evaluation>, Error> {
    Cast::new(factory.spec(), policies, isa, 0)?;
    if isa == Isa::F64 || !isa.supported() {
        return Err(Error::Isa(isa.name(), Isa::best().name()));
    }
    if options.episodes == 0 {
        return Err(Error::config("episodes", 0, "at least 1"));
    }
    // agents that are stepped all at once are all there, needed or not
    let at_once = factory.lockstep();
    let slots = options.episodes.min(at_once.unwrap_or(MAX_SLOTS));
    let blocks = at_once.unwrap_or(slots).div_ceil(BLOCK);
    // slot i plays episodes i, i + slots, ...
    let quota = |slot: usize| if slot < slots { (options.episodes - slot).div_ceil(slots) } else { 0 };
    // a thread whose agents are done must not leave the others waiting
    let threads = if at_once.is_some() { 1 } else { marathon_physics::threads(options.threads).clamp(1, blocks) };
    let part = |id: usize| {
        let (first, end) = (blocks * id / threads, blocks * (id + 1) / threads);
        let quotas: Vec<usize> = (first * BLOCK..end * BLOCK).map(quota).collect();
        play(factory, isa, policies, options.seed, first, &quotas)
    };
    let episodes: Vec<Vec<Episode>> = std::thread::scope(|scope| {
        let others: Vec<_> = (1..threads).map(|id| scope.spawn(move || part(id))).collect();
        let mut all = part(0);
        for other in others {
            let theirs = other.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            all.iter_mut().zip(theirs).for_each(|(all, theirs)| all.extend(theirs));
        }
        all
    });
    Ok(episodes.iter().map(|episodes| summarize(episodes, factory.spec())).collect())
}

/// Plays the episodes of consecutive blocks; returns them for each role, in the order of the agents.
fn play(
    factory: &dyn ShardFactory,
    isa: Isa,
    policies: &[&Policy],
    seed: u64,
    first_block: usize,
    quotas: &[usize],
) -> Vec<Vec<Episode>> {
    let (blocks, spec) = (quotas.len() / BLOCK, factory.spec());
    let (obs_row, act_row) = (spec.obs * BLOCK, spec.act * BLOCK);
    let mut shard = factory.shard(first_block, blocks, seed);
    let mut cast = Cast::new(spec, policies, isa, blocks).expect("the policies have been checked");
    let roles: Vec<Role> = cast.roles().cloned().collect();
    let (mut obs, mut action) = (vec![0.0; blocks * obs_row], vec![0.0; blocks * act_row]);
    for (b, obs) in obs.chunks_exact_mut(obs_row).enumerate() {
        shard.reset(b, !0, obs);
    }
    let metrics: Vec<Metric> = spec.own_metrics().cloned().collect();
    let fresh = Episode { metrics: vec![0.0; metrics.len()], ..Episode::default() };
    let mut current = vec![vec![fresh.clone(); quotas.len()]; roles.len()];
    let room = || quotas.iter().map(|q| Vec::with_capacity(*q)).collect();
    let mut done: Vec<Vec<Vec<Episode>>> = roles.iter().map(|_| room()).collect();
    let mut out = BlockStep::default();
    let busy = |done: &[Vec<Episode>], b: usize| {
        let agents = b * BLOCK..(b + 1) * BLOCK;
        agents.clone().any(|i| done[i].len() < quotas[i])
    };
    let mut playing: Vec<usize> = (0..blocks).filter(|b| busy(&done[0], *b)).collect();
    while !playing.is_empty() {
        cast.act(&obs, &mut action);
        shard.announce(&action);
        for b in &playing {
            let obs = &mut obs[b * obs_row..(b + 1) * obs_row];
            shard.step(*b, &action[b * act_row..(b + 1) * act_row], obs, &mut out);
            cast.follow(*b, &out);
            let ended = out.terminated | out.truncated | out.diverged;
            for (r, role) in roles.iter().enumerate() {
                let reward = out.reward_of(r, role);
                for lane in 0..BLOCK {
                    let agent = b * BLOCK + lane;
                    let (episode, done) = (&mut current[r][agent], &mut done[r][agent]);
                    episode.total += reward[lane] as f64;
                    episode.length += 1.0;
                    episode.distance += out.forward[lane] as f64;
                    for (sum, metric) in episode.metrics.iter_mut().zip(&metrics) {
                        *sum += out.metric(metric)[lane] as f64;
                    }
                    if ended >> lane & 1 == 1 {
                        episode.diverged = out.diverged >> lane & 1 == 1;
                        episode.fell = episode.diverged || out.terminated >> lane & 1 == 1;
                        let whole = std::mem::replace(episode, fresh.clone());
                        if done.len() < quotas[agent] {
                            done.push(whole);
                        }
                    }
                }
            }
            if ended != 0 {
                shard.reset(*b, ended, obs);
            }
        }
        playing.retain(|b| busy(&done[0], *b));
    }
    done.into_iter().map(|done| done.into_iter().flatten().collect()).collect()
}

fn summarize(episodes: &[Episode], spec: &Spec) -> Evaluation {
    let (n, dt) = (episodes.len() as f64, spec.dt);
    let decisions: f64 = episodes.iter().map(|e| e.length).sum();
    let mean_of = |i: usize| episodes.iter().map(|e| e.metrics[i]).sum::<f64>() / decisions;
    let mean = |f: &dyn Fn(&Episode) -> f64| episodes.iter().map(f).sum::<f64>() / n;
    let return_mean = mean(&|e| e.total);
    Evaluation {
        episodes: episodes.len() as u64,
        return_mean,
        return_std: mean(&|e| (e.total - return_mean) * (e.total - return_mean)).sqrt(),
        return_min: episodes.iter().map(|e| e.total).fold(f64::INFINITY, f64::min),
        return_max: episodes.iter().map(|e| e.total).fold(f64::NEG_INFINITY, f64::max),
        length_mean: mean(&|e| e.length),
        distance_mean: mean(&|e| e.distance),
        speed_mean: mean(&|e| e.distance / (e.length * dt)),
        falls: episodes.iter().filter(|e| e.fell).count() as u64,
        diverged: episodes.iter().filter(|e| e.diverged).count() as u64,
        metrics: spec.own_metrics().enumerate().map(|(i, metric)| (metric.name.clone(), mean_of(i))).collect(),
    }
}
