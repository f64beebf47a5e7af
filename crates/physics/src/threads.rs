//! Threads and processes, on platforms that have them and on those that do not (WebAssembly).

/// The number of threads that are used when `wanted` are asked for; 0 asks for one per processor. Always 1 on a platform without
/// threads, where results are the same.
pub fn threads(wanted: usize) -> usize {
    if cfg!(target_family = "wasm") {
        return 1;
    }
    match wanted {
        0 => std::thread::available_parallelism().map_or(1, |n| n.get()),
        n => n,
    }
}

/// The number of this process, or 0 on a platform without processes.
pub fn process_id() -> u32 {
    if cfg!(target_family = "wasm") { 0 } else { std::process::id() }
}
