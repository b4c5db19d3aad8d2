//! Reads a function: its blocks, and what stands for what.

use std::collections::HashMap;

use super::ParseError;
use super::lex::Line;
use crate::func::ValueData;
use crate::{
    Block, BlockData, FuncData, Inst, InstData, Label, Module, SourceLoc, Type, Value, ValueDef,
};

/// Line and column.
pub(super) type At = (usize, usize);

pub(super) fn error((line, column): At, message: impl Into<String>) -> ParseError {
    ParseError { line, column, message: message.into() }
}

/// A function being read.
pub(super) struct FuncParser {
    pub(super) func: FuncData,
    begin: At,
    loc: SourceLoc,
    /// For each number in the text the value, and where it was named first.
    names: HashMap<u32, (Value, At)>,
    /// For each value its definition.
    values: Vec<Option<ValueData>>,
    /// Blocks that are named.
    blocks: Vec<(Block, At)>,
    /// Labels that are named.
    labels: Vec<(u32, At)>,
}

impl FuncParser {
    pub(super) fn new(name: String, begin: At) -> Self {
        Self {
            func: FuncData { name, ..FuncData::default() },
            begin,
            loc: SourceLoc::NONE,
            names: HashMap::new(),
            values: vec![],
            blocks: vec![],
            labels: vec![],
        }
    }

    /// What is wrong when the text ends inside.
    pub(super) fn unclosed(&self) -> ParseError {
        error(self.begin, "the function is not closed by `}`")
    }

    /// The function, and the labels it names, when everything named is there.
    pub(super) fn finish(mut self, end: At) -> Result<(FuncData, Vec<(u32, At)>), ParseError> {
        if self.func.blocks.last().is_some_and(|block| block.terminator.is_none()) {
            return Err(error(
                end,
                "the last block does not end: `jump`, `return` and the like do",
            ));
        }
        let count = self.func.blocks.len();
        for &(block, at) in &self.blocks {
            if block.index() >= count {
                return Err(error(at, format!("{block} is not there; there are {count}")));
            }
        }
        for (at, number) in self.names.values().map(|(value, at)| (at, value)) {
            match self.values.get(number.index()).copied().flatten() {
                Some(_) => {}
                None => return Err(self.undefined(*at)),
            }
        }
        self.func.entries.sort_unstable();
        self.func.values = self.values.into_iter().flatten().collect();
        Ok((self.func, self.labels))
    }

    /// The first value in the text that is never defined.
    fn undefined(&self, some: At) -> ParseError {
        let open = self
            .names
            .iter()
            .filter(|(_, (value, _))| self.values.get(value.index()).copied().flatten().is_none());
        let first = open.min_by_key(|(_, (_, at))| *at);
        match first {
            Some((number, (_, at))) => error(*at, format!("v{number} is defined nowhere")),
            None => error(some, "this value is defined nowhere"),
        }
    }

    /// Reads a line.
    pub(super) fn line(&mut self, line: &mut Line, module: &Module) -> Result<(), ParseError> {
        let word = line.peek().unwrap_or_default();
        if word.starts_with('@') {
            self.location(line)?;
        } else if word.strip_prefix("block").is_some_and(|n| n.parse::<u32>().is_ok()) {
            self.block(line)?;
        } else {
            let at = line.place();
            let Some(block) = self.func.blocks.last() else {
                return Err(error(at, "`block0:` is wanted before the first instruction"));
            };
            if block.terminator.is_some() {
                return Err(error(at, "the block has ended; another begins with its name and `:`"));
            }
            self.instruction(line, module)?;
        }
        line.end()
    }

    fn location(&mut self, line: &mut Line) -> Result<(), ParseError> {
        self.loc = if line.take_word("@none") {
            SourceLoc::NONE
        } else {
            SourceLoc(line.reference("@", "a statement")?)
        };
        Ok(())
    }

