//! The session's side of the server: what the pages want, and what they are shown. All of it happens in
//! the thread that owns the session.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Weak};
use std::time::Instant;

use axum::extract::ws::Utf8Bytes;
use tokio::sync::{oneshot, watch};
use tokio::time::timeout;

use super::protocol::{self, PageRequest};
use super::{Server, limits};
use crate::{Reply, Screen, Session};

/// A request of a page on its way to the thread that owns the session, and where the answer goes.
pub(super) struct Request {
    pub(super) id: u64,
    pub(super) content: PageRequest,
    pub(super) shown: Arc<Shown>,
    pub(super) answer: oneshot::Sender<Utf8Bytes>,
}

/// The newest view of a page. The page's connection owns it.
pub(super) struct Shown {
    pub(super) views: watch::Sender<Utf8Bytes>,
    /// Whether the newest view was sent. The next one is made then.
    pub(super) was_sent: AtomicBool,
}

/// A page that has chosen a screen.
struct Client {
    shown: Weak<Shown>,
    screen: Screen,
    /// What it was shown last.
    last: Utf8Bytes,
}

impl Server {
    /// Serves pages with a session for as long as `goes_on` says so; it is asked ten times a second. All
    /// pages see the same session: its time, its cursor, its watch lists. Each has a screen of its own.
    pub fn run(mut self, session: &mut Session<'_>, mut goes_on: impl FnMut() -> bool) {
        let mut clients: Vec<Client> = vec![];
        while goes_on() {
            session.poll();
            let mut show_at = Instant::now() + limits::VIEW_PERIOD;
            // At least one request is taken, and views are made in time however many there are.
            loop {
                let rest = show_at.saturating_duration_since(Instant::now());
                let requests = &mut self.requests;
                let request = async { timeout(rest, requests.recv()).await };
                let Ok(request) = self.handle.block_on(request) else { break };
                // The server's thread is gone.
                let Some(request) = request else { return };
                if serve(session, &mut clients, request) {
                    show_at = show_at.min(Instant::now() + limits::COMMAND_VIEW_DELAY);
                }
                if Instant::now() >= show_at {
                    break;
                }
            }
            show(session, &mut clients);
        }
    }
}

/// Answers a request. Gives whether something else is shown now.
fn serve(session: &mut Session<'_>, clients: &mut Vec<Client>, request: Request) -> bool {
    let Request { id, content, shown, answer } = request;
    let (text, has_changed) = match content {
        PageRequest::Ask(screen) => (protocol::view(id, &session.view(&screen)), false),
        PageRequest::Apply(command) => (protocol::result(id, &session.apply(*command)), true),
        PageRequest::Show(screen) => {
            let shown = Arc::downgrade(&shown);
            match clients.iter_mut().find(|client| client.shown.ptr_eq(&shown)) {
                Some(client) => (client.screen, client.last) = (screen, Utf8Bytes::default()),
                None => clients.push(Client { shown, screen, last: Utf8Bytes::default() }),
            }
            (protocol::result(id, &Ok(Reply::default())), true)
        }
    };
    // The page may have left meanwhile.
    let _ = answer.send(text.into());
    has_changed
}

/// Gives each page that can take it what is to be seen now, if that is something else than before. Pages
/// with the same screen share its view.
fn show(session: &mut Session<'_>, clients: &mut Vec<Client>) {
    clients.retain(|client| client.shown.strong_count() > 0);
    let mut made: Vec<(Screen, Utf8Bytes)> = vec![];
    for client in clients {
        let Some(shown) = client.shown.upgrade() else { continue };
        if !shown.was_sent.load(Ordering::Acquire) {
            continue;
        }
        let text = match made.iter().find(|(screen, _)| *screen == client.screen) {
            Some((_, text)) => text.clone(),
            None => {
                let text = Utf8Bytes::from(protocol::view(0, &session.view(&client.screen)));
                made.push((client.screen.clone(), text.clone()));
                text
            }
        };
        if text != client.last {
            client.last = text.clone();
            shown.was_sent.store(false, Ordering::Release);
            shown.views.send_replace(text);
        }
    }
}
