//! A claim about growth, the sweeps that it is held against, and the verdict.

use crate::fit::{Degree, polynomial_degree, slope};

/// A row of the table `complexity`.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Name of the claim.
    pub claim: String,
    /// The size that varies; `all` where every size does, empty in the row that has the claim's verdict.
    pub sweep_variable: String,
    /// Its value.
    pub size: Option<i64>,
    /// What was counted.
    pub counted: Option<f64>,
    /// What the printed formula gives.
    pub formula: Option<f64>,
    /// counted / formula.
    pub ratio: Option<f64>,
    /// The degree that the count grows with over the sweep.
    pub degree: Option<Degree>,
    /// The verdict on the claim.
    pub verdict: Verdict,
    /// Why, with the numbers.
    pub reason: String,
}

/// What the counts say of a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The count grows as the formula does.
    Holds,
    /// The count grows more slowly than the formula allows.
    HoldsAsBound,
    /// The count grows faster, or the statement is contradicted.
    DoesNotHold,
    /// It rests on equations that the paper does not print.
    NotReproducible,
}

impl Verdict {
    /// As the tables have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::HoldsAsBound => "holds_as_bound",
            Self::DoesNotHold => "does_not_hold",
            Self::NotReproducible => "not_reproducible",
        }
    }
}

/// One size varied, the others held.
#[derive(Clone, Debug)]
pub struct Sweep {
    /// The size that varies.
    pub variable: String,
    /// (size, counted, formula), sizes ascending.
    pub points: Vec<(i64, f64, f64)>,
    /// Growth of the count.
    pub degree: Degree,
    /// Growth of the formula over the same sizes.
    pub claimed: Degree,
}

/// Growth by this much more than the formula's is growth that the formula denies.
pub const TOLERANCE: f64 = 0.1;

impl Sweep {
    /// A sweep over `points` = (size, counted, formula).
    ///
    /// Where the sizes are consecutive and the counts are a polynomial that predicts two of them, the degree is
    /// that polynomial's and exact, and so is the formula's; else both are fitted over the upper half of
    /// the sizes, and of those the ones within a factor 20 of the largest (three at least), where lower orders
    /// weigh least.
    pub fn new(variable: &str, points: Vec<(i64, f64, f64)>) -> Self {
        let of = |y: fn(&(i64, f64, f64)) -> f64| growth(&points, y);
        let (degree, claimed) = (of(|p| p.1), of(|p| p.2));
        Self {
            variable: variable.to_owned(),
            points,
            degree,
            claimed,
        }
    }

    /// How much faster the count grows than the formula.
    pub fn excess(&self) -> f64 {
        if self.degree.is_exact() && self.claimed.is_exact() {
            return self.degree.value - self.claimed.value;
        }
        let ratios: Vec<_> = self.points.iter().map(|p| (p.0, p.1 / p.2, 0.0)).collect();
        upper_slope(&ratios, |p| p.1).value
    }
}

fn growth(points: &[(i64, f64, f64)], y: fn(&(i64, f64, f64)) -> f64) -> Degree {
    let whole = |x: f64| (x == x.trunc() && x.abs() < 9_007_199_254_740_992.0).then_some(x as i128);
    let values: Option<Vec<i128>> = points.iter().map(|p| whole(y(p))).collect();
    values
        .filter(|_| consecutive(points))
        .and_then(|v| polynomial_degree(&v, 3))
        .map_or_else(|| upper_slope(points, y), Degree::exact)
}

fn consecutive(points: &[(i64, f64, f64)]) -> bool {
    points.windows(2).all(|w| w[1].0 == w[0].0 + 1)
}

fn upper_slope(points: &[(i64, f64, f64)], y: fn(&(i64, f64, f64)) -> f64) -> Degree {
    let last = points.last().map_or(0, |p| p.0);
    let far = points.iter().position(|p| p.0 * 20 >= last).unwrap_or(0);
    let from = far
        .max(points.len() / 2)
        .min(points.len().saturating_sub(3));
    let upper: Vec<_> = points[from..].iter().map(|p| (p.0 as f64, y(p))).collect();
    slope(&upper)
}

/// `Holds` if in every sweep the count grows as the formula, `HoldsAsBound` if nowhere faster, else
/// `DoesNotHold`; within [`TOLERANCE`]. The reason names each sweep's degrees and the range of the ratio.
pub fn judge(sweeps: &[Sweep]) -> (Verdict, String) {
    let mut verdict = Verdict::Holds;
    let mut parts = Vec::new();
    for s in sweeps {
        let excess = s.excess();
        if excess > TOLERANCE {
            verdict = Verdict::DoesNotHold;
        } else if excess < -TOLERANCE && verdict == Verdict::Holds {
            verdict = Verdict::HoldsAsBound;
        }
        let exact = if s.degree.is_exact() { " exactly" } else { "" };
        parts.push(format!(
            "in {} degree {:.2}{exact} against {:.2}",
            s.variable, s.degree.value, s.claimed.value
        ));
    }
    let ratios = || sweeps.iter().flat_map(|s| &s.points).map(|p| p.1 / p.2);
    let (lo, hi) = (
        ratios().fold(f64::INFINITY, f64::min),
        ratios().fold(0.0, f64::max),
    );
    let reason = format!(
        "counted / formula lies in [{lo:.3}, {hi:.3}]; {}",
        parts.join("; ")
    );
    (verdict, reason)
}

/// The rows of a claim: its verdict first, then the points of its sweeps.
pub fn rows(claim: &str, sweeps: &[Sweep], verdict: Verdict, reason: String) -> Vec<Row> {
    let mut rows = vec![statement(claim, verdict, reason)];
    for s in sweeps {
        for &(size, counted, formula) in &s.points {
            rows.push(Row {
                claim: claim.to_owned(),
                sweep_variable: s.variable.clone(),
                size: Some(size),
                counted: Some(counted),
                formula: Some(formula),
                ratio: (formula != 0.0).then(|| counted / formula),
                degree: Some(s.degree),
                verdict: judge(std::slice::from_ref(s)).0,
                reason: String::new(),
            });
        }
    }
    rows
}

/// The row that has a claim's verdict.
pub fn statement(claim: &str, verdict: Verdict, reason: String) -> Row {
    Row {
        claim: claim.to_owned(),
        sweep_variable: String::new(),
        size: None,
        counted: None,
        formula: None,
        ratio: None,
        degree: None,
        verdict,
        reason,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sweep(count: fn(i64) -> i64, formula: fn(i64) -> i64) -> Sweep {
        let points = (1..10).map(|x| (x, count(x) as f64, formula(x) as f64));
        Sweep::new("n", points.collect())
    }

    #[test]
    fn the_verdict_follows_the_growth_and_not_the_factor() {
        let same = sweep(|x| 900 * x * x + x, |x| x * x);
        let slower = sweep(|x| 900 * x, |x| x * x);
        let faster = sweep(|x| x * x * x + 1, |x| 900 * x * x);
        assert!(same.degree.is_exact());
        let verdict = |s: &[Sweep]| judge(s).0;
        assert_eq!(verdict(std::slice::from_ref(&same)), Verdict::Holds);
        assert_eq!(
            verdict(&[same.clone(), slower.clone()]),
            Verdict::HoldsAsBound
        );
        assert_eq!(verdict(&[slower, faster, same]), Verdict::DoesNotHold);
    }
}
