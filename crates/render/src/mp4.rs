//! MP4 files through an `ffmpeg` process that receives raw pixels.

use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Child, ChildStderr, Command, Stdio};
use std::thread::JoinHandle;

use crate::atomic::Pending;
use crate::boxes;
use crate::error::RenderError;
use crate::image::{Image, same_size};

const FPS: [f64; 2] = [0.1, 1000.0];
/// H.264 encoders in order of preference. Builds of ffmpeg differ in their encoders; every build has the last one.
const ENCODERS: [&[&str]; 4] = [
    &["libx264", "-crf", "18", "-preset", "medium"],
    &["libopenh264", "-b:v", "6M"],
    &["h264_videotoolbox", "-b:v", "6M"],
    &["mpeg4", "-q:v", "3"],
];

/// Writes an MP4 file frame by frame.
pub struct Mp4Writer {
    pending: Pending,
    program: String,
    fps: f64,
    running: Option<Running>,
    count: usize,
    size: [usize; 2],
}

struct Running {
    child: Child,
    words: JoinHandle<String>,
}

impl Mp4Writer {
    /// Starts a video with the `ffmpeg` on the search path. The file appears under its name only at
    /// [`finish`](Self::finish).
    ///
    /// # Errors
    /// [`RenderError::NoFfmpeg`] when the program is missing, [`RenderError::Fps`], [`RenderError::Io`].
    pub fn create(path: impl AsRef<Path>, fps: f64) -> Result<Self, RenderError> {
        Self::with_program(path, fps, "ffmpeg")
    }

    /// Like [`create`](Self::create), with another program that takes ffmpeg's arguments, such as an absolute path to
    /// it.
    ///
    /// # Errors
    /// As [`create`](Self::create).
    pub fn with_program(path: impl AsRef<Path>, fps: f64, program: &str) -> Result<Self, RenderError> {
        let path = path.as_ref();
        let [min, max] = FPS;
        if !(min..=max).contains(&fps) {
            return Err(RenderError::Fps { path: path.to_path_buf(), fps, min, max });
        }
        // check that the program exists before anything is rendered
        encoders(path, program)?;
        let (pending, _) = Pending::create(path)?;
        Ok(Self { pending, program: program.into(), fps, running: None, count: 0, size: [0; 2] })
    }

    /// Appends a frame.
    ///
    /// # Errors
    /// [`RenderError::FrameSize`], [`RenderError::Ffmpeg`], [`RenderError::Io`].
    pub fn push(&mut self, frame: &Image) -> Result<(), RenderError> {
        if self.count == 0 {
            self.size = [frame.width(), frame.height()];
            self.running = Some(self.start()?);
        }
        same_size(self.count, frame, self.size)?;
        self.count += 1;

        let sink = self.running.as_mut().and_then(|running| running.child.stdin.as_mut());
        match sink.map(|sink| sink.write_all(frame.rgb())) {
            Some(Ok(())) => Ok(()),
            // a closed pipe means that ffmpeg failed: its stderr has the reason
            Some(Err(error)) if error.kind() == std::io::ErrorKind::BrokenPipe => {
                let words = self.wait()?;
                Err(self.failed("it stopped reading frames".into(), words))
            }
            Some(Err(error)) => Err(RenderError::io(self.pending.path(), "cannot send frames to ffmpeg")(error)),
            None => self.wait().map(|_| ()),
        }
    }

    /// Waits for the encoder, checks that the video is complete and gives the file its final name.
    ///
    /// # Errors
    /// [`RenderError::NoFrames`], [`RenderError::Ffmpeg`], [`RenderError::Io`].
    pub fn finish(mut self) -> Result<(), RenderError> {
        if self.count == 0 {
            return Err(RenderError::NoFrames { what: self.pending.path().display().to_string() });
        }
        let words = self.wait()?;
        let whole = File::open(self.pending.temporary()).and_then(|mut file| boxes::check(&mut file, self.count));
        match whole {
            Ok(()) => self.pending.commit(),
            // on a full disk, ffmpeg may exit with success and report the error only on stderr
            Err(problem) => Err(self.failed(format!("the video is incomplete: {problem}"), words)),
        }
    }

    fn start(&self) -> Result<Running, RenderError> {
        let path = self.pending.path();
        let known = encoders(path, &self.program)?;
        let encoder = ENCODERS.iter().find(|encoder| known.iter().any(|name| name == encoder[0]));
        let encoder = encoder.unwrap_or(&ENCODERS[ENCODERS.len() - 1]);

        let [width, height] = self.size;
        let mut child = Command::new(&self.program)
            // stop at the first error; by default ffmpeg continues after a failed write
            .args(["-hide_banner", "-loglevel", "error", "-xerror", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s"])
            .arg(format!("{width}x{height}"))
            .args(["-r", &self.fps.to_string(), "-i", "-", "-c:v"])
            .args(*encoder)
            // players need 4:2:0, which needs even sides
            .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"])
            .args(["-movflags", "+faststart", "-f", "mp4"])
            .arg(self.pending.temporary())
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|error| missing(path, &self.program, error))?;
        // read on a thread: a full pipe would block the encoder, and it us
        let stderr = child.stderr.take();
        Ok(Running { child, words: std::thread::spawn(move || last_words(stderr)) })
    }

    /// Closes the pipe and waits for a successful exit. Returns the process's stderr.
    fn wait(&mut self) -> Result<String, RenderError> {
        let Some(mut running) = self.running.take() else {
            return Err(self.failed("it had already ended".into(), String::new()));
        };
        drop(running.child.stdin.take());
        let status = running.child.wait().map_err(RenderError::io(self.pending.path(), "cannot wait for ffmpeg"))?;
        let words = running.words.join().unwrap_or_default();
        if status.success() { Ok(words) } else { Err(self.failed(status.to_string(), words)) }
    }

    fn failed(&self, status: String, stderr: String) -> RenderError {
        let path = self.pending.path().to_path_buf();
        RenderError::Ffmpeg { path, program: self.program.clone(), status, stderr }
    }
}

impl Drop for Mp4Writer {
    fn drop(&mut self) {
        if let Some(mut running) = self.running.take() {
            // the video was abandoned
            let _ = running.child.kill();
            let _ = running.child.wait();
        }
    }
}

/// Names of the video encoders of the program. Fails if the program is missing.
fn encoders(path: &Path, program: &str) -> Result<Vec<String>, RenderError> {
    let output = Command::new(program)
        .args(["-hide_banner", "-encoders"])
        .stdin(Stdio::null())
        .output()
        .map_err(|error| missing(path, program, error))?;
    let listing = String::from_utf8_lossy(&output.stdout);
    // lines read " V....D libx264   libx264 H.264 / AVC ..."
    Ok(listing.lines().filter_map(|line| line.split_whitespace().nth(1)).map(str::to_owned).collect())
}

fn missing(path: &Path, program: &str, error: std::io::Error) -> RenderError {
    match error.kind() {
        std::io::ErrorKind::NotFound => RenderError::NoFfmpeg { path: path.to_path_buf(), program: program.into() },
        _ => RenderError::io(path, "cannot run ffmpeg")(error),
    }
}

/// The end of what the process wrote to stderr.
fn last_words(stderr: Option<ChildStderr>) -> String {
    let mut bytes = Vec::new();
    if let Some(mut stderr) = stderr {
        let _ = stderr.read_to_end(&mut bytes);
    }
    let text = String::from_utf8_lossy(&bytes);
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
    lines[lines.len().saturating_sub(6)..].join("; ")
}
