//! `marathon skin` writes a skin for an agent or an MJCF file, whole or not at all, and says what is wrong otherwise.

use crate::common::{assert_no_leftovers, fail, json, succeed};

const BALL: &str =
    "<mujoco model='ball'><worldbody><body name='b'><freejoint/><geom size='.1'/></body></worldbody></mujoco>";

#[test]
fn agents_and_files_get_skins() {
    let temp = tempfile::tempdir().unwrap();
    let read = |name: &str| std::fs::read(temp.path().join(name)).unwrap();
    let report =
        json(&succeed(temp.path(), &["--json", "skin", "hopper", "--out", "hopper.glb", "--triangles", "2000"]));
    let file = read("hopper.glb");
    assert!(file.starts_with(b"glTF"));
    assert_eq!((&report["model"], &report["bytes"]), (&"hopper".into(), &file.len().into()));
    assert!((1000..=2000).contains(&report["triangles"].as_u64().unwrap()), "{report}");

    std::fs::write(temp.path().join("ball.xml"), BALL).unwrap();
    let text = succeed(temp.path(), &["skin", "ball.xml", "--out", "ball.glb"]);
    assert!(text.starts_with("wrote ball.glb: 1 joints, "), "{text}");
    let first = read("ball.glb");
    succeed(temp.path(), &["skin", "ball.xml", "--out", "ball.glb"]);
    assert!(read("ball.glb") == first, "the same command writes the same file");
    assert_no_leftovers(temp.path());
}

#[test]
fn errors_say_what_was_expected() {
    let temp = tempfile::tempdir().unwrap();
    let text = fail(temp.path(), 2, &["skin", "hopper", "--out", "hopper.png"]);
    assert!(text.contains("hopper.png") && text.contains(".glb"), "{text}");
    let text = fail(temp.path(), 2, &["skin", "hopper", "--out", "hopper.glb", "--triangles", "7"]);
    assert!(text.contains("--triangles is 7, expected 500 to 20000"), "{text}");
    std::fs::write(temp.path().join("empty.xml"), "<mujoco model='e'><worldbody/></mujoco>").unwrap();
    let text = fail(temp.path(), 1, &["skin", "empty.xml", "--out", "empty.glb"]);
    assert!(
        text.contains("empty.xml") && text.contains("model 'e'") && text.contains("expected at least one"),
        "{text}"
    );
    assert!(!temp.path().join("empty.glb").exists());
    assert_no_leftovers(temp.path());
}
