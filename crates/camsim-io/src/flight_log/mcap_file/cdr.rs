//! Decoding of ROS messages: CDR of ROS 2, and the packed form of ROS 1.

/// Reads values one after the other.
#[derive(Clone, Debug)]
pub(super) struct Decoder<'a> {
    body: &'a [u8],
    at: usize,
    is_big_endian: bool,
    /// Largest alignment; 1 packs values without gaps.
    max_alignment: usize,
    /// Whether headers begin with a sequence number and texts have no zero at their end, as in ROS 1.
    pub(super) is_ros1: bool,
}

impl<'a> Decoder<'a> {
    /// A decoder of a message in the encoding that its channel names; `None` if that is not known.
    pub(super) fn new(encoding: &str, bytes: &'a [u8]) -> Option<Self> {
        match encoding {
            "ros1" => {
                Some(Self { body: bytes, at: 0, is_big_endian: false, max_alignment: 1, is_ros1: true })
            }
            "cdr" => {
                let (head, body) = bytes.split_at_checked(4)?;
                // 0 and 1 are plain CDR, 6 and 7 its second version, which aligns to 4 bytes at most; the even
                // ones have the most significant byte first.
                let max_alignment = match head[1] {
                    0 | 1 => 8,
                    6 | 7 => 4,
                    _ => return None,
                };
                Some(Self { body, at: 0, is_big_endian: head[1] & 1 == 0, max_alignment, is_ros1: false })
            }
            _ => None,
        }
    }

    fn bytes<const N: usize>(&mut self) -> Option<[u8; N]> {
        let alignment = N.min(self.max_alignment).max(1);
        let at = self.at.checked_next_multiple_of(alignment)?;
        let end = at.checked_add(N)?;
        let mut bytes: [u8; N] = self.body.get(at..end)?.try_into().ok()?;
        self.at = end;
        if self.is_big_endian {
            bytes.reverse();
        }
        Some(bytes)
    }

    pub(super) fn u8(&mut self) -> Option<u8> {
        self.bytes::<1>().map(|[byte]| byte)
    }

    pub(super) fn u16(&mut self) -> Option<u16> {
        self.bytes().map(u16::from_le_bytes)
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        self.bytes().map(u32::from_le_bytes)
    }

    pub(super) fn f64(&mut self) -> Option<f64> {
        self.bytes().map(f64::from_le_bytes)
    }

    pub(super) fn f64s<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64()?;
        }
        Some(values)
    }

    /// A text, without the zero at its end.
    pub(super) fn text(&mut self) -> Option<String> {
        let length = usize::try_from(self.u32()?).ok()?;
        let end = self.at.checked_add(length)?;
        let bytes = self.body.get(self.at..end)?;
        self.at = end;
        let text = if self.is_ros1 { bytes } else { bytes.strip_suffix(&[0]).unwrap_or(bytes) };
        Some(String::from_utf8_lossy(text).into_owned())
    }
}
