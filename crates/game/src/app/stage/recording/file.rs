//! The file of a recording.

use super::{Lie, NUMBERS, Recording};
use crate::app::error::GameError;
use crate::app::files::exists;
use bevy_marathon::Ground;
use marathon_physics::budget;
use marathon_runs::TaskConfig;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use serde_json::Value;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// Kind of file: the key of the JSON document in its header.
const FORMAT: &str = "marathon-replay";
/// Version of the format, which the document states.
const VERSION: u32 = 1;
/// Limit on the agents of a recording, the same as on the command line.
const MOST_AGENTS: usize = 256;
/// Limit on the time between two frames, s.
const LONGEST_FRAME: f64 = 10.0;
/// Limit on coordinates, m or rad.
const FARTHEST: f64 = 1e9;
/// Numbers of a height field in a file: frame, agent, field, runs of equal elevations.
const LIE: usize = 4;
/// Limit on the points of a height field.
const MOST_POINTS: f32 = 4e6;

impl Recording {
    /// Writes the recording.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), GameError> {
        let single = |x: &[f32]| x.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        let double = |x: &[f64]| x.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        let (frames, agents) = (self.frames(), self.agents);
        let shape = |n: usize| vec![frames, agents, n / (frames * agents).max(1)];
        let (lies, elevations) = self.packed();
        let tensors = [
            ("places", Dtype::F32, vec![agents, 3], single(&self.places)),
            ("qpos", Dtype::F64, shape(self.qpos.len()), double(&self.qpos)),
            ("numbers", Dtype::F32, shape(self.numbers.len()), single(&self.numbers)),
            ("terms", Dtype::F32, shape(self.terms.len()), single(&self.terms)),
            ("actions", Dtype::F32, shape(self.actions.len()), single(&self.actions)),
            ("commands", Dtype::F64, shape(self.commands.len()), double(&self.commands)),
            ("untimed", Dtype::F32, shape(self.untimed.len()), single(&self.untimed)),
            ("lies", Dtype::F64, vec![lies.len() / LIE, LIE], double(&lies)),
            ("elevations", Dtype::F32, vec![elevations.len() / 2, 2], single(&elevations)),
        ];
        let broken = |problem: String| GameError::Replay { path: path.into(), problem };
        let mut views = Vec::new();
        for (name, kind, shape, data) in &tensors {
            views.push((*name, TensorView::new(*kind, shape.clone(), data).map_err(|e| broken(e.to_string()))?));
        }
        // one entry, because several would be written in any order
        let about = serde_json::json!({
            "version": VERSION, "ground": self.ground.name(), "dt": self.dt, "task": self.task_config,
        });
        let meta = HashMap::from([(FORMAT.to_string(), about.to_string())]);
        let file = safetensors::serialize(views, Some(meta)).map_err(|e| broken(e.to_string()))?;
        marathon_learn::write_atomic(path, &file)?;
        Ok(())
    }

    /// Grounds as tensors: a row of [`LIE`] numbers per field, and all elevations, equal neighbors once, with their count.
    fn packed(&self) -> (Vec<f64>, Vec<f32>) {
        let (mut lies, mut elevations) = (Vec::new(), Vec::<f32>::new());
        for lie in &self.grounds {
            for (field, points) in lie.fields.iter().enumerate() {
                let before = elevations.len();
                for z in points {
                    match elevations
                        .len()
                        .checked_sub(2)
                        .filter(|i| *i >= before && elevations[*i].to_bits() == z.to_bits())
                    {
                        Some(i) => elevations[i + 1] += 1.0,
                        None => elevations.extend([*z, 1.0]),
                    }
                }
                let runs = (elevations.len() - before) / 2;
                lies.extend([lie.frame, lie.agent, field, runs].map(|n| n as f64));
            }
        }
        (lies, elevations)
    }

    /// Describes grounds that the agent's model has no height fields for.
    fn wrong_ground(&self) -> Result<Option<String>, GameError> {
        if self.grounds.is_empty() {
            return Ok(None);
        }
        let TaskConfig { agent, options } = &self.task_config;
        let model = self.ground.agent_with(agent, options)?.model()?;
        let points: Vec<usize> = model.hfields.iter().map(|field| field.nrow * field.ncol).collect();
        let fits = |lie: &&Lie| lie.fields.iter().map(Vec::len).eq(points.iter().copied());
        Ok(self.grounds.iter().find(|lie| !fits(lie)).map(|lie| {
            let found: Vec<usize> = lie.fields.iter().map(Vec::len).collect();
            format!("its ground in frame {} has {found:?} points, expected {points:?}", lie.frame)
        }))
    }

    /// Reads a recording.
    ///
    /// # Errors
    /// If the file is not a whole recording of an agent that is known here.
    pub fn load(path: &Path) -> Result<Self, GameError> {
        exists(path)?;
        let bad = |problem: String| GameError::Replay { path: path.into(), problem };
        let bytes = budget::read(path, &budget::REPLAY_FILE).map_err(|e| bad(e.to_string()))?;
        let no_recording = |e: &dyn std::fmt::Display| bad(format!("not a recording of the game ({e})"));
        let (_, header) = SafeTensors::read_metadata(&bytes).map_err(|e| no_recording(&e))?;
        let meta = header.metadata().clone().unwrap_or_default();
        let Some(about) = meta.get(FORMAT).and_then(|text| serde_json::from_str::<Value>(text).ok()) else {
            return Err(bad("not a recording of the game, which writes such files by the key R".into()));
        };
        if about["version"] != VERSION {
            let found = about.get("version").map_or("none".into(), Value::to_string);
            return Err(bad(format!("its version is {found}, expected {VERSION}")));
        }
        let tensors = Tensors { file: SafeTensors::deserialize(&bytes).map_err(|e| no_recording(&e))?, bad: &bad };
        let task_config: TaskConfig =
            serde_json::from_value(about["task"].clone()).map_err(|e| bad(format!("its task cannot be read: {e}")))?;
        let spec = task_config.factory()?.spec().clone();
        let found = about["ground"].as_str().unwrap_or_default();
        let ground = Ground::named(found).ok_or_else(|| {
            let known = Ground::ALL.map(Ground::name).join(", ");
            bad(format!("its ground is '{found}', expected one of: {known}, track"))
        })?;
        let dt = about["dt"].as_f64().filter(|dt| *dt > 0.0 && *dt <= LONGEST_FRAME);
        let expected =
            || format!("its 'dt' is {}, expected seconds between frames, up to {LONGEST_FRAME}", about["dt"]);
        let dt = dt.ok_or_else(|| bad(expected()))?;
        let (_, agents, places) = tensors.read("places", 3)?;
        let (frames, with_poses, qpos) = tensors.read("qpos", spec.nq)?;
        let uneven = || bad("its tensors are about different numbers of agents or frames".into());
        if frames == 0 || agents == 0 || with_poses != agents {
            return Err(uneven());
        }
        let rows = |name: &str, columns: usize| {
            let (frames_here, agents_here, numbers) = tensors.read(name, columns)?;
            if (frames_here, agents_here) == (frames, agents) { Ok(numbers) } else { Err(uneven()) }
        };
        let (numbers, terms) = (rows("numbers", NUMBERS)?, rows("terms", spec.reward_terms.len())?);
        let (actions, commands) = (rows("actions", spec.act)?, rows("commands", spec.command.len())?);
        let untimed = rows("untimed", 1)?;
        if agents > MOST_AGENTS {
            return Err(bad(format!("it has {agents} agents, expected up to {MOST_AGENTS}")));
        }
        if let Some(i) = qpos.iter().position(|x| x.abs() > FARTHEST) {
            return Err(bad(format!("tensor 'qpos', number {i} is {}, expected up to {FARTHEST:e}", qpos[i])));
        }
        let [numbers, terms, places, actions, untimed] =
            [numbers, terms, places, actions, untimed].map(|tensor| narrow(&tensor));
        let empty = Recording::new(task_config, ground, dt, places);
        let mut recording = Recording { agents, qpos, numbers, terms, actions, commands, untimed, ..empty };
        let (lies, elevations) = (tensors.read("lies", LIE)?.2, tensors.read("elevations", 2)?.2);
        let points: f64 = elevations.as_chunks::<2>().0.iter().map(|[_, times]| times.max(0.0)).sum();
        budget::MEMORY.check(4.0 * points).map_err(|e| bad(e.to_string()))?;
        recording.grounds = unpacked(&lies, &narrow(&elevations), &recording)
            .ok_or_else(|| bad("its tensors 'lies' and 'elevations' do not fit each other".into()))?;
        if let Some(problem) = recording.wrong_ground()? {
            return Err(bad(problem));
        }
        Ok(recording)
    }
}

