//! Prints a module in the text form.

use std::fmt::{self, Write};

use plcc_abi::{SourceLine, TrapSite};

use crate::func::LOCAL_BITS_NAME;
use crate::{
    Address, BitGroups, Block, BlockCall, Field, FuncData, InstData, Module, PrimaryMap, RegionId,
    SecondaryMap, StatementId, Terminator, Value,
};

/// The column in which a comment begins. After a longer line it follows at once.
const COMMENT: usize = 40;

/// Prints a module. [`parse`](super::parse()) reads the text back as the same module.
pub fn print(module: &Module) -> String {
    let mut out = String::new();
    // Writing to a string does not fail.
    let _ = write_module(&mut out, module);
    out
}

fn write_module(out: &mut String, module: &Module) -> fmt::Result {
    writeln!(out, "image {}", module.image_size)?;
    for (region, number) in module.regions.iter().zip(0..) {
        write!(out, "region {} at {} size {}", region.name, region.offset, region.size)?;
        let finite = module.finite_regions.contains(&RegionId(number));
        out.push_str(if region.bits { " bits" } else { "" });
        out.push_str(if finite { " finite" } else { "" });
        let words = module.word_regions.contains(&RegionId(number));
        out.push_str(if words { " words24\n" } else { "\n" });
    }
    for task in &module.tasks {
        write!(out, "task {} L{}", quoted(&task.name), task.entry)?;
        if !task.resume_points.is_empty() {
            let labels: Vec<String> = task.resume_points.iter().map(|l| format!("L{l}")).collect();
            write!(out, " resume [{}]", labels.join(", "))?;
        }
        writeln!(out)?;
    }
    for (_, func) in module.funcs() {
        out.push('\n');
        Printer::new(module, func).function(out)?;
    }
    if !module.trap_sites.is_empty() {
        out.push('\n');
    }
    for TrapSite { code, statement: SourceLine { file, line }, array } in &module.trap_sites {
        write!(out, "trap_site {} file {file} line {line}", code.name())?;
        if let Some(array) = array {
            write!(out, " array {array}")?;
        }
        writeln!(out)?;
    }
    if !module.statements.is_empty() {
        out.push('\n');
    }
    for statement in &module.statements {
        let (file, line) = (statement.file, statement.line);
        let (from, to) = (statement.start, statement.end);
        writeln!(out, "statement file {file} line {line} from {from} to {to}")?;
    }
    for file in &module.files {
        writeln!(out, "\nfile {}", quoted(&file.name))?;
        for line in file.text.split('\n') {
            writeln!(out, "| {}", escaped(line))?;
        }
    }
    Ok(())
}

/// A string in quotes.
fn quoted(text: &str) -> String {
    format!("\"{}\"", escaped(text).replace('"', "\\{22}").replace('\n', "\\{a}"))
}

/// Text with an escape in place of each backslash and each control character but tabs and line
/// ends.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\\' => out.push_str("\\\\"),
            '\r' => out.push_str("\\r"),
            c if c.is_control() && c != '\t' && c != '\n' => {
                let _ = write!(out, "\\{{{:x}}}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out
}

/// The local bits of groups of eight bits: `local_bits:24[0, 2]`.
fn bit_groups(groups: BitGroups) -> String {
    let numbers: Vec<String> = groups.iter().map(|group| group.to_string()).collect();
    format!("{LOCAL_BITS_NAME}:{}[{}]", groups.first, numbers.join(", "))
}

struct Printer<'a> {
    module: &'a Module,
    func: &'a FuncData,
    /// For each value its number in the text, counted in the order of definitions.
    numbers: SecondaryMap<Value, u32>,
}

impl<'a> Printer<'a> {
    fn new(module: &'a Module, func: &'a FuncData) -> Self {
        let mut numbers = SecondaryMap::with_default(u32::MAX);
        numbers.resize(func.value_count());
        let mut next = 0;
        for (_, block) in func.blocks() {
            let results = block.insts.iter().filter_map(|&inst| func.result(inst));
            for value in block.params.iter().copied().chain(results) {
                if let Some(number) = numbers.get_mut(value) {
                    *number = next;
                }
                next += 1;
            }
        }
        Self { module, func, numbers }
    }

    #[allow(clippy::indexing_slicing, reason = "a SecondaryMap has a value for every key")]
    fn value(&self, value: Value) -> Value {
        Value(self.numbers[value])
    }

    fn values(&self, values: &[Value]) -> String {
        let names: Vec<String> = values.iter().map(|&v| self.value(v).to_string()).collect();
        names.join(", ")
    }

    fn function(&self, out: &mut String) -> fmt::Result {
        write!(out, "fn {}", quoted(self.func.name()))?;
        match self.func.local_bits() {
            0 => writeln!(out, " {{")?,
            count => writeln!(out, " {LOCAL_BITS_NAME} {count} {{")?,
        }
        let mut labels = PrimaryMap::from(vec![vec![]; self.func.block_count()]);
        for &(label, block) in self.func.entries() {
            if let Some(labels) = labels.get_mut(block) {
                labels.push(label.to_string());
            }
        }
        let mut loc = StatementId::NONE;
        for ((block, data), labels) in self.func.blocks().zip(labels.values()) {
            write!(out, "{block}")?;
            let typed = |&param: &Value| format!("{}: {}", self.value(param), self.func.ty(param));
            let params: Vec<String> = data.params.iter().map(typed).collect();
            if !params.is_empty() {
                write!(out, "({})", params.join(", "))?;
            }
            if !labels.is_empty() {
                write!(out, " ({})", labels.join(", "))?;
            }
            out.push_str(if data.cold { " cold" } else { "" });
            out.push_str(if data.optimize_for_size { " small:\n" } else { ":\n" });
            for &inst in &data.insts {
                let next = self.func.loc(inst);
                if next != loc {
                    loc = next;
                    self.location(out, loc)?;
                }
                out.push_str("    ");
                if let Some(result) = self.func.result(inst) {
                    write!(out, "{}: {} = ", self.value(result), self.func.ty(result))?;
                }
                self.inst(out, self.func.inst(inst))?;
                out.push('\n');
            }
            if let Some(terminator) = &data.terminator {
                out.push_str("    ");
                self.terminator(out, terminator)?;
                out.push('\n');
            }
        }
        out.push_str("}\n");
        Ok(())
    }

