//! A document as one HTML file, which needs nothing beside it: pages as sections, figures inside, a script and a style
//! sheet of our own.
//!
//! Without the script all sections stand below each other and every number can be read. With it one page is
//! shown at a time, tables sort and filter, a number shows its run, and a search goes over every cell.

use crate::document::{
    Block, Cell, Column, Finding, Findings, Inline, Item, Kind, Line, Ours, Page, Picture, Row,
    Shape, Table, Target,
};
use serde_json::Value;
use zonobench_lake::digits::four_digits;
use zonobench_verdicts::judged::Tally;
use zonobench_verdicts::verdict::{Tone, Verdict};

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// What can be done on the page with the script.
const HINT: &str = "Point at a reproduced number, or move to it with Tab, to see all its digits and its run. Click it, or \
                    press Enter, for the commands that make it again. Click a column's name to sort by it.";

/// All pages as one file. `experiments` is what the script says about the run behind a number: file, seed, runs and
/// steps by `paper/experiment`.
pub fn file(pages: &[Page], experiments: &Value) -> String {
    let links: Vec<String> = pages
        .iter()
        .map(|p| format!("<li><a href=\"#{}\">{}</a></li>", p.place, escaped(&p.name)))
        .collect();
    let sections: Vec<String> = pages.iter().map(section).collect();
    // In a script element only `</` could end it early.
    let experiments = experiments.to_string().replace("</", "<\\/");
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <link rel=\"icon\" href=\"data:,\">\n\
         <title>zonobench: results</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
         <a class=\"skip\" href=\"#main\">Skip to the results</a>\n\
         <header><p class=\"brand\"><a href=\"#{}\">zonobench</a></p>\n\
         <nav aria-label=\"Pages\"><ul>{}</ul></nav>\n<div id=\"tools\"></div></header>\n\
         <main id=\"main\" tabindex=\"-1\">\n{}</main>\n\
         <footer><p class=\"hint\">{HINT}</p>\n<p>zonobench {}, rendered by <code>zonobench report</code> from the lake alone.</p>\
         </footer>\n\
         <script type=\"application/json\" id=\"experiments\">{experiments}</script>\n\
         <script>\n{SCRIPT}</script>\n</body>\n</html>\n",
        pages.first().map_or("", |p| &p.place),
        links.concat(),
        sections.concat(),
        env!("CARGO_PKG_VERSION"),
    )
}

fn section(page: &Page) -> String {
    let writer = Writer { page };
    format!(
        "<section class=\"page\" id=\"{}\" data-name=\"{}\" tabindex=\"-1\">\n<h1>{}</h1>\n{}</section>\n",
        page.place,
        escaped(&page.name),
        writer.line(&page.title),
        writer.blocks(&page.blocks)
    )
}

struct Writer<'a> {
    page: &'a Page,
}

