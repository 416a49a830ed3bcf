//! What a broken profile says: one file per defect in `tests/profiles/invalid`, the message beside it.
//!
//! Files whose name begins with `warning` can be used all the same.

use std::path::PathBuf;

use crate::support::root;
use proptest::prelude::*;
use trupose::profile::{Profile, Severity, builtin, check_text};

fn invalid_profiles() -> Vec<PathBuf> {
    let folder = root().join("tests/profiles/invalid");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "ron"))
        .collect();
    files.sort();
    files
}

#[test]
fn every_defect_has_its_message() {
    let files = invalid_profiles();
    assert!(files.len() >= 25);
    for path in files {
        let name = path.file_stem().unwrap().to_str().unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let file_name = format!("{name}.ron");
        let outcome = Profile::parse(&text, &file_name);
        assert_eq!(outcome.is_ok(), name.starts_with("warning"), "{name}");
        let diagnostics = match &outcome {
            Ok((_, warnings)) => warnings,
            Err(errors) => &errors.diagnostics,
        };
        assert!(!diagnostics.is_empty(), "{name}");
        let message = check_text(&file_name, &outcome);
        assert!(
            message.lines().filter(|line| line.starts_with(' ')).all(|line| line.chars().count() <= 80),
            "{message}"
        );
        assert_printable(&message);
        insta::with_settings!({snapshot_path => "profiles/invalid", prepend_module_to_snapshot => false, omit_expression => true}, {
            insta::assert_snapshot!(name, message);
        });
    }
}

#[test]
fn problems_come_in_the_order_of_the_file() {
    let text =
        std::fs::read_to_string(invalid_profiles().iter().find(|path| path.ends_with("many_at_once.ron")).unwrap());
    let errors = Profile::parse(&text.unwrap(), "many.ron").unwrap_err();
    let places: Vec<(usize, usize)> = errors.diagnostics.iter().map(|found| (found.line, found.column)).collect();
    assert!(places.is_sorted());
    assert!(errors.error_count() >= 9, "{errors}");
}

#[test]
fn some_and_extensions_change_nothing() {
    let plain = builtin("soochow").unwrap();
    let some = plain.replace("floor_mm: 0.0", "floor_mm: Some(0.0)").replace("name: \"smr\"", "name: Some(\"smr\")");
    let extended = format!("#![enable(implicit_some)]\n/* a /* nested */ comment */\n{some}");
    let parse = |text: &str| Profile::parse(text, "soochow.ron").unwrap().0;
    assert_eq!(parse(plain), parse(&extended));
    let named = plain.replacen("(\n    schema", "Profile(\n    schema", 1);
    assert_eq!(parse(plain), parse(&named));
}

#[test]
fn a_long_line_is_cut_around_the_place() {
    let text = format!("(schema: 1, /* {} */ nam: \"x\", /* {} */)", "a".repeat(300), "b".repeat(300));
    let errors = Profile::parse(&text, "long.ron").unwrap_err();
    let shown = errors.diagnostics.iter().find(|found| found.message.contains("'nam'")).unwrap().to_string();
    let lines: Vec<&str> = shown.lines().collect();
    let caret = lines[2].find('^').unwrap();
    assert_eq!(lines[1].get(caret..caret + 3), Some("nam"));
    assert!(lines[1].len() <= 80);
}

#[test]
fn a_file_that_is_no_profile_stays_short() {
    let noise = "\u{1b}[2J§".repeat(100_000);
    let errors = Profile::parse(&noise, "\u{1b}noise").unwrap_err();
    assert!(errors.diagnostics.len() <= 101);
    assert_printable(&errors.to_string());
    assert!(Profile::parse(&"(".repeat(100_000), "deep").is_err());
    assert!(Profile::parse(&"a(".repeat(100_000), "deep").is_err());
    assert!(Profile::parse(&"/*".repeat(100_000), "deep").is_err());
}

fn assert_printable(message: &str) {
    assert!(message.chars().all(|c| c == '\n' || !c.is_control()), "{message:?}");
}

fn assert_reads_calmly(text: &str) {
    if let Err(errors) = Profile::parse(text, "mangled.ron") {
        assert!(errors.diagnostics.iter().any(|found| found.severity == Severity::Error));
        assert_printable(&errors.to_string());
    }
}

#[test]
fn every_beginning_of_a_profile_is_read_without_panic() {
    let text = builtin("fanuc_lrmate200id").unwrap();
    for (end, _) in text.trim_end().char_indices().step_by(5) {
        let beginning = text.get(..end).unwrap();
        assert!(Profile::parse(beginning, "torn.ron").is_err(), "{end}");
        assert_reads_calmly(beginning);
    }
}

proptest! {
    #[test]
    fn mangled_profiles_are_read_without_panic(at in any::<prop::sample::Index>(), length in 0_usize..20, noise in "\\PC{0,6}|[(){}\\[\\]:,\"]{0,6}|[\u{0}-\u{ff}]{0,4}") {
        let characters: Vec<char> = builtin("soochow").unwrap().chars().collect();
        let start = at.index(characters.len());
        let mut mangled: String = characters[..start].iter().collect();
        mangled.push_str(&noise);
        mangled.extend(characters.iter().skip(start + length));
        assert_reads_calmly(&mangled);
    }

    #[test]
    fn any_text_is_read_without_panic(text in any::<String>()) {
        assert_reads_calmly(&text);
    }
}
