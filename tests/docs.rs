//! Every command that README.md and docs/*.md show is run, in a folder that has what a reader would have: the profiles, the sessions
//! of the repository, a robot, a table of points, a program.
//!
//! In blocks ```` ```sh ```` every line that begins with `trupose` is a command; `\` at its end joins lines. It must end with exit code 0, or with
//! that of a remark `# exit code N` behind it. `# not run: REASON` behind it, or on the line before, leaves it out; so does a command that needs a
//! terminal, an instrument, or somebody who ends it. What is not run must at least be a command line that the program understands. Other programs
//! that may be shown are in [`OTHERS`]. Each document has a folder of its own, its commands run in order.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::thread;

use crate::support::{command, root};
use clap::Parser as _;
use trupose::cli::{Cli, Command as Told};

/// Other programs that the documents show; none of them is run.
const OTHERS: [&str; 9] =
    ["cargo", "git", "pip", "rerun", "ssh", "apt-get", "mkdir", "INSTA_UPDATE=always", "XDG_RUNTIME_DIR=$(mktemp"];

/// Languages of blocks.
const LANGUAGES: [&str; 12] =
    ["sh", "text", "ron", "", "python", "rapid", "krl", "fanuc", "urscript", "val3", "inform", "ros"];

/// A command of a document.
#[derive(Debug, PartialEq)]
struct Shown {
    line: usize,
    words: Vec<String>,
    exit_code: i32,
    is_run: bool,
}

/// Words of a line as a shell splits it, and the remark behind it. Nothing else of a shell is understood.
fn split(line: &str) -> (Vec<String>, &str) {
    let (mut words, mut word, mut quote) = (Vec::new(), None::<String>, None);
    for (at, c) in line.char_indices() {
        match (quote, c) {
            (Some(open), _) if c == open => quote = None,
            (None, '\'' | '"') => {
                quote = Some(c);
                word.get_or_insert_default();
            }
            (None, ' ') => words.extend(word.take()),
            (None, '#') if word.is_none() => return (words, &line[at..]),
            (None, '|' | '>' | '<' | '&' | ';' | '$' | '`') => panic!("no simple command: {line}"),
            _ => word.get_or_insert_default().push(c),
        }
    }
    assert!(quote.is_none(), "open quote: {line}");
    words.extend(word);
    (words, "")
}

/// The commands of a document.
fn commands(text: &str) -> Vec<Shown> {
    let mut shown = Vec::new();
    let (mut is_inside, mut before, mut joined) = (false, String::new(), String::new());
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        if let Some(language) = line.strip_prefix("```") {
            assert!(LANGUAGES.contains(&language), "line {}: {line}", index + 1);
            is_inside = !is_inside && line == "```sh";
            before.clear();
            continue;
        }
        if !is_inside {
            continue;
        }
        joined.push_str(line);
        if joined.ends_with('\\') {
            joined.pop();
            continue;
        }
        let whole = std::mem::take(&mut joined);
        if whole.starts_with("trupose ") || whole == "trupose" {
            let (words, remark) = split(&whole);
            let exit_code = remark.split_once("exit code ").map_or(0, |(_, code)| {
                code.chars().take_while(char::is_ascii_digit).collect::<String>().parse().unwrap()
            });
            let is_run = ![remark, &before].iter().any(|remark| remark.contains("# not run:"));
            shown.push(Shown { line: index + 1, words, exit_code, is_run });
        } else if let Some(program) = whole.split_whitespace().next().filter(|word| !word.starts_with('#')) {
            assert!(OTHERS.contains(&program), "line {}: what is '{program}'?", index + 1);
        }
        before = whole;
    }
    shown
}

/// Whether a command needs a terminal, another program or hardware; or runs a script of the repository, as `tests/scripts.rs` does.
fn needs_somebody(cli: &Cli) -> bool {
    match &cli.command {
        None => cli.script.as_ref().is_none_or(|script| root().join(script).exists()),
        Some(Told::Wizard(_) | Told::Link(_) | Told::Simulate(_)) => true,
        Some(Told::Resume(args)) => args.script.is_none(),
        Some(Told::Replay(args)) => !args.print && !args.csv,
        Some(_) => false,
    }
}

fn copy(from: &Path, to: &Path) {
    if from.is_dir() {
        fs::create_dir_all(to).unwrap();
        for entry in fs::read_dir(from).unwrap() {
            let entry = entry.unwrap();
            copy(&entry.path(), &to.join(entry.file_name()));
        }
    } else {
        fs::copy(from, to).unwrap();
    }
}

