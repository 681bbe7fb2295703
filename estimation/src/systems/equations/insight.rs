//! What can be said of equations before and after a run: what is linear in what, what is written and perhaps not meant, and
//! which term makes a set wide.

use super::{
    Equations, Fault, Meaning, Motion, Named, Part, Reader, Source, Terms, Texts, Wrong, in_text,
    syntax, table_fault,
};
use crate::growth::largest;
use crate::propagation::Dynamics;
use std::collections::HashSet;
use zonobench_sets::number::jacobian;
use zonobench_sets::{Interval, IntervalVector};

/// How equations depend on a vector where all others are fixed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Dependence {
    /// They do not hold it.
    No,
    /// Linearly, a constant aside.
    Linear,
    /// Otherwise.
    Nonlinear,
}

impl Dependence {
    fn of(degree: u8) -> Self {
        match degree {
            0 => Self::No,
            1 => Self::Linear,
            _ => Self::Nonlinear,
        }
    }
}

/// A term of an equation, and how steep it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Term {
    /// `next`, `rate` or `let`.
    pub table: &'static str,
    /// Whose equation it is in.
    pub name: String,
    /// The column in its text, from 1.
    pub column: usize,
    /// The term as it is written.
    pub written: String,
    /// The state that it depends on most.
    pub state: usize,
    /// Its derivative by that state, over a set.
    pub derivative: Interval,
}

/// The most terms of a sum that are looked at.
const MOST_TERMS: usize = 256;

impl Equations {
    /// How x⁺ depends on x, u and w, and y on x, u and v: by structure.
    pub fn dependence(&self) -> [[Dependence; 3]; 2] {
        let n = self.0.source.x.len();
        [&self.0.next, &self.0.output].map(|tape| tape.degrees(n).map(Dependence::of))
    }

    /// The term in the equation of state `i` that widens its enclosure over the box `over` most: the largest |∂term/∂x_j| · rad x_j. A
    /// state that is carried over (`p` in `p + T*s`) is no such term.
    ///
    /// Where the term is a definition, it is the term in there.
    pub fn steepest(
        &self,
        i: usize,
        k: usize,
        over: &IntervalVector,
        u: &[f64],
        w: &[Interval],
    ) -> Option<Term> {
        let source = &self.0.source;
        let z: Vec<Interval> = over.iter().chain(w).copied().collect();
        // What is written as the equation of state i, its largest derivative, and how much it widens.
        let steepness = |written: &str| {
            let alone = Self::new(source.with_one(i, written)).ok()?;
            let found = jacobian(&Dynamics::new(&alone, k, u), &z);
            let (state, size) = largest(found.row(i), over);
            (size > 0.0).then(|| (found.get(i, state), state, size))
        };
        let (mut table, texts) = source.motion();
        let own = &source.x[i].0;
        let mut name = own.clone();
        let mut text = &texts.iter().find(|(n, _)| n == own)?.1;
        let mut found = None;
        loop {
            let terms = syntax::parse(text).ok()?;
            let mut steepest: Option<(Term, f64)> = None;
            for at in summands(&terms).into_iter().take(MOST_TERMS) {
                let range = &terms.list[at].1;
                let written = text.get(range.clone())?;
                if table == "next" && written == own {
                    continue;
                }
                let Some((derivative, state, size)) = steepness(written) else {
                    continue;
                };
                if steepest.as_ref().is_none_or(|(_, most)| size > *most) {
                    let term = Term {
                        table,
                        name: name.clone(),
                        column: range.start + 1,
                        written: written.to_owned(),
                        state,
                        derivative,
                    };
                    steepest = Some((term, size));
                }
            }
            let Some((term, _)) = steepest else {
                return found;
            };
            // Into the steepest of the definitions that the term names.
            let names: HashSet<String> = syntax::parse(&term.written).ok()?.names().collect();
            let named = source.definitions.iter().filter(|(n, _)| names.contains(n));
            let below = named
                .filter_map(|(n, t)| steepness(n).map(|(_, _, size)| (n, t, size)))
                .max_by(|a, b| a.2.total_cmp(&b.2));
            found = Some(term);
            match below {
                Some((n, t, _)) => (table, name, text) = ("let", n.clone(), t),
                None => return found,
            }
        }
    }
}

impl Source {
    /// The system whose state `i` moves as `written`, whose other states stay, and that measures nothing.
    fn with_one(&self, i: usize, written: &str) -> Self {
        let text = |(j, (name, _)): (usize, &(String, String))| {
            let text = if j == i { written } else { name.as_str() };
            (name.clone(), text.to_owned())
        };
        Self {
            y: Named::new(),
            v: Named::new(),
            motion: Motion::Next(self.x.iter().enumerate().map(text).collect()),
            output: Texts::new(),
            ..self.clone()
        }
    }
}

