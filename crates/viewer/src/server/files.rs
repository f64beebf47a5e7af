//! The files of the page.

use super::error::ViewerError;
use super::http;
use std::fs::File;
use std::io::{Result, Write};
use std::path::{Component, Path, PathBuf};

/// Environment variable with the folder of the page.
pub const PAGE_VARIABLE: &str = "MARATHON_PAGE";

/// Finds the folder of the page. A given folder counts first, then the environment variable `MARATHON_PAGE`. Without them, it
/// is `page` beside the program, `share/marathon/page` above its folder, or `web/dist` in the present folder.
///
/// # Errors
/// If it is in none of them.
pub fn find_page(given: Option<&Path>) -> std::result::Result<PathBuf, ViewerError> {
    if let Some(folder) = given.map(Path::to_path_buf).or_else(|| std::env::var_os(PAGE_VARIABLE).map(PathBuf::from)) {
        return check(&folder);
    }
    let program = std::env::current_exe().and_then(|path| path.canonicalize()).unwrap_or_default();
    let beside = program.parent().map(|folder| folder.join("page"));
    let shared = program.parent().and_then(Path::parent).map(|folder| folder.join("share/marathon/page"));
    let places: Vec<_> = [beside, shared, Some("web/dist".into())].into_iter().flatten().collect();
    let tried = || places.iter().map(|place| place.display().to_string()).collect::<Vec<_>>().join(", ");
    places.iter().find_map(|place| check(place).ok()).ok_or_else(|| ViewerError::NotFound { tried: tried() })
}

/// The full path of a folder with the page.
pub(super) fn check(folder: &Path) -> std::result::Result<PathBuf, ViewerError> {
    let missing = || ViewerError::NoPage(folder.into());
    let whole = folder.canonicalize().map_err(|_| missing())?;
    if whole.join("index.html").is_file() { Ok(whole) } else { Err(missing()) }
}

/// Sends a file.
pub(super) fn answer(stream: &mut impl Write, page: &Path, path: &str) -> Result<()> {
    let Some((mut file, path)) = open(page, path) else {
        return http::refuse(stream, "404 Not Found", "There is no such file.");
    };
    http::begin(stream, kind(&path), Some(file.metadata()?.len()))?;
    std::io::copy(&mut file, stream).map(drop)
}

/// Opens a file inside the folder; links do not lead out of it.
fn open(page: &Path, path: &str) -> Option<(File, PathBuf)> {
    let inside = Path::new(path.strip_prefix('/')?);
    if !inside.components().all(|part| matches!(part, Component::Normal(_))) {
        return None;
    }
    let name = if inside.as_os_str().is_empty() { Path::new("index.html") } else { inside };
    let whole = page.join(name).canonicalize().ok()?;
    if !whole.starts_with(page) || !whole.is_file() {
        return None;
    }
    Some((File::open(&whole).ok()?, whole))
}

/// The type of a file by its ending.
fn kind(path: &Path) -> &'static str {
    match path.extension().and_then(|end| end.to_str()).unwrap_or_default() {
        "html" => "text/html; charset=utf-8",
        "js" => "text/javascript",
        "css" => "text/css",
        "json" => "application/json",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        "wasm" => "application/wasm",
        "xml" => "application/xml",
        "glb" => "model/gltf-binary",
        _ => "application/octet-stream",
    }
}
