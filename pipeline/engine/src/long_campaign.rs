//! The long campaign: counted case by case into a file of the repository, which can be stopped at any time, gone
//! on with, and counted again.

use crate::progress::{Progress, Verbosity};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::{Duration, Instant};
use zonobench_attack::{Case, Counts, cases};
use zonobench_lake::error::Error;
use zonobench_lake::kept::read_kept;
use zonobench_verdicts::papers;

/// One case of the record: its units 0 … `units` − 1 and what was counted in them.
///
/// The units are runs, or batches of 250 sets, and depend on nothing but their number: the same row comes out on
/// every machine, with any number of threads.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordedAttack {
    /// Folder of the paper
    pub paper: String,
    /// The family of problems
    pub system: String,
    /// Estimator, or operation on sets
    pub estimator: String,
    /// How noise and first state, or the sets, are chosen
    pub attack: String,
    /// Whether none may be lost
    pub guaranteed: bool,
    /// Units that were counted, from 0
    pub units: u64,
    /// Sets that were judged
    pub steps: u64,
    /// Sets of which neither is certain
    pub undecided: u64,
    /// Sets that certainly do not hold the truth, or were called empty
    pub lost: u64,
    /// Of the lost, those that were called empty
    pub empty: u64,
    /// Runs that ended early without a set
    pub refused: u64,
    /// The code that counted, as in the keys of the stage `attack`; its first 16 digits
    pub code: String,
}

/// What [`RecordedAttack::code`] is of this program.
pub fn code() -> &'static str {
    &crate::code::of(zonobench_evidence::CRATE)[..16]
}

impl RecordedAttack {
    fn new(case: &Case) -> Self {
        Self {
            paper: case.paper.into(),
            system: case.system.into(),
            estimator: case.estimator.into(),
            attack: case.attack.clone(),
            guaranteed: case.guaranteed,
            units: 0,
            steps: 0,
            undecided: 0,
            lost: 0,
            empty: 0,
            refused: 0,
            code: code().to_owned(),
        }
    }

    fn is_of(&self, case: &Case) -> bool {
        (self.paper == case.paper && self.system == case.system)
            && (self.estimator == case.estimator && self.attack == case.attack)
            && self.guaranteed == case.guaranteed
    }

    fn counts(&self) -> Counts {
        Counts {
            steps: self.steps,
            lost: self.lost,
            empty: self.empty,
            undecided: self.undecided,
            refused: self.refused,
        }
    }

    fn add(&mut self, units: u64, counts: Counts) {
        let mut sum = self.counts();
        sum += counts;
        self.units += units;
        (self.steps, self.lost, self.empty) = (sum.steps, sum.lost, sum.empty);
        (self.undecided, self.refused) = (sum.undecided, sum.refused);
    }

    fn name(&self) -> String {
        let Self {
            paper,
            system,
            estimator,
            attack,
            ..
        } = self;
        format!("{paper}, {system}, {estimator}, {attack}")
    }
}

/// Where counting one estimator on one family of problems ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Until {
    /// So many sets, over all attacks …
    pub sets: u64,
    /// … or so many minutes of a thread in this call, whichever comes first.
    pub minutes: u64,
}

/// The record in `path`, none if there is no such file.
///
/// Fails where a row is not one, or says more sets lost, empty or undecided than can be.
pub fn read(path: &Path) -> Result<Vec<RecordedAttack>, Error> {
    let rows: Vec<RecordedAttack> = read_kept(path)?;
    for row in &rows {
        let sum = row.lost.checked_add(row.undecided);
        if row.empty > row.lost || sum.is_none_or(|sum| sum > row.steps) {
            return Err(Error::Refused {
                what: format!("{}: {}", path.display(), row.name()),
                expected: "empty <= lost and lost + undecided <= steps".into(),
                got: format!("{:?}", row.counts()),
            });
        }
    }
    Ok(rows)
}

