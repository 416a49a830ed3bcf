//! The forms of the screens: coordinates, a known target, a simulated cell, recorded measurements, and the details of the report.

use super::{Dialog, Form};
use crate::session::about::{About, Detail};
use crate::session::filter::Filter;
use crate::session::measurements::Layout;
use crate::session::plan::PoseKind;
use crate::session::set_up::{CoordinateUnit, InstrumentChoice, PayloadText, RecordedSet, TargetChoice};
use crate::session::simulation::{Fault, Simulation, Truth};
use crate::session::wire::{LinkChoice, WireAddress};
use crate::tui::form::{TextField, Validator};
use crate::units::{from_mm, to_mm};
use crate::wizard::view::{Content, ViewModel};
use crate::wizard::{Intent, reading};

/// Words for [`Truth`], in the order of [`TRUTHS`].
const TRUTH_WORDS: &[&str] = &["random", "paper", "nominal"];
const TRUTHS: [Truth; 3] = [Truth::Drawn, Truth::Paper, Truth::Nominal];

/// Asks for the coordinates of a reading, starting with the text typed or pasted so far. They are checked while they are typed.
pub fn coordinates(view: &ViewModel, begun: &str) -> Dialog {
    let (unit, place) = match &view.content {
        Content::Capture(content) => {
            let pose = content.finding.as_ref().map(|finding| finding.pose.as_str()).or(content.pose.as_deref());
            (content.typed_unit.as_deref(), pose.map_or_else(String::new, |pose| format!(" at pose {pose}")))
        }
        Content::Target(content) => match (&content.joint_check, &content.circles) {
            (Some(check), _) if !check.joints.is_empty() => {
                let place = check.joint.as_ref().map_or_else(String::new, |joint| format!(" with {joint} moved"));
                (check.typed_unit.as_deref(), place)
            }
            (_, circles) => {
                let joint = circles.as_ref().and_then(|circles| circles.joint.as_deref());
                let place = joint.map_or_else(String::new, |joint| format!(" on the circle of {joint}"));
                (circles.as_ref().and_then(|circles| circles.typed_unit.as_deref()), place)
            }
        },
        _ => (None, String::new()),
    };
    let unit = CoordinateUnit::ALL.into_iter().find(|one| Some(one.sign()) == unit).unwrap_or_default();
    let label = format!("Coordinates x y z of the SMR{place} ({})", unit.sign());
    let field = if begun.is_empty() {
        // The last text, selected: typing replaces it, moving the cursor corrects it.
        TextField::new(label, &questioned(view, unit)).proposed()
    } else {
        TextField::new(label, begun)
    };
    Dialog::Text { field: field.checked(validator(unit)), intent: Intent::TypeReading }
}

/// The coordinates of the point in question, in the unit that is typed.
fn questioned(view: &ViewModel, unit: CoordinateUnit) -> String {
    let Content::Capture(content) = &view.content else { return String::new() };
    match (&content.finding, &content.last) {
        (Some(finding), Some(last)) if finding.measurement == last.measurement => {
            let [x, y, z] = last.xyz_mm.map(|value| from_mm(value) / unit.size());
            format!("{x:.6} {y:.6} {z:.6}")
        }
        _ => String::new(),
    }
}

/// The validator of coordinates in a unit.
fn validator(unit: CoordinateUnit) -> Validator {
    match unit {
        CoordinateUnit::Millimetre => |text| understood(text, CoordinateUnit::Millimetre),
        CoordinateUnit::Metre => |text| understood(text, CoordinateUnit::Metre),
        CoordinateUnit::Inch => |text| understood(text, CoordinateUnit::Inch),
        CoordinateUnit::Micrometre => |text| understood(text, CoordinateUnit::Micrometre),
    }
}

/// The coordinates as they are understood.
fn understood(text: &str, unit: CoordinateUnit) -> Result<String, String> {
    reading::check(text, unit)?;
    let point = reading::parse(text, unit)?;
    let [x, y, z] = [point.x, point.y, point.z].map(to_mm);
    Ok(format!("x {x:.3}  y {y:.3}  z {z:.3} mm"))
}

