//! Numbers as people read them.

/// Four significant digits, plain between 1e-4 and 1e6.
pub fn four_digits(x: f64) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    let scientific = format!("{x:.3e}");
    let Some((_, exponent)) = scientific.split_once('e') else {
        return scientific;
    };
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if !(-4..6).contains(&exponent) {
        return scientific;
    }
    let decimals = (3 - exponent).max(0) as usize;
    let plain = format!("{x:.decimals$}");
    if plain.contains('.') {
        plain.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        plain
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_show_four_digits() {
        for (x, text) in [
            (0.0440012, "0.044"),
            (1.0, "1"),
            (0.99999, "1"),
            (123_456.0, "123456"),
            (1.234_56e-7, "1.235e-7"),
            (-0.25444, "-0.2544"),
        ] {
            assert_eq!(four_digits(x), text);
        }
    }
}
