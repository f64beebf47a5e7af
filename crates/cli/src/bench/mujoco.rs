//! MuJoCo in a Python process: starts the process and exchanges messages with it.

use super::plan::Plan;
use super::workload::{STEPS, Source, Subject};
use crate::error::CliError;
use marathon_physics::workload::HOLD;
use marathon_runs::python::{self, VARIABLE};
use marathon_runs::speed::Sample;
use serde::Deserialize;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout};
use std::thread::JoinHandle;

/// Program of the process; it documents requests and answers.
const SCRIPT: &str = include_str!("mujoco_side.py");

/// A Python process with MuJoCo.
pub struct Mujoco {
    python: PathBuf,
    /// Version of MuJoCo.
    pub version: String,
    child: Child,
    requests: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
    /// Collects the error output of the process.
    complaints: Option<JoinHandle<String>>,
}

/// Results of a turn of MuJoCo.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct Turn {
    steps: u64,
    cpu: f64,
    wall: f64,
    /// Mean number of contacts of an agent.
    pub contacts: f64,
    /// Agents whose simulation became non-finite.
    pub broken: u64,
}

impl Turn {
    /// Its times as a sample.
    pub fn sample(&self) -> Sample {
        Sample { steps: self.steps, cpu: self.cpu, wall: self.wall }
    }
}

impl Mujoco {
    /// Starts Python.
    ///
    /// # Errors
    /// If there is no Python or it has no MuJoCo.
    pub fn start() -> Result<Self, CliError> {
        let python = python::find();
        let mut child = python::command(&python, SCRIPT).spawn().map_err(|e| {
            CliError::Python(format!(
                "{}: cannot be started: {e}; expected a Python with MuJoCo: install Python 3 and the package by \
                 `python3 -m pip install mujoco`, or let the variable {VARIABLE} name the Python that has it",
                python.display()
            ))
        })?;
        let (Some(requests), Some(answers), Some(mut errors)) =
            (child.stdin.take(), child.stdout.take(), child.stderr.take())
        else {
            unreachable!("all three are piped")
        };
        let complaints = std::thread::spawn(move || {
            let mut bytes = Vec::new();
            let _ = errors.read_to_end(&mut bytes);
            String::from_utf8_lossy(&bytes).into_owned()
        });
        let mut side = Self {
            python,
            version: String::new(),
            child,
            requests: Some(requests),
            answers: BufReader::new(answers),
            complaints: Some(complaints),
        };
        let hello = side.answer()?;
        if let Some(version) = hello["mujoco"].as_str() {
            side.version = version.into();
            return Ok(side);
        }
        let found = hello["missing"].as_str().unwrap_or("no MuJoCo");
        let python = marathon_runs::text::path_word(&side.python);
        Err(CliError::Python(format!(
            "{python}: found {found}, expected the package mujoco (tests run with 4.0); install it by `{python} -m pip \
             install mujoco`, or let the variable {VARIABLE} name a Python that has it"
        )))
    }

    /// Loads a model.
    ///
    /// # Errors
    /// If MuJoCo cannot read the model, or the process has ended.
    pub fn load(&mut self, plan: &Plan, subject: &Subject) -> Result<(), CliError> {
        let mut job = json!({
            "agents": plan.agents * plan.threads,
            "threads": plan.threads,
            "warmup": plan.warmup,
            "steps": STEPS,
            "hold": HOLD,
            "limp": plan.limp,
            "contacts": plan.contacts,
            "scenes": subject.scenes,
        });
        match &subject.source {
            Source::Text(text) => job["xml"] = json!(text),
            Source::File(file) => {
                let path = std::path::absolute(file).map_err(CliError::io(file, "find"))?;
                job["path"] = json!(path);
            }
        }
        self.ask(&subject.name, &job)?;
        Ok(())
    }

    /// Runs the loaded model for about `seconds` processor seconds of each thread.
    ///
    /// # Errors
    /// If the process has ended.
    pub fn turn(&mut self, subject: &Subject, seconds: f64) -> Result<Turn, CliError> {
        let answer = self.ask(&subject.name, &json!({ "seconds": seconds }))?;
        serde_json::from_value(answer).map_err(|e| self.nonsense(&e.to_string()))
    }

    fn ask(&mut self, model: &str, request: &Value) -> Result<Value, CliError> {
        let sent = self.requests.as_mut().map(|pipe| writeln!(pipe, "{request}").and_then(|()| pipe.flush()));
        if !matches!(sent, Some(Ok(()))) {
            return Err(self.ended());
        }
        let answer = self.answer()?;
        match answer["error"].as_str() {
            Some(error) => Err(CliError::Python(format!("MuJoCo {}: model '{model}': {error}", self.version))),
            None => Ok(answer),
        }
    }

    fn answer(&mut self) -> Result<Value, CliError> {
        let mut line = String::new();
        match self.answers.read_line(&mut line) {
            Ok(n) if n > 0 => serde_json::from_str(&line).map_err(|_| self.nonsense(&format!("'{}'", line.trim_end()))),
            _ => Err(self.ended()),
        }
    }

    fn nonsense(&self, found: &str) -> CliError {
        CliError::Python(format!("{}: found {found}, expected an answer of Python's", self.python.display()))
    }

    /// The error of a process that has ended early.
    fn ended(&mut self) -> CliError {
        self.requests = None;
        let status = self.child.wait().map_or_else(|e| e.to_string(), |status| status.to_string());
        let text = self.complaints.take().and_then(|thread| thread.join().ok()).unwrap_or_default();
        let complaint = match python::complaint(&text) {
            "" => String::new(),
            end => format!(":\n{end}"),
        };
        CliError::Python(format!(
            "{}: ended early ({status}), expected a Python 3 with the package mujoco; let the variable {VARIABLE} name \
             one{complaint}",
            self.python.display()
        ))
    }
}

impl Drop for Mujoco {
    fn drop(&mut self) {
        // the process ends with its input
        self.requests = None;
        let _ = self.child.wait();
    }
}
