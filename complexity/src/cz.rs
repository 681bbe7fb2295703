//! [Rego2020, Tables 1 and 7, Sec. 4.5]: the cost of a step of ZMV, ZFO, CZMV and CZFO, and of the operations
//! that they are made of.
//!
//! Two readings. Under the paper's model a linear program of N_d variables and N_c constraints costs N_d N_c³
//! and an elimination (n_g + n_c)³: the programs and eliminations that really ran, with their real sizes, are
//! priced so, and everything else is counted. The engine's own work is counted throughout: its
//! dual simplex keeps its basis from one direction to the next, and its elimination updates rows.

use crate::claim::{Row, Sweep, TOLERANCE, Verdict, judge, rows as rows_of, statement};
use crate::fit::Degree;
use crate::instance::{Dense, Instance};
use crate::{sizes, table_7};
use zonobench_estimation::propagation::{
    Choice, Expansion, Remainder, first_order, mean_value, zonotope_first_order,
    zonotope_mean_value,
};
use zonobench_sets::lp::LinearProgram;
use zonobench_sets::ops::{self, Kernel, Tally};
use zonobench_sets::reduction::{scott, yang_scott};
use zonobench_sets::{ConstrainedZonotope, Zonotope, strip};

const VALID: &str = "the instance is a valid one";

/// The sizes that Table 1 has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sizes {
    /// n, states.
    pub n: usize,
    /// n_w, process noises.
    pub n_w: usize,
    /// n_y, outputs, each with one noise.
    pub n_y: usize,
    /// n_g, generators kept.
    pub n_g: usize,
    /// n_c, constraints kept.
    pub n_c: usize,
    /// n_gw, generators of the process noise.
    pub n_gw: usize,
}

impl Sizes {
    /// All sizes in proportion: n = n_w = n_y = n_c = n_gw = s, n_g = 3 s.
    pub fn all(s: usize) -> Self {
        Self {
            n: s,
            n_w: s,
            n_y: s,
            n_g: 3 * s,
            n_c: s,
            n_gw: s,
        }
    }
}

/// The four estimators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Zonotopes, mean value.
    Zmv,
    /// Zonotopes, first-order Taylor.
    Zfo,
    /// Constrained zonotopes, mean value about C2.
    Czmv,
    /// Constrained zonotopes, first-order Taylor about C3.
    Czfo,
}

impl Method {
    /// All four.
    pub const ALL: [Self; 4] = [Self::Zmv, Self::Zfo, Self::Czmv, Self::Czfo];

    fn name(self) -> &'static str {
        match self {
            Self::Zmv => "zmv",
            Self::Zfo => "zfo",
            Self::Czmv => "czmv",
            Self::Czfo => "czfo",
        }
    }

    /// The exponent of n in the printed total.
    fn printed_total(self) -> f64 {
        match self {
            Self::Zmv => 4.0,
            Self::Zfo | Self::Czmv => 5.0,
            Self::Czfo => 8.0,
        }
    }

    /// The scales s that are run with all sizes in proportion.
    fn scales(self) -> std::ops::RangeInclusive<usize> {
        match self {
            Self::Zmv => 2..=16,
            Self::Zfo | Self::Czmv => 2..=11,
            Self::Czfo => 2..=11,
        }
    }
}

/// The steps of Table 1.
const STEPS: [&str; 3] = ["prediction", "update", "reduction"];

/// One step that ran.
#[derive(Clone, Debug)]
pub struct Run {
    /// The counts of prediction, update and reduction.
    pub tallies: [Tally; 3],
    /// Generators and constraints that enter the reduction.
    pub entering: usize,
}

