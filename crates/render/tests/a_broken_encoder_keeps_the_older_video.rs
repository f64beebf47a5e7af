//! A video that cannot be written completely is an error, and the older video of that name stays. Causes are a full disk,
//! or an encoder that reports success but writes no valid video.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::Folder;
use marathon_render::{Image, Mp4Writer, Recorder, RenderError};

/// A frame that encoders cannot compress well.
fn noise(seed: usize) -> Image {
    let mut state = 0x9e37_79b9_u32 ^ seed as u32;
    let rgb = (0..3 * 160 * 120).map(|_| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    });
    Image::from_rgb(160, 120, rgb.collect()).unwrap()
}

fn record(path: &Path, frames: usize) -> Result<(), RenderError> {
    let mut recorder = Recorder::create(path, 25.0, 8)?;
    for i in 0..frames {
        recorder.push(&noise(i))?;
    }
    recorder.finish()
}

/// A replacement for ffmpeg. It reads all frames, runs `body` with the output file as `$last`, and reports success.
#[cfg(unix)]
fn stand_in(folder: &Folder, body: &str) -> String {
    use std::os::unix::fs::PermissionsExt;
    let path = folder.path("encoder.sh");
    let listing = "case \"$*\" in *-encoders*) echo ' V....D libx264 H.264'; exit 0;; esac";
    let text = format!("#!/bin/sh\n{listing}\nfor last; do :; done\ncat > /dev/null\n{body}\nexit 0\n");
    std::fs::write(&path, text).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    // another test's fork may briefly keep the file open for writing
    std::thread::sleep(std::time::Duration::from_millis(50));
    path.display().to_string()
}

#[cfg(unix)]
#[test]
fn an_encoder_that_reports_success_is_not_believed() {
    for (body, problem) in [
        (":", "its part 'ftyp' is missing"),
        ("printf '\\0\\0\\0\\014ftypisom\\0\\0\\0\\100mdatdata' > \"$last\"", "it is cut short"),
        ("printf '\\0\\0\\0\\014ftypisom\\0\\0\\0\\014mdatdata' > \"$last\"", "its part 'moov' is missing"),
        ("rm \"$last\"; echo 'No space left on device' >&2", "No space left on device"),
    ] {
        let folder = Folder::new("success");
        std::fs::write(folder.path("run.mp4"), "older video").unwrap();
        let mut writer = Mp4Writer::with_program(folder.path("run.mp4"), 25.0, &stand_in(&folder, body)).unwrap();
        writer.push(&noise(0)).unwrap();
        let error = writer.finish().unwrap_err().to_string();
        assert!(error.contains("run.mp4") && error.contains(problem), "{body}: {error}");
        assert_eq!(std::fs::read(folder.path("run.mp4")).unwrap(), b"older video");
        assert_eq!(folder.names(), ["encoder.sh", "run.mp4"]);
    }
}

/// A separate file system in memory.
struct Disk(PathBuf);

impl Disk {
    /// A disk of this size, or the reason why it cannot be mounted.
    fn new(folder: &Folder, kilobytes: usize) -> Result<Disk, String> {
        let path = folder.path("disk");
        std::fs::create_dir(&path).unwrap();
        let size = format!("size={kilobytes}k");
        let mount = Command::new("mount").args(["-t", "tmpfs", "-o", &size, "tmpfs"]).arg(&path).output();
        match mount {
            Ok(output) if output.status.success() => Ok(Disk(path)),
            Ok(output) => Err(String::from_utf8_lossy(&output.stderr).trim().to_owned()),
            Err(error) => Err(error.to_string()),
        }
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

/// The test needs permission to mount a file system, which CI has.
#[test]
fn a_full_disk_is_an_error_and_keeps_the_older_file() {
    let folder = Folder::new("full-disk");
    // videos smaller than the encoder's buffers fail only at the end
    let disk = match Disk::new(&folder, 64) {
        Ok(disk) => disk,
        Err(reason) => return println!("skipped: no file system can be mounted here: {reason}"),
    };
    let encoder = Command::new("ffmpeg").arg("-version").output().is_ok();
    for (name, frames) in [("run.png", 6), ("run.gif", 2), ("run.gif", 40), ("run.mp4", 2), ("run.mp4", 60)] {
        if name == "run.mp4" && !encoder {
            println!("skipped: {name}: there is no ffmpeg");
            continue;
        }
        let path = disk.0.join(name);
        // only 8 kB are free
        std::fs::write(&path, "older video").unwrap();
        std::fs::write(disk.0.join("others"), vec![1; 52 * 1024]).unwrap();
        let error = record(&path, frames).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains("o space left on device"), "{name}, {frames} frames: {error}");
        assert_eq!(std::fs::read(&path).unwrap(), b"older video", "{name}, {frames} frames");
        let names: Vec<_> = std::fs::read_dir(&disk.0).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(names.len(), 2, "{name}, {frames} frames: {names:?}");

        // with free space, the same video is written
        std::fs::remove_file(disk.0.join("others")).unwrap();
        std::fs::remove_file(&path).unwrap();
        record(&folder.path(name), frames).unwrap();
    }
}
