//! A document as Markdown, as code hosts read it: a file for each page that has one, and the pictures beside it.

use crate::document::{
    Block, Finding, Findings, Inline, Item, Line, Page, Row, Shape, Table, Target,
};
use std::collections::BTreeMap;
use zonobench_lake::digits::four_digits;

/// Every file of the pages by its path, with `/`.
pub fn files(pages: &[Page]) -> BTreeMap<String, String> {
    let mut files: BTreeMap<String, String> = BTreeMap::new();
    for page in pages {
        let Some(file) = &page.file else { continue };
        let first = !files.contains_key(file);
        let mut writer = Writer {
            pages,
            file,
            below: usize::from(!first),
            out: files.remove(file).unwrap_or_default(),
            pictures: Vec::new(),
        };
        if first {
            writer.out += &format!("# {}\n\n", writer.line(&page.title));
        } else {
            writer.heading(1, &page.place, &page.title);
        }
        writer.blocks(&page.blocks);
        let (out, pictures) = (writer.out, writer.pictures);
        files.extend(pictures);
        files.insert(file.clone(), out);
    }
    for (name, text) in &mut files {
        if name.ends_with(".md") {
            *text = text.trim_end().to_owned() + "\n";
        }
    }
    files
}

/// Blocks that stand in no file of their own.
pub fn text(title: &Line, blocks: &[Block]) -> String {
    let mut writer = Writer {
        pages: &[],
        file: "",
        below: 0,
        out: String::new(),
        pictures: Vec::new(),
    };
    writer.out = format!("# {}\n\n", writer.line(title));
    writer.blocks(blocks);
    writer.out.trim_end().to_owned() + "\n"
}

struct Writer<'a> {
    pages: &'a [Page],
    file: &'a str,
    /// How much deeper headings stand than in a page of its own file
    below: usize,
    out: String,
    pictures: Vec<(String, String)>,
}

