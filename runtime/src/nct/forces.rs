//! Forces: input bits that are held as the program sees them, and physical output lines that are
//! held, whatever the program stores (`plcctl force`).

use plcc_abi::image::{read_u8, write_u8};
use plcc_abi::nct::{IMAGE_BYTES, LINE_BYTES, NctName};
use serde::{Deserialize, Serialize};

use crate::force_list::ForceList;

/// Some bits of a byte and their values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
struct ForcedBits {
    mask: u8,
    value: u8,
}

impl ForcedBits {
    fn on(self, byte: u8) -> u8 {
        byte & !self.mask | self.value & self.mask
    }
}

/// The forces in effect. They take the same memory whether there are any or not.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Forces {
    inputs: Vec<ForcedBits>,
    outputs: Vec<ForcedBits>,
    any_output: bool,
    /// Whether an input may be forced. Not part of a checkpoint, so unknown after one.
    #[serde(skip, default = "unknown")]
    maybe_input: bool,
    /// The forces as they were asked for. What a checkpoint holds are their bits.
    #[serde(skip)]
    list: ForceList<NctName, u16>,
}

/// What is assumed of forced inputs in a state that comes from a checkpoint.
fn unknown() -> bool {
    true
}

impl Default for Forces {
    fn default() -> Self {
        Self {
            inputs: vec![ForcedBits::default(); IMAGE_BYTES],
            outputs: vec![ForcedBits::default(); LINE_BYTES],
            any_output: false,
            maybe_input: false,
            list: ForceList::default(),
        }
    }
}

/// Whether two inputs or two outputs have bits in common: a bit and its word, or two words.
pub(super) fn share_bits(a: NctName, b: NctName) -> bool {
    let bits = |name| {
        let (is_input, byte, bit) = match name {
            NctName::I { byte, bit } | NctName::P { byte, bit } => (true, byte, bit),
            NctName::Y { byte, bit } | NctName::O { byte, bit } => (false, byte, bit),
            _ => return None,
        };
        let first = u32::from(byte) * 8 + bit.map_or(0, u32::from);
        Some((is_input, first..first + if bit.is_some() { 1 } else { 16 }))
    };
    bits(a).zip(bits(b)).is_some_and(|((a_is_input, a), (b_is_input, b))| {
        a_is_input == b_is_input && a.start < b.end && b.start < a.end
    })
}

impl Forces {
    /// Forces a bit or a word to a value (`Some`), or ends its force (`None`).
    ///
    /// # Errors
    /// When it is neither an input nor a physical output.
    pub(super) fn set(&mut self, name: NctName, word: Option<u16>) -> Result<(), &'static str> {
        let (bits, byte, bit): (&mut [ForcedBits], _, _) = match name {
            NctName::I { byte, bit } | NctName::P { byte, bit } => (&mut self.inputs, byte, bit),
            NctName::Y { byte, bit } | NctName::O { byte, bit } => (&mut self.outputs, byte, bit),
            _ => return Err("is neither an input nor an output, and can't be forced"),
        };
        let byte = usize::from(byte);
        if byte >= bits.len() {
            return Err("has no physical line; only outputs of the boards 0 to 3 can be forced");
        }
        let overlaps = self.list.any(|other| *other != name && share_bits(*other, name));
        match word {
            Some(word) => self.list.set(name, word)?,
            None => self.list.remove(&name),
        }
        let parts = match bit {
            // A bit concerns one byte only.
            Some(bit) => {
                [(1 << bit, word.map(|word| if word & 1 != 0 { 0xFF } else { 0 })), (0, None)]
            }
            None => {
                let [low, high] = word.unwrap_or(0).to_le_bytes();
                [(0xFF, word.map(|_| low)), (0xFF, word.map(|_| high))]
            }
        };
        for (forced, (mask, value)) in bits.iter_mut().skip(byte).zip(parts) {
            forced.mask = if value.is_some() { forced.mask | mask } else { forced.mask & !mask };
            let value = value.unwrap_or(0);
            forced.value = forced.value & !mask | value & mask;
        }
        self.maybe_input = self.inputs.iter().any(|forced| forced.mask != 0);
        self.any_output = self.outputs.iter().any(|forced| forced.mask != 0);
        if overlaps {
            // A part of another force has changed, or ended.
            self.list_again();
        }
        Ok(())
    }

    /// Whether the input of a name is forced, or the line of an output; of a word, whether all of its bits are. `Y` is not
    /// the line itself, and can be set.
    pub(super) fn hold(&self, name: NctName) -> bool {
        let (bits, byte, bit) = match name {
            NctName::I { byte, bit } | NctName::P { byte, bit } => (&self.inputs, byte, bit),
            NctName::O { byte, bit } => (&self.outputs, byte, bit),
            _ => return false,
        };
        let masks = match bit {
            Some(bit) => [1 << bit, 0],
            None => [0xFF, 0xFF],
        };
        let byte = usize::from(byte);
        byte < bits.len()
            && bits.iter().skip(byte).zip(masks).all(|(forced, mask)| forced.mask & mask == mask)
    }

    /// The forces in effect, in the order in which they were set.
    pub(super) fn list(&self) -> impl Iterator<Item = (NctName, u16)> + '_ {
        self.list.entries().map(|(name, word)| (*name, *word))
    }

    /// Finds the list again from the forced bits, which are all that a checkpoint holds: two whole bytes are a word, all
    /// others are single bits.
    pub(super) fn list_again(&mut self) {
        self.list.clear();
        let Self { inputs, outputs, list, .. } = self;
        for (forced, is_input) in [(&*inputs, true), (&*outputs, false)] {
            let name = |byte: u8, bit| match is_input {
                true => NctName::I { byte, bit },
                false => NctName::Y { byte, bit },
            };
            let whole = |byte: usize| forced.get(byte).filter(|bits| bits.mask == 0xFF);
            let mut byte = 0;
            while let (Some(bits), Ok(number)) = (forced.get(byte), u8::try_from(byte)) {
                if let Some((low, high)) = whole(byte).zip(whole(byte + 1)) {
                    let word = u16::from_le_bytes([low.value, high.value]);
                    list.push(name(number, None), word);
                    byte += 2;
                    continue;
                }
                let single = (0..8).filter(|bit| bits.mask >> bit & 1 != 0);
                for bit in single {
                    list.push(name(number, Some(bit)), u16::from(bits.value >> bit & 1));
                }
                byte += 1;
            }
        }
    }

    /// Whether the lists have the lengths of another value's, which is the program's own.
    pub(super) fn fits(&self, own: &Self) -> bool {
        self.inputs.len() == own.inputs.len() && self.outputs.len() == own.outputs.len()
    }

    /// Whether an input may be forced.
    pub(super) fn maybe_input(&self) -> bool {
        self.maybe_input
    }

    /// A byte of the inputs as the program sees it, where the lines or the NC say `value`.
    pub(super) fn input(&self, byte: usize, value: u8) -> u8 {
        self.inputs.get(byte).map_or(value, |forced| forced.on(value))
    }

    /// Puts forced outputs on their lines, which begin at `lines` in the image.
    pub(super) fn apply_to_outputs(&self, image: &mut [u8], lines: u32) {
        if !self.any_output {
            return;
        }
        for (forced, offset) in self.outputs.iter().zip(lines..) {
            if forced.mask != 0 {
                let value = forced.on(read_u8(image, offset));
                write_u8(image, offset, value);
            }
        }
    }
}
