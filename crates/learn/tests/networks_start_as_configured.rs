//! Every network of a run starts with the configured initialization, including SAC's second value network.

use crate::common::{PuckTask, small_of};
use marathon_learn::{BLOCK, Init, TrainLoop};
use marathon_physics::lanes::Isa;
use safetensors::SafeTensors;

/// All parameters of a SAC run before its start.
fn parameters(initialization: Init) -> Vec<f64> {
    let config = small_of("sac").with(|config| {
        config.network.initialization = initialization;
        (config.network.hidden, config.network.critic_hidden) = (vec![8], Some(vec![400]));
    });
    let trainer = TrainLoop::new(&PuckTask::new(), Isa::best(), &config).unwrap();
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    trainer.checkpoint().save(folder.path()).unwrap();
    let files = std::fs::read_dir(folder.path()).unwrap().map(|file| file.unwrap().path());
    let state = files.into_iter().find(|path| path.extension().is_some_and(|e| e == "safetensors")).unwrap();
    let bytes = std::fs::read(state).unwrap();
    let file = SafeTensors::deserialize(&bytes).unwrap();
    let numbers = file.tensor("params").unwrap().data().chunks_exact(4);
    numbers.map(|x| f32::from_le_bytes(*x.first_chunk().unwrap()) as f64).collect()
}

#[test]
fn both_value_networks_of_sac_do() {
    // 6 observations and 2 actions; a policy of 8 units with means and deviations, values of 400 units
    let actor = (6 * 8 + 8 + 8 * 4 + 4 + 2_usize).next_multiple_of(BLOCK);
    let (hidden, critic) = (8 * 400, 8 * 400 + 400 + 400 + 1);
    let starts = [actor, (actor + critic).next_multiple_of(BLOCK)];
    // deviations of the weights of the hidden layer and of the last one
    for (initialization, wanted) in [
        (Init::Orthogonal, [(2.0 / 400f64).sqrt(), 1.0 / 400f64.sqrt()]),
        (Init::MlAgents, [1.0 / 8f64.sqrt(), (2.0 / 401f64).sqrt()]),
    ] {
        let all = parameters(initialization);
        for start in starts {
            let last = start + hidden + 400;
            for (weights, wanted) in [&all[start..start + hidden], &all[last..last + 400]].into_iter().zip(wanted) {
                let deviation = (weights.iter().map(|w| w * w).sum::<f64>() / weights.len() as f64).sqrt();
                assert!(
                    (deviation / wanted - 1.0).abs() < 0.15,
                    "{initialization:?} at {start}: {deviation}, {wanted}"
                );
            }
        }
    }
}
