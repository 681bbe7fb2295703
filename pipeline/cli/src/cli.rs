//! The command line.

use crate::{diff, new};
use clap::{Args, CommandFactory as _, Parser, Subcommand};
use rayon::prelude::*;
use std::io::{BufWriter, ErrorKind, IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Instant, SystemTime, UNIX_EPOCH};
use zonobench_engine::campaign;
use zonobench_engine::engine::{self, Finished};
use zonobench_engine::long_campaign::{self, Until};
use zonobench_engine::progress::{Progress, Verbosity};
use zonobench_evidence::attack::{self, Size};
use zonobench_evidence::count::text as counts_text;
use zonobench_evidence::ledger;
use zonobench_lab::experiment::{Experiment, allow_commands};
use zonobench_lab::outlook;
use zonobench_lab::recorded;
use zonobench_lab::tracking::{self, MOST_FOLDED, Tracked};
use zonobench_lake::error::Error;
use zonobench_lake::lake;
use zonobench_lake::numbers;
use zonobench_lake::store::{Status, Store};
use zonobench_query::query;
use zonobench_query::tables;
use zonobench_report as report;
use zonobench_verdicts::compare::Scale;
use zonobench_verdicts::papers::{self, Paper};
use zonobench_verdicts::rank::{self, Wanted};
use zonobench_verdicts::verdict::Verdict;

