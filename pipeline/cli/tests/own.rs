//! A system of one's own, from `new` over `check` to `run`: what a user sees who has only the README.

mod program;

use program::{Folder, Outcome};

const SYSTEMS: [&str; 4] = ["equations", "rate", "linear", "lpv"];

/// x⁺ as `next`, where x begins in [`lo`, `hi`] and what is measured says nothing.
fn alone(next: &str, lo: f64, hi: f64, estimators: &str) -> String {
    format!(
        r#"schema = 1
paper = "mine"
id = "alone"
seed = 1
runs = 1
steps = 60
estimator = [{estimators}]
metric = [{{ name = "contains" }}]

[system]
kind = "equations"
x = {{ x = "1" }}
w = {{ w = "1" }}
y = {{ y = "1" }}
v = {{ v = "1" }}
parameters = {{ gain = 1.5 }}
let = {{ swing = "gain*sin(x)" }}
next = {{ x = "{next}" }}
output = {{ y = "x + v" }}

[prior]
box = [[{lo}, {hi}]]

[noise]
w = {{ box = [[-0.001, 0.001]] }}
v = {{ box = [[-1e12, 1e12]] }}
"#
    )
}

const ZMV: &str = "{ id = \"zmv\", kind = \"zmv\", generators = 4 }";
const LIFT: &str = "{ id = \"lift\", kind = \"lift\" }";

fn run(text: &str) -> (Folder, Outcome) {
    let folder = Folder::new();
    folder.write("a.toml", text);
    let outcome = folder.run(&["run", "a.toml"]);
    (folder, outcome)
}

#[test]
fn what_new_writes_is_understood_and_runs() {
    for system in SYSTEMS {
        let folder = Folder::new();
        let file = format!("my {system}.toml");
        folder.done(&["new", &file, "--system", system]);
        let checked = folder.done(&["check", &file]);
        assert!(
            checked.stdout.starts_with(&format!("mine/my-{system}\n")),
            "{}",
            checked.stdout
        );
        assert_eq!(checked.stderr, "", "{system}");
        assert!(!folder.path("lake").exists(), "check writes nothing");
        folder.done(&["run", &file]);
        folder.done(&["verify"]);
    }
}

#[test]
fn new_keeps_a_file_that_is_there() {
    let folder = Folder::new();
    folder.write("a.toml", "mine");
    folder
        .run(&["new", "a.toml"])
        .ends_with(2)
        .says(&["a.toml", "--force"]);
    assert_eq!(std::fs::read(folder.path("a.toml")).unwrap(), b"mine");
    folder.done(&["new", "a.toml", "--force"]);
    folder.done(&["check", "a.toml"]);
    folder
        .run(&["new", "no/such/folder/a.toml"])
        .ends_with(1)
        .says(&["no/such/folder/a.toml"]);
    folder
        .run(&["new", "b.toml", "--system", "linaer"])
        .ends_with(2)
        .says(&["linaer", "linear"]);
}

#[test]
fn check_says_what_was_understood() {
    let folder = Folder::new();
    folder.done(&["new", "pendulum.toml"]);
    let said = folder.done(&["check", "pendulum.toml"]).stdout;
    for part in [
        "system: equations, every 0.02 s",
        "x   2  state: phi in rad, omega in rad/s",
        "u   0  input: none",
        "next: not linear in x, without u, linear in w",
        "output: not linear in x, without u, linear in v",
        "at the center of the prior, phi = 0.3, omega = 0",
        "next by x",
        "lift          guaranteed; in the file as lift",
        "zmv           guaranteed",
        "kalman        it needs a system of kind linear",
        "20 runs of 100 steps: at most",
        "MB of memory",
    ] {
        assert!(said.contains(part), "no {part:?} in\n{said}");
    }
    // ∂omega⁺/∂phi = −T g/l cos(0.3), ∂omega⁺/∂omega = 1 − T drag.
    let row = said
        .lines()
        .find(|l| l.trim_start().starts_with("omega+  "))
        .unwrap();
    assert_eq!(
        row.split_whitespace().collect::<Vec<_>>(),
        ["omega+", "-0.1874", "0.998"]
    );

    folder.done(&["new", "cart.toml", "--system", "linear"]);
    let said = folder.done(&["check", "cart.toml"]).stdout;
    for part in [
        "linear in x, u, w and v",
        "kalman        not guaranteed",
        "box-state-est guaranteed",
    ] {
        assert!(said.contains(part), "no {part:?} in\n{said}");
    }
}

