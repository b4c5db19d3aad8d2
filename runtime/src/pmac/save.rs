//! SAVE: what is copied to non-volatile memory (guide, I-Variables and M-Variables): I, P and Q
//! with their values, and the definitions of M.

use std::hash::{Hash, Hasher};

use plcc_abi::{
    image::{read_f64, read_u64, write_f64},
    pmac::{Controller, Memory, PmacTables, Run, arithmetic::finite, layout::DOUBLE_SIZE},
};
use serde::Deserialize;
use serde::ser::{Serialize, SerializeSeq, Serializer};

use super::PmacExecutive;
use crate::fingerprint::Fnv;
use crate::retain::append_postcard;

/// What a retained file holds.
#[derive(Deserialize)]
struct Saved {
    /// Of the download that it belongs to.
    fingerprint: u64,
    /// The image's regions `p q i mdef`.
    runs: Vec<Run>,
}

/// What tells one download from another: the controller and the state after load.
fn fingerprint(tables: &PmacTables) -> u64 {
    let mut hasher = Fnv::default();
    hasher.write(&[u8::from(tables.controller == Controller::Turbo)]);
    for run in &tables.initial {
        hasher.write(&run.offset.to_le_bytes());
        run.bytes.as_slice().hash(&mut hasher);
    }
    hasher.finish()
}

/// The stretches of an image that are not 0, to be written as a row of [`Run`].
struct Stretches<'a>(&'a [u8]);

impl Serialize for Stretches<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut row = serializer.serialize_seq(Some(Run::stretches(self.0).count()))?;
        for stretch in Run::stretches(self.0) {
            row.serialize_element(&stretch)?;
        }
        row.end()
    }
}

/// Appends what SAVE kept, as it is put into a file.
pub(super) fn pack(kept: &[u8], tables: &PmacTables, out: &mut Vec<u8>) -> bool {
    append_postcard(out, &(fingerprint(tables), Stretches(kept)))
}

impl PmacExecutive {
    /// Takes back what SAVE kept.
    pub(super) fn take_back(&mut self, retained: &[u8]) -> Result<(), String> {
        let saved: Saved = postcard::from_bytes(retained)
            .map_err(|_| "it does not hold what SAVE writes".to_string())?;
        if saved.fingerprint != fingerprint(&self.control.tables) {
            return Err("it belongs to another download".into());
        }
        let layout = self.control.layout;
        let mut kept = vec![0; layout.reference_definitions as usize];
        Run::unpack(&saved.runs, &mut kept);
        for offset in (layout.p..layout.mdef).step_by(DOUBLE_SIZE as usize) {
            write_f64(&mut self.image, offset, finite(read_f64(&kept, offset)));
        }
        let mut memory = Memory {
            image: &mut self.image,
            layout: &layout,
            sparse: &mut self.control.state.sparse,
        };
        for number in 0..layout.count {
            memory.define_code(number, read_u64(&kept, layout.definition_offset(number)));
        }
        self.control.save(&kept);
        Ok(())
    }
}
