//! Sets `cfg(without_fma)` if scalar kernels are needed for x86-64 processors without fused multiply-add: with the
//! feature `baseline`, or if this very processor has none. Those kernels take a third of the compile time.

use std::env::var;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(without_fma)");
    let x86 = var("CARGO_CFG_TARGET_ARCH").is_ok_and(|arch| arch == "x86_64");
    let for_this_processor = var("TARGET").ok() == var("HOST").ok() && !has_fma();
    if x86 && (var("CARGO_FEATURE_BASELINE").is_ok() || for_this_processor) {
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
