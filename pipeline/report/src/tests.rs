//! The pages of lakes that the engine makes here: small runs of the published experiments, with verdicts and
//! as a smoke run, and an experiment of a user's own.

use super::*;
use crate::document::label;
use crate::render::{html::escaped, markdown};
use std::collections::BTreeMap;
use std::sync::{Arc, LazyLock};
use tempfile::TempDir;
use zonobench_engine::engine;
use zonobench_engine::progress::{Progress, Verbosity};
use zonobench_lab::experiment::Experiment;
use zonobench_lake::lake;
use zonobench_lake::rows::{self, Comparison};
use zonobench_lake::store::Store;
use zonobench_query::query;
use zonobench_query::tables;
use zonobench_verdicts::compare::Scale;
use zonobench_verdicts::judged::{Judged, Subject};
use zonobench_verdicts::papers;
use zonobench_verdicts::verdict::Verdict;

/// A lake of small runs of `wanted` papers, compared at `scale`; with enough steps for every figure if `figures`.
fn published(wanted: &[&str], scale: Scale, figures: bool) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    let names: Vec<String> = wanted.iter().map(|w| (*w).to_owned()).collect();
    let mut files = Vec::new();
    for paper in papers::load(&names).unwrap() {
        let mut paper = paper.quick();
        for e in paper
            .experiments
            .iter_mut()
            .filter(|e| figures && e.id == "van-der-pol")
        {
            *e = Arc::new(Experiment {
                runs: 1,
                steps: 180,
                ..(**e).clone()
            });
        }
        let run = |e| engine::run(&store, e, &Progress::new(Verbosity::Quiet, 1)).unwrap();
        let finished: Vec<engine::Finished> = paper.experiments.iter().map(run).collect();
        for f in &finished {
            files.extend(engine::publications(f).unwrap());
        }
        let compared = engine::compare(&store, &paper, &finished, scale).unwrap();
        files.extend(engine::paper_publications(&compared).unwrap());
    }
    lake::publish(folder.path(), files, |_, _| true).unwrap();
    folder
}

/// Both papers, with verdicts.
static LAKE: LazyLock<TempDir> = LazyLock::new(|| published(&["box", "ezgkf"], Scale::Full, true));

const OWN: &str = r#"
schema = 1
paper = "mine"
id = "try_a"
seed = 7
runs = 3
steps = 10
[system]
kind = "linear"
a = [[0.9]]
c = [[1.0]]
[prior]
box = [[-1.0, 1.0]]
[noise]
w = { box = [[-0.1, 0.1]] }
v = { box = [[-0.1, 0.1]] }
[[estimator]]
id = "bx"
kind = "box-state-est"
[[metric]]
name = "rmse"
"#;

fn own(text: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    let mut files = Vec::new();
    for e in Experiment::parse("own.toml", text).unwrap() {
        let progress = Progress::new(Verbosity::Quiet, 1);
        files.extend(
            engine::publications(&engine::run(&store, &Arc::new(e), &progress).unwrap()).unwrap(),
        );
    }
    lake::publish(folder.path(), files, |_, _| true).unwrap();
    folder
}

fn with_times(lake: &TempDir, times: Vec<RecordedTime>) -> BTreeMap<String, String> {
    let source = Source::open(lake.path()).unwrap();
    let recorded = Recordings {
        times,
        ..Recordings::default()
    };
    let papers = drawn(&source).unwrap();
    markdown::files(&pages::all(&source, &papers, &recorded).unwrap())
}

fn written(lake: &TempDir) -> BTreeMap<String, String> {
    with_times(lake, Vec::new())
}

/// The targets of a page's links, images among them.
fn targets(page: &str) -> Vec<String> {
    let rest = page.split("](").skip(1);
    rest.filter_map(|r| r.split_once(')'))
        .map(|(target, _)| target.to_owned())
        .collect()
}

