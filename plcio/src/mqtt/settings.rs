//! What the table `[plcio]` says of MQTT.

use std::os::unix::fs::MetadataExt;
use std::path::PathBuf;
use std::sync::Arc;

use rumqttc::{MqttOptions, TlsConfiguration, Transport};
use rustls::pki_types::CertificateDer;
use rustls::pki_types::pem::PemObject;

/// The settings of the publisher.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    /// The broker: `mqtt://HOST[:PORT]`, or `mqtts://HOST[:PORT]` for TLS. Without it nothing is published.
    pub(crate) broker: Option<String>,
    /// The group of the edge node.
    pub(crate) group: String,
    /// The name of the edge node.
    pub(crate) node: String,
    /// The user.
    pub(crate) user: Option<String>,
    /// The file with the user's password.
    pub(crate) password: Option<PathBuf>,
    /// The certificates, in PEM, by which the broker's certificate is checked.
    pub(crate) authority: Option<PathBuf>,
}

/// Whether a text can be a part of a topic.
pub(crate) fn is_name(text: &str) -> bool {
    !text.is_empty() && !text.contains(['/', '+', '#', '\0'])
}

impl Settings {
    /// Whether it is encrypted, the host, and the port.
    ///
    /// # Errors
    /// When the broker's address is none.
    pub(crate) fn address(broker: &str) -> Result<(bool, String, u16), String> {
        let expected = || format!("`{broker}` is no broker, as in mqtt://192.168.1.5:1883");
        let (encrypted, at) = match broker.split_once("://") {
            Some(("mqtt", at)) => (false, at),
            Some(("mqtts", at)) => (true, at),
            _ => return Err(expected()),
        };
        let usual = if encrypted { 8883 } else { 1883 };
        let (host, port) = match at.rsplit_once(':') {
            Some((host, port)) => (host, port.parse().ok()),
            None => (at, Some(usual)),
        };
        match port {
            Some(port) if !host.is_empty() && !host.contains('/') => {
                Ok((encrypted, host.into(), port))
            }
            _ => Err(expected()),
        }
    }

    /// The options of a connection.
    ///
    /// # Errors
    /// When a file that they name can't be used.
    pub(super) fn options(&self, broker: &str) -> Result<MqttOptions, String> {
        let (encrypted, host, port) = Self::address(broker)?;
        let client = format!("plcio-{}-{}", self.group, self.node);
        let mut options = MqttOptions::new(client, host, port);
        options.set_keep_alive(super::KEEP_ALIVE).set_clean_session(true);
        options.set_max_packet_size(super::MAX_BYTES, super::MAX_BYTES);
        if let Some(user) = &self.user {
            let password = match &self.password {
                Some(path) => self::password(path),
                None => Ok(String::new()),
            };
            options.set_credentials(user, password?);
        }
        if encrypted {
            let path =
                self.authority.as_ref().ok_or("mqtts:// needs the key mqtt-ca in [plcio]")?;
            let failed = |why: String| format!("{}: {why}", path.display());
            let certificates = CertificateDer::pem_file_iter(path);
            let mut roots = rustls::RootCertStore::empty();
            for certificate in certificates.map_err(|error| failed(error.to_string()))? {
                let certificate = certificate.map_err(|error| failed(error.to_string()))?;
                roots.add(certificate).map_err(|error| failed(error.to_string()))?;
            }
            let provider = Arc::new(rustls::crypto::ring::default_provider());
            let config = rustls::ClientConfig::builder_with_provider(provider)
                .with_safe_default_protocol_versions()
                .map_err(|error| error.to_string())?
                .with_root_certificates(roots)
                .with_no_client_auth();
            let tls = TlsConfiguration::Rustls(Arc::new(config));
            options.set_transport(Transport::tls_with_config(tls));
        }
        Ok(options)
    }
}

/// The password in a file that only its owner can read.
fn password(path: &PathBuf) -> Result<String, String> {
    let failed = |why: &dyn std::fmt::Display| format!("{}: {why}", path.display());
    let about = std::fs::metadata(path).map_err(|error| failed(&error))?;
    if about.mode() & 0o077 != 0 {
        return Err(failed(&"others may read the password in it: chmod 600 is needed"));
    }
    let text = crate::input_file::read_text(path).map_err(|error| failed(&error))?;
    Ok(text.trim_end_matches(['\r', '\n']).to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_broker_has_a_host_and_a_port() {
        let read = |text| Settings::address(text).ok();
        assert_eq!(read("mqtt://a.local"), Some((false, "a.local".into(), 1883)));
        assert_eq!(read("mqtts://10.0.0.1"), Some((true, "10.0.0.1".into(), 8883)));
        assert_eq!(read("mqtt://h:99"), Some((false, "h".into(), 99)));
        for text in ["", "h:1883", "http://h", "mqtt://", "mqtt://h:x", "mqtt://h/topic"] {
            assert_eq!(read(text), None, "{text}");
        }
        assert!(is_name("lathe 1") && !is_name("") && !is_name("a/b") && !is_name("#"));
    }
}
