//! Loads and stores in the process image, and of local bits.
//!
//! A *place* tells the two apart by one number: an offset in the image, or, from [`LOCAL_PLACES`] on, the number of a local
//! bit.

use cranelift_codegen::ir::{Endianness, InstBuilder, MemFlagsData, Value as ClifValue, types};
use cranelift_frontend::Variable;
use plcc_abi::ScanContext;
use plcc_ir::{
    Address, BitGroups, ConvertOp, FuncData, InstData, Module, RegionId, SecondaryMap, Type, Value,
};

use super::{InvalidIr, LowerResult, Lowering, clif_type};

/// The place of the first local bit. No offset in the image is as large.
pub(super) const LOCAL_PLACES: i64 = 1 << 32;

/// The place of a local bit.
pub(super) fn local_place(bit: u64) -> i64 {
    LOCAL_PLACES.saturating_add_unsigned(bit)
}

/// The place that an address has without its index; `None` if its region is not there.
pub(super) fn place(module: &Module, at: Address) -> Option<i64> {
    match at.region {
        RegionId::LOCAL_BITS => Some(local_place(at.offset.into())),
        region => Some(i64::from(module.region(region)?.offset) + i64::from(at.offset)),
    }
}

/// A base register: a value that the whole function uses; or a variable, where the value is computed again after calls
/// in cold blocks. Each block where ways meet then takes it as a parameter, which takes long to compile where such
/// calls are many; so functions that are optimised for size keep one value.
#[derive(Clone, Copy)]
pub(super) enum Base {
    /// The value, once it is computed.
    Fixed(Option<ClifValue>),
    Changing(Variable),
}

