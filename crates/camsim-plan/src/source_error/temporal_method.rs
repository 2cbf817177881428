//! A temporal inverse, and the exposure that it is used for.

use super::dry_run::MAX_LOOK_UPS;
use crate::ir::stages::{BlurStage, NodeDepths, TemporalStage};

/// A temporal inverse, and the exposure that it is used for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TemporalMethod {
    pub temporal: TemporalStage,
    pub blur: Option<BlurStage>,
}

impl TemporalMethod {
    /// Look-ups of depth, if those at mid-exposure are all that there are.
    pub fn look_ups_of_mid(self) -> Option<usize> {
        match self {
            Self {
                temporal: TemporalStage::Reproject { iterations },
                blur: Some(BlurStage { depths: NodeDepths::Mid, .. }),
            } => Some((iterations as usize).min(MAX_LOOK_UPS)),
            _ => None,
        }
    }
}

/// Whether a solver takes the camera's twist to be constant.
pub(crate) fn is_of_twist(temporal: TemporalStage) -> bool {
    matches!(temporal, TemporalStage::Linear | TemporalStage::Rk2)
}
