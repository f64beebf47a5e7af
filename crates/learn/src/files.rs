//! Files that are written completely or not at all: safetensors with one JSON document in the header, and JSON
//! documents with a checksum of their own.

use crate::error::Error;
use fnv::FnvHasher;
use marathon_physics::budget;
pub use safetensors::tensor::Dtype;
use safetensors::tensor::{SafeTensors, TensorView};
use serde::{Serialize, de::DeserializeOwned};
use serde_json::Value;
use std::collections::HashMap;
use std::fs::File;
use std::hash::Hasher;
use std::io::{self, ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Key of the JSON document in a safetensors header.
const KEY: &str = "marathon";
/// Key of a document's checksum.
const CHECKSUM: &str = "checksum";
/// Placeholder for the checksum of a sealed file while the checksum is computed.
const BLANK: &str = "0000000000000000";
/// Memory for parsing a JSON document, as a multiple of its length. `0,` becomes 32 bytes; the text and the parsed
/// document come on top.
const JSON_MEMORY: f64 = 64.0;

/// A file that is written under a temporary name until [`AtomicFile::commit`], so that readers never see a partial
/// file. Without a commit, the temporary file is deleted and the old file stays.
#[derive(Debug)]
pub struct AtomicFile {
    path: PathBuf,
    /// `None` after the commit.
    temporary: Option<PathBuf>,
    file: File,
}

/// Number of the next temporary file of this process.
static NEXT: AtomicU64 = AtomicU64::new(0);

impl AtomicFile {
    /// Creates the temporary file for `path`.
    ///
    /// # Errors
    /// If no file can be created in that folder.
    pub fn create(path: &Path) -> Result<Self, Error> {
        // a short name of fixed length: the file's own name may have the maximum length
        let name = checksum(path.file_name().unwrap_or_default().as_encoded_bytes());
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let temporary = path.with_file_name(format!(".{name}-{number}.{}.tmp", marathon_physics::process_id()));
        // never write through an existing link
        let new = || File::options().write(true).create_new(true).open(&temporary);
        let file = new().or_else(|error| match error.kind() {
            // a killed process with the same number left the file
            ErrorKind::AlreadyExists => std::fs::remove_file(&temporary).and_then(|()| new()),
            _ => Err(error),
        });
        let file = file.map_err(Error::io(path, "write"))?;
        Ok(Self { path: path.into(), temporary: Some(temporary), file })
    }

    /// Gives the file its final name.
    ///
    /// # Errors
    /// If writing the data or renaming fails, as on a full disk.
    pub fn commit(mut self) -> Result<(), Error> {
        let Some(temporary) = &self.temporary else { return Ok(()) };
        let moved = self.file.sync_all().and_then(|()| std::fs::rename(temporary, &self.path));
        moved.map_err(Error::io(&self.path, "write"))?;
        self.temporary = None;
        Ok(())
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }
    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for AtomicFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

impl Drop for AtomicFile {
    fn drop(&mut self) {
        if let Some(temporary) = &self.temporary {
            let _ = std::fs::remove_file(temporary);
        }
    }
}

/// Writes a file under a temporary name and renames it, so that readers never see a partial file.
///
/// # Errors
/// If the file cannot be written. The old file then stays intact.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let mut file = AtomicFile::create(path)?;
    file.write_all(bytes).map_err(Error::io(path, "write"))?;
    file.commit()
}

/// Numbers that safetensors can hold.
pub trait Number: Copy {
    const DTYPE: Dtype;
    fn push(self, bytes: &mut Vec<u8>);
    fn read(bytes: &[u8]) -> Self;
}

macro_rules! number {
    ($t:ty, $dtype:ident) => {
        impl Number for $t {
            const DTYPE: Dtype = Dtype::$dtype;
            fn push(self, bytes: &mut Vec<u8>) {
                bytes.extend_from_slice(&self.to_le_bytes());
            }
            fn read(bytes: &[u8]) -> Self {
                let mut word = [0; size_of::<$t>()];
                word.copy_from_slice(bytes);
                Self::from_le_bytes(word)
            }
        }
    };
}
number!(f32, F32);
number!(f64, F64);
number!(u8, U8);
number!(u32, U32);
number!(u64, U64);

/// Builds a safetensors file.
#[derive(Default)]
pub struct TensorWriter {
    tensors: Vec<(String, Dtype, Vec<usize>, Vec<u8>)>,
}

impl TensorWriter {
    /// Adds a tensor.
    pub fn add<N: Number>(&mut self, name: impl ToString, shape: &[usize], data: impl IntoIterator<Item = N>) {
        let mut bytes = Vec::new();
        data.into_iter().for_each(|x| x.push(&mut bytes));
        self.tensors.push((name.to_string(), N::DTYPE, shape.to_vec(), bytes));
    }
    /// Adds a tensor of one dimension.
    pub fn list<N: Number>(&mut self, name: &str, data: &[N]) {
        self.add(name, &[data.len()], data.iter().copied());
    }
    /// The bytes of the file, with the document in its header.
    pub fn bytes<D: Serialize>(&self, document: &D) -> Vec<u8> {
        self.with_document(serde_json::to_string(document).expect("documents are plain data"))
    }
    /// Like [`TensorWriter::bytes`], with a checksum of all these bytes at the end of the document.
    pub fn sealed_bytes<D: Serialize>(&self, document: &D) -> Vec<u8> {
        let json = serde_json::to_string(document).expect("documents are plain data");
        let open = json.strip_suffix('}').expect("a document has keys");
        let mut bytes = self.with_document(format!("{open},\"{CHECKSUM}\":\"{BLANK}\"}}"));
        let place = seal_place(&bytes).expect("the document ends with it");
        let sum = checksum(&bytes);
        bytes[place..place + sum.len()].copy_from_slice(sum.as_bytes());
        bytes
    }
    fn with_document(&self, json: String) -> Vec<u8> {
        let views = self.tensors.iter().map(|(name, dtype, shape, bytes)| {
            (
                name.as_str(),
                TensorView::new(*dtype, shape.clone(), bytes).expect("tensors have as many numbers as places"),
            )
        });
        let header = HashMap::from([(KEY.to_string(), json)]);
        safetensors::serialize(views, Some(header)).expect("named tensors in memory")
    }
}

/// Reads a safetensors file.
pub struct TensorReader<'a> {
    path: &'a Path,
    tensors: SafeTensors<'a>,
    document: String,
}

