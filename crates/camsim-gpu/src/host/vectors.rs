//! What processors have beyond what all of them have. The only place that takes their word for it.

/// Does work by the widest vectors that the processor has, and returns what that gives. Only what is inlined into it is compiled for these: functions are marked so, and
/// loops are written out, since closures that arrays' `map` or iterators call mostly stay calls.
macro_rules! widest {
    ($vectors:ident => $work:expr) => {{
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = $crate::host::vectors::Avx2::find() {
            return avx2.run(
                #[inline(always)]
                |$vectors| $work,
            );
        }
        let $vectors = $crate::host::vectors::Any;
        $work
    }};
}
pub(crate) use widest;

/// How to read and write half floats.
pub(crate) trait Vectors: Copy + Sync {
    /// Finite half floats as floats.
    fn numbers(self, halves: [u16; 8]) -> [f32; 8];
    /// Floats as half floats, rounded to the nearest.
    fn halves(self, numbers: [f32; 8]) -> [u16; 8];
}

/// Any processor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Any;

impl Vectors for Any {
    /// Moved to where a float has exponent and fraction, and set right by a factor.
    #[inline(always)]
    fn numbers(self, halves: [u16; 8]) -> [f32; 8] {
        const FACTOR: f32 = f32::from_bits((127 + 112) << 23);
        let mut numbers = [0.0; 8];
        for k in 0..8 {
            let moved = i32::from(halves[k] as i16) << 13;
            numbers[k] = f32::from_bits(moved as u32 & 0x8fff_ffff) * FACTOR;
        }
        numbers
    }

    #[inline(always)]
    fn halves(self, numbers: [f32; 8]) -> [u16; 8] {
        numbers.map(|number| half::f16::from_f32(number).to_bits())
    }
}

#[cfg(target_arch = "x86_64")]
pub(crate) use x86::Avx2;

#[cfg(target_arch = "x86_64")]
#[expect(unsafe_code, reason = "functions for processors that have more than all have are unsafe to call")]
mod x86 {
    use std::arch::{
        is_x86_feature_detected,
        x86_64::{__m128i, _MM_FROUND_TO_NEAREST_INT, _mm256_cvtph_ps, _mm256_cvtps_ph},
    };

    use super::Vectors;

    /// x86-64 with AVX2, FMA and F16C, which nearly all have: there is one only where they were found.
    #[derive(Clone, Copy, Debug)]
    pub struct Avx2(());

    impl Avx2 {
        pub fn find() -> Option<Self> {
            (is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") && is_x86_feature_detected!("f16c")).then_some(Self(()))
        }

        /// Runs what is compiled for it.
        pub fn run<R>(self, work: impl FnOnce(Self) -> R) -> R {
            #[target_feature(enable = "avx2,fma,f16c")]
            fn compiled<R>(avx2: Avx2, work: impl FnOnce(Avx2) -> R) -> R {
                work(avx2)
            }
            // SAFETY: `self` tells that this processor has them.
            unsafe { compiled(self, work) }
        }
    }

    impl Vectors for Avx2 {
        #[inline(always)]
        fn numbers(self, halves: [u16; 8]) -> [f32; 8] {
            let halves: __m128i = bytemuck::cast(halves);
            // SAFETY: `self` tells that this processor has it.
            bytemuck::cast(unsafe { _mm256_cvtph_ps(halves) })
        }

        #[inline(always)]
        fn halves(self, numbers: [f32; 8]) -> [u16; 8] {
            let numbers = bytemuck::cast(numbers);
            // SAFETY: `self` tells that this processor has it.
            bytemuck::cast(unsafe { _mm256_cvtps_ph::<_MM_FROUND_TO_NEAREST_INT>(numbers) })
        }
    }
}
