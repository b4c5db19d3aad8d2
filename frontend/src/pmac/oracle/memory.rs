//! How variables reach memory, as the statement interpreter finds them.
//!
//! Written from the guide (Memory Map, M-Variables) and the rulings. P, Q and I are doubles in the
//! image; which Q is meant depends on the coordinate system that the task addresses. An
//! M-variable's definition is looked at whenever the variable is read or written, since programs
//! move definitions. It leads to words of 24 bits. A word that is part of something else (half of
//! a P or Q, an I-variable, a definition) or lies outside the image belongs to the executive, and
//! is read and written through the host.

use plcc_abi::image::{read_f64, read_u32, read_u64, write_f64, write_u32};
use plcc_abi::pmac::{
    Controller, Definition, Field, Format, Kind, Layout, Place, PmacName, Range, Space, Variable,
    arithmetic, fixed,
};
use plcc_abi::{HostFn, Scan};

use super::resolved::{Bits, LVariable};
use crate::common::{Accessed, Observer, Value};
use crate::pmac::access;

/// What the guide says of a controller's memory.
#[derive(Clone, Copy, Debug)]
pub(super) struct MemoryMap {
    /// How many variables of each kind there are.
    count: u32,
    /// The largest address.
    last: u32,
    /// The address of P0.
    p: u32,
    /// The address of Q0 of coordinate system 1.
    q: u32,
    /// The address of the definition of M0, in Y.
    definitions: u32,
    /// How many coordinate systems there are.
    systems: u32,
}

impl MemoryMap {
    /// The map of PMAC, or of Turbo PMAC.
    pub(super) const fn new(controller: Controller) -> Self {
        match controller {
            Controller::Pmac => Self {
                count: 1024,
                last: 0xFFFF,
                p: 0x1000,
                q: 0x1400,
                definitions: 0xBC00,
                systems: 8,
            },
            Controller::Turbo => Self {
                count: 8192,
                last: 0xFF_FFFF,
                p: 0x6000,
                q: 0x8000,
                definitions: 0x4000,
                systems: 16,
            },
        }
    }

    /// A variable's number; numbers that are too large wrap around.
    fn number(&self, number: u32) -> u32 {
        number % self.count
    }

    /// The number of a variable from the value of an expression: rounded, then wrapped around.
    pub(super) fn computed_number(&self, value: f64) -> u32 {
        self.number(fixed::bits(value) as u32)
    }

    /// The number that Q0 of a coordinate system has among all Q-variables; `None` if the
    /// controller has no such system.
    pub(super) fn first_q(&self, system: u64) -> Option<u32> {
        let before = u32::try_from(system.checked_sub(1)?).ok()?;
        (before < self.systems).then(|| before * (self.count / self.systems))
    }

    /// The variable whose double an `L:` address means.
    fn variable_at(&self, address: u32) -> Option<(Kind, u32)> {
        [(Kind::P, self.p), (Kind::Q, self.q)].into_iter().find_map(|(kind, start)| {
            let number = address.checked_sub(start)?;
            (number < self.count).then_some((kind, number))
        })
    }

    /// The offset in the image of a word; `None` if the word lies outside of the image or is part
    /// of a P, a Q, an I-variable or a definition.
    pub(super) fn plain_word(&self, layout: &Layout, space: Space, address: u32) -> Option<u32> {
        let address = address & self.last;
        let is_definition = space == Space::Y
            && address.checked_sub(self.definitions).is_some_and(|number| number < self.count);
        if is_definition || self.variable_at(address).is_some() {
            return None;
        }
        match layout.place(space, address) {
            Place::Word(offset) => Some(offset),
            _ => None,
        }
    }
}

/// The low `width` bits of a value, sign-extended.
fn signed(value: u64, width: u32) -> f64 {
    ((value << (64 - width)) as i64 >> (64 - width)) as f64
}

/// The variables and memory words as a task reads and writes them.
pub(super) struct Memory<'a, 'b, O> {
    pub(super) layout: &'a Layout,
    pub(super) map: &'a MemoryMap,
    /// L-variables.
    pub(super) l_variables: &'a [LVariable],
    /// The ranges of I-variables, by rising number.
    pub(super) ranges: &'a [(u32, Range)],
    /// The definitions of M-variables after load, encoded, by number.
    pub(super) definitions: &'a [u64],
    /// The offset in the image of the task's context, which has its addressed coordinate system.
    pub(super) context: u32,
    pub(super) scan: &'a mut Scan<'b>,
    /// The observer that is told of the variables that are read and written.
    pub(super) observer: O,
}

