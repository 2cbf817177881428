//! glTF 2.0 models: the triangles of one of a file's scenes, posed at one of its times.
//!
//! A model's own axes are glTF's: x left, y up, z forward, metres. [`Model::place`] transforms it to
//! north-east-down. Colour is albedo: base colour times vertex colour, plus emissive light. The scene's light
//! is applied elsewhere; normals are read for it on request. Unsupported content is refused or noted, by
//! name.

use std::{
    cell::Cell,
    collections::{HashMap, HashSet},
    path::{Path, PathBuf},
    sync::Arc,
};

use camsim_core::scene::{
    Material, Mesh, RigidMotion, Shape, Texture, Wrap,
    motion::{Joint, JointFrame},
};
use glam::{DAffine3, DMat3, DVec3};

mod accessor;
mod asset;
mod bake;
mod emissive;
mod foreign;
mod material;
mod moving;
mod normals;
mod pose;
mod preprocess;
mod primitive;
mod treatments;
mod validation;

use asset::Asset;
pub(crate) use asset::referenced_files;
use bake::{BakeInput, Baked};
use material::{Materials, VertexRule};
use moving::{Chain, Moving};
pub use moving::{ModelMotion, NodeSpin};
use pose::Pose;
use primitive::{ShapeReader, TriangleMode};

/// Why a model cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum GltfError {
    /// The file, or one that it names, cannot be read.
    #[error("{}: cannot be read: {source}; check the path", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// The file is not glTF 2.0, damaged, or asks for more than it has.
    #[error("{}: {message}", path.display())]
    Broken {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        message: String,
    },
    /// The file needs an extension that is not supported.
    #[error("{}: needs the extension {extension}, which is not supported: {fix}", path.display())]
    Extension {
        /// The file.
        path: PathBuf,
        /// Name of the extension.
        extension: String,
        /// What to do.
        fix: &'static str,
    },
}

/// Selects a scene of the file and an instant of its animations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GltfOptions {
    /// Index of the scene; `None` for the file's default scene.
    pub scene: Option<usize>,
    /// Time in the animations, seconds, clamped to their key frames; `None` for the nodes' static transforms.
    pub time_s: Option<f64>,
    /// Index of the animation; `None` for all of them together.
    pub animation: Option<usize>,
    /// Whether vertices get normals, for lighting: the file's own, or where it has none those of flat
    /// triangles.
    pub normals: bool,
}

/// A model: shapes with materials in the model's axes.
#[derive(Clone, Debug, Default)]
pub struct Model {
    parts: Vec<Part>,
    /// Notes for the user about parts of the file that are not shown, or not as stored.
    pub notes: Vec<String>,
    /// Radius about the model's origin that contains all points, metres.
    pub radius_m: f64,
}

#[derive(Clone, Debug)]
struct Part {
    shape: Arc<Shape>,
    material: Material,
    model_from_shape: DAffine3,
    labels: PartLabels,
    /// In the model's axes; `None` if it stands still in them.
    motion: Option<Arc<RigidMotion>>,
}

/// What a part of a model is called in its file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PartLabels {
    /// Index of its node.
    pub node: usize,
    /// Names of its node and of those above it, from the root; `nodes.3` for a node without a name.
    pub node_names: Arc<[String]>,
    /// Index of its material; `None` for the default material.
    pub material: Option<usize>,
    /// Name of its material; `materials.3` without one, `default` for the default material.
    pub material_name: String,
}

/// Rotation from the model's axes (x left, y up, z forward) to forward, right, down.
const BODY_FROM_MODEL: DMat3 =
    DMat3::from_cols(DVec3::new(0.0, -1.0, 0.0), DVec3::new(0.0, 0.0, -1.0), DVec3::new(1.0, 0.0, 0.0));

/// Largest number of baked texels of a model: half a gigabyte.
const MAX_BAKED_TEXELS: usize = 1 << 27;
/// Largest number of parts of a model, so that a wrong number does not fill the memory.
const MAX_PARTS: usize = 1 << 20;
/// Largest distance of a point from the model's origin, metres; a larger one is taken as a wrong number.
pub(crate) const MAX_RADIUS_M: f64 = 1e9;
/// Largest depth of the node tree.
const MAX_NODE_DEPTH: usize = 1024;

impl Model {
    /// What each mesh that [`Model::place`] returns is called in the file, in the same order.
    pub fn labels(&self) -> impl Iterator<Item = &PartLabels> {
        self.parts.iter().map(|part| &part.labels)
    }

