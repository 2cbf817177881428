//! Instructions beyond the baseline of the target, selected at run time.

/// Runs `work` with the widest vectors of the processor, and returns its result. Only code inlined into it is
/// compiled for them: hence `#[inline(always)]`, and loops instead of iterator adapters or `array::map`,
/// whose closures often remain calls.
macro_rules! widest {
    ($vectors:ident => $work:expr) => {{
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = camsim_core::simd::Avx2::find() {
            return avx2.run(
                #[inline(always)]
                |$vectors| $work,
            );
        }
        let $vectors = $crate::simd::vectors::Baseline;
        $work
    }};
}
pub(crate) use widest;

/// Lanes of a vector.
pub(crate) const VECTOR_LANES: usize = 8;

/// A vector of integers.
pub(crate) type IntVector = [i32; VECTOR_LANES];
pub(crate) type FloatVector = [f32; VECTOR_LANES];

/// Operations that are not left to auto-vectorisation: half floats, and tests of a whole vector that the
/// compiler would split into lanes.
pub(crate) trait Vectors: Copy + Sync {
    /// Converts finite half floats to floats.
    fn floats_from_halves(self, halves: [u16; 8]) -> FloatVector;
    /// Converts floats to half floats, rounded to nearest.
    fn halves_from_floats(self, floats: FloatVector) -> [u16; 8];
    /// Weighted sum of two vectors; integers wrap around.
    fn weighted_int_sum(self, factors: [i32; 2], of: [&IntVector; 2]) -> IntVector;
    fn weighted_sum(self, factors: [f32; 2], of: [&FloatVector; 2]) -> FloatVector;
    /// Whether any lane is inside.
    fn is_any_covered(self, triangle: &Coverage<'_>) -> bool;
    /// Depth-tests a triangle and stores its depth and id in the lanes that are inside and nearer.
    fn depth_test(
        self,
        triangle: &VectorTriangle<'_>,
        depth: &mut FloatVector,
        ids: &mut [u32; VECTOR_LANES],
    );
}

/// Coverage of a triangle over consecutive pixels.
#[derive(Clone, Copy)]
pub(crate) struct Coverage<'a> {
    /// Three edge functions, each as a sum of a value common to all lanes and one per lane. A lane is inside
    /// where all are at least 0. The sums wrap around.
    pub edges: [(i32, &'a IntVector); 3],
    /// Index of the last valid lane.
    pub last: i32,
}

/// A triangle to be depth-tested over consecutive pixels.
pub(crate) struct VectorTriangle<'a> {
    /// Id of the triangle.
    pub id: u32,
    pub coverage: Coverage<'a>,
    /// near / z, as a sum of a value common to all lanes and one per lane.
    pub depth_sum: (f32, &'a FloatVector),
}

/// Fallback for any processor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Baseline;

/// Lane indices.
const LANE_INDICES: IntVector = [0, 1, 2, 3, 4, 5, 6, 7];

impl Coverage<'_> {
    #[inline(always)]
    fn covers_lane(&self, i: usize) -> bool {
        // The sign bit of the OR is set if any of the values is negative.
        let edges = self.edges.iter().fold(0, |bits, (all, per_lane)| bits | all.wrapping_add(per_lane[i]));
        (edges | (self.last - LANE_INDICES[i])) >= 0
    }
}

impl Vectors for Baseline {
    /// Shifts exponent and mantissa to their positions in a float and corrects the exponent bias by a factor.
    #[inline(always)]
    fn floats_from_halves(self, halves: [u16; 8]) -> FloatVector {
        const FACTOR: f32 = f32::from_bits((127 + 112) << 23);
        let mut floats = [0.0; 8];
        for k in 0..8 {
            let moved = i32::from(halves[k] as i16) << 13;
            floats[k] = f32::from_bits(moved as u32 & 0x8fff_ffff) * FACTOR;
        }
        floats
    }

    #[inline(always)]
    fn halves_from_floats(self, floats: FloatVector) -> [u16; 8] {
        floats.map(|number| half::f16::from_f32(number).to_bits())
    }

    #[inline(always)]
    fn weighted_int_sum(self, [a, b]: [i32; 2], [of_a, of_b]: [&IntVector; 2]) -> IntVector {
        std::array::from_fn(|i| a.wrapping_mul(of_a[i]).wrapping_add(b.wrapping_mul(of_b[i])))
    }

