//! Ratios as bars along a logarithmic axis, with names and numbers beside them.

use super::{Colour, INK, MARGIN, TITLE, WIDTH, escaped, pixels, text};

/// Bars in groups, all along one logarithmic axis that begins at 1.
#[derive(Clone, Debug, Default)]
pub struct Bars {
    /// What it shows, above it
    pub title: String,
    /// What is to be seen, in words
    pub description: String,
    /// The groups from the top
    pub groups: Vec<Group>,
}

/// Bars under one heading.
#[derive(Clone, Debug, Default)]
pub struct Group {
    /// Its heading
    pub label: String,
    /// The bars from the top
    pub bars: Vec<Bar>,
}

/// A bar to `value`, from 1 on a logarithmic axis, where what is not above 1 has its text alone, and from 0 on a linear one.
#[derive(Clone, Debug)]
pub struct Bar {
    /// Its name, left of it
    pub name: String,
    /// Where it ends
    pub value: f64,
    /// From where to where the value spreads or is uncertain, a line over its end
    pub ends: Option<[f64; 2]>,
    /// What stands right of it
    pub text: String,
    /// Its colour
    pub colour: Colour,
}

const NAMES: f64 = 110.0;
const TEXTS: f64 = 250.0;
const ROW: f64 = 16.0;
const FONT: f64 = 11.5;

impl Bars {
    /// The picture, in text that depends on the values alone.
    pub fn to_svg(&self) -> String {
        let bars = || self.groups.iter().flat_map(|g| &g.bars);
        let most = bars()
            .map(|b| b.ends.map_or(b.value, |ends| b.value.max(ends[1])))
            .filter(|v| v.is_finite());
        let decades = libm::log10(most.fold(10.0, f64::max)).ceil();
        let (left, right) = (MARGIN + NAMES, WIDTH - MARGIN - TEXTS);
        let at =
            |v: f64| left + (right - left) * (libm::log10(v.max(1.0)) / decades).clamp(0.0, 1.0);
        let (mut body, mut top) = (String::new(), MARGIN + TITLE + 3.0);
        text(
            &mut body,
            [MARGIN, top - 3.0],
            TITLE,
            " font-weight=\"bold\"",
            &self.title,
        );
        let first = top + 6.0;
        for group in &self.groups {
            top += ROW + 6.0;
            text(
                &mut body,
                [MARGIN, top],
                FONT,
                " font-weight=\"bold\"",
                &group.label,
            );
            for bar in &group.bars {
                top += ROW;
                text(&mut body, [MARGIN + 8.0, top], FONT, "", &bar.name);
                let (end, colour) = (at(bar.value), bar.colour.hex());
                body.push_str(&format!(
                    "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"10\" fill=\"{colour}\" fill-opacity=\".55\"/>\n",
                    pixels(left),
                    pixels(top - 9.0),
                    pixels(end - left)
                ));
                let mut reach = end;
                if let Some([from, to]) = bar.ends.map(|ends| ends.map(at)) {
                    body.push_str(&format!(
                        "<path d=\"M{} {}H{}\" stroke=\"{INK}\" stroke-width=\"1.2\"/>\n",
                        pixels(from),
                        pixels(top - 4.0),
                        pixels(to)
                    ));
                    reach = reach.max(to);
                }
                text(&mut body, [reach + 6.0, top], FONT, "", &bar.text);
            }
        }
        top += 8.0;
        for exponent in 0..=decades as i32 {
            let value = libm::pow(10.0, f64::from(exponent));
            body.push_str(&format!(
                "<path d=\"M{} {}V{}\" stroke=\"#c8c8c8\" stroke-width=\".7\"/>\n",
                pixels(at(value)),
                pixels(first),
                pixels(top)
            ));
            text(
                &mut body,
                [at(value), top + 13.0],
                FONT,
                " text-anchor=\"middle\"",
                &format!("{value}"),
            );
        }
        let height = pixels(top + 24.0);
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

    #[test]
    fn a_bar_ends_at_its_logarithm() {
        let bar = |value| Bar {
            name: "a <tool>".to_owned(),
            value,
            ends: None,
            text: String::new(),
            colour: Colour::Blue,
        };
        let group = Group {
            label: "hull".to_owned(),
            bars: vec![bar(10.0), bar(0.5), bar(100.0)],
        };
        let svg = Bars {
            groups: vec![group],
            ..Bars::default()
        }
        .to_svg();
        let widths: Vec<&str> = svg
            .split("width=\"")
            .skip(3)
            .filter_map(|s| s.split('"').next())
            .collect();
        let whole = WIDTH - 2.0 * MARGIN - NAMES - TEXTS;
        assert!(widths.contains(&pixels(whole).as_str()), "{widths:?}");
        assert!(widths.contains(&pixels(whole / 2.0).as_str()), "{widths:?}");
        assert!(widths.contains(&"0"), "{widths:?}");
        assert!(svg.contains("a &lt;tool&gt;"));
    }
}
