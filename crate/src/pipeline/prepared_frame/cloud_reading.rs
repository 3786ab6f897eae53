//! How the clouds of a recording are read, told from the first one: the unit of their coordinates, whether these begin at the
//! sensor, and what is taken off them where they do not.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::gyro_comments::gyro_readings;
use super::sensor_place::{Extent, is_sensor_at_origin};
use crate::geometry::PointCloud;
use crate::geometry::quantile::quantile;
use crate::io::length_unit::{
    CENTIMETRE, CLOUD_SIZES, JudgedUnit, METRE, MILLIMETRE, UNITS, judge_unit, step_of, unit_in,
};
use crate::pipeline::assumptions::{Assumption, ReadingSetting, UsualValue};
use crate::pipeline::spatial_settings::SpatialSettings;
use crate::preprocess::azimuth_clock::AzimuthClock;
use crate::preprocess::point_clock::PointClock;
use crate::{Error, Result};

/// How clouds are read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CloudReading {
    /// Metres in a unit of the coordinates.
    pub unit: f64,
    /// What is taken off all coordinates (m), whole metres: zero where the sensor is at their origin.
    pub origin: [f64; 3],
    /// Where the sensor may have been (m), behind the shift; normals point there.
    pub viewpoint: [f64; 3],
    /// Whether the sensor is at the origin of the coordinates of each cloud.
    pub is_sensor_at_origin: bool,
    /// How the times of points are read; none where the points have no times that could be those of a sweep.
    pub clock: Option<PointClock>,
    /// Where turns of a spinning lidar begin by azimuth (rad), where the points have no times.
    pub seam: Option<f64>,
    /// Whether clouds have readings of a gyroscope.
    pub has_gyro: bool,
    /// Whether all points of a cloud are registered, however many.
    pub is_whole: bool,
    /// What was assumed.
    pub assumptions: Vec<Assumption>,
    /// What is worth knowing of that, in whole sentences.
    pub notes: Vec<String>,
}

/// Bytes of a file in which its header may say the unit.
const HEAD_BYTES: usize = 2048;
/// Coordinates that begin so far from their origin (units of the file) are those of a map, which are metres.
const MAP_DISTANCE: f64 = 1e5;
/// ... up to half the Earth's circumference at the equator, which no projection exceeds.
const FARTHEST_ON_MAP: f64 = 2.004e7;
/// Longitudes and latitudes (deg) of a cloud spread by less than this share of its heights (m): a degree has 111 km.
const DEGREES_PER_HEIGHT: f64 = 1e-3;
/// What is said of times of points that are not those of a sensor.
const TIMES_OF_MAP: &str = "The times of points are not used: the coordinates do not begin at the sensor";

impl CloudReading {
    /// From the settings and the first cloud, with the bytes of its file; and half of the size of what it shows (m).
    ///
    /// # Errors
    /// When its coordinates are degrees on the Earth's sphere.
    pub(super) fn new(settings: &SpatialSettings, cloud: &PointCloud, bytes: &[u8]) -> Result<(Self, f64)> {
        let points = finite_points(cloud);
        let extent = Extent::of(&points);
        refuse_degrees(&extent)?;
        let is_sensor_at_origin = is_sensor_at_origin(&points, &extent);
        let center = if is_sensor_at_origin { DVec3::ZERO } else { extent.center() };
        let mut sizes = distances(&points, center);
        let (unit, assumption) = unit_of(settings, &points, &extent, sizes.clone(), bytes);
        let origin = (unit * center).round() + DVec3::ZERO;
        // Off the middle along the shortest side: floors, walls and single surfaces all face one side then.
        let side = unit * (extent.high - extent.low);
        let shortest = (0..3).min_by(|&a, &b| side[a].total_cmp(&side[b])).unwrap_or(2);
        let viewpoint = if is_sensor_at_origin {
            DVec3::ZERO
        } else {
            unit * center - origin + side.length() * DVec3::AXES[shortest]
        };
        let on_place = (!is_sensor_at_origin).then(|| note_on_place(origin));
        let (clock, on_clock) = match &cloud.times {
            Some(_) if !is_sensor_at_origin => (None, Some(TIMES_OF_MAP.to_owned())),
            Some(times) => match PointClock::of(times) {
                Ok(clock) => (Some(clock), Some(clock.note(times))),
                Err(note) => (None, Some(note)),
            },
            None => (None, None),
        };
        let notes = on_place.into_iter().chain(on_clock).collect();
        let assumptions = assumption.into_iter().collect();
        let (origin, viewpoint) = (origin.to_array(), viewpoint.to_array());
        let has_no_times = is_sensor_at_origin && cloud.times.is_none();
        let seam = has_no_times.then(|| AzimuthClock::seam_of(&cloud.positions)).flatten();
        let has_gyro = is_sensor_at_origin && gyro_readings(bytes).is_some();
        let reading = Self {
            unit,
            origin,
            viewpoint,
            is_sensor_at_origin,
            clock,
            seam,
            has_gyro,
            is_whole: false,
            assumptions,
            notes,
        };
        Ok((reading, unit * quantile(&mut sizes, 0.5).unwrap_or(1.0)))
    }

