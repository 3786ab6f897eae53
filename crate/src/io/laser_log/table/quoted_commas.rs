//! Commas within numbers in quotes, of tables whose columns are separated by commas.

use std::borrow::Cow;

use crate::io::text::number;

/// What they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum QuotedCommas {
    /// Separators, as of a list.
    Separate,
    /// They part thousands: `"1,670"` beside `"950"`.
    Group,
    /// Decimal commas: `"1,670"` beside `"0,950"`.
    Decimal,
}

/// Digits between two commas that part thousands.
const GROUP: usize = 3;

impl QuotedCommas {
    /// Told from the first lines, none of whose numbers may contradict.
    pub fn of<'a>(head: impl Iterator<Item = &'a [u8]>) -> Self {
        let quoted: Vec<&[u8]> = head.flat_map(quoted).filter(|text| text.contains(&b',')).collect();
        let is_number = |text: &[u8]| text.iter().all(|byte| byte.is_ascii_digit() || b"+-.,".contains(byte));
        if quoted.is_empty() || !quoted.iter().all(|text| is_number(text)) {
            return Self::Separate;
        }
        if quoted.iter().all(|text| are_groups(text)) {
            return Self::Group;
        }
        let is_decimal = |text: &&[u8]| !text.contains(&b'.') && text.split(|&byte| byte == b',').count() == 2;
        if quoted.iter().all(is_decimal) { Self::Decimal } else { Self::Separate }
    }

    /// The text with such numbers as they are written elsewhere.
    pub fn rewritten(self, text: &[u8]) -> Cow<'_, [u8]> {
        if self == Self::Separate {
            return Cow::Borrowed(text);
        }
        let mut is_quoted = false;
        let written = text.iter().filter_map(|&byte| {
            is_quoted ^= byte == b'"';
            match byte {
                b',' if is_quoted => (self == Self::Decimal).then_some(b'.'),
                b'\n' => {
                    is_quoted = false;
                    Some(byte)
                }
                _ => Some(byte),
            }
        });
        Cow::Owned(written.collect())
    }
}

/// What stands between the quotes of a line.
fn quoted(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(|&byte| byte == b'"').skip(1).step_by(2)
}

/// Whether all commas part thousands, of a number of thousands to billions that does not begin with 0.
fn are_groups(text: &[u8]) -> bool {
    let whole = text.split(|&byte| byte == b'.').next().unwrap_or_default();
    let whole = whole.strip_prefix(b"-").unwrap_or(whole);
    let groups: Vec<&[u8]> = whole.split(|&byte| byte == b',').collect();
    let (first, others) = (groups[0], &groups[1..]);
    (1..=GROUP).contains(&others.len())
        && (1..=GROUP).contains(&first.len())
        && first[0] != b'0'
        && groups.iter().all(|group| number(group).is_some())
        && others.iter().all(|group| group.len() == GROUP)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commas_in_quotes_are_told_from_all_numbers() {
        let read = |line: &str| {
            let quoted = QuotedCommas::of([line.as_bytes()].into_iter());
            String::from_utf8(quoted.rewritten(line.as_bytes()).into_owned()).unwrap()
        };
        assert_eq!(read("1,\"1,670\",\"950\",\"-12,345.5\""), "1,\"1670\",\"950\",\"-12345.5\"");
        assert_eq!(read("1,\"1,670\",\"0,950\""), "1,\"1.670\",\"0.950\"");
        for other in ["1,\"1,2,3\"", "\"1.5,2.5\"", "\"[1, 2]\"", "a,\"b,c\"", "1,2,3"] {
            assert_eq!(read(other), other);
        }
    }
}
