//! The camsim program.
fn main() -> std::process::ExitCode {
    camsim_cli::main()
}
