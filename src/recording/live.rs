//! The live view: viewers connect to a port of this machine and see the recording grow.

mod gate;

use std::net::{Ipv4Addr, TcpListener};
use std::sync::Arc;
use std::thread;

use rerun::RecordingStream;
use rerun::log::PendingRow;

use self::gate::Gate;
use super::RecordingError;
use super::blueprint::Purpose;
use super::identity::Identity;
use super::renderer::Renderer;
use super::rrd::{Ids, layout_messages};
use crate::session::journal::Line;

/// A port on this machine on which viewers can watch the recording grow.
#[derive(Clone, Debug)]
pub struct Live {
    port: u16,
    /// The port, which is held from the beginning.
    #[cfg_attr(not(feature = "live"), expect(dead_code, reason = "without the live view nobody connects"))]
    listener: Arc<TcpListener>,
}

/// Most bytes of the recording that the server keeps for later viewers: many times a long session.
#[cfg(feature = "live")]
const HISTORY: u64 = 256 << 20;

impl Live {
    /// Takes the port. Port 0 picks a free one.
    ///
    /// # Errors
    /// It is taken, or this program was built without the live view.
    pub fn on(port: u16) -> Result<Self, RecordingError> {
        if cfg!(not(feature = "live")) {
            return Err(not_built_in(port));
        }
        // The library does not report a port that is taken.
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))
            .map_err(|error| RecordingError::Port { port, message: error.to_string() })?;
        let port = listener.local_addr().map_or(port, |address| address.port());
        Ok(Self { port, listener: Arc::new(listener) })
    }

    pub const fn port(&self) -> u16 {
        self.port
    }

    /// Returns the address for viewers.
    pub fn url(&self) -> String {
        format!("rerun+http://127.0.0.1:{}/proxy", self.port)
    }

    /// Starts a stream to viewers, early or late ones. They reach the library's server through a gate.
    #[cfg(feature = "live")]
    fn stream(self, identity: &Identity) -> Result<(RecordingStream, Gate), RecordingError> {
        use rerun::external::re_grpc_server::{MemoryLimit, ServerOptions};

        let failed = |error: std::io::Error| RecordingError::library("starting the live view", error);
        let inner = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).and_then(|inner| inner.local_addr()).map_err(failed)?;
        let options = ServerOptions { memory_limit: MemoryLimit::from_bytes(HISTORY), ..ServerOptions::default() };
        // Without `enabled`, an environment variable could switch the stream off.
        let stream = identity
            .stream_builder()
            .enabled(true)
            .serve_grpc_opts("127.0.0.1", inner.port(), options)
            .map_err(|error| RecordingError::library("starting the live view", error))?;
        let gate = Gate::open(self.listener, inner.port()).map_err(failed)?;
        Ok((stream, gate))
    }

    #[cfg(not(feature = "live"))]
    fn stream(self, _identity: &Identity) -> Result<(RecordingStream, Gate), RecordingError> {
        Err(not_built_in(self.port))
    }
}

fn not_built_in(port: u16) -> RecordingError {
    RecordingError::Port { port, message: "this program was built without the live view".to_owned() }
}

/// Streams the recording to connected viewers.
#[derive(Debug)]
pub(super) struct LiveView {
    stream: RecordingStream,
    /// Lets viewers in as long as it lives.
    _gate: Gate,
    identity: Identity,
    renderer: Renderer,
}

impl LiveView {
    /// Starts to serve the recording of a journal that begins with `first`, without showing a line yet.
    pub(super) fn start(live: Live, first: &Line) -> Result<Self, RecordingError> {
        let identity = Identity::of(first);
        let (stream, gate) = live.stream(&identity)?;
        Ok(Self { stream, _gate: gate, renderer: Renderer::new(&identity, Purpose::Live), identity })
    }

    /// Shows lines. Never waits for a viewer.
    pub(super) fn show(&mut self, lines: &[Line]) {
        let Some(last) = lines.last() else { return };
        for line in lines {
            self.renderer.draw(line);
        }
        let drawn = self.renderer.take_drawn();
        if let Some(layout) = drawn.layout {
            // Without a layout, because it could not be encoded, the viewer arranges itself.
            let messages = layout_messages(&self.identity, layout, &mut Ids::after(last)).into_iter().flatten();
            messages.for_each(|message| self.stream.record_msg(message));
        }
        for row in drawn.rows {
            self.stream.record_row(row.entity, PendingRow::from_iter(row.time, row.components), false);
        }
    }

    /// Ends the stream. The library may wait for a viewer that does not answer, so this happens on a thread that is never joined.
    pub(super) fn end(self) {
        drop(thread::Builder::new().name("live-end".to_owned()).spawn(move || drop(self)));
    }
}
