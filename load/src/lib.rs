//! Programs compiled ahead of time: what `plcc build` writes and the loader (`plcrt`, or a program that
//! uses this crate) reads.
//!
//! An artifact is flat, little endian, and knows its own length:
//!
//! | part | holds |
//! | --- | --- |
//! | header, 192 bytes | see [`header`]; it ends with a checksum of itself |
//! | tables | the [`Program`], the functions' names and places, the [places at which the program may be stopped](plcc_abi::TrapSite), and where it has one the [operator's screen](plcc_abi::OperatorPanel), by postcard |
//! | labels | for each label the offset of its function in the code, 32 bits each |
//! | lines | the line table, three times 32 bits an entry: offset, file, line |
//! | code | position-independent machine code without relocations |
//! | unwind information | an `.eh_frame` section, see [`plcc_abi::unwind`] |
//! | debug part | may be empty: an ELF file for gdb, see [`Artifact::debug`] |
//! | sources | may be empty: what the program was compiled from, see [`Artifact::sources`] |
//!
//! The header also has a digest of the whole file, so no byte can be wrong unnoticed. After an
//! artifact a [`signature`] may stand. A digest is against accidents: whoever can write artifacts can
//! run code, as with any executable, unless the loader is told to take signed ones only. Tables from
//! one artifact beside code from another are found by the code's [markers](plcc_abi::function_marker)
//! even where somebody has made the digest right.
//!
//! The file is read, not mapped: what has been checked must be what is executed, whatever happens
//! to the file meanwhile. Its code is copied into memory of its own that is executable and no
//! longer writable, by [`NativeEngine`], and only when everything has been
//! found right: nothing of an artifact that is refused is ever executed.
//!
//! ```no_run
//! use plcc_load::Artifact;
//! use plcc_runtime::NativeEngine;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let artifact = Artifact::open("lathe.plcx".as_ref(), None)?;
//! let engine = NativeEngine::new(&artifact.code, &artifact.program)?;
//! # Ok(())
//! # }
//! ```

#![allow(unsafe_code)]

mod error;
pub mod header;
mod payload;
pub mod signature;
#[cfg(test)]
mod tests;
pub(crate) mod validate;

use plcc_abi::Fnv;
use std::hash::Hasher;
use std::io::Read;
use std::path::Path;

use plcc_abi::{ABI_VERSION, Code, CodeParts, OperatorPanel, Program};

pub use error::ArtifactError;
use error::inconsistent;
use header::{ArtifactDigest, Header};
use payload::Decoded;
use plcc_files::open_regular;
use plcc_runtime::NativeEngine;
use signature::PublicKey;

/// The longest artifact that is read, in bytes.
pub const MAX_FILE: u64 = 512 << 20;
/// The longest tables, in bytes of the file. In memory they take several times as much.
pub const MAX_TABLES: u32 = 64 << 20;
/// The largest process image, in bytes.
pub const MAX_IMAGE: u32 = 256 << 20;

/// A program that was compiled ahead of time, read and checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Artifact {
    /// What an executive needs.
    pub program: Program,
    /// The machine code, for the machine that is running.
    pub code: Code,
    /// An ELF file that describes the code for debuggers, with symbols, lines, and types, for
    /// [`NativeEngine::show_to_gdb`](plcc_runtime::NativeEngine); empty if the artifact has none. What it holds is
    /// for debuggers alone and is not checked: nothing that runs depends on it.
    pub debug: Vec<u8>,
    /// The sources that the program was compiled from, with the compiler's options, as
    /// `RecordedSources::to_bytes` of the flight recorder writes them; empty if the artifact
    /// has none. Only `plcc` reads them: to show statements, and to run them again in the interpreter.
    pub sources: Vec<u8>,
    /// What an operator sees of the control's panels. Artifacts that were built before there was such a screen have none.
    pub operator: Option<OperatorPanel>,
}

impl Artifact {
    /// The program alone. The code and all that is for people is given back: an engine that was made of the code has
    /// a copy of what it needs.
    pub fn into_program(self) -> Program {
        self.program
    }
}

/// What an artifact holds for people beside the program. Nothing that runs depends on it, and it is not checked.
#[derive(Clone, Copy, Debug, Default)]
pub struct Attached<'a> {
    /// See [`Artifact::debug`].
    pub debug: &'a [u8],
    /// See [`Artifact::sources`].
    pub sources: &'a [u8],
    /// See [`Artifact::operator`].
    pub operator: Option<&'a OperatorPanel>,
}

/// Writes an artifact with neither debug part nor sources.
///
/// # Errors
/// When the program exceeds what the loader accepts, or program and code do not fit each other.
pub fn encode(program: &Program, code: &Code) -> Result<Vec<u8>, ArtifactError> {
    write(program, code, Attached::default())
}

/// Writes an artifact with what debuggers and displays need.
///
/// # Errors
/// As [`encode`].
pub fn encode_with(
    program: &Program,
    code: &Code,
    attached: Attached<'_>,
) -> Result<Vec<u8>, ArtifactError> {
    write(program, code, attached)
}

/// Does what [`encode_with`] does, also for code that is not sealed.
fn write(
    program: &Program,
    code: &CodeParts,
    attached: Attached<'_>,
) -> Result<Vec<u8>, ArtifactError> {
    validate::program(program)?;
    validate::code(program, code)?;
    let payload = payload::encode(program, code, attached)?;
    let header = Header {
        version: ABI_VERSION,
        length: (header::LENGTH + payload.bytes.len()) as u64,
        parts: payload.parts,
        architecture: code.architecture.clone(),
        features: code.features.clone(),
        image_size: code.image_size,
    };
    if header.length > MAX_FILE {
        return Err(ArtifactError::TooLarge {
            what: "artifact",
            size: header.length,
            limit: MAX_FILE,
        });
    }
    let mut bytes = header.encode(&payload.bytes)?.to_vec();
    bytes.extend(payload.bytes);
    Ok(bytes)
}

