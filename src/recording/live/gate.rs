//! The port of the live view. It passes bytes between viewers and the library's server, and bounds what they may ask of it.
//!
//! The library's server takes messages of any length and connections of any number, and keeps them in memory. A viewer only asks for
//! the recording, which takes a few hundred bytes, so a connection that sends much more is not one.

use std::io::{self, Read as _, Write as _};
use std::net::{Ipv4Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

/// Most connections at the same time. A viewer needs one or two.
const MOST_CONNECTIONS: usize = 16;
/// Most bytes that a connection may send in its life. Flow control of a long session takes a hundredth of it.
const MOST_SENT: u64 = 8 << 20;
/// Bytes that are passed on at once.
const PORTION: usize = 64 * 1024;
/// Pause after a connection that could not be taken: at the limit of open files the next one fails at once as well.
const PAUSE: Duration = Duration::from_millis(200);

/// Passes connections to a server until it is dropped.
#[derive(Debug)]
pub(super) struct Gate {
    ended: Arc<AtomicBool>,
    address: SocketAddr,
}

impl Gate {
    /// Passes the connections to `listener` on to the server at `port` of this machine.
    ///
    /// # Errors
    /// The system refuses a thread.
    pub(super) fn open(listener: Arc<TcpListener>, port: u16) -> io::Result<Self> {
        let (ended, address) = (Arc::new(AtomicBool::new(false)), listener.local_addr()?);
        let gate = Self { ended: Arc::clone(&ended), address };
        thread::Builder::new().name("live-gate".to_owned()).spawn(move || accept(&listener, port, &ended))?;
        Ok(gate)
    }
}

impl Drop for Gate {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
        // The thread waits for a connection.
        drop(TcpStream::connect(self.address));
    }
}

fn accept(listener: &TcpListener, port: u16, ended: &AtomicBool) {
    let open = Arc::new(AtomicUsize::new(0));
    while !ended.load(Ordering::Relaxed) {
        let Ok((viewer, _)) = listener.accept() else {
            thread::sleep(PAUSE);
            continue;
        };
        if open.load(Ordering::Relaxed) < MOST_CONNECTIONS && !ended.load(Ordering::Relaxed) {
            let place = Place::take(&open);
            // A connection that cannot be passed on is closed, and the viewer tries again.
            drop(pass(viewer, port, place));
        }
    }
}

/// One of the connections that may be open.
struct Place(Arc<AtomicUsize>);

impl Place {
    fn take(open: &Arc<AtomicUsize>) -> Arc<Self> {
        open.fetch_add(1, Ordering::Relaxed);
        Arc::new(Self(Arc::clone(open)))
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Passes bytes both ways, on two threads.
fn pass(viewer: TcpStream, port: u16, place: Arc<Place>) -> io::Result<()> {
    let server = TcpStream::connect((Ipv4Addr::LOCALHOST, port))?;
    for stream in [&viewer, &server] {
        stream.set_nodelay(true)?;
    }
    let (to_server, to_viewer) = ((viewer.try_clone()?, server.try_clone()?), (server, viewer));
    let of_server = Arc::clone(&place);
    start(move || copy(to_server, MOST_SENT, &place))?;
    start(move || copy(to_viewer, u64::MAX, &of_server))
}

fn start(work: impl FnOnce() + Send + 'static) -> io::Result<()> {
    thread::Builder::new().name("live-pass".to_owned()).spawn(work).map(drop)
}

/// Passes at most `most` bytes on, then closes both ends.
fn copy((mut from, mut to): (TcpStream, TcpStream), most: u64, _place: &Arc<Place>) {
    let mut buffer = vec![0; PORTION];
    let mut passed = 0;
    while let Ok(count @ 1..) = from.read(&mut buffer) {
        passed += count as u64;
        let Some(bytes) = buffer.get(..count).filter(|_| passed <= most) else { break };
        if to.write_all(bytes).is_err() {
            break;
        }
    }
    for stream in [from, to] {
        drop(stream.shutdown(Shutdown::Both));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A server that takes everything; returns the bytes that it has got.
    fn sink() -> (u16, Arc<AtomicUsize>) {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let port = listener.local_addr().unwrap().port();
        let got = Arc::new(AtomicUsize::new(0));
        let counted = Arc::clone(&got);
        let take = move || {
            for stream in listener.incoming().flatten() {
                let counted = Arc::clone(&counted);
                let read = move || {
                    let mut stream = stream;
                    stream.write_all(b"hello").unwrap();
                    let mut buffer = vec![0; PORTION];
                    while let Ok(count @ 1..) = stream.read(&mut buffer) {
                        counted.fetch_add(count, Ordering::Relaxed);
                    }
                };
                thread::Builder::new().spawn(read).unwrap();
            }
        };
        thread::Builder::new().spawn(take).unwrap();
        (port, got)
    }

    fn gate(port: u16) -> (Gate, SocketAddr) {
        let listener = Arc::new(TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap());
        let address = listener.local_addr().unwrap();
        (Gate::open(listener, port).unwrap(), address)
    }

    fn greeting(stream: &mut TcpStream) -> Option<[u8; 5]> {
        let mut greeting = [0; 5];
        stream.read_exact(&mut greeting).ok()?;
        Some(greeting)
    }

    #[test]
    fn an_endless_message_is_cut_off() {
        let (port, got) = sink();
        let (_gate, address) = gate(port);
        let mut flood = TcpStream::connect(address).unwrap();
        assert_eq!(greeting(&mut flood), Some(*b"hello"));
        let portion = vec![0; PORTION];
        let sent = (0..1000).take_while(|_| flood.write_all(&portion).is_ok()).count();
        assert!(sent < 1000, "{sent} portions");
        assert!(got.load(Ordering::Relaxed) as u64 <= MOST_SENT);
        assert_eq!(greeting(&mut TcpStream::connect(address).unwrap()), Some(*b"hello"), "others are served");
    }

    #[test]
    fn idle_connections_are_bounded_and_make_room_when_they_go() {
        let (port, _) = sink();
        let (_gate, address) = gate(port);
        let mut open: Vec<TcpStream> = (0..MOST_CONNECTIONS).map(|_| TcpStream::connect(address).unwrap()).collect();
        assert!(open.iter_mut().all(|stream| greeting(stream).is_some()));
        assert_eq!(greeting(&mut TcpStream::connect(address).unwrap()), None);
        open.clear();
        let again = || greeting(&mut TcpStream::connect(address).ok()?);
        assert!((0..100).any(|_| again().is_some() || {
            thread::sleep(Duration::from_millis(20));
            false
        }));
    }
}
