//! Embeds the published experiments, so that the program works without the repository.

use std::fs;
use std::path::{Path, PathBuf};

fn main() {
    let here = PathBuf::from(std::env::var("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    let experiments = here.join("../../experiments");
    embed_experiments(&experiments);
    println!("cargo:rerun-if-changed={}", experiments.display());
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

/// `EXPERIMENT_FILES`: (path below `experiments/`, text) of every TOML and CSV file but the pages' `figures.toml`.
fn embed_experiments(folder: &Path) {
    let mut files = Vec::new();
    walk(folder, &mut files);
    let mut code = String::from("&[\n");
    for file in files
        .iter()
        .filter(|f| f.extension().is_some_and(|e| e == "toml" || e == "csv"))
        .filter(|f| f.file_name().is_some_and(|name| name != "figures.toml"))
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