    fn location(&self, out: &mut String, loc: StatementId) -> fmt::Result {
        if loc == StatementId::NONE {
            out.push_str("    @none\n");
            return Ok(());
        }
        let line = format!("    {loc}");
        let statement = self.module.statements.get(loc.index());
        let text = statement.map_or("", |statement| self.module.statement_text(statement));
        if text.is_empty() {
            writeln!(out, "{line}")
        } else {
            writeln!(out, "{line:COMMENT$};; {}", escaped(text))
        }
    }

    fn inst(&self, out: &mut String, data: &InstData) -> fmt::Result {
        let value = |value| self.value(value);
        match *data {
            InstData::Iconst { ty: _, value } => write!(out, "iconst {value}"),
            InstData::Fconst { bits } => {
                let number = f64::from_bits(bits);
                if number.is_finite() {
                    write!(out, "fconst {number:?}")
                } else {
                    write!(out, "fconst {bits:#x}")
                }
            }
            InstData::Unary { op, arg } => write!(out, "{} {}", op.name(), value(arg)),
            InstData::Binary { op, args } => write!(out, "{} {}", op.name(), self.values(&args)),
            InstData::Icmp { cond, args } => {
                write!(out, "icmp {} {}", cond.name(), self.values(&args))
            }
            InstData::Fcmp { cond, args } => {
                write!(out, "fcmp {} {}", cond.name(), self.values(&args))
            }
            InstData::Select { cond, args } => {
                write!(out, "select {}, {}", value(cond), self.values(&args))
            }
            InstData::Convert { op, to: _, arg } => write!(out, "{} {}", op.name(), value(arg)),
            InstData::Bit { arg, number } => write!(out, "bit {}, {number}", value(arg)),
            InstData::Extract { op, arg, field: Field { first, width } } => {
                write!(out, "{} {}, {first}, {width}", op.name(), value(arg))
            }
            InstData::Insert { args, field: Field { first, width } } => {
                write!(out, "insert {}, {first}, {width}", self.values(&args))
            }
            InstData::Load { ty: _, at } => write!(out, "load {}", self.address(&at)),
            InstData::Store { at, value: stored } => {
                write!(out, "store {}, {}", self.address(&at), value(stored))
            }
            InstData::Unpack { word, to } => {
                write!(out, "unpack {}, {}", value(word), bit_groups(to))
            }
            InstData::Pack { from } => write!(out, "pack {}", bit_groups(from)),
            InstData::IsLate => write!(out, "is_late"),
            InstData::HostCall { function, args } => {
                write!(out, "hostcall {}({})", function.name(), self.values(args.as_slice()))
            }
        }
    }

    fn address(&self, at: &Address) -> String {
        let volatile = if at.volatile { "volatile " } else { "" };
        let place = format!("{volatile}{}:{}", self.region(at.region), at.offset);
        match at.index {
            None => place,
            Some(index) => {
                let value = self.value(index.value);
                format!("{place}[{value} * {}, {}]", index.scale, index.count)
            }
        }
    }

    fn region(&self, region: RegionId) -> String {
        if region == RegionId::LOCAL_BITS {
            return LOCAL_BITS_NAME.to_owned();
        }
        self.module.region(region).map_or_else(|| region.to_string(), |data| data.name.clone())
    }

    fn terminator(&self, out: &mut String, terminator: &Terminator) -> fmt::Result {
        match terminator {
            Terminator::Jump(call) => write!(out, "jump {}", self.call(call)),
            Terminator::Brif { cond, then, otherwise } => {
                let cond = self.value(*cond);
                write!(out, "brif {cond}, {}, {}", self.call(then), self.call(otherwise))
            }
            Terminator::Switch { arg, targets, default } => {
                let targets: Vec<String> = targets.iter().map(Block::to_string).collect();
                write!(out, "switch {}, [{}], {default}", self.value(*arg), targets.join(", "))
            }
            Terminator::Goto(label) => write!(out, "goto {label}"),
            Terminator::GotoIndirect(label) => write!(out, "goto_indirect {}", self.value(*label)),
            Terminator::Suspend(label) => write!(out, "suspend {label}"),
            Terminator::Return => write!(out, "return"),
            Terminator::Trap(code) => write!(out, "trap {}", code.name()),
            Terminator::TrapAt { site, index } => {
                write!(out, "trap_at {}", self.values(&[*site, *index]))
            }
        }
    }

    fn call(&self, call: &BlockCall) -> String {
        match call.args.as_slice() {
            [] => call.block.to_string(),
            args => format!("{}({})", call.block, self.values(args)),
        }
    }
}
