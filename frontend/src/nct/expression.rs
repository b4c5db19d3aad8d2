//! One expression or condition of NCT, checked against a program, for conditions of breakpoints,
//! for triggers and for watches.
//!
//! NCT has statements that load and compute in OP, and conditions that follow them. Both are
//! expressions here, read by the parser that reads programs:
//!
//! | expression | value |
//! | --- | --- |
//! | a variable as traces name it: `I002`, `F020`, `Y40`, `RH060`, `Q05`, `T00`, `RP001` | its value; of a bit true or false |
//! | a condition as it stands in a program: `NF0103`, `(I000 A NI001)`, `(I000 A =5)` | true or false |
//! | statements that load and compute: `LF020 + LF022`, `[LF020 * 3] >>2 BIN` | OP after them |
//! | such statements and a condition after them: `LF020 =5`, `LRH060 (>.00FF O I000)` | true or false |
//!
//! At the beginning OP has the value that the module which ran last left in it, so a relation that
//! stands alone, such as `=5`, tests that value. Status flags that a computation writes are seen by
//! what follows it, but those in the image do not change. Statements that change variables
//! (`U`, `D`, `S`), jump or end are refused. `V` compares the input images of the module that ran
//! last.
//!
//! ```
//! use plcc_diag::SourceMap;
//! use plcc_frontend::common::{MemoryLoader, Options, Value};
//! use plcc_frontend::nct;
//!
//! let mut sources = SourceMap::new();
//! let file = sources.add("mill.nct", b":001 LF020 =5 U012 Z J1 :000 J0");
//! let (program, _) = nct::check(&mut sources, file, &MemoryLoader::new(), &Options::default());
//! let program = program.ok_or("the program has errors")?;
//! let image_size = program.lower().map_err(|error| error.to_string())?.program.image_size;
//!
//! let reached = program.expression("LF020 >=5").map_err(|all| all.len().to_string())?;
//! assert_eq!(reached.variables(), ["F020"]);
//! assert_eq!(reached.evaluate(&vec![0; image_size as usize]), Ok(Value::Logical(false)));
//!
//! let wrong = program.expression("(I000 A I00)").unwrap_err();
//! assert_eq!((wrong[0].code, wrong[0].span.start), ("NCT-9", 8));
//! # Ok::<(), String>(())
//! ```

use std::sync::Arc;

use plcc_abi::Region;
use plcc_abi::nct::context;
use plcc_diag::{Diagnostic, FileId};
use plcc_ir::Type;

use crate::common::{Evaluate, EvaluationError, Expression, ExpressionCode, Value};
use crate::nct::{
    Program,
    ast::{self, Op, Operand, Stmt, Texts, Variable, Word},
    layout::{Layout, SCRATCH},
    lower::lower,
    oracle::{Computed, compute},
    read::{
        cursor::Cursor,
        diagnostic::{SyntaxError, error},
        operand::{Prefix, variable},
        parser::{Parsed, parse},
    },
    tables::{each_variable, tested_variable},
};

/// The module as which an expression is lowered.
const EXPRESSION_MODULE: u16 = 1;

/// The file in which the places of an expression's errors lie.
const FILE: FileId = FileId(0);

impl Program {
    /// The expression `text` over the program's variables.
    ///
    /// # Errors
    /// What is wrong with it. Places are offsets in `text`, in the file 0: a source map that holds
    /// the text alone draws them.
    pub fn expression(&self, text: &str) -> Result<Expression, Vec<Diagnostic>> {
        let (parsed, is_bit) = self.parsed(text)?;
        let mut variables: Vec<String> = vec![];
        let mut add = |variable: Variable| {
            let name = variable.to_string();
            if !variables.contains(&name) {
                variables.push(name);
            }
        };
        for stmt in &parsed.stmts {
            each_variable(&stmt.op, &mut add);
        }
        parsed.condition_parts.iter().filter_map(tested_variable).for_each(add);
        let image_size = self.layout.size;
        // The values of OP that brackets keep are placed after the image.
        let layout = Layout { scratch: image_size, ..Layout::clone(&self.layout) };
        let Parsed { stmts, condition_parts, slots, .. } = parsed;
        let statements = ast::Program {
            name: String::new(),
            text: String::new(),
            lines: vec![],
            stmts,
            condition_parts,
            labels: vec![],
            texts: Texts::default(),
            slots,
        };
        let evaluator = Evaluator { statements, layout: Arc::new(layout), is_bit };
        Ok(Expression::new(text, variables, image_size as usize, evaluator))
    }

