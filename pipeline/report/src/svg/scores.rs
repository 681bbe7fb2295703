//! Numbers as bars from 0, in groups that have a scale each, with intervals over their ends.

use super::bars::Group;
use super::{INK, MARGIN, TITLE, WIDTH, escaped, pixels, text};

/// Bars in groups.
#[derive(Clone, Debug, Default)]
pub struct Scores {
    /// What it shows, above it
    pub title: String,
    /// What is to be seen, in words
    pub description: String,
    /// The groups from the top
    pub groups: Vec<Group>,
}

const NAMES: f64 = 150.0;
const TEXTS: f64 = 230.0;
const ROW: f64 = 16.0;
const FONT: f64 = 11.5;

impl Group {
    /// The ends of its axis: 0, and what its bars reach.
    fn reach(&self) -> [f64; 2] {
        let values = self.bars.iter().flat_map(|b| {
            let [lo, hi] = b.ends.unwrap_or([b.value; 2]);
            [b.value, lo, hi]
        });
        let [lo, hi] = values.fold([0.0_f64; 2], |[lo, hi], v| [lo.min(v), hi.max(v)]);
        if lo < hi { [lo, hi] } else { [0.0, 1.0] }
    }

    fn draw(&self, body: &mut String, mut top: f64) -> f64 {
        let (left, right) = (MARGIN + NAMES, WIDTH - MARGIN - TEXTS);
        let [lo, hi] = self.reach();
        let at = |v: f64| left + (right - left) * (v / (hi - lo) - lo / (hi - lo));
        top += ROW + 8.0;
        text(
            body,
            [MARGIN, top],
            FONT,
            " font-weight=\"bold\"",
            &self.label,
        );
        let first = top + 4.0;
        for bar in &self.bars {
            top += ROW;
            text(body, [MARGIN + 8.0, top], FONT, "", &bar.name);
            let [from, to] = [at(bar.value.min(0.0)), at(bar.value.max(0.0))].map(|x| x);
            let colour = bar.colour.hex();
            body.push_str(&format!(
                "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"10\" fill=\"{colour}\" fill-opacity=\".55\"/>\n",
                pixels(from),
                pixels(top - 9.0),
                pixels(to - from)
            ));
            let mut end = to;
            if let Some(ends) = bar.ends {
                let [lo, hi] = ends.map(at);
                end = end.max(hi);
                body.push_str(&format!(
                    "<path d=\"M{} {}H{}M{0} {3}v6M{2} {3}v6\" stroke=\"{INK}\" stroke-width=\"1.2\"/>\n",
                    pixels(lo),
                    pixels(top - 4.0),
                    pixels(hi),
                    pixels(top - 7.0)
                ));
            }
            text(body, [end + 6.0, top], FONT, "", &bar.text);
        }
        body.push_str(&format!(
            "<path d=\"M{} {}V{}\" stroke=\"{INK}\" stroke-width=\".8\"/>\n",
            pixels(at(0.0)),
            pixels(first),
            pixels(top + 3.0)
        ));
        top
    }
}

impl Scores {
    /// The picture, in text that depends on the values alone.
    pub fn to_svg(&self) -> String {
        let (mut body, mut top) = (String::new(), MARGIN + TITLE + 3.0);
        let bold = " font-weight=\"bold\"";
        text(&mut body, [MARGIN, top - 3.0], TITLE, bold, &self.title);
        for group in &self.groups {
            top = group.draw(&mut body, top);
        }
        let height = pixels(top + MARGIN);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" \
             viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" \
             font-family=\"Helvetica,Arial,'Liberation Sans',sans-serif\" fill=\"{INK}\">\n\
             <title>{}</title>\n<desc>{}</desc>\n\
             <rect width=\"{WIDTH}\" height=\"{height}\" rx=\"6\" fill=\"#fff\"/>\n{body}</svg>\n",
            escaped(&self.title),
            escaped(&self.description),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::svg::Colour;
    use crate::svg::bars::Bar;

    #[test]
    fn a_bar_is_as_long_as_its_value_on_the_scale_of_its_group() {
        let bar = |value, ends| Bar {
            name: "a <name>".to_owned(),
            value,
            ends,
            text: String::new(),
            colour: Colour::Blue,
        };
        let group = Group {
            label: "rmse".to_owned(),
            bars: vec![bar(1.0, Some([0.5, 2.0])), bar(-2.0, None)],
        };
        assert_eq!(group.reach(), [-2.0, 2.0]);
        let svg = Scores {
            groups: vec![group],
            ..Scores::default()
        }
        .to_svg();
        let whole = WIDTH - 2.0 * MARGIN - NAMES - TEXTS;
        let width = |part: f64| format!("width=\"{}\" height=\"10\"", pixels(whole * part));
        assert!(
            svg.contains(&width(0.25)) && svg.contains(&width(0.5)),
            "{svg}"
        );
        assert!(svg.contains("a &lt;name&gt;"));
    }

    #[test]
    fn a_group_of_zeros_has_a_scale_too() {
        let group = Group {
            label: String::new(),
            bars: Vec::new(),
        };
        assert_eq!(group.reach(), [0.0, 1.0]);
    }
}
