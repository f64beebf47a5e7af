//! Files are written completely or not at all: under a temporary name next to their final one, then renamed.

use std::fs::{self, File, OpenOptions};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::RenderError;

/// A file under construction. Without [`commit`](Self::commit), dropping it removes the file.
pub(crate) struct Pending {
    path: PathBuf,
    temporary: PathBuf,
    committed: bool,
}

impl Pending {
    /// Reserves a temporary name in the folder of `path` and creates an empty file there.
    pub fn create(path: &Path) -> Result<(Self, File), RenderError> {
        // two writers of one process must not share a temporary file
        static COUNTER: AtomicU64 = AtomicU64::new(0);
        let unique = COUNTER.fetch_add(1, Ordering::Relaxed);

        if path.file_name().is_none() {
            let source = std::io::Error::new(std::io::ErrorKind::InvalidInput, "the path names no file");
            return Err(RenderError::io(path, "cannot create")(source));
        }
        // not based on the file's own name, which may have the maximum length
        let temporary = path.with_file_name(format!(".marathon-{}-{unique}.tmp", std::process::id()));

        let file = File::create(&temporary).map_err(RenderError::io(path, "cannot create"))?;
        Ok((Self { path: path.to_path_buf(), temporary, committed: false }, file))
    }

    /// Final path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Path to write to.
    pub fn temporary(&self) -> &Path {
        &self.temporary
    }

    /// Gives the finished file its final name and replaces an older file. Pending writes must succeed first.
    pub fn commit(&mut self) -> Result<(), RenderError> {
        let synced = OpenOptions::new().write(true).open(&self.temporary).and_then(|file| file.sync_all());
        synced.map_err(RenderError::io(&self.path, "cannot write"))?;
        fs::rename(&self.temporary, &self.path).map_err(RenderError::io(&self.path, "cannot rename into place"))?;
        self.committed = true;
        Ok(())
    }
}

impl Drop for Pending {
    fn drop(&mut self) {
        if !self.committed {
            // the caller already has the error that led here
            let _ = fs::remove_file(&self.temporary);
        }
    }
}
