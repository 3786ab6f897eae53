//! What the lab shows is what the engine does.

use std::path::{Path, PathBuf};

use scanstitch::geometry::PointCloud;
use scanstitch::io::point_cloud;
use scanstitch::pipeline::planar::Reconstruction;
use scanstitch::pipeline::report::Stage;
use scanstitch::pipeline::settings::Settings;
use scanstitch::registration::CloudMetric::{self, Gicp, PointToLine, PointToPlane, PointToPoint, Vgicp};
use scanstitch::registration::RegistrationOptions;
use scanstitch::registration::align::{StepMethod, register_clouds};
use scanstitch::registration::lab::IcpLab;
use scanstitch::registration::lab::basin::Ends;
use scanstitch::registration::lab::grid::GridOptions;
use scanstitch::registration::lab::iteration::TracedIteration;
use scanstitch::registration::robust_kernel::RobustKernel;

/// Two clouds and how to register them.
#[derive(Clone)]
struct Pair {
    name: String,
    source: PointCloud,
    target: PointCloud,
    options: RegistrationOptions,
}

fn cloud(path: &Path) -> PointCloud {
    point_cloud::read(&std::fs::read(path).expect("readable")).expect("a cloud")
}

fn corridor() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("www/samples/corridor")
}

/// A folder of the recordings, where they are at hand: a test that does without them is not skipped.
fn recorded(path: &str) -> Option<PathBuf> {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    data.exists().then(|| data.join(path))
}

fn pair(folder: &Path, [source, target]: [&str; 2], options: RegistrationOptions) -> Pair {
    let name = format!("{} {options:?}", folder.display());
    Pair { name, source: cloud(&folder.join(source)), target: cloud(&folder.join(target)), options }
}

fn with_metric(metric: CloudMetric) -> RegistrationOptions {
    RegistrationOptions { metric: Some(metric), ..RegistrationOptions::default() }
}

/// Every metric in the plane.
fn planar_pairs() -> Vec<Pair> {
    let trimmed =
        RegistrationOptions { trim_fraction: 0.2, robust_kernel: RobustKernel::Huber, ..with_metric(PointToLine) };
    let gauss_newton = RegistrationOptions { step: Some(StepMethod::GaussNewton), ..with_metric(PointToPoint) };
    let searched = RegistrationOptions { search_translation: 0.5, search_rotation: 0.3, ..with_metric(PointToLine) };
    [with_metric(PointToLine), with_metric(PointToPoint), trimmed, gauss_newton, searched]
        .into_iter()
        .flat_map(|options| {
            let zju = recorded("laser/zju10").map(|folder| pair(&folder, ["1.ply", "0.ply"], options.clone()));
            zju.into_iter().chain([pair(&corridor(), ["3.ply", "2.ply"], options)])
        })
        .collect()
}

/// Every metric in space, where the recordings are at hand.
fn spatial_pairs() -> Vec<Pair> {
    let kitti = recorded("lidar/kitti_pair");
    let thinned =
        |metric| RegistrationOptions { voxel_size: 0.5, max_correspondence_distance: 1.0, ..with_metric(metric) };
    let of_kitti = |folder: PathBuf| {
        [PointToPoint, PointToPlane, Gicp, Vgicp]
            .map(|metric| pair(&folder, ["source.ply", "target.ply"], thinned(metric)))
            .to_vec()
    };
    kitti.map(of_kitti).unwrap_or_default()
}

