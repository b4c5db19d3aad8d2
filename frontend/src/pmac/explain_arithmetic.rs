//! The text that `--explain-arithmetic` prints: for each statement whether integers or doubles compute it, and why.
//!
//! It is read from what the compiler makes of the statement: the passes that find integers are run, and the
//! instructions of the statement that are executed as a rule are looked at. Cold blocks, which compute with doubles
//! what is not an integer after all, and general code for moved definitions do not count.

use std::collections::HashMap;
use std::fmt::Write as _;

use plcc_abi::pmac::layout::region;
use plcc_abi::{HostFn, HostType};
use plcc_diag::SourceMap;
use plcc_ir::passes::{self, Pass, PassOptions, PassSet};
use plcc_ir::{
    Address, BinaryOp, ConvertOp, FuncData, InstData, Module, ROUNDING, Statement, Type, UnaryOp,
    Value,
};

use crate::pmac::analyse::load::Loaded;
use crate::pmac::ast::Download;
use crate::pmac::tasks::{TaskKind, tasks};

/// The passes that decide between integers and doubles. Those after them make the same shorter.
const PASSES: [Pass; 5] =
    [Pass::Branches, Pass::Integers, Pass::SpeculateVariables, Pass::Speculate, Pass::Dce];

/// The bytes of a variable.
const SIZE: u32 = 8;

/// How a statement is computed.
#[derive(Default)]
struct Arithmetic {
    /// Whether anything is computed; else values are only copied.
    computes: bool,
    /// The operations on doubles, in words, each once.
    doubles: Vec<String>,
    /// What is checked to be an integer, in words, each once.
    checked: Vec<String>,
}

/// A statement by its place: file, first byte, byte after the last.
type At = (u32, u32, u32);

/// The text for a download, of which `module` is what lowering made. Under the name of each PLC and PLCC it has a line
/// for each statement that computes something: file, line, source, whether that is computed in integers, and which
/// operations are on doubles. The last line counts the statements without and with such.
pub(crate) fn explain(
    download: &Download,
    loaded: &Loaded,
    sources: &SourceMap,
    mut module: Module,
) -> String {
    let passes = PASSES.into_iter().fold(PassSet::NONE, PassSet::with);
    passes::optimize(&mut module, PassOptions::from(passes));
    let mut found = arithmetic(&module);
    let mut out = String::new();
    let (mut integer, mut real) = (0, 0);
    for (kind, code) in tasks(download, loaded) {
        if matches!(kind, TaskKind::Command(_)) {
            continue;
        }
        let _ = writeln!(out, "{}", kind.name());
        for stmt in code.iter().filter(|stmt| Download::computed(&stmt.kind).is_some()) {
            let (span, _) = download.origins.place(stmt.at);
            // Statements that a macro wrote are at one place, and told of once.
            let Some(how) = found.remove(&(span.file.0, span.start, span.end)) else { continue };
            integer += u32::from(how.computes && how.doubles.is_empty());
            real += u32::from(!how.doubles.is_empty());
            let line = sources.line(span.file, span.start);
            let text = sources.text(span.file);
            let source = text.get(span.start as usize..span.end as usize).unwrap_or("");
            let (source, path) = (uncommented(source), sources.path(span.file));
            let _ = writeln!(out, "  {path}:{line}: {source}: {}", how.in_words());
        }
    }
    let _ = writeln!(out, "{integer} in integers, {real} in floating point");
    out
}

/// A statement on one line, without the comments inside it.
fn uncommented(source: &str) -> String {
    let mut words = Vec::new();
    for line in source.lines() {
        let mut quoted = false;
        let end = line.char_indices().find_map(|(at, c)| {
            quoted ^= c == '"';
            let comment = c == ';' || line.get(at..).is_some_and(|rest| rest.starts_with("//"));
            (comment && !quoted).then_some(at)
        });
        words.extend(line.get(..end.unwrap_or(line.len())).unwrap_or("").split_whitespace());
    }
    words.join(" ")
}

impl Arithmetic {
    fn in_words(&self) -> String {
        let integer = match self.checked.as_slice() {
            [] if !self.computes => "copied".into(),
            [] => "integer".into(),
            [name] => format!("integer while {name} holds an integer"),
            names => format!("integer while {} hold integers", names.join(", ")),
        };
        match self.doubles.as_slice() {
            [] => integer,
            doubles if self.checked.is_empty() => format!("floating point: {}", doubles.join(", ")),
            doubles => format!("floating point: {}; all else {integer}", doubles.join(", ")),
        }
    }
}

/// How each statement is computed, by the instructions that are executed as a rule.
fn arithmetic(module: &Module) -> HashMap<At, Arithmetic> {
    let mut found: HashMap<At, Arithmetic> = HashMap::new();
    for (_, func) in module.funcs() {
        for (_, block) in func.blocks().filter(|(_, b)| !b.cold && !b.optimize_for_size) {
            for &inst in &block.insts {
                let statement = module.statements.get(func.loc(inst).index());
                if let Some(&Statement { file, line: _, start, end }) = statement {
                    let how = found.entry((file, start, end)).or_default();
                    how.add(module, func, func.inst(inst));
                }
            }
        }
    }
    found
}

