//! What is wrong with a file that a user wrote: which file, which line, which key or column, what was
//! expected and what came, with the place marked in the text where there is one.

use crate::Error;
use miette::{
    Diagnostic, LabeledSpan, MietteError, MietteSpanContents, SourceCode, SourceSpan, SpanContents,
};
use std::fmt;
use std::ops::Range;

/// A fault in a user's file.
///
/// Displayed in one line, `file:line: subject: expected …, got …`; as a diagnostic it marks the place.
#[derive(Debug)]
pub struct BadInput {
    file: String,
    line: Option<usize>,
    message: String,
    help: Option<String>,
    // Boxed, because a fault is returned by value all the way up.
    source: Option<Box<Snippet>>,
}

impl BadInput {
    /// A fault of the whole file.
    pub fn file(file: impl Into<String>, message: impl Into<String>) -> Self {
        Self {
            file: file.into(),
            line: None,
            message: message.into(),
            help: None,
            source: None,
        }
    }

    /// A fault at line `line`, counted from 1.
    pub fn line(file: impl Into<String>, line: usize, message: impl Into<String>) -> Self {
        Self {
            line: Some(line),
            ..Self::file(file, message)
        }
    }

    /// A fault at the bytes `span` of `text`, which is the content of `file`.
    pub fn span(file: &str, text: &str, span: Range<usize>, message: impl Into<String>) -> Self {
        let snippet = Snippet::around(file, text, span);
        Self {
            line: Some(1 + snippet.line),
            source: Some(Box::new(snippet)),
            ..Self::file(file, message)
        }
    }

    /// With a hint at what to do.
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// The message without the place.
    pub fn message(&self) -> &str {
        &self.message
    }
}

impl fmt::Display for BadInput {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, "{}:{line}: {}", self.file, self.message),
            None => write!(f, "{}: {}", self.file, self.message),
        }
    }
}

impl std::error::Error for BadInput {}

impl Diagnostic for BadInput {
    fn help(&self) -> Option<Box<dyn fmt::Display + '_>> {
        self.help
            .as_ref()
            .map(|help| Box::new(help) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.source
            .as_deref()
            .map(|snippet| snippet as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let span = self.source.as_ref()?.marked;
        Some(Box::new(std::iter::once(LabeledSpan::new_with_span(
            Some("here".into()),
            span,
        ))))
    }
}

impl From<BadInput> for Error {
    fn from(fault: BadInput) -> Self {
        Error::Input(Box::new(fault))
    }
}

/// The most characters of a line that are shown around a fault.
const MOST_WIDTH: usize = 120;

/// A marked line of a file with its neighbours, each cut to what fits a screen.
#[derive(Debug)]
struct Snippet {
    file: String,
    text: String,
    /// The bytes of `text` that are marked.
    marked: SourceSpan,
    /// The marked line, counted from 0.
    line: usize,
    /// The line with which `text` begins.
    first: usize,
    /// The column of the mark in its line, counted from 0.
    column: usize,
}

impl Snippet {
    /// Of the bytes `span` of `text`. One line is marked: a whole table would hide what is wrong with it.
    fn around(file: &str, text: &str, span: Range<usize>) -> Self {
        let start = text.floor_char_boundary(span.start);
        let line = text[..start].bytes().filter(|&b| b == b'\n').count();
        let begin = text[..start].rfind('\n').map_or(0, |at| at + 1);
        let end = text[start..].find('\n').map_or(text.len(), |at| start + at);
        let stop = end.min(text.ceil_char_boundary(span.end.max(start)));
        // The marked place stands a third of the width from the left, where the line is too long.
        let before = text[begin..start].chars().count();
        let cut = match before + text[start..end].chars().take(MOST_WIDTH).count() > MOST_WIDTH {
            true => before.saturating_sub(MOST_WIDTH / 3),
            false => 0,
        };
        let head = text[begin..].char_indices().nth(cut);
        let from = head.map_or(end, |(at, _)| begin + at);
        let shown = first_characters(&text[from..end], MOST_WIDTH);
        let mut snippet = String::new();
        if begin > 0 {
            let previous = text[..begin - 1].rfind('\n').map_or(0, |at| at + 1);
            snippet += first_characters(&text[previous..begin - 1], MOST_WIDTH).trim_end();
            snippet.push('\n');
        }
        let mark = snippet.len() + (start - from).min(shown.len());
        let length = (stop - start).min(snippet.len() + shown.len() - mark);
        snippet += shown;
        if end < text.len() {
            let next = text[end + 1..].lines().next().unwrap_or_default();
            snippet.push('\n');
            snippet += first_characters(next, MOST_WIDTH);
        }
        Self {
            file: file.to_owned(),
            text: snippet,
            marked: (mark, length).into(),
            line,
            first: line - usize::from(begin > 0),
            column: before,
        }
    }
}

impl SourceCode for Snippet {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        lines_before: usize,
        lines_after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let part = self.text.read_span(span, lines_before, lines_after)?;
        // Without lines before, what is asked for is the place itself: the text may begin in the middle of its line.
        let column = match lines_before {
            0 => self.column,
            _ => part.column(),
        };
        Ok(Box::new(MietteSpanContents::new_named(
            self.file.clone(),
            part.data(),
            *part.span(),
            self.first + part.line(),
            column,
            part.line_count(),
        )))
    }
}

/// At most `most` characters of `text`, from its beginning.
fn first_characters(text: &str, most: usize) -> &str {
    let end = text.char_indices().nth(most);
    &text[..end.map_or(text.len(), |(at, _)| at)]
}

/// The most characters of a wrong value that a message repeats.
const MOST_SHOWN: usize = 80;

