//! Clocks for reports. Nothing that is learned depends on them.

/// Seconds of processor time that this thread has used.
pub fn thread_cpu() -> f64 {
    #[cfg(any(unix, windows))]
    {
        cpu_time::ThreadTime::try_now().map_or(0.0, |t| t.as_duration().as_secs_f64())
    }
    #[cfg(not(any(unix, windows)))]
    {
        0.0
    }
}

/// Seconds since an arbitrary moment.
pub fn wall() -> f64 {
    #[cfg(any(unix, windows))]
    {
        use std::{sync::OnceLock, time::Instant};
        static START: OnceLock<Instant> = OnceLock::new();
        START.get_or_init(Instant::now).elapsed().as_secs_f64()
    }
    #[cfg(not(any(unix, windows)))]
    {
        0.0
    }
}
