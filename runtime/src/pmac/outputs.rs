//! The physical outputs of a PMAC, and what they become at a stop.
//!
//! A PMAC's lines are bits of its memory, so an M-variable that is defined as a line shows the line
//! itself: after a stop it shows the safe value. The compiler finds out which lines are outputs
//! ([`PmacTables::outputs`](plcc_abi::pmac::PmacTables::outputs)).

use plcc_abi::image::read_u8;
use plcc_abi::pmac::{
    Definition, Field, Layout, Memory, Place, PmacName, Space, SparseMemory, WORD_SIZE,
};

use crate::NameError;
use crate::safe_outputs::{SafeLines, SafeOutput, SafeOutputs, SafeValue, does_not_fit};

use super::names::{self, PmacNames};

/// Bits of a physical output in the process image: the offset of the first byte, and a mask for each
/// byte.
struct Lines {
    offset: u32,
    masks: Vec<u8>,
}

impl Lines {
    /// The bits of a definition; `None` where it is none of single words. `number` is that of the
    /// M-variable, which decides where the value of a thumbwheel line is kept.
    fn of(layout: &Layout, definition: Definition, number: u32) -> Option<Self> {
        let (space, address, Field { offset, width, format: _ }) = match definition {
            Definition::X { address, field } => (Space::X, address, field),
            Definition::Y { address, field } => (Space::Y, address, field),
            Definition::Tw { .. } => {
                let offset = layout.thumbwheel_offset(number);
                return Some(Self { offset, masks: vec![0xFF; 8] });
            }
            _ => return None,
        };
        let Place::Word(at) = layout.place(space, address) else { return None };
        let bits = 1u32.checked_shl(width.into()).unwrap_or(0).wrapping_sub(1);
        let mask = bits.checked_shl(offset.into()).unwrap_or(0) & 0xFF_FFFF;
        let masks = mask.to_le_bytes().into_iter().take(WORD_SIZE as usize).collect();
        Some(Self { offset: at, masks })
    }

    /// Adds the lines to `safe`, as `value` says; `image` holds the bits of a value.
    fn apply(&self, safe: &mut SafeLines, value: &SafeValue, image: &[u8]) {
        for (at, &mask) in (self.offset..).zip(&self.masks).filter(|(_, mask)| **mask != 0) {
            safe.apply(value, at, mask, read_u8(image, at));
        }
    }
}

impl PmacNames {
    /// Without an option every output is off.
    pub(super) fn all_off(&self) -> SafeLines {
        let mut safe = SafeLines::default();
        for output in &self.outputs {
            let number = output.variable.map_or(0, |variable| variable.number);
            if let Some(lines) = Lines::of(&self.layout, output.definition, number) {
                lines.apply(&mut safe, &SafeValue::Off, &[]);
            }
        }
        safe
    }

    /// What the outputs become when `outputs` says so.
    pub(super) fn lines_at_stop(&self, outputs: &SafeOutputs) -> Result<SafeLines, Vec<NameError>> {
        self.all_off().with(outputs, |lines, output| self.add_safe_output(lines, output))
    }

    /// Adds an entry: an M- or L-variable that is defined as bits of I/O memory, or a word of it.
    fn add_safe_output(
        &self,
        safe: &mut SafeLines,
        SafeOutput { name, value }: &SafeOutput,
    ) -> Result<(), NameError> {
        let layout = self.layout;
        let found = self.variable(name)?;
        let definition = self.definition(found).unwrap_or(Definition::Star);
        let number = match found {
            PmacName::Variable(variable) => variable.number,
            PmacName::Memory(_) | PmacName::Plc { .. } | PmacName::Motion(_) => 0,
        };
        let is_line = match definition {
            Definition::X { address, .. } => layout.is_io(Space::X, address),
            Definition::Y { address, .. } => layout.is_io(Space::Y, address),
            Definition::Tw { .. } => true,
            _ => false,
        };
        let lines = Lines::of(&layout, definition, number).filter(|_| is_line);
        let lines = lines.ok_or_else(|| NameError::Unfit {
            name: name.clone(),
            reason: "is not a physical output; those are bits of the words of I/O memory, and \
                     M-variables that are defined as such"
                .into(),
        })?;
        // The value is written to an image of its own, so that its format is the variable's.
        let mut image = vec![0; layout.size as usize];
        if let SafeValue::Value(text) = value {
            let wanted = names::number(text).map_err(|_| does_not_fit(name, text))?;
            let mut sparse = SparseMemory::default();
            let mut memory = Memory { image: &mut image, layout: &layout, sparse: &mut sparse };
            let carried = if let Definition::Tw { .. } = definition {
                plcc_abi::image::write_f64(memory.image, lines.offset, wanted);
                wanted
            } else {
                memory.write(definition, wanted);
                memory.read(definition)
            };
            if carried != wanted {
                return Err(does_not_fit(name, text));
            }
        }
        lines.apply(safe, value, &image);
        Ok(())
    }
}
