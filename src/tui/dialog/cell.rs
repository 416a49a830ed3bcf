//! The forms of what is not in the list: the cell, and a robot by its data sheet.

use super::ask::number;
use super::{Dialog, Form};
use crate::profile::CellText;
use crate::profile::cell_text::{
    AcceptanceText, INSTRUMENTS, InstrumentText, boxes_as_text, boxes_from_text, limits_as_text, limits_from_text,
};
use crate::profile::datasheet::{Datasheet, Dimension, Maker};
use crate::wizard::Intent;

/// Instruments to pick: those of the list, and whatever the fields below say.
const PICKS: &[&str] = &["as below", "Leica AT", "Vantage", "Radian", "total station 0.5\"", "total station 1\""];
const ACCEPTED_RMS: &str = "accepted RMS (mm)";
const MAKERS: &[&str] = &["abb", "fanuc", "kuka", "staubli"];

/// Asks for everything about the cell, filled in with what is known. Where there is a result, it begins at the acceptance limits.
pub(super) fn cell(known: &CellText, has_result: bool) -> Dialog {
    let text = |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
    let instrument = known.instrument.as_ref();
    let tracker = known.tracker_mm.map_or_else(String::new, |(x, y, z)| format!("{x} {y} {z}"));
    let acceptance = known.acceptance.unwrap_or_default();
    let form =
        Form::new("This cell. Filled in from the last session or the profile", stated)
            .pick("instrument", PICKS, 0, "Left/Right. From the list: half of what the maker allows as the largest error of a point. as below: the two fields that follow, such as those of its certificate.")
            .text("name of it", instrument.map_or("", |one| &one.name), "Maker, type and serial number. Empty: nothing is known about its accuracy.")
            .text("sigma (um)", &text(instrument.map(|one| one.sigma_um)), "Standard deviation of a coordinate, the part that does not depend on the distance.")
            .text("sigma (um/m)", &text(instrument.map(|one| one.sigma_um_per_m)), "The part that grows with the distance.")
            .text("tracker at x y z (mm)", &tracker, "Where it stands, seen from the base of the robot; to about 0.1 m. For lines of sight when poses are chosen.")
            .text("joint limits (deg)", &limits_as_text(&known.planning_limits), "For poses in this cell, narrower than the robot's own: J1 -90..90, J4 -180..180 (sliding joints mm). Empty: those of the profile.")
            .text("boxes (mm)", &boxes_as_text(&known.keep_out), "What the arm must not touch, in the base: a name and two corners, separated by ';': table 300 -500 0 900 500 400; fence ...")
            .text(ACCEPTED_RMS, &text(acceptance.position_rms_mm), "Largest RMS position error on poses that were not used. The moment at which limits are set is kept in the journal.")
            .text("accepted max (mm)", &text(acceptance.position_max_mm), "Largest position error of a single pose. Empty: not limited.");
    Dialog::Form(if has_result { form.starting_at(ACCEPTED_RMS) } else { form })
}

fn stated(values: &[String]) -> Result<Intent, String> {
    let [pick, name, sigma, per_metre, tracker, limits, boxes, rms, max] = values else {
        return Err("nine values are needed".to_owned());
    };
    let optional = |label: &str, text: &String| -> Result<Option<f64>, String> {
        if text.is_empty() { Ok(None) } else { number(label, text).map(Some) }
    };
    let acceptance = AcceptanceText {
        position_rms_mm: optional("accepted RMS", rms)?,
        position_max_mm: optional("accepted max", max)?,
    };
    let cell = CellText {
        instrument: instrument(pick, name, sigma, per_metre)?,
        tracker_mm: place(tracker)?,
        acceptance: (acceptance != AcceptanceText::default()).then_some(acceptance),
        planning_limits: limits_from_text(limits)?,
        keep_out: boxes_from_text(boxes)?,
    };
    Ok(Intent::DescribeCell(Box::new(cell)))
}

fn instrument(pick: &str, name: &str, sigma: &str, per_metre: &str) -> Result<Option<InstrumentText>, String> {
    let listed = PICKS.iter().position(|one| *one == pick).and_then(|at| INSTRUMENTS.get(at.checked_sub(1)?));
    if let Some((name, sigma_um, sigma_um_per_m)) = listed {
        let (sigma_um, sigma_um_per_m) = (*sigma_um, *sigma_um_per_m);
        return Ok(Some(InstrumentText { name: (*name).to_owned(), sigma_um, sigma_um_per_m }));
    }
    if name.is_empty() && sigma.is_empty() {
        return Ok(None);
    }
    let sigma_um = number("sigma (um)", sigma)?;
    let sigma_um_per_m = if per_metre.is_empty() { 0.0 } else { number("sigma (um/m)", per_metre)? };
    let name = if name.is_empty() { "instrument" } else { name };
    Ok(Some(InstrumentText { name: name.to_owned(), sigma_um, sigma_um_per_m }))
}

pub(super) fn place(text: &str) -> Result<Option<(f64, f64, f64)>, String> {
    let words: Vec<&str> = text.split([' ', ';']).filter(|word| !word.is_empty()).collect();
    match words.as_slice() {
        [] => Ok(None),
        [x, y, z] => Ok(Some((number("tracker x", x)?, number("tracker y", y)?, number("tracker z", z)?))),
        _ => Err(format!("the place of the tracker needs three numbers, not '{text}'")),
    }
}

