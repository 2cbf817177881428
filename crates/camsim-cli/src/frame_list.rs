//! `--frames`: a selection of frames.

use std::{fmt, str::FromStr};

/// Reads the number of one frame or variation.
///
/// # Errors
/// A message for the user.
pub fn whole_number(text: &str) -> Result<u64, String> {
    let is_number = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    text.parse()
        .ok()
        .filter(|_| is_number)
        .ok_or_else(|| format!("it is a number that counts from 0, such as 7, and at most {}", u64::MAX))
}

/// Ranges as typed; omitted ends come from the sequence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameList(Vec<FrameRange>);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct FrameRange {
    first: u64,
    /// Exclusive.
    end: Option<u64>,
}

/// Why `--frames` cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FrameListError {
    /// Not a list of ranges.
    Syntax(String),
    /// An empty range.
    Empty(String),
    /// A frame outside of the window.
    Outside {
        /// The option.
        asked_by: &'static str,
        /// The frame.
        frame: u64,
        /// Number of frames.
        frames: u64,
    },
}

impl fmt::Display for FrameListError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Syntax(part) => {
                write!(
                    f,
                    "`{part}` is not a range of frames, which count from 0: write 7, 10..20 (without 20), 10..=20, 10.. or several \
                     of them with commas"
                )
            }
            Self::Empty(part) => write!(f, "`{part}` is empty: the end must be above the start"),
            Self::Outside { asked_by, frame, frames } => {
                let last = frames.saturating_sub(1);
                write!(
                    f,
                    "{asked_by}: frame {frame} does not exist, the last one is {last}; widen flight.window_s \
                     or raise camera.fps"
                )
            }
        }
    }
}

impl std::error::Error for FrameListError {}

impl FromStr for FrameList {
    type Err = FrameListError;

    fn from_str(text: &str) -> Result<Self, FrameListError> {
        text.split(',').map(|part| FrameRange::parse(part.trim())).collect::<Result<_, _>>().map(Self)
    }
}

impl FrameRange {
    fn parse(text: &str) -> Result<Self, FrameListError> {
        let syntax = || FrameListError::Syntax(text.to_owned());
        let number = |digits: &str| match digits.bytes().all(|byte| byte.is_ascii_digit()) {
            true => digits.parse::<u64>().map_err(|_| syntax()),
            false => Err(syntax()),
        };
        let part = match text.split_once("..") {
            None => {
                let first = number(text)?;
                Self { first, end: Some(first.checked_add(1).ok_or_else(syntax)?) }
            }
            Some((first, end)) => Self {
                first: if first.is_empty() { 0 } else { number(first)? },
                end: match (end, end.strip_prefix('=')) {
                    ("", _) => None,
                    (_, Some(last)) => Some(number(last)?.checked_add(1).ok_or_else(syntax)?),
                    (end, None) => Some(number(end)?),
                },
            },
        };
        if part.end.is_some_and(|end| end <= part.first) {
            return Err(FrameListError::Empty(text.to_owned()));
        }
        Ok(part)
    }
}

impl FrameList {
    /// The selected frames of a sequence of `frames` frames, in ascending order without duplicates.
    ///
    /// # Errors
    /// [`FrameListError::Outside`].
    pub fn resolve(&self, frames: u64) -> Result<Vec<u64>, FrameListError> {
        let mut list = Vec::new();
        for part in &self.0 {
            let end = part.end.unwrap_or_else(|| frames.max(part.first + 1));
            if end > frames {
                return Err(FrameListError::Outside {
                    asked_by: "--frames",
                    frame: part.first.max(frames).min(end - 1),
                    frames,
                });
            }
            list.extend(part.first..end);
        }
        list.sort_unstable();
        list.dedup();
        Ok(list)
    }
}

impl FrameList {
    /// The same for `--variations`, of a scenario with `count` of them, or as many as one likes.
    ///
    /// # Errors
    /// A message for the user.
    pub fn variations(&self, count: Option<u64>) -> Result<Vec<u64>, String> {
        let is_open = self.0.iter().any(|part| part.end.is_none());
        let first = self.0.iter().map(|part| part.first).max().unwrap_or(0);
        let end = self.0.iter().filter_map(|part| part.end).max().unwrap_or(0).max(first.saturating_add(1));
        match count {
            Some(count) if end > count => Err(format!(
                "--variations: variation {} does not exist, the last one is {}; raise randomize.variations",
                first.max(count),
                count.saturating_sub(1)
            )),
            Some(count) => self.resolve(count).map_err(|error| error.to_string()),
            None if is_open => {
                Err("--variations has no end: write 0..100, or state randomize.variations".into())
            }
            None if end - self.0.iter().map(|part| part.first).min().unwrap_or(0) > MOST_VARIATIONS => {
                Err(format!("--variations: more than {MOST_VARIATIONS} in one run; render them in parts"))
            }
            None => self.resolve(end).map_err(|error| error.to_string()),
        }
    }
}

