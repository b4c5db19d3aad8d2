//! PMI programs in the statement interpreter and in native code: the same image after every scan.
#![allow(clippy::unwrap_used, clippy::panic)]

use plcc_abi::{
    Engine, Outcome, Program, Scan, Tables,
    engine::NoHost,
    image,
    pmi::{PmiTables, Role, TimerKind, Type},
};
use plcc_codegen::{OptLevel, Target, compile};
use plcc_diag::SourceMap;
use plcc_frontend::{
    common::{Limits, MemoryLoader, Options},
    pmi,
};
use plcc_runtime::native::NativeEngine;
use plcc_tests::gen_pmi::generate;

/// An engine with its image.
struct Machine {
    name: &'static str,
    engine: Box<dyn Engine>,
    image: Vec<u8>,
}

fn write(image: &mut [u8], ty: Type, offset: u32, value: i32) {
    match ty {
        Type::Logical => image::write_u8(image, offset, u8::from(value != 0)),
        Type::Integer => image::write_i16(image, offset, value as i16),
        Type::Long => image::write_i32(image, offset, value),
    }
}

fn tables(program: &Program) -> &PmiTables {
    let Tables::Pmi(tables) = &program.tables else { panic!("PMI's tables") };
    tables
}

/// What the executive does with timers before a scan.
fn count_down(image: &mut [u8], tables: &PmiTables) {
    for timer in &tables.timers {
        let count = image::read_i32(image, timer.counter);
        if count > 0 {
            image::write_i32(image, timer.counter, count - 1);
        }
        if count == 1 {
            image::write_u8(image, timer.delayed, u8::from(timer.kind == TimerKind::E));
        }
    }
}

fn machines(source: &str, limits: Limits) -> (Program, Vec<Machine>) {
    let mut sources = SourceMap::new();
    let file = sources.add("generated.pmi", source.as_bytes());
    let options = Options { limits, ..Options::default() };
    let (program, all) = pmi::check(&mut sources, file, &MemoryLoader::new(), &options);
    let checked = program.unwrap_or_else(|| panic!("{source}\n{all:?}"));
    let lowered = checked.lower();
    let program = lowered.program;
    let mut image = vec![0; program.image_size as usize];
    for &(offset, ty, value) in &tables(&program).initial {
        write(&mut image, ty, offset, value);
    }
    let native = |opt| {
        let target = Target::host(opt).unwrap();
        let code = compile(&lowered.module, &target).unwrap();
        Box::new(NativeEngine::new(&code, &program).unwrap())
    };
    let machines = vec![
        Machine { name: "interp", engine: checked.interpreter(), image: image.clone() },
        Machine { name: "none", engine: native(OptLevel::None), image: image.clone() },
        Machine { name: "speed", engine: native(OptLevel::Speed), image },
    ];
    (program, machines)
}

/// Runs a program with a stimulus in all engines; how the last scan ended.
fn compare(source: &str, stimulus: &str, ticks: u32, limits: Limits) -> Outcome {
    let (program, mut machines) = machines(source, limits);
    let tables = tables(&program).clone();
    let scratch = program.region("scratch").map(|r| r.offset..r.offset + r.size);
    let rows: Vec<(u32, &str, i32)> = stimulus
        .lines()
        .skip(1)
        .map(|row| {
            let [tick, name, value] = row.split(',').collect::<Vec<_>>().try_into().unwrap();
            (tick.parse().unwrap(), name, value.parse().unwrap())
        })
        .collect();
    let mut last = Outcome::End;
    for tick in 0..ticks {
        let mut outcomes = vec![];
        for machine in &mut machines {
            for (_, name, value) in rows.iter().filter(|row| row.0 == tick) {
                let (name, index) = name.split_once('[').unwrap_or((name, "0]"));
                let symbol = tables.symbols.iter().find(|s| s.name == name).unwrap();
                if symbol.role == Role::Constant {
                    continue;
                }
                let index: u32 = index.trim_end_matches(']').parse().unwrap();
                let offset = symbol.offset + index * symbol.ty.size();
                write(&mut machine.image, symbol.ty, offset, *value);
            }
            count_down(&mut machine.image, &tables);
            let mut scan = Scan { image: &mut machine.image, host: &mut NoHost };
            outcomes.push(machine.engine.call(0, &mut scan));
            if let Some(range) = &scratch {
                machine.image[range.start as usize..range.end as usize].fill(0);
            }
        }
        let (first, others) = machines.split_first().unwrap();
        for (machine, outcome) in others.iter().zip(&outcomes[1..]) {
            assert_eq!(*outcome, outcomes[0], "tick {tick} {}\n{source}", machine.name);
            let symbol = |at: usize| {
                let at = at as u32;
                tables.symbols.iter().find(|s| {
                    let size = s.elements.unwrap_or(1) * s.ty.size();
                    (s.offset..s.offset + size).contains(&at)
                })
            };
            let differs = first.image.iter().zip(&machine.image).position(|(a, b)| a != b);
            if let Some(at) = differs {
                let name = symbol(at).map_or("?", |s| &s.name);
                panic!("tick {tick} {}: {name} differs at {at}\n{source}", machine.name);
            }
        }
        last = outcomes[0];
        if last != Outcome::End {
            break;
        }
    }
    last
}

#[test]
fn generated_programs_agree() {
    let seeds = std::env::var("PLCC_SEEDS").ok().and_then(|n| n.parse().ok()).unwrap_or(60);
    let mut stopped = 0;
    for seed in 0..seeds {
        let case = generate(seed, 20 + seed as usize % 50);
        let outcome = compare(&case.source, &case.stimulus, case.ticks, Limits::Original);
        stopped += u32::from(outcome != Outcome::End);
    }
    assert!(stopped > 0, "no program was stopped");
}

/// A statement that is cut into many functions, with values that wait, of every type.
#[test]
fn long_statements_agree() {
    let mut source = "$INTEGER\nA,B,C[7]\n$LONG\nL,R\n$END\nB=B+1\n".to_owned();
    source.push_str("R=L-((B&T)+(A*B*((");
    for i in 0..6000 {
        source.push_str(["A+", "B*3-", "C[B%3+2]-", "(L>B)+"][i % 4]);
    }
    source.push_str("1))/7))\nX=R/=0\nC[(B%3");
    for i in 0..3000 {
        source.push_str(["+A-A", "+C[1]-C[1]"][i % 2]);
    }
    source.push_str(")+2]=B\n");
    let stimulus = "tick,name,value\n0,A,3\n1,L,70000\n2,A,-9\n3,C[1],5\n";
    assert_eq!(compare(&source, stimulus, 10, Limits::Original), Outcome::End);
}
