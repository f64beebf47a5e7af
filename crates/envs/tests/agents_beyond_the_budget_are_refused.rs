//! A number of agents that exceeds the memory budget is rejected before any agent is created. The estimated memory per
//! agent is an upper bound.

use marathon_envs::{EnvError, VecEnv, VecEnvOptions, registry};
use marathon_physics::lanes::Isa;

fn refused(agents: usize, threads: usize) -> EnvError {
    match VecEnv::new("Hopper-v0", &VecEnvOptions { agents, threads, ..Default::default() }) {
        Ok(_) => panic!("{agents} agents on {threads} threads were made"),
        Err(error) => error,
    }
}

#[test]
fn agents_and_threads_that_cannot_be_had_are_refused() {
    for agents in [1_000_000_000, usize::MAX] {
        let error = refused(agents, 1);
        assert!(matches!(error, EnvError::Memory { agents: found, .. } if found == agents), "{error}");
        let text = error.to_string();
        assert!(text.starts_with(&format!("agents is {agents}, which asks for ")), "{text}");
        assert!(text.contains("the limit 'agents_memory' is 16 GB; set MARATHON_LIMITS=agents_memory="), "{text}");
    }
    assert_eq!(refused(1, 1_000_000).to_string(), "threads is 1000000, expected at most 1024");
}

/// Memory of this process, bytes.
#[cfg(target_os = "linux")]
fn memory() -> usize {
    let text = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = text.lines().find(|line| line.starts_with("VmRSS:")).unwrap();
    1024 * line.split_whitespace().nth(1).unwrap().parse::<usize>().unwrap()
}

/// Only one test measures the process's memory, because parallel tests would change it.
#[cfg(target_os = "linux")]
#[test]
fn an_agent_takes_no_more_than_it_is_said_to() {
    for (id, agents) in [
        ("Hopper-v0", 16_000),
        ("Humanoid-v5", 8_000),
        ("MarathonManController-v0", 8_000),
        ("TerrainWalker2d-v0", 1_600),
        ("Swimmer-v5", 16_000),
    ] {
        let said = registry::factory(id, Isa::best()).unwrap().agent_bytes();
        // shared data is allocated before the measurement
        let play = |agents: usize| {
            let mut env = VecEnv::new(id, &VecEnvOptions { agents, threads: 1, ..Default::default() }).unwrap();
            let mut step = env.buffers();
            env.reset(Some(1), &mut step.obs).unwrap();
            (env, step)
        };
        drop(play(16));
        let before = memory();
        let kept = play(agents);
        let each = memory().saturating_sub(before) / agents;
        println!("{id}: {each} bytes, {said} said");
        assert!(each <= said, "{id}: an agent takes {each} bytes, the estimate is {said}");
        // the estimate is not so high that it refuses agents that fit
        assert!(said < 12 * each.max(500), "{id}: an agent takes {each} bytes, the estimate is {said}");
        // reused memory would hide an allocation
        std::mem::forget(kept);
    }
}
