//! Parse, run, exit status; nothing else.

fn main() -> std::process::ExitCode {
    penombre::cli::run()
}
