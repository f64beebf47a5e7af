//! The file that a command is to write, looked at before its work begins: work that cannot be kept is not worth doing.

use crate::error::RunError;
use crate::folder::policy_path;
use crate::text::path_word;
use marathon_learn::AtomicFile;
use std::path::Path;

/// Refuses a file that cannot be written: one with another ending, in no folder, in one that takes no files, a folder itself,
/// or one of the `inputs` (files, or folders of runs, whose policies are kept).
///
/// # Errors
/// Names the option `out`, what it is and what was expected.
pub fn check<P: AsRef<Path>>(out: &Path, endings: &[&str], inputs: &[P]) -> Result<(), RunError> {
    let wrong = |problem: String| Err(RunError::option("out", format!("is {}, {problem}", path_word(out))));
    let ending = out.extension().unwrap_or_default();
    if !endings.iter().any(|known| ending.eq_ignore_ascii_case(known)) {
        let known: Vec<String> = endings.iter().map(|known| format!(".{known}")).collect();
        return wrong(format!("expected a name that ends with {}", known.join(" or ")));
    }
    if out.is_dir() {
        return wrong("a folder; expected a file".into());
    }
    let file = |input: &Path| policy_path(input).unwrap_or_else(|_| input.into()).canonicalize().ok();
    if let Ok(old) = out.canonicalize()
        && inputs.iter().any(|input| file(input.as_ref()).as_ref() == Some(&old))
    {
        return wrong("a file that is read; expected another".into());
    }
    let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return wrong(format!("but there is no folder {}; make it, or choose another", path_word(folder)));
    }
    // a folder may refuse files, and a disk may be full
    AtomicFile::create(out)?;
    Ok(())
}
