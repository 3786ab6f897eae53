//! Surfaces of depth images and clouds for JavaScript.

use js_sys::{Float32Array, Uint8Array, Uint32Array};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use wasm_bindgen::prelude::*;

use crate::thrown::Thrown;

use crate::from_object;
use crate::memory::{grow_ahead, make_room};
use scanstitch::error::Error;
use scanstitch::geometry::{Pose3, TriangleMesh};
use scanstitch::io::mesh::{self, MeshFormat};
use scanstitch::pipeline::prepared_frame::ColorFile;
use scanstitch::pipeline::surface::SurfaceReconstruction;

#[wasm_bindgen]
extern "C" {
    /// Any subset of the options; missing ones have their default values.
    #[wasm_bindgen(typescript_type = "Partial<SurfaceOptions>")]
    pub type PartialSurfaceOptions;
    /// File format of a mesh.
    #[wasm_bindgen(typescript_type = "'ply' | 'obj' | 'stl'")]
    pub type MeshFormatName;
}

/// A surface of triangles that grows by depth images or clouds at known poses. Call `free()` when it is no longer used.
#[wasm_bindgen]
pub struct Surface {
    surface: SurfaceReconstruction,
    mesh: Option<TriangleMesh>,
}

#[wasm_bindgen]
impl Surface {
    /// Without frames; `decode_config` is that of a run, which tells how they are read.
    ///
    /// # Errors
    /// When an option is unknown or out of its limits.
    #[wasm_bindgen(constructor)]
    pub fn new(decode_config: &str, options: Option<PartialSurfaceOptions>) -> Result<Surface, Thrown> {
        let decode_config = serde_json::from_str(decode_config)
            .map_err(|_| Error::whole("This is not a decode configuration", "Pass on what decode_config() returned"))?;
        let options = from_object(options.map(JsValue::from))?;
        Ok(Self { surface: SurfaceReconstruction::new(decode_config, options)?, mesh: None })
    }

    /// Adds a depth image at its pose (clouds are `put`) x y z qx qy qz qw (m, camera to world), with the file of its colours where it has any.
    /// The first five images tell the noise by what they differ: in the order of `follow`, these are from places apart.
    ///
    /// # Errors
    /// When the depth image is damaged or of another size than the first of the run, or the pose is none.
    #[allow(clippy::needless_pass_by_value, reason = "optional arrays cross by value")]
    pub fn add(&mut self, name: &str, depth: &[u8], color: Option<Vec<u8>>, pose: &[f64]) -> Result<(), Thrown> {
        let T_world_camera = pose_of(pose).ok_or_else(|| {
            Error::whole("The pose is not seven finite numbers", "Give x y z qx qy qz qw").in_file(name)
        })?;
        let color = color.as_deref().map(|bytes| ColorFile { name: "its colour image", bytes: Ok(bytes) });
        grow_ahead();
        let image = self.surface.read(name, depth, color)?;
        self.mesh = None;
        self.surface.add(&image, &T_world_camera);
        Ok(())
    }

    /// Takes in which frames of a run are to be in the surface from now on, by their numbers, each with its pose x y z qx qy qz qw (m,
    /// sensor to world). Returns those that are to be `put`, in this order: new ones, those that have moved, and those that are no longer
    /// in it; of images keyframes first. Where most have moved, all are put anew. While the run goes on, small motions, and images that
    /// are no keyframes, wait until `is_final`; clouds are all put anew then.
    ///
    /// # Errors
    /// When a pose is none.
    pub fn follow(&mut self, frames: &[u32], poses: &[f64], is_final: bool) -> Result<Vec<u32>, Thrown> {
        let poses: Option<Vec<Pose3>> = poses.chunks(7).map(pose_of).collect();
        let poses = poses.filter(|poses| poses.len() == frames.len()).ok_or_else(|| {
            Error::whole("The poses are not seven finite numbers a frame", "Give x y z qx qy qz qw for each frame")
        })?;
        let frames = frames.iter().map(|&frame| frame as usize).zip(poses);
        Ok(self.surface.follow(frames, is_final).into_iter().map(|frame| frame as u32).collect())
    }

    /// Puts a frame in at its pose, with what `SpatialReconstruction.kept_points` returned; or out, as `follow` has said.
    ///
    /// # Errors
    /// When the bytes are none of a frame of the run.
    pub fn put(&mut self, frame: u32, kept_points: &[u8]) -> Result<(), Thrown> {
        grow_ahead();
        let points = self.surface.read_kept(kept_points)?;
        self.mesh = None;
        self.surface.put(frame as usize, &points);
        Ok(())
    }

    /// Whether its frames are clouds: their z axis is up, where a camera's y axis is down.
    #[wasm_bindgen(getter)]
    pub fn is_of_clouds(&self) -> bool {
        self.surface.is_of_clouds()
    }

