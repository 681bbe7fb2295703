//! Equations as a user writes them: what is read, what is refused and where, and the same bits as a system in Rust.

use super::*;
use crate::AnySystem;
use crate::systems::{Form, Quadrotor, QuotientForm, Raimondo, Unicycle, VanDerPol, VehicleSe2};
use zonobench_sets::Interval;
use zonobench_sets::number::{Function, hessian, jacobian};

fn named(text: &str) -> Named {
    text.split_whitespace()
        .map(|name| (name.to_owned(), "1".to_owned()))
        .collect()
}

fn texts(pairs: &[(&str, &str)]) -> Texts {
    pairs
        .iter()
        .map(|(name, text)| ((*name).to_owned(), (*text).to_owned()))
        .collect()
}

/// A cart with drag: position p, speed s; its distance from a point beside the track is measured.
fn cart() -> Source {
    Source {
        x: vec![("p".into(), "m".into()), ("s".into(), "m/s".into())],
        u: named("force"),
        w: named("gust"),
        y: named("range"),
        v: named("e"),
        parameters: vec![("T".into(), 0.1), ("drag".into(), 0.05)],
        definitions: texts(&[("a", "force - drag*s^2")]),
        motion: Motion::Next(texts(&[("p", "p + T*s"), ("s", "s + T*a + gust")])),
        output: texts(&[("range", "sqrt(p^2 + 1) + e")]),
        period: Some(0.1),
    }
}

fn refused(change: impl FnOnce(&mut Source)) -> Fault {
    let mut source = cart();
    change(&mut source);
    Equations::new(source).unwrap_err()
}

#[test]
fn a_cart_moves_as_its_equations_say() {
    let system = Equations::new(cart()).unwrap();
    let (mut next, mut y) = ([0.0; 2], [0.0]);
    system.f(3, &[2.0, 4.0], &[1.0], &[0.25], &mut next);
    assert_eq!(
        next,
        [2.0 + 4.0 * 0.1, 4.0 + (-(16.0 * 0.05) + 1.0) * 0.1 + 0.25]
    );
    system.h(3, &[2.0, 4.0], &[1.0], &[0.5], &mut y);
    assert_eq!(y, [f64::sqrt(5.0) + 0.5]);
    assert!(system.linear_parts().is_none() && system.warnings().is_empty());
    assert_eq!(system.variables().x[1], Variable::new("s", "m/s"));
    // Its canonical form reads itself.
    let text = serde_json::to_string(&AnySystem::Equations(system.clone())).unwrap();
    let back: AnySystem = serde_json::from_str(&text).unwrap();
    assert_eq!(back, AnySystem::Equations(system));
}

