//! A simulated tracker with the combined API of NDI and one tool.

use std::time::Duration;

use nalgebra::UnitQuaternion;
use nalgebra::Vector3;

use super::Output;
use super::PointSource;
use super::Simulator;
use super::fault::{FaultPlan, Planned, faults};
use super::schedule::{Schedule, halves};
use crate::link::protocol::LineChange;
use crate::link::protocol::Moment;
use crate::link::protocol::ndi::Frame;
use crate::link::protocol::ndi::FrameDecoder;
use crate::link::protocol::ndi::encode_binary;
use crate::link::protocol::ndi::encode_text;

const FRAMES_PER_SECOND: f64 = 60.0;

/// Time from a command to its reply.
const ANSWERING: Duration = Duration::from_millis(4);

/// Duration of a slow start of hardware.
const STARTING: Duration = Duration::from_secs(6);

/// Duration of a reset.
const RESETTING: Duration = Duration::from_secs(2);

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
        PartlyOutOfVolume "partly-out-of-volume" "The tool is partly outside the measurement volume.",
        OutOfVolume "out-of-volume" "The tool is not seen because it is outside the measurement volume.",
        Infrared "infrared" "Too much infrared light around the tracker.",
        HardwareFailure "hardware-failure" "The tracker reports a failure of its hardware.",
        SlowStart "slow-start" "Takes 6 s for `INIT`, `PINIT` and `TSTART`. Occasion: a command.",
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

/// A serial line.
#[derive(Clone, Copy, Debug)]
struct Line {
    /// Speed of the tracker (baud).
    own: u32,
    /// Speed of the other side (baud).
    peer: u32,
    resets: u32,
}

