//! Bird's-eye view for JavaScript: pixels of a top view mapped to a front view, and back.

use js_sys::JSON;
use tsify::Ts;
use wasm_bindgen::prelude::*;

use crate::{from_object, plain};
use scanstitch::camera::bev::points::{FRONT_POINT_COLUMNS, PAIR_COLUMNS, POINT_COLUMNS, points_csv, read_pixels};
use scanstitch::camera::bev::refine::refine;
use scanstitch::camera::bev::warp::warp_rows;
use scanstitch::camera::bev::{
    BevAxes, BevLayout, BevPair, BevPoint, BevPolygon, BevPoseKind, BevPreset, BevRefinement, BevRefinementOptions,
    BevRole, BevScene, BevSegment, EulerOrder, PlaneTransfer, WholePixels, presets,
};
use scanstitch::error::Error;

#[wasm_bindgen]
extern "C" {
    /// Two cameras over a plane.
    #[wasm_bindgen(typescript_type = "BevScene")]
    pub type BevSceneObject;
    /// One of the two cameras.
    #[wasm_bindgen(typescript_type = "BevRole")]
    pub type BevRoleName;
    /// Directions of axes.
    #[wasm_bindgen(typescript_type = "BevAxes")]
    pub type AxesName;
    /// Representation of a pose.
    #[wasm_bindgen(typescript_type = "BevPoseKind")]
    pub type BevPoseKindName;
    /// The order of three rotations.
    #[wasm_bindgen(typescript_type = "EulerOrder")]
    pub type EulerOrderName;
    /// Rounding of projected pixels.
    #[wasm_bindgen(typescript_type = "WholePixels")]
    pub type WholePixelsName;
    /// Pairs of pixels that show the same points.
    #[wasm_bindgen(typescript_type = "BevPair[]")]
    pub type BevPairObjects;
    /// Any subset of the options; missing ones have their default values.
    #[wasm_bindgen(typescript_type = "Partial<BevRefinementOptions>")]
    pub type PartialBevRefinementOptions;
}

/// Two cameras over a plane, which maps pixels of one to the other. Call `free()` when it is no longer used.
#[wasm_bindgen]
pub struct BirdsEyeView {
    front_from_top: PlaneTransfer,
    top_from_front: PlaneTransfer,
}

#[wasm_bindgen]
impl BirdsEyeView {
    /// From a scene.
    ///
    /// # Errors
    /// When a camera or the plane is invalid, or the plane passes through a camera.
    #[wasm_bindgen(constructor)]
    pub fn new(scene: &BevSceneObject) -> Result<BirdsEyeView, JsValue> {
        let scene = scene_of(scene)?;
        Ok(Self { front_from_top: scene.front_from_top()?, top_from_front: scene.top_from_front()? })
    }

    /// Maps pixels, u v u v ..., of the camera `from` to the other one.
    ///
    /// # Errors
    /// When the number of values is odd or a name is unknown.
    pub fn points(
        &self,
        marked: &[f64],
        from: &BevRoleName,
        whole: Option<WholePixelsName>,
    ) -> Result<Vec<Ts<BevPoint>>, JsValue> {
        Ok(self.followed(marked, from, whole)?.iter().map(plain).collect())
    }

    /// The same as a table: `number,top_u,top_v,x,y,z,front_u,front_v,status`.
    ///
    /// # Errors
    /// As `points`.
    pub fn points_csv(
        &self,
        marked: &[f64],
        from: &BevRoleName,
        whole: Option<WholePixelsName>,
    ) -> Result<String, JsValue> {
        let points = self.followed(marked, from, whole)?;
        Ok(match role_of(from)? {
            BevRole::Top => points_csv(&points, "top", "front"),
            BevRole::Front => points_csv(&points, "front", "top"),
        })
    }

    /// The part of the region with these corners, u v u v ..., that the other camera sees; it is clipped before it is projected.
    ///
    /// # Errors
    /// As `points`.
    pub fn polygon(&self, corners: &[f64], from: &BevRoleName) -> Result<Ts<BevPolygon>, JsValue> {
        Ok(plain(&self.transfer(from)?.polygon(&pixels(corners)?)))
    }