/// Asks for the seven dimensions of a data sheet.
pub(super) fn data_sheet(known: &Datasheet) -> Dialog {
    let maker = Maker::ALL.iter().position(|maker| *maker == known.maker).unwrap_or(0);
    let mut form = Form::new("A robot with six axes, from the drawing in its data sheet", sheet)
        .text("name", &known.name, "Maker and type, for the report.")
        .pick("counts like", MAKERS, maker, "Left/Right. abb: zero with the upper arm up and the forearm forward; fanuc: the same, J3 is the slope of the forearm; kuka: zero stretched forward; staubli: zero straight up.");
    for dimension in Dimension::ALL {
        let value = known.dimension(dimension);
        let shown = if value == 0.0 { String::new() } else { value.to_string() };
        form = form.text(dimension.label(), &shown, dimension.about());
    }
    let limits = if known.name.is_empty() { String::new() } else { known.limits_deg.to_string() };
    Dialog::Form(form.text(
        "limits (deg)",
        &limits,
        "Of the six joints: 165 is -165 to 165, so: 165, -110..110, -110..70, 160, 120, 400",
    ))
}

fn sheet(values: &[String]) -> Result<Intent, String> {
    let [name, maker, dimensions @ .., limits] = values else { return Err("ten values are needed".to_owned()) };
    let mut dimensions_mm = [0.0; 7];
    for ((dimension, text), place) in Dimension::ALL.into_iter().zip(dimensions).zip(&mut dimensions_mm) {
        if !text.is_empty() {
            *place = number(dimension.label(), text)?;
        }
    }
    let maker = maker.parse::<Maker>().map_err(|error| error.to_string())?;
    let limits_deg = limits.parse().map_err(|error: crate::profile::datasheet::DatasheetError| error.to_string())?;
    let sheet = Datasheet { name: name.clone(), maker, dimensions_mm, limits_deg };
    sheet.profile().map_err(|error| error.to_string())?;
    Ok(Intent::DescribeRobot(Box::new(sheet)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(texts: &[&str]) -> Vec<String> {
        texts.iter().map(|text| (*text).to_owned()).collect()
    }

    #[test]
    fn the_form_of_a_cell_gives_back_what_it_shows() {
        let known = CellText {
            instrument: Some(InstrumentText { name: "AT960 17".to_owned(), sigma_um: 7.5, sigma_um_per_m: 3.0 }),
            tracker_mm: Some((2500.0, -10.0, 900.5)),
            acceptance: Some(AcceptanceText { position_rms_mm: Some(0.3), position_max_mm: None }),
            planning_limits: limits_from_text("J1 -90..90, J4 -170..170").unwrap(),
            keep_out: boxes_from_text("table 300 -500 0 900 500 400").unwrap(),
        };
        let Dialog::Form(form) = cell(&known, false) else { panic!() };
        assert_eq!(form.value(), Ok(Intent::DescribeCell(Box::new(known))));
        let Dialog::Form(mut form) = cell(&CellText::default(), true) else { panic!() };
        assert_eq!(form.value(), Ok(Intent::DescribeCell(Box::default())));
        // With a result, the limits come first.
        form.paste("0.3");
        let limits = AcceptanceText { position_rms_mm: Some(0.3), position_max_mm: None };
        let cell = CellText { acceptance: Some(limits), ..CellText::default() };
        assert_eq!(form.value(), Ok(Intent::DescribeCell(Box::new(cell))));
    }

    #[test]
    fn an_instrument_is_picked_or_typed() {
        let read = |texts: [&str; 9]| match stated(&values(&texts)) {
            Ok(Intent::DescribeCell(cell)) => Ok(cell.instrument),
            Ok(other) => panic!("{other:?}"),
            Err(error) => Err(error),
        };
        let picked = read(["Vantage", "x", "1", "2", "", "", "", "", ""]).unwrap().unwrap();
        assert_eq!((picked.name.as_str(), picked.sigma_um), ("FARO Vantage", 10.0));
        let typed = read(["as below", "", "12,5", "", "", "", "", "", ""]).unwrap().unwrap();
        assert_eq!((typed.sigma_um, typed.sigma_um_per_m), (12.5, 0.0));
        for (texts, part) in [
            (["as below", "x", "", "", "", "", "", "", ""], "sigma"),
            (["as below", "", "", "", "1 2", "", "", "", ""], "three numbers"),
            (["as below", "", "", "", "", "J1", "", "", ""], "no limit"),
            (["as below", "", "", "", "", "", "table", "", ""], "no box"),
            (["as below", "", "", "", "", "", "", "x", ""], "not a number"),
        ] {
            let error = read(texts).unwrap_err();
            assert!(error.contains(part), "{error}");
        }
        assert_eq!(PICKS.len(), INSTRUMENTS.len() + 1);
    }

    #[test]
    fn a_data_sheet_is_checked_while_it_is_typed() {
        let typed = ["My arm", "abb", "290", "", "270", "70", "302", "72", "", "165 -110..110 -110..70 160 120 400"];
        let Ok(Intent::DescribeRobot(sheet)) = sheet(&values(&typed)) else { panic!() };
        assert_eq!(sheet.flange_at_zero(), Ok([374.0, 0.0, 630.0]));
        let Dialog::Form(form) = data_sheet(&sheet) else { panic!() };
        assert_eq!(form.value(), Ok(Intent::DescribeRobot(sheet)));
        let Dialog::Form(empty) = data_sheet(&Datasheet::default()) else { panic!() };
        assert!(empty.value().is_err());
    }
}
