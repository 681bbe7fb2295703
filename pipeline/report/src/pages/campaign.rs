//! The long campaign against the guarantees, from the committed `attack.csv` beside the pages, by estimator.

use crate::document::prose::prose;
use crate::document::{Block, Kind, Page, Shape, Table, line};
use zonobench_attack::clopper_pearson_upper;
use zonobench_engine::long_campaign::RecordedAttack;
use zonobench_evidence::attack::CONFIDENCE;
use zonobench_lake::digits::four_digits;

/// The name of the file beside the pages.
pub const FILE: &str = "attack.csv";

/// The columns of [`rows`].
const COLUMNS: [(&str, Shape); 10] = [
    ("paper", Shape::Words),
    ("system", Shape::Words),
    ("estimator", Shape::Words),
    ("guaranteed", Shape::Words),
    ("sets", Shape::Number),
    ("undecided", Shape::Number),
    ("lost", Shape::Number),
    ("of them called empty", Shape::Number),
    ("refused", Shape::Number),
    ("rate of losses below (95 %, sets as trials)", Shape::Number),
];

/// How it was run, and how it is run again.
fn how(recorded: &[RecordedAttack]) -> String {
    let mut codes: Vec<&str> = recorded.iter().map(|row| row.code.as_str()).collect();
    codes.sort_unstable();
    codes.dedup();
    format!(
        "Counted once by `zonobench attack --record reports/attack.csv` and kept in that file, with the number of runs of \
         every row; the counts depend on the code alone, here {}, and `zonobench attack --recount reports/attack.csv` counts \
         them again and names a row that its own code counts otherwise. The lake's table `attack` holds the small campaign \
         that every `reproduce-all` makes. Of the constrained zonotopes' intersections, undecided are empty sets that are \
         not called empty. The bound on a rate is Clopper and Pearson's with the sets as trials, as if they were \
         independent, which the sets of one run are not.{}",
        codes.join(", "),
        by_runs(recorded)
    )
}

/// The bound with the runs as trials, of what is guaranteed and lost nothing; empty where there is no such thing.
fn by_runs(recorded: &[RecordedAttack]) -> String {
    let clean = |row: &&RecordedAttack| row.guaranteed && row.lost == 0;
    let units: u64 = recorded.iter().filter(clean).map(|row| row.units).sum();
    if units == 0 {
        return String::new();
    }
    format!(
        " With the runs as trials, which are drawn independently: of the guaranteed rows without a loss, {units} runs in \
         all, none lost a set, so at 95 % fewer than {} of such runs do.",
        four_digits(clopper_pearson_upper(0, units, CONFIDENCE))
    )
}

/// One row an estimator and family of problems, all attacks together, in the order of the file.
fn rows(recorded: &[RecordedAttack]) -> Vec<[String; 10]> {
    let mut sums: Vec<RecordedAttack> = Vec::new();
    for row in recorded {
        let same = |sum: &&mut RecordedAttack| {
            sum.paper == row.paper && sum.system == row.system && sum.estimator == row.estimator
        };
        match sums.iter_mut().find(same) {
            Some(sum) => {
                sum.steps += row.steps;
                sum.undecided += row.undecided;
                sum.lost += row.lost;
                sum.empty += row.empty;
                sum.refused += row.refused;
            }
            None => sums.push(row.clone()),
        }
    }
    let shown = |sum: RecordedAttack| {
        let bound = clopper_pearson_upper(sum.lost, sum.steps, CONFIDENCE);
        let guaranteed = if sum.guaranteed { "yes" } else { "no" };
        [
            sum.paper,
            sum.system,
            sum.estimator,
            guaranteed.to_owned(),
            sum.steps.to_string(),
            sum.undecided.to_string(),
            sum.lost.to_string(),
            sum.empty.to_string(),
            sum.refused.to_string(),
            four_digits(bound),
        ]
    };
    sums.into_iter().map(shown).collect()
}

/// The page; None where nothing was recorded.
pub fn page(recorded: &[RecordedAttack]) -> Option<Page> {
    if recorded.is_empty() {
        return None;
    }
    let rows = rows(recorded).into_iter();
    let rows = rows.map(|row| row.map(Into::into).to_vec()).collect();
    let caption = "Every estimator that was attacked";
    Some(Page {
        place: "campaign".to_owned(),
        name: "Campaign".to_owned(),
        file: Some(super::FRONT.to_owned()),
        title: line!["The campaign against the guarantees"],
        blocks: vec![
            Block::Para(prose(&how(recorded))),
            Block::Table(Table::new(Kind::Sortable, caption, &COLUMNS, rows)),
        ],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_attacks_on_one_estimator_are_summed() {
        let text = "paper,system,estimator,attack,guaranteed,units,steps,undecided,lost,empty,refused,code\n\
                    cz,linear,zmv,uniform,true,1,40,1,0,0,0,7a\ncz,linear,zmv,chase,true,1,60,2,0,0,1,7a\n\
                    cz,linear,zsmf,chase,false,1,10,0,3,1,0,7a\n";
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(FILE);
        std::fs::write(&path, text).unwrap();
        let recorded = zonobench_engine::long_campaign::read(&path).unwrap();
        let found = rows(&recorded);
        assert_eq!(found.len(), 2);
        assert_eq!(found[0][..9].join(" "), "cz linear zmv yes 100 3 0 0 1");
        assert_eq!(found[0][9], four_digits(1.0 - libm::pow(0.05, 0.01)));
        assert_eq!(found[1][4..9].join(" "), "10 0 3 1 0");
        std::fs::write(&path, text.replace("3,1,0", "3,4,0")).unwrap();
        let message = zonobench_engine::long_campaign::read(&path)
            .unwrap_err()
            .to_string();
        assert!(message.contains("zsmf"), "{message}");
        assert!(page(&[]).is_none());
        let section = crate::render::markdown::files(&[page(&recorded).unwrap()]);
        let section = &section[crate::pages::FRONT];
        assert!(section.contains("here 7a, and"));
        // Two runs of zmv.
        let bound = four_digits(1.0 - libm::sqrt(0.05));
        assert!(section.contains(&format!(
            "2 runs in all, none lost a set, so at 95 % fewer than {bound} of"
        )));
    }
}
