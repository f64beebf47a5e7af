//! Pictures of the game, without a window: a small picture at low quality has a sky above, a checkered ground below and
//! a character in the middle. The same command draws the same picture. Errors have messages.
//!
//! Needs a Vulkan device; a software one will do (Debian: mesa-vulkan-drivers libvulkan1).

use marathon_render::Image;
use std::error::Error;
use std::path::Path;
use std::process::{Command, Output};

const SIZE: [usize; 2] = [320, 192];

fn game(folder: &Path, words: &[&str]) -> Result<Output, Box<dyn Error>> {
    Ok(Command::new(env!("CARGO_BIN_EXE_marathon-game")).current_dir(folder).args(words).output()?)
}

fn read(path: &Path) -> Result<Image, Box<dyn Error>> {
    let mut reader = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path)?)).read_info()?;
    let mut bytes = vec![0; reader.output_buffer_size().ok_or("the picture is too large")?];
    let info = reader.next_frame(&mut bytes)?;
    assert_eq!(info.color_type, png::ColorType::Rgb);
    bytes.truncate(info.buffer_size());
    Ok(Image::from_rgb(info.width as usize, info.height as usize, bytes)?)
}

fn draw(folder: &Path, name: &str, more: &[&str]) -> Result<Image, Box<dyn Error>> {
    let common = ["--quality", "low", "--size", "320x192", "--start", "0.5", "--seconds", "0.2", "--fps", "10"];
    let words = [more, &common[..], &["--record", name][..]].concat();
    let output = game(folder, &words)?;
    assert!(
        output.status.success(),
        "{words:?}: {}\nNo graphics? apt install mesa-vulkan-drivers libvulkan1",
        String::from_utf8_lossy(&output.stderr)
    );
    let image = read(&folder.join(name))?;
    // kept so that you can look at it after the test run
    image.save_png(Path::new(env!("CARGO_TARGET_TMPDIR")).join(name))?;
    Ok(image)
}

/// Mean color of a part of the picture, given in shares of its sides.
fn mean(image: &Image, x: [f64; 2], y: [f64; 2]) -> [f64; 3] {
    let span = |[a, b]: [f64; 2], n: usize| (a * n as f64) as usize..(b * n as f64) as usize;
    let mut sum = [0.0; 4];
    for v in span(y, SIZE[1]) {
        for u in span(x, SIZE[0]) {
            let p = image.pixel(u, v);
            (0..3).for_each(|k| sum[k] += f64::from(p[k]));
            sum[3] += 1.0;
        }
    }
    [sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3]]
}

#[test]
fn a_runner_between_sky_and_ground() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let image = draw(folder.path(), "hopper.png", &["hopper", "--no-hud"])?;
    let sky = mean(&image, [0.0, 1.0], [0.0, 0.12]);
    assert!(sky[2] > sky[0] + 10.0 && sky[2] > 120.0, "the sky is blue: {sky:?}");
    let ground = mean(&image, [0.0, 1.0], [0.85, 1.0]);
    let warmth = ground[0] - ground[2];
    assert!((5.0..60.0).contains(&warmth), "the ground is a warm gray: {ground:?}");
    // the hopper wears warm colors, which nothing else has
    let warm = (0..SIZE[0] * SIZE[1])
        .map(|i| image.pixel(i % SIZE[0], i / SIZE[0]))
        .filter(|p| i32::from(p[0]) > i32::from(p[2]) + 50)
        .count();
    assert!((100..12_000).contains(&warm), "pixels of the hopper: {warm}");
    Ok(())
}

#[test]
fn the_same_command_draws_the_same_picture() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let words = ["ant", "--agents", "3", "--no-hud", "--seed", "4"];
    let first = draw(folder.path(), "ants.png", &words)?;
    let again = draw(folder.path(), "ants-again.png", &words)?;
    let differing = first.rgb().iter().zip(again.rgb()).filter(|(a, b)| a.abs_diff(**b) > 2).count();
    assert!(differing < first.rgb().len() / 500, "{differing} numbers differ");
    Ok(())
}

#[test]
fn text_and_marks_are_drawn() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let plain = draw(folder.path(), "walker-plain.png", &["walker", "--no-hud"])?;
    let full = draw(folder.path(), "walker-full.png", &["walker", "--contacts", "--joints"])?;
    let differing = plain.rgb().iter().zip(full.rgb()).filter(|(a, b)| a.abs_diff(**b) > 30).count();
    assert!(differing > plain.rgb().len() / 50, "{differing} numbers differ");
    Ok(())
}

#[test]
fn a_ball_is_thrown_on_its_cue() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let red = |image: &Image| {
        let pixels = image.rgb().as_chunks::<3>().0.iter();
        pixels
            .filter(|[r, g, b]| *r > 100 && u16::from(*r) > 3 * u16::from(*g) && u16::from(*r) > 3 * u16::from(*b))
            .count()
    };
    let words = ["hopper", "--mode", "push", "--no-hud"];
    let without = red(&draw(folder.path(), "hopper-alone.png", &words)?);
    let with = red(&draw(folder.path(), "hopper-ball.png", &[&words[..], &["--action", "0.5:throw"]].concat())?);
    assert!(with > without + 100, "red pixels: {without}, with a ball {with}");
    Ok(())
}

