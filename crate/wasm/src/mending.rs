//! Mending a map by hand for JavaScript.

use tsify::Ts;
use wasm_bindgen::prelude::*;

use crate::thrown::Thrown;

use crate::{Reconstruction, from_object, plain};
use scanstitch::pipeline::planar::{Consequence, Edit, GraphLoops, PlacedPlan, RefusedEdit, ScanAt};

#[wasm_bindgen]
extern "C" {
    /// Steps of mending, in their order.
    #[wasm_bindgen(typescript_type = "readonly Edit[]")]
    pub type Edits;
}

pub(crate) fn edits(list: Edits) -> Result<Vec<Edit>, Thrown> {
    from_object(Some(list.into()))
}

#[wasm_bindgen]
impl Reconstruction {
    /// The loops of the map's graph.
    ///
    /// # Errors
    /// When the run is not done or the map has no graph.
    pub fn graph_loops(&mut self) -> Result<Ts<GraphLoops>, Thrown> {
        Ok(plain(&self.engine.graph_loops()?))
    }

    /// The scans with beams that end in the square cell around a place of the map or pass through it, by their numbers. `x`, `y` and the
    /// `side` of the cell in m.
    ///
    /// # Errors
    /// No input causes an error.
    #[wasm_bindgen(unchecked_return_type = "ScanAt[]")]
    pub fn scans_at(&self, x: f64, y: f64, side: f64) -> Result<Vec<Ts<ScanAt>>, Thrown> {
        Ok(self.engine.scans_at([x, y], side).iter().map(plain).collect())
    }

    /// The map's graph as a g2o file: nodes are scans, counted from 0. Undefined where there is no graph, as before the scans are registered.
    pub fn graph_g2o(&self) -> Option<String> {
        self.engine.graph_g2o()
    }

    /// What the last of these steps, one about a loop, would change after those before it. The map stays as it is.
    ///
    /// # Errors
    /// When the run is not done, the map has no graph, or a step is not valid.
    pub fn preview_edit(&mut self, steps: Edits) -> Result<Ts<Consequence>, Thrown> {
        Ok(plain(&self.engine.preview_edit(&edits(steps)?)?))
    }

    /// Takes these steps, and none that were taken before. Call `step()` then until its stage is `done`. Returns the steps about loops
    /// that were not taken, with the reason; `unused_edits()` tells the others.
    ///
    /// # Errors
    /// When the run is not done, a step is about loops and the map has no graph, or a step is not valid; all stays as it is.
    #[wasm_bindgen(unchecked_return_type = "RefusedEdit[]")]
    pub fn set_edits(&mut self, steps: Edits) -> Result<Vec<Ts<RefusedEdit>>, Thrown> {
        Ok(self.engine.set_edits(&edits(steps)?)?.iter().map(plain).collect())
    }

    /// The steps of a run that is done which had no effect on the map or its grid, with the reason: those that lie outside.
    ///
    /// # Errors
    /// No input causes an error.
    #[wasm_bindgen(unchecked_return_type = "RefusedEdit[]")]
    pub fn unused_edits(&self) -> Result<Vec<Ts<RefusedEdit>>, Thrown> {
        Ok(self.engine.unused_edits().iter().map(plain).collect())
    }

    /// The building plan that steps have laid behind the map; undefined where there is none.
    ///
    /// # Errors
    /// No input causes an error.
    pub fn plan(&self) -> Result<Option<Ts<PlacedPlan>>, Thrown> {
        Ok(self.engine.plan().map(plain))
    }

    /// Where a step `lay_plan` would lay its picture in the map as it is, how far its points are off, and whether they fit each other.
    ///
    /// # Errors
    /// When it is another step, or not valid.
    pub fn preview_plan(&self, steps: Edits) -> Result<Option<Ts<PlacedPlan>>, Thrown> {
        let placed = edits(steps)?.last().map(scanstitch::pipeline::planar::Reconstruction::preview_plan);
        Ok(placed.transpose()?.flatten().as_ref().map(plain))
    }
}
