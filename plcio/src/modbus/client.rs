//! Asks devices: reads what they give, and writes what they get, in every poll.
//!
//! An input whose device gives no value in time becomes late, so that the control gives it its safe value. A unit that is
//! lost is asked again, after pauses that grow from 0.1 s to 5 s; meanwhile the others of its line go on. When the control
//! has left, devices with outputs are still served: each gets its safe values, also one that comes back later.

use std::collections::BTreeMap;
use std::time::Duration;

use plcc_image::configuration::{Address, Medium};
use serde_json::Value;
use tokio::time::{Instant, sleep_until};

use super::blocks::{Member, blocks};
use super::link::{Failure, Link};
use super::reports::Reports;
use super::unit::Unit;
use crate::session::{Shared, Stage, Stages};

/// The shortest and the longest pause before a unit is asked again.
const PAUSES: (Duration, Duration) = (Duration::from_millis(100), Duration::from_secs(5));

/// A device, or all units of a serial line.
pub(crate) struct Device {
    name: String,
    medium: Medium,
    units: Vec<Polled>,
}

/// A unit, and when it is polled.
struct Polled {
    unit: Unit,
    next: Instant,
    /// How long is waited until it is asked again, if it is lost now.
    pause: Duration,
    /// Whether the last poll was answered.
    is_connected: bool,
    /// Why it was lost, as far as that was reported.
    lost: Option<String>,
}

/// The members of a unit that are read, and those that are written.
type Members = (Vec<Member>, Vec<Member>);

/// The devices of some points.
pub(crate) fn devices(shared: &Shared, points: &[usize]) -> Vec<Device> {
    let mut found: Vec<(Medium, BTreeMap<u8, Members>)> = vec![];
    let hub = shared.hub();
    for &index in points {
        let Some(point) = hub.point(index) else { continue };
        let Some(Address::Modbus(address)) = point.address.clone() else { continue };
        let at = found.iter().position(|(known, _)| *known == address.medium);
        let at = at.unwrap_or_else(|| {
            found.push((address.medium.clone(), BTreeMap::new()));
            found.len() - 1
        });
        if let Some((_, units)) = found.get_mut(at) {
            let (reads, writes) = units.entry(address.unit).or_default();
            let members = if point.is_input { reads } else { writes };
            members.push(Member { index, address });
        }
    }
    let device = |(medium, units): (Medium, BTreeMap<u8, Members>)| {
        let name = medium.to_string();
        let unit = |(number, (reads, writes)): (u8, Members)| {
            let manner = shared.settings.manner(&medium, number);
            let reports = Reports::new(shared.events.clone(), name.clone(), number);
            let unit = Unit::new(number, manner, blocks(reads), blocks(writes), reports);
            let next = Instant::now();
            Polled { unit, next, pause: PAUSES.0, is_connected: false, lost: None }
        };
        let units = units.into_iter().map(unit).collect();
        Device { name, medium, units }
    };
    found.into_iter().map(device).collect()
}

impl Polled {
    /// Notes that the unit is lost, and why. Returns whether that has to be reported: the same reason is reported once,
    /// however often the unit is asked again.
    fn is_lost(&mut self, why: &str) -> bool {
        self.is_connected = false;
        self.next = Instant::now() + self.pause;
        self.pause = (self.pause * 2).min(PAUSES.1);
        let is_new = self.lost.as_deref() != Some(why);
        self.lost = Some(why.to_owned());
        is_new
    }

    /// Notes that the unit has answered all requests of a poll. Returns whether that has to be reported.
    fn is_polled(&mut self) -> bool {
        (self.lost, self.pause) = (None, PAUSES.0);
        self.next = (self.next + self.unit.manner.poll).max(Instant::now());
        !std::mem::replace(&mut self.is_connected, true)
    }
}

impl Device {
    /// Polls the units until the session ends; then writes the outputs once more.
    pub(crate) async fn run(self, shared: Shared, mut stages: Stages) {
        let Self { name, medium, mut units } = self;
        let has_many = units.len() > 1;
        let report = |kind: &str, unit: Option<u8>, why: Option<&str>| {
            let mut about = vec![("device", Value::from(name.as_str()))];
            about.extend(unit.filter(|_| has_many).map(|unit| ("unit", unit.into())));
            about.extend(why.map(|why| ("why", why.into())));
            shared.events.write(kind, &about);
        };
        let mut link = Link::new(medium);
        let mut stage = Stage::Works;
        loop {
            let before = std::mem::replace(&mut stage, *stages.borrow_and_update());
            if stage != Stage::Works {
                units.retain(|polled| polled.unit.has_outputs());
            }
            let mut unreachable = None;
            for polled in &mut units {
                let is_at_once = stage != before && polled.is_connected;
                if !is_at_once && (polled.next > Instant::now() || stage == Stage::Ends) {
                    continue;
                }
                let number = Some(polled.unit.number);
                match polled.unit.exchange(&mut link, &shared, &stages).await {
                    Ok(()) if polled.is_polled() => report("connected", number, None),
                    Ok(()) => {}
                    Err(Failure::Unreachable(why)) => {
                        unreachable = Some(why);
                        break;
                    }
                    Err(Failure::Lost(why)) if polled.is_lost(&why) => {
                        report("lost", number, Some(&why));
                    }
                    Err(_) => {}
                }
            }
            if let Some(why) = unreachable {
                let mut is_new = false;
                units.iter_mut().for_each(|polled| is_new |= polled.is_lost(&why));
                if is_new {
                    report("lost", None, Some(&why));
                }
            }
            let next = units.iter().map(|polled| polled.next).min();
            let Some(next) = next.filter(|_| stage != Stage::Ends) else {
                link.close().await;
                return;
            };
            tokio::select! {
                () = sleep_until(next) => {}
                changed = stages.changed() => if changed.is_err() { return },
            }
        }
    }
}
