//! Nodes that move during frames: those that spin, and those that the file's animations move.

use std::{
    collections::{BTreeSet, HashMap},
    f64::consts::TAU,
    sync::Arc,
};

use camsim_core::scene::{
    RigidMotion,
    motion::{Between, Curve, Joint, JointFrame, Keys, Repeat, Track},
};
use glam::{DAffine3, DQuat, DVec3};
use gltf::animation::{Interpolation, Property};

use super::{
    GltfError, GltfOptions, accessor,
    asset::Asset,
    pose::{Pose, unit},
};

/// What of a model moves by itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelMotion {
    /// Parts that spin.
    pub spins: Vec<NodeSpin>,
    /// Whether the file's animations play, each again and again from its beginning to its last key. At path
    /// time 0 they are at [`GltfOptions::time_s`].
    pub animate: bool,
}

/// A node that spins with all its children.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeSpin {
    /// Its name; `None` for the whole model.
    pub node: Option<String>,
    /// Axis in the node's axes.
    pub axis: DVec3,
    /// Turns a second.
    pub hz: f64,
    /// Angle at path time 0.
    pub phase_rad: f64,
}

/// The joints between the model and a node, in the model's axes.
#[derive(Clone, Debug, Default)]
pub(super) struct Chain {
    joints: Vec<Joint>,
    /// Of the joints; `None` without any.
    pub motion: Option<Arc<RigidMotion>>,
}

/// Tracks of the animated nodes of a file.
#[derive(Debug, Default)]
pub(super) struct Moving<'a> {
    spins: &'a [NodeSpin],
    translations: HashMap<usize, Track>,
    rotations: HashMap<usize, Track>,
    /// Names of nodes that have been found.
    found: BTreeSet<String>,
    /// Notes for the user.
    pub notes: Vec<String>,
}

/// Period of each animation, seconds: its last key.
pub(super) fn periods_s(asset: &Asset) -> Result<Vec<f64>, GltfError> {
    let period = |animation: gltf::Animation<'_>| {
        let last_s = |channel: gltf::animation::Channel<'_>| -> Result<f64, GltfError> {
            let times_s = accessor::numbers(asset, &channel.sampler().input())?;
            Ok(times_s.last().copied().unwrap_or(0.0))
        };
        animation
            .channels()
            .map(last_s)
            .try_fold(0.0_f64, |most, last| -> Result<f64, GltfError> { Ok(most.max(last?)) })
    };
    asset.document.animations().map(period).collect()
}

