//! Pieces of HTML: escaped text, and the little Markdown that summaries and captions are written in.

use crate::markdown;
use zonobench_verdicts::verdict::{Tone, Verdict};

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

/// `text` as code.
pub fn code(text: &str) -> String {
    format!("<code>{}</code>", escaped(text))
}

/// Lines that a person copies into a shell.
pub fn commands(lines: &str) -> String {
    format!(
        "<pre class=\"sh\" tabindex=\"0\"><code>{}</code></pre>\n",
        escaped(lines)
    )
}

/// A row's or column's label; the levels of one are joined by `|` in `published.csv`.
pub fn label(text: &str) -> String {
    let levels: Vec<String> = text.split('|').map(escaped).collect();
    levels.join(" · ")
}

/// The place of a paper, or of something on its page.
pub fn place(paper: &str, name: &str) -> String {
    match (paper, name) {
        ("", name) => markdown::anchor(name),
        (paper, "") => format!("paper-{}", markdown::anchor(paper)),
        (paper, name) => format!(
            "paper-{}-{}",
            markdown::anchor(paper),
            markdown::anchor(name)
        ),
    }
}

/// The class that a verdict is coloured by.
pub fn class(verdict: Verdict) -> &'static str {
    match verdict.tone() {
        Tone::Good => "good",
        Tone::Bad => "bad",
        Tone::Open => "open",
        Tone::Plain => "none",
        Tone::Fault => "fault",
    }
}

/// A verdict: its mark and its name, on its colour.
pub fn badge(verdict: Verdict) -> String {
    format!(
        "<span class=\"badge {}\"><span aria-hidden=\"true\">{}</span> {}</span>",
        class(verdict),
        verdict.mark(),
        escaped(verdict.name()).replace('_', " ")
    )
}

/// The badge of a verdict that was read from a table; the bare word where it is none of ours.
pub fn badge_named(name: &str) -> String {
    Verdict::parse(name).map_or_else(|_| escaped(name), badge)
}

/// What keyboards can scroll where it is wider than the window.
pub fn scrolling(name: &str, inside: &str) -> String {
    format!(
        "<div class=\"scroll\" role=\"region\" aria-label=\"{}\" tabindex=\"0\">{inside}</div>\n",
        escaped(name)
    )
}

/// A table of a caption, headers and bodies (`<tbody>` elements or rows), with the names of `classes`.
pub fn table(classes: &str, caption: &str, header: &[&str], bodies: &str) -> String {
    let header: Vec<String> = header
        .iter()
        .map(|name| format!("<th scope=\"col\">{name}</th>"))
        .collect();
    let bodies = if bodies.starts_with("<tbody") {
        bodies.to_owned()
    } else {
        format!("<tbody>{bodies}</tbody>")
    };
    scrolling(
        caption,
        &format!(
            "<table class=\"{classes}\"><caption>{}</caption><thead><tr>{}</tr></thead>{bodies}</table>",
            escaped(caption),
            header.concat()
        ),
    )
}

/// A row whose first cell names it; the cells are HTML already.
pub fn row(cells: &[String]) -> String {
    let mut out = "<tr>".to_owned();
    for (i, cell) in cells.iter().enumerate() {
        out += &match i {
            0 => format!("<th scope=\"row\">{cell}</th>"),
            _ => format!("<td>{cell}</td>"),
        };
    }
    out + "</tr>\n"
}

/// Paragraphs and lists of Markdown.
pub fn blocks(text: &str) -> String {
    let mut out = String::new();
    for block in text.split("\n\n").map(str::trim).filter(|b| !b.is_empty()) {
        let items: Option<Vec<&str>> = block.lines().map(|l| l.trim().strip_prefix("- ")).collect();
        out += &match items {
            Some(items) => {
                let items: Vec<String> = items
                    .iter()
                    .map(|i| format!("<li>{}</li>", inline(i)))
                    .collect();
                format!("<ul>{}</ul>\n", items.concat())
            }
            None => format!("<p>{}</p>\n", inline(block)),
        };
    }
    out
}

