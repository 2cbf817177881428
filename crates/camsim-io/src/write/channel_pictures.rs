//! Channels of a frame as pictures for people: distances, normals, numbers and displacements in colour.

use std::f32::consts::TAU;

use camsim_core::{
    frame::{Plane, PlaneValues, RenderedFrame},
    scenario::{Channel, FlowState},
    scene::Encoding,
};

use super::png_file::{hue_rgb8, palette_rgb8};

/// Turbo (Mikhailov 2019) at sixteenths, sRGB: dark blue, blue, green, yellow, red, dark red.
const TURBO: [[u8; 3]; 17] = [
    [48, 18, 59],
    [64, 64, 162],
    [70, 107, 227],
    [66, 148, 255],
    [40, 188, 235],
    [24, 221, 194],
    [50, 242, 152],
    [109, 254, 98],
    [164, 252, 60],
    [205, 236, 52],
    [238, 207, 58],
    [253, 172, 52],
    [251, 126, 33],
    [235, 80, 14],
    [208, 47, 5],
    [169, 22, 1],
    [122, 4, 3],
];
/// Share of the values below the ends of a scale, and above.
const BEYOND: f32 = 0.01;
/// Brightness where the target of a flow does not show the point.
const UNSEEN: f32 = 0.4;

/// A picture of each channel that is a picture or a plane, as frames whose colours are linear, in the order of
/// [`Channel::ALL`].
///
/// - distances: turbo by their logarithm between the 1st and 99th percentile, near red and far blue;
/// - normals: red to the right or north, green up or east, blue towards the camera or down;
/// - numbers: [`palette_rgb8`]; coverage: grey;
/// - displacements: hue by direction (red to the right, then yellow and green downwards), pale where short
///   against the 99th percentile, dark where the target does not show the point.
///
/// The sky and pixels without a value are black.
#[must_use]
pub fn channel_pictures(frame: &RenderedFrame) -> Vec<(Channel, RenderedFrame)> {
    let picture = |channel: Channel| {
        let rgb8 = match channel {
            Channel::Color => return Some((channel, with_color(frame, frame.color_rgba.clone()))),
            Channel::Depth => distances(frame.depth_m.as_deref()?),
            _ => of_plane(frame.planes.iter().find(|plane| plane.channel == channel)?),
        };
        let linear = Encoding::Srgb.decode_table();
        let pixel = |[r, g, b]: [u8; 3]| [linear[r as usize], linear[g as usize], linear[b as usize], 1.0];
        Some((channel, with_color(frame, rgb8.into_iter().flat_map(pixel).collect())))
    };
    Channel::ALL.iter().copied().filter_map(picture).collect()
}

fn with_color(frame: &RenderedFrame, color_rgba: Vec<f32>) -> RenderedFrame {
    RenderedFrame { index: frame.index, size_px: frame.size_px, color_rgba, ..RenderedFrame::default() }
}

fn of_plane(plane: &Plane) -> Vec<[u8; 3]> {
    let byte = |value: f32| (255.0 * value.clamp(0.0, 1.0)).round() as u8;
    let values = match &plane.values {
        PlaneValues::Index(numbers) => return numbers.iter().map(|&number| palette_rgb8(number)).collect(),
        PlaneValues::Float(values) => values,
    };
    let normal = |signs: [f32; 3]| {
        let of_pixel = |n: &[f32]| {
            if n == [0.0; 3] { [0; 3] } else { [0, 1, 2].map(|k: usize| byte(0.5 + 0.5 * signs[k] * n[k])) }
        };
        values.chunks_exact(3).map(of_pixel).collect()
    };
    match plane.channel {
        Channel::Range => distances(values),
        Channel::Normal => normal([1.0, -1.0, -1.0]),
        Channel::NormalWorld => normal([1.0; 3]),
        Channel::Motion => displacements(values.chunks_exact(2).map(|v| ([v[0], v[1]], 1.0)).collect()),
        Channel::BlurPath => {
            displacements(values.chunks_exact(4).map(|v| ([v[2] - v[0], v[3] - v[1]], 1.0)).collect())
        }
        Channel::Flow | Channel::FlowBack | Channel::FlowGlobal => {
            let of_pixel = |v: &[f32]| {
                let state = |state: FlowState| v[2] == f32::from(state as u8);
                let value = match () {
                    () if state(FlowState::None) => 0.0,
                    () if state(FlowState::Visible) || state(FlowState::Several) => 1.0,
                    () => UNSEEN,
                };
                ([v[0], v[1]], value)
            };
            displacements(values.chunks_exact(3).map(of_pixel).collect())
        }
        Channel::Coverage
        | Channel::Color
        | Channel::Depth
        | Channel::Valid
        | Channel::Rows
        | Channel::Raw
        | Channel::Coords
        | Channel::Object
        | Channel::Class => values.iter().map(|&value| [byte(value); 3]).collect(),
    }
}

