//! Numbers and times as instruments write them. Parsing is strict, so that no text has two readings.

use super::super::excerpt::excerpt;
use super::options::DecimalSign;

/// A finite decimal number with the given decimal sign, an optional sign and exponent; no digit grouping, no `NaN`.
pub(super) fn number(text: &str, sign: DecimalSign) -> Result<f64, String> {
    let refused = |why: &str| Err(format!("`{}` {why}", excerpt(text)));
    let plain = text.strip_prefix(['+', '-']).unwrap_or(text);
    let (own, other) = match sign {
        DecimalSign::Point => ('.', ','),
        DecimalSign::Comma => (',', '.'),
    };
    if plain.contains(other) {
        return refused(&format!("contains `{other}`, but the decimal sign is set to `{own}`"));
    }
    if !plain.starts_with(|c: char| c.is_ascii_digit() || c == own) {
        return refused("is not a number");
    }
    if !plain.chars().all(|c| c.is_ascii_digit() || c == own || matches!(c, 'e' | 'E' | '+' | '-')) {
        return refused("is not a number");
    }
    match text.replace(own, ".").parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => refused("is not a number"),
    }
}

/// A time (s): a plain number of seconds, `2026-05-04T12:30:05.25Z` (zone optional) or `05/04/2026 12:30:05`. Only differences
/// between times of one instrument are meaningful.
pub(super) fn time(text: &str, sign: DecimalSign) -> Result<f64, String> {
    let calendar = || calendar_time(text).ok_or_else(|| format!("`{}` is not a time", excerpt(text)));
    number(text, sign).or_else(|_| calendar())
}

fn calendar_time(text: &str) -> Option<f64> {
    let (date, clock) = text.split_once(['T', ' '])?;
    let (year, month, day) = if date.contains('/') { month_first(date)? } else { year_first(date)? };
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) || !(1900..=9999).contains(&year) {
        return None;
    }
    let (clock, zone) = split_zone(clock.trim_start())?;
    let seconds = clock_seconds(clock)?;
    Some(days_since_1970(year, month, day) as f64 * 86_400.0 + seconds - zone)
}

fn year_first(date: &str) -> Option<(i64, i64, i64)> {
    let mut parts = date.splitn(3, '-').map(whole);
    Some((parts.next()??, parts.next()??, parts.next()??))
}

fn month_first(date: &str) -> Option<(i64, i64, i64)> {
    let mut parts = date.splitn(3, '/').map(whole);
    let (month, day) = (parts.next()??, parts.next()??);
    Some((parts.next()??, month, day))
}

fn whole(text: &str) -> Option<i64> {
    (!text.is_empty() && text.len() <= 4 && text.bytes().all(|b| b.is_ascii_digit())).then(|| text.parse().ok())?
}

/// `hh:mm:ss.fff` (s).
fn clock_seconds(text: &str) -> Option<f64> {
    let mut parts = text.splitn(3, ':');
    let (hour, minute) = (whole(parts.next()?)?, whole(parts.next()?)?);
    let second = number(parts.next()?, DecimalSign::Point).ok()?;
    let valid = hour < 24 && minute < 60 && (0.0..61.0).contains(&second);
    valid.then_some((hour * 3600 + minute * 60) as f64 + second)
}

/// The clock and its offset from UTC (s).
fn split_zone(text: &str) -> Option<(&str, f64)> {
    if let Some(clock) = text.strip_suffix(['Z', 'z']) {
        return Some((clock, 0.0));
    }
    let Some(at) = text.find(['+', '-']) else {
        return Some((text, 0.0));
    };
    let (clock, zone) = text.split_at_checked(at)?;
    let sign = if zone.starts_with('-') { -1.0 } else { 1.0 };
    let (hours, minutes) = zone.trim_start_matches(['+', '-']).split_once(':')?;
    Some((clock, sign * (whole(hours)? * 3600 + whole(minutes)? * 60) as f64))
}

/// Days of the Gregorian calendar since 1970-01-01 (H. Hinnant, "chrono-compatible low-level date algorithms").
const fn days_since_1970(year: i64, month: i64, day: i64) -> i64 {
    let year = if month <= 2 { year - 1 } else { year };
    let era = year.div_euclid(400);
    let year_of_era = year.rem_euclid(400);
    let day_of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    let day_of_era = year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year;
    era * 146_097 + day_of_era - 719_468
}
