//! Our k-d tree beside kiddo's, on the clouds that registration searches: planar scans, a lidar's cloud, the surfels of a depth image.

use std::hint::black_box;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use scanstitch::io::ply;
use scanstitch::search::{KdTree, Neighbor};

use crate::benchmark::{Files, Prepared};
use crate::spatial::surfels_of;

/// Radius of a search for all neighbours, in mean spacings of a surface's points: about 30 of them lie within it.
const RADIUS_SPACINGS: f32 = 3.0;

#[derive(Clone, Copy)]
pub enum Query {
    Nearest,
    Radius,
}

/// An index of points that both libraries offer.
pub trait Index<const D: usize>: Sized + 'static {
    /// What a search within a radius fills.
    type Found: Default + 'static;
    fn build(points: &[[f32; D]]) -> Self;
    /// Index and squared distance (m^2).
    fn nearest(&self, query: &[f32; D]) -> (u32, f32);
    /// Without an order, into `found`; how many there are.
    fn within(&self, query: &[f32; D], radius: f32, found: &mut Self::Found) -> usize;
}

impl<const D: usize> Index<D> for KdTree<D> {
    type Found = Vec<Neighbor>;

    fn build(points: &[[f32; D]]) -> Self {
        Self::build(points)
    }

    fn nearest(&self, query: &[f32; D]) -> (u32, f32) {
        self.nearest(query, f32::INFINITY).map_or((u32::MAX, 0.0), |neighbor| (neighbor.index, neighbor.sq_distance))
    }

    fn within(&self, query: &[f32; D], radius: f32, found: &mut Self::Found) -> usize {
        self.within(query, radius, found);
        found.len()
    }
}

impl<const D: usize> Index<D> for ImmutableKdTree<f32, D> {
    type Found = ();

    fn build(points: &[[f32; D]]) -> Self {
        Self::new_from_slice(points).expect("finite points, fewer than 2^32")
    }

    fn nearest(&self, query: &[f32; D]) -> (u32, f32) {
        let found = self.query(query).nearest_one::<SquaredEuclidean<f32>>().execute();
        (found.item, found.distance)
    }

    fn within(&self, query: &[f32; D], radius: f32, (): &mut ()) -> usize {
        self.query(query).within::<SquaredEuclidean<f32>>(radius * radius).unsorted().execute().len()
    }
}

/// Indexed points and queries, in the plane where all of them lie in it.
enum Clouds {
    Planar { points: Vec<[f32; 2]>, queries: Vec<[f32; 2]> },
    Spatial { points: Vec<[f32; 3]>, queries: Vec<[f32; 3]> },
}

impl Clouds {
    fn read(files: &Files) -> Result<Self, String> {
        let clouds = files.iter().map(|(name, bytes)| read(name, bytes)).collect::<Result<Vec<_>, _>>()?;
        let (queries, clouds) = clouds.split_last().ok_or("no cloud was given")?;
        let points = clouds.concat();
        Ok(if points.iter().chain(queries).all(|point| point[2] == 0.0) {
            let in_plane = |points: &[[f32; 3]]| points.iter().map(|&[x, y, _]| [x, y]).collect();
            Self::Planar { points: in_plane(&points), queries: in_plane(queries) }
        } else {
            Self::Spatial { points, queries: queries.clone() }
        })
    }
}

/// The finite points of a PLY file, or the surfels of a depth image.
fn read(name: &str, bytes: &[u8]) -> Result<Vec<[f32; 3]>, String> {
    let points: Vec<[f32; 3]> = if name.ends_with(".ply") {
        let cloud = ply::read(bytes).map_err(|error| error.in_file(name).to_string())?;
        bytemuck::cast_slice(&cloud.positions).to_vec()
    } else {
        surfels_of(&vec![(name.into(), bytes.into())])?
            .surfels()
            .map(|surfel| surfel.point.cast::<f32>().into())
            .collect()
    };
    Ok(points.into_iter().filter(|point| point.iter().all(|x| x.is_finite())).collect())
}

pub fn build<Planar: Index<2>, Spatial: Index<3>>(files: &Files) -> Result<Prepared, String> {
    Ok(match Clouds::read(files)? {
        Clouds::Planar { points, .. } => time_build::<2, Planar>(points),
        Clouds::Spatial { points, .. } => time_build::<3, Spatial>(points),
    })
}

fn time_build<const D: usize, I: Index<D>>(points: Vec<[f32; D]>) -> Prepared {
    Prepared {
        work: Some((points.len() as f64, "points")),
        run: Box::new(move || {
            black_box(I::build(black_box(&points)));
        }),
    }
}

pub fn query<Planar: Index<2>, Spatial: Index<3>>(files: &Files, kind: Query) -> Result<Prepared, String> {
    match Clouds::read(files)? {
        Clouds::Planar { points, queries } => time_query::<2, Planar>(&points, queries, kind),
        Clouds::Spatial { points, queries } => time_query::<3, Spatial>(&points, queries, kind),
    }
}

/// Times the searches, after a check that they find what our tree finds.
fn time_query<const D: usize, I: Index<D>>(
    points: &[[f32; D]],
    queries: Vec<[f32; D]>,
    kind: Query,
) -> Result<Prepared, String> {
    let (index, ours) = (I::build(points), KdTree::build(points));
    let radius = RADIUS_SPACINGS * median_spacing(points, &ours);
    let (mut found, mut expected) = (I::Found::default(), Vec::new());
    for query in &queries {
        ours.within(query, radius, &mut expected);
        let nearest = ours.nearest(query, f32::INFINITY).map_or(0.0, |nearest| nearest.sq_distance);
        let is_same = match kind {
            // Libraries sum the squares in different orders.
            Query::Nearest => (index.nearest(query).1 - nearest).abs() <= 1e-5 * nearest,
            Query::Radius => index.within(query, radius, &mut found).abs_diff(expected.len()) <= 1,
        };
        if !is_same {
            return Err(format!("the search at {query:?} has another result than our k-d tree"));
        }
    }
    Ok(Prepared {
        work: Some((queries.len() as f64, "queries")),
        run: Box::new(move || {
            for query in &queries {
                match kind {
                    Query::Nearest => drop(black_box(index.nearest(black_box(query)))),
                    Query::Radius => drop(black_box(index.within(black_box(query), radius, &mut found))),
                }
            }
        }),
    })
}

/// Median distance of a point to its nearest neighbour at another place (m).
fn median_spacing<const D: usize>(points: &[[f32; D]], tree: &KdTree<D>) -> f32 {
    let mut found = Vec::new();
    let mut spacings: Vec<f32> = points
        .iter()
        .filter_map(|point| {
            tree.k_nearest(point, f32::INFINITY, 4, &mut found);
            found.iter().map(|neighbor| neighbor.sq_distance).find(|&sq_distance| sq_distance > 0.0)
        })
        .collect();
    spacings.sort_unstable_by(f32::total_cmp);
    spacings.get(spacings.len() / 2).map_or(0.0, |sq_distance| sq_distance.sqrt())
}
