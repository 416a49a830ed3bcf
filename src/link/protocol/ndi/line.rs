//! Start-up of a serial line: instruments have 9600 baud after they are switched on, and another speed only after `COMM`.

use std::time::Duration;

use super::super::LineChange;

/// Speed after switching on or a reset (baud).
const FACTORY_SPEED: u32 = 9600;

/// Steps until the line has the wanted speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LineStep {
    /// Asks at the wanted speed: another program may have left it so. A reset would unload the tools.
    AtSpeed,
    /// Asks at the speed after switching on.
    AtFactorySpeed,
    /// Sends a break, which resets the instrument whatever its speed is.
    Reset,
    /// Sets the wanted speed.
    SetSpeed,
}

impl LineStep {
    /// Longest duration of a reset.
    pub(super) const RESET_LIMIT: Duration = Duration::from_secs(10);

    /// A command that every instrument answers in every mode.
    pub(super) const PROBE: &str = "APIREV:";

    /// Change of the line before the command of the step.
    pub(super) const fn change_before(self) -> Option<LineChange> {
        match self {
            Self::AtFactorySpeed => Some(LineChange::Speed(FACTORY_SPEED)),
            Self::Reset => Some(LineChange::Break),
            Self::AtSpeed | Self::SetSpeed => None,
        }
    }
}

/// A serial line with its wanted speed.
#[derive(Clone, Copy, Debug)]
pub(super) struct SerialLine {
    speed: u32,
}

impl SerialLine {
    pub(super) const fn new(speed: u32) -> Self {
        Self { speed }
    }

    pub(super) const fn speed(self) -> u32 {
        self.speed
    }

    /// The number of the wanted speed in `COMM`, if it has one.
    const fn code(self) -> Option<u8> {
        match self.speed {
            FACTORY_SPEED => Some(0),
            14_400 => Some(1),
            19_200 => Some(2),
            38_400 => Some(3),
            57_600 => Some(4),
            115_200 => Some(5),
            921_600 => Some(6),
            _ => None,
        }
    }

    /// Command of a step; a break has none.
    pub(super) fn command(self, step: LineStep) -> Option<String> {
        match step {
            LineStep::AtSpeed | LineStep::AtFactorySpeed => Some(LineStep::PROBE.to_owned()),
            LineStep::Reset => None,
            // Eight data bits, no parity, one stop bit, no handshake.
            LineStep::SetSpeed => self.code().map(|code| format!("COMM:{code}0000")),
        }
    }

    /// The next step after an answer; `None`: the line has the wanted speed.
    pub(super) const fn answered(self, step: LineStep) -> Option<LineStep> {
        match step {
            LineStep::AtSpeed | LineStep::SetSpeed => None,
            LineStep::AtFactorySpeed | LineStep::Reset if self.speed == FACTORY_SPEED => None,
            LineStep::AtFactorySpeed | LineStep::Reset => Some(LineStep::SetSpeed),
        }
    }

    /// The next step without an answer; `None`: nothing is left to try.
    pub(super) const fn unanswered(self, step: LineStep) -> Option<LineStep> {
        match step {
            LineStep::AtSpeed if self.code().is_none() => None,
            LineStep::AtSpeed if self.speed == FACTORY_SPEED => Some(LineStep::Reset),
            LineStep::AtSpeed => Some(LineStep::AtFactorySpeed),
            LineStep::AtFactorySpeed => Some(LineStep::Reset),
            LineStep::Reset | LineStep::SetSpeed => None,
        }
    }
}
