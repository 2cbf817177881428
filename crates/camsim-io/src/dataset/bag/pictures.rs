//! Pictures, calibrations and depth of a camera.

use super::{
    super::{
        DatasetError, ExportJob,
        axes::enu_from_camera,
        depth::read_depth,
        run_folder::{Intrinsics, RunCamera, RunFrame},
    },
    Bag, Source,
    messages::{
        Bytes, CameraInfo, CompressedImage, Header, Image, RegionOfInterest, StampedTransform,
        TransformMessage,
    },
};

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
        let info = camera_info(&camera.intrinsics()?);
        Ok(Self { job, camera, name: format!("cam{i}"), info, has_depth: camera.has("depth"), next: 0 })
    }

    fn topic(&self, end: &str) -> String {
        format!("/{}/{end}", self.name)
    }

    fn send_picture(&self, frame: &RunFrame, bag: &mut Bag<'_>) -> Result<(), DatasetError> {
        let path = self.camera.file(frame, "color_png");
        let data = std::fs::read(&path).map_err(|error| DatasetError::Input {
            path,
            message: format!("cannot be read: {error}; render it again with --resume"),
        })?;
        let header = Header::new(frame.stamp_ns, self.name.as_str());
        let picture = CompressedImage { header, format: "png".to_owned(), data: Bytes(data) };
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
            let moved = StampedTransform::new(t_ns, "map", self.name.as_str(), &pose);
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

/// The calibration as ROS has it.
fn camera_info(lens: &Intrinsics) -> CameraInfo {
    let ([fx, fy], [cx, cy], [width, height]) = (lens.focal_px, lens.principal_px, lens.size_px);
    let (model, d) = match lens.equidistant() {
        Some(k) => ("equidistant", k.to_vec()),
        None if lens.coefficients[5..] == [0.0; 3] => ("plumb_bob", lens.coefficients[..5].to_vec()),
        None => ("rational_polynomial", lens.coefficients.to_vec()),
    };
    CameraInfo {
        header: Header::new(0, ""),
        height,
        width,
        distortion_model: model.to_owned(),
        d,
        k: [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
        binning_x: 0,
        binning_y: 0,
        roi: RegionOfInterest::default(),
    }
}
