//! Meanings of the robot mode and the safety status, from the manufacturer's guide to the interface and its client library.
//! Unlisted numbers are shown as numbers.
//!
//! Newer controllers report the safety status, older ones the safety mode, which has the same numbers up to 11.

/// The safety status without any limit.
pub const SAFETY_NORMAL: i32 = 1;

/// The robot mode in which programs run.
pub const MODE_RUNNING: i32 = 7;

/// Whether joint values of this safety status must not be used: after a protective stop the arm may press against what it hit,
/// in an emergency stop it hangs in its brakes, and after a violation or a fault its encoders may be what is wrong.
///
/// All other states are common while a person is in the cell to seat the reflector, and the robot is at rest in them.
pub const fn forbids_measuring(safety_status: i32) -> bool {
    matches!(safety_status, 3 | 6..=9 | 15 | 20)
}

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
        11 => "undefined",
        12 => "safeguard stop in automatic mode",
        13 => "enabling switch released",
        14 => "enabling switch of the teach pendant released",
        15 => "emergency stop of the injection moulding machine",
        16 => "safeguard stop of the injection moulding machine",
        17 => "waiting for PROFIsafe parameters",
        18 => "PROFIsafe safeguard stop in automatic mode",
        19 => "PROFIsafe safeguard stop",
        20 => "PROFIsafe emergency stop",
        22 => "safeguard stop by the safety interface",
        23 => "stop by a safety plane",
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
