//! Every command of docs/tutorials/own-motion.md runs as printed, on recordings with another skeleton, units and axes,
//! and the results match the motion of the recordings. Only trainings are shorter, and pictures smaller. Commands that
//! open a window or need other programs are left out.

use crate::common::{json, read_json, succeed};
use crate::foreign;
use marathon_motion::Clip;
use std::path::Path;

/// Joints of the page's unusual skeleton, by Mixamo's names for them.
const UNUSUAL: [(&str, &str); 12] = [
    ("Hips", "Becken"),
    ("Spine", "Lende"),
    ("Spine2", "Brust"),
    ("Neck", "Hals"),
    ("Head", "Kopf"),
    ("UpLeg", "Oberschenkel"),
    ("Leg", "Unterschenkel"),
    ("Foot", "Fuss"),
    ("Shoulder", "Schluesselbein"),
    ("Arm", "Oberarm"),
    ("ForeArm", "Unterarm"),
    ("Hand", "Faust"),
];

fn unusual(name: &str) -> String {
    let (side, stem) = match (name.strip_prefix("Left"), name.strip_prefix("Right")) {
        (Some(stem), _) => ("li_", stem),
        (_, Some(stem)) => ("re_", stem),
        _ => ("", name),
    };
    let own = UNUSUAL.iter().find(|(known, _)| *known == stem).map_or(stem, |(_, own)| own);
    format!("{side}{own}")
}

/// Blocks of code in a language, in their order.
fn blocks<'a>(page: &'a str, language: &str) -> Vec<&'a str> {
    let opening = format!("```{language}\n");
    page.split(opening.as_str()).skip(1).map(|rest| rest.split("```").next().unwrap()).collect()
}

#[test]
fn the_commands_run_as_printed() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/tutorials/own-motion.md");
    let page = std::fs::read_to_string(page).unwrap();
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    std::fs::write(folder.join("walk.bvh"), foreign::bvh(str::to_string)).unwrap();
    std::fs::write(folder.join("walk.glb"), foreign::glb()).unwrap();
    std::fs::write(folder.join("unusual.bvh"), foreign::bvh(unusual)).unwrap();
    std::fs::write(folder.join("mapping.json"), blocks(&page, "json")[0]).unwrap();

    let mut run = Vec::new();
    for line in blocks(&page, "sh").iter().flat_map(|block| block.lines()) {
        let command = line.split('#').next().unwrap_or_default();
        let mut words: Vec<&str> = command.split_whitespace().collect();
        assert!(words.first().is_none_or(|word| *word == "marathon"), "{line}");
        if words.is_empty() || words[1] == "play" || command.contains(".mp4") {
            continue;
        }
        words.remove(0);
        run.push(words.join(" "));
        words.extend(match words[..2] {
            ["train", _] => &["--agents", "16", "--steps", "512"][..],
            ["eval", _] => &["--episodes", "16"],
            ["motion", "render"] => &["--seconds", "0.2", "--width", "60"],
            _ => &[],
        });
        succeed(folder, &words);
    }
    for part in [
        "motion import walk.bvh",
        "motion import walk.glb",
        "motion check",
        "--mapping",
        "train MarathonMan",
        "--policy",
    ] {
        assert!(run.iter().any(|command| command.contains(part)), "no command of the page has {part}: {run:?}");
    }
    assert_eq!(read_json(&folder.join("runs/walk/run.json"))["options"]["clip"], "walk.motion");
    let files = ["walk.bvh", "walk.glb", "unusual.bvh"];
    let found: Vec<bool> = files.iter().map(|file| run.iter().any(|command| command.contains(file))).collect();
    assert_eq!(found, [true; 3], "all recordings are used");
}

/// Both files come from Marathon Man's own walk, through a skeleton with other proportions.
#[test]
fn a_foreign_skeleton_gives_the_motion_back() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    std::fs::write(folder.join("a.bvh"), foreign::bvh(str::to_string)).unwrap();
    std::fs::write(folder.join("b.glb"), foreign::glb()).unwrap();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/motions/marathon_man/walk.motion");
    let read = |path: &Path| Clip::parse(path, &std::fs::read(path).unwrap()).unwrap();
    let walk = read(&file);
    for recording in ["a.bvh", "b.glb"] {
        let import = ["motion", "import", recording, "--model", "MarathonMan", "--out", "x.motion", "--json"];
        let report = json(&succeed(folder, &import));
        assert_eq!(report["warnings"], serde_json::json!([]), "{recording}");
        let clip = read(&folder.join("x.motion"));
        assert!((clip.duration() - 2.0).abs() < 0.01, "{recording} lasts {} s", clip.duration());
        let (mut ours, mut theirs) = (vec![0.0; walk.layout().nq()], vec![0.0; walk.layout().nq()]);
        let (mut sum, mut count) = (0.0, 0);
        for i in 0..=40 {
            let time = 0.05 * f64::from(i);
            clip.qpos(time, &mut ours);
            walk.qpos(time, &mut theirs);
            for k in 7..walk.layout().nq() {
                sum += (ours[k] - theirs[k]).abs();
                count += 1;
            }
        }
        let off = sum / f64::from(count);
        assert!(off < 0.02, "{recording}: joints are {off} rad off in the mean");
        let (way, known) = (ours[0], theirs[0]);
        assert!((way / known - 1.0).abs() < 0.01, "{recording}: {way} m instead of {known} m in 2 s");
    }
}
