//! The variable `context` for debuggers: the scan context with which the code is executed, so that in gdb
//! `((struct plcc_image *)context->image)->CLPUMP` is a variable of the program.
//!
//! The runtime keeps a pointer to the context of the scan that runs, and tells the debugger where, as the
//! address of a section that has just this pointer. (The machine code has the context in a register only
//! as long as it needs it.)

use gimli::write::{Address, AttributeValue, DwarfUnit, Expression, UnitEntryId};
use gimli::{
    DW_AT_byte_size, DW_AT_data_member_location, DW_AT_encoding, DW_AT_location, DW_AT_name,
    DW_AT_type, DW_ATE_unsigned, DW_TAG_base_type, DW_TAG_member, DW_TAG_pointer_type,
    DW_TAG_structure_type, DW_TAG_variable,
};

/// The section that has the pointer.
pub(super) const SECTION: &str = ".plcc_context";

/// The size of a pointer, and of every field of the context, in bytes.
const POINTER: u64 = 8;

/// Adds the variable and the type of what it points to. `image` is the type of the image, and `symbol` the
/// symbol of the section.
pub(super) fn add(dwarf: &mut DwarfUnit, image: UnitEntryId, symbol: usize) {
    let root = dwarf.unit.root();
    let mut entry = |parent: UnitEntryId, tag, name: &str, attributes: &[_]| {
        let entry = dwarf.unit.add(parent, tag);
        let added = dwarf.unit.get_mut(entry);
        if !name.is_empty() {
            added.set(DW_AT_name, AttributeValue::String(name.as_bytes().to_vec()));
        }
        for (attribute, value) in attributes {
            let value: &AttributeValue = value;
            added.set(*attribute, value.clone());
        }
        entry
    };
    let size = (DW_AT_byte_size, AttributeValue::Udata(POINTER));
    let of = |ty: UnitEntryId| (DW_AT_type, AttributeValue::UnitRef(ty));
    let unsigned = (DW_AT_encoding, AttributeValue::Encoding(DW_ATE_unsigned));
    let number = entry(root, DW_TAG_base_type, "unsigned long", &[size.clone(), unsigned]);
    // Without a type it points to something that is not described.
    let pointer = entry(root, DW_TAG_pointer_type, "", std::slice::from_ref(&size));
    let to_image = entry(root, DW_TAG_pointer_type, "", &[size.clone(), of(image)]);
    let to_number = entry(root, DW_TAG_pointer_type, "", &[size.clone(), of(number)]);
    // The fields of `plcc_abi::ScanContext`, in its order.
    let fields = [
        ("image", to_image),
        ("host", pointer),
        ("host_data", pointer),
        ("epoch", to_number),
        ("limit", number),
    ];
    let whole = (DW_AT_byte_size, AttributeValue::Udata(POINTER * fields.len() as u64));
    let context = entry(root, DW_TAG_structure_type, "plcc_context", &[whole]);
    for (offset, (name, ty)) in (0..).step_by(POINTER as usize).zip(fields) {
        let at = (DW_AT_data_member_location, AttributeValue::Udata(offset));
        entry(context, DW_TAG_member, name, &[of(ty), at]);
    }
    let to_context = entry(root, DW_TAG_pointer_type, "", &[size, of(context)]);
    let mut location = Expression::new();
    location.op_addr(Address::Symbol { symbol, addend: 0 });
    let location = (DW_AT_location, AttributeValue::Exprloc(location));
    entry(root, DW_TAG_variable, "context", &[of(to_context), location]);
}
