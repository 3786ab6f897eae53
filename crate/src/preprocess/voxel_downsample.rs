//! Downsampling to one point per voxel, the mean of the points in it.

use glam::{DVec3, Vec3};
use nalgebra::Vector3;

use super::voxel_hash::{Voxel, VoxelHash};
use crate::geometry::{PointCloud, PointTimes};
use crate::{Error, Result};

/// Sums over the points of a voxel, in double precision since there may be many of them.
#[derive(Default, Clone)]
struct Sums {
    position: DVec3,
    count: u64,
}

/// Of what not all clouds have, apart: most voxels then take a quarter of the memory.
#[derive(Default, Clone)]
struct Attributes {
    normal: DVec3,
    color: [u64; 3],
}

/// The voxels of a cloud in the order of the first point of each.
#[derive(Default)]
struct Voxels {
    cells: Vec<Voxel>,
    sums: Vec<Sums>,
    /// One a voxel, or none.
    attributes: Vec<Attributes>,
    /// Sums (s), one a voxel, or none.
    times: Vec<f64>,
}

/// The mean position, normal, colour and time of the points in every voxel of side `voxel_size` (m), in the order of the first point
/// of each voxel. Points that are not finite are dropped.
///
/// # Errors
/// When `voxel_size` is not positive, or so small that a point lies 1e9 voxels or more from the origin.
pub fn voxel_downsample(cloud: &PointCloud, voxel_size: f64) -> Result<PointCloud> {
    voxel_downsample_from(cloud, voxel_size, DVec3::ZERO)
}

/// [`voxel_downsample`] with `corner` (m, in the frame of the positions) as a common corner of voxels. With the same grid in every
/// sensor frame the voxels cut the rays at the same ranges, which biases a registration towards no motion.
///
/// # Errors
/// When `voxel_size` is not positive, or so small that a point lies 1e9 voxels or more from the corner.
pub(crate) fn voxel_downsample_from(cloud: &PointCloud, voxel_size: f64, corner: DVec3) -> Result<PointCloud> {
    Ok(Voxels::new(cloud, voxel_size, corner)?.means(cloud))
}

/// As [`voxel_downsample_from`] to voxels of side `voxel_size` (m), and to those of which each of these is divided into `parts` along each
/// axis; these come second.
///
/// # Errors
/// When `voxel_size` is not positive, or so small that a point lies 1e9 parts of voxels or more from the corner.
pub(crate) fn voxel_downsample_twice(
    cloud: &PointCloud,
    (voxel_size, parts): (f64, i32),
    corner: DVec3,
) -> Result<(PointCloud, PointCloud)> {
    let fine = Voxels::new(cloud, voxel_size / f64::from(parts), corner)?;
    Ok((fine.joined(parts, voxel_size).means(cloud), fine.means(cloud)))
}

impl Voxels {
    fn new(cloud: &PointCloud, voxel_size: f64, corner: DVec3) -> Result<Self> {
        if !(voxel_size > 0.0 && voxel_size.is_finite()) {
            let problem = format!("voxel_size = {voxel_size} m is not positive");
            return Err(Error::whole(problem, "Give a positive voxel_size"));
        }
        let has_attributes = cloud.normals.is_some() || cloud.colors.is_some();
        let mut numbers = Numbers::new(voxel_size);
        let mut voxels = Self::default();
        for (point, position) in cloud.positions.iter().enumerate().filter(|(_, position)| position.is_finite()) {
            let position = position.as_dvec3();
            let cell = numbers.hash.voxel(&Vector3::from((position - corner).to_array())).ok_or_else(|| {
                let problem = format!("voxel_size = {voxel_size} m is too small for a cloud that reaches {position} m");
                Error::whole(problem, "Give a larger voxel_size")
            })?;
            let number = voxels.at(cell, &mut numbers);
            voxels.sums[number].position += position;
            voxels.sums[number].count += 1;
            if has_attributes {
                sum_of(&mut voxels.attributes, number).add_point(cloud, point);
            }
            if let Some(times) = &cloud.times {
                *sum_of(&mut voxels.times, number) += f64::from(times.offsets[point]);
            }
        }
        Ok(voxels)
    }

