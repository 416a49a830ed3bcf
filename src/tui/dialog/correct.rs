//! The form for a robot program to correct.

use super::{Dialog, Form};
use crate::session::corrected::{Points, ProgramChoice};
use crate::wizard::{Intent, check_program};

/// Languages, after the answer that the ending of the file tells it.
const LANGUAGES: &[&str] = &[BY_ENDING, "rapid", "krl", "fanuc", "urscript", "val3", "inform", "ros"];
const BY_ENDING: &str = "by its ending";

/// Asks for the program and for what only its user knows.
pub(super) fn program() -> Dialog {
    let pose = "For what the program does not state: x,y,z,rx,ry,rz (mm; degrees about the fixed axes), or NAME=x,y,z,rx,ry,rz; several with ';'.";
    Dialog::Form(
        Form::new("Robot program to correct with the result", chosen)
            .text("program", "", "Its path, typed or pasted; Tab completes it. The program itself is not changed.")
            .path()
            .pick("language", LANGUAGES, 0, "Left/Right.")
            .pick(
                "points",
                Points::NAMES,
                0,
                "Left/Right. Computed: by an offline system, from CAD. Taught ones are right already on this arm and stay.",
            )
            .text("tool", "", pose)
            .text("frame", "", pose)
            .text("belongs to it", "", "Files with its data or its moves, such as the .dat of a .src; several with ';'."),
    )
}

fn chosen(values: &[String]) -> Result<Intent, String> {
    let [file, dialect, points, tool, frame, companions] = values else {
        return Err("six values are needed".to_owned());
    };
    let choice = ProgramChoice {
        file: file.clone(),
        dialect: if dialect == BY_ENDING { String::new() } else { dialect.clone() },
        points: points.parse().map_err(|error: crate::text::UnknownName| error.to_string())?,
        tool: tool.clone(),
        frame: frame.clone(),
        companions: companions.clone(),
    };
    check_program(&choice).map_err(|error| error.to_string())?;
    Ok(Intent::CorrectProgram(Box::new(choice)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::Dialect;

    fn said(values: [&str; 6]) -> Result<Intent, String> {
        chosen(&values.map(str::to_owned))
    }

    #[test]
    fn a_program_needs_a_path_a_language_and_the_origin_of_its_points() {
        assert_eq!(LANGUAGES[1..], *Dialect::NAMES);
        let whole = ["cell/pick.mod", BY_ENDING, "computed", "0,0,100,0,0,0", "", ""];
        let Ok(Intent::CorrectProgram(choice)) = said(whole) else { panic!() };
        assert_eq!(
            (choice.file.as_str(), choice.dialect.as_str(), choice.points),
            ("cell/pick.mod", "", Points::Computed)
        );
        let with = |at: usize, text: &'static str| {
            let mut values = whole;
            values[at] = text;
            said(values).unwrap_err()
        };
        assert_eq!(with(0, ""), "no program is named");
        assert!(with(0, "pick.txt").contains("tells no language"));
        assert!(with(2, "not stated").contains("computed or taught?"));
        assert!(with(2, "taught").contains("taught points are not corrected"));
        assert!(with(3, "0,0").contains("is no pose"));
    }
}
