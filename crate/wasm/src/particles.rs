//! Monte Carlo localisation for JavaScript.

use tsify::Ts;
use wasm_bindgen::prelude::*;

use crate::localization::Localization;
use crate::thrown::Thrown;
use crate::{from_object, plain};
use scanstitch::odometry::localization::ParticleOptions;
use scanstitch::pipeline::planar::ParticleRun;

#[wasm_bindgen]
extern "C" {
    /// Options that differ from the defaults.
    #[wasm_bindgen(typescript_type = "Partial<ParticleOptions>")]
    pub type PartialParticleOptions;
}

/// A particle filter over the scans of a localisation: call `step_towards(scan)` until it returns false. Call `free()` when it is no longer
/// used.
#[wasm_bindgen]
pub struct ParticleFilter {
    run: ParticleRun,
}

#[wasm_bindgen]
impl ParticleFilter {
    /// Over the scans that have been located, from particles all over the map.
    ///
    /// # Errors
    /// Options out of their limits.
    #[wasm_bindgen(constructor)]
    pub fn new(localization: &Localization, options: Option<PartialParticleOptions>) -> Result<Self, Thrown> {
        let options: ParticleOptions = from_object(options.map(JsValue::from))?;
        Ok(Self { run: localization.run.particle_run(options)? })
    }

    /// What was chosen, and the defaults of the rest.
    ///
    /// # Errors
    /// No input causes an error.
    pub fn options(&self) -> Result<Ts<ParticleOptions>, Thrown> {
        Ok(plain(self.run.filter().options()))
    }

    /// Weighs the next scan on the way to this one, or goes back to an earlier one. False when it is there, or after the last scan.
    pub fn step_towards(&mut self, scan: usize) -> bool {
        self.run.step_towards(scan)
    }

    /// The scan that was weighed last; -1 before the first.
    pub fn last(&self) -> i32 {
        self.run.last().and_then(|last| i32::try_from(last).ok()).unwrap_or(-1)
    }

    /// x, y (m), theta (rad) and weight of each particle: of the robot where the recording says how it carries the laser. The weights sum up
    /// to 1.
    pub fn particles(&self) -> Vec<f32> {
        let values = self.run.particles().flat_map(|particle| {
            let position = particle.T_world_sensor.translation.vector;
            [position.x, position.y, particle.T_world_sensor.rotation.angle(), particle.weight]
        });
        values.map(|value| value as f32).collect()
    }

    /// So many particles of equal weight would say as much: the inverse of the sum of the squared weights.
    pub fn effective_number(&self) -> f64 {
        self.run.filter().effective_number()
    }
}
