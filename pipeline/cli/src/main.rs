//! The program `zonobench`.

use std::process::ExitCode;

fn main() -> ExitCode {
    zonobench::cli::main()
}
