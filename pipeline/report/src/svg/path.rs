//! Path data: coordinates in hundredths of a pixel, written as briefly as the format allows.

/// Builds the `d` of a `<path>`.
#[derive(Default)]
pub(super) struct Path {
    d: String,
    /// Where the pen is, in hundredths
    pen: [i64; 2],
}

fn hundredths(p: [f64; 2]) -> [i64; 2] {
    p.map(|v| (v * 100.0).round() as i64)
}

/// `hundredths` / 100 without the zeros that say nothing: 12.5, −.25, 3.
pub(super) fn number(hundredths: i64) -> String {
    let (whole, part) = (
        hundredths.unsigned_abs() / 100,
        hundredths.unsigned_abs() % 100,
    );
    let sign = if hundredths < 0 { "-" } else { "" };
    match (whole, part) {
        (_, 0) => format!("{sign}{whole}"),
        (0, _) => format!("{sign}.{part:02}"),
        _ => format!("{sign}{whole}.{part:02}"),
    }
    .trim_end_matches(|c| part != 0 && c == '0')
    .to_owned()
}

impl Path {
    /// Lifts the pen and puts it down at `p`.
    pub(super) fn move_to(&mut self, p: [f64; 2]) {
        let p = hundredths(p);
        self.command('M', p);
        self.pen = p;
    }

    /// Lifts the pen and puts it down at `p`, written relative to where it was.
    pub(super) fn hop_to(&mut self, p: [f64; 2]) {
        if self.d.is_empty() {
            return self.move_to(p);
        }
        let p = hundredths(p);
        self.command('m', [p[0] - self.pen[0], p[1] - self.pen[1]]);
        self.pen = p;
    }

    /// Draws straight to each of the points; those that fall on the one before are left out.
    pub(super) fn lines_to(&mut self, points: &[[f64; 2]]) {
        let mut letter = Some('l');
        for p in points {
            let p = hundredths(*p);
            let by = [p[0] - self.pen[0], p[1] - self.pen[1]];
            if by == [0, 0] {
                continue;
            }
            match letter.take() {
                Some(letter) => self.command(letter, by),
                None => self.pair(by, true),
            }
            self.pen = p;
        }
    }

    /// A line through the points, with no more of them than the eye can tell.
    pub(super) fn strip(&mut self, points: &[[f64; 2]]) {
        let points = simplified(points);
        self.move_to(points[0]);
        self.lines_to(&points[1..]);
    }

    /// Back to where the pen was put down.
    pub(super) fn close(&mut self) {
        self.d.push('z');
    }

    /// Path data relative to the pen that ends where it began, as it is.
    pub(super) fn raw(&mut self, data: &str) {
        self.d.push_str(data);
    }

    pub(super) fn finish(self) -> String {
        self.d
    }

    fn command(&mut self, letter: char, p: [i64; 2]) {
        self.d.push(letter);
        self.pair(p, false);
    }

    fn pair(&mut self, p: [i64; 2], after_number: bool) {
        for (i, v) in p.into_iter().enumerate() {
            if (i > 0 || after_number) && v >= 0 {
                self.d.push(' ');
            }
            self.d.push_str(&number(v));
        }
    }
}

/// Pixels a simplified line may lie beside the given one: less than is seen.
const TOLERANCE: f64 = 0.2;

/// The line with fewer points (Ramer, Douglas and Peucker): no left-out point is farther than
/// [`TOLERANCE`] from it. `points` has one at least; ends stay.
fn simplified(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut keep = vec![false; points.len()];
    keep[0] = true;
    keep[points.len() - 1] = true;
    let mut parts = vec![(0, points.len() - 1)];
    while let Some((first, last)) = parts.pop() {
        let (mut farthest, mut distance) = (first, TOLERANCE);
        for i in first + 1..last {
            let d = distance_to_segment(points[i], points[first], points[last]);
            if d > distance {
                (farthest, distance) = (i, d);
            }
        }
        if farthest != first {
            keep[farthest] = true;
            parts.push((first, farthest));
            parts.push((farthest, last));
        }
    }
    points
        .iter()
        .zip(keep)
        .filter_map(|(p, keep)| keep.then_some(*p))
        .collect()
}

fn distance_to_segment(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let (along, to) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let squared = along[0] * along[0] + along[1] * along[1];
    let t = if squared > 0.0 {
        ((along[0] * to[0] + along[1] * to[1]) / squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let (dx, dy) = (to[0] - t * along[0], to[1] - t * along[1]);
    (dx * dx + dy * dy).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let numbers = [0, 5, -50, 100, -1234, 120, 100_000].map(number);
        assert_eq!(numbers, ["0", ".05", "-.5", "1", "-12.34", "1.2", "1000"]);
    }

    #[test]
    fn rounding_does_not_add_up() {
        let mut path = Path::default();
        path.move_to([0.0, 0.0]);
        let points: Vec<_> = (1..=3).map(|i| [f64::from(i) * 0.3333, 1.0]).collect();
        path.lines_to(&points);
        assert_eq!(path.finish(), "M0 0l.33 1 .34 0 .33 0");
    }

    #[test]
    fn a_straight_line_is_two_points_and_a_peak_stays() {
        let mut line: Vec<_> = (0..100).map(|i| [f64::from(i), f64::from(i)]).collect();
        assert_eq!(simplified(&line), [[0.0, 0.0], [99.0, 99.0]]);
        line[50][1] = 60.0;
        assert!(simplified(&line).contains(&[50.0, 60.0]));
    }
}
