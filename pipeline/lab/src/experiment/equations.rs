//! A system of `kind = "equations"`: names with units, numbers, and texts that are equations.

use super::reader::{Field, Table};
use super::unit;
use zonobench_estimation::AnySystem;
use zonobench_estimation::systems::Equations;
use zonobench_estimation::systems::equations::{Fault, Method, Motion, Named, Part, Source, Texts};
use zonobench_lake::bad_input::{BadInput, brief, nearest};

/// The keys beside `kind`.
pub const KEYS: &[&str] = &[
    "x",
    "u",
    "w",
    "y",
    "v",
    "parameters",
    "let",
    "next",
    "rate",
    "method",
    "substeps",
    "output",
    "period",
];

/// Reads the system; a mistake in an equation is answered at its column.
pub fn system(table: &Table) -> Result<AnySystem, BadInput> {
    let states = table.need("x", "the states with their units, such as { p = \"m\" }")?;
    let output = table.need("output", "an equation for every component of y")?;
    let source = Source {
        x: named(&states)?,
        u: optional(table, "u")?,
        w: optional(table, "w")?,
        y: named(&table.need(
            "y",
            "the measurements with their units, such as { range = \"m\" }",
        )?)?,
        v: optional(table, "v")?,
        parameters: match table.get("parameters") {
            Some(field) => entries(&field)?
                .into_iter()
                .map(|(name, field)| Ok((name, field.number()?)))
                .collect::<Result<_, BadInput>>()?,
            None => Vec::new(),
        },
        definitions: match table.get("let") {
            Some(field) => texts(&field)?,
            None => Texts::new(),
        },
        motion: motion(table)?,
        output: texts(&output)?,
        period: table
            .get("period")
            .map(|field| field.number())
            .transpose()?,
    };
    match Equations::new(source) {
        Ok(equations) => Ok(AnySystem::Equations(equations)),
        Err(fault) => Err(at_its_place(table, &fault)),
    }
}

/// What a system of equations says that is right and perhaps not meant, the first `most`, and how many there are; nothing of
/// any other system.
pub fn warnings(field: &Field, most: usize) -> (Vec<BadInput>, usize) {
    let Ok(table) = field.any_table() else {
        return (Vec::new(), 0);
    };
    match table.get("kind").map(|kind| kind.string()) {
        Some(Ok("equations")) => {}
        _ => return (Vec::new(), 0),
    }
    let Ok(AnySystem::Equations(equations)) = system(&table) else {
        return (Vec::new(), 0);
    };
    let all = equations.warnings();
    let first = all.iter().take(most);
    (
        first.map(|fault| at_its_place(&table, fault)).collect(),
        all.len(),
    )
}

fn motion(table: &Table) -> Result<Motion, BadInput> {
    match (table.get("next"), table.get("rate")) {
        (Some(next), None) => {
            if let Some(key) = ["method", "substeps"]
                .into_iter()
                .find(|key| table.get(key).is_some())
            {
                return Err(table.fault(key, "expected only beside rate; next is a step already"));
            }
            Ok(Motion::Next(texts(&next)?))
        }
        (None, Some(rate)) => Ok(Motion::Rate {
            equations: texts(&rate)?,
            method: match table.get("method") {
                Some(field) => match field.one_of(&["euler", "heun", "rk4"])? {
                    "heun" => Method::Heun,
                    "rk4" => Method::Rk4,
                    _ => Method::Euler,
                },
                None => Method::default(),
            },
            substeps: match table.get("substeps") {
                Some(field) => field.integer(1..=10_000, "an integer from 1 to 10000")? as usize,
                None => 1,
            },
        }),
        (Some(_), Some(_)) => Err(table.fault("rate", "expected either next or rate, got both")),
        (None, None) => Err(table
            .need(
                "next",
                "an equation for every state (or rate, its derivative)",
            )
            .map(|_| ())
            .unwrap_err()),
    }
}

fn entries<'a>(field: &Field<'a>) -> Result<Vec<(String, Field<'a>)>, BadInput> {
    let table = field.any_table()?;
    Ok(table
        .fields()
        .map(|(key, field)| (key.to_owned(), field))
        .collect())
}

fn optional(table: &Table, key: &str) -> Result<Named, BadInput> {
    table
        .get(key)
        .map_or(Ok(Named::new()), |field| named(&field))
}

fn named(field: &Field) -> Result<Named, BadInput> {
    let of = |(name, field): (String, Field)| {
        let written = field.string()?;
        if let Err((range, got)) = unit::check(written) {
            let fault = format!(
                "expected a UCUM unit such as \"m\", \"m/s2\", \"rad\" or \"1\", got {got:?}"
            );
            return Err(field.fault_within(range, fault));
        }
        Ok((name, written.to_owned()))
    };
    entries(field)?.into_iter().map(of).collect()
}

fn texts(field: &Field) -> Result<Texts, BadInput> {
    let of = |(name, field): (String, Field)| Ok((name, field.string()?.to_owned()));
    entries(field)?.into_iter().map(of).collect()
}

