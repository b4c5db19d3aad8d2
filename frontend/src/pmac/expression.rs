//! One expression or condition of PMAC, read and evaluated outside any program text: for the
//! conditions of breakpoints, triggers and watches.
//!
//! The parser is that of programs. So the expression may be what is after `=` or in the
//! parentheses of an IF: numbers, I-, P-, Q-, M- and L-variables, indirect ones (`P(P1+5)`),
//! functions, operators, comparators, AND and OR. A condition needs no parentheses around it.
//! Names that the program defined with `#define` are replaced.
//!
//! It is evaluated in floating point, also where a statement of a PLCC with the same text would
//! use integers.
//!
//! Values come from the process image alone. An M- or L-variable in sparse memory, at an address
//! for which the image has no word, is the error [`OutsideImage`](EvaluationError::OutsideImage). A
//! P or Q that was written through its X and Y words is read as the double that these words make,
//! and an M-variable for one of these words is read as the word that this double has.

use std::collections::BTreeMap;

use plcc_abi::image::read_f64;
use plcc_abi::pmac::{
    Definition, Kind, Layout, Place, PmacName, Space, SparseMemory, Variable, View, arithmetic,
};
use plcc_diag::{Diagnostic, SourceMap, Span};

use super::Program;
use super::ast::{Func, Op};
use super::lower::lower_expression;
use super::read::{expr::Reader, preprocess};
use crate::common::{Evaluate, EvaluationError, Expression, ExpressionCode, Value};

/// The surroundings in which an expression is read: the program whose names it uses.
#[expect(missing_debug_implementations, reason = "a source map has none")]
pub struct Context<'a> {
    /// The program whose names and variables it may use.
    pub program: &'a Program,
    /// The program's sources. The expression is added to them, so that errors can show it.
    pub sources: &'a mut SourceMap,
    /// The coordinate system whose Q-variables it reads, from 1.
    pub system: u32,
    /// Whether it may use L-variables, as a PLCC does.
    pub compiled: bool,
}

/// Reads an expression or a condition. It can then be evaluated on any image of the program.
///
/// # Errors
/// The diagnostics of a text that is not an expression, at least one. Their places are in the file
/// `expression` of the context's sources.
pub fn parse_expression(text: &str, context: Context<'_>) -> Result<Expression, Vec<Diagnostic>> {
    let (program, system) = (context.program, context.system);
    let Operations { ops, condition, definitions } = operations(text, context)?;
    let layout = program.loaded.layout;
    let variables = variables(&ops, system);
    let evaluator = Postfix { ops, condition, layout, system, definitions };
    Ok(Expression::new(text, variables, layout.size as usize, evaluator))
}

/// An expression as code, with the Q-variables of coordinate system 1 and the definitions of M-variables after load; `None` where
/// something about it can't be lowered.
///
/// # Errors
/// Those of [`parse_expression`].
pub(super) fn expression_code(
    text: &str,
    context: Context<'_>,
) -> Result<Option<ExpressionCode>, Vec<Diagnostic>> {
    let program = context.program;
    let Operations { ops, condition, .. } = operations(text, context)?;
    Ok(lower_expression(&program.download, &program.loaded, ops, condition).ok())
}

/// The operations of an expression.
struct Operations {
    ops: Vec<Op>,
    /// Whether its value is a truth value.
    condition: bool,
    /// The definitions of its L-variables.
    definitions: BTreeMap<u32, Definition>,
}

/// Reads the operations of an expression.
fn operations(text: &str, context: Context<'_>) -> Result<Operations, Vec<Diagnostic>> {
    let Context { program, sources, compiled, .. } = context;
    let file = sources.add("expression", text.as_bytes());
    // A debugger reads an expression for each of very many variables, and most have no name in them.
    let names =
        if preprocess::may_have_name(text, &program.names) { &program.names[..] } else { &[] };
    let (preprocessed, diagnostics) = preprocess::replace_names(sources, file, names);
    if diagnostics.iter().any(Diagnostic::is_error) {
        return Err(diagnostics);
    }
    if preprocessed.text.trim().is_empty() {
        let place = Span::new(file, 0, text.len());
        return Err(vec![Diagnostic::error(
            "PMAC-3",
            place,
            "this is not an expression: it is empty",
        )]);
    }
    let download = &program.download;
    let mut reader = Reader::new(&preprocessed.text, download.controller);
    reader.l_used = compiled.then(Vec::new);
    let (expr, condition) = reader.whole_text().map_err(|error| {
        vec![preprocessed.origins.diagnose(error.at, |span| {
            let diagnostic = Diagnostic::error(error.code, span, error.message);
            error.help.into_iter().fold(diagnostic, Diagnostic::help)
        })]
    })?;
    let mut definitions = BTreeMap::new();
    let used = reader.l_used.iter().flatten();
    for (number, at) in used.flat_map(|used| used.numbers().map(|number| (number, used.at))) {
        let Some(definition) = download.l_defs.get(&number) else {
            return Err(vec![preprocessed.origins.diagnose(at, |span| {
                Diagnostic::error("PMAC-3", span, format!("L{number} is not defined"))
                    .help(format!("define it in the program: L{number}->Y:$FFC2,8,1"))
            })]);
        };
        definitions.insert(u32::from(number), *definition);
    }
    let end = expr.start.saturating_add(expr.len) as usize;
    let ops = reader.ops.get(expr.start as usize..end).unwrap_or(&[]).to_vec();
    Ok(Operations { ops, condition, definitions })
}

