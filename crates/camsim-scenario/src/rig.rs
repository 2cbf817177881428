//! The cameras of one platform: `[camera]`, or `[[cameras]]`.
//!
//! Each camera is a scenario of its own, alike but for `camera`. A rig of several cameras is rendered as these
//! scenarios would be one after the other, with one trajectory and one scene.

use super::{CameraSpec, Scenario};

/// A scenario of one camera, or of several that share everything else.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// The scenario of each camera, in the order of the file; at least one.
    scenarios: Vec<Scenario>,
    is_list: bool,
}

impl Rig {
    /// A scenario with `[camera]`.
    #[must_use]
    pub fn single(scenario: Scenario) -> Self {
        Self { scenarios: vec![scenario], is_list: false }
    }

    /// A scenario with `[[cameras]]`: `shared` with each of them. `None` without a camera.
    #[must_use]
    pub fn of_cameras(shared: &Scenario, cameras: Vec<CameraSpec>) -> Option<Self> {
        let with = |camera| Scenario { camera, ..shared.clone() };
        let scenarios: Vec<Scenario> = cameras.into_iter().map(with).collect();
        (!scenarios.is_empty()).then_some(Self { scenarios, is_list: true })
    }

    /// Whether the cameras are `[[cameras]]`: each has a name, and a folder of that name.
    #[must_use]
    pub fn is_list(&self) -> bool {
        self.is_list
    }

    /// The scenario of each camera, in the order of the file.
    #[must_use]
    pub fn scenarios(&self) -> &[Scenario] {
        &self.scenarios
    }

    /// The scenario of the first camera.
    #[must_use]
    pub fn first(&self) -> &Scenario {
        &self.scenarios[0]
    }

    /// Names of the cameras.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.scenarios.iter().map(|scenario| scenario.camera.name.as_str())
    }

    /// Number of the camera with a name, from 0.
    #[must_use]
    pub fn position(&self, name: &str) -> Option<usize> {
        self.names().position(|known| known == name)
    }

    /// Changes the scenario of each camera.
    ///
    /// # Errors
    /// The first of `change`.
    pub fn try_map<E>(self, change: impl FnMut(Scenario) -> Result<Scenario, E>) -> Result<Self, E> {
        let scenarios = self.scenarios.into_iter().map(change).collect::<Result<_, _>>()?;
        Ok(Self { scenarios, ..self })
    }
}
