//! The unit of scans that are a file each: as set, or told from the first one.

use crate::geometry::PointCloud;
use crate::io::length_unit::{JudgedUnit, LASER_RANGES, METRE, judge_unit, step_of};
use crate::pipeline::recorded_scan::RecordedScan;

/// The unit of the scans of a run.
#[derive(Default)]
pub(super) struct ScanUnit {
    told: Option<JudgedUnit>,
    /// Metres of a unit by which the scans were read.
    used: f64,
}

impl ScanUnit {
    /// A scan in metres. `set`: metres in a unit, 0 where it is to be told.
    pub(super) fn in_metres(&mut self, mut cloud: PointCloud, set: f64) -> PointCloud {
        let told = self.told.get_or_insert_with(|| told_from(&cloud));
        self.used = if set > 0.0 { set } else { told.unit.metres };
        scale(&mut cloud, self.used);
        cloud
    }

    /// Reads the scans by another unit.
    pub(super) fn change(&mut self, scans: &mut [RecordedScan], set: f64) {
        let Some(told) = &self.told else { return };
        let unit = if set > 0.0 { set } else { told.unit.metres };
        for scan in scans {
            scale(&mut scan.cloud, unit / self.used);
        }
        self.used = unit;
    }

    /// What is to be said of a unit that was told and is not metres without a doubt.
    pub(super) fn note(&self, set: f64) -> Option<String> {
        let JudgedUnit { unit, alternatives, median, .. } = self.told.as_ref().filter(|_| set == 0.0)?;
        let others: Vec<&str> = alternatives.iter().map(|other| other.name).collect();
        let also = if others.is_empty() { String::new() } else { format!(", and may be {}", others.join(" or ")) };
        (*unit != METRE || !others.is_empty()).then(|| {
            format!(
                "No file says the unit of the scans: half of the first one's returns are nearer than {median:.0}, so they are taken for \
                 {}{also}. Another unit is set by scan_unit (m), for example scan_unit=0.01.",
                unit.name
            )
        })
    }
}

fn told_from(cloud: &PointCloud) -> JudgedUnit {
    let points = || cloud.finite_points().map(|(_, point)| point);
    let step = step_of(points().flat_map(|point| [point.x, point.y]));
    judge_unit(points().map(glam::DVec3::length).collect(), step, &LASER_RANGES)
}

fn scale(cloud: &mut PointCloud, factor: f64) {
    if factor == 1.0 {
        return;
    }
    let rounded = |index: usize| (cloud.point(index) * factor).as_vec3();
    cloud.positions = (0..cloud.len()).map(rounded).collect();
    cloud.rounded_off = None;
}
