//! Poses on a grid over some of the unknowns.

use std::ops::{Range, RangeInclusive};

use serde::{Deserialize, Serialize};

use super::motion::LabMotion;
use crate::error::{Error, Result};
use crate::geometry::{Pose3, Vector};

/// A grid of poses around a centre.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct GridOptions {
    /// The pose at the centre: 4 x 4, row by row.
    pub T_center: [f64; 16],
    /// The unknowns that vary, as indices into (theta, x, y) for planar clouds and into (wx, wy, wz, x, y, z) otherwise: the
    /// first along a row, the second from row to row, the third from layer to layer.
    pub axes: Vec<usize>,
    /// Half width of the grid along each (rad, m).
    pub half_widths: Vec<f64>,
    /// Number of nodes along each; of an odd number, one is at the centre.
    pub size: Vec<usize>,
    /// Rows to compute, from the first to before the second, counted through all layers, so that workers can share a grid; null
    /// is all.
    #[serde(default)]
    pub rows: Option<[usize; 2]>,
    /// Stride of the source points that are used; 1 is all. Larger values make large clouds faster.
    #[serde(default = "all")]
    pub stride: usize,
}

const fn all() -> usize {
    1
}

/// Most nodes of a grid.
const MAX_NODES: usize = 1 << 24;

/// A checked grid, its centre relative to the problem's origin.
pub struct Grid<M: LabMotion> {
    center: M,
    axes: Vec<usize>,
    half_widths: Vec<f64>,
    size: Vec<usize>,
    rows: Range<usize>,
}

/// Refuses a stride of 0.
pub(super) fn check_stride(stride: usize) -> Result<()> {
    if stride > 0 {
        return Ok(());
    }
    Err(Error::whole("stride must be at least 1", "Give 1 for all points, 2 for every second one"))
}

impl<M: LabMotion> Grid<M> {
    /// Checks a grid over a number of unknowns within `num_axes`.
    pub(super) fn new(center: &Pose3, options: &GridOptions, num_axes: RangeInclusive<usize>) -> Result<Self> {
        let GridOptions { axes, half_widths, size, rows, .. } = options.clone();
        let fail = |problem: &str, remedy: String| Err(Error::whole(problem, remedy));
        let count = axes.len();
        if !num_axes.contains(&count) || half_widths.len() != count || size.len() != count {
            let (least, most) = num_axes.into_inner();
            let remedy =
                if least == most { format!("Give {most} of each") } else { format!("Give {least} to {most} of each") };
            return fail("axes, half_widths and size of a grid do not fit together", remedy);
        }
        let repeated = (1..count).any(|i| axes[..i].contains(&axes[i]));
        if repeated || axes.iter().any(|&axis| axis >= M::Tangent::LEN) {
            let remedy = format!("Give different indices below {}", M::Tangent::LEN);
            return fail(&format!("axes = {axes:?} repeats an unknown or names one that does not exist"), remedy);
        }
        if !half_widths.iter().all(|width| width.is_finite() && *width >= 0.0) {
            return fail(
                "A half width of a grid is negative or not finite",
                "Give finite numbers from 0 (rad, m)".into(),
            );
        }
        check_stride(options.stride)?;
        let num_nodes = size.iter().try_fold(1usize, |product, &n| product.checked_mul(n).filter(|_| n > 0));
        if num_nodes.is_none_or(|count| count > MAX_NODES) {
            return fail(&format!("A grid cannot have {size:?} nodes"), format!("Give 1 to {MAX_NODES} nodes in all"));
        }
        let num_rows: usize = size[1..].iter().product();
        let [from, to] = rows.unwrap_or([0, num_rows]);
        if from > to || to > num_rows {
            return fail(&format!("rows {from} to {to} are not in the grid"), format!("It has {num_rows}"));
        }
        Ok(Self { center: M::from_space(center), axes, half_widths, size, rows: from..to })
    }

    /// The rows to compute.
    pub(super) fn rows(&self) -> Range<usize> {
        self.rows.clone()
    }

    /// Nodes of a row.
    pub(super) fn width(&self) -> usize {
        self.size[0]
    }

    /// Whether the poses along one of the axes differ by their translation only.
    pub(super) fn moves_along(&self, nth: usize) -> bool {
        self.axes[nth] >= M::Tangent::LEN - M::Point::LEN
    }

    /// The pose of a node.
    pub(super) fn pose(&self, row: usize, column: usize) -> M {
        let mut offsets = M::Tangent::zeros();
        let mut index = row;
        for (nth, &axis) in self.axes.iter().enumerate() {
            let at = if nth == 0 { column } else { index % self.size[nth] };
            if nth > 0 {
                index /= self.size[nth];
            }
            offsets[axis] = self.offset(nth, at);
        }
        self.center.offset(&offsets)
    }

    /// The offset of a node along one of the axes: 0 in the middle of an odd number of nodes.
    pub(super) fn offset(&self, nth: usize, at: usize) -> f64 {
        let steps = self.size[nth] - 1;
        if steps == 0 {
            return 0.0;
        }
        self.half_widths[nth] * (2.0 * at as f64 - steps as f64) / steps as f64
    }
}
