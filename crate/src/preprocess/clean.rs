//! temp
use glam::Vec3;
use serde::Serialize;
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeLimits {
    pub min_range: f64,
    pub max_range: f64,
}
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct CleaningReport {
    pub num_read: usize,
    pub non_finite: usize,
    pub too_near: usize,
    pub at_range_limit: usize,
    pub duplicates: usize,
    pub num_kept: usize,
}
pub fn clean(points: &[Vec3], limits: RangeLimits) -> (Vec<Vec3>, CleaningReport) {
    let mut r = CleaningReport { num_read: points.len(), ..Default::default() };
    let kept: Vec<Vec3> = points
        .iter()
        .copied()
        .filter(|p| {
            let d = p.length() as f64;
            if !d.is_finite() {
                r.non_finite += 1;
                false
            } else if d < limits.min_range {
                r.too_near += 1;
                false
            } else if d >= limits.max_range - 1e-3 {
                r.at_range_limit += 1;
                false
            } else {
                true
            }
        })
        .collect();
    r.num_kept = kept.len();
    (kept, r)
}
pub fn range_limit<'a>(_: impl Iterator<Item = &'a [Vec3]>, _: RangeLimits) -> Option<f64> {
    None
}