impl Writer<'_> {
    fn blocks(&self, blocks: &[Block]) -> String {
        blocks.iter().map(|block| self.block(block)).collect()
    }

    fn block(&self, block: &Block) -> String {
        match block {
            Block::Heading {
                level,
                anchor,
                text,
            } => format!(
                "<h{level} id=\"{}\">{}</h{level}>\n",
                self.place(anchor),
                self.line(text)
            ),
            Block::Para(line) => format!("<p>{}</p>\n", self.line(line)),
            Block::Notice(line) => format!("<p class=\"notice\">{}</p>\n", self.line(line)),
            Block::List(items) => self.items(items),
            Block::Contents(groups) => self.contents(groups),
            Block::Tallies(tallies) => tallies.iter().map(tally).collect(),
            Block::Table(table) => self.table(table),
            Block::Findings(findings) => self.findings(findings),
            Block::Picture(picture) => self.picture(picture),
            Block::Details { summary, inside } => format!(
                "<details><summary>{}</summary>{}</details>\n",
                self.line(summary),
                self.blocks(inside)
            ),
            Block::Commands(lines) => commands(lines),
        }
    }

    /// The place of something on this page, once in the file.
    fn place(&self, anchor: &str) -> String {
        format!("{}-{anchor}", self.page.place)
    }

    fn items(&self, items: &[Item]) -> String {
        let item = |item: &Item| {
            let below = match item.below.as_slice() {
                [] => String::new(),
                below => self.items(below),
            };
            format!("<li>{}{below}</li>", self.line(&item.line))
        };
        let items: String = items.iter().map(item).collect();
        format!("<ul>{items}</ul>\n")
    }

    fn contents(&self, groups: &[Line]) -> String {
        let groups: String = (groups.iter())
            .map(|line| format!("<li>{}</li>", self.line(line)))
            .collect();
        format!(
            "<nav class=\"contents\" aria-label=\"On the page {}\"><ul>{groups}</ul></nav>\n",
            escaped(&self.page.name)
        )
    }

    fn picture(&self, picture: &Picture) -> String {
        let caption = match picture.caption.as_slice() {
            [] => String::new(),
            _ => format!(
                "<figcaption><p>{}</p></figcaption>",
                self.line(&picture.caption)
            ),
        };
        format!(
            "<figure>{}{caption}</figure>\n",
            scrolling(&picture.title, &picture.svg)
        )
    }

    fn table(&self, table: &Table) -> String {
        let classes = match table.kind {
            Kind::Plain => "",
            Kind::Sortable => "sortable filtered",
            Kind::Cells => "cells sortable filtered",
            Kind::Grid => "grid",
            Kind::Matrix => "matrix",
        };
        let header: String = (table.columns.iter())
            .map(|column| format!("<th scope=\"col\">{}</th>", self.line(&column.name)))
            .collect();
        let body = |rows: &Vec<Row>| {
            let rows = rows.iter().map(|row| self.row(&table.columns, row));
            format!("<tbody>{}</tbody>", rows.collect::<String>())
        };
        let bodies: String = table.bodies.iter().map(body).collect();
        whole_table(classes, &table.caption, &header, &bodies)
    }

    fn row(&self, columns: &[Column], row: &Row) -> String {
        let mut out = match row.whole {
            true => "<tr class=\"whole\">".to_owned(),
            false => "<tr>".to_owned(),
        };
        for (i, (column, cell)) in columns.iter().zip(&row.cells).enumerate() {
            let inside = self.line(&cell.line);
            out += &match i {
                0 => format!("<th scope=\"row\">{inside}</th>"),
                _ => format!("<td{}>{inside}</td>", classes(column, cell)),
            };
        }
        out + "</tr>\n"
    }

    fn findings(&self, findings: &Findings) -> String {
        let mut rows = String::new();
        let mut number = 0;
        for (table, _, found) in &findings.tables {
            for finding in found {
                rows += &self.finding(table, finding);
                number += finding.claims.len();
            }
        }
        if rows.is_empty() {
            return "<p>None.</p>\n".to_owned();
        }
        let heads = [
            "claim, as printed",
            "table",
            "measured",
            "verdict",
            "why",
            "show it",
        ];
        let header: String = (heads.iter())
            .map(|name| format!("<th scope=\"col\">{name}</th>"))
            .collect();
        let caption = format!("{}: {number} findings", findings.caption);
        let bodies = format!("<tbody>{rows}</tbody>");
        whole_table("findings sortable filtered", &caption, &header, &bodies)
    }

    fn finding(&self, table: &Line, finding: &Finding) -> String {
        let claims: Vec<String> = finding.claims.iter().map(|c| self.line(c)).collect();
        format!(
            "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td>\
             <td><details><summary>command</summary>{}</details></td></tr>\n",
            claims.join("<br>"),
            self.line(table),
            self.line(&finding.measured),
            badge(finding.verdict),
            self.line(&finding.why),
            code(&finding.query)
        )
    }

    fn line(&self, line: &Line) -> String {
        line.iter().map(|inline| self.inline(inline)).collect()
    }

    fn inline(&self, inline: &Inline) -> String {
        match inline {
            Inline::Text(text) => escaped(text),
            Inline::Code(text) => code(text),
            Inline::Strong(line) => format!("<strong>{}</strong>", self.line(line)),
            Inline::Emphasis(line) => format!("<em>{}</em>", self.line(line)),
            Inline::Repeated(line) => {
                format!("<span class=\"reading\">{}</span> ", self.line(line))
            }
            Inline::Link(target, line) => {
                let target = match target {
                    Target::Here(anchor) => format!("#{}", self.place(anchor)),
                    Target::Page(page) => format!("#{page}"),
                    Target::On(page, anchor) => format!("#{page}-{anchor}"),
                    Target::Web(address) => escaped(address),
                };
                format!("<a href=\"{target}\">{}</a>", self.line(line))
            }
            Inline::Badge(verdict) => badge(*verdict),
            Inline::Mark(verdict) => format!(
                "<span role=\"img\" aria-label=\"{}\">{}</span>",
                words(*verdict),
                verdict.mark()
            ),
            Inline::Ours(ours) => number(ours),
            Inline::Bar(shares) => bar(shares),
            Inline::Scale([width, left]) => format!(
                "<span class=\"scale\" aria-hidden=\"true\"><i style=\"width:{width:.2}%\"></i>\
                 <b style=\"left:{left:.2}%\"></b></span>"
            ),
            Inline::Break => "<br>".to_owned(),
        }
    }
}

