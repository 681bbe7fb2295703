//! The parts of an experiment, read from its tables: system, uncertain vectors, truth, inputs.

use super::reader::{Field, Table, deserialize};
use crate::command::{self, CommandSettings, HashedFile};
use crate::recorded::{self, Recording};
use std::path::Path;
use zonobench_estimation::controller::Controller;
use zonobench_estimation::error::shortest;
use zonobench_estimation::signal::{SIGNAL_KEYS, Signal};
use zonobench_estimation::simulate::{DeltaLaw, Drawn, InitialState, Law, Noise, SimulationError};
use zonobench_estimation::system::{System, Variable};
use zonobench_estimation::systems::{
    Form, Linear, Lpv, Measured, Quadrotor, QuotientForm, Raimondo, Unicycle, VanDerPol, VehicleSe2,
};
use zonobench_estimation::{AnySystem, EstimationError, Inputs, Problem, Truth, Uncertain};
use zonobench_lake::bad_input::{BadInput, listed};
use zonobench_lake::store::hash_file;

/// The keys of every kind of system, beside `kind`.
const SYSTEM_KEYS: &[(&str, &[&str])] = &[
    ("linear", &["a", "b", "c", "d"]),
    ("lpv", &["a0", "a", "b", "c"]),
    ("van-der-pol", &["ts"]),
    ("raimondo", &["form", "output"]),
    ("vehicle-se2", &["dt", "form"]),
    ("quadrotor", &["m", "l", "ixx", "iyy", "izz", "g", "dt"]),
    ("unicycle", &["t0", "phi_omega", "phi_theta", "landmarks"]),
    ("equations", super::equations::KEYS),
];

const SET_KEYS: &[&str] = &["box", "center", "generators", "constraints"];
const GAUSSIAN_KEYS: &[&str] = &["mean", "covariance"];

