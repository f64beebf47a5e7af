//! Contract: snapshot, restore, continue equals never having stopped.

mod common;

use marathon_physics::{Batch, BatchOptions, Model, SimOptions};

#[test]
fn a_restored_batch_has_the_same_future() {
    let path = common::workspace().join("assets/agents/humanoid.xml");
    let model = Model::from_xml_file(&path).unwrap_or_else(|e| panic!("{e}"));
    let options = BatchOptions {
        agents: 20,
        sim: SimOptions { ground_contacts_only: true, ..Default::default() },
        ..Default::default()
    };
    let mut batch = Batch::new(&model, &options).expect("supported");
    let controls = |t: usize| -> Vec<f64> {
        (0..20 * model.nu).map(|i| ((i * 7919 + t * 104729) % 200) as f64 / 100.0 - 1.0).collect()
    };
    for t in 0..30 {
        batch.step(&controls(t), 5);
    }
    let middle = batch.snapshot();
    for t in 30..60 {
        batch.step(&controls(t), 5);
    }
    let end = batch.snapshot();
    assert!(end != middle, "something happened");

    batch.restore(&middle);
    for t in 30..60 {
        batch.step(&controls(t), 5);
    }
    assert!(batch.snapshot() == end, "the same batch again");

    let mut fresh = Batch::new(&model, &options).expect("supported");
    fresh.restore(&middle);
    for t in 30..60 {
        fresh.step(&controls(t), 5);
    }
    assert!(fresh.snapshot() == end, "another batch");
}
