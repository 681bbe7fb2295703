//! Every row type of every table of the lake, on one page.
//!
//! Units are UCUM codes; `state` means "the unit of the named component" (table `variables`). Path keys
//! (`paper`, `experiment`) are not columns: every reader gets them from the file's path.

use crate::table::{Name, table};

table! {
    /// A component of a system's state, input, noise or measurement, with its unit.
    Variable => "variables" sorted by 0 {
        role: Name, "1", "x state, u input, w process noise, y measurement, v measurement noise";
        position: i32, "1", "position in its vector, from 0";
        component: Name, "1", "name of the component";
        unit: Name, "1", "UCUM code of the component's unit";
    }
}

table! {
    /// The simulated true state. No estimator can read this table.
    Truth => "truth" sorted by 2 {
        run: i32, "1", "run, from 0";
        k: i32, "1", "step, from 0";
        component: Name, "1", "state component";
        value: f64, "state", "true value";
        rounding: Option<f64>, "state", "half width of the interval about value that encloses the exact trajectory of the drawn noise; null if unbounded";
    }
}

table! {
    /// What was measured.
    Measurement => "measurements" sorted by 2 {
        run: i32, "1", "run, from 0";
        k: i32, "1", "step, from 0";
        component: Name, "1", "measured component";
        value: Option<f64>, "state", "measured value; null if not measured at this step";
    }
}

table! {
    /// The known inputs.
    Input => "inputs" sorted by 2 {
        run: i32, "1", "run, from 0";
        k: i32, "1", "step, from 0";
        component: Name, "1", "input component";
        value: f64, "state", "value held from step k to k + 1";
    }
}

table! {
    /// The estimators of an experiment.
    EstimatorInfo => "estimators" sorted by 0 {
        estimator: Name, "1", "name in the experiment file";
        kind: Name, "1", "kind of estimator";
        guaranteed: bool, "1", "true if its sets are proved to contain the truth: a guaranteed kind, and data that keep to what it assumes";
        reads: Name, "1", "which measurements the reported estimate of step k has used";
        reported_phase: Name, "1", "the phase that the paper reports: predicted or updated";
        settings: Name, "1", "settings as JSON";
    }
}

table! {
    /// An estimate of one component at one step.
    Estimate => "estimates" sorted by 1 {
        estimator: Name, "1", "name in the experiment file";
        run: i32, "1", "run, from 0";
        k: i32, "1", "step, from 0";
        phase: Name, "1", "predicted (before y_k) or updated (after y_k); an estimator that only keeps y_k for its next prediction has no updated rows";
        component: Name, "1", "state component";
        center: Option<f64>, "state", "point estimate; null in the last row of a run that ended early";
        lower: Option<f64>, "state", "lower bound of the set's interval hull; null without a set";
        upper: Option<f64>, "state", "upper bound of the set's interval hull; null without a set";
        status: Name, "1", "ok, unbounded (a bound is infinite), or beside an estimate singular (the measurement was not taken in, and the run goes on) or refuted (a program of the user's own claims a guarantee, and its set does not hold the truth); in the last row of a run that ended early inconsistent (measurement contradicts the model), refused (the estimator does not go on), singular (a matrix has no inverse), overflow (a number is not finite), timeout (a program of the user's own did not answer) or failed";
    }
}

table! {
    /// What is known after a step, beyond the estimate: sizes, covariance, and the judge's verdict.
    Belief => "beliefs" sorted by 1 {
        estimator: Name, "1", "name in the experiment file";
        run: i32, "1", "run, from 0";
        k: i32, "1", "step, from 0";
        phase: Name, "1", "predicted or updated";
        n_generators: Option<i64>, "1", "generators of the set";
        n_constraints: Option<i64>, "1", "constraints of the set";
        trace_ggt: Option<f64>, "1", "trace of G Gᵀ (squared F-radius)";
        radius: Option<f64>, "1", "half the longest edge of the interval hull";
        volume: Option<f64>, "1", "volume of the set; null above 3 dimensions or where not asked";
        covariance: Option<Vec<f64>>, "1", "covariance, n × n by rows; null without one";
        contains_truth: Option<bool>, "1", "true if the truth is in the set, false if certainly outside, null if unknown";
        lp_count: i64, "1", "linear programs solved for this belief";
        pivots: i64, "1", "simplex pivots of those programs";
        unfinished: i64, "1", "those programs in which the simplex gave up before its optimum; their bounds hold all the same";
        fallbacks: i64, "1", "those programs that were given to the interior-point solver besides; its bits may depend on the processor";
    }
}