/// Runs one step on a random instance and counts it.
///
/// The calls are those of the estimators of these names; they are made one by one here so that the sizes are
/// free, which the systems of the case studies are not.
pub fn run(method: Method, s: &Sizes, index: u64) -> Run {
    let mut draw = Instance::new(index);
    // Table 1 counts m_g + n generators after the mean value: those of a noise that enters affinely.
    let f = match method {
        Method::Zmv | Method::Czmv => Dense::affine_in_noise(&mut draw, s.n, s.n_w),
        Method::Zfo | Method::Czfo => Dense::new(&mut draw, s.n, s.n_w),
    };
    let w = draw.zonotope(s.n_w, s.n_gw, 0.1);
    let c = draw.matrix(s.n_y, s.n, 1.0);
    match method {
        Method::Zmv | Method::Zfo => {
            let x = draw.zonotope(s.n, s.n_g, 0.1);
            let (image, prediction) = ops::tally(|| match method {
                Method::Zmv => zonotope_mean_value(&f, &x, &w).expect(VALID),
                _ => zonotope_first_order(&f, &x, &w).expect(VALID),
            });
            let y = c.mul_vec(image.c());
            let (cut, update) = ops::tally(|| {
                (0..s.n_y).fold(image, |set, i| {
                    strip::intersect(&set, c.row(i), y[i], 1e-3).expect(VALID)
                })
            });
            let (entering, reduction) = ops::tally(|| {
                let folded = cut.fold();
                yang_scott::reduce(&folded, s.n_g).expect(VALID);
                folded.generators()
            });
            Run {
                tallies: [prediction, update, reduction],
                entering,
            }
        }
        Method::Czmv | Method::Czfo => {
            let x = draw.constrained(s.n, s.n_g, s.n_c, 0.1);
            let w = ConstrainedZonotope::from(w);
            let (image, prediction) = ops::tally(|| {
                let mut lp = LinearProgram::new();
                let hull = x.interval_hull_with(&mut lp).expect(VALID);
                match method {
                    Method::Czmv => mean_value(&f, &x, &hull, &w, Choice::C2, &mut lp),
                    _ => first_order(
                        &f,
                        &x,
                        &hull,
                        &w,
                        Choice::C3,
                        Remainder::Symmetric,
                        Expansion::Full,
                        &mut lp,
                    ),
                }
                .expect(VALID)
            });
            // What a point of the image would give, so that the intersection is not empty.
            let seen = image.interval_hull().expect(VALID).mid();
            let noise = Zonotope::new(
                c.mul_vec(&seen),
                zonobench_sets::Matrix::diagonal(&vec![0.2; s.n_y]),
            )
            .expect(VALID);
            let (joined, update) = ops::tally(|| {
                image
                    .generalized_intersection(&c, &noise.into())
                    .expect(VALID)
            });
            let (entering, reduction) = ops::tally(|| {
                let folded = joined.fold();
                scott::reduce(&folded, s.n_g.max(s.n + s.n_c), s.n_c).expect(VALID);
                folded.generators() + folded.constraints()
            });
            Run {
                tallies: [prediction, update, reduction],
                entering,
            }
        }
    }
}

/// How programs and eliminations are counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {
    /// By [`modelled`].
    Model,
    /// By [`engine`].
    Engine,
}

impl Reading {
    fn of(self, tally: &Tally) -> f64 {
        match self {
            Self::Model => modelled(tally),
            Self::Engine => engine(tally),
        }
    }
}

/// The cost under the paper's model: programs and eliminations priced, the rest as counted.
pub fn modelled(tally: &Tally) -> f64 {
    let total = tally.total();
    let plain = tally.kernel(Kernel::Plain).arithmetic() as f64;
    plain + priced(tally) + 9.0 * total.decomposition_cubes as f64
}

/// The priced part of [`modelled`].
pub fn priced(tally: &Tally) -> f64 {
    let total = tally.total();
    (total.program_model + total.elimination_model) as f64
}

/// The engine's own operations.
pub fn engine(tally: &Tally) -> f64 {
    let total = tally.total();
    total.arithmetic() as f64 + 9.0 * total.decomposition_cubes as f64
}

