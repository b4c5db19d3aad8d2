//! Publishes points by MQTT with Sparkplug B, as an edge node, and takes commands for those that are given
//! from outside.
//!
//! A connection begins with a birth certificate that names all metrics; then values are sent when they
//! change. The death certificate is the connection's last will, so that the broker sends it when `plcio` is
//! gone.
//!
//! | file | holds |
//! | --- | --- |
//! | `options.rs` | the options of a connection |
//! | `sparkplug.rs` | the messages |

mod options;
mod sparkplug;

use std::collections::HashSet;
use std::time::Duration;

use plcc_configuration::Point;
use plcc_configuration::drivers::mqtt::{Broker, Settings};
use prost::Message;
use rumqttc::{AsyncClient, Event, EventLoop, LastWill, Outgoing, Packet, QoS};
use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio::time::MissedTickBehavior;

use sparkplug::{DataType, Metric, Payload, Value, now};

use crate::driver::{Driver, Making, Stages, Start, has_left};
use crate::reconnection::Reconnection;
use crate::session::Shared;

/// About how long the broker may send nothing before the connection counts as lost.
const KEEP_ALIVE: Duration = Duration::from_secs(5);
/// The longest message.
const MAX_BYTES: usize = 16 << 20;
/// How many messages wait at most to be sent, or to be handled.
const QUEUE: usize = 64;
/// How often values are compared with those that were sent, unless `poll_ms` is longer.
const PERIOD: Duration = Duration::from_millis(20);
/// The metric by which a host asks for a birth certificate.
const REBIRTH: &str = "Node Control/Rebirth";
/// The metric that numbers the connections, from 0 to 255, so that a death belongs to a birth.
const BIRTH_SEQUENCE: &str = "bdSeq";
/// The metric that says what the control is doing.
const STATE: &str = "Control/State";
/// Values of the property `Quality`: of good values, and of a control that ends no ticks (stale).
const QUALITY: (u32, u32) = (192, 500);

/// The driver.
struct Mqtt;

/// Makes the driver.
pub(crate) fn driver(_: &Making<'_>) -> Box<dyn Driver> {
    Box::new(Mqtt)
}

impl Driver for Mqtt {
    fn start(&mut self, session: &mut Start<'_>) {
        let points = session.points.to_vec();
        session.show(run(session.shared.clone(), points, session.stages.clone()));
    }
}

/// A point that is published.
struct Published {
    index: usize,
    name: String,
    datatype: DataType,
    is_input: bool,
    /// The value and the quality that were sent last.
    sent: Option<(f64, u32)>,
}

impl Published {
    fn new(index: usize, point: &Point) -> Self {
        let place = point.symbol.outside();
        let is_scaled = point.entry.scale != 1.0 || point.entry.offset != 0.0;
        let datatype = match place.range().filter(|_| !is_scaled) {
            None => DataType::Double,
            Some(_) if place.is_bit() => DataType::Boolean,
            Some(range) if *range.start() >= 0 => match *range.end() {
                0..=0xFFFF => DataType::UInt16,
                _ => DataType::UInt32,
            },
            Some(_) => DataType::Int32,
        };
        let (name, is_input) = (point.symbol.name.clone(), point.is_input);
        Self { index, name, datatype, is_input, sent: None }
    }

    fn metric(&self, value: f64, quality: u32) -> Metric {
        let mut metric = Metric::new(&self.name, self.datatype, self.datatype.value(value));
        if quality != QUALITY.0 {
            metric.property("Quality", DataType::Int32, &Value::Int(quality));
        }
        metric
    }
}

/// The publisher, of one image file.
struct Publisher {
    shared: Shared,
    points: Vec<Published>,
    /// The text of the state that was sent last.
    state: Option<&'static str>,
    /// The number of the next message of this connection, from 0 to 255.
    sequence: u8,
    /// The number of this connection.
    birth: u8,
    /// The names of refused commands that were reported.
    refused: HashSet<String>,
}

