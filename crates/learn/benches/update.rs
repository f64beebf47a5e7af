//! Speed of the trainer without an environment. `cargo bench -p marathon-learn`.
//!
//! 1. Networks: microseconds per sample and GFLOP/s of one forward and backward pass, for each instruction set.
//! 2. Training: processor microseconds per agent-step around an environment that does nothing, with everything else
//!    included (acting, advantages, four epochs of updates, optimizer, waiting).

use marathon_envs::{BLOCK, BlockStep, EnvError, Options, Shard, ShardFactory, Spec};
use marathon_learn::nets::mlp::{CHUNK, Mlp};
use marathon_learn::{Activation, Control, IterationStats, Snapshot, TrainConfig, train};
use marathon_physics::lanes::Isa;
use std::time::Instant;

fn main() {
    // `cargo test --benches` passes --test: nothing to measure
    if std::env::args().any(|a| a == "--test") {
        return;
    }
    let only = std::env::args().nth(1).filter(|a| !a.starts_with('-'));
    if only.as_deref() != Some("train") {
        networks();
    }
    if only.as_deref() != Some("networks") {
        training();
    }
}

fn networks() {
    println!(
        "{:28} {:>9} {:>10} {:>9} {:>11} {:>12}",
        "network", "isa", "us/sample", "GFLOP/s", "forward us", "backward us"
    );
    for sizes in [&[31, 32, 32, 4][..], &[31, 64, 64, 4], &[88, 128, 64, 21], &[53, 256, 128, 8], &[54, 512, 512, 8]] {
        for activation in [Activation::Tanh, Activation::Swish] {
            for isa in [Isa::X16, Isa::X8, Isa::X4] {
                if isa.supported() && (isa != Isa::X4 || sizes[1] == 64) {
                    network(sizes, activation, isa);
                }
            }
        }
    }
}

fn network(sizes: &[usize], activation: Activation, isa: Isa) {
    let net = Mlp::new(sizes, activation);
    let params: Vec<f32> = (0..net.len()).map(|i| ((i * 7919 % 1000) as f32 / 1000.0 - 0.5) * 0.1).collect();
    let (mut input, mut tape, mut gradient) = (net.input(), net.tape(), vec![0.0; net.len()]);
    for b in 0..CHUNK {
        for (i, x) in input.block_mut(b).iter_mut().enumerate() {
            *x = ((i * 31 + b) % 97) as f32 / 48.0 - 1.0;
        }
        tape.output_delta().block_mut(b).fill(0.1);
    }
    let chunks = ((4e8 / net.flops() / if isa == Isa::X4 { 2560.0 } else { 256.0 }) as usize).max(4);
    let mut best = (f64::INFINITY, 0.0, 0.0);
    for _ in 0..9 {
        let (mut forward, mut backward) = (0.0, 0.0);
        for _ in 0..chunks {
            let t0 = Instant::now();
            net.forward(isa, &params, &input, &mut tape, CHUNK);
            let t1 = Instant::now();
            net.backward(isa, &params, &input, &mut tape, &mut gradient, CHUNK);
            forward += (t1 - t0).as_secs_f64();
            backward += t1.elapsed().as_secs_f64();
        }
        let us = 1e6 / (chunks * CHUNK * BLOCK) as f64;
        if us * (forward + backward) < best.0 {
            best = (us * (forward + backward), us * forward, us * backward);
        }
    }
    let name = format!("{sizes:?} {}", activation.name());
    let rate = net.flops() * 1e-3 / best.0;
    println!("{name:28} {:>9} {:10.4} {rate:9.1} {:11.4} {:12.4}", isa.name(), best.0, best.1, best.2);
}

