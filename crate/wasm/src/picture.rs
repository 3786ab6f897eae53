//! A map and its trajectory on a canvas of the page or of a worker.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;
use nalgebra::Vector3;
use serde::Deserialize;
use tsify::Tsify;
use wasm_bindgen::prelude::*;

use crate::thrown::Thrown;
use wasm_bindgen::{Clamped, JsCast};
use web_sys::{CanvasRenderingContext2d, HtmlCanvasElement, ImageData, OffscreenCanvas};

use crate::spatial::SpatialReconstruction;
use crate::{Reconstruction, from_object};
use scanstitch::error::Error;
use scanstitch::geometry::Pose3;
use scanstitch::map::picture::{Margin, PicturedPoint, PlaneView, Rgb, frame_colors, look_direction};
use scanstitch::map::voxel::{MapPoint, VoxelMap};
use scanstitch::odometry::assessment::Status;
use scanstitch::pipeline::report::{FrameResult, PlanarPose, SpatialDeviation, SpatialPose};

#[wasm_bindgen]
extern "C" {
    /// A canvas, which is drawn on in its full size.
    #[wasm_bindgen(typescript_type = "HTMLCanvasElement | OffscreenCanvas")]
    pub type AnyCanvas;
    /// Any subset of the options; missing ones have their default values.
    #[wasm_bindgen(typescript_type = "Partial<PictureOptions>")]
    pub type PartialPictureOptions;
}

/// Options of a picture.
#[derive(Debug, Clone, Deserialize, Tsify)]
#[serde(default, deny_unknown_fields)]
pub struct PictureOptions {
    /// Light on dark.
    pub dark: bool,
    /// Whether the trajectory is drawn, and the poses on it.
    pub path: bool,
    /// Free space on each side (pixels).
    pub margin: f64,
    /// In space: what lies higher than this above the path, as ceilings do, is left out (m).
    pub max_height: f64,
}

impl Default for PictureOptions {
    fn default() -> Self {
        Self { dark: false, path: true, margin: 24.0, max_height: 0.5 }
    }
}

impl PictureOptions {
    fn read(options: Option<PartialPictureOptions>) -> Result<Self, Thrown> {
        from_object(options.map(JsValue::from))
    }
}

/// A pose on a picture.
struct PicturedPose {
    /// x and y (m).
    position: [f64; 2],
    /// Counter-clockwise from x (rad).
    heading: f64,
    color: Rgb,
    status: Status,
}

/// What there is to draw.
struct Picture {
    points: Vec<PicturedPoint>,
    colors: Vec<Rgb>,
    /// Which pose each point was seen from.
    seen_from: Vec<u32>,
    poses: Vec<PicturedPose>,
}

#[wasm_bindgen]
impl Reconstruction {
    /// Draws the stitched map and the trajectory on a canvas, as wide and as high as it is.
    ///
    /// # Errors
    /// When it is no canvas that can be drawn on, or an option is unknown.
    pub fn draw(&self, canvas: &AnyCanvas, options: Option<PartialPictureOptions>) -> Result<(), Thrown> {
        let options = PictureOptions::read(options)?;
        let frames = self.engine.frames_from(0);
        let colors = frame_colors(frames.len(), options.dark);
        let map = self.engine.map();
        let points = map.points.iter().zip(&map.frames);
        let points = points.map(|(&position, &color)| PicturedPoint { position, color }).collect();
        let bearings = map.points.iter().zip(&map.frames).map(|(&[x, y], &frame)| {
            let pose = frames[frame as usize].T_world_sensor;
            (f64::from(y) - pose.y).atan2(f64::from(x) - pose.x) - pose.theta
        });
        let look = look_direction(bearings);
        let poses = frames.iter().zip(&colors).map(|(frame, &color)| {
            let PlanarPose { x, y, theta } = frame.T_world_sensor;
            PicturedPose { position: [x, y], heading: theta + look, color, status: frame.status }
        });
        let poses = poses.collect();
        Picture { points, colors, seen_from: map.frames, poses }.draw(canvas, &options)
    }
}