#[test]
fn a_mistake_is_answered_at_its_place() {
    let at = |fault: &Fault| fault.to_string();
    let wrong = |table, i: usize, text: &str| {
        let fault = refused(|s| match (table, &mut s.motion) {
            ("let", _) => s.definitions[i].1 = text.into(),
            ("output", _) => s.output[i].1 = text.into(),
            (_, Motion::Next(next)) => next[i].1 = text.into(),
            _ => (),
        });
        at(&fault)
    };
    for (table, i, text, expected) in [
        (
            "next",
            1,
            "s + T*aa",
            "next.s, column 7: expected a name that the system has, got \"aa\"",
        ),
        (
            "next",
            0,
            "p + * s",
            "next.p, column 5: expected a number, a name, a sign or `(`, got '*'",
        ),
        (
            "next",
            0,
            "p + e",
            "next.p, column 5: expected no noise of the measurement in an equation of motion, got \"e\"",
        ),
        (
            "output",
            0,
            "p + gust",
            "output.range, column 5: expected no noise of the process in an output, got \"gust\"",
        ),
        (
            "let",
            0,
            "a + 1",
            "let.a, column 1: expected a definition that does not need itself, got a -> a in a circle",
        ),
        (
            "let",
            0,
            "sin(p, s)",
            "let.a, column 1: expected 1 argument of sin, got 2 arguments",
        ),
        (
            "next",
            0,
            "p / (T - 0.1)",
            "next.p, column 1: expected a divisor that is not 0, got 0",
        ),
        (
            "next",
            0,
            "p + ln(-T)",
            "next.p, column 5: expected a finite number, got none (NaN)",
        ),
        (
            "next",
            0,
            "p + exp(1e5)",
            "next.p, column 5: expected a finite number, got an infinite one",
        ),
    ] {
        assert_eq!(wrong(table, i, text), expected, "{text}");
    }
    let names = |change: fn(&mut Source)| at(&refused(change));
    assert_eq!(
        names(|s| s.x[0].0 = "sin".into()),
        "x.sin: expected a name that is no function and none of pi, E, k, t, got \"sin\""
    );
    assert_eq!(
        names(|s| s.u[0].0 = "2u".into()),
        "u.2u: expected a name of letters, digits and _ that begins with no digit, got \"2u\""
    );
    assert_eq!(
        names(|s| s.w[0].0 = "p".into()),
        "w.p: expected a name that stands once, got \"p\" twice"
    );
    assert_eq!(
        names(|s| s.x.push(("q".into(), "1".into()))),
        "next: expected an equation for \"q\", got none"
    );
    assert_eq!(
        names(|s| s.output[0].0 = "rnage".into()),
        "output.rnage: expected an equation for one of range, got one for \"rnage\""
    );
    assert_eq!(
        names(|s| s.parameters[0].1 = f64::NAN),
        "parameters.T: expected a finite number, got NaN"
    );
    assert_eq!(
        names(|s| s.period = Some(0.0)),
        "period: expected a finite number above 0, got 0.0"
    );
    // The nearest name can be suggested from those that there are.
    let fault = refused(|s| s.definitions[0].1 = "forse".into());
    assert!(fault.known.contains(&"force".to_owned()));
}

#[test]
fn a_million_definitions_and_deep_texts_are_refused_at_once() {
    let many = refused(|s| {
        s.definitions = (0..1_000_000)
            .map(|i| (format!("d{i}"), "p*s".into()))
            .collect();
    });
    assert_eq!(
        many.to_string(),
        "let: expected at most 65536 names, got 1000000"
    );
    let long = refused(|s| {
        s.definitions[0].1 = (0..90_000).map(|i| format!("p*{i} + ")).collect::<String>() + "1"
    });
    assert!(
        long.expected.contains("operations") || long.expected.contains("bytes"),
        "{long}"
    );
    let deep = refused(|s| s.definitions[0].1 = "(".repeat(10_000));
    assert!(deep.expected.contains("nesting"), "{deep}");
}

#[test]
fn an_output_that_holds_an_input_is_known() {
    assert!(!Equations::new(cart()).unwrap().measures_input());
    let mut source = cart();
    source.output[0].1 = "p + a + e".into();
    assert!(Equations::new(source).unwrap().measures_input());
}

#[test]
fn linear_equations_are_a_linear_system() {
    let mut source = cart();
    source.w = named("w1 w2");
    source.definitions = texts(&[("a", "(force - drag*s)/2")]);
    source.motion = Motion::Next(texts(&[("p", "p + T*s + w1"), ("s", "s + T*a + w2")]));
    source.output = texts(&[("range", "p - 2*(s - p) + e")]);
    let system = Equations::new(source.clone()).unwrap();
    let parts = system.linear_parts().unwrap();
    assert_eq!(
        parts.a,
        Matrix::from_rows(&[[1.0, 0.1], [0.0, 1.0 + -0.05 / 2.0 * 0.1]]).unwrap()
    );
    assert_eq!(parts.b, Matrix::from_rows(&[[0.0], [0.1 * 0.5]]).unwrap());
    assert_eq!(parts.c, Matrix::from_rows(&[[3.0, -2.0]]).unwrap());
    // A constant part, a noise with a factor and a time are none.
    for (p, s) in [
        ("p + 1 + w1", "s + w2"),
        ("p + 2*w1", "s + w2"),
        ("p + k + w1", "s + w2"),
        ("p*s + w1", "s + w2"),
    ] {
        source.motion = Motion::Next(texts(&[("p", p), ("s", s)]));
        assert!(
            Equations::new(source.clone())
                .unwrap()
                .linear_parts()
                .is_none(),
            "{p}"
        );
    }
}

