//! The bibliography: which works are reproduced here, and how they are cited.

/// The bibliography, under the keys that the code cites.
const REFERENCES: &str = include_str!("../../../references.bib");

/// A work of the bibliography.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// The key that the code cites
    pub key: String,
    /// Its title
    pub title: String,
    /// Authors and where it appeared
    pub citation: String,
}

/// The work that is reproduced in `experiments/<folder>`.
pub fn reference(folder: &str) -> Option<Reference> {
    REFERENCES.split("\n@").find_map(|entry| {
        let field = |name: &str| {
            let line = entry
                .lines()
                .find(|line| line.split('=').next().is_some_and(|key| key.trim() == name))?;
            let value = line.split_once('=')?.1.trim().trim_end_matches(',');
            Some(value.replace(['{', '}'], ""))
        };
        let note = field("note")?;
        let (note, of) = note.rsplit_once("Folder experiments/")?;
        if of.trim() != folder {
            return None;
        }
        let authors: Vec<String> = field("author")?
            .split(" and ")
            .map(|name| match name.split_once(", ") {
                Some((last, first)) => format!("{first} {last}"),
                None => name.to_owned(),
            })
            .collect();
        let mut citation = authors.join(", ");
        if let Some(journal) = field("journal") {
            citation += &format!(". {journal}");
            citation += &field("volume").map(|v| format!(" {v}")).unwrap_or_default();
            citation += &field("pages").map(|p| format!(", {p}")).unwrap_or_default();
            citation += &field("year").map(|y| format!(" ({y})")).unwrap_or_default();
        }
        citation += &field("doi")
            .map(|doi| format!(". doi:{doi}"))
            .unwrap_or_default();
        citation += ".";
        if !note.trim().is_empty() {
            citation += &format!(" {}", note.trim());
        }
        Some(Reference {
            key: entry.split_once('{')?.1.split_once(',')?.0.to_owned(),
            title: field("title")?,
            citation,
        })
    })
}

/// The folders of the bibliography's papers, in order.
pub fn folders() -> Vec<&'static str> {
    let after = REFERENCES.split("Folder experiments/").skip(1);
    after
        .filter_map(|rest| rest.split(|c: char| !c.is_alphanumeric()).next())
        .collect()
}

/// The title of the work in a folder, or the bare name.
pub fn title(folder: &str) -> String {
    reference(folder).map_or_else(|| folder.to_owned(), |work| work.title)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_published_paper_has_a_reference() {
        for folder in zonobench_verdicts::papers::names() {
            assert!(reference(folder).is_some(), "{folder}");
        }
    }

    #[test]
    fn a_reference_reads_as_a_citation() {
        let found = reference("cz").unwrap();
        assert_eq!(found.key, "Rego2020");
        assert_eq!(
            found.citation,
            "Brenner S. Rego, Guilherme V. Raffo, Joseph K. Scott, Davide M. Raimondo. \
             Automatica 111, 108614 (2020). doi:10.1016/j.automatica.2019.108614."
        );
        assert_eq!(folders(), ["box", "ezgkf", "inzsmf", "cz", "bundle"]);
    }
}