fn training() {
    println!(
        "\n{:28} {:>9} {:>8} {:>12} {:>14} {:>8}",
        "obs, act, hidden", "isa", "threads", "us/step", "steps/cpu-s", "update"
    );
    for (obs, act, hidden) in
        [(31, 4, vec![32, 32]), (31, 4, vec![64, 64]), (88, 21, vec![64, 64]), (88, 21, vec![256, 128])]
    {
        for (isa, threads) in [(Isa::X16, 1), (Isa::X16, 2), (Isa::X8, 1)] {
            if isa.supported() {
                run(obs, act, &hidden, isa, threads);
            }
        }
    }
}

fn run(obs: usize, act: usize, hidden: &[usize], isa: Isa, threads: usize) {
    let config = TrainConfig::default().with(|c| {
        c.run.total_steps = 600_000;
        c.network.hidden = hidden.to_vec();
        c.network.critic_hidden = Some(hidden.to_vec());
        c.run.threads = threads;
    });
    let mut seen: Vec<IterationStats> = Vec::new();
    let mut observer = |stats: &IterationStats, _: &Snapshot<'_>| {
        seen.push(stats.clone());
        Control::Continue
    };
    if let Err(e) = train(&Idle::new(obs, act), isa, &config, None, &mut observer) {
        println!("{e}");
        return;
    }
    // the best of the iterations with an update: others disturb the machine, never the other way round
    let steps = config.run.rollout_steps() as f64;
    let cost = |p: &[IterationStats]| (p[1].cpu_seconds - p[0].cpu_seconds) / steps;
    let mut costs: Vec<f64> = seen.windows(2).map(cost).collect();
    costs.sort_by(f64::total_cmp);
    let (median, share) = (costs[costs.len() / 2], seen.last().map_or(0.0, |s| s.update_share));
    let name = format!("{obs}, {act}, {hidden:?}");
    let (us, rate) = (median * 1e6, 1.0 / median);
    println!("{name:28} {:>9} {threads:8} {us:12.3} {rate:14.0} {:7.0}%", isa.name(), 100.0 * share);
}

/// An environment that costs nothing.
struct Idle(Spec);

impl Idle {
    fn new(obs: usize, act: usize) -> Self {
        let reward_terms = vec!["noise".into()];
        Self(Spec {
            id: "Idle".into(),
            obs,
            act,
            action_names: vec![String::new(); act],
            action_low: vec![-1.0; act],
            action_high: vec![1.0; act],
            dt: 0.01,
            frame_skip: 1,
            max_episode_steps: 1000,
            reward_terms,
            info: Vec::new(),
            options: Options::new(),
            nq: 2,
            nv: 2,
            ..Spec::default()
        })
    }
}

impl ShardFactory for Idle {
    fn spec(&self) -> &Spec {
        &self.0
    }
    fn shard(&self, _: usize, blocks: usize, _: u64) -> Box<dyn Shard> {
        Box::new(IdleShard(self.0.clone(), vec![0; blocks]))
    }
}

struct IdleShard(Spec, Vec<u64>);

impl Shard for IdleShard {
    fn spec(&self) -> &Spec {
        &self.0
    }
    fn blocks(&self) -> usize {
        self.1.len()
    }
    fn reset(&mut self, _: usize, _: u16, obs: &mut [f32]) {
        obs.fill(0.5);
    }
    fn step(&mut self, block: usize, action: &[f32], obs: &mut [f32], out: &mut BlockStep) {
        let random = &mut self.1[block];
        *random = random.wrapping_mul(6364136223846793005).wrapping_add(block as u64 * 2 + 1);
        let x = (*random >> 40) as f32 / (1u64 << 24) as f32;
        obs.copy_within(1.., 0);
        obs[0] = x;
        out.reward.copy_from_slice(&action[..BLOCK]);
        out.terms.clear();
        out.terms.extend_from_slice(&out.reward);
        // one agent in a thousand
        out.terminated = (x < 0.016) as u16;
    }
    fn save(&self, _: usize, _: &mut Vec<u8>) {}
    fn load<'a>(&mut self, _: usize, bytes: &'a [u8]) -> Result<&'a [u8], EnvError> {
        Ok(bytes)
    }
}
