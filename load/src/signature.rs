//! Signatures of artifacts, by Ed25519.
//!
//! The signature of a signed artifact stands after it, [`LENGTH`] bytes:
//!
//! | offset | bytes | holds |
//! | --- | --- | --- |
//! | 0 | 8 | [`MAGIC`] |
//! | 8 | 32 | the public key with which it can be checked |
//! | 40 | 64 | the Ed25519 signature of all bytes of the artifact, without these 104 |
//!
//! Keys are files in the usual text form (PEM: PKCS #8 for the private, SPKI for the public key), as
//! `openssl genpkey -algorithm ed25519` and `openssl pkey -pubout` write them too. The public key in
//! a signature says which key to look for. It proves nothing: only a key that the machine's owner has
//! put there does.

use std::fmt;
use std::io;
use std::path::Path;

use ed25519_dalek::pkcs8::DecodePublicKey;
use ed25519_dalek::{PUBLIC_KEY_LENGTH, SIGNATURE_LENGTH, VerifyingKey};

use super::error::ArtifactError;
use plcc_files::read_regular;

/// The bytes with which a signature begins.
pub const MAGIC: [u8; 8] = *b"\x8FPLCSIG1";

/// The length of a signature with the key and the magic bytes.
pub const LENGTH: usize = MAGIC.len() + PUBLIC_KEY_LENGTH + SIGNATURE_LENGTH;

/// The longest file of a key that is read, in bytes.
const MAX_KEY_FILE: u64 = 64 << 10;

/// A signature as it stands after an artifact. Nothing of it is checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Signature {
    key: [u8; PUBLIC_KEY_LENGTH],
    signature: [u8; SIGNATURE_LENGTH],
}

impl Signature {
    /// The signature `signature` that the key `key` checks.
    pub fn new(key: [u8; PUBLIC_KEY_LENGTH], signature: [u8; SIGNATURE_LENGTH]) -> Self {
        Self { key, signature }
    }

    /// The bytes that stand after the artifact.
    pub fn bytes(&self) -> Vec<u8> {
        [&MAGIC[..], &self.key, &self.signature].concat()
    }

    /// The key that the signature names; `None` if its bytes are not a key.
    pub fn key(&self) -> Option<PublicKey> {
        VerifyingKey::from_bytes(&self.key).ok().map(PublicKey)
    }
}

/// Divides a file into the artifact and the signature after it, if one stands there.
pub fn split(bytes: &[u8]) -> (&[u8], Option<Signature>) {
    let parts = || {
        let (artifact, tail) = bytes.split_last_chunk::<LENGTH>()?;
        let (magic, tail) = tail.split_first_chunk::<{ MAGIC.len() }>()?;
        let (key, signature) = tail.split_first_chunk::<PUBLIC_KEY_LENGTH>()?;
        let signature = Signature { key: *key, signature: signature.try_into().ok()? };
        (*magic == MAGIC).then_some((artifact, Some(signature)))
    };
    parts().unwrap_or((bytes, None))
}

/// A key with which signatures are checked.
#[derive(Clone, PartialEq, Eq)]
pub struct PublicKey(VerifyingKey);

impl PublicKey {
    /// Reads a key from a file.
    ///
    /// # Errors
    /// When the file can't be read, or holds no public key of this kind.
    pub fn open(path: &Path) -> io::Result<Self> {
        let text = read_regular(path, MAX_KEY_FILE)?;
        Self::parse(&String::from_utf8_lossy(&text))
    }

    /// Reads a key from its text form.
    ///
    /// # Errors
    /// When it is not a public key of this kind.
    pub fn parse(text: &str) -> io::Result<Self> {
        let invalid = |what| io::Error::new(io::ErrorKind::InvalidData, what);
        if text.contains("PRIVATE KEY") {
            return Err(invalid("it is a private key; name the public key beside it"));
        }
        let key = VerifyingKey::from_public_key_pem(text);
        key.map(Self).map_err(|_| invalid("it is not a public key; `plcc key new` makes keys"))
    }

    /// The key with these bytes; `None` if they are none.
    pub fn from_bytes(bytes: [u8; PUBLIC_KEY_LENGTH]) -> Option<Self> {
        VerifyingKey::from_bytes(&bytes).ok().map(Self)
    }

    /// Checks that a signature was made of these bytes with the private key of this key.
    ///
    /// # Errors
    /// [`ArtifactError::OtherKey`] or [`ArtifactError::WrongSignature`].
    pub fn verify(&self, artifact: &[u8], signature: &Signature) -> Result<(), ArtifactError> {
        if signature.key != *self.0.as_bytes() {
            return Err(ArtifactError::OtherKey);
        }
        let signature = ed25519_dalek::Signature::from_bytes(&signature.signature);
        let verified = self.0.verify_strict(artifact, &signature);
        verified.map_err(|_| ArtifactError::WrongSignature)
    }
}

impl fmt::Display for PublicKey {
    /// The key's bytes in hexadecimal digits.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.as_bytes().iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for PublicKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "PublicKey({self})")
    }
}
