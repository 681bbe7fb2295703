//! Embeds the published experiments and the hashes of the code that each stage can reach.
//!
//! A stage's results are addressed by its input and its code. The code of a stage is the source of
//! `sets` and `estimation` where it uses them, the pipeline files named below, and Cargo.lock. All of it
//! is watched: a stale hash would serve wrong results in silence.

use std::fs;
use std::path::{Path, PathBuf};

const TABLES: &[&str] = &["rows.rs", "table.rs"];

/// What the stages that estimate can reach outside the pipeline.
const MATHEMATICS: &[&str] = &["sets/src", "estimation/src"];

/// Stage, what it reaches outside the pipeline, and the pipeline's files that it runs.
const STAGES: &[(&str, &[&str], &[&str])] = &[
    (
        "SIMULATE",
        MATHEMATICS,
        &["stage/simulate.rs", "experiment"],
    ),
    ("ESTIMATE", MATHEMATICS, &["stage/estimate.rs"]),
    ("TRACE", MATHEMATICS, &["stage/trace.rs", "trace"]),
    ("REDUCE", MATHEMATICS, &["stage/reduce.rs"]),
    (
        "ATTACK",
        &["sets/src", "estimation/src", "attack/src"],
        &["stage/attack.rs"],
    ),
    (
        "COUNT",
        &["sets/src", "estimation/src", "complexity/src"],
        &["stage/count.rs"],
    ),
    ("SCORE", &[], &["stage/score.rs", "statistics.rs"]),
    (
        "COMPARE",
        &[],
        &["stage/compare", "statistics.rs", "published", "verdict.rs"],
    ),
    (
        "CLAIMS",
        &["claims/src", "estimation/src/random.rs"],
        &["stage/claims.rs"],
    ),
];

fn main() {
    let here = PathBuf::from(std::env::var("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    let root = here
        .parent()
        .expect("the crate lies in the workspace")
        .to_owned();
    for (stage, reached, files) in STAGES {
        let mut sources = vec![root.join("Cargo.lock")];
        sources.extend(reached.iter().map(|folder| root.join(folder)));
        sources.extend(
            TABLES
                .iter()
                .chain(files.iter())
                .map(|f| here.join("src").join(f)),
        );
        println!(
            "cargo:rustc-env=ZONOBENCH_CODE_{stage}={}",
            digest(&root, &sources)
        );
    }
    embed_experiments(&root.join("experiments"));
    for watched in [
        "sets/src",
        "estimation/src",
        "attack/src",
        "claims/src",
        "complexity/src",
        "pipeline/src",
        "experiments",
        "Cargo.lock",
    ] {
        println!("cargo:rerun-if-changed={}", root.join(watched).display());
    }
}

/// All files below `path` (or `path` itself, with or without `.rs`), in a fixed order.
fn walk(path: &Path, out: &mut Vec<PathBuf>) {
    if path.is_dir() {
        let mut entries: Vec<PathBuf> = fs::read_dir(path)
            .expect("a source folder can be listed")
            .map(|e| e.expect("readable").path())
            .collect();
        entries.sort();
        for entry in entries {
            walk(&entry, out);
        }
    } else if path.is_file() {
        out.push(path.to_owned());
    }
}

fn digest(root: &Path, sources: &[PathBuf]) -> String {
    let mut files = Vec::new();
    for source in sources {
        walk(source, &mut files);
        walk(&source.with_extension("rs"), &mut files);
    }
    files.sort();
    files.dedup();
    let mut hasher = blake3::Hasher::new();
    for file in files {
        let name = file
            .strip_prefix(root)
            .expect("sources lie in the workspace");
        hasher.update(name.to_string_lossy().replace('\\', "/").as_bytes());
        hasher.update(&[0]);
        hasher.update(&fs::read(&file).expect("a source file can be read"));
        hasher.update(&[0]);
    }
    hasher.finalize().to_hex().to_string()
}

/// `EXPERIMENT_FILES`: (path below `experiments/`, text) of every TOML and CSV file.
fn embed_experiments(folder: &Path) {
    let mut files = Vec::new();
    walk(folder, &mut files);
    let mut code = String::from("&[\n");
    for file in files
        .iter()
        .filter(|f| f.extension().is_some_and(|e| e == "toml" || e == "csv"))
    {
        let name = file
            .strip_prefix(folder)
            .expect("walked from there")
            .to_string_lossy()
            .replace('\\', "/");
        code += &format!(
            "    ({name:?}, include_str!({:?})),\n",
            file.display().to_string()
        );
    }
    code += "]\n";
    let out = PathBuf::from(std::env::var("OUT_DIR").expect("cargo sets it"));
    fs::write(out.join("experiment_files.rs"), code).expect("the build folder can be written");
}
