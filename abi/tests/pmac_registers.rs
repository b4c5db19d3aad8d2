//! PMAC's registers at their edges: whatever is written, what reads back is finite, never -0, and
//! the same when it is written again.

use plcc_abi::pmac::{
    Controller, Definition, Field, Format, Layout, Memory, Space, SparseMemory,
    arithmetic::{finite, round},
    fixed::{bits, from_float48, read_field, to_float48},
};
use plcc_random::Rng;

/// Values where formats turn over, and what no variable may hold.
fn edges() -> Vec<f64> {
    let mut values = vec![f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -0.0, 5e-324, -5e-324];
    values.extend([f64::MAX, f64::MIN, f64::MIN_POSITIVE, 1e300, -1e300, 0.1, -0.1]);
    for power in 0..64 {
        let whole = 2_f64.powi(power);
        for offset in [-1.0, -0.5, 0.0, 0.5, 1.0] {
            values.extend([whole + offset, -whole + offset]);
        }
    }
    // The same numbers in every run, of all magnitudes.
    let mut rng = Rng::new(1);
    for _ in 0..200 {
        values.push(f64::from_bits(rng.bits()));
        values.push((rng.bits() >> 20) as f64 - 8e12);
    }
    values
}

fn definitions() -> Vec<Definition> {
    let address = 0x10;
    let mut all = vec![
        Definition::Star,
        Definition::D { address },
        Definition::Dp { address },
        Definition::L { address },
        Definition::F { address },
        Definition::Tw { address: 4 },
        Definition::L { address: 0x1003 },
        Definition::L { address: 0x1403 },
        Definition::X { address: 0x2A, field: Field::WORD },
        Definition::Y {
            address: 0x1001,
            field: Field { offset: 12, width: 12, format: Format::D },
        },
        Definition::X { address: 0x1001, field: Field::WORD },
    ];
    for format in [Format::U, Format::S, Format::D, Format::C] {
        for width in 1..=24 {
            for offset in [0, (24 - width) / 2, 24 - width] {
                let field = Field { offset, width, format };
                all.push(Definition::X { address, field });
                all.push(Definition::Y { address, field });
            }
        }
    }
    all
}

fn is_clean(value: f64) -> bool {
    value.is_finite() && (value != 0.0 || value.is_sign_positive())
}

/// An image of a PMAC (1) with M1 defined so.
struct Machine {
    layout: Layout,
    image: Vec<u8>,
    sparse: SparseMemory,
}

impl Machine {
    fn new(definition: Definition) -> Self {
        let layout = Layout::new(Controller::Pmac);
        let mut machine =
            Self { layout, image: vec![0; layout.size as usize], sparse: SparseMemory::default() };
        machine.memory().define(1, definition);
        machine
    }

    fn memory(&mut self) -> Memory<'_> {
        Memory { image: &mut self.image, layout: &self.layout, sparse: &mut self.sparse }
    }
}

#[test]
fn a_value_read_back_is_finite_and_writes_back_unchanged() {
    let values = edges();
    for definition in definitions() {
        let mut machine = Machine::new(definition);
        let mut memory = machine.memory();
        // BCD of a width that is not a multiple of four need not come back, nor words of a P: its
        // mantissa is normalised.
        let decimal = |field: Field| matches!(field.format, Format::D | Format::C);
        let exact = !matches!(definition,
            Definition::X { field, .. } | Definition::Y { field, .. }
                if definition.address() == 0x1001
                    || (decimal(field) && !field.width.is_multiple_of(4)));
        for &value in &values {
            memory.write_m(1, value);
            let read = memory.read_m(1);
            assert!(is_clean(read), "{definition:?} {value:e} reads {read:e}");
            if exact {
                memory.write_m(1, read);
                assert_eq!(memory.read_m(1).to_bits(), read.to_bits(), "{definition:?} {value:e}");
            }
        }
    }
}

#[test]
fn fields_are_the_rounded_value_modulo_their_width() {
    for value in edges() {
        let low = bits(value);
        for width in 1..=24_u8 {
            let field = Field { offset: 24 - width, width, format: Format::U };
            let mut machine = Machine::new(Definition::X { address: 0x10, field });
            machine.memory().write_m(1, value);
            let expected = low & ((1 << width) - 1);
            assert_eq!(machine.memory().read_m(1), expected as f64, "{value:e} in {width} bits");
        }
        // The low bits are those of the exact integer.
        let whole = round(finite(value));
        let rest = libm::fmod(whole, 16_777_216.0);
        let expected = if rest < 0.0 { rest + 16_777_216.0 } else { rest };
        assert_eq!((low & 0xFF_FFFF) as f64, expected, "{value:e}");
    }
}

#[test]
fn every_pair_of_words_converts_to_a_number_and_back() {
    let mut rng = Rng::new(2);
    for _ in 0..20_000 {
        let words = rng.bits();
        let (x, y) = ((words >> 40) as u32, (words >> 16) as u32 & 0xFF_FFFF);
        let value = from_float48(x, y);
        assert!(is_clean(value), "{x:06X} {y:06X}");
        let (x2, y2) = to_float48(value);
        assert_eq!(from_float48(x2, y2), value, "{x:06X} {y:06X}");
    }
    for (space, word) in [(Space::X, 0xFF_FFFF), (Space::Y, 0xFFF), (Space::X, 0x80_0000)] {
        let mut machine = Machine::new(Definition::L { address: 0x1003 });
        machine.memory().write_word(space, 0x1003, word);
        assert!(is_clean(machine.memory().read_m(1)), "{space:?} {word:X}");
    }
}

#[test]
fn every_64_bit_code_can_be_used_as_a_definition() {
    let mut machine = Machine::new(Definition::Star);
    let mut memory = machine.memory();
    for kind in 0..=255_u64 {
        for field in [0, 0xFFFF_FF00_u64, 0x0118_1700, 0x02FF_1700] {
            let code = kind << 32 | field << 32 | 0xFFFF_FFFF;
            memory.define_code(1, code);
            memory.write_m(1, 1e300);
            assert!(is_clean(memory.read_m(1)), "{code:016X}");
        }
    }
    assert_eq!(read_field(0xFF_FFFF, Field::WORD), 0xFF_FFFF);
}
