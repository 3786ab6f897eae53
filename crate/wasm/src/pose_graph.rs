//! Pose graphs of files for JavaScript.

use tsify::Ts;
use wasm_bindgen::prelude::*;

use crate::{from_object, plain};
use scanstitch::graph::optimize::report::{GraphReport, optimize_graph};
use scanstitch::io::pose_graph::{self, AnyPoseGraph};

#[wasm_bindgen]
extern "C" {
    /// Any subset of the options; missing ones have their default values.
    #[wasm_bindgen(typescript_type = "Partial<GraphOptions>")]
    pub type PartialGraphOptions;
}

/// Poses and measured motions between them: a g2o or TORO file. Call `free()` when it is no longer used.
#[wasm_bindgen]
pub struct PoseGraph {
    graph: AnyPoseGraph,
}

#[wasm_bindgen]
impl PoseGraph {
    /// Reads a file. `name` is for the messages.
    ///
    /// # Errors
    /// When the file is not a pose graph; the error names the line.
    pub fn read(bytes: &[u8], name: &str) -> Result<PoseGraph, JsValue> {
        let graph = pose_graph::read(bytes).map_err(|error| error.in_file(name))?;
        Ok(Self { graph })
    }

    /// Moves the poses to where the measured motions fit best; tells how well they do.
    ///
    /// # Errors
    /// When the options are not valid.
    pub fn optimize(&mut self, options: Option<PartialGraphOptions>) -> Result<Ts<GraphReport>, JsValue> {
        let options = from_object(options.map(JsValue::from))?;
        Ok(plain(&optimize_graph(&mut self.graph, &options)))
    }

    /// The graph as a g2o file.
    pub fn to_g2o(&self) -> String {
        self.graph.to_g2o()
    }

    /// The poses, x y z qx qy qz qw of one after the other in the order of their nodes (m).
    pub fn poses(&self) -> Vec<f64> {
        self.graph.poses_in_space().iter().flat_map(flat).collect()
    }
}

fn flat(pose: &scanstitch::geometry::Pose3) -> [f64; 7] {
    let (t, q) = (pose.translation.vector, pose.rotation.coords);
    [t.x, t.y, t.z, q.x, q.y, q.z, q.w]
}
