//! The files of a frame: a depth image with its colours, or a cloud.

use super::{ColorFile, FrameNote};
use crate::camera::{ColorImage, DepthImage};
use crate::error::{Error, Result};
use crate::geometry::PointCloud;
use crate::io::{color_image, depth_image, point_cloud};

/// Reads a cloud in space.
///
/// # Errors
/// When it is broken, empty, or a planar scan; the error names the file.
pub(super) fn read_cloud(name: &str, bytes: &[u8]) -> Result<PointCloud> {
    let cloud = point_cloud::read(bytes).map_err(|error| error.in_file(name))?;
    if cloud.is_empty() {
        return Err(Error::whole("The cloud has no points", "Leave the file out or export it again").in_file(name));
    }
    if cloud.is_planar() {
        let problem = "All points have z = 0: this is a scan of a planar laser, not a cloud in space";
        return Err(Error::whole(problem, "Give planar scans apart from clouds").in_file(name));
    }
    refuse_upright_plane(&cloud).map_err(|error| error.in_file(name))?;
    Ok(cloud)
}

/// Refuses a planar scan whose plane is not that of x and y.
fn refuse_upright_plane(cloud: &PointCloud) -> Result<()> {
    let finite = || cloud.positions.iter().filter(|p| p.is_finite());
    let Some(first) = finite().next() else { return Ok(()) };
    let Some(axis) = (0..2).find(|&axis| finite().all(|p| p[axis] == first[axis])) else { return Ok(()) };
    let [flat, other] = if axis == 0 { ["x", "y"] } else { ["y", "x"] };
    let problem = format!(
        "All points have {flat} = {}: this is a scan of a planar laser, in the plane of {other} and z",
        first[axis]
    );
    Err(Error::whole(problem, "Give it in the plane of x and y, with z = 0: x ahead, y to the left"))
}

/// Reads a depth image that holds some depth.
///
/// # Errors
/// When it is broken or all zero; the error names the file.
pub(super) fn read_depth(name: &str, bytes: &[u8]) -> Result<DepthImage> {
    let image = depth_image::read(bytes).map_err(|error| error.in_file(name))?;
    if image.values.iter().all(|&value| value == 0) {
        return Err(Error::whole("All depths are zero: nothing was measured", "Leave the frame out").in_file(name));
    }
    Ok(image)
}

/// The colours of a frame's pixels. What is to be told of them is added to `notes`.
pub(super) fn colors_of(
    color: ColorFile<'_>,
    frame: &str,
    depth: &DepthImage,
    notes: &mut Vec<FrameNote>,
) -> Option<ColorImage> {
    let ColorFile { name, bytes } = color;
    let read = |bytes| read_colors(bytes, depth).map_err(|error| error.in_file(name).to_string());
    match bytes.map_err(str::to_owned).and_then(read) {
        Ok((colors, reason)) => {
            notes.extend(reason.map(|reason| FrameNote { subject: format!("{frame}: {name}"), reason }));
            Some(colors)
        }
        Err(problem) => {
            let left_out = format!("{frame}: its colours are left out");
            notes.push(match problem.strip_prefix(&format!("{name}: ")) {
                Some(reason) => FrameNote { subject: format!("{left_out}: {name}"), reason: reason.to_owned() },
                None => FrameNote { subject: left_out, reason: problem },
            });
            None
        }
    }
}

/// Colours of the size of the depth image, with a note where they were of another one. Phones take depth of fewer pixels than the
/// picture that it belongs to. Whether they are registered to the depth is told from their edges.
fn read_colors(bytes: &[u8], depth: &DepthImage) -> Result<(ColorImage, Option<String>)> {
    let colors = color_image::read_enough(bytes, [depth.width, depth.height])?;
    if (colors.width, colors.height) == (depth.width, depth.height) {
        return Ok((colors, None));
    }
    // Of two pixels one has its brightness compared: by so much the height may differ from that of the same view.
    let height = colors.height as f64 * (depth.width as f64 / colors.width as f64);
    let is_same_view = (height - depth.height as f64).abs() <= 2.0;
    if is_same_view && colors.width >= depth.width && colors.height >= depth.height {
        let note = format!(
            "it has more pixels than the depth image and is reduced to its {} x {}, as if both showed the same view",
            depth.width, depth.height
        );
        return Ok((colors.reduced(depth.width, depth.height), Some(note)));
    }
    let problem = format!(
        "The colour image has {} x {} pixels, the depth image {} x {}",
        colors.width, colors.height, depth.width, depth.height
    );
    Err(Error::whole(problem, "Give colour images that are registered to the depth images, pixel by pixel"))
}
