//! ABB controllers with RobotWare 6 by Robot Web Services 1.0: HTTP on port 80 with digest authentication.
//!
//! `GET /rw/motionsystem/mechunits/ROB_1/jointtarget` answers with the joint angles as the pendant shows them, in elements of the
//! classes `rax_1` to `rax_6`. The first request is refused with a challenge; the cookies of the answer keep the session, of
//! which a controller has only a limited number. Nothing is ever written.

#[cfg(test)]
mod tests;

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::excerpt::excerpt;
use super::http::{Challenge, MAX_RESPONSE, Response};
use super::outbox::Outbox;
use super::receive_buffer::ReceiveBuffer;
use super::{Failure, Identity, JointState, Moment, Protocol, ProtocolEvent};

/// TCP port of the service.
pub const PORT: u16 = 80;

/// Interval of the requests; controllers serve about twenty per second to all clients together.
const INTERVAL: Duration = Duration::from_millis(150);

/// Longest wait for an answer.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(5);

/// Most refusals of the user in a row: a challenge that has expired is answered once more.
const MAX_REFUSALS: u32 = 2;

/// Nonce of this client. It only has to differ between requests with the same nonce of the server, which the count does.
const CLIENT_NONCE: &str = "7472757073655f31";

/// Options of the link.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AbbOptions {
    /// Name of the user.
    pub user: String,
    /// Password of the user.
    pub password: String,
    /// Mechanical unit.
    pub unit: String,
}

impl Default for AbbOptions {
    /// The user that controllers have as delivered, and the first robot.
    fn default() -> Self {
        Self { user: "Default User".to_owned(), password: "robotics".to_owned(), unit: "ROB_1".to_owned() }
    }
}

impl AbbOptions {
    /// Fails with the reason if a text cannot be part of a request.
    pub fn validate(&self) -> Result<(), String> {
        let is_name =
            |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
        if !is_name(&self.unit) {
            return Err("unit must be a name such as ROB_1".to_owned());
        }
        let is_plain = |text: &str| !text.chars().any(|c| c.is_control() || matches!(c, '"' | '\\'));
        if !(is_plain(&self.user) && is_plain(&self.password)) {
            return Err("user and password must not contain quotes, backslashes or control characters".to_owned());
        }
        Ok(())
    }
}

/// Joint angles (rad) of the content of an answer.
pub fn joint_angles(content: &str) -> Result<Vec<f64>, String> {
    let of = |joint: usize| {
        let mark = format!("class=\"rax_{joint}\"");
        let (_, rest) = content.split_once(mark.as_str())?;
        let (value, _) = rest.split_once('>')?.1.split_once('<')?;
        value.trim().parse::<f64>().ok().filter(|value| value.is_finite()).map(f64::to_radians)
    };
    let found: Option<Vec<f64>> = (1..=6).map(of).collect();
    found.ok_or_else(|| format!("`{}` does not contain rax_1 to rax_6", excerpt(content)))
}

/// Driver of a controller.
#[derive(Clone, Debug)]
pub struct Abb {
    options: AbbOptions,
    received: ReceiveBuffer,
    outbox: Outbox,
    phase: Phase,
    challenge: Option<Challenge>,
    /// Cookies of the session, `name=value`.
    cookies: Vec<String>,
    refusals: u32,
    is_ready: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    Off,
    /// Waiting for an answer since this time.
    Waiting(Moment),
    /// Waiting until the next request.
    Pause(Moment),
}

impl Abb {
    /// Fails if [`AbbOptions::validate`] does.
    pub fn new(options: AbbOptions) -> Result<Self, String> {
        options.validate()?;
        Ok(Self {
            options,
            received: ReceiveBuffer::default(),
            outbox: Outbox::default(),
            phase: Phase::Off,
            challenge: None,
            cookies: Vec::new(),
            refusals: 0,
            is_ready: false,
        })
    }

    fn ask(&mut self, now: Moment) {
        self.phase = Phase::Waiting(now);
        let AbbOptions { user, password, unit } = &self.options;
        let uri = format!("/rw/motionsystem/mechunits/{unit}/jointtarget");
        let mut request = vec![format!("GET {uri} HTTP/1.1\r\nHost: controller\r\nAccept: application/xhtml+xml\r\n")];
        if let Some(challenge) = &mut self.challenge {
            let answer = challenge.answer(user, password, "GET", &uri, CLIENT_NONCE);
            request.push(format!("Authorization: {answer}\r\n"));
        }
        if !self.cookies.is_empty() {
            request.push(format!("Cookie: {}\r\n", self.cookies.join("; ")));
        }
        request.push("\r\n".to_owned());
        self.outbox.send(request.concat().into_bytes());
    }

