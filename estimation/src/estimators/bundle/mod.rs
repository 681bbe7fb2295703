//! The polytopic filters by remainder-form decomposition: RRSR, D-RRSR, D-ZB, D-CZ, their intersections
//! COMB and COMB+, and LIFT, which imposes all their relations on one state before projecting.
//!
//! All keep x_k in a polytope. A step needs relations f_i(x) − M x ∈ \[lo, hi\] that hold for every x of a box
//! around it (`propagation::decomposition`); how they are found and how they are used is what the
//! methods differ in.
//!
//! Source: \[Khajenejad\], with Corollary 1 and Lemmas 2, 4 and 5 in their corrected form. The paper's sets in
//! generators are, after the conversion to a polytope that it does in each step anyway, the closed forms
//! below: D-CZ and RRSR are { M x + g + w : x ∈ P, g ∈ \[lo, hi\], w ∈ W }, D-ZB the intersection over the
//! frames of P of { M x + g + w : x in the frame's box }, and an update with a box is an intersection with
//! the slabs M x ∈ y − V − \[lo, hi\].

mod belief;
mod filter;
mod image;

pub use belief::PolytopeBelief;

use crate::estimator::{Estimator, Measurement, Phase};
use crate::propagation::decomposition::{Choose, JacobianBounds, Recipe, Vectors};
use crate::{AnySystem, EstimationError, Problem, System};
use filter::{Member, Method, PolytopeFilter};
use serde::{Deserialize, Serialize};
use zonobench_sets::FacetBound;

/// From which set k = 0 is left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Start {
    /// The updated set itself.
    #[default]
    Set,
    /// Its interval hull, which is then also what is reported at k = 0: the reading that reproduces the first
    /// column of the paper's Table I.
    Hull,
}

/// What is carried from step to step beside the hull.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Carry {
    /// All facets, found by a sweep of linear programs; up to three dimensions.
    Facets,
    /// The hull, by 2n linear programs, and the strips of the last measurement; in any dimension.
    Hull,
}

/// Settings of `rrsr`, `d-rrsr`, `d-zb`, `d-cz`, `comb`, `comb+` and `lift`. What is not given is what the
/// kind has by its definition; a key that a kind does not use is refused.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PolytopeFilterSettings {
    /// `signed` for `comb+` and `lift`, `paper` for the others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vectors: Option<Vectors>,
    /// `all` for `lift`, `argmin` for the others. Not for `rrsr` and `d-rrsr`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub choose: Option<Choose>,
    /// `natural` for `rrsr`, `d-zb`, `d-cz` and `comb`, `decomposition` for `d-rrsr`, `comb+` and `lift`. In
    /// `comb` and `comb+` it is that of D-ZB and D-CZ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub jacobian: Option<JacobianBounds>,
    /// `set` unless given.
    #[serde(default)]
    pub start: Start,
    /// `lift` only: `facets` up to three dimensions and `hull` above, unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub carry: Option<Carry>,
    /// The facets that a step starts from, beside the sides of the hull: 32 unless given. Not with the hull
    /// carried.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub facets: Option<usize>,
}

/// How many inclined facets, pairs of parallel half-spaces beside those of the hull, a step starts from unless given:
/// more than any step of the paper's examples starts from, so that they are as published.
const FACETS: usize = 32;

/// A predicted set may have this many times as many: the next measurement takes most of them off again.
const WITHIN_A_STEP: usize = 6;

/// The bound on facets that `settings` ask for.
///
/// Without one they grow from step to step where measurements cut little off: a bundle has an image a frame, and every
/// image has facets of its own. Where there are more, those that cut most are kept
/// ([`Polytope::thinned`](zonobench_sets::Polytope::thinned)), an enclosure whatever is left out.
fn facet_bound(
    kind: &'static str,
    settings: &PolytopeFilterSettings,
    carry: Carry,
) -> Result<FacetBound, EstimationError> {
    let kept = match (settings.facets, carry) {
        (None, _) => FACETS,
        (Some(_), Carry::Hull) => {
            let got = "a number; only the hull is carried";
            return Err(EstimationError::setting(kind, "facets", "absent", got));
        }
        (Some(0), _) => return Err(EstimationError::setting(kind, "facets", "at least 1", 0)),
        (Some(facets), _) => facets,
    };
    Ok(FacetBound {
        most: kept.saturating_mul(WITHIN_A_STEP),
        kept,
    })
}

impl PolytopeFilterSettings {
    fn recipe(&self, vectors: Vectors, choose: Choose, jacobian: JacobianBounds) -> Recipe {
        Recipe {
            vectors: self.vectors.unwrap_or(vectors),
            choose: self.choose.unwrap_or(choose),
            jacobian: self.jacobian.unwrap_or(jacobian),
        }
    }

    /// Fails where a key is given that `kind` does not use.
    fn only(&self, kind: &'static str, choose: bool, carry: bool) -> Result<(), EstimationError> {
        let refuse = |key, expected| Err(EstimationError::setting(kind, key, expected, "one"));
        if self.choose.is_some() && !choose {
            return refuse(
                "choose",
                "no such key, because there is nothing to choose: the one linear part is the middle of the Jacobian",
            );
        }
        if self.carry.is_some() && !carry {
            return refuse(
                "carry",
                "no such key, because lift alone can carry facets or a hull",
            );
        }
        Ok(())
    }
}

