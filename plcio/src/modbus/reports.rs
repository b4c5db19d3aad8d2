//! What was reported about a unit of a device: each refusal is one event, and its end another.

use std::collections::HashMap;

use plcc_configuration::drivers::modbus::Table;
use serde_json::Value;

use super::blocks::Member;
use super::unfit::Unfit;
use crate::events::Events;
use crate::session::Shared;

/// The reports about a unit.
pub(super) struct Reports {
    events: Events,
    /// The name of the device.
    device: String,
    unit: u8,
    /// The requests that are refused, by table, number and whether they write, with the reasons.
    refused: HashMap<(Table, u16, bool), String>,
    unfit: Unfit,
}

impl Reports {
    /// Nothing was reported yet.
    pub(super) fn new(events: Events, device: String, unit: u8) -> Self {
        Self { events, device, unit, refused: HashMap::new(), unfit: Unfit::default() }
    }

    fn write(&self, kind: &str, table: Table, number: u16, more: &[(&str, &str)]) {
        let mut about = vec![
            ("device", Value::from(self.device.as_str())),
            ("unit", self.unit.into()),
            ("table", format!("{table:?}").to_lowercase().into()),
            ("number", number.into()),
        ];
        about.extend(more.iter().map(|&(key, text)| (key, text.into())));
        self.events.write(kind, &about);
    }

    /// Reports why a request is refused, or that it is not, where that has changed.
    pub(super) fn request(&mut self, request: (Table, u16, bool), why: Option<String>) {
        let (table, number, _) = request;
        match why {
            Some(why) if self.refused.get(&request) != Some(&why) => {
                self.write("refused", table, number, &[("why", &why)]);
                self.refused.insert(request, why);
            }
            None if self.refused.remove(&request).is_some() => {
                self.write("accepted", table, number, &[]);
            }
            _ => {}
        }
    }

    /// Reports why the value of a point does not fit, or that it does, where that has changed.
    pub(super) fn value(
        &mut self,
        shared: &Shared,
        member: &Member,
        why: Option<impl FnOnce() -> String>,
    ) {
        let (index, address) = (member.index, &member.address);
        let name = || {
            shared.hub().point(index).map_or_else(String::new, |point| point.symbol.name.clone())
        };
        if !self.unfit.note(index, why.is_none()) {
            return;
        }
        let name = name();
        match why {
            Some(why) => {
                let about = [("name", &*name), ("why", &why())];
                self.write("refused", address.table, address.number, &about);
            }
            None => self.write("accepted", address.table, address.number, &[("name", &name)]),
        }
    }

    /// Reports that coils and registers are written singly from now on.
    pub(super) fn single_writes(&self, table: Table, number: u16) {
        let function = if table == Table::Coil { "15" } else { "16" };
        let why = format!("it does not know the function {function}");
        self.write("single_writes", table, number, &[("why", &why)]);
    }
}
