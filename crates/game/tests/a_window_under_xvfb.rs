//! The game in a real window on a virtual screen, driven by real key presses and clicks: it starts, changes the agent, is
//! pushed, learns live for some seconds, opens its menu, and quits with code 0. Screenshots stay in `target/tmp`.
//! And it shows what a Python environment sends through a pipe, in its time.
//!
//! Needs Xvfb, xdotool, imagemagick and a Vulkan device (Debian: xvfb xdotool imagemagick mesa-vulkan-drivers libvulkan1).
#![cfg(target_os = "linux")]

use std::error::Error;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Ends with the test, whatever comes.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn start(command: &mut Command) -> Result<Running, Box<dyn Error>> {
    let program = command.get_program().to_string_lossy().into_owned();
    let child = command.spawn().map_err(|e| format!("{program}: {e}; apt install xvfb xdotool imagemagick"))?;
    Ok(Running(child))
}

/// A display for this test alone. Xvfb picks a free number and tells it once it accepts connections. Without `-noreset` it
/// would restart after its last client, and refuse the next one meanwhile.
fn screen() -> Result<(Running, String), Box<dyn Error>> {
    let mut xvfb = Command::new("Xvfb");
    xvfb.args(["-displayfd", "1", "-noreset", "-screen", "0", "640x400x24", "-nolisten", "tcp"]);
    let mut xvfb = start(xvfb.stdout(Stdio::piped()))?;
    let mut number = String::new();
    BufReader::new(xvfb.0.stdout.take().ok_or("no output")?).read_line(&mut number)?;
    assert!(!number.trim().is_empty(), "no virtual screen");
    Ok((xvfb, format!(":{}", number.trim())))
}

/// Output of the game, line by line.
struct Words(Receiver<String>, String);

impl Words {
    fn wait(&mut self, part: &str, seconds: u64) {
        let end = Instant::now() + Duration::from_secs(seconds);
        loop {
            match self.0.recv_timeout(end.saturating_duration_since(Instant::now())) {
                Ok(line) => {
                    let found = line.contains(part);
                    self.1 += &format!("{line}\n");
                    if found {
                        return;
                    }
                }
                Err(_) => panic!("{seconds} s without '{part}' in:\n{}", self.1),
            }
        }
    }
}

