//! What the code of the PLCs and commands reads and writes, as far as its text shows it.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::RangeInclusive;

use plcc_abi::HostFn;
use plcc_abi::pmac::layout::{CONTEXTS, DOUBLE_SIZE, WORD_SIZE};
use plcc_abi::pmac::{Definition, Kind, Layout, PmacName, Variable, View};
use plcc_ir::{Address, Func, FuncData, InstData, Module, Value};

use super::places::{self, Bits};
use super::values::Stored;
use crate::scan::{Code, MOST_ELEMENTS};

/// What code reads and writes.
#[derive(Debug, Default)]
pub(super) struct Access {
    /// The offsets of words that are read, four bytes each.
    pub(super) read: BTreeSet<u32>,
    /// M-variables that are read by a function of the control.
    pub(super) read_m: BTreeSet<u32>,
    /// The bits that are written, by the offsets of their words.
    pub(super) written: BTreeMap<u32, u32>,
    /// The doubles that are written, by offset, with what is written there.
    pub(super) doubles: BTreeMap<u32, Vec<Stored>>,
    /// The PLCs, or PLCCs where it says so, that are enabled, disabled, paused or resumed: the first and the last.
    pub(super) plcs: Vec<(bool, RangeInclusive<u32>)>,
    /// Whether there is a SAVE.
    pub(super) saves: bool,
}

impl Access {
    /// What the tasks of a program read and write.
    pub(super) fn of(
        code: &Code<'_>,
        tasks: impl Iterator<Item = usize>,
        layout: &Layout,
        view: View<'_>,
        l: &[(u32, Definition)],
    ) -> Self {
        let mut access = Self::default();
        let module = code.module;
        for (number, block) in code.blocks(tasks) {
            let Some(func) = module.funcs.get(number.index()) else { continue };
            for &inst in &func.block(block).insts {
                match func.inst(inst) {
                    InstData::Load { at, ty } => {
                        let base = base(module, at);
                        let extent = at.extent(*ty);
                        if !is_large(at) {
                            access.note_read(base + extent.start as u32..base + extent.end as u32);
                        }
                    }
                    InstData::Store { at, value } => {
                        access.note_store(module, layout, (number, func), at, *value);
                    }
                    InstData::HostCall { function, .. } => {
                        let mut args = vec![];
                        func.inst(inst).for_each_arg(|value| args.push(value));
                        access.note_call(func, *function, &args, (layout, view, l));
                    }
                    _ => {}
                }
            }
        }
        access
    }

    /// Notes that a question reads I-variables.
    pub(super) fn note_named(&mut self, named: &BTreeSet<String>, layout: &Layout) {
        for name in named.iter().filter_map(|name| PmacName::parse(name, layout).ok()) {
            if let PmacName::Variable(Variable { kind: Kind::I, number, .. }) = name {
                self.read.insert(layout.i_offset(number));
            }
        }
    }

    /// Whether a byte is read, or the double that begins with it.
    pub(super) fn reads(&self, offset: u32) -> bool {
        self.read.contains(&(offset / WORD_SIZE * WORD_SIZE))
    }

    fn note_read(&mut self, bytes: std::ops::Range<u32>) {
        self.read.extend(
            (bytes.start / WORD_SIZE..bytes.end.div_ceil(WORD_SIZE)).map(|word| word * WORD_SIZE),
        );
    }

    fn note_store(
        &mut self,
        module: &Module,
        layout: &Layout,
        (number, func): (Func, &FuncData),
        at: &Address,
        value: Value,
    ) {
        if is_large(at) {
            return;
        }
        let base = base(module, at);
        let extent = at.extent(func.ty(value));
        let bytes = base + extent.start as u32..base + extent.end as u32;
        let holds_doubles =
            bytes.start < layout.mdef || (layout.thumbwheels..layout.words).contains(&bytes.start);
        if holds_doubles {
            let what = Stored::Value(number, value);
            for offset in bytes.step_by(DOUBLE_SIZE as usize) {
                self.doubles.entry(offset).or_default().push(what);
            }
            return;
        }
        let q_bases = layout.q_base_at(0)..layout.q_base_at(CONTEXTS);
        let mask = match func.def_inst(value) {
            _ if q_bases.contains(&bytes.start) => layout.count - 1,
            _ if bytes.start >= layout.mdef && bytes.start < layout.reference_definitions => {
                0x1F_FFFF
            }
            Some(InstData::Insert { args: [word, _], field }) if matches!(func.def_inst(*word), Some(InstData::Load { at: from, .. }) if from == at) =>
            {
                let ones = 1_u32.checked_shl(field.width.into()).unwrap_or(0).wrapping_sub(1);
                ones << field.first
            }
            _ => 0xFF_FFFF,
        };
        *self.written.entry(bytes.start).or_default() |= mask;
    }

