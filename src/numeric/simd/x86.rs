//! Instructions of x86-64 processors. Values of [`Avx2`] and [`Avx512`] exist only inside code that runs after the processor was
//! asked for these features, so their methods may use them.

use super::{Kernel, Lanes};
use std::arch::x86_64::{
    _CMP_GE_OQ, _CMP_GT_OQ, _CMP_LE_OQ, _CMP_LT_OQ, _mm256_and_ps, _mm256_cmp_pd, _mm256_cmp_ps,
    _mm256_loadu_pd, _mm256_loadu_ps, _mm256_movemask_pd, _mm256_movemask_ps, _mm256_set1_pd,
    _mm256_set1_ps, _mm512_add_epi32, _mm512_cmp_pd_mask, _mm512_cmp_ps_mask, _mm512_loadu_pd,
    _mm512_loadu_ps, _mm512_mask_cmp_ps_mask, _mm512_maskz_compress_epi32, _mm512_set1_epi32,
    _mm512_set1_pd, _mm512_set1_ps, _mm512_setr_epi32, _mm512_storeu_si512,
};

/// Proof of the features of [`avx2`].
#[derive(Clone, Copy)]
pub(super) struct Avx2(());

/// Proof of the features of [`avx512`].
#[derive(Clone, Copy)]
pub(super) struct Avx512(());

/// To be called only for [`super::Set::Avx2`], which [`super::Vectors::all`] alone makes, where the processor has the features.
#[inline]
pub(super) fn avx2<K: Kernel>(kernel: K) -> K::Output {
    #[inline(never)]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn run<K: Kernel>(kernel: K) -> K::Output {
        kernel.run(Avx2(()))
    }
    // SAFETY: see above.
    unsafe { run(kernel) }
}

/// To be called only for [`super::Set::Avx512`], which [`super::Vectors::all`] alone makes, where the processor has the features.
#[inline]
pub(super) fn avx512<K: Kernel>(kernel: K) -> K::Output {
    #[inline(never)]
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn run<K: Kernel>(kernel: K) -> K::Output {
        kernel.run(Avx512(()))
    }
    // SAFETY: see above.
    unsafe { run(kernel) }
}

impl Lanes for Avx2 {
    #[inline(always)]
    fn beyond(self, values: &[f64; 8], bound: f64) -> (u32, u32) {
        // SAFETY: `self` proves the features; both loads are inside `values`.
        unsafe {
            let low = _mm256_loadu_pd(values.as_ptr());
            let high = _mm256_loadu_pd(values.as_ptr().add(4));
            let (most, least) = (_mm256_set1_pd(bound), _mm256_set1_pd(-bound));
            let above = |v| _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_GT_OQ>(v, most)) as u32;
            let below = |v| _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(v, least)) as u32;
            (above(low) | above(high) << 4, below(low) | below(high) << 4)
        }
    }

    #[inline(always)]
    fn at_most(self, values: &[f32; 16], bound: f32) -> u32 {
        // SAFETY: `self` proves the features; both loads are inside `values`.
        unsafe {
            let most = _mm256_set1_ps(bound);
            let half = |at: usize| {
                let v = _mm256_loadu_ps(values.as_ptr().add(at));
                _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(v, most)) as u32
            };
            half(0) | half(8) << 8
        }
    }

    #[inline(always)]
    fn overlaps(
        self,
        low: &[[f32; 16]; 3],
        high: &[[f32; 16]; 3],
        least: [f32; 3],
        most: [f32; 3],
    ) -> u32 {
        // SAFETY: `self` proves the features; all loads are inside `low` and `high`.
        unsafe {
            let half = |at: usize| {
                let axis = |k: usize| {
                    let low = _mm256_loadu_ps(low[k].as_ptr().add(at));
                    let high = _mm256_loadu_ps(high[k].as_ptr().add(at));
                    _mm256_and_ps(
                        _mm256_cmp_ps::<_CMP_LE_OQ>(low, _mm256_set1_ps(most[k])),
                        _mm256_cmp_ps::<_CMP_GE_OQ>(high, _mm256_set1_ps(least[k])),
                    )
                };
                let all = _mm256_and_ps(_mm256_and_ps(axis(0), axis(1)), axis(2));
                _mm256_movemask_ps(all) as u32
            };
            half(0) | half(8) << 8
        }
    }

    #[inline(always)]
    fn places_at_most(
        self,
        values: &[f32; 16],
        bound: f32,
        first: u32,
        out: &mut [u32; 16],
    ) -> u32 {
        let bits = self.at_most(values, bound);
        self.places(bits, first, out);
        bits
    }

    #[inline(always)]
    fn places(self, bits: u32, first: u32, out: &mut [u32; 16]) {
        super::Portable.places(bits, first, out);
    }
}

