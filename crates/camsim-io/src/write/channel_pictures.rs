//! Channels of a frame as pictures for people: distances, normals, numbers and displacements in colour.

use std::f32::consts::TAU;

use camsim_core::{
    frame::{PlaneValues, RenderedFrame},
    scenario::{CHANNELS, Channel, ChannelFacts, Colors, FlowState},
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
/// Fraction of the values below the ends of a scale, and above.
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
    let picture = |&ChannelFacts { channel, colors, .. }: &ChannelFacts| {
        let values = frame.values(channel)?;
        let rgba = match colors {
            Colors::None => return None,
            Colors::Picture => frame.color_rgba().to_vec(),
            colors => linear_rgba(&of_plane(colors, channel.components().len(), values)),
        };
        let picture = RenderedFrame::picture(frame.size_px, rgba);
        Some((channel, RenderedFrame { index: frame.index, ..picture }))
    };
    CHANNELS.iter().filter_map(picture).collect()
}

fn linear_rgba(rgb8: &[[u8; 3]]) -> Vec<f32> {
    let linear = Encoding::Srgb.decode_table();
    let pixel = |[r, g, b]: &[u8; 3]| [linear[*r as usize], linear[*g as usize], linear[*b as usize], 1.0];
    rgb8.iter().flat_map(pixel).collect()
}

/// sRGB of a plane with so many components a pixel.
fn of_plane(colors: Colors, components: usize, values: &PlaneValues) -> Vec<[u8; 3]> {
    let byte = |value: f32| (255.0 * value.clamp(0.0, 1.0)).round() as u8;
    let floats: &[f32] = match values {
        PlaneValues::Index(numbers) => return numbers.iter().map(|&number| palette_rgb8(number)).collect(),
        PlaneValues::Float(values) => values,
        PlaneValues::Raw(_) => &[],
    };
    match colors {
        Colors::Distance => distances(floats),
        Colors::Direction(signs) => {
            let of_pixel = |n: &[f32]| match n == [0.0; 3] {
                true => [0; 3],
                false => [0, 1, 2].map(|k: usize| byte(0.5 + 0.5 * signs[k] * n[k])),
            };
            floats.chunks_exact(3).map(of_pixel).collect()
        }
        Colors::Displacement => displacements(floats.chunks_exact(components).map(displacement_of).collect()),
        Colors::None | Colors::Picture | Colors::Palette | Colors::Grey => {
            floats.iter().map(|&value| [byte(value); 3]).collect()
        }
    }
}

/// The displacement of a pixel, and its brightness: from one end to another, or one with a state.
fn displacement_of(parts: &[f32]) -> ([f32; 2], f32) {
    let is = |known: FlowState, state: f32| state == f32::from(known as u8);
    match *parts {
        [x0, y0, x1, y1] => ([x1 - x0, y1 - y0], 1.0),
        [dx, dy, state] if is(FlowState::None, state) => ([dx, dy], 0.0),
        [dx, dy, state] if is(FlowState::Visible, state) || is(FlowState::Several, state) => ([dx, dy], 1.0),
        [dx, dy, _] => ([dx, dy], UNSEEN),
        [x, y] => ([x, y], 1.0),
        _ => ([0.0; 2], 0.0),
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
    let at = |fraction: f32| values.get((fraction * last).round() as usize).copied();
    [at(BEYOND).unwrap_or(0.0), at(1.0 - BEYOND).unwrap_or(1.0)]
}

fn turbo(fraction: f32) -> [u8; 3] {
    let position = fraction.clamp(0.0, 1.0) * (TURBO.len() - 1) as f32;
    let low = (position as usize).min(TURBO.len() - 2);
    let mix = |k: usize| {
        let [a, b] = [TURBO[low][k], TURBO[low + 1][k]].map(f32::from);
        (a + (b - a) * (position - low as f32)).round() as u8
    };
    [0, 1, 2].map(mix)
}

#[cfg(test)]
mod tests {
    use camsim_core::frame::Plane;

    use super::*;

    fn srgb(picture: &RenderedFrame) -> Vec<[u8; 3]> {
        let pixels = picture.color_rgba().chunks_exact(4);
        pixels.map(|p| [0, 1, 2].map(|k: usize| super::super::encode::srgb8(p[k]))).collect()
    }

    #[test]
    fn every_channel_has_its_colours() {
        let plane = |channel, values| Plane { channel, values };
        let flow = vec![2.0, 0.0, 1.0, 0.0, 2.0, 2.0, 0.0, 0.0, 0.0];
        let frame = RenderedFrame {
            size_px: [3, 1],
            planes: vec![
                Plane::color(vec![0.25; 12]),
                Plane::depth(vec![10.0, 0.0, 1000.0]),
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
