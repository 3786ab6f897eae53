//! The ICP lab: two clouds and the options of [`register_clouds`](super::align::register_clouds) in; the internals of their
//! registration as plain data out.
//!
//! [`IcpLab`] holds the prepared clouds. [`iteration`] is one step of the loop with its pairs and equations, [`landscape`] the cost
//! over two unknowns, [`basin`] the results from a grid of starts. All of them use the loop and the pairs of [`super::icp`].
//! Read [`iteration`] first.

pub mod basin;
pub mod grid;
pub mod iteration;
pub mod landscape;
pub mod motion;

use nalgebra::Vector2;
use serde::Serialize;

use self::basin::{Basin, Ends};
use self::grid::{Grid, GridOptions, check_stride};
use self::iteration::TracedIteration;
use self::motion::LabMotion;
use crate::error::{Error, Result};
use crate::geometry::{Embedding, PointCloud, Pose2, Pose3, Vector};
use crate::registration::align::RegistrationOptions;
use crate::registration::align::clouds::{CloudProblem, PreparedClouds};
use crate::registration::correlative::{LikelihoodGrid, SearchWindow, SearchedBlock};
use crate::registration::icp::{EndReason, IterationRecord};
use crate::registration::problem::IcpProblem;

/// Two clouds prepared with the options of a registration, for analysis.
pub struct IcpLab {
    clouds: PreparedClouds,
    traced: Traced,
}

/// The poses of the last trace, not rounded by a conversion to matrices.
enum Traced {
    Plane(Vec<Pose2>),
    Space(Vec<Pose3>),
}

/// All iterations of a registration.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct IcpTrace {
    /// Whether the last step was below both limits.
    pub converged: bool,
    /// Why the loop ended.
    pub end_reason: EndReason,
    /// The initial pose: 4 x 4, row by row.
    pub initial: [f64; 16],
    /// The pose after each iteration; `register` returns the last.
    pub poses: Vec<[f64; 16]>,
    /// The record of each iteration.
    pub records: Vec<IterationRecord>,
    /// Mean robust loss before each iteration and at the end (m^2), one more entry than iterations.
    pub costs: Vec<f64>,
}

/// The points of a problem as the loop uses them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LabPoints {
    /// x y z of each point (m): the target's relative to its origin, the source's in its own frame.
    pub positions: Vec<f64>,
    /// Unit normals; NaN where a point has none.
    pub normals: Vec<f64>,
}

/// Evaluates one expression for the problem of either dimension.
macro_rules! either {
    ($lab:expr, |$problem:ident, $guess:ident| $body:expr) => {
        match &$lab.clouds.problem {
            CloudProblem::Plane($problem, $guess) => {
                let $problem = $problem.as_ref();
                $body
            }
            CloudProblem::Space($problem, $guess) => {
                let $problem = $problem.as_ref();
                $body
            }
        }
    };
}

impl IcpLab {
    /// Prepares two clouds.
    ///
    /// # Errors
    /// As [`register_clouds`](super::align::register_clouds).
    pub fn new(source: &PointCloud, target: &PointCloud, options: &RegistrationOptions) -> Result<Self> {
        Ok(Self { clouds: PreparedClouds::with_table(source, target, options)?, traced: Traced::Plane(Vec::new()) })
    }

    /// Whether the clouds are registered in the plane.
    pub fn is_planar(&self) -> bool {
        matches!(self.clouds.problem, CloudProblem::Plane(..))
    }

    /// The target's origin (m), to which points and tangent vectors are relative.
    pub fn origin(&self) -> [f64; 3] {
        self.clouds.origin()
    }

    /// The pose at which a registration starts: the guess of the options, or the result of their search.
    ///
    /// # Errors
    /// When it is not finite.
    pub fn initial(&self) -> Result<[f64; 16]> {
        self.clouds.to_absolute(&self.clouds.problem.guess())
    }

    /// The source's points in its own frame, relative to the target's origin.
    pub fn source_points(&self) -> Vec<f64> {
        fn xyz<M: LabMotion>(problem: &dyn IcpProblem<M>) -> Vec<f64> {
            problem.source_points().iter().flat_map(M::xyz).collect()
        }
        either!(self, |problem, _guess| xyz(problem))
    }

