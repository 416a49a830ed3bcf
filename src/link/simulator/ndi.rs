//! A simulated tracker with the combined API of NDI and one tool.

use std::time::Duration;

use nalgebra::UnitQuaternion;
use nalgebra::Vector3;

use super::Output;
use super::PointSource;
use super::Simulator;
use super::fault::{FaultPlan, Planned, faults};
use super::schedule::{Schedule, halves};
use crate::link::protocol::Moment;
use crate::link::protocol::ndi::Frame;
use crate::link::protocol::ndi::FrameDecoder;
use crate::link::protocol::ndi::encode_binary;
use crate::link::protocol::ndi::encode_text;

const FRAMES_PER_SECOND: f64 = 60.0;

/// Time from a command to its reply.
const ANSWERING: Duration = Duration::from_millis(4);

/// Delay of a late reply, longer than the driver waits.
const LATE: Duration = Duration::from_millis(2500);

/// Fit error of the markers (mm).
const FIT_MM: f64 = 0.025;

/// Port handle of the tool.
const HANDLE: u8 = 0x0A;

faults! {
    /// A fault of the simulated tracker. Its occasion is a position unless the description says otherwise.
    pub NdiFault {
        BadCrc "bad-crc" "The reply has a wrong CRC.",
        Missing "missing" "The tool is not seen.",
        Disabled "disabled" "The port of the tool is disabled.",
        WrongMode "wrong-mode" "`ERROR0C`: wrong mode.",
        CommandDamaged "command-damaged" "`ERROR04`: the command arrived damaged.",
        CommandTimeout "command-timeout" "`ERROR05`: the command took too long.",
        LateReply "late-reply" "The reply arrives after the driver gave up.",
        Halves "halves" "The packet in two halves with a pause between them.",
        Cut "cut" "Half the packet; the rest is lost.",
        WrongLength "wrong-length" "The header states another length; its CRC is right.",
        WrongBody "wrong-body" "The body has the wrong length for its tools; its CRCs are right.",
        FrozenFrame "frozen-frame" "The frame number stops advancing.",
        NotANumber "not-a-number" "A position that is not a number.",
        NoRotation "no-rotation" "An invalid rotation.",
        Origin "origin" "0, 0, 0.",
        Silent "silent" "No reply.",
        Reset "reset" "`RESET`, as after switching off and on.",
        DisconnectMidPacket "disconnect-mid-packet" "The connection is closed in the middle of the reply.",
        InitialisationFails "initialisation-fails" "`INIT` fails. Occasion: `INIT`.",
    }
}

/// Pose of the tool in one frame.
#[derive(Clone, Copy, Debug)]
struct Pose {
    quaternion: [f64; 4],
    /// Origin of the tool (mm).
    origin_mm: [f64; 3],
}

/// A simulated tracker that measures the tip of a tool.
#[derive(Debug)]
pub struct NdiSimulator {
    faults: FaultPlan<NdiFault>,
    tip: Vector3<f64>,
    rotation: UnitQuaternion<f64>,
    decoder: FrameDecoder,
    is_initialised: bool,
    is_enabled: bool,
    is_tracking: bool,
    /// The last requested frame, with the pose of the tool in it.
    last: Option<(u32, Option<Pose>)>,
    schedule: Schedule,
}

impl NdiSimulator {
    /// A tracker whose source gives the points of the tool's tip, at `tip_mm` in the frame of the tool (mm).
    pub fn new(tip_mm: [f64; 3], faults: impl IntoIterator<Item = Planned<NdiFault>>) -> Self {
        Self {
            faults: FaultPlan::new(faults),
            tip: Vector3::from(tip_mm) * 1e-3,
            rotation: UnitQuaternion::from_euler_angles(0.4, -0.7, 1.1),
            decoder: FrameDecoder::default(),
            is_initialised: false,
            is_enabled: false,
            is_tracking: false,
            last: None,
            schedule: Schedule::default(),
        }
    }

    /// Bytes of an incomplete command.
    pub const fn pending(&self) -> usize {
        self.decoder.pending()
    }

