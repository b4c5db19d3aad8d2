//! What a driver says of itself: its name, its addresses, its settings, and what is wrong with its points.

use std::fmt;
use std::path::Path;
use std::sync::Arc;

use crate::{Address, DriverSettings, Entry, Keys, Mistake, Point};

/// What connects variables with the outside. An entry has one by its name.
pub trait Driver: fmt::Debug + Sync {
    /// The name in a configuration.
    fn name(&self) -> &'static str;

    /// The feature with which `plcio` must be built to have it; `None` if it always has it.
    fn feature(&self) -> Option<&'static str> {
        None
    }

    /// Whether `plcio` drives it, rather than another program.
    fn is_of_plcio(&self) -> bool {
        true
    }

    /// The point outside that an address names, of a range the first one; `None` where points have no addresses.
    ///
    /// # Errors
    /// What is wrong with it.
    fn address(&self, text: &str) -> Result<Option<Arc<dyn Address>>, String> {
        match text.is_empty() {
            true => Ok(None),
            false => Err(format!(
                "`address`: points of the driver {} have the names of their variables, and no address",
                self.name()
            )),
        }
    }

    /// Whether an address may be a list of points and ranges of them, one for each line: `gpiochip0/17,27,22`.
    fn lists_addresses(&self) -> bool {
        false
    }

    /// What is wrong with the points of a program taken together, among which are those of other drivers.
    fn mistakes(&self, _points: &[Point]) -> Vec<Mistake> {
        vec![]
    }

    /// The key of `[plcio]` without which its points are not connected, if that is missing, and what it would say.
    fn missing_setting(&self, _settings: &DriverSettings) -> Option<&'static str> {
        None
    }
}

impl PartialEq for dyn Driver {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

/// What a driver's settings depend on besides its own keys.
#[derive(Clone, Copy, Debug)]
pub struct About<'a> {
    /// The folder of the configuration, to which paths are relative.
    pub folder: &'a Path,
    /// A name for the control: that of its image file.
    pub name: &'a str,
    /// What is connected with what.
    pub entries: &'a [Entry],
    /// The log of the control, if it has one.
    pub log: Option<&'a Path>,
    /// The record of the control.
    pub record: &'a Path,
}

/// The settings of a driver, from the keys of `[plcio]` that are its own.
pub trait ReadSettings: Sized {
    /// Reads them. Mistakes are noted at the keys.
    fn read(keys: &mut Keys<'_>, about: &About<'_>) -> Self;
}
