//! The places of a finding, filled with measured numbers.

use super::Results;
use super::numbers::Number;
use crate::published::{Cell, Piece, Place, Published, Score};
use crate::statistics::mean_sd;
use zonobench_lake::digits::four_digits;

impl Results<'_> {
    /// The text of the cell's finding.
    pub(super) fn fill(
        &self,
        p: &Published,
        cell: &Cell,
        number: &Number,
        interval: Option<(f64, f64)>,
        rel_diff: Option<f64>,
    ) -> String {
        let show = |x: Option<f64>| x.map_or_else(|| "(no value)".to_owned(), four_digits);
        let piece = |piece: &Piece| match piece {
            Piece::Text(text) => text.clone(),
            Piece::Place(place) => match place {
                Place::Reproduced => four_digits(number.value),
                Place::Published => p.printed.clone(),
                Place::Lo => show(interval.map(|i| i.0)),
                Place::Hi => show(interval.map(|i| i.1)),
                Place::RelDiff => show(rel_diff.map(|d| 100.0 * d)),
                Place::Runs => number.n().to_string(),
                Place::Sd => show(number.sd),
                Place::Spread => {
                    (number.spread.clone()).unwrap_or_else(|| "(no spread)".to_owned())
                }
                Place::Score(score) => show(self.mean(score, cell)),
            },
        };
        cell.finding.pieces.iter().map(piece).collect()
    }

    /// The text of the finding of a cell that has no number of its own.
    pub(super) fn text(&self, cell: &Cell) -> String {
        let piece = |piece: &Piece| match piece {
            Piece::Text(text) => text.clone(),
            Piece::Place(Place::Score(score)) => self
                .mean(score, cell)
                .map_or_else(|| "(no value)".to_owned(), four_digits),
            Piece::Place(_) => "(no value)".to_owned(),
        };
        cell.finding.pieces.iter().map(piece).collect()
    }

    fn mean(&self, score: &Score, cell: &Cell) -> Option<f64> {
        let values = if score.experiments.is_empty() {
            let here = Score {
                experiments: cell.comparand.experiments().to_vec(),
                ..score.clone()
            };
            self.values(&here)?
        } else {
            self.values(score)?
        };
        mean_sd(&values).map(|(mean, _)| mean)
    }
}