    #[inline(always)]
    fn weighted_sum(self, [a, b]: [f32; 2], [of_a, of_b]: [&FloatVector; 2]) -> FloatVector {
        std::array::from_fn(|i| a * of_a[i] + b * of_b[i])
    }

    #[inline(always)]
    fn is_any_covered(self, triangle: &Coverage<'_>) -> bool {
        (0..VECTOR_LANES).any(|i| triangle.covers_lane(i))
    }

    #[inline(always)]
    fn depth_test(
        self,
        triangle: &VectorTriangle<'_>,
        depth: &mut FloatVector,
        ids: &mut [u32; VECTOR_LANES],
    ) {
        for i in 0..VECTOR_LANES {
            let depth_sum = triangle.depth_sum.0 + triangle.depth_sum.1[i];
            if triangle.coverage.covers_lane(i) && depth_sum > depth[i] {
                (depth[i], ids[i]) = (depth_sum, triangle.id);
            }
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[expect(unsafe_code, reason = "functions for processors that have more than all have are unsafe to call")]
mod x86 {
    use std::arch::x86_64::{
        __m128i, __m256, __m256i, _CMP_GT_OQ, _MM_FROUND_TO_NEAREST_INT, _mm256_add_epi32, _mm256_add_ps,
        _mm256_andnot_ps, _mm256_blendv_ps, _mm256_castsi256_ps, _mm256_cmp_ps, _mm256_cvtph_ps,
        _mm256_cvtps_ph, _mm256_movemask_ps, _mm256_mul_ps, _mm256_mullo_epi32, _mm256_or_si256,
        _mm256_set1_epi32, _mm256_set1_ps, _mm256_sub_epi32,
    };

    use camsim_core::simd::Avx2;

    use super::{Coverage, FloatVector, IntVector, LANE_INDICES, VECTOR_LANES, VectorTriangle, Vectors};

    /// The sign bit of each lane is set where it is not inside.
    #[inline(always)]
    fn outside_mask(_: Avx2, triangle: &Coverage<'_>) -> __m256 {
        let [(a, of_a), (b, of_b), (c, of_c)] = triangle.edges;
        let [of_a, of_b, of_c]: [__m256i; 3] = [of_a, of_b, of_c].map(|of| bytemuck::cast(*of));
        let lanes: __m256i = bytemuck::cast(LANE_INDICES);
        // SAFETY: a value of `Avx2` tells that this processor has it.
        unsafe {
            let sum = |all: i32, per_lane: __m256i| _mm256_add_epi32(_mm256_set1_epi32(all), per_lane);
            let beside = _mm256_or_si256(_mm256_or_si256(sum(a, of_a), sum(b, of_b)), sum(c, of_c));
            _mm256_castsi256_ps(_mm256_or_si256(
                beside,
                _mm256_sub_epi32(_mm256_set1_epi32(triangle.last), lanes),
            ))
        }
    }

    impl Vectors for Avx2 {
        #[inline(always)]
        fn floats_from_halves(self, halves: [u16; 8]) -> FloatVector {
            let halves: __m128i = bytemuck::cast(halves);
            // SAFETY: `self` tells that this processor has it.
            bytemuck::cast(unsafe { _mm256_cvtph_ps(halves) })
        }

        #[inline(always)]
        fn halves_from_floats(self, floats: FloatVector) -> [u16; 8] {
            let floats = bytemuck::cast(floats);
            // SAFETY: `self` tells that this processor has it.
            bytemuck::cast(unsafe { _mm256_cvtps_ph::<_MM_FROUND_TO_NEAREST_INT>(floats) })
        }

        #[inline(always)]
        fn weighted_int_sum(self, [a, b]: [i32; 2], of: [&IntVector; 2]) -> IntVector {
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
        fn weighted_sum(self, [a, b]: [f32; 2], of: [&FloatVector; 2]) -> FloatVector {
            let [of_a, of_b]: [__m256; 2] = of.map(|of| bytemuck::cast(*of));
            // SAFETY: `self` tells that this processor has it.
            bytemuck::cast(unsafe {
                _mm256_add_ps(_mm256_mul_ps(_mm256_set1_ps(a), of_a), _mm256_mul_ps(_mm256_set1_ps(b), of_b))
            })
        }

        #[inline(always)]
        fn is_any_covered(self, triangle: &Coverage<'_>) -> bool {
            // SAFETY: `self` tells that this processor has it.
            unsafe { _mm256_movemask_ps(outside_mask(self, triangle)) != 0xff }
        }

        #[inline(always)]
        fn depth_test(
            self,
            triangle: &VectorTriangle<'_>,
            depth: &mut FloatVector,
            ids: &mut [u32; VECTOR_LANES],
        ) {
            let (depth_sum, old_depth): (__m256, __m256) =
                (bytemuck::cast(*triangle.depth_sum.1), bytemuck::cast(*depth));
            let outside_mask = outside_mask(self, &triangle.coverage);
            // SAFETY: `self` tells that this processor has it.
            unsafe {
                let depth_sum = _mm256_add_ps(_mm256_set1_ps(triangle.depth_sum.0), depth_sum);
                // The sign bit of each lane selects.
                let is_visible =
                    _mm256_andnot_ps(outside_mask, _mm256_cmp_ps::<_CMP_GT_OQ>(depth_sum, old_depth));
                if _mm256_movemask_ps(is_visible) != 0 {
                    *depth = bytemuck::cast(_mm256_blendv_ps(old_depth, depth_sum, is_visible));
                    let id = _mm256_castsi256_ps(_mm256_set1_epi32(triangle.id.cast_signed()));
                    *ids = bytemuck::cast(_mm256_blendv_ps(bytemuck::cast(*ids), id, is_visible));
                }
            }
        }
    }
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use camsim_core::{noise::pcg4d, simd::Avx2};

    use super::*;

    /// Test values: arbitrary bits, including NaN and infinity, or values close to each other.
    fn random_floats(seed: u32, are_near: bool) -> FloatVector {
        std::array::from_fn(|i| {
            let [bits, ..] = pcg4d([seed, i as u32, 3, 4]);
            if are_near { (bits % 5) as f32 } else { f32::from_bits(bits) }
        })
    }

    fn random_ints(seed: u32, most: u32) -> IntVector {
        std::array::from_fn(|i| (pcg4d([seed, i as u32, 1, 2])[0] % (2 * most)) as i32 - most as i32)
    }

    #[test]
    fn avx2_equals_the_fallback() {
        let Some(avx2) = Avx2::find() else { return eprintln!("skipped: this processor has no AVX2") };
        let mut counts = [0; 9];
        for seed in 0..20_000 {
            let k = 16 * seed;
            let coverage = [random_ints(k, 50), random_ints(k + 1, 50), random_ints(k + 2, 50)];
            // In some cases one sum wraps around.
            let all = if seed % 7 == 0 { [i32::MAX, 40, 60] } else { [30, 40, 60] };
            let depth_sum = random_floats(k + 3, seed % 3 != 0);
            let triangle = VectorTriangle {
                id: seed,
                coverage: Coverage {
                    edges: [(all[0], &coverage[0]), (all[1], &coverage[1]), (all[2], &coverage[2])],
                    last: (seed % 11) as i32,
                },
                depth_sum: ((seed % 4) as f32, &depth_sum),
            };
            let old_depth = (random_floats(k + 4, seed % 2 == 0), [7; VECTOR_LANES]);
            let (mut by_any, mut by_avx2) = (old_depth, old_depth);
            Baseline.depth_test(&triangle, &mut by_any.0, &mut by_any.1);
            avx2.run(|avx2| avx2.depth_test(&triangle, &mut by_avx2.0, &mut by_avx2.1));
            assert_eq!(
                (by_any.0.map(f32::to_bits), by_any.1),
                (by_avx2.0.map(f32::to_bits), by_avx2.1),
                "{seed}"
            );
            assert_eq!(
                Baseline.is_any_covered(&triangle.coverage),
                avx2.run(|avx2| avx2.is_any_covered(&triangle.coverage)),
                "{seed}"
            );
            counts[by_any.1.iter().filter(|&&ids| ids != 7).count()] += 1;

            let (a, b) = (random_ints(k + 5, 1 << 20), random_ints(k + 6, 1 << 20));
            let factors = [random_ints(k + 7, 1 << 20)[0], random_ints(k + 8, 300)[0]];
            assert_eq!(
                Baseline.weighted_int_sum(factors, [&a, &b]),
                avx2.run(|avx2| avx2.weighted_int_sum(factors, [&a, &b]))
            );
            let (a, b, [c, d, ..]) =
                (random_floats(k + 9, true), random_floats(k + 10, true), random_floats(k + 11, true));
            assert_eq!(
                Baseline.weighted_sum([c, d], [&a, &b]),
                avx2.run(|avx2| avx2.weighted_sum([c, d], [&a, &b]))
            );
        }
        assert!(counts[..8].iter().all(|&count| count > 100), "not all kinds were there: {counts:?}");
    }
}