table! {
    /// A number that one kind of belief has beyond its size, of the phase that the paper reports and of the updated one.
    /// Between the stages only: metrics read it, the lake does not hold it.
    Extra => "extras" sorted by 1 {
        estimator: Name, "1", "name in the experiment file";
        run: i32, "1", "run, from 0";
        k: i32, "1", "step, from 0";
        phase: Name, "1", "predicted or updated";
        name: Name, "1", "name of the number";
        value: f64, "1", "its value";
    }
}

table! {
    /// A set, at the steps that the experiment asks for (run 0).
    Set => "sets" sorted by 1 {
        estimator: Name, "1", "name in the experiment file";
        run: i32, "1", "run, from 0";
        k: i32, "1", "step, from 0";
        phase: Name, "1", "predicted or updated";
        kind: Name, "1", "box, zonotope, ellipsoid, zonotopic-gaussian, ...";
        center: Option<Vec<f64>>, "state", "center";
        generators: Option<Vec<f64>>, "state", "generators G, n × p by rows";
        a: Option<Vec<f64>>, "1", "constraint matrix A, q × p by rows";
        b: Option<Vec<f64>>, "1", "right side b of the constraints";
        vertices: Option<Vec<f64>>, "state", "vertices in two dimensions, x1, x2, x1, x2, ...";
    }
}

table! {
    /// A metric of one run.
    Metric => "metrics" sorted by 1 {
        estimator: Name, "1", "name in the experiment file";
        run: i32, "1", "run, from 0";
        metric: Name, "1", "name of the metric in the experiment file";
        component: Option<Name>, "1", "state component; null if the metric has none";
        over: Option<Name>, "1", "the estimator compared with; null if none";
        value: Option<f64>, "state", "value; null if not applicable in this run";
    }
}

table! {
    /// A metric over the runs: mean, spread and 95 % confidence interval of the mean.
    Score => "scores" sorted by 1 {
        estimator: Name, "1", "name in the experiment file";
        metric: Name, "1", "name of the metric in the experiment file";
        component: Option<Name>, "1", "state component; null if the metric has none";
        over: Option<Name>, "1", "the estimator compared with; null if none";
        n_runs: i64, "1", "runs with a value";
        mean: Option<f64>, "state", "mean over the runs";
        sd: Option<f64>, "state", "standard deviation over the runs (n - 1)";
        ci_lo: Option<f64>, "state", "lower end of the 95 % confidence interval of the mean";
        ci_hi: Option<f64>, "state", "upper end of the 95 % confidence interval of the mean";
    }
}

table! {
    /// A number (or claim) that a paper prints.
    Published => "published" sorted by 0 {
        table: Name, "1", "table, figure or section of the paper";
        row: Name, "1", "row label as printed";
        column: Name, "1", "column label as printed";
        printed: Name, "1", "the text as printed, with its digits";
        value: Option<f64>, "1", "the printed number; null for claims in words and lost cells";
        unit: Name, "1", "UCUM code";
        kind: Name, "1", "exact, rounded, monte_carlo, timing, claim, lost or figure";
        runs: Option<i64>, "1", "runs that the paper's number is a mean of";
    }
}

table! {
    /// A published cell beside what was reproduced, with a verdict and its reason.
    Comparison => "comparison" sorted by 0 {
        table: Name, "1", "table, figure or section of the paper";
        row: Name, "1", "row label as printed";
        column: Name, "1", "column label as printed";
        reading: Name, "1", "as-written, or the name of another reading of the paper";
        published: Name, "1", "the text as printed";
        reproduced: Option<f64>, "1", "our number";
        interval_lo: Option<f64>, "1", "lower end of the prediction interval for the printed number";
        interval_hi: Option<f64>, "1", "upper end of the prediction interval for the printed number";
        rel_diff: Option<f64>, "1", "(reproduced - published) / published";
        verdict: Name, "1", "exact, within_rounding, within_ci, within_tolerance, holds, holds_as_bound, does_not_hold, differs, not_reproducible, lost_in_source or error";
        reason: Name, "1", "why, with measured numbers";
    }
}

