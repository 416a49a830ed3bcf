//! Completions and manual pages: made from the command line itself, for every command.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::support::{command, root, skip, text, trupose};
use clap::CommandFactory as _;
use trupose::cli::Cli;

/// Names of all pages that there should be.
fn pages(command: &clap::Command, before: &str, found: &mut Vec<String>) {
    let name = format!("{before}{}", command.get_name());
    for inside in command.get_subcommands().filter(|inside| inside.get_name() != "help") {
        pages(inside, &format!("{name}-"), found);
    }
    found.push(format!("{name}.1"));
}

#[test]
fn every_command_has_a_manual_page() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().join("man1");
    let output = trupose(&["man", "--out", place.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let mut written: Vec<String> =
        fs::read_dir(&place).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    let mut expected = Vec::new();
    pages(&Cli::command(), "", &mut expected);
    written.sort();
    expected.sort();
    assert_eq!(written, expected);
    assert!(written.len() > 20 && written.iter().any(|name| name == "trupose-session-export.1"), "{written:?}");
    for name in &written {
        let page = fs::read_to_string(place.join(name)).unwrap();
        let title = name.strip_suffix(".1").unwrap();
        assert!(page.contains(&format!(".TH {title} 1")), "{name}: {page}");
        assert!(page.contains(".SH NAME") && page.contains(".SH SYNOPSIS"), "{name}");
    }
    let identify = fs::read_to_string(place.join("trupose-identify.1")).unwrap();
    assert!(identify.contains("measurements") && identify.contains("Measured points"), "{identify}");
    // The same page as the one that is printed.
    let printed = trupose(&["man"]);
    assert_eq!(text(&printed.stdout), fs::read_to_string(place.join("trupose.1")).unwrap());
    // A folder that cannot be made.
    let file = folder.path().join("man1").join("trupose.1");
    assert_eq!(trupose(&["man", "--out", file.to_str().unwrap()]).status.code(), Some(5));
}

#[test]
fn every_shell_completes_every_command() {
    for (shell, mark) in [
        ("bash", "complete -F"),
        ("zsh", "#compdef trupose"),
        ("fish", "complete -c trupose"),
        ("elvish", "edit:completion"),
        ("powershell", "Register-ArgumentCompleter"),
    ] {
        let output = trupose(&["completions", shell]);
        assert_eq!(output.status.code(), Some(0), "{shell}");
        let script = text(&output.stdout);
        assert!(script.contains(mark), "{shell}");
        for command in Cli::command().get_subcommands() {
            assert!(script.contains(command.get_name()), "{shell}: {}", command.get_name());
        }
        for option in ["verify-rest", "dialect", "with-tool-offset"] {
            assert!(script.contains(option), "{shell}: {option}");
        }
    }
    assert_eq!(trupose(&["completions", "tcsh"]).status.code(), Some(2));
}

#[test]
fn the_completions_of_bash_are_a_script() {
    if !Path::new("/bin/bash").exists() {
        skip("there is no bash");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("trupose.bash");
    let out = fs::File::create(&file).unwrap();
    let status = command(root(), &["completions", "bash"]).stdout(out).status().unwrap();
    assert!(status.success());
    let ask = format!(
        ". {}; COMP_WORDS=(trupose comp); COMP_CWORD=1; _trupose trupose comp trupose; echo \"${{COMPREPLY[@]}}\"",
        file.display()
    );
    let output = Command::new("/bin/bash").args(["--norc", "-c", &ask]).output().unwrap();
    assert_eq!(text(&output.stdout).trim(), "compare compensate completions", "{}", text(&output.stderr));
}