    /// Meshes of the model with its origin at `origin_ned_m`, its z axis `heading_rad` clockwise from north,
    /// and its lengths times `scale`.
    pub fn place(&self, origin_ned_m: DVec3, heading_rad: f64, scale: f64) -> impl Iterator<Item = Mesh> {
        self.place_on(None, origin_ned_m, heading_rad, scale)
    }

    /// As [`Model::place`], on something that moves: origin and heading are where that has them at path time
    /// 0.
    pub fn place_on(
        &self,
        carrier: Option<&Joint>,
        origin_ned_m: DVec3,
        heading_rad: f64,
        scale: f64,
    ) -> impl Iterator<Item = Mesh> {
        let ned_from_body = carrier.map_or(DMat3::IDENTITY, |joint| DMat3::from_quat(joint.start().rotation));
        let ned_from_model = ned_from_body * (DMat3::from_rotation_z(heading_rad) * BODY_FROM_MODEL * scale);
        let affine = DAffine3 { matrix3: ned_from_model, translation: origin_ned_m };
        // A model is placed without stretching it.
        let frame = JointFrame::from_affine(&affine).unwrap_or(JointFrame::IDENTITY);
        let mut known: HashMap<Option<*const RigidMotion>, Arc<RigidMotion>> = HashMap::new();
        let carrier = carrier.cloned();
        self.parts.iter().map(move |part| {
            let motion = (carrier.is_some() || part.motion.is_some()).then(|| {
                let own = part.motion.as_ref();
                let placed = || {
                    let joints = own.map_or(&[][..], |motion| motion.joints());
                    let joints = joints.iter().map(|joint| joint.within(&frame));
                    Arc::new(RigidMotion::new(carrier.iter().cloned().chain(joints).collect()))
                };
                known.entry(own.map(Arc::as_ptr)).or_insert_with(placed).clone()
            });
            Mesh {
                shape: part.shape.clone(),
                material: part.material.clone(),
                origin_ned_m: origin_ned_m + ned_from_model * part.model_from_shape.translation,
                ned_from_shape: ned_from_model * part.model_from_shape.matrix3,
                object: 0,
                motion,
            }
        })
    }

    /// Spacing of the 32-bit numbers that hold the largest coordinate of a vertex, metres of the model.
    #[must_use]
    pub fn spacing_m(&self) -> f64 {
        let spacing = |part: &Part| {
            let bounds = part.shape.bounds();
            let largest = bounds.min.abs().max(bounds.max.abs()).max_element() as f32;
            let next = f32::from_bits(largest.to_bits().saturating_add(1));
            let is_finite = largest.is_finite() && next.is_finite();
            if is_finite {
                f64::from(next - largest) * part.model_from_shape.matrix3.x_axis.length()
            } else {
                0.0
            }
        };
        self.parts.iter().map(spacing).fold(0.0, f64::max)
    }

    /// Number of triangles.
    #[must_use]
    pub fn triangles(&self) -> usize {
        self.parts.iter().map(|part| part.shape.indices.len() / 3).sum()
    }
}

/// Reads a `.gltf` or `.glb` file.
///
/// # Errors
/// [`GltfError`] names the file and the location in it, or the extension that it needs.
pub fn read_gltf(path: &Path, options: GltfOptions) -> Result<Model, GltfError> {
    read_moving_gltf(path, options, &ModelMotion::default())
}

/// As [`read_gltf`], with parts that move.
///
/// # Errors
/// As [`read_gltf`]; also for a node to spin that the file has not, and for one that moves in uneven axes.
pub fn read_moving_gltf(path: &Path, options: GltfOptions, motion: &ModelMotion) -> Result<Model, GltfError> {
    // The glTF crate panics on some damaged files. No state outlives the call.
    let damaged = |_| Err(GltfError::Broken { path: path.into(), message: "is damaged".into() });
    std::panic::catch_unwind(|| read(path, options, motion)).unwrap_or_else(damaged)
}

