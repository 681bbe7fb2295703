//! The program as a user meets it: started in a folder of its own, judged by its exit code, what it
//! prints, and the files that it leaves.

// Each test file uses its part of this.
#![allow(dead_code)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// An experiment with a sweep of everything: three estimators, sets, traces, metrics, in a fraction of a second.
pub const SMALL: &str = r#"schema = 1
paper = "mine"
id = "small"
seed = 7
runs = 40
steps = 60

[system]
kind = "linear"
a = [[0.9, 1.0], [0.0, 0.8]]
c = [[-22.0, 1.0]]

[prior]
box = [[-10.0, 10.0], [-10.0, 10.0]]
covariance = [[10.0, 0.0], [0.0, 10.0]]

[noise]
w = { box = [[-1.0, 1.0], [-1.0, 1.0]], covariance = [[0.12, 0.0], [0.0, 0.12]] }
v = { box = [[-1.0, 1.0]], covariance = [[0.12]] }

[truth]
x0 = [5.0, 5.0]
w = { law = "gaussian", truncate = "box" }
v = { law = "gaussian", truncate = "box" }

[[estimator]]
id = "kf"
kind = "kalman"

[[estimator]]
id = "box"
kind = "box-state-est"

[[estimator]]
id = "mixed"
kind = "ezgkf"
phi = 20
eta = 0.5
alpha = 0.01

[[metric]]
name = "rmse"
from = 1

[[metric]]
name = "contains"

[output]
sets = [0, 4, 60]
traces = true
"#;

/// The stage results of [`SMALL`]: simulate, reduce, score, and estimate and trace of each estimator.
pub const RESULTS: usize = 9;

/// A folder to run the program in, removed in the end.
pub struct Folder {
    folder: tempfile::TempDir,
}

impl Folder {
    /// An empty folder.
    pub fn new() -> Self {
        Self {
            folder: tempfile::tempdir().unwrap(),
        }
    }

    /// A folder with `small.toml`.
    pub fn with_small() -> Self {
        let folder = Self::new();
        folder.write("small.toml", SMALL);
        folder
    }

    /// Where `name` lies in it.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), content).unwrap();
    }

    /// The program, to be started in this folder.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_zonobench"));
        command
            .args(arguments)
            .current_dir(self.folder.path())
            .stdin(Stdio::null());
        command
    }

    /// Runs the program to its end.
    pub fn run(&self, arguments: &[&str]) -> Outcome {
        Outcome::of(
            &arguments.join(" "),
            self.command(arguments).output().unwrap(),
        )
    }

    /// Runs the program, which must succeed.
    pub fn done(&self, arguments: &[&str]) -> Outcome {
        self.run(arguments).ends_with(0)
    }

    /// The files that the manifest of `lake` vouches for and the manifest itself, with their contents.
    pub fn vouched(&self, lake: &str) -> BTreeMap<String, Vec<u8>> {
        let lake = self.path(lake);
        let mut files: BTreeMap<String, Vec<u8>> = manifest(&lake)
            .into_iter()
            .map(|path| (path.clone(), read(&lake.join(path))))
            .collect();
        files.insert("MANIFEST.json".into(), read(&lake.join("MANIFEST.json")));
        files
    }
}

fn read(path: &Path) -> Vec<u8> {
    std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The paths that the manifest of `lake` lists.
pub fn manifest(lake: &Path) -> Vec<String> {
    let manifest: serde_json::Value =
        serde_json::from_slice(&read(&lake.join("MANIFEST.json"))).unwrap();
    let files = manifest["files"].as_array().unwrap();
    files
        .iter()
        .map(|entry| entry["path"].as_str().unwrap().to_owned())
        .collect()
}

/// Asserts that two lakes hold the same bytes, and names the files that differ.
pub fn assert_same(
    what: &str,
    got: &BTreeMap<String, Vec<u8>>,
    expected: &BTreeMap<String, Vec<u8>>,
) {
    let differing: Vec<&String> = got
        .keys()
        .chain(expected.keys())
        .filter(|path| got.get(*path) != expected.get(*path))
        .collect();
    assert!(differing.is_empty(), "{what}: {differing:?} differ");
}

/// The files below `folder`.
pub fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        match entry.file_type() {
            Ok(kind) if kind.is_dir() => found.extend(files_below(&entry.path())),
            _ => found.push(entry.path()),
        }
    }
    found.sort();
    found
}

/// How a run of the program ended.
#[derive(Debug)]
pub struct Outcome {
    /// The arguments, for messages.
    pub arguments: String,
    /// The exit code; None after a signal.
    pub code: Option<i32>,
    /// Standard output.
    pub stdout: String,
    /// Standard error.
    pub stderr: String,
}

impl Outcome {
    /// From what the system collected.
    pub fn of(arguments: &str, output: Output) -> Self {
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        Self {
            arguments: arguments.to_owned(),
            code: output.status.code(),
            stdout: text(&output.stdout),
            stderr: text(&output.stderr),
        }
    }

    /// Asserts the exit code.
    pub fn ends_with(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "{self:#?}");
        self
    }

    /// Asserts that standard error has all of `parts`.
    pub fn says(self, parts: &[&str]) -> Self {
        for part in parts {
            assert!(
                self.stderr.contains(part),
                "no {part:?} in {}\n{}",
                self.arguments,
                self.stderr
            );
        }
        assert!(!self.stderr.contains("panicked"), "{}", self.stderr);
        self
    }

    /// (results made, results found), as the program says of an experiment.
    pub fn tally(&self) -> (usize, usize) {
        let mut sum = (0, 0);
        for line in self.stderr.lines() {
            let Some((made, rest)) = line.split_once(" results made, ") else {
                continue;
            };
            let made = made.rsplit(' ').next().unwrap();
            sum.0 += made.parse::<usize>().unwrap();
            sum.1 += rest.split(' ').next().unwrap().parse::<usize>().unwrap();
        }
        assert_ne!(sum, (0, 0), "{self:#?}");
        sum
    }
}
