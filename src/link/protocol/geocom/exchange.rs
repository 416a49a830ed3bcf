//! One request at a time: transaction numbers, deadlines, and patience with a busy instrument.

use std::time::Duration;

use super::super::Moment;
use super::super::Severity;
use super::super::lines::LineSplitter;
use super::super::lines::Piece;
use super::super::outbox::Outbox;
use super::super::patience::Patience;
use super::super::unreadable::Unreadable;
use super::codes::SLEEPING;
use super::codes::is_busy;
use super::wire::Reply;
use super::wire::Request;
use super::wire::decode_reply;
use super::wire::encode_request;

/// Pause before a request is sent again that was damaged on its way.
const RESEND_DELAY: Duration = Duration::from_millis(200);

/// How often a request is sent again that was damaged on its way.
const MAX_RESENDS: u32 = 2;

/// Largest transaction number.
const LAST_TRANSACTION: u16 = 32_767;

/// A request to be made.
#[derive(Clone, Debug)]
pub(super) struct Call {
    pub(super) rpc: u32,
    pub(super) parameters: String,
    /// How long the answer may take.
    pub(super) limit: Duration,
    /// For messages: what is done meanwhile.
    pub(super) what: &'static str,
}

/// How a call ended.
#[derive(Debug)]
pub(super) enum Outcome {
    /// An answer, the transport being fine.
    Reply(Call, Reply),
    /// None in time.
    TimedOut(Call),
    /// Busy for longer than is bearable.
    Busy(u32),
    /// The transport failed again and again; the code, or what was wrong with the line.
    Damaged(Damage),
}

/// What was wrong with a message.
#[derive(Clone, Debug)]
pub(super) enum Damage {
    /// The instrument says it by a code.
    Code(u32),
    /// Its line cannot be read.
    Line(String),
}

#[derive(Debug)]
struct Pending {
    call: Call,
    /// The number of the request that is out; none between two attempts.
    transaction: Option<u16>,
    deadline: Moment,
    retry_at: Option<Moment>,
    patience: Patience,
    resends: u32,
}

/// The line to the instrument.
#[derive(Debug)]
pub(super) struct Exchange {
    splitter: LineSplitter,
    with_crc: bool,
    last_transaction: u16,
    pending: Option<Pending>,
    /// The instrument may have half a request in its buffer: a line feed clears it.
    is_dirty: bool,
    unreadable: Unreadable,
}

impl Exchange {
    pub(super) fn new(with_crc: bool) -> Self {
        Self {
            splitter: LineSplitter::default(),
            with_crc,
            last_transaction: 0,
            pending: None,
            is_dirty: true,
            unreadable: Unreadable::default(),
        }
    }

    /// A new connection. The numbers go on, so that an answer to the old one cannot pass.
    pub(super) fn restart(&mut self) {
        self.splitter.clear();
        self.pending = None;
        self.is_dirty = true;
        self.unreadable.clear();
    }

    pub(super) const fn pending_bytes(&self) -> usize {
        self.splitter.pending()
    }

    /// Sends a request; one that is under way is given up.
    pub(super) fn ask(&mut self, call: Call, now: Moment, outbox: &mut Outbox) {
        self.is_dirty |= self.pending.is_some();
        self.pending = Some(Pending {
            deadline: now + call.limit,
            call,
            transaction: None,
            retry_at: None,
            patience: Patience::default(),
            resends: 0,
        });
        self.send(now, outbox);
    }

    /// Gives up the request under way.
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
            Piece::Overlong => self.damaged("more than 4096 bytes without a line end".to_owned(), false, now, outbox),
            Piece::Line(line) => self.line(&line, now, outbox),
        }
    }

    fn line(&mut self, line: &[u8], now: Moment, outbox: &mut Outbox) -> Option<Outcome> {
        let is_reply = line.windows(4).any(|window| window == b"%R1P");
        // Some Bluetooth adapters send back what they are given.
        if !is_reply && line.windows(4).any(|window| window == b"%R1Q") {
            return None;
        }
        match decode_reply(line) {
            Ok(reply) if self.with_crc && !reply.checked && reply.transport == 0 => {
                self.damaged("it carries no CRC".to_owned(), is_reply, now, outbox)
            }
            Ok(reply) => {
                self.unreadable.clear();
                self.reply(reply, now, outbox)
            }
            Err(text) => self.damaged(text, is_reply, now, outbox),
        }
    }

    fn reply(&mut self, reply: Reply, now: Moment, outbox: &mut Outbox) -> Option<Outcome> {
        let pending = self.pending.as_mut()?;
        // An instrument that could not read the request cannot repeat its number.
        let is_unread = reply.transport != 0 && reply.transaction == 0;
        let is_mine = pending.transaction.is_some_and(|own| own == reply.transaction || is_unread);
        if !is_mine {
            outbox.say(
                Severity::Info,
                format!("a late or foreign answer was thrown away (number {})", reply.transaction),
            );
            return None;
        }
        pending.transaction = None;
        if reply.transport == SLEEPING {
            return self.be_patient(SLEEPING, now);
        }
        if reply.transport != 0 {
            self.is_dirty = true;
            return self.send_again(Damage::Code(reply.transport), now);
        }
        if is_busy(reply.code) {
            return self.be_patient(reply.code, now);
        }
        self.pending.take().map(|pending| Outcome::Reply(pending.call, reply))
    }

    fn be_patient(&mut self, code: u32, now: Moment) -> Option<Outcome> {
        let pending = self.pending.as_mut()?;
        pending.retry_at = pending.patience.again_at(now);
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

    /// A line that cannot be read. A damaged reply is asked for again; noise is not.
    fn damaged(&mut self, text: String, is_reply: bool, now: Moment, outbox: &mut Outbox) -> Option<Outcome> {
        let check = "baud rate, line ending and that GeoCOM is switched on";
        if let Some(said) = self.unreadable.one_more("lines", &text, check) {
            outbox.say(Severity::Warning, said);
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
                return self.pending.take().map(|pending| Outcome::TimedOut(pending.call));
            }
            _ => {}
        }
        None
    }

    pub(super) fn next_deadline(&self) -> Option<Moment> {
        self.pending.as_ref().map(|pending| pending.retry_at.unwrap_or(pending.deadline))
    }
}