#[test]
fn the_trace_is_the_way_of_register() {
    for Pair { name, source, target, options } in planar_pairs().into_iter().chain(spatial_pairs()) {
        let expected = register_clouds(&source, &target, &options).expect("registered");
        let mut lab = IcpLab::new(&source, &target, &options).expect("a lab");
        let trace = lab.trace(None).expect("a trace");
        assert_eq!(trace.poses.last(), Some(&expected.T_target_source), "{name}");
        assert_eq!((trace.records.clone(), trace.end_reason), (expected.history, expected.end_reason), "{name}");
        assert_eq!((trace.poses.len(), trace.costs.len()), (expected.iterations, expected.iterations + 1), "{name}");
        assert!(expected.iterations > 3, "{name}: {}", expected.iterations);
        for (index, record) in trace.records.iter().enumerate() {
            let iteration = lab.traced_iteration(index).expect("an iteration");
            assert_eq!(iteration.summary.T_next, trace.poses[index], "{name}, iteration {index}");
            assert_eq!(iteration.summary.inlier_rmse, record.inlier_rmse, "{name}, iteration {index}");
            assert_eq!(iteration.summary.cost, trace.costs[index], "{name}, iteration {index}");
            assert_eq!(iteration.source.len(), record.num_inliers, "{name}, iteration {index}");
            let all = iteration.source.len() + iteration.rejected_source.len();
            assert_eq!(all, lab.source_points().len() / 3, "{name}: every point has a say or a reason");
        }
    }
}

/// A grid around the end of a registration.
fn grid(center: [f64; 16], axes: &[usize], half_widths: &[f64], size: &[usize]) -> GridOptions {
    GridOptions {
        T_center: center,
        axes: axes.to_vec(),
        half_widths: half_widths.to_vec(),
        size: size.to_vec(),
        rows: None,
        stride: 1,
    }
}

#[test]
fn a_matrix_that_is_no_rigid_motion_is_refused_by_its_name() {
    let Pair { source, target, .. } = pair(&corridor(), ["3.ply", "2.ply"], RegistrationOptions::default());
    let mut lab = IcpLab::new(&source, &target, &RegistrationOptions::default()).unwrap();
    let (skewed, center) = ([1.0; 16], lab.initial().unwrap());
    let errors = [
        ("T_center", lab.pose_at(&skewed, &[0.0; 3]).unwrap_err()),
        ("T_target_source", lab.offsets(&center, &skewed).unwrap_err()),
        ("T_center", lab.cost_landscape(&grid(skewed, &[1, 2], &[0.1; 2], &[3; 2])).unwrap_err()),
        ("reference", lab.label_ends(&Ends::default(), &skewed).unwrap_err()),
        ("init_T_target_source", lab.trace(Some(&skewed)).unwrap_err()),
    ];
    for (name, error) in errors {
        assert_eq!(error.problem, format!("{name} is not a rigid motion"));
    }
}

#[test]
fn a_landscape_is_the_cost_of_every_pose() {
    for Pair { name, source, target, options } in planar_pairs() {
        let mut lab = IcpLab::new(&source, &target, &options).expect("a lab");
        let end = *lab.trace(None).expect("a trace").poses.last().expect("an iteration");
        for axes in [[1, 2], [0, 1], [2, 0], [2, 1]] {
            let half_widths = axes.map(|axis| if axis == 0 { 1.0 } else { 2.0 });
            let grid = grid(end, &axes, &half_widths, &[31, 21]);
            let landscape = lab.cost_landscape(&grid).expect("a landscape");
            let halves = [[0, 8], [8, 21]].map(|rows| GridOptions { rows: Some(rows), ..grid.clone() });
            let halves = halves.map(|half| lab.cost_landscape(&half).expect("half a landscape"));
            assert_eq!(bits(&landscape), bits(&halves.concat()), "{name}: rows of workers, axes {axes:?}");
            for (row, column) in (0..21).flat_map(|row| (0..31).map(move |column| (row, column))) {
                let mut offsets = [0.0; 3];
                offsets[axes[0]] = half_widths[0] * (2.0 * column as f64 - 30.0) / 30.0;
                offsets[axes[1]] = half_widths[1] * (2.0 * row as f64 - 20.0) / 20.0;
                let pose = lab.pose_at(&end, &offsets).expect("a pose");
                let brute = lab.iteration(&pose).expect("an iteration").summary.cost;
                let found = landscape[row * 31 + column];
                // The pose as a matrix is rounded.
                let agrees = (brute - found).abs() <= 1e-12 || (brute.is_nan() && found.is_nan());
                assert!(agrees, "{name}, axes {axes:?}, node {column}, {row}: {found} {brute}");
            }
        }
    }
}

