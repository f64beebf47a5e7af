//! Checks of display and graphics before a window opens.

use crate::app::error::GameError;

/// Fails if there is no display to open a window on.
pub fn check_display() -> Result<(), GameError> {
    if cfg!(any(target_os = "windows", target_os = "macos")) {
        return Ok(());
    }
    let display = std::env::var("DISPLAY").unwrap_or_default();
    if display.is_empty() {
        return Err(GameError::NoDisplay("not set".into()));
    }
    // the socket of a display on this machine; the window system finds other displays
    let number = display.strip_prefix(':').map(|rest| rest.split('.').next().unwrap_or(rest).to_string());
    match number {
        Some(number) if !std::path::Path::new("/tmp/.X11-unix").join(format!("X{number}")).exists() => {
            Err(GameError::NoDisplay(format!("'{display}', where nothing answers")))
        }
        _ => Ok(()),
    }
}

/// Whether a processor draws. Fails if there is no graphics adapter.
pub fn check_graphics() -> Result<bool, GameError> {
    let instance = wgpu::Instance::default();
    let options = wgpu::RequestAdapterOptions::default();
    let adapter = bevy::tasks::block_on(instance.request_adapter(&options));
    let software = |adapter: wgpu::Adapter| adapter.get_info().device_type == wgpu::DeviceType::Cpu;
    adapter.map(software).map_err(|_| GameError::NoGraphics)
}
