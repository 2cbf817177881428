//! A camera with an image sensor: raw picture, histogram, numbers and electrons, and the reference.

use egui_kittest::kittest::Queryable;

use super::harness::{Window, has, pattern_with, send};
use crate::message::Message;

/// A small camera with a Bayer mosaic.
const BAYER: &str = "[camera]\nsize_px = [48, 36]\nfocal_px = [42.0, 42.0]\nmount = { angles_deg = [0.0, -90.0, 0.0] }\n\
    sensor = { mosaic = \"rggb\", black_dn = 16.0, white_e = 4000.0, full_well_e = 8000.0, bits = 12 }\n\
    shutter = { exposure_ms = 4.0 }\n";

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn reference_of_a_mosaic_is_developed_as_a_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut window = Window::open(Some(pattern_with(folder.path(), BAYER)));
    let difference = window.difference_from_reference();
    // 0.45: both have the same noise. Strips of rows that are developed alone lose their borders.
    assert!(difference.rms_dn < 1.0, "{}", difference.rms_dn);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn raw_picture_and_its_numbers_are_shown() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut window = Window::open(Some(pattern_with(folder.path(), BAYER)));
    window.settle();
    window.click("raw");
    window.click("histogram");
    window.settle();
    let shown = window.state().engine.shown.as_ref().expect("shown");
    let image = shown.reply.raws[0].as_ref().expect("a raw picture").clone();
    let histogram = shown.reply.histograms[0].clone();
    assert!(histogram.is_raw && histogram.end == 4096);
    assert_eq!(histogram.counts.each_ref().map(|bars| bars.iter().sum::<u64>()), [432, 864, 432, 0]);
    // Red, green; green, blue: the other colours of a pixel are 0, its own one is not in most.
    let mut shown = [[0; 3]; 4];
    for (i, pixel) in image.pixels.iter().enumerate() {
        let site = &mut shown[2 * (i / 48 % 2) + i % 2];
        let codes = [pixel.r(), pixel.g(), pixel.b()];
        codes.iter().zip(site).for_each(|(code, count)| *count += u32::from(*code > 0));
    }
    for (site, color) in shown.iter().zip([0, 1, 1, 2]) {
        assert!(site[color] > 200 && site.iter().sum::<u32>() == site[color], "{shown:?}");
    }
    send(&mut window, Message::Pin(Some([21, 20])));
    (0..2).for_each(|_| window.step());
    let picture = window.state().engine.picture().expect("a picture");
    let number = picture.frame.raw().expect("raw").values[20 * 48 + 21];
    let electrons = picture.raw_scale.expect("a sensor").electrons(number).expect("linear");
    assert!(has(&window, "raw, green") && has(&window, &format!("{number} DN, {electrons:.1} electrons")));
    // Without the raw picture, the codes of the screen count.
    window.click("raw");
    window.settle();
    let histogram = &window.state().engine.shown.as_ref().expect("shown").reply.histograms[0];
    assert!(!histogram.is_raw && histogram.end == 256);
    assert!(window.harness.query_by_label("raw").is_some());
}