/// Share of the numbers of two pictures that differ clearly.
fn differing(a: &Image, b: &Image) -> f64 {
    let pairs = a.rgb().iter().zip(b.rgb());
    pairs.filter(|(a, b)| a.abs_diff(**b) > 30).count() as f64 / a.rgb().len() as f64
}

#[test]
fn a_ghost_errors_and_a_skin_are_drawn() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let words = ["MarathonManWalk", "--mode", "imitate", "--no-hud", "--option", "start=first"];
    let draw = |name: &str, more: &[&str]| draw(folder.path(), name, &[&words[..], more].concat());
    // the errors are colors of the shapes, with or without a skin
    let off = ["--action", "0:ghost", "--action", "0:ghost"];
    let plain = draw("man.png", &[&off[..], &["--action", "0:errors", "--skin", "none"]].concat())?;
    let beside = draw("man-ghost.png", &["--action", "0:ghost", "--action", "0:errors", "--skin", "none"])?;
    let errors = draw("man-errors.png", &off)?;
    let skin = draw("man-skin.png", &[&off[..], &["--action", "0:errors"]].concat())?;
    for (what, image) in [("the ghost", &beside), ("errors", &errors), ("the skin", &skin)] {
        let share = differing(&plain, image);
        assert!((0.001..0.2).contains(&share), "{what}: {share} of the numbers differ");
    }
    let green = |image: &Image| {
        let pixels = image.rgb().as_chunks::<3>().0.iter();
        pixels
            .filter(|[r, g, b]| *g > 90 && i32::from(*g) > i32::from(*r) + 30 && i32::from(*g) > i32::from(*b) + 30)
            .count()
    };
    assert!(green(&errors) > green(&plain) + 150, "green pixels: {}, with errors {}", green(&plain), green(&errors));
    Ok(())
}

/// Without the rest of the screen, sliders and cards are hidden too.
#[test]
fn without_text_and_bars_nothing_is_over_the_picture() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let watch = draw(folder.path(), "bare.png", &["hopper", "--no-hud"])?;
    let push = draw(folder.path(), "bare-push.png", &["hopper", "--mode", "push", "--no-hud"])?;
    assert!(differing(&watch, &push) < 0.002, "{}", differing(&watch, &push));
    let recorded = ["hopper", "--action", "0.1:record", "--action", "0.6:record"];
    draw(folder.path(), "recorded.png", &recorded)?;
    let replay = ["--replay", "hopper-1.replay", "--action", "0:pause"];
    let shown = draw(folder.path(), "replay.png", &replay)?;
    let bare = draw(folder.path(), "bare-replay.png", &[&replay[..], &["--no-hud"]].concat())?;
    // the time line is in the lower half
    let line = |image: &Image| mean(image, [0.35, 0.65], [0.78, 0.84]);
    let (shown, bare) = (line(&shown), line(&bare));
    assert!(bare[0] > shown[0] + 20.0, "the card of the time line is dark: {shown:?}, without it {bare:?}");
    Ok(())
}

