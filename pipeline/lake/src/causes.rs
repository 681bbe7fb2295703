//! Why two lakes differ: what each remembers of the inputs that its results were made from.

use crate::store::differences;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// A place in a stage's key that two lakes do not share.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cause {
    /// The stage, with its estimator where it has one: `simulate`, `estimate.czmv`.
    pub stage: String,
    /// Where in the key: `code`, or a path in the stage's input.
    pub place: String,
    /// What the first lake was made from.
    pub old: String,
    /// What the second was.
    pub new: String,
}

impl Cause {
    /// The estimator whose stage it is.
    pub fn estimator(&self) -> Option<&str> {
        self.stage.strip_prefix("estimate.")
    }
}

impl std::fmt::Display for Cause {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.place == "code" {
            return write!(f, "{}: another code", self.stage);
        }
        write!(
            f,
            "{}: {}: {} -> {}",
            self.stage, self.place, self.old, self.new
        )
    }
}

/// What was remembered of the stages of `experiment` (`-` for those of the whole paper), by stage.
fn remembered(lake: &Path, paper: &str, experiment: &str) -> BTreeMap<String, Value> {
    let folder = lake
        .join(".cache")
        .join("targets")
        .join(paper)
        .join(experiment);
    let Ok(files) = fs::read_dir(folder) else {
        return BTreeMap::new();
    };
    files
        .filter_map(|file| {
            let path = file.ok()?.path();
            let stage = path.file_name()?.to_str()?.strip_suffix(".json")?;
            let value = serde_json::from_slice(&fs::read(&path).ok()?).ok()?;
            Some((stage.to_owned(), value))
        })
        .collect()
}

/// The places in which the keys of an experiment's stages differ, `None` where a lake remembers nothing of it.
///
/// A hash of what an earlier stage made is no cause: that stage's own key says why.
pub fn between(old: &Path, new: &Path, paper: &str, experiment: &str) -> Option<Vec<Cause>> {
    let (old, new) = (
        remembered(old, paper, experiment),
        remembered(new, paper, experiment),
    );
    if old.is_empty() || new.is_empty() {
        return None;
    }
    let mut causes = Vec::new();
    for (stage, then) in &old {
        let Some(now) = new.get(stage) else { continue };
        let mut places = Vec::new();
        differences("", then, now, &mut places);
        causes.extend(places.into_iter().filter_map(|(place, old, new)| {
            let place = place.trim_start_matches('/');
            let place = place.strip_prefix("input/").unwrap_or(place);
            (place == "code" || !(is_hash(&old) && is_hash(&new))).then(|| Cause {
                stage: stage.clone(),
                place: place.to_owned(),
                old,
                new,
            })
        }));
    }
    Some(causes)
}

/// Whether a value is the start of a BLAKE3 hash in hexadecimal, as JSON and shortened.
fn is_hash(value: &str) -> bool {
    let digits = value.trim_matches('"').trim_end_matches("...");
    digits.len() >= 50 && digits.bytes().all(|b| b.is_ascii_hexdigit())
}

#[cfg(test)]
mod tests {
    use super::{Cause, between};
    use serde_json::json;
    use std::fs;
    use std::path::Path;

    fn remember(lake: &Path, stage: &str, value: &serde_json::Value) {
        let folder = lake.join(".cache/targets/p/e");
        fs::create_dir_all(&folder).expect("a folder");
        fs::write(folder.join(format!("{stage}.json")), value.to_string()).expect("a file");
    }

    #[test]
    fn a_setting_is_a_cause_and_the_hash_that_follows_from_it_is_none() {
        let folder = tempfile::tempdir().expect("a folder");
        let (a, b) = (folder.path().join("a"), folder.path().join("b"));
        let (one, two) = ("1".repeat(64), "2".repeat(64));
        for (lake, generators, content) in [(&a, 20, &one), (&b, 25, &two)] {
            let settings =
                json!({ "code": "c", "input": { "settings": { "generators": generators } } });
            remember(lake, "estimate.czmv", &settings);
            let reduce = json!({ "code": "c", "input": { "content": content } });
            remember(lake, "reduce", &reduce);
        }
        let cause = Cause {
            stage: "estimate.czmv".to_owned(),
            place: "settings/generators".to_owned(),
            old: "20".to_owned(),
            new: "25".to_owned(),
        };
        assert_eq!(between(&a, &b, "p", "e"), Some(vec![cause]));
        assert_eq!(between(&a, &a, "p", "e"), Some(Vec::new()));
        assert_eq!(between(&a, &b, "p", "other"), None);
    }

    #[test]
    fn another_code_is_a_cause() {
        let folder = tempfile::tempdir().expect("a folder");
        let (a, b) = (folder.path().join("a"), folder.path().join("b"));
        for (lake, code) in [(&a, "1"), (&b, "2")] {
            remember(
                lake,
                "score",
                &json!({ "code": code.repeat(64), "input": {} }),
            );
        }
        let causes = between(&a, &b, "p", "e").expect("both remember it");
        assert_eq!(causes[0].to_string(), "score: another code");
    }
}
