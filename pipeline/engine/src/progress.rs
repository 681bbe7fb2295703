//! Progress: bars on a terminal, plain lines otherwise, silence where asked.

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::Instant;

/// How much to say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verbosity {
    /// Nothing but results and errors.
    Quiet,
    /// One line an experiment, or a bar.
    Normal,
    /// Each stage as well.
    Verbose,
}

/// Where the work stands.
pub struct Progress {
    bar: Option<ProgressBar>,
    verbosity: Verbosity,
    start: Instant,
    _bars: MultiProgress,
}

impl Progress {
    /// For `total` runs of all stages.
    pub fn new(verbosity: Verbosity, total: u64) -> Self {
        let bars = MultiProgress::new();
        let show = verbosity != Verbosity::Quiet && std::io::stderr().is_terminal();
        let bar = show.then(|| {
            let style =
                ProgressStyle::with_template("{bar:32} {pos}/{len} runs, {eta} left  {wide_msg}")
                    .expect("the template is well formed");
            bars.add(ProgressBar::new(total)).with_style(style)
        });
        Self {
            bar,
            verbosity,
            start: Instant::now(),
            _bars: bars,
        }
    }

    /// `n` more runs of a stage are done.
    pub fn advance(&self, experiment: &str, stage: &str, n: u64) {
        if let Some(bar) = &self.bar {
            bar.set_message(format!("{experiment}: {stage}"));
            bar.inc(n);
        }
    }

    /// A paper's stage begins that is no experiment's.
    pub fn stage(&self, paper: &str, stage: &str) {
        let seconds = self.start.elapsed().as_secs_f64();
        match &self.bar {
            Some(bar) => bar.set_message(format!("{paper}: {stage}")),
            None => self.say(
                Verbosity::Normal,
                &format!("{seconds:7.1} s  {paper}: {stage}"),
            ),
        }
    }

    /// An experiment is done: `made` results are new, `found` were there.
    pub fn finish(&self, experiment: &str, made: usize, found: usize) {
        let seconds = self.start.elapsed().as_secs_f64();
        self.say(
            Verbosity::Normal,
            &format!("{seconds:7.1} s  {experiment}: {made} results made, {found} found"),
        );
    }

    /// Says a line above the bars.
    pub fn say(&self, at: Verbosity, line: &str) {
        if self.verbosity == Verbosity::Quiet || (at == Verbosity::Verbose && self.verbosity != at)
        {
            return;
        }
        match &self.bar {
            Some(bar) => bar.println(line),
            None => eprintln!("{line}"),
        }
    }

    /// Removes the bars.
    pub fn clear(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