#[test]
fn check_warns_of_what_is_perhaps_not_meant() {
    let folder = Folder::new();
    let text = alone("x + w", 0.0, 1.0, LIFT).replace("output = { y = \"x", "output = { y = \"x*x");
    folder.write("a.toml", &text);
    let told = folder.done(&["check", "a.toml"]).stderr;
    for part in [
        "warning: a.toml:19: system.output.y: column 1: expected x^2, got x*x",
        "warning: a.toml:16: system.parameters.gain: expected an equation that holds gain, got none",
        "warning: a.toml:17: system.let.swing: expected an equation that holds swing, got none",
    ] {
        assert!(told.contains(part), "no {part:?} in\n{told}");
    }
    let still = alone("x", 0.0, 1.0, LIFT);
    folder.write("a.toml", &still);
    let told = folder.done(&["check", "a.toml"]).stderr;
    assert!(
        told.contains("system.next.x: column 1: expected an equation that moves x"),
        "{told}"
    );
}

#[test]
fn a_mistake_is_answered_by_check_as_by_run() {
    for (old, new, part) in [
        (
            "sin(x)",
            "sinn(x)",
            "a.toml:17: system.let.swing: column 6: expected a function, got \"sinn\"",
        ),
        (
            "swing = \"gain*sin(x)\"",
            "swing = \"2*b\", b = \"swing\"",
            "a.toml:17: system.let.swing: column 3: expected a definition that does not need itself, got swing -> b -> swing in a circle",
        ),
        (
            "swing = \"gain*sin(x)\"",
            "swing = \"2*b\", b = \"x\"",
            "system.let.swing: column 3: expected a name that stands above it in let, got \"b\", which stands below it",
        ),
        (
            "gain = 1.5",
            "gain = nan",
            "a.toml:16: system.parameters.gain: expected a finite number, got nan",
        ),
        (
            "x + swing + w",
            "x/(gain - 1.5) + w",
            "a.toml:18: system.next.x: column 1: expected a divisor that is not 0, got 0",
        ),
        (
            "x + swing + w",
            "x + gain(x) + w",
            "system.next.x: column 5: expected a function, got \"gain\"",
        ),
        (
            "x + swing + w",
            "x + sin + w",
            "system.next.x: column 9: expected `(` after the function sin",
        ),
        (
            "x = { x = \"1\" }",
            "x = { gain = \"1\" }",
            "expected a name that stands once, got \"gain\" twice",
        ),
        (
            "next = { x = ",
            "next = { z = ",
            "a.toml:18: system.next.z: expected an equation for one of x, got one for \"z\"",
        ),
        (
            "w = { w = \"1\" }",
            "w = { w = \"metre\" }",
            "a.toml:13: system.w.w: expected a UCUM unit",
        ),
    ] {
        let text = alone("x + swing + w", 0.0, 1.0, LIFT);
        assert!(text.contains(old), "{old}");
        let folder = Folder::new();
        folder.write("a.toml", text.replacen(old, new, 1));
        for command in ["check", "run"] {
            folder.run(&[command, "a.toml"]).ends_with(2).says(&[part]);
        }
    }
}

