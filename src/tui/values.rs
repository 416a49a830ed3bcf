//! The content of a step as names and values, for plain lines.

use serde_json::Value;

use crate::wizard::view::{Content, LiveView};

/// Longest list that is written on one line, and entries of longer ones that are shown.
const SHORT_LIST: usize = 8;

/// The content in lines, indented; long lists are cut unless everything is asked for.
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
        let name = name.replace('_', " ");
        match value {
            Value::Null => {}
            Value::Array(values) if values.is_empty() => {}
            Value::Array(values) if values.len() <= SHORT_LIST && !values.iter().any(is_nested) => {
                lines.push(format!("{indent}{name}: {}", short(value)));
            }
            Value::Array(values) => {
                lines.push(format!("{indent}{name}: {}", values.len()));
                let most = if has_all { values.len() } else { SHORT_LIST };
                lines.extend(values.iter().take(most).map(|value| format!("{indent}  - {}", short(value))));
                if values.len() > most {
                    lines.push(format!("{indent}  and {} more: type 'all'", values.len() - most));
                }
            }
            Value::Object(_) => {
                lines.push(format!("{indent}{name}:"));
                collect(depth + 1, value, has_all, lines);
            }
            value => lines.push(format!("{indent}{name}: {}", short(value))),
        }
    }
}

const fn is_nested(value: &Value) -> bool {
    matches!(value, Value::Object(_) | Value::Array(_))
}

/// A value on a part of a line.
fn short(value: &Value) -> String {
    match value {
        Value::Null => "-".to_owned(),
        Value::String(text) => text.clone(),
        Value::Bool(true) => "yes".to_owned(),
        Value::Bool(false) => "no".to_owned(),
        Value::Number(number) => match number.as_f64().filter(|_| number.is_f64()) {
            Some(value) => format!("{value:.4}"),
            None => number.to_string(),
        },
        Value::Array(values) => values.iter().map(short).collect::<Vec<_>>().join(", "),
        Value::Object(fields) => {
            let fields = fields.iter().filter(|(_, value)| !value.is_null());
            fields
                .map(|(name, value)| format!("{} {}", name.replace('_', " "), short(value)))
                .collect::<Vec<_>>()
                .join(", ")
        }
    }
}

/// What the instrument sees, in a line.
pub(super) fn live(live: &LiveView) -> Option<String> {
    if live.down.is_some() {
        return Some("the link is down".to_owned());
    }
    live.point_mm?;
    let mut parts = Vec::new();
    parts.extend(live.rest_s.map(|seconds| format!("SMR rests {seconds:.1} s")));
    parts.extend(live.scatter_mm.map(|scatter| format!("scatter {scatter:.3} mm")));
    parts.extend(live.from_predicted_mm.map(|distance| format!("{distance:.1} mm from predicted")));
    Some(parts.join(", "))
}
