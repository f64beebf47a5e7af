//! Contract: when an agent's state becomes non-finite, its last states can be saved and replayed to the same bits.

use crate::common;
use marathon_physics::{Batch, BatchOptions, Blowup, Model};

#[test]
fn a_dumped_agent_breaks_again_at_the_same_step() {
    let path = common::workspace().join("assets/agents/hopper.xml");
    let model = Model::from_xml_file(path).unwrap_or_else(|e| panic!("{e}"));
    let options = BatchOptions { agents: 40, threads: 2, guard: 4, ..Default::default() };
    let mut batch = Batch::new(&model, &options).expect("supported");
    let controls =
        |t: usize| -> Vec<f64> { (0..40 * model.nu).map(|i| ((i * 31 + t * 17) % 20) as f64 / 10.0 - 1.0).collect() };
    let mut last = Vec::new();
    for t in 0..11 {
        last = batch.qpos(27);
        if t == 10 {
            batch.push(27, 1, [1e38, 0.0, 1e38], [0.0; 3]);
        }
        let broken = batch.step(&controls(t), 5);
        assert_eq!(broken, if t == 10 { vec![27] } else { vec![] });
    }
    let blowups = batch.take_blowups();
    assert_eq!(blowups.len(), 1);
    assert!(batch.take_blowups().is_empty(), "taken once");
    assert_eq!((blowups[0].agent, blowups[0].states.len(), blowups[0].substeps), (27, 4, 5));

    // through a file, alone, in one lane
    let text = serde_json::to_string(&blowups[0]).expect("it can be written");
    let read: Blowup = serde_json::from_str(&text).expect("and read");
    assert!(read == blowups[0]);
    let replay = read.replay(&model, &options).expect("supported");
    assert_eq!(replay.len(), 4 * 5);
    assert_eq!(replay[14].qpos, last, "the step before the last call ends where it did");
    assert!(replay[..15].iter().all(|s| s.finite), "whole before it is pushed");
    assert!(!replay[19].finite, "and broken after");
}

#[test]
fn without_a_guard_nothing_is_kept() {
    let path = common::workspace().join("assets/agents/hopper.xml");
    let model = Model::from_xml_file(path).unwrap_or_else(|e| panic!("{e}"));
    let mut batch = Batch::new(&model, &BatchOptions::default()).expect("supported");
    batch.push(0, 1, [f64::NAN, 0.0, 0.0], [0.0; 3]);
    assert_eq!(batch.step(&vec![0.0; model.nu], 1), [0]);
    assert!(batch.take_blowups().is_empty());
    assert_eq!(batch.quarantined(), 1);
}
