//! Membership in three dimensions and more, without a linear program: projections find a certificate, or a
//! direction that separates, or neither.
//!
//! o ∈ G [−1, 1]^p asks for a ξ in the cube with G ξ = o. The Douglas–Rachford iteration, which projects in
//! turns on a cube a little smaller than the unit one and on the plane G ξ = o, leads to such a ξ where the
//! set holds o with some room. Where it does not, the gap between the two, Gᵀ λ, is normal to a half-space
//! that holds the set and not o. Neither answer trusts the iteration: each is checked, with its rounding.
//!
//! Source: H. H. Bauschke, P. L. Combettes, D. R. Luke, "Finding best approximation pairs relative to two
//! closed convex sets in Hilbert spaces", Journal of Approximation Theory 127, 2004.

use super::Zonotope;
use crate::matrix::{abs_sum, dot};
use crate::rounding::{gamma, up};
use crate::{Containment, Interval, List, Matrix, units};

/// How often the two projections are taken.
const ROUNDS: usize = 100;

/// Half the edge of the cube on which ξ is projected: what is left below 1 pays for rounding.
const EDGE: f64 = 1.0 - 1e-9;

impl Zonotope {
    /// Whether the set contains c + o for every o in the box `offset`.
    ///
    /// The rounding box counts where the set is separated from the point and is left out where it holds
    /// it, both of which are sound. `Undecided` near the boundary, and where the generators do not span
    /// the space.
    pub(super) fn contains_by_projection(&self, offset: &[Interval]) -> Containment {
        // Distances add components, so they are taken in units of the rows, where that is exact.
        let units = units::of_rows(&self.g);
        let g = units::divided_rows(&self.g, &units);
        if units::multiplied_rows(&g, &units) != self.g {
            return self.contains_in_units(offset);
        }
        let radius = self.r.iter().zip(&units);
        let scaled = Self {
            c: List::filled(0.0, self.dim()),
            g,
            r: radius
                .map(|(r, u)| units::moved_up(*r, 1.0 / u, 0.0))
                .collect(),
        };
        let offset = offset.iter().zip(&units);
        let offset: List<Interval> = offset.map(|(&o, u)| o * (1.0 / u)).collect();
        scaled.contains_in_units(&offset)
    }

    /// The same with components compared as they are; c does not enter.
    fn contains_in_units(&self, offset: &[Interval]) -> Containment {
        let (n, p) = (self.dim(), self.generators());
        // K' = (G Gᵀ)⁻¹ G: the least ξ with G ξ = e is K e.
        let Ok(k) = self.g.gram().solve_positive_definite(&self.g) else {
            return Containment::Undecided;
        };
        if !k.is_finite() {
            return Containment::Undecided;
        }
        let target: Vec<f64> = offset.iter().map(|side| side.mid()).collect();
        let (mut z, mut xi, mut gap) = (vec![0.0_f64; p], vec![0.0; p], vec![0.0; n]);
        for round in 1..=ROUNDS {
            // b = P_cube z, ξ = P_plane(2b − z), z ← z + ξ − b.
            for (xi, &z) in xi.iter_mut().zip(&z) {
                *xi = 2.0 * z.clamp(-EDGE, EDGE) - z;
            }
            for (i, e) in gap.iter_mut().enumerate() {
                // At first z = 0.
                *e = match round {
                    1 => target[i],
                    _ => {
                        let row = self.g.row(i).iter().zip(&xi);
                        target[i] - row.map(|(g, xi)| g * xi).sum::<f64>()
                    }
                };
            }
            for (i, &gap) in gap.iter().enumerate() {
                for (xi, k) in xi.iter_mut().zip(k.row(i)) {
                    *xi += k * gap;
                }
            }
            let mut within = true;
            for (z, xi) in z.iter_mut().zip(&xi) {
                within &= xi.abs() <= EDGE;
                *z += xi - z.clamp(-EDGE, EDGE);
            }
            if within {
                return match self.is_certificate(&xi, &k, offset) {
                    true => Containment::Inside,
                    false => Containment::Undecided,
                };
            }
            if round.is_power_of_two() || round == ROUNDS {
                for (i, e) in gap.iter_mut().enumerate() {
                    let row = self.g.row(i).iter().zip(&z);
                    *e = target[i] - row.map(|(g, z)| g * z.clamp(-EDGE, EDGE)).sum::<f64>();
                }
                if self.separates(&gap, offset) {
                    return Containment::Outside;
                }
            }
        }
        Containment::Undecided
    }