#[wasm_bindgen]
impl SpatialReconstruction {
    /// Draws the map and the trajectory from above on a canvas, as wide and as high as it is: of a camera with z to the top of
    /// the picture, of a laser with y.
    ///
    /// # Errors
    /// When it is no canvas that can be drawn on, or an option is unknown.
    pub fn draw(&mut self, canvas: &AnyCanvas, options: Option<PartialPictureOptions>) -> Result<(), Thrown> {
        let options = PictureOptions::read(options)?;
        let result = self.engine.result();
        let axes = if result.camera.is_some() { CAMERA_AXES } else { LASER_AXES };
        seen_from_above(self.engine.map(), &result.frames, &axes, &options).draw(canvas, &options)
    }
}

/// Directions of a world that is the frame of the first sensor.
struct Axes {
    up: Vector3<f64>,
    /// Towards the top of a picture.
    ahead: Vector3<f64>,
    /// Where a sensor looks, in its own frame.
    look: Vector3<f64>,
}

const CAMERA_AXES: Axes =
    Axes { up: Vector3::new(0.0, -1.0, 0.0), ahead: Vector3::new(0.0, 0.0, 1.0), look: Vector3::new(0.0, 0.0, 1.0) };
const LASER_AXES: Axes =
    Axes { up: Vector3::new(0.0, 0.0, 1.0), ahead: Vector3::new(0.0, 1.0, 0.0), look: Vector3::new(1.0, 0.0, 0.0) };

/// The map in the colours of its points, or of the frames where it has none.
fn seen_from_above(
    map: &VoxelMap,
    frames: &[FrameResult<SpatialPose, (), SpatialDeviation>],
    Axes { up, ahead, look }: &Axes,
    options: &PictureOptions,
) -> Picture {
    let right = ahead.cross(up);
    let plane = |point: &Vector3<f64>| [right.dot(point), ahead.dot(point)];
    let colors = frame_colors(frames.len(), options.dark);
    let poses: Vec<Pose3> = frames.iter().map(|frame| frame.T_world_sensor.into()).collect();
    let path_height = poses.iter().map(|pose| up.dot(&pose.translation.vector)).fold(f64::NEG_INFINITY, f64::max);
    let mut points: Vec<_> = map.points(0..map.len()).map(|point| (point.position.as_dvec3(), point)).collect();
    let height = |position: &DVec3| up.dot(&Vector3::from(position.to_array()));
    points.retain(|(position, _)| height(position) <= path_height + options.max_height);
    points.sort_by(|(a, _), (b, _)| height(a).total_cmp(&height(b)));
    let has_colors = map.has_colors();
    let color = |index: usize, point: &MapPoint| if has_colors { index as u32 } else { point.frame };
    let pictured = points.iter().enumerate().map(|(index, (position, point))| PicturedPoint {
        position: plane(&Vector3::from(position.to_array())).map(|value| value as f32),
        color: color(index, point),
    });
    let headed = poses.iter().zip(frames).zip(&colors).map(|((pose, frame), &color)| {
        let [x, y] = plane(&(pose.rotation * look));
        let position = plane(&pose.translation.vector);
        PicturedPose { position, heading: y.atan2(x), color, status: frame.status }
    });
    Picture {
        points: pictured.collect(),
        seen_from: points.iter().map(|(_, point)| point.frame).collect(),
        poses: headed.collect(),
        colors: if has_colors { points.iter().map(|(_, point)| point.color).collect() } else { colors },
    }
}

struct Theme {
    background: Rgb,
    halo: &'static str,
    path: &'static str,
    lost: &'static str,
}

const LIGHT: Theme = Theme { background: [252, 253, 254], halo: "#ffffff", path: "#1c2633", lost: "#b3261e" };
const DARK: Theme = Theme { background: [11, 15, 20], halo: "#0b0f14", path: "#e4eaf2", lost: "#ff8a80" };

/// Half the length of the mark of a pose (pixels), and the side of the squares of which each has one mark.
const MARK_RADIUS: f64 = 8.0;
const MARK_CELL: f64 = 20.0;

