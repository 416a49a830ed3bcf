//! The command line and the environment.

use clap::CommandFactory as _;

use super::*;

#[test]
fn the_command_line_is_consistent() {
    Cli::command().debug_assert();
}

#[test]
fn the_environment_decides_about_colour_and_characters() {
    let with = |variables: &'static [(&str, &str)]| {
        TerminalEnvironment::from_variables(|name| {
            variables.iter().find(|(set, _)| *set == name).map(|(_, value)| (*value).to_owned())
        })
    };
    assert!(with(&[("LANG", "de_DE.UTF-8")]).is_utf8 && with(&[("LC_CTYPE", "C.utf8")]).is_utf8);
    assert!(!with(&[("LANG", "de_DE.UTF-8"), ("LC_ALL", "C")]).is_utf8 && !with(&[]).is_utf8);
    assert!(with(&[("NO_COLOR", "1")]).no_color && !with(&[("NO_COLOR", "")]).no_color);
}

#[test]
fn limits_and_boxes_are_ranges() {
    let limit: JointLimit = "j2=-30..60".parse().unwrap();
    assert_eq!(limit, JointLimit { joint: "j2".to_owned(), low: -30.0, high: 60.0 });
    let space: BoxMm = "500..1500,-800..800,200..1600".parse().unwrap();
    assert_eq!(space.ranges, [(500.0, 1500.0), (-800.0, 800.0), (200.0, 1600.0)]);
    for wrong in ["j2", "j2=1", "j2=60..-30", "=1..2", "j2=nan..3"] {
        assert!(wrong.parse::<JointLimit>().is_err(), "{wrong}");
    }
    for wrong in ["1..2,3..4", "1..2,3..4,6..5", "a..b,1..2,3..4"] {
        assert!(wrong.parse::<BoxMm>().is_err(), "{wrong}");
    }
}

/// The overview is written by hand, because clap does not group commands.
#[test]
fn the_overview_has_every_command_once() {
    let command = Cli::command();
    let mut listed: Vec<&str> =
        HELP.lines().filter_map(|line| line.strip_prefix("  ")?.split_once("  ").map(|(name, _)| name)).collect();
    listed.retain(|name| !name.contains(' ') && *name != "help" && *name != "trupose");
    let mut commands: Vec<&str> = command.get_subcommands().map(clap::Command::get_name).collect();
    listed.sort_unstable();
    commands.sort_unstable();
    assert_eq!(listed, commands);
    assert!(HELP.lines().all(|line| line.chars().count() <= 80));
}

#[test]
fn options_are_in_the_order_of_use() {
    let first = |name: &str, count: usize| {
        let mut command = Cli::command();
        command.build();
        let help = command.find_subcommand_mut(name).unwrap().render_long_help().to_string();
        let options = help.lines().filter_map(|line| line.trim_start().strip_prefix("--"));
        let names = options.filter_map(|line| line.split_whitespace().next()).map(str::to_owned);
        names.take(count).collect::<Vec<_>>()
    };
    assert_eq!(first("plan", 4), ["profile", "poses", "verification", "out"]);
    assert_eq!(first("identify", 2), ["measurements", "profile"]);
    assert_eq!(first("constraints", 2), ["measurements", "profile"]);
}

#[test]
fn every_command_has_examples_that_are_understood() {
    for command in Cli::command().get_subcommands() {
        let name = command.get_name();
        // Those of 'profile new' and the like are with the command below.
        let examples = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        let lines: Vec<&str> = examples
            .lines()
            .map(str::trim)
            .filter(|line| line.starts_with("trupose ") && !line.contains('\''))
            .collect();
        assert!(!lines.is_empty(), "{name}");
        for line in lines {
            assert!(line.starts_with(&format!("trupose {name}")), "{name}: {line}");
            let understood = Cli::try_parse_from(line.split_whitespace());
            assert!(understood.is_ok(), "{line}: {}", understood.unwrap_err());
        }
    }
}

#[test]
fn options_in_front_of_a_command_count_for_it() {
    let ordered = |line: &str| -> Vec<String> {
        let words = line.split(' ').map(std::ffi::OsString::from);
        Cli::in_order(words).into_iter().map(|word| word.into_string().unwrap()).collect()
    };
    for (line, expected) in [
        ("trupose --sessions DIR resume NAME", "trupose resume --sessions DIR NAME"),
        ("trupose --sessions=DIR --json resume NAME", "trupose resume --sessions=DIR --json NAME"),
        // The value of an option is no command, even with the name of one.
        ("trupose --sessions demo", "trupose --sessions demo"),
        ("trupose --sessions demo resume", "trupose resume --sessions demo"),
        ("trupose resume NAME --sessions DIR", "trupose resume NAME --sessions DIR"),
        ("trupose --help", "trupose --help"),
        ("trupose -- resume", "trupose -- resume"),
        ("trupose --sessions", "trupose --sessions"),
    ] {
        assert_eq!(ordered(line).join(" "), expected);
    }
    let Some(Command::Resume(args)) = Cli::parse_from(Cli::in_order(
        ["trupose", "--sessions", "DIR", "resume", "NAME"].map(std::ffi::OsString::from),
    ))
    .command
    else {
        panic!("not the command")
    };
    assert_eq!(args.script_args.sessions, PathBuf::from("DIR"));
}