/// `[system]`.
pub fn system(field: &Field) -> Result<AnySystem, BadInput> {
    let table = field.any_table()?;
    let kinds: Vec<&'static str> = SYSTEM_KEYS.iter().map(|(kind, _)| *kind).collect();
    let kind = table.need(
        "kind",
        &format!("a kind of system ({})", listed(kinds.iter().copied())),
    )?;
    let kind = kind.one_of(&kinds)?;
    let (_, keys) = SYSTEM_KEYS
        .iter()
        .find(|(name, _)| *name == kind)
        .expect("the kind is one of them");
    table.only(&[&["kind"], *keys].concat())?;
    let matrix = |key: &str, rows: Option<usize>, columns: Option<usize>| {
        table
            .get(key)
            .map(|field| field.matrix(rows, columns))
            .transpose()
    };
    if kind == "equations" {
        return super::equations::system(&table);
    }
    let rows = "the rows of a matrix";
    let made = match kind {
        "linear" => {
            let a = table.need("a", rows)?.matrix(None, None)?;
            let n = a.rows();
            square(&table, "a", &a)?;
            let c = table.need("c", rows)?.matrix(None, Some(n))?;
            let b = matrix("b", Some(n), None)?;
            let d = matrix("d", Some(c.rows()), b.as_ref().map(|b| b.cols()))?;
            Linear::new(a, b, c, d).map(AnySystem::Linear)
        }
        "lpv" => {
            let a0 = table.need("a0", rows)?.matrix(None, None)?;
            let n = a0.rows();
            square(&table, "a0", &a0)?;
            let list = table.need("a", "the list of the matrices A_1, A_2, ...")?;
            let list = list.array("the list of the matrices A_1, A_2, ...")?;
            let a = list
                .iter()
                .map(|item| item.matrix(Some(n), Some(n)))
                .collect::<Result<_, _>>()?;
            let c = table.need("c", rows)?.matrix(None, Some(n))?;
            Lpv::new(a0, a, matrix("b", Some(n), None)?, c).map(AnySystem::Lpv)
        }
        "raimondo" => {
            let form = match table.get("form") {
                Some(form) => match form.one_of(&["tight", "printed", "expanded"])? {
                    "tight" => QuotientForm::Tight,
                    "expanded" => QuotientForm::Expanded,
                    _ => QuotientForm::Printed,
                },
                None => QuotientForm::default(),
            };
            let output = match table.get("output") {
                Some(output) => match output.one_of(&["both", "none"])? {
                    "both" => Measured::Both,
                    _ => Measured::None,
                },
                None => Measured::default(),
            };
            Ok(AnySystem::Raimondo(Raimondo { form, output }))
        }
        "vehicle-se2" => {
            let form = match table.get("form") {
                None => Form::default(),
                Some(field) => match field.one_of(&["euler", "group"])? {
                    "group" => Form::Group,
                    _ => Form::Euler,
                },
            };
            let dt = table.need("dt", "the sampling period in s")?.number()?;
            VehicleSe2::new(dt, form).map(AnySystem::VehicleSe2)
        }
        "quadrotor" => {
            let number = |key: &str, what: &str| table.need(key, what)?.number();
            let inertia = [
                number("ixx", "the moment of inertia about the body's x in kg m²")?,
                number("iyy", "the moment of inertia about the body's y in kg m²")?,
                number("izz", "the moment of inertia about the body's z in kg m²")?,
            ];
            Quadrotor::new(
                number("m", "the mass in kg")?,
                number("l", "the length of an arm in m")?,
                inertia,
                number("g", "the gravity in m/s²")?,
                number("dt", "the sampling period in s")?,
            )
            .map(AnySystem::Quadrotor)
        }
        "unicycle" => {
            let number = |key: &str, what: &str| table.need(key, what)?.number();
            let t0 = number("t0", "the sampling period in s")?;
            let speed = number("phi_omega", "the speed")?;
            let turn = number("phi_theta", "the turn rate")?;
            let landmarks = table
                .need("landmarks", "the positions [x, y] of the landmarks")?
                .matrix(None, Some(2))?;
            let landmarks = (0..landmarks.rows()).map(|i| [landmarks[(i, 0)], landmarks[(i, 1)]]);
            Unicycle::new(t0, speed, turn, landmarks.collect()).map(AnySystem::Unicycle)
        }
        _ => VanDerPol::new(table.need("ts", "the sampling period in s")?.number()?)
            .map(AnySystem::VanDerPol),
    };
    made.map_err(|error| match error {
        EstimationError::Setting {
            key, expected, got, ..
        } => table.fault(key, format!("expected {expected}, got {got}")),
        other => field.fault(other),
    })
}

fn square(table: &Table, key: &str, a: &zonobench_sets::Matrix) -> Result<(), BadInput> {
    if a.rows() == a.cols() {
        return Ok(());
    }
    Err(table.fault(
        key,
        format!("expected a square matrix, got {} x {}", a.rows(), a.cols()),
    ))
}

/// An uncertain vector of `n` components: `[prior]`, `noise.w`, `noise.v`.
pub fn uncertain(field: &Field, n: usize) -> Result<Uncertain, BadInput> {
    let table = field.table(&[SET_KEYS, GAUSSIAN_KEYS].concat())?;
    let set = set_part(&table, n)?.unwrap_or_else(|| Uncertain::point(vec![0.0; n]));
    let whole = with_gaussian_part(&table, set, n)?;
    check_uncertain(&table, &whole, n)?;
    Ok(whole)
}

fn check_uncertain(table: &Table, of: &Uncertain, n: usize) -> Result<(), BadInput> {
    of.validate(n).map_err(|fault| {
        table.fault(
            fault.key,
            format!("expected {}, got {}", fault.expected, fault.got),
        )
    })
}

