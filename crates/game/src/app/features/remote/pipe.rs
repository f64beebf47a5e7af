//! States of a Python environment through the standard input: what `render_mode="human"` shows.
//!
//! First a line of JSON: `{"agent": ID}`, or `{"model": MJCF, "dt": seconds}`, or `{"file": path of MJCF, "dt": seconds}`.
//! Then frames of 64-bit floating-point numbers, little endian: whether an episode begins (0 or 1), reward, and the
//! configuration. The game answers each frame with one byte on the standard output when the time of the frame has passed, so that
//! a step takes its time.

use crate::app::error::GameError;
use crate::app::features::remote::mailbox::{RemotePose, RemoteSource, Shared, open};
use crate::app::stage::puppets::Kind;
use bevy_marathon::Episode;
use marathon_envs::registry;
use marathon_physics::lanes::Isa;
use marathon_physics::{Model, budget};
use serde_json::Value;
use std::io::{BufRead, Read, Write};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Limit on the time between two frames, s.
const LONGEST_FRAME: f64 = 10.0;
/// Limit on coordinates, m or rad.
const FARTHEST: f64 = 1e9;

/// Reads the first line, and the frames on a thread of their own.
///
/// # Errors
/// If the first line makes no sense.
pub fn watch(
    mut input: impl BufRead + Send + 'static,
    output: impl Write + Send + 'static,
) -> Result<RemoteSource, GameError> {
    let bad = |problem: String| GameError::Stream(problem);
    let mut line = String::new();
    // the message may contain a whole model
    let most = budget::MODEL_FILE.most().map_err(|e| bad(e.to_string()))?;
    input.by_ref().take(most.saturating_add(1)).read_line(&mut line).map_err(|e| bad(e.to_string()))?;
    budget::MODEL_FILE.check(line.len() as f64).map_err(|e| bad(format!("its first line {e}")))?;
    let about: Value = serde_json::from_str(&line).map_err(|e| bad(format!("its first line is no JSON ({e})")))?;
    let kind = match about["agent"].as_str() {
        Some(name) => {
            let spec = Arc::new(registry::factory(name, Isa::best())?.spec().clone());
            Kind::new(Arc::new(registry::agent(name)?.model()?), Some(spec.clone()), spec.dt)
        }
        None => {
            let model = match (about["model"].as_str(), about["file"].as_str()) {
                (Some(text), _) => Model::from_xml_str(text, "the environment's model"),
                (None, Some(path)) => Model::from_xml_file(path),
                (None, None) => return Err(bad("its first line has none of 'agent', 'model', 'file'".into())),
            };
            let dt = about["dt"].as_f64().filter(|dt| *dt > 0.0 && *dt <= LONGEST_FRAME);
            let expected =
                || format!("'dt' is {}, expected seconds between two frames, up to {LONGEST_FRAME}", about["dt"]);
            let dt = dt.ok_or_else(|| bad(expected()))?;
            Kind::new(Arc::new(model.map_err(Box::new)?), None, dt)
        }
    };
    let source = RemoteSource::new(kind, 1);
    let (shared, nq, dt) = (source.shared.clone(), source.kind.model.nq, source.kind.dt);
    let read = move || {
        let result = frames(input, output, &shared, nq, dt);
        open(&shared).end = Some(result.map_err(|e| format!("the environment's frames cannot be read: {e}")));
    };
    let thread = std::thread::Builder::new().name("marathon-stream".into()).spawn(read);
    thread.map_err(|e| bad(format!("a thread cannot be started: {e}")))?;
    Ok(source)
}

/// Reads frames until the other side closes.
fn frames(
    mut input: impl Read,
    mut output: impl Write,
    shared: &Shared,
    nq: usize,
    dt: f64,
) -> Result<(), std::io::Error> {
    let mut bytes = vec![0; 8 * (2 + nq)];
    let mut pose = RemotePose::default();
    let mut next = Instant::now();
    loop {
        match input.read_exact(&mut bytes) {
            Ok(()) => {}
            Err(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => return Ok(()),
            Err(e) => return Err(e),
        }
        let numbers: Vec<f64> = bytes.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
        let [begins, reward] = [numbers[0], numbers[1]];
        let episode = &mut pose.episode;
        if begins > 0.5 {
            *episode = Episode { number: episode.number + 1, ..Default::default() };
        } else {
            // a model without joints has no coordinates
            let now = numbers.get(2).copied().unwrap_or_default();
            let moved = now - pose.qpos.first().copied().unwrap_or(now);
            episode.decisions += 1;
            episode.seconds = episode.decisions as f64 * dt;
            episode.reward = reward as f32;
            episode.total += reward;
            episode.distance += moved;
            episode.speed = (moved / dt) as f32;
        }
        pose.qpos.clear();
        pose.qpos.extend_from_slice(&numbers[2..]);
        if pose.qpos.iter().all(|x| x.abs() <= FARTHEST) {
            open(shared).poses = vec![pose.clone()];
        }
        next += Duration::from_secs_f64(dt);
        let now = Instant::now();
        match next.checked_duration_since(now) {
            Some(early) => std::thread::sleep(early),
            None => next = now,
        }
        match output.write_all(b".").and_then(|()| output.flush()) {
            Ok(()) => {}
            // a program that does not wait for answers has closed its end
            Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => return Ok(()),
            Err(e) => return Err(e),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn frame(begins: f64, reward: f64, qpos: &[f64]) -> Vec<u8> {
        [&[begins, reward], qpos].concat().iter().flat_map(|x| x.to_le_bytes()).collect()
    }

    #[test]
    fn frames_are_shown_and_answered() -> Result<(), Box<dyn std::error::Error>> {
        let spec = registry::factory("hopper", Isa::best())?.spec().clone();
        let mut qpos = vec![0.0; spec.nq];
        let mut input = b"{\"agent\": \"Hopper-v0\"}\n".to_vec();
        input.extend(frame(1.0, 0.0, &qpos));
        qpos[0] = 0.5;
        input.extend(frame(0.0, 1.5, &qpos));
        let begun = Instant::now();
        let source = watch(Cursor::new(input), std::io::sink())?;
        while open(&source.shared).end.is_none() {
            assert!(begun.elapsed() < Duration::from_secs(20));
            std::thread::sleep(Duration::from_millis(2));
        }
        // two frames take the time of two decisions
        assert!(begun.elapsed().as_secs_f64() >= 1.9 * spec.dt);
        let mailbox = open(&source.shared);
        let RemotePose { qpos: seen, episode } = &mailbox.poses[0];
        assert_eq!((seen, episode.decisions, episode.number), (&qpos, 1, 1));
        assert_eq!((episode.total, episode.distance), (1.5, 0.5));
        assert_eq!(mailbox.end, Some(Ok(())));
        Ok(())
    }

    #[test]
    fn a_first_line_that_makes_no_sense_is_refused() {
        for (line, part) in [
            ("", "no JSON"),
            ("{}", "none of 'agent', 'model', 'file'"),
            ("{\"agent\": \"hoper\"}", "did you mean"),
            ("{\"model\": \"<mujoco/>\"}", "'dt' is null, expected seconds"),
            ("{\"model\": \"<mujoco/>\", \"dt\": 1e300}", "expected seconds between two frames, up to 10"),
            ("{\"model\": \"<mujocco/>\", \"dt\": 0.1}", "mujoc"),
        ] {
            let error = watch(Cursor::new(line.to_string()), std::io::sink()).map(|_| ()).expect_err(line).to_string();
            assert!(error.contains(part), "{line}: {error}");
        }
    }
}
