//! Distributions of drawn numbers, and the random numbers behind them: functions of seed, name and index alone.
//!
//! A draw does not depend on draws before it, so a series can be made in any order and in parts.

use crate::noise::{camera_seed, sample_words, upper_quantile, upper_tail};

/// Stream of [`sample_words`], apart from those of sensors.
const STREAM: u32 = 0x6472_6177;
/// Smallest fraction of a normal distribution that its clip may leave.
const MIN_CLIPPED_SHARE: f64 = 1e-9;
/// Largest span of [`Distribution::Integer`]: its numbers are equally likely to one part in 2^16.
const MAX_SPAN: i64 = 1 << 32;
/// Whole numbers up to here are exact in f64.
const MAX_WHOLE: i64 = 1 << 53;

/// Random numbers of one name, such as the key of a scenario.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Draws {
    seed: u64,
}

impl Draws {
    /// Those of a name. Other names have independent numbers.
    #[must_use]
    pub fn new(seed: u64, name: &str) -> Self {
        Self { seed: camera_seed(seed, name) }
    }

    /// Number `index`, of 48 bits.
    #[must_use]
    pub fn bits(self, index: u64) -> u64 {
        let [a, b, ..] = sample_words(index as i64, self.seed, STREAM);
        (u64::from(a >> 8) << 24) | u64::from(b >> 8)
    }

    /// Number `index`, uniform in (0, 1) without its ends.
    #[must_use]
    pub fn unit(self, index: u64) -> f64 {
        (self.bits(index) as f64 + 0.5) / (1_u64 << 48) as f64
    }
}

/// A distribution of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distribution {
    /// Equally likely from `low` to `high`.
    Uniform {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// The logarithm is equally likely: as many from 1 to 10 as from 10 to 100.
    LogUniform {
        /// Lower end, above 0.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// Normal, cut off at the ends of `clip`: values beyond do not occur, and none heap up there.
    Normal {
        /// Mean, before clipping.
        mean: f64,
        /// Standard deviation, before clipping.
        sigma: f64,
        /// Lowest and highest value, infinite where nothing is cut off.
        clip: [f64; 2],
    },
    /// Whole numbers, each equally likely, both ends included.
    Integer {
        /// Lowest.
        low: i64,
        /// Highest.
        high: i64,
    },
}

impl Distribution {
    /// Why the numbers make no distribution.
    ///
    /// # Errors
    /// A sentence that goes after the name of the distribution.
    pub fn check(&self) -> Result<(), String> {
        let ends = |low: f64, high: f64| match low.is_finite() && high.is_finite() {
            true if low <= high => Ok(()),
            true => Err(format!("goes from {low} down to {high}: write the lower number first")),
            false => Err("needs two finite numbers".to_owned()),
        };
        match *self {
            Self::Uniform { low, high } => ends(low, high),
            Self::LogUniform { low, high } if low > 0.0 => ends(low, high),
            Self::LogUniform { .. } => Err("needs numbers above 0".to_owned()),
            Self::Normal { mean, sigma, clip } => {
                if !(mean.is_finite() && sigma.is_finite() && sigma > 0.0) {
                    return Err("needs a finite mean and a standard deviation above 0".to_owned());
                }
                let [low, high] = clip;
                if low.is_nan() || high.is_nan() || low >= high {
                    return Err(format!("has clip = [{low}, {high}]: write the lower number first"));
                }
                match clipped_fraction(mean, sigma, clip) {
                    fraction if fraction >= MIN_CLIPPED_SHARE => Ok(()),
                    _ => Err(format!("of {mean} +- {sigma} hardly ever lies in its clip [{low}, {high}]")),
                }
            }
            Self::Integer { low, high } => {
                if low > high {
                    return Err(format!("goes from {low} down to {high}: write the lower number first"));
                }
                let is_exact = low >= -MAX_WHOLE && high <= MAX_WHOLE;
                match high.checked_sub(low) {
                    Some(span) if span <= MAX_SPAN && is_exact => Ok(()),
                    _ => Err("spans more than 2^32 numbers, or numbers beyond 2^53".to_owned()),
                }
            }
        }
    }

    /// The value below which a fraction `unit`, in (0, 1), of the values lies. For legal numbers ([`Self::check`]).
    ///
    /// Values but whole ones are rounded to 12 digits, so that machines whose logarithms differ in the last bit
    /// agree, and so that decimal text holds them exactly.
    #[must_use]
    pub fn quantile(&self, unit: f64) -> f64 {
        match *self {
            Self::Uniform { low, high } => rounded(low + (high - low) * unit, [low, high]),
            Self::LogUniform { low, high } => {
                rounded((low.ln() + (high.ln() - low.ln()) * unit).exp(), [low, high])
            }
            Self::Normal { mean, sigma, clip } => {
                let z = clipped_quantile(clip.map(|end| (end - mean) / sigma), unit);
                rounded(mean + sigma * z, clip)
            }
            Self::Integer { low, high } => {
                let count = (high - low + 1) as f64;
                (low as f64 + (unit * count).floor()).min(high as f64)
            }
        }
    }
}

/// The number of the first of these weights, which need not sum to 1, that reaches a fraction `unit` of their sum.
/// Those of weight 0 are never chosen.
#[must_use]
pub fn choose(weights: &[f64], unit: f64) -> usize {
    let mut left = unit * weights.iter().sum::<f64>();
    for (i, weight) in weights.iter().enumerate() {
        if left < *weight {
            return i;
        }
        left -= weight;
    }
    // Rounding may leave a rest.
    weights.iter().rposition(|weight| *weight > 0.0).unwrap_or(0)
}

/// A number to 12 digits, as [`Distribution::quantile`] rounds.
#[must_use]
pub fn to_12_digits(value: f64) -> f64 {
    format!("{value:.11e}").parse().unwrap_or(value)
}

/// `value` to 12 digits, within the ends.
fn rounded(value: f64, [low, high]: [f64; 2]) -> f64 {
    to_12_digits(value).clamp(low, high)
}

/// Lower tail of the standard normal.
fn lower_tail(z: f64) -> f64 {
    if z < 0.0 { upper_tail(-z) } else { 1.0 - upper_tail(z) }
}

/// Fraction of a normal distribution within its clip.
fn clipped_fraction(mean: f64, sigma: f64, clip: [f64; 2]) -> f64 {
    let [low, high] = clip.map(|end| (end - mean) / sigma);
    // Tails are exact where they are small.
    if low > 0.0 { upper_tail(low) - upper_tail(high) } else { lower_tail(high) - lower_tail(low) }
}

/// Quantile of the standard normal that is cut off at `low` and `high`.
fn clipped_quantile([low, high]: [f64; 2], unit: f64) -> f64 {
    if low > 0.0 {
        return -clipped_quantile([-high, -low], 1.0 - unit);
    }
    let (from, to) = (lower_tail(low), lower_tail(high));
    let p = from + unit * (to - from);
    if p < 0.5 { -upper_quantile(p.max(f64::MIN_POSITIVE)) } else { upper_quantile(1.0 - p) }
}

#[cfg(test)]
mod tests;
