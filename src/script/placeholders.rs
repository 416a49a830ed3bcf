//! `${name:default}` in the text of a script.

use std::collections::{BTreeMap, BTreeSet};

use super::error::ScriptError;

/// The text with all placeholders replaced. Comments are left alone.
pub(super) fn fill(text: &str, values: &BTreeMap<String, String>) -> Result<String, ScriptError> {
    let mut filled = String::with_capacity(text.len());
    let mut names = BTreeSet::new();
    for (index, line) in text.lines().enumerate() {
        if line.trim_start().starts_with("//") {
            filled.push_str(line);
            filled.push('\n');
            continue;
        }
        let mut rest = line;
        while let Some((before, after)) = rest.split_once("${") {
            filled.push_str(before);
            let (inside, after) = after.split_once('}').ok_or(ScriptError::OpenPlaceholder { line: index + 1 })?;
            let (name, default) = match inside.split_once(':') {
                Some((name, default)) => (name, Some(default)),
                None => (inside, None),
            };
            names.insert(name.to_owned());
            let value = values.get(name).map(String::as_str).or(default);
            filled.push_str(value.ok_or_else(|| ScriptError::MissingValue { name: name.to_owned() })?);
            rest = after;
        }
        filled.push_str(rest);
        filled.push('\n');
    }
    if let Some(name) = values.keys().find(|name| !names.contains(*name)) {
        let known = if names.is_empty() { "none".to_owned() } else { names.into_iter().collect::<Vec<_>>().join(", ") };
        return Err(ScriptError::UnknownValue { name: name.clone(), known });
    }
    Ok(filled)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(pairs: &[(&str, &str)]) -> BTreeMap<String, String> {
        pairs.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect()
    }

    #[test]
    fn values_replace_placeholders_and_defaults_fill_the_rest() {
        let text = "a(${seed:1}, \"${file}\")\n// ${not this}\n${seed:1}";
        let filled = fill(text, &values(&[("file", "x.csv"), ("seed", "7")])).unwrap();
        assert_eq!(filled, "a(7, \"x.csv\")\n// ${not this}\n7\n");
        assert_eq!(fill("${seed:1}", &values(&[])).unwrap(), "1\n");
    }

    #[test]
    fn what_is_missing_or_unknown_is_named() {
        assert_eq!(fill("${file}", &values(&[])), Err(ScriptError::MissingValue { name: "file".to_owned() }));
        let unknown = fill("${seed:1}", &values(&[("sed", "1")])).unwrap_err();
        assert_eq!(unknown.to_string(), "the script has no placeholder 'sed'; it has: seed");
        assert_eq!(fill("\n${seed", &values(&[])), Err(ScriptError::OpenPlaceholder { line: 2 }));
    }
}
