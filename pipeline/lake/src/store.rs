//! A content-addressed store of stage results.
//!
//! An artifact is a folder of files under the key blake3(stage, code, canonical input). A stage is a
//! function of its input and a folder to write into, so it cannot use what its key does not name; an
//! artifact that another stage reads enters that stage's input by the hash of its content. Folders are
//! written beside, synced and renamed: after a kill there is a whole artifact or none. Nothing in the
//! store is trusted: before use every file is hashed again, and a damaged artifact is made anew.

use crate::error::Error;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::HashMap;
use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

const ARTIFACT: &str = "artifact.json";

/// A file of an artifact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FileEntry {
    /// Name inside the artifact's folder.
    pub name: String,
    /// Size in bytes.
    pub bytes: u64,
    /// BLAKE3 of the content, in hexadecimal.
    pub blake3: String,
    /// False for files that differ from run to run (timings): they never enter a content hash.
    pub hashed: bool,
}

/// A finished result of a stage.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Artifact {
    /// Its address.
    pub key: String,
    /// Hash of its hashed files' names and contents.
    pub content: String,
    /// Its files.
    pub files: Vec<FileEntry>,
    #[serde(skip)]
    dir: PathBuf,
}

impl Artifact {
    /// The path of one of its files, if it has it.
    pub fn path(&self, name: &str) -> Option<PathBuf> {
        self.files
            .iter()
            .any(|f| f.name == name)
            .then(|| self.dir.join(name))
    }
}

/// What a stage result is for: the words after `explain`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Target {
    /// Paper.
    pub paper: String,
    /// Experiment (or `-` for results of the whole paper).
    pub experiment: String,
    /// Stage.
    pub stage: &'static str,
    /// Estimator, where the stage has one.
    pub estimator: Option<String>,
}

impl std::fmt::Display for Target {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}/{}", self.paper, self.experiment, self.stage)?;
        self.estimator
            .as_ref()
            .map_or(Ok(()), |e| write!(f, "/{e}"))
    }
}

/// Why a target would run, or that it need not.
#[derive(Clone, Debug, PartialEq)]
pub enum Status {
    /// The artifact is there.
    Cached,
    /// It was never made.
    Missing,
    /// It was made from another input: (where in the input, then, now).
    Changed(Vec<(String, String, String)>),
    /// What it reads will be made first.
    Upstream,
}

/// The store, below a lake.
pub struct Store {
    root: PathBuf,
    checked: Mutex<HashMap<String, Artifact>>,
    repair: Mutex<()>,
    counter: AtomicUsize,
    _lock: Option<File>,
}