/// Most variations of one run, which lists them.
pub const MOST_VARIATIONS: u64 = 10_000_000;

/// `--shard I/N`: every N-th frame, starting with the I-th (counted from 1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard(
    /// I and N.
    pub [u64; 2],
);

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers =
            text.split_once('/').and_then(|(i, n)| Some((i.trim().parse().ok()?, n.trim().parse().ok()?)));
        match numbers {
            Some((index, count)) if (1..=count).contains(&index) => Ok(Self([index, count])),
            _ => Err("write I/N with I from 1 to N: 1/4 is the first of four shards".to_owned()),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.0[0], self.0[1])
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    fn frames(text: &str, of: u64) -> Result<Vec<u64>, FrameListError> {
        text.parse::<FrameList>()?.resolve(of)
    }

    #[test]
    fn numbers_count_from_0() {
        assert_eq!((whole_number("0"), whole_number("12")), (Ok(0), Ok(12)));
        for text in ["-1", "", "1.5", "+3", "a", "18446744073709551616"] {
            assert!(whole_number(text).is_err_and(|error| error.contains("counts from 0")), "{text}");
        }
    }

    #[test]
    fn ranges_are_read_as_in_rust() {
        assert_eq!(frames("2..5", 10), Ok(vec![2, 3, 4]));
        assert_eq!(frames("2..=5", 10), Ok(vec![2, 3, 4, 5]));
        assert_eq!(frames("7", 10), Ok(vec![7]));
        assert_eq!(frames("8..", 10), Ok(vec![8, 9]));
        assert_eq!(frames("..2", 10), Ok(vec![0, 1]));
        assert_eq!(frames("5, 1..3, 2..4", 10), Ok(vec![1, 2, 3, 5]));
    }

    #[test]
    fn invalid_ranges_are_refused() {
        for text in [
            "",
            "a",
            "1..b",
            "-1",
            "1...3",
            "..=",
            "1,,2",
            "1..=18446744073709551615",
            "99999999999999999999",
            "+3",
        ] {
            assert!(matches!(text.parse::<FrameList>(), Err(FrameListError::Syntax(_))), "{text}");
        }
        for text in ["3..3", "5..2", "..0"] {
            assert!(matches!(text.parse::<FrameList>(), Err(FrameListError::Empty(_))), "{text}");
        }
    }

    #[test]
    fn frames_outside_are_refused() {
        let outside = |frame: u64| Err(FrameListError::Outside { asked_by: "--frames", frame, frames: 10 });
        assert_eq!(frames("5..12", 10), outside(10));
        assert_eq!(frames("20", 10), outside(20));
        assert_eq!(frames("12..", 10), outside(12));
        // A huge range is refused before it is listed.
        assert_eq!(frames("0..18446744073709551615", 10), outside(10));
    }

    #[test]
    fn variations_have_a_stated_number_or_no_end() {
        let variations = |text: &str, count| text.parse::<FrameList>().unwrap().variations(count);
        assert_eq!(variations("17", None), Ok(vec![17]));
        assert_eq!(variations("99998..100000", None), Ok(vec![99_998, 99_999]));
        assert_eq!(variations("3..", Some(5)), Ok(vec![3, 4]));
        for (text, count, wanted) in [
            ("3..", None, "has no end"),
            ("3..7", Some(5), "variation 5 does not exist, the last one is 4"),
            ("0..18446744073709551615", None, "render them in parts"),
        ] {
            let error = variations(text, count).unwrap_err();
            assert!(error.contains(wanted), "{text}: {error}");
        }
    }

    #[test]
    fn shards_count_from_one() {
        assert_eq!("2/3".parse(), Ok(Shard([2, 3])));
        for text in ["0/3", "4/3", "1", "1/0", "a/b", "-1/3"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
