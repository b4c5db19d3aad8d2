//! Local bits: truth values in the stack frame of a function (the pass `byte-bits` of IR), and the two
//! operations that turn eight bits of a word into eight of them, and back.
//!
//! On x86-64, the operations of a word are done on vectors, for up to 16 bits at once:
//!
//! ```text
//! spread_bits   punpcklbw, pshuflw, pshufd   a byte of the word in each of eight bytes
//!               pand                         of each byte one bit: 1, 2, 4, … 128
//!               pminub                       1 in the place of the bit, if it is 1
//! gather_bits   psllw                        the lowest bit of each byte to its highest
//!               pmovmskb                     the highest bits of all bytes
//! ```

use cranelift_codegen::ir::{
    ConstantData, Endianness, InstBuilder, MemFlagsData, StackSlot, StackSlotData, StackSlotKind,
    Value as ClifValue, types,
};
use cranelift_frontend::FunctionBuilder;
use plcc_ir::tables::{FastMap, FastSet};
use plcc_ir::{
    Address, BinaryOp, ConvertOp, FuncData, Inst, InstData, Module, RegionId, SecondaryMap, Type,
    UnaryOp, Value,
};

use super::memory::flags;
use super::{LowerResult, Lowering};

/// That many bytes follow the last local bit, since a truth value may be loaded with the bytes after it.
const PADDING: u32 = 8;

/// Of a vector of bytes, the bit that each byte stands for.
const BIT_OF_BYTE: [u8; 16] = [1, 2, 4, 8, 16, 32, 64, 128, 1, 2, 4, 8, 16, 32, 64, 128];

/// The local bits of a function.
pub(super) struct LocalBits {
    /// The number of bytes up to the last one that the function accesses.
    pub(super) size: u32,
    /// The first of the offsets that stand for them, after those of the image.
    pub(super) offset: i64,
    /// The part of the stack frame, if the function has local bits.
    pub(super) slot: Option<StackSlot>,
    /// The words that are unpacked at once, by the last of their stores.
    unpacked: FastMap<Inst, Unpacked>,
    /// The other stores of these words, for which nothing is written.
    left_out: FastSet<Inst>,
    /// The ORs that join two neighbouring groups of eight bits, with the address of the first.
    joined: FastMap<Inst, Address>,
}

/// A word that is unpacked.
#[derive(Clone)]
struct Unpacked {
    /// An integer of 32 or 64 bits that holds it.
    word: Value,
    /// The groups of eight bits, in rising order, each with the address of its first local bit.
    groups: Vec<(u8, Address)>,
}

impl LocalBits {
    /// Those of a function, for which a part of its stack frame is reserved.
    pub(super) fn new(
        module: &Module,
        func: &FuncData,
        builder: &mut FunctionBuilder<'_>,
        is_x86: bool,
    ) -> Self {
        let mut this = Self {
            size: 0,
            offset: i64::MAX,
            slot: None,
            unpacked: FastMap::default(),
            left_out: FastSet::default(),
            joined: FastMap::default(),
        };
        let Some(region) = &module.local_bits else { return this };
        this.offset = i64::from(region.offset);
        let insts = func.blocks().flat_map(|(_, block)| &block.insts);
        let end = |&inst: &Inst| {
            local_access(func, inst).map_or(0, |(at, ty)| at.offset.saturating_add(ty.bytes()))
        };
        this.size = insts.map(end).max().unwrap_or(0).min(region.size);
        if this.size == 0 {
            return this;
        }
        let data = StackSlotData::new(StackSlotKind::ExplicitSlot, this.size + PADDING, 4);
        this.slot = Some(builder.create_sized_stack_slot(data));
        if is_x86 {
            let uses = func.use_counts();
            for (_, block) in func.blocks() {
                this.find_unpacked(func, &block.insts);
                this.find_joined(func, &block.insts, &uses);
            }
        }
        this
    }

    /// Finds the words of a block whose groups of bits are unpacked one after the other.
    fn find_unpacked(&mut self, func: &FuncData, insts: &[Inst]) {
        let mut current: Option<(Unpacked, Vec<Inst>)> = None;
        for &inst in insts {
            let next = match *func.inst(inst) {
                InstData::Store { at, value } => match unpacked_group(func, at, value) {
                    Some(next) => Some((at, next)),
                    None => {
                        self.finish(current.take());
                        continue;
                    }
                },
                InstData::Load { .. } => {
                    self.finish(current.take());
                    continue;
                }
                data if data.has_effect() => {
                    self.finish(current.take());
                    continue;
                }
                _ => None,
            };
            let Some((at, (word, group))) = next else { continue };
            match &mut current {
                Some((unpacked, stores))
                    if unpacked.word == word
                        && unpacked.groups.last().is_some_and(|last| last.0 < group) =>
                {
                    unpacked.groups.push((group, at));
                    stores.push(inst);
                }
                _ => {
                    self.finish(current.take());
                    current = Some((Unpacked { word, groups: vec![(group, at)] }, vec![inst]));
                }
            }
        }
        self.finish(current);
    }

