//! The cost that a registration minimises: the mean robust loss of a source point.

use std::ops::Range;

use super::factors::Correspondence;
use super::icp::IcpOptions;
use super::robust_kernel::RobustKernel;

/// Sums robust losses. For Cauchy's kernel it takes the logarithm of a product of many terms, since one logarithm per term
/// would take most of the time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LossSum {
    kernel: RobustKernel,
    width: f64,
    limit: f64,
    batch: usize,
}

/// Most terms of a product.
const MAX_BATCH: f64 = 64.0;

impl IcpOptions {
    /// Sums losses of residuals up to the distance limit.
    pub(super) fn losses(&self) -> LossSum {
        let (weighting, limit) = (self.weighting, self.rejection.max_correspondence_distance);
        let largest_term = 1.0 + (limit / weighting.robust_kernel_width).powi(2);
        // Products stay within the range of f64.
        let batch = (f64::MAX.ln() / largest_term.ln()).clamp(1.0, MAX_BATCH) as usize;
        LossSum { kernel: weighting.robust_kernel, width: weighting.robust_kernel_width, limit, batch }
    }
}

impl LossSum {
    /// Number of terms after which [`flush`](Self::flush) must be called.
    pub(super) fn batch(&self) -> usize {
        self.batch
    }

    fn start(&self) -> f64 {
        if self.kernel == RobustKernel::Cauchy { 1.0 } else { 0.0 }
    }

    /// Adds a residual (m).
    #[inline]
    fn add(&self, batch: f64, residual: f64) -> f64 {
        match self.kernel {
            RobustKernel::Cauchy => {
                let u = residual / self.width;
                batch * (1.0 + u * u)
            }
            kernel => batch + kernel.loss(residual, self.width),
        }
    }

    /// Adds a point with the loss of the distance limit.
    #[inline]
    fn charge(&self, batch: f64) -> f64 {
        self.add(batch, self.limit)
    }

    /// The sum of the losses of a batch (m^2).
    fn flush(&self, batch: f64) -> f64 {
        if self.kernel == RobustKernel::Cauchy { self.width * self.width / 2.0 * batch.ln() } else { batch }
    }
}

/// Mean robust loss of a source point (m^2): pairs contribute the loss of their residual, points without a partner or with one
/// whose normal differs too much that of the distance limit; NaN where there is no pair.
///
/// Points that were trimmed and those without a residual are left out of the mean. As long as no pair changes, its derivative for a
/// perturbation on the left of the pose is `b` of the unrestricted normal equations divided by the number of points in the mean.
pub(super) fn cost<P>(
    correspondences: &[Correspondence<P>],
    charged: &[u32],
    num_points: usize,
    options: &IcpOptions,
) -> f64 {
    let num_charged = charged.len() as u32;
    let (mut pairs, mut charged) = (correspondences.iter().peekable(), charged.iter().peekable());
    let losses = options.losses();
    let mut sum = 0.0;
    for first in (0..num_points).step_by(losses.batch()) {
        let mut batch = losses.start();
        for index in first as u32..(first + losses.batch()) as u32 {
            if let Some(pair) = pairs.next_if(|pair| pair.source == index) {
                batch = losses.add(batch, pair.residual);
            } else if charged.next_if(|&&point| point == index).is_some() {
                batch = losses.charge(batch);
            }
        }
        sum += losses.flush(batch);
    }
    mean(sum, correspondences.len() as u32, num_charged)
}

/// Sums of losses for a row of many poses.
pub(super) struct RowSums {
    batches: Vec<f64>,
    sums: Vec<f64>,
    num_pairs: Vec<u32>,
    num_charged: Vec<u32>,
}

impl RowSums {
    pub(super) fn new(count: usize, losses: &LossSum) -> Self {
        Self {
            batches: vec![losses.start(); count],
            sums: vec![0.0; count],
            num_pairs: vec![0; count],
            num_charged: vec![0; count],
        }
    }

    /// Adds a point that has a partner at this range of poses, with its residuals.
    #[inline]
    pub(super) fn add(
        &mut self,
        places: Range<usize>,
        losses: &LossSum,
        mut residual: impl FnMut(usize) -> Option<f64>,
    ) {
        for place in places {
            if let Some(residual) = residual(place) {
                self.batches[place] = losses.add(self.batches[place], residual);
                self.num_pairs[place] += 1;
            }
        }
    }

    /// Adds a point that has the loss of the distance limit at this range of poses.
    #[inline]
    pub(super) fn charge(&mut self, places: Range<usize>, losses: &LossSum) {
        for place in places {
            self.batches[place] = losses.charge(self.batches[place]);
            self.num_charged[place] += 1;
        }
    }

    pub(super) fn flush(&mut self, losses: &LossSum) {
        for (sum, batch) in self.sums.iter_mut().zip(&mut self.batches) {
            *sum += losses.flush(*batch);
            *batch = losses.start();
        }
    }

    pub(super) fn means(&self) -> Vec<f64> {
        let counts = self.num_pairs.iter().zip(&self.num_charged);
        self.sums.iter().zip(counts).map(|(&sum, (&pairs, &charged))| mean(sum, pairs, charged)).collect()
    }
}

fn mean(sum: f64, num_pairs: u32, num_charged: u32) -> f64 {
    if num_pairs == 0 { f64::NAN } else { sum / f64::from(num_pairs + num_charged) }
}
