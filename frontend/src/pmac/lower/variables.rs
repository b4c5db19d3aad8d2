//! Reading and writing variables in IR. Where a variable's place is known, the code accesses it
//! there: that is so for P, Q and I, for L-variables in the process image, and in specialised code
//! for M-variables whose definition is assumed. Everything else goes through the host.

use plcc_abi::HostFn;
use plcc_abi::pmac::layout::{DEFINITION_SIZE, DOUBLE_SIZE, exec, region};
use plcc_abi::pmac::{
    Controller, Definition, DirectAccess, Field, Format, Kind, Layout, Place, Range, Space,
};
use plcc_ir::{
    Address, BinaryOp, ChunkBuilder, ExtractOp, InstBuilder, IntCond, RegionId, Type, Value,
};

use super::Lowerer;
use super::emit::{self, Operand};
use super::field;
use crate::common::BrokenInvariant;
use crate::pmac::analyse::assumptions::for_each_named_m;
use crate::pmac::ast::Target;

/// Up to that many variables of a range (`P1..4=0`) are written by stores of their own, as separate
/// assignments are. More are written by one call of the host, so that the code stays short however
/// long the range is.
pub(super) const MAX_SEPARATE_STORES: u16 = 8;

/// Regions of the image, as IR refers to them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Regions {
    pub(crate) p: RegionId,
    pub(crate) q: RegionId,
    pub(crate) i: RegionId,
    pub(crate) mdef: RegionId,
    pub(crate) words: RegionId,
    pub(crate) differing_definitions: RegionId,
    pub(crate) exec: RegionId,
}

impl Regions {
    /// The regions of a module that is built.
    pub(super) fn of(builder: &ChunkBuilder) -> Result<Self, BrokenInvariant> {
        let find = |name: &str| {
            builder
                .region(name)
                .ok_or_else(|| BrokenInvariant::new(format!("the image has no region `{name}`")))
        };
        Ok(Self {
            p: find(region::P)?,
            q: find(region::Q)?,
            i: find(region::I)?,
            mdef: find(region::MDEF)?,
            words: find(region::WORDS)?,
            differing_definitions: find(region::DIFFERING_DEFINITIONS)?,
            exec: find(region::EXEC)?,
        })
    }
}

/// Whether an address is that of a hardware register, not of memory.
fn is_hardware(layout: &Layout, address: u32) -> bool {
    let address = address & layout.address_mask();
    match layout.controller {
        Controller::Pmac => address >= 0xC000,
        Controller::Turbo => address >= 0x7_8000,
    }
}

/// The error for an L-variable whose number is computed, which the language does not have.
fn computed_number_of_l() -> BrokenInvariant {
    BrokenInvariant::new("the number of an L-variable is computed")
}

