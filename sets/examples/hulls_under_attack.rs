//! Takes the hulls of many sets that have a known exact point and counts those that cut it off.
//!
//! `cargo run -p zonobench-sets --example hulls_under_attack -- 100000 7` takes 100,000 sets from seed 7.

#[path = "../tests/attack/mod.rs"]
mod attack;

fn main() {
    let mut arguments = std::env::args().skip(1).map(|a| a.parse::<u64>());
    let mut number = |default| arguments.next().and_then(Result::ok).unwrap_or(default);
    let (sets, seed) = (number(100_000), number(7));
    let report = attack::attack(sets, seed);
    println!(
        "{} of {} hulls cut off a point of their set",
        report.cut_off, report.sets
    );
    println!("{report:?}");
    if report.cut_off + report.called_empty > 0 {
        std::process::exit(1);
    }
}
