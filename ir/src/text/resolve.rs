//! Finds what each name of a text stands for, and makes a module of its structure.
//!
//! What the [grammar](super::grammar) gives holds indices of tokens for names. Regions are above
//! the functions that use them; blocks, values and labels may be used before they are defined, so a
//! function is read twice: once for what it defines, once for what it uses.

use std::collections::HashMap;

use plcc_abi::Task;

use super::error::ParseError;
use super::grammar::{BlockText, Func, Item, Line, Param, number_in_name};
use super::lex::{Token, Tokens};
use crate::func::{LOCAL_BITS_NAME, ValueData};
use crate::{
    Block, BlockData, FuncData, Inst, InstData, Label, Module, RegionId, StatementId, Terminator,
    Type, Value, ValueDef,
};

/// Makes a module of the structure of a text.
///
/// # Errors
/// At a name that stands for nothing, or for two things.
pub(super) fn resolve(tokens: &Tokens<'_>, items: Vec<Item>) -> Result<Module, ParseError> {
    let mut module = Module::default();
    // Labels that are mentioned, by their tokens; checked when all functions are known.
    let mut labels: Vec<Label> = vec![];
    for item in items {
        match item {
            Item::Image(size) => module.image_size = size,
            Item::Region(region, finite, words) => {
                let id = RegionId(module.regions.len() as u32);
                if finite {
                    module.finite_regions.push(id);
                }
                if words {
                    module.word_regions.push(id);
                }
                module.regions.push(region);
            }
            Item::Task(name, entry, points) => {
                labels.push(entry);
                labels.extend(&points);
                let number = |label: Label| number(tokens, label.0, "L");
                let resume_points = points.into_iter().map(number).collect();
                module.tasks.push(Task { name, entry: number(entry), resume_points });
            }
            Item::TrapSite(site) => module.trap_sites.push(site),
            Item::Statement(statement) => module.statements.push(statement),
            Item::File(file) => module.files.push(file),
            Item::Func(text) => {
                let mut func = FuncResolver {
                    tokens,
                    module: &module,
                    labels: &mut labels,
                    values: HashMap::new(),
                    func: FuncData {
                        name: text.name.clone(),
                        local_bits: text.local_bits,
                        ..FuncData::default()
                    },
                };
                func.define(&text)?;
                func.fill(text)?;
                let func = func.func;
                module.funcs.push(func);
            }
        }
    }
    let count: usize = module.funcs.iter().map(|func| func.entries.len()).sum();
    for label in labels {
        let number = number(tokens, label.0, "L");
        if number as usize >= count {
            let message = format!("L{number} is nowhere: there are {count} labels, from L0");
            return Err(tokens.error(label.index(), message));
        }
    }
    module.label_count = count as u32;
    Ok(module)
}

/// The number in the name that the token with an index holds; `u32::MAX` if it holds none.
fn number(tokens: &Tokens<'_>, token: u32, prefix: &str) -> u32 {
    match tokens.tokens.get(token as usize) {
        Some(Token::Word(word)) => number_in_name(prefix, word).unwrap_or(u32::MAX),
        _ => u32::MAX,
    }
}

/// A function while its names are looked up.
struct FuncResolver<'a> {
    tokens: &'a Tokens<'a>,
    /// What is above the function.
    module: &'a Module,
    labels: &'a mut Vec<Label>,
    /// For each number of a value in the text the value.
    values: HashMap<u32, Value>,
    func: FuncData,
}

