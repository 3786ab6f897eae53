//! For every cell the nearest cell of a wall, exactly and in linear time: Felzenszwalb and Huttenlocher, "Distance transforms of sampled
//! functions", Theory of Computing 8 (2012).

/// No cell.
pub(super) const NONE: u32 = u32::MAX;

/// For each cell the nearest cell of a wall, by the distance of their middles.
pub(super) fn nearest_cells(is_wall: &[bool], width: usize, height: usize) -> Vec<u32> {
    // Within each column first: the row of the nearest wall.
    let mut rows = vec![NONE; width * height];
    for x in 0..width {
        let mut sweep = |ys: &mut dyn Iterator<Item = usize>| {
            let mut last = NONE;
            for y in ys {
                if is_wall[y * width + x] {
                    last = y as u32;
                }
                let row = &mut rows[y * width + x];
                if last != NONE && (*row == NONE || last.abs_diff(y as u32) < row.abs_diff(y as u32)) {
                    *row = last;
                }
            }
        };
        sweep(&mut (0..height));
        sweep(&mut (0..height).rev());
    }
    let mut envelope = Envelope::default();
    let mut nearest = vec![NONE; width * height];
    for y in 0..height {
        envelope.fill(&rows[y * width..][..width], y);
        envelope.write(&mut nearest[y * width..][..width], width);
    }
    nearest
}

/// The lower envelope of the parabolas (x - column)^2 + height of a row.
#[derive(Default)]
struct Envelope {
    /// Column, squared height and row of the wall of each parabola, and from where on it is the lowest.
    parabolas: Vec<(f64, f64, u32, f64)>,
}

impl Envelope {
    fn fill(&mut self, rows: &[u32], y: usize) {
        self.parabolas.clear();
        for (x, &row) in rows.iter().enumerate().filter(|(_, row)| **row != NONE) {
            let (x, height) = (x as f64, f64::from(row.abs_diff(y as u32)).powi(2));
            let start = loop {
                let Some(&(before_x, before_height, _, before_start)) = self.parabolas.last() else {
                    break f64::NEG_INFINITY;
                };
                let crossing = (height + x * x - before_height - before_x * before_x) / (2.0 * (x - before_x));
                if crossing > before_start {
                    break crossing;
                }
                self.parabolas.pop();
            };
            self.parabolas.push((x, height, row, start));
        }
    }

    fn write(&self, nearest: &mut [u32], width: usize) {
        let mut at = 0;
        for (x, nearest) in nearest.iter_mut().enumerate() {
            while self.parabolas.get(at + 1).is_some_and(|next| next.3 <= x as f64) {
                at += 1;
            }
            if let Some(&(column, _, row, _)) = self.parabolas.get(at) {
                *nearest = row * width as u32 + column as u32;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_cell_is_that_of_brute_force() {
        let (width, height) = (37, 23);
        let is_wall: Vec<bool> = (0..width * height).map(|i| (i * i + 7 * i) % 41 == 3).collect();
        let sq_distance = |a: usize, b: usize| {
            let d = |a: usize, b: usize| a.abs_diff(b).pow(2);
            d(a % width, b % width) + d(a / width, b / width)
        };
        for (cell, &nearest) in nearest_cells(&is_wall, width, height).iter().enumerate() {
            let best = (0..width * height).filter(|&wall| is_wall[wall]).map(|wall| sq_distance(cell, wall)).min();
            assert!(is_wall[nearest as usize]);
            assert_eq!(Some(sq_distance(cell, nearest as usize)), best, "cell {cell}");
        }
        assert!(nearest_cells(&[false; 12], 4, 3).iter().all(|&cell| cell == NONE));
    }
}