/// The set that the table gives; None where it gives none.
fn set_part(table: &Table, n: usize) -> Result<Option<Uncertain>, BadInput> {
    if let Some(field) = table.get("box") {
        if let Some(other) = SET_KEYS[1..].iter().find(|key| table.get(key).is_some()) {
            return Err(table.fault(
                other,
                "expected either box, or center and generators, got both",
            ));
        }
        let expected = format!("{n} pairs [lower, upper]");
        let pairs = field.array(&expected)?;
        if pairs.len() != n {
            return Err(field.expected(expected));
        }
        let (mut lower, mut upper) = (Vec::new(), Vec::new());
        for pair in &pairs {
            let bounds = pair.vector(Some(2))?;
            if bounds[0] > bounds[1] {
                return Err(pair.fault(format!(
                    "expected lower <= upper, got [{}, {}]",
                    shortest(bounds[0]),
                    shortest(bounds[1])
                )));
            }
            lower.push(bounds[0]);
            upper.push(bounds[1]);
        }
        return Uncertain::from_box(&lower, &upper)
            .map(Some)
            .map_err(|fault| field.fault(fault));
    }
    let center = table
        .get("center")
        .map(|field| field.vector(Some(n)))
        .transpose()?;
    let generators = table
        .get("generators")
        .map(|field| field.matrix(Some(n), None))
        .transpose()?;
    let constraints = match table.get("constraints") {
        None => None,
        Some(field) => {
            let Some(g) = &generators else {
                return Err(field.fault("expected generators beside constraints, got none"));
            };
            let inner = field.table(&["a", "b"])?;
            let b = inner.need("b", "an array of numbers")?.vector(None)?;
            let a = inner
                .need("a", "rows of numbers")?
                .matrix(Some(b.len()), Some(g.cols()))?;
            Some((a, b))
        }
    };
    if center.is_none() && generators.is_none() {
        return Ok(None);
    }
    let center = center.unwrap_or_else(|| vec![0.0; n]);
    Ok(Some(Uncertain {
        generators,
        constraints,
        ..Uncertain::point(center)
    }))
}

/// `set` with the mean and the covariance that the table gives.
fn with_gaussian_part(table: &Table, mut set: Uncertain, n: usize) -> Result<Uncertain, BadInput> {
    if let Some(field) = table.get("mean") {
        set.mean = Some(field.vector(Some(n))?);
    }
    if let Some(field) = table.get("covariance") {
        set.covariance = Some(field.matrix(Some(n), Some(n))?);
    }
    Ok(set)
}

/// `[truth]`; what it leaves out is taken from what the estimators assume.
pub fn truth(
    section: Option<&Field>,
    root: &Table,
    problem: &Problem,
    steps: usize,
    folder: Option<&Path>,
) -> Result<Truth, BadInput> {
    let variables = problem.system.variables();
    let n_delta = problem.system.n_delta();
    let names_w = &variables.w[..variables.w.len() - n_delta];
    let table = section
        .map(|field| field.table(&["x0", "w", "v", "delta"]))
        .transpose()?;
    let get = |key: &str| table.as_ref().and_then(|table| table.get(key));
    let at = |error: SimulationError| point_at(root, &error);

    let x0 = match get("x0") {
        None => Truth::assumed_x0(problem).map_err(at)?,
        Some(field) if field.is_string() => {
            field.one_of(&["prior"])?;
            InitialState::Drawn(problem.prior.clone())
        }
        Some(field) if field.is_array() => {
            InitialState::Point(field.vector(Some(variables.x.len()))?)
        }
        Some(field) => {
            return Err(field.expected(format!("{} numbers or \"prior\"", variables.x.len())));
        }
    };
    let w = match get("w") {
        None => Truth::assumed_noise("truth.w", &problem.w).map_err(at)?,
        Some(field) => noise(&field, &problem.w, names_w, "w", steps, folder)?,
    };
    let v = match get("v") {
        None => Truth::assumed_noise("truth.v", &problem.v).map_err(at)?,
        Some(field) => noise(&field, &problem.v, &variables.v, "v", steps + 1, folder)?,
    };
    let delta = match get("delta") {
        None => Truth::assumed_delta(&problem.system),
        Some(field) => Some(delta(&field, n_delta)?),
    };
    let truth = Truth { x0, w, v, delta };
    truth.validate(&problem.system, steps).map_err(at)?;
    Ok(truth)
}

/// The fault of a simulation, at the place that its dotted path leads to.
pub fn point_at(root: &Table, error: &SimulationError) -> BadInput {
    let (path, fault) = match error {
        SimulationError::Part {
            part,
            expected,
            got,
        } => (*part, format!("expected {expected}, got {got}")),
        SimulationError::Signal {
            part,
            component,
            source,
        } => (*part, format!("component {component}: {source}")),
        SimulationError::Uncertain { part, source } => (*part, source.to_string()),
        SimulationError::Truncation { part, .. } => (*part, error.to_string()),
        SimulationError::Diverged { .. } => ("truth", error.to_string()),
    };
    at_path(root, path, &fault)
}

