//! Constants of a graph, and their memory.

use super::proto::{DOUBLE, FLOAT, INT64, Tensor};
use marathon_physics::budget::{self, OverBudget};
use std::borrow::Cow;
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::rc::Rc;

/// Number of copies of each number while a network becomes a policy.
const COPIES: f64 = 6.0;

/// The external files with the numbers of large tensors (PyTorch writes `model.onnx.data`). It counts all numbers that
/// are read and computed, because a small file can refer to the same large tensor many times.
pub struct Neighbors {
    folder: PathBuf,
    read: RefCell<BTreeMap<String, Rc<Vec<u8>>>>,
    numbers: Cell<f64>,
}

impl Neighbors {
    /// The neighbors of a model's file.
    pub fn of(model: &Path) -> Self {
        let folder = model.parent().unwrap_or(Path::new("")).into();
        Neighbors { folder, read: RefCell::default(), numbers: Cell::new(0.0) }
    }

    /// Counts numbers before or after they are allocated.
    ///
    /// # Errors
    /// If all counted numbers together exceed the memory limit.
    pub fn count(&self, numbers: usize) -> Result<(), OverBudget> {
        self.numbers.set(self.numbers.get() + numbers as f64);
        budget::MEMORY.check(COPIES * size_of::<f64>() as f64 * self.numbers.get())
    }

    /// Reads the numbers of a tensor as bytes.
    fn bytes(&self, tensor: &Tensor) -> Result<Vec<u8>, String> {
        let entry = |key: &str| tensor.external_data.iter().find(|e| e.key == key).map(|e| e.value.as_str());
        let number = |key: &str| entry(key).map(str::parse::<usize>).transpose();
        let name = entry("location").unwrap_or_default();
        let mut parts = Path::new(name).components();
        // a model must not read files elsewhere
        if !matches!((parts.next(), parts.next()), (Some(Component::Normal(_)), None)) {
            return Err(format!("tensor '{}' in file '{name}', expected one in the model's folder", tensor.name));
        }
        if !self.read.borrow().contains_key(name) {
            let bytes = budget::read(&self.folder.join(name), &budget::POLICY_FILE)
                .map_err(|e| format!("tensor '{}' in file '{name}' beside the model's: {e}", tensor.name))?;
            self.read.borrow_mut().insert(name.into(), Rc::new(bytes));
        }
        let bytes = self.read.borrow()[name].clone();
        let (Ok(offset), Ok(length)) = (number("offset"), number("length")) else {
            return Err(format!("tensor '{}' at a place of file '{name}' that is not a number", tensor.name));
        };
        let rest = bytes.get(offset.unwrap_or(0)..);
        let part = rest.and_then(|rest| rest.get(..length.unwrap_or(rest.len())));
        let part = part.ok_or_else(|| format!("tensor '{}' beyond the end of file '{name}'", tensor.name))?;
        self.count(part.len() / size_of::<f32>()).map_err(|e| format!("tensor '{}' {e}", tensor.name))?;
        Ok(part.to_vec())
    }
}

/// A constant array, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    pub shape: Vec<usize>,
    pub data: Vec<f64>,
}

impl Array {
    /// A single number.
    pub fn scalar(x: f64) -> Self {
        Array { shape: Vec::new(), data: vec![x] }
    }

    /// Reads a tensor of the file, or of a file in the same folder. The error says what is wrong with it.
    pub fn read(tensor: &Tensor, neighbors: &Neighbors) -> Result<Self, String> {
        let raw = match tensor.data_location {
            0 => Cow::Borrowed(&tensor.raw_data),
            _ => Cow::Owned(neighbors.bytes(tensor)?),
        };
        let listed = tensor.float_data.len().max(tensor.double_data.len()).max(tensor.int64_data.len());
        neighbors.count(listed.max(raw.len() / 4)).map_err(|e| format!("tensor '{}' {e}", tensor.name))?;
        let data: Vec<f64> = match tensor.data_type {
            FLOAT if raw.is_empty() => tensor.float_data.iter().map(|x| f64::from(*x)).collect(),
            FLOAT => raw.as_chunks().0.iter().map(|x| f64::from(f32::from_le_bytes(*x))).collect(),
            DOUBLE if raw.is_empty() => tensor.double_data.clone(),
            DOUBLE => raw.as_chunks().0.iter().map(|x| f64::from_le_bytes(*x)).collect(),
            INT64 if raw.is_empty() => tensor.int64_data.iter().map(|x| *x as f64).collect(),
            INT64 => raw.as_chunks().0.iter().map(|x| i64::from_le_bytes(*x) as f64).collect(),
            other => {
                let expected = "float, double or int64 (1, 11 or 7)";
                return Err(format!("tensor '{}' of ONNX's data type {other}, expected {expected}", tensor.name));
            }
        };
        let shape: Option<Vec<usize>> = tensor.dims.iter().map(|n| usize::try_from(*n).ok()).collect();
        let count = shape.as_ref().and_then(|s| s.iter().try_fold(1_usize, |n, d| n.checked_mul(*d)));
        match (shape, count) {
            (Some(shape), Some(count)) if count == data.len() => Ok(Array { shape, data }),
            _ => Err(format!("tensor '{}' of shape {:?} with {} numbers", tensor.name, tensor.dims, data.len())),
        }
    }

    /// The number of an array with a single element.
    pub fn single(&self) -> Option<f64> {
        if let [x] = self.data[..] { Some(x) } else { None }
    }

    /// The numbers as a list of length `n`: a single number is repeated.
    pub fn spread(&self, n: usize) -> Option<Vec<f64>> {
        match self.single() {
            Some(x) => Some(vec![x; n]),
            // ones before the last dimension do not matter
            None => (self.data.len() == n && self.shape.last() == Some(&n)).then(|| self.data.clone()),
        }
    }

    /// Rows and columns, if the array is a matrix.
    pub fn matrix(&self) -> Option<(usize, usize)> {
        if let [rows, columns] = self.shape[..] { Some((rows, columns)) } else { None }
    }

    /// The transposed matrix.
    pub fn transposed(&self) -> Option<Array> {
        let (rows, columns) = self.matrix()?;
        let data = (0..rows * columns).map(|i| self.data[i % rows * columns + i / rows]).collect();
        Some(Array { shape: vec![columns, rows], data })
    }

    /// Applies a function to every number.
    pub fn map(&self, f: impl Fn(f64) -> f64) -> Array {
        Array { shape: self.shape.clone(), data: self.data.iter().map(|x| f(*x)).collect() }
    }

    /// Combines two arrays elementwise. The other one has the same shape or a single number.
    pub fn zip(&self, other: &Array, f: impl Fn(f64, f64) -> f64) -> Option<Array> {
        match (self.single(), other.single()) {
            (_, Some(b)) => Some(self.map(|a| f(a, b))),
            (Some(a), None) => Some(other.map(|b| f(a, b))),
            (None, None) if self.shape == other.shape => {
                let data = self.data.iter().zip(&other.data).map(|(a, b)| f(*a, *b)).collect();
                Some(Array { shape: self.shape.clone(), data })
            }
            _ => None,
        }
    }
}
