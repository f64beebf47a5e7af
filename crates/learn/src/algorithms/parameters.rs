//! Places of the parameters of several networks in one array.

use crate::lanes::BLOCK;
use std::ops::Range;

/// Gradient elements whose squares are summed together.
const NORM_BLOCK: usize = 1024;

/// Places of networks in one array. Each is padded with zeros to rows of sixteen.
#[derive(Clone, Debug, Default)]
pub struct Places {
    starts: Vec<usize>,
    len: usize,
}

impl Places {
    /// Adds a network of `count` parameters and returns its place.
    pub fn add(&mut self, count: usize) -> Range<usize> {
        let start = self.len;
        self.starts.push(start);
        self.len = (start + count).next_multiple_of(BLOCK);
        start..start + count
    }
    /// Length of the array.
    pub fn total(&self) -> usize {
        self.len
    }
    /// Number of networks.
    pub fn count(&self) -> usize {
        self.starts.len()
    }
    /// Pieces of the array whose squares are summed together, with the index of their network.
    pub fn pieces(&self) -> Vec<(usize, Range<usize>)> {
        let ends = self.starts.iter().skip(1).copied().chain([self.len]);
        let of = |(network, (start, end)): (usize, (&usize, usize))| {
            let cut = (*start..end).step_by(NORM_BLOCK);
            cut.map(move |i| (network, i..(i + NORM_BLOCK).min(end))).collect::<Vec<_>>()
        };
        self.starts.iter().zip(ends).enumerate().flat_map(of).collect()
    }
}