impl Artifact {
    /// Reads and checks a file. With a key, the file must be signed with the private key that belongs to it.
    ///
    /// # Errors
    /// When it can't be read or is refused.
    pub fn open(path: &Path, key: Option<&PublicKey>) -> Result<Self, ArtifactError> {
        Self::parse(&Self::bytes(path)?, key)
    }

    /// Does what [`open`](Self::open) does, and gives the file's bytes too.
    ///
    /// # Errors
    /// When it can't be read or is refused.
    pub fn open_with_bytes(
        path: &Path,
        key: Option<&PublicKey>,
    ) -> Result<(Self, Vec<u8>), ArtifactError> {
        let bytes = Self::bytes(path)?;
        Ok((Self::parse(&bytes, key)?, bytes))
    }

    /// The bytes of a file, one more than allowed where it is longer than any artifact may be.
    fn bytes(path: &Path) -> Result<Vec<u8>, ArtifactError> {
        let fail = |source| ArtifactError::Read { path: path.to_owned(), source };
        let file = open_regular(path).map_err(fail)?;
        let mut bytes = Vec::new();
        // One byte more than allowed tells a file that is too long, also one that never ends.
        file.take(MAX_FILE + 1).read_to_end(&mut bytes).map_err(fail)?;
        Ok(bytes)
    }

    /// Checks an artifact's bytes. With a key, its signature is checked before anything else of them
    /// is looked at.
    ///
    /// # Errors
    /// When any check fails; [`ArtifactError`] lists them.
    pub fn parse(bytes: &[u8], key: Option<&PublicKey>) -> Result<Self, ArtifactError> {
        let Inspection { program, code: parts, debug, sources, operator, machine, .. } =
            read(bytes, key)?;
        machine?;
        // SAFETY: the digest says that the bytes are those that were written, and only `encode`
        // writes artifacts, for code that was sealed; sealing compares the code's own markers with
        // the tables. As with any executable, whoever can forge a file can run code, unless a key
        // was given. All that the tables say has been checked, and that the code is for this
        // machine.
        let code = unsafe { Code::seal(parts) }.map_err(|error| inconsistent(error.to_string()))?;
        Ok(Self { program, code, debug, sources, operator })
    }

    /// Tells gdb of the code that an engine of this artifact runs.
    ///
    /// # Errors
    /// When the artifact has no debug part, or a damaged one.
    pub fn show_to_gdb(&self, engine: &mut NativeEngine) -> Result<(), &'static str> {
        if self.debug.is_empty() {
            return Err("--gdb: the artifact was built with --no-debug; build it without");
        }
        engine.show_to_gdb(&self.debug)
    }

    /// A number that stands for the machine code: programs with the same number have the same code.
    pub fn code_number(&self) -> u64 {
        let mut hasher = Fnv::default();
        hasher.write(&self.code.bytes);
        for label in &self.code.labels {
            hasher.write(&label.to_le_bytes());
        }
        hasher.finish()
    }

    /// Whether a file begins with the bytes by which artifacts are known. It may be damaged.
    pub fn is_artifact(bytes: &[u8]) -> bool {
        bytes.starts_with(&header::MAGIC)
    }
}

/// What an artifact holds, for showing it. Its code can't be run.
#[derive(Debug)]
pub struct Inspection {
    /// What an executive needs.
    pub program: Program,
    /// The machine code with its tables.
    pub code: CodeParts,
    /// What debuggers need, see [`Artifact::debug`].
    pub debug: Vec<u8>,
    /// The sources, see [`Artifact::sources`].
    pub sources: Vec<u8>,
    /// The operator's screen, see [`Artifact::operator`].
    pub operator: Option<OperatorPanel>,
    /// Whether this machine can run it, else why not.
    pub machine: Result<(), ArtifactError>,
    /// The SHA-256 of the artifact, which names it.
    pub digest: ArtifactDigest,
    /// The key with which it says that it was signed. Unless a key was given, nobody has checked
    /// that.
    pub signed_by: Option<PublicKey>,
}

impl Inspection {
    /// Reads a file, which may be for another machine. With a key, the file must be signed with the
    /// private key that belongs to it.
    ///
    /// # Errors
    /// When it can't be read or is refused for another reason than the machine.
    pub fn open(path: &Path, key: Option<&PublicKey>) -> Result<Self, ArtifactError> {
        read(&Artifact::bytes(path)?, key)
    }
}

/// Decodes a file's bytes and checks everything but the machine, for which it gives the result.
fn read(bytes: &[u8], key: Option<&PublicKey>) -> Result<Inspection, ArtifactError> {
    if bytes.len() as u64 > MAX_FILE {
        let size = bytes.len() as u64;
        return Err(ArtifactError::TooLarge { what: "file", size, limit: MAX_FILE });
    }
    let (artifact, signature) = signature::split(bytes);
    if let Some(key) = key {
        let signature = signature.as_ref().ok_or(ArtifactError::NotSigned)?;
        key.verify(artifact, signature)?;
    }
    let (header, digest, payload) = Header::decode(artifact)?;
    let machine = header.check_machine();
    let Decoded { program, code, debug, sources, operator } = payload::decode(&header, payload)?;
    validate::program(&program)?;
    validate::code(&program, &code)?;
    let signed_by = signature.and_then(|signature| signature.key());
    Ok(Inspection { program, code, debug, sources, operator, machine, digest, signed_by })
}
