//! The options of a connection.

use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::sync::Arc;

use plcc_configuration::drivers::mqtt::{Broker, Settings};
use rumqttc::{MqttOptions, TlsConfiguration, Transport};
use rustls::pki_types::CertificateDer;
use rustls::pki_types::pem::PemObject;

/// The options of a connection.
///
/// # Errors
/// When a file that they name can't be used.
pub(super) fn options(settings: &Settings, broker: &Broker) -> Result<MqttOptions, String> {
    let client = format!("plcio-{}-{}", settings.group, settings.node);
    let mut options = MqttOptions::new(client, broker.host.as_str(), broker.port);
    options.set_keep_alive(super::KEEP_ALIVE).set_clean_session(true);
    options.set_max_packet_size(super::MAX_BYTES, super::MAX_BYTES);
    if let Some(user) = &settings.user {
        let password = match &settings.password {
            Some(path) => password(path),
            None => Ok(String::new()),
        };
        options.set_credentials(user, password?);
    }
    if broker.is_encrypted {
        let path =
            settings.authority.as_ref().ok_or("mqtts:// needs the key mqtt-ca in [plcio]")?;
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
/// The password in a file that only its owner can read.
fn password(path: &Path) -> Result<String, String> {
    let failed = |why: &dyn std::fmt::Display| format!("{}: {why}", path.display());
    let about = std::fs::metadata(path).map_err(|error| failed(&error))?;
    if about.mode() & 0o077 != 0 {
        return Err(failed(&"others may read the password in it: chmod 600 is needed"));
    }
    let text = crate::input_file::read_text(path).map_err(|error| failed(&error))?;
    Ok(text.trim_end_matches(['\r', '\n']).to_owned())
}
