//! Local bits: truth values in the stack frame of a function (the pass `byte-bits` of IR), and the two
//! instructions that turn groups of eight bits of a word into local bits, and back.
//!
//! On x86-64 they are done on vectors, for up to two groups at once:
//!
//! ```text
//! unpack   punpcklbw, pshuflw, pshufd   a byte of the word in each of eight bytes
//!          pand                         of each byte one bit: 1, 2, 4, … 128
//!          pminub                       1 in the place of the bit, if it is 1
//! pack     psllw                        the lowest bit of each byte to its highest
//!          pmovmskb                     the highest bits of all bytes
//! ```

use cranelift_codegen::ir::{
    ConstantData, Endianness, InstBuilder, MemFlagsData, StackSlot, StackSlotData, StackSlotKind,
    Value as ClifValue, types,
};
use cranelift_frontend::FunctionBuilder;
use plcc_ir::{BitGroups, FuncData, Value};

use super::memory::{flags, local_place};
use super::{LowerResult, Lowering};

/// That many bytes follow the last local bit, since a truth value may be loaded with the bytes after it.
const PADDING: u32 = 8;

/// The local bits of a group.
const GROUP: i64 = 8;

/// Of a vector of bytes, the bit that each byte stands for.
const BIT_OF_BYTE: [u8; 16] = [1, 2, 4, 8, 16, 32, 64, 128, 1, 2, 4, 8, 16, 32, 64, 128];

/// The part of the stack frame for a function's local bits, if it has any.
pub(super) fn stack_slot(func: &FuncData, builder: &mut FunctionBuilder<'_>) -> Option<StackSlot> {
    let size = func.local_bits();
    (size > 0).then(|| {
        let data = StackSlotData::new(StackSlotKind::ExplicitSlot, size + PADDING, 4);
        builder.create_sized_stack_slot(data)
    })
}

/// Cuts groups into runs of one or two neighbours: the first of each run, and whether there is a second.
fn runs(groups: BitGroups) -> Vec<(u32, bool)> {
    let mut runs: Vec<(u32, bool)> = vec![];
    for group in groups.iter() {
        match runs.last_mut() {
            Some((first, is_pair @ false)) if *first + 1 == group => *is_pair = true,
            _ => runs.push((group, false)),
        }
    }
    runs
}

impl Lowering<'_> {
    /// Puts groups of bits of a word into local bits.
    pub(super) fn unpack(&mut self, word: Value, to: BitGroups) -> LowerResult<()> {
        let word = self.value(word)?;
        let spread = match self.is_x86 {
            true => self.bytes_twice(word),
            false => self.builder.ins().uextend(types::I64, word),
        };
        for (group, is_pair) in runs(to) {
            let start = local_place(to.bits(group).start);
            if self.is_x86 {
                let truths = self.truths_of(spread, group, is_pair);
                let size = if is_pair { 2 * GROUP } else { GROUP };
                self.lower_waiting_loads(Some(start..start + size))?;
                let (base, offset) = self.group_address(to, group)?;
                if is_pair {
                    // This says that the second group is there, too.
                    self.group_address(to, group + 1)?;
                }
                self.builder.ins().store(flags(), truths, base, offset);
                continue;
            }
            for group in group..=group + u32::from(is_pair) {
                let low = self.builder.ins().ushr_imm_u(spread, i64::from(8 * group));
                let truths = self.spread_bits(low);
                let start = local_place(to.bits(group).start);
                self.lower_waiting_loads(Some(start..start + GROUP))?;
                let (base, offset) = self.group_address(to, group)?;
                self.builder.ins().store(flags(), truths, base, offset);
            }
        }
        Ok(())
    }

    /// A word with the bits of groups of local bits, and 0 elsewhere.
    pub(super) fn pack(&mut self, from: BitGroups) -> LowerResult<ClifValue> {
        let mut packed = None;
        for (group, is_pair) in runs(from) {
            let (base, offset) = self.group_address(from, group)?;
            let bits = if is_pair && self.is_x86 {
                self.group_address(from, group + 1)?;
                let bytes = self.builder.ins().load(types::I8X16, flags(), base, offset);
                self.lowest_bits(bytes, types::I32)
            } else {
                let mut bits = self.packed_group(base, offset);
                if is_pair {
                    let (base, offset) = self.group_address(from, group + 1)?;
                    let second = self.packed_group(base, offset);
                    let second = self.builder.ins().ishl_imm_u(second, GROUP);
                    bits = self.builder.ins().bor(bits, second);
                }
                bits
            };
            let bits = match group {
                0 => bits,
                _ => self.builder.ins().ishl_imm_u(bits, GROUP * i64::from(group)),
            };
            packed = Some(match packed {
                Some(others) => self.builder.ins().bor(others, bits),
                None => bits,
            });
        }
        Ok(match packed {
            Some(packed) => packed,
            None => self.builder.ins().iconst(types::I32, 0),
        })
    }

    /// The local bits of one group, as the lowest bits of an integer of 32 bits.
    fn packed_group(&mut self, base: ClifValue, offset: i32) -> ClifValue {
        let bytes = self.builder.ins().load(types::I64, flags(), base, offset);
        let bits = self.gather_bits(bytes);
        self.builder.ins().ireduce(types::I32, bits)
    }

    /// A vector with each byte of a word twice, one after the other.
    fn bytes_twice(&mut self, word: ClifValue) -> ClifValue {
        let lanes = self.builder.ins().scalar_to_vector(types::I32X4, word);
        let bytes = self.builder.ins().bitcast(types::I8X16, byte_order(), lanes);
        self.shuffle(bytes, |byte| byte / 2 + 16 * (byte % 2))
    }

    /// The local bits of one or two groups, as they are stored; `twice` has each byte of the word twice.
    fn truths_of(&mut self, twice: ClifValue, group: u32, is_pair: bool) -> ClifValue {
        let group = group as u8;
        let second = group + u8::from(is_pair);
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
        if is_pair {
            return truths;
        }
        let halves = self.builder.ins().bitcast(types::F64X2, byte_order(), truths);
        self.builder.ins().extractlane(halves, 0)
    }

    /// The eight lowest bits of an integer of 64 bits, each in a byte of its own.
    fn spread_bits(&mut self, x: ClifValue) -> ClifValue {
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
    fn gather_bits(&mut self, x: ClifValue) -> ClifValue {
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
