//! One request at a time: transaction numbers, deadlines and retries.

use std::time::Duration;

use super::super::Moment;
use super::super::Severity;
use super::super::backoff::Backoff;
use super::super::error_streak::ErrorStreak;
use super::super::lines::LineSplitter;
use super::super::lines::MAX_LINE;
use super::super::lines::Piece;
use super::super::outbox::Outbox;
use super::codes::SLEEPING;
use super::codes::is_busy;
use super::codes::is_unknown;
use super::wire::Reply;
use super::wire::Request;
use super::wire::decode_reply;
use super::wire::encode_request;

/// Pause before a damaged request is sent again.
const RESEND_DELAY: Duration = Duration::from_millis(200);

/// Most repetitions of a damaged request.
const MAX_RESENDS: u32 = 2;

/// Largest transaction number.
const LAST_TRANSACTION: u16 = 32_767;

/// A request with its time limit.
#[derive(Clone, Debug)]
pub(super) struct Call {
    pub(super) rpc: u32,
    pub(super) parameters: String,
    /// Time limit of the answer.
    pub(super) limit: Duration,
    /// Description of the activity for messages.
    pub(super) what: &'static str,
}

/// How a call ended.
#[derive(Debug)]
pub(super) enum Outcome {
    /// An answer without a transport error.
    Reply(Call, Reply),
    /// No answer in time.
    TimedOut(Call),
    /// Busy for too long, with the return code.
    Busy(u32),
    /// Repeated transport errors.
    Damaged(Damage),
}

/// Kind of damage to a message.
#[derive(Clone, Debug)]
pub(super) enum Damage {
    /// Transport error reported by the instrument.
    Code(u32),
    /// The answer cannot be read.
    Line(String),
    /// The answer has no transaction number, so that it could belong to any request.
    Unnumbered,
}

#[derive(Debug)]
struct Pending {
    call: Call,
    /// Number of the sent request; `None` between two attempts.
    transaction: Option<u16>,
    deadline: Moment,
    retry_at: Option<Moment>,
    backoff: Backoff,
    resends: u32,
    /// Whether an answer without a transaction number has arrived.
    has_unnumbered: bool,
}

/// Requests and answers on the line to the instrument.
#[derive(Debug)]
pub(super) struct Exchange {
    splitter: LineSplitter,
    with_crc: bool,
    last_transaction: u16,
    pending: Option<Pending>,
    /// Whether the instrument may have part of a request in its buffer, which a line feed clears.
    is_dirty: bool,
    errors: ErrorStreak,
}

impl Exchange {
    pub(super) fn new(with_crc: bool) -> Self {
        Self {
            splitter: LineSplitter::default(),
            with_crc,
            last_transaction: 0,
            pending: None,
            is_dirty: true,
            errors: ErrorStreak::default(),
        }
    }

    /// Resets for a new connection. Transaction numbers continue, so that answers from the old one are not accepted.
    pub(super) fn restart(&mut self) {
        self.splitter.clear();
        self.pending = None;
        self.is_dirty = true;
        self.errors.reset();
    }

    pub(super) const fn pending_bytes(&self) -> usize {
        self.splitter.pending()
    }

    /// Sends a request and abandons the one in progress.
    pub(super) fn ask(&mut self, call: Call, now: Moment, outbox: &mut Outbox) {
        self.is_dirty |= self.pending.is_some();
        self.pending = Some(Pending {
            deadline: now + call.limit,
            call,
            transaction: None,
            retry_at: None,
            backoff: Backoff::default(),
            resends: 0,
            has_unnumbered: false,
        });
        self.send(now, outbox);
    }

    /// Abandons the request in progress.
    pub(super) fn abandon(&mut self) {
        self.pending = None;
        self.is_dirty = true;
    }

    fn send(&mut self, now: Moment, outbox: &mut Outbox) {
        let transaction = self.last_transaction % LAST_TRANSACTION + 1;
        let Some(pending) = &mut self.pending else {
            return;
        };
        self.last_transaction = transaction;
        pending.transaction = Some(transaction);
        pending.retry_at = None;
        pending.deadline = now + pending.call.limit;
        let request = Request { rpc: pending.call.rpc, transaction, parameters: pending.call.parameters.clone() };
        let clear = if std::mem::take(&mut self.is_dirty) { "\n" } else { "" };
        outbox.send(format!("{clear}{}\r\n", encode_request(&request, self.with_crc)).into_bytes());
    }

