//! The model: which number each thing has, image by image and point by point.

use glam::DVec3;

use super::observations::{FrameObservations, Observation, read_points};
use super::picture;
use super::rigs::{ModelRig, Moment, moments, rig_from_world, rigs};
use crate::formats::axes::{Rigid, enu, enu_from_camera};
use crate::formats::colmap::write::camera_model;
use crate::formats::exporting::run_folder::RunCamera;
use crate::formats::exporting::{DatasetError, ExportJob};
use crate::write::POINTS_CSV;

/// Most observations that are held at once to write points with their tracks.
const HELD: u64 = 4_000_000;

/// Cameras, and numbers of images and points.
pub(super) struct Model<'a> {
    cameras: Vec<ModelCamera<'a>>,
    rigs: Vec<ModelRig>,
    /// Of each rig.
    moments: Vec<Vec<Moment>>,
    /// Positions in east, north, up.
    positions: Vec<DVec3>,
    /// Number of observations of each point.
    lengths: Vec<u32>,
    /// Colour of each point in the picture that sees it first.
    colours: Vec<[u8; 3]>,
    format: &'static str,
}

/// A camera of the model.
pub(super) struct ModelCamera<'a> {
    pub(super) id: u32,
    pub(super) name: &'static str,
    pub(super) number: i32,
    pub(super) size_px: [u32; 2],
    pub(super) parameters: Vec<f64>,
    camera: &'a RunCamera,
    prefix: String,
    /// Number of the image before its first one.
    first_image: u32,
    /// What is added to its numbers of points.
    first_point: u64,
}

/// An image of the model.
pub(super) struct ModelImage<'m> {
    pub(super) id: u32,
    pub(super) camera: u32,
    pub(super) name: String,
    pub(super) camera_from_world: Rigid,
    /// Pixel from the corner, and number of the point from 1.
    pub(super) points: &'m [(f64, f64, u64)],
}

/// A frame of the model: images of one instant.
pub(super) struct ModelFrame<'m> {
    pub(super) id: u32,
    pub(super) rig: u32,
    pub(super) rig_from_world: Rigid,
    /// Numbers of cameras, and of images.
    pub(super) images: &'m [(u32, u32)],
}

/// A point of the model.
pub(super) struct ModelPoint<'m> {
    /// Number from 1.
    pub(super) id: u64,
    pub(super) position_m: DVec3,
    pub(super) rgb: [u8; 3],
    /// Images, and indices in their lists of points.
    pub(super) track: &'m [(u32, u32)],
}

impl<'a> Model<'a> {
    /// Reads cameras and points, and counts observations.
    pub(super) fn new(job: &'a ExportJob<'_>) -> Result<Self, DatasetError> {
        let cameras: Vec<&RunCamera> = job.run.cameras.iter().collect();
        let rigs = rigs(&cameras);
        let mut model = Self {
            cameras: Vec::new(),
            moments: rigs.iter().map(|rig| moments(rig, &cameras)).collect(),
            rigs,
            positions: Vec::new(),
            lengths: Vec::new(),
            colours: Vec::new(),
            format: job.name(),
        };
        let mut first_image = 0;
        let mut tables: Vec<(Vec<DVec3>, u64)> = Vec::new();
        for (i, camera) in job.run.cameras.iter().enumerate() {
            let calibration = camera.calibration()?;
            let (name, number, parameters) = camera_model(&calibration)?;
            let own = read_points(&camera.folder.join(POINTS_CSV))?;
            // Cameras of a rig that track the same points share them.
            let first_point = match tables.iter().find(|(points, _)| *points == own) {
                Some((_, first)) => *first,
                None => {
                    let first = model.positions.len() as u64;
                    model.positions.extend(own.iter().map(|ned| enu(*ned)));
                    tables.push((own, first));
                    first
                }
            };
            model.cameras.push(ModelCamera {
                id: i as u32 + 1,
                name,
                number,
                size_px: calibration.intrinsics.size_px,
                parameters,
                camera,
                prefix: job.prefix(i),
                first_image,
                first_point,
            });
            first_image += camera.frames.len() as u32;
        }
        model.lengths = vec![0; model.positions.len()];
        let mut lengths = std::mem::take(&mut model.lengths);
        model.each_observation(&mut |point, _, _| lengths[point as usize] += 1)?;
        model.lengths = lengths;
        model.colours = model.read_colours()?;
        Ok(model)
    }

    pub(super) fn cameras(&self) -> &[ModelCamera<'a>] {
        &self.cameras
    }

    pub(super) fn rigs(&self) -> &[ModelRig] {
        &self.rigs
    }

    /// Number of frames.
    pub(super) fn frames(&self) -> u64 {
        self.moments.iter().map(|moments| moments.len() as u64).sum()
    }

    pub(super) fn images(&self) -> u64 {
        self.cameras.iter().map(|camera| camera.camera.frames.len() as u64).sum()
    }

    /// Number of points that some image sees.
    pub(super) fn points(&self) -> u64 {
        self.lengths.iter().filter(|length| **length > 0).count() as u64
    }

    /// Mean number of points in an image.
    pub(super) fn mean_observations(&self) -> f64 {
        self.lengths.iter().map(|length| f64::from(*length)).sum::<f64>() / self.images().max(1) as f64
    }

    /// What is written as the error of every point: 0 where the truth is exact, -1 (unknown) with a rolling
    /// shutter, for which COLMAP has no model.
    pub(super) fn error_px(&self) -> f64 {
        if self.cameras.iter().all(|camera| camera.camera.is_global()) { 0.0 } else { -1.0 }
    }

