//! Names and comments that controllers accept.

/// Longest name if the controller has no shorter limit (characters).
pub const MAX_NAME: usize = 24;

/// Names that are not allowed for programs: keywords and existing routines of any dialect.
const RESERVED: &[&str] = &[
    "begin", "break", "call", "case", "const", "data", "def", "else", "end", "endif", "exit", "false", "for", "global",
    "goto", "home", "if", "int", "main", "module", "nop", "not", "or", "pose", "proc", "real", "return", "robot",
    "start", "stop", "string", "sys", "system", "task", "thread", "true", "var", "wait", "while",
];

/// Name of a program whose own name has no allowed characters.
const FALLBACK: &str = "trupose";

/// A name as an identifier: ASCII letters, digits and `_`, starting with a letter, at most `longest` characters. Other characters
/// become `_`.
pub(super) fn identifier(name: &str, longest: usize) -> String {
    let mut cleaned = String::new();
    for c in name.chars() {
        let c = if c.is_ascii_alphanumeric() { c } else { '_' };
        let is_doubled = c == '_' && (cleaned.is_empty() || cleaned.ends_with('_'));
        if !is_doubled {
            cleaned.push(c);
        }
    }
    if cleaned.starts_with(|c: char| !c.is_ascii_alphabetic()) {
        cleaned.insert(0, 'p');
    }
    let is_reserved = |name: &str| RESERVED.iter().any(|word| name.eq_ignore_ascii_case(word));
    let mut short: String = cleaned.chars().take(longest).collect();
    short.truncate(short.trim_end_matches('_').len());
    if short.is_empty() {
        short = FALLBACK.chars().take(longest).collect();
    }
    if is_reserved(&short) {
        short = short.chars().take(longest.saturating_sub(1)).chain(['1']).collect();
    }
    short
}

/// Text for comments and messages: printable ASCII without quotation marks and characters that could end a comment.
pub(super) fn ascii(text: &str) -> String {
    let is_harmless =
        |c: char| (c == ' ' || c.is_ascii_graphic()) && !matches!(c, '"' | '\\' | '\'' | '<' | '>' | '&' | ';');
    text.chars().take(60).map(|c| if is_harmless(c) { c } else { '_' }).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn names_fit_the_controller() {
        for (name, longest, expected) in [
            ("cal poses", 8, "cal_pose"),
            ("CalPoses", 24, "CalPoses"),
            ("2nd try", 24, "p2nd_try"),
            ("Pr\u{fc}fung / A", 24, "Pr_fung_A"),
            ("\u{4f60}\u{597d}", 8, "trupose"),
            ("", 8, "trupose"),
            ("MAIN", 24, "MAIN1"),
            ("home", 4, "hom1"),
            ("program_", 8, "program"),
        ] {
            assert_eq!(identifier(name, longest), expected);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn any_name_becomes_an_identifier(name in ".{0,40}", longest in 4..30_usize) {
            let short = identifier(&name, longest);
            prop_assert!(!short.is_empty() && short.len() <= longest);
            prop_assert!(short.starts_with(|c: char| c.is_ascii_alphabetic()));
            prop_assert!(short.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_'));
        }

        #[test]
        fn any_text_becomes_harmless(text in ".{0,90}") {
            prop_assert!(ascii(&text).bytes().all(|byte| byte == b' ' || byte.is_ascii_graphic()));
        }
    }
}