    fn command(&mut self, command: &str, source: &mut dyn PointSource, now: Moment) {
        let reply = match command {
            "INIT:" => self.initialise(),
            // The only reply that clients do not parse, so it marks the tracker as simulated.
            "APIREV:" => "G.003.001 SIMULATED".to_owned(),
            "PHSR:02" if !self.is_initialised => format!("01{HANDLE:02X}001"),
            "PHSR:03" if self.is_initialised && !self.is_enabled => format!("01{HANDLE:02X}011"),
            "PHSR:02" | "PHSR:03" => "00".to_owned(),
            "PINIT:0A" => {
                self.is_initialised = true;
                "OKAY".to_owned()
            }
            "PENA:0AD" if self.is_initialised => {
                self.is_enabled = true;
                "OKAY".to_owned()
            }
            "PENA:0AD" => "ERROR0E".to_owned(),
            "TSTART:" => {
                self.is_tracking = true;
                "OKAY".to_owned()
            }
            "TSTOP:" => {
                self.is_tracking = false;
                "OKAY".to_owned()
            }
            "TX:0001" | "BX:0001" if self.is_tracking => return self.position(command == "BX:0001", source, now),
            "TX:0001" | "BX:0001" => "ERROR0C".to_owned(),
            _ => "ERROR01".to_owned(),
        };
        self.schedule.send(now + ANSWERING, encode_text(&reply));
    }

    fn initialise(&mut self) -> String {
        self.is_initialised = false;
        self.is_enabled = false;
        self.is_tracking = false;
        match self.faults.occasion(|fault| fault == NdiFault::InitialisationFails) {
            Some(_) => "ERROR15".to_owned(),
            None => "OKAY".to_owned(),
        }
    }

    /// Replies with the pose of the tool in the frame at this time.
    fn position(&mut self, is_binary: bool, source: &mut dyn PointSource, now: Moment) {
        let fault = self.faults.occasion(|fault| fault != NdiFault::InitialisationFails);
        let frame = match (fault, self.last) {
            (Some(NdiFault::FrozenFrame), Some((frame, _))) => frame,
            _ => frame_at(now),
        };
        let pose = match self.last {
            Some((last, pose)) if last == frame => pose,
            _ => self.observe(source),
        };
        self.last = Some((frame, pose));
        let pose = pose.filter(|_| fault != Some(NdiFault::Missing)).map(|pose| with_fault(pose, fault));
        let bytes =
            if is_binary { binary_reply(pose, frame, fault) } else { encode_text(&text_reply(pose, frame, fault)) };
        self.reply(bytes, fault, now + ANSWERING);
    }

    fn observe(&self, source: &mut dyn PointSource) -> Option<Pose> {
        let point = source.shot()?.point;
        let origin = (point - self.rotation * self.tip) * 1e3;
        let q = self.rotation;
        Some(Pose { quaternion: [q.w, q.i, q.j, q.k], origin_mm: [origin.x, origin.y, origin.z] })
    }

    fn reply(&mut self, bytes: Vec<u8>, fault: Option<NdiFault>, at: Moment) {
        match fault {
            Some(NdiFault::Silent) => {}
            Some(NdiFault::BadCrc) => self.schedule.send(at, with_bad_crc(bytes)),
            Some(NdiFault::WrongMode) => self.schedule.send(at, encode_text("ERROR0C")),
            Some(NdiFault::CommandDamaged) => self.schedule.send(at, encode_text("ERROR04")),
            Some(NdiFault::CommandTimeout) => self.schedule.send(at, encode_text("ERROR05")),
            Some(NdiFault::LateReply) => self.schedule.send(at + LATE, bytes),
            Some(NdiFault::Halves) => self.schedule.send_halves(at, &bytes),
            Some(NdiFault::Cut) => self.schedule.send(at, halves(&bytes).0.to_vec()),
            Some(NdiFault::Reset) => self.schedule.send(at, encode_text("RESET")),
            Some(NdiFault::DisconnectMidPacket) => self.schedule.break_off(at, &bytes),
            _ => self.schedule.send(at, bytes),
        }
    }
}

/// Number of the frame at a time.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the cast saturates, and times are not negative"
)]
fn frame_at(now: Moment) -> u32 {
    (now.as_secs_f64() * FRAMES_PER_SECOND) as u32
}