impl<'a> Moving<'a> {
    pub fn new(
        asset: &Asset,
        options: GltfOptions,
        motion: &'a ModelMotion,
        periods_s: &[f64],
    ) -> Result<Self, GltfError> {
        let mut moving = Self { spins: &motion.spins, ..Self::default() };
        let is_chosen = |animation: &gltf::Animation<'_>| {
            motion.animate && options.animation.is_none_or(|n| animation.index() == n)
        };
        for animation in asset.document.animations().filter(is_chosen) {
            let number = animation.index();
            let period_s = periods_s.get(number).copied().unwrap_or(0.0);
            let repeat = (period_s > 0.0).then_some(Repeat { from_s: 0.0, period_s, always: true });
            let start_s = options.time_s.unwrap_or(0.0);
            for channel in animation.channels() {
                moving.add_channel(asset, &channel, start_s, repeat)?;
            }
        }
        Ok(moving)
    }

    fn add_channel(
        &mut self,
        asset: &Asset,
        channel: &gltf::animation::Channel<'_>,
        start_s: f64,
        repeat: Option<Repeat>,
    ) -> Result<(), GltfError> {
        let (node, property) = (channel.target().node().index(), channel.target().property());
        let sampler = channel.sampler();
        let times_s = accessor::numbers(asset, &sampler.input())?;
        let values = accessor::numbers(asset, &sampler.output())?;
        let damaged = || {
            let number = channel.animation().index();
            asset.error(format!("animations.{number}: the times of a sampler do not ascend"))
        };
        let sampler = Sampler { times_s, values, interpolation: sampler.interpolation() };
        if sampler.times_s.is_empty() {
            return Ok(());
        }
        let keys = |position, rotation| Track::Keys(Keys { position, rotation, start_s, repeat });
        match property {
            Property::Translation => {
                let at = sampler.curve(3, &|v| DVec3::new(v[0], v[1], v[2])).ok_or_else(damaged)?;
                self.translations.insert(node, keys(at, Curve::constant(DQuat::IDENTITY)));
            }
            Property::Rotation => {
                let quaternion = |v: &[f64]| DQuat::from_xyzw(v[0], v[1], v[2], v[3]);
                let unit_of = |v: &[f64]| unit([v[0], v[1], v[2], v[3]]);
                // Tangents have no length of 1, and cubic keys count as they are stored.
                let turn = match sampler.interpolation {
                    Interpolation::CubicSpline => sampler.curve(4, &quaternion),
                    _ => sampler.curve(4, &unit_of),
                };
                self.rotations.insert(node, keys(Curve::constant(DVec3::ZERO), turn.ok_or_else(damaged)?));
            }
            Property::Scale => {
                if !sampler.is_constant(3) {
                    self.notes.push(format!(
                        "scene.gltf.motion.animate moves and turns nodes: nodes.{node} keeps the size that it \
                         has at time_s"
                    ));
                }
            }
            Property::MorphTargetWeights => self.notes.push(format!(
                "scene.gltf.motion.animate moves and turns nodes: the morph targets of nodes.{node} stay as \
                 they are at time_s"
            )),
        }
        Ok(())
    }

    /// Whether any node moves.
    pub fn is_any(&self) -> bool {
        let spins = self.spins.iter().any(|spin| spin.node.is_some());
        spins || !self.translations.is_empty() || !self.rotations.is_empty()
    }

    /// The whole model's axes at path time 0, and the joints that all nodes share.
    pub fn root(&self) -> (DAffine3, Chain) {
        let mut model_from_root = DAffine3::IDENTITY;
        let mut joints = Vec::new();
        for spin in self.spins.iter().filter(|spin| spin.node.is_none()) {
            add_spin(&mut joints, &mut model_from_root, spin);
        }
        (model_from_root, Chain::new(joints))
    }

    /// A node's axes at path time 0, and the joints between the model and the node.
    pub fn node(
        &mut self,
        asset: &Asset,
        pose: &Pose,
        node: &gltf::Node<'_>,
        model_from_parent: DAffine3,
        parent: &Chain,
    ) -> Result<(DAffine3, Chain), GltfError> {
        let i = node.index();
        let parent_from_node = pose.parent_from_node(node);
        let (translation, rotation) = (self.translations.get(&i), self.rotations.get(&i));
        let is_own =
            |spin: &&NodeSpin| spin.node.is_some() && spin.node.as_deref() == asset.given_name("nodes", i);
        let spins: Vec<&NodeSpin> = self.spins.iter().filter(is_own).collect();
        if translation.is_none() && rotation.is_none() && spins.is_empty() {
            return Ok((model_from_parent * parent_from_node, parent.clone()));
        }
        self.found.extend(spins.iter().filter_map(|spin| spin.node.clone()));
        let uneven = || {
            asset.error(format!(
                "nodes.{i}: moves within a node that is stretched unevenly, which no rigid motion can show: \
                 give the nodes above it equal scales along x, y and z"
            ))
        };
        let frame = |affine: &DAffine3| JointFrame::from_affine(affine).ok_or_else(uneven);
        frame(&model_from_parent)?;
        let mut joints = parent.joints.clone();
        let (at, turned) = pose.turn_of(node);
        let (shift, turn) = (DAffine3::from_translation(at), DAffine3::from_quat(turned));
        if let Some(track) = translation {
            joints.push(Joint::new(frame(&model_from_parent)?, track.clone()));
        }
        if let Some(track) = rotation {
            joints.push(Joint::new(frame(&(model_from_parent * shift))?, track.clone()));
        }
        let mut model_from_turned = model_from_parent * shift * turn;
        let turned_from_node = (shift * turn).inverse() * parent_from_node;
        for spin in spins {
            add_spin(&mut joints, &mut model_from_turned, spin);
        }
        Ok((model_from_turned * turned_from_node, Chain::new(joints)))
    }

    /// An error if a node that is to spin is not there.
    pub fn check_names(&self, asset: &Asset) -> Result<(), GltfError> {
        let missing = |name: &&String| !self.found.contains(*name);
        let Some(name) = self.spins.iter().filter_map(|spin| spin.node.as_ref()).find(missing) else {
            return Ok(());
        };
        let names: BTreeSet<&str> =
            asset.document.nodes().filter_map(|node| asset.given_name("nodes", node.index())).collect();
        let some: Vec<&str> = names.iter().copied().take(20).collect();
        let known = match (names.len(), some.len()) {
            (0, _) => "no node of its scene has a name".to_owned(),
            (all, few) if all > few => format!("its first of {all} are {}", some.join(", ")),
            _ => format!("its nodes are {}", some.join(", ")),
        };
        Err(asset.error(format!("has no node \"{name}\" for scene.gltf.motion.spin: {known}")))
    }
}

impl Chain {
    fn new(joints: Vec<Joint>) -> Self {
        let motion = (!joints.is_empty()).then(|| Arc::new(RigidMotion::new(joints.clone())));
        Self { joints, motion }
    }
}

/// Adds a spin in axes that do not stretch, which then are those of its phase.
fn add_spin(joints: &mut Vec<Joint>, model_from_axes: &mut DAffine3, spin: &NodeSpin) {
    let axis = spin.axis.normalize_or(DVec3::Y);
    let track = Track::Spin { axis, hz: spin.hz, phase_rad: spin.phase_rad };
    let frame = JointFrame::from_affine(model_from_axes).unwrap_or(JointFrame::IDENTITY);
    joints.push(Joint::new(frame, track));
    *model_from_axes *= DAffine3::from_quat(DQuat::from_axis_angle(axis, spin.phase_rad % TAU));
}

/// Keys of a sampler.
struct Sampler {
    times_s: Vec<f64>,
    values: Vec<f64>,
    interpolation: Interpolation,
}

impl Sampler {
    /// `None` if the keys are not as [`Curve::new`] wants them.
    fn curve<V>(&self, components: usize, value: &dyn Fn(&[f64]) -> V) -> Option<Curve<V>> {
        let rows: Vec<&[f64]> = self.values.chunks_exact(components).collect();
        let every =
            |first: usize| -> Vec<V> { rows.iter().skip(first).step_by(3).map(|row| value(row)).collect() };
        let (values, between) = match self.interpolation {
            Interpolation::Step => (rows.iter().map(|row| value(row)).collect(), Between::Step),
            Interpolation::Linear => (rows.iter().map(|row| value(row)).collect(), Between::Linear),
            // In-tangent, value, out-tangent.
            Interpolation::CubicSpline => {
                (every(1), Between::Cubic { arriving: every(0), leaving: every(2) })
            }
        };
        Curve::new(self.times_s.clone(), values, between)
    }

    fn is_constant(&self, components: usize) -> bool {
        let mut rows = self.values.chunks_exact(components);
        let first = rows.next();
        self.interpolation != Interpolation::CubicSpline && rows.all(|row| Some(row) == first)
    }
}
