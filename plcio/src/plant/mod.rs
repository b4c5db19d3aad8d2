//! Carries the points of the driver `zenoh`, events and the record of a control to other computers of a plant, and takes values for the
//! points that are given from outside.
//!
//! | file | holds |
//! | --- | --- |
//! | `zenoh_config.rs` | the configuration of a session |
//! | `values.rs` | the points, their values as JSON, and the message with all of them |
//! | `follow.rs` | inputs that follow variables of other controls |
//! | `log_tail.rs` | the logs, of which each new line is an event for others |
//! | `record.rs` | queries of the record |
//!
//! docs/plant.md lists the keys.
//!
//! zenoh works on threads of its own, and the driver has one, too: where it waits for zenoh, no other driver waits.

mod follow;
mod log_tail;
mod record;
mod values;
mod zenoh_config;

use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::Value as Json;
use tokio::task::JoinSet;
use tokio::time::MissedTickBehavior;
use zenoh::Session;
use zenoh::handlers::RingChannel;
use zenoh::key_expr::KeyExpr;
use zenoh::query::Query;
use zenoh::sample::{Locality, Sample, SampleKind};

use crate::driver::{Driver, Making, Stages, Start, has_left};
use crate::reconnection::Reconnection;
use crate::session::Shared;
use follow::Follower;
use log_tail::{LogTail, last_lines};
use record::Record;
use values::{Points, Values, json_of, number_of};

/// How often values are compared with those that were published, unless `poll_ms` is longer.
const PERIOD: Duration = Duration::from_millis(20);
/// How often the message with all values is published at least, so that others see that the control is there.
const BEAT: Duration = Duration::from_millis(100);
/// How many values that others write, or queries, may wait; the oldest are dropped.
const QUEUE: usize = 256;
/// How many values that others have written are taken over together.
const BATCH: usize = 64;
/// How many names of refused values are reported in the time [`REFUSED`].
const MAX_REFUSED: usize = 64;
/// After this time the same names are reported again.
const REFUSED: Duration = Duration::from_secs(60);

/// The driver.
struct Zenoh;

/// Makes the driver.
pub(crate) fn driver(_: &Making<'_>) -> Box<dyn Driver> {
    Box::new(Zenoh)
}

impl Driver for Zenoh {
    fn start(&mut self, session: &mut Start<'_>) {
        let points = session.points.to_vec();
        session.show(run(session.shared.clone(), points, session.stages.clone()));
    }
}

/// The work for one image file.
struct Publisher {
    points: Arc<Points>,
    /// What was published last.
    published: Option<Values>,
    /// The names of refused values that were reported in this minute.
    refused: HashSet<String>,
    /// When this minute began.
    refused_since: Instant,
}

/// Works on a thread of its own until the session ends.
async fn run(shared: Shared, points: Vec<usize>, stages: Stages) {
    let (done, finished) = tokio::sync::oneshot::channel::<()>();
    let new = |shared: &Shared| {
        Reconnection::new(shared.events.clone(), vec![("device", "zenoh".into())])
    };
    let (mut for_errors, mut connection) = (new(&shared), new(&shared));
    let work = move || {
        let runtime =
            tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build();
        match runtime {
            Ok(runtime) => {
                runtime.block_on(publish(&shared, &points, stages, &mut connection));
                // A disk that does not answer holds up nothing.
                runtime.shutdown_background();
            }
            Err(error) => connection.lost(&error.to_string()),
        }
        drop(done);
    };
    match std::thread::Builder::new().name("zenoh".into()).spawn(work) {
        // The sender is never used: it is dropped at the end of the thread.
        Ok(_) => drop(finished.await),
        Err(error) => for_errors.lost(&error.to_string()),
    }
}

/// Opens sessions of zenoh until the session of `plcio` ends.
async fn publish(
    shared: &Shared,
    points: &[usize],
    mut stages: Stages,
    connection: &mut Reconnection,
) {
    let points = Arc::new(Points::new(shared.clone(), points));
    let mut publisher = Publisher {
        points,
        published: None,
        refused: HashSet::new(),
        refused_since: Instant::now(),
    };
    loop {
        let Err(why) = publisher.session(&mut stages, connection).await else { return };
        connection.lost(&why);
        if !connection.wait(has_left(&mut stages)).await {
            return;
        }
    }
}