    /// The statements of an expression, and whether it is the name of a bit.
    fn parsed(&self, text: &str) -> Result<(Parsed, bool), Vec<Diagnostic>> {
        Ok(match single_variable(text) {
            Some((variable, stmt)) => {
                let is_bit = matches!(variable, Variable::Bit(_));
                (Parsed { stmts: vec![stmt], ..Parsed::default() }, is_bit)
            }
            None => (self.statements(text)?, false),
        })
    }

    /// The expression `text` as code, which leaves its value in register OP; `None` where something about it can't be lowered,
    /// and where it reads at an address that is in a word, since it may have no value then.
    ///
    /// # Errors
    /// What is wrong with it, as [`expression`](Self::expression) says it.
    pub(super) fn expression_code(
        &self,
        text: &str,
    ) -> Result<Option<ExpressionCode>, Vec<Diagnostic>> {
        let expression = self.expression(text)?;
        if expression.variables().iter().any(|name| name.starts_with("FI")) {
            return Ok(None);
        }
        let (parsed, _) = self.parsed(text)?;
        Ok(self.lower_expression(parsed))
    }

    fn lower_expression(&self, parsed: Parsed) -> Option<ExpressionCode> {
        let Parsed { mut stmts, condition_parts, slots, .. } = parsed;
        let span = stmts.first()?.span;
        let statement = |op| Stmt { op, span };
        stmts.insert(0, statement(Op::Label(EXPRESSION_MODULE)));
        // What comes of a condition is put into OP.
        let is_condition = stmts.iter().any(|stmt| matches!(stmt.op, Op::If { .. }));
        if is_condition {
            stmts.retain(|stmt| !matches!(stmt.op, Op::EndIf));
            let otherwise = stmts.len() as u32 + 1;
            for stmt in &mut stmts {
                if let Op::If { otherwise: to, .. } = &mut stmt.op {
                    *to = otherwise;
                }
            }
            let load = |value| statement(Op::Load(Operand::Const(value)));
            let otherwise = [Op::Else { end: otherwise + 2 }].map(statement);
            stmts.push(load(1));
            stmts.extend(otherwise);
            stmts.extend([load(0), statement(Op::EndIf)]);
        }
        stmts.push(statement(Op::End(EXPRESSION_MODULE as u8)));
        let mut labels = vec![None; usize::from(EXPRESSION_MODULE) + 1];
        *labels.last_mut()? = Some(0);
        let statements = ast::Program {
            name: String::new(),
            text: String::new(),
            lines: vec![1; stmts.len()],
            stmts,
            condition_parts,
            labels,
            texts: Texts::default(),
            slots,
        };
        // The values of OP that brackets keep are placed after the image.
        let mut layout = Layout::clone(&self.layout);
        let scratch = layout.size.next_multiple_of(8);
        let size = (u32::from(slots) * 2 + 8).next_multiple_of(8);
        let at = layout.regions.iter().position(|region| region.name == SCRATCH)?;
        let region = layout.regions.remove(at);
        layout.regions.push(Region { offset: scratch, size, ..region });
        (layout.scratch, layout.size) = (scratch, scratch + size);
        let result = layout.context + context::OP;
        let module = lower(&statements, &layout).ok()?.module;
        Some(ExpressionCode { module, result, ty: Type::I16 })
    }

