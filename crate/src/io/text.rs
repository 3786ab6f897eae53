//! What the readers of text share: lines, numbers, and how an error message quotes the input.

use crate::{Error, Result};

/// Refuses the text that stands in the place of a file in a clone without Git LFS, and text in UTF-16, as shells and editors of
/// Windows write it.
///
/// Source: the specification of Git LFS, "The Pointer".
pub(super) fn refuse_pointer_and_utf16(bytes: &[u8]) -> Result<()> {
    if bytes.starts_with(b"version https://git-lfs.github.com/spec/") {
        let problem = "This is a Git LFS pointer, not the file itself";
        return Err(Error::line(1, problem, "Fetch the file with git lfs pull"));
    }
    if bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF") {
        return Err(Error::line(
            1,
            "This is text in UTF-16",
            "Save it in UTF-8; in PowerShell: | Out-File -Encoding utf8",
        ));
    }
    Ok(())
}

/// Lines with their numbers, from 1. LF, CRLF and lone CR end one.
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    let mut rest = Some(bytes);
    std::iter::from_fn(move || next_line(&mut rest)).enumerate().map(|(index, line)| (index + 1, line))
}

/// Takes the first line off. `rest` is `None` after the last one.
#[inline(never)]
fn next_line<'a>(rest: &mut Option<&'a [u8]>) -> Option<&'a [u8]> {
    let bytes = (*rest)?;
    let end = bytes.iter().position(|&byte| byte == b'\n' || byte == b'\r').unwrap_or(bytes.len());
    let length = if bytes[end..].starts_with(b"\r\n") { 2 } else { 1 };
    *rest = if bytes[end..] == *b"\r" { None } else { bytes.get(end + length..) };
    Some(&bytes[..end])
}

/// Number of the line (from 1) that the byte at `offset` belongs to. LF, CRLF and lone CR end a line.
pub(super) fn line_number(bytes: &[u8], offset: usize) -> usize {
    let ends_line = |i: usize| bytes[i] == b'\n' || (bytes[i] == b'\r' && bytes.get(i + 1) != Some(&b'\n'));
    1 + (0..offset.min(bytes.len())).filter(|&i| ends_line(i)).count()
}

/// The bytes without a leading UTF-8 byte order mark, which some editors write.
pub(super) fn without_byte_order_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)
}

/// A piece of input as an error message shows it: [shortened](shorten) and in quotes.
pub(super) fn quote(text: &[u8]) -> String {
    format!("\"{}\"", shorten(text))
}

/// A piece of input made printable and at most 40 characters long.
pub(super) fn shorten(text: &[u8]) -> String {
    /// Half a line of a terminal: the message says more than that.
    const MAX_LENGTH: usize = 40;
    // A character takes 4 bytes at the most, so this holds all that is shown.
    let lossy = String::from_utf8_lossy(&text[..text.len().min(4 * MAX_LENGTH + 4)]);
    let mut shown: String =
        lossy.chars().take(MAX_LENGTH).map(|c| if c.is_control() { '\u{FFFD}' } else { c }).collect();
    if lossy.chars().count() > MAX_LENGTH {
        shown.push_str("...");
    }
    shown
}

/// A number at the start of `bytes` and the bytes it takes: decimal, `nan` or `inf` in any case and with any sign.
/// What follows is not looked at.
pub(super) fn leading_number(bytes: &[u8]) -> Option<(f64, usize)> {
    fast_float2::parse_partial(bytes).ok()
}

/// The same as [`leading_number`], rounded once to single precision: by way of double it would be rounded twice.
pub(super) fn leading_single(bytes: &[u8]) -> Option<(f64, usize)> {
    fast_float2::parse_partial::<f32, _>(bytes).ok().map(|(value, length)| (f64::from(value), length))
}

