//! Robust kernels: the weight of a correspondence as a function of its residual.
//!
//! Each is an M-estimator with the loss rho(r), used by iteratively reweighted least squares with the weight
//! w(r) = rho'(r) / r. Sources: Zhang, "Parameter estimation techniques: a tutorial with application to conic
//! fitting", Image and Vision Computing 15 (1997), table 1; Geman-McClure in the form of Zhou, Park and Koltun,
//! "Fast global registration", ECCV 2016, eq. 4.

use serde::{Deserialize, Serialize};

/// A robust kernel without its width.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum RobustKernel {
    /// Least squares: every correspondence has the same weight.
    None,
    /// Quadratic within the width, linear beyond: the influence of large residuals is constant.
    Huber,
    /// Logarithmic: the influence of large residuals decreases.
    Cauchy,
    /// Bounded: the influence of large residuals tends to zero.
    GemanMcclure,
    /// Bounded: residuals beyond the width have no influence.
    Tukey,
}

impl RobustKernel {
    /// The weight of a residual; 1 at zero, never above. `width` has the unit of the residual and is positive.
    pub fn weight(self, residual: f64, width: f64) -> f64 {
        let u = residual.abs() / width;
        match self {
            Self::None => 1.0,
            Self::Huber => {
                if u <= 1.0 {
                    1.0
                } else {
                    1.0 / u
                }
            }
            Self::Cauchy => 1.0 / (1.0 + u * u),
            Self::GemanMcclure => (1.0 + u * u).powi(-2),
            Self::Tukey => {
                if u <= 1.0 {
                    (1.0 - u * u).powi(2)
                } else {
                    0.0
                }
            }
        }
    }

    /// The loss rho(r) that the weights derive from, in the square of the residual's unit.
    pub fn loss(self, residual: f64, width: f64) -> f64 {
        let u = residual.abs() / width;
        match self {
            Self::None => residual * residual / 2.0,
            Self::Huber if u <= 1.0 => residual * residual / 2.0,
            Self::Huber => width * (residual.abs() - width / 2.0),
            Self::Cauchy => width * width / 2.0 * (1.0 + u * u).ln(),
            Self::GemanMcclure => residual * residual / 2.0 / (1.0 + u * u),
            Self::Tukey => width * width / 6.0 * (1.0 - (1.0 - u.min(1.0).powi(2)).powi(3)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weight_is_the_derivative_of_the_loss_over_the_residual() {
        use RobustKernel::{Cauchy, GemanMcclure, Huber, None, Tukey};
        let h = 1e-6;
        for kernel in [None, Huber, Cauchy, GemanMcclure, Tukey] {
            assert_eq!(kernel.weight(0.0, 0.1), 1.0);
            for r in [-0.35, -0.05, 0.02, 0.0999, 0.13, 0.9] {
                let derivative = (kernel.loss(r + h, 0.1) - kernel.loss(r - h, 0.1)) / (2.0 * h);
                assert!((kernel.weight(r, 0.1) - derivative / r).abs() < 1e-6, "{kernel:?} at {r}");
            }
        }
    }
}
