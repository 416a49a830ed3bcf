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
pub fn decode_tx(text: &str) -> Result<Vec<Tool>, String> {
    let mut rest = Cursor { rest: text };
    let count = rest.hexadecimal(2)?;
    let mut tools = Vec::new();
    for _ in 0..count {
        tools.push(tx_tool(&mut rest)?);
    }
    rest.hexadecimal(4)?;
    if rest.rest.is_empty() { Ok(tools) } else { Err(format!("{} characters too many", rest.rest.len())) }
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
    let frame = if has_frame { rest.hexadecimal(8).and_then(|_status| rest.hexadecimal(8))? } else { 0 };
    if !word(rest, "\n") {
        return Err(format!("the line of tool {handle:02X} does not end"));
    }
    Ok(Tool { handle, state, frame })
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
pub fn decode_bx(body: &[u8]) -> Result<Vec<Tool>, String> {
    bx_tools(body, true).or_else(|error| bx_tools(body, false).map_err(|_other| error))
}

fn bx_tools(body: &[u8], has_disabled_frame: bool) -> Result<Vec<Tool>, String> {
    let mut rest = body;
    let [count] = take_bytes(&mut rest)?;
    let mut tools = Vec::new();
    for _ in 0..count {
        tools.push(bx_tool(&mut rest, has_disabled_frame)?);
    }
    match rest.len() {
        0 | 2 => Ok(tools),
        more => Err(format!("the length is wrong: {more} bytes too many")),
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
    let frame = if has_frame {
        let _port_status: [u8; 4] = take_bytes(rest)?;
        u32::from_le_bytes(take_bytes(rest)?)
    } else {
        0
    };
    Ok(Tool { handle, state, frame })
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
