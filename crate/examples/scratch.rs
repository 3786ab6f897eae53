#[path = "depth/recordings.rs"]
#[allow(dead_code)]
mod recordings;
use scanstitch::prepared_frame::*;
use scanstitch::spatial_settings::*;
use scanstitch::surfel_map::SurfelMap;
use scanstitch::registration::projective::*;
use scanstitch::geometry::Pose3;
use scanstitch::scene::apartment::Tour;
use recordings::*;
fn main() {
    let a: Vec<f64> = std::env::args().skip(1).map(|s| s.parse().unwrap()).collect();
    let (seed, bits, step, frame) = (a[0] as u64, a[1] as u8, a[2], a[3] as usize);
    let walk = Walk { tour: Tour::AllRooms, step, turn: if step > 0.3 {20.0} else {10.0}, bits, noise: 0.0, frames: 100 };
    let rec = if seed > 0 { walk.recording(seed, Some(std::path::Path::new("/tmp/lost_cache"))) } else { floor(if bits==8 {"first"} else {"second"}) };
    let settings = SpatialSettings::default();
    let prep = Preparation::new(&settings, "x", &rec.depth[0]).unwrap();
    let mut map = SurfelMap::new();
    let truth: Vec<Pose3> = rec.truth.iter().map(|p| rec.truth[0].inverse() * p).collect();
    for i in 0..=frame {
        let f = PreparedFrame::from_depth(&prep, FrameLabel { name: "x".into(), index: i, time: None }, &rec.depth[i], None).unwrap();
        let Surfaces::Surfels(s) = &f.surfaces else { panic!() };
        let s = &s[0].1;
        let view = map.view(s, &truth[i]);
        if i == frame || (a.len() > 4 && i > 0) {
            let own = ProjectiveTarget::draw((0..).zip(s.surfels()), &s.cell_camera(), &Pose3::identity());
            let (mut ag, mut free, mut hid, mut unk) = (0,0,0,0);
            let (w,h) = (s.columns, s.rows);
            let mut pic = vec![b' '; w*h];
            for (c, surfel) in s.cells.iter().enumerate() { let Some(su) = surfel else { continue };
                let p = truth[i] * nalgebra::Point3::from(su.point);
                let n = truth[i].rotation * su.normal;
                pic[c] = match view.look_around(&p.coords, 0.03) {
                    Sight::Agreeing(x) if x.normal.dot(&n) > 0.8 => {ag+=1; b'.'}
                    Sight::Agreeing(_) => b',', Sight::InFreeSpace => {free+=1; b'F'}, Sight::Hidden => {hid+=1; b'h'}, Sight::Unknown => {unk+=1; b'?'} };
            }
            let (mut mag, mut mfree, mut mhid) = (0,0,0);
            let inv = truth[i].inverse();
            let mut pic2 = vec![b' '; w*h];
            let cam = s.cell_camera();
            for su in view.surfels() {
                let p = inv * nalgebra::Point3::from(su.point);
                let n = inv.rotation * su.normal;
                let ch = match own.look_around(&p.coords, 0.03) {
                    Sight::Agreeing(x) if x.normal.dot(&n) > 0.8 => {mag+=1; b'.'}
                    Sight::Agreeing(_) => b',', Sight::InFreeSpace => {mfree+=1; b'F'}, Sight::Hidden => {mhid+=1; b'h'}, Sight::Unknown => b'?' };
                if let Some(px) = cam.project(&p.coords) { let (u,v) = ((px.x+0.5).floor(), (px.y+0.5).floor());
                  if u>=0.0 && v>=0.0 && u < w as f64 && v < h as f64 { pic2[v as usize*w+u as usize] = ch; } }
            }
            println!("{i}: frame in map: {ag} agree {free} free {hid} hidden {unk} unknown; map in frame {mag} agree {mfree} free {mhid} hidden; agreement {:.3}", (ag+mag) as f64/((ag+mag+free+mfree) as f64));
            if i == frame {
                for r in (0..h).step_by(3) { let l: Vec<u8> = (0..w).map(|c| pic[r*w+c]).collect(); println!("{}", String::from_utf8(l).unwrap()); }
                println!("map in frame");
                for r in (0..h).step_by(3) { let l: Vec<u8> = (0..w).map(|c| pic2[r*w+c]).collect(); println!("{}", String::from_utf8(l).unwrap()); }
                println!("depth");
                for r in (0..h).step_by(6) { for c in (0..w).step_by(6) { print!("{}", s.cells[r*w+c].map_or("   .".to_string(), |x| format!("{:4.1}", x.point.z))); } println!(); }
            }
        }
        map.insert(s, &truth[i], &view);
    }
}
