//! A finding: the text of a reason, with places for measured numbers, and the word that it begins with.

use super::cell::Score;
use crate::verdict::Verdict;
use zonobench_lake::bad_input::nearest;

/// What a finding says of a verdict, before its text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prefix {
    /// `Not reproducible:` the paper does not print what decides it; the text has the range that was seen.
    NotReproducible,
    /// `Fitted:` what the paper leaves open was chosen so that the numbers agree.
    Fitted,
    /// `By accident:` the numbers agree by other things than the paper's.
    ByAccident,
    /// `Slip:` the paper's own proof, or an equation beside it, corrects the claim; the text says which.
    Slip,
    /// `Damaged:` our text of the paper is damaged there.
    Damaged,
}

impl Prefix {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::NotReproducible,
        Self::Fitted,
        Self::ByAccident,
        Self::Slip,
        Self::Damaged,
    ];

    /// The words before the colon.
    pub fn words(self) -> &'static str {
        match self {
            Self::NotReproducible => "Not reproducible",
            Self::Fitted => "Fitted",
            Self::ByAccident => "By accident",
            Self::Slip => "Slip",
            Self::Damaged => "Damaged",
        }
    }

    /// The verdict that it makes of another one; that one itself where it does not fit it.
    pub fn on(self, verdict: Verdict) -> Verdict {
        use Verdict::{Differs, DoesNotHold, Holds, HoldsAsBound, Undecided};
        match self {
            Self::NotReproducible => match verdict {
                Differs | Holds | HoldsAsBound | DoesNotHold | Undecided => {
                    Verdict::NotReproducible
                }
                other => other,
            },
            Self::Fitted if verdict.is_success() => Verdict::Fitted,
            Self::ByAccident if verdict.is_success() => Verdict::ByAccident,
            Self::Slip if verdict == DoesNotHold => Verdict::Slip,
            Self::Damaged if matches!(verdict, Differs | DoesNotHold) => Verdict::LostInSource,
            _ => verdict,
        }
    }
}

/// A measured number that a finding has a place for.
#[derive(Clone, Debug, PartialEq)]
pub enum Place {
    /// Ours.
    Reproduced,
    /// The paper's.
    Published,
    /// Lower end of the prediction interval.
    Lo,
    /// Its upper end.
    Hi,
    /// 100 (reproduced − published) / published.
    RelDiff,
    /// Our runs.
    Runs,
    /// The standard deviation of a run.
    Sd,
    /// Whose spread a number of one run was lent.
    Spread,
    /// Another score; without experiments, of those of the cell.
    Score(Score),
}

/// The places that have no argument.
const PLACES: [(&str, Place); 8] = [
    ("reproduced", Place::Reproduced),
    ("published", Place::Published),
    ("lo", Place::Lo),
    ("hi", Place::Hi),
    ("rel_diff", Place::RelDiff),
    ("n", Place::Runs),
    ("sd", Place::Sd),
    ("spread", Place::Spread),
];

/// A part of a finding's text.
#[derive(Clone, Debug, PartialEq)]
pub enum Piece {
    /// Words.
    Text(String),
    /// A number to come.
    Place(Place),
}

/// The text of a reason.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Finding {
    /// What it says of the verdict.
    pub prefix: Option<Prefix>,
    /// The text, without the prefix.
    pub pieces: Vec<Piece>,
}

impl Finding {
    /// Parses a column `finding`. Fails with what was expected and what came where a place is misspelt.
    pub fn parse(text: &str) -> Result<Self, (String, String)> {
        let (prefix, text) = prefix_of(text)?;
        let mut pieces = Vec::new();
        let mut words = String::new();
        let mut rest = text;
        while let Some((before, after)) = rest.split_once('{') {
            words += before;
            let Some((inside, tail)) = after.split_once('}') else {
                rest = after;
                words.push('{');
                continue;
            };
            rest = tail;
            match place(inside)? {
                Some(place) => {
                    pieces.push(Piece::Text(std::mem::take(&mut words)));
                    pieces.push(Piece::Place(place));
                }
                // The braces of a set in the text.
                None => words += &format!("{{{inside}}}"),
            }
        }
        words += rest;
        pieces.push(Piece::Text(words));
        pieces.retain(|piece| *piece != Piece::Text(String::new()));
        Ok(Self { prefix, pieces })
    }

    /// Whether it says anything.
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// Whether the text is shown beside `verdict`: always after a prefix, else where it explains why not.
    pub fn is_shown(&self, verdict: Verdict) -> bool {
        let explains = matches!(
            verdict,
            Verdict::Undecided
                | Verdict::Differs
                | Verdict::DoesNotHold
                | Verdict::NotReproducible
                | Verdict::LostInSource
                | Verdict::Error
        );
        !self.is_empty() && (self.prefix.is_some() || explains)
    }