/// Markdown inside of a paragraph: `**strong**`, `*emphasis*`, code, `\` before a sign, links. A link leads on
/// where its target is on the web; another one is its text, since the pages that it names are not in this file.
pub fn inline(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    let (mut strong, mut emphasis) = (false, false);
    while let Some(c) = rest.chars().next() {
        let after = &rest[c.len_utf8()..];
        let mut taken = c.len_utf8();
        match c {
            '\\' => match after.chars().next().filter(char::is_ascii_punctuation) {
                Some(sign) => {
                    out += &escaped(&sign.to_string());
                    taken += sign.len_utf8();
                }
                None => out.push('\\'),
            },
            '`' => {
                let fence: String = rest.chars().take_while(|c| *c == '`').collect();
                match rest[fence.len()..].split_once(fence.as_str()) {
                    Some((inside, _)) => {
                        out += &code(inside.trim());
                        taken = 2 * fence.len() + inside.len();
                    }
                    None => out.push('`'),
                }
            }
            '*' if after.starts_with('*') => {
                out += if strong { "</strong>" } else { "<strong>" };
                strong = !strong;
                taken += 1;
            }
            // A star between spaces is a star.
            '*' if emphasis || (after.contains('*') && !after.starts_with(' ')) => {
                out += if emphasis { "</em>" } else { "<em>" };
                emphasis = !emphasis;
            }
            '[' => match after.split_once("](").and_then(|(words, tail)| {
                let (target, _) = tail.split_once(')')?;
                (!words.contains(['[', '\n'])).then_some((words, target))
            }) {
                Some((words, target)) => {
                    let shown = inline(words);
                    out += &if target.starts_with("https://") {
                        format!("<a href=\"{}\">{shown}</a>", escaped(target))
                    } else {
                        shown
                    };
                    taken = words.len() + target.len() + 4;
                }
                None => out.push('['),
            },
            '&' => {
                let entity = ["&amp;", "&lt;", "&gt;"]
                    .into_iter()
                    .find(|e| rest.starts_with(e));
                out += entity.unwrap_or("&amp;");
                taken = entity.map_or(1, str::len);
            }
            ' ' if rest.starts_with("  \n") => {
                out += "<br>";
                taken = 3;
            }
            c => out += &escaped(&c.to_string()),
        }
        rest = &rest[taken..];
    }
    if emphasis {
        out += "</em>";
    }
    if strong {
        out += "</strong>";
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_of_a_text_is_read_as_markup() {
        assert_eq!(
            escaped("a < b & \"c\" > d"),
            "a &lt; b &amp; &quot;c&quot; &gt; d"
        );
        assert_eq!(inline("x < y & z"), "x &lt; y &amp; z");
        assert_eq!(inline("a &lt; b"), "a &lt; b");
        assert_eq!(label("D-ZB|k=1"), "D-ZB · k=1");
    }

    #[test]
    fn markdown_of_captions_becomes_elements() {
        assert_eq!(inline("**A** and *b*"), "<strong>A</strong> and <em>b</em>");
        assert_eq!(inline("2 * 3"), "2 * 3");
        assert_eq!(inline("`a*b` \\*"), "<code>a*b</code> *");
        assert_eq!(
            inline("[a](https://b.c/d) [e](f.md#g) x[0]"),
            "<a href=\"https://b.c/d\">a</a> e x[0]"
        );
        assert_eq!(
            blocks("- a\n- b\n\nc"),
            "<ul><li>a</li><li>b</li></ul>\n<p>c</p>\n"
        );
        assert_eq!(inline("**open"), "<strong>open</strong>");
    }

    #[test]
    fn every_verdict_has_a_colour_and_its_name() {
        assert_eq!(class(Verdict::WithinCi), "good");
        assert_eq!(class(Verdict::DoesNotHold), "bad");
        assert_eq!(class(Verdict::Error), "fault");
        assert_eq!(class(Verdict::NotReproducible), "open");
        assert_eq!(class(Verdict::Fitted), "none");
        for verdict in Verdict::ALL {
            assert!(badge(verdict).contains(&verdict.name().replace('_', " ")));
        }
        assert_eq!(badge_named("a new one"), "a new one");
    }
}
