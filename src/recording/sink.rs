//! The file of a recording: what is written is on disk once it is flushed, and an error is told.
//!
//! The library's own file sink ends with the first error, says nothing of its cause, and can wait for ever for a writer that
//! is gone. This one keeps the first error and goes on without the file.

use std::fs::File;
use std::io::Write;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rerun::external::re_build_info::CrateVersion;
use rerun::external::re_log_encoding::{Encoder, EncodingOptions};
use rerun::log::LogMsg;
use rerun::sink::{LogSink, SinkFlushError};

/// A file, or something that behaves like one in a test.
pub(super) trait Medium: Write + Send + 'static {
    /// Forces to disk what was written.
    ///
    /// # Errors
    /// What the system says.
    fn sync(&mut self) -> std::io::Result<()>;
}

impl Medium for File {
    fn sync(&mut self) -> std::io::Result<()> {
        self.sync_data()
    }
}

/// The medium behind a lock: the encoder writes to it, and the sink forces it to disk.
#[derive(Clone)]
struct Shared(Arc<Mutex<Box<dyn Medium>>>);

impl Write for Shared {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        locked(&self.0).write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        locked(&self.0).flush()
    }
}

fn locked<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Writes a recording so that a flush means that it is on disk.
pub(super) struct DurableSink {
    encoder: Mutex<Option<Encoder<Shared>>>,
    medium: Shared,
    failed: Mutex<Option<String>>,
}

impl DurableSink {
    /// Writes to `medium`, which is empty.
    ///
    /// # Errors
    /// The header cannot be written.
    pub(super) fn new(medium: impl Medium) -> Result<Self, String> {
        let medium = Shared(Arc::new(Mutex::new(Box::new(medium))));
        let encoder = Encoder::new_eager(CrateVersion::LOCAL, EncodingOptions::PROTOBUF_COMPRESSED, medium.clone())
            .map_err(|error| cause(&error))?;
        Ok(Self { encoder: Mutex::new(Some(encoder)), medium, failed: Mutex::new(None) })
    }

    /// Keeps the first error. What was written stays readable; nothing follows it, so no index is written behind a gap.
    fn fail(&self, message: String) {
        if let Some(mut encoder) = locked(&self.encoder).take() {
            encoder.do_not_emit_footer();
        }
        locked(&self.failed).get_or_insert(message);
    }
}

/// The message of an error with those of its causes.
fn cause(error: &(dyn std::error::Error + 'static)) -> String {
    let chain = std::iter::successors(Some(error), |error| error.source());
    // Some say their cause themselves.
    let mut texts: Vec<String> = chain.map(ToString::to_string).collect();
    texts.dedup_by(|cause, said| said.ends_with(&**cause));
    texts.join(": ")
}

impl LogSink for DurableSink {
    fn send(&self, message: LogMsg) {
        let result = match locked(&self.encoder).as_mut() {
            Some(encoder) => encoder.append(&message).map(|_bytes| ()),
            None => Ok(()),
        };
        if let Err(error) = result {
            self.fail(cause(&error));
        }
    }

    fn flush_blocking(&self, _timeout: Duration) -> Result<(), SinkFlushError> {
        if locked(&self.failed).is_none() {
            let synced = locked(&self.medium.0).sync();
            if let Err(error) = synced {
                self.fail(error.to_string());
            }
        }
        locked(&self.failed).as_ref().map_or(Ok(()), |message| Err(SinkFlushError::failed(message.clone())))
    }

    fn defers_finalization_to_shutdown(&self) -> bool {
        true
    }
}

impl Drop for DurableSink {
    fn drop(&mut self) {
        // The index is a convenience: a file without it is read all the same, and the next merge makes a new one.
        if let Some(mut encoder) = locked(&self.encoder).take()
            && encoder.finish().is_ok()
        {
            drop(locked(&self.medium.0).sync());
        }
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::disallowed_methods, reason = "deadlines of tests")]

    use std::io;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::Instant;

    use rerun::external::re_log_encoding::DecoderApp;
    use rerun::{RecordingStreamBuilder, TextDocument};

    use super::*;

    /// A disk with little room.
    struct Small {
        held: Arc<Mutex<Vec<u8>>>,
        room: usize,
        synced: Arc<AtomicUsize>,
    }

    impl Write for Small {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let mut held = locked(&self.held);
            let count = bytes.len().min(self.room - held.len());
            if count == 0 && !bytes.is_empty() {
                return Err(io::Error::from(io::ErrorKind::StorageFull));
            }
            held.extend_from_slice(&bytes[..count]);
            Ok(count)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Medium for Small {
        fn sync(&mut self) -> io::Result<()> {
            self.synced.fetch_add(1, Ordering::Relaxed);
            Ok(())
        }
    }

    #[test]
    fn a_full_disk_is_told_at_once_with_its_cause_and_keeps_what_was_written() {
        let (held, synced) = (Arc::new(Mutex::new(Vec::new())), Arc::new(AtomicUsize::new(0)));
        let medium = Small { held: Arc::clone(&held), room: 40_000, synced: Arc::clone(&synced) };
        let sink = DurableSink::new(medium).unwrap();
        let stream = RecordingStreamBuilder::new("test")
            .enabled(true)
            .set_sinks(vec![Box::new(sink) as Box<dyn LogSink>])
            .unwrap();
        let mut flushed = 0;
        let error = loop {
            assert!(flushed < 1000, "the disk never got full");
            stream.set_time_sequence("pose", flushed);
            // Texts that cannot be compressed away.
            let text = crate::session::sha256(flushed.to_string().as_bytes());
            stream.log("text", &TextDocument::new(text)).unwrap();
            let begun = Instant::now();
            let result = stream.flush_with_timeout(Duration::from_secs(5));
            assert!(begun.elapsed() < Duration::from_secs(1));
            match result {
                Ok(()) => flushed += 1,
                Err(error) => break error.to_string(),
            }
        };
        assert!(flushed > 3);
        assert!(error.contains("no storage space"), "{error}");
        assert!(synced.load(Ordering::Relaxed) >= usize::try_from(flushed).unwrap());
        // It stays so, and ends in good time.
        assert!(stream.flush_with_timeout(Duration::from_secs(5)).is_err());
        let begun = Instant::now();
        drop(stream);
        assert!(begun.elapsed() < Duration::from_secs(5));
        let bytes = locked(&held).clone();
        let rows = DecoderApp::decode_lazy(bytes.as_slice())
            .filter_map(Result::ok)
            .filter(|message| matches!(message, LogMsg::ArrowMsg(store, _) if store.is_recording()))
            .count();
        assert!(rows >= usize::try_from(flushed).unwrap(), "{rows} messages of {flushed} flushed rows");
    }
}
