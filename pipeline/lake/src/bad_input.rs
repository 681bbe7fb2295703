//! What is wrong with a file that a user wrote: which file, which line, which key or column, what was
//! expected and what came, with the place marked in the text where there is one.

use crate::Error;
use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode, SourceSpan};
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
    source: Option<Box<(NamedSource<String>, SourceSpan)>>,
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
        let start = text.floor_char_boundary(span.start);
        let line = 1 + text.as_bytes()[..start]
            .iter()
            .filter(|&&b| b == b'\n')
            .count();
        // One line is marked: a whole table would hide what is wrong with it.
        let end = text[start..]
            .find('\n')
            .map_or(text.len(), |at| start + at)
            .min(text.ceil_char_boundary(span.end.max(start)));
        let source = NamedSource::new(file, text.to_owned());
        Self {
            line: Some(line),
            source: Some(Box::new((source, (start..end).into()))),
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
            .as_ref()
            .map(|marked| &marked.0 as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let span = self.source.as_ref()?.1;
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

/// The candidate most like `word`, where one is near enough to be meant: one slip of the keyboard away,
/// or alike by Jaro and Winkler's measure.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    candidates
        .into_iter()
        .map(|candidate| {
            let slip = word.len() > 1 && strsim::osa_distance(word, candidate) == 1;
            (
                strsim::jaro_winkler(word, candidate).max(if slip { 0.9 } else { 0.0 }),
                candidate,
            )
        })
        .filter(|(likeness, _)| *likeness > 0.8)
        .fold(None, |best: Option<(f64, &str)>, this| match best {
            Some(best) if best.0 >= this.0 => Some(best),
            _ => Some(this),
        })
        .map(|(_, candidate)| candidate)
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
        assert_eq!(nearest("zzz", keys), None);
    }
}