    /// The target's points and normals; for `vgicp` its voxels.
    pub fn target_points(&self) -> LabPoints {
        fn listed<M: LabMotion>(problem: &dyn IcpProblem<M>) -> LabPoints {
            let points = problem.target_points();
            let normal = |normal: &Option<M::Point>| normal.as_ref().map_or([f64::NAN; 3], M::xyz);
            LabPoints {
                positions: points.iter().flat_map(|(p, _)| M::xyz(p)).collect(),
                normals: points.iter().flat_map(|(_, n)| normal(n)).collect(),
            }
        }
        either!(self, |problem, _guess| listed(problem))
    }

    /// Runs the loop from a pose, or from that at which a registration starts.
    ///
    /// # Errors
    /// When the pose is not a rigid motion.
    pub fn trace(&mut self, init_T_target_source: Option<&[f64; 16]>) -> Result<IcpTrace> {
        let init =
            init_T_target_source.map(|rows| self.clouds.to_relative("init_T_target_source", rows)).transpose()?;
        let (trace, traced) = match &self.clouds.problem {
            CloudProblem::Plane(problem, guess) => {
                let (trace, poses) =
                    self.run(problem.as_ref(), init.map_or(*guess, |init| Pose2::from_space(&init)))?;
                (trace, Traced::Plane(poses))
            }
            CloudProblem::Space(problem, guess) => {
                let (trace, poses) = self.run(problem.as_ref(), init.unwrap_or(*guess))?;
                (trace, Traced::Space(poses))
            }
        };
        self.traced = traced;
        Ok(trace)
    }

    fn run<M: LabMotion>(&self, problem: &dyn IcpProblem<M>, init: M) -> Result<(IcpTrace, Vec<M>)> {
        let registration = problem.register(init);
        let rows = |pose: &M| self.clouds.to_absolute(&pose.in_space());
        let trace = IcpTrace {
            converged: registration.converged,
            end_reason: registration.end_reason,
            initial: rows(&init)?,
            poses: registration.trace[1..].iter().map(rows).collect::<Result<_>>()?,
            records: registration.history,
            costs: problem.costs(&mut registration.trace.iter().copied()),
        };
        Ok((trace, registration.trace))
    }

    /// The iteration that the loop would do at a pose.
    ///
    /// # Errors
    /// When the pose is not a rigid motion.
    pub fn iteration(&self, T_target_source: &[f64; 16]) -> Result<TracedIteration> {
        self.sampled_iteration(T_target_source, 1)
    }

    /// The same with every `stride`-th source point only, for large clouds that are dragged by hand.
    ///
    /// # Errors
    /// When the pose is not a rigid motion, or the stride is 0.
    pub fn sampled_iteration(&self, T_target_source: &[f64; 16], stride: usize) -> Result<TracedIteration> {
        check_stride(stride)?;
        let pose = self.clouds.to_relative("T_target_source", T_target_source)?;
        either!(self, |problem, _guess| self.details(problem, &Embedding::from_space(&pose), stride))
    }

    /// Iteration `index` of the last [`trace`](Self::trace), from the unrounded pose of the loop; one past the last is the iteration
    /// that would follow.
    ///
    /// # Errors
    /// When there is no such iteration.
    pub fn traced_iteration(&self, index: usize) -> Result<TracedIteration> {
        let missing = |count: usize| {
            let problem = format!("The trace has no pose {index}: it has {count}");
            Error::whole(problem, "Call trace() first, and count from 0")
        };
        match (&self.clouds.problem, &self.traced) {
            (CloudProblem::Plane(problem, _), Traced::Plane(poses)) => {
                self.details(problem.as_ref(), poses.get(index).ok_or_else(|| missing(poses.len()))?, 1)
            }
            (CloudProblem::Space(problem, _), Traced::Space(poses)) => {
                self.details(problem.as_ref(), poses.get(index).ok_or_else(|| missing(poses.len()))?, 1)
            }
            _ => Err(missing(0)),
        }
    }

    fn details<M: LabMotion>(&self, problem: &dyn IcpProblem<M>, pose: &M, stride: usize) -> Result<TracedIteration> {
        let to_absolute = |pose: &M| self.clouds.to_absolute(&pose.in_space());
        TracedIteration::of(&problem.iteration(pose, stride), problem, &to_absolute)
    }

