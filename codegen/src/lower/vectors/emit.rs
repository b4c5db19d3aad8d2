//! Writes the instructions of rows.

use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::{
    ConstantData, Endianness, InstBuilder, MemFlagsData, Value as ClifValue, types,
};
use plcc_ir::{Address, BinaryOp, Inst, IntCond, Type, UnaryOp};

use super::super::memory::flags;
use super::super::{InvalidIr, LowerResult, Lowering, clif_type};
use super::row::{Format, Node, StoredRow};

/// The CLIF type of a vector.
fn vector_type(format: Format) -> types::Type {
    match format {
        Format::Truths(_) | Format::Integers(Type::I1 | Type::I8) => types::I8X16,
        Format::Integers(Type::I16) => types::I16X8,
        Format::Integers(_) => types::I32X4,
    }
}

/// The bytes of a vector whose lanes all hold the same number.
fn repeated(format: Format, number: i64) -> Vec<u8> {
    let size = vector_type(format).lane_type().bytes() as usize;
    number.to_le_bytes().iter().take(size).copied().cycle().take(16).collect()
}

/// The order of bytes in lanes, for a vector that is reinterpreted as one with lanes of another size.
fn lane_order() -> MemFlagsData {
    MemFlagsData::new().with_endianness(Endianness::Little)
}