#[test]
fn it_is_played() -> Result<(), Box<dyn Error>> {
    let (_screen, display) = screen()?;
    let folder = tempfile::tempdir()?;
    let mut game = Command::new(env!("CARGO_BIN_EXE_marathon-game"));
    game.args([
        "hopper",
        "--mode",
        "push",
        "--quality",
        "low",
        "--size",
        "640x400",
        "--max-fps",
        "12",
        "--threads",
        "1",
    ])
    .current_dir(folder.path())
    .env("DISPLAY", &display)
    .env("XDG_CONFIG_HOME", folder.path())
    .env("NO_COLOR", "1")
    .stderr(Stdio::piped())
    .stdout(Stdio::piped());
    let mut game = start(&mut game)?;
    let (tell, told) = channel();
    let outputs: [Box<dyn std::io::Read + Send>; 2] =
        [Box::new(game.0.stdout.take().ok_or("no output")?), Box::new(game.0.stderr.take().ok_or("no output")?)];
    for output in outputs {
        let tell = tell.clone();
        std::thread::spawn(move || {
            BufReader::new(output).lines().map_while(Result::ok).for_each(|line| {
                let _ = tell.send(line);
            });
        });
    }
    let mut words = Words(told, String::new());
    words.wait("loaded: 1 of Hopper-v0", 120);

    let run = |program: &str, args: &[&str]| -> Result<String, Box<dyn Error>> {
        let output = Command::new(program).args(args).env("DISPLAY", &display).output();
        let output = output.map_err(|e| format!("{program}: {e}; apt install xdotool imagemagick"))?;
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let window =
        run("xdotool", &["search", "--sync", "--name", "^Marathon$"])?.lines().next().unwrap_or("").to_string();
    run("xdotool", &["windowfocus", &window])?;
    let shot = |name: &str| -> Result<(), Box<dyn Error>> {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        run("import", &["-window", "root", &path.display().to_string()])?;
        assert!(path.metadata()?.len() > 5_000, "{name} shows something");
        Ok(())
    };
    // a press as long as a slow frame
    let key = |name: &str| run("xdotool", &["key", "--delay", "400", name]);

    std::thread::sleep(Duration::from_secs(3));
    shot("window-1-hopper.png")?;
    key("p")?;
    words.wait("pushed", 60);
    // where the runner is: the middle of the picture
    for y in ["200", "225", "250"] {
        run("xdotool", &["mousemove", "--window", &window, "320", y, "sleep", "0.3", "click", "1"])?;
        std::thread::sleep(Duration::from_millis(600));
    }
    key("n")?;
    words.wait("loaded: 1 of Walker2d-v0", 60);
    shot("window-2-walker.png")?;
    key("l")?;
    words.wait("learning Walker2d-v0 from random weights", 60);
    words.wait("frames of the last 5 s: median", 60);
    shot("window-3-learning.png")?;
    key("s")?;
    words.wait("saved as walker2d-live-1.safetensors", 60);
    assert!(marathon_learn::Policy::load(&folder.path().join("walker2d-live-1.safetensors")).is_ok());
    key("Escape")?;
    std::thread::sleep(Duration::from_secs(5));
    shot("window-4-menu.png")?;
    // training has continued since the save, so the first press asks
    key("q")?;
    std::thread::sleep(Duration::from_secs(2));
    shot("window-5-question.png")?;
    assert!(game.0.try_wait()?.is_none(), "it asks");
    key("q")?;
    let begun = Instant::now();
    let status = loop {
        if let Some(status) = game.0.try_wait()? {
            break status;
        }
        assert!(begun.elapsed() < Duration::from_secs(60), "it does not end");
        std::thread::sleep(Duration::from_millis(100));
    };
    assert_eq!(status.code(), Some(0), "{}", words.1);
    Ok(())
}

#[test]
fn an_environment_is_shown_in_its_time() -> Result<(), Box<dyn Error>> {
    let (_screen, display) = screen()?;
    let start_it = |first_line: &[u8]| -> Result<(Running, std::process::ChildStdin), Box<dyn Error>> {
        let mut game = Command::new(env!("CARGO_BIN_EXE_marathon-game"));
        game.args(["--watch-stream", "--size", "320x200", "--max-fps", "10"]).env("DISPLAY", &display);
        let mut game = start(game.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()))?;
        let mut to_it = game.0.stdin.take().ok_or("no input")?;
        to_it.write_all(first_line)?;
        Ok((game, to_it))
    };
    let (mut game, mut to_it) = start_it(b"{\"agent\": \"Hopper-v0\"}\n")?;
    let mut from_it = game.0.stdout.take().ok_or("no output")?;
    let agent = marathon_envs::agent("hopper")?;
    let (model, dt) =
        (agent.model()?, marathon_envs::factory("hopper", marathon_physics::lanes::Isa::best())?.spec().dt);
    let mut begun = Instant::now();
    for frame in 0..100 {
        let mut numbers = vec![if frame == 0 { 1.0 } else { 0.0 }, 0.5];
        numbers.extend(&model.qpos0);
        numbers[2] += 0.02 * f64::from(frame);
        to_it.write_all(&numbers.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>())?;
        from_it.read_exact(&mut [0])?;
        if frame == 0 {
            begun = Instant::now();
        }
    }
    assert!(begun.elapsed().as_secs_f64() > 98.0 * dt, "steps take the time that they simulate");
    drop(to_it);
    let status = game.0.wait()?;
    assert_eq!(status.code(), Some(0), "it ends with the environment");

    let (mut game, to_it) = start_it(b"{\"agent\": \"hoper\"}\n")?;
    drop(to_it);
    assert_eq!(game.0.wait()?.code(), Some(1));
    let mut text = String::new();
    game.0.stderr.take().ok_or("no errors")?.read_to_string(&mut text)?;
    assert!(text.contains("did you mean 'Hopper-v0'") && !text.contains("panicked"), "{text}");
    Ok(())
}

