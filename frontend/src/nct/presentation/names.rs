//! The names of the bits of a word.

use plcc_abi::nct::NctName;

/// The names of the 16 bits of a word of inputs, outputs or flags; none of other variables.
pub(super) fn bits(word: NctName) -> Vec<String> {
    let of = |make: &dyn Fn(u16, u8) -> NctName, byte: u16| {
        (0..16).map(|bit| make(byte + bit / 8, (bit % 8) as u8).to_string()).collect()
    };
    let low = |byte: u16| u8::try_from(byte).unwrap_or(u8::MAX);
    match word {
        NctName::F { byte, bit: None } => {
            of(&|byte, bit| NctName::F { byte, bit: Some(bit) }, byte)
        }
        NctName::I { byte, bit: None } => {
            of(&|byte, bit| NctName::I { byte: low(byte), bit: Some(bit) }, byte.into())
        }
        NctName::Y { byte, bit: None } => {
            of(&|byte, bit| NctName::Y { byte: low(byte), bit: Some(bit) }, byte.into())
        }
        _ => vec![],
    }
}