#[test]
fn a_product_of_a_name_with_itself_is_told() {
    let mut source = cart();
    source.definitions[0].1 = "force - drag*(s*s)".into();
    let system = Equations::new(source).unwrap();
    let [warning] = system.warnings() else {
        panic!("{:?}", system.warnings())
    };
    assert!(
        warning
            .to_string()
            .starts_with("let.a, column 15: expected s^2, got s*s"),
        "{warning}"
    );
}

#[test]
fn definitions_that_go_in_a_circle_are_shown_as_one() {
    let fault = |pairs: &[(&str, &str)]| {
        let definitions = texts(pairs);
        refused(|s| s.definitions = definitions).to_string()
    };
    let with = |others: &[(&'static str, &'static str)]| {
        let mut all = vec![("a", "force - drag*s + b")];
        all.extend(others);
        fault(&all)
    };
    assert_eq!(
        with(&[("b", "2*c"), ("c", "p - b/(a + 9)")]),
        "let.a, column 18: expected a definition that does not need itself, got a -> b -> c -> a in a circle"
    );
    assert_eq!(
        with(&[("b", "2*p")]),
        "let.a, column 18: expected a name that stands above it in let, got \"b\", which stands below it"
    );
    // Also where no equation needs them.
    let a = ("a", "force - drag*s");
    assert!(fault(&[a, ("c", "d"), ("d", "c")]).contains("c -> d -> c"));
    assert_eq!(
        fault(&[a, ("c", "pp")]),
        "let.c, column 1: expected a name that the system has, got \"pp\""
    );
}

#[test]
fn what_no_equation_holds_and_what_does_not_move_is_told() {
    let mut source = cart();
    source.u = named("force unused");
    source.parameters.push(("mass".into(), 1.0));
    source.definitions.push(("half".into(), "p/2".into()));
    source.motion = Motion::Next(texts(&[("p", "p"), ("s", "s + T*a + gust")]));
    let system = Equations::new(source).unwrap();
    let told: Vec<String> = system.warnings().iter().map(Fault::to_string).collect();
    assert_eq!(
        told,
        [
            "next.p, column 1: expected an equation that moves p, got one in which it keeps its first value, without noise",
            "u.unused: expected an equation that holds unused, got none",
            "parameters.mass: expected an equation that holds mass, got none",
            "let.half: expected an equation that holds half, got none",
        ]
    );
}

#[test]
fn it_is_known_what_is_linear_in_what() {
    use Dependence::{Linear, No, Nonlinear};
    let of = |next: &str, output: &str| {
        let mut source = cart();
        source.motion = Motion::Next(texts(&[("p", next), ("s", "s + T*a*0 + gust")]));
        source.output[0].1 = output.into();
        Equations::new(source).unwrap().dependence()
    };
    let system = Equations::new(cart()).unwrap();
    assert_eq!(
        system.dependence(),
        [[Nonlinear, Linear, Linear], [Nonlinear, No, Linear]]
    );
    assert_eq!(
        of("p*force", "p + e"),
        [[Nonlinear, Linear, Linear], [Linear, No, Linear]]
    );
    assert_eq!(of("p + s*gust", "e*force")[0][2], Linear);
    assert_eq!(of("p + gust*gust", "e*force")[0][2], Nonlinear);
    assert_eq!(of("p", "e*force")[1], [No, Linear, Linear]);
    assert_eq!(
        of("p", "p/force + exp(e)")[1],
        [Linear, Nonlinear, Nonlinear]
    );
}

#[test]
fn the_steepest_term_is_found_where_it_stands() {
    let mut source = cart();
    source.definitions = texts(&[("lift", "3*cos(s)"), ("a", "lift - drag*s^2 - force")]);
    let system = Equations::new(source).unwrap();
    let side = |lo, hi| Interval::new(lo, hi).unwrap();
    let over = IntervalVector::new(vec![side(-1.0, 1.0), side(10.0, 90.0)]);
    let of = |i| {
        let found = system.steepest(i, 0, &over, &[1.0], &[Interval::ZERO]);
        found.unwrap()
    };
    // ∂(drag s²)/∂s = 2 · 0.05 s.
    let term = of(1);
    assert_eq!(
        (
            term.table,
            &*term.name,
            term.column,
            &*term.written,
            term.state
        ),
        ("let", "a", 8, "drag*s^2", 1)
    );
    assert!(
        term.derivative.contains(9.0) && term.derivative.hi() < 9.1,
        "{term:?}"
    );
    // p is carried over: what moves it is s.
    let term = of(0);
    assert_eq!((term.table, &*term.written, term.state), ("next", "T*s", 1));
}

