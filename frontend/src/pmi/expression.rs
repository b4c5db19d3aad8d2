//! One expression or condition of PMI, checked against a program, for conditions of breakpoints,
//! for triggers and for watches.
//!
//! Whatever may be after the `=` of an assignment is an expression (PMI 2.3): arithmetic,
//! relations, logical operators, elements of arrays, the executive's `@` names, the program's
//! constants and keys. It is read by the parser that reads programs, with the same errors and the
//! same limits, and is evaluated as in a program: INTEGER results keep 16 bits, both sides of `&`
//! and `!` are computed. A name that the program does not know is an error (31). In a program an
//! assignment would declare it as a LOGICAL, but an expression assigns nothing.
//!
//! ```
//! use plcc_diag::SourceMap;
//! use plcc_frontend::common::{MemoryLoader, Options, Value};
//! use plcc_frontend::pmi;
//!
//! let mut sources = SourceMap::new();
//! let file = sources.add("pump.pmi", b"$INTEGER\nLEVEL, LIMIT = 50\n$END\nPUMP = LEVEL < LIMIT\n");
//! let (program, _) = pmi::check(&mut sources, file, &MemoryLoader::new(), &Options::default());
//! let program = program.ok_or("the program has errors")?;
//!
//! let low = program.expression("LEVEL < LIMIT / 2 & /@ESTOP").map_err(|all| all.len().to_string())?;
//! assert_eq!(low.variables(), ["LEVEL", "@ESTOP"]);
//! let image = vec![0; program.lower().map_err(|error| error.to_string())?.program.image_size as usize];
//! assert_eq!(low.evaluate(&image), Ok(Value::Logical(true)));
//!
//! let wrong = program.expression("LEVEL < LIMT").unwrap_err();
//! assert_eq!((wrong[0].code, wrong[0].span.start), ("PMI-31", 8));
//! # Ok::<(), String>(())
//! ```

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use plcc_abi::pmi::{Type, arithmetic};
use plcc_diag::{Diagnostic, FileId, Span};

use crate::common::{Evaluate, EvaluationError, Expression, ExpressionCode, Value};
use crate::pmi::{
    Program,
    analyse::{expression::ExpressionCheck, names::Names},
    ast::{Binary, Op, SymbolId},
    layout::Location,
    lower::lower_expression,
    read::{
        cursor::Cursor,
        diagnostic,
        expression::{ExpressionReader, Until},
        lexer::lex,
        split::Extent,
    },
};

/// The table of a program's names, which is made for the first expression. A debugger reads one for each of very many
/// variables, so that none of them may cost what the whole table costs.
#[derive(Clone, Debug, Default)]
pub(super) struct NameTable(Arc<OnceLock<Mutex<Names>>>);

impl Program {
    /// The operations of an expression in postfix order, and whether it is a LOGICAL.
    fn operations(&self, text: &str) -> Result<(Vec<Op>, bool), Vec<Diagnostic>> {
        let end = u32::try_from(text.len()).unwrap_or(u32::MAX);
        let mut tokens = vec![];
        lex(text, 0, end, self.limits, &mut tokens);
        let statement = Extent { file: FileId(0), start: 0, end, open: false };
        let mut cursor = Cursor::new(text, &tokens, statement);
        let table = self.names.0.get_or_init(|| Mutex::new(Names::of(&self.checked.symbols)));
        let mut names = table.lock().unwrap_or_else(PoisonError::into_inner);
        names.renew_suggestions();
        let mut ops = vec![];
        let mut parts = vec![];
        let mut read = ExpressionReader::new(&mut cursor, &mut parts, self.limits).read(Until::End);
        let check = ExpressionCheck::new(&cursor, &mut names, &mut ops);
        let checked = check.check(&mut read, &parts, None).map_err(|mut problem| {
            let help = diagnostic::default_help(problem.code).map(Into::into);
            problem.help = problem.help.or(help);
            vec![*problem]
        })?;
        Ok((ops, checked.ty == Some(Type::Logical)))
    }

    /// The expression `text` as code; `None` where something about it can't be lowered.
    ///
    /// # Errors
    /// What is wrong with it, as [`expression`](Self::expression) says it.
    pub(super) fn expression_code(
        &self,
        text: &str,
    ) -> Result<Option<ExpressionCode>, Vec<Diagnostic>> {
        let (ops, _) = self.operations(text)?;
        Ok(lower_expression(&self.checked, &self.layout, &ops).ok())
    }

