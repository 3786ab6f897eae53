//! The ICP lab for JavaScript: iterations with their pairs, landscapes and basins as typed arrays.

use js_sys::{Float64Array, Int16Array, Object, Reflect, Uint8Array, Uint16Array, Uint32Array};
use tsify::Ts;
use wasm_bindgen::prelude::*;

use crate::memory::grow_ahead;
use crate::point_cloud::PartialRegistrationOptions;
use crate::{PointCloud, from_object, plain};
use scanstitch::error::Error;
use scanstitch::registration::correlative::{SearchWindow, SearchedBlock};
use scanstitch::registration::icp::EndReason;
use scanstitch::registration::lab::basin::{Ends, Minimum};
use scanstitch::registration::lab::grid::GridOptions;
use scanstitch::registration::lab::iteration::TracedIteration;
use scanstitch::registration::lab::landscape::{self, LocalMinimum};
use scanstitch::registration::lab::{IcpLab as Engine, IcpTrace};

#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = "
/** One iteration of the loop with its pairs. */
export interface IcpIteration extends IterationSummary {
  /** Indices of the source points of the pairs. */
  source: Uint32Array<ArrayBuffer>;
  /** Indices of their partners. */
  target: Uint32Array<ArrayBuffer>;
  /** Residuals (m). */
  residual: Float64Array<ArrayBuffer>;
  /** Weights, 0 to 1. */
  weight: Float64Array<ArrayBuffer>;
  /** What each pair contributes to the smallest share of `degeneracy`: they sum up to it. Empty where that is null. */
  contribution: Float64Array<ArrayBuffer>;
  /** Indices of the source points that were rejected. */
  rejected_source: Uint32Array<ArrayBuffer>;
  /** Their nearest target points; 2^32 - 1 where none is within the distance limit. */
  rejected_target: Uint32Array<ArrayBuffer>;
  /** 0: no target point within the limit; 1: normals; 2: trimmed; 3: the target point has no normal to measure along. */
  rejected_reason: Uint8Array<ArrayBuffer>;
}

/** Where registrations ended, in the order of their starts: along a row, row by row, layer by layer. */
export interface BasinEnds {
  /** 16 numbers an end: 4 x 4, row by row. */
  T_target_source: Float64Array<ArrayBuffer>;
  /** 0: converged; 1: cycle; 2: iterations used up; 3: no step. */
  end_reason: Uint8Array<ArrayBuffer>;
  iterations: Uint16Array<ArrayBuffer>;
  /** Mean robust loss of each end (m^2). */
  cost: Float64Array<ArrayBuffer>;
}

/** Ends grouped by minimum. */
export interface BasinLabels {
  /** Of each start: 0 for the minimum of the reference, 1 and on for the others in the order of `minima`, -1 where the loop did
   * not come to rest. */
  labels: Int16Array<ArrayBuffer>;
  /** The reference's first, the others by the number of starts that end there. */
  minima: Minimum[];
  /** Share of all starts that end in the minimum of the reference. */
  share_home: number;
}
";

#[wasm_bindgen]
extern "C" {
    /// An iteration as a plain object.
    #[wasm_bindgen(typescript_type = "IcpIteration")]
    pub type IcpIteration;
    /// A grid of poses.
    #[wasm_bindgen(typescript_type = "GridOptions")]
    pub type GridObject;
    /// Results of registrations.
    #[wasm_bindgen(typescript_type = "BasinEnds")]
    pub type BasinEnds;
    /// Results grouped by minimum.
    #[wasm_bindgen(typescript_type = "BasinLabels")]
    pub type BasinLabels;
}

/// Two clouds prepared with the options of a registration, for analysis. Call `free()` when it is no longer used.
#[wasm_bindgen]
pub struct IcpLab {
    engine: Engine,
}

#[wasm_bindgen]
impl IcpLab {
    /// Prepares two clouds, as `register` does.
    ///
    /// # Errors
    /// As those of `register`.
    #[wasm_bindgen(constructor)]
    pub fn new(
        source: &PointCloud,
        target: &PointCloud,
        options: Option<PartialRegistrationOptions>,
    ) -> Result<IcpLab, JsValue> {
        let options = from_object(options.map(JsValue::from))?;
        let engine = Engine::new(&source.cloud, &target.cloud, &options)?;
        Ok(Self { engine })
    }

    /// Whether the clouds are registered in the plane, with three unknowns (theta, x, y); six (wx, wy, wz, x, y, z) otherwise.
    #[wasm_bindgen(getter)]
    pub fn is_planar(&self) -> bool {
        self.engine.is_planar()
    }

    /// The target's origin (m), to which points and tangent vectors are relative. Zero except for map coordinates.
    pub fn origin(&self) -> Vec<f64> {
        self.engine.origin().to_vec()
    }