    pub(super) fn push(&mut self, byte: u8, now: Moment, outbox: &mut Outbox) -> Option<Outcome> {
        match self.splitter.push(byte)? {
            Piece::Overlong => {
                self.damaged(format!("more than {MAX_LINE} bytes without a line end"), false, now, outbox)
            }
            Piece::Line(line) => self.line(&line, now, outbox),
        }
    }

    fn line(&mut self, line: &[u8], now: Moment, outbox: &mut Outbox) -> Option<Outcome> {
        let is_reply = line.windows(4).any(|window| window == b"%R1P");
        // Some Bluetooth adapters echo the requests.
        if !is_reply && line.windows(4).any(|window| window == b"%R1Q") {
            return None;
        }
        match decode_reply(line) {
            Ok(reply) if self.with_crc && !reply.checked && reply.transport == 0 => {
                self.damaged("the CRC is missing".to_owned(), is_reply, now, outbox)
            }
            Ok(reply) => {
                self.errors.reset();
                self.reply(reply, now, outbox)
            }
            Err(text) => self.damaged(text, is_reply, now, outbox),
        }
    }

    fn reply(&mut self, reply: Reply, now: Moment, outbox: &mut Outbox) -> Option<Outcome> {
        let pending = self.pending.as_mut()?;
        // An instrument that could not read the request cannot repeat its number.
        let is_unnumbered_error = reply.transport != 0 && reply.transaction == 0;
        let is_expected = |number| number == reply.transaction || is_unnumbered_error;
        pending.has_unnumbered |= reply.transaction == 0;
        if !pending.transaction.is_some_and(is_expected) {
            outbox.report(Severity::Info, format!("discarded a late or foreign answer (number {})", reply.transaction));
            return None;
        }
        pending.transaction = None;
        if reply.transport == SLEEPING {
            return self.back_off(SLEEPING, now);
        }
        if is_unknown(reply.transport) {
            // Asking again cannot help; the caller decides what the missing procedure means.
            let reply = Reply { code: reply.transport, parameters: Vec::new(), ..reply };
            return self.pending.take().map(|pending| Outcome::Reply(pending.call, reply));
        }
        if reply.transport != 0 {
            self.is_dirty = true;
            return self.send_again(Damage::Code(reply.transport), now);
        }
        if is_busy(reply.code) {
            return self.back_off(reply.code, now);
        }
        self.pending.take().map(|pending| Outcome::Reply(pending.call, reply))
    }

    fn back_off(&mut self, code: u32, now: Moment) -> Option<Outcome> {
        let pending = self.pending.as_mut()?;
        pending.retry_at = pending.backoff.next_attempt(now);
        if pending.retry_at.is_some() {
            return None;
        }
        self.pending = None;
        Some(Outcome::Busy(code))
    }

    fn send_again(&mut self, damage: Damage, now: Moment) -> Option<Outcome> {
        let pending = self.pending.as_mut()?;
        if pending.resends >= MAX_RESENDS {
            self.abandon();
            return Some(Outcome::Damaged(damage));
        }
        if pending.retry_at.is_none() {
            pending.resends += 1;
            pending.retry_at = Some(now + RESEND_DELAY);
        }
        None
    }

    /// Handles an unreadable line. A damaged answer is requested again; noise is ignored.
    fn damaged(&mut self, text: String, is_reply: bool, now: Moment, outbox: &mut Outbox) -> Option<Outcome> {
        let check = "baud rate, line ending and whether GeoCOM is switched on";
        if let Some(warning) = self.errors.record("lines", &text, check) {
            outbox.report(Severity::Warning, warning);
        }
        if !is_reply {
            return None;
        }
        self.is_dirty = true;
        self.send_again(Damage::Line(text), now)
    }

    pub(super) fn tick(&mut self, now: Moment, outbox: &mut Outbox) -> Option<Outcome> {
        let pending = self.pending.as_ref()?;
        match pending.retry_at {
            Some(at) if at <= now => self.send(now, outbox),
            None if pending.deadline <= now => {
                self.is_dirty = true;
                return self.pending.take().map(|pending| {
                    if pending.has_unnumbered {
                        Outcome::Damaged(Damage::Unnumbered)
                    } else {
                        Outcome::TimedOut(pending.call)
                    }
                });
            }
            _ => {}
        }
        None
    }

    pub(super) fn next_deadline(&self) -> Option<Moment> {
        self.pending.as_ref().map(|pending| pending.retry_at.unwrap_or(pending.deadline))
    }
}
