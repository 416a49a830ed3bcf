//! Tool positions in `TX` and `BX` replies.

use nalgebra::Point3;
use nalgebra::Quaternion;
use nalgebra::UnitQuaternion;
use nalgebra::Vector3;

use super::super::excerpt::excerpt;

/// Largest deviation of a quaternion's norm from one; `TX` rounds each component to 0.0001.
const NORM_TOLERANCE: f64 = 0.01;

/// One tool in one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Tool {
    /// Port handle of the tool.
    pub handle: u8,
    /// Position, or why there is none.
    pub state: ToolState,
    /// Number of the frame.
    pub frame: u32,
    /// Status bits of the port.
    pub port: u32,
}

/// Tools of one reply.
#[derive(Clone, Debug, PartialEq)]
pub struct Positions {
    /// The tools in the order of the reply.
    pub tools: Vec<Tool>,
    /// Status bits of the instrument; 0 if the reply has none.
    pub system: u16,
}

/// The tool is outside the measurement volume.
const OUT_OF_VOLUME: u32 = 1 << 6;

/// Status bits of a port that concern the quality of its position.
const PORT_FLAGS: [(u32, &str); 5] = [
    (OUT_OF_VOLUME, "the tool is outside the measurement volume"),
    (1 << 7, "the tool is partly outside the measurement volume"),
    (1 << 8, "the position is limited by the algorithm"),
    (1 << 9, "infrared light disturbs the tool"),
    (1 << 12, "the position could not be processed fully"),
];

/// The instrument reports that its hardware has failed.
const HARDWARE_FAILURE: u16 = 1 << 4;

/// Status bits of the instrument that concern the quality of all positions.
const SYSTEM_FLAGS: [(u16, &str); 6] = [
    (1 << 0, "synchronisation error of the instrument"),
    (1 << 1, "too much infrared light around the instrument"),
    (1 << 2, "error in the internal data of the instrument"),
    (1 << 3, "the instrument recovered from an error"),
    (1 << 5, "the hardware of the instrument has changed"),
    (1 << 9, "the instrument is outside its temperature range"),
];

impl Tool {
    /// Whether the tool is outside the measurement volume.
    pub(super) const fn is_out_of_volume(&self) -> bool {
        self.port & OUT_OF_VOLUME != 0
    }

    /// Warnings of its port.
    pub(super) fn flags(&self) -> impl Iterator<Item = &'static str> {
        let port = self.port;
        PORT_FLAGS.into_iter().filter(move |(bit, _)| port & bit != 0).map(|(_, words)| words)
    }
}

impl Positions {
    /// Whether the instrument reports that its hardware has failed.
    pub(super) const fn has_failed(&self) -> bool {
        self.system & HARDWARE_FAILURE != 0
    }

    /// Warnings of the instrument.
    pub(super) fn flags(&self) -> impl Iterator<Item = &'static str> {
        let system = self.system;
        SYSTEM_FLAGS.into_iter().filter(move |(bit, _)| system & bit != 0).map(|(_, words)| words)
    }
}

/// Position of a tool, or why there is none.
#[derive(Clone, Debug, PartialEq)]
pub enum ToolState {
    /// The tool is seen.
    Seen {
        /// Rotation of the tool frame: q0, qx, qy, qz.
        quaternion: [f64; 4],
        /// Origin of the tool frame (m).
        origin: Point3<f64>,
        /// Fit error of the markers (m).
        error: f64,
    },
    /// The tool is not seen.
    Missing,
    /// The port is not enabled.
    Disabled,
    /// The port has no tool.
    Unoccupied,
}

/// A point of the tool in the frame of the instrument (m). Fails if the quaternion is not a rotation.
pub(super) fn tip_in_instrument(
    quaternion: [f64; 4],
    origin: Point3<f64>,
    tip: Vector3<f64>,
) -> Result<Point3<f64>, String> {
    let [w, x, y, z] = quaternion;
    let quaternion = Quaternion::new(w, x, y, z);
    let norm = quaternion.norm();
    if (norm - 1.0).abs() > NORM_TOLERANCE || !norm.is_finite() {
        return Err(format!("the rotation of the tool is invalid (its quaternion has the norm {norm:.3})"));
    }
    let point = origin + UnitQuaternion::from_quaternion(quaternion) * tip;
    if origin.coords.norm_squared() == 0.0 {
        return Err("the tool is exactly at 0, 0, 0".to_owned());
    }
    if !point.coords.iter().all(|value| value.is_finite() && value.abs() < 100.0) {
        return Err("the position of the tool is out of range".to_owned());
    }
    Ok(point)
}

/// Reads the text of a `TX 0001` reply without its CRC.
pub fn decode_tx(text: &str) -> Result<Positions, String> {
    let mut rest = Cursor { rest: text };
    let count = rest.hexadecimal(2)?;
    let mut tools = Vec::new();
    for _ in 0..count {
        tools.push(tx_tool(&mut rest)?);
    }
    let system = u16::try_from(rest.hexadecimal(4)?).unwrap_or_default();
    if rest.rest.is_empty() {
        Ok(Positions { tools, system })
    } else {
        Err(format!("{} characters too many", rest.rest.len()))
    }
}

