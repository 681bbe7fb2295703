//! An exact simplex.

use super::{Q, V, dot};
use num_traits::{One, Signed, Zero};

/// A linear program over bounded variables and two-sided rows.
#[derive(Clone, Debug, Default)]
pub struct Lp {
    lower: V,
    upper: V,
    rows: Vec<(V, Q, Q)>,
}

impl Lp {
    /// The program over lower ≤ x ≤ upper, without rows.
    pub fn over(lower: V, upper: V) -> Self {
        Self {
            lower,
            upper,
            rows: Vec::new(),
        }
    }

    /// The program over −1 ≤ x ≤ 1 of `n` variables.
    pub fn unit(n: usize) -> Self {
        Self::over(vec![-Q::one(); n], vec![Q::one(); n])
    }

    /// Adds low ≤ a·x ≤ high.
    pub fn row(&mut self, a: V, low: Q, high: Q) {
        self.rows.push((a, low, high));
    }

    /// Adds a·x = b.
    pub fn equal(&mut self, a: &[Q], b: &Q) {
        self.row(a.to_vec(), b.clone(), b.clone());
    }

    /// The largest d·x and a point where it is taken; `None` if no x satisfies the rows.
    ///
    /// A bounded dual simplex by the smallest-index rule, which ends in exact arithmetic.
    pub fn maximize(&self, d: &[Q]) -> Option<(Q, V)> {
        let half = Q::new(1.into(), 2.into());
        let (m, n) = (self.rows.len(), self.lower.len());
        let middle: V = (0..n)
            .map(|j| (&self.lower[j] + &self.upper[j]) * &half)
            .collect();
        // Centred: |y| ≤ range and |slack| ≤ range.
        let mut range: V = (0..n)
            .map(|j| (&self.upper[j] - &self.lower[j]) * &half)
            .collect();
        range.extend(self.rows.iter().map(|(_, l, h)| (h - l) * &half));
        if range.iter().any(Q::is_negative) {
            return None;
        }
        let mut right: V = self
            .rows
            .iter()
            .map(|(a, l, h)| (h + l) * &half - dot(a, &middle))
            .collect();
        let mut t: Vec<V> = self.rows.iter().map(|(a, _, _)| a.clone()).collect();
        let mut reduced = d.to_vec();
        let mut basis: Vec<usize> = (n..n + m).collect();
        let mut column: Vec<usize> = (0..n).collect();
        let mut side: Vec<bool> = reduced.iter().map(|r| !r.is_negative()).collect();
        loop {
            let at: V = (0..n)
                .map(|j| {
                    let r = range[column[j]].clone();
                    if side[j] { r } else { -r }
                })
                .collect();
            let x: V = (0..m).map(|i| &right[i] - dot(&t[i], &at)).collect();
            let leaving = (0..m)
                .filter(|&i| x[i].abs() > range[basis[i]])
                .min_by_key(|&i| basis[i]);
            let Some(r) = leaving else {
                let mut point = middle;
                for (j, at) in at.into_iter().enumerate().filter(|(j, _)| column[*j] < n) {
                    point[column[j]] += at;
                }
                for (i, x) in x.into_iter().enumerate().filter(|(i, _)| basis[*i] < n) {
                    point[basis[i]] += x;
                }
                return Some((dot(d, &point), point));
            };
            let down = x[r].is_positive();
            let mut best: Option<(Q, usize)> = None;
            for j in 0..n {
                // The row must move towards its range when column j leaves its side.
                let slope = if down == side[j] {
                    -t[r][j].clone()
                } else {
                    t[r][j].clone()
                };
                if !slope.is_positive() {
                    continue;
                }
                let step = reduced[j].abs() / slope;
                let better = best
                    .as_ref()
                    .is_none_or(|(s, c)| step < *s || (step == *s && column[j] < column[*c]));
                if better {
                    best = Some((step, j));
                }
            }
            let (_, j) = best?;
            let pivot = t[r][j].clone();
            t[r][j] = Q::one();
            for v in &mut t[r] {
                *v /= &pivot;
            }
            right[r] /= &pivot;
            let (row, value) = (t[r].clone(), right[r].clone());
            for i in (0..m).filter(|&i| i != r) {
                let f = std::mem::replace(&mut t[i][j], Q::zero());
                if !f.is_zero() {
                    for (t, p) in t[i].iter_mut().zip(&row).filter(|(_, p)| !p.is_zero()) {
                        *t -= &f * p;
                    }
                    right[i] -= &f * &value;
                }
            }
            let f = std::mem::replace(&mut reduced[j], Q::zero());
            for (t, p) in reduced.iter_mut().zip(&row).filter(|(_, p)| !p.is_zero()) {
                *t -= &f * p;
            }
            side[j] = down;
            std::mem::swap(&mut basis[r], &mut column[j]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact::{Source, frac, q, v};

    #[test]
    fn a_program_by_hand() {
        // max x + 2y over 0 ≤ x, y ≤ 3, x + y ≤ 4: 1 + 6.
        let mut lp = Lp::over(v(&[0, 0]), v(&[3, 3]));
        lp.row(v(&[1, 1]), q(0), q(4));
        let (value, at) = lp.maximize(&v(&[1, 2])).unwrap();
        assert_eq!((value, at), (q(7), v(&[1, 3])));
        lp.equal(&v(&[1, -1]), &q(5));
        assert!(lp.maximize(&v(&[1, 2])).is_none());
    }

    /// Over one equality the maximum is found by trying every vertex.
    #[test]
    fn agrees_with_the_vertices() {
        let mut s = Source::of("test", "lp");
        for _ in 0..300 {
            let n = 3;
            let a = s.vector(n, 2);
            let b = s.int(-4, 4);
            let d = s.vector(n, 2);
            let mut lp = Lp::unit(n);
            lp.equal(&a, &q(b));
            let mut best: Option<Q> = None;
            for free in 0..n {
                for signs in 0..1 << n {
                    let mut x: V = (0..n)
                        .map(|j| if signs >> j & 1 == 1 { q(1) } else { q(-1) })
                        .collect();
                    if a[free].is_zero() {
                        if dot(&a, &x) != q(b) {
                            continue;
                        }
                    } else {
                        x[free] = Q::zero();
                        x[free] = (q(b) - dot(&a, &x)) / &a[free];
                        if x[free].abs() > q(1) {
                            continue;
                        }
                    }
                    let value = dot(&d, &x);
                    if best.as_ref().is_none_or(|b| value > *b) {
                        best = Some(value);
                    }
                }
            }
            assert_eq!(lp.maximize(&d).map(|(value, _)| value), best);
        }
        assert_eq!(frac(2, 4), frac(1, 2));
    }
}
