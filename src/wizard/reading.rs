//! Readings: parsing of typed or pasted coordinates, and the checks that every reading passes.

use nalgebra::Point3;

use crate::session::measurements::NamedPoint;
use crate::session::reading::Reading;
use crate::session::set_up::CoordinateUnit;
use crate::text::{counted, printable, shortened};
use crate::units::{MILLIMETRE, to_mm};

/// Largest scatter of the shots, as a multiple of the scatter expected from the instrument's σ.
const SCATTER_FACTOR: f64 = 5.0;
/// Scatter that is accepted from every instrument (m).
const SCATTER_ALWAYS: f64 = 0.03 * MILLIMETRE;
/// Columns of the typed text that a message quotes.
const QUOTED: usize = 41;
/// Range that no instrument exceeds (m).
const FARTHEST: f64 = 1000.0;

/// Reads three coordinates in `unit`: `1234.5 -20 88.1`, `x=1 y=2 z=3`, `1.5; 2.5; 3.5`, `[1, 2, 3]`, `1,5; 2,5; 3,5`, with or
/// without `mm` behind the numbers.
///
/// # Errors
/// What is wrong with the text, and how it should read.
pub fn parse(text: &str, unit: CoordinateUnit) -> Result<Point3<f64>, String> {
    let expected = || {
        format!("'{}' is not a point; type three numbers in {}, such as '1234.567 -20.1 88'", quoted(text), unit.sign())
    };
    let cleaned: String = text
        .chars()
        .map(|c| match c {
            // Characters that people and programs put around coordinates.
            '(' | ')' | '[' | ']' | '{' | '}' | '<' | '>' | '\t' | '\r' | '\n' | '|' | '\u{a0}' => ' ',
            '\u{2212}' => '-',
            c => c,
        })
        .collect();
    let separated =
        separate(&cleaned).map_err(|advice| format!("'{}' can be read in several ways; {advice}", quoted(text)))?;
    let mut values = Vec::with_capacity(3);
    let mut axes = String::new();
    for word in separated {
        let word = strip_name(&word, &mut axes);
        if let Some(other) = CoordinateUnit::ALL.iter().find(|other| other.sign() == word) {
            if *other != unit {
                return Err(format!(
                    "the reading is in {}, but {} was chosen in the instrument step",
                    other.sign(),
                    unit.sign()
                ));
            }
            continue;
        }
        let number = word.strip_suffix(unit.sign()).unwrap_or(word);
        if number.is_empty() {
            continue;
        }
        let value: f64 = number.parse().map_err(|_error| expected())?;
        if !value.is_finite() {
            return Err(expected());
        }
        values.push(value);
    }
    if !axes.is_empty() && axes != "xyz" {
        return Err(format!("the coordinates are named '{axes}': give x, y and z, in this order"));
    }
    match values[..] {
        [x, y, z] => Ok(Point3::new(x, y, z) * unit.size()),
        [_, _, _, ..] => Err(format!(
            "found {} numbers in '{}': one point at a time, three numbers in {}",
            values.len(),
            quoted(text),
            unit.sign()
        )),
        _ => Err(format!("{}; found {}", expected(), counted(values.len(), "number"))),
    }
}

/// Checks that a text would be accepted as the coordinates of a measured point in `unit`.
///
/// # Errors
/// Why the text was rejected.
pub fn check(text: &str, unit: CoordinateUnit) -> Result<(), String> {
    let point = parse(text, unit)?;
    gate(&point, None).map_or(Ok(()), Err)
}

/// Parses one point, or one per line. A line may begin with the name of its point, and a line of titles is passed over.
///
/// # Errors
/// What is wrong, and in which line.
pub fn parse_all(text: &str, unit: CoordinateUnit) -> Result<Vec<Point3<f64>>, String> {
    Ok(parse_named(text, unit)?.into_iter().map(|named| named.point).collect())
}

