//! What the other side of a control costs: a tick of a program that does next to nothing, alone and beside its simulated
//! control, which is idle, with eight small machines. The difference of the two is a step of the simulator. Then the ticks of a
//! PMAC with eight simulated motors.
//! `cargo bench -p plcc-benches --bench simulator`

use std::fmt::Write;
use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use plcc::compile;
use plcc::disk::Disk;
use plcc_abi::Dialect;
use plcc_benches::{compiled, motion};
use plcc_codegen::OptLevel;
use plcc_diag::SourceMap;
use plcc_frontend::common::{Machine, Options};
use plcc_host::args::RunArgs;
use plcc_host::session;
use plcc_runtime::Executive;

/// How many small machines stand beside a control.
const DEVICES: usize = 8;

/// A program with an output and with eight inputs, and their names.
fn idle(dialect: Dialect) -> (String, &'static str, Vec<String>) {
    if dialect == Dialect::Nct {
        let inputs = (0..DEVICES).map(|at| format!("I01{at}")).collect();
        return (":000\nJ0\n:001\nLI010 SY010\nJ1\n".into(), "Y010", inputs);
    }
    let inputs: Vec<String> = (0..DEVICES).map(|at| format!("LS{at}")).collect();
    let declared: String =
        inputs.iter().zip(0..).map(|(name, at)| format!("{name}=0/{at}\n")).collect();
    (format!("$INPUT\n{declared}$OUTPUT\nOUT=2/0\n$END\nOUT=LS0\n"), "OUT", inputs)
}

/// A cylinder for each input.
fn table(output: &str, inputs: &[String]) -> String {
    let mut table = String::from("[simulator]\n");
    for input in inputs {
        let _ = writeln!(table, "[[simulator.device]]\nname = \"K{input}\"\nkind = \"cylinder\"");
        let _ = writeln!(table, "extend = \"{output}\"\nextended = \"{input}\"");
    }
    table
}

fn ticks(criterion: &mut Criterion) {
    for (dialect, name) in [(Dialect::Pmi, "pmi"), (Dialect::Nct, "nct")] {
        let (text, output, inputs) = idle(dialect);
        let Ok(machine) = Machine::parse(&table(output, &inputs)) else { continue };
        let mut sources = SourceMap::new();
        let file = sources.add("idle", text.as_bytes());
        let checked = compile::check(&mut sources, &[file], dialect, &Disk, &Options::default()).0;
        let Some(Ok(lowered)) = checked.map(|checked| checked.optimized(OptLevel::Speed)) else {
            continue;
        };
        for simulate in [false, true] {
            let Ok((mut engine, _)) = compile::jit(&lowered) else { continue };
            let run = RunArgs { simulate, ..RunArgs::default() };
            let made = session::simulated_executive(&lowered.program, &run, Some(&machine));
            let Ok(mut executive) = made else { continue };
            let mut events = Vec::new();
            let what = if simulate { "simulated" } else { "alone" };
            criterion.bench_function(&format!("idle/{name}/{what}"), |bencher| {
                bencher.iter(|| {
                    events.clear();
                    black_box(executive.tick(&mut engine, &mut events)).is_ok()
                });
            });
        }
    }
}

/// A tick of a PMAC whose motors are simulated. The difference of the last two is the calculation of a move of eight motors.
fn motors(criterion: &mut Criterion) {
    for (name, source) in motion::downloads() {
        let Ok(mut made) = compiled::pmac(&source, OptLevel::Speed) else { continue };
        let Ok(mut executive) = motion::executive(&made.program) else { continue };
        let mut events = Vec::new();
        criterion.bench_function(&format!("motion/{name}"), |bencher| {
            bencher.iter(|| {
                events.clear();
                black_box(executive.tick(&mut made.native, &mut events)).is_ok()
            });
        });
    }
}

criterion_group!(benches, ticks, motors);
criterion_main!(benches);
