//! The stages of a reconstruction in space, each on frames that are given as files.
#![allow(clippy::needless_pass_by_value, clippy::unnecessary_wraps, reason = "benchmarks are all of one type")]

use std::hint::black_box;

use glam::DVec3;
use scanstitch::Error;
#[cfg(feature = "peers")]
use scanstitch::camera::SurfelImage;
use scanstitch::camera::{DepthImage, DepthScale, Pinhole};
use scanstitch::geometry::{PointCloud, Pose3};
use scanstitch::io::{color_image, depth_image, ply};
use scanstitch::map::voxel::VoxelMap;
use scanstitch::odometry::cloud::{CloudOptions, PreparedCloud};
use scanstitch::odometry::depth::{DepthOdometry, DepthOptions};
use scanstitch::pipeline::prepared_frame::{ColorFile, DecodeConfig, FrameLabel, MapPoints, PreparedFrame, Surfaces};
use scanstitch::pipeline::spatial_settings::SpatialSettings;
use scanstitch::preprocess::depth_cloud::depth_cloud;
use scanstitch::preprocess::depth_surfels::{DepthModel, depth_surfels};
use scanstitch::preprocess::estimate_normals::estimate_normals;
use scanstitch::preprocess::voxel_downsample::voxel_downsample;
use scanstitch::preprocess::wrap_around::usable_pixels;
use scanstitch::registration::global::{DescribedCloud, GlobalMethod, register_globally};
use scanstitch::registration::icp::{Criteria, IcpOptions, Rejection, Weighting, register};
use scanstitch::registration::robust_kernel::RobustKernel;
use scanstitch::registration::solver::Motion;
use scanstitch::registration::spatial::{SpatialMetric, register_in_space};
use scanstitch::registration::voxelized::{GaussianVoxels, PlaneToVoxel};
use scanstitch::search::{KdTree, Neighborhood};

use crate::benchmark::{Benchmark, Files, Prepared};

/// The stages of depth frames: the files are depth and colour images, turn about.
pub const DEPTH_BENCHMARKS: &[Benchmark] = &[
    Benchmark { name: "depth_decode", about: "decoding a depth image", prepare: decode_depth },
    Benchmark { name: "color_decode", about: "decoding a colour image", prepare: decode_color },
    Benchmark { name: "depth_back_project", about: "every pixel to a point", prepare: back_project },
    Benchmark { name: "depth_surfels", about: "surfaces with normals from the image grid", prepare: surfels },
    Benchmark {
        name: "depth_prepare",
        about: "all of a frame that needs no other: decoding to surfaces and map points",
        prepare,
    },
    Benchmark { name: "depth_voxels", about: "the points of an image to voxels of 5 cm", prepare: voxels },
    Benchmark { name: "depth_normals", about: "normals of these from 30 neighbours", prepare: normals },
    Benchmark { name: "depth_features", about: "FPFH features of these from 100 neighbours", prepare: features },
    Benchmark { name: "depth_global", about: "matching features, and a motion without a guess", prepare: global },
    Benchmark { name: "depth_local", about: "registering a frame to the map of those before it", prepare: local },
    Benchmark { name: "depth_map", about: "adding a frame to the stitched map, voxels of 2 cm", prepare: map },
];

/// Registration alone: the files are the source and the target of a pair of clouds, voxels of 25 cm.
pub const PAIR_BENCHMARKS: &[Benchmark] = &[
    Benchmark { name: "pair_prepare", about: "voxels of 25 cm, index and normals of a cloud", prepare: pair_prepare },
    Benchmark {
        name: "pair_point_to_plane",
        about: "point to plane from the identity, prepared",
        prepare: |files| pair_align(&files, SpatialMetric::PointToPlane),
    },
    Benchmark {
        name: "pair_gicp",
        about: "plane to plane from the identity, prepared",
        prepare: |files| pair_align(&files, SpatialMetric::Gicp),
    },
    Benchmark {
        name: "pair_vgicp",
        about: "plane to voxels of 1 m from the identity, prepared",
        prepare: |files| pair_vgicp(&files),
    },
];

type Outcome = Result<Prepared, String>;

fn words(error: Error) -> String {
    error.to_string()
}

/// One run works through one frame.
fn frame(run: impl FnMut() + 'static) -> Outcome {
    Ok(Prepared { work: Some((1.0, "frames")), run: Box::new(run) })
}

/// A decoded frame with its camera and options.
struct Decoded {
    image: DepthImage,
    usable: Vec<bool>,
    camera: Pinhole,
    model: DepthModel,
}

