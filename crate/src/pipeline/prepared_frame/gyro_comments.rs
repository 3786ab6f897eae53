//! What a gyroscope measured around a cloud, as comments in the header of a PCD file: `# gyro T X Y Z`, a reading a line, with its time from
//! the cloud's time stamp (s) and the angular velocity in the frame of the lidar (rad/s).

/// Headers are shorter (bytes): 2,000 readings of 60 bytes.
const MAX_HEADER: usize = 120_000;
const WORD: &str = "# gyro";

/// The readings in a header; `None` where it does not have the word.
pub(super) fn gyro_readings(bytes: &[u8]) -> Option<Vec<[f64; 4]>> {
    if !bytes.starts_with(WORD.as_bytes()) {
        return None;
    }
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(MAX_HEADER)]);
    let reading = |line: &str| -> Option<[f64; 4]> {
        let numbers: Vec<f64> = line.split_whitespace().map_while(|word| word.parse().ok()).collect();
        numbers.try_into().ok()
    };
    Some(head.lines().map_while(|line| line.strip_prefix(WORD)).filter_map(reading).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_at_the_beginning_of_a_header_are_readings() {
        let file = b"# gyro\n# gyro -0.1 1e-3 2 -3\n# gyro 0.05 1 2\n# gyro 0.1 0 0 1\nVERSION 0.7\n# gyro 1 1 1 1\n";
        assert_eq!(gyro_readings(file), Some(vec![[-0.1, 1e-3, 2.0, -3.0], [0.1, 0.0, 0.0, 1.0]]));
        assert_eq!((gyro_readings(b"VERSION 0.7"), gyro_readings(b"# gyro")), (None, Some(vec![])));
    }
}