    /// Notes that bits are written by the control.
    fn note_bits(&mut self, bits: &Bits, layout: &Layout) {
        let Some(&(first, _)) = bits.places.first() else { return };
        if first < layout.mdef || (layout.thumbwheels..layout.words).contains(&first) {
            self.doubles.entry(first).or_default().push(Stored::Any);
            return;
        }
        for &(offset, bit) in &bits.places {
            let word = offset / WORD_SIZE * WORD_SIZE;
            let bit = 8 * (offset - word) + u32::from(bit);
            *self.written.entry(word).or_default() |= 1 << bit;
        }
    }

    fn note_call(
        &mut self,
        func: &FuncData,
        function: HostFn,
        args: &[Value],
        (layout, view, l): (&Layout, View<'_>, &[(u32, Definition)]),
    ) {
        let constant = |at: usize| match args.get(at).and_then(|&value| func.def_inst(value)) {
            Some(InstData::Iconst { value, .. }) => Some(*value as u32),
            _ => None,
        };
        let m = |number: u32| {
            let number = number & (layout.count - 1);
            places::bits(layout, Some(number), view.definition(number))
        };
        match function {
            HostFn::PmacMRead => {
                self.read_m.extend(constant(0).map(|number| number & (layout.count - 1)));
            }
            HostFn::PmacMWrite => {
                if let Some(bits) = constant(0).and_then(m) {
                    self.note_bits(&bits, layout);
                }
            }
            HostFn::PmacIWrite => {
                if let Some(number) = constant(0) {
                    self.note_bits(&places::double(layout.i_offset(number)), layout);
                }
            }
            HostFn::PmacPlc => {
                let compiled = constant(1).map_or(vec![false, true], |it| vec![it != 0]);
                let numbers = constant(2).unwrap_or(0)..=constant(3).unwrap_or(31);
                self.plcs.extend(compiled.into_iter().map(|it| (it, numbers.clone())));
            }
            HostFn::PmacSave => self.saves = true,
            HostFn::PmacAddressMotor => {
                if let Some(context) = constant(0) {
                    *self.written.entry(layout.motor_at(context)).or_default() |= 0x3F;
                }
            }
            HostFn::PmacRangeWrite => {
                let (Some(kind), Some(first), Some(count)) =
                    (constant(0).and_then(Kind::from_number), constant(1), constant(2))
                else {
                    return;
                };
                let (count, step) = (count & 0xFFFF, count >> 16);
                for number in (0..count).map(|k| first.wrapping_add(k * step)) {
                    let bits = match kind {
                        Kind::P => Some(places::double(layout.p_offset(number))),
                        Kind::Q => Some(places::double(layout.q_offset(number))),
                        Kind::I => Some(places::double(layout.i_offset(number))),
                        Kind::M => m(number),
                        Kind::L => l
                            .iter()
                            .find(|(l, _)| *l == number)
                            .and_then(|(_, it)| places::bits(layout, None, *it)),
                    };
                    if let Some(bits) = bits {
                        self.note_bits(&bits, layout);
                    }
                }
            }
            _ => {}
        }
    }
}

/// Whether an element of an array is named that is too large to be followed.
fn is_large(at: &Address) -> bool {
    at.index.is_some_and(|index| index.count > MOST_ELEMENTS)
}

fn base(module: &Module, at: &Address) -> u32 {
    module.region(at.region).map_or(0, |region| region.offset)
}
