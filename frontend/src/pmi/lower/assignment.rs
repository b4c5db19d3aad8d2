//! Assignments, and what they set off at once: timers and flip-flops (PMI 2.2.5, 2.2.6).

use plcc_abi::pmi::{TimerKind, Type as PmiType};
use plcc_ir::{Address, BinaryOp, InstBuilder, IntCond, Type, UnaryOp, Value};

use super::{Lowerer, Operand, Result, ir_type};
use crate::common::OrMissing;
use crate::pmi::ast::{FlipFlopDef, Meaning, Ops, SymbolId, Target, TimerDef};

impl Lowerer<'_> {
    pub(super) fn assign(&mut self, target: &Target, value: &Ops) -> Result {
        // An index of the target is computed and checked before the value, since both may trap.
        let (id, index) = match target {
            Target::Scalar(id) => (*id, None),
            Target::At(id, index) => (*id, Some(*index)),
            Target::Element(id, index) => {
                self.expression(index)?;
                let index = self.pop()?;
                let index = self.check_index(*id, index)?;
                self.stack.push(Operand::Value(index, Type::I32));
                (*id, None)
            }
        };
        self.expression(value)?;
        let operand = self.pop()?;
        let at = match target {
            Target::Element(..) => {
                let index = self.pop()?;
                let index = self.as_type(index, Type::I32);
                self.element(id, index)?
            }
            Target::Scalar(_) | Target::At(..) => self.scalar(id, index.unwrap_or(0))?,
        };
        let ty = self.type_of(id)?;
        let mut value = match ty {
            PmiType::Logical => self.logical(operand),
            PmiType::Integer => self.as_type(operand, Type::I16),
            PmiType::Long => self.as_type(operand, Type::I32),
        };
        let checked = self.checked;
        let symbol = checked.symbol(id).or_missing(|| format!("symbol {}", id.0))?;
        let old_clock = match symbol.meaning {
            Meaning::ResetOnly => {
                let old = self.builder.func().load(ir_type(ty), at);
                value = self.builder.func().binary(BinaryOp::And, old, value);
                None
            }
            Meaning::Clock(index) => {
                let offset = self.layout.last_clocks.get(index as usize).copied();
                let offset = offset.or_missing(|| format!("the last clock of {}", symbol.name))?;
                Some((offset, self.load(PmiType::Logical, offset)?))
            }
            _ => None,
        };
        self.builder.func().store(at, value);
        match symbol.meaning {
            Meaning::TimerControl(index) => {
                let counter = self.layout.counters.get(index as usize).copied();
                let timer = checked.timers.get(index as usize).zip(counter);
                let (timer, counter) =
                    timer.or_missing(|| format!("the timer of {}", symbol.name))?;
                self.timer(timer, counter, value)?;
            }
            Meaning::Clock(index) | Meaning::Pin(index) => {
                let clocked = old_clock.map(|(offset, old)| (offset, old, value));
                let flipflop = checked.flipflops.get(index as usize);
                let flipflop =
                    flipflop.or_missing(|| format!("the flip-flop of {}", symbol.name))?;
                self.flipflop(flipflop, clocked)?;
            }
            _ => {}
        }
        Ok(())
    }

    /// The address of a variable, or of an element whose index is known.
    fn scalar(&self, id: SymbolId, index: u32) -> Result<Address> {
        let ty = self.type_of(id)?;
        self.address(ty, self.offset(id)? + index * ty.size())
    }

    /// PMI 3.1.9: what an assignment to a timer's control contact does at once.
    fn timer(&mut self, timer: &TimerDef, counter: u32, control: Value) -> Result {
        let delayed = self.offset(timer.delayed)?;
        let old_delayed = self.load(PmiType::Logical, delayed)?;
        let old = self.load(PmiType::Long, counter)?;
        let func = self.builder.func();
        let idle_mark = func.constant(Type::I32, -1);
        let preset = func.constant(Type::I32, i64::from(timer.preset));
        let idle = func.icmp(IntCond::Eq, old, idle_mark);
        let (new_delayed, new) = match timer.kind {
            TimerKind::E => {
                let running = func.select(idle, preset, old);
                let new = func.select(control, running, idle_mark);
                (func.binary(BinaryOp::And, old_delayed, control), new)
            }
            TimerKind::D => {
                let starts = func.binary(BinaryOp::And, idle, old_delayed);
                let running = func.select(starts, preset, old);
                let new = func.select(control, idle_mark, running);
                (func.binary(BinaryOp::Or, old_delayed, control), new)
            }
        };
        self.store(PmiType::Logical, delayed, new_delayed)?;
        self.store(PmiType::Long, counter, new)
    }

    /// PMI 3.1.10: what an assignment to a flip-flop's pin does at once. If the pin is the clock,
    /// `clocked` holds the offset of the last clock, its value, and the new clock.
    fn flipflop(&mut self, pins: &FlipFlopDef, clocked: Option<(u32, Value, Value)>) -> Result {
        let logical = PmiType::Logical;
        let (q, d) = (self.offset(pins.q)?, self.offset(pins.d)?);
        let (preset, clear) = (self.offset(pins.preset)?, self.offset(pins.clear)?);
        let mut state = self.load(logical, q)?;
        if let Some((last, old, new)) = clocked {
            let data = self.load(logical, d)?;
            let func = self.builder.func();
            let was_low = func.unary(UnaryOp::Not, old);
            let rising = func.binary(BinaryOp::And, new, was_low);
            state = func.select(rising, data, state);
            self.store(logical, last, new)?;
        }
        let preset = self.load(logical, preset)?;
        let clear = self.load(logical, clear)?;
        let func = self.builder.func();
        let set = func.binary(BinaryOp::Or, state, preset);
        let cleared = func.unary(UnaryOp::Not, clear);
        let state = func.binary(BinaryOp::And, set, cleared);
        self.store(logical, q, state)
    }
}
