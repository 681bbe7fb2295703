//! The counts of a paper's claims about cost, drawn: counted points, and the claimed growth beside them.

use crate::document::{Block, Kind, Line, Picture, Shape, Table, badge, code, emphasis, line};
use crate::svg::{Axis, Colour, Figure, Marker, Panel, Series};
use std::collections::BTreeMap;
use zonobench_lake::rows::Complexity;

/// The file of the picture of one claim.
fn file_name(claim: &str) -> String {
    format!("count-{claim}.svg")
}

/// The section of a page with its pictures; nothing where nothing was counted.
pub fn section(paper: &str, rows: &[Complexity]) -> Vec<Block> {
    if rows.is_empty() {
        return Vec::new();
    }
    let mut statements = Vec::new();
    let mut pictures = Vec::new();
    for (claim, sweeps) in by_claim(rows) {
        let verdict = |r: &&Complexity| &*r.claim == claim && r.sweep_variable.is_none();
        let Some(statement) = rows.iter().find(verdict) else {
            continue;
        };
        statements.push(vec![
            claim.into(),
            badge(&statement.verdict).into(),
            (&*statement.reason).into(),
        ]);
        // The engine's own counts share a picture with the reading under the paper's prices.
        pictures.extend(picture(claim, &sweeps).map(|svg| {
            Block::Picture(Picture {
                file: file_name(claim),
                title: claim.to_owned(),
                svg,
                caption: Line::new(),
            })
        }));
    }
    let columns = [
        ("Claim", Shape::Words),
        ("Verdict", Shape::Words),
        ("Counted", Shape::Why),
    ];
    let mut out = vec![
        Block::heading(2, "Counted operations"),
        Block::Para(line![
            "What the code did, counted by the kernels themselves, beside what the paper's formulas say. A factor does not \
             refute an O(·), growth does: ",
            emphasis("holds"),
            " where the count grows as the formula in every sweep, ",
            emphasis("holds_as_bound"),
            " where nowhere faster. All points: ",
            code(format!("zonobench count {paper}"))
        ]),
        Block::Table(Table::new(
            Kind::Sortable,
            "Counted operations",
            &columns,
            statements,
        )),
    ];
    out.extend(pictures);
    out
}

/// The rows of each claim by what is swept, claims in their order.
fn by_claim(rows: &[Complexity]) -> Vec<(&str, BTreeMap<&str, Vec<&Complexity>>)> {
    let mut claims: Vec<(&str, BTreeMap<&str, Vec<&Complexity>>)> = Vec::new();
    for r in rows {
        if claims.last().is_none_or(|(claim, _)| *claim != &*r.claim) {
            claims.push((&r.claim, BTreeMap::new()));
        }
        if let (Some(variable), Some((_, sweeps))) = (&r.sweep_variable, claims.last_mut()) {
            sweeps.entry(variable).or_default().push(r);
        }
    }
    claims
}

/// A panel a sweep, both axes logarithmic: counted points, the formula dashed and through its last point the slope
/// that the count was fitted with. None for a claim without sweeps, or whose counts are not positive.
fn picture(claim: &str, sweeps: &BTreeMap<&str, Vec<&Complexity>>) -> Option<String> {
    let panels: Vec<Panel> = sweeps
        .iter()
        .filter_map(|(variable, rows)| panel(variable, rows))
        .collect();
    let columns = panels.len().min(3);
    (columns > 0).then(|| {
        Figure {
            title: format!("{claim}: operations counted, and the formula"),
            columns,
            panels,
            ..Figure::default()
        }
        .to_svg()
    })
}

fn panel(variable: &str, rows: &[&Complexity]) -> Option<Panel> {
    let points = |y: fn(&Complexity) -> Option<f64>| -> Vec<[f64; 2]> {
        let point = |r: &&Complexity| Some([r.size? as f64, y(r)?]);
        let positive = |p: &[f64; 2]| p[0] > 0.0 && p[1] > 0.0;
        rows.iter().filter_map(point).filter(positive).collect()
    };
    let (counted, formula) = (points(|r| r.counted), points(|r| r.formula));
    if counted.len() < 2 || formula.len() < 2 {
        return None;
    }
    let mut series = vec![
        Series::Dashes {
            label: "formula".to_owned(),
            colour: Colour::Vermilion,
            points: formula.clone(),
        },
        Series::Points {
            label: "counted".to_owned(),
            colour: Colour::Blue,
            marker: Marker::Ring,
            points: counted,
        },
    ];
    // The slope that the formula has at its largest sizes.
    if let [.., a, b] = formula[..] {
        let exponent = libm::log(b[1] / a[1]) / libm::log(b[0] / a[0]);
        if exponent.is_finite() {
            series.push(Series::Slope {
                label: "claimed slope".to_owned(),
                colour: Colour::Grey,
                exponent,
                through: b,
            });
        }
    }
    let axis = |label: &str| Axis {
        log: true,
        ..Axis::new(label, "")
    };
    let degree = rows.first().and_then(|r| r.fitted_degree);
    Some(Panel {
        title: degree.map_or_else(String::new, |d| format!("counted degree {d:.2}")),
        x: axis(match variable {
            "all" => "all sizes",
            name => name,
        }),
        y: axis("operations"),
        series,
        ..Panel::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(variable: Option<&str>, size: i64, counted: f64) -> Complexity {
        Complexity {
            claim: "c".into(),
            sweep_variable: variable.map(Into::into),
            size: variable.map(|_| size),
            counted: variable.map(|_| counted),
            formula: variable.map(|_| (size * size) as f64),
            ratio: None,
            fitted_degree: Some(2.0),
            degree_lo: None,
            degree_hi: None,
            verdict: "holds".into(),
            reason: "because".into(),
        }
    }

    #[test]
    fn a_claim_with_a_sweep_has_a_picture_and_one_without_has_none() {
        let rows = [
            row(None, 0, 0.0),
            row(Some("n"), 1, 3.0),
            row(Some("n"), 2, 12.0),
        ];
        let pictures = |rows: &[Complexity]| -> Vec<String> {
            let blocks = section("p", rows).into_iter();
            let svg = |block| match block {
                Block::Picture(picture) => Some(picture.svg),
                _ => None,
            };
            blocks.filter_map(svg).collect()
        };
        let drawn = pictures(&rows);
        assert_eq!(drawn.len(), 1);
        assert!(drawn[0].contains("counted degree 2.00"));
        assert!(pictures(&rows[..1]).is_empty() && !section("p", &rows[..1]).is_empty());
        assert!(section("p", &[]).is_empty());
    }
}
