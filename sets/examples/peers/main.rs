//! Certified hulls, supports, reductions and estimator steps beside what other tools take for the same sets.
//!
//! `benches/peers/run` calls it and adds the tools that have Python bindings. By hand:
//!
//! - `cargo run --release -p zonobench-sets --example peers -- measure FILE` writes the sets and prints the rows of
//!   this library and of clarabel as CSV;
//! - `… -- table FILE …` prints rows as ratios to ours.

mod interior_point;
mod ours;
mod plain;
mod sets;
mod table;
mod timing;

use sets::{Case, SIZES, Size, off};
use std::hint::black_box;
use std::process::ExitCode;
use timing::{HEADER, Row, Times, time};

const USAGE: &str = "expected `measure FILE` or `table FILE …`";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match arguments[..] {
        ["measure", file] => measure(file),
        ["table", ref files @ ..] if !files.is_empty() => table::print(files),
        _ => Err(format!("{USAGE}, got {arguments:?}")),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!("{fault}");
            ExitCode::from(2)
        }
    }
}

fn measure(file: &str) -> Result<(), String> {
    let all: Vec<(Size, Vec<Case>)> = SIZES
        .iter()
        .map(|&size| (size, sets::cases(size)))
        .collect();
    std::fs::write(file, sets::json(&all).to_string()).map_err(|e| format!("{file}: {e}"))?;
    println!("{HEADER}");
    for (size, cases) in all {
        ours::measure(size, &cases);
        clarabel(size, &cases);
        ours::closed_forms(size, &cases);
        ours::zonotope_steps(size, &cases);
    }
    Ok(())
}

fn clarabel(size: Size, cases: &[Case]) {
    let row = |operation, times: Times, hulls, remark| Row {
        tool: "clarabel",
        version: interior_point::VERSION,
        operation,
        size,
        times,
        hulls,
        remark,
    };
    let times = time(cases.len(), || {
        for case in cases {
            black_box(interior_point::hull(&case.set));
        }
    });
    let hulls = cases
        .iter()
        .map(|c| off(&interior_point::hull(&c.set), &c.ends));
    println!(
        "{}",
        row(
            "interval hull",
            times,
            hulls.collect(),
            "2n programs; one solver a set"
        )
    );
    let times = time(cases.len(), || {
        for case in cases {
            black_box(interior_point::support(&case.set, &case.direction));
        }
    });
    println!("{}", row("support", times, Vec::new(), ""));
}
