//! A policy that is exported to ONNX and imported again acts the same. Invalid bytes are refused without a panic.
//! (`python/tests/test_onnx.py` compares with ONNX Runtime and reads files by PyTorch and Stable-Baselines3.)

use marathon_envs::{Spec, factory};
use marathon_learn::{Activation, Policy, PolicyMeta};
use marathon_physics::lanes::Isa;
use proptest::prelude::*;
use std::path::Path;
use std::sync::LazyLock;

static SPEC: LazyLock<Spec> = LazyLock::new(|| factory("hopper", Isa::F32).expect("it is there").spec().clone());

/// Numbers in [-1, 1).
fn noise(seed: u64) -> impl FnMut() -> f32 {
    let mut state = seed ^ 0x9e37_79b9_7f4a_7c15;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 23) as f32 - 1.0
    }
}

fn policy(hidden: &[usize], activation: Activation, change: impl Fn(&mut PolicyMeta)) -> Policy {
    let mut meta = PolicyMeta::of(&SPEC, hidden.to_vec(), activation);
    meta.observation_clip = 3.0;
    change(&mut meta);
    let sizes = [&[meta.obs], hidden, &[meta.act]].concat();
    let mut x = noise(sizes.len() as u64);
    let params = (0..sizes.windows(2).map(|p| (p[0] + 1) * p[1]).sum()).map(|_| 0.7 * x()).collect();
    let mean = (0..meta.obs).map(|_| x()).collect();
    let std = (0..meta.obs).map(|_| 1.5 + x()).collect();
    let log_std = (0..meta.act).map(|_| x() - 1.0).collect();
    Policy::from_parts(meta, params, (mean, std), log_std).expect("the lengths fit")
}

fn read(bytes: &[u8]) -> Result<Policy, String> {
    Policy::from_onnx(Path::new("policy.onnx"), bytes, Some(&SPEC)).map_err(|e| e.to_string())
}

#[test]
fn a_policy_survives_the_round_trip() {
    let narrow = |meta: &mut PolicyMeta| meta.action_range = vec![[-0.4, 0.4], [0.0, 2.0], [-1.0, 1.0], [-3.0, -1.0]];
    let even = |meta: &mut PolicyMeta| meta.action_range = vec![[-0.4, 0.4]; 4];
    let far = |meta: &mut PolicyMeta| meta.action_clip = 3.0;
    let squashed = |meta: &mut PolicyMeta| meta.squash = true;
    let squashed_narrow = |meta: &mut PolicyMeta| (narrow(meta), squashed(meta)).0;
    let changes: [&dyn Fn(&mut PolicyMeta); 6] = [&|_| {}, &narrow, &even, &far, &squashed, &squashed_narrow];
    for activation in Activation::ALL {
        for hidden in [&[][..], &[5], &[16, 7]] {
            for change in changes {
                let policy = policy(hidden, activation, change);
                let again = read(&policy.to_onnx()).unwrap();
                let mut x = noise(1);
                for _ in 0..50 {
                    let obs: Vec<f32> = (0..SPEC.obs).map(|_| 4.0 * x()).collect();
                    for (a, b) in policy.act(&obs).iter().zip(again.act(&obs)) {
                        assert!((a - b).abs() < 1e-5, "{activation:?} {hidden:?}: {a} became {b}");
                    }
                }
                assert_eq!(again.log_std(), policy.log_std());
                // without hidden layers the activation is unknown
                let activation = if hidden.is_empty() { again.meta().activation } else { activation };
                assert_eq!(again.meta(), &PolicyMeta { activation, ..policy.meta().clone() });
            }
        }
    }
}

#[test]
fn training_and_evaluation_travel_along() {
    let trained = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/policies/hopper.safetensors");
    let policy = Policy::load(&trained).unwrap();
    let bytes = policy.to_onnx();
    assert_eq!(Policy::meta_of_onnx(&bytes).as_ref(), Some(policy.meta()));
    assert_eq!(read(&bytes).unwrap().meta(), policy.meta());
    assert_eq!(Policy::meta_of_onnx(b"nothing"), None);
}

#[test]
fn a_policy_of_an_old_file_acts_between_minus_one_and_one() {
    let old = policy(&[8], Activation::Tanh, |meta| meta.action_range.clear());
    let again = read(&old.to_onnx()).unwrap();
    assert!(old.meta().action_range.is_empty());
    assert_eq!(again.meta().action_range, vec![[-1.0, 1.0]; old.meta().act]);
}

#[test]
fn the_file_knows_its_task_also_where_the_program_does_not() {
    let theirs = policy(&[8], Activation::Elu, |meta| (meta.agent, meta.control_dt) = ("Inchworm-v0".into(), 0.02));
    let bytes = theirs.to_onnx();
    let again = Policy::from_onnx(Path::new("policy.onnx"), &bytes, None).unwrap();
    assert_eq!(again.meta(), theirs.meta());
    let nameless = replace(&bytes, b"marathon", b"somebody");
    let error = Policy::from_onnx(Path::new("policy.onnx"), &nameless, None).unwrap_err().to_string();
    assert!(error.starts_with("policy.onnx: agent: found none, expected one"), "{error}");
}

#[test]
fn what_does_not_fit_is_refused_by_name() {
    let bytes = policy(&[8], Activation::Tanh, |_| {}).to_onnx();
    let ant = factory("ant", Isa::F32).unwrap().spec().clone();
    let error = Policy::from_onnx(Path::new("policy.onnx"), &bytes, Some(&ant)).unwrap_err().to_string();
    assert_eq!(
        error,
        "policy.onnx: inputs: found 'obs_0' of 31 numbers, expected one observation of 53 numbers, as Ant-v0 has"
    );
    let renamed = replace(&bytes, b"Gemm", b"Conv");
    let error = read(&renamed).unwrap_err();
    assert!(
        error.contains("output 'deterministic_continuous_actions': found operation Conv on the network"),
        "{error}"
    );
    for bad in [&b""[..], b"onnx", &[0xff; 40]] {
        assert!(read(bad).is_err());
    }
}

fn replace(bytes: &[u8], from: &[u8], to: &[u8]) -> Vec<u8> {
    let mut out = bytes.to_vec();
    for i in 0..out.len() - from.len() {
        if out[i..].starts_with(from) {
            out[i..i + from.len()].copy_from_slice(to);
        }
    }
    out
}

static FILE: LazyLock<Vec<u8>> =
    LazyLock::new(|| policy(&[3], Activation::Swish, |meta| meta.action_range = vec![[-0.5, 1.0]; 4]).to_onnx());

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..Default::default() })]

    #[test]
    fn changed_bytes_never_panic(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8)) {
        let mut bytes = FILE.clone();
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        let by_name = Policy::from_onnx(Path::new("policy.onnx"), &bytes, None);
        for policy in read(&bytes).into_iter().chain(by_name) {
            policy.act(&vec![0.1; policy.meta().obs]);
        }
    }

    #[test]
    fn missing_and_repeated_parts_never_panic(a in any::<prop::sample::Index>(), b in any::<prop::sample::Index>(), twice: bool) {
        let (a, b) = (a.index(FILE.len()), b.index(FILE.len()));
        let (a, b) = (a.min(b), a.max(b));
        let mut bytes = FILE[..if twice { b } else { a }].to_vec();
        bytes.extend(&FILE[if twice { a } else { b }..]);
        let _ = (read(&bytes), Policy::from_onnx(Path::new("policy.onnx"), &bytes, None));
    }

    #[test]
    fn any_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = read(&bytes);
    }
}