#[test]
fn outside_of_the_domain_the_term_and_its_operand_are_named() {
    let mut source = cart();
    source.output[0].1 = "ln(p - 1) + e".into();
    let system = Equations::new(source).unwrap();
    let over = |lo, hi| IntervalVector::new(vec![Interval::new(lo, hi).unwrap(), Interval::ONE]);
    assert_eq!(system.domain_fault(&over(2.0, 3.0)), None);
    let fault = system.domain_fault(&over(0.5, 3.0)).unwrap();
    assert!(
        fault.starts_with("`ln(p - 1)` in output.range, column 1, needs a number above 0, and over the set it is in [-0.5, 2]"),
        "{fault}"
    );
    assert!(fault.ends_with("(p in [0.5, 3])"), "{fault}");
}

/// A system's f, or its h, as a function of state and noise.
struct Map<'a, S> {
    system: &'a S,
    u: &'a [f64],
    outputs: usize,
    inputs: usize,
    n: usize,
    measured: bool,
}

impl<Y: System> Function for Map<'_, Y> {
    fn inputs(&self) -> usize {
        self.inputs
    }
    fn outputs(&self) -> usize {
        self.outputs
    }
    fn evaluate<S: Real>(&self, z: &[S], out: &mut [S]) {
        let (x, noise) = z.split_at(self.n);
        if self.measured {
            self.system.h(2, x, self.u, noise, out);
        } else {
            self.system.f(2, x, self.u, noise, out);
        }
    }
}

/// Value, Jacobian and Hessian over boxes are the same to the last bit.
fn same_bits(rust: &impl System, written: &Equations, middle: &[f64], width: f64, u: &[f64]) {
    let variables = rust.variables();
    let (n, w, m, v) = (
        variables.x.len(),
        variables.w.len(),
        variables.y.len(),
        variables.v.len(),
    );
    assert_eq!(middle.len(), n);
    for measured in [false, true] {
        let (noise, outputs) = if measured { (v, m) } else { (w, n) };
        for scale in [0.0, 0.1, 1.0] {
            let box_ = |i: usize| {
                let c = if i < n { middle[i] } else { 0.0 };
                Interval::from_center_radius(c, width * scale)
            };
            let z: Vec<Interval> = (0..n + noise).map(box_).collect();
            let of_rust = Map {
                system: rust,
                u,
                outputs,
                inputs: n + noise,
                n,
                measured,
            };
            let of_text = Map {
                system: written,
                u,
                outputs,
                inputs: n + noise,
                n,
                measured,
            };
            let (a, b) = (jacobian(&of_rust, &z), jacobian(&of_text, &z));
            assert_eq!(
                a.value, b.value,
                "values, measured: {measured}, scale {scale}"
            );
            for q in 0..outputs {
                assert_eq!(
                    a.row(q),
                    b.row(q),
                    "gradient of component {q}, measured: {measured}, scale {scale}"
                );
            }
            let (a, b) = (hessian(&of_rust, &z), hessian(&of_text, &z));
            for q in 0..outputs {
                assert_eq!(
                    a.output(q),
                    b.output(q),
                    "second derivatives of component {q}, measured: {measured}"
                );
            }
        }
    }
}