/// Set-membership and mixed state estimation: published results, rebuilt and compared.
///
/// `zonobench reproduce-all` runs every published experiment and ends with a verdict for every printed
/// number and claim that `published.csv` lists. Results lie in a lake of Parquet tables and MCAP traces that `tables`, `query` and `report` read.
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
    /// Exit code 0: done, every published row has a verdict and no guarantee is violated ("differs" is a
    /// finding, not a failure); 1: something failed or a guarantee is violated; 2: bad usage.
    ReproduceAll(Reproduce),
    /// Write an experiment file to start from: commented, and it runs as it is
    ///
    /// For example: zonobench new pendulum.toml, then zonobench check pendulum.toml, then zonobench run pendulum.toml.
    New {
        /// The file; its name becomes the experiment's
        file: PathBuf,
        /// What it is about
        #[arg(long, value_enum, default_value = "equations")]
        system: new::System,
        /// Write over a file that is there
        #[arg(long)]
        force: bool,
    },
    /// Say what was understood of an experiment file; nothing runs, nothing is written
    ///
    /// Dimensions, names and units; what is linear in what; the Jacobian at the center of the prior; which estimators apply, and why
    /// the others do not; how many rows and how much memory a run takes. Of a sweep, the first experiment is shown.
    /// Exit code 0: it would run, though there may be warnings; 2: it would not, and the place is shown.
    Check {
        /// The experiment file
        file: PathBuf,
    },
    /// Run your own experiment files through the same stages
    Run {
        /// Experiment files (see the README for their form)
        #[arg(required = true)]
        files: Vec<PathBuf>,
        #[command(flatten)]
        lake: LakeArg,
        /// Threads; all processors if not given
        #[arg(long, value_parser = number_of_threads)]
        jobs: Option<usize>,
        /// Start the programs that the files name as estimators (kind = "command"), with your rights
        #[arg(long)]
        allow_commands: bool,
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
        /// Folder for estimates.parquet, beliefs.parquet and estimators.parquet, and for sets.parquet where the
        /// file asks for sets
        #[arg(long)]
        out: PathBuf,
        /// How many steps in a row may have no measurement: each of them is predicted
        #[arg(long, value_name = "STEPS", default_value_t = recorded::LONGEST_GAP)]
        longest_gap: usize,
        /// Start the programs that the file names as estimators (kind = "command"), with your rights
        #[arg(long)]
        allow_commands: bool,
    },
    /// Show what would run, and why
    Plan {
        /// Your own experiment files; without any, the papers
        #[arg(conflicts_with = "paper")]
        files: Vec<PathBuf>,
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
        /// PAPER[/EXPERIMENT[/STAGE[/ESTIMATOR]]], as `plan` lists them
        target: String,
        /// Your own experiment files, if the target is in one of them
        files: Vec<PathBuf>,
        #[command(flatten)]
        lake: LakeArg,
    },
    /// What moved between two lakes: published cells, scores and claims, and the part of a key that did it
    ///
    /// A number that stays in the first lake's interval moved within it. Exit code 0: nothing moved beyond; 1: a number
    /// left its interval, or has none and moved, or a verdict is another one; 2: bad usage. A lake of an older version
    /// may lack tables and columns: that is told, and no failure.
    ///
    /// For example: zonobench diff lake-before lake --format markdown
    Diff {
        /// The first lake
        first: PathBuf,
        /// The second
        second: PathBuf,
        /// How to print it
        #[arg(long, value_enum, default_value = "table")]
        format: diff::Format,
        /// Every line; without it, 20 of each kind (JSON and HTML have all)
        #[arg(long)]
        all: bool,
    },
    /// The papers' claims about cost: what was counted beside what the formulas say
    Count {
        /// Paper (all if not given)
        paper: Option<String>,
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
    /// Compare methods on the same draws: ratios of means by paired differences, with a verdict
    ///
    /// Every two estimators of an experiment are compared by every metric, run by run: the ratio of their means, its 99 %
    /// interval from the pairs, and what follows for the first: "less", "more", or "no difference" where the interval
    /// holds 1. "undecided": fewer than two runs have both, or the runs do not differ, so that they say nothing of others.
    /// An estimator's rank is one more than the number of those that are less for certain; equal ranks are not told
    /// apart. Less is better of errors and sizes, not of `contains` or `coverage`. Of a hundred comparisons of equal
    /// methods one is wrong by chance.
    ///
    /// For example: zonobench rank ezgkf/lpv --metric rmse
    Rank {
        /// PAPER, PAPER/EXPERIMENT or EXPERIMENT (all that the lake holds if not given)
        experiments: Vec<String>,
        /// Only this metric (may be repeated)
        #[arg(long, value_name = "NAME")]
        metric: Vec<String>,
        /// Only comparisons with this estimator
        #[arg(long, value_name = "ID")]
        against: Option<String>,
        /// How to print them: csv and json have a row a pair
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
    /// What the authors of a paper would want to read, as Markdown
    ///
    /// Every verdict of the paper that is not a success: the evidence, the command that shows it, and what would
    /// change it.
    Dossier {
        /// Paper
        paper: String,
        /// A file for it; the terminal if not given
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
        #[command(flatten)]
        lake: LakeArg,
    },
    /// Try the papers' numbered claims in exact arithmetic: verdict, counterexample
    ///
    /// Nothing is read or kept: the same command gives the same counts. The lake's table `claims` holds them too.
    Claims {
        /// Paper (all if not given)
        paper: Option<String>,
        /// Only this claim, with its statement and what follows
        #[arg(long, value_name = "ID")]
        claim: Option<String>,
        /// Threads; all processors if not given
        #[arg(long, value_parser = number_of_threads)]
        jobs: Option<usize>,
    },
    /// Attack what is called guaranteed, and count the sets that do not hold the truth
    ///
    /// Random and adversarial problems; noise on the vertices of its bounds, bang-bang, constant, or chosen by an
    /// adversary that sees the sets. Nothing is read or kept; the lake's table `attack` holds the default campaign.
    /// Exit code 1 if something guaranteed was lost.
    Attack {
        /// Paper (all if not given)
        paper: Option<String>,
        /// So many times the runs of the default campaign
        #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
        times: u64,
        /// Go on with the long campaign in this file; it can be stopped at any time, and is whole after every block
        #[arg(long, value_name = "FILE", conflicts_with = "times")]
        record: Option<PathBuf>,
        /// With --record: so many sets of every estimator on every family of problems ...
        #[arg(
            long,
            value_name = "N",
            default_value_t = 1_000_000,
            requires = "record"
        )]
        sets: u64,
        /// ... or so many minutes of a thread in this call, whichever comes first
        #[arg(long, value_name = "M", default_value_t = 10, requires = "record", value_parser = clap::value_parser!(u64).range(1..=100_000))]
        minutes: u64,
        /// Count every unit of the long campaign in this file again; exit code 1 where a count differs
        #[arg(long, value_name = "FILE", conflicts_with_all = ["times", "record"])]
        recount: Option<PathBuf>,
        /// Threads; all processors if not given
        #[arg(long, value_parser = number_of_threads)]
        jobs: Option<usize>,
    },
    /// Print what a shell needs to complete the commands, or the manual's pages
    ///
    /// For example: zonobench completions bash > ~/.local/share/bash-completion/completions/zonobench
    Completions {
        /// The shell; `man` writes a manual page a command instead
        #[arg(value_enum)]
        shell: Shell,
        /// With `man`: the folder for the pages
        #[arg(long, default_value = ".", value_name = "FOLDER")]
        out: PathBuf,
    },
    /// Rehash every file against the manifest; check schemas, rows, and that no guarantee is violated
    Verify {
        #[command(flatten)]
        lake: LakeArg,
        /// Only print a hash of the numbers of each table, to compare builds and machines
        #[arg(long)]
        numbers: bool,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Shell {
    Bash,
    Zsh,
    Fish,
    Man,
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
    #[arg(long, value_parser = number_of_threads)]
    jobs: Option<usize>,
    /// The lake [default: lake, with --quick lake-quick]
    #[arg(long)]
    lake: Option<PathBuf>,
    /// Folder for the reports [default: reports below the current folder if it is there and the lake
    /// holds every paper, else in the lake]
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
    // It is set once, so nothing was set before.
    let _ = miette::set_hook(Box::new(|_| Box::new(error_style())));
    match run(cli.command, verbosity) {
        Ok(code) => ExitCode::from(code),
        Err(error) => {
            let code = error.exit_code();
            eprintln!("{:?}", miette::Report::new(error));
            ExitCode::from(code as u8)
        }
    }
}

/// How errors are drawn: never with a path broken in two, and in lines as they come where a program reads them.
fn error_style() -> miette::MietteHandler {
    miette::MietteHandlerOpts::new()
        // Every message holds its cause already.
        .without_cause_chain()
        .break_words(false)
        .wrap_lines(std::io::stderr().is_terminal())
        .build()
}

/// Writes results to the standard output. A reader who has seen enough (`zonobench query … | head`) is no error.
fn print(text: &str) -> Result<(), Error> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => {
            Err(Error::io("write to", Path::new("the standard output"), e))
        }
        _ => Ok(()),
    }
}

