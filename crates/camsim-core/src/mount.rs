//! Mount: the camera on the platform.

/// Camera pose at any instant.
#[derive(Clone, Debug)]
pub struct CameraPath;