impl<O: Observer> Memory<'_, '_, O> {
    /// Calls a function of the executive.
    pub(super) fn host(&mut self, function: HostFn, args: [u64; 4]) -> u64 {
        self.scan.host.call(self.scan.image, function, args)
    }

    fn p_offset(&self, number: u32) -> u32 {
        self.layout.p + 8 * self.map.number(number)
    }

    /// The offset of a Q-variable, whose number counts from Q0 of coordinate system 1.
    fn q_offset(&self, number: u32) -> u32 {
        self.layout.q + 8 * self.map.number(number)
    }

    fn i_offset(&self, number: u32) -> u32 {
        self.layout.i + 8 * self.map.number(number)
    }

    /// The offset in the image at which the number of the addressed coordinate system's Q0 is kept.
    fn q_base_offset(&self) -> u32 {
        self.layout.q_base_at(self.context)
    }

    /// ADDRESS: chooses the coordinate system whose Q-variables this task means from now on. A number that no
    /// coordinate system has changes nothing.
    pub(super) fn address(&mut self, system: u64) {
        if let Some(first) = self.map.first_q(system) {
            write_u32(self.scan.image, self.q_base_offset(), first);
        }
    }

    /// ADDRESS of a motor, for commands.
    pub(super) fn address_motor(&mut self, motor: f64) {
        let context = (self.q_base_offset() - self.layout.q_base_at(0)) / 4;
        let motor = arithmetic::finite(motor).to_bits();
        self.host(HostFn::PmacAddressMotor, [u64::from(context), motor, 0, 0]);
    }

    /// The offset of a Q-variable of the addressed coordinate system.
    fn system_q_offset(&self, number: u32) -> u32 {
        let first = read_u32(self.scan.image, self.q_base_offset());
        self.q_offset(first.wrapping_add(number))
    }

    /// The double at an offset of the image.
    #[inline(always)]
    pub(super) fn double(&mut self, offset: u32) -> f64 {
        let value = read_f64(self.scan.image, offset);
        if self.observer.is_active() {
            let (kind, number) = self.variable_of(offset);
            return self.seen(kind, number, value);
        }
        value
    }

    /// Puts a value into the P- or I-variable whose double is at an offset of the image.
    #[inline(always)]
    pub(super) fn write_double(&mut self, offset: u32, value: f64) {
        write_f64(self.scan.image, offset, value);
        if self.observer.is_active() {
            let (kind, number) = self.variable_of(offset);
            self.observe(O::write, kind, number, value);
        }
    }

    /// The P- or I-variable whose double is at an offset of the image.
    fn variable_of(&self, offset: u32) -> (Kind, u32) {
        let number = |start: u32| offset.checked_sub(start).map(|distance| distance / 8);
        match number(self.layout.p).filter(|number| *number < self.map.count) {
            Some(number) => (Kind::P, number),
            None => (Kind::I, number(self.layout.i).unwrap_or(0)),
        }
    }

    /// Tells the observer of a variable that is read or written.
    fn observe(&mut self, tell: fn(&mut O, Accessed, Value), kind: Kind, number: u32, value: f64) {
        let variable = self.accessed(kind, number);
        tell(&mut self.observer, variable, Value::Real(value));
    }

    /// Tells the observer of a variable that is read, and gives the value with which the statement goes on.
    fn seen(&mut self, kind: Kind, number: u32, value: f64) -> f64 {
        let variable = self.accessed(kind, number);
        self.observer.read(variable, Value::Real(value));
        self.observer.instead(variable, Value::Real(value)).number()
    }

    fn accessed(&self, kind: Kind, number: u32) -> Accessed {
        let system = match kind {
            Kind::Q => {
                let first = read_u32(self.scan.image, self.q_base_offset());
                first / (self.map.count / self.map.systems) + 1
            }
            _ => 1,
        };
        let number = self.map.number(number);
        access::accessed(PmacName::Variable(Variable { kind, number, system }))
    }

    /// Whether angles are in radians: I15 is not 0.
    pub(super) fn radians(&self) -> bool {
        read_f64(self.scan.image, self.i_offset(15)) != 0.0
    }

