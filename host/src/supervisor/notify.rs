//! Tells the outside that a control is well: systemd, by its notification socket, and a hardware watchdog,
//! which restarts the computer when nobody writes to it.
//!
//! The crate sd-notify is not used: it waits until systemd takes a message, and the thread that watches the control must wait for
//! nobody.

use std::env;
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use plcc_files::why_not_written;

/// Time between two writes to the hardware watchdog.
const FEED_INTERVAL: Duration = Duration::from_secs(1);

/// Tells systemd and the hardware watchdog that the control is well, as far as there are such.
#[derive(Debug)]
pub(super) struct Notifier {
    /// A socket, and the address at which systemd listens.
    socket: Option<(UnixDatagram, SocketAddr)>,
    /// How often systemd wants to hear that all is well, if it does.
    interval: Option<Duration>,
    /// When it is told that next.
    next: Instant,
    /// The hardware watchdog.
    device: Option<File>,
    /// When it is written to next.
    next_feed: Instant,
    /// Whether systemd was told that the control runs.
    ready: bool,
}

impl Notifier {
    /// Reads from the environment what systemd expects, and opens the hardware watchdog, if there is to be one.
    ///
    /// # Errors
    /// Why the hardware watchdog can't be opened.
    pub(super) fn new(device: Option<&Path>) -> Result<Self, String> {
        let now = Instant::now();
        let socket = env::var_os("NOTIFY_SOCKET").and_then(|path| {
            let address = address(&PathBuf::from(path))?;
            let socket = UnixDatagram::unbound().ok()?;
            // The thread that watches the control must not wait for systemd.
            socket.set_nonblocking(true).ok()?;
            Some((socket, address))
        });
        let interval = env::var("WATCHDOG_USEC").ok().and_then(|text| text.parse().ok());
        let device = device.map(|path| {
            // A FIFO without a reader is refused rather than waited for, and nobody is waited for later.
            let flags = rustix::fs::OFlags::NONBLOCK.bits() as i32;
            let opened = File::options().write(true).custom_flags(flags).open(path);
            opened.map_err(|error| {
                let why = match error.kind() {
                    ErrorKind::NotFound => "there is no such device".into(),
                    _ => why_not_written(&error),
                };
                format!("the hardware watchdog {} can't be opened: {why}", path.display())
            })
        });
        Ok(Self {
            socket,
            // Half of the time after which systemd acts, as its manual recommends.
            interval: interval.map(|time: u64| Duration::from_micros(time / 2)),
            next: now,
            device: device.transpose()?,
            next_feed: now,
            ready: false,
        })
    }

    /// The control is well and has run so many ticks.
    pub(super) fn well(&mut self, ticks: u64, now: Instant) {
        if !self.ready {
            self.ready = true;
            self.send("READY=1\nSTATUS=running\n");
        }
        if self.is_time(now) {
            self.send(&format!("WATCHDOG=1\nSTATUS=running, {ticks} ticks\n"));
        }
        if now >= self.next_feed {
            self.next_feed = now + FEED_INTERVAL;
            self.feed(b"\0");
        }
    }

    /// No control runs ticks: one that has died is about to be started again, or one starts or ends, for which the supervisor itself
    /// gives it a limited time. So systemd must not take the supervisor to hang. The hardware watchdog is told nothing of it.
    pub(super) fn waiting(&mut self, now: Instant) {
        if self.ready && self.is_time(now) {
            self.send("WATCHDOG=1\n");
        }
    }

    /// Whether it is time to tell systemd that all is well.
    fn is_time(&mut self, now: Instant) -> bool {
        let Some(interval) = self.interval.filter(|_| now >= self.next) else { return false };
        self.next = now + interval;
        true
    }

    /// The control ends in good order, so that the hardware watchdog is to stop, too.
    pub(super) fn end(&mut self) {
        self.send("STOPPING=1\n");
        self.feed(b"V");
    }

    /// Sends systemd a sentence that `systemctl status` shows.
    pub(super) fn status(&mut self, text: &str) {
        self.send(&format!("STATUS={text}\n"));
    }

    fn send(&self, text: &str) {
        if let Some((socket, address)) = &self.socket {
            // systemd that does not listen is not a reason to do anything else.
            let _ = socket.send_to_addr(text.as_bytes(), address);
        }
    }

    fn feed(&mut self, bytes: &[u8]) {
        if let Some(device) = &mut self.device {
            // When it can't be written, it restarts the computer, as it should.
            let _ = device.write_all(bytes);
        }
    }
}

/// The address of a socket: a path, or on Linux a name without a file after `@`.
fn address(path: &Path) -> Option<SocketAddr> {
    #[cfg(target_os = "linux")]
    {
        use std::os::linux::net::SocketAddrExt;
        use std::os::unix::ffi::OsStrExt;
        if let Some(name) = path.as_os_str().as_bytes().strip_prefix(b"@") {
            return SocketAddr::from_abstract_name(name).ok();
        }
    }
    SocketAddr::from_pathname(path).ok()
}