/// Publishes until the session ends.
async fn run(shared: Shared, points: Vec<usize>, mut stages: Stages) {
    let Some(broker) = shared.settings.drivers.mqtt.broker.clone() else {
        let why = "[plcio] has no key `mqtt-broker`, which says where the broker is";
        shared.events.write("lost", &[("device", "mqtt".into()), ("why", why.into())]);
        return;
    };
    let published = {
        let hub = shared.hub();
        let point = |index: usize| Some(Published::new(index, hub.point(index)?));
        points.into_iter().filter_map(point).collect()
    };
    let mut publisher = Publisher {
        shared: shared.clone(),
        points: published,
        state: None,
        sequence: 0,
        birth: 0,
        refused: HashSet::new(),
    };
    let about = vec![("device", broker.text.as_str().into())];
    let mut connection = Reconnection::new(shared.events.clone(), about);
    loop {
        let done = publisher.connection(&broker, &mut stages, &mut connection).await;
        let Err(why) = done else { return };
        connection.lost(&why);
        publisher.birth = publisher.birth.wrapping_add(1);
        if !connection.wait(has_left(&mut stages)).await {
            return;
        }
    }
}

/// Passes everything on that comes from the broker, until the connection ends.
async fn receive(mut connection: EventLoop, packets: mpsc::Sender<Packet>) -> Result<(), String> {
    loop {
        match connection.poll().await {
            Ok(Event::Incoming(packet)) => {
                if packets.send(packet).await.is_err() {
                    return Ok(());
                }
            }
            Ok(Event::Outgoing(Outgoing::Disconnect)) => return Ok(()),
            Ok(Event::Outgoing(_)) => {}
            Err(error) => return Err(error.to_string()),
        }
    }
}

impl Publisher {
    fn topic(&self, kind: &str) -> String {
        let Settings { group, node, .. } = &self.shared.settings.drivers.mqtt;
        format!("spBv1.0/{group}/{kind}/{node}")
    }

    /// The death certificate of this connection.
    fn death(&self) -> Vec<u8> {
        let birth = Metric::new(
            BIRTH_SEQUENCE,
            DataType::UInt64,
            DataType::UInt64.value(self.birth.into()),
        );
        Payload { timestamp: Some(now()), metrics: vec![birth], seq: None }.encode_to_vec()
    }