impl Writer<'_> {
    fn blocks(&mut self, blocks: &[Block]) {
        for block in blocks {
            self.block(block);
        }
    }

    fn block(&mut self, block: &Block) {
        match block {
            Block::Heading {
                level,
                anchor,
                text,
            } => self.heading(*level, anchor, text),
            Block::Para(line) => self.out += &format!("{}\n\n", self.line(line)),
            Block::Notice(line) => self.out += &format!("> {}\n\n", self.line(line)),
            Block::List(items) => {
                self.items(items, 0);
                self.out.push('\n');
            }
            Block::Contents(groups) => {
                let lines: Vec<String> = groups.iter().map(|line| self.line(line)).collect();
                self.out += &format!("{}\n\n", lines.join("  \n"));
            }
            Block::Tallies(tallies) => {
                for tally in tallies {
                    let tally = tally.sentence(|part| format!("**{}** {}", part.n, part.what));
                    self.out += &format!("- {tally}\n");
                }
                self.out.push('\n');
            }
            Block::Table(table) => self.table(table),
            Block::Findings(findings) => self.findings(findings),
            Block::Picture(picture) => {
                let (alternative, file) = (escaped(&picture.title), &picture.file);
                self.out += &format!("![{alternative}]({file})\n\n");
                if !picture.caption.is_empty() {
                    self.out += &format!("{}\n\n", self.line(&picture.caption));
                }
                let folder = self.file.rsplit_once('/').map_or("", |(folder, _)| folder);
                let path = [folder, file].join("/").trim_start_matches('/').to_owned();
                self.pictures.push((path, picture.svg.clone()));
            }
            Block::Details { summary, inside } => {
                let summary = self.line(summary);
                self.out += &format!("<details><summary>{summary}</summary>\n\n");
                self.blocks(inside);
                self.out += "</details>\n\n";
            }
            Block::Commands(lines) => self.out += &format!("```sh\n{lines}\n```\n\n"),
        }
    }

    /// A heading that can be linked to.
    fn heading(&mut self, level: usize, anchor: &str, text: &Line) {
        let (signs, text) = ("#".repeat(level + self.below), self.line(text));
        self.out += &format!("<a id=\"{anchor}\"></a>\n\n{signs} {text}\n\n");
    }

    fn items(&mut self, items: &[Item], depth: usize) {
        for item in items {
            let indent = "  ".repeat(depth);
            // What goes on after a break belongs to the item.
            let line = self
                .line(&item.line)
                .replace('\n', &format!("\n{indent}  "));
            self.out += &format!("{indent}- {line}\n");
            self.items(&item.below, depth + 1);
        }
    }

    /// What is drawn only on a screen is left out.
    fn table(&mut self, table: &Table) {
        let shown: Vec<usize> = (0..table.columns.len())
            .filter(|i| table.columns[*i].shape != Shape::Drawn)
            .collect();
        let header = shown
            .iter()
            .map(|i| self.cell(&table.columns[*i].name, false));
        let header: Vec<String> = header.collect();
        self.row(&header);
        self.row(&vec!["---".to_owned(); header.len()]);
        for Row { cells, whole } in table.bodies.iter().flatten() {
            let cells = (shown.iter().filter_map(|i| cells.get(*i)))
                .map(|cell| self.cell(&cell.line, *whole));
            let cells: Vec<String> = cells.collect();
            self.row(&cells);
        }
        self.out.push('\n');
    }

    fn row(&mut self, cells: &[String]) {
        self.out += &format!("| {} |\n", cells.join(" | "));
    }

    fn cell(&self, line: &Line, whole: bool) -> String {
        let text = self.inlines(line, true).replace("  \n", "<br>");
        match whole && !text.is_empty() {
            true => format!("**{text}**"),
            false => text,
        }
    }

    fn findings(&mut self, findings: &Findings) {
        for (table, command, found) in &findings.tables {
            let table = self.line(table);
            self.out += &format!("**{table}** {}\n\n", code(command, false));
            for finding in found {
                self.finding(finding);
            }
            self.out.push('\n');
        }
        if findings.tables.is_empty() {
            self.out += "None.\n\n";
        }
    }

    fn finding(&mut self, finding: &Finding) {
        let (why, verdict) = (self.line(&finding.why), finding.verdict.shown());
        let why = why.replace('\n', "\n  ");
        match finding.claims.as_slice() {
            [claim] => {
                self.out += &format!("- {}", self.line(claim));
                if !finding.measured.is_empty() {
                    self.out += &format!("; measured {}", self.line(&finding.measured));
                }
                self.out += &format!(": {verdict}. {why}\n");
            }
            claims => {
                self.out += &format!("- {verdict}: {why}\n");
                for claim in claims {
                    self.out += &format!("  - {}\n", self.line(claim));
                }
            }
        }
    }

    fn line(&self, line: &Line) -> String {
        self.inlines(line, false)
    }

    fn inlines(&self, line: &Line, in_table: bool) -> String {
        line.iter()
            .map(|inline| self.inline(inline, in_table))
            .collect()
    }

    fn inline(&self, inline: &Inline, in_table: bool) -> String {
        let inside = |line: &Line| self.inlines(line, in_table);
        match inline {
            Inline::Text(text) => escaped(text),
            Inline::Code(text) => code(text, in_table),
            Inline::Strong(line) => format!("**{}**", inside(line)),
            Inline::Emphasis(line) => format!("*{}*", inside(line)),
            Inline::Link(target, line) => match self.target(target) {
                Some(target) => format!("[{}]({target})", inside(line)),
                None => inside(line),
            },
            Inline::Badge(verdict) => verdict.shown(),
            Inline::Mark(verdict) => verdict.mark().to_owned(),
            Inline::Ours(ours) => four_digits(ours.exact),
            Inline::Repeated(_) | Inline::Bar(_) | Inline::Scale(_) => String::new(),
            Inline::Break => "  \n".to_owned(),
        }
    }

    /// Where a link leads from this file; None for a page that has none.
    fn target(&self, target: &Target) -> Option<String> {
        let (place, within) = match target {
            Target::Here(place) => return Some(format!("#{place}")),
            Target::Web(address) => return Some(address.clone()),
            Target::Page(page) => (page, None),
            Target::On(page, within) => (page, Some(within)),
        };
        let page = self.pages.iter().find(|p| p.place == *place)?;
        let file = page.file.as_deref()?;
        let first = self
            .pages
            .iter()
            .find(|p| p.file.as_deref() == Some(file))?;
        let within = match within {
            Some(within) => format!("#{within}"),
            None if first.place == *place => String::new(),
            None => format!("#{place}"),
        };
        let path = match (
            file == self.file && !within.is_empty(),
            self.file.contains('/'),
        ) {
            (true, _) => String::new(),
            (_, true) => format!("../{file}"),
            (_, false) => file.to_owned(),
        };
        Some(path + &within)
    }
}

