//! A connection: its bytes in and out, both bounded, and how often it may ask.

use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use super::token_bucket::TokenBucket;
use crate::Peer;
use plcc_protocol::MAX_REQUEST;

/// Requests a second that a client may make in the long run: the rate of a [`TokenBucket`], of which each
/// request takes a token.
const RATE: f64 = 200.0;
/// Requests that a client may make at once after a rest.
const BURST: f64 = 100.0;
/// A client that takes nothing of a reply for so long is disconnected.
const STALL: Duration = Duration::from_secs(10);

/// Whether a connection is still of use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Connected {
    /// It goes on.
    Open,
    /// The client has left, or nothing more is to be sent: the connection is to be dropped.
    Closed,
}

/// A client.
#[derive(Debug)]
pub(super) struct Connection {
    pub(super) stream: UnixStream,
    pub(super) peer: Peer,
    /// A number that no other connection of the server has.
    pub(super) number: u64,
    /// Whether a request of this client waits for its answer; meanwhile no other one is taken.
    pub(super) waits: bool,
    /// When the client last sent or took something.
    pub(super) last_active: Instant,
    /// Whether the connection ends when the reply is sent.
    pub(super) ends: bool,
    /// What was read and not yet taken as a request.
    input: Vec<u8>,
    /// The reply that is being sent.
    output: Vec<u8>,
    /// How many bytes of it are sent.
    sent: usize,
    /// How many requests the client may make now.
    tokens: TokenBucket,
}

impl Connection {
    pub(super) fn new(stream: UnixStream, peer: Peer, number: u64, now: Instant) -> Self {
        Self {
            stream,
            peer,
            number,
            waits: false,
            last_active: now,
            ends: false,
            input: vec![],
            output: vec![],
            sent: 0,
            tokens: TokenBucket::new(RATE, BURST, now),
        }
    }

    /// Whether there is something to send.
    pub(super) fn has_output(&self) -> bool {
        self.sent < self.output.len()
    }

    /// Whether bytes are to be read: the client has its reply to everything before, and has not asked
    /// too often.
    pub(super) fn wants_input(&mut self, now: Instant) -> bool {
        self.tokens.refill(now);
        !self.waits
            && !self.ends
            && !self.has_output()
            && !self.tokens.is_empty()
            && self.input.len() <= MAX_REQUEST
    }

    /// Whether the client has asked so often that it has to wait.
    pub(super) fn is_limited(&self) -> bool {
        self.tokens.is_empty()
    }

    /// Reads what is there.
    pub(super) fn read(&mut self, now: Instant) -> Connected {
        let mut bytes = [0; 8192];
        match self.stream.read(&mut bytes) {
            Ok(0) => Connected::Closed,
            Ok(count) => {
                self.last_active = now;
                self.input.extend(bytes.get(..count).unwrap_or_default());
                Connected::Open
            }
            Err(error) if is_transient(error.kind()) => Connected::Open,
            Err(_) => Connected::Closed,
        }
    }

    /// Whether a request may be taken now.
    fn may_ask(&mut self, now: Instant) -> bool {
        self.tokens.refill(now);
        !(self.waits || self.ends || self.has_output() || self.tokens.is_empty())
    }

    /// Where the first line ends that was read.
    fn line_feed(&self) -> Option<usize> {
        self.input.iter().position(|&byte| byte == b'\n')
    }

    /// Whether [`next_line`](Self::next_line) gives something.
    pub(super) fn has_line(&mut self, now: Instant) -> bool {
        self.may_ask(now) && (self.line_feed().is_some() || self.input.len() >= MAX_REQUEST)
    }

    /// The next whole line that was read, without its line feed. `None` if there is none, or no request
    /// may be taken now; an error if the line is too long.
    pub(super) fn next_line(&mut self, now: Instant) -> Option<Result<Vec<u8>, ()>> {
        if !self.may_ask(now) {
            return None;
        }
        match self.line_feed() {
            Some(end) if end < MAX_REQUEST => {
                self.tokens.take();
                let line = self.input.drain(..=end).take(end).collect();
                Some(Ok(line))
            }
            None if self.input.len() < MAX_REQUEST => None,
            _ => Some(Err(())),
        }
    }

