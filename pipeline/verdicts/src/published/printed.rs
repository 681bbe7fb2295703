//! A printed number: its value, and the size of its last digit, read from its text.

/// The value of a printed number: a number, a product, or a quotient of two products, where everything
/// right of the one slash is the divisor.
pub fn value(printed: &str) -> Option<f64> {
    let product = |t: &str| {
        t.split('*').try_fold(1.0, |p, factor| {
            Some(p * factor.trim().parse::<f64>().ok()?)
        })
    };
    let value = match printed.split_once('/') {
        None => product(printed)?,
        Some((over, under)) => product(over)? / product(under)?,
    };
    value.is_finite().then_some(value)
}

/// Half a unit of the last printed digit of a plain decimal number; 0 for anything else.
pub fn half_unit(printed: &str) -> f64 {
    let digits = printed.trim().trim_start_matches(['-', '+']);
    if digits.is_empty() || !digits.chars().all(|c| c.is_ascii_digit() || c == '.') {
        return 0.0;
    }
    let decimals = digits.split_once('.').map_or(0, |(_, d)| d.len());
    0.5 * (0..decimals).fold(1.0, |unit, _| unit / 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn printed_numbers_have_values_and_units() {
        assert_eq!(value(".0437"), Some(0.0437));
        assert_eq!(value("1/4*2"), Some(0.125));
        assert_eq!(value("0.5*0.02*-6"), Some(0.5 * 0.02 * -6.0));
        assert_eq!(value("always"), None);
        assert_eq!(value("inf"), None);
        assert_eq!(half_unit(".600"), 0.5e-3);
        assert_eq!(half_unit("-12"), 0.5);
        assert_eq!(half_unit("1/4"), 0.0);
    }
}