/// Asks for known coordinates of the SMR.
pub fn known_target(nominal_mm: [f64; 3]) -> Dialog {
    let [x, y, z] = nominal_mm.map(|value| format!("{value:.3}"));
    Dialog::Form(
        Form::new("Centre of the SMR in the flange frame", known)
            .text("x (mm)", &x, "Measured on the flange adapter, for example with a CMM, to the centre of the SMR.")
            .text("y (mm)", &y, "Along the y axis of the flange as the profile defines it.")
            .text("z (mm)", &z, "Along the flange axis, away from the arm.")
            .text("sigma (mm)", "0.1", "Standard deviation of each coordinate. 0: exact, so it is not identified."),
    )
}

fn known(values: &[String]) -> Result<Intent, String> {
    let [x, y, z, sigma] = values else { return Err("four numbers are needed".to_owned()) };
    let sigma_mm = number("sigma", sigma)?;
    if sigma_mm < 0.0 {
        return Err("sigma cannot be negative".to_owned());
    }
    let xyz_mm = (number("x", x)?, number("y", y)?, number("z", z)?);
    Ok(Intent::ChooseTarget(TargetChoice::Known { xyz_mm, sigma_mm }))
}

/// Asks for the payload, starting with the one stated so far.
pub fn payload(stated: &PayloadText) -> Dialog {
    let (x, y, z) = stated.centre_mm;
    Dialog::Form(
        Form::new("What the flange carries while it is measured, besides the SMR", carried)
            .text("mass (kg)", &stated.mass_kg.to_string(), "Tool and workpiece together. 0: nothing.")
            .text("x (mm)", &x.to_string(), "Centre of mass in the flange frame.")
            .text("y (mm)", &y.to_string(), "Along the y axis of the flange as the profile defines it.")
            .text("z (mm)", &z.to_string(), "Along the flange axis, away from the arm."),
    )
}

fn carried(values: &[String]) -> Result<Intent, String> {
    let [mass, x, y, z] = values else { return Err("four numbers are needed".to_owned()) };
    let centre_mm = (number("x", x)?, number("y", y)?, number("z", z)?);
    let payload = PayloadText { mass_kg: number("mass", mass)?, centre_mm };
    if payload.is_usable() {
        Ok(Intent::StatePayload(payload))
    } else {
        Err(format!("the mass is from 0 to {} kg, the centre within 10 m of the flange", PayloadText::HEAVIEST))
    }
}

/// Asks for an instrument on a wire, starting with the link of the profile.
pub fn linked(proposal: Option<&LinkChoice>) -> Dialog {
    let proposed = proposal.cloned().unwrap_or_default();
    Dialog::Form(
        Form::new("An instrument on the network or a serial port", link)
            .text(
                "instrument",
                &proposed.address,
                "emscon:HOST, geocom:serial:/dev/ttyUSB0:9600, ndi:HOST, ascii:tcp:HOST:PORT, ascii:listen:0.0.0.0:5000",
            )
            .text(
                "options",
                &proposed.options.unwrap_or_default(),
                "Empty: defaults. For ascii a preset such as xyz or bridge; otherwise as in (measure_ms: 2000).",
            )
            .text("robot", &proposed.robot.unwrap_or_default(), "rtde:HOST, abb:HOST, kuka:HOST, fanuc:HOST, yaskawa:HOST or ascii:tcp:HOST:PORT, if the robot controller reports its joint angles. Empty: it does not.")
            .text(
                "robot options",
                &proposed.robot_options.unwrap_or_default(),
                "Usually empty. Yaskawa: (pulses_per_degree: [1000.0, ...]) unless the profile of the robot states them.",
            )
            .pick(
                "automatic measuring",
                &["no", "yes"],
                usize::from(proposed.is_automatic),
                "Left/Right. yes: as soon as the SMR has been at rest for 2 s near its predicted position.",
            ),
    )
}

