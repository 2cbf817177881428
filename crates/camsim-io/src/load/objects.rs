//! Names, classes and numbers of the objects of a scene.

use std::collections::HashMap;

use camsim_core::{
    scenario::{GltfSpec, ObjectsOf},
    scene::SceneObject,
};

use super::LoadError;
use crate::gltf_file::{Model, PartLabels};

/// The objects so far, in the order of their numbers.
#[derive(Debug, Default)]
pub(super) struct ObjectList(Vec<SceneObject>);

impl ObjectList {
    /// Adds an object. Returns its number, from 1.
    pub fn add(&mut self, name: String, class: Option<u16>) -> u32 {
        self.0.push(SceneObject { name, class: class.unwrap_or(0) });
        self.0.len() as u32
    }

    pub fn into_objects(self) -> Vec<SceneObject> {
        self.0
    }
}

/// The name that the scenario gives, or another one.
pub(super) fn name_or(name: &Option<String>, otherwise: &str) -> String {
    name.clone().unwrap_or_else(|| otherwise.to_owned())
}

/// The objects that each copy of a model has.
#[derive(Debug)]
pub(super) struct ModelObjects {
    /// Name of the model.
    name: String,
    /// Whether copies come from a table, and have the number of their row in their name.
    is_numbered: bool,
    /// Part of the name and class of each object of a copy.
    objects: Vec<(Option<String>, Option<u16>)>,
    /// The object of each mesh of a copy, an index of `objects`.
    of_mesh: Vec<usize>,
}

impl ModelObjects {
    /// # Errors
    /// A name in `classes` that the model does not have.
    pub fn new(spec: &GltfSpec, model: &Model) -> Result<Self, LoadError> {
        check_names(spec, model)?;
        let stem = spec.file.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let mut this = Self {
            name: name_or(&spec.name, &stem),
            is_numbered: spec.placements.is_some(),
            objects: Vec::new(),
            of_mesh: Vec::new(),
        };
        let mut known = HashMap::new();
        for labels in model.labels() {
            let PartLabels { node, node_names, material, material_name } = labels;
            // Nodes and materials may share a name, so their index in the file counts.
            let (key, part) = match spec.objects {
                ObjectsOf::Placement => (None, None),
                ObjectsOf::Node => (Some(*node), node_names.last()),
                ObjectsOf::Material => (*material, Some(material_name)),
            };
            let of_part = || match spec.objects {
                ObjectsOf::Placement => None,
                ObjectsOf::Node => node_names.iter().rev().find_map(|name| spec.classes.get(name)).copied(),
                ObjectsOf::Material => spec.classes.get(material_name).copied(),
            };
            let object = *known.entry(key).or_insert_with(|| {
                this.objects.push((part.cloned(), of_part().or(spec.class)));
                this.objects.len() - 1
            });
            this.of_mesh.push(object);
        }
        Ok(this)
    }

    /// Adds the objects of the copy in `row` (from 1) of the table of placements. Returns the number of the
    /// object of each of its meshes.
    pub fn of_copy(&self, row: usize, list: &mut ObjectList) -> Vec<u32> {
        let copy = if self.is_numbered { format!("{}#{row}", self.name) } else { self.name.clone() };
        let numbers: Vec<u32> = self
            .objects
            .iter()
            .map(|(part, class)| {
                let name = part.as_ref().map_or_else(|| copy.clone(), |part| format!("{copy}/{part}"));
                list.add(name, *class)
            })
            .collect();
        self.of_mesh.iter().map(|&object| numbers[object]).collect()
    }
}

/// Refuses names in `classes` that no part of the model has.
fn check_names(spec: &GltfSpec, model: &Model) -> Result<(), LoadError> {
    let (kind, names): (_, Vec<&String>) = match spec.objects {
        ObjectsOf::Placement => return Ok(()),
        ObjectsOf::Node => ("node", model.labels().flat_map(|labels| &*labels.node_names).collect()),
        ObjectsOf::Material => ("material", model.labels().map(|labels| &labels.material_name).collect()),
    };
    let Some(name) = spec.classes.keys().find(|name| !names.contains(name)) else { return Ok(()) };
    let mut known: Vec<String> = names.into_iter().cloned().collect();
    known.sort();
    known.dedup();
    Err(LoadError::NoSuchPart { file: spec.file.clone(), kind, name: name.clone(), known })
}

#[cfg(test)]
mod tests;
