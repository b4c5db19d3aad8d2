//! The table `[plcio]`: the settings of the program with the drivers.

use std::path::PathBuf;
use std::time::Duration;

use crate::{About, DriverSettings, Keys, value};

/// The settings.
#[derive(Clone, Debug)]
pub struct Plcio {
    /// The time from one poll of a device to the next.
    pub poll: Duration,
    /// How long a device has for its answer.
    pub answer: Duration,
    /// How long the control may end no tick before its outputs are made safe.
    pub silence: Duration,
    /// The log.
    pub log: Option<PathBuf>,
    /// Those of the drivers.
    pub drivers: DriverSettings,
}

impl Plcio {
    /// Reads the table. Mistakes are noted at its keys.
    pub fn read(keys: &mut Keys<'_>, about: &About<'_>) -> Self {
        Self {
            poll: keys.time("poll", "poll_ms").unwrap_or(Duration::from_millis(20)),
            answer: keys.time("answer", "answer_ms").unwrap_or(Duration::from_millis(500)),
            silence: keys.time("silence", "silence_ms").unwrap_or(Duration::from_secs(1)),
            log: keys.read("log", value::path_in(about.folder)),
            drivers: DriverSettings::read(keys, about),
        }
    }
}