/// The printed cells of Table 1, with n_u = n_cw = n_cv = 0 and n_v = n_gv = n_y.
pub fn table_1(method: Method, step: usize, s: &Sizes) -> f64 {
    let [n, n_w, n_y, n_g, n_c, n_gw] = [s.n, s.n_w, s.n_y, s.n_g, s.n_c, s.n_gw].map(|x| x as f64);
    let (m, m_g, m_c) = (n + n_w, n_g + n_gw, n_c);
    let (n_v, n_gv) = (n_y, n_y);
    let cube = |x: f64| x * x * x;
    let affine = n * n * n_g + n * n_w * n_gw;
    let taylor = n * (m * m * m_g + m * m_g * m_g);
    let strips = |g: f64| n_y * (cube(n) * g + n * n * g * g + n_v * n_gv);
    let (d_n, d_w, d_v) = (n - n_y, n_gw, n_gv);
    let wide = m_g * m_g - m_c * m_c;
    match (method, step) {
        (Method::Zmv, 0) => affine,
        (Method::Zmv, 1) => strips(m_g + n),
        (Method::Zmv, _) => n * n * (m_g + n) + n * (n_gw + n) * (m_g + n),
        (Method::Zfo, 0) => taylor,
        (Method::Zfo, 1) => strips(m_g * m_g + n),
        (Method::Zfo, _) => n * n * (m_g * m_g + n) + n * (m_g * m_g + n) * (m_g * m_g + n),
        (Method::Czmv, 0) => affine + (n * n_g + n_c) * cube(n_g + n_c) + n_w * n_gw * cube(n_gw),
        (Method::Czmv, 1) => n_y * n * (m_g + n) + n_y * n_v * n_gv,
        (Method::Czmv, _) => {
            n_y * cube(m_g + m_c + n_gv + n + n_y)
                + (n + n_c) * (n + n_c) * (n_g + d_n + d_w + d_v)
                + (n + n_c) * (d_n + d_w + d_v) * (n_g + d_n + d_w + d_v)
        }
        (Method::Czfo, 0) => taylor + (m * m_g + m_c) * cube(m_g + m_c),
        (Method::Czfo, 1) => n_y * n * (m_g * m_g + n) + n_y * n_v * n_gv,
        (Method::Czfo, _) => {
            (m_c * m_c + n_y) * cube(m_g * m_g + m_c * m_c + n_gv + n + n_y)
                + (n + n_c) * (n + n_c) * (wide + d_n + d_v)
                + (n + n_c) * (wide + d_n + d_v) * (wide + d_n + d_v)
        }
    }
}

/// The degree in s of a formula of Table 1 with all sizes in proportion: exact, from its values.
fn printed_degree(formula: impl Fn(&Sizes) -> f64) -> Degree {
    let points = (1..=14).map(|s| (s as i64, formula(&Sizes::all(s)), 1.0));
    Sweep::new("all", points.collect()).degree
}

/// The sweep of a step with all sizes in proportion, under one reading.
///
/// Under the model the priced programs and eliminations are a polynomial in s, known exactly; the degree is
/// theirs, exactly, unless the rest grows faster.
fn in_proportion(
    runs: &[(usize, Run)],
    steps: std::ops::Range<usize>,
    reading: Reading,
    formula: impl Fn(&Sizes) -> f64,
) -> Sweep {
    let points = |count: &dyn Fn(&Tally) -> f64| -> Vec<(i64, f64, f64)> {
        runs.iter()
            .map(|(s, run)| {
                let counted = run.tallies[steps.clone()].iter().map(count).sum();
                (*s as i64, counted, formula(&Sizes::all(*s)))
            })
            .collect()
    };
    let mut sweep = Sweep::new("all", points(&|t| reading.of(t)));
    sweep.claimed = printed_degree(&formula);
    if reading == Reading::Model {
        let model = Sweep::new("all", points(&priced));
        let rest = Sweep::new("all", points(&|t| modelled(t) - priced(t)));
        let model = if model.degree.is_exact() {
            model
        } else {
            Sweep {
                degree: bracketed(runs, steps.end).unwrap_or(model.degree),
                ..model
            }
        };
        if model.degree.is_exact() && rest.degree.value < model.degree.value + TOLERANCE {
            sweep.degree = model.degree;
        }
    }
    sweep
}

