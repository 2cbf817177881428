//! Writes small TIFF files, valid and invalid.

use std::path::Path;

/// Values of a tag.
#[derive(Clone)]
pub enum Value {
    Short(Vec<u16>),
    Long(Vec<u32>),
    Double(Vec<f64>),
    Text(&'static str),
}

/// A classic little-endian TIFF with one strip.
#[derive(Clone)]
pub struct Tiff {
    pub tags: Vec<(u16, Value)>,
    pub data: Vec<u8>,
    pub keys: Vec<u16>,
}

impl Tiff {
    /// One band of floats in UTM zone 32N with 10 m pixels; the corner is at 500 000, 5 200 000.
    pub fn heights([width, height]: [u32; 2], value: impl Fn(u32, u32) -> f32) -> Self {
        let data: Vec<u8> = (0..height)
            .flat_map(|row| (0..width).map(move |column| (column, row)))
            .flat_map(|(c, r)| value(c, r).to_le_bytes())
            .collect();
        let mut tiff = Self::pixels([width, height], 1, 32, 3, 1, data);
        tiff.keys = vec![1024, 1, 1025, 1, 3072, 32632];
        tiff
    }

    /// Bands of bytes with the same georeference as [`Self::heights`].
    pub fn colors(
        [width, height]: [u32; 2],
        bands: u16,
        photometric: u16,
        value: impl Fn(u32, u32, u16) -> u8,
    ) -> Self {
        let value = &value;
        let data = (0..height)
            .flat_map(|row| {
                (0..width).flat_map(move |column| (0..bands).map(move |band| value(column, row, band)))
            })
            .collect();
        let mut tiff = Self::pixels([width, height], bands, 8, 1, photometric, data);
        tiff.keys = vec![1024, 1, 1025, 1, 3072, 32632];
        tiff
    }

    /// Pixels without GeoKeys.
    pub fn pixels(
        [width, height]: [u32; 2],
        bands: u16,
        bits: u16,
        format: u16,
        photometric: u16,
        data: Vec<u8>,
    ) -> Self {
        let tags = vec![
            (256, Value::Long(vec![width])),
            (257, Value::Long(vec![height])),
            (258, Value::Short(vec![bits; bands.into()])),
            (259, Value::Short(vec![1])),
            (262, Value::Short(vec![photometric])),
            (277, Value::Short(vec![bands])),
            (278, Value::Long(vec![height])),
            (339, Value::Short(vec![format; bands.into()])),
            (33550, Value::Double(vec![10.0, 10.0, 0.0])),
            (33922, Value::Double(vec![0.0, 0.0, 0.0, 500_000.0, 5_200_000.0, 0.0])),
        ];
        Self { tags, data, keys: Vec::new() }
    }

    /// Replaces a tag.
    pub fn with(mut self, tag: u16, value: Value) -> Self {
        self.tags.retain(|(known, _)| *known != tag);
        self.tags.push((tag, value));
        self
    }

    /// Replaces the GeoKeys: pairs of key and value.
    pub fn with_keys(mut self, keys: &[u16]) -> Self {
        self.keys = keys.to_vec();
        self
    }

    /// Sets GDAL_METADATA.
    pub fn with_metadata(self, items: &'static str) -> Self {
        self.with(42112, Value::Text(items))
    }

    /// Writes the file.
    pub fn write(mut self, path: &Path) {
        if !self.keys.is_empty() {
            let mut list = vec![1, 1, 0, self.keys.len() as u16 / 2];
            self.keys.chunks(2).for_each(|key| list.extend([key[0], 0, 1, key[1]]));
            self.tags.push((34735, Value::Short(list)));
        }
        if !self.tags.iter().any(|(tag, _)| *tag == 273) {
            self.tags.push((273, Value::Long(vec![8])));
        }
        if !self.tags.iter().any(|(tag, _)| *tag == 279) {
            self.tags.push((279, Value::Long(vec![self.data.len() as u32])));
        }
        self.tags.sort_by_key(|(tag, _)| *tag);
        let mut file = b"II*\0\0\0\0\0".to_vec();
        file.extend(&self.data);
        let mut entries = Vec::new();
        for (tag, value) in &self.tags {
            let (kind, count, bytes): (u16, usize, Vec<u8>) = match value {
                Value::Short(list) => (3, list.len(), list.iter().flat_map(|v| v.to_le_bytes()).collect()),
                Value::Long(list) => (4, list.len(), list.iter().flat_map(|v| v.to_le_bytes()).collect()),
                Value::Double(list) => (12, list.len(), list.iter().flat_map(|v| v.to_le_bytes()).collect()),
                Value::Text(text) => (2, text.len() + 1, [text.as_bytes(), &[0]].concat()),
            };
            entries.extend(tag.to_le_bytes());
            entries.extend(kind.to_le_bytes());
            entries.extend((count as u32).to_le_bytes());
            if bytes.len() <= 4 {
                entries.extend(bytes.iter().chain(&[0; 4]).take(4));
            } else {
                file.resize(file.len().next_multiple_of(2), 0);
                entries.extend((file.len() as u32).to_le_bytes());
                file.extend(bytes);
            }
        }
        file.resize(file.len().next_multiple_of(2), 0);
        let directory_offset = (file.len() as u32).to_le_bytes();
        file[4..8].copy_from_slice(&directory_offset);
        file.extend((self.tags.len() as u16).to_le_bytes());
        file.extend(entries);
        file.extend([0; 4]);
        std::fs::write(path, file).unwrap();
    }
}