/// The terms of the sum that a text is, as places in its list.
fn summands(terms: &Terms) -> Vec<usize> {
    let mut found = Vec::new();
    let mut open = vec![terms.list.len() - 1];
    while let Some(at) = open.pop() {
        match terms.list[at].0 {
            syntax::Term::Add(a, b) | syntax::Term::Sub(a, b) => open.extend([b, a]),
            syntax::Term::Neg(a) => open.push(a),
            _ => found.push(at),
        }
    }
    found
}

impl Terms {
    /// The names in the text.
    fn names(&self) -> impl Iterator<Item = String> + '_ {
        self.list.iter().filter_map(|(term, _)| match term {
            syntax::Term::Name(name) => Some(name.clone()),
            _ => None,
        })
    }
}

impl Reader<'_> {
    /// The definitions that no equation needs: a name in them has to be one all the same.
    pub(super) fn check_unused(&self) -> Result<(), Fault> {
        let used = self.used();
        for (i, terms) in self.definitions.iter().enumerate() {
            let name = &self.source.definitions[i].0;
            if used.contains(name.as_str()) {
                continue;
            }
            for (term, range) in &terms.list {
                let syntax::Term::Name(of) = term else {
                    continue;
                };
                let wrong = match self.meanings.get(of.as_str()) {
                    Some(Meaning::Definition(j)) if *j >= i => self.not_above(i, *j, range),
                    None if !syntax::CONSTANTS.contains(&of.as_str()) => Wrong {
                        known: self.known(),
                        ..Wrong::new(
                            range.clone(),
                            "a name that the system has",
                            format!("{of:?}"),
                        )
                    },
                    _ => continue,
                };
                return Err(in_text("let", name, wrong));
            }
        }
        Ok(())
    }

    /// The names that `next` (or `rate`) and `output` hold, and the definitions that they need.
    fn used(&self) -> HashSet<&str> {
        let both = [&self.motion, &self.output];
        let needed = both
            .into_iter()
            .flat_map(|texts| self.named(texts))
            .map(|i| &self.definitions[i]);
        let mut used = HashSet::new();
        for terms in both.into_iter().flatten().chain(needed) {
            for (term, _) in &terms.list {
                if let syntax::Term::Name(name) = term {
                    used.insert(name.as_str());
                }
            }
        }
        // A definition that stands in another.
        let defined = both.into_iter().flat_map(|texts| self.named(texts));
        used.extend(defined.map(|i| self.source.definitions[i].0.as_str()));
        used
    }

    pub(super) fn warnings(&self) -> Vec<Fault> {
        let texts = self
            .definitions
            .iter()
            .chain(&self.motion)
            .chain(&self.output);
        let mut warnings = Vec::new();
        for ((table, name), terms) in self.names().into_iter().zip(texts) {
            for (term, range) in &terms.list {
                if let syntax::Term::Mul(a, b) = term
                    && let (syntax::Term::Name(a), syntax::Term::Name(b)) =
                        (&terms.list[*a].0, &terms.list[*b].0)
                    && a == b
                {
                    let part = Part::Text(table, name.clone(), range.clone());
                    let why =
                        "which forgets that both factors are the same: its enclosure is wider";
                    warnings.push(table_fault(
                        part,
                        format!("{a}^2"),
                        format!("{a}*{a}, {why}"),
                    ));
                }
            }
        }
        self.warn_of_states_that_stay(&mut warnings);
        self.warn_of_unused(&mut warnings);
        warnings
    }

    fn warn_of_states_that_stay(&self, warnings: &mut Vec<Fault>) {
        let (table, _) = self.source.motion();
        for ((name, _), terms) in self.source.x.iter().zip(&self.motion) {
            let [(only, range)] = &terms.list[..] else {
                continue;
            };
            let stays = match (&self.source.motion, only) {
                (Motion::Next(_), syntax::Term::Name(n)) => n == name,
                (Motion::Rate { .. }, syntax::Term::Number(x)) => *x == 0.0,
                _ => false,
            };
            if stays {
                warnings.push(table_fault(
                    Part::Text(table, name.clone(), range.clone()),
                    format!("an equation that moves {name}"),
                    "one in which it keeps its first value, without noise",
                ));
            }
        }
    }

    fn warn_of_unused(&self, warnings: &mut Vec<Fault>) {
        let used = self.used();
        let source = self.source;
        let of = |table: &'static str, names: &mut dyn Iterator<Item = &String>| {
            let unused: Vec<Fault> = names
                .filter(|name| !used.contains(name.as_str()))
                .map(|name| {
                    let part = Part::Name(table, name.clone());
                    table_fault(part, format!("an equation that holds {name}"), "none")
                })
                .collect();
            unused
        };
        warnings.extend(of("u", &mut source.u.iter().map(|(name, _)| name)));
        warnings.extend(of("w", &mut source.w.iter().map(|(name, _)| name)));
        warnings.extend(of("v", &mut source.v.iter().map(|(name, _)| name)));
        warnings.extend(of(
            "parameters",
            &mut source.parameters.iter().map(|(name, _)| name),
        ));
        warnings.extend(of(
            "let",
            &mut source.definitions.iter().map(|(name, _)| name),
        ));
    }
}
