//! A state that becomes non-finite is handled at its own agent: counted, reset, reported, without any effect on others.

use crate::common;
use marathon_physics::{Batch, BatchOptions, Isa, Model, SimOptions};
use std::path::Path;

/// Every shipped model, with the contacts that its environment has.
#[test]
fn a_broken_agent_is_reset_and_its_neighbors_are_untouched() {
    for path in common::shipped() {
        break_one(&path);
    }
}

fn break_one(path: &Path) {
    let model = Model::from_xml_file(path).unwrap_or_else(|e| panic!("{e}"));
    let options = BatchOptions { agents: 16, ..Default::default() };
    let (mut sick, mut healthy) = (Batch::new(&model, &options).unwrap(), Batch::new(&model, &options).unwrap());
    let ctrl = vec![0.3; 16 * model.nu];
    for (name, value) in [("infinite", f64::INFINITY), ("not a number", f64::NAN), ("huge", 1e30)] {
        let name = format!("{}: {name}", path.display());
        let mut qvel = vec![0.0; model.nv];
        qvel[model.nv - 1] = value;
        let before = sick.quarantined();
        sick.reset(5, &model.qpos0, &qvel);
        healthy.reset(5, &model.qpos0, &vec![0.0; model.nv]);
        let mut reported = Vec::new();
        for _ in 0..20 {
            reported.extend(sick.step(&ctrl, 4));
            healthy.step(&ctrl, 4);
            for agent in (0..16).filter(|a| *a != 5) {
                assert_eq!(sick.qpos(agent), healthy.qpos(agent), "{name}: agent {agent}");
                assert_eq!(sick.qvel(agent), healthy.qvel(agent), "{name}: agent {agent}");
            }
            assert!(
                sick.qpos(5).iter().chain(&sick.qvel(5)).all(|x| x.is_finite()),
                "{name}: only finite states are seen"
            );
        }
        assert_eq!(reported, [5], "{name}: reported once");
        assert_eq!(sick.quarantined(), before + 1, "{name}: counted");
    }
}

#[test]
fn an_agent_too_far_away_is_broken_in_every_lane_width() {
    let path = common::workspace().join("assets/agents/hopper.xml");
    let model = Model::from_xml_file(&path).unwrap_or_else(|e| panic!("{e}"));
    for isa in Isa::ALL.into_iter().filter(|i| i.supported()) {
        let sim = SimOptions { ground_contacts_only: true, ..Default::default() };
        let mut batch = Batch::new(&model, &BatchOptions { agents: 16, isa, sim, ..Default::default() }).unwrap();
        let mut qpos = model.qpos0.clone();
        // finite, but its square is not: the result would depend on whether another agent touches the ground
        qpos[1] = 3e38;
        batch.reset(3, &qpos, &vec![0.0; model.nv]);
        assert_eq!(batch.step(&vec![0.0; 16 * model.nu], 1), [3], "{}", isa.name());
    }
}