/// The degree of the priced eliminations where the sets' numbers decide how many columns go with each.
///
/// R eliminations that start from S rows and columns, each of which takes one row and at most one column
/// and the columns that vanish with it, cost at most R S³; where they cost at least R (S/2)³, the degree is that of R S³,
/// and R and S are polynomials, known exactly. None where one of this is not so, or the reduction is not among the
/// steps up to `end`.
fn bracketed(runs: &[(usize, Run)], end: usize) -> Option<Degree> {
    let reduction = |r: &Run| r.tallies[2].total();
    let exact = |f: &dyn Fn(&Run) -> f64| {
        let points = runs.iter().map(|(s, run)| (*s as i64, f(run), 1.0));
        let degree = Sweep::new("all", points.collect()).degree;
        degree.is_exact().then_some(degree.value)
    };
    let within = runs.iter().all(|(_, r)| {
        let (most, counts) = (r.entering as u128, reduction(r));
        let (n, cost) = (u128::from(counts.eliminations), counts.elimination_model);
        cost <= n * most.pow(3) && 8 * cost >= n * most.pow(3)
    });
    let eliminations = exact(&|r| reduction(r).eliminations as f64)?;
    let entering = exact(&|r| r.entering as f64)?;
    (end == 3 && within).then(|| Degree::exact((eliminations + 3.0 * entering) as usize))
}

/// One size at a time, the others at twice the proportion.
type Variation = (&'static str, &'static [usize], fn(&mut Sizes, usize));

const VARIATIONS: [Variation; 4] = [
    ("n", &[2, 4, 6, 8, 12, 16], |s, x| {
        s.n = x;
        s.n_g = 40;
    }),
    ("n_g", &[12, 24, 36, 48, 60], |s, x| s.n_g = x),
    ("n_c", &[2, 4, 6, 8, 10], |s, x| {
        s.n_c = x;
        s.n_g = 24;
    }),
    ("n_y", &[2, 4, 6, 8, 10], |s, x| s.n_y = x),
];

/// All rows of the paper.
pub fn rows() -> Vec<Row> {
    let mut out = Vec::new();
    let mut degrees = Vec::new();
    for method in Method::ALL {
        let name = method.name();
        let runs: Vec<(usize, Run)> = method
            .scales()
            .map(|s| (s, run(method, &Sizes::all(s), 0)))
            .collect();
        for (step, label) in STEPS.iter().enumerate() {
            let formula = |s: &Sizes| table_1(method, step, s);
            let under_model = in_proportion(&runs, step..step + 1, Reading::Model, formula);
            let own = in_proportion(&runs, step..step + 1, Reading::Engine, formula);
            degrees.push((method, step, under_model.degree.value));
            let (verdict, reason) = judge(std::slice::from_ref(&under_model));
            let reason = format!(
                "{reason}, programs and eliminations priced as the paper does; the engine's own operations grow, over the sizes run, with \
                 degree {:.2}",
                own.degree.value
            );
            out.extend(rows_of(
                &format!("cz-{name}-{label}"),
                &[under_model],
                verdict,
                reason,
            ));
            let (verdict, reason) = judge(std::slice::from_ref(&own));
            out.extend(rows_of(
                &format!("cz-{name}-{label}-engine"),
                &[own],
                verdict,
                reason,
            ));
        }
        out.extend(totals(method, &runs));
    }
    out.extend(beside_zonotopes(&degrees));
    out.extend(table_7::rows());
    out.extend(pivots());
    out.extend(sizes::of_constrained_zonotopes());
    out
}

/// Sec. 4.5: predictions of constrained zonotopes cost more than those of zonotopes, updates less, as degrees with all
/// sizes in proportion.
fn beside_zonotopes(degrees: &[(Method, usize, f64)]) -> Vec<Row> {
    let of = |method: Method, step: usize| {
        let found = degrees.iter().find(|(m, s, _)| *m == method && *s == step);
        found.map_or(f64::NAN, |(_, _, degree)| *degree)
    };
    let mut out = Vec::new();
    for (method, other) in [(Method::Czmv, Method::Zmv), (Method::Czfo, Method::Zfo)] {
        for (step, more) in [(0, true), (1, false)] {
            let (own, theirs) = (of(method, step), of(other, step));
            let holds = if more {
                own > theirs + TOLERANCE
            } else {
                own < theirs - TOLERANCE
            };
            let verdict = if holds {
                Verdict::Holds
            } else {
                Verdict::DoesNotHold
            };
            let reason = format!(
                "with all sizes in proportion the counted degree is {own:.2}, that of {} {theirs:.2}, programs and eliminations \
                 priced as the paper does",
                other.name().to_uppercase()
            );
            let name = format!(
                "cz-{}-{}-against-{}",
                method.name(),
                STEPS[step],
                other.name()
            );
            out.push(statement(&name, verdict, reason));
        }
    }
    out
}