/// Writes the record so that the file is always a whole one.
fn write(path: &Path, rows: &[RecordedAttack]) -> Result<(), Error> {
    let counted = rows.iter().filter(|row| row.units > 0);
    let mut csv = csv::Writer::from_writer(Vec::new());
    for row in counted {
        csv.serialize(row).map_err(|source| Error::CsvSyntax {
            file: path.display().to_string(),
            source,
        })?;
    }
    let text = csv
        .into_inner()
        .expect("a vector takes all that is written");
    let draft = path.with_extension("csv.tmp");
    std::fs::write(&draft, text).map_err(|e| Error::io("write", &draft, e))?;
    std::fs::rename(&draft, path).map_err(|e| Error::io("rename", &draft, e))
}

/// The cases of `paper` (of all if none), each with its row of the record, an empty one where it has none.
///
/// Fails where a row is of no case of this program.
fn joined(path: &Path) -> Result<Vec<(Case, RecordedAttack)>, Error> {
    let recorded = read(path)?;
    let cases = cases();
    if let Some(row) = recorded
        .iter()
        .find(|row| !cases.iter().any(|case| row.is_of(case)))
    {
        return Err(Error::Refused {
            what: path.display().to_string(),
            expected: "cases of the campaign".into(),
            got: row.name(),
        });
    }
    let with_row = |case: Case| {
        let row = recorded.iter().find(|row| row.is_of(&case)).cloned();
        let row = row.unwrap_or_else(|| RecordedAttack::new(&case));
        (case, row)
    };
    Ok(cases.into_iter().map(with_row).collect())
}

/// The sum over units `from` … `to` − 1.
fn count(case: &Case, from: u64, to: u64) -> Result<Counts, Error> {
    let units = (from..to).into_par_iter();
    let counted = units.map(|unit| case.count(unit).map_err(Error::Attack));
    // The sums are of integers: no order changes them.
    counted.try_reduce(Counts::default, |mut a, b| {
        a += b;
        Ok(a)
    })
}

/// What has become of one case in this call.
struct Pace {
    /// Time of a thread spent.
    spent: Duration,
    /// How long the next block may take.
    block: Duration,
    units: u64,
}

impl Pace {
    /// How many units the next block has, of a case of which so many sets are left: a unit a thread first, then as many
    /// as the time of a block affords, which doubles.
    fn next(&mut self, row: &RecordedAttack, left: u64, threads: u32) -> u64 {
        if self.units == 0 {
            return u64::from(threads);
        }
        let unit = (self.spent / self.units as u32).max(Duration::from_nanos(1));
        let wanted = left.div_ceil((row.steps / row.units.max(1)).max(1));
        let affordable = (self.block.as_nanos() / unit.as_nanos()) as u64;
        self.block = (2 * self.block).min(Duration::from_secs(60));
        wanted.min(affordable.max(u64::from(threads)))
    }
}