    /// The verdict, as the prefix has it.
    pub fn on(&self, verdict: Verdict) -> Verdict {
        self.prefix.map_or(verdict, |prefix| prefix.on(verdict))
    }
}

/// A prefix and what follows it. A text that begins nearly as one of them does is refused.
fn prefix_of(text: &str) -> Result<(Option<Prefix>, &str), (String, String)> {
    let Some((words, rest)) = text.split_once(':') else {
        return Ok((None, text));
    };
    if let Some(prefix) = Prefix::ALL.into_iter().find(|p| p.words() == words) {
        return Ok((Some(prefix), rest.trim_start()));
    }
    let near = nearest(words, Prefix::ALL.map(Prefix::words));
    match near
        .filter(|near| strsim::osa_distance(near, words) <= 2 || near.eq_ignore_ascii_case(words))
    {
        Some(near) => Err((
            format!("a finding that begins with {near:?}, or with other words"),
            format!("{words:?}"),
        )),
        None => Ok((None, text)),
    }
}

/// The place that stands in braces; None for the braces of a set.
fn place(inside: &str) -> Result<Option<Place>, (String, String)> {
    let wrong = |expected: String| Err((expected, format!("{{{inside}}}")));
    if let Some(subject) = inside.strip_prefix("score:") {
        return match Score::of_place(subject) {
            Some(score) => Ok(Some(Place::Score(score))),
            None => wrong(
                "{score:EXPERIMENT:ESTIMATOR:METRIC} or {score:EXPERIMENT:ESTIMATOR:METRIC:COMPONENT}"
                    .to_owned(),
            ),
        };
    }
    if let Some((_, place)) = PLACES.iter().find(|(name, _)| *name == inside) {
        return Ok(Some(place.clone()));
    }
    let names = PLACES.iter().map(|(name, _)| *name);
    match nearest(inside, names.filter(|name| name.len() > 2)) {
        Some(near) if inside.len() > 2 => wrong(format!("a place (did you mean {{{near}}}?)")),
        _ => Ok(None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_prefix_makes_another_verdict_only_of_what_it_fits() {
        use Verdict::{
            ByAccident, Differs, DoesNotHold, Exact, Fitted, Holds, LostInSource, NotReproducible,
            Slip, Undecided, WithinCi,
        };
        for (text, before, after) in [
            ("Not reproducible: a", Differs, NotReproducible),
            ("Not reproducible: a", Holds, NotReproducible),
            ("Not reproducible: a", DoesNotHold, NotReproducible),
            ("Not reproducible: a", WithinCi, WithinCi),
            ("Fitted: a", WithinCi, Fitted),
            ("Fitted: a", Differs, Differs),
            ("By accident: a", Exact, ByAccident),
            ("By accident: a", DoesNotHold, DoesNotHold),
            ("Slip: a", DoesNotHold, Slip),
            ("Slip: a", Holds, Holds),
            ("Slip: a", Differs, Differs),
            ("Damaged: a", DoesNotHold, LostInSource),
            ("Damaged: a", Differs, LostInSource),
            ("Damaged: a", Holds, Holds),
            ("a", Undecided, Undecided),
        ] {
            let finding = Finding::parse(text).unwrap();
            assert_eq!(finding.on(before), after, "{text} {before}");
            assert!(finding.is_shown(after), "{text} {after}");
        }
        assert!(!Finding::parse("a").unwrap().is_shown(Holds));
        assert!(!Finding::default().is_shown(Differs));
    }

    #[test]
    fn places_are_read_and_the_braces_of_a_set_are_text() {
        let finding = Finding::parse("of {w, v} in {lo}: {score:.:czmv:rmse:x1}{").unwrap();
        let [
            Piece::Text(a),
            Piece::Place(Place::Lo),
            Piece::Text(_),
            Piece::Place(Place::Score(s)),
            Piece::Text(e),
        ] = &finding.pieces[..]
        else {
            panic!("{finding:?}");
        };
        assert_eq!((a.as_str(), e.as_str()), ("of {w, v} in ", "{"));
        assert_eq!((s.experiments.len(), s.component.as_str()), (0, "x1"));
    }

    #[test]
    fn a_slip_of_the_keyboard_is_refused() {
        for (text, near) in [
            ("{reproducd} is it", "{reproduced}"),
            ("Sllip: b", "\"Slip\""),
            ("Not Reproducible: b", "\"Not reproducible\""),
            ("{score:a:b} c", "METRIC"),
        ] {
            let (expected, _) = Finding::parse(text).unwrap_err();
            assert!(expected.contains(near), "{text}: {expected}");
        }
        assert_eq!(Finding::parse("Not at every step: b").unwrap().prefix, None);
    }
}