macro_rules! filters {
    ($($(#[$doc:meta])* $name:ident, $kind:literal, $choose:literal, $carry:literal, $method:expr;)+) => {$(
        $(#[$doc])*
        #[derive(Clone, Debug)]
        pub struct $name<Y = AnySystem>(PolytopeFilter<Y>);

        impl<Y: System> $name<Y> {
            /// Fails where a part of the problem has no set, or a setting does not fit; the bundle and the
            /// facets need at most three states.
            pub fn new(
                settings: &PolytopeFilterSettings,
                problem: &Problem<Y>,
            ) -> Result<Self, EstimationError> {
                settings.only($kind, $choose, $carry)?;
                let method: fn(&PolytopeFilterSettings) -> Method = $method;
                PolytopeFilter::new($kind, method(settings), settings, problem).map(Self)
            }
        }

        impl<Y: System> Estimator for $name<Y> {
            type Belief = PolytopeBelief;
            fn prior(&self) -> PolytopeBelief {
                self.0.prior()
            }
            fn predict(
                &self,
                k: usize,
                belief: &PolytopeBelief,
                u: &[f64],
            ) -> Result<PolytopeBelief, EstimationError> {
                self.0.predict(k, belief, u)
            }
            fn update(
                &self,
                k: usize,
                belief: &PolytopeBelief,
                u: &[f64],
                y: Measurement,
            ) -> Result<PolytopeBelief, EstimationError> {
                self.0.update(k, belief, u, y)
            }
            fn guaranteed(&self) -> bool {
                true
            }
            fn reads(&self) -> &'static str {
                "y_0 ... y_{k-1} (predicted), y_0 ... y_k (updated)"
            }
            fn reported_phase(&self) -> Phase {
                Phase::Updated
            }
        }
    )+};
}

const PAPER: (Vectors, Choose, JacobianBounds) =
    (Vectors::Paper, Choose::Argmin, JacobianBounds::Natural);

const PLUS: (Vectors, Choose, JacobianBounds) = (
    Vectors::Signed,
    Choose::Argmin,
    JacobianBounds::Decomposition,
);

fn with_defaults(
    s: &PolytopeFilterSettings,
    (vectors, choose, jacobian): (Vectors, Choose, JacobianBounds),
) -> Recipe {
    s.recipe(vectors, choose, jacobian)
}

fn mean_value(jacobian: JacobianBounds, s: &PolytopeFilterSettings) -> Member {
    Member::MeanValue {
        jacobian: s.jacobian.unwrap_or(jacobian),
        vectors: s.vectors.unwrap_or_default(),
    }
}

/// The mean-value member of an intersection, whose Jacobian is its own.
fn fixed(jacobian: JacobianBounds, vectors: Vectors) -> Member {
    Member::MeanValue { jacobian, vectors }
}

filters! {
    /// RRSR: the mean value extension over the hull, applied to the polytope [Khajenejad, Prop. 3, Lemma 5].
    ///
    /// f(h) + mid J (x − h) + p, |p_i| ≤ ½ Σ_k diam J_ik r_k, x ∈ P, with h and r the middle and the half-widths
    /// of P's hull. Guaranteed, whether h lies in P or not: the hull contains both.
    Rrsr, "rrsr", false, false, |s| Method::Intersection(vec![mean_value(JacobianBounds::Natural, s)]);

    /// D-RRSR: RRSR with every entry of the Jacobian bounded by its decomposition [Khajenejad, Prop. 5].
    DRrsr, "d-rrsr", false, false, |s| {
        Method::Intersection(vec![mean_value(JacobianBounds::Decomposition, s)])
    };

    /// D-ZB: in every frame of the bundle of P, the decomposition over the frame's box; the images are
    /// intersected [Khajenejad, Lemmas 1 and 3].
    DZb, "d-zb", true, false, |s| Method::Intersection(vec![Member::Frames(with_defaults(s, PAPER))]);

    /// D-CZ: the decomposition over the hull of P, applied to P [Khajenejad, Lemmas 2 and 4].
    DCz, "d-cz", true, false, |s| Method::Intersection(vec![Member::Hull(with_defaults(s, PAPER))]);

    /// COMB: RRSR, D-RRSR, D-ZB and D-CZ of the same set, intersected [Khajenejad, Sec. IV].
    Comb, "comb", true, false, |s| Method::Intersection(vec![
        fixed(JacobianBounds::Natural, Vectors::Paper),
        fixed(JacobianBounds::Decomposition, Vectors::Paper),
        Member::Frames(with_defaults(s, PAPER)),
        Member::Hull(with_defaults(s, PAPER)),
    ]);

    /// COMB+: D-RRSR, and D-ZB and D-CZ with signed vectors and the Jacobian of Prop. 5, intersected.
    CombPlus, "comb+", true, false, |s| Method::Intersection(vec![
        fixed(JacobianBounds::Decomposition, Vectors::Signed),
        Member::Frames(with_defaults(s, PLUS)),
        Member::Hull(with_defaults(s, PLUS)),
    ]);

    /// LIFT: all relations for one and the same state, then the projection.
    ///
    /// { x⁺ : some x ∈ P has x⁺_i − w_i − M x ∈ \[lo, hi\] for every vector of every row and for the mean value,
    /// w ∈ W }. Every relation was proved for every x of the hull, so their conjunction is an enclosure; it is
    /// contained in the set that any one choice of vectors gives over the hull, and in D-RRSR. 2n variables,
    /// whatever the step; its hull takes 2n linear programs.
    Lift, "lift", true, true, |s| Method::Lift {
        recipe: s.recipe(Vectors::Signed, Choose::All, JacobianBounds::Decomposition),
    };
}
