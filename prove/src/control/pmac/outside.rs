//! What comes to a PMAC from outside: the bits of words that its program reads and does not write, and the variables that it
//! only reads.

use std::collections::{BTreeMap, BTreeSet};

use plcc_abi::image::read_f64;
use plcc_abi::pmac::layout::WORD_SIZE;
use plcc_abi::pmac::{
    Definition, Field, Format, Kind, Layout, PmacName, PmacTables, Variable as Named, View,
};

use super::access::Access;
use super::keep::{double_name, valid};
use super::places::{self, BitPlace, Bits, Coded};
use crate::logic::Memory;
use crate::system::{Form, Maker, Variable};

/// What comes from outside, by its name.
#[derive(Debug, Default)]
pub(super) struct Outside {
    all: Vec<(String, Bits)>,
    /// The offsets of the doubles among it.
    doubles: BTreeSet<u32>,
}

/// The variables that a question names.
struct Asked {
    m: BTreeSet<u32>,
    l: BTreeSet<u32>,
    places: BTreeSet<BitPlace>,
    doubles: BTreeSet<u32>,
}

impl Asked {
    fn of(named: &BTreeSet<String>, layout: &Layout) -> Self {
        let (mut m, mut l) = (BTreeSet::new(), BTreeSet::new());
        let (mut places, mut doubles) = (BTreeSet::new(), BTreeSet::new());
        for name in named.iter().filter_map(|name| PmacName::parse(name, layout).ok()) {
            match name {
                PmacName::Memory(definition) => {
                    let bits = places::bits(layout, None, definition);
                    places.extend(bits.into_iter().flat_map(|it| it.places));
                }
                PmacName::Variable(Named { kind, number, system }) => match kind {
                    Kind::M => drop(m.insert(number)),
                    Kind::L => drop(l.insert(number)),
                    Kind::P => drop(doubles.insert(layout.p_offset(number))),
                    Kind::Q => {
                        let number = layout.q_base_of(system) + number;
                        doubles.insert(layout.q_offset(number));
                    }
                    Kind::I => {}
                },
                PmacName::Plc { .. } | PmacName::Motion(_) => {}
            }
        }
        Self { m, l, places, doubles }
    }
}

impl Outside {
    /// What comes from outside. `own` says of which words all bits are the control's own; `is_set` of which doubles the download
    /// itself says what they are.
    pub(super) fn of(
        tables: &PmacTables,
        view: View<'_>,
        access: &Access,
        named: &BTreeSet<String>,
        own: &BTreeSet<u32>,
        is_set: &dyn Fn(u32) -> bool,
    ) -> Self {
        let layout = view.layout;
        let asked = Asked::of(named, layout);
        let mut outside = Self::default();
        let mut taken: BTreeSet<BitPlace> = BTreeSet::new();
        let is_written = |&(offset, bit): &BitPlace| {
            let word = offset / WORD_SIZE * WORD_SIZE;
            let number = 8 * (offset - word) + u32::from(bit);
            own.contains(&word) || access.written.get(&word).is_some_and(|it| it >> number & 1 == 1)
        };
        let is_double_of = |offset: u32| !access.doubles.contains_key(&offset) && !is_set(offset);
        let doubles = (layout.p..layout.i).step_by(8);
        for offset in doubles.filter(|&offset| {
            (access.reads(offset) || asked.doubles.contains(&offset)) && is_double_of(offset)
        }) {
            outside.add_double(layout, offset);
        }
        // Variables of few bits give their names first.
        let mut variables: Vec<(usize, PmacName, Bits)> = vec![];
        let m = (0..layout.count).filter_map(|number| {
            let definition = view.definition(number);
            let bits = places::bits(layout, Some(number), definition)?;
            let is_named = access.read_m.contains(&number) || asked.m.contains(&number);
            Some((Kind::M, number, bits, is_named))
        });
        let l = tables.l.iter().filter_map(|&(number, definition)| {
            let bits = places::bits(layout, None, definition)?;
            Some((Kind::L, number, bits, asked.l.contains(&number)))
        });
        for (kind, number, bits, is_named) in m.chain(l) {
            let read = |place: &BitPlace| access.reads(place.0) || asked.places.contains(place);
            let matters = is_named || bits.places.first().is_some_and(read);
            if matters {
                let name = PmacName::Variable(Named { kind, number, system: 1 });
                variables.push((bits.places.len(), name, bits));
            }
        }
        variables.sort_by_key(|(width, ..)| *width);
        let mut rest: BTreeMap<BitPlace, ()> = BTreeMap::new();
        for (_, name, bits) in variables {
            if bits.coded == Coded::Double {
                let Some(&(offset, _)) = bits.places.first() else { continue };
                if is_double_of(offset) && outside.doubles.insert(offset) {
                    outside.all.push((name.to_string(), bits));
                }
                continue;
            }
            let is_whole = matches!(bits.coded, Coded::Signed | Coded::Unsigned)
                && !bits.places.iter().any(|place| is_written(place) || taken.contains(place));
            if is_whole {
                taken.extend(bits.places.iter().copied());
                outside.all.push((name.to_string(), bits));
            } else {
                rest.extend(bits.places.into_iter().map(|place| (place, ())));
            }
        }
        rest.extend(asked.places.into_iter().map(|place| (place, ())));
        for (place, ()) in rest {
            if is_written(&place) || taken.contains(&place) {
                continue;
            }
            if let Some(name) = line(layout, place) {
                outside.all.push((name, Bits { places: vec![place], coded: Coded::Unsigned }));
            }
        }
        outside
    }

    fn add_double(&mut self, layout: &Layout, offset: u32) {
        if self.doubles.insert(offset) {
            self.all.push((double_name(layout, offset), places::double(offset)));
        }
    }

    pub(super) fn has_double(&self, offset: u32) -> bool {
        self.doubles.contains(&offset)
    }

    /// Gives a new value to all of it.
    pub(super) fn put(&self, image: &[u8], maker: &mut Maker, memory: &mut Memory) {
        for (name, bits) in &self.all {
            let form = match bits.coded {
                Coded::Signed => Form::Signed,
                Coded::Double => Form::Double,
                _ => Form::Unsigned,
            };
            let new = maker.input(name.clone(), bits.places.len(), form);
            let value = match form {
                Form::Double => valid(&mut maker.builder.graph, &new),
                _ => new.clone(),
            };
            for (&(offset, bit), lit) in bits.places.iter().zip(value) {
                memory.set_bit(offset as usize, bit, lit);
            }
            if let Some(input) = maker.inputs.last_mut() {
                input.first = first(input, bits, image);
            }
        }
    }
}

/// The number that a variable is after load.
fn first(variable: &Variable, bits: &Bits, image: &[u8]) -> i64 {
    if let (Form::Double, Some(&(offset, _))) = (variable.form, bits.places.first()) {
        return read_f64(image, offset).to_bits() as i64;
    }
    let places: BTreeMap<_, _> = variable.bits.iter().copied().zip(&bits.places).collect();
    variable.number(|lit| {
        let place = places.get(&lit);
        place.is_some_and(|(offset, bit)| {
            image.get(*offset as usize).is_some_and(|byte| byte >> bit & 1 == 1)
        })
    })
}

/// The name of a bit of a word of memory.
pub(super) fn line(layout: &Layout, (offset, bit): BitPlace) -> Option<String> {
    let (space, address) = places::address(layout, offset)?;
    let bit = 8 * (offset % WORD_SIZE) as u8 + bit;
    let field = Field { offset: bit, width: 1, format: Format::U };
    Some(PmacName::Memory(Definition::word(space, address, field)).to_string())
}
