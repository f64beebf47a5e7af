//! A hash of states, to compare bits across processors and browsers.

use fnv::FnvHasher;
use std::hash::Hasher;

/// FNV-1a over the bits of numbers, in little-endian order.
pub fn hash(numbers: impl IntoIterator<Item = f64>) -> u64 {
    let mut hasher = FnvHasher::default();
    for x in numbers {
        // the bits of NaN differ between engines
        let bits = if x.is_nan() { u64::MAX } else { x.to_bits() };
        hasher.write(&bits.to_le_bytes());
    }
    hasher.finish()
}
