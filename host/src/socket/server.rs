//! The socket's thread: accepts connections, reads requests, has the thread that runs the ticks carry
//! them out, and replies.

use std::collections::VecDeque;
use std::fs;
use std::io;
use std::os::fd::AsFd;
use std::os::unix::fs::{FileTypeExt, PermissionsExt};
use std::os::unix::net::UnixListener;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::net::{self, AddressFamily, SocketAddrUnix, SocketFlags, SocketType};
use serde_json::Value as Json;
use thiserror::Error;

use super::connection::{Connected, Connection};
use super::peer::Admitted;
use super::requests::{Answered, RequestState, Requests};
use super::token_bucket::TokenBucket;
use crate::Peer;
use crate::journal::EntryKind;
use plcc_files::why_not_written;
use plcc_protocol::{ErrorCode, Failure, MAX_REQUEST, RequestLine, reply};

/// How many clients are connected at most.
const MAX_CLIENTS: usize = 16;
/// Connections a second that are accepted in the long run, of all clients together. Without a limit a client that
/// connects, asks and leaves without end would go round the limit of a connection, and keep this thread busy.
/// The others wait in the listener's queue.
const ACCEPT_RATE: f64 = 50.0;
/// Connections that are accepted at once after a rest.
const ACCEPT_BURST: f64 = MAX_CLIENTS as f64;
/// How many connections wait to be accepted at most; further clients wait in `connect`. With the queue that the
/// system gives otherwise, of 4096, clients that leave again at once could keep others waiting for more than a minute.
const WAITING_CLIENTS: i32 = 64;
/// How long the thread sleeps at most when nothing waits for an answer.
const IDLE: Duration = Duration::from_millis(100);
/// How often it looks for answers. The thread that runs the ticks can't wake it, since that would be
/// a system call.
const ANSWER_WAIT: Duration = Duration::from_millis(1);

/// Why the socket can't be opened.
#[derive(Debug, Error)]
pub enum SocketError {
    /// Another process listens there.
    #[error("the socket {0} is in use by another process")]
    InUse(PathBuf),
    /// There is something else of that name.
    #[error("{0} is not a socket, and is not replaced by one")]
    Other(PathBuf),
    /// The system refuses it.
    #[error("the socket {0} can't be opened: {why}", why = why_not_written(.1))]
    Io(PathBuf, io::Error),
}

/// Opens the socket at `path`, with the permissions `mode` (as in 0o600). A socket that a dead process has left
/// behind is replaced.
///
/// # Errors
/// When a process listens there, something else has that name, or the system refuses it.
fn open(path: &Path, mode: u32) -> Result<UnixListener, SocketError> {
    let failed = |error| SocketError::Io(path.to_owned(), error);
    match fs::symlink_metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {}
        Err(error) => return Err(failed(error)),
        Ok(about) => {
            if !about.file_type().is_socket() {
                return Err(SocketError::Other(path.to_owned()));
            }
            if is_listened_to(path) {
                return Err(SocketError::InUse(path.to_owned()));
            }
            fs::remove_file(path).map_err(failed)?;
        }
    }
    // Nobody else may connect, not even before the mode is set: the socket gets its name last.
    let mut beside = path.as_os_str().to_owned();
    beside.push(format!(".{}.tmp", std::process::id()));
    let beside = PathBuf::from(beside);
    let _ = fs::remove_file(&beside);
    let listener = UnixListener::bind(&beside).map_err(failed)?;
    // The standard library listens with a long queue already; this makes it shorter.
    let result = net::listen(&listener, WAITING_CLIENTS)
        .map_err(io::Error::from)
        .and_then(|()| fs::set_permissions(&beside, fs::Permissions::from_mode(mode)))
        .and_then(|()| listener.set_nonblocking(true))
        .and_then(|()| fs::rename(&beside, path));
    result.map_err(|error| {
        let _ = fs::remove_file(&beside);
        failed(error)
    })?;
    Ok(listener)
}

/// Whether there is a socket at a path and a process listens at it.
pub(crate) fn is_in_use(path: &Path) -> bool {
    let about = fs::symlink_metadata(path);
    about.is_ok_and(|about| about.file_type().is_socket()) && is_listened_to(path)
}

/// Whether a process listens at a socket: only then is a connection not refused. One that accepts none, since
/// it is suspended, is not waited for when its queue is full.
fn is_listened_to(path: &Path) -> bool {
    let connect = || {
        let flags = SocketFlags::NONBLOCK | SocketFlags::CLOEXEC;
        let socket = net::socket_with(AddressFamily::UNIX, SocketType::STREAM, flags, None)?;
        net::connect(&socket, &SocketAddrUnix::new(path)?)
    };
    connect() != Err(Errno::CONNREFUSED)
}

