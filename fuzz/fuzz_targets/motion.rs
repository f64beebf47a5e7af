//! Any bytes are a motion or an error that names the file: no reader panics, and what is read can be used.

#![no_main]

use libfuzzer_sys::fuzz_target;
use marathon_motion::{Animation, Clip, Mapping, import};
use marathon_physics::Model;
use std::path::Path;
use std::sync::OnceLock;

/// Longer motions are read but not edited.
const MOST_NUMBERS: usize = 20_000;

fuzz_target!(|data: &[u8]| {
    let Some((kind, bytes)) = data.split_first() else { return };
    let kind = chosen().unwrap_or(*kind);
    let read = |name: &str| import::any(name.as_ref(), bytes).map(|animation| animation.clip().clone());
    let clip = match kind % 5 {
        // with the checksum, nearly every change would be refused early
        0 => Clip::parse_without_checksum("fuzzed.motion".as_ref(), bytes),
        1 => read("fuzzed.bvh"),
        2 => read("fuzzed.json"),
        3 => read("fuzzed.glb"),
        _ => {
            let (animation, model) = figure();
            if let Err(error) = Mapping::parse("fuzzed.json".as_ref(), bytes, animation.skeleton(), model) {
                assert!(error.to_string().contains("fuzzed.json"), "{error}");
            }
            return;
        }
    };
    match clip {
        Ok(clip) => used(&clip),
        Err(error) => assert!(error.to_string().contains("fuzzed."), "an error names the file: {error}"),
    }
});

/// The reader that `MOTION_READER` names by its number, for who wants to fuzz one alone.
fn chosen() -> Option<u8> {
    static CHOSEN: OnceLock<Option<u8>> = OnceLock::new();
    *CHOSEN.get_or_init(|| std::env::var("MOTION_READER").ok()?.parse().ok())
}

/// Samples, edits and writes a clip.
fn used(clip: &Clip) {
    let path = Path::new("fuzzed");
    if clip.frames() * clip.layout().nq() > MOST_NUMBERS {
        return;
    }
    let again = Clip::parse(path, &clip.to_bytes()).expect("what was written can be read");
    assert_eq!(&again, clip);
    let (mut qpos, mut qvel) = (vec![0.0; clip.layout().nq()], vec![0.0; clip.layout().nv()]);
    for time in [-1e300, -1.0, 0.0, 0.3 * clip.duration(), clip.duration(), 1e9, f64::NAN] {
        clip.qpos(time, &mut qpos);
        clip.qvel(time, &mut qvel);
        let phase = clip.phase(time);
        assert!(time.is_nan() || (0.0..=1.0).contains(&phase), "{phase}");
    }
    let _ = clip.trim(path, 0.1, 0.2);
    let _ = clip.resample(path, clip.dt() * 0.7);
}

/// A skeleton and a model for mappings.
fn figure() -> &'static (Animation, Model) {
    static FIGURE: OnceLock<(Animation, Model)> = OnceLock::new();
    FIGURE.get_or_init(|| {
        let model = "<mujoco model='m'><worldbody><body name='a'><freejoint/><geom size='.1'/>\
            <body name='b'><joint/><geom size='.1'/></body></body></worldbody></mujoco>";
        let model = Model::from_xml_str_with(model, "m.xml", &|_| Err(String::new())).expect("a model");
        let bvh = "HIERARCHY ROOT Hips { OFFSET 0 0 0 CHANNELS 0 JOINT LeftLeg { OFFSET 0 1 0 CHANNELS 1 Xrotation } } \
            MOTION Frames: 2 Frame Time: 0.1 0 1";
        (import::bvh("m.bvh".as_ref(), bvh.as_bytes()).expect("a skeleton"), model)
    })
}
