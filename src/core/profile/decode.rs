//! Decodes the syntax tree into values. Every function reports problems with their location and returns `None`, so that one pass
//! over the file finds all problems.

use nalgebra::{Point3, Unit, Vector3};

use super::diagnostic::{Findings, Span};
use super::syntax::{Ast, Field, Node, shortened};
use crate::text::{is_printable, near_miss};
use crate::units::Quantity;

/// Fields of a struct. Unknown and repeated ones were reported already.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fields<'t> {
    pub(super) span: Span,
    fields: &'t [Field],
}

impl<'t> Fields<'t> {
    /// Value of a field; `None` if it is absent or `None`.
    pub(super) fn get(&self, name: &str) -> Option<&'t Ast> {
        let value = self.fields.iter().find(|field| field.name == name).map(|field| &field.value)?;
        (!matches!(value.node, Node::Absent)).then_some(value)
    }

    /// Whether a field is given, be it as `None`.
    pub(super) fn states(&self, name: &str) -> bool {
        self.fields.iter().any(|field| field.name == name)
    }

    /// Decoded value of a field, or `default` if it is absent; `None` if it is invalid.
    pub(super) fn get_or<T>(&self, name: &str, default: T, decode: impl FnOnce(&'t Ast) -> Option<T>) -> Option<T> {
        match self.get(name) {
            Some(ast) => decode(ast),
            None => Some(default),
        }
    }

    /// Value of a required field.
    pub(super) fn require(&self, name: &str, example: &str, findings: &mut Findings<'_>) -> Option<&'t Ast> {
        let value = self.get(name);
        if value.is_none() {
            findings.error(self.start(), format!("field '{name}' is missing"), format!("add '{name}: {example}'"));
        }
        value
    }

    /// The opening bracket of the struct, as the location of missing fields.
    pub(super) fn start(&self) -> Span {
        Span::new(self.span.start, self.span.start + 1)
    }
}

/// Decodes a struct; unknown and repeated fields are errors.
pub(super) fn fields<'t>(
    ast: &'t Ast,
    what: &str,
    allowed: &[&str],
    findings: &mut Findings<'_>,
) -> Option<Fields<'t>> {
    let fields: &[Field] = match &ast.node {
        Node::Struct(fields) => fields,
        Node::Tuple(items) if items.is_empty() => &[],
        other => {
            let hint = format!("allowed fields: {}", allowed.join(", "));
            findings.error(
                ast.span,
                format!("{what} needs named fields '(name: value, ...)', found {}", other.describe()),
                hint,
            );
            return None;
        }
    };
    for (index, field) in fields.iter().enumerate() {
        if !allowed.contains(&field.name.as_str()) {
            let hint = unknown_hint(&field.name, allowed);
            findings.error(field.name_span, format!("unknown field '{}' in {what}", shortened(&field.name)), hint);
        } else if fields.iter().take(index).any(|earlier| earlier.name == field.name) {
            findings.error(
                field.name_span,
                format!("field '{}' is given twice", field.name),
                "keep one of them".to_owned(),
            );
        }
    }
    Some(Fields { span: ast.span, fields })
}

/// Hint `did you mean 'x'? allowed: …`.
pub(super) fn unknown_hint(given: &str, allowed: &[&str]) -> String {
    let list = allowed.join(", ");
    match near_miss(given, allowed) {
        Some(name) => format!("did you mean '{name}'? allowed: {list}"),
        None => format!("allowed: {list}"),
    }
}

/// Largest number (mm or deg): larger ones cannot describe a robot and could become infinite.
const LARGEST: f64 = 1e9;

/// Decodes a number that is finite and at most [`LARGEST`].
pub(super) fn number(ast: &Ast, findings: &mut Findings<'_>) -> Option<f64> {
    match &ast.node {
        Node::Number(number) if number.abs() <= LARGEST => Some(*number),
        Node::Number(number) => {
            findings.error(
                ast.span,
                format!("{number:e} is not a finite number of a plausible size"),
                "write a plain number".to_owned(),
            );
            None
        }
        other => {
            findings.error(ast.span, format!("expected a number, found {}", other.describe()), None);
            None
        }
    }
}

/// Decodes a number above zero.
pub(super) fn positive(ast: &Ast, findings: &mut Findings<'_>) -> Option<f64> {
    let value = number(ast, findings)?;
    if value > 0.0 {
        return Some(value);
    }
    findings.error(ast.span, format!("{value} is not above zero"), "give a number above 0".to_owned());
    None
}

/// Decodes a number that is at least zero.
pub(super) fn not_negative(ast: &Ast, findings: &mut Findings<'_>) -> Option<f64> {
    let value = number(ast, findings)?;
    if value >= 0.0 {
        return Some(value);
    }
    findings.error(ast.span, format!("{value} is below zero"), "give 0 or a number above 0".to_owned());
    None
}