impl Lowering<'_> {
    /// Writes the row that is stored in the place of an instruction, if there is one.
    pub(in super::super) fn stored_row(&mut self, inst: Inst) -> LowerResult<()> {
        let Some(&StoredRow { at, ty, format, node }) = self.vectors.rows.get(&inst) else {
            return self.chain(inst);
        };
        let value = self.vector(node)?;
        let start = self.row_offset(at, ty, format.lanes())?;
        let bytes = (format.lanes() * ty.bytes() as usize) as i64;
        self.lower_waiting_loads(Some(start..start + bytes))?;
        let (base, offset) = self.address(ty, at)?;
        let value = match (format, ty) {
            (Format::Integers(int), Type::I1) => {
                // To the bytes of the image, by the saturating conversion to half the width.
                let mut value = value;
                if int == Type::I32 {
                    value = self.builder.ins().snarrow(value, value);
                }
                if int != Type::I8 {
                    value = self.builder.ins().snarrow(value, value);
                }
                let ones = self.vector_constant(Format::Truths(16), &[1; 16]);
                self.builder.ins().band(value, ones)
            }
            _ => value,
        };
        let value = match bytes {
            16 => value,
            8 => {
                let halves = self.builder.ins().bitcast(types::F64X2, lane_order(), value);
                self.builder.ins().extractlane(halves, 0)
            }
            _ => {
                let quarters = self.builder.ins().bitcast(types::I32X4, lane_order(), value);
                self.builder.ins().extractlane(quarters, 0)
            }
        };
        self.builder.ins().store(flags(), value, base, offset);
        Ok(())
    }

    /// Writes the chain of selects that ends with an instruction, if there is one.
    fn chain(&mut self, inst: Inst) -> LowerResult<()> {
        let Some(result) = self.func.result(inst) else { return Ok(()) };
        let Some(chain) = self.vectors.chains.get(&inst).cloned() else { return Ok(()) };
        let bits = self.word_of_truths(&chain.rows)?;
        let zeros = self.builder.ins().clz(bits);
        // The highest bit has the number 31 - zeros.
        let less = match chain.step {
            1 => zeros,
            step => {
                let step = self.iconst(Type::I32, step);
                self.builder.ins().imul(zeros, step)
            }
        };
        let most = chain.start.wrapping_add(chain.step.wrapping_mul(31));
        let most = self.iconst(Type::I32, most);
        let mut chosen = self.builder.ins().isub(most, less);
        if chain.ty != Type::I32 {
            chosen = self.builder.ins().ireduce(clif_type(chain.ty), chosen);
        }
        let otherwise = self.value(chain.otherwise)?;
        let value = self.builder.ins().select(bits, chosen, otherwise);
        self.define(result, value)?;
        self.widen_for_index(result, value);
        Ok(())
    }

    /// A word with the truth values of some rows, each given with its number of lanes; the first is the
    /// lowest bit.
    fn word_of_truths(&mut self, rows: &[(usize, usize)]) -> LowerResult<ClifValue> {
        if let Some(&word) = self.vectors.words.get(rows) {
            return Ok(word);
        }
        let (mut bits, mut count) = (None, 0);
        for &(node, lanes) in rows {
            let truths = self.vector(node)?;
            let masks = self.builder.ins().ineg(truths);
            let mut these = self.builder.ins().vhigh_bits(types::I32, masks);
            if lanes < 16 {
                // The other half of the vector may have any value.
                these = self.builder.ins().band_imm_u(these, 0xFF);
            }
            if count > 0 {
                these = self.builder.ins().ishl_imm_u(these, count);
            }
            bits = Some(match bits {
                Some(others) => self.builder.ins().bor(others, these),
                None => these,
            });
            count += lanes as i64;
        }
        let bits = bits.ok_or_else(|| InvalidIr("a row of selects has no conditions".into()))?;
        self.vectors.words.insert(rows.to_vec(), bits);
        Ok(bits)
    }

    /// The offset in the image of a row's first lane; all of its lanes lie in the region.
    fn row_offset(&self, at: Address, ty: Type, lanes: usize) -> LowerResult<i64> {
        let last = at.offset.checked_add((lanes as u32 - 1) * ty.bytes());
        let last = last.ok_or_else(|| InvalidIr("a row leaves its region".into()))?;
        self.place(ty, Address { offset: last, ..at })?;
        self.place(ty, at)
    }

    /// The vector of a node.
    fn vector(&mut self, node: usize) -> LowerResult<ClifValue> {
        let missing = || InvalidIr("a row has no such operand".into());
        if let Some(&Some(written)) = self.vectors.written.get(node) {
            return Ok(written);
        }
        let slot = self.vectors.nodes.get_mut(node).ok_or_else(missing)?;
        // A node is written once, so that it is not needed any more.
        let data = std::mem::replace(slot, Node::Constants(Type::I8, Format::Truths(8), vec![]));
        let value = self.write_node(&data)?;
        self.vectors.nodes[node] = data;
        self.vectors.written[node] = Some(value);
        Ok(value)
    }

    fn write_node(&mut self, node: &Node) -> LowerResult<ClifValue> {
        Ok(match *node {
            Node::Constants(ty, format, ref lanes) => self.constants(ty, format, lanes),
            Node::Splat(value, format) => {
                let scalar = self.value(value)?;
                self.splat(scalar, self.func.ty(value), format)
            }
            Node::SplatLoad(at, ty, format) => {
                self.place(ty, at)?;
                let (base, offset) = self.address(ty, at)?;
                let scalar = self.builder.ins().load(clif_type(ty), flags(), base, offset);
                self.splat(scalar, ty, format)
            }
            Node::Load(at, ty, format) => self.load_row(at, ty, format)?,
            Node::Gather(ref addresses, ty, format) => self.gather(addresses, ty, format)?,
            Node::Unary(UnaryOp::Neg, arg, _) => {
                let arg = self.vector(arg)?;
                self.builder.ins().ineg(arg)
            }
            Node::Unary(_, arg, format) => {
                let arg = self.vector(arg)?;
                match format {
                    Format::Truths(_) => {
                        let ones = self.vector_constant(format, &[1; 16]);
                        self.builder.ins().bxor(arg, ones)
                    }
                    Format::Integers(_) => self.builder.ins().bnot(arg),
                }
            }
            Node::Binary(BinaryOp::And, [a, b]) => {
                // AND with an inverted operand is one instruction.
                let [a, b] = if self.opposite(a).is_some() { [b, a] } else { [a, b] };
                let x = self.vector(a)?;
                match self.opposite(b) {
                    Some(not) => {
                        let y = self.vector(not)?;
                        self.builder.ins().band_not(x, y)
                    }
                    None => {
                        let y = self.vector(b)?;
                        self.builder.ins().band(x, y)
                    }
                }
            }
            Node::Binary(op, [a, b]) => {
                let (x, y) = (self.vector(a)?, self.vector(b)?);
                match op {
                    BinaryOp::Or => self.builder.ins().bor(x, y),
                    BinaryOp::Xor => self.builder.ins().bxor(x, y),
                    BinaryOp::Add => self.builder.ins().iadd(x, y),
                    BinaryOp::Sub => self.builder.ins().isub(x, y),
                    BinaryOp::Smin => self.builder.ins().smin(x, y),
                    BinaryOp::Smax => self.builder.ins().smax(x, y),
                    BinaryOp::Umin => self.builder.ins().umin(x, y),
                    BinaryOp::Umax => self.builder.ins().umax(x, y),
                    _ => return Err(InvalidIr(format!("a row can't do {op:?}"))),
                }
            }
            Node::Compare(cond, [a, b]) => {
                let (x, y) = (self.vector(a)?, self.vector(b)?);
                let (cond, x, y) = match cond {
                    IntCond::Eq => (IntCC::Equal, x, y),
                    IntCond::Ne => (IntCC::NotEqual, x, y),
                    IntCond::Slt => (IntCC::SignedGreaterThan, y, x),
                    IntCond::Sle => (IntCC::SignedLessThanOrEqual, x, y),
                    IntCond::Sgt => (IntCC::SignedGreaterThan, x, y),
                    IntCond::Sge => (IntCC::SignedGreaterThanOrEqual, x, y),
                    IntCond::Ult => (IntCC::UnsignedLessThan, x, y),
                    IntCond::Ule => (IntCC::UnsignedLessThanOrEqual, x, y),
                    IntCond::Ugt => (IntCC::UnsignedGreaterThan, x, y),
                    IntCond::Uge => (IntCC::UnsignedGreaterThanOrEqual, x, y),
                };
                self.builder.ins().icmp(cond, x, y)
            }
            Node::Select(cond, args, format) => self.select_row(cond, args, format)?,
            Node::Extend(arg, format) => {
                let arg = self.vector(arg)?;
                let one = self.vector_constant(format, &repeated(format, 1));
                self.builder.ins().band(arg, one)
            }
        })
    }

    /// A vector with the same value, of a type, in all lanes.
    fn splat(&mut self, scalar: ClifValue, ty: Type, format: Format) -> ClifValue {
        let vector = vector_type(format);
        let lane = vector.lane_type();
        let scalar = match ty == Type::I1 && lane != types::I8 {
            true => self.builder.ins().uextend(lane, scalar),
            false => scalar,
        };
        let all = self.builder.ins().splat(vector, scalar);
        if ty == Type::I1 { self.truths(format, all) } else { all }
    }

    /// The operand of a node that inverts it; `None` for other nodes.
    fn opposite(&self, node: usize) -> Option<usize> {
        match self.vectors.nodes.get(node) {
            Some(&Node::Unary(UnaryOp::Not, arg, _)) => Some(arg),
            _ => None,
        }
    }

    /// Whether a node is 0 in all lanes.
    fn is_zero(&self, node: usize) -> bool {
        matches!(self.vectors.nodes.get(node), Some(Node::Constants(_, _, lanes)) if lanes.iter().all(|&n| n == 0))
    }

    fn select_row(
        &mut self,
        cond: usize,
        [a, b]: [usize; 2],
        format: Format,
    ) -> LowerResult<ClifValue> {
        let mask = self.vector(cond)?;
        if let Format::Truths(_) = format {
            let (x, y) = (self.vector(a)?, self.vector(b)?);
            let differ = self.builder.ins().bxor(x, y);
            let change = self.builder.ins().band(differ, mask);
            return Ok(self.builder.ins().bxor(change, y));
        }
        if self.is_zero(b) {
            let x = self.vector(a)?;
            return Ok(self.builder.ins().band(x, mask));
        }
        if self.is_zero(a) {
            let y = self.vector(b)?;
            return Ok(self.builder.ins().band_not(y, mask));
        }
        // The same number is added in some lanes and not in others.
        if let Some(&Node::Binary(BinaryOp::Add, [x, more])) = self.vectors.nodes.get(a)
            && x == b
            && let Some(Node::Constants(_, _, lanes)) = self.vectors.nodes.get(more)
        {
            let is_one = lanes.iter().all(|&n| n == 1);
            let x = self.vector(x)?;
            if is_one {
                return Ok(self.builder.ins().isub(x, mask));
            }
            let more = self.vector(more)?;
            let more = self.builder.ins().band(more, mask);
            return Ok(self.builder.ins().iadd(x, more));
        }
        let (x, y) = (self.vector(a)?, self.vector(b)?);
        Ok(self.builder.ins().bitselect(mask, x, y))
    }

    /// A vector constant with these bytes.
    fn vector_constant(&mut self, format: Format, bytes: &[u8]) -> ClifValue {
        let constant = self.builder.func.dfg.constants.insert(ConstantData::from(bytes));
        self.builder.ins().vconst(vector_type(format), constant)
    }

    fn constants(&mut self, ty: Type, format: Format, lanes: &[i64]) -> ClifValue {
        let size = vector_type(format).lane_type().bytes() as usize;
        let is_mask = ty == Type::I1 && matches!(format, Format::Integers(_));
        let lane = |&number: &i64| {
            let number = if is_mask { -number } else { number };
            number.to_le_bytes().into_iter().take(size)
        };
        let mut bytes: Vec<u8> = lanes.iter().flat_map(lane).collect();
        bytes.resize(16, 0);
        self.vector_constant(format, &bytes)
    }

    /// Truth values in lanes that are 0 or 1, as the format has them.
    fn truths(&mut self, format: Format, lanes: ClifValue) -> ClifValue {
        match format {
            Format::Truths(_) => lanes,
            Format::Integers(_) => self.builder.ins().ineg(lanes),
        }
    }

    /// Loads neighbours in the image.
    fn load_row(&mut self, at: Address, ty: Type, format: Format) -> LowerResult<ClifValue> {
        self.row_offset(at, ty, format.lanes())?;
        let (base, offset) = self.address(ty, at)?;
        let bitcast =
            |this: &mut Self, value, to| this.builder.ins().bitcast(to, lane_order(), value);
        let ins = self.builder.ins();
        let value = match (format, ty) {
            (Format::Truths(8), _) => {
                let eight = ins.load(types::F64, flags(), base, offset);
                let eight = self.builder.ins().scalar_to_vector(types::F64X2, eight);
                bitcast(self, eight, types::I8X16)
            }
            (Format::Integers(Type::I16), Type::I1) => ins.uload8x8(flags(), base, offset),
            (Format::Integers(Type::I32), Type::I1) => {
                let four = ins.load(types::I32, flags(), base, offset);
                let four = self.builder.ins().scalar_to_vector(types::I32X4, four);
                let bytes = bitcast(self, four, types::I8X16);
                let words = self.builder.ins().uwiden_low(bytes);
                self.builder.ins().uwiden_low(words)
            }
            _ => ins.load(vector_type(format), flags(), base, offset),
        };
        Ok(if ty == Type::I1 { self.truths(format, value) } else { value })
    }

    /// Loads variables from anywhere, each into its lane.
    fn gather(
        &mut self,
        addresses: &[Address],
        ty: Type,
        format: Format,
    ) -> LowerResult<ClifValue> {
        let vector = vector_type(format);
        // A truth value is put into the lowest byte of its lane.
        let (by, step) = match ty {
            Type::I1 => (types::I8X16, vector.lane_type().bytes() as u8),
            _ => (vector, 1),
        };
        let zero = self.builder.func.dfg.constants.insert(ConstantData::from(&[0u8; 16][..]));
        let mut all = self.builder.ins().vconst(by, zero);
        for (&at, lane) in addresses.iter().zip(0u8..) {
            self.place(ty, at)?;
            let (base, offset) = self.address(ty, at)?;
            let value = self.builder.ins().load(clif_type(ty), flags(), base, offset);
            all = self.builder.ins().insertlane(all, value, lane * step);
        }
        if by != vector {
            all = self.builder.ins().bitcast(vector, lane_order(), all);
        }
        Ok(if ty == Type::I1 { self.truths(format, all) } else { all })
    }
}
