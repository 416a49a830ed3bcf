//! Text, numbers and tables as HTML. Text from outside passes through [`escape`]; nothing refers to other files or addresses.

use super::STYLE;
use crate::text::fixed;
use crate::text::printable;

/// Shown for a number that is missing or not finite.
pub(super) const NONE: &str = "–";
/// A blank as wide as a digit.
const FIGURE_SPACE: &str = "\u{2007}";

/// A page that needs nothing else; `body` is HTML, the rest is text.
pub(super) fn page(heading: &str, robot: &str, body: &str, origin: &str) -> String {
    let [heading, robot, origin] = [heading, robot, origin].map(escape);
    let mut html = String::from("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
    html.push_str("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n");
    add(&mut html, &format!("<title>{heading}: {robot}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n"));
    add(&mut html, &format!("<h1>{heading}</h1>\n<p class=\"lead\">{robot}</p>\n{body}"));
    add(&mut html, &format!("<p class=\"small soft\">{origin}</p>\n</body>\n</html>\n"));
    html
}

/// Appends formatted text.
pub(super) fn add(html: &mut String, part: &str) {
    html.push_str(part);
}

/// Escapes text from outside: control characters and special characters of HTML are replaced. An address stays readable, but the
/// file contains no double slash.
pub(super) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in printable(text).chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            '/' if escaped.ends_with('/') => escaped.push_str("&#47;"),
            c => escaped.push(c),
        }
    }
    escaped
}

/// Text from outside as a CSS string, with quotes. Only ASCII letters and digits are not escaped.
pub(super) fn css_string(text: &str) -> String {
    let escaped = |c: char| {
        if c.is_ascii_alphanumeric() || matches!(c, ' ' | '-' | '_' | '.' | ',') {
            c.to_string()
        } else {
            format!("\\{:06x} ", u32::from(c))
        }
    };
    let text: String = printable(text).chars().map(escaped).collect();
    format!("\"{text}\"")
}

/// A number with fixed decimals and a true minus sign.
pub(super) fn number(value: f64, decimals: usize) -> String {
    if value.is_finite() { fixed(value, decimals).replace('-', "−") } else { NONE.to_owned() }
}

/// A number that may be missing.
pub(super) fn optional(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| NONE.to_owned(), |value| number(value, decimals))
}

/// A number with fixed decimals, padded so that its point lines up with numbers of `most` decimals.
pub(super) fn aligned(value: Option<f64>, decimals: usize, most: usize) -> String {
    let shown = optional(value, decimals);
    if shown == NONE { shown } else { shown + &FIGURE_SPACE.repeat(most.saturating_sub(decimals)) }
}

/// Kind of a table column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Column {
    /// Text with line breaks.
    Text,
    /// Text on one line.
    Word,
    /// Numbers, aligned to the right.
    Number,
}

impl Column {
    const fn class(self) -> &'static str {
        match self {
            Self::Text => "",
            Self::Word => " class=\"w\"",
            Self::Number => " class=\"n\"",
        }
    }
}

/// A table; heads and cells are HTML. `keeps` it on one page.
pub(super) fn table(caption: &str, columns: &[(&str, Column)], rows: &[Vec<String>], keeps: bool) -> String {
    let mut html = String::from("<div class=\"scroll\"><table");
    html.push_str(if keeps { " class=\"keep\">" } else { ">" });
    if !caption.is_empty() {
        add(&mut html, &format!("<caption>{caption}</caption>"));
    }
    html.push_str("<thead><tr>");
    for (name, column) in columns {
        add(&mut html, &format!("<th scope=\"col\"{}>{name}</th>", column.class()));
    }
    html.push_str("</tr></thead>\n<tbody>\n");
    for row in rows {
        html.push_str("<tr>");
        for (cell, (_, column)) in row.iter().zip(columns) {
            add(&mut html, &format!("<td{}>{cell}</td>", column.class()));
        }
        html.push_str("</tr>\n");
    }
    html.push_str("</tbody></table></div>\n");
    html
}

/// Names with values; values are HTML, and empty ones are left out.
pub(super) fn facts(rows: &[(&str, String)]) -> String {
    let mut html = String::from("<table class=\"kv\"><tbody>\n");
    for (name, value) in rows.iter().filter(|(_, value)| !value.is_empty()) {
        add(&mut html, &format!("<tr><th scope=\"row\">{name}</th><td>{value}</td></tr>\n"));
    }
    html.push_str("</tbody></table>\n");
    html
}

/// A paragraph; `html` as it is.
pub(super) fn paragraph(html: &str) -> String {
    format!("<p>{html}</p>\n")
}

/// Points in order, each HTML.
pub(super) fn list(points: &[String]) -> String {
    let points: Vec<String> = points.iter().map(|point| format!("<li>{point}</li>\n")).collect();
    format!("<ul>\n{}</ul>\n", points.concat())
}

/// A time of RFC 3339 in UTC as it is read: date, time to the minute.
pub(super) fn time(text: &str) -> String {
    let minute = text.get(..16).filter(|_| text.ends_with('Z') && text.is_ascii());
    escape(&minute.map_or_else(|| text.to_owned(), |minute| minute.replace('T', " ") + " UTC"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_foreign_becomes_markup() {
        assert_eq!(escape("<script>alert('x')</script>"), "&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt;");
        assert_eq!(escape("a\u{1b}[31m\u{202e}b"), "a\u{fffd}[31m\u{fffd}b");
        assert_eq!(escape("x://y///z & \"Ä 机器人\""), "x:/&#47;y/&#47;/z &amp; &quot;Ä 机器人&quot;");
        assert_eq!(
            css_string("a\"}</style>\\é"),
            "\"a\\000022 \\00007d \\00003c \\00002f style\\00003e \\00005c \\0000e9 \""
        );
    }

    #[test]
    fn numbers_that_are_none_are_a_dash() {
        assert_eq!([f64::NAN, f64::INFINITY, f64::NEG_INFINITY].map(|value| number(value, 3)), [NONE; 3]);
        assert_eq!(number(-0.00001, 3), "0.000");
        assert_eq!(number(-1.5, 1), "−1.5");
        assert_eq!(aligned(Some(0.12), 2, 4), "0.12\u{2007}\u{2007}");
        assert_eq!(aligned(None, 2, 4), NONE);
    }

    #[test]
    fn a_time_is_read_to_the_minute() {
        assert_eq!(time("2026-01-05T08:00:59Z"), "2026-01-05 08:00 UTC");
        assert_eq!(time("<soon>"), "&lt;soon&gt;");
    }
}
