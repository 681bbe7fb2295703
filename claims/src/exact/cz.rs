//! Constrained zonotopes {c + G ξ : |ξ|∞ ≤ 1, A ξ = b}, exactly; a zonotope is one without constraints.

use super::{Lp, M, Q, Source, V, add, dot, frac, scale, sub};

/// {c + G ξ : |ξ|∞ ≤ 1, A ξ = b}.
#[derive(Clone, Debug)]
pub struct Cz {
    /// Generators G.
    pub g: M,
    /// Centre c.
    pub c: V,
    /// Constraint matrix A.
    pub a: M,
    /// Right side b.
    pub b: V,
}

impl Cz {
    /// The zonotope {c + G ξ}.
    pub fn zonotope(g: M, c: V) -> Self {
        let a = M::zeros(0, g.cols());
        Self {
            g,
            c,
            a,
            b: Vec::new(),
        }
    }

    /// The box with these centre and half widths.
    pub fn boxed(c: V, r: &[Q]) -> Self {
        Self::zonotope(M::diag(r), c)
    }

    fn lp(&self) -> Lp {
        let mut lp = Lp::unit(self.g.cols());
        for i in 0..self.a.rows() {
            lp.equal(self.a.row(i), &self.b[i]);
        }
        lp
    }

    /// max d·x over the set, with ξ where it is taken; `None` if the set is empty.
    pub fn maximize(&self, d: &[Q]) -> Option<(Q, V)> {
        let (value, xi) = self.lp().maximize(&self.g.t().apply(d))?;
        Some((value + dot(d, &self.c), xi))
    }

    /// The support function; `None` if the set is empty.
    pub fn support(&self, d: &[Q]) -> Option<Q> {
        self.maximize(d).map(|(value, _)| value)
    }

    /// c + G ξ.
    pub fn at(&self, xi: &[Q]) -> V {
        add(&self.c, &self.g.apply(xi))
    }

    /// Whether x is in the set.
    pub fn contains(&self, x: &[Q]) -> bool {
        let mut lp = self.lp();
        let offset = sub(x, &self.c);
        for i in 0..self.g.rows() {
            lp.equal(self.g.row(i), &offset[i]);
        }
        lp.maximize(&vec![frac(0, 1); self.g.cols()]).is_some()
    }

    /// The interval hull; `None` if the set is empty.
    pub fn hull(&self) -> Option<Vec<(Q, Q)>> {
        let n = self.c.len();
        let unit = M::identity(n);
        (0..n)
            .map(|i| {
                let e = unit.row(i);
                let minus = scale(&frac(-1, 1), e);
                Some((-self.support(&minus)?, self.support(e)?))
            })
            .collect()
    }

    /// ξ of vertices of the set {|ξ|∞ ≤ 1, A ξ = b} in drawn directions, and of points between two of them;
    /// empty if the set is.
    pub fn coordinates(&self, draw: &mut Source, count: usize) -> Vec<V> {
        let lp = self.lp();
        let mut out: Vec<V> = Vec::new();
        for k in 0..count {
            let d = draw.direction(self.g.cols(), 3);
            let Some((_, xi)) = lp.maximize(&d) else {
                return Vec::new();
            };
            if k % 3 == 2 {
                let f = frac(draw.int(0, 4), 4);
                let other = &out[k - 1];
                out.push(add(&xi, &scale(&f, &sub(other, &xi))));
            } else {
                out.push(xi);
            }
        }
        out
    }

    /// Points of the set: vertices in drawn directions of ξ, and points between two of them.
    pub fn points(&self, draw: &mut Source, count: usize) -> Vec<V> {
        let xi = self.coordinates(draw, count);
        xi.iter().map(|xi| self.at(xi)).collect()
    }

    /// R Z, [Rego2020, Eq. (8)].
    pub fn image(&self, r: &M) -> Self {
        Self {
            g: r.mul(&self.g),
            c: r.apply(&self.c),
            a: self.a.clone(),
            b: self.b.clone(),
        }
    }

    /// Z ⊕ W, [Rego2020, Eq. (9)].
    pub fn sum(&self, w: &Cz) -> Self {
        Self {
            g: self.g.beside(&w.g),
            c: add(&self.c, &w.c),
            a: self.a.block(&w.a),
            b: [self.b.clone(), w.b.clone()].concat(),
        }
    }

    /// Z ∩_R Y, [Rego2020, Eq. (10)].
    pub fn meet(&self, r: &M, y: &Cz) -> Self {
        let own = r.mul(&self.g).beside(&y.g.scale(&frac(-1, 1)));
        Self {
            g: self.g.beside(&M::zeros(self.g.rows(), y.g.cols())),
            c: self.c.clone(),
            a: self.a.block(&y.a).above(&own),
            b: [self.b.clone(), y.b.clone(), sub(&y.c, &r.apply(&self.c))].concat(),
        }
    }

    /// Z moved by −h.
    pub fn about(&self, h: &[Q]) -> Self {
        Self {
            c: sub(&self.c, h),
            ..self.clone()
        }
    }

    /// The zonotope {c + G ξ} without the constraints.
    pub fn relaxed(&self) -> Self {
        Self::zonotope(self.g.clone(), self.c.clone())
    }
}