fn tx_tool(rest: &mut Cursor<'_>) -> Result<Tool, String> {
    let handle = u8::try_from(rest.hexadecimal(2)?).unwrap_or_default();
    let word = |rest: &mut Cursor<'_>, word: &str| {
        let after = rest.rest.strip_prefix(word);
        rest.rest = after.unwrap_or(rest.rest);
        after.is_some()
    };
    let state = if word(rest, "MISSING") {
        ToolState::Missing
    } else if word(rest, "DISABLED") {
        ToolState::Disabled
    } else if word(rest, "UNOCCUPIED") {
        ToolState::Unoccupied
    } else {
        tx_transform(rest)?
    };
    // An empty port has no frame number.
    let has_frame = !rest.rest.starts_with('\n');
    let (port, frame) = if has_frame { (rest.hexadecimal(8)?, rest.hexadecimal(8)?) } else { (0, 0) };
    if !word(rest, "\n") {
        return Err(format!("the line of tool {handle:02X} does not end"));
    }
    Ok(Tool { handle, state, frame, port })
}

fn tx_transform(rest: &mut Cursor<'_>) -> Result<ToolState, String> {
    let mut quaternion = [0.0; 4];
    for part in &mut quaternion {
        *part = rest.signed(6)? * 1e-4;
    }
    let mut origin = Point3::origin();
    for part in origin.coords.iter_mut() {
        *part = rest.signed(7)? * 1e-5;
    }
    let error = rest.signed(6)? * 1e-7;
    Ok(ToolState::Seen { quaternion, origin, error })
}

/// Reads fields of fixed width.
struct Cursor<'text> {
    rest: &'text str,
}

impl<'text> Cursor<'text> {
    fn take(&mut self, width: usize) -> Result<&'text str, String> {
        let (field, rest) = self.rest.split_at_checked(width).ok_or("the reply is too short")?;
        self.rest = rest;
        Ok(field)
    }

    fn hexadecimal(&mut self, width: usize) -> Result<u32, String> {
        let field = self.take(width)?;
        let is_plain = field.bytes().all(|digit| digit.is_ascii_hexdigit());
        let value = u32::from_str_radix(field, 16).ok().filter(|_| is_plain);
        value.ok_or_else(|| format!("`{}` is not hexadecimal", excerpt(field)))
    }

    /// A number with sign and digits.
    fn signed(&mut self, width: usize) -> Result<f64, String> {
        let field = self.take(width)?;
        let is_signed = field.starts_with(['+', '-']);
        let value = field.parse::<i32>().ok().filter(|_| is_signed);
        value.map(f64::from).ok_or_else(|| format!("`{}` is not a signed number", excerpt(field)))
    }
}

/// Reads the body of a `BX 0001` reply.
///
/// Instruments differ in two ways, which the length tells apart: whether a disabled tool has a status and a frame number, and
/// whether the system status follows the tools.
pub fn decode_bx(body: &[u8]) -> Result<Positions, String> {
    bx_tools(body, true).or_else(|error| bx_tools(body, false).map_err(|_other| error))
}

fn bx_tools(body: &[u8], has_disabled_frame: bool) -> Result<Positions, String> {
    let mut rest = body;
    let [count] = take_bytes(&mut rest)?;
    let mut tools = Vec::new();
    for _ in 0..count {
        tools.push(bx_tool(&mut rest, has_disabled_frame)?);
    }
    match *rest {
        [] => Ok(Positions { tools, system: 0 }),
        [low, high] => Ok(Positions { tools, system: u16::from_le_bytes([low, high]) }),
        _ => Err(format!("the length is wrong: {} bytes too many", rest.len())),
    }
}

fn bx_tool(rest: &mut &[u8], has_disabled_frame: bool) -> Result<Tool, String> {
    let [handle, status] = take_bytes(rest)?;
    let state = match status {
        1 => bx_transform(rest)?,
        2 => ToolState::Missing,
        4 => ToolState::Disabled,
        other => return Err(format!("tool {handle:02X} has the unknown status {other}")),
    };
    let has_frame = has_disabled_frame || state != ToolState::Disabled;
    let mut number = || take_bytes(rest).map(u32::from_le_bytes);
    let (port, frame) = if has_frame { (number()?, number()?) } else { (0, 0) };
    Ok(Tool { handle, state, frame, port })
}

fn bx_transform(rest: &mut &[u8]) -> Result<ToolState, String> {
    let mut next = || take_bytes(rest).map(f32::from_le_bytes).map(f64::from);
    let quaternion = [next()?, next()?, next()?, next()?];
    let origin = Point3::new(next()? * 1e-3, next()? * 1e-3, next()? * 1e-3);
    Ok(ToolState::Seen { quaternion, origin, error: next()? * 1e-3 })
}

fn take_bytes<const N: usize>(rest: &mut &[u8]) -> Result<[u8; N], String> {
    let (field, after) = rest.split_first_chunk::<N>().ok_or("the length is wrong: the reply is too short")?;
    *rest = after;
    Ok(*field)
}
