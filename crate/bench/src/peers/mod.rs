//! Other libraries beside ours: kiddo beside our k-d tree, faer beside our sparse Cholesky factorisation.

mod cholesky;
mod neighbours;

use scanstitch::geometry::{Pose2, Pose3};
use scanstitch::search::KdTree;

use self::cholesky::{Work, faer, ours};
use self::neighbours::{Query, build, query};
use crate::benchmark::Benchmark;

type Kiddo<const D: usize> = kiddo::ImmutableKdTree<f32, D>;

/// Neighbours: the last file holds the queries; the points of the others are indexed. Cholesky: `all` is ordering, symbolic and
/// numeric factorisation and solution, `numbers` the last two, as in all iterations but the first. faer gets its matrix
/// ready made.
pub const PEER_BENCHMARKS: &[Benchmark] = &[
    Benchmark {
        name: "neighbours_build",
        about: "building our k-d tree",
        prepare: |files| build::<KdTree<2>, KdTree<3>>(&files),
    },
    Benchmark {
        name: "neighbours_build_kiddo",
        about: "building kiddo's k-d tree",
        prepare: |files| build::<Kiddo<2>, Kiddo<3>>(&files),
    },
    Benchmark {
        name: "neighbours_nearest",
        about: "nearest neighbours by our k-d tree",
        prepare: |files| query::<KdTree<2>, KdTree<3>>(&files, Query::Nearest),
    },
    Benchmark {
        name: "neighbours_nearest_kiddo",
        about: "nearest neighbours by kiddo's k-d tree",
        prepare: |files| query::<Kiddo<2>, Kiddo<3>>(&files, Query::Nearest),
    },
    Benchmark {
        name: "neighbours_radius",
        about: "all neighbours within three spacings by our k-d tree",
        prepare: |files| query::<KdTree<2>, KdTree<3>>(&files, Query::Radius),
    },
    Benchmark {
        name: "neighbours_radius_kiddo",
        about: "all neighbours within three spacings by kiddo's k-d tree",
        prepare: |files| query::<Kiddo<2>, Kiddo<3>>(&files, Query::Radius),
    },
    Benchmark {
        name: "cholesky_all_1000_se2",
        about: "ordering, factoring and solving the equations of 1000 poses by our sparse Cholesky",
        prepare: |_| ours::<Pose2>(1000, Work::All),
    },
    Benchmark {
        name: "cholesky_all_1000_se2_faer",
        about: "ordering, factoring and solving the equations of 1000 poses by faer's sparse Cholesky",
        prepare: |_| faer::<Pose2>(1000, Work::All),
    },
    Benchmark {
        name: "cholesky_numbers_1000_se2",
        about: "factoring and solving again the equations of 1000 poses by our sparse Cholesky",
        prepare: |_| ours::<Pose2>(1000, Work::Numbers),
    },
    Benchmark {
        name: "cholesky_numbers_1000_se2_faer",
        about: "factoring and solving again the equations of 1000 poses by faer's sparse Cholesky",
        prepare: |_| faer::<Pose2>(1000, Work::Numbers),
    },
    Benchmark {
        name: "cholesky_all_1000_se3",
        about: "ordering, factoring and solving the equations of 1000 poses by our sparse Cholesky",
        prepare: |_| ours::<Pose3>(1000, Work::All),
    },
    Benchmark {
        name: "cholesky_all_1000_se3_faer",
        about: "ordering, factoring and solving the equations of 1000 poses by faer's sparse Cholesky",
        prepare: |_| faer::<Pose3>(1000, Work::All),
    },
    Benchmark {
        name: "cholesky_numbers_1000_se3",
        about: "factoring and solving again the equations of 1000 poses by our sparse Cholesky",
        prepare: |_| ours::<Pose3>(1000, Work::Numbers),
    },
    Benchmark {
        name: "cholesky_numbers_1000_se3_faer",
        about: "factoring and solving again the equations of 1000 poses by faer's sparse Cholesky",
        prepare: |_| faer::<Pose3>(1000, Work::Numbers),
    },
    Benchmark {
        name: "cholesky_all_7000_se2",
        about: "ordering, factoring and solving the equations of 7000 poses by our sparse Cholesky",
        prepare: |_| ours::<Pose2>(7000, Work::All),
    },
    Benchmark {
        name: "cholesky_all_7000_se2_faer",
        about: "ordering, factoring and solving the equations of 7000 poses by faer's sparse Cholesky",
        prepare: |_| faer::<Pose2>(7000, Work::All),
    },
    Benchmark {
        name: "cholesky_numbers_7000_se2",
        about: "factoring and solving again the equations of 7000 poses by our sparse Cholesky",
        prepare: |_| ours::<Pose2>(7000, Work::Numbers),
    },
    Benchmark {
        name: "cholesky_numbers_7000_se2_faer",
        about: "factoring and solving again the equations of 7000 poses by faer's sparse Cholesky",
        prepare: |_| faer::<Pose2>(7000, Work::Numbers),
    },
];