    fn take(&mut self, response: &Response, now: Moment) {
        self.keep_cookies(response);
        match response.status {
            200 => match joint_angles(&String::from_utf8_lossy(&response.body)) {
                Ok(positions) => self.take_joints(positions, now),
                Err(why) => return self.lose(Failure::Garbled(why)),
            },
            401 => return self.take_challenge(response, now),
            404 => {
                let text = format!("it has no mechanical unit '{}'", self.options.unit);
                return self.lose(Failure::Refused(text));
            }
            503 => self.phase = Phase::Pause(now + 4 * INTERVAL),
            status => return self.lose(Failure::Refused(format!("it answered with the status {status}"))),
        }
        if response.closes() {
            self.lose(Failure::Disconnected("the controller closed the connection".to_owned()));
        }
    }

    fn take_challenge(&mut self, response: &Response, now: Moment) {
        self.refusals += 1;
        self.challenge = response.headers("www-authenticate").find_map(Challenge::read);
        if self.challenge.is_none() {
            let text = "it asks for another authentication than digest; RobotWare 7 is not supported";
            return self.lose(Failure::Refused(text.to_owned()));
        }
        if self.refusals > MAX_REFUSALS {
            let text = format!("the user '{}' or its password is not accepted", self.options.user);
            return self.lose(Failure::Refused(text));
        }
        self.ask(now);
    }

    fn keep_cookies(&mut self, response: &Response) {
        for cookie in response.headers("set-cookie") {
            let cookie = cookie.split(';').next().unwrap_or_default().trim();
            let Some((name, _)) = cookie.split_once('=') else { continue };
            self.cookies.retain(|known| known.split_once('=').is_none_or(|(known, _)| known != name));
            self.cookies.push(cookie.to_owned());
        }
        // A controller sends two; whatever sends many more is not one.
        self.cookies.truncate(8);
    }

    fn take_joints(&mut self, positions: Vec<f64>, now: Moment) {
        self.refusals = 0;
        if !std::mem::replace(&mut self.is_ready, true) {
            self.outbox.push(ProtocolEvent::Ready(Identity {
                name: "ABB controller, Robot Web Services".to_owned(),
                checked: vec![format!("joint values: rax_1 to rax_6 of {} in deg", self.options.unit)],
                ..Identity::default()
            }));
        }
        let controller_time = now.as_secs_f64();
        self.outbox.push(ProtocolEvent::Joints(JointState { controller_time, ..JointState::at(positions) }));
        self.phase = Phase::Pause(now + INTERVAL);
    }

    fn lose(&mut self, failure: Failure) {
        self.phase = Phase::Off;
        self.received.clear();
        self.outbox.lose(failure);
    }

    /// Bytes of an incomplete response.
    pub fn pending(&self) -> usize {
        self.received.unread().len()
    }
}

impl Protocol for Abb {
    fn start(&mut self, now: Moment) {
        self.outbox.clear();
        self.received.clear();
        self.refusals = 0;
        self.is_ready = false;
        // Challenge and cookies stay: a new connection continues the session.
        self.ask(now);
    }

    fn feed(&mut self, bytes: &[u8], now: Moment) {
        for piece in bytes.chunks(MAX_RESPONSE) {
            if self.phase == Phase::Off {
                return;
            }
            self.received.feed(piece);
            while self.phase != Phase::Off {
                match Response::read(self.received.unread()) {
                    Ok(None) => break,
                    Ok(Some((response, length))) => {
                        self.received.consume(length);
                        if matches!(self.phase, Phase::Waiting(_)) {
                            self.take(&response, now);
                        }
                    }
                    Err(why) if self.is_ready => self.lose(Failure::Garbled(why)),
                    Err(why) => self.lose(Failure::Foreign(why)),
                }
            }
        }
    }

    fn tick(&mut self, now: Moment) {
        match self.phase {
            Phase::Pause(until) if until <= now => self.ask(now),
            Phase::Waiting(since) if since + ANSWER_TIMEOUT <= now => {
                let what = "waiting for joint angles".to_owned();
                self.lose(Failure::Silent { what, seconds: ANSWER_TIMEOUT.as_secs_f64() });
            }
            Phase::Off | Phase::Pause(_) | Phase::Waiting(_) => {}
        }
    }

    fn outbox(&mut self) -> &mut Outbox {
        &mut self.outbox
    }

    fn next_deadline(&self) -> Option<Moment> {
        match self.phase {
            Phase::Off => None,
            Phase::Pause(until) => Some(until),
            Phase::Waiting(since) => Some(since + ANSWER_TIMEOUT),
        }
    }
}
