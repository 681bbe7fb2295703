//! The command line.

use crate::engine::{self, Finished};
use crate::error::Error;
use crate::experiment::Experiment;
use crate::lake;
use crate::papers::{self, Paper};
use crate::progress::{Progress, Verbosity};
use crate::query;
use crate::report;
use crate::stage::compare::Scale;
use crate::store::{Status, Store};
use crate::tables;
use crate::tracking;
use clap::{Args, Parser, Subcommand};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// Set-membership and mixed state estimation: published results, rebuilt and compared.
///
/// `zonobench reproduce-all` runs every published experiment and ends with a verdict for every printed
/// number. Results lie in a lake of Parquet tables and MCAP traces that `tables`, `query` and `report` read.
/// Nothing is computed twice: the same command after a change, or after a kill, runs what is missing.
#[derive(Parser)]
#[command(name = "zonobench", version, max_term_width = 110)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Say nothing but results and errors
    #[arg(long, short, global = true)]
    quiet: bool,
    /// Say more
    #[arg(long, short, global = true)]
    verbose: bool,
}

#[derive(Subcommand)]
enum Command {
    /// Rebuild the papers: every experiment, the lake, the traces, the tables, the report
    ///
    /// Exit code 0: done, every published number has a verdict and no guarantee is violated ("differs" is a
    /// finding, not a failure); 1: something failed or a guarantee is violated; 2: bad usage.
    ReproduceAll(Reproduce),
    /// Run your own experiment files through the same stages
    Run {
        /// Experiment files (see the README for their form)
        #[arg(required = true)]
        files: Vec<PathBuf>,
        #[command(flatten)]
        lake: LakeArg,
        /// Threads; all processors if not given
        #[arg(long)]
        jobs: Option<usize>,
    },
    /// Run estimators on recorded data: no simulation, no truth
    Track {
        /// An experiment file: system, prior, noise and estimators are read
        file: PathBuf,
        /// Measurements, CSV or Parquet: column k and one a component; an empty cell was not measured
        #[arg(long)]
        measurements: PathBuf,
        /// Inputs, in the same form
        #[arg(long)]
        inputs: Option<PathBuf>,
        /// Folder for estimates.parquet, beliefs.parquet and estimators.parquet
        #[arg(long)]
        out: PathBuf,
    },
    /// Show what would run, and why
    Plan {
        /// Only this paper (may be repeated)
        #[arg(long)]
        paper: Vec<String>,
        /// As a graph for Graphviz
        #[arg(long)]
        dot: bool,
        #[command(flatten)]
        lake: LakeArg,
    },
    /// Show why one result would run: the part of its key that differs from what the lake holds
    Explain {
        /// PAPER/EXPERIMENT[/STAGE[/ESTIMATOR]], as `plan` lists them
        target: String,
        #[command(flatten)]
        lake: LakeArg,
    },
    /// The papers' tables: published, reproduced, interval, verdict
    Tables {
        /// Paper (all if not given)
        paper: Option<String>,
        /// Table, as the paper calls it ("Table III")
        table: Option<String>,
        /// How to print them
        #[arg(long, value_enum, default_value = "table")]
        format: tables::Format,
        #[command(flatten)]
        lake: LakeArg,
    },
    /// SQL over the lake; every lake table is a table name, with columns paper and experiment
    ///
    /// For example: zonobench query "SELECT experiment, estimator, metric, component, mean, sd FROM scores
    /// WHERE paper = 'ezgkf' AND metric = 'rmse'"
    Query {
        /// The query
        sql: String,
        /// How to print the result
        #[arg(long, value_enum, default_value = "table")]
        format: query::Format,
        #[command(flatten)]
        lake: LakeArg,
    },
    /// Render the reports from what the lake holds
    Report {
        #[command(flatten)]
        lake: LakeArg,
        /// Folder for the reports
        #[arg(long, default_value = "reports")]
        out: PathBuf,
    },
    /// Rehash every file against the manifest; check schemas, rows, and that no guarantee is violated
    Verify {
        #[command(flatten)]
        lake: LakeArg,
    },
}

#[derive(Args)]
struct LakeArg {
    /// The lake
    #[arg(long, default_value = "lake")]
    lake: PathBuf,
}

#[derive(Args)]
struct Reproduce {
    /// Only this paper (may be repeated)
    #[arg(long)]
    paper: Vec<String>,
    /// A smoke run of under a minute: few runs and steps, numbers compared with nothing
    #[arg(long, conflicts_with = "full")]
    quick: bool,
    /// More seeds where the default uses one
    #[arg(long)]
    full: bool,
    /// Threads; all processors if not given
    #[arg(long)]
    jobs: Option<usize>,
    /// The lake [default: lake, with --quick lake-quick]
    #[arg(long)]
    lake: Option<PathBuf>,
    /// Folder for the reports [default: reports below the current folder if it is there, else in the lake]
    #[arg(long)]
    reports: Option<PathBuf>,
}