/// The fault where it was written, with the nearest name where one was not found.
fn at_its_place(table: &Table, fault: &Fault) -> BadInput {
    let said = format!(
        "expected {}, got {}",
        brief(&fault.expected),
        brief(&fault.got)
    );
    let in_table = |name: &str| table.get(name);
    let placed = match &fault.part {
        Part::Table(key) => table.fault(key, said),
        Part::Name(key, name) => match in_table(key).and_then(|f| f.any_table().ok()) {
            Some(inner) => inner.fault(name, said),
            None => table.fault(key, said),
        },
        Part::Text(key, name, range) => {
            match in_table(key)
                .and_then(|f| f.any_table().ok())
                .and_then(|inner| inner.get(name))
            {
                Some(text) => {
                    text.fault_within(range.clone(), format!("column {}: {said}", range.start + 1))
                }
                None => table.fault(key, said),
            }
        }
    };
    let wanted = fault.got.trim_matches('"');
    match nearest(wanted, fault.known.iter().map(String::as_str)) {
        Some(near) => placed.with_help(format!("did you mean {near}?")),
        None if fault.known.is_empty() => placed,
        None => placed.with_help(brief(&format!("names: {}", fault.known.join(", ")))),
    }
}

#[cfg(test)]
mod tests {
    use super::super::Experiment;
    use zonobench_estimation::AnySystem;

    const CART: &str = r#"schema = 1
paper = "mine"
id = "cart"
seed = 1
runs = 2
steps = 5

[system]
kind = "equations"
x = { p = "m", s = "m/s" }
u = { force = "m/s2" }
w = { gust = "m/s" }
y = { range = "m" }
v = { e = "m" }
parameters = { T = 0.1, drag = 0.05 }
let = { a = "force - drag*s^2" }
next = { p = "p + T*s", s = "s + T*a + gust" }
output = { range = "sqrt(p^2 + 1) + e" }
period = 0.1

[prior]
box = [[-1.0, 1.0], [-1.0, 1.0]]

[noise]
w = { box = [[-0.1, 0.1]] }
v = { box = [[-0.1, 0.1]] }

[inputs]
constant = [1.0]

[[estimator]]
id = "lift"
kind = "lift"
"#;

    fn read(text: &str) -> Vec<Experiment> {
        Experiment::parse("x.toml", text).unwrap_or_else(|fault| panic!("{fault}"))
    }

    fn refused(old: &str, new: &str) -> String {
        assert!(CART.contains(old), "{old}");
        let fault = Experiment::parse("x.toml", &CART.replacen(old, new, 1))
            .expect_err("the file is wrong");
        match miette::Diagnostic::help(&fault) {
            Some(help) => format!("{fault} [{help}]"),
            None => fault.to_string(),
        }
    }

    #[test]
    fn a_system_is_read_from_its_equations_and_swept_by_its_parameters() {
        let experiments = read(CART);
        let AnySystem::Equations(system) = &experiments[0].problem.system else {
            panic!("another system")
        };
        assert_eq!(system.source().x[1], ("s".to_owned(), "m/s".to_owned()));
        assert_eq!(
            system.source().parameters,
            [("T".to_owned(), 0.1), ("drag".to_owned(), 0.05)]
        );
        let swept = read(&format!(
            "{CART}\n[sweep]\n\"system.parameters.drag\" = [0.0, 0.2]\n"
        ));
        let drags: Vec<f64> = swept
            .iter()
            .map(|e| match &e.problem.system {
                AnySystem::Equations(system) => system.source().parameters[1].1,
                _ => f64::NAN,
            })
            .collect();
        assert_eq!(drags, [0.0, 0.2]);
    }

    #[test]
    fn a_mistake_is_answered_at_its_line_with_the_nearest_name() {
        for (old, new, expected) in [
            (
                "s + T*a + gust",
                "s + T*a + gusst",
                "x.toml:17: system.next.s: column 11: expected a name that the system has, got \"gusst\" [did you mean gust?]",
            ),
            (
                "sqrt(p^2 + 1)",
                "sqr t(p^2 + 1)",
                "x.toml:18: system.output.range: column 5: expected `(` after the function sqr, got 't'",
            ),
            (
                "sqrt(p^2 + 1)",
                "sqrtt(p^2 + 1)",
                "x.toml:18: system.output.range: column 1: expected a function, got \"sqrtt\" [did you mean sqrt?]",
            ),
            (
                "p = \"p + T*s\", ",
                "",
                "x.toml:17: system.next: expected an equation for \"p\", got none",
            ),
            (
                "\"m/s2\"",
                "\"m/sec2\"",
                "x.toml:11: system.u.force: expected a UCUM unit such as \"m\", \"m/s2\", \"rad\" or \"1\", got \"sec2\"",
            ),
            (
                "drag = 0.05",
                "drag = \"x\"",
                "x.toml:15: system.parameters.drag: expected a number, got \"x\"",
            ),
            (
                "gust = ",
                "sin = ",
                "x.toml:12: system.w.sin: expected a name that is no function and none of pi, E, k, t, got \"sin\"",
            ),
            (
                "period = 0.1\n",
                "perod = 0.1\n",
                "[did you mean \"period\"?]",
            ),
            (
                "output = { range",
                "method = \"rk4\"\noutput = { range",
                "x.toml:18: system.method: expected only beside rate; next is a step already",
            ),
            (
                "next = {",
                "rate = {}\nnext = {",
                "expected either next or rate, got both",
            ),
        ] {
            let message = refused(old, new);
            assert!(message.contains(expected), "{new}: {message}");
        }
    }

    #[test]
    fn deep_and_long_files_are_refused() {
        let deep = refused("force - drag*s^2", &"(".repeat(10_000));
        assert!(deep.contains("nesting"), "{}", &deep[..200]);
        let long = refused("force - drag*s^2", &"force + ".repeat(1_250_000));
        assert!(long.contains("at most"), "{}", &long[..200]);
        let many: String = (0..100_000).map(|i| format!("d{i} = \"p*s\", ")).collect();
        let many = refused("let = { a =", &format!("let = {{ {many} a ="));
        assert!(many.contains("names"), "{}", &many[..200]);
    }
}
