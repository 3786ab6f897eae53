//! Scenes and tables of pixels, read and written.

use scanstitch::camera::bev::points::{PAIR_COLUMNS, POINT_COLUMNS, points_csv, read_pixels};
use scanstitch::camera::bev::presets::homework_views;
use scanstitch::camera::bev::{BevScene, BevStatus, WholePixels, presets};

use super::chance::Chance;
use super::plain::distance;

#[test]
fn a_scene_is_read_as_it_is_written_and_faults_are_named() {
    for preset in presets() {
        let text = serde_json::to_string_pretty(&preset.scene).unwrap();
        assert_eq!(BevScene::read(text.as_bytes()).unwrap(), preset.scene);
    }
    let mut chance = Chance(7);
    for _ in 0..100 {
        let scene = chance.scene();
        let again = BevScene::read(serde_json::to_string(&scene).unwrap().as_bytes()).unwrap();
        // Decimal numbers may come back with another last bit, which no pixel shows.
        let [before, after] = [&scene, &again].map(|scene| scene.front_from_top().unwrap());
        let marked = chance.pixel(&scene.top);
        if let (BevStatus::Visible, Some(pixel)) = (before.point(marked).status, after.point(marked).projected) {
            assert!(distance(before.point(marked).projected.unwrap(), pixel) < 1e-9);
        }
        assert_eq!((again.axes, again.top.width), (scene.axes, scene.top.width));
    }
    let text = serde_json::to_string_pretty(&homework_views()).unwrap();
    let misspelt = BevScene::read(text.replace("\"axes\"", "\"axis\"").as_bytes()).unwrap_err().to_string();
    assert!(misspelt.starts_with("line 2: unknown field `axis`"), "{misspelt}");
    let cut = BevScene::read(&text.as_bytes()[..100]).unwrap_err().to_string();
    assert!(cut.contains("EOF"), "{cut}");
}

#[test]
fn tables_of_pixels_are_read_with_and_without_names() {
    let read = |text: &str| read_pixels(text.as_bytes(), POINT_COLUMNS);
    let expected = vec![[239.0, 141.0], [258.5, -3.0]];
    for text in [
        "239,141\n258.5,-3\n",
        "u,v\n239,141\n258.5,-3",
        "\u{feff}239; 141\r\n258.5; -3\r\n",
        "# marked by hand\n239 141 # rug\n\n258.5\t-3\n",
        "number,top_u,top_v\n1,239,141\n2,258.5,-3\n",
        "v,u\n141,239\n-3,258.5\n",
    ] {
        assert_eq!(read(text).unwrap(), expected, "{text}");
    }
    let message = |text: &str| read(text).unwrap_err().to_string();
    assert!(message("239,141\n258\n").starts_with("line 2: The line has 1 of 2 numbers"));
    assert!(message("239,141\n258,left\n").starts_with("line 2: \"left\" is not a number"));
    assert!(message("239,141\n258,inf\n").starts_with("line 2: \"inf\" is not a number"));
    assert!(message("a,b\n1,2\n").starts_with("line 1: No column is called u or top_u"));
    assert!(message("u,v\n").contains("no point"));
    assert!(read_pixels(&[0xff, 0xfe], POINT_COLUMNS).unwrap_err().to_string().contains("not text"));
    let pairs = read_pixels(b"front_u,front_v,top_u,top_v\n1,2,3,4\n", PAIR_COLUMNS).unwrap();
    assert_eq!(pairs, [[3.0, 4.0, 1.0, 2.0]]);
}

#[test]
fn points_become_a_table() {
    let there = homework_views().front_from_top().unwrap();
    let points = [[256.0, 128.0], [250.0, 400.0]].map(|pixel| there.point(pixel).in_whole_pixels(WholePixels::Rounded));
    let text = points_csv(&points, "top", "front");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "number,top_u,top_v,x,y,z,front_u,front_v,status");
    assert!(lines[1].starts_with("1,256,128,") && lines[1].ends_with(",256,461,visible"), "{}", lines[1]);
    assert!(lines[2].ends_with(",,,behind_camera") && lines[2].matches(',').count() == 8, "{}", lines[2]);
    // What is written is read again.
    assert_eq!(read_pixels(text.as_bytes(), POINT_COLUMNS).unwrap(), [[256.0, 128.0], [250.0, 400.0]]);
}
