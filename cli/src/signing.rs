//! Private keys and the signatures that they make; [`plcc_load::signature`] has the rest.

use std::fs::OpenOptions;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use ed25519_dalek::pkcs8::spki::der::pem::LineEnding;
use ed25519_dalek::pkcs8::{DecodePrivateKey, EncodePrivateKey, EncodePublicKey};
use ed25519_dalek::{Signer, SigningKey};
use plcc_files::{read_regular, why_not_read};
use plcc_load::signature::Signature;

use crate::failure::Failure;

/// The longest file of a private key that is read, in bytes.
const MAX_KEY_FILE: u64 = 64 << 10;

/// Makes a new pair of keys. The private one is written to `path`, readable by its owner alone, the
/// public one to the same name with `.pub` after it. Gives the public key in hexadecimal digits.
///
/// # Errors
/// When one of the files exists or can't be written, or the system gives no random numbers.
pub(crate) fn new_key(path: &Path) -> Result<String, Failure> {
    let mut seed = [0; 32];
    getrandom::fill(&mut seed)
        .map_err(|error| Failure::usage(format!("the system gives no random numbers: {error}")))?;
    let key = SigningKey::from_bytes(&seed);
    let unwritable = |error: &dyn std::fmt::Display| {
        Failure::internal(format!("a new key can't be written as text: {error}"))
    };
    let private = key.to_pkcs8_pem(LineEnding::LF).map_err(|error| unwritable(&error))?;
    let public = key.verifying_key().to_public_key_pem(LineEnding::LF);
    let public = public.map_err(|error| unwritable(&error))?;
    let mut public_path = path.as_os_str().to_owned();
    public_path.push(".pub");
    let public_path = PathBuf::from(public_path);
    if public_path.exists() {
        return Err(Failure::file(&public_path, "it exists already; nothing is overwritten"));
    }
    create(path, private.as_bytes(), 0o600)?;
    create(&public_path, public.as_bytes(), 0o644)?;
    Ok(key.verifying_key().as_bytes().iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Writes a file that does not exist yet, with these permissions.
fn create(path: &Path, bytes: &[u8], mode: u32) -> Result<(), Failure> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, mode);
    #[cfg(not(unix))]
    let _ = mode;
    let written = options.open(path).and_then(|mut file| file.write_all(bytes));
    written.map_err(|error| match error.kind() {
        io::ErrorKind::AlreadyExists => {
            Failure::file(path, "it exists already; nothing is overwritten")
        }
        _ => Failure::file(path, format!("it can't be written: {error}")),
    })
}

/// An artifact with a signature after it, made with the private key in a file.
///
/// # Errors
/// When the file can't be read, or holds no private key of this kind.
pub(crate) fn sign(mut artifact: Vec<u8>, path: &Path) -> Result<Vec<u8>, Failure> {
    let text = read_regular(path, MAX_KEY_FILE).map_err(|error| {
        Failure::file(path, format!("it can't be read: {}", why_not_read(&error)))
    })?;
    let text = String::from_utf8_lossy(&text);
    let key = SigningKey::from_pkcs8_pem(&text)
        .map_err(|_| Failure::file(path, "it is not a private key; `plcc key new` makes keys"))?;
    let signature = key.sign(&artifact).to_bytes();
    artifact.extend(Signature::new(key.verifying_key().to_bytes(), signature).bytes());
    Ok(artifact)
}