fn run(command: Command, verbosity: Verbosity) -> Result<u8, Error> {
    match command {
        Command::ReproduceAll(options) => reproduce_all(&options, verbosity),
        Command::New {
            file,
            system,
            force,
        } => {
            new::write(&file, system, force)?;
            if verbosity != Verbosity::Quiet {
                let file = file.display();
                print(&format!(
                    "{file} is written. Try:\n  zonobench check {file}\n  zonobench run {file}\n"
                ))?;
            }
            Ok(0)
        }
        Command::Check { file } => check(&file),
        Command::Run {
            files,
            lake,
            jobs,
            allow_commands,
        } => {
            let experiments = load(&files, allow_commands)?;
            if verbosity != Verbosity::Quiet {
                files.iter().for_each(|file| warn(file));
            }
            run_files(experiments, &lake.lake, jobs, verbosity)
        }
        Command::Track {
            file,
            measurements,
            inputs,
            out,
            longest_gap,
            allow_commands,
        } => {
            let recording = tracking::Files {
                measurements: &measurements,
                inputs: inputs.as_deref(),
                longest_gap,
                allow_commands,
            };
            track(&tracking::track(&file, &recording, &out)?, verbosity)
        }
        Command::Plan {
            files,
            paper,
            dot,
            lake,
        } => {
            let (papers, gallery) = match files.is_empty() {
                true => published(&paper)?,
                false => (Vec::new(), Vec::new()),
            };
            let experiments = experiments(&files, &paper)?;
            plan(&experiments, &papers, &gallery, dot, &lake.lake)
        }
        Command::Explain {
            target,
            files,
            lake,
        } => explain(&target, &files, &lake.lake),
        Command::Diff {
            first,
            second,
            format,
            all,
        } => {
            let found = diff::diff(&first, &second)?;
            print(&found.render(format, all))?;
            Ok(u8::from(found.moved_beyond()))
        }
        Command::Completions { shell, out } => completions(shell, &out),
        Command::Dossier { paper, out, lake } => {
            let text = report::dossier(&lake.lake, &paper)?;
            match out {
                Some(file) => std::fs::write(&file, text)
                    .map_err(|e| Error::io("write", &file, e))
                    .map(|()| 0),
                None => print(&text).map(|()| 0),
            }
        }
        Command::Count { paper, lake } => count(paper.as_deref(), &lake.lake),
        Command::Tables {
            paper,
            table,
            format,
            lake,
        } => {
            print(&tables::render(
                &lake.lake,
                paper.as_deref(),
                table.as_deref(),
                format,
            )?)?;
            Ok(0)
        }
        Command::Query { sql, format, lake } => {
            let mut out = BufWriter::new(std::io::stdout());
            query::write(&lake.lake, &sql, format, &mut out)?;
            Ok(0)
        }
        Command::Rank {
            experiments,
            metric,
            against,
            format,
            lake,
        } => {
            let wanted = Wanted {
                experiments,
                metrics: metric,
                against,
            };
            let rankings = rank::rankings(&lake.lake, &wanted)?;
            print(&match format {
                query::Format::Table => rank::text(&rankings),
                query::Format::Csv => rank::csv(&rankings),
                query::Format::Json => rank::json(&rankings),
            })?;
            Ok(0)
        }
        Command::Report { lake, out } => {
            let written = report::write(&lake.lake, &out)?;
            print(&format!("{written} files in {}\n", out.display()))?;
            Ok(0)
        }
        Command::Claims { paper, claim, jobs } => {
            let text =
                threads(jobs)?.install(|| ledger::render(paper.as_deref(), claim.as_deref()))?;
            print(&text)?;
            Ok(0)
        }
        Command::Attack {
            paper,
            record: Some(path),
            sets,
            minutes,
            jobs,
            ..
        } => {
            let (progress, until) = (Progress::new(verbosity, 0), Until { sets, minutes });
            let work = || long_campaign::record(&path, paper.as_deref(), until, &progress);
            Ok(u8::from(!threads(jobs)?.install(work)?))
        }
        Command::Attack {
            paper,
            recount: Some(path),
            jobs,
            ..
        } => {
            let progress = Progress::new(verbosity, 0);
            let work = || long_campaign::recount(&path, paper.as_deref(), &progress);
            print(&format!(
                "{} sets, each as recorded\n",
                threads(jobs)?.install(work)?
            ))?;
            Ok(0)
        }
        Command::Attack {
            paper, times, jobs, ..
        } => {
            let (paper, size) = (paper.as_deref(), Size::Times(times));
            let progress = Progress::new(verbosity, campaign::units(paper, size)?);
            let found = threads(jobs)?.install(|| campaign::run(paper, size, &progress))?;
            print(&found.text)?;
            Ok(u8::from(found.broken))
        }
        Command::Verify {
            lake,
            numbers: true,
        } => {
            print(&numbers::text(&numbers::of_lake(&lake.lake)?))?;
            Ok(0)
        }
        Command::Verify { lake, .. } => verify(&lake.lake),
    }
}

