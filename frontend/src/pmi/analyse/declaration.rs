//! Declarations of variables, constants, timers, flip-flops and auxiliary axes (PMI 3.1.3 to 3.1.5,
//! 3.1.9, 3.1.10).

use plcc_abi::pmi::{TimerKind, Type};
use plcc_diag::Span;

use crate::common::Limits;
use crate::pmi::{
    analyse::specification_section::{Result, SpecificationSection},
    ast::{FlipFlopDef, Meaning, SymbolId, TimerDef},
    read::{cursor::Cursor, diagnostic::error, token::Kind},
};

/// How many elements an array may have for the original compiler (PMI 2.2.7).
const ELEMENTS: std::ops::RangeInclusive<u32> = 2..=255;
/// How many arrays a program may have for it.
const MAX_ARRAYS: u32 = 256;
/// How many bytes all arrays together may take, with `--limits none` too.
const MAX_ARRAY_BYTES: u64 = 64 << 20;

impl SpecificationSection<'_> {
    /// `NAME`, `NAME = constant`, `NAME[n]`, `NAME[n] = [constants]`, with commas between them.
    pub(crate) fn variables(&mut self, cursor: &mut Cursor<'_>, ty: Type) -> Result {
        loop {
            let name = self.new_name(cursor)?;
            self.check_new(name)?;
            let elements = match cursor.kind() {
                Some(Kind::LBracket) => Some(self.elements(cursor, name, ty)?),
                _ => None,
            };
            if cursor.eat(Kind::Eq) {
                let constants = self.constants(cursor, ty, elements, name)?;
                let (values, spans) = constants.into_iter().unzip();
                let symbol = self.declare(name, ty, elements, Meaning::Constant(values))?;
                self.checked.constant_spans.push((symbol, spans));
            } else {
                self.declare(name, ty, elements, Meaning::Variable)?;
            }
            if cursor.kind().is_none() {
                return Ok(());
            }
            if !cursor.eat(Kind::Comma) {
                let what = format!("`,` is expected, not {}", cursor.found());
                return Err(cursor.error_here(11, what).into());
            }
        }
    }

    /// `[n]` of a declaration.
    fn elements(&mut self, cursor: &mut Cursor<'_>, name: (&str, Span), ty: Type) -> Result<u32> {
        cursor.at += 1;
        let (written, span) = self.number(cursor)?;
        let count = u32::try_from(written).unwrap_or(0);
        let allowed = match self.limits {
            Limits::Original => ELEMENTS.contains(&count),
            Limits::None => count > 0,
        };
        if !allowed {
            let help = match self.limits {
                Limits::Original => "an array has 2 to 255 elements; `--limits none` allows any",
                Limits::None => "an array has at least one element",
            };
            let what = format!("{} cannot have {written} elements", name.0);
            return Err(error(19, span, what).help(help).into());
        }
        self.expect(cursor, Kind::RBracket, "]")?;
        self.arrays += 1;
        if self.arrays > MAX_ARRAYS && self.limits == Limits::Original {
            return Err(error(18, name.1, format!("{} is one array too many", name.0))
                .help("a program has at most 256 arrays; `--limits none` allows more")
                .into());
        }
        self.bytes += u64::from(count) * u64::from(ty.size());
        if self.bytes > MAX_ARRAY_BYTES {
            return Err(error(40, name.1, format!("there is no room for {}", name.0))
                .help("all arrays together may take 64 MiB; make them smaller")
                .into());
        }
        Ok(count)
    }

    /// The value of a constant, or the values of an array of constants, one for each element, each with its place.
    fn constants(
        &mut self,
        cursor: &mut Cursor<'_>,
        ty: Type,
        elements: Option<u32>,
        name: (&str, Span),
    ) -> Result<Vec<(i32, Span)>> {
        let Some(elements) = elements else {
            return Ok(vec![self.constant(cursor, ty)?]);
        };
        self.expect(cursor, Kind::LBracket, "[")?;
        let mut values = vec![];
        let mut extra = None;
        loop {
            let span = cursor.span();
            values.push(self.constant(cursor, ty)?);
            if values.len() > elements as usize {
                extra = extra.or(Some(span));
            }
            if cursor.eat(Kind::RBracket) {
                break;
            }
            if !cursor.eat(Kind::Comma) {
                let what = format!("`,` or `]` is expected, not {}", cursor.found());
                return Err(cursor.error_here(11, what).into());
            }
        }
        if values.len() == elements as usize {
            return Ok(values);
        }
        // The error points at the first value too many, or at the end of the statement.
        let end = cursor.tokens.last().map_or(name.1, |token| cursor.span_of(*token));
        let span = extra.unwrap_or(end);
        let count = values.len();
        let what = format!("{} has {elements} elements but {count} constants", name.0);
        Err(error(20, span, what).help("give one constant for each element").into())
    }

    /// The value of a constant of type `ty`, with its sign, and where it stands.
    fn constant(&mut self, cursor: &mut Cursor<'_>, ty: Type) -> Result<(i32, Span)> {
        let start = cursor.span();
        let negative = cursor.eat(Kind::Minus);
        let span = start.to(cursor.span());
        let value = match cursor.token() {
            Some(token) => match (token.kind, cursor.slice(token)) {
                (Kind::Number(value), _) => {
                    let value = i64::from(value);
                    if negative { -value } else { value }
                }
                (Kind::Name, "T") if ty == Type::Logical && !negative => 1,
                (Kind::Name, "F") if ty == Type::Logical && !negative => 0,
                (Kind::Name | Kind::Executive | Kind::Text, _) => {
                    let what = format!("{} is no constant of this type", cursor.found());
                    return Err(error(30, span, what).help(range_of(ty)).into());
                }
                _ => {
                    let what = format!("a constant is expected, not {}", cursor.found());
                    return Err(cursor.error_here(12, what).into());
                }
            },
            None => return Err(cursor.error_here(12, "a constant is expected here").into()),
        };
        cursor.at += 1;
        let fits = match ty {
            Type::Logical => (0..=1).contains(&value) && !negative,
            Type::Integer => (-32_767..=32_767).contains(&value),
            Type::Long => (-2_147_483_647..=2_147_483_647).contains(&value),
        };
        if !fits {
            let what = format!("{value} is no constant of this type");
            return Err(error(30, span, what).help(range_of(ty)).into());
        }
        Ok((value as i32, span))
    }

    /// `E/TC/DC = P`: type, control contact, delayed contact, delay in units of 20 ms.
    pub(crate) fn timer(&mut self, cursor: &mut Cursor<'_>) -> Result {
        let span = cursor.span();
        let kind = match cursor.name() {
            Some(("E", _)) => TimerKind::E,
            Some(("D", _)) => TimerKind::D,
            Some((other, _)) => {
                return Err(error(21, span, format!("`{other}` is no type of timer"))
                    .help("E delays switching on, D switching off: E/TC/DC = 50")
                    .into());
            }
            None => {
                let what = format!("E or D is expected, not {}", cursor.found());
                return Err(cursor.error_here(21, what).into());
            }
        };
        self.expect(cursor, Kind::Slash, "/")?;
        let control = self.new_name(cursor)?;
        let index = self.checked.timers.len() as u32;
        let control = self.declare(control, Type::Logical, None, Meaning::TimerControl(index))?;
        self.expect(cursor, Kind::Slash, "/")?;
        let delayed = self.new_name(cursor)?;
        let delayed = self.declare(delayed, Type::Logical, None, Meaning::Derived)?;
        self.expect(cursor, Kind::Eq, "=")?;
        let (preset, span) = self.number(cursor)?;
        if !(1..=32_767).contains(&preset) {
            return Err(error(22, span, format!("{preset} is no delay"))
                .help("a delay is 1 to 32767 units of 20 ms")
                .into());
        }
        self.end(cursor)?;
        let preset = preset as i32;
        self.checked.timers.push(TimerDef { kind, control, delayed, preset, preset_span: span });
        Ok(())
    }

    /// `Q/D/CK/PR/CL`: output, data, clock, preset, clear.
    pub(crate) fn flipflop(&mut self, cursor: &mut Cursor<'_>) -> Result {
        let index = self.checked.flipflops.len() as u32;
        let q = self.pin(cursor, Meaning::Derived, true)?;
        let d = self.pin(cursor, Meaning::Variable, true)?;
        let clock = self.pin(cursor, Meaning::Clock(index), true)?;
        let preset = self.pin(cursor, Meaning::Pin(index), true)?;
        let clear = self.pin(cursor, Meaning::Pin(index), false)?;
        self.end(cursor)?;
        self.checked.flipflops.push(FlipFlopDef { q, d, clock, preset, clear });
        Ok(())
    }

    /// A pin of a flip-flop; `more` says that a `/` and another pin follow.
    fn pin(&mut self, cursor: &mut Cursor<'_>, meaning: Meaning, more: bool) -> Result<SymbolId> {
        let name = self.new_name(cursor)?;
        let symbol = self.declare(name, Type::Logical, None, meaning)?;
        if more {
            self.expect(cursor, Kind::Slash, "/")?;
        }
        Ok(symbol)
    }

    /// `NAME = NUMBER, NUMBER…` of `$AUXAXIS`.
    pub(crate) fn auxiliary(&mut self, cursor: &mut Cursor<'_>) -> Result {
        let (name, _) = self.new_name(cursor)?;
        self.expect(cursor, Kind::Eq, "=")?;
        let mut numbers = vec![];
        loop {
            numbers.push(self.constant(cursor, Type::Long)?.0);
            if cursor.kind().is_none() {
                break;
            }
            self.expect(cursor, Kind::Comma, ",")?;
        }
        self.checked.auxiliary.push((name.to_owned(), numbers));
        Ok(())
    }
}

/// The values that a constant of a type may have, as a help says it.
fn range_of(ty: Type) -> &'static str {
    match ty {
        Type::Logical => "a LOGICAL is 0, 1, T or F",
        Type::Integer => "an INTEGER is -32767 to 32767; a LONG holds more",
        Type::Long => "a LONG is -2147483647 to 2147483647",
    }
}
