//! The marked view as the other camera would see it if everything lay in the plane. As an overlay of the other view it shows
//! whether the cameras are right.

use nalgebra::Vector3;

use super::transfer::PlaneTransfer;
use crate::error::{Error, Result};

/// Bytes of a pixel: red, green, blue, opacity.
const BYTES: usize = 4;

/// Rows `first_row .. first_row + num_rows` of the warped image, RGBA. `transfer` leads from the image that is painted to
/// the image that colours come from, which is `image` (RGBA). Pixels that see no ground, or ground that the image does
/// not show, are transparent; the others are interpolated between four.
///
/// # Errors
/// When `image` is not as large as its camera says.
pub fn warp_rows(transfer: &PlaneTransfer, image: &[u8], first_row: usize, num_rows: usize) -> Result<Vec<u8>> {
    let (source, target) = (&transfer.projected.pinhole, &transfer.marked.pinhole);
    if image.len() != source.width * source.height * BYTES {
        let problem =
            format!("{} bytes do not make an image of {} x {} pixels", image.len(), source.width, source.height);
        return Err(Error::whole(problem, "Give four bytes for each pixel"));
    }
    let last_row = (first_row + num_rows).min(target.height);
    let mut warped = vec![0; last_row.saturating_sub(first_row) * target.width * BYTES];
    let (a, H) = transfer.rows();
    let [left, top, right, bottom] = transfer.projected.frame();
    let rows = warped.chunks_exact_mut(target.width * BYTES);
    for (v, row) in (first_row..last_row).zip(rows) {
        let start = Vector3::new(0.0, v as f64, 1.0);
        let (a_start, H_start) = ((a * start).x, H * start);
        for (u, pixel) in row.chunks_exact_mut(BYTES).enumerate() {
            // Eqs. (7) and (8) at (u, v, 1), which is u times the first column further.
            let u = u as f64;
            let z = H_start.z + H[(2, 0)] * u;
            if a_start + a.x * u <= 0.0 || z <= 0.0 {
                continue;
            }
            let x = (H_start.x + H[(0, 0)] * u) / z;
            let y = (H_start.y + H[(1, 0)] * u) / z;
            if x >= left && x <= right && y >= top && y <= bottom {
                pixel.copy_from_slice(&interpolated(image, source.width, source.height, x as f32, y as f32));
            }
        }
    }
    Ok(warped)
}

/// The colour between the four pixels around a place in the image.
fn interpolated(image: &[u8], width: usize, height: usize, x: f32, y: f32) -> [u8; BYTES] {
    let (x, y) = (x.clamp(0.0, (width - 1) as f32), y.clamp(0.0, (height - 1) as f32));
    let (x0, y0) = (x as usize, y as usize);
    let (x1, y1) = ((x0 + 1).min(width - 1), (y0 + 1).min(height - 1));
    let (right, down) = (x - x0 as f32, y - y0 as f32);
    let at = |x: usize, y: usize| &image[(y * width + x) * BYTES..][..BYTES];
    let corners = [at(x0, y0), at(x1, y0), at(x0, y1), at(x1, y1)];
    let shares = [(1.0 - right) * (1.0 - down), right * (1.0 - down), (1.0 - right) * down, right * down];
    std::array::from_fn(|channel| {
        let sum: f32 = corners.iter().zip(shares).map(|(corner, share)| f32::from(corner[channel]) * share).sum();
        (sum + 0.5) as u8
    })
}