/// The papers named and, if it is, the gallery; all if none is named.
fn published(wanted: &[String]) -> Result<(Vec<Paper>, Vec<Arc<Experiment>>), Error> {
    let (of_gallery, of_papers): (Vec<String>, Vec<String>) =
        wanted.iter().cloned().partition(|w| w == papers::GALLERY);
    let papers = match wanted.is_empty() || !of_papers.is_empty() {
        true => papers::load(&of_papers)?,
        false => Vec::new(),
    };
    let gallery = match wanted.is_empty() || !of_gallery.is_empty() {
        true => papers::gallery()?,
        false => Vec::new(),
    };
    Ok((papers, gallery))
}

/// The most threads that `--jobs` takes: more than any machine has use for, fewer than any refuses.
const MOST_THREADS: usize = 1024;

fn number_of_threads(text: &str) -> Result<usize, String> {
    let jobs = text
        .parse()
        .ok()
        .filter(|jobs| (1..=MOST_THREADS).contains(jobs));
    jobs.ok_or_else(|| format!("expected a number of threads from 1 to {MOST_THREADS}"))
}

fn threads(jobs: Option<usize>) -> Result<rayon::ThreadPool, Error> {
    let jobs = jobs.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));
    rayon::ThreadPoolBuilder::new()
        .num_threads(jobs)
        .build()
        .map_err(|e| Error::Refused {
            what: "--jobs".to_owned(),
            expected: format!("a number of threads that the system grants ({e})"),
            got: jobs.to_string(),
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
    experiments
        .par_iter()
        .map(|e| engine::run(store, e, progress))
        .collect()
}

fn reproduce_all(options: &Reproduce, verbosity: Verbosity) -> Result<u8, Error> {
    let start = Instant::now();
    let (mut papers, mut gallery) = published(&options.paper)?;
    if options.quick {
        papers = papers.into_iter().map(Paper::quick).collect();
        gallery = gallery.iter().map(|e| Arc::new(e.quick())).collect();
    }
    let (scale, size) = if options.quick {
        (Scale::Quick, Size::Quick)
    } else {
        (Scale::Full, Size::Times(1))
    };
    let default = if options.quick { "lake-quick" } else { "lake" };
    let lake = options.lake.clone().unwrap_or_else(|| default.into());
    let store = Store::open(&lake)?;
    let of_papers = papers.iter().flat_map(|p| &p.experiments);
    let experiments: Vec<Arc<Experiment>> = of_papers.chain(&gallery).cloned().collect();
    let attacks = |p: &Paper| {
        let systems = attack::systems(&p.name).into_iter();
        systems
            .map(|s| attack::units(&p.name, s, size))
            .sum::<u64>()
    };
    let own: Vec<u64> = gallery
        .iter()
        .map(|e| engine::own_units(e, size))
        .collect::<Result<_, _>>()?;
    let attacked = papers.iter().map(attacks).chain(own);
    let total = work(&experiments) + attacked.sum::<u64>();
    let progress = Progress::new(verbosity, total);
    let pool = threads(options.jobs)?;
    let finished = pool.install(|| run_all(&store, &experiments, &progress))?;
    let mut files = Vec::new();
    for f in &finished {
        files.extend(engine::publications(f)?);
    }
    for paper in &papers {
        let name = &paper.name;
        progress.stage(name, "claims, counts and comparison");
        let compared = pool.install(|| engine::compare(&store, paper, &finished, scale))?;
        files.extend(engine::paper_publications(&compared)?);
        progress.stage(name, "attacks");
        files.extend(pool.install(|| engine::attack(&store, name, size, &progress))?);
    }
    let of_gallery = || {
        let one = |e: &Arc<Experiment>| engine::attack_own(&store, e, size, &progress);
        gallery.par_iter().map(one).collect::<Result<Vec<_>, _>>()
    };
    files.extend(pool.install(of_gallery)?);
    progress.clear();
    let mut names: Vec<&str> = papers.iter().map(|p| p.name.as_str()).collect();
    if !gallery.is_empty() {
        names.push(papers::GALLERY);
    }
    pool.install(|| lake::publish(&lake, files, |paper, _| names.contains(&paper)))?;
    for f in &finished {
        engine::write_timings(&lake, f)?;
    }
    for paper in &papers {
        engine::write_timing_comparison(&lake, paper, &finished)?;
    }
    let entries = lake::read_manifest(&lake)?;
    let reports = match &options.reports {
        Some(folder) => folder.clone(),
        None => reports_folder(&lake, &entries, options.quick),
    };
    report::write(&lake, &reports)?;
    let violations = lake::violations(&lake, &entries)?;
    log_run(&lake, "reproduce-all", start, &finished)?;
    let errors = summary(&lake, &reports, options.quick, verbosity)?;
    for violation in &violations {
        eprintln!("{}: {}", violation.path, violation.what);
    }
    let failed = tell_failures(&finished);
    if verbosity != Verbosity::Quiet {
        let (made, found) = finished
            .iter()
            .fold((0, 0), |(m, f), x| (m + x.made, f + x.found));
        print(&format!(
            "{made} results made, {found} found, {:.1} s\n",
            start.elapsed().as_secs_f64()
        ))?;
    }
    Ok(u8::from(errors > 0 || failed || !violations.is_empty()))
}

/// Says how the estimators went on recorded data; 1 if one of them failed.
fn track(all: &[Tracked], verbosity: Verbosity) -> Result<u8, Error> {
    let mut failed = false;
    for tracked in all {
        let id = &tracked.id;
        for ending in &tracked.endings {
            let (estimator, k) = (&ending.estimator, ending.k);
            match ending.status.as_str() {
                _ if ending.is_failure() => {
                    failed = true;
                    eprintln!("{id}: {ending}");
                }
                "inconsistent" => print(&format!(
                    "{id}: {estimator}: the measurement at k = {k} contradicts the model\n"
                ))?,
                _ => print(&format!("{id}: {estimator}: k = {k}: {}\n", ending.cause))?,
            }
        }
        if verbosity != Verbosity::Quiet {
            let mut out = String::new();
            if !tracked.left_out.is_empty() {
                let metrics = tracked.left_out.join(", ");
                out += &format!("{id}: left out, because they need the truth: {metrics}\n");
            }
            if tracked.too_long {
                out += &format!(
                    "{id}: no metrics, because the recording has more than {MOST_FOLDED} steps\n"
                );
            }
            let (steps, folder) = (tracked.steps, tracked.out.display());
            out += &format!("{id}: k = 0 to {steps}; see {folder}/estimates.parquet\n");
            print(&out)?;
        }
    }
    Ok(u8::from(failed))
}

/// The most failures of an experiment that are told one by one.
const MOST_TOLD: usize = 10;

/// Tells the runs that failed, on the standard error; true if there are any. Their rows have the status.
fn tell_failures(finished: &[Finished]) -> bool {
    for f in finished {
        let name = f.experiment.name();
        for failure in f.failures.iter().take(MOST_TOLD) {
            eprintln!("{name}: {failure}");
        }
        if let Some(more) = f.failures.len().checked_sub(MOST_TOLD).filter(|&n| n > 0) {
            eprintln!("{name}: {more} more runs ended early; see the table estimates");
        }
    }
    finished.iter().any(|f| !f.failures.is_empty())
}

/// `reports` below the current folder where it is there and this lake may be shown in it, else in the lake.
fn reports_folder(lake: &Path, entries: &[lake::Entry], quick: bool) -> PathBuf {
    let here = PathBuf::from("reports");
    if !quick && here.is_dir() && has_every_paper(entries) {
        here
    } else {
        lake.join("reports")
    }
}

/// True if every paper is compared: the committed front page sums them all up, which a lake of some of them cannot.
fn has_every_paper(entries: &[lake::Entry]) -> bool {
    papers::names().iter().all(|paper| {
        let table = lake::paper_table_path("comparison", paper);
        entries.iter().any(|entry| entry.path == table)
    })
}

/// Prints the matrix of verdicts and where to look; returns the number of cells in error.
fn summary(lake: &Path, reports: &Path, quick: bool, verbosity: Verbosity) -> Result<usize, Error> {
    let tallies = tables::tallies(lake)?;
    let errors = (tallies.iter().flat_map(|t| &t.parts))
        .filter(|part| part.like == Verdict::Error)
        .map(|part| part.n)
        .sum();
    if verbosity == Verbosity::Quiet {
        return Ok(errors);
    }
    let mut out = if quick {
        "A quick run: every method and table, few runs; its numbers are compared with nothing.\n\n"
            .to_owned()
    } else {
        format!(
            "What the papers print, as reproduced (reading as-written), by verdict:\n\n{}\n{}\n",
            tables::matrix_text(lake)?,
            tallies
                .iter()
                .map(|t| t.sentence(|part| format!("{} {}", part.n, part.what)) + "\n")
                .collect::<String>()
        )
    };
    out += &format!(
        "Report:  {0}/{1} in a browser, {0}/README.md\n",
        reports.display(),
        report::HTML
    );
    out += &format!("Tables:  zonobench tables [PAPER [TABLE]]{}\n", flag(lake));
    out += &format!(
        "Data:    zonobench query \"SELECT * FROM scores LIMIT 5\"{}\n",
        flag(lake)
    );
    print(&out)?;
    Ok(errors)
}

fn flag(lake: &Path) -> String {
    if lake == Path::new("lake") {
        String::new()
    } else {
        format!(" --lake {}", lake.display())
    }
}

/// The experiments of the user's files, whose names differ, and whose programs may be started.
fn load(files: &[PathBuf], allow: bool) -> Result<Vec<Arc<Experiment>>, Error> {
    let mut experiments = read(files)?;
    for experiment in &mut experiments {
        allow_commands(&mut experiment.estimators, allow)?;
    }
    Ok(experiments.into_iter().map(Arc::new).collect())
}

/// What was understood of an experiment file.
fn check(file: &Path) -> Result<u8, Error> {
    let experiments = Experiment::load(file)?;
    let mut out = String::new();
    if let Some(first) = experiments.first() {
        out += &outlook::text(first);
    }
    if let [_, others @ ..] = &experiments[..]
        && !others.is_empty()
    {
        let names: Vec<&str> = others
            .iter()
            .take(MOST_TOLD)
            .map(|e| e.id.as_str())
            .collect();
        let more = match others.len().checked_sub(MOST_TOLD) {
            Some(n) if n > 0 => format!(" and {n} more"),
            _ => String::new(),
        };
        out += &format!("and by sweep or case: {}{more}\n", names.join(", "));
    }
    print(&out)?;
    warn(file);
    Ok(0)
}

/// Tells what is right in a file and perhaps not meant.
fn warn(file: &Path) {
    let (first, all) = Experiment::warnings(file, MOST_TOLD);
    for warning in &first {
        eprintln!("warning: {warning}");
    }
    if let Some(more) = all.checked_sub(MOST_TOLD).filter(|&n| n > 0) {
        eprintln!("{more} more warnings");
    }
}

/// The experiments of the user's files, whose names differ.
fn read(files: &[PathBuf]) -> Result<Vec<Experiment>, Error> {
    let mut experiments: Vec<(Experiment, &Path)> = Vec::new();
    for file in files {
        for experiment in Experiment::load(file)? {
            if let Some((_, first)) = experiments
                .iter()
                .find(|(e, _)| e.name() == experiment.name())
            {
                return Err(Error::Refused {
                    what: format!("{}: id", file.display()),
                    expected: format!("experiments that {} does not have", first.display()),
                    got: experiment.name(),
                });
            }
            experiments.push((experiment, file));
        }
    }
    Ok(experiments
        .into_iter()
        .map(|(experiment, _)| experiment)
        .collect())
}

fn run_files(
    experiments: Vec<Arc<Experiment>>,
    lake: &Path,
    jobs: Option<usize>,
    verbosity: Verbosity,
) -> Result<u8, Error> {
    let start = Instant::now();
    let store = Store::open(lake)?;
    let progress = Progress::new(verbosity, work(&experiments));
    let pool = threads(jobs)?;
    let finished = pool.install(|| run_all(&store, &experiments, &progress))?;
    progress.clear();
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
    let failed = tell_failures(&finished);
    if verbosity != Verbosity::Quiet {
        let mut out = String::new();
        for e in &experiments {
            let sql = format!(
                "SELECT estimator, metric, component, n_runs, mean, sd FROM scores WHERE paper = '{}' AND experiment = '{}'",
                e.paper, e.id
            );
            let scores = query::text(lake, &sql, query::Format::Table)?;
            out += &format!("\n{}\n\n{scores}\n", e.name());
        }
        out += &format!(
            "Data:    zonobench query \"SELECT * FROM estimates LIMIT 5\"{}\n",
            flag(lake)
        );
        print(&out)?;
    }
    Ok(u8::from(failed || !violations.is_empty()))
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

fn completions(shell: Shell, out: &Path) -> Result<u8, Error> {
    let mut command = Cli::command();
    let shell = match shell {
        Shell::Bash => clap_complete::Shell::Bash,
        Shell::Zsh => clap_complete::Shell::Zsh,
        Shell::Fish => clap_complete::Shell::Fish,
        Shell::Man => {
            std::fs::create_dir_all(out).map_err(|e| Error::io("create", out, e))?;
            clap_mangen::generate_to(command, out).map_err(|e| Error::io("write to", out, e))?;
            return Ok(0);
        }
    };
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut command, "zonobench", &mut text);
    print(&String::from_utf8_lossy(&text))?;
    Ok(0)
}

/// The experiments of the user's files, or of the papers where there are none.
fn experiments(files: &[PathBuf], papers: &[String]) -> Result<Vec<Arc<Experiment>>, Error> {
    if files.is_empty() {
        let (papers, gallery) = published(papers)?;
        let of_papers = papers.into_iter().flat_map(|paper| paper.experiments);
        Ok(of_papers.chain(gallery).collect())
    } else {
        // Nothing runs here.
        Ok(read(files)?.into_iter().map(Arc::new).collect())
    }
}

/// What a part of a plan is of.
enum Of<'a> {
    Experiment(&'a Experiment),
    Paper(&'a Paper),
    Attack,
}

fn plan(
    experiments: &[Arc<Experiment>],
    papers: &[Paper],
    gallery: &[Arc<Experiment>],
    dot: bool,
    lake: &Path,
) -> Result<u8, Error> {
    let store = Store::read_only(lake);
    let (mut cached, mut to_run) = (0, 0);
    let mut out = String::new();
    if dot {
        out += "digraph zonobench {\n  rankdir = LR;\n";
    }
    let of_experiments = experiments
        .iter()
        .map(|e| (engine::plan(&store, e), Of::Experiment(e)));
    let of_papers = papers
        .iter()
        .map(|p| (engine::plan_paper(&store, p), Of::Paper(p)));
    let mut all: Vec<_> = of_experiments.chain(of_papers).collect();
    for e in gallery {
        all.push((vec![engine::plan_own(&store, e)?], Of::Attack));
    }
    for (planned, of) in all {
        if dot {
            out += &match of {
                Of::Experiment(experiment) => engine::dot(experiment, &planned),
                Of::Paper(paper) => engine::dot_paper(paper, &planned),
                Of::Attack => engine::dot_own(&planned),
            };
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
            out += &format!("{}: {why}\n", line.target);
        }
    }
    out += &if dot {
        "}\n".to_owned()
    } else {
        format!("{to_run} results to make, {cached} in the lake\n")
    };
    print(&out)?;
    Ok(0)
}

fn explain(wanted: &str, files: &[PathBuf], lake: &Path) -> Result<u8, Error> {
    let store = Store::read_only(lake);
    let mut known = Vec::new();
    let mut out = String::new();
    let paper = wanted.split('/').next().unwrap_or_default().to_owned();
    let mut planned = Vec::new();
    for experiment in experiments(files, std::slice::from_ref(&paper))? {
        known.push(experiment.name());
        planned.push(engine::plan(&store, &experiment));
    }
    if files.is_empty() {
        let (papers, gallery) = published(&[paper])?;
        for e in &gallery {
            planned.push(vec![engine::plan_own(&store, e)?]);
        }
        for paper in papers {
            known.push(format!("{}/-", paper.name));
            planned.push(engine::plan_paper(&store, &paper));
        }
    }
    for lines in planned {
        for line in lines {
            let name = line.target.to_string();
            if name != wanted && !name.starts_with(&format!("{wanted}/")) {
                continue;
            }
            match line.status {
                Status::Cached => out += &format!("{name}: in the lake, would not run\n"),
                Status::Missing => out += &format!("{name}: would run, it was never made\n"),
                Status::Upstream => {
                    out += &format!("{name}: would run, it reads what runs before it\n")
                }
                Status::Changed(changes) => {
                    out += &format!("{name}: would run, its key differs:\n");
                    for (place, old, new) in changes {
                        out += &format!("  {place}: {old} -> {new}\n");
                    }
                }
            }
        }
    }
    if out.is_empty() {
        return Err(Error::Unknown {
            what: "target",
            got: wanted.to_owned(),
            expected: format!(
                "experiments: {}; `plan` lists their targets",
                known.join(", ")
            ),
        });
    }
    print(&out)?;
    Ok(0)
}

fn count(paper: Option<&str>, lake: &Path) -> Result<u8, Error> {
    let claiming = zonobench_complexity::PAPERS;
    if let Some(unknown) = paper.filter(|p| !claiming.contains(p)) {
        return Err(Error::Unknown {
            what: "paper that claims a cost",
            got: unknown.to_owned(),
            expected: format!("papers: {}", claiming.join(", ")),
        });
    }
    let store = Store::open(lake)?;
    let all = claiming.into_iter();
    let mut out = String::new();
    for name in all.filter(|name| paper.is_none_or(|p| p == *name)) {
        let counts = counts_text(&engine::counted(&store, name)?);
        out += &format!("# {name}\n{counts}\n");
    }
    print(&out)?;
    Ok(0)
}

fn verify(lake: &Path) -> Result<u8, Error> {
    let (files, findings) = lake::verify(lake)?;
    let mut out: String = findings
        .iter()
        .map(|f| format!("{}: {}\n", f.path, f.what))
        .collect();
    out += &match findings.len() {
        0 => format!("{files} files as the manifest says, no guarantee violated\n"),
        1 => format!("1 fault in {files} files\n"),
        n => format!("{n} faults in {files} files\n"),
    };
    if findings.is_empty() {
        let remarks = lake::given_up(lake, &lake::read_manifest(lake)?)?;
        out.extend(remarks.iter().map(|f| format!("{}: {}\n", f.path, f.what)));
    }
    print(&out)?;
    Ok(u8::from(!findings.is_empty()))
}

#[cfg(test)]
mod tests {
    use super::has_every_paper;
    use zonobench_lake::lake;
    use zonobench_verdicts::papers;

    #[test]
    fn a_lake_of_some_papers_is_not_for_the_committed_pages() {
        let compared = |paper: &&str| lake::Entry {
            path: lake::paper_table_path("comparison", paper),
            table: "comparison".to_owned(),
            bytes: 0,
            blake3: String::new(),
            rows: Some(1),
            schema_version: None,
            key: String::new(),
        };
        let mut entries: Vec<lake::Entry> = papers::names().iter().map(compared).collect();
        assert!(has_every_paper(&entries));
        entries.pop();
        assert!(!has_every_paper(&entries));
    }
}
