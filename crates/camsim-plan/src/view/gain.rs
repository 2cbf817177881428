//! Value of a pixel for each unit of light that arrives.

use camsim_core::{
    camera::CameraModel, photometric::vignette_weight, scenario::Primary, sequence::Sequence,
    vignetting::model_weight,
};

/// Value of a pixel of a frame, of the linear range, for each unit of light that arrives.
pub(crate) fn gain(sequence: &Sequence, camera: &CameraModel, frame: u64) -> impl Fn([u32; 2]) -> f64 + Sync {
    let photometric = &sequence.scenario.camera.photometric;
    let light = photometric.light * sequence.exposure(frame).map_or(1.0, |exposure| exposure.light);
    let size_px = camera.size_px;
    let gains = sequence.light_gains();
    move |[x, y]: [u32; 2]| {
        let vignette = sequence.vignette.as_ref().map_or(1.0, |map| {
            let [column, row] = [(x, 0), (y, 1)].map(|(at, k)| (at * map.size_px[k] / size_px[k]) as usize);
            f64::from(vignette_weight(
                map.values[row * map.size_px[0] as usize + column],
                photometric.vignette_thresholds,
            ))
        });
        let model = photometric.vignetting.as_ref();
        let model = model.map_or(1.0, |spec| model_weight(spec, camera, [x, y], Primary::Green));
        let exposed = gains.as_ref().map_or(1.0, |shutter| shutter.light_gain(x, y));
        vignette * model * exposed * light
    }
}
