//! How tables print numbers.

use std::fmt;

/// A number of a table: the fewest decimal digits (at most 17) that read back to the same bits. Below 1e-5 and from
/// 1e16 on it has an exponent (`-1.2985e-25`); whole numbers have no fraction (`7`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Number(pub f64);

impl Number {
    /// The digits, in `buffer`.
    pub(crate) fn digits(self, buffer: &mut zmij::Buffer) -> &str {
        let text = buffer.format(self.0);
        text.strip_suffix(".0").unwrap_or(text)
    }
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.digits(&mut zmij::Buffer::new()))
    }
}

/// Nanoseconds as decimal seconds, exactly: with all nine decimals.
pub(crate) fn seconds(t_ns: i64) -> String {
    let (whole, rest) = (t_ns.unsigned_abs() / 1_000_000_000, t_ns.unsigned_abs() % 1_000_000_000);
    format!("{}{whole}.{rest:09}", if t_ns < 0 { "-" } else { "" })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    #[test]
    fn numbers_are_short_and_read_back() {
        for (value, text) in [
            (0.0, "0"),
            (-0.0, "-0"),
            (7.0, "7"),
            (-2.5, "-2.5"),
            (0.1 + 0.2, "0.30000000000000004"),
            (1.0 / 3.0, "0.3333333333333333"),
            (1e-5, "0.00001"),
            (1e-6, "1e-6"),
            (2e-4, "0.0002"),
            (-1.298_5e-25, "-1.2985e-25"),
            (1_403_636_579.763_555, "1403636579.763555"),
            (9_007_199_254_740_992.0, "9007199254740992"),
            (1e22, "1e+22"),
            (f64::MIN_POSITIVE, "2.2250738585072014e-308"),
        ] {
            assert_eq!(Number(value).to_string(), text);
            assert_eq!(text.parse::<f64>().unwrap().to_bits(), value.to_bits());
        }
    }

    #[test]
    fn seconds_have_nine_decimals() {
        assert_eq!([seconds(-1), seconds(1_000_000_123)], ["-0.000000001", "1.000000123"]);
    }

    #[test]
    fn no_number_has_more_than_17_digits() {
        // Bits of a linear congruential generator: all exponents.
        let mut bits = 1_u64;
        for _ in 0..20_000 {
            bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let value = f64::from_bits(bits);
            if !value.is_finite() {
                continue;
            }
            let text = Number(value).to_string();
            let mantissa = text.split('e').next().unwrap().trim_start_matches(['-', '0', '.']);
            let digits = mantissa.chars().filter(char::is_ascii_digit).count();
            assert!(digits <= 17 && text.len() <= 24, "{text}");
            assert_eq!(text.parse::<f64>().unwrap().to_bits(), value.to_bits(), "{text}");
        }
    }
}
