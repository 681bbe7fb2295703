//! Which sources a crate of this workspace is made of: its own, and those of every crate that it stands on.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// The folders of all crates of the workspace at `root`, by name, in order of name.
pub fn crates(root: &Path) -> Vec<(String, PathBuf)> {
    let manifest =
        fs::read_to_string(root.join("Cargo.toml")).expect("the workspace has a Cargo.toml");
    let mut crates: Vec<(String, PathBuf)> = manifest
        .lines()
        .filter_map(|line| {
            let (name, rest) = line.split_once(" = { path = \"")?;
            Some((name.to_owned(), root.join(rest.split_once('"')?.0)))
        })
        .collect();
    crates.sort();
    crates
}

/// The names of `start` and of every crate of the workspace that it stands on, in order.
pub fn reached(crates: &[(String, PathBuf)], start: &str) -> BTreeSet<String> {
    let mut reached = BTreeSet::new();
    let mut open = vec![start.to_owned()];
    while let Some(name) = open.pop() {
        if let Some((_, folder)) = crates.iter().find(|(n, _)| *n == name)
            && reached.insert(name)
        {
            open.extend(dependencies(folder));
        }
    }
    reached
}

/// The names below `[dependencies]` and `[build-dependencies]` of the crate in `folder`.
fn dependencies(folder: &Path) -> Vec<String> {
    let manifest = fs::read_to_string(folder.join("Cargo.toml")).expect("a crate has a Cargo.toml");
    let mut section = "";
    let mut names = Vec::new();
    for line in manifest.lines() {
        if line.starts_with('[') {
            section = line.trim();
        } else if matches!(section, "[dependencies]" | "[build-dependencies]")
            && let Some(end) = line.find(['.', ' ', '='])
        {
            names.push(line[..end].to_owned());
        }
    }
    names
}

/// The files that the code of crate `start` is made of: `src`, `Cargo.toml` and `build.rs` of every crate that it
/// reaches, and the workspace's `Cargo.toml` (profiles, features) and `Cargo.lock`; in order of path.
pub fn files(root: &Path, crates: &[(String, PathBuf)], start: &str) -> Vec<PathBuf> {
    let mut files = vec![root.join("Cargo.toml"), root.join("Cargo.lock")];
    for name in reached(crates, start) {
        let (_, folder) = crates
            .iter()
            .find(|(n, _)| *n == name)
            .expect("a reached crate is one of them");
        for part in ["src", "Cargo.toml", "build.rs"] {
            walk(&folder.join(part), &mut files);
        }
    }
    files.sort();
    files
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

/// BLAKE3 over the names, relative to `root`, and the bytes of `files`, in hexadecimal.
pub fn digest(root: &Path, files: &[PathBuf]) -> String {
    let mut hasher = blake3::Hasher::new();
    for file in files {
        let name = file
            .strip_prefix(root)
            .expect("sources lie in the workspace");
        let bytes = fs::read(file).expect("a source file can be read");
        hasher.update(name.to_string_lossy().replace('\\', "/").as_bytes());
        hasher.update(&[0]);
        hasher.update(&(bytes.len() as u64).to_le_bytes());
        hasher.update(&bytes);
    }
    hasher.finalize().to_hex().to_string()
}
