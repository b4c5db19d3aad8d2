//! The folder of certificates: the server's own one, made where it is missing, those of clients that are
//! trusted, and those of clients that were refused.

use std::collections::HashSet;
use std::fs::{self, DirBuilder, Permissions};
use std::os::unix::fs::{DirBuilderExt, PermissionsExt};
use std::path::{Path, PathBuf};

use opcua::crypto::{CertificateStore, X509Data};

/// The folder.
pub(super) struct Certificates {
    folder: PathBuf,
    /// The refused certificates that have been reported.
    reported: HashSet<PathBuf>,
}

/// The length of the server's key in bits.
const KEY_BITS: u32 = 2048;
/// For how many days the server's certificate is valid: twenty years, since machines outlive the people who
/// would renew it.
const DAYS: u32 = 7300;

impl Certificates {
    /// Makes the folder and the server's certificate where they are missing. The folder and the private key
    /// are for their owner alone.
    ///
    /// # Errors
    /// Why that is not possible.
    pub(super) fn open(folder: &Path, uri: &str) -> Result<Self, String> {
        let shown = folder.display();
        let failed = |error: std::io::Error| format!("{shown}: {error}");
        let mut private = DirBuilder::new();
        private.recursive(true).mode(0o700);
        for part in ["own", "private", "trusted", "rejected"] {
            private.create(folder.join(part)).map_err(failed)?;
        }
        let store = CertificateStore::new(folder);
        if store.read_own_cert().is_err() || store.read_own_pkey().is_err() {
            let data = X509Data {
                key_size: KEY_BITS,
                common_name: "plcio".into(),
                organization: "plcio".into(),
                organizational_unit: "plcio".into(),
                country: "XX".into(),
                state: "-".into(),
                alt_host_names: X509Data::alt_host_names(uri, None, true, true, true),
                certificate_duration_days: DAYS,
            };
            store
                .create_and_store_application_instance_cert(&data, true)
                .map_err(|why| format!("{shown}: {why}"))?;
            let key = folder.join("private/private.pem");
            fs::set_permissions(key, Permissions::from_mode(0o600)).map_err(failed)?;
        }
        let mut certificates = Self { folder: folder.into(), reported: HashSet::new() };
        // What was refused in an earlier session has been reported then.
        certificates.newly_refused();
        Ok(certificates)
    }

    /// The files of certificates that were refused since the last call.
    pub(super) fn newly_refused(&mut self) -> Vec<PathBuf> {
        let files = fs::read_dir(self.folder.join("rejected"));
        let paths = files.into_iter().flatten().flatten().map(|entry| entry.path());
        let refused: HashSet<PathBuf> = paths.collect();
        let new = refused.difference(&self.reported).cloned().collect();
        self.reported = refused;
        new
    }
}
