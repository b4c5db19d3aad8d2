//! MQTT with Sparkplug B: `plcio` publishes points, and takes commands.

use std::path::PathBuf;

use toml::de::DeValue;

use crate::{About, Driver, DriverSettings, Keys, ReadSettings, value};

pub(super) const DRIVERS: &[&dyn Driver] = &[&Mqtt];

#[derive(Debug)]
struct Mqtt;

impl Driver for Mqtt {
    fn name(&self) -> &'static str {
        "mqtt"
    }

    fn feature(&self) -> Option<&'static str> {
        Some("mqtt")
    }

    fn missing_setting(&self, settings: &DriverSettings) -> Option<&'static str> {
        let Settings { broker, authority, .. } = &settings.mqtt;
        match broker {
            None => Some("`mqtt-broker`, which says where the broker is"),
            Some(broker) if broker.is_encrypted && authority.is_none() => {
                Some("`mqtt-ca`, which mqtts:// needs")
            }
            Some(_) => None,
        }
    }
}

/// The settings of the publisher.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The broker. Without it nothing is published.
    pub broker: Option<Broker>,
    /// The group of the edge node.
    pub group: String,
    /// The name of the edge node.
    pub node: String,
    /// The user.
    pub user: Option<String>,
    /// The file with the user's password.
    pub password: Option<PathBuf>,
    /// The certificates, in PEM, by which the broker's certificate is checked.
    pub authority: Option<PathBuf>,
}

/// Where a broker is: `mqtt://HOST[:PORT]`, or `mqtts://HOST[:PORT]` for TLS.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Broker {
    /// The address as it is written.
    pub text: String,
    /// Whether the connection is encrypted.
    pub is_encrypted: bool,
    /// The host.
    pub host: String,
    /// The port.
    pub port: u16,
}

impl Broker {
    /// Reads an address; `None` if it is none.
    pub fn parse(text: &str) -> Option<Self> {
        let (is_encrypted, at) = match text.split_once("://")? {
            ("mqtt", at) => (false, at),
            ("mqtts", at) => (true, at),
            _ => return None,
        };
        let usual = if is_encrypted { 8883 } else { 1883 };
        let (host, port) = match at.rsplit_once(':') {
            Some((host, port)) => (host, port.parse().ok()?),
            None => (at, usual),
        };
        let is_host = !host.is_empty() && !host.contains('/');
        is_host.then(|| Self { text: text.into(), is_encrypted, host: host.into(), port })
    }
}

/// Whether a text can be a part of a topic.
fn is_name(text: &str) -> bool {
    !text.is_empty() && !text.contains(['/', '+', '#', '\0'])
}

fn broker(value: &DeValue<'_>) -> value::Result<Broker> {
    let broker = Broker::parse(&value::text(value)?);
    broker.ok_or_else(|| "a broker such as mqtt://192.168.1.5 is expected".into())
}

fn name(value: &DeValue<'_>) -> value::Result<String> {
    let name = value::text(value)?;
    if is_name(&name) { Ok(name) } else { Err("a name without / + # is expected".into()) }
}

impl ReadSettings for Settings {
    fn read(keys: &mut Keys<'_>, about: &About<'_>) -> Self {
        let path = value::path_in(about.folder);
        let node = keys.read("mqtt-node", name);
        Self {
            broker: keys.read("mqtt-broker", broker),
            group: keys.read("mqtt-group", name).unwrap_or_else(|| "plcc".into()),
            node: node.unwrap_or_else(|| about.name.replace(['+', '#'], "-")),
            user: keys.read("mqtt-user", value::text),
            password: keys.read("mqtt-password", path),
            authority: keys.read("mqtt-ca", path),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_broker_has_a_host_and_a_port() {
        let read = |text| {
            Broker::parse(text).map(|broker| (broker.is_encrypted, broker.host, broker.port))
        };
        assert_eq!(read("mqtt://a.local"), Some((false, "a.local".into(), 1883)));
        assert_eq!(read("mqtts://10.0.0.1"), Some((true, "10.0.0.1".into(), 8883)));
        assert_eq!(read("mqtt://h:99"), Some((false, "h".into(), 99)));
        for text in ["", "h:1883", "http://h", "mqtt://", "mqtt://h:x", "mqtt://h/topic"] {
            assert_eq!(read(text), None, "{text}");
        }
        assert!(is_name("lathe 1") && !is_name("") && !is_name("a/b") && !is_name("#"));
    }
}
