//! The metrics that a run is folded into: their names, keys and formulas.
//!
//! In the formulas K is the window of steps (`from` ≤ k ≤ `to`, or the steps `at`), |K| its length,
//! x_k the truth, c_k the estimate's center, [l_k, u_k] its interval hull and r_k = (u_k − l_k)/2. A run
//! that ends early (an inconsistent measurement) is folded over the steps it has.
//!
//! Another unit of a component changes what has its unit by that factor and nothing else, but for the metrics that compare
//! components or add them by their definition: `radius` and `r_box` (the largest half-width), the `width` of no component,
//! `rmse_norm` and `bound_ratio`.

use super::reader::{Field, Table};
use serde::{Deserialize, Serialize};
use zonobench_estimation::estimator::Phase;
use zonobench_lake::bad_input::{BadInput, listed, nearest};

/// What there is to know about a metric.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MetricInfo {
    /// Its name in a file.
    pub name: &'static str,
    /// The keys it must have, beside `name`.
    pub required: &'static [&'static str],
    /// The keys it may have, beside those that all may have ([`COMMON_KEYS`]).
    pub optional: &'static [&'static str],
    /// UCUM unit code; `state` where it is the component's own, `state-product` where it is the product
    /// of the components' units.
    pub unit: &'static str,
    /// True if there is a value for every component.
    pub per_component: bool,
    /// How it is computed.
    pub formula: &'static str,
}

/// Whether a metric compares with the true state.
pub fn needs_truth(name: &str) -> bool {
    match name {
        "rmse" | "rmse_wrapped" | "rmse_norm" | "overshoot" => true,
        "contains" | "outside" | "better" => true,
        "nees" | "coverage" | "crps" => true,
        name => matches!(name, "ellipsoid_contains" | "boundary"),
    }
}

/// Keys that every metric may have.
pub const COMMON_KEYS: &[&str] = &["name", "id", "from", "to", "at", "phase", "description"];