/// What a reader has at hand.
fn furnish(folder: &Path) {
    let put = |from: &str, to: &str| copy(&root().join(from), &folder.join(to));
    put("profiles", "profiles");
    fs::create_dir(folder.join("sessions")).unwrap();
    for entry in fs::read_dir(root().join("sessions")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        // Not what else a user may have there.
        if name.ends_with(".script.ron") || ["example", "soochow-example"].contains(&name.as_str()) {
            put(&format!("sessions/{name}"), &format!("sessions/{name}"));
        }
    }
    put("profiles/soochow.ron", "my-robot.ron");
    put("sessions/example/measurements.csv", "points.csv");
    put("sessions/example/calibration.ron", "calibration.ron");
    put("sessions/soochow-example/verification.csv", "later.csv");
    put("tests/urdf/ur5.urdf", "arm.urdf");
    put_foreign_tables(folder);
    // A session as it was earlier.
    let journal = fs::read_to_string(root().join("sessions/example/journal.ron")).unwrap();
    fs::create_dir(folder.join("then")).unwrap();
    fs::write(folder.join("then/journal.ron"), journal.split_inclusive('\n').take(40).collect::<String>()).unwrap();
    let targets = "pose,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\npick,10,20,-30,40,50,60\nplace,-40,10,5,30,-60,0\n";
    fs::write(folder.join("targets.csv"), targets).unwrap();
    let program =
        "DEF part()\nPTP {A1 10,A2 20,A3 -30,A4 40,A5 50,A6 60}\nPTP {A1 -40,A2 10,A3 5,A4 30,A5 -60,A6 0}\nEND\n";
    fs::write(folder.join("part.src"), program).unwrap();
}

/// The measurements as other programs would write them, and the factory calibration of an arm.
fn put_foreign_tables(folder: &Path) {
    let text = fs::read_to_string(root().join("sessions/example/measurements.csv")).unwrap();
    let rows: Vec<Vec<&str>> =
        text.lines().filter(|line| !line.starts_with(['#', 'p'])).map(|line| line.split(',').collect()).collect();
    let columns =
        |from: usize, to: usize| -> String { rows.iter().map(|row| row[from..to].join("  ") + "\n").collect() };
    let put = |name: &str, text: &str| fs::write(folder.join(name), text).unwrap();
    put("points.txt", &format!("q1_deg q2_deg q3_deg q4_deg q5_deg q6_deg X [mm] Y [mm] Z [mm]\n{}", columns(1, 10)));
    put("kuka.txt", &format!("A1 A2 A3 A4 A5 A6 X Y Z\n{}", columns(1, 10)));
    put("headless.txt", &columns(1, 10));
    put("joints.txt", &columns(1, 7));
    put("smr.txt", &columns(7, 10));
    let zero = "[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]";
    put(
        "calibration.conf",
        &format!(
            "[mounting]\ndelta_theta = [1e-4, 2e-4, -1e-4, 0.0, 1e-4, 0.0]\ndelta_a = {zero}\ndelta_d = {zero}\ndelta_alpha = {zero}\ncalibration_status = 2 # linearised\n"
        ),
    );
}

/// Runs the commands of a document; gives back what went wrong and how many ran.
fn run(document: &Path) -> (Vec<String>, usize) {
    let folder = tempfile::tempdir().unwrap();
    furnish(folder.path());
    let (mut wrong, mut ran, mut done) = (Vec::new(), 0, BTreeSet::new());
    for shown in commands(&fs::read_to_string(document).unwrap()) {
        let place = format!("{}:{}: {}", document.display(), shown.line, shown.words.join(" "));
        let cli = match Cli::try_parse_from(&shown.words) {
            Ok(cli) => cli,
            // '--help' and '--version' are no mistakes.
            Err(error) if error.exit_code() == 0 => continue,
            Err(error) => {
                wrong.push(format!("{place}\n{error}"));
                continue;
            }
        };
        if !shown.is_run || needs_somebody(&cli) || !done.insert(shown.words.clone()) {
            continue;
        }
        let mut arguments = shown.words[1..].to_vec();
        // The same command in less time.
        let quicker = match &cli.command {
            Some(Told::Plan(_)) => &["--candidates", "200", "--time-limit", "5"][..],
            Some(Told::Demo(_)) => &["--set", "candidates=200", "--set", "poses=20", "--set", "verification=10"],
            _ => &[],
        };
        if !arguments.iter().any(|word| word.contains("candidates")) {
            arguments.extend(quicker.iter().map(|word| (*word).to_owned()));
        }
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let output = command(folder.path(), &arguments).stdin(Stdio::null()).env_remove("TERM").output().unwrap();
        ran += 1;
        if output.status.code() != Some(shown.exit_code) {
            let error = String::from_utf8_lossy(&output.stderr);
            wrong.push(format!(
                "{place}\nends with {:?} instead of {}\n{error}",
                output.status.code(),
                shown.exit_code
            ));
        }
    }
    (wrong, ran)
}