fn link(values: &[String]) -> Result<Intent, String> {
    let [address, options, robot, robot_options, automatic] = values else {
        return Err("five values are needed".to_owned());
    };
    let parsed: WireAddress = address.parse()?;
    if parsed.protocol.is_robot() {
        return Err(format!("{} is a robot: enter it below", parsed.protocol));
    }
    let some = |text: &String| (!text.trim().is_empty()).then(|| text.trim().to_owned());
    let robot = some(robot);
    if let Some(robot) = &robot {
        WireAddress::of_robot(robot)?;
    }
    let is_automatic = automatic == "yes";
    let robot_options = some(robot_options).filter(|_| robot.is_some());
    let choice = LinkChoice { address: parsed.to_string(), options: some(options), robot, robot_options, is_automatic };
    Ok(Intent::ChooseInstrument(InstrumentChoice::Linked(choice)))
}

/// Asks for a simulated cell.
pub fn simulated(is_paper: bool) -> Dialog {
    let truth = usize::from(is_paper);
    Dialog::Form(
        Form::new("Simulated cell, for rehearsing", simulation)
            .text("seed", "1", "The same seed gives the same errors and noise again.")
            .pick("hidden errors of the arm", TRUTH_WORDS, truth, "Left/Right. random: drawn by seed; paper: table II of the method paper (only its own arm); nominal: none.")
            .text("noise (mm)", "", "Standard deviation of a coordinate. Empty: that of the profile's instrument.")
            .text("errors of joints", "", "Beyond the geometry (urad): curves=100,compliance=500,tilt=100,harmonics=50. Empty: none.")
            .text("faults", "", "What goes wrong, separated by commas: wrong-pose@12, outlier@9:3mm, target-bumped@20:5mm, beam-break@7-9. Empty: nothing."),
    )
}

fn simulation(values: &[String]) -> Result<Intent, String> {
    let [seed, truth, noise, joints, faults] = values else { return Err("five values are needed".to_owned()) };
    let seed = seed.parse().ok().ok_or_else(|| format!("'{seed}' is not a whole number"))?;
    let truth = TRUTH_WORDS.iter().zip(TRUTHS).find(|(word, _)| *word == truth).map_or(Truth::Drawn, |(_, one)| one);
    let noise_mm = if noise.is_empty() { None } else { Some(number("noise", noise)?) };
    if noise_mm.is_some_and(|noise| !(0.0..=100.0).contains(&noise)) {
        return Err("noise must be from 0 to 100 mm".to_owned());
    }
    let joint_errors = if joints.is_empty() { None } else { Some(joints.parse()?) };
    let faults = faults.split([',', ';']).map(str::trim).filter(|text| !text.is_empty());
    let faults =
        faults.map(|text| text.parse::<Fault>().map_err(|error| error.to_string())).collect::<Result<_, _>>()?;
    Ok(Intent::ChooseInstrument(InstrumentChoice::Simulated(Simulation {
        seed,
        truth,
        joint_errors,
        noise_mm,
        faults,
        ..Simulation::default()
    })))
}

/// Asks for tables of recorded measurements.
pub fn recorded() -> Dialog {
    let rows = "A condition on the columns, such as: pose % 5 != 0. Empty: all rows.";
    Dialog::Form(
        Form::new("Recorded measurements, played back as if they were captured now", replay)
            .text(
                "table to identify from",
                "",
                "Path of a CSV file with joint values and measured points, units in its header.",
            )
            .path()
            .text("rows to use", "", rows)
            .text("table to verify with", "", "Path; it may be the same file with other rows. Empty: no verification.")
            .path()
            .text("rows to use", "", rows)
            .pick(
                "layout",
                Layout::NAMES,
                0,
                "Left/Right. named: header with names and units; robodk, delmia: exported by those programs.",
            ),
    )
}

fn replay(values: &[String]) -> Result<Intent, String> {
    let [first, first_rows, second, second_rows, layout] = values else {
        return Err("five values are needed".to_owned());
    };
    if first.is_empty() {
        return Err("enter the table to identify from".to_owned());
    }
    if second.is_empty() && !second_rows.is_empty() {
        return Err("there are rows to verify with, but no table".to_owned());
    }
    let mut sets = vec![set(first, first_rows, layout, PoseKind::Identification)?];
    if !second.is_empty() {
        sets.push(set(second, second_rows, layout, PoseKind::Verification)?);
    }
    Ok(Intent::ChooseInstrument(InstrumentChoice::Replay { sets }))
}

