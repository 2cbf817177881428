//! Node transforms, skin joints and morph weights at an instant of the animations.

use std::collections::HashMap;

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};
use gltf::animation::{Interpolation, Property};

use super::{GltfError, GltfOptions, MAX_NODE_DEPTH, accessor, asset::Asset};

/// Animated properties by node index; nodes that no animation moves are absent.
#[derive(Debug, Default)]
pub(super) struct Pose {
    translations: HashMap<usize, [f64; 4]>,
    rotations: HashMap<usize, [f64; 4]>,
    scales: HashMap<usize, [f64; 4]>,
    weights: HashMap<usize, Vec<f64>>,
    /// Global transform of each node; empty for files without skins.
    model_from_node: HashMap<usize, DAffine3>,
    /// Note for the user if two animations move the same property.
    pub note: Option<String>,
}

impl Pose {
    /// `periods_s` are those of the animations that are played again and again; empty to hold the last key.
    pub fn new(asset: &Asset, options: GltfOptions, periods_s: &[f64]) -> Result<Self, GltfError> {
        let mut pose = Self::default();
        if let Some(n) = options.animation.filter(|&n| n >= asset.document.animations().count()) {
            return Err(
                asset.error(format!("has no animation {n}; it has {}", asset.document.animations().count()))
            );
        }
        if let Some(time_s) = options.time_s {
            let is_chosen =
                |animation: &gltf::Animation<'_>| options.animation.is_none_or(|n| animation.index() == n);
            // Animation index by node index and property.
            let mut animation_of = HashMap::new();
            for channel in asset
                .document
                .animations()
                .filter(is_chosen)
                .flat_map(|animation| animation.channels().collect::<Vec<_>>())
            {
                let (node, animation) = (channel.target().node().index(), channel.animation().index());
                let previous = animation_of.insert((node, channel.target().property() as u8), animation);
                if let Some(previous) =
                    previous.filter(|&previous| previous != animation && pose.note.is_none())
                {
                    pose.note = Some(format!(
                        "animations {previous} and {animation} both move node {node}; the later one is used: \
                         choose one with scene.gltf.animation"
                    ));
                }
                let period_s = periods_s.get(animation).copied().filter(|period_s| *period_s > 0.0);
                let time_s = period_s.map_or(time_s, |period_s| time_s.rem_euclid(period_s));
                pose.apply_channel(asset, &channel, time_s)?;
            }
        }
        if asset.document.skins().next().is_some() {
            let children: Vec<usize> =
                asset.document.nodes().flat_map(|node| node.children().map(|child| child.index())).collect();
            for root in asset.document.nodes().filter(|node| !children.contains(&node.index())) {
                pose.insert_global_transforms(asset, &root, DAffine3::IDENTITY, 0)?;
            }
        }
        Ok(pose)
    }

    /// Stores the global transforms of a node and its descendants.
    fn insert_global_transforms(
        &mut self,
        asset: &Asset,
        node: &gltf::Node<'_>,
        model_from_parent: DAffine3,
        depth: usize,
    ) -> Result<(), GltfError> {
        if depth > MAX_NODE_DEPTH {
            return Err(asset
                .error(format!("nodes.{}: is within itself, or {MAX_NODE_DEPTH} nodes deep", node.index())));
        }
        let model_from_node = model_from_parent * self.parent_from_node(node);
        if self.model_from_node.insert(node.index(), model_from_node).is_some() {
            return Err(asset.error(format!("nodes.{}: has two parents", node.index())));
        }
        node.children()
            .try_for_each(|child| self.insert_global_transforms(asset, &child, model_from_node, depth + 1))
    }

    /// Local transform of a node.
    pub fn parent_from_node(&self, node: &gltf::Node<'_>) -> DAffine3 {
        let i = node.index();
        let is_animated = self.translations.contains_key(&i)
            || self.rotations.contains_key(&i)
            || self.scales.contains_key(&i);
        match node.transform() {
            gltf::scene::Transform::Matrix { matrix } if !is_animated => {
                let matrix = DMat4::from_cols_array_2d(&matrix.map(|column| column.map(f64::from)));
                DAffine3 { matrix3: DMat3::from_mat4(matrix), translation: matrix.w_axis.truncate() }
            }
            transform => {
                let (translation, rotation, scale) = transform.decomposed();
                let translation =
                    self.translations.get(&i).map_or(translation.map(f64::from), |&[x, y, z, _]| [x, y, z]);
                let rotation = self.rotations.get(&i).copied().unwrap_or(rotation.map(f64::from));
                let rotation = unit(rotation);
                let scale = self.scales.get(&i).map_or(scale.map(f64::from), |&[x, y, z, _]| [x, y, z]);
                let matrix3 = DMat3::from_quat(rotation) * DMat3::from_diagonal(DVec3::from_array(scale));
                DAffine3 { matrix3, translation: DVec3::from_array(translation) }
            }
        }
    }

    /// Origin and rotation of a node, without its scale.
    pub fn turn_of(&self, node: &gltf::Node<'_>) -> (DVec3, DQuat) {
        let i = node.index();
        let (translation, rotation, _) = node.transform().decomposed();
        let translation =
            self.translations.get(&i).map_or(translation.map(f64::from), |&[x, y, z, _]| [x, y, z]);
        let rotation = self.rotations.get(&i).copied().unwrap_or(rotation.map(f64::from));
        (DVec3::from_array(translation), unit(rotation))
    }

