//! zenoh: `plcio` publishes points for other computers of a plant, takes values that others write, and follows variables of other
//! controls.

mod variable;

use std::path::PathBuf;
use std::sync::Arc;

use toml::de::DeValue;

pub use variable::ZenohVariable;

use crate::{About, Address, Driver, DriverSettings, Keys, ReadSettings, value};

pub(super) const DRIVERS: &[&dyn Driver] = &[&Zenoh];

#[derive(Debug)]
struct Zenoh;

impl Driver for Zenoh {
    fn name(&self) -> &'static str {
        "zenoh"
    }

    fn feature(&self) -> Option<&'static str> {
        Some("zenoh")
    }

    fn address(&self, text: &str) -> Result<Option<Arc<dyn Address>>, String> {
        match text {
            "" => Ok(None),
            _ => Ok(Some(Arc::new(ZenohVariable::parse(text)?))),
        }
    }

    fn missing_setting(&self, settings: &DriverSettings) -> Option<&'static str> {
        let Settings { connect, listen, .. } = &settings.zenoh;
        let is_alone = connect.is_none() && listen.is_none();
        is_alone.then_some("`zenoh-connect` or `zenoh-listen`")
    }
}

/// The settings.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Routers or other computers, between commas: endpoints of zenoh such as `tcp/192.168.1.5:7447`.
    pub connect: Option<String>,
    /// Where others may connect, where no router answers: an endpoint.
    pub listen: Option<String>,
    /// What stands before all keys.
    pub prefix: String,
    /// The name of the control in keys.
    pub name: String,
    /// The log of the control, if it has one.
    pub control_log: Option<PathBuf>,
    /// The record of the control.
    pub record: PathBuf,
}

/// Whether a text can be a part of a key: not empty, and without letters that have a meaning in keys.
fn is_key_part(text: &str) -> bool {
    !text.is_empty() && !text.contains(['/', '*', '$', '?', '#'])
}

/// Parts of a key between slashes.
fn prefix(value: &DeValue<'_>) -> value::Result<String> {
    let text = value::text(value)?;
    let fits = text.split('/').all(is_key_part);
    fits.then_some(text).ok_or_else(|| "a name without * $ ? # is expected".into())
}

fn name(value: &DeValue<'_>) -> value::Result<String> {
    let text = value::text(value)?;
    let fits = is_key_part(&text);
    fits.then_some(text).ok_or_else(|| "a name without * $ ? # is expected".into())
}

impl ReadSettings for Settings {
    fn read(keys: &mut Keys<'_>, about: &About<'_>) -> Self {
        let own_name = keys.read("zenoh-name", name);
        Self {
            connect: keys.read("zenoh-connect", value::text),
            listen: keys.read("zenoh-listen", value::text),
            prefix: keys.read("zenoh-prefix", prefix).unwrap_or_else(|| "plcc".into()),
            name: own_name.unwrap_or_else(|| about.name.replace(['*', '$', '?', '#'], "-")),
            control_log: about.log.map(ToOwned::to_owned),
            record: about.record.to_owned(),
        }
    }
}