impl Lowerer<'_> {
    /// The address of the variable with a number in a region of doubles.
    fn variable_address(&self, region: RegionId, number: u32) -> Address {
        Address::fixed(region, DOUBLE_SIZE * (number & (self.layout.count - 1)))
    }

    /// The address of a word at an offset in the region of words; volatile if the controller's
    /// `address` is that of a hardware register.
    fn word_address(&self, offset: u32, address: u32) -> Address {
        let at = Address::fixed(self.regions.words, offset);
        if is_hardware(&self.layout, address) { at.volatile() } else { at }
    }

    /// The number of a Q-variable among those of all coordinate systems, an `i32`: its own number
    /// plus that of the addressed coordinate system's first Q-variable.
    fn q_number(&mut self, number: Value) -> Value {
        let at = Address::fixed(self.regions.exec, exec::q_base(self.context));
        let b = self.builder.func();
        let base = b.load(Type::I32, at);
        let sum = b.binary(BinaryOp::Add, base, number);
        b.binary_imm(BinaryOp::And, sum, i64::from(self.layout.count - 1))
    }

    /// The address of the variable whose number is computed, in a region of doubles.
    fn computed_address(&self, region: RegionId, index: Value) -> Address {
        Address::indexed(region, 0, index, 8, self.layout.count)
    }

    fn q_address(&mut self, number: u32) -> Address {
        if !self.has_address_statements {
            return self.variable_address(self.regions.q, number);
        }
        let number = self.builder.func().constant(Type::I32, i64::from(number));
        let index = self.q_number(number);
        self.computed_address(self.regions.q, index)
    }

    /// A variable's value.
    pub(crate) fn read(&mut self, kind: Kind, number: u32) -> Result<Operand, BrokenInvariant> {
        let at = match kind {
            Kind::P => self.variable_address(self.regions.p, number),
            Kind::I => self.variable_address(self.regions.i, number),
            Kind::Q => self.q_address(number),
            Kind::M => return self.read_m(number),
            Kind::L => {
                let value = self.read_l(number)?;
                return Ok(Operand::integer(self.builder.func(), value));
            }
        };
        Ok(Operand::Stored(at))
    }

    fn read_m(&mut self, number: u32) -> Result<Operand, BrokenInvariant> {
        let number = number & (self.layout.count - 1);
        let place = self.places_of_m.get(number as usize).copied().flatten();
        match place.filter(|_| self.specialised) {
            Some(place) => Ok(self.read_m_direct(number, place)),
            None => self.read_m_general(number),
        }
    }

    fn read_m_general(&mut self, number: u32) -> Result<Operand, BrokenInvariant> {
        let b = self.builder.func();
        let number = b.constant(Type::I32, i64::from(number));
        let value = emit::host_value(b, HostFn::PmacMRead, &[number])?;
        Ok(Operand::Double(value))
    }

    fn read_m_direct(&mut self, number: u32, place: DirectAccess) -> Operand {
        let at = match place {
            DirectAccess::Word(offset, address, field) => {
                let at = self.word_address(offset, address);
                self.single_bits.add(&self.builder, field);
                let b = self.builder.func();
                let value = field::read_field(b, at, field);
                return Operand::integer(b, value);
            }
            DirectAccess::Star => {
                let at = Address::fixed(self.regions.mdef, DEFINITION_SIZE * number);
                let b = self.builder.func();
                let word = b.load(Type::I32, at);
                let low = plcc_ir::Field { first: 0, width: 21 };
                let value = b.extract(ExtractOp::Signed, word, low);
                return Operand::integer(b, value);
            }
            DirectAccess::P(number) => self.variable_address(self.regions.p, number),
            DirectAccess::Q(number) => self.variable_address(self.regions.q, number),
        };
        Operand::Stored(at)
    }

    /// The value of a variable whose number is computed.
    pub(crate) fn read_indirect(
        &mut self,
        kind: Kind,
        number: Operand,
    ) -> Result<Operand, BrokenInvariant> {
        let index = self.variable_number(number)?;
        let region = match kind {
            Kind::P => self.regions.p,
            Kind::I => self.regions.i,
            Kind::Q => {
                let index = self.q_number(index);
                let at = self.computed_address(self.regions.q, index);
                return Ok(Operand::Stored(at));
            }
            Kind::M => {
                let b = self.builder.func();
                let value = emit::host_value(b, HostFn::PmacMRead, &[index])?;
                return Ok(Operand::Double(value));
            }
            Kind::L => return Err(computed_number_of_l()),
        };
        let at = self.computed_address(region, index);
        Ok(Operand::Stored(at))
    }

    /// The number of a variable, an `i32`, from a computed value: rounded to an integer and cut to
    /// the bits that numbers of variables have.
    fn variable_number(&mut self, number: Operand) -> Result<Value, BrokenInvariant> {
        let mask = i64::from(self.layout.count - 1);
        let b = self.builder.func();
        let bits = number.bits(b)?;
        Ok(b.binary_imm(BinaryOp::And, bits, mask))
    }

    /// Assigns a value to what a statement names. `index` is the computed number of an indirect
    /// variable.
    pub(crate) fn assign(
        &mut self,
        target: Target,
        value: Operand,
        index: Option<Operand>,
    ) -> Result<(), BrokenInvariant> {
        match target {
            Target::Var(kind, number) => self.write(kind, u32::from(number), value),
            Target::Indirect(kind, _) => {
                self.write_indirect(kind, index.ok_or_else(super::lacks_operand)?, value)
            }
            Target::Range { kind, first, count, step } if count > MAX_SEPARATE_STORES => {
                let value = value.stored(self.builder.func());
                self.write_range(kind, (first, count, step), value);
                Ok(())
            }
            Target::Range { kind, first, count, step } => {
                // The value is read once, since a write may change the variable that it comes from.
                let value = match value {
                    Operand::Stored(_) => Operand::Double(value.float(self.builder.func())),
                    other => other,
                };
                let specialised = self.specialised;
                for k in 0..u32::from(count) {
                    self.write(kind, u32::from(first) + k * u32::from(step), value)?;
                    // The write may have moved the definitions of the variables that follow.
                    self.specialised &= !self.may_change_definitions;
                }
                self.specialised = specialised;
                Ok(())
            }
        }
    }

    /// Assigns a double to `count` variables from `first` on, `step` apart, through the host, in a
    /// single call.
    pub(crate) fn write_range(
        &mut self,
        kind: Kind,
        (first, count, step): (u16, u16, u16),
        value: Value,
    ) {
        let first = self.builder.func().constant(Type::I32, i64::from(first));
        let first = match kind {
            Kind::Q if self.has_address_statements => self.q_number(first),
            _ => first,
        };
        let b = self.builder.func();
        let kind_number = b.constant(Type::I32, i64::from(kind.number()));
        let count_and_step = b.constant(Type::I32, i64::from(count) | i64::from(step) << 16);
        b.host_call(HostFn::PmacRangeWrite, &[kind_number, first, count_and_step, value]);
        // Definitions of M-variables lie in memory, which M- and L-variables can reach.
        self.may_change_definitions |= matches!(kind, Kind::M | Kind::L);
    }

    fn write(&mut self, kind: Kind, number: u32, value: Operand) -> Result<(), BrokenInvariant> {
        let at = match kind {
            Kind::P => self.variable_address(self.regions.p, number),
            Kind::Q => self.q_address(number),
            Kind::I => return self.write_i(number, value),
            Kind::M => return self.write_m(number, value),
            Kind::L => {
                let bits = match self.l_format(number)? {
                    Format::D | Format::C => self.encode_bcd(number, value)?,
                    Format::U | Format::S => value.bits(self.builder.func())?,
                };
                return self.write_l(number, bits);
            }
        };
        value.store(self.builder.func(), at);
        Ok(())
    }

    fn write_i(&mut self, number: u32, value: Operand) -> Result<(), BrokenInvariant> {
        let at = self.variable_address(self.regions.i, number);
        let range = self.ranges.binary_search_by_key(&number, |r| r.0).ok();
        let range = range.and_then(|index| self.ranges.get(index)).map(|r| r.1);
        let b = self.builder.func();
        match (range, value) {
            (None, _) => value.store(b, at),
            (Some(range), Operand::Const(value)) => {
                Operand::Const(range.convert(value)).store(b, at)
            }
            (Some(Range::Integer(low, high)), _) => {
                let value = value.float(b);
                let (low, high) = (b.fconst(low as f64), b.fconst(high as f64));
                let value = emit::host_value(b, HostFn::PmacRange, &[value, low, high])?;
                b.store(at, value);
            }
            (Some(Range::Real(..)), _) => {
                let value = value.stored(b);
                let number = b.constant(Type::I32, i64::from(number));
                b.host_call(HostFn::PmacIWrite, &[number, value]);
            }
        }
        Ok(())
    }

    fn write_m(&mut self, number: u32, value: Operand) -> Result<(), BrokenInvariant> {
        let number = number & (self.layout.count - 1);
        let place = self.places_of_m.get(number as usize).copied().flatten();
        match place.filter(|_| self.specialised) {
            Some(place) => self.write_m_direct(number, place, value),
            None => {
                self.write_m_general(number, value);
                Ok(())
            }
        }
    }

    fn write_m_general(&mut self, number: u32, value: Operand) {
        let b = self.builder.func();
        let value = value.stored(b);
        let number = b.constant(Type::I32, i64::from(number));
        b.host_call(HostFn::PmacMWrite, &[number, value]);
        self.may_change_definitions = true;
    }

    fn write_m_direct(
        &mut self,
        number: u32,
        place: DirectAccess,
        value: Operand,
    ) -> Result<(), BrokenInvariant> {
        let at = match place {
            DirectAccess::Word(offset, address, field) => {
                let at = self.word_address(offset, address);
                self.single_bits.add(&self.builder, field);
                let b = self.builder.func();
                let bits = value.bits(b)?;
                field::write_field(b, at, field, bits);
                return Ok(());
            }
            DirectAccess::Star => {
                let at = Address::fixed(self.regions.mdef, DEFINITION_SIZE * number);
                let b = self.builder.func();
                let bits = value.bits(b)?;
                let bits = b.binary_imm(BinaryOp::And, bits, 0x1F_FFFF);
                b.store(at, bits);
                return Ok(());
            }
            DirectAccess::P(number) => self.variable_address(self.regions.p, number),
            DirectAccess::Q(number) => self.variable_address(self.regions.q, number),
        };
        value.store(self.builder.func(), at);
        Ok(())
    }

    fn write_indirect(
        &mut self,
        kind: Kind,
        index: Operand,
        value: Operand,
    ) -> Result<(), BrokenInvariant> {
        let index = self.variable_number(index)?;
        let function = match kind {
            Kind::P | Kind::Q => {
                let at = match kind {
                    Kind::P => self.computed_address(self.regions.p, index),
                    _ => {
                        let index = self.q_number(index);
                        self.computed_address(self.regions.q, index)
                    }
                };
                value.store(self.builder.func(), at);
                return Ok(());
            }
            Kind::I => HostFn::PmacIWrite,
            Kind::M => {
                self.may_change_definitions = true;
                HostFn::PmacMWrite
            }
            Kind::L => return Err(computed_number_of_l()),
        };
        let b = self.builder.func();
        let value = value.stored(b);
        b.host_call(function, &[index, value]);
        Ok(())
    }

    /// An L-variable's word and field.
    pub(crate) fn l_field(&self, number: u32) -> Result<(Space, u32, Field), BrokenInvariant> {
        match self.download.l_defs.get(&(number as u16)) {
            Some(Definition::X { address, field }) => Ok((Space::X, *address, *field)),
            Some(Definition::Y { address, field }) => Ok((Space::Y, *address, *field)),
            other => Err(BrokenInvariant::new(format!("L{number} is defined as {other:?}"))),
        }
    }

    pub(crate) fn l_format(&self, number: u32) -> Result<Format, BrokenInvariant> {
        self.l_field(number).map(|(_, _, field)| field.format)
    }

    /// An L-variable's value, an `i32`.
    pub(crate) fn read_l(&mut self, number: u32) -> Result<Value, BrokenInvariant> {
        let (space, address, field) = self.l_field(number)?;
        Ok(match self.layout.place(space, address) {
            Place::Word(offset) => {
                let at = self.word_address(offset - self.layout.words, address);
                self.single_bits.add(&self.builder, field);
                field::read_field(self.builder.func(), at, field)
            }
            _ => {
                let word = self.sparse_word(space, address)?;
                field::field_of(self.builder.func(), word, field)
            }
        })
    }

    /// Reads a word of sparse memory through the host, as an `i32`.
    fn sparse_word(&mut self, space: Space, address: u32) -> Result<Value, BrokenInvariant> {
        let b = self.builder.func();
        let space = b.constant(Type::I32, i64::from(space == Space::Y));
        let address = b.constant(Type::I32, i64::from(address));
        emit::host_value(b, HostFn::PmacWordRead, &[space, address])
    }

    /// Writes the low bits of an `i32` to an L-variable.
    pub(crate) fn write_l(&mut self, number: u32, bits: Value) -> Result<(), BrokenInvariant> {
        let (space, address, field) = self.l_field(number)?;
        if let Place::Word(offset) = self.layout.place(space, address) {
            let at = self.word_address(offset - self.layout.words, address);
            self.single_bits.add(&self.builder, field);
            field::write_field(self.builder.func(), at, field, bits);
            return Ok(());
        }
        let old = self.sparse_word(space, address)?;
        let b = self.builder.func();
        let word = field::insert_field(b, old, field, bits);
        self.write_sparse_word(space, address, word);
        Ok(())
    }

    /// Writes a word through the host, which may change a definition.
    pub(crate) fn write_sparse_word(&mut self, space: Space, address: u32, word: Value) {
        let b = self.builder.func();
        let space = b.constant(Type::I32, i64::from(space == Space::Y));
        let address = b.constant(Type::I32, i64::from(address));
        b.host_call(HostFn::PmacWordWrite, &[space, address, word]);
        self.may_change_definitions = true;
    }

    /// A value in binary coded decimal, an `i32`; complemented if that is the L-variable's format.
    pub(crate) fn encode_bcd(
        &mut self,
        number: u32,
        value: Operand,
    ) -> Result<Value, BrokenInvariant> {
        let complemented = self.l_format(number)? == Format::C;
        let b = self.builder.func();
        let value = value.float(b);
        let bits = emit::host_value(b, HostFn::PmacBcd, &[value])?;
        Ok(if complemented { b.binary_imm(BinaryOp::Xor, bits, -1) } else { bits })
    }

    /// Whether statements name an M-variable whose definition is assumed.
    pub(crate) fn assumes_definitions(&self, code: &[crate::pmac::ast::Stmt]) -> bool {
        let mut any = false;
        for_each_named_m(self.download, code, &mut |number| {
            any |= self.places_of_m.get(usize::from(number)).is_some_and(Option::is_some);
        });
        any
    }

    /// I15 as an `i32`: 1 if angles are in radians, 0 if they are in degrees.
    pub(crate) fn radians(&mut self) -> Value {
        let at = self.variable_address(self.regions.i, 15);
        let b = self.builder.func();
        let value = b.load(Type::F64, at);
        let zero = b.fconst(0.0);
        let truth = b.fcmp(plcc_ir::FloatCond::Ne, value, zero);
        b.zextend_or_trunc(Type::I32, truth)
    }

    /// Whether all definitions are the assumed ones, an `i1`.
    pub(crate) fn definitions_are_as_assumed(&mut self) -> Value {
        let at = Address::fixed(self.regions.exec, exec::INVALID_ASSUMPTIONS);
        let b = self.builder.func();
        let invalid = b.load(Type::I32, at);
        b.icmp_imm(IntCond::Eq, invalid, 0)
    }

    /// An integer as a double.
    pub(crate) fn int_to_double(&mut self, value: Value) -> Operand {
        let b = self.builder.func();
        Operand::integer(b, value)
    }
}
