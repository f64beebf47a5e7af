//! The README's first command gives the shipped policy: `train hopper`, with the default seed, gives the weights of
//! `assets/policies/hopper.safetensors`, bit for bit. After a change of bits, `marathon-studies reproduce
//! --update` trains the shipped policies again.

use crate::common::{read_json, succeed, tensors};
use std::path::Path;

#[test]
fn training_gives_the_shipped_weights() {
    let temp = tempfile::tempdir().unwrap();
    succeed(temp.path(), &["train", "hopper"]);
    let run = temp.path().join("runs/hopper-1");
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/policies/hopper.safetensors");
    let [trained, shipped] = [run.join("policy.safetensors"), shipped].map(|file| tensors(&file));
    for (t, s) in trained.iter().zip(&shipped) {
        assert_eq!((&t.0, &t.1), (&s.0, &s.1));
        assert!(
            t.2 == s.2,
            "{} has other bits: run `marathon-studies reproduce hopper --update` if they are meant to change",
            t.0
        );
    }
    assert_eq!(trained.len(), shipped.len());
    // the numbers in the README
    let eval = &read_json(&run.join("summary.json"))["eval"];
    let readme = include_str!("../../../README.md");
    let line =
        format!("return    {:.1} ± {:.1}", eval["return_mean"].as_f64().unwrap(), eval["return_std"].as_f64().unwrap());
    assert!(readme.contains(&line), "README.md lacks `{line}`");
}
