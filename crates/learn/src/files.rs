//! Files: safetensors with one JSON document in the header, written whole or not at all.

use crate::Error;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use serde::{Serialize, de::DeserializeOwned};
use std::collections::HashMap;
use std::io::Write;
use std::path::Path;

/// Key of the JSON document in a safetensors header.
const KEY: &str = "marathon";

/// Writes a file under a temporary name and renames it, so that a reader never sees half of it.
///
/// # Errors
/// If the file cannot be written; the old one is whole then.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
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
        parse(self.path, &self.document, format, version)
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
    /// Length of a list of unknown length.
    pub fn list_len(&self, name: &str) -> usize {
        self.tensors.tensor(name).map_or(0, |t| t.shape().iter().product())
    }
}

/// Parses a JSON document that names its format and version.
pub fn parse<D: DeserializeOwned>(path: &Path, json: &str, format: &str, version: u32) -> Result<D, Error> {
    let bad = |e: serde_json::Error| Error::file(path, "JSON", format!("'{e}'"), format!("a {format} document"));
    let value: serde_json::Value = serde_json::from_str(json).map_err(bad)?;
    let (found, number) = (&value["format"], &value["version"]);
    if found != format {
        return Err(Error::file(path, "format", found, format!("\"{format}\"")));
    }
    if *number != version {
        return Err(Error::file(path, "version", number, format!("{version}, the one that this program knows")));
    }
    serde_json::from_value(value).map_err(bad)
}

/// Checksum (FNV-1a) that tells damaged files.
pub fn checksum(bytes: &[u8]) -> String {
    let hash = bytes.iter().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ *b as u64).wrapping_mul(0x100_0000_01b3));
    format!("{hash:016x}")
}
