//! The little Markdown that summaries and captions are written in, read into blocks.

use super::{Block, Inline, Item, Line, Target};

/// Paragraphs, `## ` headings are not among them, and lists.
pub fn blocks(text: &str) -> Vec<Block> {
    let parts = text.split("\n\n").map(str::trim).filter(|b| !b.is_empty());
    let of = |block: &str| {
        if !block.starts_with("- ") {
            return Block::Para(prose(block));
        }
        let items = block.strip_prefix("- ").unwrap_or(block).split("\n- ");
        Block::List(items.map(|item| Item::from(prose(item))).collect())
    };
    parts.map(of).collect()
}

/// What is open while a line is read.
enum Open {
    Strong,
    Emphasis,
}

/// A paragraph's inside: `**strong**`, `*emphasis*`, code, `\` before a sign, links to the web, two spaces before a line's
/// end. A link to elsewhere is its words.
pub fn prose(text: &str) -> Line {
    let mut reader = Reader {
        open: Vec::new(),
        line: Line::new(),
        words: String::new(),
    };
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let taken = reader.take(c, rest);
        rest = &rest[taken..];
    }
    while !reader.open.is_empty() {
        reader.close();
    }
    reader.flush();
    reader.line
}

struct Reader {
    /// What is open, with the line that it stands in
    open: Vec<(Open, Line)>,
    line: Line,
    words: String,
}

impl Reader {
    /// Reads what begins with `c` at the start of `rest`; returns how many bytes that were.
    fn take(&mut self, c: char, rest: &str) -> usize {
        let after = &rest[c.len_utf8()..];
        match c {
            '\\' => match after.chars().next().filter(char::is_ascii_punctuation) {
                Some(sign) => {
                    self.words.push(sign);
                    return 1 + sign.len_utf8();
                }
                None => self.words.push('\\'),
            },
            '`' => {
                let fence: String = rest.chars().take_while(|c| *c == '`').collect();
                if let Some((inside, _)) = rest[fence.len()..].split_once(fence.as_str()) {
                    self.push(Inline::Code(inside.trim().replace('\n', " ")));
                    return 2 * fence.len() + inside.len();
                }
                self.words.push('`');
            }
            '*' if after.starts_with('*') => {
                self.turn(|open| matches!(open, Open::Strong), Open::Strong);
                return 2;
            }
            // A star between spaces is a star.
            '*' if self.is_emphatic() || (after.contains('*') && !after.starts_with(' ')) => {
                self.turn(|open| matches!(open, Open::Emphasis), Open::Emphasis);
            }
            '[' => {
                if let Some((words, target)) = link(after) {
                    let inside = prose(words);
                    if target.starts_with("https://") {
                        self.push(Inline::Link(Target::Web(target.to_owned()), inside));
                    } else {
                        self.flush();
                        self.line.extend(inside);
                    }
                    return words.len() + target.len() + 4;
                }
                self.words.push('[');
            }
            '&' => {
                for (entity, sign) in [("&amp;", '&'), ("&lt;", '<'), ("&gt;", '>')] {
                    if rest.starts_with(entity) {
                        self.words.push(sign);
                        return entity.len();
                    }
                }
                self.words.push('&');
            }
            ' ' if rest.starts_with("  \n") => {
                self.push(Inline::Break);
                return 3;
            }
            '\n' => {
                self.words.push(' ');
                return rest.len() - after.trim_start_matches(' ').len();
            }
            c => self.words.push(c),
        }
        c.len_utf8()
    }

    fn is_emphatic(&self) -> bool {
        self.open
            .iter()
            .any(|(open, _)| matches!(open, Open::Emphasis))
    }

    fn flush(&mut self) {
        if !self.words.is_empty() {
            let words = std::mem::take(&mut self.words);
            self.line.push(Inline::Text(words));
        }
    }

    fn push(&mut self, inline: Inline) {
        self.flush();
        self.line.push(inline);
    }

    /// Closes what `is` open, else opens `new`.
    fn turn(&mut self, is: fn(&Open) -> bool, new: Open) {
        match self.open.iter().rposition(|(open, _)| is(open)) {
            Some(at) => {
                while self.open.len() > at {
                    self.close();
                }
            }
            None => {
                self.flush();
                self.open.push((new, std::mem::take(&mut self.line)));
            }
        }
    }

    fn close(&mut self) {
        self.flush();
        if let Some((open, before)) = self.open.pop() {
            let inside = std::mem::replace(&mut self.line, before);
            self.line.push(match open {
                Open::Strong => Inline::Strong(inside),
                Open::Emphasis => Inline::Emphasis(inside),
            });
        }
    }
}

/// Words and target of a link whose `[` was read.
fn link(after: &str) -> Option<(&str, &str)> {
    let (words, tail) = after.split_once("](")?;
    let (target, _) = tail.split_once(')')?;
    (!words.contains(['[', '\n'])).then_some((words, target))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::{code, emphasis, line, strong};

    #[test]
    fn markdown_of_captions_becomes_inlines() {
        assert_eq!(
            prose("**A** and *b*"),
            line![strong("A"), " and ", emphasis("b")]
        );
        assert_eq!(prose("2 * 3 &lt; x"), line!["2 * 3 < x"]);
        assert_eq!(prose("`a*b` \\*"), line![code("a*b"), " *"]);
        let web = Inline::Link(Target::Web("https://b.c/d".to_owned()), line!["a"]);
        assert_eq!(
            prose("[a](https://b.c/d) [e](f.md#g) x[0]"),
            line![web, " ", "e", " x[0]"]
        );
        assert_eq!(prose("**open"), line![strong("open")]);
        assert_eq!(prose("one\n  two"), line!["one two"]);
    }

    #[test]
    fn paragraphs_and_lists_are_apart() {
        assert_eq!(
            blocks("- a\n- b\n\nc"),
            [
                Block::list([line!["a"], line!["b"]]),
                Block::Para(line!["c"])
            ]
        );
    }
}