/// "`path`: `fault`" at the last value on the way of `path` that is in the file.
pub fn at_path(root: &Table, path: &str, fault: &str) -> BadInput {
    let mut node = root.node();
    for step in path.split('.') {
        match node.get(step) {
            Some(entry) => node = &entry.node,
            None => break,
        }
    }
    root.fault_at(&node.span, format!("{path}: {fault}"))
}

/// `truth.w` or `truth.v`, of which the estimators assume `assumed`.
fn noise(
    field: &Field,
    assumed: &Uncertain,
    variables: &[Variable],
    prefix: &str,
    vectors: usize,
    folder: Option<&Path>,
) -> Result<Noise, BadInput> {
    let n = variables.len();
    let sources = ["law", "signals", "alternatives", "file"];
    let table = field.any_table()?;
    let given: Vec<&str> = sources
        .iter()
        .copied()
        .filter(|key| table.get(key).is_some())
        .collect();
    let drawn_keys = [&["law", "truncate"][..], SET_KEYS, GAUSSIAN_KEYS].concat();
    match given[..] {
        ["law"] => table.only(&drawn_keys)?,
        [one] => table.only(&[one])?,
        [] => {
            table.only(&[&sources[1..], &drawn_keys[..]].concat())?;
            return Err(field.fault("expected one of law, signals, alternatives, file, got none"));
        }
        [_, second, ..] => {
            return Err(table.fault(
                second,
                format!("expected one of {}, got several", listed(sources)),
            ));
        }
    }
    // Where no set is assumed there is none to stay inside of.
    let about = assumed.has_set().then(|| assumed.center.clone());
    if let Some(list) = table.get("signals") {
        return Ok(Noise::Signals {
            terms: components(&list, n, terms)?,
            about,
        });
    }
    if let Some(list) = table.get("alternatives") {
        let alternatives = components(&list, n, |item| {
            let options = item.array("an array of alternative signals")?;
            if options.is_empty() {
                return Err(item.fault("expected at least one alternative, got none"));
            }
            options.iter().map(terms).collect()
        })?;
        return Ok(Noise::Alternatives {
            alternatives,
            about,
        });
    }
    if let Some(file) = table.get("file") {
        return Ok(Noise::Data(data(
            &file, variables, prefix, vectors, folder,
        )?));
    }
    let names: Vec<&'static str> = Law::NAMES.iter().map(|(name, _)| *name).collect();
    let name = table.need("law", "a law")?.one_of(&names)?;
    let (_, law) = *Law::NAMES
        .iter()
        .find(|(known, _)| *known == name)
        .expect("the law is one of them");
    if law == Law::Zero {
        table.only(&["law"])?;
        return Ok(Noise::Drawn(Drawn {
            law,
            of: Uncertain::point(vec![0.0; n]),
            truncate: false,
        }));
    }
    let truncate = match table.get("truncate") {
        None => false,
        Some(field) => {
            field.one_of(&["box"])?;
            true
        }
    };
    // The noise's own set or Gaussian replaces the assumed one, each as a whole.
    let own = set_part(&table, n)?;
    let mut of = match own {
        Some(set) => Uncertain {
            mean: assumed.mean.clone(),
            covariance: assumed.covariance.clone(),
            ..set
        },
        None => assumed.clone(),
    };
    if GAUSSIAN_KEYS.iter().any(|key| table.get(key).is_some()) {
        of.mean = None;
        of = with_gaussian_part(&table, of, n)?;
    }
    check_uncertain(&table, &of, n)?;
    if truncate && of.bounds.is_none() {
        return Err(table.fault(
            "truncate",
            "expected a noise with a box, here or in [noise], got none",
        ));
    }
    Ok(Noise::Drawn(Drawn { law, of, truncate }))
}