fn with_fault(mut pose: Pose, fault: Option<NdiFault>) -> Pose {
    match fault {
        Some(NdiFault::NotANumber) => pose.origin_mm = [f64::NAN; 3],
        Some(NdiFault::NoRotation) => pose.quaternion = [0.1; 4],
        Some(NdiFault::Origin) => pose.origin_mm = [0.0; 3],
        _ => {}
    }
    pose
}

fn with_bad_crc(mut bytes: Vec<u8>) -> Vec<u8> {
    // The last byte of a text is CR; the one before belongs to the CRC in both formats.
    let at = bytes.len().saturating_sub(2);
    if let Some(byte) = bytes.get_mut(at) {
        *byte = if *byte == b'0' { b'1' } else { b'0' };
    }
    bytes
}

fn text_reply(pose: Option<Pose>, frame: u32, fault: Option<NdiFault>) -> String {
    let transform = match (pose, fault) {
        (_, Some(NdiFault::Disabled)) => "DISABLED".to_owned(),
        (None, _) => "MISSING".to_owned(),
        (Some(_), Some(NdiFault::NotANumber)) => format!("{}{}+00250", "+0.nan".repeat(4), "+00.nan".repeat(3)),
        (Some(pose), _) => {
            let [q0, qx, qy, qz] = pose.quaternion.map(|part| part * 1e4);
            let [x, y, z] = pose.origin_mm.map(|part| part * 1e2);
            format!("{q0:+06.0}{qx:+06.0}{qy:+06.0}{qz:+06.0}{x:+07.0}{y:+07.0}{z:+07.0}{:+06.0}", FIT_MM * 1e4)
        }
    };
    let extra = if matches!(fault, Some(NdiFault::WrongBody | NdiFault::WrongLength)) { "00" } else { "" };
    format!("01{HANDLE:02X}{transform}00000031{frame:08X}\n{extra}0000")
}

#[expect(clippy::cast_possible_truncation, reason = "the format has single precision")]
fn binary_reply(pose: Option<Pose>, frame: u32, fault: Option<NdiFault>) -> Vec<u8> {
    let mut body = vec![1, HANDLE];
    match (pose, fault) {
        (_, Some(NdiFault::Disabled)) => body.push(4),
        (None, _) => body.push(2),
        (Some(pose), _) => {
            body.push(1);
            let values = pose.quaternion.into_iter().chain(pose.origin_mm).chain([FIT_MM]);
            body.extend(values.flat_map(|value| (value as f32).to_le_bytes()));
        }
    }
    body.extend(0x31_u32.to_le_bytes());
    body.extend(frame.to_le_bytes());
    body.extend([0, 0]);
    if fault == Some(NdiFault::WrongBody) {
        body.extend([0; 5]);
    }
    if fault == Some(NdiFault::WrongLength) {
        // The header of a longer packet before a shorter body: the rest never arrives.
        let longer = encode_binary(&[body.as_slice(), &[0; 30]].concat());
        return longer.into_iter().take(body.len() + 8).collect();
    }
    encode_binary(&body)
}

impl Simulator for NdiSimulator {
    fn accept(&mut self, _now: Moment) {
        self.decoder.resync();
        self.schedule.clear();
    }

    fn feed(&mut self, bytes: &[u8], source: &mut dyn PointSource, now: Moment) {
        for &byte in bytes {
            match self.decoder.push(byte) {
                Some(Frame::Text(command)) => self.command(&command, source, now),
                Some(Frame::Damaged(_)) => {
                    self.decoder.resync();
                    self.schedule.send(now + ANSWERING, encode_text("ERROR04"));
                }
                Some(Frame::Binary(_)) | None => {}
            }
        }
    }

    fn tick(&mut self, _source: &mut dyn PointSource, now: Moment) {
        self.schedule.tick(now);
    }

    fn next_output(&mut self) -> Option<Output> {
        self.schedule.next_output()
    }

    fn next_deadline(&self) -> Option<Moment> {
        self.schedule.next_deadline()
    }
}

#[cfg(test)]
mod tests;