    fn block(&mut self, line: &mut Line) -> Result<(), ParseError> {
        let at = line.place();
        let number = line.reference("block", "a block")?;
        let next = Block(self.func.blocks.len() as u32);
        if number != next.0 {
            return Err(error(at, format!("the next block is {next}: they stand in order")));
        }
        if self.func.blocks.last().is_some_and(|block| block.terminator.is_none()) {
            return Err(error(at, "the block before does not end"));
        }
        let mut data = BlockData::default();
        while line.take('(') {
            loop {
                if line.peek().is_some_and(|word| word.starts_with('L')) {
                    let label = Label(line.reference("L", "a label")?);
                    self.func.entries.push((label, next));
                } else {
                    let at = line.place();
                    let number = line.reference("v", "a parameter")?;
                    line.sign(':')?;
                    let ty = self.ty(line)?;
                    let def = ValueDef::Param(next, data.params.len() as u32);
                    data.params.push(self.define(number, at, ValueData { ty, def })?);
                }
                if !line.take(',') {
                    break;
                }
            }
            line.sign(')')?;
        }
        line.sign(':')?;
        self.func.blocks.push(data);
        Ok(())
    }

    pub(super) fn ty(&self, line: &mut Line) -> Result<Type, ParseError> {
        let word = line.word("a type")?;
        Type::from_name(&word).ok_or_else(|| {
            line.error_before(format!("`{word}` is no type; there are i1 i8 i16 i32 i64 f64"))
        })
    }

    /// The value of a number.
    fn named(&mut self, number: u32, at: At) -> Value {
        let next = Value(self.values.len() as u32);
        let (value, _) = *self.names.entry(number).or_insert((next, at));
        if value == next {
            self.values.push(None);
        }
        value
    }

    fn define(&mut self, number: u32, at: At, data: ValueData) -> Result<Value, ParseError> {
        let value = self.named(number, at);
        match self.values.get_mut(value.index()) {
            Some(slot @ None) => *slot = Some(data),
            _ => return Err(error(at, format!("v{number} is defined twice"))),
        }
        Ok(value)
    }

    /// An operand.
    pub(super) fn value(&mut self, line: &mut Line) -> Result<Value, ParseError> {
        let at = line.place();
        let number = line.reference("v", "a value")?;
        Ok(self.named(number, at))
    }

    /// A block that is gone to.
    pub(super) fn target(&mut self, line: &mut Line) -> Result<Block, ParseError> {
        let at = line.place();
        let block = Block(line.reference("block", "a block")?);
        self.blocks.push((block, at));
        Ok(block)
    }

    /// A label that is gone to.
    pub(super) fn label(&mut self, line: &mut Line) -> Result<Label, ParseError> {
        let at = line.place();
        let number = line.reference("L", "a label")?;
        self.labels.push((number, at));
        Ok(Label(number))
    }

    /// An instruction with or without result, or a terminator.
    fn instruction(&mut self, line: &mut Line, module: &Module) -> Result<(), ParseError> {
        let inst = Inst(self.func.insts.len() as u32);
        let result = match line.peek() {
            Some(word) if word.strip_prefix('v').is_some_and(|n| n.parse::<u32>().is_ok()) => {
                let at = line.place();
                let number = line.reference("v", "a value")?;
                line.sign(':')?;
                let ty = self.ty(line)?;
                line.sign('=')?;
                let def = ValueDef::Result(inst);
                Some((self.define(number, at, ValueData { ty, def })?, ty))
            }
            _ => None,
        };
        let ty = result.map(|(_, ty)| ty);
        if let Some(data) = self.operation(line, ty, module)? {
            self.place(inst, data, result.map(|(value, _)| value));
        }
        Ok(())
    }

    fn place(&mut self, inst: Inst, data: InstData, result: Option<Value>) {
        self.func.insts.push(data);
        self.func.locs.push(self.loc);
        self.func.results.push(result);
        if let Some(block) = self.func.blocks.last_mut() {
            block.insts.push(inst);
        }
    }
}