/// Every link of every page leads to a file and a place in it.
fn assert_links_resolve(pages: &BTreeMap<String, String>) {
    for (name, page) in pages.iter().filter(|(name, _)| name.ends_with(".md")) {
        for target in targets(page) {
            let (file, place) = target.split_once('#').unwrap_or((&target, ""));
            let folder = name.rsplit_once('/').map_or("", |(folder, _)| folder);
            let path = match (file, file.strip_prefix("../")) {
                ("", _) => name.clone(),
                (_, Some(above)) => above.to_owned(),
                _ if folder.is_empty() => file.to_owned(),
                _ => format!("{folder}/{file}"),
            };
            let found = pages
                .get(&path)
                .unwrap_or_else(|| panic!("{name}: {target} leads nowhere"));
            assert!(
                place.is_empty() || found.contains(&format!("<a id=\"{place}\"></a>")),
                "{name}: no place {place} in {path}"
            );
        }
    }
}

/// Every line of a table has as many cells as its header.
fn assert_tables_are_whole(pages: &BTreeMap<String, String>) {
    for (name, page) in pages.iter().filter(|(name, _)| name.ends_with(".md")) {
        let bars = |line: &str| line.replace("\\|", "").matches('|').count();
        let mut header = None;
        for line in page.lines() {
            if line.starts_with('|') {
                assert_eq!(
                    *header.get_or_insert(bars(line)),
                    bars(line),
                    "{name}: {line}"
                );
            } else {
                header = None;
            }
        }
    }
}

#[test]
fn the_same_lake_gives_the_same_bytes_wherever_it_lies() {
    let first = written(&LAKE);
    assert_eq!(first, written(&LAKE));
    let other = tempfile::tempdir().unwrap();
    for entry in lake::read_manifest(LAKE.path()).unwrap() {
        let to = other.path().join(&entry.path);
        std::fs::create_dir_all(to.parent().unwrap()).unwrap();
        std::fs::copy(LAKE.path().join(&entry.path), to).unwrap();
    }
    std::fs::copy(
        LAKE.path().join(lake::MANIFEST),
        other.path().join(lake::MANIFEST),
    )
    .unwrap();
    assert_eq!(first, written(&other));
    let here = LAKE.path().to_str().unwrap();
    assert!(first.values().all(|page| !page.contains(here)));
}

#[test]
fn every_link_leads_somewhere_and_every_table_is_whole() {
    let pages = written(&LAKE);
    assert_links_resolve(&pages);
    assert_tables_are_whole(&pages);
}

#[test]
fn every_figure_is_drawn_and_small() {
    let pages = written(&LAKE);
    for name in [
        "box/fig-3",
        "box/fig-4",
        "box/fig-5",
        "box/fig-6",
        "box/fig-7",
        "box/fig-8",
        "box/fig-9",
        "ezgkf/fig-1",
    ] {
        let svg = &pages[&format!("{name}.svg")];
        assert!(svg.len() < 60_000, "{name} has {} bytes", svg.len());
        let (folder, file) = name.split_once('/').unwrap();
        assert!(
            pages[&format!("{folder}/README.md")].contains(&format!("({file}.svg)")),
            "{name} is not shown"
        );
    }
    assert!(!pages["box/README.md"].contains("Not drawn"));
    assert!(!pages["ezgkf/README.md"].contains("Not drawn"));
}

#[test]
fn the_queries_below_a_figure_give_what_it_shows() {
    let mut queries = 0;
    for page in written(&LAKE).values() {
        for line in page
            .lines()
            .filter_map(|line| line.strip_prefix("zonobench query \""))
        {
            // As a shell reads it.
            let sql = line.trim_end_matches('"').replace("\\\"", "\"");
            let frame = query::run(LAKE.path(), &sql).unwrap();
            assert!(!frame.is_empty(), "{line}");
            queries += 1;
        }
    }
    assert!(queries >= 16, "{queries} queries");
}

