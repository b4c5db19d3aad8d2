//! Declarations of variables, constants, timers and flip-flops (PMI 3.1.3 to 3.1.5, 3.1.9).

use plcc_abi::pmi::Type;
use plcc_diag::Span;

use crate::common::Limits;
use crate::pmi::{
    analyse::specification_section::SpecificationSection,
    ast::{FlipFlopDef, Meaning, SymbolId, TimerDef},
    read::{
        cursor::Cursor,
        diagnostic::{Result, error},
        syntax::{Timer, VariableDeclaration},
        token::Token,
    },
};

/// How many arrays a program may have for the original compiler (PMI 2.2.7).
const MAX_ARRAYS: u32 = 256;
/// How many bytes all arrays together may take, with `--limits none` too.
const MAX_ARRAY_BYTES: u64 = 64 << 20;

impl SpecificationSection<'_> {
    /// The variables of a statement.
    pub(crate) fn variables(
        &mut self,
        cursor: &Cursor<'_>,
        variables: &mut [VariableDeclaration],
        form: Result,
    ) -> Result {
        for variable in variables {
            self.variable(cursor, variable)?;
        }
        form
    }

    fn variable(&mut self, cursor: &Cursor<'_>, variable: &mut VariableDeclaration) -> Result {
        let VariableDeclaration { ty, name, elements, .. } = *variable;
        self.check_new(cursor, name)?;
        if let Some(elements) = elements {
            self.check_room(cursor, name, ty, elements)?;
        }
        if let Some(constants) = variable.constants.take() {
            if let Some(elements) = elements {
                check_count(cursor, name, elements, &constants)?;
            }
            let (values, spans) = constants.into_iter().unzip();
            let symbol = self.declare(cursor, name, ty, elements, Meaning::Constant(values))?;
            self.checked.constant_spans.push((symbol, spans));
        } else if variable.is_whole {
            self.declare(cursor, name, ty, elements, Meaning::Variable)?;
        }
        Ok(())
    }

    /// Refuses an array for which there is no room.
    fn check_room(&mut self, cursor: &Cursor<'_>, name: Token, ty: Type, elements: u32) -> Result {
        let (name, span) = (cursor.slice(name), cursor.span_of(name));
        self.arrays += 1;
        if self.arrays > MAX_ARRAYS && self.limits == Limits::Original {
            return Err(error(18, span, format!("{name} is one array too many"))
                .help("a program has at most 256 arrays; `--limits none` allows more")
                .into());
        }
        self.bytes += u64::from(elements) * u64::from(ty.size());
        if self.bytes > MAX_ARRAY_BYTES {
            return Err(error(40, span, format!("there is no room for {name}"))
                .help("all arrays together may take 64 MiB; make them smaller")
                .into());
        }
        Ok(())
    }

    /// A timer.
    pub(crate) fn timer(&mut self, cursor: &Cursor<'_>, timer: &Timer, form: Result) -> Result {
        let index = self.checked.timers.len() as u32;
        let Some(control) = timer.control else { return form };
        let meaning = Meaning::TimerControl(index);
        let control = self.declare(cursor, control, Type::Logical, None, meaning)?;
        let Some(delayed) = timer.delayed else { return form };
        let delayed = self.declare(cursor, delayed, Type::Logical, None, Meaning::Derived)?;
        form?;
        if let (Some(kind), Some((preset, preset_span))) = (timer.kind, timer.preset) {
            let timer = TimerDef { kind, control, delayed, preset, preset_span };
            self.checked.timers.push(timer);
        }
        Ok(())
    }

    /// A flip-flop: output, data, clock, preset, clear.
    pub(crate) fn flipflop(&mut self, cursor: &Cursor<'_>, pins: &[Token], form: Result) -> Result {
        let index = self.checked.flipflops.len() as u32;
        let meanings = [
            Meaning::Derived,
            Meaning::Variable,
            Meaning::Clock(index),
            Meaning::Pin(index),
            Meaning::Pin(index),
        ];
        let mut declared: Vec<SymbolId> = vec![];
        for (pin, meaning) in pins.iter().zip(meanings) {
            declared.push(self.declare(cursor, *pin, Type::Logical, None, meaning)?);
        }
        form?;
        if let [q, d, clock, preset, clear] = *declared {
            self.checked.flipflops.push(FlipFlopDef { q, d, clock, preset, clear });
        }
        Ok(())
    }
}

/// Refuses more or fewer constants than an array has elements.
fn check_count(
    cursor: &Cursor<'_>,
    name: Token,
    elements: u32,
    constants: &[(i32, Span)],
) -> Result {
    let count = constants.len();
    if count == elements as usize {
        return Ok(());
    }
    // The error points at the first value too many, or at the end of the statement.
    let extra = constants.get(elements as usize).map(|(_, span)| *span);
    let end = cursor.span_of(cursor.tokens.last().copied().unwrap_or(name));
    let what = format!("{} has {elements} elements but {count} constants", cursor.slice(name));
    Err(error(20, extra.unwrap_or(end), what).help("give one constant for each element").into())
}