/// One item for each of `n` components.
fn components<T>(
    list: &Field,
    n: usize,
    read: impl Fn(&Field) -> Result<T, BadInput>,
) -> Result<Vec<T>, BadInput> {
    let expected = format!("an array with signals for {n} components");
    let items = list.array(&expected)?;
    if items.len() != n {
        return Err(list.expected(expected));
    }
    items.iter().map(read).collect()
}

/// The terms of one component: an array of signals, or one signal.
fn terms(field: &Field) -> Result<Vec<Signal>, BadInput> {
    if field.is_table() {
        return Ok(vec![signal(field)?]);
    }
    field
        .array("an array of signals")?
        .iter()
        .map(signal)
        .collect()
}

fn signal(field: &Field) -> Result<Signal, BadInput> {
    let table = field.any_table()?;
    let kinds: Vec<&'static str> = SIGNAL_KEYS.iter().map(|(kind, _)| *kind).collect();
    let kind = table
        .need(
            "kind",
            &format!("a kind of signal ({})", listed(kinds.iter().copied())),
        )?
        .one_of(&kinds)?;
    let (_, keys) = SIGNAL_KEYS
        .iter()
        .find(|(name, _)| *name == kind)
        .expect("the kind is one of them");
    table.only(&[&["kind"], *keys].concat())?;
    let signal: Signal = deserialize(&table, &[])?;
    signal.validate().map_err(|fault| {
        table.fault(
            fault.key,
            format!("expected {}, got {}", fault.expected, fault.got),
        )
    })?;
    Ok(signal)
}

fn delta(field: &Field, n: usize) -> Result<DeltaLaw, BadInput> {
    if n == 0 {
        return Err(field.fault("expected no delta, because the system has none, got one"));
    }
    let table = field.any_table()?;
    if let Some(list) = table.get("signals") {
        table.only(&["signals"])?;
        return Ok(DeltaLaw::Signals {
            terms: components(&list, n, terms)?,
        });
    }
    let law = table.need(
        "law",
        &format!(
            "a law ({}) or signals",
            listed(DeltaLaw::NAMES.iter().copied())
        ),
    )?;
    let keys: &[&str] = match law.one_of(DeltaLaw::NAMES)? {
        "constant" => &["law", "value"],
        "sine" => &[
            "law",
            "period",
            "omega",
            "dt",
            "amplitude",
            "offset",
            "phase",
        ],
        _ => &["law"],
    };
    table.only(keys)?;
    deserialize(&table, &[])
}

/// `[inputs]`.
pub fn inputs(
    section: Option<&Field>,
    root: &Table,
    system: &AnySystem,
    steps: usize,
    folder: Option<&Path>,
) -> Result<Inputs, BadInput> {
    let variables = system.variables();
    let n = variables.u.len();
    let Some(section) = section else {
        if n == 0 {
            return Ok(Inputs::Constant(Vec::new()));
        }
        let message =
            format!("inputs: expected a table, because the system has {n} inputs, got nothing");
        return Err(root.fault_at(root.span(), message));
    };
    let sources = ["constant", "signals", "file", "controller"];
    let table = section.table(&sources)?;
    let given: Vec<&str> = table.keys().collect();
    let inputs = match given[..] {
        ["constant"] => Inputs::Constant(table.need("constant", "numbers")?.vector(Some(n))?),
        ["signals"] => Inputs::Signals(components(&table.need("signals", "signals")?, n, terms)?),
        ["file"] => {
            let file = table.need("file", "the name of a file")?;
            let (name, recording) = recording(&file, &variables.u, "u", folder)?;
            let rows = recorded::inputs_to(&recording, steps, system.measures_input());
            Inputs::Data(rows.map_err(|fault| file.fault(format!("{name}: {fault}")))?)
        }
        ["controller"] => {
            let field = table.need("controller", "the name of a controller")?;
            let names: Vec<&str> = Controller::NAMES.iter().map(|(name, _)| *name).collect();
            let name = field.one_of(&names)?;
            let controller = Controller::NAMES.iter().find(|(known, _)| *known == name);
            let (_, controller) = controller.expect("the name is one of them");
            if controller.start(system).is_none() {
                let kind = system.kind();
                return Err(field.fault(format!(
                    "expected a system that this controller can drive, got {kind}"
                )));
            }
            Inputs::Controller(*controller)
        }
        _ => {
            return Err(section.fault(format!(
                "expected one of {}, got {}",
                listed(sources),
                if given.is_empty() { "none" } else { "several" }
            )));
        }
    };
    inputs
        .validate(system, steps)
        .map_err(|error| point_at(root, &error))?;
    Ok(inputs)
}

