//! The table of the longest runs: a SQLite database in the user's folder for data, with the best replays beside it.

use crate::app::error::{GameError, printable_line};
use crate::app::stage::recording::Recording;
use etcetera::BaseStrategy;
use marathon_physics::budget;
use rusqlite::{Connection, ErrorCode, OpenFlags, OptionalExtension, Transaction, named_params};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Version of the tables, which SQLite keeps as `user_version`.
const VERSION: i64 = 1;
/// Runs of a course that keep their replays.
pub const KEPT: usize = 10;
/// Runs of a course that stay in the table, besides the shortest.
pub const ROWS: usize = 100;
/// Longest time that another game may write to it.
const PATIENCE: Duration = Duration::from_secs(3);

const SCHEMA: &str = "
CREATE TABLE runs (
    id INTEGER PRIMARY KEY,
    agent TEXT NOT NULL,
    course TEXT NOT NULL,
    difficulty REAL NOT NULL,
    part TEXT NOT NULL,
    options TEXT NOT NULL,
    seed INTEGER NOT NULL,
    number INTEGER NOT NULL,
    episode INTEGER NOT NULL,
    runner TEXT NOT NULL,
    builder TEXT NOT NULL,
    distance REAL NOT NULL,
    seconds REAL NOT NULL,
    slowest REAL NOT NULL,
    ended TEXT NOT NULL,
    date TEXT NOT NULL,
    version TEXT NOT NULL,
    replay TEXT,
    UNIQUE (agent, course, difficulty, part, options, seed, number, episode, runner, builder, distance, seconds)
) STRICT;
CREATE INDEX longest ON runs (agent, course, difficulty, part, distance DESC);
";

/// The course of a run. Runs on the same course are compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Course {
    /// Registry name of the agent.
    pub agent: String,
    /// The kind of the ground.
    pub kind: String,
    /// Difficulty, 0 to 1.
    pub difficulty: f64,
    /// The player's role: `watch`, `run` or `build`.
    pub role: String,
}

/// A run that has ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// The course.
    pub course: Course,
    /// All arguments of the task, as text.
    pub options: String,
    /// Seed, number of the agent under it, and of its episode: what the start and the course are drawn from.
    pub draw: [u64; 3],
    /// The runner: a policy with its checksum, or a player.
    pub runner: String,
    /// The builder of the course: the same, or `seed`.
    pub builder: String,
    /// Largest distance, m.
    pub distance: f64,
    /// Duration, s.
    pub seconds: f64,
    /// The slowest time factor of the run; 1 is real time.
    pub slowest: f64,
    /// The reason of its end.
    pub ended: String,
    /// Date and time of the end, UTC; the table writes it.
    pub date: String,
    /// Version of the game; the table writes it.
    pub version: String,
    /// Its replay, if it is one of the best.
    pub replay: Option<PathBuf>,
}

/// The place of a run among the others on its course.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// 1 for the longest.
    pub rank: usize,
    /// Number of runs.
    pub of: usize,
    /// The longest and the shortest, m.
    pub longest: f64,
    /// See there.
    pub shortest: f64,
    /// The shortest time of a run through the whole course, s.
    pub fastest: Option<f64>,
}

/// The table of the longest runs.
pub struct Table {
    connection: Connection,
    path: PathBuf,
}

/// The default path of the table.
///
/// # Errors
/// If the system names no folder for a user's data.
pub fn default_path() -> Result<PathBuf, GameError> {
    let folder = etcetera::base_strategy::choose_native_strategy().map(|strategy| strategy.data_dir());
    let folder =
        folder.map_err(|e| GameError::System(format!("{e}; --table FILE names a table of the longest runs")))?;
    Ok(folder.join("marathon/runs.sqlite"))
}

/// Path of a replay in the table's folder. `None` if the name leads to another folder, as it may in an untrusted table.
fn within(folder: &Path, name: &str) -> Option<PathBuf> {
    (Path::new(name).file_name() == Some(name.as_ref())).then(|| folder.join(name))
}

/// The error of a table, with a remedy.
fn wrong(path: &Path, error: &rusqlite::Error) -> GameError {
    let remedy = "move it away, and a new one begins, or name another: --table FILE";
    let problem = match error.sqlite_error_code() {
        Some(ErrorCode::NotADatabase) => format!("not a table of runs, which is a SQLite database; {remedy}"),
        Some(ErrorCode::DatabaseCorrupt) => format!("the database is damaged ({error}); {remedy}"),
        Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => {
            "another program has locked it; end that, or name another table: --table FILE".into()
        }
        Some(ErrorCode::ReadOnly | ErrorCode::PermissionDenied | ErrorCode::CannotOpen) => {
            format!("it cannot be written ({error}); name a file that can: --table FILE")
        }
        _ => format!("{error}; {remedy}"),
    };
    GameError::Table { path: path.into(), problem }
}

