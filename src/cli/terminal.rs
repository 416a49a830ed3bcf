//! Options for the terminal, and the environment variables that concern it.

use clap::{Args, ValueEnum};

/// Options for the terminal.
#[derive(Args, Clone, Copy, Debug, Default)]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of the command line")]
pub struct TerminalArgs {
    /// Colours: when the terminal has them and NO_COLOR is not set, always, or never
    #[arg(long, value_enum, default_value_t, value_name = "WHEN")]
    pub color: ColorArg,
    /// Use ASCII characters only [default: only where the locale is not UTF-8]
    #[arg(long)]
    pub ascii: bool,
    /// Draw with blocks instead of braille, for fonts without it
    #[arg(long, conflicts_with = "ascii")]
    pub blocks: bool,
    /// Take the mouse wheel; the terminal's own selection then needs Shift
    #[arg(long)]
    pub mouse: bool,
    /// Ring the bell when a reading needs attention; Ctrl-B turns it on and off
    #[arg(long, conflicts_with = "plain")]
    pub bell: bool,
    /// Plain lines instead of a full screen [default: only where TERM is 'dumb']
    #[arg(long)]
    pub plain: bool,
}

/// `--color`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ColorArg {
    /// Unless NO_COLOR is set
    #[default]
    Auto,
    /// Even if NO_COLOR is set
    Always,
    /// Never
    Never,
}

/// Environment variables that concern the terminal.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TerminalEnvironment {
    /// `TERM`.
    pub term: Option<String>,
    /// `NO_COLOR` is set and not empty (no-color.org).
    pub no_color: bool,
    /// The locale's characters are UTF-8.
    pub is_utf8: bool,
}

impl TerminalEnvironment {
    /// Reads the environment of this process.
    pub fn read() -> Self {
        #[expect(clippy::disallowed_methods, reason = "the one place that reads the environment")]
        let read = |name: &str| std::env::var(name).ok();
        Self::from_variables(read)
    }

    pub(super) fn from_variables(read: impl Fn(&str) -> Option<String>) -> Self {
        let set = |name: &str| read(name).filter(|value| !value.is_empty());
        let locale = ["LC_ALL", "LC_CTYPE", "LANG"].into_iter().find_map(set).unwrap_or_default().to_ascii_lowercase();
        Self {
            term: set("TERM"),
            no_color: set("NO_COLOR").is_some(),
            is_utf8: locale.ends_with("utf-8") || locale.ends_with("utf8"),
        }
    }
}
