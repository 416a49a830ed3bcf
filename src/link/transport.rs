//! Transports: serial ports, TCP in both directions, UDP. Reads have a timeout; a closed connection is an error.

use std::io::{self, Read as _, Write as _};
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener, TcpStream, ToSocketAddrs as _, UdpSocket};
use std::time::{Duration, Instant};

use serialport::SerialPort;

use super::protocol::LineChange;
use crate::session::wire::Route;

/// Timeout of a connection attempt.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);
/// Timeout of a write; a peer that does not read counts as lost.
const WRITE_TIMEOUT: Duration = Duration::from_secs(5);
/// Duration of a break on a serial line.
const BREAK: Duration = Duration::from_millis(250);
/// Largest datagram (bytes).
const MAX_DATAGRAM: usize = 65_536;

/// A connected transport.
pub(super) trait Transport: Send {
    /// Reads available bytes and waits up to `wait` for them; 0 if none arrived.
    ///
    /// # Errors
    /// The connection is closed or broken.
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize>;

    /// Writes all bytes.
    ///
    /// # Errors
    /// The connection is closed or broken, or the peer does not read.
    fn write(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Changes a serial line; other transports have none.
    ///
    /// # Errors
    /// The port does not accept the change.
    fn change_line(&mut self, _change: LineChange) -> io::Result<()> {
        Ok(())
    }
}

/// Connects. `keep_going` can cancel the wait for a client.
///
/// # Errors
/// The other end cannot be reached; the message contains advice. [`io::ErrorKind::Interrupted`] if it was cancelled.
pub(super) fn connect(route: &Route, keep_going: &dyn Fn() -> bool) -> io::Result<Box<dyn Transport>> {
    match route {
        Route::Serial { device, speed } => serial(device, *speed),
        Route::Tcp { host, port } => tcp(host, *port, keep_going),
        Route::Listen { host, port } => listen(host, *port, keep_going),
        Route::Udp { host, port } => udp(host, *port),
        Route::Ask { host, port } => ask(host, *port),
    }
}

fn serial(device: &str, speed: u32) -> io::Result<Box<dyn Transport>> {
    let port = serialport::new(device, speed).timeout(WRITE_TIMEOUT).open().map_err(|error| {
        let advice = match error.kind() {
            serialport::ErrorKind::Io(io::ErrorKind::PermissionDenied) => {
                "; add the user to the group of the device, often 'dialout'"
            }
            serialport::ErrorKind::NoDevice => "; another program may be using it",
            serialport::ErrorKind::Io(io::ErrorKind::NotFound) => "; is the adapter plugged in?",
            _ => "",
        };
        io::Error::other(format!("cannot open '{device}': {error}{advice}"))
    })?;
    Ok(Box::new(Serial(port)))
}

struct Serial(Box<dyn SerialPort>);

impl Transport for Serial {
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        self.0.set_timeout(wait.max(Duration::from_millis(1)))?;
        bytes_read(self.0.read(buffer), "the serial port is gone; is the adapter still plugged in?")
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.set_timeout(WRITE_TIMEOUT)?;
        self.0.write_all(bytes)?;
        self.0.flush()
    }

    fn change_line(&mut self, change: LineChange) -> io::Result<()> {
        match change {
            LineChange::Speed(speed) => self.0.set_baud_rate(speed)?,
            LineChange::Break => {
                self.0.set_break()?;
                std::thread::sleep(BREAK);
                self.0.clear_break()?;
            }
        }
        Ok(())
    }
}

fn addresses(host: &str, port: u16) -> io::Result<Vec<SocketAddr>> {
    let found: Vec<SocketAddr> = (host, port)
        .to_socket_addrs()
        .map_err(|error| io::Error::other(format!("unknown host '{host}': {error}")))?
        .collect();
    if found.is_empty() { Err(io::Error::other(format!("'{host}' has no address"))) } else { Ok(found) }
}

fn tcp(host: &str, port: u16, keep_going: &dyn Fn() -> bool) -> io::Result<Box<dyn Transport>> {
    let mut last = io::Error::other("no address");
    for address in addresses(host, port)? {
        if !keep_going() {
            return Err(io::ErrorKind::Interrupted.into());
        }
        match TcpStream::connect_timeout(&address, CONNECT_TIMEOUT) {
            Ok(stream) => return stream_of(stream),
            Err(error) => last = error,
        }
    }
    let advice = match last.kind() {
        io::ErrorKind::ConnectionRefused => {
            "; nothing listens there: check the port, and that the controller is running"
        }
        io::ErrorKind::TimedOut => "; no answer: check the address and the cable",
        _ => "",
    };
    Err(io::Error::new(last.kind(), format!("cannot connect to {host} port {port}: {last}{advice}")))
}

