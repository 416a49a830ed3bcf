//! Wires: serial ports, TCP both ways, UDP. Reads wait a moment and no longer; what is closed says so.

use std::io::{self, Read as _, Write as _};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream, ToSocketAddrs as _, UdpSocket};
use std::time::{Duration, Instant};

use serialport::SerialPort;

use crate::session::wire::Route;

/// Longest time to connect.
const CONNECT: Duration = Duration::from_secs(5);
/// Longest time that a write may take: a peer that does not read is lost.
const WRITE: Duration = Duration::from_secs(5);
/// Longest datagram.
const DATAGRAM: usize = 65_536;

/// A connected wire.
pub(super) trait Transport: Send {
    /// Reads what is there, waits up to `wait` for it; nothing came: 0.
    ///
    /// # Errors
    /// The wire is closed or broken.
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize>;

    /// Writes everything.
    ///
    /// # Errors
    /// The wire is closed or broken, or the peer does not read.
    fn write(&mut self, bytes: &[u8]) -> io::Result<()>;
}

/// Connects; asks `keep_going` while it waits for somebody.
///
/// # Errors
/// Nobody is there, with what to do about it in the message; [`io::ErrorKind::Interrupted`] once `keep_going` says no.
pub(super) fn connect(route: &Route, keep_going: &dyn Fn() -> bool) -> io::Result<Box<dyn Transport>> {
    match route {
        Route::Serial { device, speed } => serial(device, *speed),
        Route::Tcp { host, port } => tcp(host, *port, keep_going),
        Route::Listen { host, port } => listen(host, *port, keep_going),
        Route::Udp { host, port } => udp(host, *port),
    }
}

fn serial(device: &str, speed: u32) -> io::Result<Box<dyn Transport>> {
    let port = serialport::new(device, speed).timeout(WRITE).open().map_err(|error| {
        let advice = match error.kind() {
            serialport::ErrorKind::Io(io::ErrorKind::PermissionDenied) => {
                "; the user must belong to the group of the device, often 'dialout'"
            }
            serialport::ErrorKind::NoDevice => "; another program may use it",
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
        patient(self.0.read(buffer), "the serial port is gone; is the adapter still plugged in?")
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.set_timeout(WRITE)?;
        self.0.write_all(bytes)?;
        self.0.flush()
    }
}

fn addresses(host: &str, port: u16) -> io::Result<Vec<SocketAddr>> {
    let found: Vec<SocketAddr> = (host, port)
        .to_socket_addrs()
        .map_err(|error| io::Error::other(format!("'{host}' is no known host: {error}")))?
        .collect();
    if found.is_empty() { Err(io::Error::other(format!("'{host}' has no address"))) } else { Ok(found) }
}

fn tcp(host: &str, port: u16, keep_going: &dyn Fn() -> bool) -> io::Result<Box<dyn Transport>> {
    let mut last = io::Error::other("no address");
    for address in addresses(host, port)? {
        if !keep_going() {
            return Err(io::ErrorKind::Interrupted.into());
        }
        match TcpStream::connect_timeout(&address, CONNECT) {
            Ok(stream) => return stream_of(stream),
            Err(error) => last = error,
        }
    }
    let advice = match last.kind() {
        io::ErrorKind::ConnectionRefused => "; nothing listens there: is it the right port, and is the controller up?",
        io::ErrorKind::TimedOut => "; nobody answers: is it the right address, and is the cable in?",
        _ => "",
    };
    Err(io::Error::new(last.kind(), format!("cannot connect to {host} port {port}: {last}{advice}")))
}

fn stream_of(stream: TcpStream) -> io::Result<Box<dyn Transport>> {
    stream.set_nodelay(true)?;
    stream.set_write_timeout(Some(WRITE))?;
    Ok(Box::new(Stream(stream)))
}

struct Stream(TcpStream);

impl Transport for Stream {
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        self.0.set_read_timeout(Some(wait.max(Duration::from_millis(1))))?;
        patient(self.0.read(buffer), "the other end has closed the connection")
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
    const LOOK: Duration = Duration::from_millis(20);
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
        std::thread::sleep(LOOK);
    }
}

fn udp(host: &str, port: u16) -> io::Result<Box<dyn Transport>> {
    let socket = UdpSocket::bind((host, port))
        .map_err(|error| io::Error::new(error.kind(), format!("cannot listen on {host} port {port}: {error}")))?;
    Ok(Box::new(Datagrams { socket, peer: None, packet: vec![0; DATAGRAM] }))
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
            Err(error) if is_patience(&error) => return Ok(0),
            Err(error) => return Err(error),
        };
        let count = received.min(buffer.len());
        if let (Some(to), Some(from)) = (buffer.get_mut(..count), self.packet.get(..count)) {
            to.copy_from_slice(from);
        }
        Ok(count)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        // Nobody has spoken yet: there is nobody to answer.
        let Some(peer) = self.peer else { return Ok(()) };
        self.socket.send_to(bytes, peer).map(drop)
    }
}

fn is_patience(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted)
}

/// Nothing within the time is no error; an end is.
fn patient(read: io::Result<usize>, closed: &str) -> io::Result<usize> {
    match read {
        Ok(0) => Err(io::Error::new(io::ErrorKind::UnexpectedEof, closed)),
        Ok(count) => Ok(count),
        Err(error) if is_patience(&error) => Ok(0),
        Err(error) => Err(error),
    }
}

/// Time since the first of its moments, for protocols.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stopwatch(Instant);

impl Stopwatch {
    /// Starts now.
    #[expect(clippy::disallowed_methods, reason = "a wire is an edge of the program: deadlines need a clock")]
    pub(super) fn start() -> Self {
        Self(Instant::now())
    }

    /// Time since the start.
    pub(super) fn now(self) -> Duration {
        self.0.elapsed()
    }
}

/// A listener on this machine for a simulated instrument.
///
/// # Errors
/// The system refuses.
pub(super) fn loopback() -> io::Result<(TcpListener, u16)> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
    let port = listener.local_addr()?.port();
    Ok((listener, port))
}
