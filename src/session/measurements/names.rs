//! What the name of a column says: a joint, a coordinate, a unit. Words of the field in English, German, French, Chinese and Japanese.
//!
//! Only words that mean the measured point count: `tcp_x`, `nominal_x` or `target_x` may be the point of the controller, and are none
//! of it.

/// Words for a joint. The single letters count only beside nothing but such words.
const JOINT_WORDS: &[&str] = &[
    "joint",
    "joints",
    "jnt",
    "jt",
    "axis",
    "ax",
    "rax",
    "theta",
    "th",
    "θ",
    "achse",
    "gelenk",
    "axe",
    "articulation",
    "eje",
    "asse",
    "giunto",
    "关节",
    "關節",
    "轴",
    "軸",
    "関節",
    "ジョイント",
];
const JOINT_LETTERS: &[&str] = &["q", "j", "a"];

/// Words beside a joint or a coordinate that change nothing.
const VALUE_WORDS: &[&str] =
    &["angle", "angles", "pos", "position", "value", "val", "state", "winkel", "wert", "角度", "角", "值", "値"];

/// Words for the measured point.
const POINT_WORDS: &[&str] = &[
    "pos",
    "position",
    "point",
    "punkt",
    "coord",
    "coordinate",
    "koordinate",
    "koord",
    "measured",
    "measurement",
    "meas",
    "gemessen",
    "messpunkt",
    "mesure",
    "mesuré",
    "tracker",
    "lasertracker",
    "laser",
    "field",
    "smr",
    "nest",
    "reflector",
    "reflektor",
    "prism",
    "prisma",
    "marker",
    "p",
    "pt",
    "坐标",
    "座標",
    "坐標",
];

/// Whole names of columns that name the pose.
const POSE_NAMES: &[&str] = &[
    "pose",
    "name",
    "point",
    "punkt",
    "nr",
    "no",
    "number",
    "id",
    "index",
    "pose id",
    "pose name",
    "pose nr",
    "point name",
    "point id",
    "messpunkt",
    "punktname",
    "pt",
    "点",
    "点号",
    "点名",
    "序号",
    "编号",
    "番号",
    "姿勢",
    "姿态",
];

/// Whole names of columns that name the SMR.
const TARGET_NAMES: &[&str] =
    &["target", "smr", "nest", "reflector", "reflektor", "réflecteur", "prism", "prisma", "靶球", "反射球"];

/// Whole names of columns with times.
const TIME_NAMES: &[&str] =
    &["time", "t", "timestamp", "stamp", "zeit", "zeitstempel", "temps", "时间", "時間", "時刻"];

/// Whole names of columns with temperatures.
const TEMPERATURE_NAMES: &[&str] = &["temperature", "temp", "temperatur", "température", "温度"];

/// Words that show that a table is German, where *Grad* is a degree and not a gon.
const GERMAN_WORDS: &[&str] = &["achse", "gelenk", "punkt", "messpunkt", "winkel", "zeit", "temperatur", "reflektor"];

/// The unit that a word means, as column names write it.
pub(super) fn unit(word: &str, is_german: bool) -> Option<&'static str> {
    Some(match word.trim() {
        "deg" | "degs" | "degree" | "degrees" | "°" | "º" | "degré" | "degrés" | "度" => "deg",
        "grad" if is_german => "deg",
        "rad" | "rads" | "radian" | "radians" | "radiant" | "弧度" | "ラジアン" => "rad",
        "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" | "毫米" | "ミリ" | "ミリメートル" => {
            "mm"
        }
        "cm" | "centimeter" | "centimeters" | "centimetre" | "centimetres" | "厘米" => "cm",
        "m" | "meter" | "meters" | "metre" | "metres" | "mètre" | "mètres" | "米" | "メートル" => "m",
        "um" | "µm" | "μm" | "micron" | "microns" | "micrometer" | "micrometers" | "micrometre" | "微米" => "um",
        "in" | "inch" | "inches" | "zoll" | "\"" => "in",
        "degc" | "°c" | "celsius" | "℃" => "degc",
        _ => return None,
    })
}

/// Whether a set of joints is named by nothing but words for a joint.
pub(super) fn is_plain_joint(set: &str) -> bool {
    set.split(' ').all(|word| JOINT_WORDS.contains(&word) || JOINT_LETTERS.contains(&word))
}

/// Whether any of these names is German.
pub(super) fn is_german<'a>(names: impl IntoIterator<Item = &'a str>) -> bool {
    names.into_iter().any(|name| Name::new(name, false).words.iter().any(|word| GERMAN_WORDS.contains(&word.as_str())))
}

/// The name of a column, taken apart.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Name {
    /// Lower-case words and numbers.
    words: Vec<String>,
    /// The unit at its end.
    pub(super) unit: Option<&'static str>,
    /// What stands in brackets at its end and is no known unit.
    pub(super) unknown_unit: Option<String>,
}