    /// The pose at offsets from a centre, in the coordinates of landscapes and basins (rotation first).
    ///
    /// # Errors
    /// When the centre is not a rigid motion, or there are not as many offsets as unknowns.
    pub fn pose_at(&self, T_center: &[f64; 16], offsets: &[f64]) -> Result<[f64; 16]> {
        fn moved<M: LabMotion>(center: &Pose3, offsets: &[f64]) -> Result<Pose3> {
            let mut tangent = M::Tangent::zeros();
            if offsets.len() != M::Tangent::LEN {
                let problem = format!("{} offsets were given", offsets.len());
                return Err(Error::whole(problem, format!("Give {}, the rotation first", M::Tangent::LEN)));
            }
            offsets.iter().enumerate().for_each(|(axis, &offset)| tangent[axis] = offset);
            Ok(M::from_space(center).offset(&tangent).in_space())
        }
        let center = self.clouds.to_relative("T_center", T_center)?;
        let at = if self.is_planar() { moved::<Pose2>(&center, offsets) } else { moved::<Pose3>(&center, offsets) };
        self.clouds.to_absolute(&at?)
    }

    /// The offsets of a pose from a centre: the coordinates of landscapes and basins.
    ///
    /// # Errors
    /// When one of them is not a rigid motion.
    pub fn offsets(&self, T_center: &[f64; 16], T_target_source: &[f64; 16]) -> Result<Vec<f64>> {
        fn between<M: LabMotion>(center: &Pose3, pose: &Pose3) -> Vec<f64> {
            M::from_space(center).offsets_to(&M::from_space(pose)).as_slice().to_vec()
        }
        let center = self.clouds.to_relative("T_center", T_center)?;
        let pose = self.clouds.to_relative("T_target_source", T_target_source)?;
        let is_planar = self.is_planar();
        Ok(if is_planar { between::<Pose2>(&center, &pose) } else { between::<Pose3>(&center, &pose) })
    }

    /// The cost at every node of a grid over two unknowns, row by row (m^2): see [`landscape`].
    ///
    /// # Errors
    /// When the grid does not fit.
    pub fn cost_landscape(&self, options: &GridOptions) -> Result<Vec<f64>> {
        let center = self.clouds.to_relative("T_center", &options.T_center)?;
        Ok(match &self.clouds.problem {
            CloudProblem::Plane(problem, _) => {
                let grid = Grid::new(&center, options, 2..=2)?;
                landscape::planar_costs(problem.every(options.stride).as_ref(), &grid, self.clouds.table())
            }
            CloudProblem::Space(problem, _) => {
                let grid = Grid::new(&center, options, 2..=2)?;
                landscape::costs(problem.every(options.stride).as_ref(), &grid)
            }
        })
    }

    /// The results of registrations that start at every node of a grid over one to three unknowns: see [`basin`].
    ///
    /// # Errors
    /// When the grid does not fit.
    pub fn basin_of_attraction(&self, options: &GridOptions) -> Result<Ends> {
        let center = self.clouds.to_relative("T_center", &options.T_center)?;
        let rows = |pose: &Pose3| self.clouds.to_absolute(pose);
        either!(self, |problem, _guess| {
            let grid = Grid::new(&center, options, 1..=3)?;
            basin::ends(problem.every(options.stride).as_ref(), &grid, &rows)
        })
    }

    /// The levels of the correlative search around a centre. `window`: half widths in x and y (m) and in rotation (rad).
    ///
    /// # Errors
    /// When the clouds are not planar, the centre is not a rigid motion, or the window is negative or too large.
    pub fn search_path(&self, T_center: &[f64; 16], window: SearchWindow) -> Result<Vec<SearchedBlock>> {
        let CloudProblem::Plane(problem, _) = &self.clouds.problem else {
            let problem = "The correlative search is for planar clouds, and these are clouds in space";
            return Err(Error::whole(problem, "Give two planar scans"));
        };
        let window = window.checked()?;
        let target: Vec<Vector2<f64>> = problem.target_points().into_iter().map(|(point, _)| point).collect();
        let center = Pose2::from_space(&self.clouds.to_relative("T_center", T_center)?);
        Ok(LikelihoodGrid::new(&target).window(problem.source_points(), &center, window).path())
    }

    /// Groups results by minimum: see [`basin`]. `reference` is a pose in the basin of the minimum that is taken as right.
    ///
    /// # Errors
    /// When a pose is not a rigid motion.
    pub fn label_ends(&self, ends: &Ends, reference: &[f64; 16]) -> Result<Basin> {
        let reference = self.clouds.to_relative("reference", reference)?;
        let to_relative = |rows: &[f64; 16]| self.clouds.to_relative("T_target_source", rows);
        either!(self, |problem, _guess| basin::labelled(problem, ends, &reference, &to_relative))
    }
}