    /// Larger voxels of side `voxel_size` (m), which are as many of these along each axis.
    fn joined(&self, parts: i32, voxel_size: f64) -> Self {
        let mut numbers = Numbers::new(voxel_size);
        let mut joined = Self::default();
        for (part, (cell, sums)) in self.cells.iter().zip(&self.sums).enumerate() {
            let number = joined.at(cell.map(|x| x.div_euclid(parts)), &mut numbers);
            joined.sums[number].position += sums.position;
            joined.sums[number].count += sums.count;
            if let Some(attributes) = self.attributes.get(part) {
                sum_of(&mut joined.attributes, number).add(attributes);
            }
            if let Some(time) = self.times.get(part) {
                *sum_of(&mut joined.times, number) += time;
            }
        }
        joined
    }

    /// The index of a voxel, which is added where it is new.
    #[inline]
    fn at(&mut self, cell: Voxel, numbers: &mut Numbers) -> usize {
        let number = numbers.insert(cell);
        if number == self.sums.len() {
            self.cells.push(cell);
            self.sums.push(Sums::default());
        }
        number
    }

    /// One point a voxel, with what this cloud has beside positions.
    fn means(&self, cloud: &PointCloud) -> PointCloud {
        let with_attributes =
            || self.attributes.iter().zip(&self.sums).map(|(attributes, sums)| (attributes, sums.count));
        let color = |(of, count): (&Attributes, u64)| of.color.map(|sum| ((sum + count / 2) / count) as u8);
        let normal = |(of, _): (&Attributes, u64)| -> Vec3 { of.normal.normalize_or_zero().as_vec3() };
        let time = |(sum, sums): (&f64, &Sums)| (sum / sums.count as f64) as f32;
        let times = cloud.times.as_ref();
        PointCloud {
            positions: self.sums.iter().map(|sums| (sums.position / sums.count as f64).as_vec3()).collect(),
            normals: cloud.normals.as_ref().map(|_| with_attributes().map(normal).collect()),
            colors: cloud.colors.as_ref().map(|_| with_attributes().map(color).collect()),
            origin: cloud.origin,
            rounded_off: None,
            times: times.map(|times| PointTimes {
                origin: times.origin,
                offsets: self.times.iter().zip(&self.sums).map(time).collect(),
            }),
        }
    }
}

/// The sum of a voxel, which may be the next one.
fn sum_of<T: Default>(sums: &mut Vec<T>, number: usize) -> &mut T {
    if number == sums.len() {
        sums.push(T::default());
    }
    &mut sums[number]
}

/// Numbers of voxels; points that follow one another mostly lie in one.
struct Numbers {
    hash: VoxelHash,
    last: Option<(Voxel, usize)>,
}

impl Numbers {
    fn new(voxel_size: f64) -> Self {
        Self { hash: VoxelHash::new(voxel_size), last: None }
    }

    #[inline]
    fn insert(&mut self, cell: Voxel) -> usize {
        match self.last {
            Some((last, number)) if last == cell => number,
            _ => {
                let number = self.hash.insert(cell) as usize;
                self.last = Some((cell, number));
                number
            }
        }
    }
}

impl Attributes {
    /// Adds those of a point.
    fn add_point(&mut self, cloud: &PointCloud, point: usize) {
        if let Some(normals) = &cloud.normals {
            self.normal += normals[point].as_dvec3();
        }
        if let Some(colors) = &cloud.colors {
            for (sum, &channel) in self.color.iter_mut().zip(&colors[point]) {
                *sum += u64::from(channel);
            }
        }
    }

