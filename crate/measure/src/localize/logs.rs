//! Halves of logs in each other's grids, and logs in the grids of other buildings.

use scanstitch::geometry::Pose2;

use super::building::{BUILDINGS, Building};
use super::particles::{Drive, counts, follow};
use super::{Score, Table, number, run};
use crate::arguments::{argument, flag};

pub fn buildings() -> Vec<Building> {
    let data = argument("--data").unwrap_or_else(|| "../shared/data/laser".to_owned());
    let only = argument("--only");
    let is_chosen = |name: &str| only.as_deref().is_none_or(|only| only.split(',').any(|only| only == name));
    let chosen = BUILDINGS.iter().filter(|(name, ..)| is_chosen(name));
    chosen.map(|&building| Building::read(&data, building)).collect()
}

pub fn halves() {
    let mut sum = Score::default();
    let mut found = Table::default();
    let mut filters: Vec<(usize, Table)> = counts().into_iter().map(|count| (count, Table::default())).collect();
    for building in buildings() {
        let num = building.log.scans.len();
        let halves = if flag("--time") {
            [building.part(0..num / 2), building.part(num / 2..num)]
        } else {
            [building.part((0..num).step_by(2)), building.part((1..num).step_by(2))]
        };
        for (map, located) in [(0, 1), (1, 0)] {
            let grid = halves[map].grid();
            let (starts, size) = (number("--starts", 1), halves[located].log.scans.len());
            for first in (0..starts).map(|start| start * size / starts) {
                let part = halves[located].part(first..size.min(first + number("--scans", size)));
                let mut localization = part.localization(&grid, !flag("--alone"));
                let score = run(&mut localization, |frame| Some(part.reference[frame]));
                score.print(&format!("{}, half {located} from scan {first}", building.name));
                sum.add(&score);
                found.add(score.found.filter(|_| score.wrong == 0), score.wrong);
                let odometry: Vec<Pose2> = part.odometry.iter().map(|pose| pose * part.log.T_robot_laser).collect();
                let truth: Vec<Option<Pose2>> = part.reference.iter().copied().map(Some).collect();
                let drive = Drive { scans: localization.scans(), odometry: &odometry, truth: &truth };
                for (count, table) in &mut filters {
                    follow(&drive, &grid, *count, table);
                }
            }
        }
    }
    sum.print("all");
    println!("{}\n{}", Table::HEADER, found.row("branch and bound"));
    for (count, table) in filters {
        println!("{}", table.row(&format!("{count} particles")));
    }
}

pub fn others() {
    let buildings = buildings();
    let of_file = argument("--map").map(|file| ("the map", super::wean::grid(&file)));
    let of_building = |building: &Building| (building.name, building.grid());
    let grids: Vec<_> = of_file.map_or_else(|| buildings.iter().map(of_building).collect(), |grid| vec![grid]);
    let mut num_wrong = 0;
    for (map, grid) in &grids {
        for building in buildings.iter().filter(|building| building.name != *map) {
            let part = building.part(0..building.log.scans.len().min(number("--scans", 400)));
            let score = run(&mut part.localization(grid, !flag("--alone")), |_| None);
            num_wrong += usize::from(score.good > 0);
            score.print(&format!("{} in {map}", building.name));
        }
    }
    println!("{num_wrong} pairs with a certain place");
}
