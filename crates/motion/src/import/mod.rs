//! Readers of motion capture formats: bytes in, an [`Animation`](crate::Animation) out.

mod deepmimic;

pub use deepmimic::deepmimic;
