//! `progress.csv`: one row of numbers per iteration.

use crate::error::RunError;
use marathon_learn::{IterationStats, Learned, write_atomic};
use marathon_physics::budget;
use std::fs::{File, OpenOptions};
use std::path::{Path, PathBuf};

/// First column, the order of the rows.
const ITERATION: &str = "iteration";
/// Memory of a table's cells per byte of its file. A single comma can be an empty cell.
const CELL_MEMORY: f64 = 16.0;

/// Appends rows. Each row is written to the file at once.
pub struct CsvLog {
    path: PathBuf,
    writer: csv::Writer<File>,
    /// Header and last row of the file when it was opened.
    before: Option<(String, String)>,
}

/// Columns and values of an iteration. A missing value (no episode ended) is an empty cell. `terms` are the reward
/// terms of all roles. Columns of roles other than the first begin with the role's name.
pub fn columns(stats: &IterationStats, steps_per_second: f64, terms: &[String]) -> Vec<(String, Option<f64>)> {
    let IterationStats { learned, others, .. } = stats;
    let about = [
        (ITERATION, Some(stats.iteration as f64)),
        ("steps", Some(stats.steps as f64)),
        ("wall_seconds", Some(stats.wall_seconds)),
        ("cpu_seconds", Some(stats.cpu_seconds)),
        ("steps_per_second", Some(steps_per_second)),
        ("episodes", Some(stats.episodes as f64)),
        ("return_mean", learned.return_mean),
        ("length_mean", stats.length_mean),
        ("speed_mean", stats.speed_mean),
        ("fall_fraction", stats.fall_fraction),
        ("diverged", Some(stats.diverged as f64)),
    ];
    let shares = [("env_share", Some(stats.env_share)), ("update_share", Some(stats.update_share))];
    let skipped = ("skipped_minibatches", Some(learned.skipped_minibatches as f64));
    let first = about.into_iter().chain(of_learning(learned)).chain(shares).chain([skipped]);
    let mut row: Vec<(String, Option<f64>)> = first.map(|(name, x)| (name.to_string(), x)).collect();
    row.extend(learned.signal_rewards.iter().map(|(reward, x)| (format!("{reward}_reward"), Some(*x))));
    for (role, learned) in others {
        let named = [("return_mean", learned.return_mean)].into_iter().chain(of_learning(learned));
        row.extend(named.map(|(name, x)| (format!("{role}/{name}"), x)));
        row.extend(learned.signal_rewards.iter().map(|(reward, x)| (format!("{role}/{reward}_reward"), Some(*x))));
    }
    let all = [learned].into_iter().chain(others.iter().map(|(_, learned)| learned));
    let all = all.flat_map(|learned| &learned.reward_terms);
    row.extend(terms.iter().zip(all).map(|(term, x)| (format!("reward/{term}"), Some(*x))));
    row.extend(stats.metrics.iter().map(|(metric, x)| (format!("metric/{metric}"), Some(*x))));
    row
}

/// Columns of the learner's statistics.
fn of_learning(learned: &Learned) -> [(&'static str, Option<f64>); 8] {
    [
        ("kl", learned.kl),
        ("clip_fraction", learned.clip_fraction),
        ("policy_loss", learned.policy_loss),
        ("value_loss", learned.value_loss),
        ("explained_variance", learned.explained_variance),
        ("entropy", learned.entropy),
        ("std_mean", learned.std_mean),
        ("lr", learned.lr),
    ]
    .map(|(name, x)| (name, Some(x)))
}

impl CsvLog {
    /// Opens the file of a run that has done `iteration` iterations. Later rows are removed.
    ///
    /// # Errors
    /// If the file cannot be read or written.
    pub fn open(path: &Path, iteration: u64) -> Result<Self, RunError> {
        let before = if path.exists() { cut(path, iteration)? } else { None };
        let file = OpenOptions::new().create(true).append(true).open(path).map_err(RunError::io(path, "open"))?;
        Ok(Self { path: path.into(), writer: csv::Writer::from_writer(file), before })
    }

    /// A value of the last row when the file was opened.
    pub fn before(&self, name: &str) -> Option<f64> {
        let (head, last) = self.before.as_ref()?;
        let column = head.split(',').position(|n| n == name)?;
        last.split(',').nth(column)?.parse().ok()
    }

    /// Appends a row, and the header before the first row. An existing file keeps its columns.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn push(&mut self, row: &[(String, Option<f64>)]) -> Result<(), RunError> {
        let head = std::fs::metadata(&self.path).is_ok_and(|m| m.len() == 0);
        let mut write = || {
            if head {
                self.writer.write_record(row.iter().map(|(name, _)| name))?;
            }
            let cell = |x: Option<f64>| x.map_or(String::new(), |x| x.to_string());
            match &self.before {
                None => self.writer.write_record(row.iter().map(|(_, x)| cell(*x)))?,
                Some((head, _)) => {
                    let value = |name| cell(row.iter().find(|(own, _)| own == name).and_then(|(_, x)| *x));
                    self.writer.write_record(head.split(',').map(value))?;
                }
            }
            self.writer.flush().map_err(csv::Error::from)
        };
        write().map_err(|e| failed(&self.path, "write", e))
    }
}

