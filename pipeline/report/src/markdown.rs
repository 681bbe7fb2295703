//! Pieces of Markdown, as code hosts read it.

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

/// `text` as code, also in a table's cell.
pub fn code(text: &str) -> String {
    let fence = if text.contains('`') { "``" } else { "`" };
    format!("{fence}{}{fence}", text.replace('|', "\\|"))
}

/// A table; its cells are Markdown already.
pub fn table(header: &[&str], rows: &[Vec<String>]) -> String {
    let line = |cells: &mut dyn Iterator<Item = &str>| {
        let cells: Vec<&str> = cells.collect();
        format!("| {} |\n", cells.join(" | "))
    };
    let mut out = line(&mut header.iter().copied());
    out += &line(&mut header.iter().map(|_| "---"));
    for row in rows {
        out += &line(&mut row.iter().map(String::as_str));
    }
    out
}

/// What can be opened with a click.
pub fn details(summary: &str, body: &str) -> String {
    format!(
        "<details><summary>{summary}</summary>\n\n{}\n\n</details>\n",
        body.trim_end()
    )
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

/// A heading that can be linked to under [`anchor`] of `name`; `text` is Markdown already.
pub fn heading(level: usize, name: &str, text: &str) -> String {
    format!(
        "<a id=\"{}\"></a>\n\n{} {text}\n\n",
        anchor(name),
        "#".repeat(level)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_markdown_would_read_is_escaped() {
        assert_eq!(
            escaped("a|b < c*d _e_ x_1 [v](w)"),
            "a\\|b &lt; c\\*d \\_e\\_ x_1 \\[v\\](w)"
        );
        assert_eq!(code("a|b"), "`a\\|b`");
    }

    #[test]
    fn anchors_are_words_and_hyphens() {
        assert_eq!(anchor("Eq. (18)"), "eq-18");
        assert_eq!(anchor("Table III"), "table-iii");
    }
}
