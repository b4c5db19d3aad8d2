//! Whether the tables of an NCT program fit its image.

use plcc_abi::nct::{FLAG_BYTES, FlagLocation, IMAGE_BYTES, NctTables};

use crate::artifact::validate::{Check, Image, ensure};

/// Checks that every byte of flags is inside the image, and every name exists.
pub(super) fn tables(tables: &NctTables, image: Image) -> Check {
    // Texts and settings are looked up with care by whoever uses them.
    let NctTables { inputs, previous, outputs, flags, named, .. } = tables;
    let groups = [
        (inputs, IMAGE_BYTES),
        (previous, IMAGE_BYTES),
        (outputs, IMAGE_BYTES),
        (flags, FLAG_BYTES),
    ];
    for (locations, count) in groups {
        ensure(locations.len() == count, || "a table of bytes has the wrong length".into())?;
        for &FlagLocation { offset, unpacked } in locations {
            image.check(offset, if unpacked { 8 } else { 1 }, "a byte of flags")?;
        }
    }
    for name in named {
        let known = name.to_string().parse().is_ok_and(|read| *name == read);
        ensure(known, || "it names a variable that does not exist".into())?;
    }
    Ok(())
}