/// A place that a column can have in a row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// A number of a joint as the name writes it; names with the same `set` belong together.
    Joint {
        set: String,
        number: usize,
    },
    /// Coordinate 0, 1 or 2 of a point; several points in a row are numbered.
    Coordinate {
        set: String,
        axis: usize,
        group: Option<usize>,
    },
    Pose,
    Target,
    Time,
    Temperature,
}

impl Name {
    pub(super) fn new(raw: &str, is_german: bool) -> Self {
        let lower = narrow(raw).to_lowercase();
        let (lower, bracket) = without_bracket(&lower);
        let mut pieces: Vec<&str> = lower.split(is_between_words).filter(|piece| !piece.is_empty()).collect();
        let mut found = None;
        // The unit first: 'µm' and '°' would be taken apart with the words.
        if pieces.len() > 1
            && let Some(last) = pieces.last().and_then(|last| unit(last, is_german))
        {
            found = Some(last);
            pieces.pop();
        }
        let mut words: Vec<String> = pieces.into_iter().flat_map(parts).collect();
        if found.is_none()
            && words.len() > 1
            && let Some(last) = words.last().and_then(|last| unit(last, is_german))
        {
            found = Some(last);
            words.pop();
        }
        let mut unknown_unit = None;
        if let Some(bracket) = bracket {
            match unit(bracket, is_german) {
                Some(known) => found = Some(known),
                None => unknown_unit = Some(bracket.to_owned()),
            }
        }
        Self { words, unit: found, unknown_unit }
    }

    /// What the column holds, as far as its name alone can say.
    pub(super) fn place(&self) -> Option<Place> {
        let whole = self.words.join(" ");
        if POSE_NAMES.contains(&whole.as_str()) {
            return Some(Place::Pose);
        }
        if TARGET_NAMES.contains(&whole.as_str()) {
            return Some(Place::Target);
        }
        if TIME_NAMES.contains(&whole.as_str()) {
            return Some(Place::Time);
        }
        if TEMPERATURE_NAMES.contains(&whole.as_str()) && self.unit == Some("degc") {
            return Some(Place::Temperature);
        }
        self.coordinate().or_else(|| self.joint())
    }

    /// Whether the name is exactly this one, whatever stands between its words.
    pub(super) fn is(&self, other: &Self) -> bool {
        self.words == other.words
    }

    /// Whether the name speaks of the tool of the controller.
    pub(super) fn is_of_tool(&self) -> bool {
        self.words.iter().any(|word| word == "tcp" || word == "tool" || word == "werkzeug")
    }

    fn joint(&self) -> Option<Place> {
        let is_number = |word: &&String| word.bytes().all(|byte| byte.is_ascii_digit());
        // Of `arm_1_joint_2` the last number is that of the joint.
        let at = self.words.iter().rposition(|word| is_number(&word))?;
        let number = self.words.get(at)?.parse().ok().filter(|number| *number < 100)?;
        let beside: Vec<&str> = self
            .words
            .iter()
            .enumerate()
            .filter(|(index, word)| *index != at && !VALUE_WORDS.contains(&word.as_str()))
            .map(|(_, word)| word.as_str())
            .collect();
        let is_known = |word: &&str| JOINT_WORDS.contains(word) || JOINT_LETTERS.contains(word);
        let is_joint =
            beside.iter().any(|word| JOINT_WORDS.contains(word)) || (!beside.is_empty() && beside.iter().all(is_known));
        is_joint.then(|| Place::Joint { set: beside.join(" "), number })
    }

    fn coordinate(&self) -> Option<Place> {
        // The last column of a 4 x 4 matrix.
        if let [matrix, place] = self.words.as_slice()
            && matrix == "m"
        {
            let axis = ["03", "13", "23"].iter().position(|known| known == place)?;
            return Some(Place::Coordinate { set: "m".to_owned(), axis, group: None });
        }
        let (mut axis, mut group, mut beside) = (None, None, Vec::new());
        for word in &self.words {
            let letter = ["x", "y", "z"].iter().position(|letter| letter == word);
            match (letter, word.parse::<usize>()) {
                (Some(letter), _) if axis.is_none() => axis = Some(letter),
                (None, Ok(number)) if group.is_none() => group = Some(number),
                (None, Err(_)) if POINT_WORDS.contains(&word.as_str()) => beside.push(word.as_str()),
                _ => return None,
            }
        }
        Some(Place::Coordinate { set: beside.join(" "), axis: axis?, group })
    }
}

/// Brackets and letters of the wide forms that East Asian keyboards write, as the usual ones.
fn narrow(text: &str) -> String {
    let usual = |c: char| match c {
        '\u{ff01}'..='\u{ff5e}' => u32::from(c).checked_sub(0xfee0).and_then(char::from_u32).unwrap_or(c),
        '【' | '〔' => '[',
        '】' | '〕' => ']',
        '\u{3000}' => ' ',
        _ => c,
    };
    text.chars().map(usual).collect()
}

