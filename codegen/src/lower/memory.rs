//! Loads and stores in the process image.

use cranelift_codegen::ir::{Endianness, InstBuilder, MemFlagsData, Value as ClifValue, types};
use cranelift_frontend::Variable;
use plcc_abi::ScanContext;
use plcc_ir::{Address, ConvertOp, FuncData, InstData, RegionId, SecondaryMap, Type, Value};

use super::{InvalidIr, LowerResult, Lowering, clif_type};

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
        let local =
            self.local_bits.slot.map(|slot| self.builder.ins().stack_addr(pointer, slot, 0));
        for index in 0..self.bases.len() {
            let (place, base) = self.bases[index];
            // By a subtraction: Cranelift would fold an addition back into every address.
            let (start, from) = match local.filter(|_| place >= self.local_bits.offset) {
                Some(local) => (local, self.local_bits.offset),
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

    /// The base value and the offset from it for a local bit, whose offset after the image is given.
    fn local_address(&mut self, offset: i64) -> LowerResult<(ClifValue, i32)> {
        let missing = || InvalidIr("the function has no local bits".into());
        let start = self.local_bits.offset;
        let base = self.bases.iter().find(|(place, _)| *place >= start);
        let &(place, base) = base.ok_or_else(missing)?;
        let distance = i32::try_from(offset - place).map_err(|_| missing())?;
        Ok((self.base(base)?, distance))
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
        let start = self.image_offset(ty, at)?;
        let extent = at.extent(ty);
        let value = self.value(value)?;
        let stored = start..start + (extent.end - extent.start) as i64;
        self.lower_waiting_loads(Some(stored))?;
        let (base, offset) = self.address(ty, at)?;
        self.builder.ins().store(flags(), value, base, offset);
        Ok(())
    }

    /// The offset in the image of an address without its index; local bits lie after the image. Code is safe to
    /// run only if each access stays in its region whatever the index is, so this checks it, though the
    /// verifier has done so before.
    pub(super) fn image_offset(&self, ty: Type, at: Address) -> LowerResult<i64> {
        let region = self.module.region(at.region);
        let region = region.ok_or_else(|| InvalidIr("its region is not there".into()))?;
        let last = at
            .index
            .map_or(0, |index| u64::from(index.count.saturating_sub(1)) * u64::from(index.scale));
        let end = u64::from(at.offset) + last + u64::from(ty.bytes());
        let region_end = u64::from(region.offset) + u64::from(region.size);
        let is_in_image = region_end <= u64::from(self.module.image_size);
        let is_local = at.region == RegionId::LOCAL_BITS && end <= u64::from(self.local_bits.size);
        if end > u64::from(region.size) || !is_in_image && !is_local {
            return Err(InvalidIr(format!("it leaves its region `{}`", region.name)));
        }
        Ok(i64::from(region.offset) + i64::from(at.offset))
    }

    /// The base value and the offset from it that a load or store uses for an address.
    pub(super) fn address(&mut self, ty: Type, at: Address) -> LowerResult<(ClifValue, i32)> {
        let offset = self.image_offset(ty, at)?;
        let base = match at.index {
            Some(index) => {
                let moved = self.index(index)?;
                let image = self.base(self.image)?;
                self.builder.ins().iadd(image, moved)
            }
            None => {
                let near = |place: i64| i8::try_from(offset - place).ok().map(i32::from);
                let based = |&(place, base): &(i64, Base)| Some((base, near(place)?));
                if near(0).is_none()
                    && let Some((base, offset)) = self.bases.iter().find_map(based)
                {
                    return Ok((self.base(base)?, offset));
                }
                if at.region == RegionId::LOCAL_BITS {
                    return self.local_address(offset);
                }
                self.base(self.image)?
            }
        };
        Ok(match i32::try_from(offset) {
            Ok(offset) => (base, offset),
            Err(_) => (self.builder.ins().iadd_imm_s(base, offset), 0),
        })
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
