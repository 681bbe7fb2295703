//! Polytopes of a bounded number of facets: the half-spaces that cut least go.
//!
//! Dropping a half-space can only make a polytope larger, so whatever is chosen here is an enclosure. Chosen is
//! by how deep a slab cuts into what the others leave, as a share of the width there: a number without
//! units.

use super::clipped::{Clipped, Cut};
use super::{Polytope, Slab};
use crate::lp::LinearProgram;
use crate::{ConstrainedZonotope, IntervalVector, SetError};

/// A slab that cuts off less than this share of the width is not worth a facet.
const SHALLOW: f64 = 1e-9;

/// How many facets a polytope may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FacetBound {
    /// Up to so many slabs that are not along an axis it is left as it is.
    pub most: usize,
    /// Where it has more, so many are kept.
    pub kept: usize,
}

impl Polytope {
    /// As [`Polytope::enclosing_with`], but where the set has more than `bound.most` slabs that are not along an axis,
    /// its polytope has the `bound.kept` that cut most ([`Polytope::thinned`]). Where the sweep finds so many
    /// vertices, or such a volume, that it has gone astray, vertices and volume are those of the box that is cut by
    /// the slabs, rounded.
    ///
    /// `known` is a polytope that holds the set and has all its facets among its slabs, where there is one. The hull is
    /// the smallest in any case. Fails as [`Polytope::enclosing_with`].
    pub fn enclosing_at_most(
        set: &ConstrainedZonotope,
        known: Option<&Self>,
        bound: FacetBound,
        lp: &mut LinearProgram,
    ) -> Result<Self, SetError> {
        if !(2..=3).contains(&set.dim()) {
            return Self::enclosing_with(set, lp);
        }
        // A body of F faces has at most 2 F − 4 vertices.
        let mut most_vertices = bound.most.saturating_mul(2);
        let mut body = None;
        if let Some(known) = known {
            let (taken, cut) = deepest(&known.hull, &known.slabs, bound.most.saturating_add(1));
            if taken.len() > bound.most {
                let all = Self::new(set.interval_hull_with(lp)?, known.slabs.clone())?;
                return Ok(all.cut_down(bound.kept));
            }
            most_vertices = ASTRAY * (cut.vertices().len() + 1);
            body = Some(cut);
        }
        let (all, complete) = Self::swept(set, most_vertices, lp)?;
        if complete && all.inclined() <= bound.most {
            let body = body.unwrap_or_else(|| deepest(&all.hull, &all.slabs, bound.most).1);
            return Ok(if all.has_volume(body.volume()) {
                all
            } else {
                all.with_vertices_of(&body)
            });
        }
        // Of the known slabs few enough cut at all; what was asked for on the way astray may be anything.
        Ok(match known {
            Some(known) => Self::new(all.hull, known.slabs.clone())?.cut_down(bound.most),
            None => all.cut_down(bound.kept),
        })
    }

    /// As [`Polytope::simplified`], within `bound`: see [`Polytope::enclosing_at_most`].
    pub fn simplified_at_most(
        &self,
        bound: FacetBound,
        lp: &mut LinearProgram,
    ) -> Result<Self, SetError> {
        let set = self.to_constrained_zonotope()?;
        Self::enclosing_at_most(&set, Some(self), bound, lp)
    }

    /// The polytope with the `most` slabs that cut most, beside its hull; the polytope itself where it has no more
    /// than that, or more than three dimensions.
    ///
    /// Begins with the hull and takes in, again and again, the slab that cuts deepest into what the slabs taken
    /// leave: max(h(a) − hi, lo + h(−a)) over the hull's width along a, h the support of what is left. Ties go to the
    /// first. Vertices and volume are rounded.
    pub fn thinned(&self, most: usize) -> Self {
        if self.inclined() <= most || self.dim() > 3 {
            return self.clone();
        }
        self.clone().cut_down(most)
    }

    fn cut_down(self, most: usize) -> Self {
        let (mut taken, body) = deepest(&self.hull, &self.slabs, most);
        taken.sort_unstable();
        let slabs = taken.into_iter().map(|i| self.slabs[i].clone()).collect();
        Self { slabs, ..self }.with_vertices_of(&body)
    }

    /// The same half-spaces with the vertices and the volume of `body`.
    fn with_vertices_of(self, body: &Clipped) -> Self {
        let widths: f64 = self.hull.widths().iter().product();
        Self {
            vertices: body.vertices(),
            volume: Some(body.volume().min(widths)),
            ..self
        }
    }

    /// Whether the volume is `other`, within [`SAME_VOLUME`]; a flat set has its own.
    fn has_volume(&self, other: f64) -> bool {
        let own = self.volume.unwrap_or(0.0);
        own == 0.0 || (own - other).abs() <= SAME_VOLUME * other
    }

    /// The number of slabs that are not along an axis.
    fn inclined(&self) -> usize {
        self.slabs.iter().filter(|s| s.side().is_none()).count()
    }
}

/// A sweep has gone astray where it finds more vertices than this times those that cutting finds.
const ASTRAY: usize = 2;

/// Its vertices are rounding, and its body folded, where its volume is off by more than this share.
const SAME_VOLUME: f64 = 1e-3;

/// At most `most` of the slabs that are not along an axis, in the order in which they cut deepest, and the hull
/// cut by them.
///
/// The depth of a slab only falls as others are taken, so it is asked for again only where it may be the
/// greatest.
fn deepest(hull: &IntervalVector, slabs: &[Slab], most: usize) -> (Vec<usize>, Clipped) {
    let mut left = Clipped::of_box(hull);
    let candidates: Vec<(usize, Cut)> = slabs
        .iter()
        .enumerate()
        .filter(|(_, slab)| slab.side().is_none())
        .map(|(i, slab)| (i, left.cut_of(slab)))
        .collect();
    // An upper bound on the depth of each, and for how many slabs taken it is the depth.
    let mut known: Vec<(f64, usize)> = candidates
        .iter()
        .map(|(_, cut)| (left.depth(cut), 0))
        .collect();
    let mut taken = Vec::new();
    while taken.len() < most {
        let mut first = (SHALLOW, None);
        for (k, &(bound, _)) in known.iter().enumerate() {
            if bound > first.0 {
                first = (bound, Some(k));
            }
        }
        let Some(k) = first.1 else { break };
        let (i, cut) = &candidates[k];
        if known[k].1 < taken.len() {
            // Rounding may not let a depth grow.
            known[k] = (left.depth(cut).min(first.0), taken.len());
            continue;
        }
        known[k].0 = f64::NEG_INFINITY;
        left.cut(cut);
        taken.push(*i);
    }
    (taken, left)
}