impl Lowering<'_> {
    /// Loads the image's address from the context and computes the base addresses from it. That is
    /// done at the beginning of a function, and they are rematerialised after each call in a cold
    /// block: so they need not survive that call in a callee-saved register, of which there are
    /// few and most of whose encodings take a byte more in each instruction.
    pub(super) fn materialise_bases(&mut self) {
        let pointer = self.builder.func.dfg.value_type(self.context);
        let flags = MemFlagsData::trusted().with_readonly();
        let offset = std::mem::offset_of!(ScanContext, image) as i32;
        let image = self.builder.ins().load(pointer, flags, self.context, offset);
        self.image = self.define_base(self.image, image);
        let local = self.local_bits.map(|slot| self.builder.ins().stack_addr(pointer, slot, 0));
        for index in 0..self.bases.len() {
            let (place, base) = self.bases[index];
            // By a subtraction: Cranelift would fold an addition back into every address.
            let (start, from) = match local.filter(|_| place >= LOCAL_PLACES) {
                Some(local) => (local, LOCAL_PLACES),
                None => (image, 0),
            };
            let less = self.builder.ins().iconst(pointer, from - place);
            let value = self.builder.ins().isub(start, less);
            self.bases[index].1 = self.define_base(base, value);
        }
    }

    /// Gives a base register a value, from here on.
    fn define_base(&mut self, base: Base, value: ClifValue) -> Base {
        match base {
            Base::Fixed(_) => Base::Fixed(Some(value)),
            Base::Changing(variable) => {
                self.builder.def_var(variable, value);
                base
            }
        }
    }

    /// The value of a base register.
    fn base(&mut self, base: Base) -> LowerResult<ClifValue> {
        match base {
            Base::Fixed(value) => value.ok_or_else(|| InvalidIr("a base is not there".into())),
            Base::Changing(variable) => Ok(self.builder.use_var(variable)),
        }
    }

    /// The base value and the offset from it for a local bit at a place.
    fn local_address(&mut self, place: i64) -> LowerResult<(ClifValue, i32)> {
        let missing = || InvalidIr("the function has no local bits".into());
        let base = self.bases.iter().find(|(of, _)| *of >= LOCAL_PLACES);
        let &(of, base) = base.ok_or_else(missing)?;
        let distance = i32::try_from(place - of).map_err(|_| missing())?;
        Ok((self.base(base)?, distance))
    }

    /// The base value and the offset from it for the local bits of a group.
    pub(super) fn group_address(
        &mut self,
        groups: BitGroups,
        group: u32,
    ) -> LowerResult<(ClifValue, i32)> {
        let bits = groups.bits(group);
        if bits.end > u64::from(self.func.local_bits()) {
            return Err(InvalidIr("it reaches beyond the local bits".into()));
        }
        self.address_of_place(local_place(bits.start))
    }

    pub(super) fn load(&mut self, ty: Type, at: Address) -> LowerResult<ClifValue> {
        let (base, offset) = self.address(ty, at)?;
        Ok(self.builder.ins().load(clif_type(ty), flags(), base, offset))
    }

    /// Whether a value of 8 or 16 bits is used extended with zeros and also otherwise.
    pub(super) fn is_also_extended(&self, value: Value) -> bool {
        matches!(self.func.ty(value), Type::I8 | Type::I16)
            && self.use_count(value) > 1
            && self.is_extended[value]
    }

    /// Loads such a value: by the instruction that extends it, so that no further one has to.
    pub(super) fn load_extended(
        &mut self,
        result: Value,
        ty: Type,
        at: Address,
    ) -> LowerResult<ClifValue> {
        let (base, offset) = self.address(ty, at)?;
        let wide = match ty {
            Type::I8 => self.builder.ins().uload8(types::I32, flags(), base, offset),
            _ => self.builder.ins().uload16(types::I32, flags(), base, offset),
        };
        self.extended_loads.insert(result, wide);
        Ok(self.builder.ins().ireduce(clif_type(ty), wide))
    }

    pub(super) fn store(&mut self, at: Address, value: Value) -> LowerResult<()> {
        let ty = self.func.ty(value);
        let start = self.place(ty, at)?;
        let extent = at.extent(ty);
        let value = self.value(value)?;
        let stored = start..start + (extent.end - extent.start) as i64;
        self.lower_waiting_loads(Some(stored))?;
        let (base, offset) = self.address(ty, at)?;
        self.builder.ins().store(flags(), value, base, offset);
        Ok(())
    }

    /// The place of an address without its index. Code is safe to run only if each access stays in its region whatever
    /// the index is, so this checks it, though the verifier has done so before.
    pub(super) fn place(&self, ty: Type, at: Address) -> LowerResult<i64> {
        let last = at
            .index
            .map_or(0, |index| u64::from(index.count.saturating_sub(1)) * u64::from(index.scale));
        let end = u64::from(at.offset) + last + u64::from(ty.bytes());
        if at.region == RegionId::LOCAL_BITS {
            if end > u64::from(self.func.local_bits()) || at.index.is_some() {
                return Err(InvalidIr("it reaches beyond the local bits".into()));
            }
        } else {
            let region = self.module.region(at.region);
            let region = region.ok_or_else(|| InvalidIr("its region is not there".into()))?;
            let region_end = u64::from(region.offset) + u64::from(region.size);
            if end > u64::from(region.size) || region_end > u64::from(self.module.image_size) {
                return Err(InvalidIr(format!("it leaves its region `{}`", region.name)));
            }
        }
        place(self.module, at).ok_or_else(|| InvalidIr("its region is not there".into()))
    }

    /// The base value and the offset from it that a load or store uses for an address.
    pub(super) fn address(&mut self, ty: Type, at: Address) -> LowerResult<(ClifValue, i32)> {
        let place = self.place(ty, at)?;
        let Some(index) = at.index else { return self.address_of_place(place) };
        let moved = self.index(index)?;
        let image = self.base(self.image)?;
        let base = self.builder.ins().iadd(image, moved);
        Ok(self.at_distance(base, place))
    }

    /// The same for a place.
    fn address_of_place(&mut self, place: i64) -> LowerResult<(ClifValue, i32)> {
        let near = |of: i64| i8::try_from(place - of).ok().map(i32::from);
        let based = |&(of, base): &(i64, Base)| Some((base, near(of)?));
        if near(0).is_none()
            && let Some((base, distance)) = self.bases.iter().find_map(based)
        {
            return Ok((self.base(base)?, distance));
        }
        if place >= LOCAL_PLACES {
            return self.local_address(place);
        }
        let image = self.base(self.image)?;
        Ok(self.at_distance(image, place))
    }

    /// A base value with a distance from it that an instruction can hold.
    fn at_distance(&mut self, base: ClifValue, distance: i64) -> (ClifValue, i32) {
        match i32::try_from(distance) {
            Ok(distance) => (base, distance),
            Err(_) => (self.builder.ins().iadd_imm_s(base, distance), 0),
        }
    }
}

/// For each value of a function whether it is an operand of an extension with zeros.
pub(super) fn extended_values(func: &FuncData) -> SecondaryMap<Value, bool> {
    let mut extended = SecondaryMap::from(vec![false; func.value_count()]);
    for inst in func.blocks().flat_map(|(_, block)| &block.insts) {
        if let InstData::Convert { op: ConvertOp::Zext, to: _, arg } = func.inst(*inst)
            && let Some(slot) = extended.get_mut(*arg)
        {
            *slot = true;
        }
    }
    extended
}

/// How the image is accessed: the memory is always there, and little endian on every machine.
pub(super) fn flags() -> MemFlagsData {
    MemFlagsData::new().with_notrap().with_endianness(Endianness::Little)
}