    /// Enters a word whose groups were found: all are unpacked at the last of their stores, and the other stores are left out.
    fn finish(&mut self, found: Option<(Unpacked, Vec<Inst>)>) {
        if let Some((unpacked, mut stores)) = found
            && let Some(last) = stores.pop()
        {
            self.left_out.extend(stores);
            self.unpacked.insert(last, unpacked);
        }
    }

    /// Finds the ORs of a block that join two groups of bits.
    fn find_joined(&mut self, func: &FuncData, insts: &[Inst], uses: &SecondaryMap<Value, u32>) {
        // The groups that were gathered since anything was last stored in the local bits.
        let mut gathered: FastMap<Value, Address> = FastMap::default();
        let is_used_once = |value: Value| uses[value] == 1;
        for &inst in insts {
            if let InstData::Store { at, .. } = func.inst(inst) {
                if at.region == RegionId::LOCAL_BITS {
                    gathered.clear();
                }
                continue;
            }
            let Some(result) = func.result(inst) else { continue };
            let address = |value: Value| gathered.get(&value).copied();
            match *func.inst(inst) {
                InstData::Load { ty: Type::I64, at } if at.region == RegionId::LOCAL_BITS => {
                    gathered.insert(result, at);
                }
                InstData::Unary { op: UnaryOp::GatherBits, arg }
                | InstData::Convert { op: ConvertOp::Trunc, to: Type::I32, arg } => {
                    if let Some(at) = address(arg).filter(|_| is_used_once(arg)) {
                        gathered.insert(result, at);
                    }
                }
                InstData::Binary { op: BinaryOp::Or, args: [low, shifted] } => {
                    if let Some(InstData::Binary { op: BinaryOp::Shl, args: [high, by] }) =
                        func.def_inst(shifted)
                        && func.constant(*by) == Some(8)
                        && [low, *high].into_iter().all(|part| is_gathered(func, part))
                        && [low, shifted, *high].into_iter().all(is_used_once)
                        && let (Some(first), Some(second)) = (address(low), address(*high))
                        && first.offset.checked_add(8) == Some(second.offset)
                    {
                        self.joined.insert(inst, first);
                    }
                }
                _ => {}
            }
        }
    }

    /// Whether nothing is to be written for an instruction.
    pub(super) fn leaves_out(&self, inst: Inst) -> bool {
        self.left_out.contains(&inst)
    }
}

/// The address and type of an access of local bits.
fn local_access(func: &FuncData, inst: Inst) -> Option<(Address, Type)> {
    let (at, ty) = match *func.inst(inst) {
        InstData::Load { ty, at } => (at, ty),
        InstData::Store { at, value } => (at, func.ty(value)),
        _ => return None,
    };
    (at.region == RegionId::LOCAL_BITS).then_some((at, ty))
}

/// If a store to an address puts a group of bits of a word there: the word, and the number of the group among those of its
/// lowest 32 bits.
fn unpacked_group(func: &FuncData, at: Address, value: Value) -> Option<(Value, u8)> {
    let &InstData::Unary { op: UnaryOp::SpreadBits, arg } = func.def_inst(value)? else {
        return None;
    };
    if at.region != RegionId::LOCAL_BITS {
        return None;
    }
    if let Some(&InstData::Binary { op: BinaryOp::Lshr, args: [word, by] }) = func.def_inst(arg)
        && let Some(by @ (8 | 16 | 24)) = func.constant(by)
    {
        return Some((word, by as u8 / 8));
    }
    Some((arg, 0))
}

/// Whether a value is an integer of 32 bits that a group was gathered into.
fn is_gathered(func: &FuncData, value: Value) -> bool {
    matches!(func.def_inst(value), Some(InstData::Convert { op: ConvertOp::Trunc, .. }))
        && func.ty(value) == Type::I32
}

