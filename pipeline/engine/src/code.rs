//! The code that a stage can reach, as a part of its results' addresses.
//!
//! A stage can reach the sources of its crate and of every crate that this one stands on, and nothing else: the
//! compiler sees to that. So the hash is over whole crates, and nobody keeps a list. The compiler's version is not
//! in it, because the bits do not depend on it (`snapshots/bits.txt` pins them); `Cargo.toml` with its profiles and
//! `Cargo.lock` are.

#[cfg(test)]
#[path = "sources.rs"]
mod sources;

/// (crate, hash of its code).
const CODE: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/code.rs"));

/// The hash of the code of a crate of this workspace.
pub fn of(package: &str) -> &'static str {
    let (_, hash) = CODE
        .iter()
        .find(|(name, _)| *name == package)
        .expect("a stage is in a crate of the workspace");
    hash
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::path::{Path, PathBuf};
    use std::process::Command;

    const STAGES: [&str; 3] = [
        zonobench_lab::stage::CRATE,
        zonobench_verdicts::CRATE,
        zonobench_evidence::CRATE,
    ];

    fn root() -> PathBuf {
        let here = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        here.canonicalize().unwrap()
    }

    /// What cargo says that `package` stands on, of this workspace.
    fn according_to_cargo(package: &str) -> BTreeSet<String> {
        let tree = Command::new(env!("CARGO"))
            .args([
                "tree",
                "--offline",
                "--locked",
                "--edges",
                "normal,build",
                "--prefix",
                "none",
            ])
            .args(["--package", package])
            .current_dir(root())
            .output()
            .unwrap();
        assert!(
            tree.status.success(),
            "{}",
            String::from_utf8_lossy(&tree.stderr)
        );
        String::from_utf8(tree.stdout)
            .unwrap()
            .lines()
            .filter_map(|line| line.split(' ').next())
            .filter(|name| name.starts_with("zonobench"))
            .map(str::to_owned)
            .collect()
    }

    #[test]
    fn a_stage_reaches_the_crates_that_cargo_says() {
        let crates = sources::crates(&root());
        for stage in STAGES {
            assert_eq!(
                sources::reached(&crates, stage),
                according_to_cargo(stage),
                "{stage}"
            );
        }
    }

    #[test]
    fn a_byte_changed_in_any_source_that_a_stage_can_reach_moves_its_hash() {
        let crates = sources::crates(&root());
        for stage in STAGES {
            let files = sources::files(&root(), &crates, stage);
            // A copy of just these files, in which one byte after the other is changed.
            let copy = tempfile::tempdir().unwrap();
            let copied: Vec<PathBuf> = files
                .iter()
                .map(|file| copy.path().join(file.strip_prefix(root()).unwrap()))
                .collect();
            for (from, to) in files.iter().zip(&copied) {
                std::fs::create_dir_all(to.parent().unwrap()).unwrap();
                std::fs::copy(from, to).unwrap();
            }
            let whole = sources::digest(copy.path(), &copied);
            assert_eq!(whole, of(stage), "{stage}: built from other sources");
            for file in &copied {
                let bytes = std::fs::read(file).unwrap();
                let mut changed = bytes.clone();
                changed[bytes.len() / 2] ^= 1;
                std::fs::write(file, &changed).unwrap();
                assert_ne!(
                    sources::digest(copy.path(), &copied),
                    whole,
                    "{}",
                    file.display()
                );
                std::fs::write(file, &bytes).unwrap();
            }
        }
    }

    #[test]
    fn every_source_of_a_reached_crate_is_hashed() {
        let crates = sources::crates(&root());
        let files = sources::files(&root(), &crates, zonobench_lab::stage::CRATE);
        for reached in [
            "sets/src/number/interval.rs",
            "estimation/src/track.rs",
            "pipeline/lab/src/stage/mod.rs",
            "pipeline/lab/src/experiment/metric.rs",
            "pipeline/lake/src/table.rs",
            "Cargo.lock",
        ] {
            assert!(files.contains(&root().join(reached)), "{reached}");
        }
        // What is shown, and what is judged, moves no run.
        for other in ["pipeline/report", "pipeline/verdicts", "pipeline/query"] {
            assert!(
                files.iter().all(|f| !f.starts_with(root().join(other))),
                "{other}"
            );
        }
    }
}
