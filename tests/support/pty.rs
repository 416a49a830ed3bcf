//! The program in a real pseudo-terminal, with what that shows.
//!
//! Nothing waits for time to pass: a wait ends when the output makes its condition true, and fails at a deadline.

use std::fs;
use std::io::{Read as _, Write};
use std::num::NonZeroU16;
use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use portable_pty::{Child, CommandBuilder, MasterPty, PtySize, native_pty_system};

/// Longest wait for something to be shown.
pub(crate) const PATIENCE: Duration = Duration::from_secs(20);

/// Keys as a terminal sends them.
pub(crate) const ENTER: &str = "\r";
pub(crate) const CTRL_U: &str = "\u{15}";
pub(crate) const CTRL_L: &str = "\u{c}";
pub(crate) const CTRL_Z: &str = "\u{1a}";

/// What the terminal shows, and everything that was written to it.
pub(crate) struct Shown {
    parser: vt100::Parser,
    pub(crate) raw: Vec<u8>,
    is_over: bool,
}

impl Shown {
    pub(crate) fn screen(&self) -> &vt100::Screen {
        self.parser.screen()
    }

    pub(crate) fn text(&self) -> String {
        self.screen().contents()
    }

    pub(crate) fn has(&self, text: &str) -> bool {
        self.text().contains(text)
    }

    /// Number of the step in the header.
    pub(crate) fn step(&self) -> Option<u32> {
        let text = self.text();
        let (_, rest) = text.split_once("step ")?;
        rest.split_once(" of 8: ")?.0.parse().ok()
    }

    /// Samples in the header.
    pub(crate) fn samples(&self) -> usize {
        let text = self.text();
        let line = text.lines().nth(1).unwrap_or_default();
        let part = line.split(" · ").find(|part| part.ends_with(" samples") || part.ends_with(" sample"));
        part.and_then(|part| part.split(' ').next()?.parse().ok()).unwrap_or(0)
    }
}

struct Shared {
    shown: Mutex<Shown>,
    news: Condvar,
    is_leaving: AtomicBool,
}

/// A terminal in which a program runs.
pub(crate) struct Terminal {
    shared: Arc<Shared>,
    master: Option<Box<dyn MasterPty + Send>>,
    writer: Option<Box<dyn Write + Send>>,
    child: Box<dyn Child + Send + Sync>,
    reader: Option<JoinHandle<()>>,
    pub(crate) started: Instant,
}

fn cells(size: u16) -> NonZeroU16 {
    NonZeroU16::new(size).unwrap_or(NonZeroU16::MIN)
}

const fn pty_size((columns, rows): (u16, u16)) -> PtySize {
    PtySize { rows, cols: columns, pixel_width: 0, pixel_height: 0 }
}

impl Terminal {
    /// The program with `arguments` in `folder`, in a terminal of so many columns and rows.
    pub(crate) fn start(folder: &Path, arguments: &[&str], size: (u16, u16)) -> Self {
        Self::start_with(folder, env!("CARGO_BIN_EXE_trupose"), arguments, size, &[])
    }

    pub(crate) fn start_with(
        folder: &Path,
        program: &str,
        arguments: &[&str],
        size: (u16, u16),
        variables: &[(&str, &str)],
    ) -> Self {
        let pair = native_pty_system().openpty(pty_size(size)).unwrap();
        let mut command = CommandBuilder::new(program);
        command.args(arguments);
        command.cwd(folder);
        for name in ["NO_COLOR", "LC_ALL", "LC_CTYPE"] {
            command.env_remove(name);
        }
        command.env("TERM", "xterm-256color");
        command.env("LANG", "C.UTF-8");
        for (name, value) in variables {
            command.env(name, value);
        }
        let started = Instant::now();
        let child = pair.slave.spawn_command(command).unwrap();
        drop(pair.slave);
        let parser = vt100::Parser::new(cells(size.1), cells(size.0), 0);
        let shared = Arc::new(Shared {
            shown: Mutex::new(Shown { parser, raw: Vec::new(), is_over: false }),
            news: Condvar::new(),
            is_leaving: AtomicBool::new(false),
        });
        let mut output = pair.master.try_clone_reader().unwrap();
        let writer = pair.master.take_writer().unwrap();
        let of_reader = Arc::clone(&shared);
        let read = move || {
            let mut bytes = [0; 16_384];
            loop {
                // With the last one at the other end gone, Linux says EIO.
                let count = output.read(&mut bytes).unwrap_or(0);
                let mut shown = of_reader.shown.lock().unwrap();
                shown.parser.process(&bytes[..count]);
                shown.raw.extend_from_slice(&bytes[..count]);
                let is_last = count == 0 || of_reader.is_leaving.load(Ordering::SeqCst);
                shown.is_over = is_last;
                drop(shown);
                of_reader.news.notify_all();
                if is_last {
                    break;
                }
            }
        };
        let reader = thread::Builder::new().name("pty".to_owned()).spawn(read).unwrap();
        Self { shared, master: Some(pair.master), writer: Some(writer), child, reader: Some(reader), started }
    }

    /// Types.
    pub(crate) fn send(&mut self, keys: &str) {
        self.send_bytes(keys.as_bytes());
    }

