//! The dossier of a paper: what its authors would want to read. Every verdict that is not a success, its evidence, the
//! command that shows it, and what would change it.

use crate::about;
use crate::markdown::{code, escaped};
use crate::model;
use crate::page::{label, smoke_run};
use crate::source::{Held, Source};
use std::path::Path;
use zonobench_lake::digits::four_digits;
use zonobench_lake::error::Error;
use zonobench_verdicts::compare::interval;
use zonobench_verdicts::judged::{self, Judged};
use zonobench_verdicts::published::Comparand;
use zonobench_verdicts::verdict::Verdict;

/// The dossier of `paper`, as Markdown, from what the lake holds.
///
/// Fails where the lake has no comparison of that paper, naming those there are.
pub fn dossier(lake: &Path, paper: &str) -> Result<String, Error> {
    let all = Source::open(lake)?.papers()?;
    let compared = all.iter().filter(|held| !held.comparisons.is_empty());
    let Some(held) = compared.clone().find(|held| held.name == paper) else {
        let names: Vec<&str> = compared.map(|held| held.name.as_str()).collect();
        return Err(Error::Unknown {
            what: "paper in this lake",
            got: paper.to_owned(),
            expected: match &names[..] {
                [] => "it has no paper; `zonobench reproduce-all` makes them".to_owned(),
                names => format!("papers: {}", names.join(", ")),
            },
        });
    };
    Ok(of(held))
}

/// The verdicts in the order in which an author would want to see them, each with a heading.
const SECTIONS: [(Verdict, &str); 10] = [
    (Verdict::DoesNotHold, "Claims that we could not confirm"),
    (Verdict::Differs, "Numbers that came out otherwise"),
    (Verdict::Slip, "Slips of the pen"),
    (Verdict::Undecided, "Claims that our runs do not decide"),
    (
        Verdict::NotReproducible,
        "What the text does not say, and would decide it",
    ),
    (Verdict::Fitted, "What we chose so that it agrees"),
    (
        Verdict::ByAccident,
        "What agrees, but not by what the paper describes",
    ),
    (
        Verdict::LostInSource,
        "What is illegible or damaged in the text that we have",
    ),
    (Verdict::Error, "What we failed to compute"),
    (Verdict::Quick, "A smoke run"),
];

fn of(held: &Held) -> String {
    let mut out = match about::reference(&held.name) {
        Some(work) => format!(
            "# For the authors of “{}”\n\n{}\n\n",
            escaped(&work.title),
            escaped(&work.citation)
        ),
        None => format!("# For the authors of {}\n\n", escaped(&held.name)),
    };
    if held.is_quick() {
        return out + &smoke_run();
    }
    out += "Thank you for a paper that can be rebuilt from its text. We have done so: every experiment, with the equations and \
            parameters as they are printed, and set what came out beside what you print. This page is the part that did not \
            come out, or that we could not decide, with the evidence and a command for each. A verdict is about one number or one \
            sentence under one reading of it, not about the work; where we have misread you, we would like to be told, and \
            below each group stands what would change it.\n\n";
    out += "In all:\n\n";
    for tally in judged::tallies(held.comparisons.iter()) {
        out += &format!(
            "- {}\n",
            tally.sentence(|part| format!("{} {}", part.n, part.what))
        );
    }
    out += &format!(
        "\nThe commands read a lake that `zonobench reproduce-all --paper {0}` makes from the files in \
         `experiments/{0}`; its README lists each choice that the text left to us. Times are not here: they are of other machines.\n\n",
        held.name
    );
    let written = || held.comparisons.iter().filter(|c| c.is_as_written());
    for (verdict, title) in SECTIONS {
        let cells: Vec<&Judged> = written().filter(|c| c.verdict == verdict).collect();
        if !cells.is_empty() {
            out += &section(held, verdict, title, &cells);
        }
    }
    if written().all(|c| c.verdict.is_success()) {
        out += "Every number and every claim came out. There is nothing to ask.\n";
    }
    out.trim_end().to_owned() + "\n"
}

fn section(held: &Held, verdict: Verdict, title: &str, cells: &[&Judged]) -> String {
    let mut out = format!("## {title}\n\n");
    out += &format!("`{verdict}`: {}.\n\n", verdict.meaning());
    if cells.iter().any(|c| c.reason.contains("repaired: ")) {
        out += "“repaired: 0 of 300 lost”, for example, says that the statement with the correction that is named before it was tried \
                300 times, and failed in none.\n\n";
    }
    // Cells that share table, reason and command are one item.
    let mut items: Vec<(&Judged, Vec<&Judged>)> = Vec::new();
    for c in cells {
        let same = |(first, _): &&mut (&Judged, Vec<&Judged>)| {
            first.table == c.table
                && first.reason == c.reason
                && command(held, first) == command(held, c)
        };
        match items.iter_mut().find(same) {
            Some((_, all)) => all.push(c),
            None => items.push((c, vec![c])),
        }
    }
    for (first, all) in &items {
        let places: Vec<String> = all.iter().map(|c| place(c)).collect();
        out += &format!("- **{}**, {}\n", escaped(&first.table), places.join("; "));
        out += &format!(
            "  - Evidence: {}\n",
            escaped(first.reason.trim_end_matches('.'))
        );
        if let Some((asked, words)) = &first.asked {
            out += &format!("  - Read as: {}", code(&asked.to_string()));
            if !words.is_empty() {
                out += &format!(", {}", escaped(words.trim_end_matches('.')));
            }
            out.push('\n');
        }
        out += &format!("  - Shown by: {}\n", code(&command(held, first)));
        if let Some(answer) = answer_to(held, first) {
            out += &format!("  - It would change if {answer}\n");
        }
    }
    out + &format!("\n{}\n\n", answer(verdict))
}

