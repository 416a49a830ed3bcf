//! All integration tests, in one program: it is linked once. A file of tests is a module here.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    clippy::disallowed_methods,
    clippy::string_slice,
    reason = "a failure of a test is a panic; tests have clocks, and their files need no atomic writes"
)]

mod support;
mod table_import;

mod architecture;
#[cfg(target_os = "linux")]
mod by_keys;
mod cartesian;
mod cartesian_programs;
mod cli;
mod compensate;
mod contacts;
mod descriptions;
mod docs;
mod example;
#[cfg(unix)]
mod faults;
mod gravity;
mod health;
mod health_cli;
mod inverse;
mod iso9283;
mod joint_check;
mod joint_errors;
mod kinematics;
mod lines;
#[cfg(target_os = "linux")]
mod links;
mod manual;
mod measured_data;
mod measurement_messages;
mod measurement_tables;
mod models;
mod numbers;
mod paper;
#[cfg(target_os = "linux")]
mod pictures;
mod plan_cli;
mod planning_reference;
mod plans;
mod poses;
mod procedure;
mod profile_messages;
mod program_files;
mod program_rewrite;
mod programs;
#[cfg(unix)]
mod recording;
mod report;
mod scripts;
#[cfg(unix)]
mod sessions;
#[cfg(target_os = "linux")]
mod terminal;
mod tested;
mod triage;
mod whole_arm;
mod wizard_random;
mod worked_example;

/// A file beside this one that is no module here would not even be compiled.
#[test]
fn no_test_file_is_forgotten() {
    let text = include_str!("main.rs");
    for entry in std::fs::read_dir(support::root().join("tests")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_str().unwrap();
        if path.extension().is_some_and(|extension| extension == "rs") && name != "main" {
            assert!(text.contains(&format!("\nmod {name};\n")), "tests/{name}.rs is no module of tests/main.rs");
        }
    }
}