/// The longest time that a program may take for a step, in s.
const LONGEST_STEP: f64 = 86_400.0;

/// The largest file that a program may name, in bytes: it is read and hashed.
const LARGEST_FILE: u64 = 1 << 30;

/// `[[estimator]] kind = "command"`.
pub fn command(table: &Table, folder: Option<&Path>) -> Result<CommandSettings, BadInput> {
    let field = table.need(
        "command",
        "the program and its arguments, as an array of strings",
    )?;
    let Some(folder) = folder else {
        return Err(
            field.fault("expected no program, because this experiment is not in a folder, got one")
        );
    };
    let words = field.array("an array of strings")?;
    let words: Vec<&str> = words.iter().map(Field::string).collect::<Result<_, _>>()?;
    if words.first().is_none_or(|name| name.is_empty()) {
        return Err(field.expected("a program and its arguments"));
    }
    if words.iter().any(|word| word.contains('\0')) {
        return Err(field.fault("expected texts without the character NUL, got one with it"));
    }
    let files = match table.get("files") {
        None => Vec::new(),
        Some(list) => (list.array("an array of names of files")?.iter())
            .map(|item| hashed(item, folder))
            .collect::<Result<_, _>>()?,
    };
    let timeout = match table.get("timeout") {
        None => 10.0,
        Some(field) => match field.number()? {
            t if t > 0.0 && t <= LONGEST_STEP => t,
            _ => return Err(field.expected(format!("a time above 0 of at most {LONGEST_STEP} s"))),
        },
    };
    let settings = match table.get("settings") {
        None => serde_json::Value::Null,
        Some(field) => field.any_table()?.node().to_json(),
    };
    Ok(CommandSettings {
        kind: command::KIND,
        command: words.into_iter().map(str::to_owned).collect(),
        files,
        timeout,
        settings,
        folder: folder.to_owned(),
        allowed: false,
    })
}

/// A file that a program's answers depend on.
fn hashed(item: &Field, folder: &Path) -> Result<HashedFile, BadInput> {
    let name = item.string()?;
    let path = folder.join(name);
    let fault = |got: String| item.fault(format!("expected a file of at most 1 GiB, got {got}"));
    let about = std::fs::metadata(&path).map_err(|e| fault(format!("{}: {e}", path.display())))?;
    if !about.is_file() || about.len() > LARGEST_FILE {
        return Err(fault(format!("{}, which is none", path.display())));
    }
    let (_, blake3) = hash_file(&path).map_err(|e| fault(e.to_string()))?;
    Ok(HashedFile {
        name: name.to_owned(),
        blake3,
    })
}

/// The numbers of a file beside the experiment: one complete row for each of the first `vectors` steps.
fn data(
    field: &Field,
    variables: &[Variable],
    prefix: &str,
    vectors: usize,
    folder: Option<&Path>,
) -> Result<Vec<Vec<f64>>, BadInput> {
    let (name, rows) = recording(field, variables, prefix, folder)?;
    rows.complete(vectors)
        .map_err(|fault| field.fault(format!("{name}: {fault}")))
}

/// The name of a file beside the experiment, and what it holds.
fn recording<'a>(
    field: &'a Field,
    variables: &[Variable],
    prefix: &str,
    folder: Option<&Path>,
) -> Result<(&'a str, Recording), BadInput> {
    let name = field.string()?;
    let Some(folder) = folder else {
        return Err(
            field.fault("expected no file, because this experiment is not in a folder, got one")
        );
    };
    let names: Vec<&str> = variables
        .iter()
        .map(|variable| variable.name.as_str())
        .collect();
    let rows = recorded::read(&folder.join(name), &names, prefix, recorded::MOST_STEPS)
        .map_err(|fault| fault.with_help(field.fault("names this file").to_string()))?;
    Ok((name, rows))
}
