//! The monitor in a browser: a server that gives the page, and a WebSocket by which the page says what is
//! to be shown and done.
//!
//! Two threads work here. The server's thread (`http`, `client`) speaks with browsers. The thread that
//! owns the [`Session`](crate::Session) answers requests and makes views (`clients`); it never waits for
//! a browser:
//!
//! - A client has one request under way at a time; its next one is not even read before the answer. So a
//!   client that floods waits for itself, and the queue of requests is never longer than there are clients.
//! - Of a client's views only the newest is kept. A new one is made when the one before was sent, so a slow
//!   client costs nothing and sees the newest state as soon as it can.
//! - Messages, connections and clients are limited (`limits`).
//!
//! Who may see the page is decided in `access`.

mod access;
mod assets;
mod client;
mod clients;
mod http;
mod limits;
mod protocol;
#[cfg(test)]
mod tests;

use std::fmt;
use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::thread;

use thiserror::Error;
use tokio::runtime::{Builder, Handle};
use tokio::sync::mpsc;

use access::Access;
use clients::Request;

/// Where the server listens unless another address is given.
pub const DEFAULT_ADDRESS: &str = "127.0.0.1:7400";

/// Why there is no server.
#[derive(Debug, Error)]
pub enum WebError {
    /// The address can't be listened at.
    #[error("can't listen at {address}: {source}; choose another address by --web=ADDRESS:PORT")]
    Address {
        /// The address.
        address: SocketAddr,
        /// Why.
        source: io::Error,
    },
    /// The operating system gives no random numbers for the token.
    #[error("the operating system gives no random numbers: {0}")]
    Random(String),
    /// The operating system gives no thread.
    #[error("the server's thread can't be started: {0}")]
    Thread(io::Error),
}

/// A server that listens. Its clients are served while [`Server::run`] runs.
pub struct Server {
    address: SocketAddr,
    first_url: String,
    requests: mpsc::Receiver<Request>,
    handle: Handle,
}

impl fmt::Debug for Server {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Server").field("address", &self.address).finish()
    }
}

impl Server {
    /// Listens at an address; port 0 takes a free one. `announce` gets the address of the page each time
    /// that the one before was used, from another thread: each opens one browser.
    ///
    /// # Errors
    /// When the address can't be listened at, or the operating system gives no thread or random numbers.
    pub fn start(
        address: SocketAddr,
        announce: impl Fn(&str) + Send + Sync + 'static,
    ) -> Result<Self, WebError> {
        let refused = |source| WebError::Address { address, source };
        let listener = TcpListener::bind(address).map_err(refused)?;
        listener.set_nonblocking(true).map_err(refused)?;
        let address = listener.local_addr().map_err(refused)?;
        let access = Access::new(address, Box::new(announce))?;
        let first_url = access.url();
        let runtime = Builder::new_current_thread().enable_io().enable_time().build();
        let runtime = runtime.map_err(WebError::Thread)?;
        let handle = runtime.handle().clone();
        let listener = {
            let _context = handle.enter();
            tokio::net::TcpListener::from_std(listener).map_err(refused)?
        };
        let (sender, requests) = mpsc::channel(limits::MAX_CLIENTS);
        let serve = move || runtime.block_on(http::serve(listener, Arc::new(access), sender));
        let thread = thread::Builder::new().name("web".into()).spawn(serve);
        thread.map_err(WebError::Thread)?;
        Ok(Self { address, first_url, requests, handle })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The page's address for the first browser, with the token that is valid once.
    pub fn first_url(&self) -> &str {
        &self.first_url
    }

    /// What the user must know when the server can be reached from other machines.
    pub fn warning(&self) -> Option<String> {
        (!self.address.ip().is_loopback()).then(|| {
            format!(
                "{} can be reached from other machines, and what is sent is not encrypted: whoever can read \
                 the network's traffic can do all that this monitor may",
                self.address
            )
        })
    }
}