/// Decodes a text: one line, not empty, without control characters.
pub(super) fn text(ast: &Ast, findings: &mut Findings<'_>) -> Option<String> {
    let Node::Text(text) = &ast.node else {
        findings.error(ast.span, format!("expected a text in \"quotes\", found {}", ast.node.describe()), None);
        return None;
    };
    if text.trim().is_empty() {
        findings.error(ast.span, "this text is empty", None);
        return None;
    }
    if !text.chars().all(is_printable) {
        let hint = "keep it on one line, without escape sequences".to_owned();
        findings.error(ast.span, "this text has control characters", hint);
        return None;
    }
    Some(text.clone())
}

/// Decodes `true` or `false`.
pub(super) fn flag(ast: &Ast, findings: &mut Findings<'_>) -> Option<bool> {
    if let Node::Flag(flag) = ast.node {
        return Some(flag);
    }
    findings.error(ast.span, format!("expected true or false, found {}", ast.node.describe()), None);
    None
}

/// Decodes one of the given names.
pub(super) fn choice<T: Copy>(ast: &Ast, choices: &[(&str, T)], findings: &mut Findings<'_>) -> Option<T> {
    let names: Vec<&str> = choices.iter().map(|(name, _)| *name).collect();
    if let Node::Name(name) = &ast.node {
        if let Some((_, value)) = choices.iter().find(|(known, _)| known == name) {
            return Some(*value);
        }
        findings.error(ast.span, format!("unknown value '{}'", shortened(name)), unknown_hint(name, &names));
    } else {
        let hint = format!("allowed: {}", names.join(", "));
        findings.error(ast.span, format!("expected a name without quotes, found {}", ast.node.describe()), hint);
    }
    None
}

/// Decodes a tuple of `N` numbers; all invalid ones are reported.
pub(super) fn numbers<const N: usize>(ast: &Ast, findings: &mut Findings<'_>) -> Option<[f64; N]> {
    let items = match &ast.node {
        Node::Tuple(items) | Node::List(items) if items.len() == N => items,
        other => {
            let hint = format!("write {N} numbers in round brackets: ({})", ["0.0"; N].join(", "));
            findings.error(ast.span, format!("expected {N} numbers, found {}", other.describe()), hint);
            return None;
        }
    };
    let mut values = [0.0; N];
    let mut is_valid = true;
    for (value, item) in values.iter_mut().zip(items) {
        match number(item, findings) {
            Some(number) => *value = number,
            None => is_valid = false,
        }
    }
    is_valid.then_some(values)
}

/// Decodes a point from millimetres to metres.
pub(super) fn point(ast: &Ast, findings: &mut Findings<'_>) -> Option<Point3<f64>> {
    let coordinates: [f64; 3] = numbers(ast, findings)?;
    Some(Point3::from(coordinates.map(|coordinate| Quantity::Length.from_edge(coordinate))))
}

/// Decodes a direction of any nonzero length into a unit vector.
pub(super) fn direction(ast: &Ast, findings: &mut Findings<'_>) -> Option<Unit<Vector3<f64>>> {
    let coordinates: [f64; 3] = numbers(ast, findings)?;
    let direction = Unit::try_new(Vector3::from(coordinates), 1e-9);
    if direction.is_none() {
        findings.error(ast.span, "a direction must not be zero", "for example (0.0, 0.0, 1.0)".to_owned());
    }
    direction
}

/// Decodes a range `(low, high)` from mm or degrees to SI units; reversed or empty ranges are errors.
pub(super) fn range(ast: &Ast, quantity: Quantity, findings: &mut Findings<'_>) -> Option<(f64, f64)> {
    let [low, high] = numbers(ast, findings)?;
    if low < high {
        return Some((quantity.from_edge(low), quantity.from_edge(high)));
    }
    let unit = quantity.unit();
    findings.error(
        ast.span,
        format!("the lower limit {low} {unit} is not below the upper limit {high} {unit}"),
        "write (lower, upper)".to_owned(),
    );
    None
}

/// Decodes a list into its entries.
pub(super) fn list<'t>(ast: &'t Ast, what: &str, findings: &mut Findings<'_>) -> Option<&'t [Ast]> {
    if let Node::List(items) = &ast.node {
        return Some(items);
    }
    findings.error(ast.span, format!("expected a list of {what} '[...]', found {}", ast.node.describe()), None);
    None
}

/// Decodes a map from names into its entries; repeated names are errors. The span is that of the name.
pub(super) fn number_map<'t>(ast: &'t Ast, findings: &mut Findings<'_>) -> Option<Vec<(&'t str, Span, &'t Ast)>> {
    let Node::Map(entries) = &ast.node else {
        let hint = "write {\"name\": 1.0, ...}".to_owned();
        findings.error(ast.span, format!("expected a map '{{...}}', found {}", ast.node.describe()), hint);
        return None;
    };
    let mut decoded: Vec<(&str, Span, &Ast)> = Vec::new();
    for (key, value) in entries {
        let Node::Text(name) = &key.node else {
            findings.error(key.span, format!("expected a name in \"quotes\", found {}", key.node.describe()), None);
            continue;
        };
        if decoded.iter().any(|(earlier, _, _)| earlier == name) {
            findings.error(key.span, format!("'{}' is given twice", shortened(name)), "keep one of them".to_owned());
        } else {
            decoded.push((name, key.span, value));
        }
    }
    Some(decoded)
}