fn set(file: &str, rows: &str, layout: &str, kind: PoseKind) -> Result<RecordedSet, String> {
    let rows = match rows {
        "" => None,
        rows => Some(Filter::parse(rows).map(|_| rows.to_owned()).map_err(|error| first_line(&error.to_string()))?),
    };
    Ok(RecordedSet { file: file.to_owned(), kind, rows, layout: layout.to_owned() })
}

/// An error without the lines that point at its position.
fn first_line(text: &str) -> String {
    text.lines().next().unwrap_or_default().to_owned()
}

/// What is asked for the report, each with its help.
const ASKED: [(Detail, &str); 13] = [
    (Detail::Serial, "Of the arm, from its type plate: the result belongs to this arm only."),
    (Detail::Operator, "The person who measured."),
    (Detail::Site, "Hall, cell: whatever a later reader must know."),
    (Detail::Controller, "Type, serial number and software version."),
    (Detail::Options, "Options such as absolute accuracy, and whether they were on while measuring."),
    (Detail::Speed, "Speed between the poses, and the wait before each reading."),
    (Detail::WarmUp, "How long the arm moved before the first reading."),
    (Detail::InstrumentSerial, "From its type plate."),
    (Detail::Certificate, "Number of the calibration certificate, and the laboratory."),
    (Detail::CertificateDue, "The last day on which it is valid, such as 2027-03-31."),
    (Detail::FieldCheck, "What was checked on the instrument today, and the result."),
    (Detail::Smr, "Type, serial number and radius."),
    (Detail::Weather, "What the instrument corrects for: temperature, pressure, humidity."),
];

