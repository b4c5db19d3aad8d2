//! Asks devices: reads what they give, and writes what they get, in every poll.
//!
//! An input whose device gives no value in time becomes late, so that the control gives it its safe value. A unit that is
//! lost is asked again, after pauses that grow from 0.1 s to 5 s; meanwhile the others of its line go on. When the control
//! has left, devices with outputs are still served: each gets its safe values, also one that comes back later.

use std::collections::BTreeMap;

use plcc_configuration::drivers::modbus::{Manner, Medium, ModbusAddress};
use serde_json::Value;
use tokio::time::{Instant, sleep_until};

use super::blocks::{Member, blocks};
use super::link::{Failure, Link};
use super::reports::Reports;
use super::unit::Unit;
use crate::driver::{Driver, Making, Stage, Stages, Start};
use crate::reconnection::Reconnection;
use crate::session::Shared;

/// The driver: each device is a task of its own.
struct Client;

/// Makes the driver.
pub(crate) fn driver(_: &Making<'_>) -> Box<dyn Driver> {
    Box::new(Client)
}

impl Driver for Client {
    fn start(&mut self, session: &mut Start<'_>) {
        for device in devices(session.shared, session.points) {
            session.write(device.run(session.shared.clone(), session.stages.clone()));
        }
    }
}

/// A device, or all units of a serial line.
struct Device {
    name: String,
    medium: Medium,
    units: Vec<Polled>,
}

/// A unit, and when it is polled.
struct Polled {
    unit: Unit,
    next: Instant,
    connection: Reconnection,
}

/// The members of a unit that are read, and those that are written.
type Members = (Vec<Member>, Vec<Member>);

/// The devices of some points.
fn devices(shared: &Shared, points: &[usize]) -> Vec<Device> {
    let mut found: Vec<(Medium, BTreeMap<u8, Members>)> = vec![];
    let hub = shared.hub();
    for &index in points {
        let Some(point) = hub.point(index) else { continue };
        let Some(address) = point.address::<ModbusAddress>().cloned() else { continue };
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
        let has_many = units.len() > 1;
        let settings = &shared.settings;
        let usual = Manner { poll: settings.poll, answer: settings.answer, is_single: false };
        let unit = |(number, (reads, writes)): (u8, Members)| {
            let manner = settings.drivers.modbus.manner(&medium, number, usual);
            let reports = Reports::new(shared.events.clone(), name.clone(), number);
            let unit = Unit::new(number, manner, blocks(reads), blocks(writes), reports);
            let mut about = vec![("device", Value::from(name.as_str()))];
            about.extend(has_many.then(|| ("unit", number.into())));
            let connection = Reconnection::new(shared.events.clone(), about);
            Polled { unit, next: Instant::now(), connection }
        };
        let units = units.into_iter().map(unit).collect();
        Device { name, medium, units }
    };
    found.into_iter().map(device).collect()
}

impl Polled {
    /// Decides when the unit, which is lost, is asked again.
    fn ask_later(&mut self) {
        self.next = Instant::now() + self.connection.next_pause();
    }
}

impl Device {
    /// Polls the units until the session ends; then writes the outputs once more.
    async fn run(self, shared: Shared, mut stages: Stages) {
        let Self { name, medium, mut units } = self;
        let mut link = Link::new(medium);
        let mut stage = Stage::Works;
        loop {
            let before = std::mem::replace(&mut stage, *stages.borrow_and_update());
            if stage != Stage::Works {
                units.retain(|polled| polled.unit.has_outputs());
            }
            let mut unreachable = None;
            for polled in &mut units {
                let is_at_once = stage != before && polled.connection.is_connected();
                if !is_at_once && (polled.next > Instant::now() || stage == Stage::Ends) {
                    continue;
                }
                match polled.unit.exchange(&mut link, &shared, &stages).await {
                    Ok(()) => {
                        polled.connection.connected();
                        polled.next = (polled.next + polled.unit.manner.poll).max(Instant::now());
                    }
                    Err(Failure::Unreachable(why)) => {
                        unreachable = Some(why);
                        break;
                    }
                    Err(Failure::Lost(why)) => {
                        polled.connection.lost(&why);
                        polled.ask_later();
                    }
                    // What is refused is reported where it is asked.
                    Err(Failure::Refused(_)) => {}
                }
            }
            if let Some(why) = unreachable {
                let mut is_new = false;
                for polled in &mut units {
                    is_new |= polled.connection.note_lost(&why);
                    polled.ask_later();
                }
                if is_new {
                    let about = [("device", Value::from(name.as_str())), ("why", why.into())];
                    shared.events.write("lost", &about);
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
