//! Sixteen samples side by side: memory, the inner loops of networks, random streams.

pub mod buffer;
pub(crate) mod mirror;
pub mod noise;
pub(crate) mod tiles;

pub use marathon_envs::BLOCK;

/// Runs `$body` with `$T` bound to the single-precision lane type of an `Isa`.
macro_rules! f32_lanes {
    ($isa:expr, $T:ident => $body:expr) => {{
        use marathon_physics::lanes;
        match $isa {
            #[cfg(target_arch = "x86_64")]
            lanes::Isa::X16 => {
                type $T = lanes::F32x16;
                $body
            }
            #[cfg(target_arch = "x86_64")]
            lanes::Isa::X8 => {
                type $T = lanes::F32x8;
                $body
            }
            lanes::Isa::F32 => {
                type $T = f32;
                $body
            }
            _ => marathon_physics::with_baseline! {
                type $T = lanes::F32x4;
                $body
            },
        }
    }};
}
pub(crate) use f32_lanes;