impl Store {
    /// Opens the store of `lake` for writing, creating it where it is missing; one process at a time.
    pub fn open(lake: &Path) -> Result<Self, Error> {
        let root = lake.join(".cache");
        let tmp = root.join("tmp");
        fs::create_dir_all(&root).map_err(|e| Error::io("create", &root, e))?;
        let path = root.join("lock");
        let lock = File::options()
            .create(true)
            .truncate(false)
            .write(true)
            .open(&path)
            .map_err(|e| Error::io("open", &path, e))?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(Error::Locked {
                    path: lake.to_owned(),
                });
            }
            Err(TryLockError::Error(e)) => return Err(Error::io("lock", &path, e)),
        }
        // What a killed process left half-written; the lock says that nobody is at work on it.
        if tmp.exists() {
            fs::remove_dir_all(&tmp).map_err(|e| Error::io("clear", &tmp, e))?;
        }
        fs::create_dir_all(&tmp).map_err(|e| Error::io("create", &tmp, e))?;
        Ok(Self {
            _lock: Some(lock),
            ..Self::read_only(lake)
        })
    }

    /// The store of `lake` to look at only.
    pub fn read_only(lake: &Path) -> Self {
        Self {
            root: lake.join(".cache"),
            checked: Mutex::default(),
            repair: Mutex::default(),
            counter: AtomicUsize::new(0),
            _lock: None,
        }
    }

    /// The artifact of `stage` for `input`: from the store if it is there and whole, else made by `make`,
    /// which writes its files into the folder that it is given.
    pub fn run(
        &self,
        target: &Target,
        code: &str,
        input: &Value,
        make: impl FnOnce(&Path) -> Result<(), Error>,
    ) -> Result<(Artifact, bool), Error> {
        let key = key(target.stage, code, input);
        if let Some(artifact) = self.checked.lock().expect("no holder panics").get(&key) {
            return Ok((artifact.clone(), false));
        }
        let found = self.load(target.stage, &key)?;
        let made = found.is_none();
        let artifact = match found {
            Some(artifact) => artifact,
            None => self.make(target, &key, make)?,
        };
        self.remember(target, code, input)?;
        self.checked
            .lock()
            .expect("no holder panics")
            .insert(key, artifact.clone());
        Ok((artifact, made))
    }

    /// The artifact if it is there; its files are not hashed.
    pub fn peek(&self, stage: &str, code: &str, input: &Value) -> Option<Artifact> {
        self.inspect(stage, &key(stage, code, input), false)
    }

    fn dir(&self, stage: &str, key: &str) -> PathBuf {
        self.root.join(stage).join(key)
    }

    /// The artifact if it is there and whole; a damaged one is removed.
    fn load(&self, stage: &str, key: &str) -> Result<Option<Artifact>, Error> {
        if let Some(artifact) = self.inspect(stage, key, true) {
            return Ok(Some(artifact));
        }
        let dir = self.dir(stage, key);
        if !dir.exists() {
            return Ok(None);
        }
        // One at a time, and looked at again: another thread may have made it anew meanwhile.
        let _guard = self.repair.lock().expect("no holder panics");
        let again = self.inspect(stage, key, true);
        if again.is_none() && dir.exists() {
            fs::remove_dir_all(&dir).map_err(|e| Error::io("remove the damaged", &dir, e))?;
        }
        Ok(again)
    }

    /// The artifact if it is there and whole: its files are hashed, or only their sizes are looked at.
    fn inspect(&self, stage: &str, key: &str, hash: bool) -> Option<Artifact> {
        let dir = self.dir(stage, key);
        let text = fs::read(dir.join(ARTIFACT)).ok()?;
        let artifact = serde_json::from_slice::<Artifact>(&text).ok()?;
        let whole = artifact.key == key
            && artifact.content == content(&artifact.files)
            && artifact
                .files
                .iter()
                .all(|f| is_plain_name(&f.name) && is_whole(&dir, f, hash));
        whole.then_some(Artifact { dir, ..artifact })
    }

    fn make(
        &self,
        target: &Target,
        key: &str,
        make: impl FnOnce(&Path) -> Result<(), Error>,
    ) -> Result<Artifact, Error> {
        let n = self.counter.fetch_add(1, Ordering::Relaxed);
        let tmp = self.root.join("tmp").join(format!("{n}-{}", &key[..16]));
        fs::create_dir_all(&tmp).map_err(|e| Error::io("create", &tmp, e))?;
        let result = make(&tmp).and_then(|()| self.commit(target.stage, key, &tmp));
        if result.is_err() {
            // Best effort: the folder is cleared at the next start anyway.
            let _ = fs::remove_dir_all(&tmp);
        }
        result.map_err(|e| e.without_draft(&tmp, &self.root, &target.to_string()))
    }

    fn commit(&self, stage: &str, key: &str, tmp: &Path) -> Result<Artifact, Error> {
        let mut names: Vec<String> = fs::read_dir(tmp)
            .map_err(|e| Error::io("list", tmp, e))?
            .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
            .collect();
        names.sort();
        let mut files = Vec::new();
        for name in names {
            let path = tmp.join(&name);
            let (bytes, blake3) = hash_file(&path)?;
            files.push(FileEntry {
                hashed: !name.starts_with("timings"),
                name,
                bytes,
                blake3,
            });
        }
        let dir = self.dir(stage, key);
        let artifact = Artifact {
            key: key.to_owned(),
            content: content(&files),
            files,
            dir: dir.clone(),
        };
        let text = serde_json::to_vec_pretty(&artifact).map_err(|e| Error::json(tmp, e))?;
        write_synced(&tmp.join(ARTIFACT), &text)?;
        let parent = self.root.join(stage);
        fs::create_dir_all(&parent).map_err(|e| Error::io("create", &parent, e))?;
        match fs::rename(tmp, &dir) {
            Ok(()) => sync_dir(&parent).map(|()| artifact),
            // Two experiments may need the same result at the same time: the first one to finish is kept.
            Err(e) => match self.inspect(stage, key, false) {
                Some(first) => {
                    fs::remove_dir_all(tmp).map_err(|e| Error::io("clear", tmp, e))?;
                    Ok(first)
                }
                None => Err(Error::io("commit", &dir, e)),
            },
        }
    }

    fn target_file(&self, target: &Target) -> PathBuf {
        let name = match &target.estimator {
            Some(e) => format!("{}.{e}.json", target.stage),
            None => format!("{}.json", target.stage),
        };
        self.root
            .join("targets")
            .join(&target.paper)
            .join(&target.experiment)
            .join(name)
    }

    fn remember(&self, target: &Target, code: &str, input: &Value) -> Result<(), Error> {
        let path = self.target_file(target);
        let value = serde_json::json!({ "code": code, "input": input });
        let text = canonical(&value);
        if fs::read_to_string(&path).is_ok_and(|old| old == text) {
            return Ok(());
        }
        let parent = path.parent().expect("a target file lies in a folder");
        fs::create_dir_all(parent).map_err(|e| Error::io("create", parent, e))?;
        let n = self.counter.fetch_add(1, Ordering::Relaxed);
        let tmp = self.root.join("tmp").join(format!("{n}-target"));
        fs::write(&tmp, text).map_err(|e| Error::io("write", &tmp, e))?;
        fs::rename(&tmp, &path).map_err(|e| Error::io("commit", &path, e))
    }

    /// Whether `target` is there for this input, and if not, what differs from the last time.
    pub fn status(&self, target: &Target, code: &str, input: &Value) -> Status {
        if self.peek(target.stage, code, input).is_some() {
            return Status::Cached;
        }
        let old = fs::read(self.target_file(target)).ok();
        let Some(old) = old.and_then(|text| serde_json::from_slice::<Value>(&text).ok()) else {
            return Status::Missing;
        };
        let mut changes = Vec::new();
        differences(
            "",
            &old,
            &serde_json::json!({ "code": code, "input": input }),
            &mut changes,
        );
        if changes.is_empty() {
            Status::Missing
        } else {
            Status::Changed(changes)
        }
    }
}