impl<'a> TensorReader<'a> {
    /// Reads the header of `bytes`, which came from `path`.
    pub fn new(path: &'a Path, bytes: &'a [u8]) -> Result<Self, Error> {
        let bad = |e: safetensors::SafeTensorError| Error::file(path, "header", format!("'{e}'"), "a safetensors file");
        let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(bad)?;
        let document = metadata.metadata().as_ref().and_then(|m| m.get(KEY)).cloned();
        let expected = format!("metadata '{KEY}', which Marathon writes");
        let document: String = document.ok_or_else(|| Error::file(path, "header", "none", expected))?;
        budget::MEMORY.check(JSON_MEMORY * document.len() as f64).map_err(|e| Error::budget(path, "header", e))?;
        Ok(Self { path, tensors: SafeTensors::deserialize(bytes).map_err(bad)?, document })
    }
    /// Returns the JSON document.
    pub fn document<D: DeserializeOwned>(&self, format: &str, version: u32) -> Result<D, Error> {
        let mut value = json(self.path, &self.document, format)?;
        // the checksum covers all bytes: see `seal`
        value.as_object_mut().and_then(|keys| keys.remove(CHECKSUM));
        known(self.path, value, format, version)
    }
    /// Checks and returns the checksum of `bytes`, which this reader was created from. `None` if the document has no
    /// checksum.
    ///
    /// # Errors
    /// If the bytes have changed since the checksum was computed.
    pub fn seal(&self, bytes: &[u8]) -> Result<Option<String>, Error> {
        let document: Value = serde_json::from_str(&self.document).unwrap_or_default();
        let Some(found) = document.get(CHECKSUM) else { return Ok(None) };
        let place = seal_place(bytes).unwrap_or(bytes.len() - BLANK.len());
        let (before, rest) = bytes.split_at(place);
        let sum = checksum_of_parts(&[before, BLANK.as_bytes(), &rest[BLANK.len()..]]);
        match found == sum.as_str() && rest.starts_with(sum.as_bytes()) {
            true => Ok(Some(sum)),
            false => Err(changed(self.path, found, &sum)),
        }
    }
    /// Returns a tensor of a known shape.
    pub fn get<N: Number>(&self, name: &str, shape: &[usize]) -> Result<Vec<N>, Error> {
        let place = format!("tensor '{name}'");
        let expected = format!("{:?} {shape:?}", N::DTYPE);
        let Ok(view) = self.tensors.tensor(name) else {
            let mut names = self.tensors.names();
            names.sort();
            return Err(Error::file(self.path, place, format!("only {}", names.join(", ")), expected));
        };
        if view.dtype() != N::DTYPE || view.shape() != shape {
            let found = format!("{:?} {:?}", view.dtype(), view.shape());
            return Err(Error::file(self.path, place, found, expected));
        }
        Ok(view.data().chunks_exact(size_of::<N>()).map(N::read).collect())
    }
    /// Returns a tensor of a known shape without infinities and NaN.
    pub fn finite(&self, name: &str, shape: &[usize]) -> Result<Vec<f32>, Error> {
        let data: Vec<f32> = self.get(name, shape)?;
        match data.iter().position(|x| !x.is_finite()) {
            None => Ok(data),
            Some(i) => Err(Error::file(self.path, format!("tensor '{name}', number {i}"), data[i], "a finite number")),
        }
    }
    /// Returns a list of unknown length.
    pub fn list<N: Number>(&self, name: &str) -> Result<Vec<N>, Error> {
        self.get(name, &[self.list_len(name)])
    }
    /// Returns a list of unknown length without infinities and NaN.
    pub fn finite_list(&self, name: &str) -> Result<Vec<f32>, Error> {
        self.finite(name, &[self.list_len(name)])
    }
    fn list_len(&self, name: &str) -> usize {
        self.tensors.tensor(name).map_or(0, |t| t.shape().iter().product())
    }
    /// Names of all tensors in order, with the types of their numbers.
    pub fn names(&self) -> Vec<(&str, Dtype)> {
        let mut names: Vec<_> = self.tensors.iter().map(|(name, tensor)| (name, tensor.dtype())).collect();
        names.sort_by_key(|(name, _)| *name);
        names
    }
}