fn stream_of(stream: TcpStream) -> io::Result<Box<dyn Transport>> {
    stream.set_nodelay(true)?;
    stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
    Ok(Box::new(Stream(stream)))
}

struct Stream(TcpStream);

impl Transport for Stream {
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        self.0.set_read_timeout(Some(wait.max(Duration::from_millis(1))))?;
        bytes_read(self.0.read(buffer), "the other end closed the connection")
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.write_all(bytes).map_err(|error| match error.kind() {
            io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => {
                io::Error::new(io::ErrorKind::TimedOut, "the other end does not read")
            }
            _ => error,
        })
    }
}

fn listen(host: &str, port: u16, keep_going: &dyn Fn() -> bool) -> io::Result<Box<dyn Transport>> {
    const POLL_INTERVAL: Duration = Duration::from_millis(20);
    let listener = TcpListener::bind((host, port))
        .map_err(|error| io::Error::new(error.kind(), format!("cannot listen on {host} port {port}: {error}")))?;
    listener.set_nonblocking(true)?;
    loop {
        match listener.accept() {
            Ok((stream, _)) => {
                stream.set_nonblocking(false)?;
                return stream_of(stream);
            }
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
            Err(error) => return Err(error),
        }
        if !keep_going() {
            return Err(io::ErrorKind::Interrupted.into());
        }
        std::thread::sleep(POLL_INTERVAL);
    }
}

fn udp(host: &str, port: u16) -> io::Result<Box<dyn Transport>> {
    let socket = UdpSocket::bind((host, port))
        .map_err(|error| io::Error::new(error.kind(), format!("cannot listen on {host} port {port}: {error}")))?;
    Ok(Box::new(Datagrams { socket, peer: None, packet: vec![0; MAX_DATAGRAM] }))
}

/// A socket for datagrams to one peer and back.
fn ask(host: &str, port: u16) -> io::Result<Box<dyn Transport>> {
    let mut last = io::Error::other("no address");
    for address in addresses(host, port)? {
        let any: SocketAddr = match address {
            SocketAddr::V4(_) => (Ipv4Addr::UNSPECIFIED, 0).into(),
            SocketAddr::V6(_) => (Ipv6Addr::UNSPECIFIED, 0).into(),
        };
        match UdpSocket::bind(any).and_then(|socket| socket.connect(address).map(|()| socket)) {
            Ok(socket) => {
                return Ok(Box::new(Datagrams { socket, peer: Some(address), packet: vec![0; MAX_DATAGRAM] }));
            }
            Err(error) => last = error,
        }
    }
    Err(io::Error::new(last.kind(), format!("cannot send to {host} port {port}: {last}")))
}

struct Datagrams {
    socket: UdpSocket,
    peer: Option<SocketAddr>,
    packet: Vec<u8>,
}

impl Transport for Datagrams {
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        self.socket.set_read_timeout(Some(wait.max(Duration::from_millis(1))))?;
        let received = match self.socket.recv_from(&mut self.packet) {
            Ok((count, peer)) => {
                self.peer = Some(peer);
                count
            }
            Err(error) if is_timeout(&error) => return Ok(0),
            Err(error) => return Err(error),
        };
        let count = received.min(buffer.len());
        if let (Some(to), Some(from)) = (buffer.get_mut(..count), self.packet.get(..count)) {
            to.copy_from_slice(from);
        }
        Ok(count)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        // Without a received datagram there is no address to answer to.
        let Some(peer) = self.peer else { return Ok(()) };
        let sent =
            if self.socket.peer_addr().is_ok() { self.socket.send(bytes) } else { self.socket.send_to(bytes, peer) };
        sent.map(drop)
    }
}

fn is_timeout(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted)
}

/// Turns a timeout into 0 bytes, and the end of the stream into an error.
fn bytes_read(read: io::Result<usize>, closed: &str) -> io::Result<usize> {
    match read {
        Ok(0) => Err(io::Error::new(io::ErrorKind::UnexpectedEof, closed)),
        Ok(count) => Ok(count),
        Err(error) if is_timeout(&error) => Ok(0),
        Err(error) => Err(error),
    }
}

/// Clock for protocols: time since its start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stopwatch(Instant);

impl Stopwatch {
    #[expect(clippy::disallowed_methods, reason = "a wire is an edge of the program: deadlines need a clock")]
    pub(super) fn start() -> Self {
        Self(Instant::now())
    }

    pub(super) fn now(self) -> Duration {
        self.0.elapsed()
    }
}

/// A listener on this machine for a simulated instrument.
///
/// # Errors
/// No port is available.
pub(super) fn loopback() -> io::Result<(TcpListener, u16)> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
    let port = listener.local_addr()?.port();
    Ok((listener, port))
}