    /// The parts of lines, u v u v for each, that the other camera sees; invisible lines are left out.
    ///
    /// # Errors
    /// As `points`.
    pub fn segments(&self, ends: &[f64], from: &BevRoleName) -> Result<Vec<Ts<BevSegment>>, JsValue> {
        let transfer = self.transfer(from)?;
        let lines = pixels(ends)?;
        let seen = lines.chunks_exact(2).filter_map(|line| transfer.segment([line[0], line[1]]));
        Ok(seen.map(|found| plain(&found)).collect())
    }

    /// The plane's homography, row by row: maps (u, v, 1) of the camera `from` to the other one's pixel up to scale.
    ///
    /// # Errors
    /// When the name is unknown.
    pub fn homography(&self, from: &BevRoleName) -> Result<Vec<f64>, JsValue> {
        Ok(self.transfer(from)?.homography().transpose().as_slice().to_vec())
    }

    /// The layout of the cameras and the ground, for a drawing. The visible part of the ground is cut at `max_depth` (m).
    ///
    /// # Errors
    /// No input causes an error.
    pub fn layout(&self, max_depth: f64) -> Result<Ts<BevLayout>, JsValue> {
        Ok(plain(&BevLayout::new(&self.front_from_top, max_depth)))
    }

    fn transfer(&self, from: &BevRoleName) -> Result<&PlaneTransfer, JsValue> {
        Ok(match role_of(from)? {
            BevRole::Top => &self.front_from_top,
            BevRole::Front => &self.top_from_front,
        })
    }

    fn followed(
        &self,
        marked: &[f64],
        from: &BevRoleName,
        whole: Option<WholePixelsName>,
    ) -> Result<Vec<BevPoint>, JsValue> {
        let whole: WholePixels = from_object(whole.map(JsValue::from))?;
        let transfer = self.transfer(from)?;
        Ok(pixels(marked)?.into_iter().map(|pixel| transfer.point(pixel).in_whole_pixels(whole)).collect())
    }
}

/// A picture of the top view, kept by the engine to be warped. Call `free()` when it is no longer used.
#[wasm_bindgen]
pub struct BevImage {
    rgba: Vec<u8>,
}

#[wasm_bindgen]
impl BevImage {
    /// From RGBA bytes.
    #[wasm_bindgen(constructor)]
    pub fn new(rgba: Vec<u8>) -> BevImage {
        Self { rgba }
    }

    /// Rows of the top view as the front camera would see it if everything lay in the plane: RGBA, transparent where the top view
    /// shows nothing.
    ///
    /// # Errors
    /// When the size of the picture is not that of the top camera's image.
    pub fn warp_rows(&self, view: &BirdsEyeView, first_row: usize, num_rows: usize) -> Result<Vec<u8>, JsValue> {
        Ok(warp_rows(&view.top_from_front, &self.rgba, first_row, num_rows)?)
    }
}

/// Preset scenes: the homework's two layouts.
///
/// # Errors
/// No input causes an error.
#[wasm_bindgen]
pub fn bev_presets() -> Result<Vec<Ts<BevPreset>>, JsValue> {
    Ok(presets().iter().map(plain).collect())
}

/// Reads `scene.json`.
///
/// # Errors
/// When the file is not a scene.
#[wasm_bindgen]
pub fn read_bev_scene(bytes: &[u8], name: &str) -> Result<Ts<BevScene>, JsValue> {
    Ok(plain(&BevScene::read(bytes).map_err(|error| error.in_file(name))?))
}

/// Reads a table of pixels of the camera `from`: u v u v ...
///
/// # Errors
/// When a line does not consist of two numbers.
#[wasm_bindgen]
pub fn read_bev_points(bytes: &[u8], name: &str, from: &BevRoleName) -> Result<Vec<f64>, JsValue> {
    let columns = match role_of(from)? {
        BevRole::Top => POINT_COLUMNS,
        BevRole::Front => FRONT_POINT_COLUMNS,
    };
    let rows = read_pixels(bytes, columns).map_err(|error| error.in_file(name))?;
    Ok(rows.into_iter().flatten().collect())
}

