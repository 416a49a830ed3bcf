//! Expectations of a script.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::wizard::ViewModel;

/// A condition on one value of the view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Check {
    /// Is exactly this text.
    Is(String),
    /// Contains this text.
    Contains(String),
    /// Is a number below this limit.
    Below(f64),
    /// Is a number above this limit.
    Above(f64),
    /// Is present and not empty.
    Exists,
    /// Is absent or empty.
    Absent,
}

impl Check {
    /// Tests the value at `path` of the view. The error says what was expected and what was seen.
    pub(super) fn test(&self, view: &ViewModel, path: &str) -> Result<(), String> {
        let root = serde_json::to_value(view).map_err(|error| error.to_string())?;
        let found = find(&root, path);
        let seen = match &found {
            Ok(value) => text_of(value),
            Err(nearest) => nearest.clone(),
        };
        let is_met = match (self, &found) {
            (Self::Absent, Err(_)) => true,
            (Self::Absent, Ok(value)) => is_empty(value),
            (Self::Exists, Ok(value)) => !is_empty(value),
            (Self::Is(text), Ok(value)) => text_of(value) == *text,
            (Self::Contains(text), Ok(value)) => text_of(value).contains(text.as_str()),
            (Self::Below(limit), Ok(value)) => value.as_f64().is_some_and(|number| number < *limit),
            (Self::Above(limit), Ok(value)) => value.as_f64().is_some_and(|number| number > *limit),
            (_, Err(_)) => false,
        };
        if is_met { Ok(()) } else { Err(format!("expected {path} {}; seen: {seen}", self.words())) }
    }

    /// The condition in words.
    fn words(&self) -> String {
        match self {
            Self::Is(text) => format!("to be '{text}'"),
            Self::Contains(text) => format!("to contain '{text}'"),
            Self::Below(limit) => format!("to be below {limit}"),
            Self::Above(limit) => format!("to be above {limit}"),
            Self::Exists => "to be present".to_owned(),
            Self::Absent => "to be absent".to_owned(),
        }
    }
}

/// The value at a path such as `capture.rows.0.pose`; paths into the step's own part need no `content.`. The error says where the
/// path ends and which names exist there.
fn find<'a>(root: &'a Value, path: &str) -> Result<&'a Value, String> {
    let mut parts = path.split('.').peekable();
    let mut at = root;
    if let Some(first) = parts.peek()
        && root.get(first).is_none()
        && let Some(content) = root.get("content")
    {
        at = content;
    }
    let mut walked = Vec::new();
    for part in parts {
        let next = match part.parse::<usize>() {
            Ok(index) => at.get(index),
            Err(_) => at.get(part),
        };
        at = next.ok_or_else(|| {
            let parent = if walked.is_empty() { "the view".to_owned() } else { walked.join(".") };
            format!("no '{part}' in {parent}, which has {}", names_in(at))
        })?;
        walked.push(part);
    }
    Ok(at)
}

fn names_in(value: &Value) -> String {
    match value {
        Value::Object(fields) => fields.keys().cloned().collect::<Vec<_>>().join(", "),
        Value::Array(items) => format!("{} entries", items.len()),
        other => text_of(other),
    }
}

fn is_empty(value: &Value) -> bool {
    match value {
        Value::Null => true,
        Value::Array(items) => items.is_empty(),
        Value::String(text) => text.is_empty(),
        Value::Object(_) | Value::Bool(_) | Value::Number(_) => false,
    }
}

/// A text as it is, everything else as JSON.
fn text_of(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Null => "nothing".to_owned(),
        other => other.to_string(),
    }
}