    pub(crate) fn send_bytes(&mut self, bytes: &[u8]) {
        let writer = self.writer.as_mut().unwrap();
        writer.write_all(bytes).unwrap();
        writer.flush().unwrap();
    }

    /// Whether the output makes `condition` true within `patience`; looked at whenever there is more of it.
    pub(crate) fn comes(&self, patience: Duration, mut condition: impl FnMut(&Shown) -> bool) -> bool {
        let end = Instant::now() + patience;
        let mut shown = self.shared.shown.lock().unwrap();
        loop {
            if condition(&shown) {
                return true;
            }
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() || shown.is_over {
                return false;
            }
            shown = self.shared.news.wait_timeout(shown, left).unwrap().0;
        }
    }

    #[track_caller]
    pub(crate) fn wait_for(&self, what: &str, condition: impl FnMut(&Shown) -> bool) {
        assert!(self.comes(PATIENCE, condition), "{what} does not come:\n{}", self.text());
    }

    #[track_caller]
    pub(crate) fn wait_for_text(&self, text: &str) {
        self.wait_for(text, |shown| shown.has(text));
    }

    #[track_caller]
    pub(crate) fn wait_for_step(&self, step: u32) {
        self.wait_for(&format!("step {step}"), |shown| shown.step() == Some(step));
    }

    /// Types again and again until it has its effect: what is under way may be in its way.
    #[track_caller]
    pub(crate) fn send_until(&mut self, keys: &str, what: &str, mut condition: impl FnMut(&Shown) -> bool) {
        for _ in 0..60 {
            self.send(keys);
            if self.comes(Duration::from_millis(500), &mut condition) {
                return;
            }
        }
        panic!("{what} does not come by {keys:?}:\n{}", self.text());
    }

    pub(crate) fn text(&self) -> String {
        self.look(Shown::text)
    }

    pub(crate) fn look<T>(&self, look: impl FnOnce(&Shown) -> T) -> T {
        look(&self.shared.shown.lock().unwrap())
    }

    /// Everything that was written so far.
    pub(crate) fn raw(&self) -> Vec<u8> {
        self.look(|shown| shown.raw.clone())
    }

    /// Bytes written so far.
    pub(crate) fn written(&self) -> usize {
        self.look(|shown| shown.raw.len())
    }

    /// Bytes written, and when the last of them came, once nothing has come for `quiet` after at least one has.
    pub(crate) fn burst(&self, before: usize, quiet: Duration) -> (usize, Instant) {
        self.wait_for("output", |shown| shown.raw.len() > before);
        loop {
            let (seen, at) = (self.written(), Instant::now());
            if !self.comes(quiet, |shown| shown.raw.len() > seen) {
                return (seen - before, at);
            }
        }
    }

    pub(crate) fn resize(&self, size: (u16, u16)) {
        self.shared.shown.lock().unwrap().parser.set_size(cells(size.1), cells(size.0));
        self.master.as_ref().unwrap().resize(pty_size(size)).unwrap();
    }

    /// The modes of the line, as text.
    pub(crate) fn modes(&self) -> String {
        format!("{:?}", self.master.as_ref().unwrap().get_termios().unwrap())
    }

    pub(crate) fn process(&self) -> u32 {
        self.child.process_id().unwrap()
    }

    pub(crate) fn signal(&self, name: &str) {
        signal(self.process(), name);
    }

    /// The line goes down: nobody is at the other end any more.
    pub(crate) fn hang_up(&mut self) {
        self.shared.is_leaving.store(true, Ordering::SeqCst);
        // Its reader has to read something to let go.
        self.send(CTRL_L);
        self.reader.take().unwrap().join().unwrap();
        self.writer = None;
        self.master = None;
    }

    /// Exit code of the program, which must end within `patience`, and the processor time (s) it has used from `since` on.
    #[track_caller]
    pub(crate) fn end(&mut self, patience: Duration, since: f64) -> (u32, f64) {
        let end = Instant::now() + patience;
        while !has_ended(self.process()) {
            assert!(Instant::now() < end, "it does not end within {patience:?}:\n{}", self.text());
            thread::yield_now();
            thread::park_timeout(Duration::from_millis(2));
        }
        let used = processor_seconds(self.process()) - since;
        let status = self.child.wait().unwrap();
        assert_eq!(status.signal(), None, "it was killed");
        (status.exit_code(), used)
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

fn signal(process: u32, name: &str) {
    assert!(Command::new("kill").args(["-s", name, &process.to_string()]).status().unwrap().success());
}

/// Fields of /proc/PID/stat behind the name.
fn stat(process: u32) -> Vec<String> {
    let text = fs::read_to_string(format!("/proc/{process}/stat")).unwrap();
    let (_, fields) = text.rsplit_once(") ").unwrap();
    fields.split(' ').map(str::to_owned).collect()
}

/// Whether it has ended, or is gone.
fn has_ended(process: u32) -> bool {
    matches!(stat(process)[0].as_str(), "Z" | "X")
}

/// Processor time (s) of a process, in user and kernel mode.
pub(crate) fn processor_seconds(process: u32) -> f64 {
    let fields = stat(process);
    // Fields 14 and 15 of proc(5), in hundredths of a second.
    let ticks = |field: usize| fields[field].parse::<f64>().unwrap();
    (ticks(11) + ticks(12)) / 100.0
}