/// The socket and its thread; dropping it ends both.
#[derive(Debug)]
pub(crate) struct Server {
    path: PathBuf,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Server {
    /// Opens the socket and starts the thread. It serves those who are admitted.
    ///
    /// # Errors
    /// When the socket is in use or can't be opened, or there is no thread.
    pub(crate) fn start(
        path: &Path,
        admitted: Admitted,
        requests: Requests,
    ) -> Result<Self, SocketError> {
        // Who connects is checked in any case.
        let mode = if admitted.is_alone() { 0o600 } else { 0o666 };
        let listener = open(path, mode)?;
        let ends = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&ends);
        let body = move || {
            let now = Instant::now();
            SocketThread::new(listener, admitted, requests, now).run(&flag);
        };
        let thread = thread::Builder::new().name("socket".into()).spawn(body);
        let thread = thread.map_err(|error| SocketError::Io(path.to_owned(), error))?;
        Ok(Self { path: path.to_owned(), ends, thread: Some(thread) })
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        // A file that can't be removed is replaced by the next process.
        let _ = fs::remove_file(&self.path);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// The number of no client: nobody waits for the answer.
const NOBODY: u64 = u64::MAX;

/// A request that waits for its answer.
struct Waiting {
    client: u64,
    id: Json,
}

/// What the socket's thread works on.
struct SocketThread {
    listener: UnixListener,
    requests: Requests,
    connections: Vec<Connection>,
    next_number: u64,
    /// How many connections may be accepted now.
    accept_tokens: TokenBucket,
    /// The requests that wait, in the order in which their answers will come.
    waiting: VecDeque<Waiting>,
    /// The request for an online change that is not answered.
    change: Option<Waiting>,
    /// Who is served.
    admitted: Admitted,
}

impl SocketThread {
    fn new(listener: UnixListener, admitted: Admitted, requests: Requests, now: Instant) -> Self {
        let (connections, waiting) = (vec![], VecDeque::new());
        let accept_tokens = TokenBucket::new(ACCEPT_RATE, ACCEPT_BURST, now);
        Self {
            listener,
            requests,
            connections,
            next_number: 0,
            accept_tokens,
            waiting,
            change: None,
            admitted,
        }
    }

    fn run(&mut self, ends: &AtomicBool) {
        while !ends.load(Ordering::Relaxed) {
            let ready = self.wait(Instant::now());
            self.act(&ready, Instant::now());
        }
    }

    /// Serves the listener and the connections that [`wait`](Self::wait) has found `ready` (in its order), and sends the
    /// answers that have come.
    fn act(&mut self, ready: &[bool], now: Instant) {
        if ready.first().is_some_and(|ready| *ready) {
            self.accept(now);
        }
        self.answer(now);
        self.serve(ready.get(1..).unwrap_or_default(), now);
        self.release_keys();
        self.continue_change(now);
    }

    /// Waits until something can be done. Returns whether a connection can be accepted, and then for each
    /// connection whether that is ready.
    fn wait(&mut self, now: Instant) -> Vec<bool> {
        self.accept_tokens.refill(now);
        let mut limited = self.accept_tokens.is_empty();
        let listened = if limited { PollFlags::empty() } else { PollFlags::IN };
        let flags: Vec<PollFlags> = self
            .connections
            .iter_mut()
            .map(|connection| {
                let input = connection.wants_input(now);
                limited |= connection.is_limited();
                if connection.has_output() {
                    PollFlags::OUT
                } else if input {
                    PollFlags::IN
                } else {
                    // `poll` reports in any case that a client has gone.
                    PollFlags::empty()
                }
            })
            .collect();
        let mut fds = vec![PollFd::new(&self.listener, listened)];
        let streams = self.connections.iter().zip(flags);
        fds.extend(
            streams.map(|(connection, flags)| {
                PollFd::from_borrowed_fd(connection.stream.as_fd(), flags)
            }),
        );
        let time = match (self.waiting.is_empty() && self.change.is_none(), limited) {
            (false, _) => ANSWER_WAIT,
            (true, true) => ANSWER_WAIT * 10,
            (true, false) => IDLE,
        };
        let time = Timespec { tv_sec: 0, tv_nsec: i64::from(time.subsec_nanos()) };
        // A signal may end the wait; nothing is ready then. No other failure may keep this thread busy.
        if poll(&mut fds, Some(&time)).is_err_and(|error| error != Errno::INTR) {
            thread::sleep(ANSWER_WAIT);
        }
        fds.iter().map(|fd| !fd.revents().is_empty()).collect()
    }

    fn accept(&mut self, now: Instant) {
        // Also when it fails: where the process may open no more files, the connection stays in the queue, and trying
        // again at once would keep this thread busy.
        self.accept_tokens.take();
        let Ok((stream, _)) = self.listener.accept() else { return };
        if stream.set_nonblocking(true).is_err() {
            return;
        }
        let Ok(peer) = Peer::of(&stream) else { return };
        let admitted = self.admitted.admits(&stream, &peer);
        if self.connections.len() >= MAX_CLIENTS {
            // The one that has done nothing for the longest time makes room.
            let idle = self.connections.iter().enumerate().filter(|(_, c)| !c.waits);
            let oldest = idle.min_by_key(|(_, c)| c.last_active).map(|(at, _)| at);
            match oldest {
                Some(at) => drop(self.connections.remove(at)),
                None => return,
            }
        }
        let mut connection = Connection::new(stream, peer, self.next_number, now);
        self.next_number += 1;
        if !admitted {
            let text = "the socket is for the user who runs the control, for root, and for those whom \
                        --allow-user and --allow-group name";
            let by = connection.peer.clone();
            self.requests.journal.write(EntryKind::Refused { what: "the socket".into(), by });
            connection.ends = true;
            let failure = Err::<(), _>(Failure::new(ErrorCode::Denied, text));
            if connection.send(reply(&Json::Null, failure), now) == Connected::Closed {
                return;
            }
        }
        self.connections.push(connection);
    }

    /// Passes answers on to those who wait for them.
    fn answer(&mut self, now: Instant) {
        while let Some(answered) = self.requests.next_answer() {
            let (waiting, result) = match answered {
                Answered::Request(result) => (self.waiting.pop_front(), result),
                Answered::Change(result) => (self.change.take(), result),
                Answered::ChangeWaits => continue,
            };
            self.reply(waiting, result, now);
        }
    }

    /// Sends the reply to a request that has waited.
    fn reply(&mut self, waiting: Option<Waiting>, result: Result<Json, Failure>, now: Instant) {
        let Some(Waiting { client, id }) = waiting else { return };
        // Who has left needs no answer.
        let Some(at) = self.position(client) else { return };
        if let Some(connection) = self.connections.get_mut(at)
            && connection.send(reply(&id, result), now) == Connected::Closed
        {
            self.connections.remove(at);
        }
    }

    fn position(&self, client: u64) -> Option<usize> {
        self.connections.iter().position(|connection| connection.number == client)
    }

    /// Has the keys of the operator's screen released whose client has left.
    fn release_keys(&mut self) {
        let Self { connections, requests, waiting, .. } = self;
        let is_there = |pid| connections.iter().any(|connection| connection.peer.pid == pid);
        while requests.release_key(is_there) {
            waiting.push_back(Waiting { client: NOBODY, id: Json::Null });
        }
    }

    /// Has an online change go on that waits. When its client has left it is given up.
    fn continue_change(&mut self, now: Instant) {
        if let Some(change) = &self.change
            && self.position(change.client).is_none()
        {
            self.requests.give_up_change("the client that asked for it has left");
        }
        if let Some(result) = self.requests.continue_change(now) {
            let waiting = self.change.take();
            self.reply(waiting, result, now);
        }
    }

    /// Reads and sends on connections that are ready, and takes requests.
    fn serve(&mut self, ready: &[bool], now: Instant) {
        let mut ready = ready.iter().copied();
        let Self { connections, requests, waiting, change, .. } = self;
        connections.retain_mut(|connection| {
            let ready = ready.next().unwrap_or(false);
            if connection.has_stalled(now) {
                return false;
            }
            if ready {
                let state = match connection.has_output() {
                    true => connection.flush(now),
                    false if connection.wants_input(now) => connection.read(now),
                    false if connection.is_limited() => Connected::Open,
                    // It waits for an answer, and its client has gone.
                    false => connection.check_alive(),
                };
                if state == Connected::Closed {
                    return false;
                }
            }
            while connection.has_line(now)
                && requests.takes_requests()
                && let Some(line) = connection.next_line(now)
            {
                let Ok(line) = line else {
                    connection.ends = true;
                    let text = format!("a request has at most {MAX_REQUEST} bytes");
                    let failure = Err::<(), _>(Failure::new(ErrorCode::TooLarge, text));
                    return connection.send(reply(&Json::Null, failure), now) == Connected::Open;
                };
                let RequestLine { id, request } = RequestLine::parse(&line);
                let outcome = match request {
                    Ok(request) => requests.handle(request, &connection.peer),
                    Err(failure) => RequestState::Done(Err(failure)),
                };
                match outcome {
                    RequestState::Done(result) => {
                        if connection.send(reply(&id, result), now) == Connected::Closed {
                            return false;
                        }
                    }
                    RequestState::Pending => {
                        connection.waits = true;
                        waiting.push_back(Waiting { client: connection.number, id });
                    }
                    RequestState::Changing => {
                        connection.waits = true;
                        *change = Some(Waiting { client: connection.number, id });
                    }
                }
            }
            true
        });
    }
}

#[cfg(test)]
mod tests {
    use std::os::fd::OwnedFd;
    use std::os::unix::net::UnixStream;

    use super::*;
    use crate::socket::tests;

    #[test]
    fn clients_that_connect_and_leave_again_and_again_are_slowed_down_to_the_rate() {
        let temporary = tempfile::tempdir().unwrap();
        let folder = temporary.path();
        let path = folder.join("socket");
        let listener = open(&path, 0o600).unwrap();
        let now = Instant::now();
        let (requests, _scan_end) = tests::requests();
        let admitted = Admitted::new(&[], &[]);
        let mut thread = SocketThread::new(listener, admitted, requests, now);
        // No more than wait to be accepted, since nobody accepts any meanwhile.
        for _ in 0..WAITING_CLIENTS {
            drop(UnixStream::connect(&path).unwrap());
        }
        // How many are accepted when the clock stands still at `now`: it goes on until nothing more is ready.
        let mut accepted_at = |now: Instant| {
            let before = thread.next_number;
            while let ready = thread.wait(now)
                && ready.contains(&true)
            {
                thread.act(&ready, now);
            }
            assert!(thread.connections.is_empty(), "all of them have left");
            thread.next_number - before
        };
        assert_eq!(accepted_at(now), ACCEPT_BURST as u64);
        assert_eq!(accepted_at(now), 0);
        assert_eq!(accepted_at(now + Duration::from_millis(200)), (ACCEPT_RATE / 5.0) as u64);
        assert_eq!(accepted_at(now + Duration::from_secs(60)), ACCEPT_BURST as u64);
    }

    #[test]
    fn attempts_to_accept_that_fail_are_slowed_down_too() {
        let now = Instant::now();
        let (requests, _scan_end) = tests::requests();
        // A socket that does not listen.
        let listener = UnixListener::from(OwnedFd::from(UnixStream::pair().unwrap().0));
        let mut thread = SocketThread::new(listener, Admitted::new(&[], &[]), requests, now);
        for _ in 0..ACCEPT_BURST as usize {
            thread.accept(now);
        }
        assert!(thread.connections.is_empty() && thread.accept_tokens.is_empty());
    }

    #[test]
    fn few_connections_wait_to_be_accepted() {
        let temporary = tempfile::tempdir().unwrap();
        let folder = temporary.path();
        let path = folder.join("socket");
        let _listener = open(&path, 0o600).unwrap();
        let connect = || {
            let flags = SocketFlags::NONBLOCK | SocketFlags::CLOEXEC;
            let socket = net::socket_with(AddressFamily::UNIX, SocketType::STREAM, flags, None)?;
            net::connect(&socket, &SocketAddrUnix::new(&path)?)
        };
        // Linux takes one more than the length of the queue.
        let waiting = (0..1000).take_while(|_| connect().is_ok()).count();
        assert!(waiting <= WAITING_CLIENTS as usize + 1, "{waiting}");
        assert_eq!(connect(), Err(Errno::AGAIN));
    }

    #[test]
    fn a_dead_process_socket_is_replaced_and_a_living_one_is_not() {
        let temporary = tempfile::tempdir().unwrap();
        let folder = temporary.path();
        let path = folder.join("socket");
        let first = open(&path, 0o600).unwrap();
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        assert!(matches!(open(&path, 0o600), Err(SocketError::InUse(_))));
        drop(first);
        let second = open(&path, 0o666).unwrap();
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o666);
        drop(second);
        fs::remove_file(&path).unwrap();
        fs::write(&path, "text").unwrap();
        assert!(matches!(open(&path, 0o600), Err(SocketError::Other(_))));
        assert!(matches!(open(&folder.join("no/socket"), 0o600), Err(SocketError::Io(..))));
        assert_eq!(fs::read_dir(folder).unwrap().count(), 1, "nothing is left over");
    }
}
