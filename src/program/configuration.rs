//! How the languages state the branch of a Cartesian target.
//!
//! `docs/programs.md` names the sources of the notations, and what is not verified.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::fmt;

use crate::inverse::Posture;
use crate::units::DEGREE;

/// The branch of a Cartesian target, as written in the program.
#[derive(Clone, Debug, PartialEq)]
pub enum Configuration {
    /// ABB `confdata`: quarter turns of axes 1, 4 and 6, and the form of the arm.
    Rapid { cf1: i32, cf4: i32, cf6: i32, cfx: i32 },
    /// KUKA status and turn, as bits.
    Krl { s: Option<u32>, t: Option<u32> },
    /// FANUC `CONFIG`.
    Fanuc(FanucConfig),
    /// Stäubli shoulder, elbow and wrist; `None`: free, or as before.
    Val3 { righty: Option<bool>, elbow_is_positive: Option<bool>, wrist_is_positive: Option<bool> },
    /// Yaskawa `RCONF`.
    Inform(Rconf),
    /// The solution nearest to these joint values (rad), such as `qnear` of PolyScope.
    Near(Vec<f64>),
    /// The controller chooses.
    Free,
}

/// FANUC configuration letters and turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FanucConfig {
    /// `F` against `N`.
    pub is_flipped: bool,
    /// `U` against `D`.
    pub elbow_is_up: bool,
    /// `T` against `B`.
    pub is_front: bool,
    /// `L` against `R`, if written.
    pub is_left: Option<bool>,
    /// Turn numbers as written.
    pub turns: [i32; 3],
}

/// Yaskawa manipulator type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(clippy::struct_excessive_bools, reason = "each is a digit of the line RCONF")]
pub struct Rconf {
    pub is_no_flip: bool,
    pub is_lower_arm: bool,
    pub is_rear: bool,
    /// Axis R at or beyond half a turn.
    pub r_is_wound: bool,
    /// Axis T at or beyond half a turn.
    pub t_is_wound: bool,
    /// Axis S at or beyond half a turn.
    pub s_is_wound: bool,
}

/// How far beyond the edge of a quarter or half turn an axis still belongs to it (rad). A correction may carry an axis across the
/// edge, and controllers take the nearest turn.
const EDGE: f64 = 10.0 * DEGREE;

