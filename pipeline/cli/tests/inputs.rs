//! Files that nobody would write: experiments, recordings, manifests and Parquet with bytes and lines changed.
//!
//! Whatever stands in a file, reading it ends with its content or with an error that names the file. The cases of one
//! seed run here; `cargo test -p zonobench --test inputs -- --ignored` goes on for `ZONOBENCH_FUZZ_SECONDS` seconds from the
//! seed `ZONOBENCH_FUZZ_SEED`, and a finding is reported with the number of its case.

mod program;

use arrow_array::{ArrayRef, Float64Array, Int64Array, RecordBatch};
use parquet::arrow::ArrowWriter;
use program::{Folder, SMALL};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use zonobench_lab::experiment::{Experiment, Tracking};
use zonobench_lab::recorded;
use zonobench_lake::{lake, numbers, rows, table};

/// Uniform bits (splitmix64).
struct Bits(u64);

impl Bits {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }

    fn of<'a, T>(&mut self, all: &'a [T]) -> &'a T {
        &all[self.below(all.len())]
    }
}

/// What a value is replaced by.
const VALUES: [&str; 34] = [
    "0",
    "-1",
    "1",
    "2",
    "1e308",
    "-1e308",
    "1e-320",
    "nan",
    "inf",
    "-inf",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551616",
    "1e400",
    "0.1",
    "true",
    "\"\"",
    "\"a\"",
    "\"../../x\"",
    "[]",
    "[[]]",
    "[1.0]",
    "[[1.0, 2.0], [3.0]]",
    "{}",
    "{ box = [[1.0, -1.0]] }",
    "{ law = \"uniform\" }",
    "[0, 0]",
    "\"\\u0000\"",
    "\"x1 + x2*(w1 - 1)^2\"",
    "\"p/(T - T)\"",
    "\"ln(-1)\"",
    "\"((((-\"",
    "\"sin sin(\"",
    "\"m/s2\"",
];

/// `text` with something changed: a line, a value, a key, a few bytes.
fn changed(text: &[u8], bits: &mut Bits) -> Vec<u8> {
    let mut lines: Vec<Vec<u8>> = text
        .split_inclusive(|&b| b == b'\n')
        .map(<[u8]>::to_vec)
        .collect();
    for _ in 0..=bits.below(3) {
        let at = bits.below(lines.len());
        match bits.below(8) {
            0 => drop(lines.remove(at)),
            1 => {
                let again = lines[at].clone();
                lines.insert(bits.below(lines.len()), again);
            }
            2 => {
                let other = bits.below(lines.len());
                lines.swap(at, other);
            }
            // A number, a text or a list becomes another value.
            3..=5 => {
                let line = &mut lines[at];
                let starts: Vec<usize> = (1..line.len())
                    .filter(|&i| {
                        let (before, now) = (line[i - 1], line[i]);
                        b" [,:=".contains(&before)
                            && (now.is_ascii_digit() || b"-\"[{".contains(&now))
                    })
                    .collect();
                if starts.is_empty() {
                    continue;
                }
                let start = *bits.of(&starts);
                let end = match line[start] {
                    b'[' | b'{' | b'"' => line.len().saturating_sub(1).max(start + 1),
                    _ => (start..line.len())
                        .find(|&i| b" ,]}\n".contains(&line[i]))
                        .unwrap_or(line.len()),
                };
                let value = bits.of(&VALUES).as_bytes().to_vec();
                line.splice(start..end, value);
            }
            _ => {
                let line = &mut lines[at];
                let i = bits.below(line.len());
                match bits.below(3) {
                    0 => line[i] = bits.next() as u8,
                    1 => drop(line.remove(i)),
                    _ => line.insert(i, bits.next() as u8),
                }
            }
        }
        if lines.is_empty() {
            break;
        }
        lines.retain(|line| !line.is_empty());
        if lines.is_empty() {
            break;
        }
    }
    lines.concat()
}

