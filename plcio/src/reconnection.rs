//! Connections that are made again: after which pause, and what is reported of it.

use std::time::Duration;

use serde_json::Value;

use crate::events::Events;

/// The pause before a connection is made again for the first time. It doubles with each attempt that fails.
const FIRST_PAUSE: Duration = Duration::from_millis(100);
/// The longest pause.
pub(crate) const LONGEST_PAUSE: Duration = Duration::from_secs(5);

/// A connection with a device that is made again whenever it is lost. The same reason is reported once, however often connecting
/// fails.
pub(crate) struct Reconnection {
    events: Events,
    /// What stands in each event: which device it is.
    about: Vec<(&'static str, Value)>,
    pause: Duration,
    is_connected: bool,
    /// Why it was lost, as far as that was reported.
    lost: Option<String>,
}

impl Reconnection {
    /// No connection yet with a device, which events name so.
    pub(crate) fn new(events: Events, about: Vec<(&'static str, Value)>) -> Self {
        Self { events, about, pause: FIRST_PAUSE, is_connected: false, lost: None }
    }

    /// Whether there is a connection.
    pub(crate) fn is_connected(&self) -> bool {
        self.is_connected
    }

    /// Notes that there is a connection, so that the pauses begin with the shortest again. Returns whether that is to be reported:
    /// there was none before, or a reason was reported why it was lost.
    pub(crate) fn note_connected(&mut self) -> bool {
        self.pause = FIRST_PAUSE;
        let was_lost = self.lost.take().is_some();
        !std::mem::replace(&mut self.is_connected, true) || was_lost
    }

    /// Notes that there is no connection, and why. Returns whether that is to be reported: it is another reason than before.
    pub(crate) fn note_lost(&mut self, why: &str) -> bool {
        self.is_connected = false;
        let is_new = self.lost.as_deref() != Some(why);
        self.lost = Some(why.to_owned());
        is_new
    }

    /// The same as [`note_connected`](Self::note_connected), with the event `connected` where it is to be reported.
    pub(crate) fn connected(&mut self) {
        if self.note_connected() {
            self.events.write("connected", &self.about);
        }
    }

    /// The same as [`note_lost`](Self::note_lost), with the event `lost` where it is to be reported.
    pub(crate) fn lost(&mut self, why: &str) {
        if self.note_lost(why) {
            let mut about = self.about.clone();
            about.push(("why", why.into()));
            self.events.write("lost", &about);
        }
    }

    /// How long to wait now before the connection is made again.
    pub(crate) fn next_pause(&mut self) -> Duration {
        let pause = self.pause;
        self.pause = (pause * 2).min(LONGEST_PAUSE);
        pause
    }

    /// Waits for the next pause, or until something is over. Returns whether that is not over.
    #[cfg(any(feature = "mqtt", feature = "zenoh", feature = "gpio", feature = "ethercat"))]
    pub(crate) async fn wait(&mut self, over: impl Future<Output = ()>) -> bool {
        tokio::select! {
            () = tokio::time::sleep(self.next_pause()) => true,
            () = over => false,
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn pauses_grow_until_there_is_a_connection_and_a_reason_is_reported_once() {
        let mut device = Reconnection::new(Events::open(None).unwrap(), vec![]);
        let pauses = |device: &mut Reconnection, count| {
            (0..count).map(|_| device.next_pause().as_millis()).collect::<Vec<_>>()
        };
        assert!(device.note_lost("off") && !device.note_lost("off") && device.note_lost("busy"));
        assert_eq!(pauses(&mut device, 7), [100, 200, 400, 800, 1600, 3200, 5000]);
        assert!(device.note_connected() && !device.note_connected() && device.is_connected());
        assert_eq!(pauses(&mut device, 2), [100, 200]);
        assert!(device.note_lost("busy") && !device.is_connected() && device.note_connected());
    }
}
