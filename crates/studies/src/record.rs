//! The results of a study and their files.

use crate::args::Options;
use crate::error::StudyError;
use marathon_learn::write_atomic;
use marathon_physics::lanes::Isa;
use marathon_runs::report::chart::Chart;
use serde::Serialize;

/// A table with a picture.
#[derive(Serialize)]
pub struct Record {
    /// Name of the files and of the command.
    pub name: &'static str,
    /// Heading.
    pub title: &'static str,
    /// Measurements and method of the study, in one or more paragraphs.
    pub about: String,
    /// Headings of the columns.
    pub columns: Vec<&'static str>,
    /// Cells, as they are written.
    pub rows: Vec<Vec<String>>,
    /// Words of the command besides seeds, steps and threads.
    pub words: String,
    /// Versions of the other projects' programs.
    pub versions: Vec<String>,
    /// The picture.
    #[serde(skip)]
    pub chart: Chart,
}

impl Record {
    /// Writes the three files and returns the text of the page.
    ///
    /// # Errors
    /// If one cannot be written.
    pub fn save(&self, options: &Options) -> Result<String, StudyError> {
        let out = &options.out;
        std::fs::create_dir_all(out).map_err(StudyError::io(out, "create folder"))?;
        let file = |extension: &str| out.join(format!("{}.{extension}", self.name));

        let mut table = csv::Writer::from_writer(Vec::new());
        let path = file("csv");
        let bad = |e: csv::Error| StudyError::file(&path, "table", e, "rows of equal length");
        table.write_record(&self.columns).map_err(bad)?;
        for row in &self.rows {
            table.write_record(row).map_err(bad)?;
        }
        let bytes = table.into_inner().map_err(|e| StudyError::file(&path, "table", e, "a table in memory"))?;
        write_atomic(&path, &bytes)?;
        self.chart.draw(&file("png"))?;

        let line = |cells: Vec<&str>| format!("| {} |\n", cells.join(" | "));
        let mut text = format!("# {}\n\n{}\n\n", self.title, self.about.trim());
        text += &line(self.columns.clone());
        text += &line(vec!["---"; self.columns.len()]);
        for row in &self.rows {
            text += &line(row.iter().map(String::as_str).collect());
        }
        let Options { seeds, threads, .. } = options;
        let steps = options.steps.map_or(String::new(), |steps| format!(" --steps {steps}"));
        text += &format!(
            "\n![{}]({}.png)\n\n```text\ncargo run --release -p marathon-studies -- {} --seeds {seeds}{steps} --threads {threads}{}\n```\n\n\
             Marathon {}, {}, {} thread{}, instruction set {}{}. Seconds are processor time of all threads unless said \
             otherwise. ± is the standard deviation over the seeds.\n",
            self.title,
            self.name,
            self.name,
            self.words,
            env!("CARGO_PKG_VERSION"),
            processor(),
            if *threads == 0 { "all".to_string() } else { threads.to_string() },
            if *threads == 1 { "" } else { "s" },
            Isa::best().name(),
            self.versions.iter().map(|v| format!("; {v}")).collect::<String>(),
        );
        write_atomic(&file("md"), text.as_bytes())?;
        Ok(text)
    }
}

/// Name of the processor; where the system does not name it, the architecture.
fn processor() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    model.map_or_else(|| std::env::consts::ARCH.to_string(), |(_, name)| name.trim().to_string())
}