/// Numbers of a finished or running run.
#[derive(Debug, Default)]
pub struct History {
    names: Vec<String>,
    rows: Vec<Vec<Option<f64>>>,
}

impl History {
    /// Reads a file of [`CsvLog`] up to an incomplete row.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn read(path: &Path) -> Result<Self, RunError> {
        let bytes = budget::read(path, &budget::TABLE_FILE).map_err(RunError::io(path, "read"))?;
        let need = budget::MEMORY.check(CELL_MEMORY * bytes.len() as f64);
        need.map_err(|e| RunError::io(path, "read")(e.into()))?;
        let mut reader = csv::Reader::from_reader(&bytes[..]);
        let names = reader.headers().map_err(|e| failed(path, "read", e))?.iter().map(String::from).collect();
        let cell = |x: &str| if x.is_empty() { Some(None) } else { x.parse().ok().map(Some) };
        let whole = reader.records().map_while(|row| row.ok()?.iter().map(cell).collect());
        Ok(Self { names, rows: whole.collect() })
    }
    /// A column by its name, with `None` for empty cells. Empty if there is no such column.
    pub fn column(&self, name: &str) -> Vec<Option<f64>> {
        let Some(i) = self.names.iter().position(|n| n == name) else { return Vec::new() };
        self.rows.iter().map(|row| row[i]).collect()
    }
}

/// Keeps the header and the rows up to an iteration. Also removes an incomplete last row of a killed process. Returns
/// the header and the last row.
fn cut(path: &Path, iteration: u64) -> Result<Option<(String, String)>, RunError> {
    let text = budget::read_to_string(path, &budget::TABLE_FILE).map_err(RunError::io(path, "read"))?;
    let mut kept = String::with_capacity(text.len());
    for (i, line) in text.split_inclusive('\n').enumerate() {
        let number = line.split(',').next().and_then(|cell| cell.parse::<u64>().ok());
        let wanted = if i == 0 { line.starts_with(ITERATION) } else { number.is_some_and(|n| n <= iteration) };
        if !(wanted && line.ends_with('\n')) {
            break;
        }
        kept.push_str(line);
    }
    // appending in place would also change hard-linked copies of the file
    if kept.len() < text.len() || has_other_names(path) {
        write_atomic(path, kept.as_bytes())?
    }
    let mut lines = kept.lines();
    let head = lines.next();
    Ok(head.zip(lines.next_back()).map(|(head, last)| (head.into(), last.into())))
}

/// Whether a file has other names, such as hard-linked copies.
fn has_other_names(path: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        std::fs::metadata(path).is_ok_and(|facts| facts.nlink() > 1)
    }
    #[cfg(not(unix))]
    {
        let _ = path;
        false
    }
}

fn failed(path: &Path, action: &'static str, error: csv::Error) -> RunError {
    match error.into_kind() {
        csv::ErrorKind::Io(source) => RunError::io(path, action)(source),
        other => RunError::file(path, "table", format!("{other:?}"), "rows of equal length"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_after_a_checkpoint_are_cut_and_half_a_row_too() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("progress.csv");
        let row = |i: f64| vec![(ITERATION.to_string(), Some(i)), ("a".into(), (i > 1.0).then_some(0.5 * i))];
        let mut log = CsvLog::open(&path, 0).unwrap();
        (1..=5).for_each(|i| log.push(&row(f64::from(i))).unwrap());
        drop(log);
        let mut log = CsvLog::open(&path, 3).unwrap();
        assert_eq!((log.before("a"), log.before("b")), (Some(1.5), None));
        log.push(&row(4.0)).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "iteration,a\n1,\n2,1\n3,1.5\n4,2\n");
        std::fs::write(&path, "iteration,a\n1,\n2,").unwrap();
        let mut log = CsvLog::open(&path, 9).unwrap();
        assert_eq!((log.before(ITERATION), log.before("a")), (Some(1.0), None));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "iteration,a\n1,\n");
        assert_eq!(History::read(&path).unwrap().column("a"), [None]);
        // a file keeps its columns
        log.push(&[("new".into(), Some(7.0)), ("a".into(), Some(1.0)), (ITERATION.into(), Some(2.0))]).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "iteration,a\n1,\n2,1\n");
    }
}