/// Every metric.
pub const METRICS: &[MetricInfo] = &[
    MetricInfo {
        name: "rmse",
        required: &[],
        optional: &["over"],
        unit: "state",
        per_component: true,
        formula: "sqrt(mean over K of (c_i - x_i)^2), for each component i",
    },
    MetricInfo {
        name: "rmse_wrapped",
        required: &[],
        optional: &["over"],
        unit: "state",
        per_component: true,
        formula: "as rmse, with the error of a component in rad taken in (-pi, pi]; the estimates themselves are not wrapped",
    },
    MetricInfo {
        name: "rmse_norm",
        required: &["components"],
        optional: &["over"],
        unit: "state",
        per_component: false,
        formula: "sqrt(mean over K of the sum over the components given of (c_i - x_i)^2)",
    },
    MetricInfo {
        name: "overshoot",
        required: &[],
        optional: &[],
        unit: "state",
        per_component: true,
        formula: "max over K of the error c_i - x_i beyond 0, seen from its sign at the first step of K; 0 if it keeps its sign; errors in rad in (-pi, pi]",
    },
    MetricInfo {
        name: "radius",
        required: &[],
        optional: &["over"],
        unit: "state",
        per_component: false,
        formula: "mean over K of max_i r_i: half the longest edge of the interval hull",
    },
    MetricInfo {
        name: "r_box",
        required: &[],
        optional: &["over"],
        unit: "state",
        per_component: false,
        formula: "mean over K of max_i r_i, of the confidence box where the belief has a Gaussian part",
    },
    MetricInfo {
        name: "width",
        required: &[],
        optional: &["over"],
        unit: "state",
        per_component: true,
        formula: "mean over K of u_i - l_i, for each component i, and of max_i (u_i - l_i) for no component",
    },
    MetricInfo {
        name: "bound_ratio",
        required: &["bound"],
        optional: &[],
        unit: "1",
        per_component: false,
        formula: "max over K of max_i (u_i - l_i) / bound, the bound on the width of box-state-est as printed or corrected",
    },
    MetricInfo {
        name: "volume",
        required: &[],
        optional: &["over"],
        unit: "state-product",
        per_component: false,
        formula: "mean over K of the volume of the set",
    },
    MetricInfo {
        name: "area",
        required: &[],
        optional: &["over"],
        unit: "state-product",
        per_component: false,
        formula: "mean over K of the area of the set, of two dimensions",
    },
    MetricInfo {
        name: "box_area",
        required: &["components"],
        optional: &["over"],
        unit: "state-product",
        per_component: false,
        formula: "mean over K of the product of u_i - l_i over the components given",
    },
    MetricInfo {
        name: "body_box_area",
        required: &[],
        optional: &["over"],
        unit: "m2",
        per_component: false,
        formula: "mean over K of the product of the widths of the position along the axes of the vehicle; of sets of poses",
    },
    MetricInfo {
        name: "projected_area",
        required: &[],
        optional: &["over"],
        unit: "m2",
        per_component: false,
        formula: "mean over K of the exact area of the first-order set of positions, whatever the axes; of sets of poses",
    },
    MetricInfo {
        name: "contains",
        required: &[],
        optional: &[],
        unit: "1",
        per_component: false,
        formula: "share of K with x_k certainly in the set; steps without a verdict do not count",
    },
    MetricInfo {
        name: "outside",
        required: &[],
        optional: &[],
        unit: "1",
        per_component: false,
        formula: "number of k in K with x_k certainly outside the set",
    },
    MetricInfo {
        name: "inconsistent",
        required: &[],
        optional: &[],
        unit: "1",
        per_component: false,
        formula: "1 if the run ended at a step of K because the measurement contradicted the model, else 0",
    },
    MetricInfo {
        name: "refused",
        required: &[],
        optional: &[],
        unit: "1",
        per_component: false,
        formula: "1 if the run ended at a step of K because the estimator refused to go on, else 0",
    },
    MetricInfo {
        name: "better",
        required: &["than"],
        optional: &["than_phase", "strict"],
        unit: "1",
        per_component: true,
        formula: "share of K with |c_i - x_i| <= that of the estimator `than` (< where strict), for each component i",
    },
    MetricInfo {
        name: "ellipsoid_contains",
        required: &["level"],
        optional: &[],
        unit: "1",
        per_component: false,
        formula: "share of K with (x - c)' P^-1 (x - c) <= chi2(level, n)",
    },
    MetricInfo {
        name: "ellipsoid_inside",
        required: &["level", "within"],
        optional: &["within_phase"],
        unit: "1",
        per_component: false,
        formula: "share of K where c_i -+ sqrt(chi2(level, n) P_ii) lies in [l_i, u_i] of the estimator `within`, for all i",
    },
    MetricInfo {
        name: "center_inside",
        required: &["within"],
        optional: &["within_phase"],
        unit: "1",
        per_component: false,
        formula: "share of K with c_k in the interval hull of the estimator `within`",
    },
    MetricInfo {
        name: "boundary",
        required: &["level"],
        optional: &[],
        unit: "1",
        per_component: true,
        formula: "share of K with min(x_i - l_i, u_i - x_i) <= level (u_i - l_i), for each component i",
    },
    MetricInfo {
        name: "nees",
        required: &[],
        optional: &[],
        unit: "1",
        per_component: false,
        formula: "mean over K of (x - c)' P^-1 (x - c), errors in rad taken in (-pi, pi]; beside it, called <id>_lo and <id>_hi, the 95 % bounds of its mean over the N runs that have one, chi2 quantiles of n N degrees of freedom over N: exact for one step, wide for the mean of several, whose errors are related",
    },
    MetricInfo {
        name: "nis",
        required: &[],
        optional: &[],
        unit: "1",
        per_component: false,
        formula: "mean over the measured steps of K of z' S^-1 z, the innovation z with its covariance S, after the update whatever the phase; beside it, called <id>_lo and <id>_hi, the 95 % bounds of its mean over the runs, chi2 quantiles of D degrees of freedom over the number of terms, D all components measured in K",
    },
    MetricInfo {
        name: "coverage",
        required: &[],
        optional: &["level"],
        unit: "1",
        per_component: true,
        formula: "share of K with l_i <= x_i <= u_i, for each component i, and for all at once for no component; with level, of the intervals c_i -+ sqrt(chi2(level, 1) P_ii) and of the ellipsoid (x - c)' P^-1 (x - c) <= chi2(level, n) instead",
    },
    MetricInfo {
        name: "crps",
        required: &[],
        optional: &[],
        unit: "state",
        per_component: true,
        formula: "mean over K of s (z (2 F(z) - 1) + 2 f(z) - 1/sqrt(pi)) with z = (x_i - c_i)/s, s = sqrt(P_ii), f and F the standard normal density and its integral, for each component i: the continuous ranked probability score of N(c_i, P_ii)",
    },
];

/// Which of the two printed width bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Bound {
    /// As the paper prints it.
    Printed,
    /// With absolute values, valid for every system.
    Corrected,
}

/// A metric as an experiment asks for it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MetricSpec {
    /// One of [`METRICS`].
    pub name: &'static str,
    /// What it is called in the lake; the name where the file gives none.
    pub id: String,
    /// The first step of K.
    pub from: usize,
    /// The last step of K; the experiment's last where not given.
    pub to: Option<usize>,
    /// The steps of K one by one, instead of `from` and `to`; empty where not given.
    pub at: Vec<usize>,
    /// The belief that is measured; the one the paper reports where not given.
    pub phase: Option<Phase>,
    /// Divide each step's value by that of this estimator, then take the mean.
    pub over: Option<String>,
    /// The estimator to compare with.
    pub than: Option<String>,
    /// Its belief; the one its paper reports where not given.
    pub than_phase: Option<Phase>,
    /// The estimator whose set should hold this one's.
    pub within: Option<String>,
    /// Its belief; the one its paper reports where not given.
    pub within_phase: Option<Phase>,
    /// A probability (ellipsoids) or a share of the width (boundary).
    pub level: Option<f64>,
    /// < instead of ≤.
    pub strict: bool,
    /// Which bound.
    pub bound: Option<Bound>,
    /// The components that are taken together, as positions in the state; empty where not given.
    pub components: Vec<usize>,
}

