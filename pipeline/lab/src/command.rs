//! An estimator that is a program of the user's own: JSON lines over its standard input and output.
//!
//! A program is told the problem, then run after run and step after step what was measured, and answers each step with
//! what it knows; `docs/own-methods.md` has the lines. One process serves a block of runs. It never sees the truth,
//! and nothing that it says is believed: shapes are checked, sets are judged, its time is measured here. Whatever it
//! does, it costs its own run alone: a crash, a silence, a wrong answer each end the run with a status.
//!
//! Pipes block, so each side has a thread of its own, and the estimate stage waits on channels with a deadline.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TryRecvError, sync_channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use zonobench_estimation::system::Variable;
use zonobench_estimation::{AnyBelief, Problem, Reported, System as _, Uncertain};
use zonobench_lake::error::Error;
use zonobench_sets::Matrix;

/// The value of `kind`.
pub const KIND: &str = "command";

/// The keys of the kind.
pub const KEYS: &[&str] = &["command", "files", "timeout", "settings"];

/// The runs that one process serves.
pub const BLOCK: usize = 16;

/// Runs of a block that may fail in a row before its process is not started again.
const MOST_FAILURES: usize = 3;

/// The longest answer, in bytes.
const LONGEST_LINE: usize = 16 << 20;

/// What is kept of a program's error output: its last bytes.
const KEPT_OF_ERRORS: usize = 2000;

/// How long a program may take to end once its input has.
const GRACE: Duration = Duration::from_secs(1);

/// A program and what it is told. Its serialized form is part of the key of its results.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CommandSettings {
    /// Always [`KIND`].
    pub kind: &'static str,
    /// The program and its arguments.
    pub command: Vec<String>,
    /// The files that its answers depend on.
    pub files: Vec<HashedFile>,
    /// The longest time for a step, in s; the first answer of a process may take as long again.
    pub timeout: f64,
    /// What the program is told beside the problem, as it stands in the file.
    pub settings: Value,
    /// The folder that it is started in: that of the experiment file.
    #[serde(skip)]
    pub folder: PathBuf,
    /// Whether the user has allowed it to be started.
    #[serde(skip)]
    pub allowed: bool,
}

/// The complaint about a program that the user has not allowed to be started.
pub fn not_allowed(estimator: &str, settings: &CommandSettings) -> Error {
    Error::Refused {
        what: format!("estimator {estimator}"),
        expected: "--allow-commands, because its file wants to start a program with your rights"
            .to_owned(),
        got: format!("none, for: {}", settings.command.join(" ")),
    }
}

/// A file by its content.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct HashedFile {
    /// As the experiment names it.
    pub name: String,
    /// BLAKE3 of its bytes.
    pub blake3: String,
}

/// How a run of a program ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The status of its last row.
    pub status: String,
    /// Why, in words.
    pub cause: String,
}

impl Fault {
    fn failed(cause: impl Into<String>) -> Self {
        Self {
            status: "failed".to_owned(),
            cause: cause.into(),
        }
    }
}

/// What a program said of a step.
#[derive(Clone, Debug)]
pub struct Said {
    /// What it knows.
    pub belief: AnyBelief,
    /// Whether it claims that its set holds the state for certain.
    pub claims: bool,
}

/// A line of a program.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Answer {
    k: Option<usize>,
    status: Option<String>,
    reason: Option<String>,
    center: Option<Vec<f64>>,
    lower: Option<Vec<f64>>,
    upper: Option<Vec<f64>>,
    generators: Option<Vec<Vec<f64>>>,
    constraints: Option<Constraints>,
    covariance: Option<Vec<Vec<f64>>>,
    guaranteed: Option<bool>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Constraints {
    a: Vec<Vec<f64>>,
    b: Vec<f64>,
}