/// The opposite of [`Recording::packed`]; `None` if the numbers do not fit each other.
fn unpacked(lies: &[f64], elevations: &[f32], recording: &Recording) -> Option<Vec<Lie>> {
    let mut grounds: Vec<Lie> = Vec::new();
    let mut runs = elevations.as_chunks::<2>().0.iter();
    for [frame, agent, field, count] in lies.as_chunks::<LIE>().0.iter().map(|lie| lie.map(|x| x as usize)) {
        let mut points = Vec::new();
        for _ in 0..count {
            let [z, times] = runs.next()?;
            if !(1.0..=MOST_POINTS - points.len() as f32).contains(times) {
                return None;
            }
            points.resize(points.len() + *times as usize, *z);
        }
        match grounds.last_mut().filter(|lie| (lie.frame, lie.agent) == (frame, agent)) {
            Some(lie) if field == lie.fields.len() => Arc::make_mut(&mut lie.fields).push(points),
            None if field == 0 && frame < recording.frames() && agent < recording.agents => {
                grounds.push(Lie { frame, agent, fields: Arc::new(vec![points]) });
            }
            _ => return None,
        }
    }
    runs.next().is_none().then_some(grounds)
}

fn narrow(numbers: &[f64]) -> Vec<f32> {
    numbers.iter().map(|x| *x as f32).collect()
}

