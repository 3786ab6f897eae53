//! Times that are written as a clock shows them.

/// `14:03:10,250` as seconds of the day, `2024-05-03T14:03:10.25Z` as seconds since 1970; other words before the time and an
/// offset from UTC behind it are left out.
pub(super) fn clock(word: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(word).ok()?.trim_matches(|c: char| c.is_whitespace() || "\"'Z".contains(c));
    let (date, time) = text.rsplit_once(['T', ' ']).unwrap_or(("", text));
    let time = time.split(['+', '-']).next()?; // without the offset from UTC
    let mut parts = time.split(':');
    let (Some(hours), Some(minutes), Some(seconds), None) = (parts.next(), parts.next(), parts.next(), parts.next())
    else {
        return None;
    };
    let (hours, minutes): (u8, u8) = (hours.parse().ok()?, minutes.parse().ok()?);
    let seconds: f64 = seconds.replace(',', ".").parse().ok()?;
    if hours > 23 || minutes > 59 || !(0.0..61.0).contains(&seconds) {
        return None;
    }
    let day = days_since_1970(date.trim()).unwrap_or(0.0);
    Some(((24.0 * day + f64::from(hours)) * 60.0 + f64::from(minutes)) * 60.0 + seconds)
}

/// Of a day as ISO 8601 writes it, by the Gregorian calendar (Hinnant, "chrono-compatible low-level date algorithms").
fn days_since_1970(date: &str) -> Option<f64> {
    let mut parts = date.split('-').map(|part| part.parse::<u16>().ok());
    let (Some(Some(year)), Some(Some(month)), Some(Some(day)), None) =
        (parts.next(), parts.next(), parts.next(), parts.next())
    else {
        return None;
    };
    let is_date = (1970..10_000).contains(&year) && (1..=12).contains(&month) && (1..=31).contains(&day);
    // Years that begin in March have their leap day last.
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let [year, month, day] = [year, month, day].map(u32::from);
    let days = 365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + day - 1;
    is_date.then(|| f64::from(days) - 719_468.0)
}

#[cfg(test)]
mod tests {
    use super::clock;

    #[test]
    fn clocks_are_seconds() {
        assert_eq!(clock(b"14:03:10,250"), Some(50_590.25));
        assert_eq!(clock(b"1970-01-02T00:00:01.5Z"), Some(86_401.5));
        assert_eq!(clock(b"2024-02-29 12:00:00"), Some(1_709_208_000.0));
        assert_eq!(clock(b"2024-05-03T10:00:00.25+00:00"), Some(1_714_730_400.25));
        assert_eq!(clock(b"2024-05-03T10:00:00.25-05:00"), Some(1_714_730_400.25));
        assert_eq!(clock(b"03.05.2024 10:00:00"), Some(36_000.0));
        for word in ["12", "1:2", "25:00:00", "a:b:c", "1:2:3:4", "", "10:00:99", "2024-05-03"] {
            assert_eq!(clock(word.as_bytes()), None, "{word}");
        }
    }
}