// Long because it is the list of what a file consists of and of what is said about it.
fn read(path: &Path, options: GltfOptions, motion: &ModelMotion) -> Result<Model, GltfError> {
    let asset = Asset::read(path, options.normals)?;
    let periods_s = if motion.animate { moving::periods_s(&asset)? } else { Vec::new() };
    let options = GltfOptions { time_s: options.time_s.or(motion.animate.then_some(0.0)), ..options };
    let broken = |message: String| GltfError::Broken { path: path.into(), message };
    let document = &asset.document;
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
                radius_m: 0.0,
            }),
        };
    };
    let moving = Moving::new(&asset, options, motion, &periods_s)?;
    let mut reader = Reader {
        pose: Pose::new(&asset, options, &periods_s)?,
        root: moving.root(),
        moving,
        materials: Materials::new(&asset),
        asset: &asset,
        options,
        shapes: HashMap::new(),
        baked: HashMap::new(),
        texels_left: MAX_BAKED_TEXELS,
        parts: Vec::new(),
        visited: HashSet::new(),
        node_names: Vec::new(),
        notes: Vec::new(),
        radius_m: 0.0,
    };
    let (model_from_root, chain) = reader.root.clone();
    for node in scene.nodes() {
        reader.node(&node, model_from_root, &chain, false, 0)?;
    }
    reader.moving.check_names(&asset)?;
    let Reader { parts, mut notes, materials, radius_m, pose, moving, .. } = reader;
    let pose_notes = pose.note;
    if parts.is_empty() {
        notes.push(match &asset.hidden_nodes()[..] {
            [] => "has no triangles: nothing of it is shown".into(),
            hidden => format!(
                "has no visible triangles: KHR_node_visibility hides {}, and nothing is shown",
                hidden.join(", ")
            ),
        });
    }
    if options.time_s.is_some() && document.animations().next().is_none() {
        let key = if motion.animate { "motion.animate" } else { "time_s" };
        notes.push(format!("has no animation for {key}: its nodes keep their static transforms"));
    }
    if options.time_s.is_none() && options.animation.is_some() {
        notes.push(
            "animation has no effect without time_s: nodes keep their static transforms; set time_s".into(),
        );
    }
    if options.time_s.is_none() && options.animation.is_none() && document.animations().next().is_some() {
        notes.push("has animations, but time_s is not set: its nodes keep their static transforms".into());
    }
    notes.extend(asset.notes.iter().cloned());
    notes.extend(pose_notes);
    notes.extend(moving.notes);
    notes.extend(materials.notes);
    notes.sort();
    notes.dedup();
    Ok(Model { parts, notes, radius_m })
}

/// A shape with its baked texture of base colour and emissive light.
type BakedPart = (Arc<Shape>, Arc<Texture>);

/// Mesh index, primitive index, and whether the node mirrors.
type ShapeKey = (usize, usize, bool);

/// Walks the node tree and collects parts.
struct Reader<'a> {
    asset: &'a Asset,
    options: GltfOptions,
    pose: Pose,
    moving: Moving<'a>,
    /// Axes and joints of the whole model.
    root: (DAffine3, Chain),
    materials: Materials<'a>,
    /// Shapes without skin and morph targets.
    shapes: HashMap<ShapeKey, Arc<Shape>>,
    /// Baked shapes without skin and morph targets; `None` where baking was not possible.
    baked: HashMap<ShapeKey, Option<BakedPart>>,
    /// Number of texels that further baked textures may have.
    texels_left: usize,
    parts: Vec<Part>,
    /// Indices of visited nodes: a valid tree visits each once.
    visited: HashSet<usize>,
    /// Names of the node that is read and of those above it, from the root.
    node_names: Vec<String>,
    notes: Vec<String>,
    /// Radius about the model's origin that contains all points so far, metres.
    radius_m: f64,
}

