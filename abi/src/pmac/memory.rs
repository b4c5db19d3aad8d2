//! General access to a PMAC's memory: any variable through any definition.
//!
//! All of it is one memory of 24-bit words (rulings, Values). P and Q are kept as doubles in the
//! image, and the definitions of the M-variables as codes; they are converted to and from words only
//! where a program accesses them as words.

use super::arithmetic::finite;
use super::assumption::Definitions;
use super::definition::{Definition, Field};
use super::fixed;
use super::layout::{Layout, Place, Space};
use super::sparse_memory::SparseMemory;
use crate::image::{read_f64, read_u8, read_u32, read_u64, write_f64, write_u32};

/// A PMAC's memory, for reading.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// The process image.
    pub image: &'a [u8],
    /// Its layout.
    pub layout: &'a Layout,
    /// The words that are not in the image.
    pub sparse: &'a SparseMemory,
}

impl View<'_> {
    /// Reads a word.
    pub fn read_word(&self, space: Space, address: u32) -> u32 {
        let address = address & self.layout.address_mask();
        let half = |offset| {
            let (x, y) = self.halves(offset);
            if space == Space::X { x } else { y }
        };
        match self.layout.place(space, address) {
            Place::Word(offset) => read_u32(self.image, offset) & 0xFF_FFFF,
            Place::P(number) => half(self.layout.p_offset(number)),
            Place::Q(number) => half(self.layout.q_offset(number)),
            Place::I(number) => {
                let value = read_f64(self.image, self.layout.i_offset(number));
                fixed::bits(value) as u32 & 0xFF_FFFF
            }
            Place::Definition(number) => {
                let code = read_u32(self.image, self.layout.definition_offset(number));
                code & self.layout.address_mask()
            }
            Place::Sparse => {
                let (x, y) = self.sparse.get(address);
                if space == Space::X { x } else { y }
            }
        }
    }

    /// The words of a P or Q.
    fn halves(&self, offset: u32) -> (u32, u32) {
        let value = read_f64(self.image, offset);
        self.sparse.halves(offset, value).unwrap_or_else(|| fixed::to_float48(value))
    }

    /// Reads a field of a word.
    pub fn read_field(&self, space: Space, address: u32, field: Field) -> i32 {
        fixed::read_field(self.read_word(space, address), field)
    }

    fn pair(&self, address: u32) -> (u32, u32) {
        (self.read_word(Space::X, address), self.read_word(Space::Y, address))
    }

    /// Where the double is that an `L:` address means, if it is a P or a Q.
    fn double(&self, address: u32) -> Option<u32> {
        match self.layout.place(Space::X, address) {
            Place::P(number) => Some(self.layout.p_offset(number)),
            Place::Q(number) => Some(self.layout.q_offset(number)),
            _ => None,
        }
    }

    /// The definition of an M-variable as it is now.
    pub fn definition(&self, number: u32) -> Definition {
        let number = number & (self.layout.count - 1);
        Definition::decode(read_u64(self.image, self.layout.definition_offset(number)))
    }

    /// Whether an M-variable's definition differs from its reference: what code assumes, or, where
    /// code assumes nothing, what it was after load. The number wraps.
    pub fn differs_from_reference(&self, number: u32) -> bool {
        read_u8(self.image, self.layout.differing_definitions + (number & (self.layout.count - 1)))
            != 0
    }

    /// Reads an M-variable; the number wraps.
    pub fn read_m(&self, number: u32) -> f64 {
        let number = number & (self.layout.count - 1);
        match self.definition(number) {
            Definition::Star => {
                let value = read_u32(self.image, self.layout.definition_offset(number));
                fixed::sign_extend(u64::from(value), 21) as f64
            }
            Definition::Tw { .. } => {
                finite(read_f64(self.image, self.layout.thumbwheel_offset(number)))
            }
            definition => self.read(definition),
        }
    }

    /// Reads through a definition; `*` and multiplexed ones, which belong to a number, give 0.
    pub fn read(&self, definition: Definition) -> f64 {
        match definition {
            Definition::Star | Definition::Tw { .. } => 0.0,
            Definition::X { address, field } => {
                f64::from(self.read_field(Space::X, address, field))
            }
            Definition::Y { address, field } => {
                f64::from(self.read_field(Space::Y, address, field))
            }
            Definition::D { address } => {
                let (x, y) = self.pair(address);
                fixed::sign_extend(u64::from(x) << 24 | u64::from(y), 48) as f64
            }
            Definition::Dp { address } => f64::from(self.dual_port(address) as i32),
            Definition::L { address } => match self.double(address) {
                Some(offset) => finite(read_f64(self.image, offset)),
                None => {
                    let (x, y) = self.pair(address);
                    fixed::from_float48(x, y)
                }
            },
            Definition::F { address } => fixed::from_single(self.dual_port(address)),
        }
    }

    /// The low 16 bits of X over those of Y.
    fn dual_port(&self, address: u32) -> u32 {
        let (x, y) = self.pair(address);
        (x & 0xFFFF) << 16 | y & 0xFFFF
    }
}