    /// Weights of a mesh's morph targets at a node.
    pub fn weights(&self, node: &gltf::Node<'_>, mesh: &gltf::Mesh<'_>) -> Vec<f64> {
        let static_weights =
            || node.weights().or(mesh.weights()).unwrap_or_default().iter().map(|&w| f64::from(w)).collect();
        self.weights.get(&node.index()).cloned().unwrap_or_else(static_weights)
    }

    /// Joint matrices of a skin: from the bind pose to the model's axes.
    pub fn joints(&self, asset: &Asset, skin: &gltf::Skin<'_>) -> Result<Vec<DAffine3>, GltfError> {
        let inverse_bind =
            skin.inverse_bind_matrices().map(|accessor| accessor::matrices(asset, &accessor)).transpose()?;
        let joint = |(k, node): (usize, gltf::Node<'_>)| {
            let matrix = inverse_bind
                .as_ref()
                .and_then(|all| all.get(k))
                .map_or(DMat4::IDENTITY, DMat4::from_cols_array);
            let joint_from_bind =
                DAffine3 { matrix3: DMat3::from_mat4(matrix), translation: matrix.w_axis.truncate() };
            self.model_from_node.get(&node.index()).copied().unwrap_or(DAffine3::IDENTITY) * joint_from_bind
        };
        Ok(skin.joints().enumerate().map(joint).collect())
    }

    /// Stores the value of a channel at a time, seconds.
    fn apply_channel(
        &mut self,
        asset: &Asset,
        channel: &gltf::animation::Channel<'_>,
        time_s: f64,
    ) -> Result<(), GltfError> {
        let target = channel.target();
        let Some(value) = sampled(asset, channel, time_s)? else { return Ok(()) };
        let four = || std::array::from_fn(|k| value.get(k).copied().unwrap_or(0.0));
        let node = target.node().index();
        match target.property() {
            Property::Translation => drop(self.translations.insert(node, four())),
            Property::Rotation => drop(self.rotations.insert(node, four())),
            Property::Scale => drop(self.scales.insert(node, four())),
            Property::MorphTargetWeights => drop(self.weights.insert(node, value)),
        }
        Ok(())
    }
}

/// A rotation as stored; none if it has no direction.
pub(super) fn unit(rotation: [f64; 4]) -> DQuat {
    let rotation = DQuat::from_array(rotation).normalize();
    if rotation.is_finite() { rotation } else { DQuat::IDENTITY }
}

/// Value of a channel's sampler at a time, seconds; `None` without key frames. Interpolation by glTF 2.0,
/// appendix C.
fn sampled(
    asset: &Asset,
    channel: &gltf::animation::Channel<'_>,
    time_s: f64,
) -> Result<Option<Vec<f64>>, GltfError> {
    let sampler = channel.sampler();
    let is_rotation = channel.target().property() == Property::Rotation;
    let times_s = accessor::numbers(asset, &sampler.input())?;
    let Some(last) = times_s.len().checked_sub(1) else { return Ok(None) };
    let values = accessor::numbers(asset, &sampler.output())?;
    let is_cubic = sampler.interpolation() == Interpolation::CubicSpline;
    let numbers_per_key = values.len() / times_s.len();
    // A key of a cubic spline has an in-tangent, a value and an out-tangent.
    let components = if is_cubic { numbers_per_key / 3 } else { numbers_per_key };
    let is_whole = numbers_per_key * times_s.len() == values.len() && (!is_cubic || numbers_per_key % 3 == 0);
    if !is_whole || components == 0 || (is_rotation && components != 4) {
        return Err(asset.error(format!(
            "animations.{}: a sampler's input and output do not fit",
            channel.animation().index()
        )));
    }
    let part = |key: usize, part: usize| {
        let start = key * numbers_per_key + if is_cubic { part * components } else { 0 };
        &values[start..start + components]
    };
    let (in_tangent, value, out_tangent) =
        (|key: usize| part(key, 0), |key: usize| part(key, 1), |key: usize| part(key, 2));
    let key = times_s.partition_point(|&key_s| key_s <= time_s).saturating_sub(1);
    let next = (key + 1).min(last);
    let span_s = times_s[next] - times_s[key];
    let t = if span_s > 0.0 { ((time_s - times_s[key]) / span_s).clamp(0.0, 1.0) } else { 0.0 };
    Ok(Some(match sampler.interpolation() {
        _ if t == 0.0 => value(key).to_vec(),
        Interpolation::Step => value(key).to_vec(),
        Interpolation::Linear if is_rotation => {
            let quaternion = |v: &[f64]| DQuat::from_xyzw(v[0], v[1], v[2], v[3]);
            quaternion(value(key)).slerp(quaternion(value(next)), t).to_array().to_vec()
        }
        Interpolation::Linear => value(key).iter().zip(value(next)).map(|(a, b)| a + t * (b - a)).collect(),
        Interpolation::CubicSpline => {
            let (t2, t3) = (t * t, t.powi(3));
            let component = |k: usize| {
                (2.0 * t3 - 3.0 * t2 + 1.0) * value(key)[k]
                    + span_s * (t3 - 2.0 * t2 + t) * out_tangent(key)[k]
                    + (3.0 * t2 - 2.0 * t3) * value(next)[k]
                    + span_s * (t3 - t2) * in_tangent(next)[k]
            };
            (0..components).map(component).collect()
        }
    }))
}
