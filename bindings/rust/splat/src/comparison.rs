//! Is B better than A, or is the difference chance?

use crate::error::{call, Result};
use crate::object::object;
use crate::text::{c_optional_path, c_text, pointer, text, zeros};
use crate::values::{CompareFlags, ComparisonInfo, MetricComparison};
use splat_sys as sys;
use std::ffi::CString;
use std::path::Path;

/// Scores of one object; NaN: none in that metric.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Score {
    /// Name of the object.
    pub object: String,
    /// dB
    #[cfg_attr(feature = "serde", serde(deserialize_with = "crate::numbers::Field::read"))]
    pub psnr: f64,
    /// Higher is better.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "crate::numbers::Field::read"))]
    pub ssim: f64,
    /// Less is better.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "crate::numbers::Field::read"))]
    pub lpips: f64,
}

/// Scores of a method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScoreSet<'a> {
    /// per_object.csv or scores.txt, or the folder of per_object.csv.
    Path(&'a Path),
    /// Numbers of the caller.
    Scores(&'a [Score]),
}

/// How two methods are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct CompareDesc {
    /// [`CompareFlags::UNPAIRED`]: ignore which object a score belongs to.
    pub flags: CompareFlags,
    /// Seed of all random choices.
    pub seed: u64,
    /// Random permutations; 0: 300000.
    pub resamples: u32,
    /// Samples of the interval; 0: 10000.
    pub bootstraps: u32,
}

object! {
    /// The comparison of two methods. Needs no device.
    Comparison, splat_comparison, splat_comparison_destroy
}

// SAFETY: evaluate.h: thread-safe, a comparison never changes.
unsafe impl Send for Comparison {}
// SAFETY: as above.
unsafe impl Sync for Comparison {}

/// A set for C; its texts and numbers live as long.
struct RawSet {
    raw: sys::splat_score_set,
    _path: Option<CString>,
    _names: Vec<CString>,
    _scores: Vec<sys::splat_score>,
}

impl RawSet {
    fn new(argument: &str, set: ScoreSet<'_>) -> Result<Self> {
        let (path, list) = match set {
            ScoreSet::Path(path) => (Some(path), &[][..]),
            ScoreSet::Scores(scores) => (None, scores),
        };
        let path = c_optional_path(argument, path)?;
        let names: Vec<CString> =
            list.iter().map(|score| c_text(argument, &score.object)).collect::<Result<_>>()?;
        let scores: Vec<sys::splat_score> = list
            .iter()
            .zip(&names)
            .map(|(score, name)| sys::splat_score {
                object: name.as_ptr(),
                psnr: score.psnr,
                ssim: score.ssim,
                lpips: score.lpips,
            })
            .collect();
        let none = scores.is_empty();
        let raw = sys::splat_score_set {
            path: pointer(&path),
            scores: if none { std::ptr::null() } else { scores.as_ptr() },
            score_count: scores.len() as u64,
        };
        Ok(RawSet { raw, _path: path, _names: names, _scores: scores })
    }
}

impl Comparison {
    /// Compare B with A in every metric that both have. The same numbers for the same seed.
    ///
    /// ```
    /// use splat::prelude::*;
    /// let scores = |more| {
    ///     (0..9).map(move |i| Score {
    ///         object: i.to_string(),
    ///         psnr: f64::from(20 + i % 3) + more * f64::from(8 + i),
    ///         ssim: f64::NAN,
    ///         lpips: f64::NAN,
    ///     })
    /// };
    /// let (a, b): (Vec<_>, Vec<_>) = (scores(0.0).collect(), scores(0.1).collect());
    /// let desc = CompareDesc::default();
    /// let comparison = Comparison::of_scores(ScoreSet::Scores(&a), ScoreSet::Scores(&b), &desc)?;
    /// assert_eq!(comparison.metric(0)?.verdict, Verdict::BETTER);
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `InvalidArgument` (no scores, an object without a name or twice), `NotFound` (no
    /// such file; compared in pairs, they share no object), `Format`, `Io`.
    pub fn of_scores(a: ScoreSet<'_>, b: ScoreSet<'_>, desc: &CompareDesc) -> Result<Comparison> {
        let (a, b) = (RawSet::new("a", a)?, RawSet::new("b", b)?);
        let raw = sys::splat_compare_desc {
            flags: desc.flags.0,
            a: a.raw,
            b: b.raw,
            seed: desc.seed,
            resamples: desc.resamples,
            bootstraps: desc.bootstraps,
            ..Default::default()
        };
        Comparison::made(|handle| call!(splat_compare_scores(&raw, handle)))
    }

    /// Describe the comparison.
    /// # Errors
    /// Another version of the library.
    pub fn get_info(&self) -> Result<ComparisonInfo> {
        let mut info = sys::splat_comparison_info::default();
        call!(splat_comparison_get_info(self.handle, &mut info))?;
        Ok(ComparisonInfo::from_raw(&info))
    }

    /// Get the comparison in one metric. `index`: below [`ComparisonInfo::metrics`].
    /// # Errors
    /// `InvalidArgument` (index).
    pub fn metric(&self, index: u32) -> Result<MetricComparison> {
        let mut metric = sys::splat_metric_comparison::default();
        call!(splat_comparison_metric(self.handle, index, &mut metric))?;
        Ok(MetricComparison::from_raw(&metric))
    }

    /// Copy the scores of A and B that were compared in one metric; paired, those of one object
    /// have the same place in both.
    /// # Errors
    /// `InvalidArgument` (index, a slice that is too short).
    pub fn samples(&self, index: u32) -> Result<(Vec<f64>, Vec<f64>)> {
        let metric = self.metric(index)?;
        let (mut a, mut b) = (
            zeros::<f64>("a", &[metric.n_a as usize])?,
            zeros::<f64>("b", &[metric.n_b as usize])?,
        );
        let (a_out, b_out) = (a.as_mut_ptr(), b.as_mut_ptr());
        call!(splat_comparison_samples(self.handle, index, a_out, metric.n_a, b_out, metric.n_b))?;
        Ok((a, b))
    }

    /// JSON: paths, objects, seed, metrics with differences, intervals and verdicts.
    /// # Errors
    /// Another version of the library.
    pub fn report(&self) -> Result<String> {
        // SAFETY: the buffer lives through the call.
        text(|buffer, capacity, needed| unsafe {
            sys::splat_comparison_report(self.handle, buffer, capacity, needed)
        })
    }
}