/// `bytes` with some changed, cut off, or put in.
fn damaged(bytes: &[u8], bits: &mut Bits) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    // The footer and the headers of pages are where lengths and kinds stand.
    let footer = 1 + bytes.len() * 3 / 4;
    for _ in 0..=bits.below(4) {
        if bytes.is_empty() {
            break;
        }
        let at = match bits.below(2) {
            0 => bits.below(bytes.len()),
            _ => (footer + bits.below(bytes.len())) % bytes.len(),
        };
        match bits.below(6) {
            0 => bytes.truncate(at),
            1 => bytes.insert(at, bits.next() as u8),
            2 => bytes[at] = *bits.of(&[0, 0x7f, 0x80, 0xff]),
            _ => bytes[at] ^= 1 << bits.below(8),
        }
    }
    bytes
}

/// A file of one kind, and what reads it.
struct Seed {
    name: String,
    content: Vec<u8>,
    read: fn(&Path) -> Result<(), String>,
}

impl Seed {
    /// Where its readers look for it.
    fn place(&self, folder: &Folder) -> PathBuf {
        match self.name.as_str() {
            "MANIFEST.json" => folder.path("lake").join(&self.name),
            name => folder.path(name),
        }
    }
}

fn said<T, E: std::fmt::Display>(result: Result<T, E>) -> Result<(), String> {
    result.map(drop).map_err(|e| e.to_string())
}

fn experiment(path: &Path) -> Result<(), String> {
    said(Experiment::load(path))
}

fn tracking(path: &Path) -> Result<(), String> {
    said(Tracking::load(path))
}

fn recording(path: &Path) -> Result<(), String> {
    said(recorded::measurements(path, &["y1"], recorded::LONGEST_GAP))
}

fn manifest(path: &Path) -> Result<(), String> {
    let lake = path.parent().expect("it lies in a folder");
    said(numbers::of_lake(lake))
}

fn truths(path: &Path) -> Result<(), String> {
    let decoded = said(table::read::<rows::Truth>(path));
    decoded.and(said(lake::count_rows(path)))
}

/// The files of the papers, a recording as CSV and as Parquet, and a small lake.
fn seeds(folder: &Folder) -> Vec<Seed> {
    let mut seeds = Vec::new();
    let mut seed = |name: &str, content: Vec<u8>, read| {
        seeds.push(Seed {
            name: name.to_owned(),
            content,
            read,
        });
    };
    let papers = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../experiments");
    let mut files: Vec<PathBuf> = program::files_below(&papers);
    // `figures.toml` tells of pictures.
    files.retain(|file| {
        file.extension().is_some_and(|e| e == "toml") && !file.ends_with("figures.toml")
    });
    for file in files {
        let text = std::fs::read(&file).unwrap();
        let name = file.file_name().unwrap().to_str().unwrap();
        seed(name, text.clone(), experiment);
        seed(name, text, tracking);
    }
    seed("small.toml", SMALL.into(), experiment);
    let recorded: String = (0..30)
        .map(|k| format!("{k},{}\n", 0.25 * f64::from(k)))
        .collect();
    seed("y.csv", format!("k,y1\n{recorded}").into(), recording);

    folder.write("small.toml", SMALL);
    folder.done(&["run", "small.toml", "--quiet"]);
    let lake = folder.path("lake");
    seed(
        "MANIFEST.json",
        std::fs::read(lake.join("MANIFEST.json")).unwrap(),
        manifest,
    );
    let truth = lake.join(lake::table_path("truth", "mine", "small"));
    seed("truth.parquet", std::fs::read(truth).unwrap(), truths);
    seed("y.parquet", parquet_recording(), recording);
    seeds
}

