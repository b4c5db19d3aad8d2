//! The passes `speculate-variables` and `speculate`: random PMAC programs that use their variables as integers, in
//! which some variables hold other numbers now and then. The results stay the same, and most of these programs
//! are changed by the passes.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fmt::Write as _;

use plcc_abi::image::write_f64;
use plcc_abi::pmac::{Layout, pure_functions};
use plcc_abi::{Engine, Host, HostFn, Program, Scan};
use plcc_codegen::{CodegenOptions, Target, compile};
use plcc_diag::SourceMap;
use plcc_frontend::common::{Controller, Lowered, MemoryLoader, Options};
use plcc_frontend::pmac;
use plcc_ir::interp::Interpreter;
use plcc_ir::passes::{Pass, PassSet, optimize};
use plcc_ir::text::print;
use plcc_ir::{Module, Terminator};
use plcc_random::Rng;
use plcc_runtime::native::NativeEngine;

/// The numbers of a program's P-variables: neighbours, which are checked together, and single ones.
const VARIABLES: [usize; 12] = [0, 1, 2, 3, 5, 7, 8, 10, 12, 14, 15, 18];
/// The elements of its array are P20 and those behind it.
const ARRAY: usize = 20;

/// A host that has pure functions only.
struct Pure;

impl Host for Pure {
    fn call(&mut self, _: &mut [u8], function: HostFn, args: [u64; 4]) -> u64 {
        pure_functions::call(function, args).unwrap()
    }
}

fn variable(rng: &mut Rng) -> String {
    format!("P{}", rng.pick(&VARIABLES))
}

/// An element of the array; seldom the index may reach other variables.
fn element(rng: &mut Rng) -> String {
    let first = if rng.chance(5) { 4 } else { ARRAY };
    format!("P({first}+({}+{})%{})", variable(rng), rng.below(9), 1 + rng.below(16))
}

/// An expression. In a plain program it has an integer of 32 bits if the variables have small ones.
fn value(rng: &mut Rng, plain: bool) -> String {
    let (a, b, c) = (variable(rng), variable(rng), variable(rng));
    let number = rng.below(1000);
    match rng.below(if plain { 9 } else { 12 }) {
        0 | 1 => format!("({a}*{}+{b})%{}", 1 + rng.below(9), 1 + rng.below(1000)),
        2 | 3 => format!("({a}*{}+{b})&{number}", rng.below(9)),
        4 => format!("{a}|({b}^{number})"),
        5 => format!("({a}-{b})%(0-{})", 1 + rng.below(50)),
        6 => a,
        7 => format!("ABS({a}-{number})"),
        8 => number.to_string(),
        9 => format!("{a}*0.5"),
        10 => format!("({a}*{b})&{c}"),
        _ => format!("({}+{a})%1000", element(rng)),
    }
}

fn statement(rng: &mut Rng, text: &mut String, plain: bool, depth: usize) {
    let (to, number) = (variable(rng), rng.below(100) as i64 - 20);
    match rng.below(if depth == 0 { 7 } else { 10 }) {
        0 => {
            let _ = writeln!(text, "{to}={to}+{number}");
        }
        1 if !plain => {
            let (to, from) = (element(rng), element(rng));
            let _ = writeln!(text, "{to}={from}");
        }
        2 => {
            let _ = writeln!(text, "{}={}", element(rng), value(rng, plain));
        }
        1 | 3..7 => {
            let _ = writeln!(text, "{to}={}", value(rng, plain));
        }
        _ => {
            let comparator = *rng.pick(&["=", "!=", ">", "!>", "<", "!<", "~"]);
            let other = if rng.chance(50) { variable(rng) } else { number.to_string() };
            let _ = writeln!(text, "IF ({to}{comparator}{other})");
            for _ in 0..1 + rng.below(2) {
                statement(rng, text, plain, depth - 1);
            }
            if rng.chance(50) {
                text.push_str("ELSE\n");
                statement(rng, text, plain, depth - 1);
            }
            text.push_str("ENDIF\n");
        }
    }
}

fn program(rng: &mut Rng) -> String {
    let plain = rng.chance(70);
    let mut text = "OPEN PLC 1 CLEAR\n".to_owned();
    for _ in 0..20 + rng.below(30) {
        statement(rng, &mut text, plain, 2);
    }
    text + "CLOSE\n"
}

/// A number as variables hold it: mostly a small integer.
fn number(rng: &mut Rng, only_integers: bool) -> f64 {
    let bits = rng.bits();
    match rng.below(if only_integers { 8 } else { 9 }) {
        0 => f64::from(bits as i32),
        1 => *rng.pick(&[2_147_483_647.0, -2_147_483_648.0, 0.0]),
        8 => *rng.pick(&[
            0.5,
            -7.25,
            2_147_483_648.0,
            -2_147_483_649.0,
            9_007_199_254_740_992.0,
            1e300,
            5e-324,
        ]),
        _ => f64::from(bits as i8),
    }
}

