//! glTF 2.0 models: the triangles of one of a file's scenes, posed at one of its times.
//!
//! A model's own axes are glTF's: x left, y up, z ahead, metres. [`Model::place`] stands it in
//! north-east-down. Colour is albedo: base colour times vertex colour, plus what is emitted; light and shade
//! are the scene's matter, which normals are read for if it asks. What cannot be shown is refused, with its
//! name, or noted.

use std::{
    cell::Cell,
    collections::{HashMap, HashSet},
    path::{Path, PathBuf},
    sync::Arc,
};

use camsim_core::scene::{Material, Mesh, Shape, Texture, Wrap};
use glam::{DAffine3, DMat3, DVec3};

mod accessor;
mod checks;
mod emitted;
mod material;
mod mend;
mod normals;
mod pose;
mod primitive;
mod source;
mod treatments;

use emitted::Bake;
use material::Materials;
use pose::Pose;
use source::Source;
pub(crate) use source::files_beside;

/// Why a model cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum GltfError {
    /// The file, or one that it names, cannot be read.
    #[error("{}: cannot be read: {source}; check the path", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Not glTF 2.0, or damaged.
    #[error("{}: {message}", path.display())]
    Broken {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        message: String,
    },
    /// Needs an extension that is not there.
    #[error("{}: needs the extension {extension}, which is not supported: {fix}", path.display())]
    Extension {
        /// The file.
        path: PathBuf,
        /// Its name.
        extension: String,
        /// What to do.
        fix: &'static str,
    },
}

/// Which of a file's scenes, and when.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GltfOptions {
    /// Number of the scene; the file's own choice if left out.
    pub scene: Option<usize>,
    /// Seconds within the animations; as the file's nodes stand if left out. Before the first key and after
    /// the last one nothing moves.
    pub time_s: Option<f64>,
    /// Number of the animation; all of them together if left out.
    pub animation: Option<usize>,
    /// Whether corners get normals, for light to fall on them: the file's own, or where it has none those of
    /// flat triangles.
    pub normals: bool,
}

/// A model's surfaces.
#[derive(Clone, Debug, Default)]
pub struct Model {
    parts: Vec<Part>,
    /// What of the file is not shown, or not as it is meant.
    pub notes: Vec<String>,
    /// No point is farther from its origin.
    pub reach_m: f64,
}

#[derive(Clone, Debug)]
struct Part {
    shape: Arc<Shape>,
    material: Material,
    model_from_shape: DAffine3,
}

/// From a model's axes (x left, y up, z ahead) to forward, right, down.
const BODY_FROM_MODEL: DMat3 =
    DMat3::from_cols(DVec3::new(0.0, -1.0, 0.0), DVec3::new(0.0, 0.0, -1.0), DVec3::new(1.0, 0.0, 0.0));

/// Texels that are made where base colour and emitted light lie in different ways, at most: half a gigabyte.
const MOST_BAKED: usize = 1 << 27;
/// Parts of a scene, at most: a slip in a number must not fill the memory.
const MOST_PARTS: usize = 1 << 20;
/// No point of a model is farther from its origin, metres: what claims to be is a slip in a number.
pub(crate) const FARTHEST_M: f64 = 1e9;
/// Nodes within nodes, at most.
const DEEPEST: usize = 1024;

impl Model {
    /// Meshes for a model whose origin is at `at_ned_m` and whose z looks `heading_rad` east of north.
    pub fn place(&self, at_ned_m: DVec3, heading_rad: f64, scale: f64) -> impl Iterator<Item = Mesh> {
        let ned_from_model = DMat3::from_rotation_z(heading_rad) * BODY_FROM_MODEL * scale;
        self.parts.iter().map(move |part| Mesh {
            shape: part.shape.clone(),
            material: part.material.clone(),
            origin_ned_m: at_ned_m + ned_from_model * part.model_from_shape.translation,
            ned_from_shape: ned_from_model * part.model_from_shape.matrix3,
            object: 0,
        })
    }

    /// Triangles of one placed model.
    #[must_use]
    pub fn triangles(&self) -> usize {
        self.parts.iter().map(|part| part.shape.indices.len() / 3).sum()
    }
}

/// Reads a `.gltf` or `.glb` file.
///
/// # Errors
/// [`GltfError`] names the file, or the extension that it would need.
pub fn read_gltf(path: &Path, options: GltfOptions) -> Result<Model, GltfError> {
    // The glTF crate takes some of what a damaged file says for granted. Nothing outlives the call that it
    // could leave half done.
    let damaged = |_| Err(GltfError::Broken { path: path.into(), message: "is damaged".into() });
    std::panic::catch_unwind(|| read(path, options)).unwrap_or_else(damaged)
}

