//! Marc Lehmann's LZF: decompression and compression.
//!
//! A control byte below 32 begins a literal: that number of bytes plus 1 follow. Any other control byte begins a copy of earlier
//! output. Its upper three bits are the length minus 2 (where they are 7, the next byte is added to the length); its lower five
//! bits, with the byte after them, are the distance minus 1.

/// Exactly `expected` bytes from `packed`.
///
/// # Errors
/// The offset in `packed` where the data end early, point before their beginning or give another number of bytes.
pub(super) fn decompress(packed: &[u8], expected: usize) -> Result<Vec<u8>, usize> {
    // Three bytes make a copy at the most.
    if expected > packed.len().saturating_mul(MAX_COPY / 3) {
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

/// Largest number of bytes of a literal: what five bits count, and one.
const MAX_LITERAL: usize = 1 << 5;
/// Largest number of bytes of a copy: what three bits and a byte count, and two.
const MAX_COPY: usize = 7 + 255 + 2;
/// Bits of the distance of a copy from its original.
const BACK_BITS: u32 = 13;

/// Bytes that [`decompress`] turns into `data`: copies are looked for where the same three bytes were last seen.
pub(super) fn compress(data: &[u8]) -> Vec<u8> {
    let mut packed = Vec::with_capacity(data.len() / 2);
    // Where three bytes were last seen, by their hash: a place for each distance.
    let mut last_seen = vec![usize::MAX; 1 << BACK_BITS];
    let (mut position, mut literal) = (0, 0);
    while position + 3 <= data.len() {
        let key = u32::from_le_bytes([data[position], data[position + 1], data[position + 2], 0]);
        let slot = &mut last_seen[(key.wrapping_mul(0x9E37_79B1) >> (32 - BACK_BITS)) as usize];
        let candidate = std::mem::replace(slot, position);
        let length = if candidate < position && position - candidate <= 1 << BACK_BITS {
            let pairs = data[candidate..].iter().zip(&data[position..]).take(MAX_COPY);
            pairs.take_while(|(a, b)| a == b).count()
        } else {
            0
        };
        if length < 3 {
            position += 1;
            continue;
        }
        put_literals(&mut packed, &data[literal..position]);
        let (back, code) = (position - candidate - 1, length - 2);
        if code < 7 {
            packed.push((code << 5 | back >> 8) as u8);
        } else {
            packed.push((7 << 5 | back >> 8) as u8);
            packed.push((code - 7) as u8);
        }
        packed.push(back as u8);
        position += length;
        literal = position;
    }
    put_literals(&mut packed, &data[literal..]);
    packed
}

fn put_literals(packed: &mut Vec<u8>, bytes: &[u8]) {
    for run in bytes.chunks(MAX_LITERAL) {
        packed.push((run.len() - 1) as u8);
        packed.extend_from_slice(run);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_compressed_comes_back() {
        let mut random = 7u32;
        let mut noise = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 24) as u8
        };
        let noisy: Vec<u8> = (0..5000).map(|_| noise()).collect();
        let repeating: Vec<u8> = (0..20_000u32).map(|i| (i % 700 / 3) as u8).collect();
        let long_run = vec![9; 3000];
        for data in [&noisy[..], &repeating, &long_run, &noisy[..1], &noisy[..2], &noisy[..3], &[]] {
            let packed = compress(data);
            assert_eq!(decompress(&packed, data.len()).as_deref(), Ok(data));
            assert!(packed.len() <= data.len() + data.len().div_ceil(MAX_LITERAL));
        }
        assert!(compress(&repeating).len() * 10 < repeating.len());
        assert!(compress(&long_run).len() < 50);
    }

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