    /// A variable's value. An L-variable has none by its number; see [`Self::read_l_variable`].
    pub(super) fn read(&mut self, kind: Kind, number: u32) -> f64 {
        let value = self.value(kind, number);
        if self.observer.is_active() {
            return self.seen(kind, number, value);
        }
        value
    }

    fn value(&mut self, kind: Kind, number: u32) -> f64 {
        match kind {
            Kind::P => read_f64(self.scan.image, self.p_offset(number)),
            Kind::Q => read_f64(self.scan.image, self.system_q_offset(number)),
            Kind::I => read_f64(self.scan.image, self.i_offset(number)),
            Kind::M => self.read_m(number),
            Kind::L => 0.0,
        }
    }

    /// Puts a value into a variable.
    pub(super) fn write(&mut self, kind: Kind, number: u32, value: f64) {
        self.store(kind, number, value);
        if self.observer.is_active() {
            let value = self.value(kind, number);
            self.observe(O::write, kind, number, value);
        }
    }

    fn store(&mut self, kind: Kind, number: u32, value: f64) {
        let value = arithmetic::finite(value);
        let offset = match kind {
            Kind::P => self.p_offset(number),
            Kind::Q => self.system_q_offset(number),
            Kind::I => return self.write_i(number, value),
            Kind::M => return self.write_m(number, value),
            Kind::L => return,
        };
        write_f64(self.scan.image, offset, value);
    }

    /// Puts a value into an I-variable, converted to the variable's range if it has one.
    fn write_i(&mut self, number: u32, value: f64) {
        let number = self.map.number(number);
        let range = self.ranges.binary_search_by_key(&number, |(of, _)| *of).ok();
        let range = range.and_then(|index| self.ranges.get(index));
        let value = range.map_or(value, |(_, range)| range.convert(value));
        write_f64(self.scan.image, self.i_offset(number), value);
    }

    fn word(&mut self, space: Space, address: u32) -> u32 {
        match self.map.plain_word(self.layout, space, address) {
            Some(offset) => read_u32(self.scan.image, offset) & 0xFF_FFFF,
            None => {
                let space = u64::from(space == Space::Y);
                self.host(HostFn::PmacWordRead, [space, address.into(), 0, 0]) as u32 & 0xFF_FFFF
            }
        }
    }

    /// Puts 24 bits into a word.
    pub(super) fn write_word(&mut self, space: Space, address: u32, word: u32) {
        let word = word & 0xFF_FFFF;
        match self.map.plain_word(self.layout, space, address) {
            Some(offset) => write_u32(self.scan.image, offset, word),
            None => {
                let space = u64::from(space == Space::Y);
                self.host(HostFn::PmacWordWrite, [space, address.into(), word.into(), 0]);
            }
        }
        if self.observer.is_active() {
            let (address, field) = (address & self.map.last, Field::WORD);
            let name = PmacName::Memory(match space {
                Space::X => Definition::X { address, field },
                Space::Y => Definition::Y { address, field },
            });
            self.observer.write(access::accessed(name), Value::Integer(word.into()));
        }
    }

    /// The words X and Y at an address, of which X is the higher one.
    fn pair(&mut self, address: u32) -> (u32, u32) {
        (self.word(Space::X, address), self.word(Space::Y, address))
    }

    fn write_pair(&mut self, address: u32, x: u32, y: u32) {
        self.write_word(Space::X, address, x);
        self.write_word(Space::Y, address, y);
    }

    /// 32 bits: the low 16 bits of X are the higher half, those of Y the lower half.
    fn halves(&mut self, address: u32) -> u32 {
        let (x, y) = self.pair(address);
        (x & 0xFFFF) << 16 | y & 0xFFFF
    }

    fn write_halves(&mut self, address: u32, bits: u32) {
        let (x, y) = self.pair(address);
        self.write_pair(address, x & 0xFF_0000 | bits >> 16, y & 0xFF_0000 | bits & 0xFFFF);
    }

    /// The offset of the double of the P- or Q-variable to which an `L:` definition leads; `None` if it leads to none.
    fn double_of(&self, address: u32) -> Option<u32> {
        Some(match self.map.variable_at(address & self.map.last)? {
            (Kind::P, number) => self.p_offset(number),
            (_, number) => self.q_offset(number),
        })
    }

    /// The offset of an M-variable's definition. An undefined M-variable keeps its value there, too.
    fn definition_offset(&self, number: u32) -> u32 {
        self.layout.mdef + 8 * self.map.number(number)
    }

