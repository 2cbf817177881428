//! Vector instructions beyond the baseline of the target, selected at run time.

#[cfg(target_arch = "x86_64")]
pub use x86::Avx2;

/// Runs `work` compiled for the widest vectors of the processor. Only what is inlined into it is: hence
/// `#[inline(always)]`, and loops instead of iterator adapters. The result is the same with all vectors.
#[inline(always)]
pub(crate) fn with_widest<R>(work: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    if let Some(avx2) = Avx2::find() {
        return avx2.run(
            #[inline(always)]
            |_| work(),
        );
    }
    work()
}

#[cfg(target_arch = "x86_64")]
#[expect(unsafe_code, reason = "functions for processors that have more than all have are unsafe to call")]
mod x86 {
    use std::arch::is_x86_feature_detected;

    /// x86-64 with AVX2, FMA and F16C, which nearly all processors have. A value exists only if they were
    /// detected.
    #[derive(Clone, Copy, Debug)]
    pub struct Avx2(());

    impl Avx2 {
        /// `None` where the processor lacks any of them.
        #[must_use]
        #[inline]
        pub fn find() -> Option<Self> {
            (is_x86_feature_detected!("avx2")
                && is_x86_feature_detected!("fma")
                && is_x86_feature_detected!("f16c"))
            .then_some(Self(()))
        }

        /// Runs `work`, compiled for these instructions as far as it is inlined.
        #[inline]
        pub fn run<R>(self, work: impl FnOnce(Self) -> R) -> R {
            #[target_feature(enable = "avx2,fma,f16c")]
            fn compiled<R>(avx2: Avx2, work: impl FnOnce(Avx2) -> R) -> R {
                work(avx2)
            }
            // SAFETY: `self` tells that this processor has them.
            unsafe { compiled(self, work) }
        }
    }
}
