//! OPC UA: clients read and write points by the server of `plcio`.

use std::path::PathBuf;

use crate::{About, Driver, DriverSettings, Keys, ReadSettings, value};

pub(super) const DRIVERS: &[&dyn Driver] = &[&OpcUa];

#[derive(Debug)]
struct OpcUa;

impl Driver for OpcUa {
    fn name(&self) -> &'static str {
        "opcua"
    }

    fn feature(&self) -> Option<&'static str> {
        Some("opcua")
    }

    fn missing_setting(&self, settings: &DriverSettings) -> Option<&'static str> {
        settings.opcua.address.is_none().then_some("`opcua-server`, which says where it listens")
    }
}

/// The settings of the server.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Where it listens: host and port. Without it there is no server.
    pub address: Option<String>,
    /// The folder of its certificate and of those that it trusts.
    pub certificates: PathBuf,
    /// The file with users and passwords.
    pub users: Option<PathBuf>,
    /// Whether everybody may read, without a password.
    pub anonymous: bool,
}

impl ReadSettings for Settings {
    fn read(keys: &mut Keys<'_>, about: &About<'_>) -> Self {
        let path = value::path_in(about.folder);
        let certificates = keys.read("opcua-certificates", path);
        Self {
            address: keys.read("opcua-server", value::text),
            certificates: certificates.unwrap_or_else(|| about.folder.join("opcua")),
            users: keys.read("opcua-users", path),
            anonymous: keys.read("opcua-anonymous", value::bool).unwrap_or(false),
        }
    }
}