/// As [`parse_all`], with the names of the points.
///
/// # Errors
/// What is wrong, and in which line.
pub fn parse_named(text: &str, unit: CoordinateUnit) -> Result<Vec<NamedPoint>, String> {
    let lines: Vec<&str> = text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    let one = parse(text, unit);
    if one.is_ok() || lines.len() < 2 {
        return one.map(|point| vec![NamedPoint { name: None, point }]);
    }
    let mut points = Vec::new();
    for (line, number) in lines.iter().zip(1..) {
        let named = || {
            let (name, rest) = line.split_once([' ', '\t', ',', ';'])?;
            let point = parse(rest.trim_start_matches([' ', ',', ';']), unit).ok()?;
            let is_name = name.contains(char::is_alphabetic) || name.chars().all(|c| c.is_ascii_digit());
            is_name.then(|| NamedPoint { name: Some(name.to_owned()), point })
        };
        match parse(line, unit) {
            Ok(point) => points.push(NamedPoint { name: None, point }),
            Err(problem) => match named() {
                Some(point) => points.push(point),
                None if number == 1 && !line.contains(|c: char| c.is_ascii_digit()) => {}
                None => return Err(format!("line {number}: {problem}")),
            },
        }
    }
    if points.is_empty() { Err("there is no point in these lines".to_owned()) } else { Ok(points) }
}

/// Advice on numbers that can be read in several ways.
const SEPARATE: &str = "separate the numbers by blanks or ';'";
const NO_THOUSANDS: &str = "leave out the thousands separator";
const ONE_DECIMAL_SIGN: &str = "write all decimals with a point";

/// The words of a point. A comma is a separator or a decimal sign; where it is not clear which, returns advice instead.
fn separate(text: &str) -> Result<Vec<String>, &'static str> {
    let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    let has_both = |text: &str| text.contains(',') && text.contains('.');
    // `1,234.5`, `1.234,5`: in one number, one of them is a thousands separator.
    let mixed = |numbers: &[String]| {
        let is_long = |number: &String| has_both(number.trim_matches(','));
        if numbers.iter().any(is_long) { NO_THOUSANDS } else { ONE_DECIMAL_SIGN }
    };
    if text.contains(';') {
        // Numbers are separated by ';', so a comma is a decimal sign, unless there are points as well.
        let numbers = text.replace(';', " ");
        return if has_both(text) { Err(mixed(&words(&numbers))) } else { Ok(words(&numbers.replace(',', "."))) };
    }
    if !text.contains(',') {
        return Ok(words(text));
    }
    let parts = words(text);
    let has_outer_commas = parts.iter().any(|part| part.ends_with(',') || part.starts_with(','));
    if has_outer_commas {
        // `1, 2, 3`: separators. A comma inside a word would then be ambiguous.
        let inner: Vec<&String> = parts.iter().filter(|part| part.trim_matches(',').contains(',')).collect();
        return match inner.as_slice() {
            [] => Ok(words(&text.replace(',', " "))),
            inner if inner.iter().any(|part| part.contains('.')) => Err(NO_THOUSANDS),
            _ => Err(SEPARATE),
        };
    }
    if parts.len() >= 3 {
        // `1,5 2,5 3,5`: decimal commas, if there is no decimal point. A single comma before three digits may mean thousands.
        let with_comma: Vec<&String> = parts.iter().filter(|part| part.contains(',')).collect();
        let thousands = match with_comma.as_slice() {
            [only] => {
                only.split_once(',').is_some_and(|(_, behind)| behind.chars().filter(char::is_ascii_digit).count() == 3)
            }
            _ => false,
        };
        return match (text.contains('.'), thousands) {
            (true, _) => Err(mixed(&parts)),
            (false, true) => Err("leave out the thousands separator, or write decimals with a point"),
            (false, false) => Ok(words(&text.replace(',', "."))),
        };
    }
    // `1.5,2.5,3.5`: separators, if every part is a number on its own.
    let parts: Vec<&str> = text.split(',').collect();
    let is_clear = parts.len() == 3 && (text.contains('.') || parts.iter().all(|part| part.trim().len() > 3));
    if is_clear { Ok(words(&text.replace(',', " "))) } else { Err(SEPARATE) }
}

