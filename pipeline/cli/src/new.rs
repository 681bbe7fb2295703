//! A first experiment file: commented, and right as it stands.

use clap::ValueEnum;
use std::fs::OpenOptions;
use std::io::{ErrorKind, Write as _};
use std::path::Path;
use zonobench_lake::error::Error;

/// What the file is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum System {
    /// Equations x+ = next(x, u, w): a pendulum with drag and a distance sensor
    Equations,
    /// A differential equation and a method that makes steps of it: a tank
    Rate,
    /// Matrices A, B, C: a cart, for a Kalman filter and a box observer
    Linear,
    /// Matrices that vary within bounds: two tanks
    Lpv,
}

impl System {
    /// The text for an experiment called `name`.
    pub fn text(self, name: &str) -> String {
        let template = match self {
            Self::Equations => include_str!("templates/equations.toml"),
            Self::Rate => include_str!("templates/rate.toml"),
            Self::Linear => include_str!("templates/linear.toml"),
            Self::Lpv => include_str!("templates/lpv.toml"),
        };
        template.replacen("id     = \"NAME\"", &format!("id     = {name:?}"), 1)
    }
}

/// The experiment's id in a file of this name: its letters and digits, else `mine`.
fn id(file: &Path) -> String {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    let kept = stem.to_lowercase();
    let kept: String = kept
        .chars()
        .map(|c| match c.is_ascii_alphanumeric() || c == '_' {
            true => c,
            false => '-',
        })
        .take(40)
        .collect();
    let kept = kept.trim_start_matches(|c: char| !c.is_ascii_lowercase());
    // Names that readers of the lake take for something else.
    match kept {
        "" | "inf" | "infinity" | "epoch" | "true" | "false" => "mine".to_owned(),
        kept => kept.to_owned(),
    }
}

/// Writes the file; over one that is there only if `force`.
pub fn write(file: &Path, system: System, force: bool) -> Result<(), Error> {
    let mut options = OpenOptions::new();
    options.write(true);
    match force {
        true => options.create(true).truncate(true),
        false => options.create_new(true),
    };
    let mut out = options.open(file).map_err(|error| match error.kind() {
        ErrorKind::AlreadyExists => Error::Refused {
            what: file.display().to_string(),
            expected: "a name without a file, or --force to write over it".to_owned(),
            got: "a file that is there".to_owned(),
        },
        _ => Error::io("write", file, error),
    })?;
    out.write_all(system.text(&id(file)).as_bytes())
        .map_err(|error| Error::io("write", file, error))
}

#[cfg(test)]
mod tests {
    use super::*;
    use zonobench_lab::experiment::Experiment;

    #[test]
    fn a_file_is_called_after_its_name() {
        let of = |name: &str| id(Path::new(name));
        assert_eq!(of("a/b/Pendulum.toml"), "pendulum");
        assert_eq!(of("my pendulum 2.toml"), "my-pendulum-2");
        assert_eq!(of("2nd.toml"), "nd");
        for name in ["123.toml", "inf.toml", "", "..", "été/日本.toml"] {
            assert_eq!(of(name), "mine", "{name}");
        }
    }

    #[test]
    fn every_template_is_an_experiment_without_a_warning() {
        for system in System::value_variants() {
            let text = system.text("some-name");
            let all = Experiment::parse("new.toml", &text)
                .unwrap_or_else(|fault| panic!("{system:?}: {fault}"));
            assert_eq!(all[0].id, "some-name");
        }
    }
}
