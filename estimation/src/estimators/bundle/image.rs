//! Sets from relations: the image of a set by one relation a row, the intersection of images, and the lifted
//! set of all relations.

use super::belief::{Equation, PolytopeBelief};
use crate::System;
use crate::propagation::decomposition::{
    Recipe, Relation, chosen_relations, jacobian_bounds, linear_parts, mean_value_relations,
};
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::reduction::scott;
use zonobench_sets::{
    ConstrainedZonotope, FacetBound, Frame, Interval, IntervalVector, List, Matrix, Polytope,
    SetError, Slab, Zonotope,
};

/// The η of a noise set { c + G η : A η = b }, whose noise is not merely added.
pub(super) struct Coordinates {
    /// { η : A η = b }.
    pub set: ConstrainedZonotope,
    /// A box around it.
    pub range: IntervalVector,
}

impl Coordinates {
    /// Those of a set without rounding box.
    pub fn of(noise: &ConstrainedZonotope) -> Result<Self, SetError> {
        let p = noise.generators();
        let unit = Zonotope::new(vec![0.0; p], Matrix::identity(p))?;
        let (a, b) = (noise.a().clone(), noise.b().to_vec());
        Ok(Self {
            set: ConstrainedZonotope::with_slack(unit, a, b, noise.delta().to_vec())?,
            range: IntervalVector::new(scott::coordinate_bounds(noise)?),
        })
    }

    /// `x` × the set.
    pub fn beside(x: ConstrainedZonotope, noise: Option<&Self>) -> ConstrainedZonotope {
        match noise {
            Some(noise) => x.cartesian_product(&noise.set),
            None => x,
        }
    }
}

/// The box of (x, η), or of x where the noise is added.
pub(super) fn beside(x: &IntervalVector, noise: Option<&Coordinates>) -> IntervalVector {
    match noise {
        Some(noise) => IntervalVector::stack(&[x, &noise.range]),
        None => x.clone(),
    }
}

/// { M x + g : x ∈ X, g_i ∈ remainder_i }.
pub(super) fn image(
    set: &ConstrainedZonotope,
    relations: &[&Relation],
) -> Result<ConstrainedZonotope, SetError> {
    let middle: Vec<f64> = relations.iter().map(|r| r.remainder.mid()).collect();
    let sides: Vec<f64> = relations.iter().map(|r| r.remainder.rad()).collect();
    set.affine_map(&linear_parts(relations), &middle)?
        .plus_box(&sides)
}

/// The intersection of the images, each enlarged by W, with no more facets than `facets` says.
pub(super) fn intersection(
    images: Vec<ConstrainedZonotope>,
    w: &ConstrainedZonotope,
    facets: FacetBound,
    lp: &mut LinearProgram,
) -> Result<PolytopeBelief, SetError> {
    let enlarged = images.into_iter().map(|image| image.minkowski_sum(w));
    let mut enlarged = enlarged.collect::<Result<Vec<_>, _>>()?;
    if enlarged.len() == 1 {
        let set = enlarged.remove(0);
        return PolytopeBelief::new(set, Vec::new(), None, facets, lp);
    }
    let mut all: Option<Polytope> = None;
    for image in &enlarged {
        let own = if image.constraints() == 0 {
            Polytope::of_zonotope(&without_flat_columns(image.zonotope())?)?
        } else {
            Polytope::enclosing_at_most(image, None, facets, lp)?
        };
        all = Some(match all {
            Some(so_far) => so_far.intersect(&own)?,
            None => own,
        });
    }
    let all = all.expect("every member has an image");
    PolytopeBelief::known(all.simplified_at_most(facets, lp)?, facets, lp)
}

/// The zonotope with the boxes among its generators added up: columns along an axis become one.
fn without_flat_columns(z: &Zonotope) -> Result<Zonotope, SetError> {
    let n = z.dim();
    let mut sides = vec![Interval::ZERO; n];
    let mut kept: Vec<List<f64>> = Vec::new();
    for j in 0..z.generators() {
        let column = z.g().col(j);
        let mut nonzero = (0..n).filter(|&i| column[i] != 0.0);
        match (nonzero.next(), nonzero.next()) {
            (None, _) => {}
            (Some(i), None) => sides[i] = sides[i] + Interval::point(column[i].abs()),
            _ => kept.push(column),
        }
    }
    let p = kept.len();
    let g = Matrix::from_fn(n, p + n, |i, j| {
        if j < p {
            kept[j][i]
        } else if j - p == i {
            sides[i].hi()
        } else {
            0.0
        }
    });
    Zonotope::with_rounding(z.c().to_vec(), g, z.r().to_vec())
}

/// { z + w : z_i − M (x, η) ∈ remainder for every relation of row i, for one x ∈ P and η of the noise; w ∈ W }.
pub(super) fn lift<Y: System>(
    f: &Equation<Y>,
    from: &Polytope,
    noise: Option<&Coordinates>,
    recipe: Recipe,
    w: &ConstrainedZonotope,
) -> Result<ConstrainedZonotope, SetError> {
    let n = from.dim();
    let over = beside(from.hull(), noise);
    let m = over.dim();
    let frame = Frame::identity(&over);
    let j = jacobian_bounds(f, &frame, recipe.jacobian, recipe.vectors)?;
    let mut rows = chosen_relations(f, &frame, &j, recipe)?;
    for (row, mean) in rows.iter_mut().zip(mean_value_relations(f, &over, &j)?) {
        if !row.contains(&mean) {
            row.push(mean);
        }
    }
    let mut slabs = Vec::new();
    let mut sides = Vec::with_capacity(m + n);
    sides.extend(over.iter().copied());
    for (i, row) in rows.iter().enumerate() {
        let mut side: Option<Interval> = None;
        for relation in row {
            let reach = relation
                .linear
                .iter()
                .zip(&over)
                .filter(|(m, _)| **m != 0.0)
                .fold(relation.remainder, |s, (&m, &x)| s + Interval::point(m) * x);
            side = Some(match side {
                // Both contain z_i, so they meet unless P is empty.
                Some(known) => known.intersect(&reach).unwrap_or(known),
                None => reach,
            });
            let mut normal: Vec<f64> = relation.linear.iter().map(|m| -m).collect();
            normal.extend((0..n).map(|l| f64::from(l == i)));
            slabs.push(Slab {
                normal,
                range: relation.remainder,
            });
        }
        sides.push(side.expect("every row has a relation"));
    }
    for slab in from.slabs() {
        let inclined = slab.normal.iter().filter(|a| **a != 0.0).count() > 1;
        if inclined {
            let mut normal = slab.normal.clone();
            normal.resize(m + n, 0.0);
            slabs.push(Slab {
                normal,
                range: slab.range,
            });
        }
    }
    if let Some(noise) = noise {
        let set = &noise.set;
        for i in 0..set.constraints() {
            let mut normal = vec![0.0; n];
            normal.extend(set.a().row(i));
            normal.resize(m + n, 0.0);
            slabs.push(Slab {
                normal,
                range: Interval::from_center_radius(set.b()[i], set.delta()[i]),
            });
        }
    }
    let both = ConstrainedZonotope::from_box(&IntervalVector::new(sides))?.within(&slabs)?;
    both.components(m..m + n)?.minkowski_sum(w)
}
