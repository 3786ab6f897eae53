//! Clouds for JavaScript, and the registration of two.

use tsify::Ts;
use wasm_bindgen::prelude::*;

use crate::{from_object, plain, read_ply};
use scanstitch::error::Error;
use scanstitch::geometry::PointCloud as Cloud;
use scanstitch::io::ply;
use scanstitch::io::point_cloud::CloudFormat;
use scanstitch::registration::align::{RegistrationOptions, RegistrationResult, register_clouds};

#[wasm_bindgen]
extern "C" {
    /// Any subset of the options; missing ones have their default values.
    #[wasm_bindgen(typescript_type = "Partial<RegistrationOptions>")]
    pub type PartialRegistrationOptions;
    /// Encoding of a PLY file.
    #[wasm_bindgen(typescript_type = "'ascii' | 'binary_little_endian'")]
    pub type PlyFormat;
    /// A format of clouds: PLY or PCD, as text or binary; `ply` and `pcd` are the binary ones.
    #[wasm_bindgen(
        typescript_type = "'ply' | 'ply_ascii' | 'ply_binary' | 'pcd' | 'pcd_ascii' | 'pcd_binary' | 'pcd_binary_compressed'"
    )]
    pub type MapFormat;
}

pub(crate) fn map_format(format: &MapFormat) -> Result<CloudFormat, JsValue> {
    let name = JsValue::from(format).as_string().unwrap_or_default();
    Ok(CloudFormat::named(&name)?)
}

/// Points in metres, with normals and colours where the file has them. Call `free()` when it is no longer used.
#[wasm_bindgen]
pub struct PointCloud {
    pub(crate) cloud: Cloud,
}

#[wasm_bindgen]
impl PointCloud {
    /// Reads a PLY file; `name` is for the messages.
    ///
    /// # Errors
    /// When the file is not a valid PLY file.
    pub fn from_ply(bytes: &[u8], name: &str) -> Result<PointCloud, JsValue> {
        Ok(Self { cloud: read_ply(name, bytes)? })
    }

    /// From x y z x y z ... (m), with a unit normal of each point where they are known (NaN for a point without one).
    ///
    /// # Errors
    /// When the length is not a multiple of three, or the numbers of normals and points differ.
    pub fn from_positions(xyz: &[f32], normals: Option<Vec<f32>>) -> Result<PointCloud, JsValue> {
        if !xyz.len().is_multiple_of(3) {
            let problem = format!("{} numbers are not a multiple of three", xyz.len());
            return Err(Error::whole(problem, "Give x, y and z of every point").into());
        }
        if let Some(normals) = normals.as_ref().filter(|normals| normals.len() != xyz.len()) {
            let problem = format!("{} numbers of normals for {} of positions", normals.len(), xyz.len());
            return Err(Error::whole(problem, "Give x, y and z of every normal, or none").into());
        }
        let vectors = |xyz: &[f32]| xyz.chunks_exact(3).map(glam::Vec3::from_slice).collect();
        let normals = normals.map(|normals| vectors(&normals));
        Ok(Self { cloud: Cloud { normals, ..Cloud::from_positions(vectors(xyz)) } })
    }

    /// Number of points.
    #[wasm_bindgen(getter)]
    pub fn length(&self) -> usize {
        self.cloud.len()
    }

    /// Whether all points lie in the plane z = 0, as a planar laser's do.
    #[wasm_bindgen(getter)]
    pub fn is_planar(&self) -> bool {
        self.cloud.is_planar()
    }

    /// x y z x y z ... (m), relative to `origin()`.
    pub fn positions(&self) -> Vec<f32> {
        bytemuck::cast_slice(&self.cloud.positions).to_vec()
    }

    /// Offset to add to every position (m); zero except for clouds in map coordinates.
    pub fn origin(&self) -> Vec<f64> {
        self.cloud.origin.to_array().to_vec()
    }

    /// Unit normals, x y z x y z ..., where the file has them.
    pub fn normals(&self) -> Option<Vec<f32>> {
        self.cloud.normals.as_deref().map(|normals| bytemuck::cast_slice(normals).to_vec())
    }

    /// Colours, red green blue red ..., where the file has them.
    pub fn colors(&self) -> Option<Vec<u8>> {
        self.cloud.colors.as_deref().map(|colors| bytemuck::cast_slice(colors).to_vec())
    }

    /// A PLY file of the cloud.
    ///
    /// # Errors
    /// When the format is unknown.
    pub fn to_ply(&self, format: &PlyFormat) -> Result<Vec<u8>, JsValue> {
        let format = match JsValue::from(format).as_string().as_deref() {
            Some("ascii") => ply::Format::Ascii,
            Some("binary_little_endian") => ply::Format::BinaryLittleEndian,
            other => {
                let problem = format!("\"{}\" is not a PLY format", other.unwrap_or_default());
                return Err(Error::whole(problem, "Use \"ascii\" or \"binary_little_endian\"").into());
            }
        };
        Ok(ply::write(&self.cloud, format))
    }
}

/// Registers `source` to `target`: in the plane when both are planar, in space otherwise.
///
/// # Errors
/// When a cloud has no points, when only one is planar, or when the options do not fit.
#[wasm_bindgen]
pub fn register(
    source: &PointCloud,
    target: &PointCloud,
    options: Option<PartialRegistrationOptions>,
) -> Result<Ts<RegistrationResult>, JsValue> {
    let options: RegistrationOptions = from_object(options.map(JsValue::from))?;
    Ok(plain(&register_clouds(&source.cloud, &target.cloud, &options)?))
}