fn decoded(files: &Files) -> Result<Decoded, String> {
    let (_, bytes) = files.first().ok_or("no frame was given")?;
    let image = depth_image::read(bytes).map_err(words)?;
    let usable = usable_pixels(&image);
    let DepthScale { step, sensor, .. } = DepthScale::estimate(&image);
    let camera = SpatialSettings::default().camera(image.width, image.height, image.bits, sensor).map_err(words)?;

    let square_noise = if image.bits > 8 { 2e-3 } else { 0.0 };
    let model = DepthModel { step, offset: 0.5, square_noise, min_range: 0.1, max_range: 10.0 };
    Ok(Decoded { image, usable, camera, model })
}

fn decode_depth(files: Files) -> Outcome {
    decoded(&files)?;
    frame(move || {
        black_box(depth_image::read(black_box(&files[0].1)).ok());
    })
}

fn decode_color(files: Files) -> Outcome {
    let (_, bytes) = files.into_iter().nth(1).ok_or("no colour image was given")?;
    color_image::read(&bytes).map_err(words)?;
    frame(move || {
        black_box(color_image::read(black_box(&bytes)).ok());
    })
}

fn cloud_of(frame: &Decoded) -> PointCloud {
    depth_cloud(&frame.image, &frame.usable, &frame.camera, &frame.model, None)
}

fn back_project(files: Files) -> Outcome {
    let decoded = decoded(&files)?;
    frame(move || {
        black_box(cloud_of(black_box(&decoded)));
    })
}

/// The surfels of the first depth image.
#[cfg(feature = "peers")]
pub fn surfels_of(files: &Files) -> Result<SurfelImage, String> {
    let Decoded { image, usable, camera, model } = decoded(files)?;
    Ok(depth_surfels(&image, &usable, &camera, &model))
}

fn surfels(files: Files) -> Outcome {
    let Decoded { image, usable, camera, model } = decoded(&files)?;
    frame(move || {
        black_box(depth_surfels(black_box(&image), &usable, &camera, &model));
    })
}

/// The given frames, prepared with the default settings.
fn prepared(files: &Files) -> Result<(DecodeConfig, Vec<PreparedFrame>), String> {
    let (name, first) = files.first().ok_or("no frame was given")?;
    let decode_config = DecodeConfig::new(&SpatialSettings::default(), name, first).map_err(words)?;
    let frames = files.chunks(2).enumerate().map(|(index, pair)| prepare_one(&decode_config, index, pair));
    let frames = frames.collect::<Result<_, _>>()?;
    Ok((decode_config, frames))
}

fn prepare_one(
    decode_config: &DecodeConfig,
    index: usize,
    pair: &[(String, Vec<u8>)],
) -> Result<PreparedFrame, String> {
    let color = pair.get(1).map(|(name, bytes)| ColorFile { name, bytes: Ok(bytes) });
    let label = FrameLabel { name: pair[0].0.clone(), index, time: None };
    PreparedFrame::from_depth(decode_config, label, &pair[0].1, color).map_err(words)
}

/// A frame prepared as most of a recording are: after the quantisation of its depth is known.
fn prepare(files: Files) -> Outcome {
    let (mut decode_config, _) = prepared(&files)?;
    if let Some(depth) = &mut decode_config.depth {
        depth.decided = depth.quantisations.first().copied();
    }
    frame(move || {
        black_box(prepare_one(black_box(&decode_config), 0, &files[..2]).ok());
    })
}

const VOXEL_SIZE: f64 = 0.05;

fn voxels(files: Files) -> Outcome {
    let cloud = cloud_of(&decoded(&files)?);
    voxel_downsample(&cloud, VOXEL_SIZE).map_err(words)?;
    frame(move || {
        black_box(voxel_downsample(black_box(&cloud), VOXEL_SIZE).ok());
    })
}

fn thinned(files: &Files) -> Result<(PointCloud, KdTree<3>), String> {
    let cloud = voxel_downsample(&cloud_of(&decoded(files)?), VOXEL_SIZE).map_err(words)?;
    let tree = KdTree::build(bytemuck::cast_slice(&cloud.positions));
    Ok((cloud, tree))
}

const NORMAL_NEIGHBOURS: Neighborhood = Neighborhood { max_neighbors: 30, radius: 2.0 * VOXEL_SIZE };
const FEATURE_NEIGHBOURS: Neighborhood = Neighborhood { max_neighbors: 100, radius: 5.0 * VOXEL_SIZE };

fn normals(files: Files) -> Outcome {
    let (cloud, tree) = thinned(&files)?;
    frame(move || {
        black_box(estimate_normals(black_box(&cloud.positions), &tree, NORMAL_NEIGHBOURS, DVec3::ZERO));
    })
}