    /// Side of a voxel (m): larger than in the options where the memory was not enough, or clouds have too few points for it.
    #[wasm_bindgen(getter)]
    pub fn voxel_size(&mut self) -> f64 {
        if self.surface.is_of_clouds() {
            self.mesh();
        }
        self.surface.voxel_size()
    }

    /// Number of frames added.
    #[wasm_bindgen(getter)]
    pub fn num_frames(&self) -> usize {
        self.surface.num_frames()
    }

    /// Number of triangles.
    #[wasm_bindgen(getter)]
    pub fn num_triangles(&mut self) -> usize {
        self.mesh().triangles.len()
    }

    /// Number of triangles that fill holes.
    #[wasm_bindgen(getter)]
    pub fn num_filled(&mut self) -> usize {
        self.mesh().num_filled()
    }

    /// Fills holes up to this extent from now on (m); 0: none. What was seen to be empty stays open, as
    /// all holes of clouds do.
    ///
    /// # Errors
    /// When it is out of its limits.
    pub fn set_max_hole_size(&mut self, max_hole_size: f64) -> Result<(), Thrown> {
        self.surface.set_max_hole_size(max_hole_size)?;
        self.mesh = None;
        Ok(())
    }

    /// Replaces the triangles by fewer ones over the same vertices, as a decimation chooses them, three vertices each. Until something is
    /// added, or the surface is `restore`d, it has these.
    ///
    /// # Errors
    /// When a vertex does not exist.
    pub fn set_triangles(&mut self, triangles: &[u32]) -> Result<(), Thrown> {
        let mesh = self.mesh();
        let (triangles, rest) = triangles.as_chunks::<3>();
        let num_vertices = mesh.positions.len();
        if !rest.is_empty() || triangles.as_flattened().iter().any(|&vertex| vertex as usize >= num_vertices) {
            let problem = format!("These are no triangles over {num_vertices} vertices");
            return Err(Error::whole(problem, "Give three vertices for each").into());
        }
        let mesh = self.mesh.take().unwrap_or_default();
        self.mesh = Some(mesh.with_triangles(triangles.to_vec()));
        Ok(())
    }

    /// Brings all triangles back.
    pub fn restore(&mut self) {
        self.mesh = None;
    }

    /// Vertices x y z ... (m), in the world frame of the poses.
    pub fn positions(&mut self) -> Float32Array {
        Float32Array::from(triples(&self.mesh().positions).as_slice())
    }

    /// Unit normals x y z ...
    pub fn normals(&mut self) -> Float32Array {
        Float32Array::from(triples(&self.mesh().normals).as_slice())
    }

    /// Red, green, blue, ...; empty where the recording has no colours.
    pub fn colors(&mut self) -> Uint8Array {
        Uint8Array::from(self.mesh().colors.as_flattened())
    }

    /// Standard deviation of each vertex along its normal (m).
    pub fn deviations(&mut self) -> Float32Array {
        Float32Array::from(self.mesh().deviations.as_slice())
    }

    /// 1 for each vertex that fills a hole, otherwise 0; empty where none does.
    pub fn filled(&mut self) -> Uint8Array {
        let filled: Vec<u8> = self.mesh().filled.iter().map(|&is_filled| u8::from(is_filled)).collect();
        Uint8Array::from(filled.as_slice())
    }

    /// Three vertices a triangle.
    pub fn triangles(&mut self) -> Uint32Array {
        Uint32Array::from(self.mesh().triangles.as_flattened())
    }

    /// The surface as a file.
    ///
    /// # Errors
    /// When the format is unknown.
    pub fn file(&mut self, format: &MeshFormatName) -> Result<Vec<u8>, Thrown> {
        let format = MeshFormat::named(&JsValue::from(format).as_string().unwrap_or_default())?;
        Ok(mesh::write(self.mesh(), format))
    }

    fn mesh(&mut self) -> &TriangleMesh {
        self.mesh.get_or_insert_with(|| {
            // What is spread to the smallest voxels, and the vertices and triangles with where they are found.
            make_room(2 * self.surface.num_bytes());
            self.surface.mesh()
        })
    }
}

fn pose_of(numbers: &[f64]) -> Option<Pose3> {
    let &[x, y, z, qx, qy, qz, qw] = numbers else { return None };
    let rotation = UnitQuaternion::try_new(Quaternion::new(qw, qx, qy, qz), 1e-8)?;
    numbers.iter().all(|number| number.is_finite()).then(|| Isometry3::from_parts(Translation3::new(x, y, z), rotation))
}

fn triples(vectors: &[glam::Vec3]) -> Vec<f32> {
    vectors.iter().flat_map(glam::Vec3::to_array).collect()
}