/// Parses the arguments, runs, and says how it went by the exit code.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    let verbosity = match (cli.quiet, cli.verbose) {
        (true, _) => Verbosity::Quiet,
        (_, true) => Verbosity::Verbose,
        _ => Verbosity::Normal,
    };
    match run(cli.command, verbosity) {
        Ok(code) => ExitCode::from(code),
        Err(error) => {
            let code = error.exit_code();
            eprintln!("{:?}", miette::Report::new(error));
            ExitCode::from(code as u8)
        }
    }
}

fn run(command: Command, verbosity: Verbosity) -> Result<u8, Error> {
    match command {
        Command::ReproduceAll(options) => reproduce_all(&options, verbosity),
        Command::Run { files, lake, jobs } => run_files(&files, &lake.lake, jobs, verbosity),
        Command::Track {
            file,
            measurements,
            inputs,
            out,
        } => {
            for tracked in tracking::track(&file, &measurements, inputs.as_deref(), &out)? {
                for (estimator, k) in &tracked.inconsistent {
                    println!(
                        "{}: {estimator}: the measurement at k = {k} contradicts the model",
                        tracked.id
                    );
                }
                if verbosity != Verbosity::Quiet {
                    let out = tracked.out.display();
                    println!(
                        "{}: k = 0 to {}; see {out}/estimates.parquet",
                        tracked.id, tracked.steps
                    );
                }
            }
            Ok(0)
        }
        Command::Plan { paper, dot, lake } => plan(&paper, dot, &lake.lake),
        Command::Explain { target, lake } => explain(&target, &lake.lake),
        Command::Tables {
            paper,
            table,
            format,
            lake,
        } => {
            print!(
                "{}",
                tables::render(&lake.lake, paper.as_deref(), table.as_deref(), format)?
            );
            Ok(0)
        }
        Command::Query { sql, format, lake } => {
            print!("{}", query::render(&query::run(&lake.lake, &sql)?, format));
            Ok(0)
        }
        Command::Report { lake, out } => {
            let written = report::write(&lake.lake, &out)?;
            println!("{written} files in {}", out.display());
            Ok(0)
        }
        Command::Verify { lake } => verify(&lake.lake),
    }
}

fn threads(jobs: Option<usize>) -> Result<rayon::ThreadPool, Error> {
    let jobs = match jobs {
        Some(0) => {
            return Err(Error::Unknown {
                what: "number of threads",
                got: "0".to_owned(),
                expected: "--jobs takes a number of at least 1".to_owned(),
            });
        }
        Some(n) => n,
        None => std::thread::available_parallelism().map_or(1, usize::from),
    };
    rayon::ThreadPoolBuilder::new()
        .num_threads(jobs)
        .build()
        .map_err(|e| Error::Unknown {
            what: "number of threads",
            got: jobs.to_string(),
            expected: e.to_string(),
        })
}

fn work(experiments: &[Arc<Experiment>]) -> u64 {
    experiments
        .iter()
        .map(|e| (e.runs * (1 + e.estimators.len())) as u64)
        .sum()
}

fn run_all(
    store: &Store,
    experiments: &[Arc<Experiment>],
    progress: &Progress,
) -> Result<Vec<Finished>, Error> {
    let finished = experiments
        .par_iter()
        .map(|e| engine::run(store, e, progress))
        .collect();
    progress.clear();
    finished
}