#[test]
fn what_is_wrong_is_told() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    std::fs::write(folder.path().join("broken.safetensors"), "no policy")?;
    std::fs::write(folder.path().join("broken.xml"), "<mujoco><worldbody><geom type='spere'/></worldbody></mujoco>")?;
    std::fs::create_dir(folder.path().join("empty"))?;
    let skin = std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/skins/marathon_man.glb"))?;
    let shin = skin.windows(9).position(|name| name == b"\"LeftLeg\"").ok_or("a shin")?;
    std::fs::write(folder.path().join("lame.glb"), [&skin[..shin], b"\"LeftLog\"", &skin[shin + 9..]].concat())?;
    std::fs::write(folder.path().join("half.glb"), &skin[..skin.len() / 2])?;
    std::fs::write(
        folder.path().join("draco.glb"),
        glb(r#"{"asset":{"version":"2.0"},"extensionsRequired":["KHR_draco_mesh_compression"]}"#),
    )?;
    std::fs::write(
        folder.path().join("wrong.json"),
        r#"{"mapping": 1, "model": "hero", "hips": ["a", "b"], "parts": {}}"#,
    )?;
    let cases: [(&[&str], i32, &[&str]); 25] = [
        (&["hoper"], 1, &["'hoper' does not exist", "did you mean 'Hopper-v0'"]),
        (&["runs/hopper-1"], 1, &["runs/hopper-1", "no such file"]),
        (&["broken.safetensor"], 1, &["did you mean", "broken.safetensors"]),
        (&["broken.safetensors"], 1, &["broken.safetensors"]),
        (&["half.glb"], 1, &["half.glb: this is a motion", "MarathonMan --mode imitate --option clip=half.glb"]),
        (&["empty"], 1, &["no policy.safetensors", "the folder of a run"]),
        (&["broken.xml"], 1, &["broken.xml:1", "sphere"]),
        (&["--replay", "broken.safetensors"], 1, &["broken.safetensors", "not a recording"]),
        (&["MarathonMan", "--option", "clip=wlak"], 1, &["'wlak'", "did you mean 'walk'"]),
        (&["hopper", "--option", "clip=run"], 1, &["'Hopper-v0' takes no option 'clip'"]),
        (&["hopper", "--mode", "imitate"], 1, &["--mode", "follows none", "MarathonMan-v0 does"]),
        (&["MarathonMan", "--skin", "hero.glb"], 1, &["hero.glb", "no such file"]),
        (&["MarathonMan", "--skin", "broken.xml"], 1, &["broken.xml", "no .glb file"]),
        (
            &["MarathonMan", "--skin", "lame.glb", "--record", "a.png"],
            1,
            &["lame.glb", "left_shin", "left_knee", "LeftLog", "--mapping FILE.json"],
        ),
        (
            &["MarathonMan", "--skin", "draco.glb"],
            1,
            &["draco.glb", "KHR_draco_mesh_compression", "without compression"],
        ),
        (
            &["MarathonMan", "--skin", "marathon_man", "--mapping", "wrong.json", "--record", "a.png"],
            1,
            &["marathon_man cannot be worn by the mapping wrong.json", "found \"hero\"", "expected \"marathon_man\""],
        ),
        (&["MarathonMan", "--skin", "marathon_man", "--mapping", "rong.json"], 1, &["did you mean", "wrong.json"]),
        (&["MarathonMan", "--mapping", "wrong.json"], 2, &["--skin"]),
        (&["MarathonMan", "--skin", "none", "--mapping", "wrong.json"], 1, &["--skin none", "--skin FILE.glb"]),
        (&["\u{1b}[31mhopper"], 1, &["\\u{1b}[31mhopper"]),
        (&["MarathonMan", "--skin", "half.glb", "--record", "a.png"], 1, &["half.glb cannot be worn"]),
        (
            &["hopper", "--skin", "marathon_man", "--record", "a.png"],
            1,
            &["no built-in mapping", "marathon_man, humanoid"],
        ),
        (&["hopper", "--agents", "0"], 2, &["--agents"]),
        (&["hopper", "--action", "1:thorw"], 2, &["--action", "did you mean 'throw'"]),
        (&["hopper", "--record", "a.mov"], 1, &["a.mov", "mp4"]),
    ];
    for (words, code, parts) in cases {
        let output = game(folder.path(), words)?;
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{words:?}: {text}");
        for part in parts {
            assert!(text.contains(part), "{words:?} lacks '{part}': {text}");
        }
        assert!(!text.contains("panicked") && !text.contains("stack backtrace"), "{words:?}: {text}");
        assert!(!text.contains("\u{1b}[31mhopper"), "{words:?}: {text}");
    }
    Ok(())
}

/// A glTF file that consists only of its JSON.
fn glb(json: &str) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = |n: usize| (n as u32).to_le_bytes();
    [b"glTF", &length(2)[..], &length(20 + json.len()), &length(json.len()), b"JSON", &json].concat()
}

/// A mapping names the bones of a skeleton whose names are not known.
#[test]
fn a_skin_of_unknown_names_is_worn_by_a_mapping() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets");
    let skin = std::fs::read(assets.join("skins/marathon_man.glb"))?;
    let shin = skin.windows(9).position(|name| name == b"\"LeftLeg\"").ok_or("a shin")?;
    std::fs::write(folder.path().join("hero.glb"), [&skin[..shin], b"\"Limb-07\"", &skin[shin + 9..]].concat())?;
    let mapping = std::fs::read_to_string(assets.join("motions/mappings/marathon_man.json"))?;
    std::fs::write(folder.path().join("hero.json"), mapping.replace("\"left_knee\"", "\"Limb-07\""))?;
    let words = ["MarathonManWalk", "--no-hud", "--option", "start=first", "--skin"];
    let usual = draw(folder.path(), "skin.png", &[&words[..], &["marathon_man"]].concat())?;
    let mapped =
        draw(folder.path(), "skin-mapped.png", &[&words[..], &["hero.glb", "--mapping", "hero.json"]].concat())?;
    assert!(differing(&usual, &mapped) < 0.002, "{}", differing(&usual, &mapped));
    Ok(())
}

#[test]
fn without_a_display_or_graphics_the_remedy_is_named() -> Result<(), Box<dyn Error>> {
    let game = || Command::new(env!("CARGO_BIN_EXE_marathon-game"));
    let output = game().env_remove("DISPLAY").arg("hopper").output()?;
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(1) && text.contains("xvfb-run") && text.contains("--record"), "{text}");
    let output = game().env("DISPLAY", ":7999").arg("hopper").output()?;
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(1) && text.contains(":7999"), "{text}");
    let nothing = game()
        .env("VK_DRIVER_FILES", "/nonexistent.json")
        .env("WGPU_BACKEND", "vulkan")
        .env("VK_ICD_FILENAMES", "/nonexistent.json")
        .args(["hopper", "--record", "a.png"])
        .output()?;
    let text = String::from_utf8_lossy(&nothing.stderr).into_owned();
    assert!(nothing.status.code() == Some(1) && text.contains("mesa-vulkan-drivers"), "{text}");
    Ok(())
}