/// The number a whole token spells, the C runtimes' spellings of "not a number" and of infinity among them:
/// `nan(ind)`, `-nan(snan)`, `1.#QNAN`, `-1.#IND`, `1.#INF`.
pub(super) fn number(token: &[u8]) -> Option<f64> {
    match leading_number(token) {
        Some((value, length)) if length == token.len() => Some(value),
        Some((value, length)) if value.is_nan() && token[length..].starts_with(b"(") && token.ends_with(b")") => {
            Some(value)
        }
        Some((value, length)) if value.abs() == 1.0 && token[..length].ends_with(b".") => {
            let name = token[length..].to_ascii_uppercase();
            let is_spelling = |spelling: &[u8]| {
                name.strip_prefix(spelling).is_some_and(|padding| padding.iter().all(|&digit| digit == b'0'))
            };
            if is_spelling(b"#INF") {
                Some(value * f64::INFINITY)
            } else {
                [&b"#QNAN"[..], b"#SNAN", b"#IND", b"#NAN"].into_iter().any(is_spelling).then_some(f64::NAN)
            }
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_reader_knows_the_pointers_of_git_lfs_and_utf_16() {
        let pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 12345\n";
        let utf16 = b"\xFF\xFE1\0 \x002\0";
        for (text, remedy) in [(&pointer[..], "git lfs pull"), (utf16, "Save it in UTF-8")] {
            let told = |result: Result<()>| assert!(result.unwrap_err().to_string().contains(remedy));
            told(crate::io::ply::read(text).map(drop));
            told(crate::io::point_cloud::read(text).map(drop));
            told(crate::io::depth_image::read(text).map(drop));
            told(crate::io::color_image::read(text).map(drop));
            told(crate::io::laser_log::read(text).map(drop));
            told(crate::io::trajectory::read(text).map(drop));
            told(crate::io::pcd::read(text).map(drop));
            told(crate::io::intrinsics::read(text).map(drop));
            told(crate::io::relations::read(text).map(drop));
        }
    }

    #[test]
    fn numbers_in_every_spelling() {
        for (token, expected) in [
            ("0", 0.0),
            ("-1.5e3", -1500.0),
            ("+.25", 0.25),
            ("7.", 7.0),
            ("1e400", f64::INFINITY),
            ("-inf", f64::NEG_INFINITY),
            ("Infinity", f64::INFINITY),
            ("1.#INF", f64::INFINITY),
            ("-1.#INF00", f64::NEG_INFINITY),
        ] {
            assert_eq!(number(token.as_bytes()), Some(expected), "{token}");
        }
        for token in ["nan", "NaN", "-nan", "nan(ind)", "-nan(snan)", "1.#QNAN", "-1.#IND", "1.#IND00", "1.#SNAN"] {
            assert!(number(token.as_bytes()).is_some_and(f64::is_nan), "{token}");
        }
        for token in ["", "abc", "1,5", "1.2.3", "0x10", "--1", "1e", "nan(", "2.#INF", "1.#", "1.#INFx", "12#"] {
            assert_eq!(number(token.as_bytes()), None, "{token}");
        }
    }

    #[test]
    fn lines_end_with_any_of_the_three_endings() {
        let text = b"a\nb\r\nc\rd\n\ne";
        for (letter, line) in [(b'a', 1), (b'b', 2), (b'c', 3), (b'd', 4), (b'e', 6)] {
            let offset = text.iter().position(|&byte| byte == letter).unwrap();
            assert_eq!(line_number(text, offset), line);
        }
        assert_eq!(line_number(text, 1000), 6);
    }

    #[test]
    fn lines_are_numbered_and_end_with_any_of_the_three_endings() {
        let read = |text: &'static str| lines(text.as_bytes()).collect::<Vec<_>>();
        let expected: Vec<(usize, &[u8])> = vec![(1, b"a"), (2, b"b"), (3, b""), (4, b"c"), (5, b"")];
        assert_eq!(read("a\nb\n\nc\n"), expected);
        assert_eq!(read("a\r\nb\r\n\r\nc\r\n"), expected);
        assert_eq!(read("a\rb\r\rc\r"), expected[..4], "nothing follows the last CR");
        assert_eq!(read("a\r\r\nb"), [(1, &b"a"[..]), (2, b""), (3, b"b")]);
        assert_eq!(
            (read(""), read("\r"), read("\n")),
            (vec![(1, &b""[..])], vec![(1, &b""[..])], vec![(1, &b""[..]), (2, b"")])
        );
    }

    #[test]
    fn quotes_are_short_and_printable() {
        assert_eq!(quote(b"1,5"), "\"1,5\"");
        assert_eq!(quote(b"a\0b"), "\"a\u{FFFD}b\"");
        assert_eq!(quote(&[b'x'; 1000]), format!("\"{}...\"", "x".repeat(40)));
        assert_eq!(quote("é".repeat(40).as_bytes()), format!("\"{}\"", "é".repeat(40)));
    }
}
