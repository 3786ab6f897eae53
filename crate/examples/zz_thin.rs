use glam::Vec3;
use scanstitch::cloud_odometry::*;
use scanstitch::geometry::PointCloud;
use scanstitch::io::depth_png;
use scanstitch::preprocess::estimate_normals::*;
use scanstitch::preprocess::voxel_downsample::*;
use scanstitch::registration::global::fpfh::*;
use scanstitch::registration::global::matching::*;
use scanstitch::search::*;
fn back(path: &str) -> PointCloud {
    let image = depth_png::read(&std::fs::read(path).unwrap()).unwrap();
    PointCloud::from_positions(
        image
            .values
            .iter()
            .enumerate()
            .filter(|(_, v)| **v > 0)
            .map(|(i, &v)| {
                let z = f32::from(v) * 10. / 255.;
                Vec3::new(((i % 512) as f32 - 256.) / 256. * z, ((i / 512) as f32 - 256.) / 256. * z, z)
            })
            .collect(),
    )
}
fn cpu() -> f64 {
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .unwrap()
        .split_whitespace()
        .next()
        .unwrap()
        .parse::<f64>()
        .unwrap()
        * 1e-6
}
fn best<T>(mut f: impl FnMut() -> T) -> (f64, T) {
    let mut b = f64::MAX;
    let mut r = None;
    for _ in 0..7 {
        std::thread::yield_now();
        let t = cpu();
        r = Some(f());
        b = b.min(cpu() - t);
    }
    (b, r.unwrap())
}
fn main() {
    for (fl, i) in [("second", 40), ("first", 50)] {
        let o = CloudOptions::course(0.05);
        let path = |k: i32| format!("../shared/data/rgbd/apartment_{fl}_floor/depth/{k}.png");
        let c = back(&path(i));
        let (tv, v) = best(|| voxel_downsample(&c, 0.05).unwrap());
        let (tt, tree) = best(|| KdTree::build(bytemuck::cast_slice(&v.positions)));
        let nb = Neighbourhood { max_neighbors: 30, radius: 0.1 };
        let (tn, n) = best(|| estimate_normals(&v.positions, &tree, nb, glam::DVec3::ZERO));
        let (tn20, _) = best(|| {
            estimate_normals(
                &v.positions,
                &tree,
                Neighbourhood { max_neighbors: 20, radius: f64::INFINITY },
                glam::DVec3::ZERO,
            )
        });
        println!("{} -> {}: voxel {tv:.1} tree {tt:.1} normals30/r {tn:.1} normals20 {tn20:.1}", c.len(), v.len());
        let nf = Neighbourhood { max_neighbors: 100, radius: 0.25 };
        let (tf, f) = best(|| fpfh(&v.positions, &n, &tree, nf));
        let mut out = vec![];
        let mut tot = 0;
        let (tw, _) = best(|| {
            tot = 0;
            for p in &v.positions {
                tree.within(&p.to_array(), 0.25, &mut out);
                tot += out.len();
            }
        });
        println!("fpfh {tf:.1} (within alone {tw:.1}, {:.1} each)", tot as f64 / v.len() as f64);
        let p = PreparedCloud::new(&back(&path(i + 1)), &o).unwrap();
        let f2 = fpfh(&p.cloud().positions, p.target().normals(), p.target().tree(), nf);
        let (ti, ia) = best(|| FeatureIndex::new(f.clone()));
        let ib = FeatureIndex::new(f2.clone());
        let (t1, _) = best(|| f2.iter().map(|x| u64::from(ia.nearest(x, f32::MAX).unwrap_or(0))).sum::<u64>());
        let (tm, m) = best(|| mutual_matches(&ib, &ia));
        println!("index {ti:.1} forward {t1:.1} mutual {tm:.1}: {}", m.len());
    }
}