fn distances(values_m: &[f32]) -> Vec<[u8; 3]> {
    let is_there = |value: f32| value > 0.0 && value.is_finite();
    let logs = values_m.iter().filter(|&&value| is_there(value)).map(|value| value.ln()).collect();
    let [near, far] = ends(logs);
    let color = |&value: &f32| match is_there(value) {
        true => turbo(1.0 - (value.ln() - near) / (far - near).max(f32::MIN_POSITIVE)),
        false => [0; 3],
    };
    values_m.iter().map(color).collect()
}

/// Displacements with their brightness.
fn displacements(pixels: Vec<([f32; 2], f32)>) -> Vec<[u8; 3]> {
    let lengths = pixels.iter().filter(|(_, value)| *value > 0.0).map(|([x, y], _)| x.hypot(*y)).collect();
    let [_, longest] = ends(lengths);
    let color = |([x, y], value): ([f32; 2], f32)| {
        let saturation = (x.hypot(y) / longest.max(f32::MIN_POSITIVE)).min(1.0);
        hue_rgb8((y.atan2(x) / TAU).rem_euclid(1.0).into(), saturation.into(), value.into())
    };
    pixels.into_iter().map(color).collect()
}

/// Ends of a scale; 0 and 1 without values.
fn ends(mut values: Vec<f32>) -> [f32; 2] {
    values.retain(|value| value.is_finite());
    values.sort_unstable_by(f32::total_cmp);
    let last = values.len().saturating_sub(1) as f32;
    let at = |share: f32| values.get((share * last).round() as usize).copied();
    [at(BEYOND).unwrap_or(0.0), at(1.0 - BEYOND).unwrap_or(1.0)]
}

fn turbo(share: f32) -> [u8; 3] {
    let place = share.clamp(0.0, 1.0) * (TURBO.len() - 1) as f32;
    let low = (place as usize).min(TURBO.len() - 2);
    let mix = |k: usize| {
        let [a, b] = [TURBO[low][k], TURBO[low + 1][k]].map(f32::from);
        (a + (b - a) * (place - low as f32)).round() as u8
    };
    [0, 1, 2].map(mix)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn srgb(picture: &RenderedFrame) -> Vec<[u8; 3]> {
        let pixels = picture.color_rgba.chunks_exact(4);
        pixels.map(|p| [0, 1, 2].map(|k: usize| super::super::encode::srgb8(p[k]))).collect()
    }

    #[test]
    fn every_channel_has_its_colours() {
        let plane = |channel, values| Plane { channel, values };
        let flow = vec![2.0, 0.0, 1.0, 0.0, 2.0, 2.0, 0.0, 0.0, 0.0];
        let frame = RenderedFrame {
            size_px: [3, 1],
            color_rgba: vec![0.25; 12],
            depth_m: Some(vec![10.0, 0.0, 1000.0]),
            planes: vec![
                plane(Channel::Object, PlaneValues::Index(vec![0, 1, 2])),
                plane(
                    Channel::Normal,
                    PlaneValues::Float(vec![0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]),
                ),
                plane(Channel::Flow, PlaneValues::Float(flow)),
                plane(Channel::Coverage, PlaneValues::Float(vec![1.0, 0.5, 0.0])),
            ],
            ..RenderedFrame::default()
        };
        let pictures = channel_pictures(&frame);
        let of = |channel: Channel| {
            let found = pictures.iter().find(|(known, _)| *known == channel);
            found.map(|(_, picture)| srgb(picture)).unwrap_or_default()
        };
        let channels: Vec<Channel> = pictures.iter().map(|(channel, _)| *channel).collect();
        assert_eq!(
            channels,
            [
                Channel::Color,
                Channel::Depth,
                Channel::Normal,
                Channel::Object,
                Channel::Coverage,
                Channel::Flow
            ]
        );
        // Near is dark red, the sky black, far dark blue.
        assert_eq!(of(Channel::Depth), [TURBO[16], [0; 3], TURBO[0]]);
        assert_eq!(of(Channel::Normal), [[128, 128, 255], [0; 3], [255, 128, 128]]);
        assert_eq!(of(Channel::Object), [[0; 3], palette_rgb8(1), palette_rgb8(2)]);
        assert_eq!(of(Channel::Coverage), [[255; 3], [128; 3], [0; 3]]);
        // To the right is red; downwards a quarter of the wheel on, dark as it is hidden; nothing is black.
        assert_eq!(of(Channel::Flow), [[255, 0, 0], [51, 102, 0], [0; 3]]);
    }
}
