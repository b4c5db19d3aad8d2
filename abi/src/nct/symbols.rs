//! NCT's bytes of flags by their place in the image.

use alloc::{
    format,
    string::{String, ToString},
    vec,
    vec::Vec,
};

use super::{FlagLocation, NctName, NctTables};
use crate::{ImageSymbol, ImageType};

/// The bytes of I, Y and F that the program names, each once. The registers are in regions of
/// their own.
pub(crate) fn symbols(tables: &NctTables) -> Vec<ImageSymbol> {
    let mut symbols = vec![];
    let mut last = String::new();
    for &name in &tables.named {
        let (places, letter, byte) = match name {
            NctName::I { byte, .. } => (&tables.inputs, "I", usize::from(byte)),
            NctName::Y { byte, .. } => (&tables.outputs, "Y", usize::from(byte)),
            NctName::F { byte, .. } => (&tables.flags, "F", usize::from(byte)),
            _ => continue,
        };
        let width = if letter == "F" { 3 } else { 2 };
        // A word is two bytes.
        let count = if name.to_string().len() == width + 1 { 2 } else { 1 };
        for number in byte..byte + count {
            let Some(&FlagLocation { offset, unpacked }) = places.get(number) else { continue };
            let name = format!("{letter}{number:0width$}");
            if name != last {
                let ty = if unpacked { ImageType::Bits } else { ImageType::Byte };
                symbols.push(ImageSymbol { name: name.clone(), ty, offset, elements: 1 });
                last = name;
            }
        }
    }
    symbols
}
