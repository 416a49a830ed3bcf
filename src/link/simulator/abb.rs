//! A simulated ABB controller with Robot Web Services 1.0: digest authentication, a session cookie, the joint target of ROB_1.

use std::time::Duration;

use super::fault::{FaultPlan, Planned, faults};
use super::schedule::Schedule;
use super::{Output, PointSource, Simulator};
use crate::link::protocol::Moment;
use crate::link::protocol::http::Challenge;

/// Time from a request to its answer.
const ANSWERING: Duration = Duration::from_millis(40);

/// Longest accepted head of a request (bytes).
const MAX_REQUEST: usize = 8192;

/// What the controller challenges with.
const CHALLENGE: &str = "Digest realm=\"validusers@robapi.abb\", domain=\"/\", qop=\"auth\", nonce=\"5349a3f1b2\", opaque=\"799d5\", algorithm=\"MD5\"";

/// Cookie of the session.
const COOKIE: &str = "-http-session-=8::http.session::d9e1";

faults! {
    /// A fault of the simulated controller. Its occasion is a request with a right answer to the challenge.
    pub AbbFault {
        Halves "halves" "The answer in two halves with a pause between them.",
        Chunked "chunked" "The answer in chunks.",
        Refused "refused" "The user is not accepted.",
        NewChallenge "new-challenge" "The challenge has expired.",
        Busy "busy" "Status 503: too many requests.",
        Unknown "unknown" "Status 404: there is no such mechanical unit.",
        MissingAxis "missing-axis" "`rax_6` is missing.",
        NotANumber "not-a-number" "A joint value is not a number.",
        Silent "silent" "No answer.",
        Closes "closes" "The connection is closed after the answer.",
        DisconnectMidAnswer "disconnect-mid-answer" "The connection is closed in the middle of the answer.",
    }
}

/// A simulated controller.
#[derive(Debug)]
pub struct AbbSimulator {
    faults: FaultPlan<AbbFault>,
    received: Vec<u8>,
    schedule: Schedule,
    /// Number of requests that were answered with a challenge or a new session.
    sessions: u32,
}

impl AbbSimulator {
    pub fn new(faults: impl IntoIterator<Item = Planned<AbbFault>>) -> Self {
        Self { faults: FaultPlan::new(faults), received: Vec::new(), schedule: Schedule::default(), sessions: 0 }
    }

    /// Bytes of an incomplete request.
    pub const fn pending(&self) -> usize {
        self.received.len()
    }

    /// Number of sessions that were opened.
    #[cfg(test)]
    pub const fn sessions(&self) -> u32 {
        self.sessions
    }

    fn request(&mut self, head: &str, source: &mut dyn PointSource, now: Moment) {
        let at = now + ANSWERING;
        let mut words = head.lines().next().unwrap_or_default().split(' ');
        let (method, uri) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
        let header = |name: &str| {
            head.lines().filter_map(|line| line.split_once(':')).find(|(known, _)| known.eq_ignore_ascii_case(name))
        };
        let is_allowed = header("authorization").is_some_and(|(_, value)| is_right(value.trim(), method, uri));
        if !is_allowed {
            return self
                .schedule
                .send(at, response("401 Unauthorized", &format!("WWW-Authenticate: {CHALLENGE}\r\n"), ""));
        }
        let fault = self.faults.occasion(|_| true);
        match fault {
            Some(AbbFault::Refused | AbbFault::NewChallenge) => {
                let challenge = format!("WWW-Authenticate: {CHALLENGE}\r\n");
                return self.schedule.send(at, response("401 Unauthorized", &challenge, ""));
            }
            Some(AbbFault::Busy) => return self.schedule.send(at, response("503 Service Unavailable", "", "")),
            Some(AbbFault::Silent) => return,
            _ => {}
        }
        if fault == Some(AbbFault::Unknown) || method != "GET" || uri != "/rw/motionsystem/mechunits/ROB_1/jointtarget"
        {
            return self.schedule.send(at, response("404 Not Found", "", ""));
        }
        let mut headers = String::new();
        if header("cookie").is_none() {
            self.sessions += 1;
            headers = format!("Set-Cookie: {COOKIE}; path=/; httponly\r\nSet-Cookie: ABBCX=1; path=/\r\n");
        }
        if fault == Some(AbbFault::Closes) {
            headers.push_str("Connection: close\r\n");
        }
        let body = joint_target(&source.joints().positions, fault);
        if fault == Some(AbbFault::Chunked) {
            let chunks = format!("{:x}\r\n{body}\r\n0\r\n\r\n", body.len());
            let head = format!("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n{headers}\r\n");
            return self.schedule.send(at, format!("{head}{chunks}").into_bytes());
        }
        let bytes = response("200 OK", &headers, &body);
        match fault {
            Some(AbbFault::Halves) => self.schedule.send_halves(at, &bytes),
            Some(AbbFault::DisconnectMidAnswer) => self.schedule.break_off(at, &bytes),
            _ => self.schedule.send(at, bytes),
        }
    }
}

/// Whether this answers the challenge for the user that controllers have as delivered.
fn is_right(authorization: &str, method: &str, uri: &str) -> bool {
    let of = |name: &str| authorization.split_once(&format!("{name}=")).map(|(_, rest)| rest.trim_start_matches('"'));
    let client_nonce = of("cnonce").and_then(|rest| rest.split('"').next()).unwrap_or_default();
    let count = of("nc").and_then(|rest| u32::from_str_radix(rest.get(..8)?, 16).ok()).unwrap_or(0);
    let Some(mut challenge) = Challenge::read(CHALLENGE).map(|challenge| challenge.after(count.saturating_sub(1)))
    else {
        return false;
    };
    challenge.answer("Default User", "robotics", method, uri, client_nonce) == authorization
}

fn response(status: &str, headers: &str, body: &str) -> Vec<u8> {
    format!(
        "HTTP/1.1 {status}\r\nContent-Type: application/xhtml+xml\r\nContent-Length: {}\r\n{headers}\r\n{body}",
        body.len()
    )
    .into_bytes()
}

/// The content of the answer for joint values (rad).
fn joint_target(positions: &[f64], fault: Option<AbbFault>) -> String {
    let joints = if fault == Some(AbbFault::MissingAxis) { 5 } else { 6 };
    let mut items = Vec::new();
    for joint in 1..=joints {
        let angle = positions.get(joint - 1).copied().unwrap_or(0.0).to_degrees();
        let value =
            if fault == Some(AbbFault::NotANumber) && joint == 6 { "NaN".to_owned() } else { format!("{angle:.7}") };
        items.push(format!("<span class=\"rax_{joint}\">{value}</span>\n"));
    }
    items.push("<span class=\"eax_a\">8.9999998E+09</span>\n".to_owned());
    let items = items.concat();
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<html xmlns=\"http://www.w3.org/1999/xhtml\">\n<body>\n<div class=\"state\">\n\
         <ul><li class=\"ms-jointtarget\" title=\"ROB_1 SIMULATED\">\n{items}</li></ul>\n</div>\n</body>\n</html>\n"
    )
}

impl Simulator for AbbSimulator {
    fn accept(&mut self, _now: Moment) {
        self.received.clear();
        self.schedule.clear();
    }

    fn feed(&mut self, bytes: &[u8], source: &mut dyn PointSource, now: Moment) {
        for &byte in bytes {
            self.received.push(byte);
            if self.received.ends_with(b"\r\n\r\n") {
                let head = std::mem::take(&mut self.received);
                self.request(&String::from_utf8_lossy(&head), source, now);
            } else if self.received.len() >= MAX_REQUEST {
                self.received.clear();
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
