//! The program as it ships, built with the tests so that they can start it as a process of its own and send it signals.

use std::process::ExitCode;

fn main() -> ExitCode {
    retina_server::cli::main()
}
