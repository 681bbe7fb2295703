use super::*;

fn line(label: &str, points: Vec<[f64; 2]>) -> Series {
    Series::Line {
        label: label.to_owned(),
        colour: Colour::Blue,
        points,
    }
}

fn panel(series: Vec<Series>) -> Panel {
    Panel {
        title: "a panel".to_owned(),
        x: Axis::new("time", "s"),
        y: Axis::new("x1", "m"),
        series,
        equal: false,
    }
}

fn figure(panels: Vec<Panel>) -> Figure {
    Figure {
        title: "A figure".to_owned(),
        columns: 3,
        panels,
        ..Figure::default()
    }
}

/// A pseudo-random walk (the multiplier of MINSTD), so that no point can be left out.
fn rough(points: u32) -> Vec<[f64; 2]> {
    let mut state = 42_u64;
    let mut value = 0.0;
    (0..points)
        .map(|k| {
            state = state * 48_271 % 0x7fff_ffff;
            value += state as f64 / f64::from(0x7fff_ffff) - 0.5;
            [f64::from(k), value]
        })
        .collect()
}

/// Every path of the document.
fn paths(svg: &str) -> Vec<&str> {
    svg.split("<path d=\"")
        .skip(1)
        .map(|rest| rest.split('"').next().unwrap())
        .collect()
}

#[test]
fn the_same_figure_is_the_same_text() {
    let draw = || figure(vec![panel(vec![line("x", rough(500))])]).to_svg();
    assert_eq!(draw(), draw());
}

#[test]
fn six_rough_panels_stay_small() {
    let series = || {
        let band = rough(250)
            .iter()
            .map(|p| [p[0], p[1] - 1.0, p[1] + 1.0])
            .collect();
        let band = Series::Band {
            label: "hull".to_owned(),
            colour: Colour::Sky,
            points: band,
        };
        panel(vec![band, line("x", rough(250))])
    };
    let svg = figure((0..6).map(|_| series()).collect()).to_svg();
    assert!(svg.len() < 60_000, "{} bytes", svg.len());
}

#[test]
fn it_says_what_it_shows() {
    let svg = figure(vec![panel(vec![
        line("truth", rough(5)),
        line("estimate", rough(5)),
    ])])
    .to_svg();
    assert!(svg.starts_with("<svg "));
    assert!(svg.contains(" role=\"img\""));
    assert!(svg.contains("<title>A figure</title>"));
    assert!(svg.contains("<desc>a panel over time (s): truth, estimate.</desc>"));
}

#[test]
fn labels_are_escaped() {
    let mut panel = panel(vec![line("a < b & \"c\"\u{1}", rough(5))]);
    panel.title = "x > y".to_owned();
    let svg = figure(vec![panel]).to_svg();
    assert!(svg.contains(">a &lt; b &amp; &quot;c&quot;\u{fffd}</text>"));
    assert!(svg.contains(">x &gt; y</text>"));
    assert!(!svg.contains("a < b"));
}

#[test]
fn a_polygon_is_closed_and_one_with_a_vertex_at_infinity_is_not_drawn() {
    let polygon = |vertices| Series::Polygon {
        label: String::new(),
        colour: Colour::Green,
        filled: true,
        vertices,
    };
    let mut vertices = rectangle([0.0, 0.0], [2.0, 1.0]);
    let count = |vertices| {
        let svg = figure(vec![panel(vec![polygon(vertices)])]).to_svg();
        let closed = paths(&svg).iter().filter(|d| d.ends_with('z')).count();
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        closed
    };
    assert_eq!(count(vertices.clone()), 1);
    vertices[2][0] = f64::INFINITY;
    assert_eq!(count(vertices), 0);
}

#[test]
fn a_line_has_a_gap_where_it_is_not_finite() {
    let mut points = rough(20);
    points[7][1] = f64::NAN;
    points[12][1] = f64::INFINITY;
    let svg = figure(vec![panel(vec![line("", points)])]).to_svg();
    let inside = svg.split("overflow").nth(1).unwrap();
    let line = paths(inside)[1]; // after the grid
    assert_eq!(line.matches('M').count(), 3, "{line}");
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
}

#[test]
fn a_label_stands_once_in_the_legend() {
    let panels = (0..3)
        .map(|_| panel(vec![line("EZGKF", rough(5))]))
        .collect();
    let svg = figure(panels).to_svg();
    assert_eq!(svg.matches(">EZGKF</text>").count(), 1);
}

#[test]
fn a_slope_is_straight_on_logarithmic_axes() {
    let log = |label: &str| Axis {
        log: true,
        ..Axis::new(label, "1")
    };
    let slope = Series::Slope {
        label: "n³".to_owned(),
        colour: Colour::Grey,
        exponent: 3.0,
        through: [10.0, 1000.0],
    };
    let measured = (1..20)
        .map(|n| [f64::from(n), f64::from(n * n * n)])
        .collect();
    let panel = Panel {
        x: log("n"),
        y: log("operations"),
        series: vec![slope, line("counted", measured)],
        ..Panel::default()
    };
    let svg = figure(vec![panel]).to_svg();
    // Simplified, a straight line is two points: a move and one step.
    let straight =
        |d: &&str| d.starts_with('M') && d.matches(['l', 'M']).count() == 2 && !d.contains('z');
    let panel = svg.split("overflow").nth(1).unwrap();
    assert!(
        paths(panel).iter().skip(1).take(2).all(straight),
        "{:?}",
        paths(panel)
    );
}

#[test]
fn an_ellipse_goes_through_the_ends_of_its_axes() {
    let points = ellipse([1.0, 2.0], [[4.0, 0.0], [0.0, 9.0]]);
    assert_eq!(points[0], [3.0, 2.0]);
    assert!((points[18][1] - 5.0).abs() < 1e-12); // rounding of sin π/2
    assert!(ellipse([0.0, 0.0], [[-1.0, 0.0], [0.0, 1.0]]).is_empty());
}

#[test]
fn nothing_to_draw_is_drawn_all_the_same() {
    for panels in [
        vec![],
        vec![panel(vec![])],
        vec![panel(vec![line("x", vec![[f64::NAN, 1.0]])])],
    ] {
        let svg = figure(panels).to_svg();
        assert!(svg.ends_with("</svg>\n") && !svg.contains("NaN"));
    }
}

#[test]
fn long_labels_below_a_narrow_panel_do_not_touch() {
    let narrow = || panel(vec![line("x", vec![[-0.008_865, 0.0], [-0.008_855, 1.0]])]);
    let svg = figure(vec![narrow(), narrow(), narrow()]).to_svg();
    let label = |text: &str| -> Option<(f64, String)> {
        let x = text.split('"').nth(1)?.parse().ok()?;
        let says = text.split('>').nth(1)?.split('<').next()?;
        (text.contains("10.5") && text.contains("middle")).then(|| (x, says.to_owned()))
    };
    let labels: Vec<_> = svg.split("<text ").filter_map(label).collect();
    assert!(labels.len() > 3, "{labels:?}");
    for pair in labels.windows(2).filter(|pair| pair[0].0 < pair[1].0) {
        let half = |l: &(f64, String)| text_width(&l.1, TICK_LABEL) / 2.0;
        assert!(
            pair[0].0 + half(&pair[0]) < pair[1].0 - half(&pair[1]),
            "{pair:?}"
        );
    }
}
