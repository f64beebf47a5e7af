//! Memory for blocks: numbers in rows of sixteen, one row per feature, aligned to a cache line.

use crate::lanes::BLOCK;

/// A flat array that starts on a cache line, so that a sixteen-lane load never touches two.
pub struct Aligned<S> {
    data: Vec<S>,
    start: usize,
    len: usize,
}

impl<S: Copy + Default> Aligned<S> {
    /// `len` zeros.
    pub fn new(len: usize) -> Self {
        const LINE: usize = 64;
        let data = vec![S::default(); len + LINE / size_of::<S>()];
        // moving the vector does not move its heap block, which is never resized
        let start = (LINE - data.as_ptr() as usize % LINE) % LINE / size_of::<S>();
        Self { data, start, len }
    }
    /// `rows` rows of sixteen zeros.
    pub fn rows(rows: usize) -> Self {
        Self::new(rows * BLOCK)
    }
    /// All rows of sixteen.
    #[inline(always)]
    pub fn as_rows(&self) -> &[[S; BLOCK]] {
        self.as_chunks::<BLOCK>().0
    }
    /// All rows of sixteen.
    #[inline(always)]
    pub fn as_rows_mut(&mut self) -> &mut [[S; BLOCK]] {
        self.as_chunks_mut::<BLOCK>().0
    }
}

impl<S> std::ops::Deref for Aligned<S> {
    type Target = [S];
    #[inline(always)]
    fn deref(&self) -> &[S] {
        &self.data[self.start..self.start + self.len]
    }
}

impl<S> std::ops::DerefMut for Aligned<S> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [S] {
        &mut self.data[self.start..self.start + self.len]
    }
}

/// A chunk of blocks in the layout `[block][feature][16]`, the work space of a network.
///
/// The stride between blocks is an odd number of rows. With a power of two, the same feature of every block would
/// compete for one set of the first-level cache.
pub struct Blocks<S> {
    data: Aligned<S>,
    features: usize,
    stride: usize,
}

impl<S: Copy + Default> Blocks<S> {
    /// Creates `blocks` blocks of `features` features, filled with zeros.
    pub fn new(blocks: usize, features: usize) -> Self {
        let stride = features | 1;
        Self { data: Aligned::rows(blocks * stride), features, stride }
    }
    /// Number of features.
    pub fn features(&self) -> usize {
        self.features
    }
    /// Rows from one block to the next.
    #[inline(always)]
    pub fn stride(&self) -> usize {
        self.stride
    }
    /// All rows, padding included.
    #[inline(always)]
    pub fn as_rows(&self) -> &[[S; BLOCK]] {
        self.data.as_rows()
    }
    /// All rows, padding included.
    #[inline(always)]
    pub fn as_rows_mut(&mut self) -> &mut [[S; BLOCK]] {
        self.data.as_rows_mut()
    }
    /// One block, `[feature][16]`.
    #[inline(always)]
    pub fn block(&self, block: usize) -> &[S] {
        &self.data[block * self.stride * BLOCK..][..self.features * BLOCK]
    }
    /// One block, `[feature][16]`.
    #[inline(always)]
    pub fn block_mut(&mut self, block: usize) -> &mut [S] {
        &mut self.data[block * self.stride * BLOCK..][..self.features * BLOCK]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buffers_start_on_a_cache_line() {
        for len in [1, 15, 16, 1000, 1 << 20] {
            let (a, b) = (Aligned::<f32>::new(len), Aligned::<f64>::new(len));
            assert_eq!((a.as_ptr() as usize % 64, a.len()), (0, len));
            assert_eq!((b.as_ptr() as usize % 64, b.len()), (0, len));
        }
    }
}
