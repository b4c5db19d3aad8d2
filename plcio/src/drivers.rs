//! The drivers that this `plcio` was built with. A new one is a module of `main.rs` and a line of the list.

use std::sync::{Arc, LazyLock};

use plcc_configuration::Mistake;
use plcc_configuration::drivers;
use tokio::sync::Notify;
use tokio::task::JoinSet;

use crate::driver::{Driver, Making, Stages, Start};
use crate::events::Events;
use crate::session::Shared;
use crate::settings::Settings;

/// Makes a driver.
type Make = fn(&Making<'_>) -> Box<dyn Driver>;

/// The drivers by their names in a configuration.
const ALL: &[(&str, Make)] = &[
    ("modbus-tcp", crate::modbus::client::driver),
    ("modbus-rtu", crate::modbus::client::driver),
    ("modbus-server", crate::modbus::server::driver),
    #[cfg(feature = "opcua")]
    ("opcua", crate::opcua::driver),
    #[cfg(feature = "mqtt")]
    ("mqtt", crate::mqtt::driver),
    #[cfg(feature = "zenoh")]
    ("zenoh", crate::plant::driver),
    ("hal", crate::hal::driver),
    #[cfg(feature = "gpio")]
    ("gpio", crate::gpio::driver),
    #[cfg(feature = "ethercat")]
    ("ethercat", crate::ethercat::driver),
];

fn is_built(name: &str) -> bool {
    ALL.iter().any(|(known, _)| *known == name)
}

/// The names of the drivers, each in a line of its own.
pub(crate) fn names() -> String {
    ALL.iter().map(|(name, _)| format!("{name}\n")).collect()
}

/// What `--version` says: the version, and the drivers in a line.
pub(crate) fn long_version() -> &'static str {
    static TEXT: LazyLock<String> = LazyLock::new(|| {
        let names: Vec<&str> = ALL.iter().map(|(name, _)| *name).collect();
        format!("{}\ndrivers: {}", env!("CARGO_PKG_VERSION"), names.join(", "))
    });
    &TEXT
}

/// What a configuration asks for and this `plcio` was built without.
pub(crate) fn missing(configuration: &plcc_configuration::Configuration) -> Vec<Mistake> {
    let missing = |line, feature: &str| Mistake {
        line,
        message: format!(
            "this plcio was built without the feature `{feature}`: cargo install --locked --path plcio --features {feature}"
        ),
    };
    let without = |name: &str, feature: Option<&'static str>| feature.filter(|_| !is_built(name));
    let entries = configuration.entries.iter().filter_map(|entry| {
        let feature = without(entry.driver.name(), entry.driver.feature())?;
        Some(missing(entry.line, feature))
    });
    let keys = configuration.plcio_keys().filter_map(|(key, line)| {
        let (part, _) = key.split_once('-')?;
        let driver = drivers::all().find(|driver| driver.feature() == Some(part))?;
        Some(missing(line, without(driver.name(), driver.feature())?))
    });
    entries.chain(keys).collect()
}

/// The drivers that a configuration uses.
pub(crate) struct Drivers(Vec<(&'static str, Box<dyn Driver>)>);

impl Drivers {
    /// Makes them. `end` is notified when one of them ends `plcio`.
    pub(crate) fn new(settings: &Arc<Settings>, events: &Events, end: &Arc<Notify>) -> Self {
        let making = Making { settings, events, end };
        let is_named = |name| settings.entries.iter().any(|entry| entry.driver.name() == name);
        let made = ALL.iter().map(|&(name, make)| (name, make(&making)));
        let is_used = |(name, driver): &(&'static str, Box<dyn Driver>)| {
            is_named(*name) || driver.works_without_points()
        };
        Self(made.filter(is_used).collect())
    }

    /// Starts them for an image file. Gives the tasks that write outputs to devices; those for others who look on go into `others`, or
    /// are not begun without that.
    pub(crate) fn start(
        &mut self,
        shared: &Shared,
        stages: &Stages,
        mut others: Option<&mut JoinSet<()>>,
    ) -> JoinSet<()> {
        let mut writers = JoinSet::new();
        for (name, driver) in &mut self.0 {
            let points = shared.hub().points_of(name);
            driver.start(&mut Start {
                shared,
                points: &points,
                stages: stages.clone(),
                writers: &mut writers,
                others: others.as_deref_mut(),
            });
        }
        writers
    }

    /// Ends what outlives image files.
    pub(crate) async fn end(&mut self) {
        for (_, driver) in &mut self.0 {
            driver.end().await;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_driver_of_a_configuration_is_here_or_needs_a_feature() {
        for driver in drivers::all().filter(|driver| driver.is_of_plcio()) {
            assert!(is_built(driver.name()) || driver.feature().is_some(), "{}", driver.name());
        }
        let known = |name| drivers::all().any(|driver| driver.name() == name);
        assert!(ALL.iter().all(|(name, _)| known(*name)));
    }
}
