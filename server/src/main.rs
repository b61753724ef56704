//! The program `retina-server`; what it does is in `retina_server::cli`.

use std::process::ExitCode;

fn main() -> ExitCode {
    retina_server::cli::main()
}
