//! The size of pictures, for files that state none.

use serde_json::{Value, json};

use super::document::{Document, KeyProblem, find};
use super::{CameraFormat, nerfstudio, opencv, opensfm};

/// Adds a size to a document that has none. Whether the size that is read is this one is checked later.
pub(super) fn complete(document: &mut Document, format: CameraFormat, [width, height]: [u32; 2]) {
    let add = |value: &mut Value, keys: [&str; 2]| {
        if let Value::Object(map) = value {
            map.insert(keys[0].to_owned(), json!(width));
            map.insert(keys[1].to_owned(), json!(height));
        }
    };
    match format {
        CameraFormat::OrbSlam if find(&document.value, "Camera.width").is_none() => {
            add(&mut document.value, ["Camera.width", "Camera.height"]);
        }
        CameraFormat::OpenCv | CameraFormat::OpenCvFisheye
            if opencv::image_size(&document.value).is_err() =>
        {
            add(&mut document.value, ["image_width", "image_height"]);
        }
        CameraFormat::Nerfstudio if nerfstudio::lacks_size(&document.value) => {
            add(&mut document.value, ["w", "h"]);
        }
        CameraFormat::OpenSfm => {
            for camera in opensfm::cameras_mut(document) {
                if find(camera, "width").is_none() {
                    add(camera, ["width", "height"]);
                }
            }
        }
        _ => {}
    }
}

/// Refuses a size that is not that of the file.
pub(super) fn check(wanted: Option<[u32; 2]>, [width, height]: [u32; 2]) -> Result<(), KeyProblem> {
    match wanted {
        Some(wanted) if wanted != [width, height] => Err(KeyProblem::new(
            "--size",
            format!(
                "is {} x {}, but the file states {width} x {height}: leave --size out, it is for files without a size",
                wanted[0], wanted[1]
            ),
        )),
        _ => Ok(()),
    }
}