/// A name without the brackets at its end, and what is in them.
fn without_bracket(name: &str) -> (&str, Option<&str>) {
    let name = name.trim();
    for (open, close) in [('[', ']'), ('(', ')'), ('{', '}')] {
        if let Some((before, inside)) = name.strip_suffix(close).and_then(|rest| rest.rsplit_once(open))
            && !before.trim().is_empty()
            && !inside.trim().is_empty()
        {
            return (before, Some(inside.trim()));
        }
    }
    (name, None)
}

fn is_between_words(c: char) -> bool {
    c.is_whitespace() || matches!(c, '_' | '.' | '-' | '/' | ':')
}

/// The runs of letters, digits and East Asian characters of a word: `joint1` is `joint` and `1`, `X坐标` is `x` and `坐标`.
fn parts(word: &str) -> Vec<String> {
    let kind = |c: char| match c {
        '0'..='9' => 0,
        '\u{2e80}'.. => 1,
        'θ' => 2,
        _ => 3,
    };
    let mut parts: Vec<String> = Vec::new();
    let mut last = None;
    for c in word.chars() {
        match parts.last_mut() {
            Some(part) if last == Some(kind(c)) => part.push(c),
            _ => parts.push(c.to_string()),
        }
        last = Some(kind(c));
    }
    // `Xmm` is a coordinate with its unit.
    if let [only] = parts.as_slice()
        && let Some((at, _)) = only.char_indices().nth(1)
    {
        let (letter, rest) = only.split_at(at);
        if ["x", "y", "z"].contains(&letter) && ["mm", "cm", "m", "in", "um"].contains(&rest) {
            return vec![letter.to_owned(), rest.to_owned()];
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joint(name: &str) -> Option<(String, usize)> {
        match Name::new(name, name.contains("Achse")).place() {
            Some(Place::Joint { set, number }) => Some((set, number)),
            _ => None,
        }
    }

    #[test]
    fn joints_of_many_programs_are_known() {
        for (name, set, number) in [
            ("q1_deg", "q", 1),
            ("J1 (deg)", "j", 1),
            ("A6", "a", 6),
            ("Joint 3 [rad]", "joint", 3),
            ("theta_7", "theta", 7),
            ("Achse2_Grad", "achse", 2),
            ("arm_left_1_joint", "arm left joint", 1),
            ("panda_joint4", "panda joint", 4),
            ("joint_a5", "joint a", 5),
            ("关节1角度(度)", "关节", 1),
            ("第1軸", "第 軸", 1),
            ("θ2", "θ", 2),
            ("joint_1_position", "joint", 1),
        ] {
            assert_eq!(joint(name), Some((set.to_owned(), number)), "{name}");
        }
        for name in
            ["shoulder_pan_joint", "q1_cmd", "dq1", "a", "x1", "m_03", "field.position0", "current 1", "torque_j1"]
        {
            assert_eq!(joint(name), None, "{name}");
        }
    }

    #[test]
    fn only_measured_points_are_points() {
        for (name, expected) in [
            ("X (mm)", Some(("", 0, None))),
            ("z_mm", Some(("", 2, None))),
            ("measurement_y", Some(("measurement", 1, None))),
            ("X坐标（毫米）", Some(("坐标", 0, None))),
            ("x1_mm", Some(("", 0, Some(1)))),
            ("SMR2 Z [mm]", Some(("smr", 2, Some(2)))),
            ("m_13", Some(("m", 1, None))),
            ("Xmm", Some(("", 0, None))),
            ("tcp_x", None),
            ("nominal_x_mm", None),
            ("x_cmd", None),
            ("x_y", None),
            ("m_01", None),
        ] {
            let found = match Name::new(name, false).place() {
                Some(Place::Coordinate { set, axis, group }) => Some((set, axis, group)),
                _ => None,
            };
            assert_eq!(found, expected.map(|(set, axis, group)| (set.to_owned(), axis, group)), "{name}");
        }
    }

    #[test]
    fn units_are_words_signs_and_brackets() {
        for (name, unit) in [
            ("q1_°", Some("deg")),
            ("q1 [deg]", Some("deg")),
            ("x_millimeter", Some("mm")),
            ("X/mm", Some("mm")),
            ("z [µm]", Some("um")),
            ("T [°C]", Some("degc")),
            ("X(毫米)", Some("mm")),
            ("x [pulse]", None),
            ("x", None),
            ("Achse1_Grad", None),
        ] {
            assert_eq!(Name::new(name, false).unit, unit, "{name}");
        }
        assert_eq!(Name::new("Achse1_Grad", true).unit, Some("deg"));
        assert_eq!(Name::new("x [pulse]", false).unknown_unit.as_deref(), Some("pulse"));
    }
}
