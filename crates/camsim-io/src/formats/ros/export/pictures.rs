//! Pictures, calibrations and depth of a camera.

use std::path::Path;

use image::{DynamicImage, ExtendedColorType};

use super::messages::{
    Bytes, CameraInfo, CompressedImage, Header, Image, RegionOfInterest, StampedTransform, TransformMessage,
};
use super::{Bag, Source};
use crate::formats::axes::enu_from_camera;
use crate::formats::exporting::depth::read_depth;
use crate::formats::exporting::pictures::read;
use crate::formats::exporting::run_folder::{RunCamera, RunFrame};
use crate::formats::exporting::{DatasetError, ExportJob, stereo};
use crate::formats::ros::write as ros;
use crate::formats::writing::lens_names::Family;
use crate::formats::writing::{Calibration, CalibrationError, lens_names};
use crate::write::encode_png;

/// The frames of a camera, one after the other.
pub(super) struct Pictures<'a> {
    job: &'a ExportJob<'a>,
    camera: &'a RunCamera,
    name: String,
    info: CameraInfo,
    has_depth: bool,
    next: usize,
}

impl<'a> Pictures<'a> {
    pub(super) fn new(job: &'a ExportJob<'a>, i: usize, camera: &'a RunCamera) -> Result<Self, DatasetError> {
        let cameras: Vec<&RunCamera> = job.run.cameras.iter().collect();
        let info = camera_info(&camera.calibration()?, stereo::offset_m(&cameras, camera)?)?;
        Ok(Self { job, camera, name: format!("cam{i}"), info, has_depth: camera.has("depth"), next: 0 })
    }

    fn topic(&self, end: &str) -> String {
        format!("/{}/{end}", self.name)
    }

    fn send_picture(&self, frame: &RunFrame, bag: &mut Bag<'_>) -> Result<(), DatasetError> {
        let (format, data) = without_alpha(&self.camera.file(frame, "color_png"))?;
        let header = Header::new(frame.stamp_ns, self.name.as_str());
        let picture = CompressedImage { header, format: format.to_owned(), data: Bytes(data) };
        let kind = "sensor_msgs/msg/CompressedImage";
        bag.send(&self.topic("image_raw/compressed"), kind, frame.stamp_ns, &picture)
    }

    fn send_depth(&self, frame: &RunFrame, bag: &mut Bag<'_>) -> Result<(), DatasetError> {
        let plane = read_depth(&self.camera.file(frame, "depth"))?;
        let [width, height] = plane.size_px;
        let data = plane.values.iter().flat_map(|z| z.to_le_bytes()).collect();
        let picture = Image {
            header: Header::new(frame.stamp_ns, self.name.as_str()),
            height,
            width,
            encoding: "32FC1".to_owned(),
            is_bigendian: 0,
            step: 4 * width,
            data: Bytes(data),
        };
        bag.send(&self.topic("depth/image_raw"), "sensor_msgs/msg/Image", frame.stamp_ns, &picture)
    }
}

impl Source for Pictures<'_> {
    fn next_ns(&self) -> Option<i64> {
        self.camera.frames.get(self.next).map(|frame| frame.stamp_ns)
    }

    fn send(&mut self, bag: &mut Bag<'_>) -> Result<(), DatasetError> {
        let Some(frame) = self.camera.frames.get(self.next) else { return Ok(()) };
        let t_ns = frame.stamp_ns;
        self.info.header = Header::new(t_ns, self.name.as_str());
        bag.send(&self.topic("camera_info"), "sensor_msgs/msg/CameraInfo", t_ns, &self.info)?;
        if self.camera.vibrates() {
            let pose = enu_from_camera(&frame.pose);
            let true_ns = t_ns.saturating_sub(self.camera.stamp_error_ns(frame));
            let moved = StampedTransform::new(true_ns, "map", self.name.as_str(), &pose);
            bag.send("/tf", "tf2_msgs/msg/TFMessage", t_ns, &TransformMessage { transforms: vec![moved] })?;
        }
        self.send_picture(frame, bag)?;
        if self.has_depth {
            self.send_depth(frame, bag)?;
        }
        self.next += 1;
        self.job.target.advance()
    }
}

/// A picture with the channels that `image_transport` knows, and its format: a PNG with three channels of 8 bits is
/// `bgr8` to it, one with one channel `mono8`, and others are named.
fn without_alpha(path: &Path) -> Result<(&'static str, Vec<u8>), DatasetError> {
    let picture = read(path)?;
    let size_px = [picture.width(), picture.height()];
    let bytes_of =
        |samples: &[u16]| samples.iter().flat_map(|sample| sample.to_ne_bytes()).collect::<Vec<u8>>();
    let (format, bytes, kind) = match picture {
        DynamicImage::ImageLuma8(grey) => ("png", grey.into_raw(), ExtendedColorType::L8),
        DynamicImage::ImageLuma16(grey) => {
            ("mono16; png compressed mono16", bytes_of(grey.as_raw()), ExtendedColorType::L16)
        }
        DynamicImage::ImageRgba16(color) => {
            let rgb = DynamicImage::ImageRgba16(color).into_rgb16();
            ("rgb16; png compressed bgr16", bytes_of(rgb.as_raw()), ExtendedColorType::Rgb16)
        }
        color => ("png", color.into_rgb8().into_raw(), ExtendedColorType::Rgb8),
    };
    Ok((format, encode_png(path, size_px, &bytes, kind)?))
}

/// The calibration as ROS has it, of a camera that is so far to the right of and below the first one of its pair.
fn camera_info(camera: &Calibration, offset_m: [f64; 2]) -> Result<CameraInfo, CalibrationError> {
    let (model, d) = lens_names::lens(Family::Ros, camera)?;
    let lens = &camera.intrinsics;
    let [width, height] = lens.size_px;
    Ok(CameraInfo {
        header: Header::new(0, ""),
        height,
        width,
        distortion_model: model.to_owned(),
        d,
        k: ros::camera_matrix(lens),
        r: ros::NO_ROTATION,
        p: ros::projection_matrix(lens, offset_m),
        binning_x: 0,
        binning_y: 0,
        roi: RegionOfInterest::default(),
    })
}
