//! The set-up: from a new connection to tracking.

use std::time::Duration;

use super::super::Failure;
use super::super::Identity;
use super::super::excerpt::excerpt;
use super::options::NdiOptions;
use super::options::ReplyFormat;

/// Most rounds in which tools are looked for.
const MOST_ROUNDS: u32 = 4;

/// Steps of the set-up, in order.
#[derive(Clone, Debug)]
pub(super) enum SetUpStep {
    Initialise,
    Version,
    /// Lists the handles that other programs have left.
    FindStale,
    FreeHandle(u8, Vec<u8>),
    FindTools {
        /// Number of earlier rounds: a tool with two faces shows its second only after the first was initialised.
        round: u32,
    },
    InitialiseTool {
        handle: u8,
        left: Vec<u8>,
        round: u32,
    },
    FindInitialised,
    EnableTool(u8, Vec<u8>),
    StartTracking,
}

/// What follows after a step.
#[derive(Debug)]
pub(super) enum NextStep {
    Step(SetUpStep),
    Ready(u8),
}

/// Results of the set-up so far.
#[derive(Debug, Default)]
pub(super) struct SetUp {
    version: Option<String>,
    enabled: Vec<u8>,
}

impl SetUpStep {
    pub(super) fn command(&self) -> String {
        match self {
            Self::Initialise => "INIT:".to_owned(),
            Self::Version => "APIREV:".to_owned(),
            Self::FindStale => "PHSR:01".to_owned(),
            Self::FreeHandle(handle, _) => format!("PHF:{handle:02X}"),
            Self::FindTools { .. } => "PHSR:02".to_owned(),
            Self::InitialiseTool { handle, .. } => format!("PINIT:{handle:02X}"),
            Self::FindInitialised => "PHSR:03".to_owned(),
            Self::EnableTool(handle, _) => format!("PENA:{handle:02X}D"),
            Self::StartTracking => "TSTART:".to_owned(),
        }
    }

    /// Whether an error at this step can be ignored.
    pub(super) const fn is_optional(&self) -> bool {
        matches!(self, Self::Version | Self::FindStale | Self::FreeHandle(..))
    }

    /// Longest usual duration of the step. The clients of others allow 5 to 7 s for what starts hardware.
    pub(super) const fn slowest(&self) -> Duration {
        match self {
            Self::Initialise | Self::InitialiseTool { .. } | Self::StartTracking => Duration::from_secs(10),
            Self::Version
            | Self::FindStale
            | Self::FreeHandle(..)
            | Self::FindTools { .. }
            | Self::FindInitialised
            | Self::EnableTool(..) => Duration::ZERO,
        }
    }
}

impl SetUp {
    /// Handles the reply to a step; `None` after an ignored error.
    pub(super) fn advance(
        &mut self,
        step: SetUpStep,
        reply: Option<&str>,
        options: &NdiOptions,
    ) -> Result<NextStep, Failure> {
        let reply = reply.unwrap_or_default();
        Ok(NextStep::Step(match step {
            SetUpStep::Initialise => {
                okay(reply)?;
                SetUpStep::Version
            }
            SetUpStep::Version => {
                self.version = (!reply.is_empty()).then(|| excerpt(reply));
                SetUpStep::FindStale
            }
            SetUpStep::FindStale if reply.is_empty() => SetUpStep::FindTools { round: 0 },
            SetUpStep::FindStale => free_next(handles(reply)?),
            SetUpStep::FreeHandle(_, left) => free_next(left),
            SetUpStep::FindTools { round } => match initialise_next(handles(reply)?, round) {
                Some(step) if round < MOST_ROUNDS => step,
                _ => SetUpStep::FindInitialised,
            },
            SetUpStep::InitialiseTool { left, round, .. } => {
                okay(reply)?;
                initialise_next(left, round).unwrap_or(SetUpStep::FindTools { round: round + 1 })
            }
            SetUpStep::FindInitialised => self.enable_next(handles(reply)?)?,
            SetUpStep::EnableTool(handle, left) => {
                okay(reply)?;
                self.enabled.push(handle);
                self.enable_next(left)?
            }
            SetUpStep::StartTracking => {
                okay(reply)?;
                return self.choose(options).map(NextStep::Ready);
            }
        }))
    }