/// The classes of a cell.
fn classes(column: &Column, cell: &Cell) -> String {
    let shape = match (column.shape, cell.tone) {
        // A verdict's count, or a number beside ours, is of its colour.
        (_, Some(_)) => "count",
        (Shape::Number, None) if length(&cell.line) < 28 => "number",
        (Shape::Why, None) => "why",
        _ => "",
    };
    let tone = cell.tone.map_or("", tone);
    match format!("{shape} {tone}").trim() {
        "" => String::new(),
        classes => format!(" class=\"{classes}\""),
    }
}

/// How many characters of text a line has, about.
fn length(line: &Line) -> usize {
    let of = |inline: &Inline| match inline {
        Inline::Text(text) | Inline::Code(text) => text.chars().count(),
        Inline::Strong(line)
        | Inline::Emphasis(line)
        | Inline::Repeated(line)
        | Inline::Link(_, line) => length(line),
        _ => 8,
    };
    line.iter().map(of).sum()
}

/// `text` as it reads, in an element or in an attribute between double quotes.
pub fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c => out.push(c),
        }
    }
    out
}

fn code(text: &str) -> String {
    format!("<code>{}</code>", escaped(text))
}

fn commands(lines: &str) -> String {
    format!(
        "<pre class=\"sh\" tabindex=\"0\"><code>{}</code></pre>\n",
        escaped(lines)
    )
}

/// The class that a verdict is coloured by.
fn tone(tone: Tone) -> &'static str {
    match tone {
        Tone::Good => "good",
        Tone::Bad => "bad",
        Tone::Open => "open",
        Tone::Plain => "none",
        Tone::Fault => "fault",
    }
}

/// The name of a verdict as words.
fn words(verdict: Verdict) -> String {
    escaped(verdict.name()).replace('_', " ")
}

/// A verdict: its mark and its name, on its colour.
fn badge(verdict: Verdict) -> String {
    format!(
        "<span class=\"badge {}\"><span aria-hidden=\"true\">{}</span> {}</span>",
        tone(verdict.tone()),
        verdict.mark(),
        words(verdict)
    )
}

/// Our number: what the script shows of it, all digits and the run, is in its attributes.
fn number(ours: &Ours) -> String {
    let mut attributes = format!(" data-exact=\"{}\"", ours.exact);
    if let Some((lo, hi)) = ours.interval {
        attributes += &format!(" data-interval=\"{lo} to {hi}\"");
    }
    for (name, value) in &ours.run {
        attributes += &format!(" data-{name}=\"{}\"", escaped(value));
    }
    format!(
        "<button type=\"button\" class=\"exact\"{attributes}>{}</button>",
        four_digits(ours.exact)
    )
}