/// A PMAC's memory, for reading and writing.
pub struct Memory<'a> {
    /// The process image.
    pub image: &'a mut [u8],
    /// Its layout.
    pub layout: &'a Layout,
    /// The words that are not in the image.
    pub sparse: &'a mut SparseMemory,
}

impl Memory<'_> {
    /// The same memory, for reading only.
    pub fn view(&self) -> View<'_> {
        View { image: self.image, layout: self.layout, sparse: self.sparse }
    }

    /// Reads a word.
    pub fn read_word(&self, space: Space, address: u32) -> u32 {
        self.view().read_word(space, address)
    }

    /// The definition of an M-variable as it is now.
    pub fn definition(&self, number: u32) -> Definition {
        self.view().definition(number)
    }

    /// Whether an M-variable's definition differs from its reference: what code assumes, or, where
    /// code assumes nothing, what it was after load. The number wraps.
    pub fn differs_from_reference(&self, number: u32) -> bool {
        self.view().differs_from_reference(number)
    }

    /// Reads an M-variable; the number wraps.
    pub fn read_m(&self, number: u32) -> f64 {
        self.view().read_m(number)
    }

    /// Reads through a definition; `*` and multiplexed ones, which belong to a number, give 0.
    pub fn read(&self, definition: Definition) -> f64 {
        self.view().read(definition)
    }

    /// Writes a word's 24 bits.
    pub fn write_word(&mut self, space: Space, address: u32, word: u32) {
        let address = address & self.layout.address_mask();
        let word = word & 0xFF_FFFF;
        match self.layout.place(space, address) {
            Place::Word(offset) => write_u32(self.image, offset, word),
            Place::P(number) => self.write_half(self.layout.p_offset(number), space, word),
            Place::Q(number) => self.write_half(self.layout.q_offset(number), space, word),
            Place::I(number) => {
                write_f64(self.image, self.layout.i_offset(number), f64::from(word));
            }
            Place::Definition(number) => {
                let offset = self.layout.definition_offset(number);
                let mask = u64::from(self.layout.address_mask());
                let code = read_u64(self.image, offset);
                self.define_code(number, (code & !mask) | (u64::from(word) & mask));
            }
            Place::Sparse => {
                let (x, y) = self.sparse.get(address);
                let words = if space == Space::X { (word, y) } else { (x, word) };
                self.sparse.set(address, words);
            }
        }
    }

    fn write_half(&mut self, offset: u32, space: Space, word: u32) {
        let (x, y) = self.view().halves(offset);
        let (x, y) = if space == Space::X { (word, y) } else { (x, word) };
        let value = fixed::from_float48(x, y);
        write_f64(self.image, offset, value);
        self.sparse.set_halves(offset, value, (x, y));
    }

    /// Replaces a field of a word by the low bits of `bits`.
    pub fn write_field(&mut self, space: Space, address: u32, field: Field, bits: u32) {
        let word = self.read_word(space, address);
        self.write_word(space, address, fixed::insert_field(word, field, bits));
    }

    fn set_pair(&mut self, address: u32, x: u32, y: u32) {
        self.write_word(Space::X, address, x);
        self.write_word(Space::Y, address, y);
    }

    /// Defines an M-variable. `*` starts with the value 0.
    pub fn define(&mut self, number: u32, definition: Definition) {
        self.define_code(number, definition.encode());
    }

    /// Sets a definition's [code](Definition::encode), with the value of a `*`.
    pub fn define_code(&mut self, number: u32, code: u64) {
        self.definitions().set_code(number, code);
    }

    /// The definitions of its M-variables.
    pub fn definitions(&mut self) -> Definitions<'_> {
        Definitions::new(self.image, self.layout)
    }

    /// Writes an M-variable; the number wraps.
    pub fn write_m(&mut self, number: u32, value: f64) {
        let number = number & (self.layout.count - 1);
        match self.definition(number) {
            Definition::Star => {
                let value = fixed::bits(value) as u32 & 0x1F_FFFF;
                write_u32(self.image, self.layout.definition_offset(number), value);
            }
            Definition::Tw { .. } => {
                write_f64(self.image, self.layout.thumbwheel_offset(number), finite(value));
            }
            definition => self.write(definition, value),
        }
    }

    /// Writes through a definition; `*` and multiplexed ones, which belong to a number, take
    /// nothing.
    pub fn write(&mut self, definition: Definition, value: f64) {
        match definition {
            Definition::Star | Definition::Tw { .. } => {}
            Definition::X { address, field } => {
                self.write_field(Space::X, address, field, fixed::field_bits(value, field.format));
            }
            Definition::Y { address, field } => {
                self.write_field(Space::Y, address, field, fixed::field_bits(value, field.format));
            }
            Definition::D { address } => {
                let bits = fixed::bits(value);
                self.set_pair(address, (bits >> 24) as u32, bits as u32);
            }
            Definition::Dp { address } => {
                self.set_dual_port(address, fixed::bits(value) as u32);
            }
            Definition::L { address } => match self.view().double(address) {
                Some(offset) => write_f64(self.image, offset, finite(value)),
                None => {
                    let (x, y) = fixed::to_float48(value);
                    self.set_pair(address, x, y);
                }
            },
            Definition::F { address } => self.set_dual_port(address, fixed::to_single(value)),
        }
    }

    fn set_dual_port(&mut self, address: u32, bits: u32) {
        let (x, y) = self.view().pair(address);
        self.set_pair(address, x & 0xFF_0000 | bits >> 16, y & 0xFF_0000 | bits & 0xFFFF);
    }
}

