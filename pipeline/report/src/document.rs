//! What a report says, before it is written: pages of blocks, blocks of inlines.
//!
//! A page is built once, from what the lake holds; `render` writes it as Markdown and as HTML. What only one of them
//! can show is a part of the model too: the bars of a table, or all digits of a number, are left out of Markdown; a
//! page whose numbers are of this machine alone has no file there.

pub mod prose;

use zonobench_verdicts::judged::Tally;
use zonobench_verdicts::verdict::{Tone, Verdict};

/// A page: a section of the HTML file, and a part of a Markdown file.
pub struct Page {
    /// Where links lead: `overview`, `paper-box`
    pub place: String,
    /// Its name in the navigation
    pub name: String,
    /// Its Markdown file; pages of the same file stand below each other. None for what was measured on this machine
    pub file: Option<String>,
    /// Its heading
    pub title: Line,
    /// What it says
    pub blocks: Vec<Block>,
}

/// Words of a sentence, a cell or a heading.
pub type Line = Vec<Inline>;

/// What stands below each other on a page.
#[derive(Clone, Debug, PartialEq)]
pub enum Block {
    /// A heading that links lead to
    Heading {
        /// 2 or more; 1 is the page's title
        level: usize,
        /// Its place on the page
        anchor: String,
        /// What it says
        text: Line,
    },
    /// A paragraph
    Para(Line),
    /// A paragraph that must not be overlooked
    Notice(Line),
    /// Items without an order
    List(Vec<Item>),
    /// Links to what is on the page, in groups
    Contents(Vec<Line>),
    /// What the cells came to
    Tallies(Vec<Tally>),
    /// A table
    Table(Table),
    /// What does not come out as written: a list in Markdown, a table that sorts in HTML
    Findings(Findings),
    /// A figure
    Picture(Picture),
    /// What is opened with a click
    Details {
        /// What is seen before
        summary: Line,
        /// What is seen then
        inside: Vec<Block>,
    },
    /// Lines that a person copies into a shell
    Commands(String),
}

/// An item of a list.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// What it says
    pub line: Line,
    /// The items below it
    pub below: Vec<Item>,
}

/// A piece of a [`Line`].
#[derive(Clone, Debug, PartialEq)]
pub enum Inline {
    /// Words as they are
    Text(String),
    /// Code
    Code(String),
    /// Words of weight
    Strong(Line),
    /// Another voice: a reading's name
    Emphasis(Line),
    /// What stands in the row above already: empty in Markdown
    Repeated(Line),
    /// A link
    Link(Target, Line),
    /// A verdict: its mark and its name
    Badge(Verdict),
    /// The mark of a verdict
    Mark(Verdict),
    /// A number of ours
    Ours(Ours),
    /// Shares of one bar, by colour: empty in Markdown
    Bar(Vec<(Tone, usize)>),
    /// Two marks on a scale, in percent of it: empty in Markdown
    Scale([f64; 2]),
    /// The line ends here
    Break,
}

/// Where a link leads.
#[derive(Clone, Debug, PartialEq)]
pub enum Target {
    /// A place on the same page
    Here(String),
    /// A page, by its place
    Page(String),
    /// A place on a page
    On(String, String),
    /// The web
    Web(String),
}

/// A number of ours, with what a screen shows of it on demand.
#[derive(Clone, Debug, PartialEq)]
pub struct Ours {
    /// All its digits
    pub exact: f64,
    /// Where the printed number is expected
    pub interval: Option<(f64, f64)>,
    /// `paper/experiment` and what else names its score, where that is known
    pub run: Vec<(String, String)>,
}

/// A table.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// What it shows; HTML has it above the table
    pub caption: String,
    /// What it is for
    pub kind: Kind,
    /// Its columns
    pub columns: Vec<Column>,
    /// Rows that belong together
    pub bodies: Vec<Vec<Row>>,
}

