//! Bindings for JavaScript.

use wasm_bindgen::prelude::*;

/// A scan of an E57 file.
#[wasm_bindgen(getter_with_clone)]
pub struct E57Scan {
    /// x y z, point by point (m), in the frame of the scanner.
    pub positions: Vec<f64>,
    /// Red, green, blue, point by point; empty where the scan has none.
    pub colors: Vec<u8>,
    /// Points without coordinates, which are left out.
    pub num_invalid: usize,
}

/// The scans of an E57 file.
///
/// # Errors
/// When the file is damaged.
#[wasm_bindgen]
pub fn read_e57(bytes: &[u8]) -> Result<Vec<E57Scan>, JsError> {
    let scans = crate::read_e57(bytes).map_err(|error| JsError::new(&error))?;
    let scan = |crate::Scan { positions, colors, num_invalid }| E57Scan { positions, colors, num_invalid };
    Ok(scans.into_iter().map(scan).collect())
}

/// The LAS that a LAZ was packed from.
///
/// # Errors
/// When it is no LAZ, or damaged before its first point.
#[wasm_bindgen]
pub fn unpack_laz(bytes: &[u8]) -> Result<Vec<u8>, JsError> {
    crate::unpack_laz(bytes).map_err(|error| JsError::new(&error))
}
