//! The sources of a crate, parsed, without its unit tests and programs under `bin`.

use crate::Error;
use std::path::{Path, PathBuf};

/// The sources of a crate without its unit tests.
pub struct Sources {
    /// In the order of their paths.
    pub files: Vec<Source>,
}

/// One source.
pub struct Source {
    /// Below `src`.
    pub path: PathBuf,
    /// Names from the root of the crate; none for the root itself.
    pub module: Vec<String>,
    /// Number of lines.
    pub lines: usize,
    /// Syntax tree from the parser.
    pub syntax: syn::File,
}

impl Sources {
    /// Reads the folder `src`.
    ///
    /// # Errors
    /// If a source cannot be read or is not Rust.
    pub fn read(src: &Path) -> Result<Sources, Error> {
        let mut files = Vec::new();
        read_folder(src, src, &mut files)?;
        files.sort_by(|a, b| a.path.cmp(&b.path));
        Ok(Sources { files })
    }
}

impl Source {
    /// The top-level module that the source belongs to; for the root of the crate, the name of its file.
    pub fn room(&self) -> String {
        let root = || self.path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        self.module.first().cloned().unwrap_or_else(root)
    }
}

/// Whether an item is compiled for unit tests only.
pub fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes
        .iter()
        .any(|a| a.path().is_ident("cfg") && a.parse_args::<syn::Path>().is_ok_and(|path| path.is_ident("test")))
}

fn read_folder(src: &Path, folder: &Path, files: &mut Vec<Source>) -> Result<(), Error> {
    let io = |path: &Path| {
        let path = path.to_path_buf();
        move |source| Error::Io { path, source }
    };
    for entry in std::fs::read_dir(folder).map_err(io(folder))? {
        let path = entry.map_err(io(folder))?.path();
        if path.file_stem().is_some_and(|stem| stem == "tests") {
            continue;
        }
        if path.is_dir() {
            read_folder(src, &path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = std::fs::read_to_string(&path).map_err(io(&path))?;
            let syntax = syn::parse_file(&text).map_err(|e| Error::Syntax {
                path: path.clone(),
                line: e.span().start().line,
                message: e.to_string(),
            })?;
            let below = path.strip_prefix(src).expect("a file below the folder").to_path_buf();
            let mut module: Vec<String> =
                below.with_extension("").iter().map(|part| part.to_string_lossy().into_owned()).collect();
            let last = module.last().cloned().unwrap_or_default();
            // programs of a crate use it from outside
            if module[0] == "bin" {
                continue;
            }
            if last == "mod" || module.len() == 1 && (last == "lib" || last == "main") {
                module.pop();
            }
            files.push(Source { path: below, module, lines: text.lines().count(), syntax });
        }
    }
    Ok(())
}