    /// Looks into the pictures that show a point for the first time.
    fn read_colours(&self) -> Result<Vec<[u8; 3]>, DatasetError> {
        let mut colours: Vec<Option<[u8; 3]>> = vec![None; self.positions.len()];
        let mut seen = Vec::new();
        for camera in &self.cameras {
            let mut observations = FrameObservations::open(camera.camera)?;
            for frame in &camera.camera.frames {
                observations.of(frame.number, &mut seen)?;
                seen.retain(|seen| {
                    self.known(camera, seen).is_some_and(|point| colours[point as usize].is_none())
                });
                if seen.is_empty() {
                    continue;
                }
                let path = camera.camera.file(frame, "color_png");
                let picture = image::open(&path)
                    .map_err(|error| DatasetError::Input { path, message: error.to_string() })?
                    .into_rgb8();
                for observation in &seen {
                    let [x, y] = observation.px.map(|px| px.round().max(0.0) as u32);
                    let pixel = picture.get_pixel_checked(x, y).map(|pixel| pixel.0);
                    colours[(camera.first_point + observation.point) as usize] = pixel;
                }
            }
        }
        // A position at the very border rounds to a pixel beyond it.
        Ok(colours.into_iter().map(|colour| colour.unwrap_or([128; 3])).collect())
    }

    fn known(&self, camera: &ModelCamera<'_>, seen: &Observation) -> Option<u64> {
        let point = camera.first_point + seen.point;
        (point < self.positions.len() as u64).then_some(point)
    }

    /// Calls `visit` with point, image, and index in the image's list.
    fn each_observation(&self, visit: &mut dyn FnMut(u64, u32, u32)) -> Result<(), DatasetError> {
        let mut seen = Vec::new();
        for camera in &self.cameras {
            let mut observations = FrameObservations::open(camera.camera)?;
            for (image, frame) in (camera.first_image + 1..).zip(&camera.camera.frames) {
                observations.of(frame.number, &mut seen)?;
                let points = seen.iter().filter_map(|seen| self.known(camera, seen));
                points.zip(0..).for_each(|(point, index)| visit(point, image, index));
            }
        }
        Ok(())
    }

    /// Calls `visit` with each image.
    pub(super) fn each_image(
        &self,
        visit: &mut dyn FnMut(&ModelImage<'_>) -> Result<(), DatasetError>,
    ) -> Result<(), DatasetError> {
        let (mut seen, mut points) = (Vec::new(), Vec::new());
        for camera in &self.cameras {
            let mut observations = FrameObservations::open(camera.camera)?;
            for (id, frame) in (camera.first_image + 1..).zip(&camera.camera.frames) {
                observations.of(frame.number, &mut seen)?;
                points.clear();
                let known = |seen: &Observation| {
                    let [x, y] = seen.px;
                    Some((x + 0.5, y + 0.5, self.known(camera, seen)? + 1))
                };
                points.extend(seen.iter().filter_map(known));
                let pose = camera.camera.centre_pose(self.format, frame)?;
                visit(&ModelImage {
                    id,
                    camera: camera.id,
                    name: picture(&camera.prefix, frame),
                    camera_from_world: enu_from_camera(&pose).inverse(),
                    points: &points,
                })?;
            }
        }
        Ok(())
    }

    /// Calls `visit` with each frame.
    pub(super) fn each_frame(
        &self,
        visit: &mut dyn FnMut(&ModelFrame<'_>) -> Result<(), DatasetError>,
    ) -> Result<(), DatasetError> {
        let cameras: Vec<&RunCamera> = self.cameras.iter().map(|camera| camera.camera).collect();
        let mut images = Vec::new();
        let of_rigs = self.rigs.iter().zip(&self.moments);
        let all = of_rigs.flat_map(|(rig, moments)| moments.iter().map(move |moment| (rig, moment)));
        for (id, (rig, moment)) in (1..).zip(all) {
            images.clear();
            images.extend(moment.pictures.iter().map(|(sensor, index)| {
                let camera = &self.cameras[rig.sensors[*sensor].camera];
                (camera.id, camera.first_image + *index as u32 + 1)
            }));
            let rig_from_world = rig_from_world(rig, moment, &cameras, self.format)?;
            visit(&ModelFrame { id, rig: rig.id, rig_from_world, images: &images })?;
        }
        Ok(())
    }

    /// Calls `visit` with each point that some image sees. The table of tracks is read once for every [`HELD`]
    /// observations.
    pub(super) fn each_point(
        &self,
        visit: &mut dyn FnMut(&ModelPoint<'_>) -> Result<(), DatasetError>,
    ) -> Result<(), DatasetError> {
        let mut first = 0;
        while first < self.lengths.len() {
            let mut held = 0;
            let more = self.lengths[first..].iter().take_while(|length| {
                held += u64::from(**length);
                held <= HELD
            });
            let last = first + more.count().max(1);
            let mut tracks: Vec<Vec<(u32, u32)>> = vec![Vec::new(); last - first];
            self.each_observation(&mut |point, image, index| {
                if (first..last).contains(&(point as usize)) {
                    tracks[point as usize - first].push((image, index));
                }
            })?;
            for (point, track) in (first..).zip(&tracks).filter(|(_, track)| !track.is_empty()) {
                visit(&ModelPoint {
                    id: point as u64 + 1,
                    position_m: self.positions[point],
                    rgb: self.colours[point],
                    track,
                })?;
            }
            first = last;
        }
        Ok(())
    }
}
