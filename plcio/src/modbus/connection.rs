//! A connection of a client to the server. It ends when the client asks nothing for a while, so that clients that
//! have vanished, never finish a request, or never read an answer do not take the places of others.

use std::future::Future;
use std::io;
use std::pin::Pin;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::task::{Context, Poll};
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;
use tokio::time::{Instant, Sleep, sleep_until};

/// What is known of a client: shared by its connection and by what answers it.
#[derive(Debug)]
pub(super) struct Client {
    /// When it has asked last.
    asked: Mutex<Instant>,
    /// Why its connection ended, where it has not closed it.
    why: OnceLock<String>,
}

impl Client {
    /// A client that connects now.
    pub(super) fn new() -> Self {
        Self { asked: Mutex::new(Instant::now()), why: OnceLock::new() }
    }

    /// Notes that the client asks something now.
    pub(super) fn asks(&self) {
        *self.asked.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
    }

    /// Why its connection ended, where it has not closed it.
    pub(super) fn why(&self) -> Option<&str> {
        self.why.get().map(String::as_str)
    }

    /// Notes why the connection ends.
    fn ends(&self, why: String) {
        // The first reason counts.
        let _ = self.why.set(why);
    }
}

/// A connection.
pub(super) struct Connection {
    stream: TcpStream,
    idle: Duration,
    client: Arc<Client>,
    /// When is checked again how long ago the client has asked.
    deadline: Pin<Box<Sleep>>,
}

impl Connection {
    /// A connection that ends when its client asks nothing for the time `idle`.
    pub(super) fn new(stream: TcpStream, idle: Duration, client: Arc<Client>) -> Self {
        let deadline = Box::pin(sleep_until(Instant::now() + idle));
        Self { stream, idle, client, deadline }
    }

    /// Gives the result of reading or writing, or an error if the client has asked nothing for too long.
    fn watch<T>(
        &mut self,
        context: &mut Context<'_>,
        moved: Poll<io::Result<T>>,
    ) -> Poll<io::Result<T>> {
        if let Poll::Ready(Err(error)) = &moved {
            self.client.ends(error.to_string());
        }
        while moved.is_pending() && self.deadline.as_mut().poll(context).is_ready() {
            let asked = *self.client.asked.lock().unwrap_or_else(PoisonError::into_inner);
            let end = asked + self.idle;
            if end <= Instant::now() {
                let idle = self.idle.as_millis();
                self.client.ends(format!("it has asked nothing for {idle} ms"));
                return Poll::Ready(Err(io::ErrorKind::TimedOut.into()));
            }
            self.deadline.as_mut().reset(end);
        }
        moved
    }
}

impl AsyncRead for Connection {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let read = Pin::new(&mut self.stream).poll_read(context, buffer);
        self.watch(context, read)
    }
}

impl AsyncWrite for Connection {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.watch(context, written)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}