fn reproduce_all(options: &Reproduce, verbosity: Verbosity) -> Result<u8, Error> {
    let start = Instant::now();
    let mut papers = papers::load(&options.paper)?;
    if options.quick {
        papers = papers.into_iter().map(Paper::quick).collect();
    }
    let scale = if options.quick {
        Scale::Quick
    } else {
        Scale::Full
    };
    let default = if options.quick { "lake-quick" } else { "lake" };
    let lake = options.lake.clone().unwrap_or_else(|| default.into());
    let store = Store::open(&lake)?;
    let experiments: Vec<Arc<Experiment>> =
        papers.iter().flat_map(|p| p.experiments.clone()).collect();
    let progress = Progress::new(verbosity, work(&experiments));
    let pool = threads(options.jobs)?;
    let finished = pool.install(|| run_all(&store, &experiments, &progress))?;
    let mut files = Vec::new();
    for f in &finished {
        files.extend(engine::publications(f)?);
    }
    for paper in &papers {
        let comparison = engine::compare(&store, paper, &finished, scale)?;
        files.extend(engine::paper_publications(paper, &comparison)?);
    }
    let names: Vec<&str> = papers.iter().map(|p| p.name.as_str()).collect();
    pool.install(|| lake::publish(&lake, files, |paper, _| names.contains(&paper)))?;
    for f in &finished {
        engine::write_timings(&lake, f)?;
    }
    for paper in &papers {
        engine::write_timing_comparison(&lake, paper, &finished)?;
    }
    let reports = options.reports.clone().unwrap_or_else(|| {
        // Only the whole of the published run belongs on the committed pages.
        let here = PathBuf::from("reports");
        if !options.quick && here.is_dir() {
            here
        } else {
            lake.join("reports")
        }
    });
    report::write(&lake, &reports)?;
    let entries = lake::read_manifest(&lake)?;
    let violations = lake::violations(&lake, &entries)?;
    log_run(&lake, "reproduce-all", start, &finished)?;
    let errors = summary(&lake, &reports, options.quick, verbosity)?;
    for violation in &violations {
        eprintln!("{}: {}", violation.path, violation.what);
    }
    if verbosity != Verbosity::Quiet {
        let (made, found) = finished
            .iter()
            .fold((0, 0), |(m, f), x| (m + x.made, f + x.found));
        println!(
            "{made} results made, {found} found, {:.1} s",
            start.elapsed().as_secs_f64()
        );
    }
    Ok(u8::from(errors > 0 || !violations.is_empty()))
}

/// Prints the matrix of verdicts and where to look; returns the number of cells in error.
fn summary(lake: &Path, reports: &Path, quick: bool, verbosity: Verbosity) -> Result<usize, Error> {
    let matrix = tables::matrix(lake)?;
    let errors = matrix
        .iter()
        .filter(|(_, _, verdict, _)| verdict == "error")
        .map(|(_, _, _, n)| n)
        .sum();
    if verbosity == Verbosity::Quiet {
        return Ok(errors);
    }
    if quick {
        println!(
            "A quick run: every method and table, few runs; its numbers are compared with nothing.\n"
        );
    } else {
        println!(
            "What the papers print, as reproduced (reading as-written):\n\n{}",
            tables::matrix_text(lake)?
        );
    }
    println!("Report:  {}/README.md", reports.display());
    println!("Tables:  zonobench tables [PAPER [TABLE]]{}", flag(lake));
    println!(
        "Data:    zonobench query \"SELECT * FROM scores LIMIT 5\"{}",
        flag(lake)
    );
    Ok(errors)
}

fn flag(lake: &Path) -> String {
    if lake == Path::new("lake") {
        String::new()
    } else {
        format!(" --lake {}", lake.display())
    }
}

fn run_files(
    files: &[PathBuf],
    lake: &Path,
    jobs: Option<usize>,
    verbosity: Verbosity,
) -> Result<u8, Error> {
    let start = Instant::now();
    let mut experiments: Vec<Arc<Experiment>> = Vec::new();
    for file in files {
        for experiment in Experiment::load(file)? {
            if experiments.iter().any(|e| e.name() == experiment.name()) {
                return Err(Error::Unknown {
                    what: "place for a second experiment",
                    got: experiment.name(),
                    expected: format!(
                        "{} gives an id that another file gave: ids differ",
                        file.display()
                    ),
                });
            }
            experiments.push(Arc::new(experiment));
        }
    }
    let store = Store::open(lake)?;
    let progress = Progress::new(verbosity, work(&experiments));
    let pool = threads(jobs)?;
    let finished = pool.install(|| run_all(&store, &experiments, &progress))?;
    let mut published = Vec::new();
    for f in &finished {
        published.extend(engine::publications(f)?);
    }
    let ours = |paper: &str, experiment: Option<&str>| {
        experiment.is_some_and(|id| experiments.iter().any(|e| e.paper == paper && e.id == id))
    };
    pool.install(|| lake::publish(lake, published, ours))?;
    for f in &finished {
        engine::write_timings(lake, f)?;
    }
    log_run(lake, "run", start, &finished)?;
    let violations: Vec<_> = lake::violations(lake, &lake::read_manifest(lake)?)?;
    for violation in &violations {
        eprintln!("{}: {}", violation.path, violation.what);
    }
    if verbosity != Verbosity::Quiet {
        for e in &experiments {
            let sql = format!(
                "SELECT estimator, metric, component, n_runs, mean, sd FROM scores WHERE paper = '{}' AND experiment = '{}'",
                e.paper, e.id
            );
            println!(
                "\n{}\n\n{}",
                e.name(),
                query::render(&query::run(lake, &sql)?, query::Format::Table)
            );
        }
        println!(
            "Data:    zonobench query \"SELECT * FROM estimates LIMIT 5\"{}",
            flag(lake)
        );
    }
    Ok(u8::from(!violations.is_empty()))
}