/// `text` so that it reads as it is, in a paragraph, a heading or a table's cell.
pub fn escaped(text: &str) -> String {
    let characters: Vec<char> = text.chars().collect();
    let mut out = String::new();
    for (i, &c) in characters.iter().enumerate() {
        // An underscore inside a word is no emphasis.
        let beside = |at: Option<usize>| {
            at.and_then(|at| characters.get(at))
                .is_some_and(|c| c.is_alphanumeric())
        };
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '\n' | '\r' => out.push(' '),
            '_' if beside(i.checked_sub(1)) && beside(Some(i + 1)) => out.push('_'),
            '\\' | '|' | '*' | '_' | '`' | '[' | ']' | '~' | '$' | '#' => {
                out.push('\\');
                out.push(c);
            }
            c => out.push(c),
        }
    }
    out
}

/// `text` as code.
fn code(text: &str, in_table: bool) -> String {
    let fence = if text.contains('`') { "``" } else { "`" };
    let text = match in_table {
        true => text.replace('|', "\\|"),
        false => text.to_owned(),
    };
    format!("{fence}{text}{fence}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::{Kind, line, link_on, link_page, strong};

    fn page(place: &str, file: Option<&str>, blocks: Vec<Block>) -> Page {
        Page {
            place: place.to_owned(),
            name: place.to_owned(),
            file: file.map(str::to_owned),
            title: line![place],
            blocks,
        }
    }

    #[test]
    fn what_markdown_would_read_is_escaped() {
        assert_eq!(
            escaped("a|b < c*d _e_ x_1 [v](w)"),
            "a\\|b &lt; c\\*d \\_e\\_ x_1 \\[v\\](w)"
        );
        assert_eq!(code("a|b", true), "`a\\|b`");
        assert_eq!(code("a|b", false), "`a|b`");
    }

    #[test]
    fn links_lead_from_file_to_file_and_to_no_page_that_has_none() {
        let links = line![
            link_page("top", "1"),
            link_page("more", "2"),
            link_on("deep", "x", "3"),
            link_page("here", "4")
        ];
        let pages = [
            page("top", Some("README.md"), vec![Block::Para(links.clone())]),
            page("more", Some("README.md"), Vec::new()),
            page("deep", Some("d/README.md"), vec![Block::Para(links)]),
            page("here", None, Vec::new()),
        ];
        let files = files(&pages);
        assert_eq!(files.len(), 2);
        assert!(files["README.md"].contains("[1](README.md)[2](#more)[3](d/README.md#x)4\n"));
        assert!(files["README.md"].ends_with("<a id=\"more\"></a>\n\n## more\n"));
        assert!(files["d/README.md"].contains("[1](../README.md)[2](../README.md#more)[3](#x)4\n"));
    }

    #[test]
    fn a_table_leaves_out_what_is_drawn() {
        let columns = [("a", Shape::Words), ("b", Shape::Drawn)];
        let rows = vec![vec!["1".into(), Inline::Scale([1.0, 2.0]).into()]];
        let mut table = Table::new(Kind::Plain, "", &columns, rows);
        table.bodies[0][0].whole = true;
        let text = text(&line![strong("t")], &[Block::Table(table)]);
        assert_eq!(text, "# **t**\n\n| a |\n| --- |\n| **1** |\n");
    }
}
