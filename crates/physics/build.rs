//! Sets `cfg(without_fma)` where scalar kernels do not ask the processor for fused multiply-add: on all processors but
//! x86-64, and there with the feature `baseline` or if this very processor has none. On x86-64, those kernels take a third
//! of the compile time.
//!
//! Sets `cfg(vectors = "...")`: the 128-bit vectors that every processor of the target has.
//!
//! Sets `cfg(one_lane_type)` for web pages: four lanes are the only ones. Each further type doubles what a visitor downloads.

use std::env::var;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(without_fma)");
    println!("cargo::rustc-check-cfg=cfg(vectors, values(\"sse2\", \"neon\", \"simd128\", \"relaxed\", \"none\"))");
    println!("cargo::rustc-check-cfg=cfg(one_lane_type)");
    println!("cargo::rustc-cfg=vectors=\"{}\"", vectors());
    let page = var("CARGO_CFG_TARGET_ARCH").is_ok_and(|arch| arch == "wasm32")
        && var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "unknown");
    if page && vectors() != "none" {
        println!("cargo::rustc-cfg=one_lane_type");
    }
    let x86 = var("CARGO_CFG_TARGET_ARCH").is_ok_and(|arch| arch == "x86_64");
    let for_this_processor = var("TARGET").ok() == var("HOST").ok() && !has_fma();
    if !x86 || var("CARGO_FEATURE_BASELINE").is_ok() || for_this_processor {
        println!("cargo::rustc-cfg=without_fma");
    }
}

/// The 128-bit vectors of the target.
fn vectors() -> &'static str {
    let features = var("CARGO_CFG_TARGET_FEATURE").unwrap_or_default();
    let has = |feature| features.split(',').any(|f| f == feature);
    match var("CARGO_CFG_TARGET_ARCH").unwrap_or_default().as_str() {
        "x86_64" => "sse2",
        "aarch64" if has("neon") => "neon",
        "wasm32" if has("relaxed-simd") => "relaxed",
        "wasm32" if has("simd128") => "simd128",
        _ => "none",
    }
}

/// Whether the processor of this build has fused multiply-add.
fn has_fma() -> bool {
    #[cfg(target_arch = "x86_64")]
    return std::arch::is_x86_feature_detected!("fma");
    #[cfg(not(target_arch = "x86_64"))]
    return true;
}