/// The first line: everything that an estimator is told.
pub fn problem_line(problem: &Problem, steps: usize, settings: &Value) -> String {
    let variables = problem.system.variables();
    let named = |list: &[Variable]| -> Value {
        let one = |v: &Variable| json!({ "name": v.name, "unit": v.unit });
        list.iter().map(one).collect()
    };
    let uncertain = |part: &Uncertain| {
        let sides = part
            .bounds
            .as_ref()
            .map(|sides| -> Vec<[f64; 2]> { sides.iter().map(|s| [s.lo(), s.hi()]).collect() });
        let constraints = part.constraints.as_ref();
        json!({
            "center": part.center,
            "generators": part.generators,
            "box": sides,
            "constraints": constraints.map(|(a, b)| json!({ "a": a, "b": b })),
            "mean": part.mean,
            "covariance": part.covariance,
        })
    };
    let linear = problem.system.linear_parts();
    let linear = linear.map(|l| json!({ "a": l.a, "b": l.b, "c": l.c, "d": l.d }));
    let line = json!({ "problem": {
        "kind": problem.system.kind(),
        "system": problem.system,
        "linear": linear,
        "period": problem.system.period(),
        "steps": steps,
        "x": named(&variables.x),
        "u": named(&variables.u),
        "w": named(&variables.w),
        "y": named(&variables.y),
        "v": named(&variables.v),
        "prior": uncertain(&problem.prior),
        "noise": { "w": uncertain(&problem.w), "v": uncertain(&problem.v) },
        "settings": settings,
    }});
    line.to_string()
}

/// What a program is told, for all of its processes.
pub struct Program<'a> {
    settings: &'a CommandSettings,
    hello: String,
    n: usize,
}

impl<'a> Program<'a> {
    /// Of an estimator that is a program.
    pub fn new(settings: &'a CommandSettings, problem: &Problem, steps: usize) -> Self {
        Self {
            settings,
            hello: problem_line(problem, steps, &settings.settings),
            n: problem.system.variables().x.len(),
        }
    }

    /// A process for a block of runs; it is started with the first.
    pub fn block(&self) -> Block<'_> {
        Block {
            program: self,
            talk: None,
            failures: 0,
            last: None,
        }
    }
}

/// A process and the runs that it serves, one after the other.
pub struct Block<'a> {
    program: &'a Program<'a>,
    talk: Option<Talk>,
    failures: usize,
    last: Option<Fault>,
}

impl Block<'_> {
    /// Begins a run; starts the program where it is not running.
    pub fn begin(&mut self, run: usize) -> Result<(), Fault> {
        if self.failures >= MOST_FAILURES
            && let Some(last) = &self.last
        {
            let cause = format!(
                "not started again after {MOST_FAILURES} runs in a row that ended so: {}",
                last.cause
            );
            return Err(Fault {
                status: last.status.clone(),
                cause,
            });
        }
        let talk = match self.talk.take() {
            Some(talk) => Ok(talk),
            None => Talk::start(self.program.settings, &self.program.hello),
        };
        let began = talk.and_then(|mut talk| {
            talk.silent()?;
            talk.say(json!({ "run": run }).to_string())?;
            Ok(talk)
        });
        match began {
            Ok(talk) => {
                self.talk = Some(talk);
                Ok(())
            }
            Err(fault) => Err(self.failed(fault)),
        }
    }

    /// One step: what was measured goes in, what is known comes out.
    pub fn step(&mut self, k: usize, u: &[f64], y: &[Option<f64>]) -> Result<Said, Fault> {
        let Some(talk) = &mut self.talk else {
            return Err(Fault::failed("the program is not running"));
        };
        let line = json!({ "k": k, "u": u, "y": y }).to_string();
        let timeout = self.program.settings.timeout;
        match talk
            .ask(line, timeout)
            .and_then(|answer| self.program.understood(k, &answer))
        {
            Ok(Ok(said)) => Ok(said),
            // Its own word: the run ends, the process serves the next one.
            Ok(Err(word)) => {
                self.failures = 0;
                Err(word)
            }
            Err(fault) => Err(self.failed(fault)),
        }
    }

    /// The run is over, and the program has answered every step.
    pub fn finished(&mut self) {
        self.failures = 0;
    }

    /// The process is ended; the next run starts another.
    fn failed(&mut self, fault: Fault) -> Fault {
        self.failures += 1;
        self.last = Some(fault.clone());
        if let Some(talk) = self.talk.take() {
            talk.kill();
        }
        fault
    }
}