#[test]
fn a_sampled_iteration_has_the_pairs_of_its_points() {
    for Pair { name, source, target, options } in planar_pairs() {
        // Which residuals are trimmed depends on all of them.
        let lab = IcpLab::new(&source, &target, &RegistrationOptions { trim_fraction: 0.0, ..options }).expect("a lab");
        let start = lab.initial().expect("a guess");
        let whole = lab.iteration(&start).expect("an iteration");
        let sampled = lab.sampled_iteration(&start, 3).expect("an iteration");
        let pairs = |of: &TracedIteration| -> Vec<(u32, u32, u64)> {
            let pairs = of.source.iter().zip(&of.target).zip(&of.residual);
            pairs.map(|((&source, &target), residual)| (source, target, residual.to_bits())).collect()
        };
        let expected: Vec<_> = pairs(&whole).into_iter().filter(|(source, ..)| source % 3 == 0).collect();
        assert_eq!(pairs(&sampled), expected, "{name}");
        let left_out: Vec<u32> = whole.rejected_source.iter().copied().filter(|source| source % 3 == 0).collect();
        assert_eq!(sampled.rejected_source, left_out, "{name}");
        assert_eq!(sampled.summary.num_points, expected.len() + left_out.len(), "{name}");
        assert!(sampled.summary.cost > 0.0 && sampled.summary.cost.is_finite(), "{name}");
    }
}

#[test]
fn a_sampled_grid_is_that_of_its_points() {
    for Pair { name, source, target, options } in planar_pairs() {
        let lab = IcpLab::new(&source, &target, &RegistrationOptions { trim_fraction: 0.0, ..options }).expect("a lab");
        let start = lab.initial().expect("a guess");
        let sampled = GridOptions { stride: 3, ..grid(start, &[0, 1], &[0.2, 0.5], &[5, 3]) };
        let middle = lab.sampled_iteration(&start, 3).expect("an iteration").summary.cost;
        let landscape = lab.cost_landscape(&sampled).expect("a landscape");
        assert!((landscape[7] - middle).abs() <= 1e-12, "{name}: {} {middle}", landscape[7]);
        let ends = lab.basin_of_attraction(&sampled).expect("a basin");
        for (T, cost) in ends.T_target_source.iter().zip(&ends.cost) {
            let again = lab.sampled_iteration(T, 3).expect("an iteration").summary.cost;
            let agrees = (again - cost).abs() <= 1e-9 || (again.is_nan() && cost.is_nan());
            assert!(agrees, "{name}: {again} {cost}");
        }
        let none = lab.cost_landscape(&GridOptions { stride: 0, ..sampled }).expect_err("no points");
        assert!(none.to_string().contains("stride must be at least 1"), "{name}: {none}");
    }
}

#[test]
fn a_scan_is_looked_into_as_the_run_registered_it() {
    for folder in [recorded("laser/zju10"), Some(corridor())].into_iter().flatten() {
        let mut run = Reconstruction::new(Settings::default()).expect("settings");
        for i in 0..10 {
            run.add_scan(&format!("{i}.ply"), cloud(&folder.join(format!("{i}.ply")))).expect("a scan");
        }
        assert!(run.scan_to_map(1).is_none(), "nothing has been registered yet");
        while run.step().stage != Stage::Done {}
        assert!(run.scan_to_map(0).is_none() && run.scan_to_map(10).is_none());
        for frame in 1..10 {
            let pair = run.scan_to_map(frame).expect("registered");
            let options = RegistrationOptions {
                init_T_target_source: Some(pair.init_T_target_source),
                ..with_metric(PointToLine)
            };
            let looked_into = register_clouds(&pair.source, &pair.target, &options).expect("registered");
            let history = run.history(frame);
            assert_eq!(looked_into.history.len(), history.len(), "{} {frame}", folder.display());
            for (seen, done) in looked_into.history.iter().zip(history) {
                assert_eq!(seen.num_inliers, done.num_inliers, "{} {frame}", folder.display());
                // The points of the map are rounded to single precision.
                assert!((seen.inlier_rmse - done.inlier_rmse).abs() < 1e-6, "{seen:?} {done:?}");
            }
        }
    }
}

fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|x| x.to_bits()).collect()
}
