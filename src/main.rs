//! The camsim program.

fn main() -> std::process::ExitCode {
    hush_device_selection();
    camsim_cli::main()
}

/// Mesa's device-selection layer asks the desktop session which GPU to prefer; where there is no session it
/// only prints an error for each adapter it opens. camsim ranks adapters itself, so the layer is switched off
/// there.
#[expect(unsafe_code, reason = "the environment is changed before any thread exists")]
fn hush_device_selection() {
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() && std::env::var_os("NODEVICE_SELECT").is_none() {
        // SAFETY: first statement of main; no other thread runs that could read the environment.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}
