//! A policy file contains its own checksum. A file with a changed byte or without a checksum is refused with an error
//! that names the checksum. The policies that ship have checksums.

use crate::common::{PuckTask, silent, small_config};
use marathon_learn::{Policy, train};
use marathon_physics::lanes::Isa;
use std::path::Path;

fn small() -> Policy {
    let config = small_config().with(|c| {
        c.network.hidden = vec![4];
        c.run.total_steps = 1;
    });
    train(&PuckTask::new(), Isa::best(), &config, None, &mut silent).unwrap().policy
}

fn refusal(bytes: &[u8]) -> String {
    match Policy::from_bytes(Path::new("puck.safetensors"), bytes) {
        Ok(_) => "none".into(),
        Err(error) => error.to_string(),
    }
}

#[test]
fn a_changed_byte_anywhere_is_refused_by_name() {
    let policy = small();
    let bytes = policy.to_bytes();
    assert_eq!(Policy::from_bytes(Path::new("puck.safetensors"), &bytes).unwrap(), policy);
    let header = 8 + u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    for place in 0..bytes.len() {
        for bit in [place % 8, (place + 5) % 8] {
            let mut changed = bytes.clone();
            changed[place] ^= 1 << bit;
            let text = refusal(&changed);
            assert!(text.starts_with("puck.safetensors: "), "bit {bit} of byte {place}: {text}");
            if place >= header {
                let expected = "; the file has changed since it was written";
                assert!(text.contains("checksum: found") && text.ends_with(expected), "{text}");
            }
        }
    }
    // adding or removing bytes is an error too
    for bytes in [&bytes[..bytes.len() - 1], &[&bytes[..], &[0]].concat()] {
        assert!(refusal(bytes).starts_with("puck.safetensors: "), "{}", refusal(bytes));
    }
}

/// The policy without its checksum, as another program may write it.
fn unsealed(policy: &Policy) -> Vec<u8> {
    let bytes = policy.to_bytes();
    let header = 8 + u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    let text = std::str::from_utf8(&bytes[8..header]).unwrap();
    let start = text.rfind(r#",\"checksum\":\""#).unwrap();
    let end = start + r#",\"checksum\":\"0123456789abcdef\""#.len();
    let text = format!("{}{}", &text[..start], text[end..].trim_end());
    [&(text.len() as u64).to_le_bytes(), text.as_bytes(), &bytes[header..]].concat()
}

#[test]
fn a_file_without_a_checksum_is_refused_with_the_command_that_writes_one() {
    let policy = small();
    let bytes = unsealed(&policy);
    let advice =
        "checksum: found none, expected one; `marathon import puck.safetensors --out NEW.safetensors` writes it";
    assert_eq!(refusal(&bytes), format!("puck.safetensors: {advice}"));
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let path = folder.path().join("puck.safetensors");
    std::fs::write(&path, &bytes).unwrap();
    assert_eq!(Policy::load_unsealed(&path).unwrap(), policy);
    // an existing checksum is checked
    let mut changed = policy.to_bytes();
    *changed.last_mut().unwrap() ^= 1;
    std::fs::write(&path, &changed).unwrap();
    let error = Policy::load_unsealed(&path).unwrap_err().to_string();
    assert!(error.contains("the file has changed since it was written"), "{error}");
}

#[test]
fn a_policy_of_another_version_is_refused() {
    let policy = small();
    let (mean, std) = (policy.normalizer().mean().to_vec(), policy.normalizer().std().to_vec());
    for version in [0, 2] {
        let mut meta = policy.meta().clone();
        meta.version = version;
        let stats = (mean.clone(), std.clone());
        let other = Policy::from_parts(meta, policy.params().to_vec(), stats, policy.log_std().to_vec()).unwrap();
        let expected = "expected 1, which this program supports";
        assert_eq!(refusal(&other.to_bytes()), format!("puck.safetensors: version: found {version}, {expected}"));
    }
}

#[test]
fn shipped_policies_have_theirs() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/policies");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|end| end == "safetensors") {
            let policy = Policy::load(&path).unwrap_or_else(|error| panic!("{error}"));
            // after rewriting, the policy is the same
            assert!(Policy::from_bytes(&path, &policy.to_bytes()).unwrap() == policy, "{}", path.display());
            count += 1;
        }
    }
    assert!(count >= 15, "{count} policies");
}

/// Invalid numbers are refused even if the checksum is correct.
#[test]
fn numbers_that_are_not_finite_are_refused() {
    let policy = small();
    let mut params = policy.params().to_vec();
    params[3] = f32::NAN;
    let (mean, std) = (policy.normalizer().mean().to_vec(), policy.normalizer().std().to_vec());
    let bad = Policy::from_parts(policy.meta().clone(), params, (mean, std), policy.log_std().to_vec()).unwrap();
    let text = refusal(&bad.to_bytes());
    assert!(text.contains("tensor 'layer.0.weight', number 3: found NaN, expected a finite number"), "{text}");
}