    /// The pose at which a registration starts, 4 x 4, row by row: the guess of the options, or the result of their search.
    ///
    /// # Errors
    /// When it is not finite.
    pub fn initial(&self) -> Result<Vec<f64>, JsValue> {
        Ok(self.engine.initial()?.to_vec())
    }

    /// The source's points as the loop uses them, x y z x y z ... (m), in its own frame.
    pub fn source_points(&self) -> Vec<f64> {
        self.engine.source_points()
    }

    /// The target's points as the loop uses them, x y z x y z ... (m); for `vgicp` its voxels.
    pub fn target_points(&self) -> Vec<f64> {
        self.engine.target_points().positions
    }

    /// The unit normals of the target's points; NaN where one has none.
    pub fn target_normals(&self) -> Vec<f64> {
        self.engine.target_points().normals
    }

    /// Runs the loop from a pose (16 numbers), or from `initial()`.
    ///
    /// # Errors
    /// When the pose is not a rigid motion.
    pub fn trace(&mut self, init_T_target_source: Option<Vec<f64>>) -> Result<Ts<IcpTrace>, JsValue> {
        let init = init_T_target_source.map(|rows| pose(&rows)).transpose()?;
        Ok(plain(&self.engine.trace(init.as_ref())?))
    }

    /// The iteration that the loop would do at a pose (16 numbers); with a `stride`, from every `stride`-th source point only, for
    /// large clouds that are dragged by hand.
    ///
    /// # Errors
    /// When the pose is not a rigid motion, or the stride is 0.
    pub fn iteration(&self, T_target_source: &[f64], stride: Option<usize>) -> Result<IcpIteration, JsValue> {
        let of = self.engine.sampled_iteration(&pose(T_target_source)?, stride.unwrap_or(1));
        Ok(iteration(&of?))
    }

    /// Iteration `index` of the last `trace()`, from the unrounded pose of the loop; one past the last is the iteration that would
    /// follow.
    ///
    /// # Errors
    /// When there is no such iteration.
    pub fn traced_iteration(&self, index: usize) -> Result<IcpIteration, JsValue> {
        Ok(iteration(&self.engine.traced_iteration(index)?))
    }

    /// The pose at offsets from a centre, one per unknown: the source is rotated about its own origin around the target's axes, and
    /// translated along them. These are the coordinates of landscapes and basins.
    ///
    /// # Errors
    /// When the centre is not a rigid motion, or there are not as many offsets as unknowns.
    pub fn pose_at(&self, T_center: &[f64], offsets: &[f64]) -> Result<Vec<f64>, JsValue> {
        Ok(self.engine.pose_at(&pose(T_center)?, offsets)?.to_vec())
    }

    /// The offsets of a pose from a centre.
    ///
    /// # Errors
    /// When one of them is not a rigid motion.
    pub fn offsets(&self, T_center: &[f64], T_target_source: &[f64]) -> Result<Vec<f64>, JsValue> {
        Ok(self.engine.offsets(&pose(T_center)?, &pose(T_target_source)?)?)
    }

    /// The cost (m^2) at every node of a grid over two unknowns, row by row, with the pairs searched at each: the mean robust loss
    /// of a source point. A point without a partner, or whose partner's normal differs too much, has the loss of the distance
    /// limit; NaN where there is no pair.
    ///
    /// # Errors
    /// When the grid does not fit.
    pub fn cost_landscape(&self, grid: GridObject) -> Result<Vec<f64>, JsValue> {
        Ok(self.engine.cost_landscape(&grid_options(grid)?)?)
    }

    /// The results of registrations that start at every node of a grid over one to three unknowns.
    ///
    /// # Errors
    /// When the grid does not fit.
    pub fn basin_of_attraction(&self, grid: GridObject) -> Result<BasinEnds, JsValue> {
        grow_ahead();
        let ends = self.engine.basin_of_attraction(&grid_options(grid)?)?;
        let object = Object::new();
        let reasons: Vec<u8> = ends.end_reason.iter().map(|reason| *reason as u8).collect();
        set(&object, "T_target_source", &Float64Array::from(ends.T_target_source.as_flattened()));
        set(&object, "end_reason", &Uint8Array::from(reasons.as_slice()));
        set(&object, "iterations", &Uint16Array::from(ends.iterations.as_slice()));
        set(&object, "cost", &Float64Array::from(ends.cost.as_slice()));
        Ok(object.unchecked_into())
    }