impl Reader<'_> {
    /// Adds the meshes of a node and its descendants.
    fn node(
        &mut self,
        node: &gltf::Node<'_>,
        model_from_parent: DAffine3,
        chain: &Chain,
        is_hidden: bool,
        depth: usize,
    ) -> Result<(), GltfError> {
        if depth > MAX_NODE_DEPTH {
            return Err(self
                .asset
                .error(format!("nodes.{}: is within itself, or {MAX_NODE_DEPTH} nodes deep", node.index())));
        }
        if !self.visited.insert(node.index()) {
            return Err(self.asset.error(format!("nodes.{}: has two parents", node.index())));
        }
        // Hidden nodes are walked too, so that malformed trees are refused.
        let is_hidden = is_hidden || !self.asset.is_visible(node.index());
        let (model_from_node, chain) =
            self.moving.node(self.asset, &self.pose, node, model_from_parent, chain)?;
        self.node_names.push(self.asset.name_of("nodes", node.index()));
        if let Some(mesh) = node.mesh().filter(|_| !is_hidden) {
            let instances = self.asset.instances(node.index())?;
            for node_from_instance in instances.unwrap_or_else(|| vec![DAffine3::IDENTITY]) {
                self.mesh(node, &mesh, model_from_node * node_from_instance, &chain)?;
            }
        }
        node.children()
            .try_for_each(|child| self.node(&child, model_from_node, &chain, is_hidden, depth + 1))?;
        self.node_names.pop();
        Ok(())
    }

    /// Adds the primitives of a node's mesh.
    fn mesh(
        &mut self,
        node: &gltf::Node<'_>,
        mesh: &gltf::Mesh<'_>,
        model_from_node: DAffine3,
        chain: &Chain,
    ) -> Result<(), GltfError> {
        for primitive in mesh.primitives() {
            if self.parts.len() >= MAX_PARTS {
                return Err(self.asset.error(format!("has more than {MAX_PARTS} parts")));
            }
            match primitive::triangle_mode(primitive.mode()) {
                Some(mode) => self.primitive((node, mesh), &primitive, mode, model_from_node, chain)?,
                None => self.notes.push("points and lines are not shown".into()),
            }
        }
        Ok(())
    }

    /// Adds one primitive of a node's mesh.
    fn primitive(
        &mut self,
        (node, mesh): (&gltf::Node<'_>, &gltf::Mesh<'_>),
        primitive: &gltf::Primitive<'_>,
        triangle_mode: TriangleMode,
        model_from_node: DAffine3,
        chain: &Chain,
    ) -> Result<(), GltfError> {
        let weights = self.pose.weights(node, mesh);
        let joints = node.skin().map(|skin| self.pose.joints(self.asset, &skin)).transpose()?;
        // Joint matrices already transform to the model's axes.
        let model_from_shape = if joints.is_some() { self.root.0 } else { model_from_node };
        // A skin hangs on several nodes.
        let motion = if joints.is_some() { self.root.1.motion.clone() } else { chain.motion.clone() };
        if joints.is_some() && self.moving.is_any() {
            self.notes.push(
                "scene.gltf.motion moves and turns nodes: skins stay as they are at time_s, and move with the \
                 whole model only"
                    .into(),
            );
        }
        let is_mirrored = model_from_shape.matrix3.determinant() < 0.0;
        let is_deformed = joints.is_some() || primitive.morph_targets().next().is_some();
        let key = Some((mesh.index(), primitive.index(), is_mirrored)).filter(|_| !is_deformed);
        let (material, rule) = self.materials.get(&primitive.material())?;
        self.note_ignored_attributes(mesh, primitive, &rule);
        let has_clamped_colors = Cell::new(false);
        let shape_reader = ShapeReader {
            asset: self.asset,
            mesh,
            triangle_mode,
            is_mirrored,
            rule: &rule,
            weights: &weights,
            joints: joints.as_deref(),
            with_normals: self.options.normals && rule.is_lit,
            has_clamped_colors: &has_clamped_colors,
        };
        let (shape, material) = match self.baked_part(&shape_reader, primitive, key)? {
            Some((shape, texture)) => {
                (shape, Material { texture, wrap: [Wrap::Clamp; 2], nearest: false, ..material })
            }
            None => (self.shape(&shape_reader, primitive, key)?, material),
        };
        if has_clamped_colors.get() {
            self.notes.push(format!("meshes.{}: COLOR_0 is clamped to 0 to 1", mesh.index()));
        }
        self.extend_radius(node, mesh, &shape, &model_from_shape)?;
        if !shape.indices.is_empty() {
            let material = self.materials.for_shape(&shape, material);
            let of = primitive.material();
            let labels = PartLabels {
                node: node.index(),
                node_names: self.node_names.as_slice().into(),
                material: of.index(),
                material_name: of
                    .index()
                    .map_or_else(|| "default".to_owned(), |index| self.asset.name_of("materials", index)),
            };
            self.parts.push(Part { shape, material, model_from_shape, motion, labels });
        }
        Ok(())
    }

    fn note_ignored_attributes(
        &mut self,
        mesh: &gltf::Mesh<'_>,
        primitive: &gltf::Primitive<'_>,
        rule: &VertexRule,
    ) {
        if self.options.normals && rule.ignores_vertex_colors {
            self.notes.push(EMISSIVE_TEXTURE_UNLIT.into());
        }
        if rule.ignores_vertex_colors && primitive.get(&gltf::Semantic::Colors(0)).is_some() {
            self.notes.push("vertex colours of surfaces with an emissive texture are ignored".into());
        }
        if rule.has_texture() && primitive.get(&gltf::Semantic::TexCoords(rule.set)).is_none() {
            let (number, set) = (mesh.index(), rule.set);
            self.notes.push(format!(
                "meshes.{number}: has no TEXCOORD_{set} for its texture: one texel covers the whole surface"
            ));
        }
    }

    /// The shape of a primitive, from the cache if it has a key and has been read before.
    fn shape(
        &mut self,
        shape_reader: &ShapeReader<'_>,
        primitive: &gltf::Primitive<'_>,
        key: Option<ShapeKey>,
    ) -> Result<Arc<Shape>, GltfError> {
        if let Some(shape) = key.and_then(|key| self.shapes.get(&key)) {
            return Ok(shape.clone());
        }
        let shape = Arc::new(shape_reader.shape(primitive)?);
        self.shapes.extend(key.map(|key| (key, shape.clone())));
        Ok(shape)
    }

    /// The baked shape of a primitive whose base colour and emissive texture have different coordinates, from
    /// the cache if it has a key and has been baked before.
    fn baked_part(
        &mut self,
        shape_reader: &ShapeReader<'_>,
        primitive: &gltf::Primitive<'_>,
        key: Option<ShapeKey>,
    ) -> Result<Option<BakedPart>, GltfError> {
        let Some(input) = self.materials.bake_input(&primitive.material()) else { return Ok(None) };
        if let Some(part) = key.and_then(|key| self.baked.get(&key)) {
            return Ok(part.clone());
        }
        let part = self.bake(shape_reader, primitive, &input)?;
        self.baked.extend(key.map(|key| (key, part.clone())));
        Ok(part)
    }

    /// Refuses shapes whose points are too far from the model's origin; else extends the radius.
    fn extend_radius(
        &mut self,
        node: &gltf::Node<'_>,
        mesh: &gltf::Mesh<'_>,
        shape: &Shape,
        model_from_shape: &DAffine3,
    ) -> Result<(), GltfError> {
        let shape_radius_m = shape
            .vertices
            .iter()
            .map(|vertex| DVec3::from_array(vertex.position_m.map(f64::from)).length())
            .fold(0.0, f64::max);
        let radius_m =
            model_from_shape.translation.length() + shape_radius_m * norm(&model_from_shape.matrix3);
        if radius_m.is_nan() || radius_m > MAX_RADIUS_M {
            let (node, mesh) = (node.index(), mesh.index());
            return Err(self.asset.error(format!(
                "nodes.{node}: places points of meshes.{mesh} {radius_m:.1e} m from the model's origin, more \
                 than {MAX_RADIUS_M:.0e} m: check the mesh's positions and the translation, rotation and \
                 scale of its nodes"
            )));
        }
        self.radius_m = self.radius_m.max(radius_m);
        Ok(())
    }

    /// Bakes base colour and emissive texture of a primitive into one texture; `None`, with a note, where
    /// that is not possible.
    fn bake(
        &mut self,
        shape_reader: &ShapeReader<'_>,
        primitive: &gltf::Primitive<'_>,
        input: &BakeInput,
    ) -> Result<Option<BakedPart>, GltfError> {
        // The scene's light would apply to the baked emissive light as well, so the shape is not lit.
        let shape = ShapeReader { with_normals: false, ..*shape_reader }.shape(primitive)?;
        let emissive_uvs = shape_reader.uvs(primitive, &input.emissive.rule, shape.vertices.len())?;
        let name = self.asset.material_name(primitive.material().index());
        let Some(Baked { shape, texture, coarser }) =
            bake::bake(&shape, &emissive_uvs, input, self.texels_left)
        else {
            self.notes.push(format!(
                "{name}: emissiveTexture is ignored: its texture coordinates differ from the base colour's, \
                 and triangles overlap in both layouts, or one texture for both would be too large; give it \
                 the base colour's texture coordinates"
            ));
            return Ok(None);
        };
        self.texels_left -= texture.rgba8.len() / 4;
        if coarser > 1.25 {
            self.notes.push(format!(
                "{name}: base colour and emissive texture have different texture coordinates; they are \
                 combined {coarser:.1} times coarser than stored"
            ));
        }
        if self.options.normals {
            self.notes.push(EMISSIVE_TEXTURE_UNLIT.into());
        }
        Ok(Some((Arc::new(shape), Arc::new(texture))))
    }
}

const EMISSIVE_TEXTURE_UNLIT: &str = "surfaces with an emissive texture are not lit by the scene's light";

/// Frobenius norm: an upper bound on how much a matrix lengthens a vector.
fn norm(matrix: &DMat3) -> f64 {
    (matrix.x_axis.length_squared() + matrix.y_axis.length_squared() + matrix.z_axis.length_squared()).sqrt()
}

#[cfg(test)]
mod tests;