/// SIGTERM ends the game cleanly, and recordings are saved. A video reports that it is not written.
#[test]
fn signals_end_it_and_recordings_are_kept() -> Result<(), Box<dyn Error>> {
    let (_screen, display) = screen()?;
    let folder = tempfile::tempdir()?;
    for (number, signal) in ["TERM", "INT"].iter().enumerate() {
        let mut game = Command::new(env!("CARGO_BIN_EXE_marathon-game"));
        let words = ["hopper", "--quality", "low", "--size", "320x200", "--max-fps", "10", "--action", "0.5:record"];
        game.args(words).current_dir(folder.path()).env("DISPLAY", &display);
        let mut game = start(game.stdout(Stdio::piped()).stderr(Stdio::piped()))?;
        let (tell, told) = channel();
        let outputs: [Box<dyn Read + Send>; 2] =
            [Box::new(game.0.stdout.take().ok_or("no output")?), Box::new(game.0.stderr.take().ok_or("no output")?)];
        for output in outputs {
            let tell = tell.clone();
            std::thread::spawn(move || {
                BufReader::new(output).lines().map_while(Result::ok).for_each(|line| {
                    let _ = tell.send(line);
                });
            });
        }
        drop(tell);
        let mut words = Words(told, String::new());
        words.wait("recording; the same key ends it", 120);
        std::thread::sleep(Duration::from_secs(3));
        Command::new("kill").args([&format!("-{signal}"), &game.0.id().to_string()]).status()?;
        words.wait("interrupted", 60);
        assert_eq!(game.0.wait()?.code(), Some(130), "{signal}: {}", words.1);
        words.1 += &words.0.iter().collect::<Vec<_>>().join("\n");
        assert!(!words.1.contains("graphics adapter"), "{}", words.1);
        let path = folder.path().join(format!("hopper-{}.replay", number + 1));
        assert!(marathon_game::app::Recording::load(&path)?.seconds() > 0.2, "{signal}");
    }
    let mut video = Command::new(env!("CARGO_BIN_EXE_marathon-game"));
    video.args(["hopper", "--quality", "low", "--size", "320x200", "--seconds", "600", "--record", "a.mp4"]);
    video.args(["--action", "0:record"]).current_dir(folder.path());
    let mut video = start(video.stdout(Stdio::null()).stderr(Stdio::piped()))?;
    let (tell, told) = channel();
    let lines = BufReader::new(video.0.stderr.take().ok_or("no errors")?).lines();
    std::thread::spawn(move || lines.map_while(Result::ok).try_for_each(|line| tell.send(line)));
    let mut words = Words(told, String::new());
    words.wait("a.mp4: ", 120);
    // a few frames more
    words.wait("a.mp4: ", 120);
    Command::new("kill").args(["-INT", &video.0.id().to_string()]).status()?;
    assert_eq!(video.0.wait()?.code(), Some(130));
    words.1 += &words.0.iter().collect::<Vec<_>>().join("\n");
    let text = &words.1;
    assert!(text.contains("interrupted: a.mp4 is not written"), "{text}");
    let left: Vec<_> = std::fs::read_dir(folder.path())?.flatten().map(|entry| entry.file_name()).collect();
    assert!(!left.iter().any(|name| name.to_string_lossy().contains("mp4")), "{left:?}");
    assert!(folder.path().join("hopper-3.replay").exists(), "{left:?}");
    Ok(())
}