/// Statements that all need integrality checks, so that they are rows for the pass `speculate`.
fn program_of_rows(rng: &mut Rng) -> String {
    let mut text = "OPEN PLC 1 CLEAR\n".to_owned();
    for _ in 0..15 + rng.below(25) {
        let (element, other, variable) = (element(rng), element(rng), variable(rng));
        let (number, at, factor) = (1 + rng.below(1000), self::variable(rng), self::variable(rng));
        let _ = match rng.below(16) {
            0..4 => writeln!(text, "{element}=({other}+{variable})%{number}"),
            4..6 => writeln!(text, "{element}={other}"),
            6..9 => writeln!(text, "{variable}=({element}+{other})&{number}"),
            9 => writeln!(text, "{variable}=({element}*0.5+{variable})%{number}"),
            10 => writeln!(text, "{variable}={element}"),
            // One check serves several indices, or the statement behind it.
            11 | 12 => writeln!(text, "{variable}={factor}*(P({at}+21)-P(20+{at}))+P(20+{at})"),
            13 => writeln!(text, "{at}={factor}%16\n{variable}=P(20+{at}*2)"),
            14 => writeln!(text, "{at}=INT({factor}*0.5)\n{variable}=P(21+{at})-P(20+{at})"),
            _ => writeln!(text, "IF ({element}>{number})\n{variable}={other}%7\nENDIF"),
        };
    }
    text + "CLOSE\n"
}

/// Whether cold code goes on in other cold code, as that of a row does.
fn has_row(module: &Module) -> bool {
    module.funcs().any(|(_, func)| {
        func.blocks().any(|(_, data)| match &data.terminator {
            Some(Terminator::Jump(to)) => data.cold && func.block(to.block).cold,
            _ => false,
        })
    })
}

#[test]
fn rows_of_statements_whose_checks_fail_store_the_same() {
    let mut with_rows = 0;
    let programs = 50;
    for seed in 0..programs {
        let mut rng = Rng::new(1000 + seed);
        let text = program_of_rows(&mut rng);
        let lowered = lower(&text);
        let passes = PassSet::ALL.without(Pass::SpeculateVariables);
        let rows = made(&lowered, passes);
        with_rows += usize::from(has_row(&rows));
        let code = compile(&rows, &Target::host().unwrap(), CodegenOptions::ALL).unwrap();
        let few = PassSet::NONE.with(Pass::Speculate).with(Pass::Integers).with(Pass::Dce);
        let mut engines: [Box<dyn Engine>; 4] = [
            Box::new(Interpreter::new(lowered.module.clone())),
            Box::new(Interpreter::new(rows)),
            Box::new(Interpreter::new(made(&lowered, few))),
            Box::new(NativeEngine::new(&code, &lowered.program).unwrap()),
        ];
        compare(&mut engines, &lowered.program, &mut rng, &format!("seed {seed}\n{text}"));
    }
    // If few were, errors of the pass would hardly be found.
    assert!(3 * with_rows > programs as usize * 2, "{with_rows} of {programs}");
}

/// The program of a text, before any pass.
fn lower(text: &str) -> Lowered {
    let mut sources = SourceMap::new();
    let file = sources.add("generated.pmc", text.as_bytes());
    let (checked, _) =
        pmac::check(&mut sources, &[file], &MemoryLoader::new(), &Options::default());
    checked.unwrap_or_else(|| panic!("{text}")).lower().unwrap()
}

/// Its module after some passes.
fn made(lowered: &Lowered, passes: PassSet) -> Module {
    let mut module = lowered.module.clone();
    optimize(&mut module, passes);
    module
}

/// Runs engines of a program from random images; all must leave the same ones.
fn compare(engines: &mut [Box<dyn Engine>; 4], program: &Program, rng: &mut Rng, what: &str) {
    let layout = Layout::new(Controller::Pmac);
    for round in 0..12 {
        let mut start = vec![0; program.image_size as usize];
        for p in 0..ARRAY + 32 {
            write_f64(&mut start, layout.p_offset(p as u32), number(rng, round % 2 == 0));
        }
        let images = engines.each_mut().map(|engine| {
            let mut image = start.clone();
            // Three scans, so that what was stored is checked.
            for _ in 0..3 {
                engine.call(0, None, &mut Scan::new(&mut image, &mut Pure));
            }
            image
        });
        for image in &images {
            let differs = image.iter().zip(&images[0]).position(|(a, b)| a != b);
            assert_eq!(differs, None, "round {round}, {what}");
        }
    }
}

#[test]
fn variables_that_are_checked_once_hold_the_same_values() {
    let mut changed = 0;
    let programs = 50;
    for seed in 0..programs {
        let mut rng = Rng::new(seed);
        let text = program(&mut rng);
        let lowered = lower(&text);
        let all = made(&lowered, PassSet::ALL);
        let without = made(&lowered, PassSet::ALL.without(Pass::SpeculateVariables));
        changed += usize::from(print(&all) != print(&without));
        let code = compile(&all, &Target::host().unwrap(), CodegenOptions::ALL).unwrap();
        let some = Pass::ALL.iter().copied().filter(|_| rng.chance(50));
        let some = some.fold(PassSet::NONE, PassSet::with).with(Pass::SpeculateVariables);
        let mut engines: [Box<dyn Engine>; 4] = [
            Box::new(Interpreter::new(lowered.module.clone())),
            Box::new(Interpreter::new(all)),
            Box::new(Interpreter::new(made(&lowered, some))),
            Box::new(NativeEngine::new(&code, &lowered.program).unwrap()),
        ];
        compare(&mut engines, &lowered.program, &mut rng, &format!("seed {seed}\n{text}"));
    }
    // If few were, errors of the pass would hardly be found.
    assert!(3 * changed > programs as usize, "{changed} of {programs}");
}
