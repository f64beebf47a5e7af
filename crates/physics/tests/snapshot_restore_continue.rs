//! Contract: restoring a snapshot and continuing equals an uninterrupted simulation.

use crate::common;
use marathon_physics::{Batch, BatchOptions, Model, Variation};

#[test]
fn a_restored_batch_has_the_same_future() {
    for file in ["assets/agents/humanoid.xml", "crates/physics/tests/models/full/pile.xml"] {
        check(file);
    }
    for name in ["terrain", "equality", "tendons", "actuators", "medium", "elliptic", "mocap"] {
        check(&format!("crates/physics/tests/models/full/{name}.xml"));
    }
}

fn check(file: &str) {
    let model = Model::from_xml_file(common::workspace().join(file)).unwrap_or_else(|e| panic!("{e}"));
    let options = BatchOptions { agents: 20, ..Default::default() };
    let mut batch = Batch::new(&model, &options).expect("supported");
    // some agents have their own constants and ground, which are part of their state
    let mut own = Variation::none(&model);
    own.mass.iter_mut().enumerate().for_each(|(body, factor)| *factor = 1.2 + 0.1 * (body % 3) as f64);
    own.friction = 0.7;
    batch.vary(3, &own);
    batch.push(4, 1, [1.0, 0.5, 0.2], [0.0, 0.1, 0.0]);
    for (k, body) in model.mocap_bodies().enumerate() {
        batch.set_mocap(6, k, &model.bodies[body].pos.map(|x| x + 0.1), &[2.0, 0.1, 0.0, 0.0]);
    }
    for (field, h) in model.hfields.iter().enumerate() {
        let elevations: Vec<f32> = (0..h.data.len()).map(|k| 0.01 * k as f32).collect();
        batch.set_ground(5, field, &elevations);
    }
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
    assert!(end != middle, "{file}: something happened");

    batch.restore(&middle);
    for t in 30..60 {
        batch.step(&controls(t), 5);
    }
    assert!(batch.snapshot() == end, "{file}: the same batch again");

    let mut fresh = Batch::new(&model, &options).expect("supported");
    fresh.restore(&middle);
    for t in 30..60 {
        fresh.step(&controls(t), 5);
    }
    assert!(fresh.snapshot() == end, "{file}: another batch");
}