/// Appends one line to the run log: when, how long, what. Never hashed.
fn log_run(lake: &Path, command: &str, start: Instant, finished: &[Finished]) -> Result<(), Error> {
    let path = lake.join("runlog.jsonl");
    let unix = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |t| t.as_secs());
    let line = serde_json::json!({
        "command": command,
        "unix_time_s": unix,
        "seconds": start.elapsed().as_secs_f64(),
        "version": env!("CARGO_PKG_VERSION"),
        "processor": processor(),
        "threads": rayon::current_num_threads(),
        "made": finished.iter().map(|f| f.made).sum::<usize>(),
        "found": finished.iter().map(|f| f.found).sum::<usize>(),
    });
    let append = || -> std::io::Result<()> {
        let mut file = std::fs::File::options()
            .create(true)
            .append(true)
            .open(&path)?;
        std::io::Write::write_all(&mut file, format!("{line}\n").as_bytes())
    };
    append().map_err(|e| Error::io("append to", &path, e))
}

/// The processor's model, where the system tells it.
fn processor() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info
        .lines()
        .find_map(|line| line.strip_prefix("model name"));
    model.map_or_else(
        || "unknown".to_owned(),
        |m| m.trim_start_matches([' ', '\t', ':']).to_owned(),
    )
}

fn plan(wanted: &[String], dot: bool, lake: &Path) -> Result<u8, Error> {
    let store = Store::read_only(lake);
    let (mut cached, mut to_run) = (0, 0);
    if dot {
        println!("digraph zonobench {{\n  rankdir = LR;");
    }
    for paper in papers::load(wanted)? {
        for experiment in &paper.experiments {
            let planned = engine::plan(&store, experiment);
            if dot {
                print!("{}", engine::dot(experiment, &planned));
                continue;
            }
            for line in planned {
                let why = match &line.status {
                    Status::Cached => {
                        cached += 1;
                        continue;
                    }
                    Status::Missing => "was never made".to_owned(),
                    Status::Upstream => "reads what runs before it".to_owned(),
                    Status::Changed(changes) => {
                        let (place, old, new) = &changes[0];
                        let more = changes.len() - 1;
                        let more = if more > 0 {
                            format!(" (and {more} more)")
                        } else {
                            String::new()
                        };
                        format!("{place}: {old} -> {new}{more}")
                    }
                };
                to_run += 1;
                println!("{}: {why}", line.target);
            }
        }
    }
    if dot {
        println!("}}");
    } else {
        println!("{to_run} results to make, {cached} in the lake");
    }
    Ok(0)
}

fn explain(wanted: &str, lake: &Path) -> Result<u8, Error> {
    let store = Store::read_only(lake);
    let mut known = Vec::new();
    let mut found = false;
    let paper = wanted.split('/').next().unwrap_or_default().to_owned();
    for paper in papers::load(&[paper])? {
        for experiment in &paper.experiments {
            known.push(experiment.name());
            for line in engine::plan(&store, experiment) {
                let name = line.target.to_string();
                if name != wanted && !name.starts_with(&format!("{wanted}/")) {
                    continue;
                }
                found = true;
                match line.status {
                    Status::Cached => println!("{name}: in the lake, would not run"),
                    Status::Missing => println!("{name}: would run, it was never made"),
                    Status::Upstream => println!("{name}: would run, it reads what runs before it"),
                    Status::Changed(changes) => {
                        println!("{name}: would run, its key differs:");
                        for (place, old, new) in changes {
                            println!("  {place}: {old} -> {new}");
                        }
                    }
                }
            }
        }
    }
    if found {
        return Ok(0);
    }
    Err(Error::Unknown {
        what: "target",
        got: wanted.to_owned(),
        expected: format!("experiments: {}", known.join(", ")),
    })
}

fn verify(lake: &Path) -> Result<u8, Error> {
    let (files, findings) = lake::verify(lake)?;
    for finding in &findings {
        println!("{}: {}", finding.path, finding.what);
    }
    if findings.is_empty() {
        println!("{files} files as the manifest says, no guarantee violated");
        Ok(0)
    } else {
        println!("{} faults in {files} files", findings.len());
        Ok(1)
    }
}