impl Lowering<'_> {
    /// Writes the store of an instruction together with others of the same word, if they are unpacked at once; gives
    /// whether that was done.
    pub(super) fn unpacked_word(&mut self, inst: Inst) -> LowerResult<bool> {
        let Some(Unpacked { word, groups }) = self.local_bits.unpacked.get(&inst).cloned() else {
            return Ok(false);
        };
        let word = match self.func.def_inst(word) {
            Some(&InstData::Convert { op: ConvertOp::Zext, to: _, arg })
                if self.func.ty(arg) == Type::I32 =>
            {
                self.value(arg)?
            }
            _ => {
                let word = self.value(word)?;
                self.builder.ins().ireduce(types::I32, word)
            }
        };
        let lanes = self.builder.ins().scalar_to_vector(types::I32X4, word);
        let bytes = self.builder.ins().bitcast(types::I8X16, byte_order(), lanes);
        // Each byte of the word twice, one after the other.
        let twice = self.shuffle(bytes, |byte| byte / 2 + 16 * (byte % 2));
        let mut rest = groups.as_slice();
        while let Some((&(group, at), others)) = rest.split_first() {
            let next = others.first().copied();
            let is_pair = next
                == at.offset.checked_add(8).map(|offset| (group + 1, Address { offset, ..at }));
            let second = if is_pair { group + 1 } else { group };
            let pairs = [group, group, second, second];
            let low = self.shuffle(twice, |byte| match pairs.get(usize::from(byte / 2)) {
                Some(pair) => 2 * pair + byte % 2,
                None => byte,
            });
            let all = match is_pair {
                true => self.shuffle(low, |byte| byte % 4 + 4 * (byte / 8)),
                false => low,
            };
            let bits = self.byte_constant(&BIT_OF_BYTE);
            let kept = self.builder.ins().band(all, bits);
            let ones = self.byte_constant(&[1; 16]);
            let truths = self.builder.ins().umin(kept, ones);
            let value = match is_pair {
                true => truths,
                false => {
                    let halves = self.builder.ins().bitcast(types::F64X2, byte_order(), truths);
                    self.builder.ins().extractlane(halves, 0)
                }
            };
            let start = self.image_offset(Type::I64, at)?;
            self.lower_waiting_loads(Some(start..start + if is_pair { 16 } else { 8 }))?;
            let (base, offset) = self.address(Type::I64, at)?;
            self.builder.ins().store(flags(), value, base, offset);
            rest = others.get(usize::from(is_pair)..).unwrap_or_default();
        }
        Ok(true)
    }

    /// The result of an OR that joins two groups of bits, which are gathered at once; `None` if it does
    /// something else.
    pub(super) fn joined_groups(&mut self, inst: Inst) -> LowerResult<Option<ClifValue>> {
        let Some(&at) = self.local_bits.joined.get(&inst) else { return Ok(None) };
        let second = Address { offset: at.offset.saturating_add(8), ..at };
        self.image_offset(Type::I64, second)?;
        let (base, offset) = self.address(Type::I64, at)?;
        let bytes = self.builder.ins().load(types::I8X16, flags(), base, offset);
        Ok(Some(self.lowest_bits(bytes, types::I32)))
    }

    /// The eight lowest bits of an integer of 64 bits, each in a byte of its own.
    pub(super) fn spread_bits(&mut self, x: ClifValue) -> ClifValue {
        // In each byte of a multiple of the bits, one of them is kept. Then 127 is added to each byte, which makes
        // its highest bit 1 if the byte is not 0.
        let low = self.builder.ins().band_imm_u(x, 0xFF);
        let factor = self.builder.ins().iconst(types::I64, 0x0101_0101_0101_0101);
        let everywhere = self.builder.ins().imul(low, factor);
        let kept = self.builder.ins().iconst(types::I64, 0x8040_2010_0804_0201_u64 as i64);
        let kept = self.builder.ins().band(everywhere, kept);
        let most = self.builder.ins().iconst(types::I64, 0x7F7F_7F7F_7F7F_7F7F);
        let sum = self.builder.ins().iadd(kept, most);
        let high = self.builder.ins().ushr_imm_u(sum, 7);
        let ones = self.builder.ins().iconst(types::I64, 0x0101_0101_0101_0101);
        self.builder.ins().band(high, ones)
    }

    /// The lowest bit of each byte of an integer of 64 bits, side by side.
    pub(super) fn gather_bits(&mut self, x: ClifValue) -> ClifValue {
        if self.is_x86 {
            let lanes = self.builder.ins().scalar_to_vector(types::I64X2, x);
            return self.lowest_bits(lanes, types::I64);
        }
        let ones = self.builder.ins().iconst(types::I64, 0x0101_0101_0101_0101);
        let low = self.builder.ins().band(x, ones);
        // The product has the bit of byte i at position 56 + i, and no sum below carries into these.
        let factor = self.builder.ins().iconst(types::I64, 0x0102_0408_1020_4080);
        let product = self.builder.ins().imul(low, factor);
        self.builder.ins().ushr_imm_u(product, 56)
    }

    /// The lowest bits of all bytes of a vector, as an integer.
    fn lowest_bits(&mut self, vector: ClifValue, ty: types::Type) -> ClifValue {
        let words = self.builder.ins().bitcast(types::I16X8, byte_order(), vector);
        let by = self.builder.ins().iconst(types::I32, 7);
        let high = self.builder.ins().ishl(words, by);
        let bytes = self.builder.ins().bitcast(types::I8X16, byte_order(), high);
        self.builder.ins().vhigh_bits(ty, bytes)
    }

    /// A vector whose bytes are bytes of another, by their numbers; from 16 on those of the same vector once more.
    fn shuffle(&mut self, bytes: ClifValue, number: impl Fn(u8) -> u8) -> ClifValue {
        let numbers: Vec<u8> = (0..16).map(number).collect();
        let mask = self.builder.func.dfg.immediates.push(ConstantData::from(numbers.as_slice()));
        self.builder.ins().shuffle(bytes, bytes, mask)
    }

    fn byte_constant(&mut self, bytes: &[u8; 16]) -> ClifValue {
        let constant = self.builder.func.dfg.constants.insert(ConstantData::from(&bytes[..]));
        self.builder.ins().vconst(types::I8X16, constant)
    }
}

/// The order of bytes in lanes, for a vector that is reinterpreted as one with lanes of another size.
fn byte_order() -> MemFlagsData {
    MemFlagsData::new().with_endianness(Endianness::Little)
}
