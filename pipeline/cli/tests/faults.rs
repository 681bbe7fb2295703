//! What a machine does to a lake: kills, damaged files, full disks, places that cannot be written,
//! two processes at once. The same command mends all of it, without a flag.

#![cfg(unix)]

mod program;

use program::{Folder, Outcome, RESULTS, SMALL, assert_same, files_below, manifest};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant, SystemTime};

/// What an undisturbed run of [`SMALL`] leaves.
fn undisturbed() -> BTreeMap<String, Vec<u8>> {
    let folder = Folder::with_small();
    folder.done(&["run", "small.toml"]);
    folder.vouched("lake")
}

/// splitmix64: numbers in [0, 1) from a seed.
struct Draws(u64);

impl Draws {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn started(folder: &Folder, arguments: &[&str]) -> Child {
    folder
        .command(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Starts `run` and kills it when `lake` holds `at` files: time measured in progress, so that a slow
/// machine meets the same moments as a fast one. True if the kill came before the end.
fn killed_at(folder: &Folder, lake: &str, at: usize) -> bool {
    killed_with(folder, &["run", "small.toml", "--lake", lake], lake, at)
}

/// As [`killed_at`], with any command that fills `lake`.
fn killed_with(folder: &Folder, arguments: &[&str], lake: &str, at: usize) -> bool {
    let mut child = started(folder, arguments);
    while child.try_wait().unwrap().is_none() {
        if files_below(&folder.path(lake)).len() >= at {
            child.kill().unwrap(); // SIGKILL
            return child.wait().unwrap().code().is_none();
        }
        std::thread::sleep(Duration::from_micros(100));
    }
    false
}

/// Results of stages that are whole in the cache of `lake`.
fn finished(folder: &Folder, lake: &str) -> usize {
    let cache = folder.path(lake).join(".cache");
    let below_tmp = cache.join("tmp");
    let whole = |path: &Path| path.ends_with("artifact.json") && !path.starts_with(&below_tmp);
    files_below(&cache)
        .iter()
        .filter(|path| whole(path))
        .count()
}

#[test]
fn a_run_killed_at_any_time_is_taken_up_by_the_same_command() {
    let folder = Folder::with_small();
    folder.done(&["run", "small.toml"]);
    let expected = folder.vouched("lake");
    let last = files_below(&folder.path("lake")).len();
    let mut draws = Draws(2018);
    let (mut killed, mut found_any) = (0, 0);
    for trial in 0..20 {
        let at = 1 + (draws.next() * (last - 1) as f64) as usize;
        let lake = format!("lake{trial}");
        killed += usize::from(killed_at(&folder, &lake, at));
        let survived = finished(&folder, &lake);
        let again = folder.done(&["run", "small.toml", "--lake", &lake]);
        let (made, found) = again.tally();
        assert_eq!(
            (made, found),
            (RESULTS - survived, survived),
            "killed at {at} files: something was lost"
        );
        found_any += usize::from(survived > 0);
        assert_same(
            &format!("killed at {at} files"),
            &folder.vouched(&lake),
            &expected,
        );
        assert!(
            files_below(&folder.path(&lake).join(".cache/tmp")).is_empty(),
            "killed at {at} files: rests"
        );
        folder.done(&["verify", "--lake", &lake]);
        std::fs::remove_dir_all(folder.path(&lake)).unwrap();
    }
    assert!(
        killed >= 12 && found_any >= 6,
        "{killed} kills came before the end, {found_any} found results"
    );
}

#[test]
fn a_run_killed_again_and_again_gets_to_its_end() {
    let folder = Folder::with_small();
    let expected = undisturbed();
    let mut at = 3;
    let mut kills = 0;
    while killed_at(&folder, "lake", at) {
        kills += 1;
        at = at.max(files_below(&folder.path("lake")).len()) + 6;
        assert!(kills < 60, "it does not get on");
    }
    folder.done(&["run", "small.toml"]);
    assert!(kills >= 3, "{kills}");
    assert_same("after the kills", &folder.vouched("lake"), &expected);
    folder.done(&["verify"]);
}

/// What a killed run published, and a changed file no longer asks for, goes away with the next run.
#[test]
fn a_published_file_that_no_manifest_came_to_know_is_cleared_away() {
    let folder = Folder::with_small();
    folder.done(&["run", "small.toml"]);
    let expected = folder.vouched("lake");
    let stray = "lake/traces/paper=mine/experiment=small/gone_run0000.mcap";
    folder.write(stray, "half a trace");
    // Another experiment's files are not this run's to remove.
    std::fs::create_dir_all(folder.path("lake/scores/paper=mine/experiment=other")).unwrap();
    let other = "lake/scores/paper=mine/experiment=other/part-0.parquet";
    folder.write(other, "another's");
    let found = folder.run(&["verify"]).ends_with(1).stdout;
    assert!(
        found.contains("gone_run0000.mcap: is not in the manifest"),
        "{found}"
    );
    // Nor is it read.
    let count = "SELECT COUNT(*) AS n, MIN(paper) AS p, MIN(experiment) AS e FROM scores";
    let counted = folder.done(&["query", count, "--format", "csv"]).stdout;
    assert_eq!(counted, "n,p,e\n8,mine,small\n");
    folder.done(&["run", "small.toml"]);
    assert!(!folder.path(stray).exists() && folder.path(other).exists());
    assert_same("without the stray", &folder.vouched("lake"), &expected);
}

/// Sets the time of change of every file below `folder`.
fn stamped(folder: &Path, time: SystemTime) {
    for path in files_below(folder) {
        let file = std::fs::File::options().append(true).open(&path).unwrap();
        file.set_modified(time).unwrap();
    }
}

/// Nothing is decided by a time: not by that of a file, which a clock that jumps puts before what it was made from or
/// long after now, and what is damaged is found without it.
#[test]
fn a_clock_that_jumps_makes_nothing_run_and_hides_nothing() {
    let folder = Folder::with_small();
    folder.done(&["run", "small.toml"]);
    let expected = folder.vouched("lake");
    let year = Duration::from_secs(365 * 24 * 3600);
    let now = SystemTime::now();
    for time in [SystemTime::UNIX_EPOCH, now - year, now + 10 * year] {
        stamped(&folder.path("lake"), time);
        assert_eq!(folder.done(&["run", "small.toml"]).tally(), (0, RESULTS));
        // The experiment is younger than its results, then older.
        stamped(&folder.path("lake"), SystemTime::UNIX_EPOCH);
        assert_eq!(folder.done(&["run", "small.toml"]).tally(), (0, RESULTS));
        folder.done(&["verify"]);
        // Half of a run, and the clock jumps before it goes on.
        let lake = "later";
        killed_at(&folder, lake, 12);
        let survived = finished(&folder, lake);
        stamped(&folder.path(lake), time);
        let again = folder.done(&["run", "small.toml", "--lake", lake]);
        assert_eq!(again.tally(), (RESULTS - survived, survived));
        assert_same("after the jump", &folder.vouched(lake), &expected);
        std::fs::remove_dir_all(folder.path(lake)).unwrap();
    }
    // A changed byte under the time that the file had before.
    let table = folder.path("lake/scores/paper=mine/experiment=small/part-0.parquet");
    let time = std::fs::metadata(&table).unwrap().modified().unwrap();
    damage(&table, Damage::Changed);
    stamped(table.parent().unwrap(), time);
    folder.run(&["verify"]).ends_with(1);
    folder.done(&["run", "small.toml"]);
    assert_same("mended", &folder.vouched("lake"), &expected);
}

/// The stages that run no filter: a campaign and counts, stopped and taken up.
#[test]
fn claims_counts_and_attacks_survive_a_kill_as_well() {
    let folder = Folder::new();
    let arguments = |lake: &'static str| {
        [
            "reproduce-all",
            "--quick",
            "--paper",
            "box",
            "--paper",
            "ezgkf",
            "--lake",
            lake,
            "--reports",
            "pages",
        ]
    };
    folder.done(&arguments("whole"));
    let expected = folder.vouched("whole");
    for table in ["attack", "claims", "complexity", "comparison"] {
        let start = format!("{table}/");
        assert!(
            expected.keys().any(|path| path.starts_with(&start)),
            "{table}"
        );
    }
    let last = files_below(&folder.path("whole")).len();
    let mut kills = 0;
    for part in 1..6 {
        let at = part * last / 6;
        kills += usize::from(killed_with(&folder, &arguments("lake"), "lake", at));
    }
    assert!(kills >= 3, "{kills} kills came before the end");
    folder.done(&arguments("lake"));
    assert_same("after the kills", &folder.vouched("lake"), &expected);
    folder.done(&["verify", "--lake", "lake"]);
}

/// A way to damage a file.
#[derive(Clone, Copy, Debug)]
enum Damage {
    Changed,
    Truncated,
    Emptied,
    Deleted,
}

fn damage(path: &Path, how: Damage) {
    let mut bytes = std::fs::read(path).unwrap();
    match how {
        Damage::Changed => {
            let middle = bytes.len() / 2;
            bytes[middle] ^= 1;
            std::fs::write(path, bytes).unwrap();
        }
        Damage::Truncated => std::fs::write(path, &bytes[..bytes.len() / 2]).unwrap(),
        Damage::Emptied => std::fs::write(path, "").unwrap(),
        Damage::Deleted => std::fs::remove_file(path).unwrap(),
    }
}

const DAMAGES: [Damage; 4] = [
    Damage::Changed,
    Damage::Truncated,
    Damage::Emptied,
    Damage::Deleted,
];

#[test]
fn a_damaged_file_of_the_lake_is_found_and_rebuilt() {
    let folder = Folder::with_small();
    folder.done(&["run", "small.toml"]);
    let expected = folder.vouched("lake");
    let lake = folder.path("lake");
    for how in DAMAGES {
        let files = manifest(&lake);
        files.iter().for_each(|path| damage(&lake.join(path), how));
        let found = folder.run(&["verify"]).ends_with(1).stdout;
        for path in &files {
            assert!(
                found.contains(&format!("{path}: ")),
                "{how:?}: {path} is not in {found}"
            );
        }
        assert!(
            found.ends_with(&format!("{0} faults in {0} files\n", files.len())),
            "{how:?}: {found}"
        );
        assert_eq!(
            folder.done(&["run", "small.toml"]).tally(),
            (0, RESULTS),
            "{how:?}: the cache is whole"
        );
        assert_same(&format!("{how:?}"), &folder.vouched("lake"), &expected);
        folder.done(&["verify"]);
    }
}

#[test]
fn a_damaged_file_of_the_cache_is_never_trusted() {
    let folder = Folder::with_small();
    folder.done(&["run", "small.toml"]);
    let expected = folder.vouched("lake");
    let cache = folder.path("lake/.cache");
    for how in DAMAGES {
        for path in files_below(&cache)
            .iter()
            .filter(|path| !path.ends_with("lock"))
        {
            damage(path, how);
        }
        // The lake is rebuilt from the cache, and must not be from a damaged one.
        std::fs::remove_file(folder.path("lake/scores/paper=mine/experiment=small/part-0.parquet"))
            .unwrap();
        assert_eq!(
            folder.done(&["run", "small.toml"]).tally(),
            (RESULTS, 0),
            "{how:?}"
        );
        assert_same(&format!("{how:?}"), &folder.vouched("lake"), &expected);
        folder.done(&["verify"]);
    }
}

#[test]
fn one_damaged_result_is_made_again_and_no_other() {
    let folder = Folder::with_small();
    folder.done(&["run", "small.toml"]);
    let expected = folder.vouched("lake");
    let of = |name: &str| {
        let files = files_below(&folder.path("lake/.cache"));
        files.into_iter().find(|path| path.ends_with(name)).unwrap()
    };
    for name in [
        "truth.parquet",
        "estimates.parquet",
        "trace.mcap",
        "metrics.parquet",
        "scores.parquet",
    ] {
        damage(&of(name), Damage::Changed);
        assert_eq!(
            folder.done(&["run", "small.toml"]).tally(),
            (1, RESULTS - 1),
            "{name}"
        );
        assert_same(name, &folder.vouched("lake"), &expected);
    }
}

#[test]
fn without_its_cache_a_lake_gets_the_same_manifest() {
    let folder = Folder::with_small();
    folder.done(&["run", "small.toml"]);
    let expected = folder.vouched("lake");
    std::fs::remove_dir_all(folder.path("lake/.cache")).unwrap();
    folder.done(&["verify"]);
    folder.done(&["query", "SELECT * FROM scores"]);
    assert_eq!(folder.done(&["run", "small.toml"]).tally(), (RESULTS, 0));
    assert_same("without a cache", &folder.vouched("lake"), &expected);
}

/// The commands that read a lake all refuse it with these words.
fn readers_refuse(folder: &Folder, parts: &[&str]) {
    for arguments in [
        &["verify"][..],
        &["tables"],
        &["query", "SELECT * FROM scores"],
    ] {
        let outcome = folder.run(arguments);
        assert!(matches!(outcome.code, Some(1 | 2)), "{outcome:?}");
        outcome.says(parts);
    }
}

#[test]
fn a_damaged_manifest_is_refused_and_written_anew() {
    let folder = Folder::with_small();
    folder.done(&["run", "small.toml"]);
    let expected = folder.vouched("lake");
    let whole = &expected["MANIFEST.json"];
    for length in [0, 1, whole.len() / 2, whole.len() - 2] {
        folder.write("lake/MANIFEST.json", &whole[..length]);
        readers_refuse(&folder, &["lake/MANIFEST.json: expected a manifest, got"]);
        folder.done(&["run", "small.toml"]);
        assert_same(
            &format!("cut to {length}"),
            &folder.vouched("lake"),
            &expected,
        );
    }
    std::fs::remove_file(folder.path("lake/MANIFEST.json")).unwrap();
    readers_refuse(&folder, &["no lake at lake"]);
    folder.done(&["run", "small.toml"]);
    assert_same("deleted", &folder.vouched("lake"), &expected);
    // A wrong size or number of rows is found, and is not carried on.
    let text = String::from_utf8(whole.clone()).unwrap();
    for (right, wrong) in [
        ("\"bytes\": ", "\"bytes\": 1"),
        ("\"rows\": 8,", "\"rows\": 9,"),
    ] {
        assert!(text.contains(right));
        folder.write("lake/MANIFEST.json", text.replacen(right, wrong, 1));
        assert!(
            folder
                .run(&["verify"])
                .ends_with(1)
                .stdout
                .ends_with("1 fault in 15 files\n"),
            "{right}"
        );
        folder.done(&["run", "small.toml"]);
        assert_same(wrong, &folder.vouched("lake"), &expected);
    }
}

/// A manifest is no leave to touch files outside the lake.
#[test]
fn a_manifest_that_points_outside_is_refused_and_nothing_there_is_touched() {
    let folder = Folder::with_small();
    folder.done(&["run", "small.toml"]);
    let expected = folder.vouched("lake");
    let text = String::from_utf8(expected["MANIFEST.json"].clone()).unwrap();
    // Named like a file that this experiment no longer has, which would be removed.
    let victim = "outside/paper=mine/experiment=small/part-0.parquet";
    std::fs::create_dir_all(folder.path(victim).parent().unwrap()).unwrap();
    folder.write(victim, "precious");
    std::os::unix::fs::symlink(folder.path("outside"), folder.path("lake/link")).unwrap();
    let absolute = folder.path(victim).display().to_string();
    let below_link = victim.replacen("outside", "link", 1);
    for path in [
        format!("../{victim}"),
        format!("scores/../../{victim}"),
        absolute,
        below_link,
    ] {
        let entry = format!(
            "{{\"path\": {path:?}, \"table\": \"scores\", \"bytes\": 8, \"blake3\": \"\", \"rows\": 1, \
             \"schema_version\": null, \"key\": \"\"}},"
        );
        folder.write(
            "lake/MANIFEST.json",
            text.replacen("\"files\": [", &format!("\"files\": [{entry}"), 1),
        );
        readers_refuse(
            &folder,
            &[
                "lake/MANIFEST.json: expected paths that stay in the lake",
                &path,
            ],
        );
        folder.done(&["run", "small.toml"]);
        assert_eq!(
            std::fs::read_to_string(folder.path(victim)).unwrap(),
            "precious",
            "{path}"
        );
        assert_same(&path, &folder.vouched("lake"), &expected);
    }
}

#[test]
fn a_symbolic_link_in_place_of_a_table_is_not_written_through() {
    let folder = Folder::with_small();
    folder.done(&["run", "small.toml"]);
    let expected = folder.vouched("lake");
    // A file that is a link: replaced, and what it led to stays.
    let scores = folder.path("lake/scores/paper=mine/experiment=small/part-0.parquet");
    folder.write("precious", "precious");
    std::fs::remove_file(&scores).unwrap();
    std::os::unix::fs::symlink(folder.path("precious"), &scores).unwrap();
    readers_refuse(&folder, &["without symbolic links, got scores/"]);
    folder.done(&["run", "small.toml"]);
    assert_eq!(
        std::fs::read_to_string(folder.path("precious")).unwrap(),
        "precious"
    );
    assert_same("a linked file", &folder.vouched("lake"), &expected);
    // A folder that is a link: refused.
    std::fs::rename(folder.path("lake/scores"), folder.path("scores")).unwrap();
    std::os::unix::fs::symlink(folder.path("scores"), folder.path("lake/scores")).unwrap();
    readers_refuse(&folder, &["without symbolic links, got scores/"]);
    folder
        .run(&["run", "small.toml"])
        .ends_with(2)
        .says(&["without symbolic links, got scores/"]);
}

#[test]
fn two_processes_do_not_share_a_lake() {
    let folder = Folder::with_small();
    folder.done(&["run", "small.toml"]);
    let long = SMALL
        .replace("id = \"small\"", "id = \"long\"")
        .replace("runs = 40", "runs = 100000");
    folder.write("long.toml", long);
    let mut first = started(&folder, &["run", "long.toml"]);
    let start = Instant::now();
    // It is at work once it has drafts.
    while files_below(&folder.path("lake/.cache/tmp")).is_empty() {
        assert!(start.elapsed() < Duration::from_secs(30) && first.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(1));
    }
    let second = folder.run(&["run", "small.toml"]);
    // Whoever only reads is not kept out.
    let reader = folder.run(&["query", "SELECT * FROM scores"]);
    let still_running = first.try_wait().unwrap().is_none();
    first.kill().unwrap();
    first.wait().unwrap();
    assert!(still_running, "the first was to outlast the second");
    second
        .ends_with(1)
        .says(&["the lake lake is in use by another zonobench"]);
    reader.ends_with(0);
    // The lock goes with its process.
    folder.done(&["run", "small.toml"]);
}

#[test]
fn a_lake_that_cannot_be_made_is_a_clear_error() {
    let folder = Folder::with_small();
    folder.write("file", "in the way");
    for lake in ["file", "file/lake"] {
        let outcome = folder
            .run(&["run", "small.toml", "--lake", lake])
            .ends_with(1);
        outcome.says(&[&format!("cannot create {lake}/.cache"), "ot a directory"]);
    }
    folder.write("t.csv", "k,y1\n0,1\n");
    let outcome = folder.run(&[
        "track",
        "small.toml",
        "--measurements",
        "t.csv",
        "--out",
        "file/out",
    ]);
    outcome
        .ends_with(1)
        .says(&["cannot create file/out", "ot a directory"]);
    assert_eq!(
        std::fs::read_to_string(folder.path("file")).unwrap(),
        "in the way"
    );
}

/// Nobody's user, for a process that must not write what root may.
const NOBODY: u32 = 65534;

#[test]
fn a_lake_that_cannot_be_written_is_a_clear_error_and_can_be_read() {
    use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
    use std::os::unix::process::CommandExt as _;
    let folder = Folder::with_small();
    folder.done(&["run", "small.toml"]);
    let expected = folder.vouched("lake");
    let allow = |mode: u32, path: &Path| {
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
    };
    let is_root = std::fs::metadata("/proc/self").is_ok_and(|m| m.uid() == 0);
    allow(0o755, &folder.path(""));
    allow(0o555, &folder.path("lake"));
    allow(0o555, &folder.path("lake/.cache"));
    allow(0o444, &folder.path("lake/.cache/lock"));
    let run = |arguments: &[&str]| {
        let mut command = folder.command(arguments);
        if is_root {
            command.uid(NOBODY).gid(NOBODY);
        }
        command
            .output()
            .map(|output| Outcome::of(&arguments.join(" "), output))
    };
    match run(&["run", "small.toml"]) {
        // The program lies where nobody may go.
        Err(e) if is_root && e.kind() == std::io::ErrorKind::PermissionDenied => {
            eprintln!("not tried as another user: {e}");
        }
        outcome => {
            outcome
                .unwrap()
                .ends_with(1)
                .says(&["cannot open lake/.cache/lock: Permission denied"]);
            run(&["verify"]).unwrap().ends_with(0);
            run(&["query", "SELECT * FROM scores"])
                .unwrap()
                .ends_with(0);
            run(&["run", "small.toml", "--lake", "lake/inner"])
                .unwrap()
                .ends_with(1)
                .says(&["cannot create lake/inner"]);
        }
    }
    allow(0o755, &folder.path("lake"));
    allow(0o755, &folder.path("lake/.cache"));
    allow(0o644, &folder.path("lake/.cache/lock"));
    folder.done(&["run", "small.toml"]);
    assert_same("after it", &folder.vouched("lake"), &expected);
}

/// Runs `script` in a shell in `folder`; `$0` is the program.
fn shell(folder: &Folder, script: &str) -> Outcome {
    let program = folder.command(&[]).get_program().to_owned();
    let mut command = std::process::Command::new("sh");
    let output = command
        .arg("-c")
        .arg(script)
        .arg(program)
        .current_dir(folder.path(""))
        .output();
    Outcome::of(script, output.unwrap())
}

#[test]
fn a_disk_that_takes_no_more_is_a_clear_error_and_space_mends_it() {
    let folder = Folder::with_small();
    let expected = undisturbed();
    // Every write beyond the limit fails, as on a full disk; without the trap it would be a signal.
    for blocks in [0, 1, 2, 8, 32, 128] {
        let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" run small.toml");
        let outcome = shell(&folder, &script);
        assert_eq!(outcome.code, Some(1), "{blocks}: {outcome:?}");
        outcome.says(&["lake/", "File too large"]);
    }
    folder.done(&["run", "small.toml"]);
    assert_same("with space", &folder.vouched("lake"), &expected);
    folder.done(&["verify"]);
}

/// On a small file system of its own, where the machine lets a test mount one.
#[test]
fn a_full_file_system_is_a_clear_error_and_space_mends_it() {
    let folder = Folder::with_small();
    let expected = undisturbed();
    std::fs::create_dir(folder.path("disk")).unwrap();
    let script = "unshare -m sh -c '
        mount -t tmpfs -o size=64k none disk || exit 77
        for size in 64k 128k 256k 384k; do
            mount -o remount,size=$size disk || exit 77
            \"$0\" run small.toml --lake disk/lake >/dev/null 2>>errors
            echo $?
        done
        mount -o remount,size=64m disk
        \"$0\" run small.toml --lake disk/lake >/dev/null 2>&1 && \"$0\" verify --lake disk/lake >/dev/null || exit 1
        cp -r disk/lake lake
    ' \"$0\"";
    let outcome = shell(&folder, script);
    if outcome.stdout.is_empty() {
        eprintln!("no file system could be mounted here: {}", outcome.stderr);
        return;
    }
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let errors = std::fs::read_to_string(folder.path("errors")).unwrap();
    assert!(outcome.stdout.starts_with("1\n"), "{outcome:?}\n{errors}");
    assert!(
        outcome
            .stdout
            .lines()
            .all(|code| code == "1" || code == "0"),
        "{outcome:?}\n{errors}"
    );
    assert!(
        errors.contains("No space left on device") && !errors.contains("panicked"),
        "{errors}"
    );
    assert_same("with space", &folder.vouched("lake"), &expected);
}
