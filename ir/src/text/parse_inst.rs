//! Reads instructions and terminators.

use plcc_abi::{HostFn, TrapCode};

use super::ParseError;
use super::lex::Line;
use super::parse_func::FuncParser;
use crate::{
    Address, Args, BinaryOp, BlockCall, ConvertOp, FloatCond, InstData, IntCond, Module, Region,
    Terminator, Type, UnaryOp, Value,
};

impl FuncParser {
    /// An instruction, or `None` when a terminator was read and put in its place.
    pub(super) fn operation(
        &mut self,
        line: &mut Line,
        ty: Option<Type>,
        module: &Module,
    ) -> Result<Option<InstData>, ParseError> {
        let word = line.word("an instruction")?;
        match (word.as_str(), ty) {
            ("store", None) => {
                let at = self.address(line, module)?;
                line.sign(',')?;
                let value = self.value(line)?;
                Ok(Some(InstData::Store { at, value }))
            }
            ("hostcall", _) => self.host_call(line).map(Some),
            (_, Some(ty)) => self.valued(&word, ty, line, module).map(Some),
            (_, None) => {
                let terminator = self.terminator(&word, line)?;
                if let Some(block) = self.func.blocks.last_mut() {
                    block.terminator = Some(terminator);
                }
                Ok(None)
            }
        }
    }

    fn valued(
        &mut self,
        word: &str,
        ty: Type,
        line: &mut Line,
        module: &Module,
    ) -> Result<InstData, ParseError> {
        if let Some(op) = UnaryOp::from_name(word) {
            return Ok(InstData::Unary { op, arg: self.value(line)? });
        }
        if let Some(op) = BinaryOp::from_name(word) {
            return Ok(InstData::Binary { op, args: self.pair(line)? });
        }
        if let Some(op) = ConvertOp::from_name(word) {
            return Ok(InstData::Convert { op, to: ty, arg: self.value(line)? });
        }
        match word {
            "iconst" => Ok(InstData::Iconst { ty, value: line.number("integer of 64 bits")? }),
            "fconst" => {
                let word = line.word("a number")?;
                let bits = match word.strip_prefix("0x") {
                    Some(digits) => u64::from_str_radix(digits, 16).ok(),
                    None => word.parse().ok().filter(|n: &f64| n.is_finite()).map(f64::to_bits),
                };
                let bits =
                    bits.ok_or_else(|| line.error_before(format!("`{word}` is no finite number")))?;
                Ok(InstData::Fconst { bits })
            }
            "icmp" => {
                let word = line.word("a comparison")?;
                let cond = IntCond::from_name(&word).ok_or_else(|| {
                    no_comparison(line, &word, names(IntCond::ALL, IntCond::name))
                })?;
                Ok(InstData::Icmp { cond, args: self.pair(line)? })
            }
            "fcmp" => {
                let word = line.word("a comparison")?;
                let cond = FloatCond::from_name(&word).ok_or_else(|| {
                    no_comparison(line, &word, names(FloatCond::ALL, FloatCond::name))
                })?;
                Ok(InstData::Fcmp { cond, args: self.pair(line)? })
            }
            "select" => {
                let cond = self.value(line)?;
                line.sign(',')?;
                Ok(InstData::Select { cond, args: self.pair(line)? })
            }
            "load" => Ok(InstData::Load { ty, at: self.address(line, module)? }),
            _ => Err(line.error_before(format!("`{word}` is no instruction with a result"))),
        }
    }

    fn pair(&mut self, line: &mut Line) -> Result<[Value; 2], ParseError> {
        let a = self.value(line)?;
        line.sign(',')?;
        Ok([a, self.value(line)?])
    }

    fn address(&mut self, line: &mut Line, module: &Module) -> Result<Address, ParseError> {
        let volatile = line.take_word("volatile");
        let name = line.word("a region's name")?;
        let index =
            module.regions.iter().position(|region| region.name == name).ok_or_else(|| {
                line.error_before(format!("`{name}` is no region; they stand above the functions"))
            })?;
        line.sign(':')?;
        let offset = line.number("offset in bytes")?;
        let mut at = Address::fixed(Region(index as u32), offset);
        if line.take('[') {
            let value = self.value(line)?;
            line.sign('*')?;
            let scale = line.number("distance in bytes")?;
            line.sign(',')?;
            let count = line.number("number of elements")?;
            line.sign(']')?;
            at = Address::indexed(at.region, offset, value, scale, count);
        }
        at.volatile = volatile;
        Ok(at)
    }

    fn host_call(&mut self, line: &mut Line) -> Result<InstData, ParseError> {
        let word = line.word("a function of the host")?;
        let function = HostFn::from_name(&word)
            .ok_or_else(|| line.error_before(format!("`{word}` is no function of the host")))?;
        line.sign('(')?;
        let args = self.arguments(line)?;
        let args = Args::new(&args)
            .ok_or_else(|| line.error_before("a function of the host takes four at most"))?;
        Ok(InstData::HostCall { function, args })
    }

    /// Values up to the closing parenthesis.
    fn arguments(&mut self, line: &mut Line) -> Result<Vec<Value>, ParseError> {
        let mut args = vec![];
        if line.take(')') {
            return Ok(args);
        }
        loop {
            args.push(self.value(line)?);
            if !line.take(',') {
                line.sign(')')?;
                return Ok(args);
            }
        }
    }

    fn call(&mut self, line: &mut Line) -> Result<BlockCall, ParseError> {
        let block = self.target(line)?;
        let args = if line.take('(') { self.arguments(line)? } else { vec![] };
        Ok(BlockCall { block, args })
    }

    fn terminator(&mut self, word: &str, line: &mut Line) -> Result<Terminator, ParseError> {
        match word {
            "jump" => Ok(Terminator::Jump(self.call(line)?)),
            "brif" => {
                let cond = self.value(line)?;
                line.sign(',')?;
                let then = self.call(line)?;
                line.sign(',')?;
                Ok(Terminator::Brif { cond, then, otherwise: self.call(line)? })
            }
            "switch" => {
                let arg = self.value(line)?;
                line.sign(',')?;
                line.sign('[')?;
                let mut targets = vec![];
                while !line.take(']') {
                    if !targets.is_empty() {
                        line.sign(',')?;
                    }
                    targets.push(self.target(line)?);
                }
                line.sign(',')?;
                Ok(Terminator::Switch { arg, targets, default: self.target(line)? })
            }
            "goto" => Ok(Terminator::Goto(self.label(line)?)),
            "goto_indirect" => Ok(Terminator::GotoIndirect(self.value(line)?)),
            "suspend" => Ok(Terminator::Suspend(self.label(line)?)),
            "return" => Ok(Terminator::Return),
            "trap" => {
                let word = line.word("a code")?;
                let code = TrapCode::from_name(&word).ok_or_else(|| {
                    let known = names(TrapCode::ALL, TrapCode::name);
                    line.error_before(format!("`{word}` is no code; there are {known}"))
                })?;
                Ok(Terminator::Trap(code))
            }
            _ => Err(line.error_before(format!(
                "`{word}` is no instruction without a result; one with a result reads \
                 `v0: i16 = {word} …`"
            ))),
        }
    }
}

fn no_comparison(line: &Line, word: &str, known: String) -> ParseError {
    line.error_before(format!("`{word}` is no comparison; there are {known}"))
}

/// The words of a list.
fn names<T: Copy>(all: &[T], name: impl Fn(T) -> &'static str) -> String {
    all.iter().map(|&one| name(one)).collect::<Vec<_>>().join(" ")
}