#[test]
fn every_cell_stands_on_its_page_and_every_finding_on_the_front() {
    let pages = written(&LAKE);
    for paper in ["box", "ezgkf"] {
        let page = &pages[&format!("{paper}/README.md")];
        let cells: Vec<Judged> = tables::comparisons(LAKE.path(), paper).unwrap();
        assert!(
            cells.iter().any(|c| c.verdict.is_finding()),
            "{paper} has a finding to look for"
        );
        for c in &cells {
            let place = page
                .split(&format!("\n### {}\n", markdown::escaped(&c.table)))
                .nth(1)
                .unwrap();
            let section = place.split("\n### ").next().unwrap();
            let [row, column] = [&c.row, &c.column].map(|l| markdown::escaped(&label(l)));
            let start = if c.is_as_written() {
                format!("| {row} | {column} | {}", markdown::escaped(&c.published))
            } else {
                format!("|  | ↳ *{}* |", markdown::escaped(c.reading.name()))
            };
            let verdict = format!("| {} |", c.verdict.shown());
            let found = section
                .lines()
                .any(|l| l.starts_with(&start) && l.contains(&verdict));
            assert!(found, "{paper}: {c:?}");
            if c.is_as_written() && c.verdict.is_finding() {
                let front = &pages["README.md"];
                assert!(front.contains(&format!("**{row}**")), "{row} is no finding");
                assert!(
                    front.contains(&markdown::escaped(&c.reason)),
                    "{row} has no reason"
                );
                assert!(
                    front.contains(&format!("`zonobench tables {paper} {:?}`", &*c.table)),
                    "{row} has no command"
                );
            }
        }
    }
}

/// Subject and verdict of every cell as written, from the Parquet rows and the CSV texts alone.
fn counted_by_hand(paper: &str) -> Vec<(Subject, String)> {
    let of = |table: &str| LAKE.path().join(lake::paper_table_path(table, paper));
    let compared: Vec<Comparison> = zonobench_lake::table::read(&of("comparison")).unwrap();
    let printed: Vec<rows::Published> = zonobench_lake::table::read(&of("published")).unwrap();
    let loaded = papers::load(&[paper.to_owned()]).unwrap();
    let mut cells = csv::Reader::from_reader(loaded[0].tables.cells.as_bytes());
    let cells: Vec<csv::StringRecord> = cells.records().map(Result::unwrap).collect();
    let subject = |c: &Comparison| {
        let p = printed
            .iter()
            .find(|p| (&p.table, &p.row, &p.column) == (&c.table, &c.row, &c.column))
            .unwrap();
        let copied = cells.iter().any(|cell| {
            let is = [&*c.table, &c.row, &c.column, &c.reading];
            cell.iter().take(4).eq(is) && &cell[6] == "parameter"
        });
        match (&*p.kind, copied) {
            ("claim", _) => Subject::Claim,
            (_, true) => Subject::Parameter,
            _ => Subject::Number,
        }
    };
    let written = compared.iter().filter(|c| &*c.reading == "as-written");
    written
        .map(|c| (subject(c), c.verdict.to_string()))
        .collect()
}

#[test]
fn a_count_on_the_front_page_is_the_count_of_its_rows() {
    let pages = written(&LAKE);
    let (front, html) = (&pages["README.md"], html_of(&LAKE));
    let html = between(&html, "id=\"overview\"", "</section>")[0].to_owned();
    let all: Vec<(Subject, String)> = ["box", "ezgkf"]
        .into_iter()
        .flat_map(counted_by_hand)
        .collect();
    for subject in Subject::ALL {
        let own: Vec<&str> = all
            .iter()
            .filter(|(s, _)| *s == subject)
            .map(|(_, verdict)| verdict.as_str())
            .collect();
        let line = front
            .lines()
            .find(|l| l.starts_with("- ") && l.contains(&format!(" {}: ", subject.name())))
            .unwrap_or_else(|| panic!("no {} on the front page", subject.name()));
        let start = format!("- {} {}: ", own.len(), subject.name());
        assert!(line.starts_with(&start), "{line}: {start}");
        assert!(html.contains(&format!("<b>{}</b> {}</p>", own.len(), subject.name())));
        // Every part: its verdicts are those of its rows, and the parts are all of them.
        let mut sum = 0;
        for part in line[start.len()..].split(", ") {
            let (n, what) = part.split_once("** ").unwrap();
            let n: usize = n.trim_start_matches("**").parse().unwrap();
            let rows = own
                .iter()
                .filter(|v| subject.outcome(Verdict::parse(v).unwrap()) == what)
                .count();
            assert_eq!(n, rows, "{line}: {what}");
            assert!(html.contains(&format!("<b>{n}</b> {what}</li>")), "{what}");
            sum += n;
        }
        assert_eq!(sum, own.len(), "{line}");
    }
    // Nothing that is fitted, agrees by accident or was copied is called reproduced.
    let reproduced = all.iter().filter(|(subject, verdict)| {
        let names = ["exact", "within_rounding", "within_ci", "within_tolerance"];
        *subject == Subject::Number && names.contains(&verdict.as_str())
    });
    assert!(front.contains(&format!("**{}** reproduced", reproduced.count())));
}