    /// An M-variable's definition as it is now.
    fn definition(&self, number: u32) -> Definition {
        Definition::decode(read_u64(self.scan.image, self.definition_offset(number)))
    }

    /// Whether an M-variable's definition is the one that it had when the download was loaded.
    #[inline(always)]
    pub(super) fn is_as_loaded(&self, number: u16) -> bool {
        let now = read_u64(self.scan.image, self.layout.mdef + 8 * u32::from(number));
        self.definitions.get(usize::from(number)) == Some(&now)
    }

    /// The value of an M- or L-variable that is a field of a word in the image.
    #[inline(always)]
    pub(super) fn bits(&mut self, kind: Kind, number: u16, bits: Bits) -> i32 {
        let value = bits.of(read_u32(self.scan.image, bits.offset));
        if self.observer.is_active() {
            return self.seen(kind, number.into(), value.into()) as i32;
        }
        value
    }

    /// Puts a value into an M-variable that is a field of the word at an offset of the image.
    pub(super) fn write_bits(&mut self, number: u16, offset: u32, field: Field, value: f64) {
        let integer = value as i32;
        let bits = match field.format {
            Format::U | Format::S if f64::from(integer) == value => integer as u32,
            format => fixed::field_bits(value, format),
        };
        let word = read_u32(self.scan.image, offset);
        let word = fixed::insert_field(word, field, bits);
        write_u32(self.scan.image, offset, word);
        if self.observer.is_active() {
            let value = fixed::read_field(word, field).into();
            self.observe(O::write, Kind::M, number.into(), value);
        }
    }

    fn read_m(&mut self, number: u32) -> f64 {
        match self.definition(number) {
            Definition::Star => {
                let value = read_u32(self.scan.image, self.definition_offset(number));
                signed(value.into(), 21)
            }
            Definition::Tw { .. } => {
                let offset = self.layout.thumbwheels + 8 * self.map.number(number);
                arithmetic::finite(read_f64(self.scan.image, offset))
            }
            Definition::X { address, field } => {
                f64::from(fixed::read_field(self.word(Space::X, address), field))
            }
            Definition::Y { address, field } => {
                f64::from(fixed::read_field(self.word(Space::Y, address), field))
            }
            Definition::D { address } => {
                let (x, y) = self.pair(address);
                signed(u64::from(x) << 24 | u64::from(y), 48)
            }
            Definition::Dp { address } => f64::from(self.halves(address) as i32),
            Definition::L { address } => match self.double_of(address) {
                Some(offset) => arithmetic::finite(read_f64(self.scan.image, offset)),
                None => {
                    let (x, y) = self.pair(address);
                    fixed::from_float48(x, y)
                }
            },
            Definition::F { address } => fixed::from_single(self.halves(address)),
        }
    }

    fn write_m(&mut self, number: u32, value: f64) {
        match self.definition(number) {
            Definition::Star => {
                let bits = fixed::bits(value) as u32 & 0x1F_FFFF;
                write_u32(self.scan.image, self.definition_offset(number), bits);
            }
            Definition::Tw { .. } => {
                let offset = self.layout.thumbwheels + 8 * self.map.number(number);
                write_f64(self.scan.image, offset, value);
            }
            Definition::X { address, field } => self.write_field(Space::X, address, field, value),
            Definition::Y { address, field } => self.write_field(Space::Y, address, field, value),
            Definition::D { address } => {
                let bits = fixed::bits(value);
                self.write_pair(address, (bits >> 24) as u32, bits as u32);
            }
            Definition::Dp { address } => self.write_halves(address, fixed::bits(value) as u32),
            Definition::L { address } => match self.double_of(address) {
                Some(offset) => write_f64(self.scan.image, offset, value),
                None => {
                    let (x, y) = fixed::to_float48(value);
                    self.write_pair(address, x, y);
                }
            },
            Definition::F { address } => self.write_halves(address, fixed::to_single(value)),
        }
    }

    fn write_field(&mut self, space: Space, address: u32, field: Field, value: f64) {
        let word = self.word(space, address);
        let bits = fixed::field_bits(value, field.format);
        self.write_word(space, address, fixed::insert_field(word, field, bits));
    }

    /// The value of the L-variable at an index of `l_variables`.
    pub(super) fn read_l_variable(&mut self, index: u32) -> i32 {
        let Some(variable) = self.l_variables.get(index as usize).copied() else { return 0 };
        let value = fixed::read_field(self.l_variable_word(variable), variable.field);
        if self.observer.is_active() {
            return self.seen(Kind::L, variable.number.into(), value.into()) as i32;
        }
        value
    }

