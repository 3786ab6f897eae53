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

/// Unpacks what bzip2 has packed, piece by piece.
#[wasm_bindgen]
#[derive(Default)]
pub struct Bzip2 {
    inner: crate::bzip2::Unpacker,
}

#[wasm_bindgen]
impl Bzip2 {
    /// Waits for the first piece.
    #[wasm_bindgen(constructor)]
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// What comes out of the next packed bytes. Where that is more than `most` bytes, it ends soon after them.
    ///
    /// # Errors
    /// When the bytes are damaged or are not packed by bzip2.
    pub fn push(&mut self, packed: &[u8], most: usize) -> Result<Vec<u8>, JsError> {
        self.inner.push(packed, most).map_err(|error| JsError::new(&error))
    }

    /// Whether what has come ends where a stream ends.
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.inner.is_complete()
    }
}