#[test]
fn the_counts_of_the_matrix_are_those_of_the_lake() {
    let pages = written(&LAKE);
    let front = &pages["README.md"];
    let header = front
        .lines()
        .find(|l| l.starts_with("| paper | table |"))
        .unwrap();
    let header: Vec<&str> = header.split(" | ").collect();
    for paper in ["box", "ezgkf"] {
        let whole = format!("| **[{paper}](");
        let line = front.lines().find(|l| l.starts_with(&whole)).unwrap();
        let cells: Vec<&str> = line.split(" | ").collect();
        let counted = counted_by_hand(paper);
        let mut sum = 0;
        for (name, cell) in header.iter().zip(&cells).skip(2) {
            let n: usize = cell.trim_matches(['*', ' ', '|']).parse().unwrap_or(0);
            let rows = counted.iter().filter(|(subject, verdict)| {
                let verdict = Verdict::parse(verdict).unwrap();
                let shown = format!("{}: {}", subject.name(), verdict.shown()).replace('_', " ");
                name.trim_end_matches(" |") == shown
            });
            assert_eq!(n, rows.count(), "{paper}: {name}");
            sum += n;
        }
        assert_eq!(sum, counted.len(), "{paper}");
        // The counts above each table are of its own cells.
        for table in tables::comparisons(LAKE.path(), paper).unwrap() {
            let of_table = tables::comparisons(LAKE.path(), paper).unwrap();
            let n = of_table
                .iter()
                .filter(|c| c.table == table.table && c.is_as_written())
                .filter(|c| (c.subject, c.verdict) == (table.subject, table.verdict))
                .count();
            if !table.is_as_written() {
                continue;
            }
            let page = &pages[&format!("{paper}/README.md")];
            let place = format!("\n### {}\n\n", markdown::escaped(&table.table));
            let line = page.split(&place).nth(1).unwrap().lines().next().unwrap();
            let counted = format!("{n} {}", table.verdict.shown());
            assert!(
                line.contains(&counted),
                "{paper} {}: {counted}",
                table.table
            );
        }
    }
}

#[test]
fn a_dossier_has_every_verdict_that_is_no_success_with_evidence_and_a_command() {
    for paper in ["box", "ezgkf"] {
        let text = dossier(LAKE.path(), paper).unwrap();
        let mut shown = 0;
        for c in tables::comparisons(LAKE.path(), paper).unwrap() {
            let item = format!(
                "{}{}: printed “{}”",
                markdown::escaped(&label(&c.row)),
                if c.column.is_empty() {
                    String::new()
                } else {
                    format!(", {}", markdown::escaped(&label(&c.column)))
                },
                markdown::escaped(&c.published)
            );
            if !c.is_as_written() {
                continue;
            }
            let found = text.lines().position(|l| {
                l.starts_with(&format!("- **{}**", markdown::escaped(&c.table)))
                    && l.contains(&item)
            });
            assert_eq!(found.is_some(), !c.verdict.is_success(), "{paper}: {item}");
            let Some(found) = found else { continue };
            shown += 1;
            let below: Vec<&str> = text.lines().skip(found + 1).take(3).collect();
            let evidence = markdown::escaped(c.reason.trim_end_matches('.'));
            assert_eq!(below[0], format!("  - Evidence: {evidence}"));
            let command = below
                .iter()
                .find(|l| l.starts_with("  - Shown by: `zonobench "));
            assert!(command.is_some(), "{item}: {below:?}");
        }
        assert!(shown > 0, "{paper} has something to ask");
        // It says what came out too, in the counts of the front page.
        let all = tables::comparisons(LAKE.path(), paper).unwrap();
        let reproduced = all
            .iter()
            .filter(|c| c.is_as_written() && c.subject == Subject::Number && c.verdict.is_success())
            .count();
        if reproduced > 0 {
            assert!(
                text.contains(&format!("{reproduced} reproduced")),
                "{paper}"
            );
        }
    }
    let error = dossier(LAKE.path(), "nobody").unwrap_err();
    assert!(matches!(&error, Error::Unknown { expected, .. } if expected == "papers: box, ezgkf"));
    let quick = published(&["ezgkf"], Scale::Quick, false);
    assert!(
        dossier(quick.path(), "ezgkf")
            .unwrap()
            .contains("A smoke run")
    );
}