    /// One connection, until the session ends.
    ///
    /// # Errors
    /// Why it was lost.
    async fn connection(
        &mut self,
        broker: &Broker,
        stages: &mut Stages,
        link: &mut Reconnection,
    ) -> Result<(), String> {
        let mut options = options::options(&self.shared.settings.drivers.mqtt, broker)?;
        let (topic, death) = (self.topic("NDEATH"), self.death());
        options.set_last_will(LastWill::new(topic, death, QoS::AtLeastOnce, false));
        let (client, connection) = AsyncClient::new(options, QUEUE);
        let (sender, mut packets) = mpsc::channel(QUEUE);
        // It is ended when the set is dropped.
        let mut task = JoinSet::new();
        task.spawn(receive(connection, sender));
        let over = |result: Option<Result<Result<(), String>, tokio::task::JoinError>>| match result
        {
            Some(Ok(Err(why))) => why,
            Some(Err(error)) => error.to_string(),
            _ => "the connection is closed".into(),
        };
        // A time that begins anew with each command would never be over in a flood of them.
        let mut period = tokio::time::interval(self.shared.settings.poll.max(PERIOD));
        period.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                packet = packets.recv() => match packet {
                    Some(Packet::ConnAck(_)) => {
                        let commands = self.topic("NCMD");
                        let asked = client.try_subscribe(commands, QoS::AtLeastOnce);
                        asked.map_err(|error| error.to_string())?;
                    }
                    // A host must be able to ask for a birth when it sees one.
                    Some(Packet::SubAck(_)) => {
                        self.send_birth_certificate(&client)?;
                        link.connected();
                    }
                    Some(Packet::Publish(message)) => {
                        if self.command(&message.payload) && link.is_connected() {
                            self.send_birth_certificate(&client)?;
                        }
                    }
                    Some(_) => {}
                    None => return Err(over(task.join_next().await)),
                },
                _ = period.tick(), if link.is_connected() => self.report(&client),
                () = has_left(stages) => {
                    if link.is_connected() {
                        self.report(&client);
                        let death = self.death();
                        let _ = client.try_publish(self.topic("NDEATH"), QoS::AtLeastOnce, false, death);
                    }
                    let _ = client.try_disconnect();
                    // First the messages that wait are sent.
                    let goes_out = async {
                        while packets.recv().await.is_some() {}
                    };
                    let _ = tokio::time::timeout(Duration::from_secs(1), goes_out).await;
                    return Ok(());
                }
            }
        }
    }

    /// The value and the quality of each point, and what the control is doing.
    fn values(&self) -> (Vec<Option<(f64, u32)>>, &'static str) {
        let hub = self.shared.hub();
        let state = hub.control_state();
        let quality = if state.is_alive() { QUALITY.0 } else { QUALITY.1 };
        let value = |point: &Published| Some((hub.value_outside(point.index)?, quality));
        (self.points.iter().map(value).collect(), state.name())
    }

    /// Sends the birth certificate: all metrics with their types and values.
    ///
    /// # Errors
    /// When the connection takes no message.
    fn send_birth_certificate(&mut self, client: &AsyncClient) -> Result<(), String> {
        let (values, state) = self.values();
        let mut metrics = vec![
            Metric::new(
                BIRTH_SEQUENCE,
                DataType::UInt64,
                DataType::UInt64.value(self.birth.into()),
            ),
            Metric::new(REBIRTH, DataType::Boolean, Value::Boolean(false)),
            Metric::new(STATE, DataType::String, Value::String(state.into())),
        ];
        for (point, value) in self.points.iter_mut().zip(values) {
            let mut metric = match value {
                Some((value, quality)) => point.metric(value, quality),
                // There was no tick yet.
                None => {
                    let mut metric = point.metric(0.0, QUALITY.1);
                    (metric.value, metric.is_null) = (None, Some(true));
                    metric
                }
            };
            let texts = {
                let hub = self.shared.hub();
                hub.point(point.index).map_or(Default::default(), |point| {
                    (point.entry.description.clone(), point.symbol.unit.clone())
                })
            };
            for (key, text) in [("Description", texts.0), ("engUnit", texts.1)] {
                if !text.is_empty() {
                    metric.property(key, DataType::String, &Value::String(text));
                }
            }
            point.sent = value;
            metrics.push(metric);
        }
        self.state = Some(state);
        self.sequence = 0;
        let birth = Payload { timestamp: Some(now()), metrics, seq: Some(0) }.encode_to_vec();
        let sent = client.try_publish(self.topic("NBIRTH"), QoS::AtMostOnce, false, birth);
        sent.map_err(|error| error.to_string())
    }

    /// Sends what has changed. What the connection does not take now goes with the next report.
    fn report(&mut self, client: &AsyncClient) {
        let (values, state) = self.values();
        let mut metrics = vec![];
        if self.state != Some(state) {
            metrics.push(Metric::new(STATE, DataType::String, Value::String(state.into())));
        }
        for (point, value) in self.points.iter().zip(&values) {
            if let Some((number, quality)) = *value
                && point.sent != *value
            {
                metrics.push(point.metric(number, quality));
            }
        }
        if metrics.is_empty() {
            return;
        }
        let sequence = self.sequence.wrapping_add(1);
        let payload = Payload { timestamp: Some(now()), metrics, seq: Some(sequence.into()) };
        let topic = self.topic("NDATA");
        if client.try_publish(topic, QoS::AtMostOnce, false, payload.encode_to_vec()).is_ok() {
            (self.sequence, self.state) = (sequence, Some(state));
            for (point, value) in self.points.iter_mut().zip(values) {
                point.sent = value.or(point.sent);
            }
        }
    }

    /// Does what a host asks for. Gives whether it wants a birth certificate.
    fn command(&mut self, bytes: &[u8]) -> bool {
        let Ok(payload) = Payload::decode(bytes) else {
            self.refuse("", "a command that is not a Sparkplug payload");
            return false;
        };
        let mut wants_birth = false;
        let mut given = false;
        for metric in payload.metrics {
            let name = metric.name.unwrap_or_default();
            if name == REBIRTH {
                wants_birth |= metric.value == Some(Value::Boolean(true));
                continue;
            }
            let point = self.points.iter().find(|point| point.name == name && point.is_input);
            let Some(point) = point else {
                self.refuse(&name, "nobody may write it");
                continue;
            };
            let number = metric.value.as_ref().and_then(|value| point.datatype.number(value));
            let fits =
                number.is_some_and(|n| self.shared.hub().set_input_if_it_fits(point.index, n));
            if fits {
                given = true;
                self.refused.remove(&name);
            } else {
                self.refuse(&name, "it can't have this value");
            }
        }
        if given {
            self.shared.hub().publish();
        }
        wants_birth
    }

    /// Reports that a command is refused: once for each name, and for at most [`QUEUE`] names.
    fn refuse(&mut self, name: &str, why: &str) {
        if self.refused.len() < QUEUE && self.refused.insert(name.to_owned()) {
            let about = [("device", "mqtt".into()), ("name", name.into()), ("why", why.into())];
            self.shared.events.write("refused", &about);
        }
    }
}
