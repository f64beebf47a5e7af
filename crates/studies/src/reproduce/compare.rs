//! Comparison of reproduced policies, tables and images with those of the repository.

use crate::error::StudyError;
use marathon_learn::Policy;
use std::path::Path;

/// Cells of a table whose first numbers differ by less than this factor count as equal: times differ on every computer.
const TOLERANCE: f64 = 0.05;

/// Cells that are listed at most.
const LISTED: usize = 6;

/// The outcome of a comparison.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// Nothing changed.
    None,
    /// A description of the differences.
    Some(String),
}

/// Compares the networks of two policies: their weights, the statistics of their observations, and their spread.
///
/// # Errors
/// If one cannot be read.
pub fn policies(new: &Path, old: &Path) -> Result<Change, StudyError> {
    let [new, old] = [Policy::load(new)?, Policy::load(old)?];
    let numbers = |policy: &Policy| {
        let statistics = policy.normalizer();
        [policy.params(), policy.log_std(), statistics.mean(), statistics.std()].concat()
    };
    let (ours, theirs) = (numbers(&new), numbers(&old));
    let same = ours.len() == theirs.len() && ours.iter().zip(&theirs).all(|(a, b)| a.to_bits() == b.to_bits());
    if same {
        return Ok(Change::None);
    }
    let part = |policy: &Policy| match &policy.meta().evaluation {
        Some(eval) => format!("return {:.1} ± {:.1}, {} falls", eval.return_mean, eval.return_std, eval.falls),
        None => "no evaluation".into(),
    };
    Ok(Change::Some(format!("{}, before: {}", part(&new), part(&old))))
}

/// Compares the cells of two tables.
///
/// # Errors
/// If one is not a table.
pub fn tables(new: &Path, old: &Path) -> Result<Change, StudyError> {
    let [new, old] = [read(new)?, read(old)?];
    if new.len() != old.len() || new.iter().zip(&old).any(|(a, b)| a.len() != b.len()) {
        return Ok(Change::Some(format!("{} rows, before: {}", new.len().max(1) - 1, old.len().max(1) - 1)));
    }
    let mut moved = Vec::new();
    for (ours, theirs) in new.iter().zip(&old) {
        for (column, (a, b)) in ours.iter().zip(theirs).enumerate().filter(|(_, (a, b))| !alike(a, b)) {
            let heading = &new[0][column];
            moved.push(format!("{}, {heading}: {a}, before: {b}", ours[0]));
        }
    }
    match moved.len() {
        0 => Ok(Change::None),
        n if n > LISTED => {
            moved.truncate(LISTED);
            Ok(Change::Some(format!("{}; and {} more", moved.join("; "), n - LISTED)))
        }
        _ => Ok(Change::Some(moved.join("; "))),
    }
}

/// Compares the bytes of two files.
///
/// # Errors
/// If one cannot be read.
pub fn images(new: &Path, old: &Path) -> Result<Change, StudyError> {
    let read = |path: &Path| std::fs::read(path).map_err(StudyError::io(path, "read"));
    let same = read(new)? == read(old)?;
    Ok(if same { Change::None } else { Change::Some("other pixels".into()) })
}

fn read(path: &Path) -> Result<Vec<Vec<String>>, StudyError> {
    let bad = |error: csv::Error| StudyError::file(path, "table", error, "comma-separated values");
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_path(path).map_err(bad)?;
    reader.records().map(|row| Ok(row.map_err(bad)?.iter().map(String::from).collect())).collect()
}

/// Whether two cells are equal, or begin with numbers that are close.
fn alike(a: &str, b: &str) -> bool {
    if a == b {
        return true;
    }
    let number = |text: &str| {
        let digits: String = text.chars().filter(|c| *c != ',').collect();
        let end = digits.find(|c: char| !c.is_ascii_digit() && !".-".contains(c)).unwrap_or(digits.len());
        digits[..end].parse::<f64>().ok()
    };
    match (number(a), number(b)) {
        (Some(x), Some(y)) => (x - y).abs() <= TOLERANCE * x.abs().max(y.abs()),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_alike_if_their_numbers_are() {
        assert!(alike("321,422 ± 6985", "325000 ± 10"));
        assert!(alike("no GPU here", "no GPU here"));
        assert!(!alike("100", "110") && !alike("0.31 ± 0.37", "0.25") && !alike("met", "not met") && !alike("-", "5"));
    }

    #[test]
    fn moved_cells_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let [new, old, short] = ["new", "old", "short"].map(|name| folder.path().join(name));
        std::fs::write(&new, "agent,return\nhopper,833.1\nant,500\n").unwrap();
        std::fs::write(&old, "agent,return\nhopper,830\nant,887\n").unwrap();
        std::fs::write(&short, "agent,return\n").unwrap();
        assert_eq!(tables(&new, &new).unwrap(), Change::None);
        assert_eq!(tables(&new, &old).unwrap(), Change::Some("ant, return: 500, before: 887".into()));
        assert_eq!(tables(&new, &short).unwrap(), Change::Some("2 rows, before: 0".into()));
    }

    #[test]
    fn policies_are_equal_whatever_their_metadata() {
        let shipped = |name: &str| {
            Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../assets/policies/{name}.safetensors"))
        };
        let folder = tempfile::tempdir().unwrap();
        let copy = folder.path().join("copy.safetensors");
        let mut policy = Policy::load(&shipped("hopper")).unwrap();
        let evaluation = policy.meta().evaluation.clone().unwrap();
        policy.set_evaluation(marathon_learn::Evaluation { return_mean: 1.0, ..evaluation });
        policy.save(&copy).unwrap();
        assert_eq!(policies(&copy, &shipped("hopper")).unwrap(), Change::None);
        let Change::Some(text) = policies(&copy, &shipped("walker2d")).unwrap() else { panic!("they differ") };
        assert!(text.starts_with("return 1.0 ± ") && text.contains("before: return 1"), "{text}");
    }
}