fn read(path: &Path, options: GltfOptions) -> Result<Model, GltfError> {
    let source = Source::read(path)?;
    let broken = |message: String| GltfError::Broken { path: path.into(), message };
    let document = &source.document;
    let Some(scene) = options
        .scene
        .map_or_else(|| document.default_scene().or(document.scenes().next()), |n| document.scenes().nth(n))
    else {
        return match options.scene {
            Some(n) => Err(broken(format!(
                "has no scene {n}; the last one is {}",
                document.scenes().count() as i64 - 1
            ))),
            None => Ok(Model {
                parts: Vec::new(),
                notes: vec!["has no scene: nothing of it is shown".into()],
                reach_m: 0.0,
            }),
        };
    };
    let mut reader = Reader {
        pose: Pose::new(&source, options)?,
        materials: Materials::new(&source),
        source: &source,
        options,
        shapes: HashMap::new(),
        baked: HashMap::new(),
        texels_left: MOST_BAKED,
        parts: Vec::new(),
        met: HashSet::new(),
        notes: Vec::new(),
        reach_m: 0.0,
    };
    for node in scene.nodes() {
        reader.node(&node, DAffine3::IDENTITY, false, 0)?;
    }
    let Reader { parts, mut notes, materials, reach_m, pose: Pose { note: pose_notes, .. }, .. } = reader;
    if parts.is_empty() {
        notes.push(match &source.hidden_nodes()[..] {
            [] => "has no triangles: nothing of it is shown".into(),
            hidden => format!(
                "has no triangles that are visible: KHR_node_visibility hides {}, and nothing is shown",
                hidden.join(", ")
            ),
        });
    }
    if options.time_s.is_some() && document.animations().next().is_none() {
        notes.push("has no animation for time_s to be a time of: its nodes are as they stand".into());
    }
    if options.time_s.is_none() && options.animation.is_some() {
        notes.push("animation says nothing without time_s: its nodes are as they stand; give the time of the file that is meant".into());
    }
    if options.time_s.is_none() && options.animation.is_none() && document.animations().next().is_some() {
        notes.push(
            "has animations, and no time_s says which instant of them is meant: its nodes are as they stand"
                .into(),
        );
    }
    notes.extend(source.notes.iter().cloned());
    notes.extend(pose_notes);
    notes.extend(materials.notes);
    notes.sort();
    notes.dedup();
    Ok(Model { parts, notes, reach_m })
}

/// A shape, and the picture of its base colour and its emitted light.
type BakedPart = (Arc<Shape>, Arc<Texture>);

struct Reader<'a> {
    source: &'a Source,
    options: GltfOptions,
    pose: Pose,
    materials: Materials<'a>,
    /// By mesh, primitive and whether it is mirrored: those that no node changes.
    shapes: HashMap<(usize, usize, bool), Arc<Shape>>,
    /// Of those the ones with a picture of emitted light that lies in its own way: the shape and its picture,
    /// or that there is none.
    baked: HashMap<(usize, usize, bool), Option<BakedPart>>,
    /// Texels that further ones may have.
    texels_left: usize,
    parts: Vec<Part>,
    /// Nodes that have been met: a tree comes by each of them once.
    met: HashSet<usize>,
    notes: Vec<String>,
    /// No point so far is farther from the model's origin.
    reach_m: f64,
}