/// What is printed, and ours.
fn place(c: &Judged) -> String {
    let column = match &*c.column {
        "" => String::new(),
        column => format!(", {}", label(column)),
    };
    let mut out = format!(
        "{}{column}: printed “{}”",
        label(&c.row),
        escaped(&c.published)
    );
    if let Some(ours) = c.reproduced {
        out += &format!(", ours {}", four_digits(ours));
    }
    if let Some((lo, hi)) = c.interval {
        out += &format!(", expected in {}", escaped(&interval(lo, hi)));
    }
    out
}

/// The one command that shows it.
fn command(held: &Held, c: &Judged) -> String {
    match model::mapped(held, c).map(|cell| &cell.comparand) {
        Some(Comparand::Claims(claim)) => {
            format!("zonobench claims {} --claim {claim}", held.name)
        }
        Some(Comparand::Complexity(_)) => format!("zonobench count {}", held.name),
        _ => format!("zonobench tables {} {:?}", held.name, &*c.table),
    }
}

/// What would change this very verdict.
fn answer_to(held: &Held, c: &Judged) -> Option<String> {
    let files = || {
        let cell = model::mapped(held, c)?;
        let paper = held.paper.as_ref()?;
        let mut files: Vec<String> = (cell.comparand.experiments().iter())
            .filter_map(|id| paper.file(id))
            .map(|file| code(&format!("experiments/{file}")))
            .collect();
        files.dedup();
        (!files.is_empty()).then(|| files.join(", "))
    };
    let comparand = model::mapped(held, c).map(|cell| &cell.comparand);
    match (c.verdict, comparand) {
        (Verdict::DoesNotHold | Verdict::Slip, Some(Comparand::Claims(_))) => Some(
            "the counterexample broke a hypothesis that the text states or implies, and that we have overlooked.".to_owned(),
        ),
        (Verdict::DoesNotHold, Some(Comparand::Complexity(_))) => Some(
            "an operation were counted that you do not mean, or the formula were of another step.".to_owned(),
        ),
        (Verdict::DoesNotHold, _) => {
            let (asked, _) = c.asked.as_ref()?;
            Some(format!("a setting in {} were as you had it, and the measured number then satisfied `{asked}`.", files()?))
        }
        (Verdict::Differs, _) => Some(format!(
            "a setting in {} were as you had it, and the printed number then lay in the interval.",
            files()?
        )),
        (Verdict::Undecided, _) => Some(format!("`runs` in {} were more.", files()?)),
        _ => None,
    }
}

/// How to answer a verdict of this kind.
fn answer(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::DoesNotHold => {
            "*How to answer:* tell us the hypothesis, the reading of a word or the setting under which you made the statement. We add \
             it as the reading, run it again, and the verdict follows; a statement is withdrawn from this list as soon as one \
             reading that its text allows makes it true."
        }
        Verdict::Differs => {
            "*How to answer:* a setting that we took from the text otherwise than you did is the likeliest cause: a step or a run \
             more, another start, a seed, a unit. A line of your code or your data file would settle it."
        }
        Verdict::Slip => {
            "*How to answer:* if you agree, nothing is needed: the method stands, we follow the corrected line. If the printed line \
             is meant, tell us what a symbol in it stands for."
        }
        Verdict::Undecided => {
            "*How to answer:* more runs decide it; if you have run more than we did, your number of runs and mean are enough."
        }
        Verdict::NotReproducible => {
            "*How to answer:* the missing value, table or data file. With it the row is an ordinary comparison; until then we claim \
             neither that the number is right nor that it is not."
        }
        Verdict::Fitted => {
            "*How to answer:* the value that you used. If it is the one we found, the row counts as reproduced."
        }
        Verdict::ByAccident => {
            "*How to answer:* the settings of this row as you ran it. The numbers agree, and the rest of the row says that they \
             agree for another reason."
        }
        Verdict::LostInSource => {
            "*How to answer:* the line as it stands in your copy. None of these is held against the paper."
        }
        _ => "This is ours to mend.",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_verdict_of_a_cell_that_is_no_success_has_a_section() {
        let sections: BTreeSet<Verdict> = SECTIONS.iter().map(|(verdict, _)| *verdict).collect();
        for verdict in Verdict::ALL {
            let wanted = verdict.is_of_a_cell() && !verdict.is_success();
            assert_eq!(sections.contains(&verdict), wanted, "{verdict}");
        }
    }
}