/// Publishes each new line of a log, until zenoh ends.
async fn publish_events(session: Session, key: String, log: PathBuf, period: Duration) {
    let mut tail = LogTail::new(log);
    loop {
        for line in tail.new_lines() {
            if session.put(&key, line).await.is_err() {
                return;
            }
        }
        tokio::time::sleep(period).await;
    }
}

impl Publisher {
    /// One session of zenoh, until that of `plcio` ends. zenoh makes lost connections again itself.
    ///
    /// # Errors
    /// Why it can't be opened or used.
    async fn session(
        &mut self,
        stages: &mut Stages,
        connection: &mut Reconnection,
    ) -> Result<(), String> {
        let config = zenoh_config::config(&self.points.shared.settings.drivers.zenoh)?;
        let session = tokio::select! {
            session = zenoh::open(config) => session.map_err(|error| error.to_string())?,
            () = has_left(stages) => return Ok(()),
        };
        let done =
            self.serve(&session, stages, connection).await.map_err(|error| error.to_string());
        let _ = tokio::time::timeout(Duration::from_secs(1), session.close()).await;
        done
    }

    /// Publishes, takes values and answers queries.
    async fn serve(
        &mut self,
        session: &Session,
        stages: &mut Stages,
        connection: &mut Reconnection,
    ) -> zenoh::Result<()> {
        let points = Arc::clone(&self.points);
        let (base, settings) = (points.base.as_str(), &points.shared.settings);
        let token = session.liveliness().declare_token(base).await?;
        let written = session.declare_subscriber(format!("{base}/set/*"));
        let written = written.with(RingChannel::new(QUEUE)).await?;
        let namesakes = session.declare_subscriber(format!("{base}/image"));
        let namesakes =
            namesakes.allowed_origin(Locality::Remote).with(RingChannel::new(1)).await?;
        // They end when the set is dropped.
        let mut tasks = JoinSet::new();
        let queries = session.declare_queryable(format!("{base}/**"));
        let queries = queries.with(RingChannel::new(QUEUE)).await?;
        let record = Record::new(&settings.drivers.zenoh.record, base);
        let for_queries = Arc::clone(&points);
        tasks.spawn(async move {
            let mut running = JoinSet::new();
            while let Ok(query) = queries.recv_async().await {
                while running.try_join_next().is_some() {}
                answer(&for_queries, &record, query, &mut running).await;
            }
        });
        for follower in Follower::all(&points, session)? {
            tasks.spawn(follower.run());
        }
        let logs = [("control", &settings.drivers.zenoh.control_log), ("plcio", &settings.log)];
        for (part, log) in logs {
            if let Some(log) = log.clone() {
                let key = format!("{base}/events/{part}");
                tasks.spawn(publish_events(session.clone(), key, log, settings.poll.max(BEAT)));
            }
        }
        let mut period = tokio::time::interval(settings.poll.max(PERIOD));
        period.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut has_namesake = false;
        let mut beat = Instant::now();
        self.published = None;
        loop {
            tokio::select! {
                _ = period.tick() => {
                    let is_beat = beat.elapsed() >= BEAT;
                    if is_beat {
                        beat = Instant::now();
                        let info = session.info();
                        // One that listens is its own router.
                        let peers = settings.drivers.zenoh.listen.is_some()
                            || info.routers_zid().await.next().is_some();
                        match peers {
                            true if !connection.is_connected() => {
                                connection.connected();
                                self.published = None;
                            }
                            false if connection.is_connected() => {
                                connection.lost("no router answers");
                            }
                            _ => {}
                        }
                    }
                    self.report(session, is_beat).await?;
                }
                sample = written.recv_async() => {
                    self.take(&sample?);
                    for _ in 1..BATCH {
                        let Some(sample) = written.try_recv()? else { break };
                        self.take(&sample);
                    }
                    points.shared.hub().publish();
                }
                _ = namesakes.recv_async() => if !std::mem::replace(&mut has_namesake, true) {
                    let why = ("why", "another control has this name".into());
                    let about = [("device", "zenoh".into()), ("name", base.into()), why];
                    points.shared.events.write("refused", &about);
                },
                () = has_left(stages) => {
                    self.report(session, true).await?;
                    let _ = token.undeclare().await;
                    return Ok(());
                }
            }
        }
    }