fn described(files: &Files) -> Result<impl Fn() -> DescribedCloud + 'static, String> {
    let (cloud, tree) = thinned(files)?;
    let normals = estimate_normals(&cloud.positions, &tree, NORMAL_NEIGHBOURS, DVec3::ZERO);
    Ok(move || DescribedCloud::new(black_box(&cloud.positions), &normals, &tree, FEATURE_NEIGHBOURS))
}

fn features(files: Files) -> Outcome {
    let describe = described(&files)?;
    frame(move || {
        black_box(describe());
    })
}

fn global(files: Files) -> Outcome {
    let target = described(&files)?();
    let (_, target_tree) = thinned(&files)?;
    let source = described(&files.into_iter().skip(2).collect())?();
    frame(move || {
        let method = GlobalMethod::Consistency;
        black_box(register_globally(black_box(&source), &target, &target_tree, method, 1.5 * VOXEL_SIZE).ok());
    })
}

/// Of the frames given, all but the last make the map; the last is registered and not added.
fn local(files: Files) -> Outcome {
    let (_, frames) = prepared(&files)?;
    let mut frames = frames.into_iter().filter_map(|frame| match frame.surfaces {
        Surfaces::Surfels(images) => images.into_iter().next().map(|(_, surfels)| surfels),
        Surfaces::Cloud(_) => None,
    });
    let last = frames.next_back().ok_or("no frame was given")?;
    let mut odometry = DepthOdometry::new(DepthOptions::default());
    for surfels in frames {
        odometry.register_frame(&surfels);
    }
    frame(move || {
        black_box(odometry.clone().register_frame(black_box(&last)));
    })
}

fn map(files: Files) -> Outcome {
    let (_, frames) = prepared(&files)?;
    let MapPoints::Image(image, _) = &frames[0].map_points else { return Err("this is no depth image".into()) };
    let image = image.clone();
    frame(move || {
        let mut map = VoxelMap::new(0.02);
        map.insert(&black_box(&image).cloud(0.0), &Pose3::identity(), 0, f64::MAX);
        black_box(map);
    })
}

const PAIR_VOXEL: f64 = 0.25;

fn pair_options() -> CloudOptions {
    CloudOptions { normals: Neighborhood { max_neighbors: 10, radius: f64::INFINITY }, ..CloudOptions::new(PAIR_VOXEL) }
}

fn pair_prepare(files: Files) -> Outcome {
    let (name, bytes) = files.first().ok_or("no cloud was given")?;
    let cloud = ply::read(bytes).map_err(|error| words(error.in_file(name)))?;
    let cloud = PointCloud::from_positions(cloud.positions);
    PreparedCloud::new(&cloud, &pair_options()).map_err(words)?;
    frame(move || {
        black_box(PreparedCloud::new(black_box(&cloud), &pair_options()).ok());
    })
}

fn pair_align(files: &Files, metric: SpatialMetric) -> Outcome {
    let [source, target] = prepared_pair(files)?;
    frame(move || {
        let (source, target, solver) = (black_box(&source), target.target(), Motion::Free.solver());
        black_box(register_in_space(metric, source.source(), target, Pose3::identity(), (&PAIR_ICP, &[]), &solver));
    })
}

fn pair_vgicp(files: &Files) -> Outcome {
    let [source, target] = prepared_pair(files)?;
    let target = GaussianVoxels::new(target.target().points(), target.target().normals(), 1.0);
    frame(move || {
        let source = black_box(&source).source();
        black_box(register(source, &target, Pose3::identity(), &PlaneToVoxel, &PAIR_ICP));
    })
}

fn prepared_pair(files: &Files) -> Result<[PreparedCloud; 2], String> {
    let [source, target] = [0, 1].map(|index| {
        let (name, bytes) = files.get(index).ok_or("two clouds are needed")?;
        let cloud = ply::read(bytes).map_err(|error| words(error.in_file(name)))?;
        PreparedCloud::new(&PointCloud::from_positions(cloud.positions), &pair_options()).map_err(words)
    });
    Ok([source?, target?])
}

/// The defaults of small_gicp.
const PAIR_ICP: IcpOptions = IcpOptions {
    rejection: Rejection {
        max_correspondence_distance: 1.0,
        max_normal_angle: std::f64::consts::PI,
        trim_fraction: 0.0,
    },
    weighting: Weighting { robust_kernel: RobustKernel::None, robust_kernel_width: 1.0 },
    // 0.1 degrees.
    criteria: Criteria { max_iterations: 20, rotation_eps: std::f64::consts::PI / 1800.0, translation_eps: 1e-3 },
};
