//! Checks the output file of a command before the command starts, so that no work is lost at the end.

use crate::error::RunError;
use crate::folder::policy_path;
use crate::text::path_word;
use marathon_learn::AtomicFile;
use std::path::Path;

/// Refuses an output file that cannot be written. Possible reasons: another ending, a missing or read-only folder, a
/// folder of that name, or a file that is also one of the `inputs`. Inputs are files, or folders of runs, which stand
/// for their policies.
///
/// # Errors
/// Names the option `out`, its value and what was expected.
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
        return wrong("which is also an input; expected another file".into());
    }
    let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return wrong(format!("but there is no folder {}; create it, or choose another", path_word(folder)));
    }
    // the folder may be read-only, or the disk full
    AtomicFile::create(out)?;
    Ok(())
}
