//! A saved policy reloads to the same actions, one row or many blocks at a time. Damaged files are refused.

use crate::common::{PuckTask, silent, small_config};
use marathon_envs::ShardFactory;
use marathon_learn::{Activation, BLOCK, BlockPolicy, EvalOptions, Policy, evaluate, train};
use marathon_physics::lanes::Isa;

fn trained(activation: Activation) -> Policy {
    let config = small_config().with(|c| {
        c.network.activation = activation;
        c.network.hidden = vec![37, 19];
        c.run.total_steps = 5000;
    });
    train(&PuckTask::new(), Isa::best(), &config, None, &mut silent).unwrap().policy
}

fn observations(blocks: usize) -> Vec<f32> {
    (0..blocks * 6 * BLOCK).map(|i| ((i * 7919) % 2003) as f32 * 0.1 - 100.0).collect()
}

#[test]
fn reloaded_policy_acts_alike_on_every_width_and_row_by_row() {
    let dir = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    for activation in Activation::ALL {
        let path = dir.path().join(format!("{}.safetensors", activation.name()));
        let policy = trained(activation);
        policy.save(&path).unwrap();
        let loaded = Policy::load_for(&path, PuckTask::new().spec()).unwrap();
        assert_eq!(loaded, policy);

        // more blocks than a chunk, and not a multiple of a tile
        let blocks = 21;
        let obs = observations(blocks);
        let mut want = vec![0.0; blocks * 2 * BLOCK];
        BlockPolicy::new(&policy, Isa::best()).act(&obs, &mut want);
        for isa in [Isa::F32, Isa::X4, Isa::X8, Isa::X16].into_iter().filter(|isa| isa.supported()) {
            let mut got = vec![0.0; want.len()];
            BlockPolicy::new(&loaded, isa).act(&obs, &mut got);
            assert_eq!(want, got, "{}", isa.name());
        }
        for agent in 0..blocks * BLOCK {
            let (b, lane) = (agent / BLOCK, agent % BLOCK);
            let row: Vec<f32> = (0..6).map(|k| obs[(b * 6 + k) * BLOCK + lane]).collect();
            let action: Vec<f32> = (0..2).map(|k| want[(b * 2 + k) * BLOCK + lane]).collect();
            assert_eq!(loaded.act(&row), action, "agent {agent}");
            assert!(action.iter().all(|a| a.abs() <= 1.0));
        }
    }
}

#[test]
fn file_says_what_it_is() {
    let dir = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let path = dir.path().join("puck.safetensors");
    let mut policy = trained(Activation::Tanh);
    let options = EvalOptions { episodes: 20, ..Default::default() };
    policy.set_evaluation(evaluate(&PuckTask::new(), Isa::best(), &policy, &options).unwrap());
    policy.save(&path).unwrap();
    let loaded = Policy::load(&path).unwrap();
    let meta = loaded.meta();
    assert_eq!((meta.agent.as_str(), meta.obs, meta.act, &meta.hidden[..]), ("Puck-v0", 6, 2, &[37, 19][..]));
    assert_eq!((meta.control_dt, meta.physics_dt, meta.frame_skip), (0.05, 0.025, 2));
    assert_eq!(meta.evaluation.as_ref().unwrap().episodes, 20);
    assert_eq!(meta.training.as_ref().unwrap().steps, 5760);
    // the same policy gives the same file, byte for byte
    let again = dir.path().join("again.safetensors");
    loaded.save(&again).unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), std::fs::read(&again).unwrap());
}

#[test]
fn policy_of_another_agent_is_refused() {
    let dir = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let path = dir.path().join("puck.safetensors");
    trained(Activation::Tanh).save(&path).unwrap();
    let other = PuckTask::new().renamed("Hopper-v0");
    let error = Policy::load_for(&path, other.spec()).err().unwrap().to_string();
    assert!(error.ends_with("puck.safetensors: agent: found Puck-v0, expected Hopper-v0"), "{error}");
    let loaded = Policy::load(&path).unwrap();
    let error = evaluate(&other, Isa::best(), &loaded, &Default::default()).err().unwrap().to_string();
    assert_eq!(error, "agent is for Puck-v0, expected Hopper-v0");
}

#[test]
fn damaged_policies_never_panic() {
    let dir = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let path = dir.path().join("puck.safetensors");
    trained(Activation::Swish).save(&path).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let header = 8 + u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    let load = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        Policy::load(&path)
    };
    for end in (0..bytes.len()).step_by(97) {
        assert!(load(&bytes[..end]).is_err(), "cut at {end}");
    }
    // a change of any header byte gives an error, or a policy with consistent numbers
    for i in 0..header {
        let mut damaged = bytes.clone();
        damaged[i] ^= 1 << (i % 7);
        if let Ok(policy) = load(&damaged) {
            policy.act(&vec![0.5; policy.meta().obs]);
        }
    }
    // numbers that are not finite
    let mut damaged = bytes.clone();
    let last = damaged.len() - 4;
    damaged[last..].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(load(&damaged).err().unwrap().to_string().contains("the file has changed since it was written"));
    // a file of another kind
    assert!(load(b"<mujoco/>").err().unwrap().to_string().contains("expected a safetensors file"));
    std::fs::remove_file(&path).unwrap();
    assert!(Policy::load(&path).err().unwrap().to_string().contains("puck.safetensors: read"));
}

#[test]
fn the_mean_of_policies_lies_between_them() {
    let policies = [100.0, 0.0, -40.0].map(|shift| shifted(&trained(Activation::Tanh), shift));
    let mean = Policy::mean(&policies).unwrap();
    assert_eq!(mean.params()[0], ((policies.iter().map(|p| f64::from(p.params()[0])).sum::<f64>()) / 3.0) as f32);
    assert!((mean.params()[0] - policies[1].params()[0] - 20.0).abs() < 1e-4);
    assert_eq!(mean.normalizer(), policies[1].normalizer());
    assert_eq!(mean.meta(), policies[2].meta());
    // it acts
    assert!(mean.act(&[0.1; 6]).iter().all(|a| a.abs() <= 1.0));

    assert_eq!(Policy::mean(&[]).unwrap_err().to_string(), "mean is for no policies, expected one or more");
    let other = trained(Activation::Elu);
    let error = Policy::mean(&[other, policies[0].clone()]).unwrap_err().to_string();
    assert_eq!(error, "activation is for elu, expected tanh");
}

/// A policy whose weights are larger by `shift`.
fn shifted(policy: &Policy, shift: f32) -> Policy {
    let params = policy.params().iter().map(|x| x + shift).collect();
    let (mean, std) = (policy.normalizer().mean().to_vec(), policy.normalizer().std().to_vec());
    Policy::from_parts(policy.meta().clone(), params, (mean, std), policy.log_std().to_vec()).unwrap()
}
