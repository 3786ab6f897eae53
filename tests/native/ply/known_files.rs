//! Files of other projects and recordings, of which is known what they hold.

use glam::{DVec3, Vec3};
use scanstitch::io::ply::read;

use crate::common::shared_data;

/// What an independent reader (Python's plyfile) or the eye says a file holds: name, points, first and last position,
/// whether there are normals and colours.
type Known = (&'static str, usize, [f64; 3], [f64; 3], bool, bool);

#[rustfmt::skip]
#[allow(clippy::unreadable_literal)]
const KNOWN: [Known; 25] = [
    ("assimp/cube.ply", 8, [0.0, 0.0, 0.0], [1.0, 1.0, 0.0], false, false),
    ("assimp/cube_binary.ply", 8, [0.0, 0.0, 0.0], [1.0, 1.0, 0.0], false, false),
    ("assimp/cube_binary_starts_with_nl.ply", 8, [5.967534065246582, 0.0, 0.0], [6.967534065246582, 1.0, 0.0], false, false),
    ("assimp/cube_uv.ply", 24, [1.0, 1.0, -1.0], [-1.0, 1.0, 1.0], true, false),
    ("assimp/float-color.ply", 3, [0.0, 0.0, 0.0], [200.0, 200.0, 0.0], false, true),
    ("assimp/points.ply", 4, [0.0, 0.0, 0.0], [0.0, 1.0, 1.0], true, true),
    ("happly/platonic_shelf.ply", 50, [-3.562626, -0.627972, 0.613591], [6.068807, 0.985759, 0.056527], false, false),
    ("happly/platonic_shelf_ascii.ply", 50, [-3.562626, -0.627972, 0.613591], [6.068807, 0.985759, 0.056527], false, false),
    ("loaders_gl/cube_att.ply", 24, [0.0, 0.0, 0.0], [1.0, 0.0, 1.0], true, false),
    ("open3d/color.ply", 3017, [0.4007812440395355, 0.3007468581199646, 0.4164062440395355], [0.4039062559604645, 0.3051159977912903, 0.43085938692092896], true, true),
    ("open3d/test_sample_ascii.ply", 7, [0.0, 8.40703010559082, 0.0], [0.1979999989271164, 8.380040168762207, -0.053054001182317734], false, false),
    ("open3d/test_sample_custom.ply", 7, [0.0, 8.40703010559082, 0.0], [0.1979999989271164, 8.380040168762207, -0.053054001182317734], false, false),
    // An intensity of 128 does not fit its type int8: a column that is stepped over.
    ("open3d/test_sample_wrong_format_v1.ply", 2, [0.0, 0.0, -1.0], [0.7236, -0.52572, -0.447215], true, false),
    // The coordinates are so large that they are kept relative to an origin.
    ("pdal/issue_2421.ply", 1, [1.23457, 12345.6789, 1234567890.12345], [1.23457, 12345.6789, 1234567890.12345], false, false),
    ("pdal/mesh.ply", 4, [1.0, 1.0, 0.0], [2.0, 2.0, 2.0], false, false),
    ("pdal/simple_binary.ply", 3, [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], false, false),
    ("pdal/simple_text.ply", 3, [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], false, false),
    // x and y alone.
    ("pdal/sized_dims.ply", 1, [1.0, 12346.0, 0.0], [1.0, 12346.0, 0.0], false, false),
    ("trimesh/metadata.ply", 4, [-4.0, -4.0, 0.0], [4.0, 4.0, 0.0], false, false),
    ("trimesh/ply_empty_ascii.ply", 0, [0.0; 3], [0.0; 3], true, false),
    ("trimesh/ply_points_ascii.ply", 8, [1.0, 1.0, 1.0], [1.0, 1.0, -1.0], false, false),
    // All normals are zero: none.
    ("trimesh/ply_points_bin.ply", 8, [1.0, 1.0, 1.0], [1.0, 1.0, -1.0], false, false),
    ("trimesh/points_ascii_with_lists.ply", 5, [-0.06324999779462814, 0.03597930073738098, 0.04208730161190033], [-0.06350000202655792, 0.03672889992594719, 0.04246620088815689], false, false),
    ("trimesh/points_emptyface.ply", 1024, [-86.01312255859375, 39.389984130859375, -32.027198791503906], [-63.021419525146484, -21.709869384765625, 1.6876213550567627], false, false),
    ("trimesh/sphere.ply", 642, [-0.5257310271263123, 0.8506510257720947, 0.0], [0.9129819869995117, 0.39960700273513794, -0.0823236033320427], false, false),
];

/// Files that are refused, and how the message begins.
const REFUSED: [(&str, &str); 1] = [("assimp/empty.ply", "The file is empty.")];

#[test]
fn every_ply_file_of_seven_projects_is_read_or_refused_with_the_right_reason() {
    let Some(folder) = shared_data("ply_pcd") else { return };
    let mut found = Vec::new();
    for project in std::fs::read_dir(&folder).unwrap() {
        for file in std::fs::read_dir(project.unwrap().path()).into_iter().flatten() {
            let file = file.unwrap().path();
            if file.extension().is_some_and(|extension| extension == "ply") {
                found.push(file.strip_prefix(&folder).unwrap().to_str().unwrap().replace('\\', "/"));
            }
        }
    }
    for name in &found {
        let listed = KNOWN.iter().any(|known| known.0 == name) || REFUSED.iter().any(|refused| refused.0 == name);
        assert!(listed, "{name} is in neither table");
    }
    assert_eq!(found.len(), KNOWN.len() + REFUSED.len());

    for (name, message) in REFUSED {
        let error = read(&std::fs::read(folder.join(name)).unwrap()).expect_err(name);
        assert!(error.to_string().starts_with(message), "{name}: {error}");
    }
    for (name, num_points, first, last, has_normals, has_colors) in KNOWN {
        let cloud = read(&std::fs::read(folder.join(name)).unwrap()).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(cloud.len(), num_points, "{name}");
        assert_eq!(cloud.normals.is_some(), has_normals, "{name}");
        assert_eq!(cloud.colors.is_some(), has_colors, "{name}");
        for (position, expected) in [(cloud.positions.first(), first), (cloud.positions.last(), last)] {
            let Some(position) = position else { continue };
            let error = (position.as_dvec3() + cloud.origin).distance(DVec3::from(expected));
            assert!(error < 1e-6, "{name}: {error} m");
        }
        for normal in cloud.normals.iter().flatten() {
            assert!(*normal == Vec3::ZERO || (normal.length() - 1.0).abs() < 1e-5, "{name}: {normal}");
        }
    }

    let read_known = |name: &str| read(&std::fs::read(folder.join(name)).unwrap()).unwrap();
    let points = read_known("assimp/points.ply");
    assert_eq!(points.colors.unwrap(), [[255, 255, 255], [255, 0, 255], [255, 255, 0], [0, 255, 255]]);
    assert_eq!(points.normals.unwrap()[3], Vec3::new(1.0, 1.0, 0.0).normalize());
    assert_eq!(read_known("assimp/float-color.ply").colors.unwrap(), [[0, 0, 255]; 3]);
    let color = read_known("open3d/color.ply");
    assert_eq!(color.colors.as_ref().unwrap()[0], [34, 33, 35]);
    assert_eq!(color.colors.as_ref().unwrap()[3016], [233, 46, 43]);
    assert!(color.normals.unwrap()[0].distance(Vec3::new(1.188_893_2, -6.030_208_6, 1.296_534_1).normalize()) < 1e-6);
    // The same shelf in both encodings, the faces before the vertices.
    assert_eq!(read_known("happly/platonic_shelf.ply"), read_known("happly/platonic_shelf_ascii.ply"));
}

#[test]
fn the_recordings_are_read() {
    let Some(data) = shared_data("") else { return };
    for index in 0..10 {
        let cloud = read(&std::fs::read(data.join(format!("laser/zju10/{index}.ply"))).unwrap()).unwrap();
        assert_eq!(cloud.len(), 180);
        assert!(cloud.is_planar());
    }
    let cloud = read(&std::fs::read(data.join("laser/zju10/0.ply")).unwrap()).unwrap();
    assert_eq!(cloud.positions[1], DVec3::new(1.979_695_057_658_993, 0.034_748_793_943_889, 0.0).as_vec3());
    let cloud = read(&std::fs::read(data.join("lidar/kitti_pair/source.ply")).unwrap()).unwrap();
    assert_eq!((cloud.len(), cloud.origin), (69_792, DVec3::ZERO));
}