    /// Publishes what has changed, and with `is_beat` the message with all values in any case.
    async fn report(&mut self, session: &Session, is_beat: bool) -> zenoh::Result<()> {
        let points = &self.points;
        let (ticks, values) = points.values();
        if self.published.as_ref() == Some(&values) && !is_beat {
            return Ok(());
        }
        // What a connection can't take is dropped; the next message has all values again.
        session
            .put(format!("{}/image", points.base), points.image(ticks, &values).to_string())
            .await?;
        let last = self.published.as_ref();
        if last.is_none_or(|last| last.state != values.state) {
            let state = Json::from(values.state).to_string();
            session.put(format!("{}/state", points.base), state).await?;
        }
        for (index, (point, &value)) in points.keyed.iter().zip(&values.values).enumerate() {
            let before = last.and_then(|last| last.values.get(index)).copied().flatten();
            if let Some(bits) = value.filter(|_| value != before) {
                let text = json_of(f64::from_bits(bits), point.is_bit).to_string();
                session.put(point.key.as_str(), text).await?;
            }
        }
        self.published = Some(values);
        Ok(())
    }

    /// Takes a value that somebody has written. The control gets it when the hub publishes.
    fn take(&mut self, sample: &Sample) {
        let points = Arc::clone(&self.points);
        let key = sample.key_expr().as_str();
        let part = key.rsplit('/').next().unwrap_or_default();
        let named = |point: &&values::KeyedPoint| point.is_written && point.part() == part;
        let Some(point) = points.keyed.iter().find(named) else {
            return self.refuse(part, "nobody may write it");
        };
        let value = match sample.kind() {
            SampleKind::Put => serde_json::from_slice(&sample.payload().to_bytes()).ok(),
            SampleKind::Delete => None,
        };
        let number = value.and_then(|value: Json| number_of(&value, point.is_bit));
        if number
            .is_some_and(|number| points.shared.hub().set_input_if_it_fits(point.index, number))
        {
            self.refused.remove(part);
        } else {
            self.refuse(part, "it can't have this value");
        }
    }

    /// Reports that a value is refused: in a minute once for each name, and for at most [`MAX_REFUSED`] names.
    fn refuse(&mut self, name: &str, why: &str) {
        if self.refused_since.elapsed() > REFUSED {
            self.refused.clear();
            self.refused_since = Instant::now();
        }
        if self.refused.len() < MAX_REFUSED && self.refused.insert(name.to_owned()) {
            let about = [("device", "zenoh".into()), ("name", name.into()), ("why", why.into())];
            self.points.shared.events.write("refused", &about);
        }
    }
}

/// Answers a query, or begins a task that does.
async fn answer(points: &Points, record: &Record, query: Query, running: &mut JoinSet<()>) {
    let asks_for = |key: &str| {
        let key = KeyExpr::try_from(format!("{}/{key}", points.base)).ok()?;
        query.key_expr().intersects(&key).then_some(key)
    };
    // Each reply may fail, since who has asked may have left.
    let key = query.key_expr().as_str();
    // Wildcards ask for what is small: the record is only given to who names it.
    if key.strip_prefix(points.base.as_str()).is_some_and(|rest| rest.starts_with("/record/")) {
        running.spawn(record.clone().answer(query));
        return;
    }
    let (ticks, values) = points.values();
    if let Some(key) = asks_for("image") {
        let _ = query.reply(key, points.image(ticks, &values).to_string()).await;
    }
    if let Some(key) = asks_for("state") {
        let _ = query.reply(key, Json::from(values.state).to_string()).await;
    }
    let settings = &points.shared.settings;
    for (part, log) in [("control", &settings.drivers.zenoh.control_log), ("plcio", &settings.log)]
    {
        if let (Some(log), Some(key)) = (log, asks_for(&format!("events/{part}"))) {
            let _ = query.reply(key, last_lines(log).join("\n")).await;
        }
    }
    for (point, value) in points.keyed.iter().zip(values.values) {
        let Ok(key) = KeyExpr::try_from(point.key.as_str()) else { continue };
        if let Some(bits) = value.filter(|_| query.key_expr().intersects(&key)) {
            let text = json_of(f64::from_bits(bits), point.is_bit).to_string();
            let _ = query.reply(key, text).await;
        }
    }
}