impl Table {
    /// The table of a file, which is made if it is not there.
    ///
    /// # Errors
    /// If the file is no table, a later version's, damaged, or cannot be written. The text names the remedy.
    pub fn open(path: &Path) -> Result<Self, GameError> {
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|source| GameError::Write { path: path.into(), source })?;
        }
        Self::connect(path, OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_CREATE)
    }

    fn connect(path: &Path, flags: OpenFlags) -> Result<Self, GameError> {
        let refuse = |problem: String| Err(GameError::Table { path: path.into(), problem });
        if let Ok(facts) = std::fs::metadata(path) {
            if !facts.is_file() {
                return refuse("found a folder or a device, expected a file; name another: --table FILE".into());
            }
            if let Err(error) = budget::TABLE_FILE.check(facts.len() as f64) {
                return refuse(format!("{error}, or name another file: --table FILE"));
            }
        }
        let wrong = |error: rusqlite::Error| wrong(path, &error);
        let mut connection = Connection::open_with_flags(path, flags).map_err(wrong)?;
        connection.busy_timeout(PATIENCE).map_err(wrong)?;
        let found: i64 = connection.query_row("PRAGMA user_version", [], |row| row.get(0)).map_err(wrong)?;
        match found {
            VERSION => {}
            0 => {
                let begun = connection.transaction_with_behavior(rusqlite::TransactionBehavior::Immediate);
                let begun = begun.map_err(wrong)?;
                // another game may have been faster
                let known: i64 = begun.query_row("PRAGMA user_version", [], |row| row.get(0)).map_err(wrong)?;
                let others: i64 =
                    begun.query_row("SELECT count(*) FROM sqlite_schema", [], |row| row.get(0)).map_err(wrong)?;
                if known == 0 && others > 0 {
                    return refuse("a database of another program; name another file: --table FILE".into());
                }
                if known == 0 {
                    begun.execute_batch(SCHEMA).map_err(wrong)?;
                    begun.pragma_update(None, "user_version", VERSION).map_err(wrong)?;
                }
                begun.commit().map_err(wrong)?;
            }
            _ => {
                let remedy = "take that version, or name another file: --table FILE";
                return refuse(format!(
                    "a later version of the game wrote it: its tables have version {found}, this one knows {VERSION}; {remedy}"
                ));
            }
        }
        // a view in an untrusted table may never end, and a trigger may change data
        let programs = "SELECT count(*) FROM sqlite_schema WHERE type IN ('view', 'trigger')";
        let programs: i64 = connection.query_row(programs, [], |row| row.get(0)).map_err(wrong)?;
        if programs > 0 {
            return refuse(
                "it has views or triggers, which a table of runs has not; name another: --table FILE".into(),
            );
        }
        Ok(Table { connection, path: path.into() })
    }

    /// Folder of the replays.
    fn folder(&self) -> PathBuf {
        let stem = self.path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        self.path.with_file_name(format!("{stem}-replays"))
    }

    fn wrong(&self, error: &rusqlite::Error) -> GameError {
        wrong(&self.path, error)
    }

    /// Adds a run, its replay too if it is one of the best, and takes away what has become one too many. A run that is known
    /// already, to the bit, is not added again.
    ///
    /// # Errors
    /// If something cannot be written; the table is then as before.
    pub fn add(&mut self, run: &Run, recording: &Recording) -> Result<Place, GameError> {
        let folder = self.folder();
        let path = self.path.clone();
        let wrong = |error: rusqlite::Error| wrong(&path, &error);
        let begun = self.connection.transaction_with_behavior(rusqlite::TransactionBehavior::Immediate);
        let begun = begun.map_err(wrong)?;
        let id = insert(&begun, run).map_err(wrong)?;
        let place = place(&begun, &run.course, run.distance).map_err(wrong)?;
        let mut file = None;
        if let Some(id) = id.filter(|_| place.rank <= KEPT) {
            std::fs::create_dir_all(&folder).map_err(|source| GameError::Write { path: folder.clone(), source })?;
            // names of lost tables may be there
            let names = (0..).map(|i| if i == 0 { format!("run-{id}.replay") } else { format!("run-{id}-{i}.replay") });
            let name = names.into_iter().find(|name| !folder.join(name).exists()).unwrap_or_default();
            recording.save(&folder.join(&name))?;
            file = Some(folder.join(&name));
            begun.execute("UPDATE runs SET replay = ?1 WHERE id = ?2", (&name, id)).map_err(wrong)?;
        }
        let pruned = prune(&begun, &run.course).and_then(|gone| begun.commit().map(|()| gone));
        match pruned {
            Ok(gone) => {
                for replay in gone.iter().filter_map(|name| within(&folder, name)) {
                    // a file that stays takes room, no more
                    let _ = std::fs::remove_file(replay);
                }
                Ok(place)
            }
            Err(error) => {
                file.iter().for_each(|file| drop(std::fs::remove_file(file)));
                Err(wrong(error))
            }
        }
    }

    /// The place of a distance on a course, m. An infinite distance yields the present record. `None` without runs.
    ///
    /// # Errors
    /// If the table cannot be read.
    pub fn place(&self, course: &Course, distance: f64) -> Result<Option<Place>, GameError> {
        let found = place(&self.connection, course, distance).map_err(|error| self.wrong(&error))?;
        Ok(Some(found).filter(|place| place.of > 0))
    }

    /// The longest runs of a course, the longest first.
    ///
    /// # Errors
    /// If the table cannot be read.
    pub fn longest(&self, course: &Course, most: usize) -> Result<Vec<Run>, GameError> {
        let read = || -> rusqlite::Result<Vec<_>> {
            // a stranger's table may hold texts of any length, and the screen shows all of them in every frame
            let mut query = self.connection.prepare(
                "SELECT options, seed, number, episode, substr(runner, 1, 100), substr(builder, 1, 100), distance, seconds,
                        slowest, substr(ended, 1, 100), substr(date, 1, 100), substr(version, 1, 100), replay
                 FROM runs WHERE agent = :agent AND course = :kind AND difficulty = :difficulty AND part = :part
                 ORDER BY distance DESC, id LIMIT :most",
            )?;
            let folder = self.folder();
            let Course { agent, kind, difficulty, role } = course;
            let of = named_params! { ":agent": agent, ":kind": kind, ":difficulty": difficulty, ":part": role, ":most": most as i64 };
            let rows = query.query_map(of, |row| {
                let draw = [row.get::<_, i64>(1)?, row.get(2)?, row.get(3)?].map(|x| x as u64);
                Ok(Run {
                    course: course.clone(),
                    options: row.get(0)?,
                    draw,
                    runner: row.get(4)?,
                    builder: row.get(5)?,
                    distance: row.get(6)?,
                    seconds: row.get(7)?,
                    slowest: row.get(8)?,
                    ended: row.get(9)?,
                    date: row.get(10)?,
                    version: row.get(11)?,
                    replay: row.get::<_, Option<String>>(12)?.and_then(|name| within(&folder, &name)),
                })
            })?;
            rows.collect()
        };
        read().map_err(|error| self.wrong(&error))
    }

    /// The courses of all runs, in alphabetical order.
    ///
    /// # Errors
    /// If the table cannot be read.
    pub fn courses(&self) -> Result<Vec<Course>, GameError> {
        let read = || -> rusqlite::Result<Vec<_>> {
            let mut query = self.connection.prepare(
                "SELECT DISTINCT agent, course, difficulty, part FROM runs ORDER BY agent, course, difficulty, part",
            )?;
            let rows = query.query_map([], |row| {
                Ok(Course { agent: row.get(0)?, kind: row.get(1)?, difficulty: row.get(2)?, role: row.get(3)? })
            })?;
            rows.collect()
        };
        read().map_err(|error| self.wrong(&error))
    }
}