    /// The expression `text` over the program's variables.
    ///
    /// # Errors
    /// What is wrong with it. Places are offsets in `text`, in the file 0: a source map that holds
    /// the text alone draws them.
    pub fn expression(&self, text: &str) -> Result<Expression, Vec<Diagnostic>> {
        let (ops, is_logical) = self.operations(text)?;
        let mut evaluator = Evaluator { is_logical, codes: vec![] };
        let mut variables: Vec<String> = vec![];
        for op in ops {
            let code = self.code(op, &mut variables).ok_or_else(|| {
                let span = Span::new(FileId(0), 0, text.len());
                vec![Diagnostic::error("PMI-45", span, "the program's variables have no place")]
            })?;
            evaluator.codes.push(code);
        }
        Ok(Expression::new(text, variables, self.layout.size as usize, evaluator))
    }

    /// An operation with the place of its variable; `None` if the layout has no place for it. The
    /// variable's name is added to `variables`.
    fn code(&self, op: Op, variables: &mut Vec<String>) -> Option<Code> {
        let place = |id: SymbolId, element: u32| {
            let symbol = self.checked.symbol(id)?;
            let offset = self.layout.offset(id)? + element * symbol.ty.size();
            Some((symbol, Location { offset, ty: symbol.ty }))
        };
        let (name, code) = match op {
            Op::Const(value) => return Some(Code::Constant(value)),
            Op::Neg { long } => return Some(Code::Negate { long }),
            Op::Not => return Some(Code::Not),
            Op::Binary(op) => return Some(Code::Binary(op)),
            Op::Load(id) => {
                let (symbol, place) = place(id, 0)?;
                (symbol.name.clone(), Code::Load(place))
            }
            Op::LoadAt(id, element) => {
                let (symbol, place) = place(id, element)?;
                (format!("{}[{element}]", symbol.name), Code::Load(place))
            }
            Op::Element(id) => {
                let (symbol, first) = place(id, 0)?;
                let (array, elements) = (symbol.name.clone(), symbol.elements?);
                (array.clone(), Code::Element { array, first, elements })
            }
        };
        if !variables.contains(&name) {
            variables.push(name);
        }
        Some(code)
    }
}

/// An operation of an expression in postfix order.
#[derive(Clone, Debug)]
enum Code {
    Constant(i32),
    Load(Location),
    /// Pops an index and pushes that element.
    Element {
        array: String,
        first: Location,
        elements: u32,
    },
    Negate {
        long: bool,
    },
    Not,
    Binary(Binary),
}

/// An expression with all names resolved.
#[derive(Debug)]
struct Evaluator {
    codes: Vec<Code>,
    is_logical: bool,
}

impl Evaluate for Evaluator {
    fn evaluate(&self, image: &[u8]) -> Result<Value, EvaluationError> {
        let mut stack: Vec<i32> = vec![];
        // The parser has made sure that no operator lacks an operand.
        let pop = |stack: &mut Vec<i32>| stack.pop().unwrap_or(0);
        for code in &self.codes {
            let value = match code {
                Code::Constant(value) => *value,
                Code::Load(place) => place.read(image),
                Code::Element { array, first, elements } => {
                    let index = pop(&mut stack);
                    let element = u32::try_from(index).ok().filter(|index| index < elements);
                    let Some(element) = element else {
                        let (array, index, elements) = (array.clone(), index.into(), *elements);
                        return Err(EvaluationError::NoElement { array, index, elements });
                    };
                    let offset = first.offset + element * first.ty.size();
                    Location { offset, ty: first.ty }.read(image)
                }
                Code::Negate { long } => arithmetic::negate(pop(&mut stack), *long),
                Code::Not => i32::from(pop(&mut stack) == 0),
                Code::Binary(op) => {
                    let right = pop(&mut stack);
                    arithmetic::binary(*op, pop(&mut stack), right)
                }
            };
            stack.push(value);
        }
        let value = pop(&mut stack);
        Ok(if self.is_logical { Value::Logical(value != 0) } else { Value::Integer(value.into()) })
    }
}

#[cfg(test)]
mod tests {
    use plcc_abi::{Engine, Scan, engine::NoHost, image};
    use plcc_diag::SourceMap;

    use super::*;
    use crate::common::{MemoryLoader, Options};

    const HEAD: &str =
        "$INTEGER\nI, J = 7, A[3], C[2] = [5, 6]\n$LONG\nL\n$KEY\nK1 = \"A\"\n$END\n";