fn is_plain_name(name: &str) -> bool {
    Path::new(name).file_name().is_some_and(|f| f == name)
}

fn is_whole(dir: &Path, file: &FileEntry, verify: bool) -> bool {
    let path = dir.join(&file.name);
    if !fs::symlink_metadata(&path).is_ok_and(|m| m.is_file() && m.len() == file.bytes) {
        return false;
    }
    !verify || hash_file(&path).is_ok_and(|(_, hash)| hash == file.blake3)
}

fn content(files: &[FileEntry]) -> String {
    let mut hasher = blake3::Hasher::new();
    for file in files.iter().filter(|f| f.hashed) {
        hasher.update(file.name.as_bytes());
        hasher.update(&[0]);
        hasher.update(file.blake3.as_bytes());
    }
    hasher.finalize().to_hex().to_string()
}

/// blake3(stage, code, canonical input), in hexadecimal.
pub fn key(stage: &str, code: &str, input: &Value) -> String {
    let mut hasher = blake3::Hasher::new();
    for part in [stage, code, &canonical(input)] {
        hasher.update(&(part.len() as u64).to_le_bytes());
        hasher.update(part.as_bytes());
    }
    hasher.finalize().to_hex().to_string()
}

/// JSON with sorted keys and no white space.
pub fn canonical(value: &Value) -> String {
    match value {
        Value::Object(map) => {
            let mut entries: Vec<_> = map.iter().collect();
            entries.sort_by_key(|(k, _)| k.as_str());
            let parts: Vec<String> = entries
                .iter()
                .map(|(k, v)| format!("{}:{}", Value::from(k.as_str()), canonical(v)))
                .collect();
            format!("{{{}}}", parts.join(","))
        }
        Value::Array(items) => format!(
            "[{}]",
            items.iter().map(canonical).collect::<Vec<_>>().join(",")
        ),
        other => other.to_string(),
    }
}

/// Where two JSON values differ: (path, old, new).
pub(crate) fn differences(
    at: &str,
    old: &Value,
    new: &Value,
    out: &mut Vec<(String, String, String)>,
) {
    match (old, new) {
        (Value::Object(a), Value::Object(b)) => {
            let mut keys: Vec<&String> = a.keys().chain(b.keys()).collect();
            keys.sort();
            keys.dedup();
            for k in keys {
                let (x, y) = (
                    a.get(k).unwrap_or(&Value::Null),
                    b.get(k).unwrap_or(&Value::Null),
                );
                differences(&format!("{at}/{k}"), x, y, out);
            }
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            for (i, (x, y)) in a.iter().zip(b).enumerate() {
                differences(&format!("{at}/{i}"), x, y, out);
            }
        }
        _ if old != new => out.push((at.to_owned(), short(old), short(new))),
        _ => {}
    }
}

fn short(value: &Value) -> String {
    let text = canonical(value);
    if text.chars().count() > 60 {
        text.chars().take(57).chain("...".chars()).collect()
    } else {
        text
    }
}

/// Size and BLAKE3 of a file.
pub fn hash_file(path: &Path) -> Result<(u64, String), Error> {
    let mut hasher = blake3::Hasher::new();
    let file = File::open(path).map_err(|e| Error::io("open", path, e))?;
    hasher
        .update_reader(file)
        .map_err(|e| Error::io("read", path, e))?;
    Ok((hasher.count(), hasher.finalize().to_hex().to_string()))
}