/// What a table is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// To be read
    Plain,
    /// To be sorted and searched
    Sortable,
    /// Printed cells one by one
    Cells,
    /// As the paper lays it out
    Grid,
    /// Tables by verdicts
    Matrix,
}

/// A column.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Its head
    pub name: Line,
    /// What is in it
    pub shape: Shape,
}

/// What is in a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Words
    Words,
    /// Numbers, which do not break
    Number,
    /// Sentences
    Why,
    /// Bars, for a screen alone
    Drawn,
}

/// A row.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Its cells, the first names it
    pub cells: Vec<Cell>,
    /// Whether it is the sum of others
    pub whole: bool,
}

/// A cell.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cell {
    /// What it says
    pub line: Line,
    /// Its colour
    pub tone: Option<Tone>,
}

/// The findings of one paper.
#[derive(Clone, Debug, PartialEq)]
pub struct Findings {
    /// What they are of
    pub caption: String,
    /// Table by table: a link to it and the command that shows it, and its findings
    pub tables: Vec<(Line, String, Vec<Finding>)>,
}

/// A finding: one cell, or several that share a reason.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// What is printed
    pub claims: Vec<Line>,
    /// What was measured; empty if nothing
    pub measured: Line,
    /// What came of it
    pub verdict: Verdict,
    /// Why
    pub why: Line,
    /// The query that gives the cell
    pub query: String,
}

/// A figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Its file beside the Markdown page
    pub file: String,
    /// What it shows, for those who cannot see it
    pub title: String,
    /// The picture
    pub svg: String,
    /// What stands below it
    pub caption: Line,
}

/// What can be put into a [`Line`] with [`line!`](crate::document::line).
pub trait Words {
    /// Puts itself at the end.
    fn put(self, line: &mut Line);
}

impl Words for &str {
    fn put(self, line: &mut Line) {
        if !self.is_empty() {
            line.push(Inline::Text(self.to_owned()));
        }
    }
}

impl Words for String {
    fn put(self, line: &mut Line) {
        if !self.is_empty() {
            line.push(Inline::Text(self));
        }
    }
}

impl Words for &String {
    fn put(self, line: &mut Line) {
        self.as_str().put(line);
    }
}

impl Words for Inline {
    fn put(self, line: &mut Line) {
        line.push(self);
    }
}

impl Words for Line {
    fn put(self, line: &mut Line) {
        line.extend(self);
    }
}

impl<T: Words> Words for Option<T> {
    fn put(self, line: &mut Line) {
        if let Some(words) = self {
            words.put(line);
        }
    }
}

/// A line of texts, inlines and lines.
macro_rules! line {
    ($($part:expr),* $(,)?) => {{
        #[allow(unused_mut)]
        let mut line: $crate::document::Line = Vec::new();
        $($crate::document::Words::put($part, &mut line);)*
        line
    }};
}
pub(crate) use line;

/// Code.
pub fn code(text: impl Into<String>) -> Inline {
    Inline::Code(text.into())
}

/// Words of weight.
pub fn strong(words: impl Words) -> Inline {
    Inline::Strong(line![words])
}

/// Another voice.
pub fn emphasis(words: impl Words) -> Inline {
    Inline::Emphasis(line![words])
}

/// A link to a place on the same page.
pub fn link_here(anchor: &str, words: impl Words) -> Inline {
    Inline::Link(Target::Here(anchor.to_owned()), line![words])
}

/// A link to a page.
pub fn link_page(place: &str, words: impl Words) -> Inline {
    Inline::Link(Target::Page(place.to_owned()), line![words])
}

/// A link to a place on a page.
pub fn link_on(place: &str, anchor: &str, words: impl Words) -> Inline {
    let target = Target::On(place.to_owned(), anchor.to_owned());
    Inline::Link(target, line![words])
}

/// A verdict read from a table; the bare word where this program does not know it.
pub fn badge(name: &str) -> Inline {
    Verdict::parse(name).map_or_else(|_| Inline::Text(name.to_owned()), Inline::Badge)
}