    /// Planar clouds: the blocks of the pyramid that the correlative search evaluates around a centre, within half widths in x and
    /// y (m) and in rotation (rad).
    ///
    /// # Errors
    /// When the clouds are in space, the centre is not a rigid motion, or the window is too wide.
    pub fn search_path(
        &self,
        T_center: &[f64],
        translation: f64,
        rotation: f64,
    ) -> Result<Vec<Ts<SearchedBlock>>, JsValue> {
        let window = SearchWindow { translation, rotation };
        let path = self.engine.search_path(&pose(T_center)?, window)?;
        Ok(path.iter().map(plain).collect())
    }

    /// Groups results of registrations by minimum; `reference` (16 numbers) is a pose in the basin of the minimum that is taken as
    /// right. Results of several workers are concatenated first.
    ///
    /// # Errors
    /// When a pose is not a rigid motion.
    pub fn label_ends(&self, ends: &BasinEnds, reference: &[f64]) -> Result<BasinLabels, JsValue> {
        let ends = ends_from(ends)?;
        let basin = self.engine.label_ends(&ends, &pose(reference)?)?;
        let object = Object::new();
        let minima: Vec<Ts<Minimum>> = basin.minima.iter().map(plain).collect();
        set(&object, "labels", &Int16Array::from(basin.labels.as_slice()));
        set(&object, "minima", &minima.into_iter().map(JsValue::from).collect::<js_sys::Array>());
        set(&object, "share_home", &basin.share_home.into());
        Ok(object.unchecked_into())
    }
}

/// All local minima of a landscape of `width` nodes a row, the most prominent first; nodes that are NaN are left out.
///
/// # Errors
/// When the costs are not whole rows of `width` nodes.
#[wasm_bindgen]
pub fn local_minima(costs: &[f64], width: usize) -> Result<Vec<Ts<LocalMinimum>>, JsValue> {
    if width == 0 || !costs.len().is_multiple_of(width) {
        let problem = format!("{} costs are not rows of {width} nodes", costs.len());
        return Err(Error::whole(problem, "Give the number of nodes in a row of the landscape").into());
    }
    Ok(landscape::local_minima(costs, width).iter().map(plain).collect())
}

fn grid_options(grid: GridObject) -> Result<GridOptions, JsValue> {
    let grid: Option<GridOptions> = from_object(Some(grid.into()))?;
    Ok(grid.ok_or_else(|| Error::whole("No grid was given", "Give T_center, axes, half_widths and size"))?)
}

fn pose(rows: &[f64]) -> Result<[f64; 16], JsValue> {
    rows.try_into().map_err(|_| {
        let problem = format!("A pose of {} numbers", rows.len());
        JsValue::from(Error::whole(problem, "Give 16 numbers, row by row"))
    })
}

fn iteration(traced: &TracedIteration) -> IcpIteration {
    let object: Object = JsValue::from(plain(&traced.summary)).unchecked_into();
    set(&object, "source", &Uint32Array::from(traced.source.as_slice()));
    set(&object, "target", &Uint32Array::from(traced.target.as_slice()));
    set(&object, "residual", &Float64Array::from(traced.residual.as_slice()));
    set(&object, "weight", &Float64Array::from(traced.weight.as_slice()));
    set(&object, "contribution", &Float64Array::from(traced.contribution.as_slice()));
    set(&object, "rejected_source", &Uint32Array::from(traced.rejected_source.as_slice()));
    set(&object, "rejected_target", &Uint32Array::from(traced.rejected_target.as_slice()));
    set(&object, "rejected_reason", &Uint8Array::from(traced.rejected_reason.as_slice()));
    object.unchecked_into()
}

fn ends_from(object: &BasinEnds) -> Result<Ends, JsValue> {
    let field = |name: &str| Reflect::get(object, &JsValue::from_str(name));
    let poses = Float64Array::new(&field("T_target_source")?).to_vec();
    let reasons = Uint8Array::new(&field("end_reason")?).to_vec();
    let (iterations, cost) = (Uint16Array::new(&field("iterations")?), Float64Array::new(&field("cost")?));
    let count = reasons.len();
    if poses.len() != 16 * count || iterations.length() as usize != count || cost.length() as usize != count {
        return Err(Error::whole("The ends' arrays do not fit together", "Give 16 numbers a pose").into());
    }
    Ok(Ends {
        T_target_source: poses.as_chunks::<16>().0.to_vec(),
        end_reason: reasons.into_iter().map(end_reason).collect(),
        iterations: iterations.to_vec(),
        cost: cost.to_vec(),
    })
}

fn end_reason(number: u8) -> EndReason {
    match number {
        0 => EndReason::Converged,
        1 => EndReason::Cycle,
        2 => EndReason::MaxIterations,
        _ => EndReason::NoStep,
    }
}

/// Setting a field of a fresh object cannot fail.
fn set(object: &Object, name: &str, value: &JsValue) {
    let _ = Reflect::set(object, &JsValue::from_str(name), value);
}