/// `text` in quotes, for "got …"; of a long one its beginning, and how long it is.
pub fn shown(text: &str) -> String {
    let head = first_characters(text, MOST_SHOWN);
    format!("{head:?}{}", rest(head, text))
}

/// A key or a number as it is; of a long one the beginning, and how long it is.
pub fn shortened(text: &str) -> String {
    let head = first_characters(text, MOST_SHOWN);
    format!("{head}{}", rest(head, text))
}

/// What says that `head` is not all of `text`.
fn rest(head: &str, text: &str) -> String {
    match head.len() == text.len() {
        true => String::new(),
        false => format!("... ({} characters)", text.chars().count()),
    }
}

/// What a parser says, which may hold a value.
pub fn brief(complaint: &str) -> String {
    let head = first_characters(complaint, 3 * MOST_SHOWN);
    format!(
        "{head}{}",
        if head.len() == complaint.len() {
            ""
        } else {
            "..."
        }
    )
}

/// The longest word for which another is suggested.
const LONGEST_WORD: usize = 64;

/// The candidate most like `word`, where one is near enough to be meant: a few slips of the keyboard away
/// (a letter too many, missing, wrong, or swapped with its neighbour, by Damerau and Levenshtein), or
/// alike by Jaro and Winkler's measure.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let length = word.chars().take(LONGEST_WORD + 1).count();
    if length > LONGEST_WORD {
        return None;
    }
    let allowed = match length {
        0..=1 => 0,
        2..=4 => 1,
        5..=8 => 2,
        _ => 3,
    };
    let lower = word.to_lowercase();
    candidates
        .into_iter()
        .map(|candidate| {
            let slips = strsim::damerau_levenshtein(&lower, candidate);
            (slips, strsim::jaro_winkler(word, candidate), candidate)
        })
        .filter(|(slips, likeness, _)| *slips <= allowed || *likeness > 0.8)
        .min_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)))
        .map(|(_, _, candidate)| candidate)
}

/// `a, b, c`.
pub fn listed<'a>(words: impl IntoIterator<Item = &'a str>) -> String {
    words.into_iter().collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_names_its_line_and_marks_its_place() {
        let text = "schema = 1\nruns = \"ten\"\n";
        let fault = BadInput::span(
            "a.toml",
            text,
            18..23,
            "runs: expected an integer, got \"ten\"",
        )
        .with_help("write runs = 10");
        assert_eq!(
            fault.to_string(),
            "a.toml:2: runs: expected an integer, got \"ten\""
        );
        let mut drawn = String::new();
        miette::NarratableReportHandler::new()
            .render_report(&mut drawn, &fault)
            .unwrap();
        assert!(drawn.contains("snippet line 2: runs = \"ten\""), "{drawn}");
        assert!(
            drawn.contains("label at line 2, columns 8 to 12: here"),
            "{drawn}"
        );
        assert!(drawn.contains("write runs = 10"), "{drawn}");
        assert_eq!(Error::from(fault).exit_code(), 2);
    }

    #[test]
    fn a_span_past_the_end_is_the_end() {
        assert_eq!(BadInput::span("a", "x\n", 9..12, "m").to_string(), "a:2: m");
    }

    #[test]
    fn the_nearest_word_is_found_and_a_strange_one_is_not() {
        let keys = ["generators", "constraints", "h"];
        assert_eq!(nearest("generator", keys), Some("generators"));
        assert_eq!(nearest("swa", ["square", "saw"]), Some("saw"));
        assert_eq!(nearest("kidn", ["id", "kind"]), Some("kind"));
        assert_eq!(nearest("td", ["dt"]), Some("dt"));
        assert_eq!(
            nearest("esmtiator", ["metric", "estimator"]),
            Some("estimator")
        );
        assert_eq!(nearest("K", ["y1", "k"]), Some("k"));
        assert_eq!(nearest("zzz", keys), None);
        assert_eq!(nearest("x", keys), None);
        assert_eq!(nearest(&"generators".repeat(1000), keys), None);
    }

    #[test]
    fn a_long_value_is_shown_by_its_beginning_and_its_length() {
        assert_eq!(shown("a\"b"), "\"a\\\"b\"");
        let long = "1".repeat(2_000_000);
        let said = shown(&long);
        assert!(
            said.len() < 120 && said.ends_with("1\"... (2000000 characters)"),
            "{said}"
        );
        assert_eq!(shown(&"é".repeat(80)), format!("{:?}", "é".repeat(80)));
    }

    #[test]
    fn a_long_line_is_shown_around_its_fault() {
        let text = format!(
            "a = 1\nb = [{}oops{}]\nc = 3\n",
            "é, ".repeat(200_000),
            "1, ".repeat(200_000)
        );
        let at = text.find("oops").unwrap();
        let fault = BadInput::span("a.toml", &text, at..at + 4, "b: expected a number");
        assert_eq!(fault.to_string(), "a.toml:2: b: expected a number");
        let mut drawn = String::new();
        miette::GraphicalReportHandler::new_themed(miette::GraphicalTheme::unicode_nocolor())
            .render_report(&mut drawn, &fault)
            .unwrap();
        assert!(drawn.chars().count() < 1000, "{drawn}");
        for part in [
            "a.toml:2:600006]",
            "1 │ a = 1",
            "2 │ ",
            "oops",
            "here",
            "3 │ c = 3",
        ] {
            assert!(drawn.contains(part), "no {part:?} in\n{drawn}");
        }
        // The mark of a whole line ends where the line is cut.
        let whole = BadInput::span("a.toml", &text, 6..text.len(), "b: no");
        let mut drawn = String::new();
        miette::GraphicalReportHandler::new()
            .render_report(&mut drawn, &whole)
            .unwrap();
        assert!(drawn.chars().count() < 1500, "{drawn}");
    }
}
