//! The configuration of a session of zenoh.

use plcc_configuration::drivers::zenoh::Settings;
use serde_json::json;
use zenoh::Config;

/// The longest message that is taken from others, in bytes.
const MAX_MESSAGE: usize = 16 << 20;

/// The configuration of a session. Nobody is looked for in the network: only the endpoints that are named
/// are used.
///
/// # Errors
/// When there is no endpoint, or one is none.
pub(super) fn config(settings: &Settings) -> Result<Config, String> {
    if settings.connect.is_none() && settings.listen.is_none() {
        return Err("[plcio] has neither `zenoh-connect` nor `zenoh-listen`".into());
    }
    // A peer of zenoh does not pass on what its clients say to each other; a router does.
    let mode = if settings.listen.is_some() { "router" } else { "client" };
    let connect: Vec<&str> =
        settings.connect.iter().flat_map(|all| all.split(',')).map(str::trim).collect();
    let listen: Vec<&str> = settings.listen.iter().map(String::as_str).collect();
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