/// 3000 rows of k and y1, some of them missing.
fn parquet_recording() -> Vec<u8> {
    let k: ArrayRef = Arc::new(Int64Array::from_iter_values(0..3000));
    let y = (0..3000).map(|k| (k % 7 != 3).then(|| 0.25 * f64::from(k % 100)));
    let y: ArrayRef = Arc::new(Float64Array::from_iter(y));
    let batch = RecordBatch::try_from_iter([("k", k), ("y1", y)]).unwrap();
    let mut writer = ArrowWriter::try_new(Vec::new(), batch.schema(), None).unwrap();
    writer.write(&batch).unwrap();
    writer.into_inner().unwrap()
}

/// Case `case` of the seed: which file, and with what in it.
fn case(seeds: &[Seed], seed: u64, case: u64) -> (&Seed, Vec<u8>) {
    let mut bits = Bits(seed.wrapping_mul(0x2545_f491_4f6c_dd1d) ^ case);
    // A third of the cases are files of bytes, whose readers are not ours alone.
    let at = match bits.below(3) {
        0 => seeds.len() - 1 - bits.below(4),
        _ => bits.below(seeds.len()),
    };
    let seed = &seeds[at];
    let content = match seed.name.ends_with(".parquet") {
        true => damaged(&seed.content, &mut bits),
        false => changed(&seed.content, &mut bits),
    };
    (seed, content)
}

/// Reads one case; panics with the case where the reader does, takes long, or does not name the file.
fn check(folder: &Folder, seeds: &[Seed], seed: u64, number: u64) -> bool {
    let (file, content) = case(seeds, seed, number);
    let path = file.place(folder);
    std::fs::write(&path, &content).unwrap();
    let finding = |what: &str| {
        let kept = std::env::temp_dir().join(format!("zonobench-{seed}-{number}-{}", file.name));
        std::fs::write(&kept, &content).unwrap();
        panic!(
            "case {number} of seed {seed}, {}: {what}; kept in {}",
            file.name,
            kept.display()
        );
    };
    let start = Instant::now();
    let outcome = catch_unwind(AssertUnwindSafe(|| (file.read)(&path)));
    if start.elapsed() > Duration::from_secs(20) {
        finding("took more than 20 s");
    }
    match outcome {
        Err(_) => finding("the reader panicked"),
        // A wrong manifest may also be found by a file that it names.
        Ok(Err(message)) if !message.contains(&file.name) && !message.contains("lake") => {
            finding(&format!("an error that does not name the file: {message}"))
        }
        Ok(Err(_)) => false,
        Ok(Ok(())) => true,
    }
}

#[test]
fn changed_files_are_read_or_refused() {
    let folder = Folder::new();
    let seeds = seeds(&folder);
    for seed in &seeds {
        let path = seed.place(&folder);
        std::fs::write(&path, &seed.content).unwrap();
        (seed.read)(&path).unwrap_or_else(|e| panic!("{} as it is: {e}", seed.name));
    }
    let cases = 1500;
    let accepted = (0..cases).filter(|&n| check(&folder, &seeds, 1, n)).count() as u64;
    // Were all refused at the first byte, or none, the cases would say nothing.
    assert!(
        (cases / 20..cases * 19 / 20).contains(&accepted),
        "{accepted} of {cases} accepted"
    );
}

#[test]
#[ignore = "runs until its time is up"]
fn for_a_stated_time() {
    let number = |name: &str, default: u64| {
        std::env::var(name).map_or(default, |text| text.parse().expect(name))
    };
    let (seconds, seed) = (
        number("ZONOBENCH_FUZZ_SECONDS", 60),
        number("ZONOBENCH_FUZZ_SEED", 1),
    );
    let folder = Folder::new();
    let seeds = seeds(&folder);
    let end = Instant::now() + Duration::from_secs(seconds);
    let (mut cases, mut accepted) = (0, 0);
    while Instant::now() < end {
        accepted += u64::from(check(&folder, &seeds, seed, cases));
        cases += 1;
    }
    println!(
        "{cases} files of seed {seed}: {accepted} read, {} refused, 0 panics",
        cases - accepted
    );
}