/// Adds a row; none, if it is there already.
fn insert(begun: &Transaction<'_>, run: &Run) -> rusqlite::Result<Option<i64>> {
    let Run { course: Course { agent, kind, difficulty, role }, draw, .. } = run;
    let [seed, number, episode] = draw.map(|x| x as i64);
    let query =
        "INSERT OR IGNORE INTO runs (agent, course, difficulty, part, options, seed, number, episode, runner, builder,
         distance, seconds, slowest, ended, date, version)
         VALUES (:agent, :kind, :difficulty, :part, :options, :seed, :number, :episode, :runner, :builder,
         :distance, :seconds, :slowest, :ended, strftime('%Y-%m-%dT%H:%M:%SZ', 'now'), :version) RETURNING id";
    let row = named_params! {
        ":agent": agent, ":kind": kind, ":difficulty": difficulty, ":part": role, ":options": run.options, ":seed": seed,
        ":number": number, ":episode": episode, ":runner": run.runner, ":builder": run.builder, ":distance": run.distance,
        ":seconds": run.seconds, ":slowest": run.slowest, ":ended": run.ended, ":version": env!("CARGO_PKG_VERSION"),
    };
    begun.query_row(query, row, |row| row.get(0)).optional()
}

fn place(connection: &Connection, course: &Course, distance: f64) -> rusqlite::Result<Place> {
    let query = "SELECT count(*) FILTER (WHERE distance > :distance) + 1, count(*), max(distance), min(distance),
                min(seconds) FILTER (WHERE ended = 'through') FROM runs
         WHERE agent = :agent AND course = :kind AND difficulty = :difficulty AND part = :part";
    let Course { agent, kind, difficulty, role } = course;
    let of = named_params! {
        ":distance": distance, ":agent": agent, ":kind": kind, ":difficulty": difficulty, ":part": role
    };
    connection.query_row(query, of, |row| {
        let [rank, count] = [row.get::<_, i64>(0)?, row.get(1)?].map(|x| x as usize);
        let [longest, shortest] = [row.get::<_, Option<f64>>(2)?, row.get(3)?].map(Option::unwrap_or_default);
        Ok(Place { rank, of: count, longest, shortest, fastest: row.get(4)? })
    })
}