    /// Parses statements that load and compute, and at most one condition after them.
    fn statements(&self, text: &str) -> Result<Parsed, Vec<Diagnostic>> {
        let (parsed, found) = parse(FILE, text, self.limits);
        if !found.is_empty() {
            return Err(found);
        }
        let mut condition = None;
        for stmt in &parsed.stmts {
            let problem = match stmt.op {
                Op::Load(_) | Op::Arith { .. } | Op::Shift { .. } | Op::Bin | Op::Bcd
                    if condition.is_some() =>
                {
                    Some("nothing may follow the condition")
                }
                Op::If { .. } if condition.is_some() => Some(
                    "an expression has one condition; combine several in parentheses: (I000 A I001)",
                ),
                Op::If { .. } => {
                    condition = Some(stmt.span);
                    None
                }
                Op::Load(_) | Op::Arith { .. } | Op::Shift { .. } | Op::Bin | Op::Bcd => None,
                Op::Push(_) | Op::Apply { .. } => None,
                Op::Set(bit) | Op::Clear(bit) => return Err(vec![*switches(stmt, bit)]),
                _ => Some("an expression loads, computes and tests; it changes nothing"),
            };
            if let Some(help) = problem {
                let message = "this does not belong to an expression";
                return Err(vec![*error(7, stmt.span, message, help)]);
            }
        }
        if parsed.stmts.is_empty() {
            let span = Cursor::new(FILE, text).span_here();
            let help = "write a variable, a condition, or statements that load and compute";
            return Err(vec![*error(7, span, "the expression is missing", help)]);
        }
        Ok(parsed)
    }
}

/// The error of a `U` or `D` in an expression.
fn switches(stmt: &Stmt, bit: ast::Bit) -> SyntaxError {
    let help = format!("to look at the bit, write {bit}");
    error(7, stmt.span, format!("this switches {bit}"), help)
}

/// The variable that the whole text names, if it is just one, with the statement that loads it.
fn single_variable(text: &str) -> Option<(Variable, Stmt)> {
    let mut cursor = Cursor::new(FILE, text);
    // A program can't load a physical output line, but an expression can, since traces show it.
    let prefix = if cursor.at('O') { Prefix::Store } else { Prefix::Load };
    let variable = variable(&mut cursor, 0, prefix).ok().filter(|_| cursor.peek().is_none())?;
    let op = Op::Load(Operand::Load { negate: false, place: variable });
    Some((variable, Stmt { op, span: cursor.span_from(0) }))
}

/// An expression's statements, for an image with room for the values of brackets after it.
#[derive(Debug)]
struct Evaluator {
    statements: ast::Program,
    layout: Arc<Layout>,
    /// Whether the expression is the name of a bit.
    is_bit: bool,
}