/// Goes on with the record in `path` until every case of `paper` (of all if none) has its share of `until`; what is
/// not guaranteed is counted as in the default campaign. The file is whole after every block of work.
///
/// Returns whether nothing guaranteed was lost. Fails where the file is not a record of this campaign, was counted by
/// other code, cannot be written, or a run fails.
pub fn record(
    path: &Path,
    paper: Option<&str>,
    until: Until,
    progress: &Progress,
) -> Result<bool, Error> {
    if let Some(paper) = paper {
        papers::load(&[paper.to_owned()])?;
    }
    let mut all = joined(path)?;
    if let Some((_, row)) = all.iter().find(|(_, row)| row.code != code()) {
        return Err(Error::Refused {
            what: format!("{}: {}", path.display(), row.name()),
            expected: format!(
                "counts of this program's code, {}: begin a new file",
                code()
            ),
            got: format!("those of {}", row.code),
        });
    }
    let threads = rayon::current_num_threads() as u32;
    let attacks: Vec<u32> = all
        .iter()
        .map(|(case, _)| {
            let same = |other: &&(Case, RecordedAttack)| {
                (other.0.system, other.0.estimator, other.0.paper)
                    == (case.system, case.estimator, case.paper)
            };
            all.iter().filter(same).count() as u32
        })
        .collect();
    let mut paces: Vec<Pace> = all
        .iter()
        .map(|_| Pace {
            spent: Duration::ZERO,
            block: Duration::from_secs(2),
            units: 0,
        })
        .collect();
    loop {
        let mut done = true;
        for i in 0..all.len() {
            let (case, row) = &all[i];
            let pace = &mut paces[i];
            let share = until.sets.div_ceil(u64::from(attacks[i]));
            let time = Duration::from_secs(60 * until.minutes) / attacks[i];
            let left = if case.guaranteed {
                share.saturating_sub(row.steps)
            } else {
                u64::from(row.units < case.units)
            };
            if paper.is_some_and(|p| p != case.paper) || left == 0 || pace.spent >= time {
                continue;
            }
            done = false;
            let block = match case.guaranteed {
                true => pace.next(row, left, threads),
                false => case.units - row.units,
            };
            let start = Instant::now();
            let counts = count(case, row.units, row.units + block)?;
            pace.spent += start.elapsed() * threads;
            pace.units += block;
            all[i].1.add(block, counts);
            let rows: Vec<RecordedAttack> = all.iter().map(|(_, row)| row.clone()).collect();
            write(path, &rows)?;
        }
        let sum = |of: fn(&RecordedAttack) -> u64| -> u64 {
            let guaranteed = all.iter().filter(|(case, _)| case.guaranteed);
            guaranteed.map(|(_, row)| of(row)).sum()
        };
        let (sets, lost) = (sum(|row| row.steps), sum(|row| row.lost));
        progress.say(
            Verbosity::Normal,
            &format!("guaranteed: {lost} of {sets} sets lost so far"),
        );
        if done {
            return Ok(lost == 0);
        }
    }
}

/// Counts every unit of the record in `path` again; returns the number of sets.
///
/// Fails where a row comes out differently, and says which.
pub fn recount(path: &Path, paper: Option<&str>, progress: &Progress) -> Result<u64, Error> {
    let mut sets = 0;
    for (case, row) in joined(path)? {
        if row.units == 0 || paper.is_some_and(|p| p != case.paper) {
            continue;
        }
        let counts = count(&case, 0, row.units)?;
        if counts != row.counts() {
            return Err(Error::Refused {
                what: format!("{}: {}", path.display(), row.name()),
                expected: format!("{counts:?} in {} units, by code {}", row.units, code()),
                got: format!("{:?}, by code {}", row.counts(), row.code),
            });
        }
        sets += counts.steps;
        progress.say(Verbosity::Verbose, &format!("{}: the same", row.name()));
    }
    Ok(sets)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str =
        "paper,system,estimator,attack,guaranteed,units,steps,undecided,lost,empty,refused,code\n";

    #[test]
    fn counts_of_two_codes_are_never_added_and_a_changed_count_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("attack.csv");
        let (quiet, until) = (
            Progress::new(Verbosity::Quiet, 1),
            Until {
                sets: 200,
                minutes: 1,
            },
        );
        let other = "box,linear,box-state-est,uniform,true,1,40,0,0,0,0,0123456789abcdef\n";
        std::fs::write(&path, format!("{HEADER}{other}")).unwrap();
        let message = record(&path, Some("box"), until, &quiet).unwrap_err();
        assert!(
            message.to_string().contains("begin a new file"),
            "{message}"
        );

        std::fs::remove_file(&path).unwrap();
        assert!(record(&path, Some("box"), until, &quiet).unwrap());
        let whole = std::fs::read_to_string(&path).unwrap();
        assert!(whole.starts_with(HEADER) && whole.contains(code()));
        let sets = read(&path)
            .unwrap()
            .iter()
            .map(|row| row.steps)
            .sum::<u64>();
        assert_eq!(recount(&path, Some("box"), &quiet).unwrap(), sets);

        let mut rows = read(&path).unwrap();
        rows[0].steps += 1;
        write(&path, &rows).unwrap();
        let message = recount(&path, Some("box"), &quiet).unwrap_err().to_string();
        assert!(message.contains(&rows[0].name()), "{message}");
    }
}
