//! Inputs that follow variables of other controls.

use std::collections::HashSet;
use std::sync::Arc;
use std::time::Duration;

use serde_json::Value as Json;
use tokio::time::Instant;
use zenoh::handlers::{RingChannel, RingChannelHandler};
use zenoh::pubsub::Subscriber;
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use super::values::{Points, number_of};
use super::{BEAT, QUEUE};

/// After how long without values another control counts as lost, unless `answer_ms` is longer.
const SILENCE: Duration = Duration::from_millis(5 * BEAT.as_millis() as u64);

/// Another control whose variables inputs follow.
pub(super) struct Follower {
    points: Arc<Points>,
    control: String,
    images: Subscriber<RingChannelHandler<Sample>>,
    /// Whether its values come; `None` before it is known.
    is_heard: Option<bool>,
    /// The names of variables that it does not have, or whose values do not fit, which were reported.
    refused: HashSet<String>,
}

/// What the message of a control holds: its values, if it does its work.
fn values_of(message: &[u8]) -> Option<serde_json::Map<String, Json>> {
    let Json::Object(mut message) = serde_json::from_slice(message).ok()? else { return None };
    let works = message
        .get("state")
        .and_then(Json::as_str)
        .is_some_and(|state| ["running", "stopped"].contains(&state));
    match message.remove("values") {
        Some(Json::Object(values)) if works => Some(values),
        _ => None,
    }
}

impl Follower {
    /// One for each control that inputs follow.
    ///
    /// # Errors
    /// When zenoh can't subscribe.
    pub(super) fn all(points: &Arc<Points>, session: &Session) -> zenoh::Result<Vec<Self>> {
        let names: HashSet<&str> = points.followed.iter().map(|p| p.control.as_str()).collect();
        let follower = |control: &str| {
            let key = format!("{}/{control}/image", points.shared.settings.drivers.zenoh.prefix);
            let images = session.declare_subscriber(key).with(RingChannel::new(QUEUE)).wait()?;
            Ok(Self {
                points: Arc::clone(points),
                control: control.to_owned(),
                images,
                is_heard: None,
                refused: HashSet::new(),
            })
        };
        names.into_iter().map(follower).collect()
    }

    /// Takes its values over until zenoh ends.
    pub(super) async fn run(mut self) {
        let silence = self.points.shared.settings.answer.max(SILENCE);
        let mut heard = Instant::now();
        loop {
            match tokio::time::timeout_at(heard + silence, self.images.recv_async()).await {
                // What is not a message of a control at work changes nothing.
                Ok(Ok(sample)) => {
                    if let Some(values) = values_of(&sample.payload().to_bytes()) {
                        heard = Instant::now();
                        self.take(&values);
                        self.report(true);
                    }
                }
                Ok(Err(_)) => return,
                Err(_) => {
                    heard = Instant::now();
                    self.report(false);
                }
            }
        }
    }

    /// Sets the inputs. Those whose values are missing become late; a value that is not a number, such as the `null`
    /// of an infinity, is a bad one.
    fn take(&mut self, values: &serde_json::Map<String, Json>) {
        let followed = self.points.followed.iter().filter(|point| point.control == self.control);
        let mut wrong = vec![];
        let mut hub = self.points.shared.hub();
        for point in followed {
            let value = values.get(&point.variable);
            let number = |value: &Json| number_of(value, value.is_boolean()).unwrap_or(f64::NAN);
            let number = value.map(number);
            if !number.is_some_and(|number| hub.set_input(point.index, number)) {
                wrong.push(point.variable.clone());
            }
        }
        hub.publish();
        drop(hub);
        for name in wrong {
            if self.refused.insert(name.clone()) {
                let device = ("device", Json::from(format!("zenoh/{}", self.control)));
                let why = ("why", "it has no such value that the input could have".into());
                let about = [device, ("name", name.into()), why];
                self.points.shared.events.write("refused", &about);
            }
        }
    }

    /// Reports whether the control is heard, when that has changed.
    fn report(&mut self, is_heard: bool) {
        if self.is_heard.replace(is_heard) == Some(is_heard) {
            return;
        }
        let device = ("device", Json::from(format!("zenoh/{}", self.control)));
        let events = &self.points.shared.events;
        match is_heard {
            true => events.write("connected", &[device]),
            false => {
                let why = "no values come from it, or it does not run";
                events.write("lost", &[device, ("why", why.into())]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::values_of;

    #[test]
    fn only_a_control_that_does_its_work_gives_values() {
        let values = |text: &str| values_of(text.as_bytes()).map(|values| values.len());
        assert_eq!(values(r#"{"state":"running","values":{"A":true,"B":1}}"#), Some(2));
        assert_eq!(values(r#"{"state":"stopped","values":{}}"#), Some(0));
        for text in [
            r#"{"state":"silent","values":{"A":true}}"#,
            r#"{"state":1,"values":{}}"#,
            r#"{"values":{}}"#,
            r#"{"state":"running","values":[]}"#,
            r#"{"state":"running"}"#,
            "[]",
            "",
            "\u{0}",
            r#"{"state":"running","values":{"A":"#,
        ] {
            assert_eq!(values(text), None, "{text}");
        }
    }
}