impl Picture {
    fn draw(&self, canvas: &AnyCanvas, options: &PictureOptions) -> Result<(), Thrown> {
        let (context, size) = context_of(canvas)?;
        let theme = if options.dark { DARK } else { LIGHT };
        let path: Vec<[f64; 2]> = self.poses.iter().map(|pose| pose.position).collect();
        let margin = options.margin;
        let margin = Margin { top: margin, right: margin, bottom: margin, left: margin };
        let sensor_of = |point: usize| self.seen_from.get(point).map(|&frame| frame as usize);
        let view = PlaneView::fitted(size, margin, &self.points, &path, sensor_of);
        let view = view.unwrap_or(PlaneView { size, center: [0.0; 2], scale: 1.0, is_turned: false });
        let pixels = view.paint(&self.points, &self.colors, theme.background);
        let image = ImageData::new_with_u8_clamped_array(Clamped(&pixels), size[0] as u32)?;
        context.put_image_data(&image, 0.0, 0.0)?;
        if options.path {
            self.draw_path(&context, &view, &theme)?;
        }
        Ok(())
    }

    fn draw_path(&self, context: &CanvasRenderingContext2d, view: &PlaneView, theme: &Theme) -> Result<(), Thrown> {
        context.save();
        context.reset_transform()?;
        context.set_line_join("round");
        context.begin_path();
        for pose in self.poses.iter().filter(|pose| pose.status != Status::Lost) {
            let [x, y] = view.pixel(pose.position);
            context.line_to(x, y);
        }
        stroke(context, theme.halo, 4.0);
        stroke(context, theme.path, 1.5);
        let mut marked = Vec::new();
        for pose in &self.poses {
            let [x, y] = view.pixel(pose.position);
            let cell = [x, y].map(|value| (value / MARK_CELL).floor());
            // Where poses crowd, the first stands for the others.
            if !marked.contains(&cell) {
                marked.push(cell);
                draw_pose(context, view, pose, theme);
            }
        }
        context.restore();
        Ok(())
    }
}

/// A kite that points where the sensor looks, or a cross where a lost frame was expected.
fn draw_pose(context: &CanvasRenderingContext2d, view: &PlaneView, pose: &PicturedPose, theme: &Theme) {
    let [x, y] = view.pixel(pose.position);
    let turn = if view.is_turned { -FRAC_PI_2 } else { 0.0 };
    let (sin, cos) = (pose.heading + turn).sin_cos();
    let corner = |forward: f64, left: f64| {
        [x + MARK_RADIUS * (forward * cos - left * sin), y - MARK_RADIUS * (forward * sin + left * cos)]
    };
    context.begin_path();
    if pose.status == Status::Lost {
        for side in [-0.6, 0.6] {
            context.move_to(x - 0.6 * MARK_RADIUS, y - side * MARK_RADIUS);
            context.line_to(x + 0.6 * MARK_RADIUS, y + side * MARK_RADIUS);
        }
        stroke(context, theme.halo, 5.0);
        stroke(context, theme.lost, 2.0);
        return;
    }
    for [x, y] in [corner(1.0, 0.0), corner(-0.75, 0.68), corner(-0.35, 0.0), corner(-0.75, -0.68)] {
        context.line_to(x, y);
    }
    context.close_path();
    stroke(context, theme.halo, 2.5);
    let [red, green, blue] = pose.color;
    context.set_fill_style_str(&format!("rgb({red} {green} {blue})"));
    context.fill();
}

fn stroke(context: &CanvasRenderingContext2d, color: &str, width: f64) {
    context.set_stroke_style_str(color);
    context.set_line_width(width);
    context.stroke();
}

/// Both kinds of canvas have contexts with the same methods.
fn context_of(canvas: &AnyCanvas) -> Result<(CanvasRenderingContext2d, [usize; 2]), Thrown> {
    let refused = |problem: &str| {
        let remedy = "Give a canvas element or an OffscreenCanvas whose context is 2d and which has a size";
        Thrown::from(Error::whole(problem, remedy))
    };
    let (context, width, height) = if let Some(canvas) = canvas.dyn_ref::<HtmlCanvasElement>() {
        (canvas.get_context("2d")?, canvas.width(), canvas.height())
    } else if let Some(canvas) = canvas.dyn_ref::<OffscreenCanvas>() {
        (canvas.get_context("2d")?, canvas.width(), canvas.height())
    } else {
        return Err(refused("The target is not a canvas"));
    };
    let context = context.ok_or_else(|| refused("The canvas has a context of another kind"))?;
    if width == 0 || height == 0 {
        return Err(refused("The canvas has no size"));
    }
    Ok((context.unchecked_into(), [width as usize, height as usize]))
}