fn documents() -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> =
        fs::read_dir(root().join("docs")).unwrap().map(|entry| entry.unwrap().path()).collect();
    found.retain(|path| path.extension().is_some_and(|extension| extension == "md"));
    found.push(root().join("README.md"));
    found.sort();
    found
}

#[test]
fn every_command_shown_does_what_is_said() {
    let threads: Vec<_> = documents().into_iter().map(|path| thread::spawn(move || run(&path))).collect();
    let (wrong, ran): (Vec<_>, Vec<_>) = threads.into_iter().map(|thread| thread.join().unwrap()).unzip();
    let wrong = wrong.concat();
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
    let ran: usize = ran.iter().sum();
    assert!(ran >= 20, "only {ran} commands were found");
}

/// The recipe for Python reads the result files of a session as they are.
#[test]
fn the_recipe_for_python_runs() {
    let text = fs::read_to_string(root().join("docs/integrator.md")).unwrap();
    let recipe = text.split("```python\n").skip(1).find(|block| block.contains("report.json")).unwrap();
    let recipe = recipe.split("```").next().unwrap();
    let ran = std::process::Command::new("python3")
        .args(["-c", recipe])
        .current_dir(root().join("sessions/example"))
        .output();
    let Ok(output) = ran else {
        println!("skipped: there is no python3");
        return;
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8_lossy(&output.stdout);
    let report = fs::read_to_string(root().join("sessions/example/report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    let mean = report["verification"]["identified"]["position_mm"]["mean"].as_f64().unwrap();
    let (status, rest) = said.split_once(' ').unwrap();
    let (printed, parameters) = rest.split_once('\n').unwrap();
    assert_eq!(status, "accepted");
    assert!((printed.parse::<f64>().unwrap() - mean).abs() < 1e-12, "{printed} instead of {mean}");
    assert!(parameters.starts_with("alpha1 "), "{said}");
    assert!(said.ends_with("30 44.786000000 1141.302414\n"), "{said}");
}

#[test]
fn every_link_between_the_documents_leads_somewhere() {
    let mut wrong = Vec::new();
    for document in documents() {
        let text = fs::read_to_string(&document).unwrap();
        for (at, _) in text.match_indices("](") {
            let target = text[at + 2..].split([')', '#']).next().unwrap();
            let path = document.parent().unwrap().join(target);
            let is_file = !target.is_empty() && !target.contains("://") && !text[at + 2..].starts_with('#');
            if is_file && !path.exists() {
                wrong.push(format!("{}: {target}", document.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// Text of all sources, with string literals that go on over several lines joined.
fn sources(folder: &Path, text: &mut String) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, text);
        } else {
            let mut lines = fs::read_to_string(&path).unwrap();
            while let Some(at) = lines.find("\\\n") {
                let end = at + 2 + lines[at + 2..].find(|c: char| !c.is_whitespace()).unwrap();
                lines.replace_range(at..end, "");
            }
            text.push_str(&lines);
        }
    }
}

#[test]
fn the_messages_of_the_technician_are_those_of_the_program() {
    let mut source = String::new();
    sources(&root().join("src"), &mut source);
    let document = fs::read_to_string(root().join("docs/technician.md")).unwrap();
    let (_, table) = document.split_once("| message |").unwrap();
    let messages: Vec<&str> =
        table.lines().skip(2).map_while(|line| line.strip_prefix("| ")?.split(" | ").next()).collect();
    assert!(messages.len() > 20, "{messages:?}");
    for message in messages {
        let parts = message.split('…').map(|part| part.trim_matches([' ', '(', ')', ':', ',']));
        let unknown: Vec<&str> = parts.filter(|part| !source.contains(part)).collect();
        assert!(unknown.is_empty(), "'{message}': the program never says {unknown:?}");
    }
}

#[test]
fn commands_are_found_as_they_are_written() {
    let text = "```sh\n# first\ntrupose identify --use \"kind == 'x'\" \\\n    --json   # exit code 2: why\ncargo test\n\
                # not run: needs a viewer\ntrupose demo\ntrupose demo --seed 2\n```\ntrupose no\n```text\ntrupose no\n```\n";
    let found = commands(text);
    let of = |line, words: &[&str], exit_code, is_run| Shown {
        line,
        words: words.iter().map(|word| (*word).to_owned()).collect(),
        exit_code,
        is_run,
    };
    let expected = [
        of(4, &["trupose", "identify", "--use", "kind == 'x'", "--json"], 2, true),
        of(7, &["trupose", "demo"], 0, false),
        of(8, &["trupose", "demo", "--seed", "2"], 0, true),
    ];
    assert_eq!(found, expected);
}