impl Lanes for Avx512 {
    #[inline(always)]
    fn beyond(self, values: &[f64; 8], bound: f64) -> (u32, u32) {
        // SAFETY: `self` proves the features; the load is inside `values`.
        unsafe {
            let v = _mm512_loadu_pd(values.as_ptr());
            let above = _mm512_cmp_pd_mask::<_CMP_GT_OQ>(v, _mm512_set1_pd(bound));
            let below = _mm512_cmp_pd_mask::<_CMP_LT_OQ>(v, _mm512_set1_pd(-bound));
            (u32::from(above), u32::from(below))
        }
    }

    #[inline(always)]
    fn at_most(self, values: &[f32; 16], bound: f32) -> u32 {
        // SAFETY: `self` proves the features; the load is inside `values`.
        unsafe {
            let v = _mm512_loadu_ps(values.as_ptr());
            u32::from(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(v, _mm512_set1_ps(bound)))
        }
    }

    #[inline(always)]
    fn overlaps(
        self,
        low: &[[f32; 16]; 3],
        high: &[[f32; 16]; 3],
        least: [f32; 3],
        most: [f32; 3],
    ) -> u32 {
        // SAFETY: `self` proves the features; all loads are inside `low` and `high`.
        unsafe {
            let axis = |so_far, k: usize| {
                let low = _mm512_loadu_ps(low[k].as_ptr());
                let high = _mm512_loadu_ps(high[k].as_ptr());
                let (least, most) = (_mm512_set1_ps(least[k]), _mm512_set1_ps(most[k]));
                let below = _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(so_far, low, most);
                _mm512_mask_cmp_ps_mask::<_CMP_GE_OQ>(below, high, least)
            };
            u32::from(axis(axis(axis(u16::MAX, 0), 1), 2))
        }
    }

    #[inline(always)]
    fn places_at_most(
        self,
        values: &[f32; 16],
        bound: f32,
        first: u32,
        out: &mut [u32; 16],
    ) -> u32 {
        // SAFETY: `self` proves the features; the load is inside `values`, and the store fills `out`.
        unsafe {
            let v = _mm512_loadu_ps(values.as_ptr());
            let bits = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(v, _mm512_set1_ps(bound));
            places(bits, first, out);
            u32::from(bits)
        }
    }

    #[inline(always)]
    fn places(self, bits: u32, first: u32, out: &mut [u32; 16]) {
        // SAFETY: `self` proves the features.
        unsafe { places(bits as u16, first, out) }
    }
}

/// What [`Lanes::places`] does.
#[inline]
#[target_feature(enable = "avx512f")]
fn places(bits: u16, first: u32, out: &mut [u32; 16]) {
    let steps = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    let all = _mm512_add_epi32(steps, _mm512_set1_epi32(first as i32));
    let kept = _mm512_maskz_compress_epi32(bits, all);
    // SAFETY: the store fills `out`.
    unsafe { _mm512_storeu_si512(out.as_mut_ptr().cast(), kept) }
}