impl Reader<'_> {
    fn node(
        &mut self,
        node: &gltf::Node<'_>,
        model_from_parent: DAffine3,
        is_hidden: bool,
        depth: usize,
    ) -> Result<(), GltfError> {
        if depth > DEEPEST {
            return Err(self
                .source
                .broken(format!("nodes.{}: is within itself, or {DEEPEST} nodes deep", node.index())));
        }
        if !self.met.insert(node.index()) {
            return Err(self.source.broken(format!("nodes.{}: has two parents", node.index())));
        }
        // What is not seen must be no tree of its own either.
        let is_hidden = is_hidden || !self.source.is_visible(node.index());
        let model_from_node = model_from_parent * self.pose.parent_from_node(node);
        if let Some(mesh) = node.mesh().filter(|_| !is_hidden) {
            let instances = self.source.instances(node.index())?;
            for node_from_instance in instances.unwrap_or_else(|| vec![DAffine3::IDENTITY]) {
                self.mesh(node, &mesh, model_from_node * node_from_instance)?;
            }
        }
        node.children().try_for_each(|child| self.node(&child, model_from_node, is_hidden, depth + 1))
    }

    fn mesh(
        &mut self,
        node: &gltf::Node<'_>,
        mesh: &gltf::Mesh<'_>,
        model_from_node: DAffine3,
    ) -> Result<(), GltfError> {
        for primitive in mesh.primitives() {
            if self.parts.len() >= MOST_PARTS {
                return Err(self.source.broken(format!("has more than {MOST_PARTS} parts")));
            }
            let Some(triangles) = primitive::triangle_mode(primitive.mode()) else {
                self.notes.push("points and lines are not shown".into());
                continue;
            };
            let weights = self.pose.weights(node, mesh);
            let joints = node.skin().map(|skin| self.pose.joints(self.source, &skin)).transpose()?;
            // What a skin moves stands in the model's axes.
            let model_from_shape = if joints.is_some() { DAffine3::IDENTITY } else { model_from_node };
            let mirrored = model_from_shape.matrix3.determinant() < 0.0;
            let own = joints.is_some() || primitive.morph_targets().next().is_some();
            let key = (mesh.index(), primitive.index(), mirrored);
            let (material, uv) = self.materials.of(&primitive.material())?;
            if self.options.normals && uv.loses_colors {
                self.notes.push(
                    "what has a picture of emitted light keeps its colours: light does not fall on it".into(),
                );
            }
            if uv.loses_colors && primitive.get(&gltf::Semantic::Colors(0)).is_some() {
                self.notes.push("vertex colours under a picture of emitted light are left out".into());
            }
            if uv.has_picture() && primitive.get(&gltf::Semantic::TexCoords(uv.set)).is_none() {
                let (number, set) = (mesh.index(), uv.set);
                self.notes.push(format!("meshes.{number}: has no TEXCOORD_{set} for its picture to lie by: one texel of it is all over"));
            }
            let beyond = Cell::new(false);
            let made = primitive::Making {
                source: self.source,
                mesh,
                triangles,
                mirrored,
                uv: &uv,
                weights: &weights,
                joints: joints.as_deref(),
                normals: self.options.normals && uv.takes_light,
                beyond: &beyond,
            };
            let baked = match self.materials.bake_of(&primitive.material()) {
                None => None,
                Some(bake) => match self.baked.get(&key).filter(|_| !own) {
                    Some(known) => known.clone(),
                    None => {
                        let found = self.bake(&made, &primitive, &bake)?;
                        if !own {
                            self.baked.insert(key, found.clone());
                        }
                        found
                    }
                },
            };
            let (shape, material) = match (baked, self.shapes.get(&key).filter(|_| !own)) {
                (Some((shape, texture)), _) => {
                    (shape, Material { texture, wrap: [Wrap::Clamp; 2], nearest: false, ..material })
                }
                (None, Some(shape)) => (shape.clone(), material),
                (None, None) => {
                    let shape = Arc::new(made.shape(&primitive)?);
                    if !own {
                        self.shapes.insert(key, shape.clone());
                    }
                    (shape, material)
                }
            };
            if beyond.get() {
                let number = mesh.index();
                self.notes.push(format!(
                    "meshes.{number}: COLOR_0 is taken as the nearest within 0 to 1 where it is not"
                ));
            }
            let corner_m = shape
                .vertices
                .iter()
                .map(|vertex| DVec3::from_array(vertex.position_m.map(f64::from)).length())
                .fold(0.0, f64::max);
            let reach_m = model_from_shape.translation.length() + corner_m * norm(&model_from_shape.matrix3);
            if reach_m.is_nan() || reach_m > FARTHEST_M {
                let (node, mesh) = (node.index(), mesh.index());
                return Err(self.source.broken(format!(
                    "nodes.{node}: with it meshes.{mesh} reaches {reach_m:.1e} m from the model's origin, more than {FARTHEST_M:.0e}: check its \
                     positions, and translation, rotation and scale of its nodes"
                )));
            }
            self.reach_m = self.reach_m.max(reach_m);
            if !shape.indices.is_empty() {
                let material = self.materials.on(&shape, material);
                self.parts.push(Part { shape, material, model_from_shape });
            }
        }
        Ok(())
    }

    /// A shape under one picture of its base colour and its emitted light, which lie in different ways on it.
    fn bake(
        &mut self,
        made: &primitive::Making<'_>,
        primitive: &gltf::Primitive<'_>,
        of: &Bake,
    ) -> Result<Option<BakedPart>, GltfError> {
        // What has emitted light on top is not lit: one picture cannot hold both.
        let shape = primitive::Making { normals: false, ..*made }.shape(primitive)?;
        let light_uvs = made.uvs(primitive, &of.light.rule, shape.vertices.len())?;
        let name = self.source.material_name(primitive.material().index());
        let Some(emitted::Baked { shape, texture, coarser }) =
            emitted::bake(&shape, &light_uvs, of, self.texels_left)
        else {
            self.notes.push(format!(
                "{name}: its picture of emitted light is left out: it lies otherwise than the base colour, and in neither layout each place of the surface has a place of \
                 its own, or one picture of both would be too large; give it the base colour's texture coordinates"
            ));
            return Ok(None);
        };
        self.texels_left -= texture.rgba8.len() / 4;
        if coarser > 1.25 {
            self.notes.push(format!(
                "{name}: base colour and emitted light lie in different ways, and are shown {coarser:.1} times coarser than they are"
            ));
        }
        if self.options.normals {
            self.notes.push(
                "what has a picture of emitted light keeps its colours: light does not fall on it".into(),
            );
        }
        Ok(Some((Arc::new(shape), Arc::new(texture))))
    }
}

/// At least how much longer a matrix makes anything.
fn norm(matrix: &DMat3) -> f64 {
    (matrix.x_axis.length_squared() + matrix.y_axis.length_squared() + matrix.z_axis.length_squared()).sqrt()
}

#[cfg(test)]
mod tests;