    /// Puts a reply into the output, and sends as much of it as is taken.
    pub(super) fn send(&mut self, reply: Vec<u8>, now: Instant) -> Connected {
        self.waits = false;
        (self.output, self.sent) = (reply, 0);
        self.last_active = now;
        self.flush(now)
    }

    /// Sends as much as is taken.
    pub(super) fn flush(&mut self, now: Instant) -> Connected {
        while let Some(rest) = self.output.get(self.sent..).filter(|rest| !rest.is_empty()) {
            match self.stream.write(rest) {
                Ok(0) => return Connected::Closed,
                Ok(count) => {
                    self.sent += count;
                    self.last_active = now;
                }
                Err(error) if is_transient(error.kind()) => return Connected::Open,
                Err(_) => return Connected::Closed,
            }
        }
        (self.output, self.sent) = (vec![], 0);
        if self.ends { Connected::Closed } else { Connected::Open }
    }

    /// Looks whether the client has left, for a connection from which nothing is to be read now.
    pub(super) fn check_alive(&self) -> Connected {
        use rustix::net::RecvFlags;
        let mut byte = [0_u8];
        let peeked =
            rustix::net::recv(&self.stream, &mut byte[..], RecvFlags::PEEK | RecvFlags::DONTWAIT);
        match peeked {
            Ok((_, 0)) => Connected::Closed,
            Ok(_) | Err(rustix::io::Errno::AGAIN | rustix::io::Errno::INTR) => Connected::Open,
            Err(_) => Connected::Closed,
        }
    }

    /// Whether it has taken nothing of its reply for too long.
    pub(super) fn has_stalled(&self, now: Instant) -> bool {
        self.has_output() && now.saturating_duration_since(self.last_active) > STALL
    }
}

/// Whether an error of a socket only means that the operation is to be tried again later.
fn is_transient(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn connection() -> (Connection, UnixStream, Instant) {
        let (one, other) = UnixStream::pair().unwrap();
        one.set_nonblocking(true).unwrap();
        let now = Instant::now();
        let peer = Peer::of(&one).unwrap();
        (Connection::new(one, peer, 0, now), other, now)
    }

    #[test]
    fn lines_come_one_at_a_time_as_replies_are_taken() {
        let (mut connection, mut client, now) = connection();
        client.write_all(b"one\ntwo\nthr").unwrap();
        assert_eq!(connection.read(now), Connected::Open);
        assert_eq!(connection.next_line(now), Some(Ok(b"one".to_vec())));
        connection.waits = true;
        assert_eq!(connection.next_line(now), None, "the first waits for its answer");
        assert_eq!(connection.send(b"reply\n".to_vec(), now), Connected::Open);
        assert_eq!(connection.next_line(now), Some(Ok(b"two".to_vec())));
        assert_eq!(connection.next_line(now), None, "the third is not whole");
        drop(client);
        assert_eq!(connection.read(now), Connected::Closed);
    }

    #[test]
    fn a_flood_is_slowed_down_to_the_rate() {
        let (mut connection, mut client, now) = connection();
        client.write_all(&b"x\n".repeat(1000)).unwrap();
        assert_eq!(connection.read(now), Connected::Open);
        let mut taken = |at: Instant| std::iter::from_fn(|| connection.next_line(at)).count();
        assert_eq!(taken(now), BURST as usize);
        assert_eq!(taken(now + Duration::from_millis(100)), (RATE / 10.0) as usize);
        assert!(!connection.wants_input(now + Duration::from_millis(100)));
    }

    #[test]
    fn a_line_that_does_not_end_is_refused() {
        let (mut connection, mut client, now) = connection();
        let writer = std::thread::spawn(move || {
            // The reader stops reading, so that this fails in the end.
            let _ = client.write_all(&vec![b'x'; 1 << 20]);
        });
        while connection.next_line(now).is_none() {
            assert_eq!(connection.read(now), Connected::Open);
        }
        assert!(connection.input.len() <= MAX_REQUEST + 8192);
        drop(connection);
        writer.join().unwrap();
    }

    #[test]
    fn a_client_that_takes_no_reply_is_known() {
        let (mut connection, _client, now) = connection();
        assert_eq!(connection.send(vec![b'x'; 4 << 20], now), Connected::Open);
        assert!(connection.has_output() && !connection.wants_input(now));
        assert!(!connection.has_stalled(now + STALL));
        assert!(connection.has_stalled(now + STALL + Duration::from_millis(1)));
    }
}