#[test]
fn raimondo_as_equations_has_the_bits_of_its_rust() {
    let form = |form, definitions: &[(&str, &str)], next: &[(&str, &str)]| {
        let source = Source {
            x: named("x1 x2"),
            u: vec![],
            w: named("w1 w2"),
            y: named("y1 y2"),
            v: named("v1 v2"),
            parameters: vec![],
            definitions: texts(definitions),
            motion: Motion::Next(texts(next)),
            output: texts(&[("y1", "x1 + v1"), ("y2", "x2 - x1 + v2")]),
            period: None,
        };
        let written = Equations::new(source).unwrap();
        same_bits(
            &Raimondo {
                form,
                ..Raimondo::default()
            },
            &written,
            &[0.8, 0.65],
            0.4,
            &[],
        );
    };
    form(
        QuotientForm::Tight,
        &[("linear", "3*x1 - x1^2/7"), ("rest", "x2*(1/(x1 + 4))")],
        &[
            ("x1", "linear - 4*x2 + 16*rest + w1"),
            ("x2", "x2 - 12*rest + w2"),
        ],
    );
    form(
        QuotientForm::Printed,
        &[("linear", "3*x1 - x1^2/7"), ("product", "x1*x2/(4 + x1)")],
        &[
            ("x1", "linear - 4*product + w1"),
            ("x2", "3*product - 2*x2 + w2"),
        ],
    );
}

/// The variables of a system in Rust, with other names for its measurement noise where they are not names.
fn written_like(
    rust: &impl System,
    parameters: &[(&str, f64)],
    definitions: &[(&str, &str)],
    next: &[(&str, &str)],
    output: &[(&str, &str)],
) -> Equations {
    let of = |v: Vec<Variable>| -> Named {
        v.into_iter()
            .map(|v| (v.name, v.unit.to_string()))
            .collect()
    };
    let variables = rust.variables();
    Equations::new(Source {
        x: of(variables.x),
        u: of(variables.u),
        w: of(variables.w),
        y: of(variables.y),
        v: of(variables.v),
        parameters: parameters
            .iter()
            .map(|(name, value)| ((*name).to_owned(), *value))
            .collect(),
        definitions: texts(definitions),
        motion: Motion::Next(texts(next)),
        output: texts(output),
        period: None,
    })
    .unwrap()
}

#[test]
fn van_der_pol_as_equations_has_the_bits_of_its_rust() {
    let rust = VanDerPol::new(0.1).unwrap();
    let written = written_like(
        &rust,
        &[("T", 0.1)],
        &[("damping", "1 + (1 - x1^2)*T")],
        &[("x1", "x1 + x2*T + w1"), ("x2", "damping*x2 - x1*T + w2")],
        &[("y1", "x1 + x2 + v1")],
    );
    same_bits(&rust, &written, &[0.5, -1.5], 0.3, &[]);
}

#[test]
fn the_unicycle_as_equations_has_the_bits_of_its_rust() {
    let rust = Unicycle::new(0.7, 0.3, 0.15, vec![[5.0, 15.0], [15.0, 15.0]]).unwrap();
    let written = written_like(
        &rust,
        &[("T0", 0.7), ("speed", 0.3), ("rate", 0.15)],
        &[
            ("way", "speed*T0"),
            ("turn", "rate*T0"),
            ("b1", "15 - sy"),
            ("a1", "5 - sx"),
            ("a2", "15 - sx"),
        ],
        &[
            ("sx", "sx + way*cos(theta) + w1"),
            ("sy", "sy + way*sin(theta) + w2"),
            ("theta", "theta + turn + w3"),
        ],
        &[
            ("d1", "sqrt(a1^2 + b1^2) + v1"),
            ("phi1", "theta - atan(b1/a1) + v2"),
            ("d2", "sqrt(a2^2 + b1^2) + v3"),
            ("phi2", "theta - atan(b1/a2) + v4"),
        ],
    );
    same_bits(&rust, &written, &[1.0, 2.0, 0.4], 0.05, &[]);
}

#[test]
fn the_vehicle_as_equations_has_the_bits_of_its_rust() {
    let rust = VehicleSe2::new(0.01, Form::Euler).unwrap();
    let written = written_like(
        &rust,
        &[("T", 0.01)],
        &[
            ("turn", "omega*T"),
            ("ahead", "nu*T + w_l*T"),
            ("aside", "w_tr*T"),
        ],
        &[
            ("theta", "theta + (turn + w_theta*T)"),
            ("x1", "x1 + (cos(theta)*ahead - sin(theta)*aside)"),
            ("x2", "x2 + (sin(theta)*ahead + cos(theta)*aside)"),
        ],
        &[("y1", "x1 + v1"), ("y2", "x2 + v2")],
    );
    same_bits(&rust, &written, &[0.7, 3.0, -2.0], 0.2, &[0.4, 8.0]);
}