/// Takes away rows and replays beyond those that are kept. Returns the names of the files that are no longer needed.
fn prune(begun: &Transaction<'_>, course: &Course) -> rusqlite::Result<Vec<String>> {
    let Course { agent, kind, difficulty, role } = course;
    let of = |beyond: usize| (agent, kind, difficulty, role, beyond as i64);
    const BEYOND: &str = "(SELECT id FROM runs WHERE agent = ?1 AND course = ?2 AND difficulty = ?3 AND part = ?4
         ORDER BY distance DESC, id LIMIT -1 OFFSET ?5)";
    let files = format!("SELECT replay FROM runs WHERE replay IS NOT NULL AND id IN {BEYOND}");
    let gone = begun.prepare(&files)?.query_map(of(KEPT), |row| row.get(0))?.collect::<rusqlite::Result<_>>()?;
    begun.execute(&format!("UPDATE runs SET replay = NULL WHERE id IN {BEYOND}"), of(KEPT))?;
    // builders look for the shortest, and runners for the best time
    const HERE: &str = "(SELECT id FROM runs WHERE agent = ?1 AND course = ?2 AND difficulty = ?3 AND part = ?4";
    let shortest = format!("{HERE} ORDER BY distance, id LIMIT 1)");
    let fastest = format!("{HERE} AND ended = 'through' ORDER BY seconds, id LIMIT 1)");
    let rest = format!("id IN {BEYOND} AND id NOT IN {shortest} AND id NOT IN {fastest}");
    begun.execute(&format!("DELETE FROM runs WHERE {rest}"), of(ROWS))?;
    Ok(gone)
}

/// The table as text: the longest runs of each course.
///
/// # Errors
/// If there is no such table, or it cannot be read.
pub fn listing(path: &Path) -> Result<String, GameError> {
    if !path.exists() {
        return Ok(format!("no runs yet: {} is made by marathon-game --mode course\n", path.display()));
    }
    let table = Table::connect(path, OpenFlags::SQLITE_OPEN_READ_WRITE)?;
    let mut text = format!("{}\n", path.display());
    for course in table.courses()? {
        let Course { agent, kind, difficulty, role } = &course;
        text += &format!("\n{}\n", printable_line(&format!("{agent}   {kind}, difficulty {difficulty}   {role}")));
        for (i, run) in table.longest(&course, KEPT)?.iter().enumerate() {
            let Run { distance, seconds, ended, date, runner, builder, .. } = run;
            let replay = run.replay.as_ref().map(|path| format!("   {}", path.display())).unwrap_or_default();
            let [seed, number, episode] = run.draw;
            let row = format!(
                "{:>4}  {distance:>6.2} m  {seconds:>6.2} s  {ended:<10}  {date}  {runner} on {builder}, seed {seed}:{number}:{episode}{replay}",
                i + 1
            );
            text += &format!("{}\n", printable_line(&row));
        }
    }
    Ok(text)
}
