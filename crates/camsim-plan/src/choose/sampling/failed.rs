//! Sampling plans that do not keep the tolerance.

use crate::ir::sampling_plan::SamplingPlan;

/// Part of the error that a few probes find that all of them find at least.
pub(super) const SURE: f64 = 0.8;

/// A sampling plan that does not keep the tolerance, with the most samples.
pub(super) struct FailedSampling {
    pub plan: SamplingPlan,
    /// Error by other causes.
    pub others_dn: f64,
    /// Error as a few probes give it.
    pub roughly_dn: f64,
    /// Error as all probes give it, where it is known.
    pub known_dn: Option<f64>,
}

impl FailedSampling {
    pub fn at_least_dn(&self) -> f64 {
        self.known_dn.unwrap_or(SURE * self.roughly_dn)
    }

    pub fn exact_dn(&mut self, exactly_dn: &dyn Fn(&FailedSampling) -> f64) -> f64 {
        let exact_dn = self.known_dn.unwrap_or_else(|| exactly_dn(self));
        self.known_dn = Some(exact_dn);
        exact_dn
    }
}

/// The least error of all: those that may be better than the best known are tried, the most promising
/// first.
pub(super) fn least_dn(failed: &mut [FailedSampling], exactly_dn: &dyn Fn(&FailedSampling) -> f64) -> f64 {
    let mut order: Vec<&mut FailedSampling> = failed.iter_mut().collect();
    order.sort_by(|a, b| a.at_least_dn().total_cmp(&b.at_least_dn()));
    let mut least_dn = f64::INFINITY;
    for failed in order {
        if failed.at_least_dn() >= least_dn {
            break;
        }
        least_dn = least_dn.min(failed.exact_dn(exactly_dn));
    }
    least_dn
}