impl Program<'_> {
    /// What an answer says: a belief, or that the program ends the run.
    fn understood(&self, k: usize, line: &[u8]) -> Result<Result<Said, Fault>, Fault> {
        let wrong = |what: String| Fault::failed(format!("answered step {k} with {what}"));
        let answer: Answer = serde_json::from_slice(line).map_err(|e| {
            let shown: String = String::from_utf8_lossy(line).chars().take(60).collect();
            wrong(format!("what is not understood ({e}): {shown}"))
        })?;
        if let Some(other) = answer.k.filter(|&other| other != k) {
            return Err(wrong(format!("what belongs to step {other}")));
        }
        match answer.status.as_deref().unwrap_or("ok") {
            "ok" => {}
            word @ ("inconsistent" | "refused" | "diverged" | "singular" | "overflow"
            | "failed") => {
                let cause = answer
                    .reason
                    .unwrap_or_else(|| "as the program says".to_owned());
                return Ok(Err(Fault {
                    status: word.to_owned(),
                    cause,
                }));
            }
            other => {
                let shown: String = other.chars().take(40).collect();
                return Err(wrong(format!(
                    "the status {shown:?}, which is none of ok, inconsistent, refused, diverged, singular, overflow \
                     and failed"
                )));
            }
        }
        let Some(center) = answer.center else {
            return Err(wrong("no center".to_owned()));
        };
        if center.len() != self.n {
            let (expected, got) = (self.n, center.len());
            return Err(wrong(format!("a center of {got} numbers, not {expected}")));
        }
        let matrix = |what: &str, rows: &[Vec<f64>]| {
            Matrix::from_rows(rows).map_err(|e| wrong(format!("{what}: {e}")))
        };
        let bounds = match (answer.lower, answer.upper) {
            (Some(lower), Some(upper)) => Some((lower, upper)),
            (None, None) => None,
            _ => return Err(wrong("one of lower and upper, not both".to_owned())),
        };
        let set = match (answer.generators, answer.constraints) {
            (None, None) => None,
            (None, Some(_)) => return Err(wrong("constraints without generators".to_owned())),
            (Some(g), constraints) => {
                let of = |c: Constraints| Ok((matrix("constraints", &c.a)?, c.b));
                Some((matrix("generators", &g)?, constraints.map(of).transpose()?))
            }
        };
        let covariance = answer
            .covariance
            .map(|p| matrix("covariance", &p))
            .transpose()?;
        let reported = Reported::new(center, bounds, set, covariance).map_err(wrong)?;
        Ok(Ok(Said {
            belief: AnyBelief::Reported(reported),
            claims: answer.guaranteed == Some(true),
        }))
    }
}

/// What came from a program's standard output.
enum Line {
    /// A line, without its end.
    Whole(Vec<u8>),
    /// More than [`LONGEST_LINE`] without an end.
    TooLong,
}

/// A running process.
struct Talk {
    child: Child,
    to: Option<SyncSender<String>>,
    from: Receiver<Line>,
    errors: Arc<Mutex<VecDeque<u8>>>,
    /// Nothing was answered yet: it is still starting.
    fresh: bool,
}

