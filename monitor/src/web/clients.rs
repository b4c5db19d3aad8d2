//! The session's side of the server: what the pages want, and what they are shown. All of it happens in
//! the thread that owns the session.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Weak};
use std::time::Instant;

use axum::extract::ws::Utf8Bytes;
use tokio::sync::{oneshot, watch};
use tokio::time::timeout;

use super::protocol::{self, PageRequest};
use super::{Server, limits};
use crate::session::ShownTick;
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
    /// The number of its browser.
    pub(super) browser: u16,
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

/// The tick that each browser shows. One that comes for the first time begins in the present.
#[derive(Default)]
struct Ticks(HashMap<u16, ShownTick>);

impl Ticks {
    /// Has the session show the tick of a browser.
    fn enter(&self, browser: u16, session: &mut Session<'_>) {
        session.show_tick_of(self.0.get(&browser).copied().unwrap_or_default());
    }

    /// Keeps what a browser shows from now on.
    fn keep(&mut self, browser: u16, session: &Session<'_>) {
        self.0.insert(browser, session.shown_tick());
    }

    /// Has the session go on as long as one of the browsers follows it, that is until all of those that are connected stay at a
    /// tick. While none is connected, it does what it did.
    fn go_on(&self, clients: &[Client], session: &mut Session<'_>) {
        let of = |client: &Client| {
            let browser = client.shown.upgrade()?.browser;
            Some(self.0.get(&browser).copied().unwrap_or_default())
        };
        let shown: Vec<ShownTick> = clients.iter().filter_map(of).collect();
        let goes_on = shown.iter().find(|shown| shown.is_newest());
        if let Some(shown) = goes_on.or(shown.first()) {
            session.show_tick_of(*shown);
        }
    }
}

impl Server {
    /// Serves pages with a session for as long as `goes_on` says so; it is asked ten times a second. All
    /// pages see the same session: its cursor, its watch lists. Each has a screen of its own, each browser a tick of its own.
    pub fn run(mut self, session: &mut Session<'_>, mut goes_on: impl FnMut() -> bool) {
        let mut clients: Vec<Client> = vec![];
        let mut ticks = Ticks::default();
        while goes_on() {
            ticks.go_on(&clients, session);
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
                if serve(session, &mut clients, &mut ticks, request) {
                    show_at = show_at.min(Instant::now() + limits::COMMAND_VIEW_DELAY);
                }
                if Instant::now() >= show_at {
                    break;
                }
            }
            show(session, &mut clients, &ticks);
        }
    }
}

/// Answers a request. Gives whether something else is shown now.
fn serve(
    session: &mut Session<'_>,
    clients: &mut Vec<Client>,
    ticks: &mut Ticks,
    request: Request,
) -> bool {
    let Request { id, content, shown, answer } = request;
    let browser = shown.browser;
    ticks.enter(browser, session);
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
    ticks.keep(browser, session);
    // The page may have left meanwhile.
    let _ = answer.send(text.into());
    has_changed
}

/// Gives each page that can take it what is to be seen now, if that is something else than before. Pages
/// with the same screen at the same tick share its view.
fn show(session: &mut Session<'_>, clients: &mut Vec<Client>, ticks: &Ticks) {
    clients.retain(|client| client.shown.strong_count() > 0);
    let mut made: Vec<(Screen, ShownTick, Utf8Bytes)> = vec![];
    for client in clients {
        let Some(shown) = client.shown.upgrade() else { continue };
        if !shown.was_sent.load(Ordering::Acquire) {
            continue;
        }
        ticks.enter(shown.browser, session);
        let tick = session.shown_tick();
        let same = |(screen, at, _): &&(Screen, ShownTick, Utf8Bytes)| {
            *screen == client.screen && *at == tick
        };
        let text = match made.iter().find(same) {
            Some((.., text)) => text.clone(),
            None => {
                let text = Utf8Bytes::from(protocol::view(0, &session.view(&client.screen)));
                made.push((client.screen.clone(), tick, text.clone()));
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
