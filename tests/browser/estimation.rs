//! What depends on the platform's own arithmetic: sines, cosines and their inverses are a library of its own there.

use nalgebra::Vector3;
use scanstitch::geometry::{Pose2, RigidMotion};
use wasm_bindgen_test::wasm_bindgen_test;

#[wasm_bindgen_test]
fn planar_poses_come_back_from_the_logarithm() {
    for theta in [-3.1, -1.0, -1e-9, 0.0, 1e-4, 0.5, 3.1] {
        let tangent = Vector3::new(theta, 1.5, -20.0);
        let error = (Pose2::exp(&tangent).log() - tangent).norm();
        assert!(error < 1e-10, "theta {theta}: off by {error}");
    }
}