impl Configuration {
    /// Whether joint values (pendant, rad) have this configuration; `posture` is theirs, if the arm has one.
    pub fn matches(&self, posture: Option<&Posture>, q: &[f64]) -> bool {
        let axis = |index: usize| q.get(index).copied().unwrap_or(0.0);
        let is = |of: fn(&Posture) -> bool, expected: bool| posture.is_none_or(|posture| of(posture) == expected);
        match self {
            Self::Rapid { cf1, cf4, cf6, cfx } => {
                let quarters = [(0, *cf1), (3, *cf4), (5, *cf6)];
                quarters.into_iter().all(|(index, quarter)| is_in_quarter(axis(index), quarter))
                    && (0..8).contains(cfx)
                    && is(|posture| posture.wrist_is_behind, cfx & 4 != 0)
                    && is(|posture| posture.wrist_is_behind_lower_arm, cfx & 2 != 0)
                    && is(|posture| posture.wrist_is_negative, cfx & 1 != 0)
            }
            Self::Krl { s, t } => {
                // Bit 1: axis 3 is at or beyond the angle of the stretched arm, so the wrist is in front of the link arm.
                let has_status = s.is_none_or(|s| {
                    is(|posture| posture.wrist_is_behind, s & 1 != 0)
                        && is(|posture| !posture.wrist_is_behind_lower_arm, s & 2 != 0)
                        && is(|posture| posture.wrist_is_negative, s & 4 != 0)
                });
                let has_turn = t.is_none_or(|t| {
                    q.iter().take(6).enumerate().all(|(index, q)| {
                        let is_negative = t & (1 << index) != 0;
                        if is_negative { *q < EDGE } else { *q > -EDGE }
                    })
                });
                has_status && has_turn
            }
            Self::Fanuc(config) => {
                let turns = config.turns.into_iter().zip(3..);
                is(|posture| !posture.wrist_is_negative, config.is_flipped)
                    && is(Posture::elbow_is_up, config.elbow_is_up)
                    && is(|posture| !posture.wrist_is_behind, config.is_front)
                    && turns.into_iter().all(|(turn, index)| is_in_turn(axis(index), turn))
            }
            Self::Val3 { righty, elbow_is_positive, wrist_is_positive } => {
                let has_sign = |value: f64, is_positive: Option<bool>| {
                    is_positive.is_none_or(|is_positive| if is_positive { value > -EDGE } else { value < EDGE })
                };
                righty.is_none_or(|righty| is(|posture| !posture.wrist_is_behind, righty))
                    && has_sign(axis(2), *elbow_is_positive)
                    && has_sign(axis(4), *wrist_is_positive)
            }
            Self::Inform(rconf) => {
                let is_no_flip = axis(3).cos() < 0.0;
                let is_at_edge = axis(3).cos().abs() < EDGE.sin();
                let winds = [(3, rconf.r_is_wound), (5, rconf.t_is_wound), (0, rconf.s_is_wound)];
                (is_at_edge || is_no_flip == rconf.is_no_flip)
                    && is(|posture| !posture.elbow_is_up(), rconf.is_lower_arm)
                    && is(|posture| posture.wrist_is_behind, rconf.is_rear)
                    && winds.into_iter().all(|(index, is_wound)| {
                        let beyond = axis(index).abs() - 2.0 * FRAC_PI_2;
                        if is_wound { beyond > -EDGE } else { beyond < EDGE }
                    })
            }
            Self::Near(_) | Self::Free => true,
        }
    }
}

/// Whether an axis is in a quarter turn: 0 is from 0° to 90°, -1 from -90° to 0°.
fn is_in_quarter(q: f64, quarter: i32) -> bool {
    let start = f64::from(quarter) * FRAC_PI_2;
    (start - EDGE..start + FRAC_PI_2 + EDGE).contains(&q)
}

/// Whether an axis is in a whole turn: 0 is from -180° to 180°.
fn is_in_turn(q: f64, turn: i32) -> bool {
    (q - f64::from(turn) * TAU).abs() < 0.5 * TAU + EDGE
}

