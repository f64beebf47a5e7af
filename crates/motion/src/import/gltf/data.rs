//! Numbers in a glTF file: accessors into views of buffers.

use super::super::Beside;
use super::document::Document;
use crate::error::MotionError;
use crate::limits;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;

/// Component types by their glTF numbers.
const BYTE: u32 = 5120;
const UNSIGNED_BYTE: u32 = 5121;
const SHORT: u32 = 5122;
const UNSIGNED_SHORT: u32 = 5123;
const FLOAT: u32 = 5126;

/// The buffers of a file, which are read on first use.
pub(super) struct Buffers<'a> {
    pub path: &'a Path,
    pub document: &'a Document,
    pub blob: Option<&'a [u8]>,
    pub beside: Option<Beside<'a>>,
    read: BTreeMap<usize, Cow<'a, [u8]>>,
    /// Bytes of all rows read so far. Many channels can refer to one accessor.
    asked: f64,
}

impl<'a> Buffers<'a> {
    pub fn new(path: &'a Path, document: &'a Document, blob: Option<&'a [u8]>, beside: Option<Beside<'a>>) -> Self {
        Buffers { path, document, blob, beside, read: BTreeMap::new(), asked: 0.0 }
    }

    /// The rows of an accessor, `width` numbers each. `whole` also allows integers that encode numbers from -1 to 1.
    pub fn rows(&mut self, place: &str, index: usize, width: usize, whole: bool) -> Result<Vec<f64>, MotionError> {
        let path = self.path;
        let wrong = |key: &str, found: String, expected: &str| Err(MotionError::value(path, key, found, expected));
        let Some(accessor) = self.document.accessors.get(index) else {
            let expected = format!("one of {} accessors", self.document.accessors.len());
            return wrong(place, format!("accessor {index}"), &expected);
        };
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][width - 1];
        let size = match accessor.component_type {
            FLOAT => 4,
            BYTE | UNSIGNED_BYTE if whole && accessor.normalized => 1,
            SHORT | UNSIGNED_SHORT if whole && accessor.normalized => 2,
            _ => 0,
        };
        if size == 0 || accessor.kind != kind {
            let found =
                format!("accessor {index} of {} of type {}", accessor.kind.escape_debug(), accessor.component_type);
            let expected =
                if whole { format!("{kind} of floats or normalized integers") } else { format!("{kind} of floats") };
            return wrong(place, found, &expected);
        }
        let key = format!("accessors[{index}]");
        let view = accessor.buffer_view.filter(|_| accessor.sparse.is_none());
        let Some(view) = view else { return wrong(&key, "a sparse accessor".into(), "one with a buffer view") };
        let Some(view) = self.document.buffer_views.get(view) else {
            return wrong(&key, format!("view {view}"), &format!("one of {} views", self.document.buffer_views.len()));
        };
        if let Some(extension) = view.extensions.keys().find(|name| name.contains("meshopt")) {
            return Err(MotionError::Unsupported {
                path: path.into(),
                feature: format!("an animation compressed with {extension}"),
                instead: "export the file without compression; with gltfpack, leave out -c and -cc".into(),
            });
        }
        let row = size * width;
        let stride = view.byte_stride.unwrap_or(row);
        let within = (accessor.count.checked_sub(1))
            .and_then(|gaps| gaps.checked_mul(stride))
            .and_then(|bytes| bytes.checked_add(row))
            .and_then(|bytes| bytes.checked_add(accessor.byte_offset))
            .is_some_and(|bytes| bytes <= view.byte_length);
        let (begin, length) = (view.byte_offset, view.byte_length);
        // overlapping rows would expand a few bytes to many numbers
        if !within || stride < row {
            return wrong(&key, "data beyond the end".into(), "data within its view");
        }
        self.asked += 16.0 * (accessor.count * width) as f64;
        limits::check_memory(path, self.asked)?;
        let bytes = self.buffer(view.buffer)?;
        let Some(bytes) = begin.checked_add(length).and_then(|end| bytes.get(begin..end)) else {
            return wrong(&key, "data beyond the end".into(), "data within the file");
        };
        let mut numbers = Vec::with_capacity(accessor.count * width);
        for i in 0..accessor.count {
            let at = accessor.byte_offset + i * stride;
            for part in bytes[at..at + row].chunks(size) {
                numbers.push(number(accessor.component_type, part));
            }
        }
        Ok(numbers)
    }

    fn buffer(&mut self, index: usize) -> Result<&[u8], MotionError> {
        if !self.read.contains_key(&index) {
            let bytes = self.load(index)?;
            let total: usize = self.read.values().map(|bytes| bytes.len()).sum();
            limits::check_memory(self.path, (total + bytes.len()) as f64)?;
            self.read.insert(index, bytes);
        }
        Ok(&self.read[&index])
    }

    fn load(&self, index: usize) -> Result<Cow<'a, [u8]>, MotionError> {
        let key = format!("buffers[{index}]");
        let wrong = |found: String, expected: &str| Err(MotionError::value(self.path, &key, found, expected));
        let Some(buffer) = self.document.buffers.get(index) else {
            return wrong("nothing".into(), &format!("one of {} buffers", self.document.buffers.len()));
        };
        let uri = match (&buffer.uri, self.blob) {
            (None, Some(blob)) if index == 0 => return Ok(Cow::Borrowed(blob)),
            (None, _) => return wrong("no data".into(), "a binary chunk or a uri"),
            (Some(uri), _) => uri,
        };
        if let Some(data) = uri.strip_prefix("data:") {
            let Some((_, text)) = data.split_once(";base64,") else {
                return wrong("a data URI without base64".into(), "data:...;base64,...");
            };
            return match STANDARD.decode(text) {
                Ok(bytes) => Ok(Cow::Owned(bytes)),
                Err(error) => wrong(error.to_string(), "base64"),
            };
        }
        let name = unescaped(uri);
        let found = format!("the file {name:?}");
        match self.beside {
            Some(read) => read(&name)
                .map(Cow::Owned)
                .or_else(|reason| wrong(format!("{found}: {reason}"), "a file beside this one")),
            None => wrong(found, "data within this file; export as .glb"),
        }
    }
}

fn number(kind: u32, bytes: &[u8]) -> f64 {
    match (kind, bytes) {
        (FLOAT, &[a, b, c, d]) => f64::from(f32::from_le_bytes([a, b, c, d])),
        (SHORT, &[a, b]) => (f64::from(i16::from_le_bytes([a, b])) / 32767.0).max(-1.0),
        (UNSIGNED_SHORT, &[a, b]) => f64::from(u16::from_le_bytes([a, b])) / 65535.0,
        (BYTE, &[a]) => (f64::from(a as i8) / 127.0).max(-1.0),
        (UNSIGNED_BYTE, &[a]) => f64::from(a) / 255.0,
        _ => f64::NAN,
    }
}

/// Decodes a name in which spaces and similar characters are written as `%20`.
fn unescaped(uri: &str) -> String {
    let (mut out, mut rest) = (Vec::new(), uri.as_bytes());
    while let Some((first, behind)) = rest.split_first() {
        let code =
            std::str::from_utf8(behind.get(..2).unwrap_or(&[])).ok().and_then(|hex| u8::from_str_radix(hex, 16).ok());
        match (first, code) {
            (b'%', Some(byte)) => {
                out.push(byte);
                rest = &behind[2..];
            }
            _ => {
                out.push(*first);
                rest = behind;
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}
