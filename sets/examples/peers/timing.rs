//! Times of an operation over many cases, and the rows that a tool answers with.

use crate::sets::{Off, Size};
use std::fmt;
use std::time::{Duration, Instant};

/// For how long one operation of one size is timed.
const BUDGET: Duration = Duration::from_millis(600);

/// The times of one operation in µs: a sample is a pass over all cases, divided by their number.
#[derive(Clone, Copy)]
pub struct Times {
    pub samples: usize,
    pub min: f64,
    pub median: f64,
    /// 10 % of the samples are below
    pub low: f64,
    /// 10 % of the samples are above
    pub high: f64,
}

/// Times `pass`, which does the operation `each` times; at least five samples after one that is not counted.
pub fn time(each: usize, mut pass: impl FnMut()) -> Times {
    pass();
    let begin = Instant::now();
    let mut samples = Vec::new();
    while samples.len() < 5 || begin.elapsed() < BUDGET {
        let start = Instant::now();
        pass();
        samples.push(start.elapsed().as_secs_f64() * 1e6 / each as f64);
    }
    samples.sort_by(f64::total_cmp);
    let at = |part: f64| samples[(part * (samples.len() - 1) as f64).round() as usize];
    Times {
        samples: samples.len(),
        min: samples[0],
        median: at(0.5),
        low: at(0.1),
        high: at(0.9),
    }
}

/// The columns of a row; `reports/peers.csv` has one more, the processor.
pub const HEADER: &str = "tool,version,operation,n,generators,constraints,samples,min_us,median_us,low_us,high_us,hulls,cut_off,worst_cut,excess,remark";

/// What one tool took for one operation, and how its hulls came out.
pub struct Row {
    pub tool: &'static str,
    pub version: &'static str,
    pub operation: &'static str,
    pub size: Size,
    pub times: Times,
    /// One entry a set whose hull was compared with the exact one
    pub hulls: Vec<Off>,
    pub remark: &'static str,
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Size { n, p, q, .. } = self.size;
        let Times {
            samples,
            min,
            median,
            low,
            high,
        } = self.times;
        write!(
            f,
            "{},{},{},{n},{p},{q},",
            self.tool, self.version, self.operation
        )?;
        write!(f, "{samples},{min:.3},{median:.3},{low:.3},{high:.3},")?;
        if self.hulls.is_empty() {
            write!(f, ",,,,")?;
        } else {
            let cut = self.hulls.iter().filter(|h| h.cut > 0.0).count();
            let worst = self.hulls.iter().fold(0.0_f64, |m, h| m.max(h.cut));
            let excess = self.hulls.iter().fold(0.0_f64, |m, h| m.max(h.excess));
            write!(f, "{},{cut},{worst:.2e},{excess:.2e},", self.hulls.len())?;
        }
        f.write_str(self.remark)
    }
}
