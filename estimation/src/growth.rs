//! Sets that grow without end: when that is said, of which component, and through which term.
//!
//! A set of a nonlinear system is an enclosure of an enclosure, step after step. Where a term is enclosed too widely, the
//! set feeds on itself: it still contains the state and says nothing of it. [`Growth`] watches the boxes around an
//! estimator's sets, component by component, so that no unit matters, and [`Grown::explained`] says where it comes from.

use crate::propagation::Dynamics;
use crate::{AnySystem, Problem, System};
use std::collections::VecDeque;
use std::fmt;
use zonobench_sets::number::jacobian;
use zonobench_sets::{Interval, IntervalVector};

/// Within so many steps a set has to grow [`FOLD`]-fold.
pub const STEPS: usize = 10;

/// So much wider than ever before is called growth without end.
pub const FOLD: f64 = 10.0;

/// A component whose enclosure grew, or became infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grown {
    /// The component.
    pub component: usize,
    /// Its greatest half-width up to [`STEPS`] steps ago.
    pub before: f64,
    /// Its half-width now.
    pub now: f64,
}

/// The half-widths of a run's boxes.
///
/// A component grows without end where its half-width at k is over [`FOLD`] times the greatest of all steps up to
/// k − [`STEPS`], or is infinite after it was finite. Two things are no such growth. In the first 2 · [`STEPS`] steps a prior that is narrow, or a point, fills to the width that
/// the noise gives it; only a width that is infinite counts there. And where a measurement is missing, the set has to grow: steps count
/// once the last [`STEPS`] had one.
#[derive(Clone, Debug, Default)]
pub struct Growth {
    /// Greatest half-widths of the first step, of the first two, …, of which the last [`STEPS`] + 1 are kept.
    greatest: VecDeque<Vec<f64>>,
    /// The first box.
    first: Vec<f64>,
    /// Steps seen.
    seen: usize,
    /// Steps in a row that were measured.
    measured: usize,
}

impl Growth {
    /// Takes in the box of the next step; `is_measured` where every component of y was there.
    pub fn observe(&mut self, hull: &IntervalVector, is_measured: bool) -> Option<Grown> {
        self.seen += 1;
        self.measured = if is_measured { self.measured + 1 } else { 0 };
        let now: Vec<f64> = hull.iter().map(|side| 0.5 * side.width()).collect();
        let is_steady = self.measured >= STEPS.min(self.seen);
        let found = match (is_steady, self.greatest.back()) {
            (true, Some(last)) => self.grown(&now, last),
            _ => None,
        };
        let mut greatest = self.greatest.back().cloned().unwrap_or_default();
        greatest.resize(now.len(), 0.0);
        for (most, &x) in greatest.iter_mut().zip(&now) {
            *most = most.max(x);
        }
        if self.first.is_empty() {
            self.first = now;
        }
        self.greatest.push_back(greatest);
        if self.greatest.len() > STEPS + 1 {
            self.greatest.pop_front();
        }
        found
    }

    fn grown(&self, now: &[f64], last: &[f64]) -> Option<Grown> {
        let infinite = now
            .iter()
            .zip(last)
            .position(|(now, last)| !now.is_finite() && last.is_finite());
        if let Some(component) = infinite {
            return Some(Grown {
                component,
                before: last[component],
                now: now[component],
            });
        }
        // Of the greatest half-widths, the one of STEPS steps before this one.
        let at = self.greatest.len().checked_sub(STEPS)?;
        let before = &self.greatest[at];
        if self.seen <= 2 * STEPS {
            return None;
        }
        widest(before, now).filter(|grown| grown.now > FOLD * grown.before)
    }

    /// What grew most since the start, over [`FOLD`]-fold: for a set that cannot be said any more, because a number of it
    /// overflowed.
    pub fn since_start(&self) -> Option<Grown> {
        let last = self.greatest.back()?;
        widest(&self.first, last).filter(|grown| {
            self.measured >= STEPS.min(self.seen) && grown.now > FOLD * grown.before
        })
    }
}

/// The component with the largest quotient of `now` and `before`; one that was and is 0 has none.
fn widest(before: &[f64], now: &[f64]) -> Option<Grown> {
    let quotients = before.iter().zip(now).enumerate();
    quotients
        .filter(|(_, (_, now))| **now > 0.0)
        .map(|(component, (&before, &now))| Grown {
            component,
            before,
            now,
        })
        .max_by(|a, b| (a.now / a.before).total_cmp(&(b.now / b.before)))
}

/// A number for people: four digits.
struct Short(f64);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = self.0.abs();
        match size == 0.0 || (1e-3..1e5).contains(&size) || !size.is_finite() {
            true => {
                let rounded = (self.0 * 1e4).round() / 1e4;
                write!(f, "{rounded}")
            }
            false => write!(f, "{:.3e}", self.0),
        }
    }
}

/// [lower, upper] for people.
pub(crate) fn side(of: &Interval) -> String {
    format!("[{}, {}]", Short(of.lo()), Short(of.hi()))
}