#[cfg(test)]
mod tests {
    use alloc::{vec, vec::Vec};

    use super::super::{Controller, definition::Format};
    use super::*;

    struct Machine {
        layout: Layout,
        image: Vec<u8>,
        sparse: SparseMemory,
    }

    impl Machine {
        fn new(controller: Controller) -> Self {
            let layout = Layout::new(controller);
            Self { layout, image: vec![0; layout.size as usize], sparse: SparseMemory::default() }
        }

        fn memory(&mut self) -> Memory<'_> {
            Memory { image: &mut self.image, layout: &self.layout, sparse: &mut self.sparse }
        }
    }

    fn field(offset: u8, width: u8, format: Format) -> Field {
        Field { offset, width, format }
    }

    const L_P1: Definition = Definition::L { address: 0x1001 };

    #[test]
    fn an_undefined_variable_holds_21_bits() {
        let mut machine = Machine::new(Controller::Pmac);
        let mut memory = machine.memory();
        memory.write_m(5, -3.4);
        assert_eq!(memory.read_m(5), -3.0);
        memory.write_m(5, 1_048_576.0);
        assert_eq!(memory.read_m(5), -1_048_576.0);
        memory.write_m(5, 1_048_575.0);
        assert_eq!(memory.read_m(5), 1_048_575.0);
        // The word of the definition shows the value's low 16 bits.
        assert_eq!(memory.read_word(Space::Y, 0xBC05), 0xFFFF);
        memory.write_word(Space::Y, 0xBC05, 0xFF_0001);
        assert_eq!(memory.read_m(5), 983_041.0);
        assert!(!memory.differs_from_reference(5));
    }

    #[test]
    fn the_guides_array_moves_a_definition() {
        let mut machine = Machine::new(Controller::Pmac);
        let mut memory = machine.memory();
        memory.define(34, L_P1);
        memory.define(35, Definition::Y { address: 0xBC22, field: field(0, 16, Format::U) });
        memory.definitions().set_reference();
        assert!(!memory.differs_from_reference(34));
        for k in 0..10 {
            memory.write_m(34, 31.0 + f64::from(k));
            let next = memory.read_m(35) + 1.0;
            memory.write_m(35, next);
        }
        assert!(memory.differs_from_reference(34));
        assert!(!memory.differs_from_reference(35));
        memory.write_m(35, f64::from(0x1001));
        assert!(!memory.differs_from_reference(34));
        let p: Vec<f64> = (0..12).map(|n| read_f64(&machine.image, 8 * n)).collect();
        assert_eq!(p, [0., 31., 32., 33., 34., 35., 36., 37., 38., 39., 40., 0.]);
    }

    #[test]
    fn a_definitions_high_bits_read_zero_and_stay() {
        let mut machine = Machine::new(Controller::Pmac);
        let mut memory = machine.memory();
        let definition = Definition::X { address: 0xC003, field: field(0, 24, Format::S) };
        memory.define(3, definition);
        assert_eq!(memory.read_word(Space::Y, 0xBC03), 0xC003);
        memory.write_word(Space::Y, 0xBC03, 0xFF_1234);
        assert_eq!(memory.read_word(Space::Y, 0xBC03), 0x1234);
        assert_eq!(
            memory.definition(3),
            Definition::X { address: 0x1234, field: field(0, 24, Format::S) }
        );
        let mut turbo = Machine::new(Controller::Turbo);
        let mut memory = turbo.memory();
        memory.define(3, definition);
        memory.write_word(Space::Y, 0x4003, 0x12_3456);
        assert_eq!(memory.read_word(Space::Y, 0x4003), 0x12_3456);
    }

    #[test]
    fn the_words_of_a_p_variable_can_be_read_and_written() {
        let mut machine = Machine::new(Controller::Pmac);
        let mut memory = machine.memory();
        memory.write(L_P1, 10.0);
        assert_eq!(memory.read_word(Space::X, 0x1001), 0x50_0000);
        assert_eq!(memory.read_word(Space::Y, 0x1001), 0x804);
        memory.write_word(Space::Y, 0x1001, 0x805);
        assert_eq!(memory.read(L_P1), 20.0);
        memory.write_word(Space::X, 0x1001, 0xC0_0000);
        assert_eq!(memory.read(L_P1), -16.0);
        // 48 bits as an integer, and back.
        let whole = Definition::D { address: 0x1001 };
        let value = memory.read(whole);
        memory.write(whole, value);
        assert_eq!(memory.read(L_P1), -16.0);
        // What is never looked at as words keeps all its digits.
        memory.write(L_P1, 0.1);
        assert_eq!(memory.read(L_P1), 0.1);
    }

    #[test]
    fn a_definition_can_name_a_bit_of_an_i_variable() {
        let mut machine = Machine::new(Controller::Pmac);
        let i105 = machine.layout.i_offset(105);
        write_f64(&mut machine.image, i105, f64::from(0x1_073F));
        let mut memory = machine.memory();
        let bit = Definition::X { address: 0x2A, field: field(16, 1, Format::U) };
        assert_eq!(memory.read(bit), 1.0);
        memory.write(bit, 0.0);
        assert_eq!(read_f64(&machine.image, i105), f64::from(0x73F));
    }

    #[test]
    fn double_words_have_x_high() {
        let mut machine = Machine::new(Controller::Pmac);
        let mut memory = machine.memory();
        let long = Definition::D { address: 0x28 };
        memory.write(long, -1.0);
        assert_eq!(memory.read_word(Space::X, 0x28), 0xFF_FFFF);
        memory.write(long, 16_777_216.0 * 3.0 + 5.0);
        assert_eq!(memory.read_word(Space::X, 0x28), 3);
        assert_eq!(memory.read_word(Space::Y, 0x28), 5);
        assert_eq!(memory.read(long), 50_331_653.0);
        memory.write(long, 1e300);
        assert_eq!(memory.read(long), 0.0);
        let port = Definition::Dp { address: 0xD201 };
        memory.write(port, -2.0);
        assert_eq!(memory.read_word(Space::X, 0xD201), 0xFFFF);
        assert_eq!(memory.read_word(Space::Y, 0xD201), 0xFFFE);
        assert_eq!(memory.read(port), -2.0);
        let float = Definition::F { address: 0xD7FF };
        memory.write(float, 0.1);
        assert_eq!(memory.read(float), f64::from(0.1_f32));
        assert_eq!(memory.read_word(Space::X, 0xD7FF), 0x3DCC);
        let sparse = Definition::L { address: 0x822 };
        memory.write(sparse, -1.0);
        assert_eq!(memory.read_word(Space::X, 0x822), 0xC0_0000);
        assert_eq!(memory.read(sparse), -1.0);
    }

    #[test]
    fn thumbwheels_keep_what_was_written() {
        let mut machine = Machine::new(Controller::Pmac);
        let mut memory = machine.memory();
        memory.define(100, Definition::Tw { address: 4 });
        memory.write_m(100, 12.345);
        assert_eq!(memory.read_m(100), 12.345);
        assert_eq!(memory.read_m(101), 0.0);
    }

    #[test]
    fn every_address_of_a_turbo_pmac_holds_two_words() {
        let mut machine = Machine::new(Controller::Turbo);
        let mut memory = machine.memory();
        for address in [0_u32, 0xBC00, 0x5_0000, 0x6_0000, 0x7_8C00, 0xFF_FFFF] {
            let x = Definition::X { address, field: Field::WORD };
            let y = Definition::Y { address, field: Field::WORD };
            memory.write(x, 5.0);
            memory.write(y, 6.0);
            assert_eq!((memory.read(x), memory.read(y)), (5.0, 6.0));
        }
        assert_eq!(machine.sparse.words().count(), 2);
        machine.memory().write_word(Space::X, 0x5_0000, 0);
        machine.memory().write_word(Space::Y, 0x5_0000, 0);
        assert_eq!(machine.sparse.words().collect::<Vec<_>>(), [(0xFF_FFFF, 5, 6)]);
        let bytes = postcard::to_allocvec(&machine.sparse).unwrap();
        assert_eq!(postcard::from_bytes::<SparseMemory>(&bytes).as_ref(), Ok(&machine.sparse));
        assert_ne!(machine.sparse, SparseMemory::default());
    }
}