    fn program(text: &str) -> Program {
        let mut sources = SourceMap::new();
        let file = sources.add("a.pmi", text.as_bytes());
        let (program, all) =
            crate::pmi::check(&mut sources, file, &MemoryLoader::new(), &Options::default());
        program.unwrap_or_else(|| panic!("{all:?}"))
    }

    /// What an assignment of an expression gives is what the expression gives.
    #[test]
    fn an_expression_has_the_value_that_its_assignment_stores() {
        for (text, expected) in [
            ("I + J * 2", 14),
            ("-I % 3 + 100000", 100_000),
            ("A[I] = C[1] ! L < 5", 1),
            ("A[C[0] - 3] & T", 0),
            ("300 * 300 / 9", 10_000),
            ("300 * 300", 24_464),
            ("K1 + K1", 2),
            ("/(@ESTOP ! @FRO > 3)", 1),
            ("J / 0", 7),
            ("X = F", 1),
        ] {
            let source = format!("{HEAD}L = {text}\nX = F\n");
            let program = program(&source);
            let mut image = vec![0; program.layout.size as usize];
            let expression = program.expression(text).unwrap();
            let value = expression.evaluate(&image).unwrap().number();
            program.interpreter().call(0, None, &mut Scan::new(&mut image, &mut NoHost));
            let long = program.checked.symbols.iter().position(|symbol| symbol.name == "L");
            let place = program.layout.offset(SymbolId(long.unwrap() as u32)).unwrap();
            assert_eq!(image::read_i32(&image, place), expected, "{text}");
            assert_eq!(value, f64::from(expected), "{text}");
        }
    }

    #[test]
    fn an_expression_knows_its_type_and_variables() {
        let program = program(&format!("{HEAD}X = T\n"));
        let image = vec![0; program.layout.size as usize];
        let value = |text: &str| program.expression(text).unwrap().evaluate(&image).unwrap();
        assert_eq!(value("X"), Value::Logical(false));
        assert_eq!(value("I > -1"), Value::Logical(true));
        assert_eq!(value("X + X"), Value::Integer(0));
        assert_eq!(value("100000"), Value::Integer(100_000));
        let variables = program.expression("A[I] + A[2] + I + J + @FRO").unwrap();
        assert_eq!(variables.variables(), ["I", "A", "A[2]", "@FRO"]);
    }

    #[test]
    fn an_index_outside_its_array_is_no_value() {
        let program = program(&format!("{HEAD}X = T\n"));
        let mut image = vec![0; program.layout.size as usize];
        let expression = program.expression("A[I - 1]").unwrap();
        let outside = |index| EvaluationError::NoElement { array: "A".into(), index, elements: 3 };
        assert_eq!(expression.evaluate(&image), Err(outside(-1)));
        image.push(0);
        assert!(matches!(expression.evaluate(&image), Err(EvaluationError::WrongImage { .. })));
    }

    #[test]
    fn errors_are_the_programs_with_their_place() {
        let program = program(&format!("{HEAD}X = T\n"));
        for (text, code, start) in [
            ("", "PMI-34", 0),
            ("I +", "PMI-34", 2),
            ("I = 5 )", "PMI-32", 6),
            ("(I = 5", "PMI-32", 5),
            ("I NONE", "PMI-37", 2),
            ("A", "PMI-36", 0),
            ("I[1]", "PMI-35", 0),
            ("A[3]", "PMI-X1", 2),
            ("A[L]", "PMI-43", 2),
            ("X & Y", "PMI-31", 4),
            ("L * I", "PMI-42", 2),
            ("i", "PMI-5", 0),
            ("X = T, I", "PMI-5", 5),
            ("\"A\"", "PMI-34", 0),
            ("((((((I))))))", "PMI-32", 5),
        ] {
            let all = program.expression(text).unwrap_err();
            let found: Vec<_> = all.iter().map(|d| (d.code, d.span.start)).collect();
            assert_eq!(found, [(code, start)], "{text}");
            assert!(all.iter().all(|d| d.help.is_some()), "{text}");
        }
    }

    /// A debugger reads an expression for each variable. If each took as long as the table of all names, this would take
    /// many minutes.
    #[test]
    fn an_expression_costs_no_more_in_a_long_program() {
        let names: Vec<String> = (0..50_000).map(|number| format!("V{number}")).collect();
        let program = program(&format!("$INTEGER\n{}\n$END\n", names.join(", #\n")));
        let image = vec![0; program.layout.size as usize];
        for name in &names {
            let value = program.expression(name).unwrap().evaluate(&image);
            assert_eq!(value, Ok(Value::Integer(0)), "{name}");
        }
    }
}
