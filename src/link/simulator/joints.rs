//! A simulated program that prints the joint values of a robot as lines, ten per second.

use std::time::Duration;

use super::fault::{FaultPlan, Planned, faults};
use super::schedule::{Schedule, halves};
use super::{Output, PointSource, Simulator};
use crate::link::protocol::Moment;

/// Interval of the lines.
const INTERVAL: Duration = Duration::from_millis(100);

faults! {
    /// A fault of the simulated program. Its occasion is a line.
    pub JointsFault {
        Halves "halves" "The line in two halves with a pause between them.",
        Cut "cut" "Half the line, then its terminator; the rest is lost.",
        NotANumber "not-a-number" "A joint value is `NaN`.",
        MissingJoint "missing-joint" "The last joint value is missing.",
        WrongUnit "wrong-unit" "The values are in degrees, the line says radians.",
        NoUnit "no-unit" "The unit is missing.",
        Radians "radians" "The values in radians, as the line says.",
        Untimed "untimed" "The time is missing.",
        Stopped "stopped" "The status is `protective stop`.",
        Moving "moving" "The first joint turns at 0.2 rad/s.",
        Noise "noise" "Bytes as received at a wrong baud rate.",
        Silent "silent" "Nothing is sent.",
        DisconnectMidLine "disconnect-mid-line" "The connection is closed in the middle of the line.",
    }
}

/// A simulated source of joint lines.
#[derive(Debug)]
pub struct JointsSimulator {
    faults: FaultPlan<JointsFault>,
    next_line: Option<Moment>,
    schedule: Schedule,
    /// Angle by which a fault has turned the first joint (rad).
    travel: f64,
}

impl JointsSimulator {
    pub fn new(faults: impl IntoIterator<Item = Planned<JointsFault>>) -> Self {
        Self { faults: FaultPlan::new(faults), next_line: None, schedule: Schedule::default(), travel: 0.0 }
    }

    fn print(&mut self, source: &mut dyn PointSource, now: Moment) {
        let fault = self.faults.occasion(|_| true);
        let mut state = source.joints();
        if fault == Some(JointsFault::Moving) {
            self.travel += 0.2 * INTERVAL.as_secs_f64();
        }
        if let Some(first) = state.positions.first_mut() {
            *first += self.travel;
        }
        if fault == Some(JointsFault::MissingJoint) {
            state.positions.pop();
        }
        let is_radian = fault == Some(JointsFault::Radians);
        let number = |angle: &f64| if is_radian { format!("{angle:.9}") } else { format!("{:.7}", angle.to_degrees()) };
        let mut values: Vec<String> = state.positions.iter().map(number).collect();
        if fault == Some(JointsFault::NotANumber)
            && let Some(last) = values.last_mut()
        {
            "NaN".clone_into(last);
        }
        let unit = match fault {
            Some(JointsFault::NoUnit) => "",
            Some(JointsFault::WrongUnit | JointsFault::Radians) => "rad,",
            _ => "deg,",
        };
        let status = match (fault, &state.stopped) {
            (Some(JointsFault::Stopped), _) => "protective stop",
            (_, Some(why)) => why,
            (_, None) => "0",
        };
        let time = match fault {
            Some(JointsFault::Untimed) => String::new(),
            _ => format!(",{:.3}", now.as_secs_f64()),
        };
        let line = format!("J,{},{unit}{status}{time}\r\n", values.join(","));
        let bytes = line.as_bytes();
        match fault {
            Some(JointsFault::Halves) => self.schedule.send_halves(now, bytes),
            Some(JointsFault::Cut) => self.schedule.send(now, [halves(bytes).0, b"\r\n"].concat()),
            Some(JointsFault::Noise) => self.schedule.send(now, b"\xF8\x80\x78\xFE\x98\r\n\x06\xE6\n\xFF\r".to_vec()),
            Some(JointsFault::Silent) => {}
            Some(JointsFault::DisconnectMidLine) => self.schedule.break_off(now, bytes),
            _ => self.schedule.send(now, bytes.to_vec()),
        }
    }
}

impl Simulator for JointsSimulator {
    fn accept(&mut self, now: Moment) {
        self.schedule.clear();
        self.schedule.send(now, b"# SIMULATED controller\r\n".to_vec());
        self.next_line = Some(now + INTERVAL);
    }

    fn feed(&mut self, _bytes: &[u8], _source: &mut dyn PointSource, _now: Moment) {}

    fn tick(&mut self, source: &mut dyn PointSource, now: Moment) {
        if self.next_line.is_some_and(|next| next <= now) {
            self.next_line = Some(now + INTERVAL);
            self.print(source, now);
        }
        self.schedule.tick(now);
    }

    fn next_output(&mut self) -> Option<Output> {
        self.schedule.next_output()
    }

    fn next_deadline(&self) -> Option<Moment> {
        [self.next_line, self.schedule.next_deadline()].into_iter().flatten().min()
    }
}
