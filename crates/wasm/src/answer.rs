//! Requests of JavaScript and their answers.

use crate::hash;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Display;

/// A request: a JSON object, and files by name.
pub struct Request {
    json: Value,
    files: BTreeMap<String, Vec<u8>>,
}

impl Request {
    /// Reads a request: the length of the JSON text as four bytes, the text, then the files one after the other. The text's
    /// entry `files` has their names and lengths.
    pub fn parse(bytes: &[u8]) -> Result<Self, Failure> {
        if bytes.is_empty() {
            return Ok(Request { json: json!({}), files: BTreeMap::new() });
        }
        let malformed = || Failure::from("malformed request");
        let (length, rest) = bytes.split_first_chunk::<4>().ok_or_else(malformed)?;
        let (text, mut rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize).ok_or_else(malformed)?;
        let json: Value = serde_json::from_slice(text)?;
        let mut files = BTreeMap::new();
        for entry in json["files"].as_array().into_iter().flatten() {
            let (name, length) = (entry[0].as_str(), entry[1].as_u64());
            let (name, length) = name.zip(length).ok_or_else(malformed)?;
            let (file, others) = rest.split_at_checked(length as usize).ok_or_else(malformed)?;
            files.insert(name.into(), file.to_vec());
            rest = others;
        }
        Ok(Request { json, files })
    }

    /// The fields of the request.
    pub fn fields<T: DeserializeOwned>(&mut self) -> Result<T, Failure> {
        Ok(serde_json::from_value(self.json.take())?)
    }

    /// Takes a file.
    pub fn take_file(&mut self, name: &str) -> Option<Vec<u8>> {
        self.files.remove(name)
    }

    /// The files.
    pub fn files(&self) -> &BTreeMap<String, Vec<u8>> {
        &self.files
    }
}

/// An answer: bytes, and the number of an object.
pub struct Answer {
    pub object: i32,
    pub bytes: Vec<u8>,
}

impl Answer {
    /// Plain bytes.
    pub fn bytes(bytes: Vec<u8>) -> Self {
        Answer { object: 0, bytes }
    }

    /// Numbers in double precision.
    pub fn numbers<'a>(numbers: impl IntoIterator<Item = &'a f64>) -> Self {
        Answer::bytes(numbers.into_iter().flat_map(|x| x.to_le_bytes()).collect())
    }

    /// Numbers in single precision.
    pub fn singles(numbers: &[f32]) -> Self {
        Answer::bytes(numbers.iter().flat_map(|x| x.to_le_bytes()).collect())
    }

    /// A hash of numbers, as 16 hexadecimal digits.
    pub fn hash(numbers: impl IntoIterator<Item = f64>) -> Self {
        Answer::bytes(format!("{:016x}", hash(numbers)).into_bytes())
    }

    /// A JSON text.
    pub fn json(value: &impl Serialize) -> Result<Self, Failure> {
        Ok(Answer::bytes(serde_json::to_vec(value)?))
    }

    /// The same about an object.
    pub fn about(self, object: usize) -> Self {
        Answer { object: object as i32, ..self }
    }

    /// Nothing to say.
    pub fn done() -> Result<Self, Failure> {
        Ok(Answer::bytes(Vec::new()))
    }
}

/// Why a request cannot be carried out.
#[derive(Debug)]
pub struct Failure {
    message: String,
    /// Files that the request lacks.
    missing: Vec<String>,
}

impl Failure {
    /// A failure because files are missing.
    pub fn missing(self, missing: Vec<String>) -> Self {
        Failure { missing, ..self }
    }

    /// The JSON that JavaScript reads.
    pub fn to_json(&self) -> Vec<u8> {
        json!({ "message": self.message, "missing": self.missing }).to_string().into_bytes()
    }
}

impl<E: Display> From<E> for Failure {
    fn from(error: E) -> Self {
        Failure { message: in_a_script(&error.to_string()), missing: Vec::new() }
    }
}

/// A message without the advice that only a command line can follow.
fn in_a_script(message: &str) -> String {
    let message = message.replace("`marathon list`", "`agents()`");
    let advice = message.split_once("; set MARATHON_LIMITS=");
    match advice.and_then(|(before, rest)| Some((before, rest.split_once(" to raise it")?.1))) {
        Some((before, after)) => format!("{before}{after}"),
        None => message,
    }
}

/// Numbers in double precision.
pub fn numbers(bytes: &[u8]) -> Vec<f64> {
    bytes.as_chunks::<8>().0.iter().map(|x| f64::from_le_bytes(*x)).collect()
}