    /// Adds those of a part.
    fn add(&mut self, part: &Self) {
        self.normal += part.normal;
        for (sum, channel) in self.color.iter_mut().zip(part.color) {
            *sum += channel;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_a_voxel_become_their_mean() {
        let cloud = PointCloud {
            positions: [[0.1, 0.1, 0.1], [-0.1, 0.1, 0.1], [0.3, 0.1, 0.3], [f32::NAN, 0.0, 0.0]]
                .map(Vec3::from)
                .to_vec(),
            normals: Some(vec![Vec3::X, Vec3::Z, Vec3::Y, Vec3::Z]),
            colors: Some(vec![[10, 0, 255], [1, 2, 3], [21, 0, 255], [0, 0, 0]]),
            origin: glam::DVec3::new(5.0, 0.0, 0.0),
            rounded_off: None,
            times: Some(PointTimes { origin: 7.0, offsets: vec![0.25, 1.0, 0.75, 2.0] }),
        };
        let sparse = voxel_downsample(&cloud, 0.5).unwrap();
        assert!((sparse.positions[0] - Vec3::new(0.2, 0.1, 0.2)).length() < 1e-7);
        assert_eq!(sparse.positions[1], Vec3::new(-0.1, 0.1, 0.1)); // floor, not a cut towards zero
        let normals = sparse.normals.unwrap();
        assert!((normals[0] - Vec3::new(1.0, 1.0, 0.0).normalize()).length() < 1e-7);
        assert_eq!(sparse.colors, Some(vec![[16, 0, 255], [1, 2, 3]]));
        assert_eq!(sparse.times, Some(PointTimes { origin: 7.0, offsets: vec![0.5, 1.0] }));
        assert_eq!((sparse.origin, sparse.positions.len()), (cloud.origin, 2));
    }

    #[test]
    fn every_point_has_one_in_its_voxel_and_no_voxel_has_two() {
        let positions = (0..5000).map(|i| {
            let x = i as f32;
            Vec3::new((x * 0.37).sin() * 3.0, (x * 0.73).cos() * 2.0, (x * 1.3).sin())
        });
        let cloud = PointCloud::from_positions(positions.collect());
        let sparse = voxel_downsample(&cloud, 0.25).unwrap();
        let voxel = |p: &Vec3| (p.as_dvec3() / 0.25).floor().to_array().map(|x| x as i64);
        let mut voxels: Vec<[i64; 3]> = sparse.positions.iter().map(voxel).collect();
        voxels.sort_unstable();
        assert!(voxels.windows(2).all(|pair| pair[0] != pair[1]));
        assert!(cloud.positions.iter().all(|p| voxels.binary_search(&voxel(p)).is_ok()));
    }

    #[test]
    fn voxels_and_their_parts_hold_the_means_of_the_same_points() {
        let wave = |i: i32, rate: f32| (i as f32 * rate).sin();
        let positions = (0..3000).map(|i| Vec3::new(3.0 * wave(i, 0.37), 2.0 * wave(i, 0.73), wave(i, 1.3))).collect();
        let cloud = PointCloud {
            colors: Some((0..3000).map(|i| [(i % 251) as u8, 7, 255]).collect()),
            times: Some(PointTimes { origin: 1.0, offsets: (0..3000).map(|i| i as f32 * 1e-3).collect() }),
            ..PointCloud::from_positions(positions)
        };
        let corner = DVec3::new(0.013, -0.2, 0.1);
        let (whole, parts) = voxel_downsample_twice(&cloud, (0.5, 2), corner).unwrap();
        for (found, size) in [(whole, 0.5), (parts, 0.25)] {
            let expected = voxel_downsample_from(&cloud, size, corner).unwrap();
            let are_near =
                |a: &[f32], b: &[f32]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
            let [a, b] = [&found, &expected].map(|cloud| bytemuck::cast_slice::<_, f32>(&cloud.positions));
            assert!(are_near(a, b) && found.colors == expected.colors && found.len() > 200);
            assert!(are_near(&found.times.unwrap().offsets, &expected.times.unwrap().offsets));
        }
    }

    #[test]
    fn a_voxel_without_size_is_refused() {
        let far = PointCloud::from_positions(vec![Vec3::new(1.0, 2.0, 3.0)]);
        assert!(voxel_downsample(&far, 1e-12).unwrap_err().to_string().contains("too small"));
        for size in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(voxel_downsample(&PointCloud::default(), size).is_err());
        }
        assert!(voxel_downsample(&PointCloud::default(), 0.1).unwrap().is_empty());
    }
}