    /// Whether `xi` proves that every o of `offset` is in G [−1, 1]^p.
    ///
    /// With ρ = o − G ξ and E = G K − I, ‖E‖∞ ≤ ε < 1, the equation (I + E) s = ρ has a solution with
    /// ‖s‖∞ ≤ t = ‖ρ‖∞/(1 − ε), so that G (ξ + K s) = o; and |ξ_j| + ‖K_j‖₁ t ≤ 1 keeps it in the cube.
    ///
    /// |ρ_i| ≤ ⌈|fl(mid o_i − G_i ξ)| + rad o_i + γ_{p+1} (|mid o_i| + |G|_i 1)⌉, as |ξ| ≤ 1, and
    /// Σ_l |E_il| ≤ ⌈Σ_l |fl(E_il)| + γ_{p+1} Σ_l (1 + |G_i| 1 ‖K_l‖∞)⌉, in whatever order is summed.
    fn is_certificate(&self, xi: &[f64], k: &Matrix, offset: &[Interval]) -> bool {
        let (n, p) = (self.dim(), self.generators());
        let (mut residual, mut defect) = (0.0_f64, 0.0_f64);
        let most = |row: &[f64]| row.iter().fold(0.0_f64, |most, k| most.max(k.abs()));
        let largest: Vec<f64> = (0..n).map(|l| most(k.row(l))).collect();
        for (i, side) in offset.iter().enumerate() {
            let row = self.g.row(i);
            let mid = side.mid();
            let ones = abs_sum(row);
            let size = mid.abs() + ones;
            let bound = (mid - dot(row, xi)).abs() + side.rad() + gamma(p + 1) * size;
            residual = residual.max(up(bound, p + 4));
            let mut sum = 0.0;
            for (l, largest) in largest.iter().enumerate() {
                let one = if i == l { 1.0 } else { 0.0 };
                let entry = dot(row, k.row(l)) - one;
                sum += entry.abs() + gamma(p + 1) * (1.0 + ones * largest);
            }
            defect = defect.max(up(sum, n + p + 3));
        }
        if defect >= 0.5 {
            return false;
        }
        // 1/(1 − ε) ≤ 1 + 2 ε for ε ≤ 1/2.
        let t = up(residual * (1.0 + 2.0 * defect), 3);
        xi.iter().enumerate().all(|(j, x)| {
            let norm = (0..n).fold(0.0, |s, i| s + k[(i, j)].abs());
            up(x.abs() + norm * t, n + 2) <= 1.0
        })
    }

    /// Whether the direction (G Gᵀ)⁻¹ `gap` proves that no o of `offset` is in the set.
    fn separates(&self, gap: &[f64], offset: &[Interval]) -> bool {
        let Ok(d) = self.g.gram().solve_positive_definite(&Matrix::column(gap)) else {
            return false;
        };
        let d = d.col(0);
        let centered = Self {
            c: List::filled(0.0, self.dim()),
            ..self.clone()
        };
        let reach = offset
            .iter()
            .zip(&d)
            .fold(Interval::ZERO, |s, (&o, &d)| s + o * d);
        centered.support(&d).is_ok_and(|bound| reach.lo() > bound)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in (−1, 1) without pattern, the same every time.
    fn draws() -> impl FnMut() -> f64 {
        let mut state = 0x5eed_u64;
        move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    /// max over the normals d of all facets of |dᵀo| / ρ(d): below 1 inside, above 1 outside.
    fn gauge(g: &Matrix, o: &[f64]) -> f64 {
        let column = |j: usize| [g[(0, j)], g[(1, j)], g[(2, j)]];
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let mut most: f64 = 0.0;
        for i in 0..g.cols() {
            for j in 0..i {
                let (a, b) = (column(i), column(j));
                let d = [
                    a[1] * b[2] - a[2] * b[1],
                    a[2] * b[0] - a[0] * b[2],
                    a[0] * b[1] - a[1] * b[0],
                ];
                let support: f64 = (0..g.cols()).map(|k| dot(d, column(k)).abs()).sum();
                most = most.max(dot(d, [o[0], o[1], o[2]]).abs() / support);
            }
        }
        most
    }

    #[test]
    fn verdicts_agree_with_the_facets_and_few_are_left_open() {
        let mut draw = draws();
        let (mut open, mut inside, mut outside) = (0, 0, 0);
        for trial in 0..400 {
            let p = 4 + trial % 30;
            let g = Matrix::from_fn(3, p, |i, _| draw() * [0.1, 1.0, 5.0][i]);
            let z = Zonotope::new(vec![1.0, 2.0, 3.0], g.clone()).unwrap();
            let radius = z.radius();
            let o: Vec<f64> = radius.iter().map(|r| 0.7 * r * draw()).collect();
            let x: Vec<Interval> = o
                .iter()
                .zip(z.c())
                .map(|(o, c)| Interval::point(o + c))
                .collect();
            let gauge = gauge(&g, &o);
            match z.contains(&x).unwrap() {
                Containment::Inside => {
                    inside += 1;
                    assert!(gauge <= 1.0 + 1e-12, "{gauge}");
                }
                Containment::Outside => {
                    outside += 1;
                    assert!(gauge >= 1.0 - 1e-12, "{gauge}");
                }
                Containment::Undecided => open += 1,
            }
        }
        assert!(
            inside > 100 && outside > 50 && open < 40,
            "{inside} {outside} {open}"
        );
    }

    #[test]
    fn a_flat_set_is_left_open_and_a_cube_is_decided() {
        let flat = Zonotope::new(
            vec![0.0; 3],
            Matrix::from_fn(3, 2, |i, j| f64::from(i == j)),
        )
        .unwrap();
        let at = |z: &Zonotope, x: [f64; 3]| z.contains(&x.map(Interval::point)).unwrap();
        assert_eq!(at(&flat, [0.5, 0.5, 0.0]), Containment::Undecided);
        let cube = Zonotope::new(vec![0.0; 3], Matrix::identity(3)).unwrap();
        assert_eq!(at(&cube, [0.5, -0.999, 0.0]), Containment::Inside);
        assert_eq!(at(&cube, [0.5, -1.001, 0.0]), Containment::Outside);
        assert_eq!(at(&cube, [1.0, 1.0, 1.0]), Containment::Undecided);
    }
}
