//! What the configuration says of zenoh.

use std::path::PathBuf;

use serde_json::json;
use zenoh::Config;

/// The longest message that is taken from others, in bytes.
const MAX_MESSAGE: usize = 16 << 20;

/// The settings.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    /// Routers or other computers, between commas: endpoints of zenoh such as `tcp/192.168.1.5:7447`.
    pub(crate) connect: Option<String>,
    /// Where others may connect, where there is no router: an endpoint.
    pub(crate) listen: Option<String>,
    /// What stands before all keys.
    pub(crate) prefix: String,
    /// The name of the control in keys.
    pub(crate) name: String,
    /// The program `plcc`, which answers queries of history; `None`: they are refused.
    pub(crate) history: Option<PathBuf>,
    /// The log of the control, if it has one.
    pub(crate) control_log: Option<PathBuf>,
    /// The record of the control.
    pub(crate) record: PathBuf,
}

/// Whether a text can stand before keys: parts between slashes.
pub(crate) fn is_prefix(text: &str) -> bool {
    text.split('/').all(plcc_image::configuration::is_key_part)
}

impl Settings {
    /// The configuration of a session. Nobody is looked for in the network: only the endpoints that are named
    /// are used.
    ///
    /// # Errors
    /// When there is no endpoint, or one is none.
    pub(super) fn config(&self) -> Result<Config, String> {
        if self.connect.is_none() && self.listen.is_none() {
            return Err("[plcio] has neither `zenoh-connect` nor `zenoh-listen`".into());
        }
        // A peer of zenoh does not pass on what its clients say to each other; a router does.
        let mode = if self.listen.is_some() { "router" } else { "client" };
        let connect: Vec<&str> =
            self.connect.iter().flat_map(|all| all.split(',')).map(str::trim).collect();
        let listen: Vec<&str> = self.listen.iter().map(String::as_str).collect();
        let mut config = Config::default();
        for (key, value) in [
            ("mode", json!(mode)),
            ("connect/endpoints", json!(connect)),
            ("listen/endpoints", json!(listen)),
            ("scouting/multicast/enabled", json!(false)),
            ("scouting/gossip/enabled", json!(false)),
            ("transport/link/rx/max_message_size", json!(MAX_MESSAGE)),
        ] {
            let done = config.insert_json5(key, &value.to_string());
            done.map_err(|error| format!("zenoh does not take {key}: {error}"))?;
        }
        Ok(config)
    }
}
