//! A file system that is soon full.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use super::skip;

/// A small file system in memory.
pub(crate) struct SmallDisk(pub(crate) PathBuf);

impl SmallDisk {
    /// Makes one of this size at `path`; where that is not allowed the test is skipped.
    pub(crate) fn mount(path: PathBuf, kilobytes: usize) -> Option<Self> {
        fs::create_dir(&path).unwrap();
        let mut mount = Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", &format!("size={kilobytes}k"), "tmpfs"]).arg(&path);
        if mount.output().is_ok_and(|output| output.status.success()) {
            return Some(Self(path));
        }
        skip("no right to mount a tmpfs");
        None
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        drop(Command::new("umount").arg(&self.0).output());
    }
}
