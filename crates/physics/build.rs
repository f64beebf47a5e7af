//! Sets `cfg(without_fma)` where scalar kernels do not ask the processor for fused multiply-add: on all processors but
//! x86-64, and there with the feature `baseline` or if this very processor has none. On x86-64, those kernels take a third
//! of the compile time.

use std::env::var;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(without_fma)");
    let x86 = var("CARGO_CFG_TARGET_ARCH").is_ok_and(|arch| arch == "x86_64");
    let for_this_processor = var("TARGET").ok() == var("HOST").ok() && !has_fma();
    if !x86 || var("CARGO_FEATURE_BASELINE").is_ok() || for_this_processor {
        println!("cargo::rustc-cfg=without_fma");
    }
}

/// Whether the processor of this build has fused multiply-add.
fn has_fma() -> bool {
    #[cfg(target_arch = "x86_64")]
    return std::arch::is_x86_feature_detected!("fma");
    #[cfg(not(target_arch = "x86_64"))]
    return true;
}
