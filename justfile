# Every command that a person types. `just` alone lists them.

zonobench := "cargo zonobench"

_list:
    @just --list --unsorted

# Rebuild every paper: lake, traces, tables, reports (--quick: a smoke run of under a minute)
reproduce-all *ARGS:
    cargo reproduce-all {{ ARGS }}

# All tests
test *ARGS:
    cargo test-all {{ ARGS }}

# Run the experiments, then accept or reject each snapshot that changed
review:
    #!/usr/bin/env bash
    set -euo pipefail
    if ! cargo insta --version >/dev/null 2>&1; then
        echo "just review needs cargo-insta: cargo install --locked cargo-insta" >&2
        exit 1
    fi
    CI= INSTA_UPDATE=new INSTA_FORCE_PASS=1 cargo test --package zonobench --test snapshots
    # cargo-insta looks below the folders of packages, and snapshots/ is beside them: a package that says it is there.
    package=$(mktemp -d)
    trap 'rm -rf "$package"' EXIT
    cat > "$package/Cargo.toml" <<EOF
    [package]
    name = "snapshots"
    version = "0.0.0"
    edition = "2024"
    [lib]
    path = "$PWD/snapshots/lib.rs"
    [workspace]
    EOF
    cargo insta review --manifest-path "$package/Cargo.toml"

# What CI runs, without the readers that it installs
check:
    .ci/run --local

# dist/*.whl: the Python package with the program, both in release (PROFILE=dev: what tests have compiled already)
wheel PROFILE="release":
    python/wheel {{ PROFILE }} dist

# Overheads of the Python package, and it beside ZonoOpt, as ratios of one run
bench-python *ARGS:
    python/benches/overheads.py {{ ARGS }}

# The bits of every estimator against snapshots/bits.txt: release, opt-level 1, x86-64-v3 (a minute or two each)
bits:
    .ci/bits

# Beside other tools on the same sets, two minutes (--ours: none installed; --record: writes reports/peers.csv)
bench *ARGS:
    benches/peers/run {{ ARGS }}

# Times of the costly operations, at the sizes that the papers use
criterion *ARGS:
    cargo bench -p zonobench-sets -p zonobench-estimation --bench '*' -- {{ ARGS }}

# Hostile linear programs and reductions against exact arithmetic, then changed TOML, CSV, JSON and Parquet, each for so many seconds from this seed
fuzz SECONDS="60" SEED="1":
    cargo run --quiet -p zonobench-sets --example fuzz -- {{ SECONDS }} {{ SEED }}
    ZONOBENCH_FUZZ_SECONDS={{ SECONDS }} ZONOBENCH_FUZZ_SEED={{ SEED }} cargo test --quiet -p zonobench --test inputs -- --ignored --nocapture

# Write reports/timings.csv from the lake and measure reports/step-times.csv, the only times that the committed reports show
record-timings LAKE="lake":
    #!/usr/bin/env bash
    set -euo pipefail
    processor=$(sed -n 's/^model name[^:]*: *//p' /proc/cpuinfo 2>/dev/null | head -n 1)
    processor=${processor:-$(sysctl -n machdep.cpu.brand_string 2>/dev/null || uname -m)}
    draft=$(mktemp)
    trap 'rm -f "$draft"' EXIT
    {{ zonobench }} query --lake '{{ LAKE }}' --format csv "
        SELECT paper, experiment, estimator, ROUND(MEDIAN(median_ns) / 1000.0, 3) AS median_step_us
        FROM timings GROUP BY paper, experiment, estimator ORDER BY paper, experiment, estimator" > "$draft"
    mkdir -p reports
    awk -v processor="${processor//,/ }" 'NR == 1 { print $0 ",processor"; next } { print $0 "," processor }' "$draft" > reports/timings.csv
    cargo run --quiet -p zonobench-estimation --example quadrotor_times > "$draft"
    awk -v processor="${processor//,/ }" 'NR == 1 { print $0 ",processor"; next } { print $0 "," processor }' "$draft" > reports/step-times.csv
    for file in timings step-times; do
        echo "$(($(wc -l < "reports/$file.csv") - 1)) rows in reports/$file.csv, on $processor"
    done
