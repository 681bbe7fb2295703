//! The breakpoints of the long-step ratio test, and where among them the dual step ends.

/// The smallest pivot.
pub(super) const PIVOT: f64 = 1e-10;

/// The part of `x` above 0, which is never −0: [`f64::max`] leaves the sign of zero open.
#[inline]
pub(super) fn positive(x: f64) -> f64 {
    if x > 0.0 { x } else { 0.0 }
}

/// A breakpoint of the ratio test: the dual step at which the reduced cost of a column vanishes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Breakpoint {
    pub(super) step: f64,
    /// 2·range_j·a_j.
    pub(super) fall: f64,
    pub(super) column: usize,
}

/// A dual step that, going by a sample of the columns, a little more than reaches `excess`.
pub(super) fn step_limit(slope: &[f64], gap: &[f64], range: &[f64], excess: f64) -> f64 {
    const SAMPLE: usize = 16;
    let n = slope.len();
    if n < SAMPLE {
        return f64::INFINITY;
    }
    let mut steps = [f64::INFINITY; SAMPLE];
    let (mut count, mut total) = (0, 0.0);
    for k in 0..SAMPLE {
        let j = k * n / SAMPLE;
        if slope[j] > PIVOT {
            steps[count] = positive(gap[j]) / slope[j];
            total += 2.0 * range[j] * slope[j];
            count += 1;
        }
    }
    // The share of all candidates wanted: twice what a uniform spread would need, and one more.
    let needed = excess * SAMPLE as f64 / n as f64;
    let share = 2.0 * needed / total * count as f64;
    // Also where the sample has no candidate of a range: then the quotient is infinite or NaN.
    if share.is_nan() || share + 1.0 >= count as f64 {
        return f64::INFINITY;
    }
    let rank = share as usize + 1;
    let steps = &mut steps[..count];
    for i in 1..count {
        let mut k = i;
        while k > 0 && steps[k] < steps[k - 1] {
            steps.swap(k, k - 1);
            k -= 1;
        }
    }
    steps[rank]
}

/// Packs the columns that can enter within the dual step `limit` into `points`; their number and total
/// fall.
pub(super) fn collect(
    slope: &[f64],
    gap: &[f64],
    range: &[f64],
    limit: f64,
    points: &mut [Breakpoint],
) -> (usize, f64) {
    let mut count = 0;
    for (j, (&a, &g)) in slope.iter().zip(gap).enumerate() {
        points[count].column = j;
        // limit·a is NaN at worst for a = 0, which is no candidate.
        count += usize::from((a > PIVOT) & (g <= limit * a));
    }
    let mut total = 0.0;
    for p in &mut points[..count] {
        let j = p.column;
        p.step = positive(gap[j]) / slope[j];
        p.fall = 2.0 * range[j] * slope[j];
        total += p.fall;
    }
    (count, total)
}

/// Orders the breakpoints so that those before the returned position have smaller or equal steps, and
/// the falls up to and including it are the first to reach `excess`. Weighted selection: expected linear
/// time, no sort. The falls of all together reach `excess`, up to rounding.
pub(super) fn crossing(points: &mut [Breakpoint], mut excess: f64) -> usize {
    let (mut low, mut high) = (0, points.len());
    while high - low > 12 {
        let (a, b, c) = (
            points[low].step,
            points[(low + high) / 2].step,
            points[high - 1].step,
        );
        let pivot = a.max(b).min(a.min(b).max(c));
        let (less, below) = partition(&mut points[low..high], |step| step < pivot);
        if less > 0 {
            if below >= excess {
                high = low + less;
            } else {
                excess -= below;
                low += less;
            }
            continue;
        }
        // The pivot is the least step: take all that share it.
        let (equal, below) = partition(&mut points[low..high], |step| step <= pivot);
        if below >= excess || equal == high - low || equal == 0 {
            high = low + equal.max(1);
            break;
        }
        excess -= below;
        low += equal;
    }
    // Few are left, or all their steps are equal: take the least again and again; of equal steps the
    // steeper later, so that a steep one enters.
    for at in low..high {
        let mut least = at;
        for k in at + 1..high {
            let (p, q) = (points[k], points[least]);
            if p.step < q.step || (p.step == q.step && p.fall < q.fall) {
                least = k;
            }
        }
        points.swap(at, least);
        excess -= points[at].fall;
        if excess <= 0.0 {
            return at;
        }
    }
    high - 1
}

/// Brings the breakpoints whose step satisfies `first` to the front; their number and total fall.
fn partition(points: &mut [Breakpoint], first: impl Fn(f64) -> bool) -> (usize, f64) {
    let (mut count, mut total) = (0, 0.0);
    for i in 0..points.len() {
        if first(points[i].step) {
            total += points[i].fall;
            points.swap(i, count);
            count += 1;
        }
    }
    (count, total)
}
