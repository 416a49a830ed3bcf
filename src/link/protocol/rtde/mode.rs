//! Meanings of the robot mode and the safety status, from the manufacturer's guide to the interface. Unlisted numbers are shown
//! as numbers.

/// The safety status in which the robot may move.
pub const SAFETY_NORMAL: i32 = 1;

/// The robot mode in which programs run.
pub const MODE_RUNNING: i32 = 7;

/// Name and number of a safety status.
pub fn safety_status(number: i32) -> String {
    let words = match number {
        SAFETY_NORMAL => "normal",
        2 => "reduced",
        3 => "protective stop",
        4 => "recovery",
        5 => "safeguard stop",
        6 => "system emergency stop",
        7 => "robot emergency stop",
        8 => "safety violation",
        9 => "safety fault",
        10 => "joint id needs validation",
        _ => "unlisted safety status",
    };
    format!("{words} ({number})")
}

/// Name and number of a robot mode.
pub fn robot_mode(number: i32) -> String {
    let words = match number {
        -1 => "no controller",
        0 => "disconnected",
        1 => "safety needs confirmation",
        2 => "booting",
        3 => "power off",
        4 => "power on",
        5 => "idle",
        6 => "backdrive",
        MODE_RUNNING => "running",
        8 => "updating",
        _ => "unlisted mode",
    };
    format!("{words} ({number})")
}
