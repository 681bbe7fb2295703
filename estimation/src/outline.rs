//! Outlines of beliefs in a plane, for pictures.

use crate::estimator::Shape;
use zonobench_sets::ellipsoid::Ellipsoid;
use zonobench_sets::units::power_below;
use zonobench_sets::zonotope::Zonotope;
use zonobench_sets::{ConstrainedZonotope, Matrix};

/// Directions in which a zonotope with many generators is drawn.
const DIRECTIONS: usize = 128;

/// Probability of the ellipse that stands for a Gaussian belief.
const ELLIPSE_LEVEL: f64 = 0.99;

/// A closed polygon (counter-clockwise, without repeating the first point) that shows `shape` in the plane
/// of the components `axes`: the box where the shape has bounds, else the projected zonotope, else the 99 %
/// ellipse of the Gaussian; one point where it has none of them.
///
/// A zonotope of more than 128 generators is drawn by its support points in 128 directions. A picture, not
/// an enclosure; empty where nothing can be drawn.
pub fn outline(shape: &Shape, axes: (usize, usize)) -> Vec<[f64; 2]> {
    let (i, j) = axes;
    let center = [shape.center[i], shape.center[j]];
    if let Some(bounds) = &shape.bounds {
        let (x, y) = (bounds[i], bounds[j]);
        return vec![
            [x.lo(), y.lo()],
            [x.hi(), y.lo()],
            [x.hi(), y.hi()],
            [x.lo(), y.hi()],
        ];
    }
    if let (Some(g), Some((a, b))) = (&shape.generators, &shape.constraints) {
        let plane = Matrix::from_rows(&[g.row(i), g.row(j)]);
        return plane
            .and_then(|g| {
                ConstrainedZonotope::new(center.to_vec(), g, a.clone(), b.clone())?.vertices()
            })
            .unwrap_or_default();
    }
    if let Some(g) = shape.generators.as_ref().filter(|g| g.cols() > 0) {
        return zonotope(center, g.row(i), g.row(j));
    }
    if let Some(p) = &shape.covariance {
        return ellipse(center, p, axes);
    }
    vec![center]
}

/// The vertices, or the support points where there are too many of them.
fn zonotope(center: [f64; 2], xs: &[f64], ys: &[f64]) -> Vec<[f64; 2]> {
    if xs.len() <= DIRECTIONS {
        return Matrix::from_rows(&[xs, ys])
            .and_then(|g| Zonotope::new(center.to_vec(), g)?.vertices())
            .unwrap_or_default();
    }
    // Directions of a set about as wide as high.
    let unit = |row: &[f64]| power_below(row.iter().map(|x| x.abs()).sum());
    let units = [unit(xs), unit(ys)];
    (0..DIRECTIONS)
        .map(|k| {
            let angle = k as f64 * core::f64::consts::TAU / DIRECTIONS as f64;
            let d = [libm::cos(angle) / units[0], libm::sin(angle) / units[1]];
            xs.iter().zip(ys).fold(center, |p, (x, y)| {
                let sign = if d[0] * x + d[1] * y >= 0.0 {
                    1.0
                } else {
                    -1.0
                };
                [p[0] + sign * x, p[1] + sign * y]
            })
        })
        .collect()
}

fn ellipse(center: [f64; 2], p: &Matrix, (i, j): (usize, usize)) -> Vec<[f64; 2]> {
    let plane = Matrix::from_fn(2, 2, |r, c| p[([i, j][r], [i, j][c])]);
    Ellipsoid::with_confidence(center.to_vec(), plane, 1.0 - ELLIPSE_LEVEL)
        .and_then(|e| e.outline(64))
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use zonobench_sets::ellipsoid::chi_square_isf;

    fn area(polygon: &[[f64; 2]]) -> f64 {
        let n = polygon.len();
        (0..n)
            .map(|k| {
                let (p, q) = (polygon[k], polygon[(k + 1) % n]);
                0.5 * (p[0] * q[1] - p[1] * q[0])
            })
            .sum()
    }

    #[test]
    fn the_outline_of_a_square_with_a_diagonal_is_a_hexagon() {
        let g = Matrix::from_rows(&[[1.0, 0.0, -1.0], [0.0, 1.0, -1.0]]).unwrap();
        let shape = Shape {
            center: vec![3.0, 4.0],
            generators: Some(g),
            ..Shape::default()
        };
        let polygon = outline(&shape, (0, 1));
        assert_eq!(polygon.len(), 6);
        // 4 Σ |det| over pairs of generators.
        assert_eq!(area(&polygon), 12.0);
    }

    #[test]
    fn an_ellipse_is_counter_clockwise_and_has_its_area() {
        let p = Matrix::from_rows(&[[4.0, 1.0], [1.0, 2.0]]).unwrap();
        let shape = Shape {
            center: vec![0.0, 0.0],
            covariance: Some(p),
            ..Shape::default()
        };
        let exact = core::f64::consts::PI * 7.0_f64.sqrt() * chi_square_isf(0.01, 2).unwrap();
        assert!((area(&outline(&shape, (0, 1))) / exact - 1.0).abs() < 2e-3);
    }
}