/// A simulated tracker that measures the tip of a tool.
#[derive(Debug)]
pub struct NdiSimulator {
    faults: FaultPlan<NdiFault>,
    tip: Vector3<f64>,
    rotation: UnitQuaternion<f64>,
    decoder: FrameDecoder,
    /// The serial line, if it is one.
    line: Option<Line>,
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
            line: None,
            is_initialised: false,
            is_enabled: false,
            is_tracking: false,
            last: None,
            schedule: Schedule::default(),
        }
    }

    /// Puts the tracker on a serial line at this speed, opened by the other side at `peer` (baud).
    #[cfg(test)]
    #[must_use]
    pub fn on_serial_line(mut self, speed: u32, peer: u32) -> Self {
        self.line = Some(Line { own: speed, peer, resets: 0 });
        self
    }

    /// Speed of its serial line (baud).
    #[cfg(test)]
    pub fn speed(&self) -> Option<u32> {
        self.line.map(|line| line.own)
    }

    /// Number of resets by a break on its serial line.
    #[cfg(test)]
    pub fn resets(&self) -> u32 {
        self.line.map_or(0, |line| line.resets)
    }

    /// Bytes of an incomplete command.
    pub const fn pending(&self) -> usize {
        self.decoder.pending()
    }

    /// Sets the speed of the serial line by the number of `COMM`; the answer still has the old one.
    fn set_speed(&mut self, parameters: &str) -> String {
        let speed = match parameters {
            "00000" => 9600,
            "10000" => 14_400,
            "20000" => 19_200,
            "30000" => 38_400,
            "40000" => 57_600,
            "50000" => 115_200,
            "60000" => 921_600,
            _ => return "ERROR06".to_owned(),
        };
        if let Some(line) = &mut self.line {
            line.own = speed;
        }
        "OKAY".to_owned()
    }

    fn command(&mut self, command: &str, source: &mut dyn PointSource, now: Moment) {
        let reply = match command {
            "INIT:" => self.initialise(),
            // The only reply that clients do not parse, so it marks the tracker as simulated.
            "APIREV:" => "G.003.001 SIMULATED".to_owned(),
            "PHSR:00" => Self::handles(true, "001"),
            "PHSR:01" => "00".to_owned(),
            "PHSR:02" => Self::handles(!self.is_initialised, "001"),
            "PHSR:03" => Self::handles(self.is_initialised && !self.is_enabled, "011"),
            "PHSR:04" => Self::handles(self.is_enabled, "031"),
            // What clients ask about the tool and the version, load as its definition, or let sound.
            "PHINF:0A0001" => format!("02000000NDI         001000000012{}", if self.is_enabled { "1" } else { "0" }),
            "PHF:0A" => "OKAY".to_owned(),
            _ if command.starts_with("COMM:") => self.set_speed(command.trim_start_matches("COMM:")),
            "VER:0" | "VER:3" | "VER:4" | "VER:5" => {
                "Polaris Control Firmware SIMULATED\nNDI S/N: P7-00001\nFreeze Tag: 024".to_owned()
            }
            _ if command.starts_with("PHRQ:") => format!("{HANDLE:02X}"),
            _ if command.starts_with("PVWR:0A") => "OKAY".to_owned(),
            _ if command.starts_with("BEEP:") => "1".to_owned(),
            _ if command.starts_with("GET:") => format!("{}=0", command.trim_start_matches("GET:")),
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
            "TX:0001" | "BX:0001" | "TX:0801" | "BX:0801" | "TX:" | "BX:" if self.is_tracking => {
                return self.position(command.starts_with("BX"), source, now);
            }
            "TX:0001" | "BX:0001" | "TX:0801" | "BX:0801" | "TX:" | "BX:" => "ERROR0C".to_owned(),
            _ => "ERROR01".to_owned(),
        };
        let takes = match self.faults.occasion(|fault| fault == NdiFault::SlowStart) {
            Some(_) if ["INIT:", "PINIT:0A", "TSTART:"].contains(&command) => STARTING,
            _ => ANSWERING,
        };
        self.schedule.send(now + takes, encode_text(&reply));
    }

    /// The list of port handles, if it has one.
    fn handles(has_one: bool, status: &str) -> String {
        if has_one { format!("01{HANDLE:02X}{status}") } else { "00".to_owned() }
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
        let is_of_position = |fault| !matches!(fault, NdiFault::InitialisationFails | NdiFault::SlowStart);
        let fault = self.faults.occasion(is_of_position);
        let frame = match (fault, self.last) {
            (Some(NdiFault::FrozenFrame), Some((frame, _))) => frame,
            _ => frame_at(now),
        };
        let pose = match self.last {
            Some((last, pose)) if last == frame => pose,
            _ => self.observe(source),
        };
        self.last = Some((frame, pose));
        let pose = pose
            .filter(|_| !matches!(fault, Some(NdiFault::Missing | NdiFault::OutOfVolume)))
            .map(|pose| with_fault(pose, fault));
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

/// Status bits of the port: occupied, initialised, enabled.
const fn port_status(fault: Option<NdiFault>) -> u32 {
    match fault {
        Some(NdiFault::OutOfVolume) => 0x71,
        Some(NdiFault::PartlyOutOfVolume) => 0xb1,
        _ => 0x31,
    }
}

/// Status bits of the tracker.
const fn system_status(fault: Option<NdiFault>) -> u16 {
    match fault {
        Some(NdiFault::Infrared) => 0x0002,
        Some(NdiFault::HardwareFailure) => 0x0010,
        _ => 0,
    }
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
    format!("01{HANDLE:02X}{transform}{:08X}{frame:08X}\n{extra}{:04X}", port_status(fault), system_status(fault))
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
    body.extend(port_status(fault).to_le_bytes());
    body.extend(frame.to_le_bytes());
    body.extend(system_status(fault).to_le_bytes());
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
    fn change_line(&mut self, change: LineChange, now: Moment) {
        let Some(line) = &mut self.line else { return };
        match change {
            LineChange::Speed(speed) => line.peer = speed,
            LineChange::Break => {
                (line.own, line.resets) = (9600, line.resets + 1);
                (self.is_initialised, self.is_enabled, self.is_tracking) = (false, false, false);
                self.decoder.resync();
                self.schedule.clear();
                self.schedule.send(now + RESETTING, encode_text("RESET"));
            }
        }
    }

    fn accept(&mut self, _now: Moment) {
        self.decoder.resync();
        self.schedule.clear();
    }

    fn feed(&mut self, bytes: &[u8], source: &mut dyn PointSource, now: Moment) {
        // At another speed nothing legible arrives.
        if self.line.is_some_and(|line| line.peer != line.own) {
            return;
        }
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