/// The printed total against the printed steps and the counts, and one size at a time.
fn totals(method: Method, runs: &[(usize, Run)]) -> Vec<Row> {
    let name = method.name();
    let all = |s: &Sizes| (0..3).map(|step| table_1(method, step, s)).sum::<f64>();
    let under_model = in_proportion(runs, 0..3, Reading::Model, all);
    let own = in_proportion(runs, 0..3, Reading::Engine, all);
    let (printed, table) = (method.printed_total(), under_model.claimed.value);
    let verdict = if table == printed && under_model.degree.value <= printed + 0.1 {
        Verdict::Holds
    } else {
        Verdict::DoesNotHold
    };
    let reason = format!(
        "the text says n^{printed}; the rows of its Table 1 add up to n^{table} with all sizes in proportion; counted with the \
         paper's prices the degree is {:.2}, of the engine's own operations {:.2}",
        under_model.degree.value, own.degree.value
    );
    // A strip's candidates share one factor of G Gᵀ here; the table prices each of them by a product of its own.
    let reason = match table > printed && under_model.degree.value <= printed {
        true => format!(
            "{reason}: the code reaches what the text says because all candidates of a strip share one factor, but the table does \
             not price it so"
        ),
        false => reason,
    };
    let mut out = rows_of(&format!("cz-{name}-total"), &[under_model], verdict, reason);
    let sweeps = |reading: Reading| -> Vec<Sweep> {
        let relevant =
            |v: &&Variation| v.0 != "n_c" || matches!(method, Method::Czmv | Method::Czfo);
        VARIATIONS
            .iter()
            .filter(relevant)
            .map(|&(variable, values, set)| {
                let points = values.iter().map(|&x| {
                    let mut s = Sizes::all(2);
                    s.n_g = 24;
                    set(&mut s, x);
                    let counted = run(method, &s, 1)
                        .tallies
                        .iter()
                        .map(|t| reading.of(t))
                        .sum();
                    (x as i64, counted, all(&s))
                });
                Sweep::new(variable, points.collect())
            })
            .chain([in_proportion(runs, 0..3, reading, all)])
            .collect()
    };
    let own = sweeps(Reading::Engine);
    let (verdict, reason) = judge(&own);
    out.extend(rows_of(
        &format!("cz-{name}-total-engine"),
        &own,
        verdict,
        format!("the engine's own operations, one size at a time and all in proportion: {reason}"),
    ));
    out
}

/// The simplex: pivots a program in the hull of a constrained zonotope, the paper's model N_d N_c³ beside the work
/// done.
fn pivots() -> Vec<Row> {
    let points: Vec<(i64, f64, f64)> = (2..=14)
        .map(|s| {
            let sizes = Sizes::all(s);
            let x =
                Instance::new(3 << 40 | s as u64).constrained(sizes.n, sizes.n_g, sizes.n_c, 0.1);
            let (_, tally) = ops::tally(|| x.interval_hull().expect(VALID));
            let total = tally.total();
            (s as i64, total.pivots as f64, total.programs as f64)
        })
        .collect();
    let sweep = Sweep::new("all", points);
    let last = sweep.points.last().map_or(0.0, |p| p.1 / p.2);
    let first = sweep.points.first().map_or(0.0, |p| p.1 / p.2);
    let reason = format!(
        "pivots beside programs in the hull of n_g = 3 n, n_c = n: {first:.2} a program at n = 2, {last:.2} at n = 14, \
         each program after the first starting from the basis before it"
    );
    let mut rows = rows_of("cz-hull-pivots", &[sweep], Verdict::HoldsAsBound, reason);
    for row in &mut rows {
        row.verdict = Verdict::HoldsAsBound;
    }
    rows
}