impl Evaluate for Evaluator {
    fn evaluate(&self, image: &[u8]) -> Result<Value, EvaluationError> {
        let mut image = image.to_vec();
        image.resize(image.len() + usize::from(self.statements.slots) * 2, 0);
        match compute(&self.statements, &self.layout, &mut image) {
            Computed::Op(bit) if self.is_bit => Ok(Value::Logical(bit != 0)),
            Computed::Op(value) => Ok(Value::Integer(value.into())),
            Computed::Condition(holds) => Ok(Value::Logical(holds)),
            Computed::NoAddress(word) => {
                Err(EvaluationError::NoAddress { name: Word::Indirect(word).to_string() })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use plcc_diag::SourceMap;

    use super::*;
    use crate::common::{MemoryLoader, Options};

    /// A program with its image, in which I002, F0201 (F020 is 2), RH060 = 300, T00 = 7 and F030,
    /// the address 20 in BCD, are set.
    fn program() -> (Program, Vec<u8>) {
        let text = ":001 I002 U012 Z LF020 SF022 J1 :000 LF030 J0";
        let mut sources = SourceMap::new();
        let file = sources.add("a.nct", text.as_bytes());
        let (program, all) =
            crate::nct::check(&mut sources, file, &MemoryLoader::new(), &Options::default());
        let program = program.unwrap_or_else(|| panic!("{all:?}"));
        let mut image = vec![0; program.layout.size as usize];
        let layout = &program.layout;
        for (space, byte, value) in [
            (ast::Space::I, 0, 0b100),
            (ast::Space::F, 20, 2),
            (ast::Space::F, 30, 0x20),
            (ast::Space::F, 40, 0xAA),
        ] {
            layout.location(space, byte).unwrap().write(&mut image, value);
        }
        for (word, value) in [(Word::Rh(60), 300), (Word::T(0), 7)] {
            plcc_abi::image::write_u16(&mut image, layout.register(word).unwrap(), value);
        }
        (program, image)
    }

    #[test]
    fn variables_conditions_and_computations_have_values() {
        let (program, mut image) = program();
        let before = image.clone();
        for (text, expected) in [
            ("I002", Value::Logical(true)),
            ("I003", Value::Logical(false)),
            ("NI003", Value::Logical(true)),
            ("I00", Value::Integer(4)),
            ("F020", Value::Integer(2)),
            (" F 0 2 0 ", Value::Integer(2)),
            ("F0201", Value::Logical(true)),
            ("RH060", Value::Integer(300)),
            ("T00", Value::Integer(7)),
            ("NT00", Value::Logical(false)),
            ("O012", Value::Logical(false)),
            ("FI030", Value::Integer(2)),
            ("V002", Value::Logical(true)),
            ("(I002 A NI003)", Value::Logical(true)),
            ("=0", Value::Logical(true)),
            ("LF020 =2", Value::Logical(true)),
            ("LF020 (I003 O >1)", Value::Logical(true)),
            ("LRH060 - LF020 *2", Value::Integer(596)),
            (",6 + [LF020 * [LF020 + 1]]", Value::Integer(12)),
            (",5 - 5 F0046", Value::Logical(true)),
            ("LRH060 >>2 <=.004B", Value::Logical(true)),
        ] {
            let expression =
                program.expression(text).unwrap_or_else(|all| panic!("{text}: {all:?}"));
            assert_eq!(expression.evaluate(&image), Ok(expected), "{text}");
            assert_eq!(image, before, "{text}");
        }
        image.pop();
        let wrong = program.expression("I002").unwrap().evaluate(&image);
        assert!(matches!(wrong, Err(EvaluationError::WrongImage { .. })));
    }

    #[test]
    fn an_expression_lists_its_variables_and_refuses_words_that_are_no_address() {
        let (program, image) = program();
        let expression = program.expression("LF020 + LRH060 (I002 A NI002 O >LFI040)").unwrap();
        assert_eq!(expression.variables(), ["F020", "RH060", "I002", "FI040"]);
        let refused = program.expression("FI040").unwrap().evaluate(&image);
        assert_eq!(refused, Err(EvaluationError::NoAddress { name: "FI040".into() }));
    }

    #[test]
    fn errors_have_their_place() {
        let (program, _) = program();
        for (text, code, start) in [
            ("", "NCT-7", 0),
            ("U012", "NCT-7", 0),
            ("LF020 SF022", "NCT-7", 6),
            ("I002 I003", "NCT-7", 5),
            ("I002 LF020", "NCT-7", 5),
            ("(I002 A", "NCT-11", 0),
            ("(I002 B)", "NCT-62", 6),
            ("Q40", "NCT-42", 0),
            ("P400", "NCT-60", 0),
            ("LF020 +LI002", "NCT-7", 6),
            ("i002", "NCT-44", 0),
            (":010", "NCT-7", 0),
            ("J1", "NCT-7", 0),
            ("I00 =5", "NCT-9", 0),
        ] {
            let all = program.expression(text).unwrap_err();
            let first = all.first().map(|d| (d.code, d.span.start));
            assert_eq!(first, Some((code, start)), "{text}: {all:?}");
        }
    }
}