/// Writes a file and syncs it to the disk.
pub fn write_synced(path: &Path, content: &[u8]) -> Result<(), Error> {
    let write = || -> std::io::Result<()> {
        let mut file = File::create(path)?;
        std::io::Write::write_all(&mut file, content)?;
        file.sync_all()
    };
    write().map_err(|e| Error::io("write", path, e))
}

/// Syncs a folder, so that a rename in it survives a power cut.
pub fn sync_dir(path: &Path) -> Result<(), Error> {
    File::open(path)
        .and_then(|d| d.sync_all())
        .map_err(|e| Error::io("sync", path, e))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn target() -> Target {
        Target {
            paper: "p".into(),
            experiment: "e".into(),
            stage: "estimate",
            estimator: Some("kf".into()),
        }
    }

    fn make(dir: &Path) -> Result<(), Error> {
        write_synced(&dir.join("a.txt"), b"hello")
    }

    #[test]
    fn a_finished_stage_is_not_run_again() {
        let lake = tempfile::tempdir().unwrap();
        let (first, made) = Store::open(lake.path())
            .unwrap()
            .run(&target(), "c", &json!({"n": 1}), make)
            .unwrap();
        assert!(made);
        let store = Store::open(lake.path()).unwrap();
        let (second, made) = store
            .run(&target(), "c", &json!({"n": 1}), |_| panic!("ran again"))
            .unwrap();
        assert!(!made);
        assert_eq!(first.content, second.content);
    }

    #[test]
    fn a_damaged_artifact_is_made_anew() {
        for damage in ["changed", "truncated", "removed", "listing"] {
            let lake = tempfile::tempdir().unwrap();
            let (artifact, _) = Store::open(lake.path())
                .unwrap()
                .run(&target(), "c", &json!(1), make)
                .unwrap();
            let path = artifact.path("a.txt").unwrap();
            match damage {
                "changed" => fs::write(&path, b"hellO").unwrap(),
                "truncated" => fs::write(&path, b"he").unwrap(),
                "removed" => fs::remove_file(&path).unwrap(),
                _ => fs::write(path.with_file_name(ARTIFACT), b"{").unwrap(),
            }
            let (again, made) = Store::open(lake.path())
                .unwrap()
                .run(&target(), "c", &json!(1), make)
                .unwrap();
            assert!(made, "{damage}");
            assert_eq!(fs::read(again.path("a.txt").unwrap()).unwrap(), b"hello");
        }
    }

    #[test]
    fn the_same_result_made_twice_at_once_is_one_result() {
        let lake = tempfile::tempdir().unwrap();
        let store = Store::open(lake.path()).unwrap();
        let both = std::sync::Barrier::new(2);
        let run = || {
            let make_together = |dir: &Path| {
                both.wait();
                make(dir)
            };
            store
                .run(&target(), "c", &json!(1), make_together)
                .unwrap()
                .0
        };
        let (a, b) = std::thread::scope(|s| {
            let other = s.spawn(run);
            (run(), other.join().unwrap())
        });
        assert_eq!(a.content, b.content);
        assert_eq!(fs::read(a.path("a.txt").unwrap()).unwrap(), b"hello");
        assert!(
            fs::read_dir(lake.path().join(".cache/tmp"))
                .unwrap()
                .next()
                .is_none()
        );
    }

    #[test]
    fn a_failed_stage_leaves_nothing() {
        let lake = tempfile::tempdir().unwrap();
        let store = Store::open(lake.path()).unwrap();
        let fail = |dir: &Path| {
            Err(Error::NoLake {
                path: dir.to_owned(),
            })
        };
        assert!(store.run(&target(), "c", &json!(1), fail).is_err());
        assert_eq!(store.status(&target(), "c", &json!(1)), Status::Missing);
    }

    #[test]
    fn a_changed_input_is_explained_by_the_part_that_differs() {
        let lake = tempfile::tempdir().unwrap();
        let store = Store::open(lake.path()).unwrap();
        store
            .run(&target(), "c", &json!({"phi": 100, "eta": 0.5}), make)
            .unwrap();
        assert_eq!(
            store.status(&target(), "c", &json!({"eta": 0.5, "phi": 100})),
            Status::Cached
        );
        assert_eq!(
            store.status(&target(), "c", &json!({"phi": 200, "eta": 0.5})),
            Status::Changed(vec![("/input/phi".into(), "100".into(), "200".into())])
        );
    }

    #[test]
    fn a_lake_serves_one_writer_at_a_time() {
        let lake = tempfile::tempdir().unwrap();
        let _first = Store::open(lake.path()).unwrap();
        assert!(matches!(
            Store::open(lake.path()),
            Err(Error::Locked { .. })
        ));
    }
}