    /// Puts a floating-point value into an L-variable.
    pub(super) fn write_l_variable(&mut self, index: u32, value: f64) {
        let Some(variable) = self.l_variables.get(index as usize).copied() else { return };
        self.write_l_variable_bits(variable, fixed::field_bits(value, variable.field.format));
    }

    /// Puts the result of an integer statement into an L-variable.
    pub(super) fn write_l_variable_integer(&mut self, index: u32, value: i32) {
        let Some(variable) = self.l_variables.get(index as usize).copied() else { return };
        let bits = match variable.field.format {
            Format::U | Format::S => value as u32,
            Format::D | Format::C => fixed::field_bits(f64::from(value), variable.field.format),
        };
        self.write_l_variable_bits(variable, bits);
    }

    fn l_variable_word(&mut self, variable: LVariable) -> u32 {
        match variable.offset {
            Some(offset) => read_u32(self.scan.image, offset) & 0xFF_FFFF,
            None => self.word(variable.space, variable.address),
        }
    }

    fn write_l_variable_bits(&mut self, variable: LVariable, bits: u32) {
        let word = fixed::insert_field(self.l_variable_word(variable), variable.field, bits);
        match variable.offset {
            Some(offset) => write_u32(self.scan.image, offset, word),
            None => self.write_word(variable.space, variable.address, word),
        }
        if self.observer.is_active() {
            let value = fixed::read_field(word, variable.field).into();
            self.observe(O::write, Kind::L, variable.number.into(), value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinate_systems_share_the_q_variables() {
        let pmac = MemoryMap::new(Controller::Pmac);
        assert_eq!(pmac.first_q(1), Some(0));
        assert_eq!(pmac.first_q(8), Some(0x380));
        assert_eq!([0, 9, u64::MAX].map(|system| pmac.first_q(system)), [None; 3]);
        let turbo = MemoryMap::new(Controller::Turbo);
        assert_eq!(turbo.first_q(2), Some(0x200));
        assert_eq!(turbo.first_q(16), Some(0x1E00));
        assert_eq!(turbo.first_q(17), None);
    }

    #[test]
    fn addresses_are_what_the_guide_says() {
        let (map, layout) = (MemoryMap::new(Controller::Pmac), Layout::new(Controller::Pmac));
        assert_eq!(map.variable_at(0x1000), Some((Kind::P, 0)));
        assert_eq!(map.variable_at(0x17FF), Some((Kind::Q, 1023)));
        assert_eq!(map.variable_at(0x1800), None);
        assert_eq!(map.plain_word(&layout, Space::X, 0), Some(layout.words));
        assert_eq!(map.plain_word(&layout, Space::Y, 0x1_0000), Some(layout.words + 4));
        assert!(map.plain_word(&layout, Space::X, 0xBC00).is_some());
        assert_eq!(map.plain_word(&layout, Space::Y, 0xBC00), None);
        assert_eq!(map.plain_word(&layout, Space::Y, 0x1001), None);
        assert_eq!(map.plain_word(&layout, Space::X, 0x2A), None);
        let (map, layout) = (MemoryMap::new(Controller::Turbo), Layout::new(Controller::Turbo));
        assert_eq!(map.variable_at(0x9FFF), Some((Kind::Q, 8191)));
        assert_eq!(map.plain_word(&layout, Space::Y, 0x4000), None);
        assert_eq!(map.plain_word(&layout, Space::Y, 0x5_0000), None);
        assert!(map.plain_word(&layout, Space::Y, 0x7_8000).is_some());
    }

    #[test]
    fn numbers_that_are_computed_wrap() {
        let map = MemoryMap::new(Controller::Pmac);
        assert_eq!(map.computed_number(-1.0), 1023);
        assert_eq!(map.computed_number(1024.5), 1);
        assert_eq!(map.computed_number(f64::NAN), 0);
        assert_eq!(map.computed_number(1e300), 0);
    }

    #[test]
    fn signs_are_extended() {
        assert_eq!(signed(0x10_0000, 21), -1_048_576.0);
        assert_eq!(signed(0x0F_FFFF, 21), 1_048_575.0);
        assert_eq!(signed(0x8000_0000_0000, 48), -140_737_488_355_328.0);
    }
}