impl Grown {
    /// What grew, through which term, and what may help; `over` is the set at step `k` from which it grew.
    pub fn explained(
        &self,
        problem: &Problem,
        k: usize,
        u: &[f64],
        over: &IntervalVector,
    ) -> String {
        let system = &problem.system;
        let names = system.variables();
        let name = &names.x[self.component].name;
        let mut text = match self.now.is_finite() {
            true => format!(
                "the enclosure of {name} grows without end: its half-width is {} and was at most {} until {STEPS} steps before",
                Short(self.now),
                Short(self.before)
            ),
            false => format!(
                "the enclosure of {name} is no longer finite; its half-width was at most {}",
                Short(self.before)
            ),
        };
        let w = noise(problem);
        let term = match system {
            AnySystem::Equations(equations) => equations.steepest(self.component, k, over, u, &w),
            _ => None,
        };
        let (what, entry, from) = match &term {
            Some(term) => {
                text += &format!(
                    "; `{}` in {}.{}, column {}, contributes most",
                    term.written, term.table, term.name, term.column
                );
                ("its derivative".to_owned(), term.derivative, term.state)
            }
            None => {
                let (entry, from) = steepest(system, self.component, k, over, u, &w);
                (format!("the derivative of the next {name}"), entry, from)
            }
        };
        let of = &names.x[from].name;
        text += &format!(
            "; {what} by {of} is in {} over {of} in {}",
            side(&entry),
            side(&over[from])
        );
        let measure = match names.y.is_empty() {
            true => String::new(),
            false => format!(", or a measurement of {of}"),
        };
        text += &format!(
            "; what may help: {of} fewer times in the term, more generators, a shorter period{measure}"
        );
        text
    }
}

/// The box of w, with δ ∈ [−1, 1] after it where there is one.
fn noise(problem: &Problem) -> Vec<Interval> {
    let mut w: Vec<Interval> = problem.w.box_hull().iter().copied().collect();
    w.resize(problem.system.variables().w.len(), Interval::UNIT);
    w
}

/// The entry of the Jacobian's row `i` that contributes most to the width of x_i: |∂f_i/∂x_j| · rad x_j.
fn steepest(
    system: &AnySystem,
    i: usize,
    k: usize,
    over: &IntervalVector,
    u: &[f64],
    w: &[Interval],
) -> (Interval, usize) {
    let z: Vec<Interval> = over.iter().chain(w).copied().collect();
    let found = jacobian(&Dynamics::new(system, k, u), &z);
    let (j, _) = largest(found.row(i), over);
    (found.get(i, j), j)
}

/// The place and the size of the largest |entry| · rad; one that is not finite is the largest of all.
pub(crate) fn largest(row: &[Interval], over: &IntervalVector) -> (usize, f64) {
    let sizes = row.iter().zip(over.iter()).map(|(entry, side)| {
        let size = entry.lo().abs().max(entry.hi().abs()) * 0.5 * side.width();
        // 0 · ∞: an entry that is 0 contributes nothing.
        if size.is_nan() { 0.0 } else { size }
    });
    sizes.enumerate().fold(
        (0, -1.0),
        |most, next| if next.1 > most.1 { next } else { most },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(half_widths: &[f64]) -> IntervalVector {
        let side = |r: &f64| match r.is_finite() {
            true => Interval::new(-r, *r).unwrap(),
            false => Interval::ENTIRE,
        };
        half_widths.iter().map(side).collect()
    }

    /// The step at which growth is first said, of widths by k.
    fn first(width: impl Fn(usize) -> f64, is_measured: impl Fn(usize) -> bool) -> Option<usize> {
        let mut growth = Growth::default();
        (0..200).find(|&k| {
            growth
                .observe(&of(&[1.0, width(k)]), is_measured(k))
                .is_some()
        })
    }

    #[test]
    fn a_set_that_grows_tenfold_in_ten_steps_is_told_once_it_is_wider_than_ever() {
        assert_eq!(first(|k| libm::pow(1.3, k as f64), |_| true), Some(20));
        // 1.2^10 is 6.
        assert_eq!(first(|k| libm::pow(1.2, k as f64), |_| true), None);
        let late = |k: usize| {
            if k < 50 {
                1.0
            } else {
                libm::pow(2.0, k as f64 - 50.0)
            }
        };
        assert_eq!(first(late, |_| true), Some(54));
    }

    #[test]
    fn what_has_to_grow_is_no_growth_without_end() {
        // A point that noise fills, also through three integrators.
        for power in [1.0, 2.0, 3.0] {
            assert_eq!(first(|k| libm::pow(k as f64, power), |_| true), None);
        }
        // A width that swings, and one that falls.
        let swing = |k: usize| if k % 20 < 10 { 1.0 } else { 9.9 };
        assert_eq!(first(swing, |_| true), None);
        assert_eq!(first(|k| 1e9 / (1.0 + k as f64), |_| true), None);
        // A gap in the measurements.
        let gap = |k: usize| (50..70).contains(&k);
        let width = |k: usize| if gap(k) { 1e3 } else { 1.0 };
        assert_eq!(first(width, |k| !gap(k)), None);
        assert_eq!(first(width, |_| true), Some(50));
    }

    #[test]
    fn a_width_that_is_infinite_is_told_at_once_and_not_before_it_was_finite() {
        let bursts = |k: usize| if k < 4 { 1.0 } else { f64::INFINITY };
        assert_eq!(first(bursts, |_| true), Some(4));
        assert_eq!(
            first(|k| if k < 3 { f64::INFINITY } else { 1.0 }, |_| true),
            None
        );
    }

    #[test]
    fn growth_is_told_of_the_component_that_grew_most() {
        let mut growth = Growth::default();
        let found =
            (0..40).find_map(|k| growth.observe(&of(&[1e3, libm::pow(1.5, k as f64), 1e-9]), true));
        let found = found.unwrap();
        assert_eq!(found.component, 1);
        assert!(found.now > FOLD * found.before, "{found:?}");
        assert_eq!(growth.since_start().unwrap().component, 1);
    }
}
