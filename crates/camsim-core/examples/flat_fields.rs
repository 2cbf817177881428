//! Takes flat and dark fields with an image sensor: for `scripts/judges/emva.py`.
//!
//! ```text
//! cargo run --release -p camsim-core --example flat_fields -- 640x480 SEED key=value ... < takes
//! ```
//!
//! Each line of the input is `LEVEL EXPOSURE_MS FIRST_FRAME COUNT PATH`: raw pictures of even light, which is
//! LEVEL times white, go to PATH as 16 bit numbers, little-endian, one picture after the other. The keys are
//! numbers of `[camera.sensor]`; the sensor is monochrome.

use std::{error::Error, io::BufRead};

use camsim_core::{
    imaging::ImageSensor,
    scenario::{CameraSpec, ImageSensorSpec, Mosaic, PerChannel},
};

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args().skip(1);
    let size = words.next().ok_or("the first word is the size, such as 640x480")?;
    let (width, height) = size.split_once('x').ok_or("the size is such as 640x480")?;
    let size_px: [u32; 2] = [width.parse()?, height.parse()?];
    let seed: u64 = words.next().ok_or("the second word is the seed")?.parse()?;
    let mut spec = ImageSensorSpec { mosaic: Mosaic::Mono, ..ImageSensorSpec::default() };
    for word in words {
        let (key, value) = word.split_once('=').ok_or("keys are written key=value")?;
        set(&mut spec, key, value.parse()?)?;
    }
    for line in std::io::stdin().lock().lines() {
        take(&spec, size_px, seed, &line?)?;
    }
    Ok(())
}

fn set(spec: &mut ImageSensorSpec, key: &str, value: f64) -> Result<(), String> {
    match key {
        "white_w_m2" => spec.white_w_m2 = Some(value),
        "pixel_um" => spec.pixel_um = Some(value),
        "wavelength_nm" => spec.wavelength_nm = value,
        "quantum_efficiency" => spec.quantum_efficiency = Some(PerChannel::One(value)),
        "read_noise_e" => spec.read_noise_e = Some(value),
        "full_well_e" => spec.full_well_e = Some(value),
        "gain_e_per_dn" => spec.gain_e_per_dn = Some(value),
        "black_dn" => spec.black_dn = value,
        "bits" => spec.bits = Some(value as u32),
        "dark_current_e_s" => spec.dark_current_e_s = Some(value),
        "dark_doubling_c" => spec.dark_doubling_c = value,
        "temperature_c" => spec.temperature_c = value,
        "dsnu_e" => spec.dsnu_e = Some(value),
        "prnu" => spec.prnu = Some(value),
        _ => return Err(format!("{key} is no key of this program")),
    }
    Ok(())
}

fn take(spec: &ImageSensorSpec, size_px: [u32; 2], seed: u64, line: &str) -> Result<(), Box<dyn Error>> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let [level, exposure_ms, first, count, path] = words[..] else {
        return Err(format!("LEVEL EXPOSURE_MS FIRST_FRAME COUNT PATH, not {line}").into());
    };
    let (level, first, count): (f32, u32, u32) = (level.parse()?, first.parse()?, count.parse()?);
    let sensor = ImageSensorSpec { exposure_ms: Some(exposure_ms.parse()?), ..spec.clone() };
    let camera = CameraSpec { size_px, sensor: Some(sensor), ..CameraSpec::default() };
    let sensor = ImageSensor::new(&camera, seed).ok_or("a camera with a sensor")?;
    let light = [level, level, level, 1.0].repeat((size_px[0] * size_px[1]) as usize);
    let bytes: Vec<u8> = (first..first + count)
        .flat_map(|frame| sensor.raw(frame, 0.0, &light).values)
        .flat_map(u16::to_le_bytes)
        .collect();
    Ok(std::fs::write(path, bytes)?)
}
