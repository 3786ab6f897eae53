//! Decompression of Marc Lehmann's LZF.
//!
//! A byte below 32 is followed by that many bytes and one more, to be copied. Any other holds in its upper three bits the
//! length of a copy of what came before, less 2 (7: a further byte is added), and in its lower five, with the byte after
//! it, how far back that lies, less 1.

/// Exactly `expected` bytes from `packed`.
///
/// # Errors
/// The offset in `packed` where the data end early, point before their beginning or give another number of bytes.
pub(super) fn decompress(packed: &[u8], expected: usize) -> Result<Vec<u8>, usize> {
    // Three bytes make 264 at the most: no file makes this allocate more than 88 times its size.
    const MAX_INFLATION: usize = 88;
    if expected > packed.len().saturating_mul(MAX_INFLATION) {
        return Err(packed.len());
    }
    let mut data = Vec::with_capacity(expected);
    let mut position = 0;
    while position < packed.len() {
        let start = position;
        let control = usize::from(packed[position]);
        position += 1;
        if control < 32 {
            let literal = packed.get(position..=position + control).ok_or(start)?;
            data.extend_from_slice(literal);
            position += control + 1;
        } else {
            let mut length = control >> 5;
            if length == 7 {
                length += usize::from(*packed.get(position).ok_or(start)?);
                position += 1;
            }
            let low = usize::from(*packed.get(position).ok_or(start)?);
            position += 1;
            let back = ((control & 31) << 8 | low) + 1;
            let from = data.len().checked_sub(back).ok_or(start)?;
            // What is copied may reach into what the copy itself makes: a run.
            for index in from..from + length + 2 {
                data.push(data[index]);
            }
        }
        if data.len() > expected {
            return Err(start);
        }
    }
    if data.len() == expected { Ok(data) } else { Err(packed.len()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_copies_and_runs() {
        assert_eq!(decompress(&[2, b'a', b'b', b'c'], 3), Ok(b"abc".to_vec()));
        // Three back, four long: the copy reaches into itself.
        assert_eq!(decompress(&[2, b'a', b'b', b'c', 2 << 5, 2], 7), Ok(b"abcabca".to_vec()));
        // A long run: 7 + 3 + 2 bytes.
        assert_eq!(decompress(&[0, b'x', 7 << 5, 3, 0], 13), Ok(vec![b'x'; 13]));
        assert_eq!(decompress(&[], 0), Ok(Vec::new()));
    }

    #[test]
    fn broken_data_name_the_place() {
        assert_eq!(decompress(&[5, b'a'], 6), Err(0));
        assert_eq!(decompress(&[0, b'x', 2 << 5, 1], 5), Err(2)); // two back of one
        assert_eq!(decompress(&[0, b'x', 2 << 5], 5), Err(2));
        assert_eq!(decompress(&[0, b'x', 7 << 5], 5), Err(2));
        assert_eq!(decompress(&[0, b'x'], 2), Err(2));
        assert_eq!(decompress(&[1, b'x', b'y'], 1), Err(0));
        assert_eq!(decompress(&[0, b'x'], usize::MAX), Err(2));
    }
}
