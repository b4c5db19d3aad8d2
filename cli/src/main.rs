//! The `plcc` binary.

use std::process::ExitCode;

fn main() -> ExitCode {
    plcc::main()
}