/// Verdicts as shares of one bar; the counts beside it say the same in words.
fn bar(shares: &[(Tone, usize)]) -> String {
    let sum: usize = shares.iter().map(|(_, n)| n).sum();
    if sum == 0 {
        return String::new();
    }
    let parts: String = (shares.iter())
        .map(|(of, n)| {
            let share = 100.0 * *n as f64 / sum as f64;
            format!(
                "<i class=\"{}\" style=\"width:{share:.2}%\"></i>",
                tone(*of)
            )
        })
        .collect();
    format!("<span class=\"bar\" aria-hidden=\"true\">{parts}</span>")
}

fn tally(tally: &Tally) -> String {
    let parts: String = (tally.parts.iter())
        .map(|p| {
            format!(
                "<li class=\"{}\"><b>{}</b> {}</li>",
                tone(p.like.tone()),
                p.n,
                p.what
            )
        })
        .collect();
    format!(
        "<p><b>{}</b> {}</p><ul class=\"tallies\">{parts}</ul>\n",
        tally.all,
        tally.subject.name()
    )
}

/// What keyboards can scroll where it is wider than the window.
fn scrolling(name: &str, inside: &str) -> String {
    format!(
        "<div class=\"scroll\" role=\"region\" aria-label=\"{}\" tabindex=\"0\">{inside}</div>\n",
        escaped(name)
    )
}

fn whole_table(classes: &str, caption: &str, header: &str, bodies: &str) -> String {
    let caption_text = escaped(caption);
    scrolling(
        caption,
        &format!(
            "<table class=\"{classes}\"><caption>{caption_text}</caption><thead><tr>{header}</tr></thead>{bodies}</table>"
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::{line, link_here, strong};

    fn written(block: Block) -> String {
        let page = Page {
            place: "p".to_owned(),
            name: "a < b".to_owned(),
            file: None,
            title: line!["t"],
            blocks: vec![block],
        };
        section(&page)
    }

    #[test]
    fn nothing_of_a_text_is_read_as_markup() {
        assert_eq!(
            escaped("a < b & \"c\" > d"),
            "a &lt; b &amp; &quot;c&quot; &gt; d"
        );
        let words = line![strong("x < y"), link_here("z", "&")];
        let page = written(Block::Para(words));
        assert!(page.contains("<strong>x &lt; y</strong><a href=\"#p-z\">&amp;</a>"));
        assert!(page.contains("data-name=\"a &lt; b\""));
    }

    #[test]
    fn every_verdict_has_a_colour_and_its_name() {
        let class = |verdict: Verdict| tone(verdict.tone());
        assert_eq!(class(Verdict::WithinCi), "good");
        assert_eq!(class(Verdict::DoesNotHold), "bad");
        assert_eq!(class(Verdict::Error), "fault");
        assert_eq!(class(Verdict::NotReproducible), "open");
        assert_eq!(class(Verdict::Fitted), "none");
        for verdict in Verdict::ALL {
            assert!(badge(verdict).contains(&verdict.name().replace('_', " ")));
        }
    }

    #[test]
    fn a_cell_with_its_readings_is_a_body() {
        let row = |first: Cell| Row {
            cells: vec![first, "1".into()],
            whole: false,
        };
        let columns = [("a", Shape::Words), ("b", Shape::Number)];
        let mut table = Table::new(Kind::Cells, "c", &columns, Vec::new());
        let again = Inline::Repeated(line!["r"]);
        table.bodies = vec![vec![row("r".into()), row(again.into())]];
        let page = written(Block::Table(table));
        assert!(
            page.contains("<tbody><tr><th scope=\"row\">r</th><td class=\"number\">1</td></tr>")
        );
        assert!(page.contains("<span class=\"reading\">r</span>"));
        assert!(page.contains("class=\"cells sortable filtered\""));
    }
}
