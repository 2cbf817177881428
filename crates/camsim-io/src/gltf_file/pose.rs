//! Where nodes stand at a time: animations, joints of skins, weights of morph targets.

use std::collections::HashMap;

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};
use gltf::animation::{Interpolation, Property};

use super::{DEEPEST, GltfError, GltfOptions, accessor, source::Source};

/// What animations say of nodes.
#[derive(Debug, Default)]
pub(super) struct Pose {
    shifts: HashMap<usize, [f64; 4]>,
    turns: HashMap<usize, [f64; 4]>,
    scales: HashMap<usize, [f64; 4]>,
    weights: HashMap<usize, Vec<f64>>,
    /// From each node to the model, of all nodes, once a skin asks.
    model_from_node: HashMap<usize, DAffine3>,
    /// What two animations disagree about.
    pub note: Option<String>,
}

impl Pose {
    pub fn new(source: &Source, options: GltfOptions) -> Result<Self, GltfError> {
        let mut pose = Self::default();
        if let Some(n) = options.animation.filter(|&n| n >= source.document.animations().count()) {
            return Err(source
                .broken(format!("has no animation {n}; it has {}", source.document.animations().count())));
        }
        if let Some(time_s) = options.time_s {
            let chosen =
                |animation: &gltf::Animation<'_>| options.animation.is_none_or(|n| animation.index() == n);
            // By node and property, which animation it was.
            let mut moved = HashMap::new();
            for channel in source
                .document
                .animations()
                .filter(chosen)
                .flat_map(|animation| animation.channels().collect::<Vec<_>>())
            {
                let (node, animation) = (channel.target().node().index(), channel.animation().index());
                let before = moved.insert((node, channel.target().property() as u8), animation);
                if let Some(before) = before.filter(|&before| before != animation && pose.note.is_none()) {
                    pose.note = Some(format!(
                        "animations {before} and {animation} both move node {node}, and the later counts: choose one with scene.gltf.animation"
                    ));
                }
                pose.channel(source, &channel, time_s)?;
            }
        }
        if source.document.skins().next().is_some() {
            let children: Vec<usize> =
                source.document.nodes().flat_map(|node| node.children().map(|child| child.index())).collect();
            for root in source.document.nodes().filter(|node| !children.contains(&node.index())) {
                pose.stand(source, &root, DAffine3::IDENTITY, 0)?;
            }
        }
        Ok(pose)
    }

    fn stand(
        &mut self,
        source: &Source,
        node: &gltf::Node<'_>,
        model_from_parent: DAffine3,
        depth: usize,
    ) -> Result<(), GltfError> {
        if depth > DEEPEST {
            return Err(
                source.broken(format!("nodes.{}: is within itself, or {DEEPEST} nodes deep", node.index()))
            );
        }
        let here = model_from_parent * self.parent_from_node(node);
        if self.model_from_node.insert(node.index(), here).is_some() {
            return Err(source.broken(format!("nodes.{}: has two parents", node.index())));
        }
        node.children().try_for_each(|child| self.stand(source, &child, here, depth + 1))
    }

    /// From a node's axes to its parent's.
    pub fn parent_from_node(&self, node: &gltf::Node<'_>) -> DAffine3 {
        let i = node.index();
        let moved =
            self.shifts.contains_key(&i) || self.turns.contains_key(&i) || self.scales.contains_key(&i);
        match node.transform() {
            gltf::scene::Transform::Matrix { matrix } if !moved => {
                let of = DMat4::from_cols_array_2d(&matrix.map(|column| column.map(f64::from)));
                DAffine3 { matrix3: DMat3::from_mat4(of), translation: of.w_axis.truncate() }
            }
            transform => {
                let (shift, turn, scale) = transform.decomposed();
                let shift = self.shifts.get(&i).map_or(shift.map(f64::from), |&[x, y, z, _]| [x, y, z]);
                let turn =
                    DQuat::from_array(self.turns.get(&i).copied().unwrap_or(turn.map(f64::from))).normalize();
                let scale = self.scales.get(&i).map_or(scale.map(f64::from), |&[x, y, z, _]| [x, y, z]);
                let turn = if turn.is_finite() { turn } else { DQuat::IDENTITY };
                let matrix3 = DMat3::from_quat(turn) * DMat3::from_diagonal(DVec3::from_array(scale));
                DAffine3 { matrix3, translation: DVec3::from_array(shift) }
            }
        }
    }

