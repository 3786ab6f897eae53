//! bzip2, which archives, whole bags and chunks of ROS 1 bags may be packed with, unpacked piece by piece by the crate `bzip2`.

use bzip2::{Decompress, Error, Status};

/// Room that is made for what comes out at a time (bytes).
const ROOM: usize = 1 << 17;

/// One stream, or several behind one another, unpacked as its pieces come.
#[derive(Default)]
pub struct Unpacker {
    /// None between two streams.
    stream: Option<Decompress>,
}

impl Unpacker {
    /// What comes out of the next packed bytes. Where that is more than `most` bytes, it ends soon after them.
    ///
    /// # Errors
    /// When the bytes are damaged or are not packed by bzip2.
    pub fn push(&mut self, mut packed: &[u8], most: usize) -> Result<Vec<u8>, String> {
        let mut unpacked = Vec::new();
        while unpacked.len() <= most && !(packed.is_empty() && self.is_complete()) {
            let stream = self.stream.get_or_insert_with(|| Decompress::new(false));
            let (read, written) = (stream.total_in(), stream.total_out());
            unpacked.reserve(ROOM);
            let status = stream.decompress_vec(packed, &mut unpacked).map_err(words)?;
            let num_read = usize::try_from(stream.total_in() - read).map_err(|error| error.to_string())?;
            let is_stuck = num_read == 0 && stream.total_out() == written;
            packed = &packed[num_read..];
            match status {
                Status::StreamEnd => self.stream = None,
                _ if is_stuck => break, // until more comes
                _ => {}
            }
        }
        Ok(unpacked)
    }

    /// Whether what has come ends where a stream ends.
    #[must_use]
    pub const fn is_complete(&self) -> bool {
        self.stream.is_none()
    }
}

fn words(error: Error) -> String {
    match error {
        Error::DataMagic => "it does not begin with the signature of bzip2".to_owned(),
        _ => "it is damaged: a block or its checksum is wrong".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use bzip2::Compression;
    use bzip2::write::BzEncoder;

    use super::Unpacker;

    fn packed(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = BzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(bytes).expect("memory takes all");
        encoder.finish().expect("memory takes all")
    }

    #[test]
    fn streams_in_pieces_of_any_size() {
        let bytes: Vec<u8> = (0..50_000_u32).map(|i| ((i * i) >> 7) as u8).collect();
        let streams = [packed(&bytes), packed(b""), packed(b"end")].concat();
        for size in [7, 1000, streams.len()] {
            let mut unpacker = Unpacker::default();
            let pieces = streams.chunks(size).map(|piece| unpacker.push(piece, usize::MAX).expect("it is sound"));
            assert_eq!(pieces.collect::<Vec<_>>().concat(), [&bytes[..], b"end"].concat());
            assert!(unpacker.is_complete());
        }
    }

    #[test]
    fn a_bomb_ends_soon_after_the_bytes_that_are_wanted() {
        let bomb = packed(&vec![0; 1 << 23]);
        let unpacked = Unpacker::default().push(&bomb, 1000).expect("it is sound");
        assert!((1001..1 << 19).contains(&unpacked.len()));
    }

    #[test]
    fn cut_off_or_damaged() {
        let mut bytes = packed(b"some text");
        let mut unpacker = Unpacker::default();
        assert_eq!(unpacker.push(&bytes[..bytes.len() - 1], 100), Ok(b"some text".to_vec()));
        assert!(!unpacker.is_complete());
        bytes[12] ^= 1; // of the checksum
        assert!(Unpacker::default().push(&bytes, 100).is_err_and(|words| words.contains("checksum")));
        assert!(Unpacker::default().push(b"no bzip2", 100).is_err_and(|words| words.contains("signature")));
    }
}