impl Talk {
    fn start(settings: &CommandSettings, hello: &str) -> Result<Self, Fault> {
        let (name, arguments) = settings
            .command
            .split_first()
            .expect("it was checked when it was read");
        // A path is one from the experiment's folder; a bare name is looked for as a shell does.
        let program = match name.contains(std::path::MAIN_SEPARATOR) || name.contains('/') {
            true => settings.folder.join(name),
            false => PathBuf::from(name),
        };
        let mut child = Command::new(&program)
            .args(arguments)
            .current_dir(match settings.folder.as_os_str().is_empty() {
                true => std::path::Path::new("."),
                false => &settings.folder,
            })
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|e| Fault::failed(format!("cannot be started: {name}: {e}")))?;
        let mut input = child.stdin.take().expect("it is a pipe");
        let output = child.stdout.take().expect("it is a pipe");
        let mut error = child.stderr.take().expect("it is a pipe");
        let (to, lines) = sync_channel::<String>(4);
        std::thread::spawn(move || {
            for mut line in lines {
                line.push('\n');
                // A program that reads no more has ended, or will be found to be silent.
                if input
                    .write_all(line.as_bytes())
                    .and_then(|()| input.flush())
                    .is_err()
                {
                    break;
                }
            }
        });
        let (found, from) = sync_channel(4);
        std::thread::spawn(move || read_lines(output, &found));
        let errors = Arc::new(Mutex::new(VecDeque::new()));
        let kept = errors.clone();
        std::thread::spawn(move || {
            let mut chunk = [0; 4096];
            while let Ok(n @ 1..) = error.read(&mut chunk) {
                let mut kept = kept.lock().unwrap_or_else(|e| e.into_inner());
                kept.extend(&chunk[..n]);
                let over = kept.len().saturating_sub(KEPT_OF_ERRORS);
                kept.drain(..over);
            }
        });
        let mut talk = Self {
            child,
            to: Some(to),
            from,
            errors,
            fresh: true,
        };
        talk.say(hello.to_owned())?;
        Ok(talk)
    }

    fn say(&mut self, line: String) -> Result<(), Fault> {
        let sent = self.to.as_ref().is_some_and(|to| to.send(line).is_ok());
        if sent { Ok(()) } else { Err(self.gone()) }
    }

    /// Fails where the program has said something that it was not asked for, or has ended.
    fn silent(&mut self) -> Result<(), Fault> {
        match self.from.try_recv() {
            Err(TryRecvError::Empty) => Ok(()),
            Err(TryRecvError::Disconnected) => Err(self.gone()),
            Ok(Line::TooLong) => Err(too_long()),
            Ok(Line::Whole(line)) => {
                let shown: String = String::from_utf8_lossy(&line).chars().take(60).collect();
                Err(Fault::failed(format!("spoke without being asked: {shown}")))
            }
        }
    }

    fn ask(&mut self, line: String, timeout: f64) -> Result<Vec<u8>, Fault> {
        self.silent()?;
        self.say(line)?;
        let timeout = if self.fresh { 2.0 * timeout } else { timeout };
        match self.from.recv_timeout(Duration::from_secs_f64(timeout)) {
            Ok(Line::Whole(line)) => {
                self.fresh = false;
                Ok(line)
            }
            Ok(Line::TooLong) => Err(too_long()),
            Err(RecvTimeoutError::Timeout) => Err(Fault {
                status: "timeout".to_owned(),
                cause: format!("no answer within {timeout} s"),
            }),
            Err(RecvTimeoutError::Disconnected) => Err(self.gone()),
        }
    }

    /// Why a program that has closed its output is gone, with the last line of its error output.
    fn gone(&mut self) -> Fault {
        let how = match self.wait(GRACE) {
            Some(status) => format!("the program ended ({status})"),
            None => "the program closed its output".to_owned(),
        };
        // What it wrote last may still be on its way.
        std::thread::sleep(Duration::from_millis(20));
        let errors = self.errors.lock().unwrap_or_else(|e| e.into_inner());
        let errors: Vec<u8> = errors.iter().copied().collect();
        let errors = String::from_utf8_lossy(&errors).into_owned();
        let last = errors.lines().rev().find(|line| !line.trim().is_empty());
        Fault::failed(last.map_or(how.clone(), |last| format!("{how}: {}", last.trim())))
    }

    /// Its exit status, if it ends within `most`.
    fn wait(&mut self, most: Duration) -> Option<std::process::ExitStatus> {
        let start = Instant::now();
        loop {
            if let Ok(Some(status)) = self.child.try_wait() {
                return Some(status);
            }
            if start.elapsed() >= most {
                return None;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    fn kill(mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
    }
}

impl Drop for Talk {
    /// Its input ends, and so should it; else it is killed. Nothing is left behind but what it has started itself.
    fn drop(&mut self) {
        self.to = None;
        if self.wait(GRACE).is_none() {
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}

fn too_long() -> Fault {
    Fault::failed(format!(
        "answered with more than {LONGEST_LINE} bytes without an end of line"
    ))
}

/// Hands on line after line until the output ends or nobody listens. The channel is short, so that a program that
/// speaks without end waits.
fn read_lines(output: impl Read, found: &SyncSender<Line>) {
    let mut output = BufReader::new(output);
    loop {
        let mut line = Vec::new();
        let most = LONGEST_LINE as u64 + 1;
        match output.by_ref().take(most).read_until(b'\n', &mut line) {
            Ok(0) | Err(_) => return,
            Ok(_) => {}
        }
        let line = match line.last() {
            Some(b'\n') => {
                line.pop();
                Line::Whole(line)
            }
            _ if line.len() > LONGEST_LINE => Line::TooLong,
            // The last line may have no end.
            _ => Line::Whole(line),
        };
        if found.send(line).is_err() {
            return;
        }
    }
}