/// Reads a table of pairs: top_u top_v front_u front_v on each line.
///
/// # Errors
/// When a line does not consist of four numbers.
#[wasm_bindgen]
pub fn read_bev_pairs(bytes: &[u8], name: &str) -> Result<Vec<Ts<BevPair>>, JsValue> {
    let rows = read_pixels(bytes, PAIR_COLUMNS).map_err(|error| error.in_file(name))?;
    Ok(rows.iter().map(|&[tu, tv, fu, fv]| plain(&BevPair { top: [tu, tv], front: [fu, fv] })).collect())
}

/// The same scene in other axes.
///
/// # Errors
/// When a camera is invalid or the name is unknown.
#[wasm_bindgen]
pub fn bev_in_axes(scene: &BevSceneObject, axes: &AxesName) -> Result<Ts<BevScene>, JsValue> {
    let axes: BevAxes = from_object(Some(axes.into()))?;
    Ok(plain(&scene_of(scene)?.in_axes(axes)?))
}

/// The same scene with its two poses in another representation.
///
/// # Errors
/// When a camera is invalid or a name is unknown.
#[wasm_bindgen]
pub fn bev_with_poses(
    scene: &BevSceneObject,
    kind: &BevPoseKindName,
    order: &EulerOrderName,
) -> Result<Ts<BevScene>, JsValue> {
    let kind: BevPoseKind = from_object(Some(kind.into()))?;
    let order: EulerOrder = from_object(Some(order.into()))?;
    Ok(plain(&scene_of(scene)?.with_poses(kind, order)?))
}

/// Adjusts pitch, height and offset of a camera by least squares, such that the projections of pairs fall on their marks.
///
/// # Errors
/// When the scene is invalid or the pairs do not determine the parameters.
#[wasm_bindgen]
pub fn bev_refine(
    scene: &BevSceneObject,
    pairs: &BevPairObjects,
    options: Option<PartialBevRefinementOptions>,
) -> Result<Ts<BevRefinement>, JsValue> {
    let pairs: Vec<BevPair> = from_object(Some(pairs.into()))?;
    let options: BevRefinementOptions = from_object(options.map(JsValue::from))?;
    Ok(plain(&refine(&scene_of(scene)?, &pairs, &options)?))
}

/// Checks that a picture has the size of its camera's image.
///
/// # Errors
/// When it has another size; the error gives both.
#[wasm_bindgen]
pub fn check_bev_image(scene: &BevSceneObject, role: &BevRoleName, width: usize, height: usize) -> Result<(), JsValue> {
    let scene = scene_of(scene)?;
    let (camera, name) = match role_of(role)? {
        BevRole::Top => (&scene.top, "top"),
        BevRole::Front => (&scene.front, "front"),
    };
    Ok(camera.check_image(name, width, height)?)
}

fn scene_of(scene: &BevSceneObject) -> Result<BevScene, JsValue> {
    // Of `undefined` and functions, there is no text.
    let json = JsValue::from(JSON::stringify(scene)?).as_string();
    let json = json
        .ok_or_else(|| Error::whole("The scene is not a plain object", "Give a scene as bev_presets() returns it"))?;
    BevScene::read(json.as_bytes()).map_err(|error| {
        // Nobody has seen the lines of this text.
        JsValue::from(Error::whole(format!("The scene is not valid: {}", error.problem), error.remedy))
    })
}

fn role_of(name: &BevRoleName) -> Result<BevRole, JsValue> {
    match JsValue::from(name).as_string().as_deref() {
        Some("top") => Ok(BevRole::Top),
        Some("front") => Ok(BevRole::Front),
        other => {
            let problem = format!("{} is not a camera of the scene", other.unwrap_or("This"));
            Err(Error::whole(problem, "Use \"top\" or \"front\"").into())
        }
    }
}

fn pixels(flat: &[f64]) -> Result<Vec<[f64; 2]>, JsValue> {
    if !flat.len().is_multiple_of(2) {
        let problem = format!("{} numbers are not pairs of u and v", flat.len());
        return Err(Error::whole(problem, "Give u and v of every pixel").into());
    }
    Ok(flat.chunks_exact(2).map(|pixel| [pixel[0], pixel[1]]).collect())
}