/// Strips the name of the axis from `x=12` or `X:12`, and appends it to `axes`.
fn strip_name<'a>(word: &'a str, axes: &mut String) -> &'a str {
    let name = word.chars().next().map(|c| c.to_ascii_lowercase()).filter(|c| matches!(c, 'x' | 'y' | 'z'));
    match (name, word.get(1..)) {
        (Some(name), Some(rest)) => {
            axes.push(name);
            rest.trim_start_matches(['=', ':'])
        }
        _ => word.trim_matches(['=', ':']),
    }
}

/// The beginning of the typed text, on one line.
fn quoted(text: &str) -> String {
    let words: Vec<&str> = text.split_whitespace().collect();
    shortened(&printable(&words.join(" ")), QUOTED)
}

/// A reading from typed coordinates.
pub(super) const fn typed(point: Point3<f64>) -> Reading {
    Reading {
        point,
        sigma: None,
        scatter: None,
        shots: 1,
        temperature: None,
        pressure: None,
        humidity: None,
        configuration: None,
        joint_scatter: None,
        remarks: Vec::new(),
        seconds: 0.0,
    }
}

/// Why a reading is not a measurement at all.
pub(super) fn gate(point: &Point3<f64>, previous: Option<&Point3<f64>>) -> Option<String> {
    if !point.coords.iter().all(|value| value.is_finite()) {
        return Some("the reading is not a number".to_owned());
    }
    if point.coords.amax() <= f64::EPSILON {
        return Some("the reading is 0, 0, 0: the instrument has no target".to_owned());
    }
    if point.coords.norm() > FARTHEST {
        return Some(format!("the reading is {:.0} m away: no instrument measures that far", point.coords.norm()));
    }
    if previous.is_some_and(|previous| previous == point) {
        return Some(
            "identical to the previous reading to the last digit: the instrument did not take a new measurement"
                .to_owned(),
        );
    }
    None
}

/// Why the joint values that came with a reading are not valid for a robot with `joints` joints.
pub(super) fn foreign_joints(reading: &Reading, joints: usize) -> Option<String> {
    let reported = reading.configuration.as_ref()?;
    let fits = reported.len() == joints && reported.iter().all(|value| value.is_finite());
    (!fits).then(|| format!("the robot reported {} joint values that are not valid for this arm", reported.len()))
}

/// Largest scatter (m) of the shots of a robot at rest, for an instrument with `sigma` (m) per coordinate.
pub(super) fn scatter_limit(sigma: Option<f64>) -> f64 {
    sigma.map_or(SCATTER_ALWAYS, |sigma| (SCATTER_FACTOR * 3.0_f64.sqrt() * sigma).max(SCATTER_ALWAYS))
}

