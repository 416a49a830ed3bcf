//! Stäubli VAL3: the joint positions as data (`.dtx`), the moves as a program (`.pgx`).
//!
//! Both files go into an application (its `.pjx` names them). `waitEndMove` empties the queue of moves, so every point is an
//! exact stop; blending is off in the motion descriptor. The names of variables follow the manufacturer's examples.

mod reader;

use super::names::identifier;
use super::remark::Remark;
use super::{AS_ON_PENDANT, COMMENT_WIDTH, CRLF, Digits, Job, Language, ProgramError, ProgramFile};

pub(super) const LANGUAGE: Language = Language {
    title: "VAL3",
    advice: Some("Add the .dtx and the .pgx to an application."),
    convention: AS_ON_PENDANT,
    write,
    read: reader::read,
    digits: Digits { joint: 5, length: 4, turn: 5, are_fixed: false },
    remark: Remark { after: " -->", ..Remark::new("<!-- ", &["<?xml"]) },
};

const DECIMALS: usize = 5;

/// Longest program name (characters).
const LONGEST_NAME: usize = 15;

fn write(job: &mut Job<'_>) -> Result<Vec<ProgramFile>, ProgramError> {
    job.require_joints(6..=6, false)?;
    let name = identifier(&job.options.name, LONGEST_NAME);
    let data = data(job);
    let code = code(job, &name);
    Ok(vec![Job::file(&name, "dtx", &data, CRLF), Job::file(&name, "pgx", &code, CRLF)])
}

/// The header as an XML comment, in which two hyphens are not allowed.
fn comment(job: &Job<'_>) -> Vec<String> {
    let head = job.header(COMMENT_WIDTH);
    let inside = head.iter().map(|line| format!("  {}", line.replace("--", "__")));
    std::iter::once("<!--".to_owned()).chain(inside).chain(["-->".to_owned()]).collect()
}

fn data(job: &mut Job<'_>) -> Vec<String> {
    let mut lines = vec!["<?xml version=\"1.0\" encoding=\"utf-8\"?>".to_owned()];
    lines.extend(comment(job));
    lines.push(
        "<Database xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" \
         xmlns=\"http://www.staubli.com/robotics/VAL3/Data/2\">"
            .to_owned(),
    );
    lines.push("  <Datas>".to_owned());
    let array = |name: &str, kind: &str, size: usize| {
        format!("    <Data name=\"{name}\" access=\"private\" xsi:type=\"array\" type=\"{kind}\" size=\"{size}\">")
    };
    let end = || "    </Data>".to_owned();
    lines.push(array("jJoints", "jointRx", job.poses.len()));
    for (key, pose) in job.poses.iter().enumerate() {
        let values = job.edge_values(pose, DECIMALS);
        let axes: Vec<String> = values.iter().zip(1..).map(|(value, axis)| format!("j{axis}=\"{value}\"")).collect();
        lines.push(format!("      <Value key=\"{key}\" {} />", axes.join(" ")));
    }
    lines.push(end());
    lines.push(array("mNomSpeed", "mdesc", 1));
    lines.push(format!(
        "      <Value key=\"0\" accel=\"30\" vel=\"{}\" decel=\"30\" tmax=\"250\" rmax=\"50\" blend=\"off\" leave=\"50\" reach=\"50\" />",
        job.percent()
    ));
    lines.push(end());
    lines.push(array("tTool", "tool", 1));
    lines.push("      <Value key=\"0\" fatherId=\"flange[0]\" />".to_owned());
    lines.push(end());
    lines.extend(["  </Datas>", "</Database>"].map(str::to_owned));
    lines
}

fn code(job: &Job<'_>, name: &str) -> Vec<String> {
    let mut lines = vec!["<?xml version=\"1.0\" encoding=\"utf-8\"?>".to_owned()];
    lines.push("<Programs xmlns=\"http://www.staubli.com/robotics/VAL3/Program/2\">".to_owned());
    lines.push(format!("  <Program name=\"{name}\">"));
    let asks = job.dwell().is_none();
    if asks {
        lines.push("    <Locals xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\">".to_owned());
        lines.push("      <Local name=\"l_nKey\" type=\"num\" xsi:type=\"array\" size=\"1\" />".to_owned());
        lines.push("    </Locals>".to_owned());
    }
    lines.push("    <Code><![CDATA[begin".to_owned());
    lines.extend(job.header(COMMENT_WIDTH).iter().map(|line| format!("  // {line}")));
    if asks {
        lines.push("  userPage()".to_owned());
    }
    for (key, pose) in job.poses.iter().enumerate() {
        let label = Job::label(pose);
        lines.push(format!("  // {label}"));
        lines.push(format!("  movej(jJoints[{key}],tTool,mNomSpeed)"));
        lines.push("  waitEndMove()".to_owned());
        if pose.kind.is_measured() {
            if let Some(dwell) = job.dwell() {
                lines.push(format!("  delay({dwell})"));
            } else {
                lines.push(format!("  putln(\"{label}: measure, then any key\")"));
                lines.push("  l_nKey=get()".to_owned());
            }
        }
    }
    lines.extend(["end]]></Code>", "  </Program>", "</Programs>"].map(str::to_owned));
    lines
}