    /// A cloud as it is read: in metres, behind the shift, single precision; its times in seconds from the frame's time stamp.
    pub(super) fn read(&self, cloud: PointCloud, stamp: Option<f64>) -> PointCloud {
        let origin = DVec3::from(self.origin);
        let position = |index: usize| (self.unit * cloud.absolute_point(index) - origin).as_vec3();
        let is_read_already = self.unit == METRE.metres && origin == DVec3::ZERO && !cloud.needs_doubles();
        let positions = (!is_read_already).then(|| (0..cloud.len()).map(position).collect());
        PointCloud {
            positions: positions.unwrap_or(cloud.positions),
            normals: cloud.normals,
            colors: cloud.colors,
            times: self.clock.zip(cloud.times.as_ref()).map(|(clock, times)| clock.seconds(times, stamp)),
            ..PointCloud::default()
        }
    }
}

#[inline(never)]
fn finite_points(cloud: &PointCloud) -> Vec<DVec3> {
    (0..cloud.len()).map(|index| cloud.absolute_point(index)).filter(|point| point.is_finite()).collect()
}

#[inline(never)]
fn distances(points: &[DVec3], center: DVec3) -> Vec<f64> {
    points.iter().map(|point| point.distance(center)).collect()
}

/// Refuses x and y that are degrees on the Earth's sphere: within its bounds, far from (0, 0), and hardly spread beside the heights.
///
/// # Errors
/// When they are.
fn refuse_degrees(extent: &Extent) -> Result<()> {
    let (low, side) = (extent.low, extent.high - extent.low);
    let is_on_sphere = extent.high.x.abs() <= 180.0 && extent.high.y.abs() <= 90.0 && low.x.abs() + low.y.abs() > 1.0;
    if !is_on_sphere || side.x.max(side.y) >= DEGREES_PER_HEIGHT * side.z {
        return Ok(());
    }
    let problem = "The coordinates look like longitude and latitude (degrees) beside heights (metres)";
    Err(Error::whole(problem, "Project the clouds into metres, for example to UTM"))
}

fn note_on_place(origin: DVec3) -> String {
    let taken_off = if origin == DVec3::ZERO {
        String::new()
    } else {
        let [x, y, z] = origin.to_array();
        format!(
            " ({x}, {y}, {z}) m is taken off them while the clouds are registered; trajectory.tum, report.json and map \
             files have the coordinates of the files."
        )
    };
    format!(
        "The coordinates of the clouds do not begin at the sensor, but are those of a room or of a map: free space is not \
         tested.{taken_off}"
    )
}

/// The unit (m), and what is to be said of it where neither the settings nor the file say it and it is not metres without a doubt.
fn unit_of(
    settings: &SpatialSettings,
    points: &[DVec3],
    extent: &Extent,
    sizes: Vec<f64>,
    bytes: &[u8],
) -> (f64, Option<Assumption>) {
    if settings.cloud_unit > 0.0 {
        return (settings.cloud_unit, None);
    }
    if let Some(unit) = unit_in_header(bytes) {
        return (unit, None);
    }
    let farthest = extent.low.abs().max(extent.high.abs()).max_element();
    if (MAP_DISTANCE..FARTHEST_ON_MAP).contains(&farthest) {
        return (1.0, None);
    }
    let step = step_of(points.iter().flat_map(DVec3::to_array));
    let JudgedUnit { unit, alternatives, median, .. } = judge_unit(sizes, step, &CLOUD_SIZES);
    if unit == METRE && alternatives.is_empty() {
        return (1.0, None);
    }
    let is_open = !alternatives.is_empty();
    let likely: Vec<f64> = std::iter::once(unit).chain(alternatives).map(|unit| unit.metres).collect();
    let whole = if step >= 1.0 { "the coordinates are whole numbers, and " } else { "" };
    let why = format!("{whole}half of the points lie within {median:.0} units, as {:.2} m", median * unit.metres);
    let usual = [METRE, CENTIMETRE, MILLIMETRE];
    let usual = usual.map(|unit| UsualValue { value: unit.metres, about: unit.name.to_owned() }).to_vec();
    let confirmed_by =
        (!is_open).then(|| "the size of the scene, which no other unit in use makes plausible".to_owned());
    let assumption =
        Assumption { setting: ReadingSetting::CloudUnit, value: unit.metres, why, likely, usual, confirmed_by };
    (unit.metres, Some(assumption))
}

/// Metres of the unit that a header of a cloud names, in a comment such as `comment unit: mm`.
fn unit_in_header(bytes: &[u8]) -> Option<f64> {
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(HEAD_BYTES)]).to_ascii_lowercase();
    let comments = head.lines().take_while(|line| *line != "end_header" && !line.starts_with("data "));
    let named = |line: &str| {
        let is_said = line.split(|c: char| !c.is_ascii_alphabetic()).any(|word| word.starts_with("unit"));
        is_said.then(|| unit_in(line, &UNITS)).flatten()
    };
    comments.filter(|line| line.starts_with("comment") || line.starts_with('#')).find_map(named)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_may_say_the_unit() {
        let unit = |text: &str| unit_in_header(text.as_bytes());
        assert_eq!(unit("ply\nformat ascii 1.0\ncomment units: mm\nend_header\n"), Some(1e-3));
        assert_eq!(unit("# .PCD v0.7\n# unit centimeters\nVERSION 0.7\n"), Some(0.01));
        assert_eq!(unit("ply\ncomment unit m\nend_header\n"), Some(1.0));
        assert_eq!(unit("ply\ncomment Units: inches\nend_header\n"), Some(0.0254));
        assert_eq!(unit("ply\ncomment unit=feet\nend_header\n"), Some(0.3048));
        assert_eq!(unit("ply\ncomment made by m\nend_header\n"), None);
    }
}
