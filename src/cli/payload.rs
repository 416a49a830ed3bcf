//! Options of the payload.

use clap::Args;

use crate::session::set_up::PayloadText;

/// The payload, where it is not that of the profile or of the calibration.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct PayloadArgs {
    /// Mass that the flange carries besides the SMR [default: as in the profile or the calibration]
    #[arg(long, value_name = "KG", value_parser = mass, requires = "payload_centre_mm")]
    pub payload_kg: Option<f64>,
    /// Centre of that mass in the flange frame, such as '0,0,60'
    #[arg(long, value_name = "X,Y,Z", value_parser = centre, requires = "payload_kg", allow_hyphen_values = true)]
    pub payload_centre_mm: Option<(f64, f64, f64)>,
}

impl PayloadArgs {
    /// The stated payload.
    pub fn text(&self) -> Option<PayloadText> {
        Some(PayloadText { mass_kg: self.payload_kg?, centre_mm: self.payload_centre_mm? })
    }
}

fn mass(text: &str) -> Result<f64, String> {
    let heaviest = PayloadText::HEAVIEST;
    match text.parse::<f64>() {
        Ok(value) if (0.0..=heaviest).contains(&value) => Ok(value),
        _ => Err(format!("'{text}' is not a mass from 0 to {heaviest} kg")),
    }
}

fn centre(text: &str) -> Result<(f64, f64, f64), String> {
    let wrong = || format!("'{text}' is not a point within 10 m of the flange; write for example '0,0,60' (mm, x,y,z)");
    let numbers: Vec<f64> =
        text.split(',').map(|number| number.trim().parse()).collect::<Result<_, _>>().map_err(|_not_one| wrong())?;
    match numbers[..] {
        [x, y, z] if (PayloadText { mass_kg: 0.0, centre_mm: (x, y, z) }).is_usable() => Ok((x, y, z)),
        _ => Err(wrong()),
    }
}
