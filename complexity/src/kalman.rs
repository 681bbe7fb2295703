//! [MeslemRamdani, Secs. IV, V]: "the Kalman filter is less demanding" than Box-State-Est.

use crate::claim::{Row, Sweep, Verdict, rows as rows_of};
use crate::instance::Instance;
use zonobench_estimation::Problem;
use zonobench_estimation::estimator::Estimator;
use zonobench_estimation::estimators::{BoxStateEst, BoxStateEstSettings, Kalman, KalmanSettings};
use zonobench_sets::ops::{self, Counts};

/// The state dimensions tried, with one output as in the paper's example.
const DIMENSIONS: std::ops::RangeInclusive<usize> = 2..=10;

/// A step with a full window of n measurements: predict and update.
fn step<E: Estimator>(estimator: &E, n: usize) -> Option<Counts> {
    let y = [Some(0.0)];
    let mut belief = estimator.update(0, &estimator.prior(), &[], &y).ok()?;
    let mut counts = None;
    for k in 1..=n + 1 {
        let (next, tally) = ops::tally(|| {
            let predicted = estimator.predict(k, &belief, &[])?;
            estimator.update(k, &predicted, &[], &y)
        });
        belief = next.ok()?;
        counts = Some(tally.total());
    }
    counts
}

/// (Kalman filter, Box-State-Est) on one random system of n states.
fn both(n: usize) -> (Counts, Counts) {
    // Measurements of 0 agree with a prior about 0; a draw that is hardly observable is passed over.
    let found = (0..100).find_map(|index| {
        let problem: Problem = Instance::new((n as u64) << 8 | index).linear(n, 1);
        let kalman = Kalman::new(&KalmanSettings::default(), &problem).ok()?;
        let boxes = BoxStateEst::new(&BoxStateEstSettings::default(), &problem).ok()?;
        Some((step(&kalman, n)?, step(&boxes, n)?))
    });
    found.expect("nearly every random pair is observable")
}

/// The rows of the paper: multiplications of the box beside those of the Kalman filter, which take the place
/// of the formula.
pub fn rows() -> Vec<Row> {
    let counts: Vec<(usize, Counts, Counts)> = DIMENSIONS
        .map(|n| {
            let (kalman, boxes) = both(n);
            (n, kalman, boxes)
        })
        .collect();
    let points = counts.iter().map(|(n, kalman, boxes)| {
        (
            *n as i64,
            boxes.multiplications as f64,
            kalman.multiplications as f64,
        )
    });
    let sweep = Sweep::new("n", points.collect());
    let (_, kalman, boxes) = counts[0];
    let verdict = if kalman.multiplications < boxes.multiplications {
        Verdict::Holds
    } else {
        Verdict::DoesNotHold
    };
    // A product of a real matrix with a box by the signs of its entries needs one product a bound.
    let by_signs = boxes.multiplications / 2;
    let from = counts
        .iter()
        .find(|(_, kalman, boxes)| boxes.multiplications / 2 < kalman.multiplications)
        .map_or("at no size tried".to_owned(), |(n, ..)| {
            format!("from n = {n} on")
        });
    let reason = format!(
        "at n = 2 with one output a step takes {} multiplications and divisions in the Kalman filter and {} in the box, \
         whose constant products are made once and whose interval products take the four products of their bounds; \
         with one product a bound, as the paper's Eq. (5) has it, {by_signs}: then the box is the cheaper {from}. The \
         growth is n^{:.2} for the box and n^{:.2} for the filter",
        kalman.multiplications, boxes.multiplications, sweep.degree.value, sweep.claimed.value
    );
    let mut rows = rows_of("kalman-less-demanding-than-box", &[sweep], verdict, reason);
    for row in &mut rows[1..] {
        row.verdict = match row.ratio {
            Some(ratio) if ratio > 1.0 => Verdict::Holds,
            _ => Verdict::DoesNotHold,
        };
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kalman_filter_s_step_is_counted_whole() {
        for n in DIMENSIONS {
            let (kalman, _) = both(n);
            // A m, two products and a halving for A P Aᵀ; P Cᵀ, C P Cᵀ, n divisions, C m, K e;
            // K C, two products for T P Tᵀ, two for K R Kᵀ, their halvings.
            let sym = n * (n - 1) / 2;
            let predict = n * n + 2 * n * n * n + sym;
            let update = n * n + n + n + n + n + n * n + 2 * n * n * n + sym + n + n * n + sym;
            assert_eq!(kalman.multiplications, (predict + update) as u64);
        }
    }
}