impl Arithmetic {
    /// Adds an instruction to those that compute the statement.
    fn add(&mut self, module: &Module, func: &FuncData, data: &InstData) {
        if let Some(checked) = checked_by(func, data) {
            let name = described(module, func, checked);
            if !self.checked.contains(&name) {
                self.checked.push(name);
            }
            return;
        }
        let double = on_doubles(func, data);
        self.computes |= double.is_some()
            || matches!(
                data,
                InstData::Unary { .. }
                    | InstData::Binary { .. }
                    | InstData::Icmp { .. }
                    | InstData::Select { .. }
                    | InstData::Bit { .. }
                    | InstData::Extract { .. }
            );
        self.doubles.extend(double.filter(|double| !self.doubles.contains(double)));
    }
}

/// The double of which an instruction checks whether it is an integer.
fn checked_by(func: &FuncData, data: &InstData) -> Option<Value> {
    match *data {
        InstData::Convert { op: ConvertOp::IsInteger | ConvertOp::IsIntegerOrNan, to: _, arg } => {
            Some(arg)
        }
        InstData::Binary { op: BinaryOp::Fadd, args: [x, by] } => {
            (func.constant(by) == Some(ROUNDING.to_bits() as i64)).then_some(x)
        }
        _ => None,
    }
}

/// Whether a double is the integer that such a check makes of one.
fn is_rounded(func: &FuncData, value: Value) -> bool {
    let Some(&InstData::Convert { op: ConvertOp::IntToFloat, to: _, arg }) = func.def_inst(value)
    else {
        return false;
    };
    matches!(func.def_inst(arg), Some(InstData::Extract { .. })) && func.ty(arg) == Type::I64
}

/// The operation on doubles that an instruction is, in words; `None` if it is none, or belongs to a check.
fn on_doubles(func: &FuncData, data: &InstData) -> Option<String> {
    let distance = |value: Value| match func.def_inst(value) {
        Some(&InstData::Binary { op: BinaryOp::Fsub, args: [_, b] }) => is_rounded(func, b),
        _ => false,
    };
    let word = match *data {
        InstData::Unary { op, arg } => match op {
            UnaryOp::Fneg => "`-`",
            UnaryOp::Fabs if distance(arg) => return None,
            UnaryOp::Fabs => "ABS",
            UnaryOp::Fsqrt => "SQRT",
            UnaryOp::Ffloor | UnaryOp::Fceil | UnaryOp::Ftrunc => "INT",
            // It limits the result of another operation.
            UnaryOp::Ffinite | UnaryOp::Not | UnaryOp::Neg => return None,
        },
        InstData::Binary { op, args: [_, b] } => match op {
            // It makes -0 a 0.
            BinaryOp::Fadd if func.constant(b) == Some(0) => return None,
            BinaryOp::Fadd => "`+`",
            BinaryOp::Fsub if is_rounded(func, b) => return None,
            BinaryOp::Fsub => "`-`",
            BinaryOp::Fmul => "`*`",
            BinaryOp::Fdiv => "`/`",
            // The others are on integers.
            _ => return None,
        },
        InstData::Fcmp { cond: _, args: [a, _] } => {
            let is_check = match func.def_inst(a) {
                Some(&InstData::Unary { op: UnaryOp::Fabs, arg }) => distance(arg),
                _ => is_rounded(func, a),
            };
            if is_check {
                return None;
            }
            "a comparison"
        }
        InstData::HostCall { function, args: _ } => return on_doubles_by_host(function),
        _ => return None,
    };
    Some(word.to_owned())
}

/// What a host function does with doubles, in words; `None` if it gives no result, as where a value is only stored or
/// sent, or is not on doubles.
fn on_doubles_by_host(function: HostFn) -> Option<String> {
    let (args, result) = function.signature();
    if result.is_none() || !args.contains(&HostType::F64) && result != Some(HostType::F64) {
        return None;
    }
    Some(match function {
        HostFn::PmacAnd => "`&`".into(),
        HostFn::PmacOr => "`|`".into(),
        HostFn::PmacXor => "`^`".into(),
        HostFn::PmacMod => "`%`".into(),
        HostFn::PmacMRead => "an M-variable that the control reads".into(),
        HostFn::PmacBits | HostFn::PmacBcd | HostFn::PmacRange => "a conversion".into(),
        function => function.name().trim_start_matches("pmac_").to_uppercase(),
    })
}

/// A double that is checked, in words: the variable that it is loaded from, or the operation that computes it.
fn described(module: &Module, func: &FuncData, value: Value) -> String {
    match func.def_inst(value) {
        Some(InstData::Load { ty: _, at }) => variable(module, at),
        Some(data) => {
            on_doubles(func, data).map_or("a result".into(), |op| format!("the result of {op}"))
        }
        None => "a result".into(),
    }
}

/// A variable as users write it, such as `P145`.
fn variable(module: &Module, at: &Address) -> String {
    let number = at.offset / SIZE;
    match (module.region(at.region).map_or("", |region| region.name.as_ref()), at.index) {
        (region::P, None) => format!("P{number}"),
        (region::I, None) => format!("I{number}"),
        (region::P, Some(_)) => "P(…)".into(),
        (region::I, Some(_)) => "I(…)".into(),
        // The index is the coordinate system's, or computed.
        (region::Q, _) if number > 0 => format!("Q{number}"),
        (region::Q, _) => "a Q-variable".into(),
        _ => "a word of memory".into(),
    }
}
