//! Units as UCUM codes: products and quotients of powers of atoms with prefixes, `m/s2`, `kg.m2`, `mrad`, `1`.

use std::ops::Range;

/// Atoms that may have a metric prefix.
const METRIC: &[&str] = &[
    "m", "g", "s", "A", "K", "mol", "cd", "rad", "sr", "Hz", "N", "Pa", "J", "W", "V", "C", "F",
    "Ohm", "S", "Wb", "T", "H", "lm", "lx", "Bq", "Gy", "Sv", "kat", "L", "l", "eV", "bar", "t",
    "B", "Cel", "u", "cal", "G", "Np",
];

/// Atoms without one.
const PLAIN: &[&str] = &[
    "1", "%", "min", "h", "d", "wk", "mo", "a", "deg", "'", "''", "ar", "har", "AU", "pc", "[c]",
    "[g]", "[in_i]", "[ft_i]", "[mi_i]", "[lb_av]", "[degF]", "[pi]", "[ppm]", "10*", "atm", "gon",
    "circ", "[rpm]",
];

const PREFIXES: &[&str] = &[
    "da", "Y", "Z", "E", "P", "T", "G", "M", "k", "h", "d", "c", "m", "u", "n", "p", "f", "a", "z",
    "y",
];

/// Whether `text` is a unit; else the bytes that are none, and what stands there.
pub fn check(text: &str) -> Result<(), (Range<usize>, String)> {
    if text.is_empty() {
        return Err((0..0, String::new()));
    }
    let mut from = 0;
    for part in text.split(['.', '/']) {
        // A quotient may begin with its slash: /s.
        let leads = part.is_empty() && from == 0 && text.starts_with('/') && text.len() > 1;
        if !leads && !is_component(part) {
            return Err((
                from..from + part.len(),
                if part.is_empty() {
                    text.to_owned()
                } else {
                    part.to_owned()
                },
            ));
        }
        from += part.len() + 1;
    }
    Ok(())
}

/// An atom with a prefix and an exponent, or a whole number; a note in braces counts as 1.
fn is_component(part: &str) -> bool {
    let part = match part.split_once('{') {
        Some(("", note)) => return note.ends_with('}'),
        Some((unit, note)) if note.ends_with('}') => unit,
        Some(_) => return false,
        None => part,
    };
    if !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit()) {
        return true;
    }
    if let Some(exponent) = part
        .strip_prefix("10*")
        .or_else(|| part.strip_prefix("10^"))
    {
        return exponent.parse::<i32>().is_ok();
    }
    let atom = part.trim_end_matches(|c: char| c.is_ascii_digit());
    let atom = atom
        .strip_suffix(['-', '+'])
        .filter(|_| atom.len() < part.len())
        .unwrap_or(atom);
    if METRIC.contains(&atom) || PLAIN.contains(&atom) {
        return true;
    }
    PREFIXES.iter().any(|prefix| {
        atom.strip_prefix(prefix)
            .is_some_and(|rest| METRIC.contains(&rest))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_read_and_others_are_pointed_at() {
        for unit in [
            "1",
            "m",
            "m/s",
            "m/s2",
            "kg.m2",
            "rad",
            "mrad",
            "urad",
            "m.s-2",
            "/s",
            "N.m/rad",
            "km/h",
            "deg",
            "%",
            "kPa",
            "L/min",
            "mol/L",
            "{count}",
            "m{eq}",
            "10*3/L",
            "J/(mol.K)",
        ] {
            let ok = check(unit).is_ok();
            // Parentheses are UCUM, and not read here: a quotient of a quotient says the same.
            assert_eq!(ok, !unit.contains('('), "{unit}");
        }
        for (unit, range, got) in [
            ("meter", 0..5, "meter"),
            ("m/sec", 2..5, "sec"),
            ("", 0..0, ""),
            ("m//s", 2..2, "m//s"),
            ("m s", 0..3, "m s"),
            ("°", 0..2, "°"),
        ] {
            assert_eq!(check(unit), Err((range, got.to_owned())), "{unit}");
        }
    }
}