/// The tensors of a file.
struct Tensors<'a> {
    file: SafeTensors<'a>,
    bad: &'a dyn Fn(String) -> GameError,
}

impl Tensors<'_> {
    /// A tensor of so many columns, in single or double precision: frames, agents, numbers.
    fn read(&self, name: &str, columns: usize) -> Result<(usize, usize, Vec<f64>), GameError> {
        let tensor = self.file.tensor(name).map_err(|e| (self.bad)(e.to_string()))?;
        let shape = tensor.shape();
        let (frames, agents, found) = match *shape {
            [a, b] => (1, a, b),
            [f, a, b] => (f, a, b),
            _ => (0, 0, usize::MAX),
        };
        let numbers: Option<Vec<f64>> = match tensor.dtype() {
            Dtype::F32 => {
                Some(tensor.data().as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b).into()).collect())
            }
            Dtype::F64 => Some(tensor.data().as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect()),
            _ => None,
        };
        let Some(numbers) = numbers.filter(|_| found == columns) else {
            let expected = format!("{columns} columns of f32 or f64");
            return Err((self.bad)(format!("tensor '{name}' has the shape {shape:?}, expected {expected}")));
        };
        match numbers.iter().position(|x| !x.is_finite()) {
            Some(i) => {
                Err((self.bad)(format!("tensor '{name}', number {i} is {}, expected a finite number", numbers[i])))
            }
            None => Ok((frames, agents, numbers)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::stage::recording::Row;

    fn sample() -> Result<Recording, GameError> {
        let task_config = TaskConfig::named("hopper")?;
        let spec = task_config.factory()?.spec().clone();
        let mut recording = Recording::new(task_config, Ground::Hills, spec.dt, vec![0.0, 0.0, 0.0, 0.0, 0.0, -2.0]);
        let field = Ground::Hills.agent("hopper")?.model()?.hfields[0].clone();
        let grounds = [3.5, -0.25].map(|z| {
            let mut points = vec![1.0; field.nrow * field.ncol];
            points[..5].copy_from_slice(&[0.0, 0.0, 0.0, z, z]);
            Arc::new(vec![points])
        });
        for frame in 0..5 {
            for agent in 0..2 {
                // in double precision alone
                let place = |i: usize| (frame * 10 + agent * 100 + i) as f64 + 1e-12;
                recording.push(&Row {
                    qpos: &(0..spec.nq).map(place).collect::<Vec<f64>>(),
                    numbers: [frame as f32, 1.0, 2.0, 3.0, if frame == 3 { 1.0 } else { 0.0 }],
                    terms: &vec![0.5; spec.reward_terms.len()],
                    action: &vec![0.1 * frame as f32; spec.act],
                    command: &[],
                    grounds: &grounds[usize::from(frame >= 2 && agent == 1)],
                    untimed: frame == 2 && agent == 0,
                });
            }
        }
        Ok(recording)
    }

    #[test]
    fn a_recording_is_read_as_it_was_written() -> Result<(), Box<dyn std::error::Error>> {
        let recording = sample()?;
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("a.replay");
        recording.save(&path)?;
        let read = Recording::load(&path)?;
        assert_eq!(read, recording);
        // the ground of the second agent changes once
        let third = |frame, agent| read.grounds(frame, agent).map(|fields| fields[0][3]);
        assert!(read.untimed(2, 0) && !read.untimed(2, 1) && !read.untimed(3, 0));
        assert_eq!([third(4, 0), third(1, 1), third(2, 1), third(4, 1)], [3.5, 3.5, -0.25, -0.25].map(Some));
        let model = marathon_envs::agent("hopper")?.model()?;
        let pose = |seconds: f64| recording.pose(&model, 1, seconds)[0] - 1e-12;
        assert_eq!((pose(0.0), pose(0.5 * recording.dt), pose(99.0)), (100.0, 105.0, 140.0));
        // frame 3 begins an episode: nothing lies between it and the one before
        assert_eq!(pose(2.5 * recording.dt), 120.0);
        Ok(())
    }

    #[test]
    fn a_recording_of_another_version_is_refused() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("old.replay");
        sample()?.save(&path)?;
        let whole = std::fs::read(&path)?;
        let (_, header) = SafeTensors::read_metadata(&whole)?;
        let read = SafeTensors::deserialize(&whole)?;
        let meta = header.metadata().clone().ok_or("metadata")?;
        let refusal = |about: &Value, without: &str| -> Result<String, Box<dyn std::error::Error>> {
            let tensors = read.tensors().into_iter().filter(|(name, _)| name != without);
            let meta = HashMap::from([(FORMAT.to_string(), about.to_string())]);
            std::fs::write(&path, safetensors::serialize(tensors, Some(meta))?)?;
            Ok(Recording::load(&path).map(|_| ()).expect_err("it is refused").to_string())
        };
        let about: Value = serde_json::from_str(&meta[FORMAT])?;
        let mut unversioned = about.clone();
        unversioned.as_object_mut().ok_or("an object")?.remove("version");
        let error = refusal(&unversioned, "")?;
        assert!(error.ends_with("old.replay: its version is none, expected 1"), "{error}");
        for version in [0, 2] {
            let mut other = about.clone();
            other["version"] = version.into();
            let error = refusal(&other, "")?;
            assert!(error.ends_with(&format!("old.replay: its version is {version}, expected 1")), "{error}");
        }
        for name in ["actions", "commands", "untimed", "lies", "elevations"] {
            let error = refusal(&about, name)?;
            assert!(error.contains("old.replay") && error.contains(name), "{error}");
        }
        Ok(())
    }

    #[test]
    fn what_is_no_recording_is_refused() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("b.replay");
        let whole = {
            sample()?.save(&path)?;
            std::fs::read(&path)?
        };
        let policy = marathon_policies::bytes("hopper.safetensors");
        for bytes in [&b""[..], b"{}", &whole[..whole.len() / 2], policy] {
            std::fs::write(&path, bytes)?;
            let error = Recording::load(&path).map(|_| ()).expect_err("it is no recording").to_string();
            assert!(error.contains("b.replay"), "{error}");
        }
        // grounds that do not fit
        let recording = sample()?;
        let (lies, elevations) = recording.packed();
        assert_eq!(unpacked(&lies, &elevations, &recording).as_ref(), Some(&recording.grounds));
        assert!(unpacked(&lies[..LIE], &elevations, &recording).is_none());
        assert!(unpacked(&lies, &elevations[2..], &recording).is_none());
        for (i, x) in [(0, 9.0), (1, 7.0), (2, 1.0), (3, 1e9)] {
            let mut lies = lies.clone();
            lies[i] = x;
            assert!(unpacked(&lies, &elevations, &recording).is_none(), "{i}");
        }
        for times in [-1.0, 0.0, 1e9, f32::NAN] {
            let mut elevations = elevations.clone();
            elevations[1] = times;
            assert!(unpacked(&lies, &elevations, &recording).is_none(), "{times}");
        }
        Ok(())
    }

    /// A file of a few kilobytes whose grounds declare 16 billion points would need 64 GB.
    #[test]
    fn a_small_file_that_asks_for_much_is_refused() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("c.replay");
        let whole = {
            sample()?.save(&path)?;
            std::fs::read(&path)?
        };
        let (_, header) = SafeTensors::read_metadata(&whole)?;
        let read = SafeTensors::deserialize(&whole)?;
        let changed = |changes: &[(&str, Vec<usize>, Vec<u8>)]| -> Result<String, Box<dyn std::error::Error>> {
            let mut views: HashMap<String, TensorView<'_>> = read.tensors().into_iter().collect();
            for (name, shape, data) in changes {
                let kind = read.tensor(name)?.dtype();
                views.insert((*name).into(), TensorView::new(kind, shape.clone(), data)?);
            }
            std::fs::write(&path, safetensors::serialize(views, header.metadata().clone())?)?;
            Ok(Recording::load(&path).map(|_| ()).expect_err("it is refused").to_string())
        };
        let double = |x: &[f64]| x.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        let single = |x: &[f32]| x.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        let lies: Vec<f64> = (0..4000).flat_map(|i| [0.0, 0.0, f64::from(i), 1.0]).collect();
        let elevations: Vec<f32> = (0..4000).flat_map(|_| [0.0, 4e6]).collect();
        let error =
            changed(&[("lies", vec![4000, LIE], double(&lies)), ("elevations", vec![4000, 2], single(&elevations))])?;
        assert!(error.contains("c.replay: asks for 64 GB; the limit 'memory' is 2 GB"), "{error}");
        // grounds of another size than the model's
        let error = changed(&[
            ("lies", vec![1, LIE], double(&[0.0, 0.0, 0.0, 1.0])),
            ("elevations", vec![1, 2], single(&[0.0, 7.0])),
        ])?;
        assert!(error.contains("has [7] points, expected [2442]"), "{error}");
        let poses = read.tensor("qpos")?;
        let far = [&1e12_f64.to_le_bytes()[..], &poses.data()[8..]].concat();
        let error = changed(&[("qpos", poses.shape().to_vec(), far)])?;
        assert!(error.contains("tensor 'qpos', number 0 is 1000000000000"), "{error}");
        // more characters than the command line allows
        let nothing = |name: &str, columns: usize| {
            let size = read.tensor(name).map_or(0, |tensor| if tensor.dtype() == Dtype::F64 { 8 } else { 4 });
            let shape = if name == "places" { vec![300, columns] } else { vec![1, 300, columns] };
            (vec![0_u8; 300 * columns * size], shape)
        };
        let mut many = Vec::new();
        for name in ["places", "qpos", "numbers", "terms", "actions", "commands", "untimed"] {
            let columns = *read.tensor(name)?.shape().last().ok_or("a shape")?;
            let (data, shape) = nothing(name, columns);
            many.push((name, shape, data));
        }
        let error = changed(&many)?;
        assert!(error.contains("it has 300 agents, expected up to 256"), "{error}");
        Ok(())
    }
}