/// The names of the variables that an expression reads, each once.
fn variables(ops: &[Op], system: u32) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for op in ops {
        let name = match *op {
            Op::Var(kind, number) => name(kind, u32::from(number), system),
            Op::Indirect(kind) => format!("{kind:?}(…)"),
            Op::Call(Func::Atan2) => name(Kind::Q, 0, system),
            _ => continue,
        };
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// A variable as traces spell it.
fn name(kind: Kind, number: u32, system: u32) -> String {
    let system = if kind == Kind::Q { system } else { 1 };
    PmacName::Variable(Variable { kind, number, system }).to_string()
}

/// A checked expression in postfix order.
#[derive(Debug)]
struct Postfix {
    ops: Vec<Op>,
    /// Whether its value is a truth value.
    condition: bool,
    layout: Layout,
    system: u32,
    /// The definitions of its L-variables.
    definitions: BTreeMap<u32, Definition>,
}

impl Evaluate for Postfix {
    fn evaluate(&self, image: &[u8]) -> Result<Value, EvaluationError> {
        let layout = &self.layout;
        let sparse = SparseMemory::default();
        let view = View { image, layout, sparse: &sparse };
        let base = layout.q_base_of(self.system);
        let mut outside = None;
        let mut read = |kind: Kind, number: u32| {
            let number = number & (layout.count - 1);
            let defined = match kind {
                Kind::P => return read_f64(image, layout.p_offset(number)),
                Kind::I => return read_f64(image, layout.i_offset(number)),
                Kind::Q => return read_f64(image, layout.q_offset(base.wrapping_add(number))),
                Kind::M => view.definition(number),
                Kind::L => self.definitions.get(&number).copied().unwrap_or(Definition::Star),
            };
            if is_outside(layout, defined) {
                outside.get_or_insert_with(|| name(kind, number, self.system));
                return 0.0;
            }
            if kind == Kind::M { view.read_m(number) } else { view.read(defined) }
        };
        let radians = read(Kind::I, 15) != 0.0;
        let value = arithmetic::finite(plcc_abi::pmac::expression::evaluate(
            &self.ops,
            &mut Vec::new(),
            radians,
            &mut read,
        ));
        match outside {
            Some(name) => Err(EvaluationError::OutsideImage { name }),
            None if self.condition => Ok(Value::Logical(value != 0.0)),
            None => Ok(Value::Real(value)),
        }
    }
}

/// Whether a definition names words that the image does not hold.
fn is_outside(layout: &Layout, definition: Definition) -> bool {
    let beyond = |space, address| matches!(layout.place(space, address), Place::Sparse);
    match definition {
        Definition::Star | Definition::Tw { .. } => false,
        Definition::X { address, .. } => beyond(Space::X, address),
        Definition::Y { address, .. } => beyond(Space::Y, address),
        Definition::D { address }
        | Definition::Dp { address }
        | Definition::L { address }
        | Definition::F { address } => beyond(Space::X, address) || beyond(Space::Y, address),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::{Controller, MemoryLoader, Options};
    use crate::pmac::check;

    const PROGRAM: &str = "#define DOOR M7\n#define SPEED (P1*2)\nI5=2 P1=21 P2=0.5 Q3=8\n&2 Q3=9\n\
         M7->Y:$FFC2,8,1 M8->*\nM9->D:$100\nL1->X:$800,0,24,S\nWX:$100,-1 WY:$100,$FFFFFE\n\
         WX:$800,-7 WY:$FFC2,$100\nP23=44\nOPEN PLC 1 CLEAR CLOSE\n";

    fn program(controller: Controller, text: &str) -> (Program, SourceMap) {
        let mut sources = SourceMap::new();
        let file = sources.add("m.pmc", text.as_bytes());
        let options = Options { controller, ..Options::default() };
        let (program, found) = check(&mut sources, &[file], &MemoryLoader::new(), &options);
        (program.unwrap_or_else(|| panic!("{found:?}")), sources)
    }

    fn read(text: &str, system: u32, compiled: bool) -> Result<(Expression, Vec<u8>), String> {
        let (program, mut sources) = program(Controller::Pmac, PROGRAM);
        let context = Context { program: &program, sources: &mut sources, system, compiled };
        match parse_expression(text, context) {
            Ok(expression) => Ok((expression, program.loaded.image.clone())),
            Err(found) => {
                let d = &found[0];
                let file = sources.path(d.span.file);
                Err(format!("{} {file} {}..{}: {}", d.code, d.span.start, d.span.end, d.message))
            }
        }
    }

    fn value(text: &str) -> Value {
        let (expression, image) = read(text, 1, true).unwrap();
        assert_eq!(expression.text(), text);
        expression.evaluate(&image).unwrap()
    }

    #[test]
    fn expressions_have_numbers_and_conditions_truth_values() {
        for (text, expected) in [
            ("P1", 21.0),
            ("P1+P2*2", 22.0),
            ("-(P1-1)/4", -5.0),
            ("P(P1+2)", 44.0),
            ("Q3", 8.0),
            ("SIN(30)+SQRT(Q(1+2)*2)", 4.5),
            ("$FF&15|16", 31.0),
            ("DOOR+SPEED", 43.0),
            ("M9", -2.0),
            ("L1", -7.0),
            ("0/0+1/0", f64::MAX),
        ] {
            assert_eq!(value(text), Value::Real(expected), "{text}");
        }
        for (text, expected) in [
            ("P1=21", true),
            ("(P1!=21)", false),
            ("P1>20 AND P1<22", true),
            ("(P1=0) OR (DOOR=1)\nAND (P2~1)", true),
            ("P1=0 OR P1=21 AND P2=0", false),
        ] {
            assert_eq!(value(text), Value::Logical(expected), "{text}");
        }
    }

    #[test]
    fn q_variables_are_those_of_the_chosen_coordinate_system() {
        let (expression, image) = read("Q3+P1+Q3", 2, false).unwrap();
        assert_eq!(expression.evaluate(&image), Ok(Value::Real(39.0)));
        assert_eq!(expression.variables(), ["&2Q3", "P1"]);
        let (expression, _) = read("M(P1)+ATAN2(I15)+DOOR", 1, false).unwrap();
        assert_eq!(expression.variables(), ["P1", "M(…)", "I15", "Q0", "M7"]);
    }

    #[test]
    fn errors_have_their_places() {
        for (text, error) in [
            ("P1+", "PMAC-3 expression 2..3: a value is missing after this"),
            ("P1 P2", "PMAC-3 expression 3..5: an operator is expected here, not `P2`"),
            ("P1024", "PMAC-X1 expression 1..5: there are variables 0 to 1023, not 1024"),
            ("(P1=1", "PMAC-3 expression 0..1: this parenthesis is not closed"),
            ("P1=1 AND 2", "PMAC-3 expression 5..8: AND and OR join conditions"),
            ("DOR=1", "PMAC-3 expression 0..3: a value is expected here, not `DOR`"),
            ("L2", "PMAC-3 expression 0..2: L2 is not defined"),
            ("", "PMAC-3 expression 0..0: this is not an expression: it is empty"),
            (" ; P1", "PMAC-3 expression 0..5: this is not an expression: it is empty"),
        ] {
            assert_eq!(read(text, 1, true).unwrap_err(), error, "{text}");
        }
        let error = "PMAC-3 expression 0..2: L-variables are for PLCCs only";
        assert_eq!(read("L1", 1, false).unwrap_err(), error);
    }

    #[test]
    fn what_the_image_does_not_hold_has_no_value() {
        let text = "M1->X:$50000,0,24\nM2->X:$50,0,24\nWX:$50000,5 I5=2\n";
        let (program, mut sources) = program(Controller::Turbo, text);
        let mut parse = |text| {
            let context =
                Context { program: &program, sources: &mut sources, system: 1, compiled: false };
            parse_expression(text, context).unwrap()
        };
        let image = &program.loaded.image;
        let outside = EvaluationError::OutsideImage { name: "M1".into() };
        assert_eq!(parse("M2+M1").evaluate(image), Err(outside.clone()));
        assert_eq!(parse("M(1)").evaluate(image), Err(outside));
        assert_eq!(parse("M2").evaluate(image), Ok(Value::Real(0.0)));
        let (expected, given) = (image.len(), 0);
        let wrong = EvaluationError::WrongImage { expected, given };
        assert_eq!(parse("M2").evaluate(&[]), Err(wrong));
    }

    /// A debugger reads an expression for each variable. If each took as long as the list of all names, this would take
    /// many minutes.
    #[test]
    fn an_expression_costs_no_more_where_many_names_are_defined() {
        let mut text =
            String::from("#define 20MS 5\n#define MS *4\n#define PAGE FFC2\n#define X_1 M1\n");
        for number in 0..50_000 {
            text.push_str(&format!("#define NAME{number} {number}\n"));
        }
        let (program, mut sources) = program(Controller::Pmac, &text);
        let mut value = |text: &str| {
            let (program, sources) = (&program, &mut sources);
            let context = Context { program, sources, system: 1, compiled: false };
            parse_expression(text, context).unwrap().evaluate(&program.loaded.image).unwrap()
        };
        for round in 0..50 {
            for number in 0..1000 {
                assert_eq!(value(&format!("P{number}")), Value::Real(0.0), "{round}");
            }
        }
        for (text, expected) in
            [("NAME7", 7.0), ("3MS", 12.0), ("20MS", 5.0), ("$PAGE00", 16_761_344.0)]
        {
            assert_eq!(value(text), Value::Real(expected), "{text}");
        }
    }
}