/// Position of the checksum's digits in a sealed file: in the header, after the last checksum key of the document. The
/// document is JSON text within JSON.
fn seal_place(bytes: &[u8]) -> Option<usize> {
    let key = format!("\\\"{CHECKSUM}\\\":\\\"");
    let length = u64::from_le_bytes(*bytes.first_chunk()?);
    let header = bytes.get(8..usize::try_from(length).ok()?.checked_add(8)?)?;
    let place = 8 + header.windows(key.len()).rposition(|window| window == key.as_bytes())? + key.len();
    (place + BLANK.len() <= bytes.len()).then_some(place)
}

fn changed(path: &Path, found: &Value, sum: &str) -> Error {
    Error::file(path, CHECKSUM, found, format!("\"{sum}\"; the file has changed since it was written"))
}

/// Parses a JSON document.
fn json(path: &Path, text: &str, format: &str) -> Result<Value, Error> {
    serde_json::from_str(text).map_err(|e| Error::file(path, "JSON", format!("'{e}'"), format!("a {format} document")))
}

/// Reads a JSON document that states its format and version.
fn known<D: DeserializeOwned>(path: &Path, mut value: Value, format: &str, version: u32) -> Result<D, Error> {
    let (found, number) = (&value["format"], &value["version"]);
    if found != format {
        return Err(Error::file(path, "format", found, format!("\"{format}\"")));
    }
    if *number != version {
        return Err(Error::file(path, "version", number, format!("{version}, which this program supports")));
    }
    if let Some(found) = value.as_object_mut().and_then(|keys| keys.remove(CHECKSUM)) {
        let sum = checksum_of(&value);
        if found != sum.as_str() {
            return Err(changed(path, &found, &sum));
        }
    }
    serde_path_to_error::deserialize(value).map_err(|e| {
        let (place, expected) = (e.path().to_string(), format!("a {format} document"));
        Error::file(path, if place == "." { "JSON" } else { &place }, format!("'{}'", e.into_inner()), expected)
    })
}

/// Writes a description: a JSON document that names its format and version, with a checksum of its values.
///
/// # Errors
/// If the file cannot be written. The old file then stays intact.
pub fn write_description(path: &Path, document: &impl Serialize) -> Result<(), Error> {
    let bad = |e: serde_json::Error| Error::file(path, "JSON", format!("'{e}'"), "plain data");
    let json = serde_json::to_string_pretty(document).map_err(bad)?;
    let sum = checksum_of(&serde_json::from_str(&json).map_err(bad)?);
    let open = json.strip_suffix("\n}").expect("a document has keys");
    write_atomic(path, format!("{open},\n  \"{CHECKSUM}\": \"{sum}\"\n}}\n").as_bytes())
}

/// Reads a description. A missing checksum is not an error, so that people can edit the file.
///
/// # Errors
/// If the file cannot be read, has changed since it was written, or has another format.
pub fn read_description<D: DeserializeOwned>(path: &Path, format: &str, version: u32) -> Result<D, Error> {
    let text = budget::read_to_string(path, &budget::CONFIG_FILE).map_err(Error::io(path, "read"))?;
    known(path, json(path, &text, format)?, format, version)
}

/// Checksum of a document's values. It does not depend on the order of keys or the notation of numbers.
fn checksum_of(document: &Value) -> String {
    fn write(value: &Value, out: &mut Vec<u8>) {
        match value {
            Value::Object(keys) => {
                let mut keys: Vec<_> = keys.iter().collect();
                keys.sort_by_key(|(key, _)| *key);
                out.push(b'{');
                for (key, value) in keys {
                    out.extend(Value::from(key.as_str()).to_string().bytes());
                    write(value, out);
                }
                out.push(b'}');
            }
            Value::Array(values) => {
                out.push(b'[');
                values.iter().for_each(|value| write(value, out));
                out.push(b']');
            }
            // a comma ends numbers; integers keep all their digits
            Value::Number(n) => match n.as_f64().filter(|_| n.is_f64()) {
                Some(x) => out.extend(format!("{:x},", x.to_bits()).bytes()),
                None => out.extend(format!("{n},").bytes()),
            },
            other => out.extend(other.to_string().bytes()),
        }
    }
    let mut bytes = Vec::new();
    write(document, &mut bytes);
    checksum(&bytes)
}

/// Checksum (FNV-1a) that detects damaged files. A change of a single byte always changes the checksum.
pub fn checksum(bytes: &[u8]) -> String {
    checksum_of_parts(&[bytes])
}

/// The checksum of bytes in several parts.
fn checksum_of_parts(parts: &[&[u8]]) -> String {
    let mut hash = FnvHasher::default();
    parts.iter().for_each(|part| hash.write(part));
    format!("{:016x}", hash.finish())
}