impl fmt::Display for Configuration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rapid { cf1, cf4, cf6, cfx } => write!(f, "[{cf1},{cf4},{cf6},{cfx}]"),
            Self::Krl { s, t } => {
                let part = |name: &str, bits: &Option<u32>| bits.map(|bits| format!("{name} {bits}"));
                let parts: Vec<String> = [part("S", s), part("T", t)].into_iter().flatten().collect();
                f.write_str(&parts.join(", "))
            }
            Self::Fanuc(config) => {
                let letter = |is: bool, yes: char, no: char| if is { yes } else { no };
                write!(f, "{} ", letter(config.is_flipped, 'F', 'N'))?;
                if let Some(is_left) = config.is_left {
                    write!(f, "{} ", letter(is_left, 'L', 'R'))?;
                }
                let [one, two, three] = config.turns;
                let (up, front) = (letter(config.elbow_is_up, 'U', 'D'), letter(config.is_front, 'T', 'B'));
                write!(f, "{up} {front}, {one}, {two}, {three}")
            }
            Self::Val3 { righty, elbow_is_positive, wrist_is_positive } => {
                let word = |is: Option<bool>, yes: &'static str, no: &'static str| {
                    is.map_or("free", |is| if is { yes } else { no })
                };
                let shoulder = word(*righty, "righty", "lefty");
                let elbow = word(*elbow_is_positive, "epositive", "enegative");
                write!(f, "{shoulder}, {elbow}, {}", word(*wrist_is_positive, "wpositive", "wnegative"))
            }
            Self::Inform(rconf) => {
                let bits = [
                    rconf.is_no_flip,
                    rconf.is_lower_arm,
                    rconf.is_rear,
                    rconf.r_is_wound,
                    rconf.t_is_wound,
                    rconf.s_is_wound,
                ];
                f.write_str(&bits.map(|bit| if bit { "1" } else { "0" }).join(","))
            }
            Self::Near(_) => f.write_str("the nearest solution"),
            Self::Free => f.write_str("free"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn holds(configuration: &Configuration, flags: [bool; 3], degrees: [f64; 6]) -> bool {
        let [wrist_is_behind, wrist_is_behind_lower_arm, wrist_is_negative] = flags;
        let posture = Posture { wrist_is_behind, wrist_is_behind_lower_arm, wrist_is_negative };
        configuration.matches(Some(&posture), &degrees.map(f64::to_radians))
    }

    #[test]
    fn branches_are_told_apart_in_every_notation() {
        let usual = [false; 3];
        let down = [10.0, -20.0, 30.0, -40.0, 50.0, -100.0];
        let rapid = |cf1, cf4, cf6, cfx| Configuration::Rapid { cf1, cf4, cf6, cfx };
        assert!(holds(&rapid(0, -1, -2, 0), usual, down));
        assert!(!holds(&rapid(0, 0, -2, 0), usual, down) && !holds(&rapid(0, -1, -2, 1), usual, down));
        assert!(holds(&rapid(0, -1, -2, 7), [true; 3], down));
        // A correction across the edge of a quarter stays in it.
        assert!(holds(&rapid(-1, -1, -2, 0), usual, [0.01, 0.0, 0.0, 0.01, 30.0, -89.9]));
        // KUKA home with the wrist down is S 2 (binary 010), T 2 (axis 2 negative).
        let krl = |s, t| Configuration::Krl { s: Some(s), t: Some(t) };
        let home = [0.0, -90.0, 90.0, 0.0, 90.0, 0.0];
        assert!(holds(&krl(2, 2), usual, home) && holds(&krl(2, 35), usual, home) && !holds(&krl(2, 18), usual, home));
        assert!(!holds(&krl(6, 2), usual, home) && !holds(&krl(0, 2), usual, home));
        assert!(holds(&Configuration::Krl { s: None, t: None }, usual, home));
        let fanuc = |is_flipped, turns| {
            let config = FanucConfig { is_flipped, elbow_is_up: true, is_front: true, is_left: None, turns };
            Configuration::Fanuc(config)
        };
        let negative = [false, false, true];
        assert!(holds(&fanuc(false, [0; 3]), negative, [0.0, 0.0, 0.0, 0.0, -90.0, 170.0]));
        assert!(!holds(&fanuc(true, [0; 3]), negative, [0.0, 0.0, 0.0, 0.0, -90.0, 170.0]));
        assert!(holds(&fanuc(false, [0, 0, 1]), negative, [0.0, 0.0, 0.0, 0.0, -90.0, 270.0]));
        assert!(!holds(&fanuc(false, [0, 0, 0]), negative, [0.0, 0.0, 0.0, 0.0, -90.0, 270.0]));
        let val3 = Configuration::Val3 { righty: Some(true), elbow_is_positive: Some(true), wrist_is_positive: None };
        assert!(holds(&val3, usual, home) && !holds(&val3, usual, home.map(|q| -q)));
        let rconf = |is_no_flip, r_is_wound| {
            let bits = Rconf {
                is_no_flip,
                is_lower_arm: false,
                is_rear: false,
                r_is_wound,
                t_is_wound: false,
                s_is_wound: false,
            };
            Configuration::Inform(bits)
        };
        assert!(holds(&rconf(false, false), usual, home) && !holds(&rconf(true, false), usual, home));
        assert!(holds(&rconf(true, true), usual, [0.0, 0.0, 0.0, 190.0, 30.0, 0.0]));
        assert!(Configuration::Free.matches(None, &[]));
    }
}