#[test]
fn a_set_that_feeds_on_itself_is_diverged_and_the_others_run_on() {
    // Over a wide set the slope of x + 1.5 sin x is 2.5, and the mean value form multiplies by it at each step; the state stays.
    // What the other is told of the measurement keeps its sets small.
    let other = "{ id = \"lift\", kind = \"lift\", noise = { v = { box = [[-0.1, 0.1]] } } }";
    let text = alone("x + swing + w", 0.1, 6.2, &format!("{ZMV}, {other}"));
    let (folder, outcome) = run(&(text + "\n[truth]\nv = { law = \"zero\" }\n"));
    assert!(!outcome.stderr.contains("lift, run"), "{}", outcome.stderr);
    outcome.ends_with(1).says(&[
        "mine/alone: zmv, run 0, k = 20: diverged: the enclosure of x grows without end",
        "`gain*sin(x)` in let.swing, column 1, contributes most; its derivative by x is in [-1.5, 1.5]",
        "what may help",
    ]);
    let rows = folder.done(&[
        "query",
        "SELECT estimator, max(k) AS k FROM estimates WHERE status = 'ok' GROUP BY estimator ORDER BY estimator",
        "--format",
        "csv",
    ]);
    // The predicted set of the step in which it ended is there.
    assert_eq!(rows.stdout.trim(), "estimator,k\nlift,60\nzmv,20");
    let last = folder.done(&[
        "query",
        "SELECT k, status, lower FROM estimates WHERE estimator = 'zmv' AND status <> 'ok'",
        "--format",
        "csv",
    ]);
    assert_eq!(last.stdout.trim(), "k,status,lower\n20,diverged,");
}

#[test]
fn a_set_that_overflows_is_diverged() {
    let (_, outcome) = run(&alone("1.6*x - 0.6*x^3 + w", 0.2, 1.8, ZMV));
    outcome.ends_with(1).says(&[
        "diverged: the enclosure of x is no longer finite",
        "`0.6*x^3` in next.x, column 9",
    ]);
}

#[test]
fn a_term_that_leaves_its_domain_is_told_with_its_place_and_its_operand() {
    let (_, outcome) =
        run(&(alone("x - 0.02*sqrt(x) + w", -0.2, 0.8, ZMV) + "\n[truth]\nx0 = [0.6]\n"));
    outcome
        .ends_with(1)
        .says(&["zmv, run 0, k = 1: failed: `sqrt(x)` in next.x, column 10, needs"]);
}

#[test]
fn files_that_are_too_much_are_answered_at_once() {
    let of = |old: &str, new: String| alone("x + swing + w", 0.0, 1.0, LIFT).replacen(old, &new, 1);
    let lets: String = (0..1_000_000).map(|i| format!("d{i} = \"x\"\n")).collect();
    let cases = [
        (
            "10 MB of an equation",
            of("x + swing + w", "x + ".repeat(2_500_000)),
            "at most",
        ),
        (
            "10 MB of a comment",
            of(
                "schema = 1",
                format!("# {}\nschema = 2", "x".repeat(10_000_000)),
            ),
            "at most",
        ),
        (
            "10000 parentheses",
            of(
                "x + swing + w",
                format!("{}x{}", "(".repeat(10_000), ")".repeat(10_000)),
            ),
            "nesting",
        ),
        (
            "10000 signs",
            of("x + swing + w", "-".repeat(10_000) + "x"),
            "nesting",
        ),
        (
            "as many definitions as a file holds",
            of("let = { swing = \"gain*sin(x)\" }\n", String::new())
                + "\n[system.let]\n"
                + &lets[..4_000_000 - lets[..4_000_000].rsplit('\n').next().map_or(0, str::len)],
            "at most 65536 names",
        ),
        (
            "a million definitions",
            of("let = { swing = \"gain*sin(x)\" }\n", String::new()) + "\n[system.let]\n" + &lets,
            "at most",
        ),
        (
            "a long name",
            of("x + swing + w", "z".repeat(1_000_000)),
            "expected a name",
        ),
    ];
    for (what, text, part) in cases {
        let folder = Folder::new();
        folder.write("a.toml", text);
        for command in ["check", "run"] {
            let start = std::time::Instant::now();
            let outcome = folder.run(&[command, "a.toml"]).ends_with(2);
            let seconds = start.elapsed().as_secs_f64();
            println!(
                "{what}, {command}: {seconds:.2} s, {} bytes",
                outcome.stderr.len()
            );
            let outcome = outcome.says(&[part]);
            assert!(
                outcome.stderr.len() < 2500,
                "{what}: {} bytes",
                outcome.stderr.len()
            );
            // A second on a machine of one's own.
            assert!(seconds < 10.0, "{what}: {seconds} s");
        }
    }
}
