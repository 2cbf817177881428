//! What processors have beyond what all of them have. The only place that takes their word for it.

/// Does work by the widest vectors that the processor has, and returns what that gives. Only what is inlined
/// into it is compiled for these: functions are marked so, and loops are written out, since closures that
/// arrays' `map` or iterators call mostly stay calls.
macro_rules! widest {
    ($vectors:ident => $work:expr) => {{
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = $crate::simd::vectors::Avx2::find() {
            return avx2.run(
                #[inline(always)]
                |$vectors| $work,
            );
        }
        let $vectors = $crate::simd::vectors::Any;
        $work
    }};
}
pub(crate) use widest;

/// Numbers that are looked at together.
pub(crate) const SIDE_BY_SIDE: usize = 8;

/// Whole numbers side by side, and others.
pub(crate) type Wholes = [i32; SIDE_BY_SIDE];
pub(crate) type Numbers = [f32; SIDE_BY_SIDE];

/// What is not left to the compiler: half floats, and what it makes a condition for each number of where it
/// is one for all.
pub(crate) trait Vectors: Copy + Sync {
    /// Finite half floats as floats.
    fn numbers(self, halves: [u16; 8]) -> Numbers;
    /// Floats as half floats, rounded to the nearest.
    fn halves(self, numbers: Numbers) -> [u16; 8];
    /// Sums of two products for each, those of whole numbers modulo 2^32.
    fn mixed(self, factors: [i32; 2], of: [&Wholes; 2]) -> Wholes;
    fn mixed_numbers(self, factors: [f32; 2], of: [&Numbers; 2]) -> Numbers;
    /// Whether it is at any of the places.
    fn is_any_inside(self, what: &Inside<'_>) -> bool;
    /// Shows what is nearer than what is there, where it is.
    fn show(self, what: &Shown<'_>, depth: &mut Numbers, shown: &mut [u32; SIDE_BY_SIDE]);
}

/// Where something is, of places side by side.
#[derive(Clone, Copy)]
pub(crate) struct Inside<'a> {
    /// It is where all of these are at least 0: each the sum of one number for all places and one for each.
    /// They wrap around.
    pub sides: [(i32, &'a Wholes); 3],
    /// Places after the first one that are asked.
    pub last: i32,
}

/// Something that some of the places side by side may show.
pub(crate) struct Shown<'a> {
    /// Its number.
    pub name: u32,
    pub inside: Inside<'a>,
    /// How near it is, such a sum too: the more the nearer.
    pub near: (f32, &'a Numbers),
}

/// Any processor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Any;

/// Numbers of places side by side.
const PLACES: Wholes = [0, 1, 2, 3, 4, 5, 6, 7];

impl Inside<'_> {
    #[inline(always)]
    fn is_at(&self, i: usize) -> bool {
        // Less than 0 is what is less than 0 anywhere.
        let sides = self.sides.iter().fold(0, |bits, (all, each)| bits | all.wrapping_add(each[i]));
        (sides | (self.last - PLACES[i])) >= 0
    }
}

impl Vectors for Any {
    /// Moved to where a float has exponent and fraction, and set right by a factor.
    #[inline(always)]
    fn numbers(self, halves: [u16; 8]) -> Numbers {
        const FACTOR: f32 = f32::from_bits((127 + 112) << 23);
        let mut numbers = [0.0; 8];
        for k in 0..8 {
            let moved = i32::from(halves[k] as i16) << 13;
            numbers[k] = f32::from_bits(moved as u32 & 0x8fff_ffff) * FACTOR;
        }
        numbers
    }

    #[inline(always)]
    fn halves(self, numbers: Numbers) -> [u16; 8] {
        numbers.map(|number| half::f16::from_f32(number).to_bits())
    }

    #[inline(always)]
    fn mixed(self, [a, b]: [i32; 2], [of_a, of_b]: [&Wholes; 2]) -> Wholes {
        std::array::from_fn(|i| a.wrapping_mul(of_a[i]).wrapping_add(b.wrapping_mul(of_b[i])))
    }

    #[inline(always)]
    fn mixed_numbers(self, [a, b]: [f32; 2], [of_a, of_b]: [&Numbers; 2]) -> Numbers {
        std::array::from_fn(|i| a * of_a[i] + b * of_b[i])
    }

    #[inline(always)]
    fn is_any_inside(self, what: &Inside<'_>) -> bool {
        (0..SIDE_BY_SIDE).any(|i| what.is_at(i))
    }

    #[inline(always)]
    fn show(self, what: &Shown<'_>, depth: &mut Numbers, shown: &mut [u32; SIDE_BY_SIDE]) {
        for i in 0..SIDE_BY_SIDE {
            let near = what.near.0 + what.near.1[i];
            if what.inside.is_at(i) && near > depth[i] {
                (depth[i], shown[i]) = (near, what.name);
            }
        }
    }
}

#[cfg(target_arch = "x86_64")]
pub(crate) use x86::Avx2;

#[cfg(target_arch = "x86_64")]
#[expect(unsafe_code, reason = "functions for processors that have more than all have are unsafe to call")]
mod x86 {
    use std::arch::{
        is_x86_feature_detected,
        x86_64::{
            __m128i, __m256, __m256i, _CMP_GT_OQ, _MM_FROUND_TO_NEAREST_INT, _mm256_add_epi32, _mm256_add_ps,
            _mm256_andnot_ps, _mm256_blendv_ps, _mm256_castsi256_ps, _mm256_cmp_ps, _mm256_cvtph_ps,
            _mm256_cvtps_ph, _mm256_movemask_ps, _mm256_mul_ps, _mm256_mullo_epi32, _mm256_or_si256,
            _mm256_set1_epi32, _mm256_set1_ps, _mm256_sub_epi32,
        },
    };

    use super::{Inside, Numbers, PLACES, SIDE_BY_SIDE, Shown, Vectors, Wholes};

    /// x86-64 with AVX2, FMA and F16C, which nearly all have: there is one only where they were found.
    #[derive(Clone, Copy, Debug)]
    pub struct Avx2(());

    impl Avx2 {
        pub fn find() -> Option<Self> {
            (is_x86_feature_detected!("avx2")
                && is_x86_feature_detected!("fma")
                && is_x86_feature_detected!("f16c"))
            .then_some(Self(()))
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

    impl Avx2 {
        /// Its first bits tell where it is not.
        #[inline(always)]
        fn beyond(self, what: &Inside<'_>) -> __m256 {
            let [(a, of_a), (b, of_b), (c, of_c)] = what.sides;
            let [of_a, of_b, of_c]: [__m256i; 3] = [of_a, of_b, of_c].map(|of| bytemuck::cast(*of));
            let places: __m256i = bytemuck::cast(PLACES);
            // SAFETY: `self` tells that this processor has it.
            unsafe {
                let sum = |all: i32, each: __m256i| _mm256_add_epi32(_mm256_set1_epi32(all), each);
                let beside = _mm256_or_si256(_mm256_or_si256(sum(a, of_a), sum(b, of_b)), sum(c, of_c));
                _mm256_castsi256_ps(_mm256_or_si256(
                    beside,
                    _mm256_sub_epi32(_mm256_set1_epi32(what.last), places),
                ))
            }
        }
    }

    impl Vectors for Avx2 {
        #[inline(always)]
        fn numbers(self, halves: [u16; 8]) -> Numbers {
            let halves: __m128i = bytemuck::cast(halves);
            // SAFETY: `self` tells that this processor has it.
            bytemuck::cast(unsafe { _mm256_cvtph_ps(halves) })
        }

        #[inline(always)]
        fn halves(self, numbers: Numbers) -> [u16; 8] {
            let numbers = bytemuck::cast(numbers);
            // SAFETY: `self` tells that this processor has it.
            bytemuck::cast(unsafe { _mm256_cvtps_ph::<_MM_FROUND_TO_NEAREST_INT>(numbers) })
        }

        #[inline(always)]
        fn mixed(self, [a, b]: [i32; 2], of: [&Wholes; 2]) -> Wholes {
            let [of_a, of_b]: [__m256i; 2] = of.map(|of| bytemuck::cast(*of));
            // SAFETY: `self` tells that this processor has it.
            bytemuck::cast(unsafe {
                _mm256_add_epi32(
                    _mm256_mullo_epi32(_mm256_set1_epi32(a), of_a),
                    _mm256_mullo_epi32(_mm256_set1_epi32(b), of_b),
                )
            })
        }

        #[inline(always)]
        fn mixed_numbers(self, [a, b]: [f32; 2], of: [&Numbers; 2]) -> Numbers {
            let [of_a, of_b]: [__m256; 2] = of.map(|of| bytemuck::cast(*of));
            // SAFETY: `self` tells that this processor has it.
            bytemuck::cast(unsafe {
                _mm256_add_ps(_mm256_mul_ps(_mm256_set1_ps(a), of_a), _mm256_mul_ps(_mm256_set1_ps(b), of_b))
            })
        }

        #[inline(always)]
        fn is_any_inside(self, what: &Inside<'_>) -> bool {
            // SAFETY: `self` tells that this processor has it.
            unsafe { _mm256_movemask_ps(self.beyond(what)) != 0xff }
        }

        #[inline(always)]
        fn show(self, what: &Shown<'_>, depth: &mut Numbers, shown: &mut [u32; SIDE_BY_SIDE]) {
            let (near, before): (__m256, __m256) = (bytemuck::cast(*what.near.1), bytemuck::cast(*depth));
            let beyond = self.beyond(&what.inside);
            // SAFETY: `self` tells that this processor has it.
            unsafe {
                let near = _mm256_add_ps(_mm256_set1_ps(what.near.0), near);
                // The first bit of each number decides.
                let is_shown = _mm256_andnot_ps(beyond, _mm256_cmp_ps::<_CMP_GT_OQ>(near, before));
                if _mm256_movemask_ps(is_shown) != 0 {
                    *depth = bytemuck::cast(_mm256_blendv_ps(before, near, is_shown));
                    let name = _mm256_castsi256_ps(_mm256_set1_epi32(what.name.cast_signed()));
                    *shown = bytemuck::cast(_mm256_blendv_ps(bytemuck::cast(*shown), name, is_shown));
                }
            }
        }
    }
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use camsim_core::noise::pcg4d;

    use super::*;

    /// Numbers of all kinds: any bits, so NaN and infinite ones too, or near each other.
    fn numbers(seed: u32, are_near: bool) -> Numbers {
        std::array::from_fn(|i| {
            let [bits, ..] = pcg4d([seed, i as u32, 3, 4]);
            if are_near { (bits % 5) as f32 } else { f32::from_bits(bits) }
        })
    }

    fn wholes(seed: u32, most: u32) -> Wholes {
        std::array::from_fn(|i| (pcg4d([seed, i as u32, 1, 2])[0] % (2 * most)) as i32 - most as i32)
    }

    #[test]
    fn the_widest_vectors_show_what_any_processor_shows() {
        let Some(avx2) = Avx2::find() else { return eprintln!("skipped: this processor has no AVX2") };
        let mut counts = [0; 9];
        for seed in 0..20_000 {
            let k = 16 * seed;
            let inside = [wholes(k, 50), wholes(k + 1, 50), wholes(k + 2, 50)];
            // One sum of a few wraps around.
            let all = if seed % 7 == 0 { [i32::MAX, 40, 60] } else { [30, 40, 60] };
            let near = numbers(k + 3, seed % 3 != 0);
            let what = Shown {
                name: seed,
                inside: Inside {
                    sides: [(all[0], &inside[0]), (all[1], &inside[1]), (all[2], &inside[2])],
                    last: (seed % 11) as i32,
                },
                near: ((seed % 4) as f32, &near),
            };
            let before = (numbers(k + 4, seed % 2 == 0), [7; SIDE_BY_SIDE]);
            let (mut by_any, mut by_avx2) = (before, before);
            Any.show(&what, &mut by_any.0, &mut by_any.1);
            avx2.run(|avx2| avx2.show(&what, &mut by_avx2.0, &mut by_avx2.1));
            assert_eq!(
                (by_any.0.map(f32::to_bits), by_any.1),
                (by_avx2.0.map(f32::to_bits), by_avx2.1),
                "{seed}"
            );
            assert_eq!(
                Any.is_any_inside(&what.inside),
                avx2.run(|avx2| avx2.is_any_inside(&what.inside)),
                "{seed}"
            );
            counts[by_any.1.iter().filter(|&&shown| shown != 7).count()] += 1;

            let (a, b) = (wholes(k + 5, 1 << 20), wholes(k + 6, 1 << 20));
            let factors = [wholes(k + 7, 1 << 20)[0], wholes(k + 8, 300)[0]];
            assert_eq!(Any.mixed(factors, [&a, &b]), avx2.run(|avx2| avx2.mixed(factors, [&a, &b])));
            let (a, b, [c, d, ..]) = (numbers(k + 9, true), numbers(k + 10, true), numbers(k + 11, true));
            assert_eq!(
                Any.mixed_numbers([c, d], [&a, &b]),
                avx2.run(|avx2| avx2.mixed_numbers([c, d], [&a, &b]))
            );
        }
        assert!(counts[..8].iter().all(|&count| count > 100), "not all kinds were there: {counts:?}");
    }
}
