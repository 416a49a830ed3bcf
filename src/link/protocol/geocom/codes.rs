//! Meanings of return codes.

use super::super::Failure;

/// Success.
pub(super) const OK: u32 = 0;
/// Success, but without the full correction.
pub(super) const NO_FULL_CORRECTION: u32 = 1283;
/// Success, but the accuracy is not guaranteed.
pub(super) const ACCURACY_NOT_GUARANTEED: u32 = 1284;
/// Transport result of a sleeping instrument.
pub(super) const SLEEPING: u32 = 3108;

/// Codes after which a retry makes sense: system busy, sleep mode, EDM busy, measurement busy.
pub(super) const fn is_busy(code: u32) -> bool {
    matches!(code, 13 | 25 | 786 | 1293)
}

/// Codes of a procedure that the instrument does not have.
pub(super) const fn is_unknown(code: u32) -> bool {
    matches!(code, 3080 | 3081)
}

/// Meaning of a code.
pub const fn code_in_words(code: u32) -> &'static str {
    match code {
        0 => "done",
        2 => "wrong parameter",
        3 => "wrong result",
        6 => "timed out",
        8 => "aborted",
        12 => "the instrument is switching off",
        13 => "the system is busy",
        16 => "the battery is low",
        21 => "outside the temperature range",
        22 => "not level: the tilt is out of range",
        25 | 3108 => "the instrument is asleep",
        26 => "not possible",
        27 => "not available: the licence is missing",
        512..=530 => "the automatic target recognition failed",
        770 => "no signal returns",
        776 => "the air is too turbulent",
        786 => "the distance meter is busy",
        818 => "the distance is out of range",
        823 | 8711 => "several targets in view",
        769..=832 => "the distance meter failed",
        1283 => "without the full correction",
        1284 => "the accuracy is not guaranteed",
        1285 => "only angles, no distance",
        1288 => "only angles, without the full correction",
        1289 => "only angles, accuracy not guaranteed",
        1290 => "no angles",
        1291 => "a distance correction (ppm or prism) is set, which this call does not allow",
        1292 => "no distance could be measured",
        1293 => "a measurement is busy",
        1294 => "no signal for the distance",
        1792..=1810 => "the motors failed",
        3074 => "the instrument could not read the request",
        3075 => "the instrument could not send",
        3077 => "the request timed out on the way",
        3078 => "the request was malformed",
        3080 | 3081 => "unknown request",
        3093 => "the transaction number does not match",
        3101 | 3102 => "the CRC was wrong",
        3107 => "another request was still in progress",
        3109 => "the instrument is switched off",
        3110 => "a CRC is required",
        8704 => "the target was not found in time",
        8708 => "the target moves: not accurate",
        8710 => "no target",
        8712 => "too much light or bad air for the target recognition",
        8714 => "the target recognition is not switched on",
        8716 => "the pointing accuracy was not reached",
        _ => "unknown code",
    }
}

/// The failure for a code.
pub fn failure_of(code: u32) -> Failure {
    let text = format!("code {code}: {}", code_in_words(code));
    match code {
        770 | 818 | 1285 | 1288 | 1289 | 1292 | 1294 | 8704 | 8710 => Failure::NoTarget(text),
        22 | 776 | 1290 | 8708 | 8712 | 8716 => Failure::Unstable(text),
        6 | 8 | 12 | 13 | 16 | 21 | 25 | 786 | 1293 | 3107..=3109 => Failure::NotReady(text),
        823 | 8711 => Failure::Unusable(text),
        1291 | 8714 | 3110 => Failure::Settings(text),
        3074..=3078 | 3093..=3106 => Failure::Garbled(text),
        _ => Failure::Refused(text),
    }
}
