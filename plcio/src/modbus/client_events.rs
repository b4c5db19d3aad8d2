//! Events about the server's clients: at most so many a minute, so that a client that connects again and
//! again can't fill the log.

use std::net::SocketAddr;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::events::Events;

/// How many events are written in a minute at most.
const EVENTS_A_MINUTE: u32 = 120;
const MINUTE: Duration = Duration::from_secs(60);

/// Writes the events of one server.
#[derive(Debug)]
pub(super) struct ClientEvents {
    events: Events,
    minute: Mutex<Minute>,
}

/// What was written in the present minute.
#[derive(Debug)]
struct Minute {
    began: Instant,
    written: u32,
    /// How many events were left out since the last one that was written.
    left_out: u32,
}

impl ClientEvents {
    /// Writes to these events; none have been written yet.
    pub(super) fn new(events: Events) -> Self {
        let minute = Minute { began: Instant::now(), written: 0, left_out: 0 };
        Self { events, minute: Mutex::new(minute) }
    }

    /// Writes an event about a client, unless there were too many in this minute. The next one that is
    /// written says how many were left out.
    pub(super) fn write(&self, kind: &str, client: SocketAddr, why: Option<&str>) {
        let left_out = {
            let mut minute = self.minute.lock().unwrap_or_else(PoisonError::into_inner);
            if minute.began.elapsed() >= MINUTE {
                (minute.began, minute.written) = (Instant::now(), 0);
            }
            if minute.written >= EVENTS_A_MINUTE {
                minute.left_out += 1;
                return;
            }
            minute.written += 1;
            std::mem::take(&mut minute.left_out)
        };
        let mut about = vec![("client", Value::from(client.to_string()))];
        about.extend(why.map(|why| ("why", why.into())));
        if left_out > 0 {
            about.push(("left_out", left_out.into()));
        }
        self.events.write(kind, &about);
    }
}