#[test]
fn a_smoke_run_says_so_and_a_paper_that_is_not_there_is_named() {
    let lake = published(&["ezgkf"], Scale::Quick, false);
    let pages = written(&lake);
    assert_links_resolve(&pages);
    assert_tables_are_whole(&pages);
    assert!(
        pages["README.md"].contains("A smoke run")
            && pages["ezgkf/README.md"].contains("A smoke run")
    );
    assert!(
        pages["README.md"]
            .contains("Not in this lake, `zonobench reproduce-all` makes them:\n\n- box:")
    );
    assert!(pages["ezgkf/README.md"].contains("Not drawn: it shows steps to k = 180"));
    assert!(!pages.contains_key("box/README.md") && !pages.contains_key("ezgkf/fig-1.svg"));
    assert!(!pages["README.md"].contains("## Findings"));
}

/// A plane and a scalar system, so that there are sets in the plane and states without one.
const OWN_PLANE: &str = r#"
schema = 1
paper = "mine"
id = "plane"
seed = 7
runs = 3
steps = 10
[system]
kind = "linear"
a = [[0.9, 0.1], [0.0, 0.8]]
c = [[1.0, 0.0]]
[prior]
box = [[-1.0, 1.0], [-1.0, 1.0]]
[noise]
w = { box = [[-0.1, 0.1], [-0.1, 0.1]] }
v = { box = [[-0.1, 0.1]] }
[[estimator]]
id = "bx"
kind = "box-state-est"
[[estimator]]
id = "by"
kind = "box-state-est"
[[metric]]
name = "rmse"
"#;

#[test]
fn an_experiment_of_ones_own_has_a_page_with_its_pictures_and_scores() {
    let lake = own(OWN);
    let pages = written(&lake);
    let drawn = ["try_a-radius.svg", "try_a-scores.svg", "try_a-states.svg"];
    let drawn = drawn.map(|name| format!("mine/{name}"));
    let mut expected = vec!["README.md", "mine/README.md"];
    expected.extend(drawn.iter().map(String::as_str));
    assert_eq!(pages.keys().collect::<Vec<_>>(), expected);
    assert_links_resolve(&pages);
    assert_tables_are_whole(&pages);
    let page = &pages["mine/README.md"];
    assert!(page.contains("Seed 7."), "{page}");
    assert!(page.contains("| bx | rmse | x1 | 3 | "), "{page}");
    assert!(page.contains("in its hull: bx at 11 of 11."), "{page}");
    let html = html_of(&lake);
    for name in &drawn {
        assert!(html.contains(pages[name].as_str()), "{name}");
    }
}

#[test]
fn methods_of_ones_own_are_ranked_and_their_sets_drawn_in_the_plane() {
    let lake = own(OWN_PLANE);
    let pages = written(&lake);
    assert_links_resolve(&pages);
    assert!(pages["ranking.md"].contains("| bx | 1 | box-state-est |"));
    let sets = &pages["mine/plane-sets.svg"];
    assert!(sets.contains(">k = 10<") && sets.contains(">true state<"));
    assert!(pages["mine/README.md"].contains("in the plane of x1 and x2"));
    // What a query below a picture gives is what it shows.
    let page = &pages["mine/README.md"];
    let queries = page
        .lines()
        .filter_map(|line| line.strip_prefix("zonobench query \""));
    for line in queries {
        let frame = query::run(lake.path(), line.trim_end_matches('"')).unwrap();
        assert!(!frame.is_empty(), "{line}");
    }
}

#[test]
fn times_are_those_recorded_and_no_others() {
    let without = &written(&LAKE)["ezgkf/README.md"];
    assert!(
        without.contains("| Table III, T^CPU, EZGKF | 1.6 ms | not recorded |"),
        "{without}"
    );
    let time = |estimator: &str, median_step_us| RecordedTime {
        paper: "ezgkf".to_owned(),
        experiment: "lpv".to_owned(),
        estimator: estimator.to_owned(),
        median_step_us,
        processor: "Model 7".to_owned(),
    };
    let times = vec![
        time("ezgkp", 200.0),
        time("ezgkf", 250.0),
        time("ezgkf-m", 50.0),
    ];
    let with = &with_times(&LAKE, times)["ezgkf/README.md"];
    assert!(
        with.contains("| Table III, T^CPU, EZGKF | 1.6 ms | 250 µs |"),
        "{with}"
    );
    assert!(
        with.contains("| Table III, T^CPU, EZGKF-M · change | 25 % | 0.25 of the time of ezgkp |"),
        "{with}"
    );
    assert!(with.contains(", on Model 7."));
}