/// Asks for the details of the report that only people know.
pub fn about(about: &About) -> Dialog {
    let form = Form::new("For the report: details that only you know. All are optional.", said);
    let ask =
        |form: Form, (detail, help): &(Detail, &'static str)| form.text(detail.label(), &about.text(*detail), help);
    Dialog::Form(ASKED.iter().fold(form, ask))
}

fn said(values: &[String]) -> Result<Intent, String> {
    let mut about = About::default();
    for ((detail, _), text) in ASKED.iter().zip(values) {
        about.set(*detail, text).map_err(|error| error.to_string())?;
    }
    Ok(Intent::About(Box::new(about)))
}

/// Parses a number, with a decimal point or comma.
pub(super) fn number(name: &str, text: &str) -> Result<f64, String> {
    let value = text.replace(',', ".").parse::<f64>().ok().filter(|value| value.is_finite());
    value.ok_or_else(|| format!("{name}: '{text}' is not a number"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(texts: &[&str]) -> Vec<String> {
        texts.iter().map(|text| (*text).to_owned()).collect()
    }

    #[test]
    fn a_known_target_needs_four_numbers() {
        let target = TargetChoice::Known { xyz_mm: (1.5, -2.0, 70.0), sigma_mm: 0.0 };
        assert_eq!(known(&values(&["1,5", "-2", "70", "0"])), Ok(Intent::ChooseTarget(target)));
        assert_eq!(known(&values(&["1", "x", "70", "0"])), Err("y: 'x' is not a number".to_owned()));
        assert_eq!(known(&values(&["1", "2", "70", "-1"])), Err("sigma cannot be negative".to_owned()));
    }

    #[test]
    fn what_the_profile_says_about_the_link_stands_in_the_form() {
        let choice = LinkChoice {
            address: "emscon:tcp:192.168.0.2:700".to_owned(),
            options: Some("(measure_ms: 2000)".to_owned()),
            robot: None,
            robot_options: None,
            is_automatic: true,
        };
        let Dialog::Form(form) = linked(Some(&choice)) else { panic!() };
        assert_eq!(form.value(), Ok(Intent::ChooseInstrument(InstrumentChoice::Linked(choice))));
    }

    #[test]
    fn addresses_are_checked_where_they_are_typed() {
        let choice = LinkChoice {
            address: "emscon:tcp:192.168.0.2:700".to_owned(),
            options: Some("(measure_ms: 2000)".to_owned()),
            robot: Some("rtde:10.0.0.1".to_owned()),
            robot_options: None,
            is_automatic: true,
        };
        let typed = values(&["emscon:192.168.0.2", " (measure_ms: 2000) ", "rtde:10.0.0.1", "", "yes"]);
        assert_eq!(link(&typed), Ok(Intent::ChooseInstrument(InstrumentChoice::Linked(choice))));
        for (texts, part) in [
            (["192.168.0.2", "", "", "", "no"], "address"),
            (["rtde:10.0.0.1", "", "", "", "no"], "is a robot"),
            (["emscon:a", "", "emscon:b", "", "no"], "is not a robot controller"),
        ] {
            let error = link(&values(&texts)).unwrap_err();
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn faults_and_errors_of_joints_are_checked() {
        let cell = simulation(&values(&["7", "paper", "", "", "wrong-pose@12, outlier@9:3mm"])).unwrap();
        let Intent::ChooseInstrument(InstrumentChoice::Simulated(cell)) = cell else { panic!("{cell:?}") };
        assert_eq!((cell.seed, cell.truth, cell.noise_mm, cell.faults.len()), (7, Truth::Paper, None, 2));
        assert!(simulation(&values(&["7", "paper", "", "", "earthquake@3"])).is_err());
        assert!(simulation(&values(&["x", "paper", "", "", ""])).is_err());
        let cell = simulation(&values(&["7", "random", "", "curves=100, tilt=20", ""])).unwrap();
        let Intent::ChooseInstrument(InstrumentChoice::Simulated(cell)) = cell else { panic!("{cell:?}") };
        let sizes = cell.joint_errors.unwrap().named().map(|(_, size)| size);
        assert!(sizes.iter().sum::<f64>() > 119.0 && sizes.iter().sum::<f64>() < 121.0, "{sizes:?}");
        for wrong in ["curves", "curves=x", "gears=1", "100"] {
            assert!(simulation(&values(&["7", "random", "", wrong, ""])).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_payload_needs_plausible_numbers() {
        let payload = PayloadText { mass_kg: 2.5, centre_mm: (0.0, -10.0, 60.0) };
        assert_eq!(carried(&values(&["2,5", "0", "-10", "60"])), Ok(Intent::StatePayload(payload)));
        for wrong in [["-1", "0", "0", "0"], ["2", "0", "0", "20000"], ["a", "0", "0", "0"]] {
            assert!(carried(&values(&wrong)).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn what_the_report_is_about_may_be_empty_but_not_endless() {
        let given = About { serial: "R-17".to_owned(), ..About::default() };
        assert_eq!(said(&values(&["R-17", "", ""])), Ok(Intent::About(Box::new(given))));
        let long = "x".repeat(201);
        let refused = Err("place and conditions: at most 200 characters".to_owned());
        assert_eq!(said(&values(&["", "", &long])), refused);
    }

    #[test]
    fn every_detail_is_asked_once() {
        let mut details: Vec<&str> = ASKED.iter().map(|(detail, _)| detail.name()).collect();
        let mut known = Detail::NAMES.to_vec();
        details.sort_unstable();
        known.sort_unstable();
        assert_eq!(details, known);
        let widest = ASKED.iter().map(|(detail, _)| detail.label().chars().count()).max();
        assert!(widest < Some(24), "a label runs into its field");
    }

    #[test]
    fn recorded_tables_have_their_use() {
        let Ok(Intent::ChooseInstrument(InstrumentChoice::Replay { sets })) =
            replay(&values(&["a.csv", "pose % 5 != 0", "a.csv", "pose % 5 == 0", "named"]))
        else {
            panic!()
        };
        assert_eq!(
            sets.iter().map(|set| set.kind).collect::<Vec<_>>(),
            [PoseKind::Identification, PoseKind::Verification]
        );
        assert!(replay(&values(&["", "", "", "", "named"])).is_err());
        assert!(replay(&values(&["a.csv", "pose %%", "", "", "named"])).is_err());
    }
}