#[test]
fn the_quadrotor_as_equations_has_the_bits_of_its_rust() {
    // Quotients that are no f64: an exact one is a coefficient of the tape, whose product is tighter than in Rust.
    let rust = Quadrotor::new(0.7, 0.3, [1.1, 1.6, 1.7], 9.81, 0.01).unwrap();
    let variables = rust.variables();
    // Which state a component of y is: the one that moves it.
    let measures = |i: usize| {
        let moves = |j: &usize| {
            let x: Vec<f64> = (0..12).map(|l| f64::from(u8::from(l == *j))).collect();
            let mut y = [0.0; 9];
            rust.h(0, &x, &[], &[0.0; 9], &mut y);
            y[i] != 0.0
        };
        variables.x[(0..12).find(moves).unwrap()].name.clone()
    };
    let output: Vec<(String, String)> = (variables.y.iter().zip(&variables.v).enumerate())
        .map(|(i, (y, v))| (y.name.clone(), format!("{} + {}", measures(i), v.name)))
        .collect();
    let output: Vec<(&str, &str)> = output
        .iter()
        .map(|(a, b)| (a.as_str(), b.as_str()))
        .collect();
    let w: Vec<String> = variables.w.iter().map(|w| w.name.clone()).collect();
    let next = |x: &str, rate: &str| (x.to_owned(), format!("{x} + ({rate})*dt"));
    let next = [
        next("x", "u"),
        next("y", "v"),
        next("z", "w"),
        next(
            "u",
            &format!("(cpsi*tilted + spsi*sphi)*thrust + {}/m", w[0]),
        ),
        next(
            "v",
            &format!("(spsi*tilted - cpsi*sphi)*thrust + {}/m", w[1]),
        ),
        next("w", &format!("ctheta*cphi*thrust - g + {}/m", w[2])),
        next("phi", "p + turn*tan(theta)"),
        next("theta", "q*cphi - r*sphi"),
        next("psi", "turn*(1/ctheta)"),
        next("p", "q*r*((iyy - izz)/ixx) + u2*(l/ixx)"),
        next("q", "p*r*((izz - ixx)/iyy) + u3*(l/iyy)"),
        next("r", "p*q*((ixx - iyy)/izz) + u4/izz"),
    ];
    let next: Vec<(&str, &str)> = next.iter().map(|(a, b)| (a.as_str(), b.as_str())).collect();
    let written = written_like(
        &rust,
        &[
            ("m", 0.7),
            ("l", 0.3),
            ("ixx", 1.1),
            ("iyy", 1.6),
            ("izz", 1.7),
            ("g", 9.81),
            ("dt", 0.01),
        ],
        &[
            ("sphi", "sin(phi)"),
            ("cphi", "cos(phi)"),
            ("stheta", "sin(theta)"),
            ("ctheta", "cos(theta)"),
            ("spsi", "sin(psi)"),
            ("cpsi", "cos(psi)"),
            ("thrust", "u1/m"),
            ("tilted", "stheta*cphi"),
            ("turn", "q*sphi + r*cphi"),
        ],
        &next,
        &output,
    );
    let x = [
        0.5, 0.1, 1.2, 0.3, -0.2, 0.1, 0.12, -0.2, 1.0, 0.05, -0.08, 0.11,
    ];
    same_bits(&rust, &written, &x, 0.02, &[6.5, 0.3, -0.2, 0.1]);
}

