//! The content of a step as names and values, for plain lines.

use serde_json::Value;

use crate::wizard::view::{Content, LiveView};

/// Longest list that is written on one line, and number of entries shown of a longer one.
const SHORT_LIST: usize = 8;

/// The content as indented lines. Long lists are cut unless `has_all`.
pub(super) fn lines(content: &Content, has_all: bool) -> Vec<String> {
    let mut lines = Vec::new();
    if let Ok(Value::Object(steps)) = serde_json::to_value(content) {
        for value in steps.values() {
            collect(1, value, has_all, &mut lines);
        }
    }
    lines
}

fn collect(depth: usize, value: &Value, has_all: bool, lines: &mut Vec<String>) {
    let Value::Object(fields) = value else { return };
    let indent = "  ".repeat(depth);
    for (name, value) in fields {
        let name = name.trim_start_matches("is_").replace('_', " ");
        match value {
            // What is not so, or not there, needs no line.
            Value::Null | Value::Bool(false) => {}
            Value::Number(number) if number.as_u64() == Some(0) => {}
            Value::String(text) if text.is_empty() => {}
            Value::Bool(true) => lines.push(format!("{indent}{name}")),
            Value::Array(values) if values.is_empty() => {}
            Value::Array(values) if values.len() <= SHORT_LIST && !values.iter().any(is_nested) => {
                lines.push(format!("{indent}{name}: {}", inline(value)));
            }
            Value::Array(values) => {
                lines.push(format!("{indent}{name}: {}", values.len()));
                let most = if has_all { values.len() } else { SHORT_LIST };
                lines.extend(values.iter().take(most).map(|value| format!("{indent}  - {}", inline(value))));
                if values.len() > most {
                    lines.push(format!("{indent}  and {} more: type 'all'", values.len() - most));
                }
            }
            Value::Object(_) => {
                lines.push(format!("{indent}{name}:"));
                collect(depth + 1, value, has_all, lines);
            }
            value => lines.push(format!("{indent}{name}: {}", inline(value))),
        }
    }
}

const fn is_nested(value: &Value) -> bool {
    matches!(value, Value::Object(_) | Value::Array(_))
}

/// A value within a line.
fn inline(value: &Value) -> String {
    match value {
        Value::Null => "-".to_owned(),
        Value::String(text) => text.clone(),
        Value::Bool(true) => "yes".to_owned(),
        Value::Bool(false) => "no".to_owned(),
        Value::Number(number) => match number.as_f64().filter(|_| number.is_f64()) {
            Some(value) => format!("{value:.4}"),
            None => number.to_string(),
        },
        Value::Array(values) => values.iter().map(inline).collect::<Vec<_>>().join(", "),
        Value::Object(fields) => {
            let fields = fields.iter().filter(|(_, value)| !value.is_null());
            fields
                .map(|(name, value)| format!("{} {}", name.replace('_', " "), inline(value)))
                .collect::<Vec<_>>()
                .join(", ")
        }
    }
}

/// Silence that is not reported yet (s).
const SILENT: f64 = 2.0;

/// The position of the SMR in a line, or why it is unknown.
pub(super) fn seen(live: &LiveView) -> String {
    match (live.point_mm, live.silent_s) {
        (Some([x, y, z]), _) => format!("x {x:.3}  y {y:.3}  z {z:.3} mm"),
        (None, _) if live.is_blind => "no live view: this instrument shows nothing between measurements".to_owned(),
        (None, Some(seconds)) => silent(seconds),
        (None, None) => "no SMR".to_owned(),
    }
}

/// How long the instrument has been silent.
fn silent(seconds: f64) -> String {
    if seconds < SILENT {
        "...".to_owned()
    } else {
        format!("nothing: the instrument has been silent for {seconds:.0} s")
    }
}

/// The live reading in a line.
pub(super) fn live(live: &LiveView) -> Option<String> {
    if live.down.is_some() {
        return Some("the link is down".to_owned());
    }
    if live.is_blind {
        return None;
    }
    if let (None, Some(seconds)) = (live.point_mm, live.silent_s) {
        return (seconds >= SILENT).then(|| format!("the instrument has been silent for {seconds:.0} s"));
    }
    live.point_mm?;
    let mut parts = Vec::new();
    parts.extend(live.rest_s.map(|seconds| format!("SMR at rest for {seconds:.1} s")));
    parts.extend(live.scatter_mm.map(|scatter| format!("scatter {scatter:.3} mm")));
    parts.extend(match (&live.at_pose, live.from_predicted_mm) {
        (Some(pose), _) => Some(format!("the robot is at pose {pose}")),
        (None, distance) => distance.map(|distance| format!("{distance:.1} mm from predicted")),
    });
    Some(parts.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nothing is seen.
    fn nothing() -> LiveView {
        LiveView {
            point_mm: None,
            is_blind: false,
            silent_s: None,
            rest_s: None,
            scatter_mm: None,
            from_predicted_mm: None,
            joints: None,
            joints_shown: Vec::new(),
            flange_in_base_mm: None,
            smr_in_base_mm: None,
            joint_difference: None,
            is_still: None,
            at_pose: None,
            down: None,
            track: Vec::new(),
        }
    }

    #[test]
    fn why_nothing_is_seen_is_said_as_it_is() {
        let silent = |seconds| LiveView { silent_s: Some(seconds), ..nothing() };
        let blind = LiveView { is_blind: true, ..nothing() };
        for (view, where_it_is, now) in [
            (nothing(), "no SMR", None),
            (silent(1.5), "...", None),
            (
                silent(3.2),
                "nothing: the instrument has been silent for 3 s",
                Some("the instrument has been silent for 3 s"),
            ),
            (blind, "no live view: this instrument shows nothing between measurements", None),
        ] {
            assert_eq!((seen(&view).as_str(), live(&view).as_deref()), (where_it_is, now));
        }
        let rests = LiveView { point_mm: Some([1.0, 2.0, 3.0]), rest_s: Some(4.9), ..nothing() };
        assert_eq!(live(&rests).as_deref(), Some("SMR at rest for 4.9 s"));
    }
}
