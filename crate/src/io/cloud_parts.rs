//! What the readers of PLY and PCD share: the origin of a cloud, what its positions lose in single precision, its normals.

use glam::{DVec3, Vec3};

use crate::geometry::quantile::quantile;

/// The origin that positions are kept relative to: zero, unless the median of the first finite positions lies further
/// than 10 km from zero along some axis; then that median, in whole metres.
///
/// From 8192 m on single precision has steps of a millimetre and more. The median, since the first point alone may be
/// a far one that stands for "no return": every other point would suffer for it.
pub(super) fn origin_of(positions: impl Iterator<Item = DVec3>) -> DVec3 {
    const MAX_CENTER: f64 = 1e4;
    const MAX_LOOKED_AT: usize = 1024;
    let head: Vec<DVec3> = positions.take(MAX_LOOKED_AT).filter(|position| position.is_finite()).collect();
    if head.is_empty() {
        return DVec3::ZERO;
    }
    let median = |axis: usize| {
        let mut values: Vec<f64> = head.iter().map(|position| position[axis]).collect();
        quantile(&mut values, 0.5).unwrap_or_default()
    };
    let median = DVec3::new(median(0), median(1), median(2));
    // Adding zero turns -0 into 0.
    if median.abs().max_element() > MAX_CENTER { median.round() + DVec3::ZERO } else { DVec3::ZERO }
}

/// What a position loses in single precision (m): nothing where it is not finite.
pub(super) fn rounding_of(position: DVec3) -> Vec3 {
    let rest = (position - position.as_vec3().as_dvec3()).as_vec3();
    if rest.is_finite() { rest } else { Vec3::ZERO }
}

/// None where no position loses anything.
pub(super) fn unless_zero(rest: Vec<Vec3>) -> Option<Vec<Vec3>> {
    rest.iter().any(|&rest| rest != Vec3::ZERO).then_some(rest)
}

/// The normals at unit length, those of no length zero; none when all are zero, as writers fill the columns without
/// having any.
pub(super) fn unit_normals(mut normals: Vec<Vec3>) -> Option<Vec<Vec3>> {
    // What is off by no more than the rounding of six decimals is left as it was written.
    const NORMAL_ROUNDING: f32 = 1e-5;
    for normal in &mut normals {
        if !(1.0 - NORMAL_ROUNDING..=1.0 + NORMAL_ROUNDING).contains(&normal.length_squared()) {
            *normal = normal.as_dvec3().normalize_or_zero().as_vec3();
        }
    }
    (normals.is_empty() || normals.iter().any(|&normal| normal != Vec3::ZERO)).then_some(normals)
}
