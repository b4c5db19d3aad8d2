//! The type of the process image for debuggers: `struct plcc_image`, with a member for each variable
//! that lies in it. In gdb `((struct plcc_image *)context->image)->CLPUMP` is a variable's value.
//!
//! | variable | member |
//! | --- | --- |
//! | PMI `CLPUMP`, array `A`, `@FRO` | `CLPUMP`, `A[5]`, `at_FRO` |
//! | NCT bits of the bytes `I00`, `F010` | `I000` to `I007`, `F0100` to `F0107`, one bit each |
//! | PMAC `P1`, `I5`, `&2Q5` | `P1`, `I5`, `cs2_Q5` |
//! | PMAC `M1->Y:$FFC2,8`, as defined after the download | `M1`, one bit |
//!
//! What is packed with other things in one byte or word is a bit field, in a structure without a name
//! that has just this byte or word. Where names of the language are not names of C, they are changed as the
//! table shows.

use std::collections::{BTreeMap, HashMap, HashSet};

use gimli::write::{AttributeValue, DwarfUnit, UnitEntryId};
use gimli::{
    DW_AT_bit_size, DW_AT_byte_size, DW_AT_count, DW_AT_data_bit_offset,
    DW_AT_data_member_location, DW_AT_encoding, DW_AT_name, DW_AT_type, DW_ATE_boolean,
    DW_ATE_float, DW_ATE_signed, DW_ATE_unsigned, DW_TAG_array_type, DW_TAG_base_type,
    DW_TAG_member, DW_TAG_structure_type, DW_TAG_subrange_type, DwAte,
};
use plcc_abi::{BitField, ImageSymbol, ImageType, Program};

/// A type of one value.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct BaseType {
    name: &'static str,
    encoding: DwAte,
    bytes: u32,
}

const LOGICAL: BaseType = BaseType { name: "_Bool", encoding: DW_ATE_boolean, bytes: 1 };
const INTEGER: BaseType = BaseType { name: "short", encoding: DW_ATE_signed, bytes: 2 };
const LONG: BaseType = BaseType { name: "int", encoding: DW_ATE_signed, bytes: 4 };
const WORD: BaseType = BaseType { name: "unsigned int", encoding: DW_ATE_unsigned, bytes: 4 };
const DOUBLE: BaseType = BaseType { name: "double", encoding: DW_ATE_float, bytes: 8 };

/// Adds the structure, named `{prefix}_image`, to a unit, and returns its entry.
pub(super) fn add(dwarf: &mut DwarfUnit, program: &Program, prefix: &str) -> UnitEntryId {
    let mut types = Types { dwarf, base: HashMap::new(), arrays: HashMap::new() };
    let root = types.dwarf.unit.root();
    let structure = types.dwarf.unit.add(root, DW_TAG_structure_type);
    types.name(structure, &format!("{prefix}_image"));
    types.number(structure, DW_AT_byte_size, program.image_size.into());
    let mut names = HashSet::new();
    for symbol in program.tables.symbols() {
        types.symbol(structure, &symbol, &mut names);
    }
    let mut words: BTreeMap<u32, UnitEntryId> = BTreeMap::new();
    for BitField { name, offset, first, width, signed } in program.tables.bit_fields() {
        let name = member_name(&name);
        if !names.insert(name.clone()) {
            continue;
        }
        let word = match words.get(&offset) {
            Some(&word) => word,
            None => *words.entry(offset).or_insert(types.part(structure, offset, WORD.bytes)),
        };
        types.bits(word, &name, if signed { LONG } else { WORD }, first, width);
    }
    structure
}

/// A name of the language as a name of C.
fn member_name(name: &str) -> String {
    let name = match (name.strip_prefix('@'), name.strip_prefix('&')) {
        (Some(name), _) => format!("at_{name}"),
        (None, Some(name)) => format!("cs{}", name.replacen('Q', "_Q", 1)),
        (None, None) => name.to_owned(),
    };
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect()
}

/// The types of a unit.
struct Types<'a> {
    dwarf: &'a mut DwarfUnit,
    base: HashMap<BaseType, UnitEntryId>,
    arrays: HashMap<(BaseType, u32), UnitEntryId>,
}

