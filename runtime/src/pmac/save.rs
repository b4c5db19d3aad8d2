//! SAVE: what is copied to non-volatile memory (guide, I-Variables and M-Variables): I, P and Q
//! with their values, and the definitions of M. `carry_over` takes over what another download has
//! saved.

use std::hash::{Hash, Hasher};

use plcc_abi::{
    image::{read_f64, read_u64, write_f64},
    pmac::{Controller, Layout, Memory, PmacTables, Run, arithmetic::finite, layout::DOUBLE_SIZE},
};
use serde::ser::{SerializeSeq, Serializer};
use serde::{Deserialize, Serialize};

use super::PmacExecutive;
use super::carry_over::{self, Variables};
use crate::Restored;
use crate::retained::append_postcard;
use plcc_abi::Fnv;

/// The first bytes of what is saved. What earlier versions saved begins with a fingerprint, and none
/// is this word.
const MARK: [u8; 8] = *b"PMACSAV2";

/// What a retained file holds.
#[derive(Deserialize)]
struct FileContent {
    /// The fingerprint of the download that saved it.
    fingerprint: u64,
    /// The image's regions `p q i mdef`.
    runs: Vec<Run>,
    /// The image after the load of that download; `None` in files of earlier versions. It stands behind the
    /// fields above, and `unpack` fills it in.
    #[serde(skip)]
    after_load: Option<Vec<Run>>,
    /// The controller of that download; likewise.
    #[serde(skip)]
    controller: Option<Controller>,
}

/// The download that has saved something.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Origin {
    /// What tells it from others: a hash of the controller and the state after load.
    fingerprint: u64,
    controller: Controller,
    /// The image after load.
    after_load: Vec<Run>,
}

impl Origin {
    /// The download with these tables.
    pub(super) fn new(tables: &PmacTables) -> Self {
        let mut hasher = Fnv::default();
        hasher.write(&[u8::from(tables.controller == Controller::Turbo)]);
        for run in &tables.initial {
            hasher.write(&run.offset.to_le_bytes());
            run.bytes.as_slice().hash(&mut hasher);
        }
        let after_load = tables.initial.clone();
        Self { fingerprint: hasher.finish(), controller: tables.controller, after_load }
    }
}

/// The stretches of an image that are not 0, to be written as a row of [`Run`].
struct Stretches<'a>(&'a [u8]);

impl Serialize for Stretches<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut row = serializer.serialize_seq(Some(Run::stretches(self.0).count()))?;
        for stretch in Run::stretches(self.0) {
            let (offset, bytes) = stretch;
            row.serialize_element(&(offset, Bytes(bytes)))?;
        }
        row.end()
    }
}

/// Stretches that are packed already.
struct Packed<'a>(&'a [Run]);

impl Serialize for Packed<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().map(|run| (run.offset, Bytes(&run.bytes))))
    }
}

/// Bytes, which are copied as a whole; as a row of numbers they would be copied one by one.
struct Bytes<'a>(&'a [u8]);

impl Serialize for Bytes<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_bytes(self.0)
    }
}

/// Appends what SAVE kept, as it is put into a file.
pub(super) fn pack(kept: &[u8], origin: &Origin, out: &mut Vec<u8>) -> bool {
    let saved = (origin.fingerprint, Stretches(kept));
    append_postcard(out, &(MARK, saved, Packed(&origin.after_load), origin.controller))
}

/// What bytes of a retained file hold, of this version or of an earlier one.
fn unpack(bytes: &[u8]) -> Option<FileContent> {
    if !bytes.starts_with(&MARK) {
        return postcard::from_bytes(bytes).ok();
    }
    type Content = ([u8; 8], FileContent, Vec<Run>, Controller);
    let ((_, saved, after_load, controller), rest) =
        postcard::take_from_bytes::<Content>(bytes).ok()?;
    let complete =
        FileContent { after_load: Some(after_load), controller: Some(controller), ..saved };
    rest.is_empty().then_some(complete)
}

/// The regions `p q i mdef` of an image that has these stretches.
fn image_of(runs: &[Run], layout: &Layout) -> Vec<u8> {
    let mut image = vec![0; layout.reference_definitions as usize];
    Run::unpack(runs, &mut image);
    image
}

impl FileContent {
    /// The controller on which this was saved. Earlier versions did not write it down; a Turbo PMAC's
    /// I-variables, some of which are never 0, lie after everything that a PMAC saves.
    fn controller(&self) -> Controller {
        let end = Layout::new(Controller::Pmac).reference_definitions;
        self.controller.unwrap_or(match self.runs.last() {
            Some(run) if run.offset >= end => Controller::Turbo,
            _ => Controller::Pmac,
        })
    }
}

impl PmacExecutive {
    /// Takes back what SAVE kept.
    pub(super) fn take_back(&mut self, retained: &[u8]) -> Result<Restored, String> {
        let saved = unpack(retained).ok_or("it does not hold what SAVE writes")?;
        let layout = self.host.layout;
        let (kept, restored) = if saved.fingerprint == self.host.origin.fingerprint {
            let kept = image_of(&saved.runs, &layout);
            let values = (0..layout.reference_definitions).step_by(DOUBLE_SIZE as usize);
            let count = values.filter(|&offset| read_u64(&kept, offset) != 0).count();
            (kept, Restored { kept: count, ..Restored::default() })
        } else {
            let old_layout = Layout::new(saved.controller());
            let variables = Variables {
                saved: &image_of(&saved.runs, &old_layout),
                saved_after_load: saved.after_load.map(|runs| image_of(&runs, &old_layout)),
                saved_layout: &old_layout,
                after_load: &image_of(&self.host.tables.initial, &layout),
                layout: &layout,
            };
            carry_over::carry_over(&variables)
        };
        for number in 0..layout.count {
            for offset in [layout.p_offset(number), layout.q_offset(number)] {
                write_f64(&mut self.image, offset, finite(read_f64(&kept, offset)));
            }
            let value = read_f64(&kept, layout.i_offset(number));
            self.host.write_i(&mut self.image, number, value);
        }
        let mut memory =
            Memory { image: &mut self.image, layout: &layout, sparse: &mut self.host.state.sparse };
        for number in 0..layout.count {
            memory.define_code(number, read_u64(&kept, layout.definition_offset(number)));
        }
        self.host.save(&kept);
        Ok(restored)
    }
}
