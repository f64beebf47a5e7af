//! Contract: bits do not depend on threads, slots, widths or batch size.
//!
//! An agent's trajectory depends only on its own state and controls. The bits stay the same for any other agents in its
//! vector register, any number of agents, any slot, and any number of threads and lanes. The agents of this test start
//! differently, so a group always holds standing, falling and lying ones. They run long enough to reach every branch of
//! the solver. All features are on: contacts between moving bodies, elliptic cones, terrain, convex shapes, equality constraints,
//! tendons, activations, pushes, mocap bodies, and each agent's own constants and ground.

use crate::common;
use marathon_physics::model::Solver;
use marathon_physics::{Batch, BatchOptions, Isa, Model, Variation};
use std::path::PathBuf;

/// Start and controls of agent number `id`, from a hash of the number alone.
fn noise(id: usize, k: usize) -> f64 {
    let mut z = (id as u64) << 32 | k as u64;
    z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Runs agents `ids` (in this order of slots) and returns each one's state after every ten steps, as bits.
fn run(model: &Model, ids: &[usize], threads: usize, isa: Isa, decisions: usize) -> Vec<Vec<u64>> {
    let options = BatchOptions { agents: ids.len(), threads, isa, ..Default::default() };
    let mut batch = Batch::new(model, &options).expect("supported");
    for (slot, &id) in ids.iter().enumerate() {
        let mut qpos = model.qpos0.clone();
        for (k, q) in qpos.iter_mut().enumerate().skip(model.nq - model.nu.min(model.nv)) {
            *q += 0.2 * noise(id, k);
        }
        let qvel: Vec<f64> = (0..model.nv).map(|k| 0.5 * noise(id, 100 + k)).collect();
        batch.reset(slot, &qpos, &qvel);
        if id % 3 == 0 {
            batch.push(slot, model.bodies.len() - 1, [noise(id, 200), noise(id, 201), 1.0], [0.1, noise(id, 202), 0.0]);
        }
        if id % 5 < 2 {
            let mut own = Variation::none(model);
            own.mass.iter_mut().enumerate().for_each(|(k, x)| *x = 1.0 + 0.3 * noise(id, 300 + k));
            own.strength.iter_mut().enumerate().for_each(|(k, x)| *x = 1.0 + 0.2 * noise(id, 400 + k));
            own.friction = 1.0 + 0.5 * noise(id, 299);
            own.gravity[2] -= noise(id, 298);
            batch.vary(slot, &own);
        }
        for (field, h) in model.hfields.iter().enumerate().filter(|_| id % 2 == 0) {
            let elevations: Vec<f32> = (0..h.data.len()).map(|k| 0.2 + 0.2 * noise(id, 500 + k) as f32).collect();
            batch.set_ground(slot, field, &elevations);
        }
    }
    let mut out = vec![Vec::new(); ids.len()];
    for t in 0..decisions {
        let ctrl: Vec<f64> =
            ids.iter().flat_map(|&id| (0..model.nu).map(move |u| noise(id, 1000 + t * 64 + u))).collect();
        for (slot, &id) in ids.iter().enumerate().filter(|(_, id)| (**id + t) % 3 == 0) {
            for (k, body) in model.mocap_bodies().enumerate() {
                let pos = model.bodies[body].pos.map(|x| x + 0.05 * noise(id, 600 + t));
                let mut quat = model.bodies[body].quat;
                quat[1] += 0.1 * noise(id, 700 + t);
                batch.set_mocap(slot, k, &pos, &quat);
            }
        }
        assert!(batch.step(&ctrl, 10).is_empty(), "{}: the trajectory stays finite", model.name);
        for (slot, o) in out.iter_mut().enumerate() {
            o.extend(batch.qpos(slot).iter().chain(&batch.qvel(slot)).map(|x| x.to_bits()));
        }
    }
    out
}

fn models() -> Vec<Model> {
    let dir = common::workspace();
    let agents = ["hopper", "walker2d", "humanoid", "ant"].map(|n| dir.join(format!("assets/agents/{n}.xml")));
    let others = [
        "tumbler",
        "arm",
        "full/pile",
        "full/elliptic",
        "full/terrain",
        "full/equality",
        "full/tendons",
        "full/strings",
        "full/strings_implicitfast",
        "full/actuators_implicitfast",
        "full/actuators_rk4",
        "full/medium",
        "full/mocap",
        "convex/heap",
        "convex/arm_of_meshes",
    ]
    .map(|n| dir.join(format!("crates/physics/tests/models/{n}.xml")));
    let capped = ["capped/quadruped", "capped/four_legs", "full/pile", "full/elliptic"]
        .map(|n| dir.join(format!("crates/physics/tests/models/{n}.xml")));
    let load = |p: &PathBuf| Model::from_xml_file(p).unwrap_or_else(|e| panic!("{e}"));
    // a low cap selects another solver, in which every agent and island has its own line search
    let low = capped.iter().enumerate().map(|(i, p)| {
        let mut model = load(p);
        // pushed piles become non-finite if the solver stops too early
        (model.opt.iterations, model.opt.ls_iterations) = if i < 2 { (4, 8) } else { (12, 20) };
        model.opt.solver = if i == 1 { Solver::Cg } else { Solver::Newton };
        model
    });
    let without_slip = ["full/pile", "full/elliptic", "full/tendons", "capped/quadruped"].map(|n| {
        let mut model = load(&dir.join(format!("crates/physics/tests/models/{n}.xml")));
        model.opt.noslip_iterations = 3;
        if n == "capped/quadruped" {
            // with fewer, it becomes non-finite, in MuJoCo too
            (model.opt.iterations, model.opt.ls_iterations) = (30, 50);
        }
        model
    });
    agents.iter().chain(&others).map(load).chain(low).chain(without_slip).collect()
}

#[test]
fn widths_batch_sizes_and_slots() {
    for model in models() {
        let ids: Vec<usize> = (0..16).collect();
        let want = run(&model, &ids, 1, Isa::F32, 40);
        for isa in [Isa::X4, Isa::X8, Isa::X16].into_iter().filter(|i| i.supported()) {
            assert!(run(&model, &ids, 1, isa, 40) == want, "{}: {} differs from one lane", model.name, isa.name());
        }
        let best = Isa::best();
        for n in [1, 7] {
            assert!(run(&model, &ids[..n], 1, best, 40)[..] == want[..n], "{}: {n} agents", model.name);
        }
        // every agent in another slot, among other agents
        let mixed: Vec<usize> = (0..64).map(|i| if i % 4 == 1 { (i / 4 * 7 + 3) % 16 } else { 100 + i }).collect();
        let got = run(&model, &mixed, 1, best, 40);
        for (slot, &id) in mixed.iter().enumerate().filter(|(_, id)| **id < 16) {
            assert!(got[slot] == want[id], "{}: agent {id} in slot {slot}", model.name);
        }
    }
}

#[test]
fn threads_and_a_thousand_agents() {
    let model = &models()[0];
    let ids: Vec<usize> = (0..1000).collect();
    let want = run(model, &ids, 1, Isa::best(), 30);
    for threads in [2, 3] {
        assert!(run(model, &ids, threads, Isa::best(), 30) == want, "{threads} threads");
    }
    assert!(run(model, &ids[..16], 1, Isa::F32, 30)[..] == want[..16], "alone in one lane");
}
