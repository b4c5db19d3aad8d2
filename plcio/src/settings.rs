//! What the configuration of a control says to `plcio`.

use std::path::{Path, PathBuf};
use std::time::Duration;

use plcc_configuration::{Configuration, DriverSettings, Entry, Mistake, Mistakes, Plcio, Warning};

use crate::drivers;

/// The settings.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    /// The image file.
    pub(crate) image: PathBuf,
    /// What is connected with what.
    pub(crate) entries: Vec<Entry>,
    /// The time from one poll of a device to the next.
    pub(crate) poll: Duration,
    /// How long a device has for its answer.
    pub(crate) answer: Duration,
    /// How long the control may end no tick before its outputs are made safe.
    pub(crate) silence: Duration,
    /// The log.
    pub(crate) log: Option<PathBuf>,
    /// The settings of the drivers.
    pub(crate) drivers: DriverSettings,
}

/// That there are mistakes, if there are some.
fn refuse(path: &Path, mut mistakes: Vec<Mistake>) -> Result<(), String> {
    mistakes.sort();
    if mistakes.is_empty() { Ok(()) } else { Err(Mistakes(path, &mistakes).to_string()) }
}

impl Settings {
    /// Reads a configuration. Mistakes in keys that are not for `plcio` are left to [`check`] and `plcrt`.
    ///
    /// # Errors
    /// All mistakes, for people.
    pub(crate) fn open(path: &Path) -> Result<Self, String> {
        let (configuration, findings) = Configuration::open(path)?;
        let mut mistakes = findings.for_plcio();
        mistakes.extend(drivers::missing(&configuration));
        refuse(path, mistakes)?;
        let Configuration { image, entries, plcio, .. } = configuration;
        let Plcio { poll, answer, silence, log, drivers } = plcio;
        Ok(Self { image: image.unwrap_or_default(), entries, poll, answer, silence, log, drivers })
    }

    /// A name for the control: that of its image file.
    #[cfg(feature = "opcua")]
    pub(crate) fn name(&self) -> String {
        let name = self.image.file_stem().map(|name| name.to_string_lossy().into_owned());
        name.unwrap_or_else(|| "control".into())
    }
}

/// Finds the mistakes of a configuration as far as its program need not be known for that. Gives what may be wrong besides.
///
/// # Errors
/// All mistakes, for people.
pub(crate) fn check(path: &Path) -> Result<Vec<Warning>, String> {
    let (configuration, findings) = Configuration::open(path)?;
    let mut mistakes = findings.all();
    mistakes.extend(drivers::missing(&configuration));
    refuse(path, mistakes)?;
    Ok(configuration.warnings())
}
