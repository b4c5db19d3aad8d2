//! Pins of LinuxCNC's hardware abstraction layer.

use std::path::PathBuf;

use plcc_image::hal_pin_name;
use toml::de::DeValue;

use crate::{About, Driver, Keys, ReadSettings, value};

pub(super) const DRIVERS: &[&dyn Driver] = &[&Hal];

#[derive(Debug)]
struct Hal;

impl Driver for Hal {
    fn name(&self) -> &'static str {
        "hal"
    }
}

/// The settings of the component.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Its name in HAL.
    pub component: String,
    /// The Python that has LinuxCNC's modules.
    pub python: PathBuf,
}

fn name(value: &DeValue<'_>) -> value::Result<String> {
    let name = value::text(value)?;
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    let is_name = !name.is_empty() && name.len() <= 32 && name.chars().all(fits);
    is_name.then_some(name).ok_or_else(|| "a name of letters, digits and - is expected".into())
}

impl ReadSettings for Settings {
    fn read(keys: &mut Keys<'_>, about: &About<'_>) -> Self {
        let component = keys.read("hal-component", name);
        // A program, which is looked for in the PATH.
        let python = keys.read("hal-python", value::text).map(PathBuf::from);
        Self {
            component: component.unwrap_or_else(|| hal_pin_name(about.name)),
            python: python.unwrap_or_else(|| "/usr/bin/python3".into()),
        }
    }
}