/// `parts` with `between` them.
pub fn joined(parts: impl IntoIterator<Item = Line>, between: &str) -> Line {
    let mut out = Line::new();
    for (i, part) in parts.into_iter().enumerate() {
        if i > 0 {
            between.put(&mut out);
        }
        out.extend(part);
    }
    out
}

/// A row's or column's label; the levels of one are joined by `|` in `published.csv`.
pub fn label(text: &str) -> String {
    text.replace('|', " · ")
}

/// A name that a link can end in: letters, digits and hyphens.
pub fn anchor(text: &str) -> String {
    let mut out = String::new();
    for c in text.to_lowercase().chars() {
        if c.is_alphanumeric() {
            out.push(c);
        } else if !out.is_empty() && !out.ends_with('-') {
            out.push('-');
        }
    }
    out.trim_end_matches('-').to_owned()
}

impl Block {
    /// A heading whose place is its own words.
    pub fn heading(level: usize, text: &str) -> Self {
        Self::heading_at(level, &anchor(text), text)
    }

    /// A heading at a place with another name.
    pub fn heading_at(level: usize, anchor: &str, text: impl Words) -> Self {
        Self::Heading {
            level,
            anchor: anchor.to_owned(),
            text: line![text],
        }
    }

    /// A list of lines.
    pub fn list(lines: impl IntoIterator<Item = Line>) -> Self {
        Self::List(lines.into_iter().map(Item::from).collect())
    }
}

impl From<Line> for Item {
    fn from(line: Line) -> Self {
        Self {
            line,
            below: Vec::new(),
        }
    }
}

impl<T: Words> From<T> for Cell {
    fn from(words: T) -> Self {
        Self {
            line: line![words],
            tone: None,
        }
    }
}

impl Table {
    /// A table of rows that belong together.
    pub fn new(
        kind: Kind,
        caption: impl Into<String>,
        columns: &[(&str, Shape)],
        rows: Vec<Vec<Cell>>,
    ) -> Self {
        let column = |(name, shape): &(&str, Shape)| Column {
            name: line![*name],
            shape: *shape,
        };
        let rows = rows.into_iter().map(|cells| Row {
            cells,
            whole: false,
        });
        Self {
            caption: caption.into(),
            kind,
            columns: columns.iter().map(column).collect(),
            bodies: vec![rows.collect()],
        }
    }

    /// The same without the columns that are empty in every row and are named in `optional`.
    pub fn without_empty(mut self, optional: &[&str]) -> Self {
        let empty: Vec<bool> = (self.columns.iter().enumerate())
            .map(|(i, column)| {
                let named = optional.iter().any(|name| column.name == line![*name]);
                let mut rows = self.bodies.iter().flatten();
                named && rows.all(|row| row.cells.get(i).is_none_or(|c| c.line.is_empty()))
            })
            .collect();
        let keep = |i: &mut usize| {
            *i += 1;
            !empty[*i - 1]
        };
        let mut i = 0;
        self.columns.retain(|_| keep(&mut i));
        for row in self.bodies.iter_mut().flatten() {
            let mut i = 0;
            row.cells.retain(|_| keep(&mut i));
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn anchors_are_words_and_hyphens() {
        assert_eq!(anchor("Eq. (18)"), "eq-18");
        assert_eq!(anchor("Table III"), "table-iii");
        assert_eq!(label("D-ZB|k=1"), "D-ZB · k=1");
    }

    #[test]
    fn a_column_that_says_nothing_is_left_out_where_it_may_be() {
        let columns = [
            ("a", Shape::Words),
            ("b", Shape::Words),
            ("c", Shape::Words),
        ];
        let rows = vec![vec!["1".into(), "".into(), "".into()]];
        let table = Table::new(Kind::Plain, "", &columns, rows).without_empty(&["b"]);
        let names: Vec<Line> = table.columns.into_iter().map(|c| c.name).collect();
        assert_eq!(names, [line!["a"], line!["c"]]);
        assert_eq!(table.bodies[0][0].cells.len(), 2);
    }
}
