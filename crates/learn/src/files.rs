//! Files, written whole or not at all: safetensors with one JSON document in the header, and JSON documents that know their
//! own checksum.

use crate::error::Error;
pub use safetensors::tensor::Dtype;
use safetensors::tensor::{SafeTensors, TensorView};
use serde::{Serialize, de::DeserializeOwned};
use serde_json::Value;
use std::collections::HashMap;
use std::io::Write;
use std::path::Path;

/// Key of the JSON document in a safetensors header.
const KEY: &str = "marathon";
/// Key of a description's checksum.
const CHECKSUM: &str = "checksum";

/// Writes a file under a temporary name and renames it, so that a reader never sees half of it.
///
/// # Errors
/// If the file cannot be written; the old one is whole then.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    // a name of its own length: that of the file may be as long as names can be
    let name = checksum(path.file_name().unwrap_or_default().as_encoded_bytes());
    let temporary = path.with_file_name(format!(".{name}.{}.tmp", std::process::id()));
    let write = || {
        let mut file = std::fs::File::create(&temporary)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        std::fs::rename(&temporary, path)
    };
    write().map_err(|source| {
        let _ = std::fs::remove_file(&temporary);
        Error::io(path, "write")(source)
    })
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

/// A safetensors file being made.
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
    /// The file's bytes, the document in its header.
    pub fn bytes<D: Serialize>(&self, document: &D) -> Vec<u8> {
        let json = serde_json::to_string(document).expect("documents are plain data");
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

/// A safetensors file being read.
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
        let document = document.ok_or_else(|| Error::file(path, "header", "none", expected))?;
        Ok(Self { path, tensors: SafeTensors::deserialize(bytes).map_err(bad)?, document })
    }
    /// The JSON document.
    pub fn document<D: DeserializeOwned>(&self, format: &str, version: u32) -> Result<D, Error> {
        parse(self.path, &self.document, format, version, None)
    }
    /// A tensor of a known shape.
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
    /// A tensor of a known shape without infinities and NaN.
    pub fn finite(&self, name: &str, shape: &[usize]) -> Result<Vec<f32>, Error> {
        let data: Vec<f32> = self.get(name, shape)?;
        match data.iter().position(|x| !x.is_finite()) {
            None => Ok(data),
            Some(i) => Err(Error::file(self.path, format!("tensor '{name}', number {i}"), data[i], "a finite number")),
        }
    }
    /// A list of unknown length.
    pub fn list<N: Number>(&self, name: &str) -> Result<Vec<N>, Error> {
        self.get(name, &[self.list_len(name)])
    }
    /// The same without infinities and NaN.
    pub fn finite_list(&self, name: &str) -> Result<Vec<f32>, Error> {
        self.finite(name, &[self.list_len(name)])
    }
    fn list_len(&self, name: &str) -> usize {
        self.tensors.tensor(name).map_or(0, |t| t.shape().iter().product())
    }
    /// Names of all tensors in order, with the kinds of their numbers.
    pub fn names(&self) -> Vec<(&str, Dtype)> {
        let mut names: Vec<_> = self.tensors.iter().map(|(name, tensor)| (name, tensor.dtype())).collect();
        names.sort_by_key(|(name, _)| *name);
        names
    }
}

/// Makes a document of an earlier version into one of this version; or says where it is none, and what is found there.
pub type Upgrade = fn(u64, Value) -> Result<Value, (String, String)>;

/// Parses a JSON document that names its format and version; one of an earlier version, if there is a way to upgrade it.
fn parse<D: DeserializeOwned>(
    path: &Path,
    json: &str,
    format: &str,
    version: u32,
    upgrade: Option<Upgrade>,
) -> Result<D, Error> {
    let expected = || format!("a {format} document");
    let bad = |e: serde_json::Error| Error::file(path, "JSON", format!("'{e}'"), expected());
    let mut value: Value = serde_json::from_str(json).map_err(bad)?;
    let (found, number) = (&value["format"], &value["version"]);
    if found != format {
        return Err(Error::file(path, "format", found, format!("\"{format}\"")));
    }
    let earlier = number.as_u64().filter(|n| upgrade.is_some() && (1..version as u64).contains(n));
    if *number != version && earlier.is_none() {
        return Err(Error::file(path, "version", number, format!("{version}, the one that this program knows")));
    }
    // earlier versions wrote none
    if let Some(found) = value.as_object_mut().and_then(|keys| keys.remove(CHECKSUM)) {
        let sum = checksum_of(&value);
        if found != sum.as_str() {
            return Err(Error::file(
                path,
                CHECKSUM,
                found,
                format!("\"{sum}\"; the file has changed since it was written"),
            ));
        }
    }
    if let (Some(number), Some(upgrade)) = (earlier, upgrade) {
        value = upgrade(number, value)
            .map_err(|(place, found)| Error::file(path, place, format!("'{found}'"), expected()))?;
    }
    serde_path_to_error::deserialize(value).map_err(|e| {
        let place = e.path().to_string();
        Error::file(path, if place == "." { "JSON" } else { &place }, format!("'{}'", e.into_inner()), expected())
    })
}

/// Writes a description: a JSON document that names its format and version, with a checksum of its values.
///
/// # Errors
/// If the file cannot be written; the old one is whole then.
pub fn write_description(path: &Path, document: &impl Serialize) -> Result<(), Error> {
    let bad = |e: serde_json::Error| Error::file(path, "JSON", format!("'{e}'"), "plain data");
    let json = serde_json::to_string_pretty(document).map_err(bad)?;
    let sum = checksum_of(&serde_json::from_str(&json).map_err(bad)?);
    let open = json.strip_suffix("\n}").expect("a document has keys");
    write_atomic(path, format!("{open},\n  \"{CHECKSUM}\": \"{sum}\"\n}}\n").as_bytes())
}

/// Reads a description; one without a checksum, as earlier versions wrote them, too.
///
/// # Errors
/// If the file cannot be read, has changed since it was written, or is of another format.
pub fn read_description<D: DeserializeOwned>(path: &Path, format: &str, version: u32) -> Result<D, Error> {
    read_versions(path, format, version, None)
}

/// As [`read_description`], also for earlier versions that can be upgraded.
///
/// # Errors
/// The same.
pub fn read_versions<D: DeserializeOwned>(
    path: &Path,
    format: &str,
    version: u32,
    upgrade: Option<Upgrade>,
) -> Result<D, Error> {
    let json = std::fs::read(path).map_err(Error::io(path, "read"))?;
    let json = String::from_utf8(json).map_err(|e| Error::file(path, "text", e, "UTF-8"))?;
    parse(path, &json, format, version, upgrade)
}

/// Checksum of a document's values, whatever the order of its keys and the spelling of its numbers.
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
            // a comma ends numbers, of which integers have all their digits
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

/// Checksum (FNV-1a) that tells damaged files.
pub fn checksum(bytes: &[u8]) -> String {
    let hash = bytes.iter().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ *b as u64).wrapping_mul(0x100_0000_01b3));
    format!("{hash:016x}")
}
