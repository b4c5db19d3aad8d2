//! Whether the tables of an NCT program fit its image and its modules. The executive relies on it.

use plcc_abi::Program;
use plcc_abi::nct::{FLAG_BYTES, FlagLocation, IMAGE_BYTES, NctTables};

use crate::table_check::{Check, Image, ensure};

/// Checks that every byte of flags is inside the image, that the modules that always run are
/// there, and that every name exists.
pub(super) fn tables(tables: &NctTables, program: &Program) -> Check {
    let image = Image::new(program.image_size);
    // Texts and settings are not checked here: each access to them checks its index.
    let NctTables { inputs, previous, outputs, flags, named, .. } = tables;
    let groups = [
        ("inputs", inputs, IMAGE_BYTES),
        ("previous inputs", previous, IMAGE_BYTES),
        ("outputs", outputs, IMAGE_BYTES),
        ("local variables", flags, FLAG_BYTES),
    ];
    for (what, locations, count) in groups {
        ensure(locations.len() == count, || {
            format!("its table of {what} has {} entries, not {count}", locations.len())
        })?;
        for &FlagLocation { offset, unpacked } in locations {
            ensure(image.holds(offset, if unpacked { 8 } else { 1 }), || {
                format!("its table of {what} points outside the image")
            })?;
        }
    }
    ensure(program.tasks.len() >= 2, || "its module :000 or :001 is missing".into())?;
    for name in named {
        let known = name.to_string().parse().is_ok_and(|read| *name == read);
        ensure(known, || "it names a variable that does not exist".into())?;
    }
    Ok(())
}