impl Types<'_> {
    fn name(&mut self, entry: UnitEntryId, name: &str) {
        let value = AttributeValue::String(name.as_bytes().to_vec());
        self.dwarf.unit.get_mut(entry).set(DW_AT_name, value);
    }

    fn number(&mut self, entry: UnitEntryId, attribute: gimli::DwAt, value: u64) {
        self.dwarf.unit.get_mut(entry).set(attribute, AttributeValue::Udata(value));
    }

    /// The entry of a type of one value.
    fn base(&mut self, ty: BaseType) -> UnitEntryId {
        if let Some(&entry) = self.base.get(&ty) {
            return entry;
        }
        let root = self.dwarf.unit.root();
        let entry = self.dwarf.unit.add(root, DW_TAG_base_type);
        self.name(entry, ty.name);
        self.number(entry, DW_AT_byte_size, ty.bytes.into());
        let encoding = AttributeValue::Encoding(ty.encoding);
        self.dwarf.unit.get_mut(entry).set(DW_AT_encoding, encoding);
        self.base.insert(ty, entry);
        entry
    }

    /// The entry of the type of an array of `count` values; of the value's own type if there is one only.
    fn array(&mut self, ty: BaseType, count: u32) -> UnitEntryId {
        let of = self.base(ty);
        if count == 1 {
            return of;
        }
        if let Some(&entry) = self.arrays.get(&(ty, count)) {
            return entry;
        }
        let root = self.dwarf.unit.root();
        let entry = self.dwarf.unit.add(root, DW_TAG_array_type);
        self.dwarf.unit.get_mut(entry).set(DW_AT_type, AttributeValue::UnitRef(of));
        let range = self.dwarf.unit.add(entry, DW_TAG_subrange_type);
        self.number(range, DW_AT_count, count.into());
        self.arrays.insert((ty, count), entry);
        entry
    }

    /// Adds a member of whole bytes.
    fn member(&mut self, of: UnitEntryId, name: &str, ty: UnitEntryId, offset: u32) {
        let entry = self.dwarf.unit.add(of, DW_TAG_member);
        self.name(entry, name);
        self.dwarf.unit.get_mut(entry).set(DW_AT_type, AttributeValue::UnitRef(ty));
        self.number(entry, DW_AT_data_member_location, offset.into());
    }

    /// Adds a structure without a name as a member without a name, so that its members are found as
    /// those of the whole.
    fn part(&mut self, of: UnitEntryId, offset: u32, bytes: u32) -> UnitEntryId {
        let root = self.dwarf.unit.root();
        let part = self.dwarf.unit.add(root, DW_TAG_structure_type);
        self.number(part, DW_AT_byte_size, bytes.into());
        let entry = self.dwarf.unit.add(of, DW_TAG_member);
        self.dwarf.unit.get_mut(entry).set(DW_AT_type, AttributeValue::UnitRef(part));
        self.number(entry, DW_AT_data_member_location, offset.into());
        part
    }

    /// Adds a bit field; `first` counts bits from the structure's beginning.
    fn bits(&mut self, of: UnitEntryId, name: &str, ty: BaseType, first: u8, width: u8) {
        let base = self.base(ty);
        let entry = self.dwarf.unit.add(of, DW_TAG_member);
        self.name(entry, name);
        self.dwarf.unit.get_mut(entry).set(DW_AT_type, AttributeValue::UnitRef(base));
        self.number(entry, DW_AT_bit_size, width.into());
        self.number(entry, DW_AT_data_bit_offset, first.into());
    }

    /// Adds the members of a symbol. A name that is there already is left out.
    fn symbol(&mut self, of: UnitEntryId, symbol: &ImageSymbol, names: &mut HashSet<String>) {
        let name = member_name(&symbol.name);
        let whole = match symbol.ty {
            ImageType::Logical => LOGICAL,
            ImageType::Integer => INTEGER,
            ImageType::Long => LONG,
            ImageType::Double => DOUBLE,
            ImageType::Byte | ImageType::Bits => {
                let packed = symbol.ty == ImageType::Byte;
                let byte = packed.then(|| self.part(of, symbol.offset, 1));
                for flag in 0..8 {
                    let name = format!("{name}{flag}");
                    if !names.insert(name.clone()) {
                        continue;
                    }
                    match byte {
                        Some(byte) => self.bits(byte, &name, LOGICAL, flag, 1),
                        None => {
                            let ty = self.base(LOGICAL);
                            self.member(of, &name, ty, symbol.offset + u32::from(flag));
                        }
                    }
                }
                return;
            }
        };
        if names.insert(name.clone()) {
            let ty = self.array(whole, symbol.elements);
            self.member(of, &name, ty, symbol.offset);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::member_name;

    #[test]
    fn names_of_the_languages_become_names_of_c() {
        for (name, member) in
            [("CLPUMP", "CLPUMP"), ("@FRO", "at_FRO"), ("&2Q5", "cs2_Q5"), ("X:$700", "X__700")]
        {
            assert_eq!(member_name(name), member);
        }
    }
}
