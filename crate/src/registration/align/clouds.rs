//! Preparation of two clouds of either kind, as files hold them, for registration.

use std::rc::Rc;

use nalgebra::{Translation3, Vector2};

use super::{RegistrationOptions, check_points, plane, pose_from, row_major, space};
use crate::error::{Error, Result};
use crate::geometry::{Embedding, PointCloud, Pose2, Pose3};
use crate::registration::problem::IcpProblem;
use crate::search::NearestTable;

/// A problem of either dimension with its initial guess, relative to the target's origin.
pub enum CloudProblem {
    /// Two planar clouds.
    Plane(Box<dyn IcpProblem<Pose2>>, Pose2),
    /// Two clouds in space.
    Space(Box<dyn IcpProblem<Pose3>>, Pose3),
}

/// Two prepared clouds, and the origin of the target.
pub struct PreparedClouds {
    /// The registration problem.
    pub problem: CloudProblem,
    table: Option<Rc<NearestTable>>,
    origin: Translation3<f64>,
}

impl PreparedClouds {
    /// Prepares two clouds: in the plane where both are planar (z = 0), in space otherwise.
    ///
    /// # Errors
    /// When a cloud has no finite point, when only one of them is planar, when the metric does not fit the clouds, or when the
    /// guess is not a rigid motion.
    pub fn new(source: &PointCloud, target: &PointCloud, options: &RegistrationOptions) -> Result<Self> {
        Self::prepare(source, target, options, |_| None)
    }

    /// [`new`](Self::new) for very many searches: in the plane by a table, with the same results.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_table(source: &PointCloud, target: &PointCloud, options: &RegistrationOptions) -> Result<Self> {
        let table = |points: &[_]| NearestTable::new(points, options.max_correspondence_distance).map(Rc::new);
        Self::prepare(source, target, options, table)
    }

    fn prepare(
        source: &PointCloud,
        target: &PointCloud,
        options: &RegistrationOptions,
        table: impl Fn(&[Vector2<f64>]) -> Option<Rc<NearestTable>>,
    ) -> Result<Self> {
        for (cloud, role) in [(source, "source"), (target, "target")] {
            check_points(role, cloud.positions.iter().any(|p| p.is_finite()))?;
        }
        if source.is_planar() != target.is_planar() {
            let planar = if source.is_planar() { "source" } else { "target" };
            return Err(Error::whole(
                format!("The {planar} is planar, the other cloud is not"),
                "Give two planar scans (z = 0) or two clouds in space",
            ));
        }
        // Both clouds relative to the target's origin, which may be far away: T = shift * T_relative * shift^-1.
        let origin = space::origin_of(target);
        let guess = origin.inverse() * options.guess()? * origin;
        if source.is_planar() {
            let scan = |cloud| space::RelativeCloud::new(cloud, target.origin).scan();
            let (source, target) = (scan(source), scan(target));
            let table = table(&target.points);
            let guess = Pose2::from_space(&guess);
            let (problem, guess) = plane::prepare(&source, &target, guess, options, table.as_ref())?;
            return Ok(Self { problem: CloudProblem::Plane(problem, guess), table, origin });
        }
        let (problem, guess) = space::prepare(source, target, guess, options)?;
        Ok(Self { problem: CloudProblem::Space(problem, guess), table: None, origin })
    }

    /// The table of nearest points, for planar clouds.
    pub fn table(&self) -> Option<&NearestTable> {
        self.table.as_deref()
    }

    /// A motion relative to the target's origin as a motion between the given clouds, 4 x 4, row by row.
    ///
    /// # Errors
    /// When it is not finite.
    pub fn to_absolute(&self, T_target_source: &Pose3) -> Result<[f64; 16]> {
        Ok(row_major(
            &(self.origin * pose_from("T_target_source", &row_major(T_target_source))? * self.origin.inverse()),
        ))
    }

    /// The inverse of the conversion above, of the field or argument of this `name`.
    ///
    /// # Errors
    /// When it is not a rigid motion: the error says its name.
    pub fn to_relative(&self, name: &str, T_target_source: &[f64; 16]) -> Result<Pose3> {
        Ok(self.origin.inverse() * pose_from(name, T_target_source)? * self.origin)
    }

    /// The target's origin (m), to which the points of the problem are relative.
    pub fn origin(&self) -> [f64; 3] {
        self.origin.vector.into()
    }
}

impl CloudProblem {
    /// The initial guess in space.
    pub fn guess(&self) -> Pose3 {
        match self {
            Self::Plane(_, guess) => guess.in_space(),
            Self::Space(_, guess) => *guess,
        }
    }
}
