//! Everything after the header: tables, labels, lines, code, unwind information, debug part and sources.

use std::sync::Arc;

use plcc_abi::{CodeLine, CodeParts, FunctionRange, OperatorPanel, Program, SourceLine, TrapSite};
use serde::{Deserialize, Serialize};

use super::error::{ArtifactError, inconsistent};
use super::header::{Header, Parts};
use super::{Attached, MAX_FILE, MAX_TABLES};

/// Bytes of a label, and of an entry of the line table.
const LABEL: usize = 4;
const LINE: usize = 12;

/// The tables, which postcard writes and reads: a program, its functions, the places at which it may be
/// stopped, and the lines of its labels; borrowed or owned.
#[derive(Serialize, Deserialize)]
struct Tables<P, F, S, L> {
    program: P,
    functions: F,
    trap_sites: S,
    label_lines: L,
}

/// The tables as they are read.
type OwnedTables = Tables<Program, Vec<FunctionRange>, Vec<TrapSite>, Vec<Option<SourceLine>>>;

/// The bytes and how they are divided.
pub(super) struct Payload {
    pub(super) bytes: Vec<u8>,
    pub(super) parts: Parts,
}

/// Writes the parts one after the other.
///
/// # Errors
/// When one is larger than an artifact may be.
pub(super) fn encode(
    program: &Program,
    code: &CodeParts,
    attached: Attached<'_>,
) -> Result<Payload, ArtifactError> {
    // The other fields are in the header.
    let CodeParts { labels, label_lines, functions, lines, trap_sites, eh_frame, .. } = code;
    let machine_code = &code.bytes;
    let (trap_sites, label_lines) = (trap_sites.as_slice(), label_lines.as_slice());
    let tables = Tables { program, functions, trap_sites, label_lines };
    let mut bytes = postcard::to_allocvec(&tables)
        .map_err(|error| inconsistent(format!("its tables can't be written: {error}")))?;
    if let Some(panel) = attached.operator {
        bytes = postcard::to_extend(panel, bytes).map_err(|error| {
            inconsistent(format!("its operator's screen can't be written: {error}"))
        })?;
    }
    check_tables(bytes.len() as u64)?;
    let parts = Parts {
        tables: length(bytes.len())?,
        labels: length(labels.len())?,
        lines: length(lines.len())?,
        code: length(machine_code.len())?,
        eh_frame: length(eh_frame.len())?,
        debug: length(attached.debug.len())?,
        sources: length(attached.sources.len())?,
    };
    for label in labels {
        bytes.extend(label.to_le_bytes());
    }
    for &CodeLine { offset, file, line } in lines.iter() {
        for word in [offset, file, line] {
            bytes.extend(word.to_le_bytes());
        }
    }
    bytes.extend(machine_code);
    bytes.extend(eh_frame);
    bytes.extend(attached.debug);
    bytes.extend(attached.sources);
    Ok(Payload { bytes, parts })
}

fn length(n: usize) -> Result<u32, ArtifactError> {
    let size = n as u64;
    let too_large = |_| ArtifactError::TooLarge { what: "artifact", size, limit: MAX_FILE };
    u32::try_from(n).map_err(too_large)
}

fn check_tables(size: u64) -> Result<(), ArtifactError> {
    let limit = u64::from(MAX_TABLES);
    if size <= limit {
        Ok(())
    } else {
        Err(ArtifactError::TooLarge { what: "tables", size, limit })
    }
}

/// What a payload holds.
pub(super) struct Decoded {
    pub(super) program: Program,
    pub(super) code: CodeParts,
    pub(super) debug: Vec<u8>,
    pub(super) sources: Vec<u8>,
    pub(super) operator: Option<OperatorPanel>,
}

/// Divides the payload into its parts and decodes them. The lengths that it claims are compared with the bytes that are there before anything is allocated for them.
///
/// # Errors
/// When the lengths contradict each other, or the tables can't be decoded.
pub(super) fn decode(header: &Header, payload: &[u8]) -> Result<Decoded, ArtifactError> {
    let Parts { tables, labels, lines, code, eh_frame, debug, sources } = header.parts;
    check_tables(u64::from(tables))?;
    let (tables, rest) = split(payload, 1, tables)?;
    let (labels, rest) = split(rest, LABEL, labels)?;
    let (lines, rest) = split(rest, LINE, lines)?;
    let (machine_code, rest) = split(rest, 1, code)?;
    let (eh_frame, rest) = split(rest, 1, eh_frame)?;
    let (debug, rest) = split(rest, 1, debug)?;
    let (sources, rest) = split(rest, 1, sources)?;
    if !rest.is_empty() {
        return Err(inconsistent("its parts are shorter than the whole"));
    }
    let (tables, rest) = postcard::take_from_bytes::<OwnedTables>(tables)
        .map_err(|_| inconsistent("its tables can't be decoded"))?;
    let operator = operator(rest)?;
    let (words, _) = labels.as_chunks::<LABEL>();
    let labels = words.iter().map(|&word| u32::from_le_bytes(word)).collect();
    let (words, _) = lines.as_chunks::<4>();
    let (entries, _) = words.as_chunks::<3>();
    let lines = entries.iter().map(|entry| {
        let [offset, file, line] = entry.map(u32::from_le_bytes);
        CodeLine { offset, file, line }
    });
    let code = CodeParts {
        bytes: machine_code.to_vec(),
        labels,
        label_lines: Arc::new(tables.label_lines),
        functions: tables.functions,
        trap_sites: Arc::new(tables.trap_sites),
        lines: Arc::new(lines.collect()),
        architecture: header.architecture.clone(),
        features: header.features.clone(),
        image_size: header.image_size,
        eh_frame: eh_frame.to_vec(),
    };
    let (debug, sources) = (debug.to_vec(), sources.to_vec());
    Ok(Decoded { program: tables.program, code, debug, sources, operator })
}

/// What follows the tables in their part: nothing, or the operator's screen.
fn operator(rest: &[u8]) -> Result<Option<OperatorPanel>, ArtifactError> {
    if rest.is_empty() {
        return Ok(None);
    }
    match postcard::take_from_bytes(rest) {
        Ok((panel, [])) => Ok(Some(panel)),
        Ok(_) => Err(inconsistent("its tables are shorter than their part")),
        Err(_) => Err(inconsistent("its operator's screen can't be decoded")),
    }
}

fn split(bytes: &[u8], size: usize, count: u32) -> Result<(&[u8], &[u8]), ArtifactError> {
    let length = size.checked_mul(count as usize);
    length
        .and_then(|length| bytes.split_at_checked(length))
        .ok_or_else(|| inconsistent("its parts are longer than the whole"))
}
