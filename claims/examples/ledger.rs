//! Prints the ledger: `cargo run -p zonobench-claims --example ledger [PAPER]`.

fn main() {
    let wanted = std::env::args().nth(1);
    for claim in zonobench_claims::all() {
        if wanted.as_ref().is_some_and(|w| w != claim.paper) {
            continue;
        }
        let started = std::time::Instant::now();
        let o = claim.outcome();
        println!(
            "{:8} {:28} {:15} {:6}/{:<5} rep {}/{} {:.2}s {}",
            claim.paper,
            claim.id,
            o.verdict.name(),
            o.lost,
            o.trials,
            o.repaired_lost,
            o.repaired_trials,
            started.elapsed().as_secs_f64(),
            o.counterexample
        );
    }
}