table! {
    /// A numbered claim of a paper (theorem, proposition, lemma, corollary, remark) put to the test in exact arithmetic.
    Claim => "claims" sorted by 0 {
        claim: Name, "1", "name of the claim within the paper";
        statement: Name, "1", "what the paper says, shortened";
        verdict: Name, "1", "holds, holds_as_bound (an equality of which the inequality remains), does_not_hold or not_tested: computed from the trials";
        trials: i64, "1", "trials of the claim as printed";
        lost: i64, "1", "trials in which it failed";
        counterexample: Name, "1", "the smallest counterexample known, evaluated exactly; empty if none";
        consequence: Name, "1", "what follows for a method that uses it, and the trials of the repaired claim";
    }
}

table! {
    /// A claim about cost held against counts: first its verdict, then the sizes that it was tried at.
    Complexity => "complexity" sorted by 0 {
        claim: Name, "1", "name of the claim";
        sweep_variable: Option<Name>, "1", "the size that varies; all where every size does; null in the row that has the claim's verdict";
        size: Option<i64>, "1", "its value";
        counted: Option<f64>, "1", "operations counted, or carried by a formula that equals the count at every size that ran";
        formula: Option<f64>, "1", "what the printed formula gives";
        ratio: Option<f64>, "1", "counted / formula";
        fitted_degree: Option<f64>, "1", "the power of the size that the count grows with over the sweep";
        degree_lo: Option<f64>, "1", "lower end of its 95 % interval; equal to the degree where that is exact";
        degree_hi: Option<f64>, "1", "upper end of its 95 % interval";
        verdict: Name, "1", "holds, holds_as_bound or does_not_hold: of the claim, and of each sweep alone";
        reason: Name, "1", "why, with measured numbers";
    }
}

table! {
    /// An attack on what is called guaranteed, and on what is not.
    Attack => "attack" sorted by 0 {
        estimator: Name, "1", "estimator, or operation on sets";
        attack: Name, "1", "how noise and first state, or the sets, are chosen";
        steps: i64, "1", "sets that were judged";
        lost: i64, "1", "sets that certainly do not hold the truth, or were called empty";
        empty: i64, "1", "of the lost, those that were called empty";
        rate_hi: f64, "1", "upper Clopper-Pearson bound on the rate of lost sets at 95 %, the sets taken for independent";
        undecided: i64, "1", "sets of which it is not certain whether they hold the truth; of the intersections, empty sets not called so";
        refused: i64, "1", "runs that ended early without a set: refused, or the set reached where the model is not defined";
        guaranteed: bool, "1", "whether none may be lost";
    }
}

table! {
    /// How long steps took. Never hashed, never in a snapshot.
    Timing => "timings" sorted by 1 {
        estimator: Name, "1", "name in the experiment file";
        run: i32, "1", "run, from 0";
        steps: i64, "1", "steps timed";
        total_ns: i64, "ns", "time in the estimator over the run";
        median_ns: i64, "ns", "median time of a step";
        p999_ns: i64, "ns", "time that 99.9 % of the steps do not exceed";
        late: Option<i64>, "1", "steps that took longer than the system's sampling period; null if it has none";
        max_ns: i64, "ns", "longest step";
    }
}

table! {
    /// A printed time beside ours. Never hashed, never in a snapshot; at best the ordering holds.
    TimingComparison => "timing_comparison" sorted by 0 {
        table: Name, "1", "table, figure or section of the paper";
        row: Name, "1", "row label as printed";
        column: Name, "1", "column label as printed";
        published: Name, "1", "the text as printed";
        reproduced_ms: Option<f64>, "ms", "our time of a step, the mean over all runs; a ratio where the paper prints one";
        verdict: Name, "1", "ordering_holds, differs or error";
        reason: Name, "1", "why";
    }
}