    fn enable_next(&self, mut left: Vec<u8>) -> Result<SetUpStep, Failure> {
        if let Some(handle) = left.pop() {
            return Ok(SetUpStep::EnableTool(handle, left));
        }
        if self.enabled.is_empty() {
            let text = "there is no tool: plug one in, or load the definition file of a passive one with the manufacturer's program";
            return Err(Failure::Settings(text.to_owned()));
        }
        Ok(SetUpStep::StartTracking)
    }

    fn choose(&self, options: &NdiOptions) -> Result<u8, Failure> {
        let known = self.enabled.iter().map(|handle| format!("{handle:02X}")).collect::<Vec<_>>().join(", ");
        match (options.handle, self.enabled.as_slice()) {
            (Some(handle), enabled) if enabled.contains(&handle) => Ok(handle),
            (Some(handle), _) => Err(Failure::Settings(format!("there is no tool {handle:02X}; tools: {known}"))),
            (None, [only]) => Ok(*only),
            (None, _) => Err(Failure::Settings(format!("there are several tools ({known}): set the option 'handle'"))),
        }
    }

    pub(super) fn identity(self, handle: u8, options: &NdiOptions) -> Identity {
        let mut notes =
            vec!["optical and magnetic trackers measure to about 0.1 to 1 mm: see the data sheet".to_owned()];
        if options.reply == ReplyFormat::Text {
            notes.push("TX gives positions in steps of 0.01 mm; BX is finer".to_owned());
        }
        if options.tip_mm.iter().all(|value| *value == 0.0) {
            notes.push("no tip is set: the point is the origin of the tool, not the point it touches".to_owned());
        }
        let [x, y, z] = options.tip_mm;
        Identity {
            name: format!("NDI tracker, version {}", self.version.as_deref().unwrap_or("unknown")),
            reflector: None,
            checked: vec![
                "units: mm (fixed in the interface)".to_owned(),
                format!("tool: {handle:02X}, initialised and enabled"),
                format!("tip: {x:.3}, {y:.3}, {z:.3} mm in the frame of the tool (as set)"),
            ],
            warnings: Vec::new(),
            notes,
        }
    }
}

/// Initialises the next of these tools; `None` if none is left.
fn initialise_next(mut left: Vec<u8>, round: u32) -> Option<SetUpStep> {
    let handle = left.pop()?;
    Some(SetUpStep::InitialiseTool { handle, left, round })
}

fn free_next(mut left: Vec<u8>) -> SetUpStep {
    left.pop().map_or(SetUpStep::FindTools { round: 0 }, |handle| SetUpStep::FreeHandle(handle, left))
}

fn okay(reply: &str) -> Result<(), Failure> {
    match reply {
        "OKAY" => Ok(()),
        warning if warning.starts_with("WARNING") => Ok(()),
        other => Err(Failure::Garbled(format!("`{}` instead of OKAY", excerpt(other)))),
    }
}

/// Handles of a `PHSR` reply: their number, then two digits of handle and three of status for each, in reverse order.
fn handles(reply: &str) -> Result<Vec<u8>, Failure> {
    let garbled = || Failure::Garbled(format!("`{}` is not a list of port handles", excerpt(reply)));
    let byte = |text: &str| u8::from_str_radix(text, 16).map_err(|_not_hexadecimal| garbled());
    let (count, mut rest) = reply.split_at_checked(2).ok_or_else(garbled)?;
    let mut handles = Vec::new();
    for _ in 0..byte(count)? {
        let (entry, after) = rest.split_at_checked(5).ok_or_else(garbled)?;
        let (handle, _status) = entry.split_at_checked(2).ok_or_else(garbled)?;
        handles.push(byte(handle)?);
        rest = after;
    }
    if !rest.is_empty() {
        return Err(garbled());
    }
    handles.reverse();
    Ok(handles)
}