fn html_of(lake: &TempDir) -> String {
    let source = Source::open(lake.path()).unwrap();
    let papers = drawn(&source).unwrap();
    html(
        &pages::all(&source, &papers, &Recordings::default()).unwrap(),
        &papers,
    )
}

/// What stands between `start` and `end`, each time.
fn between<'a>(text: &'a str, start: &str, end: &str) -> Vec<&'a str> {
    let rest = text.split(start).skip(1);
    rest.filter_map(|r| r.split_once(end))
        .map(|(inside, _)| inside)
        .collect()
}

#[test]
fn the_html_page_is_whole_and_needs_no_other_file() {
    let page = html_of(&LAKE);
    assert!(page.len() < 5_000_000, "{} bytes", page.len());
    let places = between(&page, " id=\"", "\"");
    for target in between(&page, "href=\"#", "\"") {
        let found = places.iter().filter(|place| **place == target).count();
        assert_eq!(found, 1, "{target} is a place once");
    }
    for loading in [
        "src=\"",
        "<link rel=\"style",
        "@import",
        "url(",
        "<script src",
    ] {
        assert!(!page.contains(loading), "{loading}");
    }
    // The figures are those of the Markdown pages.
    let pages = written(&LAKE);
    for (name, svg) in pages.iter().filter(|(name, _)| name.ends_with(".svg")) {
        assert!(page.contains(svg.as_str()), "{name}");
    }
    let here = LAKE.path().to_str().unwrap();
    assert!(!page.contains(here));
    assert!(!page.contains("id=\"times\""), "this lake holds no times");
}

#[test]
fn every_cell_of_the_lake_stands_on_the_html_page() {
    let page = html_of(&LAKE);
    for paper in ["box", "ezgkf"] {
        let section = between(&page, &format!("id=\"paper-{paper}\""), "</section>")[0];
        let findings = between(&page, "id=\"findings\"", "</section>")[0];
        for c in tables::comparisons(LAKE.path(), paper).unwrap() {
            let row = escaped(&label(&c.row));
            let verdict = format!("</span> {}</span>", c.verdict.name().replace('_', " "));
            let found = section.lines().any(|line| {
                line.contains(&row)
                    && line.contains(&verdict)
                    && c.reproduced
                        .is_none_or(|x| line.contains(&format!("data-exact=\"{x}\"")))
            });
            assert!(found, "{paper}: {c:?}");
            if c.is_as_written() && c.verdict.is_finding() {
                assert!(
                    findings.contains(&format!("<strong>{row}</strong>")),
                    "{row} is no finding"
                );
            }
        }
    }
}

#[test]
fn an_html_page_of_other_lakes_says_what_it_has() {
    let page = html_of(&own(OWN));
    assert!(page.contains("<th scope=\"row\">bx</th><td>rmse</td><td>x1</td>"));
    let page = html_of(&published(&["ezgkf"], Scale::Quick, false));
    assert!(page.contains("A smoke run") && page.contains("Not drawn: it shows steps to k = 180"));
}

#[test]
fn pages_are_written_once_and_other_files_left_alone() {
    let lake = own(OWN);
    let out = tempfile::tempdir().unwrap();
    std::fs::write(out.path().join("notes.md"), "mine").unwrap();
    assert_eq!(write(lake.path(), out.path()).unwrap(), 6);
    let page = out.path().join("mine/README.md");
    let before = std::fs::metadata(&page).unwrap().modified().unwrap();
    assert_eq!(write(lake.path(), out.path()).unwrap(), 6);
    assert_eq!(
        std::fs::metadata(&page).unwrap().modified().unwrap(),
        before
    );
    assert_eq!(std::fs::read(out.path().join("notes.md")).unwrap(), b"mine");
    assert!(
        write(out.path(), out.path()).is_err(),
        "a folder without a manifest is no lake"
    );
}