    /// Weights of a mesh's morph targets at a node.
    pub fn weights(&self, node: &gltf::Node<'_>, mesh: &gltf::Mesh<'_>) -> Vec<f64> {
        let given =
            || node.weights().or(mesh.weights()).unwrap_or_default().iter().map(|&w| f64::from(w)).collect();
        self.weights.get(&node.index()).cloned().unwrap_or_else(given)
    }

    /// From a skin's bound shape to the model, for each of its joints.
    pub fn joints(&self, source: &Source, skin: &gltf::Skin<'_>) -> Result<Vec<DAffine3>, GltfError> {
        let inverse =
            skin.inverse_bind_matrices().map(|accessor| accessor::matrices(source, &accessor)).transpose()?;
        let joint = |(k, node): (usize, gltf::Node<'_>)| {
            let of =
                inverse.as_ref().and_then(|all| all.get(k)).map_or(DMat4::IDENTITY, DMat4::from_cols_array);
            let bound = DAffine3 { matrix3: DMat3::from_mat4(of), translation: of.w_axis.truncate() };
            self.model_from_node.get(&node.index()).copied().unwrap_or(DAffine3::IDENTITY) * bound
        };
        Ok(skin.joints().enumerate().map(joint).collect())
    }

    fn channel(
        &mut self,
        source: &Source,
        channel: &gltf::animation::Channel<'_>,
        time_s: f64,
    ) -> Result<(), GltfError> {
        let (sampler, target) = (channel.sampler(), channel.target());
        let times = accessor::numbers(source, &sampler.input())?;
        let output = sampler.output();
        let wrong = || {
            source.broken(format!(
                "animations.{}: a sampler's input and output do not fit",
                channel.animation().index()
            ))
        };
        let Some(last) = times.len().checked_sub(1) else { return Ok(()) };
        let values = accessor::numbers(source, &output)?;
        let cubic = sampler.interpolation() == Interpolation::CubicSpline;
        // Numbers a key, and of those a value.
        let of_key = values.len() / times.len();
        let width = if cubic { of_key / 3 } else { of_key };
        let whole = of_key * times.len() == values.len() && (!cubic || of_key % 3 == 0);
        if !whole || width == 0 || (target.property() == Property::Rotation && width != 4) {
            return Err(wrong());
        }
        let value = |key: usize, part: usize| {
            let from = key * of_key + if cubic { part * width } else { 0 };
            &values[from..from + width]
        };
        let at = times.partition_point(|&t| t <= time_s).saturating_sub(1);
        let next = (at + 1).min(last);
        let span = times[next] - times[at];
        let share = if span > 0.0 { ((time_s - times[at]) / span).clamp(0.0, 1.0) } else { 0.0 };
        let is_turn = target.property() == Property::Rotation;
        let found: Vec<f64> = match sampler.interpolation() {
            _ if share == 0.0 => value(at, 1).to_vec(),
            Interpolation::Step => value(at, 1).to_vec(),
            Interpolation::Linear if is_turn => {
                let quat = |v: &[f64]| DQuat::from_xyzw(v[0], v[1], v[2], v[3]);
                quat(value(at, 0)).slerp(quat(value(next, 0)), share).to_array().to_vec()
            }
            Interpolation::Linear => {
                value(at, 0).iter().zip(value(next, 0)).map(|(a, b)| a + share * (b - a)).collect()
            }
            Interpolation::CubicSpline => {
                let (t, t2, t3) = (share, share * share, share.powi(3));
                let of = |k: usize| {
                    (2.0 * t3 - 3.0 * t2 + 1.0) * value(at, 1)[k]
                        + span * (t3 - 2.0 * t2 + t) * value(at, 2)[k]
                        + (3.0 * t2 - 2.0 * t3) * value(next, 1)[k]
                        + span * (t3 - t2) * value(next, 0)[k]
                };
                (0..width).map(of).collect()
            }
        };
        let four = || std::array::from_fn(|k| found.get(k).copied().unwrap_or(0.0));
        let node = target.node().index();
        match target.property() {
            Property::Translation => drop(self.shifts.insert(node, four())),
            Property::Rotation => drop(self.turns.insert(node, four())),
            Property::Scale => drop(self.scales.insert(node, four())),
            Property::MorphTargetWeights => drop(self.weights.insert(node, found)),
        }
        Ok(())
    }
}
