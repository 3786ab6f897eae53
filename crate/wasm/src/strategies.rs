//! Strategies side by side for JavaScript: which map, which points, which motion, which threshold.

use tsify::Ts;
use wasm_bindgen::prelude::*;

use crate::memory::grow_ahead;
use crate::point_cloud::{MapFormat, map_format};
use crate::spatial::PartialSpatialSettings;
use crate::{from_object, plain};
use scanstitch::error::Error;
use scanstitch::io::{intrinsics, point_cloud, trajectory};
use scanstitch::odometry::voxel::VoxelOdometrySettings;
use scanstitch::pipeline::prepared_frame::PreparedFrame;
use scanstitch::pipeline::settings::{Preset, SettingDescription};
use scanstitch::pipeline::strategies::{
    StrategyComparison as Engine, StrategyFrame, StrategyResult, strategy_descriptions,
};

#[wasm_bindgen]
extern "C" {
    /// Settings of each strategy; those not given have their defaults.
    #[wasm_bindgen(typescript_type = "readonly Partial<VoxelOdometrySettings>[]")]
    pub type PartialStrategies;
}

/// Every setting of a strategy, with its limits and a line of explanation.
///
/// # Errors
/// No input causes an error.
#[wasm_bindgen]
pub fn describe_strategy_settings() -> Result<Vec<Ts<SettingDescription>>, JsValue> {
    Ok(strategy_descriptions().iter().map(plain).collect())
}

/// The strategies of the default comparison.
///
/// # Errors
/// No input causes an error.
#[wasm_bindgen(unchecked_return_type = "Preset<VoxelOdometrySettings>[]")]
pub fn strategy_presets() -> Result<Vec<Ts<Preset<VoxelOdometrySettings>>>, JsValue> {
    Ok(scanstitch::pipeline::strategies::strategy_presets().iter().map(plain).collect())
}

/// A comparison of strategies: `begin` with the first file, `offer` each prepared frame, and `step` every strategy that
/// continues; call `result` at any time. Call `free()` when it is no longer used.
#[wasm_bindgen]
pub struct StrategyComparison {
    engine: Engine,
}

#[wasm_bindgen]
impl StrategyComparison {
    /// A comparison without frames. `settings` define how frames are read, and in `voxel_size` the downsampling before every
    /// strategy.
    ///
    /// # Errors
    /// When a setting is unknown or out of its limits.
    #[wasm_bindgen(constructor)]
    pub fn new(
        strategies: PartialStrategies,
        settings: Option<PartialSpatialSettings>,
    ) -> Result<StrategyComparison, JsValue> {
        let strategies: Vec<VoxelOdometrySettings> = from_object(Some(strategies.into()))?;
        let engine = Engine::new(strategies, from_object(settings.map(JsValue::from))?);
        Ok(Self { engine: engine? })
    }

    /// Reads the camera from a file beside the images, unless the settings have one. Before `begin`.
    ///
    /// # Errors
    /// When the file holds no camera, and after `begin`.
    pub fn set_intrinsics(&mut self, name: &str, bytes: &[u8]) -> Result<(), JsValue> {
        let camera = intrinsics::read(bytes).map_err(|error| error.in_file(name))?;
        Ok(self.engine.set_intrinsics(camera)?)
    }

    /// Reads the first file and returns the configuration for `prepare_frame` and `prepare_cloud`.
    ///
    /// # Errors
    /// When it is neither a depth image nor a cloud, holds nothing, or the settings make no camera.
    pub fn begin(&mut self, name: &str, first_frame: &[u8]) -> Result<String, JsValue> {
        let decode_config = self.engine.begin(name, first_frame)?;
        Ok(serde_json::to_string(decode_config).unwrap_or_default())
    }

    /// Offers the next frame to every strategy. Frames must be in the order of the recording; gaps are allowed.
    ///
    /// # Errors
    /// When the bytes are no prepared frame, or the frame comes before the last one.
    pub fn offer(&mut self, prepared: &[u8]) -> Result<(), JsValue> {
        let frame = PreparedFrame::from_bytes(prepared);
        Ok(frame.and_then(|frame| self.engine.offer(frame))?)
    }

    /// Registers the offered frame by one strategy, counted from 0; this is the step to be timed.
    ///
    /// # Errors
    /// Where there is no such strategy, or it has placed that frame.
    pub fn step(&mut self, strategy: usize) -> Result<Ts<StrategyFrame>, JsValue> {
        grow_ahead();
        let frame = self.engine.step(strategy).ok_or_else(|| {
            let problem = format!("Strategy {strategy} has no frame to place");
            Error::whole(problem, "Offer a frame, then step each strategy once")
        })?;
        Ok(plain(frame))
    }

    /// Sets the trajectory to compare with, in any form that is read. It is used for nothing else. `num_recorded` is the
    /// number of frames of the recording, whether they could be used or not.
    ///
    /// # Errors
    /// When the file is no trajectory.
    pub fn set_reference(&mut self, name: &str, bytes: &[u8], num_recorded: usize) -> Result<(), JsValue> {
        let contents = trajectory::read_lenient(bytes, None).map_err(|error| error.in_file(name))?;
        self.engine.set_reference(name, contents, num_recorded);
        Ok(())
    }

    /// The result of a strategy so far; `milliseconds` are the times of its frames as measured by the caller, or none.
    ///
    /// # Errors
    /// Where there is no such strategy.
    pub fn result(&self, strategy: usize, milliseconds: &[f64]) -> Result<Ts<StrategyResult>, JsValue> {
        Ok(plain(&self.engine.result(strategy, milliseconds).ok_or_else(|| no_strategy(strategy))?))
    }

    /// The map of a strategy as a file of this format.
    ///
    /// # Errors
    /// Where there is no such strategy or format.
    pub fn map_file(&self, strategy: usize, format: &MapFormat) -> Result<Vec<u8>, JsValue> {
        let map = self.engine.map(strategy).ok_or_else(|| no_strategy(strategy))?;
        Ok(point_cloud::write(&map, map_format(format)?))
    }

    /// The trajectory of a strategy in TUM's format: time or number of the frame, x y z qx qy qz qw, one line per frame.
    ///
    /// # Errors
    /// Where there is no such strategy.
    pub fn trajectory_tum(&self, strategy: usize) -> Result<String, JsValue> {
        let (times, poses) = self.engine.trajectory(strategy).ok_or_else(|| no_strategy(strategy))?;
        Ok(trajectory::tum_text(times.as_deref(), &poses))
    }
}

fn no_strategy(strategy: usize) -> JsValue {
    JsValue::from(Error::whole(format!("There is no strategy {strategy}"), "Strategies are counted from 0"))
}