#[test]
fn sympy_expressions_are_read_as_they_are_printed() {
    // str(expr) of SymPy 1.13 for expressions in x and y, and their values at x = 0.7, y = 1.9.
    let (x, y) = (0.7_f64, 1.9_f64);
    let value = |text: &str| {
        let mut source = cart();
        source.x = named("x y");
        source.u = vec![];
        source.definitions = vec![];
        source.motion = Motion::Next(texts(&[("x", text), ("y", "y + gust")]));
        source.output = texts(&[("range", "x + e")]);
        let system = Equations::new(source).unwrap_or_else(|fault| panic!("{text}: {fault}"));
        let mut next = [0.0; 2];
        system.f(0, &[x, y], &[], &[0.0], &mut next);
        next[0]
    };
    for (text, expected) in [
        ("x**2 + 2*x*y + y**2", (x + y) * (x + y)),
        ("-x**2", -x * x),
        (
            "sqrt(x**2 + 1)*exp(-y)",
            libm::sqrt(x * x + 1.0) * libm::exp(-y),
        ),
        ("x/(y + 1) - 3*x/7", x / (y + 1.0) - 3.0 * x / 7.0),
        ("log(x) + log(y)/2", libm::log(x) + libm::log(y) / 2.0),
        ("x**(1/3)", libm::cbrt(x)),
        ("x**y", libm::pow(x, y)),
        ("Abs(x - y) + Max(x, y, 1) - Min(x, y)", (y - x) + y - x),
        (
            "atan2(y, x) + pi*tanh(x) + E",
            libm::atan2(y, x) + std::f64::consts::PI * libm::tanh(x) + std::f64::consts::E,
        ),
        (
            "1.0e-3*sin(2*x - y)**3/cosh(x)",
            1e-3 * libm::pow(libm::sin(2.0 * x - y), 3.0) / libm::cosh(x),
        ),
    ] {
        let got = value(text);
        assert!(
            (got - expected).abs() < 1e-14 * (1.0 + expected.abs()),
            "{text}: {got} {expected}"
        );
    }
}

#[test]
fn a_power_of_a_constant_has_all_of_its_exponent() {
    for (text, expected) in [
        ("9^2", 81.0),
        ("9^2.5", 243.0),
        ("9^(-0.5)", 1.0 / 3.0),
        ("9^0", 1.0),
        ("9^1", 9.0),
        ("pow(9, 2.5)", 243.0),
        ("T^2.0", 0.1 * 0.1),
        ("T^2.75", libm::pow(0.1, 2.75)),
    ] {
        let mut source = cart();
        source.output[0].1 = format!("p + {text} + e");
        let system = Equations::new(source).unwrap();
        let mut y = [Interval::ENTIRE];
        system.h(0, &[Interval::ZERO; 2], &[1.0], &[Interval::ZERO], &mut y);
        let near = Interval::from_center_radius(expected, 1e-13 * expected);
        assert!(y[0].is_subset(near), "{text}: {:?}", y[0]);
    }
}

#[test]
fn methods_of_a_rate_have_their_order() {
    // ẋ = −x + t, x(0) = 1: x(t) = t − 1 + 2 e⁻ᵗ. Halving the step divides the error of a step by 2^(order + 1).
    let step = |method, substeps, period: f64| {
        let source = Source {
            x: named("x"),
            u: vec![],
            w: named("w"),
            y: named("y"),
            v: named("v"),
            parameters: vec![],
            definitions: texts(&[("r", "t - x")]),
            motion: Motion::Rate {
                equations: texts(&[("x", "r + w")]),
                method,
                substeps,
            },
            output: texts(&[("y", "x + v")]),
            period: Some(period),
        };
        let mut next = [0.0];
        Equations::new(source)
            .unwrap()
            .f(0, &[1.0], &[], &[0.0], &mut next);
        (next[0] - (period - 1.0 + 2.0 * libm::exp(-period))).abs()
    };
    for (method, order) in [(Method::Euler, 1), (Method::Heun, 2), (Method::Rk4, 4)] {
        let ratio = step(method, 1, 0.2) / step(method, 1, 0.1);
        let expected = f64::from(1 << (order + 1));
        assert!(
            (0.8..1.25).contains(&(ratio / expected)),
            "{method:?}: {ratio}"
        );
        // n substeps over the same time divide the error by n^order.
        let ratio = step(method, 1, 0.2) / step(method, 4, 0.2);
        let expected = f64::from(1 << (2 * order));
        assert!(
            (0.7..1.5).contains(&(ratio / expected)),
            "{method:?}: {ratio}"
        );
    }
}