impl MetricSpec {
    /// What there is to know about it.
    pub fn info(&self) -> &'static MetricInfo {
        METRICS
            .iter()
            .find(|info| info.name == self.name)
            .expect("the name was checked when it was read")
    }

    /// True if step `k` is in the window K.
    pub fn covers(&self, k: usize) -> bool {
        if self.at.is_empty() {
            self.from <= k && self.to.is_none_or(|to| k <= to)
        } else {
            self.at.contains(&k)
        }
    }

    /// Reads a metric; `estimators` are the ids there are, `states` the names of the state's components,
    /// `steps` is the last step.
    pub fn read(
        field: &Field,
        estimators: &[&str],
        states: &[&str],
        steps: usize,
    ) -> Result<Self, BadInput> {
        let table = field.any_table()?;
        let names: Vec<&'static str> = METRICS.iter().map(|info| info.name).collect();
        let name = table.need(
            "name",
            &format!("the name of a metric ({})", listed(names.iter().copied())),
        )?;
        let name = name.one_of(&names)?;
        let info = METRICS
            .iter()
            .find(|info| info.name == name)
            .expect("the name is one of them");
        let keys: Vec<&str> = [COMMON_KEYS, info.required, info.optional].concat();
        table.only(&keys)?;
        for key in info.required {
            table.need(key, &format!("a value, which {name} needs"))?;
        }
        let id = match table.get("id") {
            Some(id) => super::identifier(&id)?,
            None => name.to_owned(),
        };
        let step = |key: &str| -> Result<Option<usize>, BadInput> {
            let Some(field) = table.get(key) else {
                return Ok(None);
            };
            let k = field.step()?;
            if k > steps {
                return Err(field.expected(format!("a step of at most {steps}, the last one")));
            }
            Ok(Some(k))
        };
        let (from, to) = (step("from")?, step("to")?);
        let at = match table.get("at") {
            None => Vec::new(),
            Some(field) => {
                let at: Vec<usize> = super::steps(&field, steps)?;
                if at.is_empty() || from.is_some() || to.is_some() {
                    return Err(field
                        .fault("expected some steps, without from and to, got both or no step"));
                }
                at
            }
        };
        if let (Some(from), Some(to)) = (from, to)
            && from > to
        {
            return Err(table.fault(
                "to",
                format!("expected a step of at least from = {from}, got {to}"),
            ));
        }
        let other = |key: &str| -> Result<Option<String>, BadInput> {
            let Some(field) = table.get(key) else {
                return Ok(None);
            };
            let id = field.string()?;
            if estimators.contains(&id) {
                return Ok(Some(id.to_owned()));
            }
            let fault = field.expected(format!(
                "the id of an estimator ({})",
                listed(estimators.iter().copied())
            ));
            Err(match nearest(id, estimators.iter().copied()) {
                Some(near) => fault.with_help(format!("did you mean {near:?}?")),
                None => fault,
            })
        };
        let level = match table.get("level") {
            None => None,
            Some(field) => match field.number()? {
                level if level > 0.0 && level < 1.0 => Some(level),
                _ => return Err(field.expected("a number in (0, 1)")),
            },
        };
        let bound = match table.get("bound") {
            None => None,
            Some(field) => Some(match field.one_of(&["printed", "corrected"])? {
                "printed" => Bound::Printed,
                _ => Bound::Corrected,
            }),
        };
        let components = match table.get("components") {
            None => Vec::new(),
            Some(field) => components(&field, states)?,
        };
        if let Some(text) = table.get("description") {
            text.string()?;
        }
        Ok(Self {
            name,
            id,
            from: from.unwrap_or(0),
            to,
            at,
            phase: phase(&table, "phase")?,
            over: other("over")?,
            than: other("than")?,
            than_phase: phase(&table, "than_phase")?,
            within: other("within")?,
            within_phase: phase(&table, "within_phase")?,
            level,
            strict: table
                .get("strict")
                .map(|field| field.boolean())
                .transpose()?
                .unwrap_or(false),
            bound,
            components,
        })
    }
}

/// The positions in the state of different components given by name; at least one.
fn components(field: &Field, states: &[&str]) -> Result<Vec<usize>, BadInput> {
    let expected = format!(
        "an array of state components ({})",
        listed(states.iter().copied())
    );
    let mut found = Vec::new();
    for item in field.array(&expected)? {
        let name = item.one_of(states)?;
        let at = states.iter().position(|state| *state == name);
        let at = at.expect("the name is one of them");
        if found.contains(&at) {
            return Err(item.fault(format!("expected different components, got {name} again")));
        }
        found.push(at);
    }
    if found.is_empty() {
        return Err(field.expected(expected));
    }
    Ok(found)
}

fn phase(table: &Table, key: &str) -> Result<Option<Phase>, BadInput> {
    let Some(field) = table.get(key) else {
        return Ok(None);
    };
    Ok(Some(match field.one_of(&["predicted", "updated"])? {
        "predicted" => Phase::Predicted,
        _ => Phase::Updated,
    }))
}
