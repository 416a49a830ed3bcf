//! The text of a profile with other targets.

use super::Target;
use super::diagnostic::Findings;
use super::syntax::{self, Node};
use crate::checksum::{self, Finding, Syntax};
use crate::units::to_mm;

/// Decimals of a length in millimetres: 1 nm.
const DECIMALS: usize = 6;

/// The text of a profile with these targets instead of its own; everything else, comments included, stays as it is. None if it is no
/// profile.
pub fn with_targets(text: &str, targets: &[Target]) -> Option<String> {
    let mut findings = Findings::new(text, "");
    let tree = syntax::parse(text, &mut findings)?;
    let Node::Struct(fields) = &tree.node else { return None };
    let list = listed(targets);
    let changed = if let Some(field) = fields.iter().find(|field| field.name == "targets") {
        let (before, after) = (text.get(..field.value.span.start)?, text.get(field.value.span.end..)?);
        [before, &list, after].concat()
    } else {
        let first = fields.first()?.name_span.start;
        let (before, after) = (text.get(..first)?, text.get(first..)?);
        [before, "targets: ", &list, ",\n    ", after].concat()
    };
    // The sum was that of the text before the change, which is no change by accident.
    match (checksum::check(text), checksum::place(&changed)) {
        (Finding::Intact, Some(place)) => {
            let rest = changed.get(place.end..)?;
            let bare = [changed.get(..place.start)?, rest.strip_prefix('\n').unwrap_or(rest)].concat();
            Some(checksum::with_sum(&bare, Syntax::Ron))
        }
        _ => Some(changed),
    }
}

fn listed(targets: &[Target]) -> String {
    let coordinates = |values: [f64; 3]| values.map(|value| format!("{value:.DECIMALS$}")).join(", ");
    let line = |target: &Target| {
        let axis = target.axis_in_flange.into_inner();
        format!(
            "        (name: {:?}, position_mm: ({}), uncertainty_mm: {:.DECIMALS$}, axis_in_flange: ({})),\n",
            target.name,
            coordinates(std::array::from_fn(|axis| to_mm(target.position_in_flange[axis]))),
            to_mm(target.uncertainty),
            coordinates([axis.x, axis.y, axis.z]),
        )
    };
    let lines: String = targets.iter().map(line).collect();
    format!("[\n{lines}    ]")
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::profile::{Profile, builtin, builtin_names};

    #[test]
    fn every_shipped_profile_takes_other_targets_and_nothing_else_changes() {
        let target = |name: &str, x: f64| Target {
            position_in_flange: Point3::new(x, -0.1, 0.123_456_789),
            ..Target::beside_the_flange(name)
        };
        let targets = [target("probe.a", 0.1), target("say \"b\"", -0.2)];
        for name in builtin_names() {
            let text = builtin(name).unwrap();
            let (before, _) = Profile::parse(text, name).unwrap();
            for text in [text.to_owned(), checksum::with_sum(text, Syntax::Ron)] {
                let changed = with_targets(&text, &targets).unwrap();
                assert_ne!(checksum::check(&changed), Finding::Changed, "{name}");
                let (after, _) = Profile::parse(&changed, name).unwrap_or_else(|errors| panic!("{errors}\n{changed}"));
                let found: Vec<&str> = after.targets().iter().map(|target| target.name.as_str()).collect();
                assert_eq!(found, ["probe.a", "say \"b\""], "{name}");
                assert!((after.targets()[0].position_in_flange.z - 0.123_456_789).abs() < 1e-9);
                assert_eq!(after.chain(), before.chain(), "{name}");
                assert_eq!(after.acceptance(), before.acceptance(), "{name}");
            }
        }
        assert_eq!(with_targets("[1, 2", &targets), None);
        let without = "// mine\n(schema: 1, name: \"x\")";
        assert!(with_targets(without, &targets).unwrap().starts_with("// mine\n(targets: ["));
    }
}