impl FuncResolver<'_> {
    fn number(&self, token: u32, prefix: &str) -> u32 {
        number(self.tokens, token, prefix)
    }

    /// Enters what the function defines: blocks, labels, parameters and results.
    fn define(&mut self, text: &Func) -> Result<(), ParseError> {
        let mut insts = 0;
        for (block, text) in (0..).map(Block).zip(&text.blocks) {
            if self.number(text.head.0, "block") != block.0 {
                let message = format!("the next block is {block}: blocks are in order");
                return Err(self.tokens.error(text.head.index(), message));
            }
            let mut data = BlockData {
                cold: text.cold,
                optimize_for_size: text.small,
                ..BlockData::default()
            };
            for param in &text.params {
                match *param {
                    Param::Label(label) => {
                        let label = Label(self.number(label.0, "L"));
                        self.func.entries.push((label, block));
                    }
                    Param::Value(token, ty) => {
                        let def = ValueDef::Param(block, data.params.len() as u32);
                        data.params.push(self.define_value(token, ty, def)?);
                    }
                }
            }
            self.func.blocks.push(data);
            for line in &text.lines {
                let Line::Inst(result, _) = line else { continue };
                let def = ValueDef::Result(Inst(insts));
                let result =
                    result.map(|(token, ty)| self.define_value(token, ty, def)).transpose()?;
                self.func.results.push(result);
                insts += 1;
            }
        }
        self.func.entries.sort_unstable();
        Ok(())
    }

    /// Adds a value under the number that its token names.
    fn define_value(&mut self, token: Value, ty: Type, def: ValueDef) -> Result<Value, ParseError> {
        let number = self.number(token.0, "v");
        let value = self.func.values.push(ValueData { ty, def });
        match self.values.insert(number, value) {
            None => Ok(value),
            Some(_) => Err(self.tokens.error(token.index(), format!("v{number} is defined twice"))),
        }
    }

    /// Enters instructions and terminators, with what they use.
    fn fill(&mut self, text: Func) -> Result<(), ParseError> {
        let mut loc = StatementId::NONE;
        for (block, text) in (0..).map(Block).zip(text.blocks) {
            let BlockText { lines, terminator, .. } = text;
            let mut insts = vec![];
            for line in lines {
                match line {
                    Line::Location(next) => loc = next,
                    Line::Inst(_, data) => {
                        let data = self.inst(data)?;
                        insts.push(self.func.insts.push(data));
                        self.func.locs.push(loc);
                    }
                }
            }
            let terminator = self.terminator(terminator)?;
            if let Some(data) = self.func.blocks.get_mut(block) {
                data.insts = insts;
                data.terminator = Some(terminator);
            }
        }
        Ok(())
    }

    fn inst(&self, mut data: InstData) -> Result<InstData, ParseError> {
        let mut found = Ok(());
        data.for_each_arg_mut(|value| self.resolve_value(value, &mut found));
        found?;
        if let InstData::Load { ty: _, at } | InstData::Store { at, value: _ } = &mut data {
            at.region = self.resolve_region(at.region)?;
        }
        Ok(data)
    }

    fn terminator(&mut self, mut data: Terminator) -> Result<Terminator, ParseError> {
        let mut found = Ok(());
        data.for_each_arg_mut(|value| self.resolve_value(value, &mut found));
        data.for_each_block_mut(|block| self.resolve_block(block, &mut found));
        found?;
        if let Terminator::Goto(label) | Terminator::Suspend(label) = &mut data {
            self.labels.push(*label);
            *label = Label(self.number(label.0, "L"));
        }
        Ok(data)
    }

    /// Replaces the index of a token by the value that the token names. Keeps the first error.
    fn resolve_value(&self, value: &mut Value, found: &mut Result<(), ParseError>) {
        let number = self.number(value.0, "v");
        match self.values.get(&number) {
            Some(&known) => *value = known,
            None if found.is_ok() => {
                let message = format!("v{number} is defined nowhere");
                *found = Err(self.tokens.error(value.index(), message));
            }
            None => {}
        }
    }

    /// Replaces the index of a token by the block that the token names. Keeps the first error.
    fn resolve_block(&self, block: &mut Block, found: &mut Result<(), ParseError>) {
        let number = Block(self.number(block.0, "block"));
        let count = self.func.blocks.len();
        if number.index() < count {
            *block = number;
        } else if found.is_ok() {
            let message = format!("{number} is not there; there are {count}");
            *found = Err(self.tokens.error(block.index(), message));
        }
    }

    /// The region whose name the token with an index holds.
    fn resolve_region(&self, token: RegionId) -> Result<RegionId, ParseError> {
        let name = match self.tokens.tokens.get(token.index()) {
            Some(Token::Word(word)) => *word,
            _ => "",
        };
        if name == LOCAL_BITS_NAME {
            return Ok(RegionId::LOCAL_BITS);
        }
        match self.module.regions.iter().position(|region| region.name == name) {
            Some(index) => Ok(RegionId(index as u32)),
            None => {
                let message =
                    format!("`{name}` is not a region; regions come before the functions");
                Err(self.tokens.error(token.index(), message))
            }
        }
    }
}