/// The message about shots that scatter too much.
pub(super) fn scatter_message(scatter: f64, limit: f64) -> String {
    format!(
        "the shots scatter by {:.3} mm, up to {:.3} mm is usual: the robot was still moving, or something vibrates",
        to_mm(scatter),
        to_mm(limit)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mm(text: &str) -> Result<[f64; 3], String> {
        let point = parse(text, CoordinateUnit::Millimetre)?;
        Ok([point.x, point.y, point.z].map(|value| (value * 1e9).round() / 1e6))
    }

    #[test]
    fn points_are_read_as_people_write_them() {
        let wanted = Ok([1234.567, -20.1, 88.0]);
        for text in [
            "1234.567 -20.1 88",
            "1234.567, -20.1, 88",
            "1234.567,-20.1,88",
            "1234,567 -20,1 88,0",
            "1234,567; -20,1; 88",
            "1234.567\t-20.1\t88\r\n",
            "[1234.567, -20.1, 88.0]",
            "x=1234.567 y=-20.1 z=88",
            "X: 1234.567 Y: -20.1 Z: 88",
            "1234.567mm -20.1mm 88mm",
            "1234.567 mm −20.1 mm 88 mm",
            "1.234567e3 -2.01e1 88",
        ] {
            assert_eq!(mm(text), wanted, "{text}");
        }
        assert_eq!(parse("1 2 3", CoordinateUnit::Metre), Ok(Point3::new(1.0, 2.0, 3.0)));
    }

    #[test]
    fn what_is_no_point_is_refused_with_a_reason() {
        for (text, part) in [
            ("", "found 0 numbers"),
            ("1 2", "found 2 numbers"),
            ("1 2 3 4", "found 4 numbers in '1 2 3 4': one point at a time, three numbers in mm"),
            (
                "100.5 200.25 300.125\n110.5 210.25 310.125\n1 2 3",
                "found 9 numbers in '100.5 200.25 300.125 110.5 210.25 310.12…': one point at a time",
            ),
            ("1 2 x", "named 'x'"),
            ("one two three", "is not a point"),
            ("nan 1 2", "is not a point"),
            ("1,2,3", "several ways; separate the numbers by blanks or ';'"),
            ("1,5, 2,5, 3,5", "several ways; separate the numbers by blanks or ';'"),
            ("1,234.5; 2,0; 3", "several ways; leave out the thousands separator"),
            ("1.234,5; 2; 3", "several ways; leave out the thousands separator"),
            ("1,234.5 2 3", "several ways; leave out the thousands separator"),
            ("1,234.5, 2, 3", "several ways; leave out the thousands separator"),
            ("1,5; 2.5; 3", "several ways; write all decimals with a point"),
            ("1,5 2.5 3", "several ways; write all decimals with a point"),
            ("1,234 -20 88", "several ways; leave out the thousands separator, or write decimals with a point"),
            ("Z 88 Y -20.1 X 1234.5", "named 'zyx'"),
            ("x=1 2 3", "named 'x'"),
            ("1 2 3 in", "was chosen in the instrument step"),
        ] {
            let error = mm(text).unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
    }

    #[test]
    fn what_would_be_refused_is_known_before_it_is_sent() {
        assert_eq!(check("1234.5 -20 88", CoordinateUnit::Millimetre), Ok(()));
        for (text, unit, part) in [
            ("1 2", CoordinateUnit::Millimetre, "found 2 numbers"),
            ("1 2 3 in", CoordinateUnit::Millimetre, "was chosen in the instrument step"),
            ("0 0 0", CoordinateUnit::Inch, "0, 0, 0"),
            ("1234.5 -20 88", CoordinateUnit::Metre, "m away"),
        ] {
            let error = check(text, unit).unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
    }

    #[test]
    fn gates_hold_back_what_is_no_measurement() {
        let point = Point3::new(1.0, 2.0, 3.0);
        assert_eq!(gate(&point, None), None);
        assert_eq!(gate(&point, Some(&Point3::new(1.0, 2.0, 3.000_001))), None);
        for (point, previous, part) in [
            (Point3::new(f64::NAN, 0.0, 1.0), None, "not a number"),
            (Point3::origin(), None, "0, 0, 0"),
            (Point3::new(5000.0, 0.0, 0.0), None, "5000 m away"),
            (point, Some(&point), "last digit"),
        ] {
            assert!(gate(&point, previous).unwrap().contains(part));
        }
    }

    #[test]
    fn lines_are_points_with_or_without_names() {
        let mm = CoordinateUnit::Millimetre;
        let all = |text: &str| parse_all(text, mm).map(|points| points.len());
        assert_eq!(all("1 2 3"), Ok(1));
        assert_eq!(all("1000\n2000\n3000"), Ok(1), "one coordinate per line");
        assert_eq!(all("1000 2 3\n\n4000 5 6\r\n7000 8 9\n"), Ok(3));
        assert_eq!(all("Name;X;Y;Z\nP1;1000,5;2;3\nP2;4000;5;6"), Ok(2));
        let point = parse_all("SMR_1, 1000.5, -2, 3\nSMR_2, 4, 5, 6000", mm).unwrap()[0];
        assert!((point.x - 1.0005).abs() < 1e-12 && (point.y + 0.002).abs() < 1e-12);
        assert!(parse_all("1000 2 3\n4000 5\n7000 8 9", mm).unwrap_err().starts_with("line 2: "));
        assert!(parse_all("a b\nc d", mm).is_err());
    }
}
