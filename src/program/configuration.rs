//! How the languages state the branch of a Cartesian target.
//!
//! `docs/programs.md` names the sources of the notations, and what is not verified.

use std::fmt;

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
