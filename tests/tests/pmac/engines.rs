//! PMAC downloads in the statement interpreter, the IR interpreter, the JIT and artifacts: the same
//! image, events and stops after every servo cycle, on PMAC and Turbo PMAC.
#![allow(clippy::unwrap_used, clippy::panic)]

use plcc::later_code::jit_in_parts;
use plcc::recompile::PmacRecompiler;
use plcc_abi::{Engine, pmac::Layout};
use plcc_codegen::{OptLevel, Target, compile};
use plcc_diag::SourceMap;
use plcc_frontend::{
    common::{Controller, MemoryLoader, Options},
    pmac,
};
use plcc_ir::passes::{Pass, PassSet};
use plcc_random::seeds;
use plcc_runtime::{
    Artifact, Event, Executive, Purpose, artifact,
    native::NativeEngine,
    pmac::{PmacExecutive, PmacOptions, Recompiling, Settings},
};
use plcc_tests::gen_pmac::{generate, generate_for};

/// An engine with its own executive.
struct Machine {
    name: &'static str,
    engine: Box<dyn Engine>,
    executive: PmacExecutive,
}

fn machines(source: &str, controller: Controller) -> Vec<Machine> {
    let mut sources = SourceMap::new();
    let file = sources.add("generated.pmc", source.as_bytes());
    let options = Options { controller, ..Options::default() };
    let (program, all) = pmac::check(&mut sources, &[file], &MemoryLoader::new(), &options);
    if let Some(error) = all.iter().find(|d| d.is_error()) {
        panic!("{source}\n{}", plcc_diag::render::draw(&sources, error, false));
    }
    let checked = program.unwrap();
    let lowered = checked.lower().unwrap();
    let program = lowered.program.clone();
    let native = |passes: PassSet| -> Box<dyn Engine> {
        let target = Target::host().unwrap();
        assert_eq!(plcc_ir::verify::verify(&lowered.module), []);
        let mut module = lowered.module.clone();
        plcc_ir::passes::optimize(&mut module, passes);
        let code = compile(&module, &target).unwrap();
        Box::new(NativeEngine::new(&code, &program).unwrap())
    };
    let artifact = |opt| -> Box<dyn Engine> {
        let mut module = lowered.module.clone();
        plcc_ir::passes::optimize(&mut module, opt);
        // As in a long program: code that seldom runs has its registers allocated in a single pass.
        let target = Target::host_baseline().unwrap().with_quick_code_from(0);
        let code = compile(&module, &target).unwrap();
        let read = Artifact::parse(&artifact::encode(&program, &code).unwrap(), None).unwrap();
        assert_eq!(read.program, program);
        Box::new(NativeEngine::new(&read.code, &read.program).unwrap())
    };
    let mut optimized = lowered.module.clone();
    plcc_ir::passes::optimize(&mut optimized, OptLevel::Speed);
    let mut bytes = lowered.module.clone();
    plcc_ir::passes::optimize(&mut bytes, PassSet::ALL.without(Pass::ByLength));
    let in_parts = |opt| -> Box<dyn Engine> {
        Box::new(jit_in_parts(|| Ok(lowered.clone()), opt).unwrap().engine)
    };
    // Recompiled whenever a definition has changed; M-variables that do not settle are left to
    // the host.
    let recompiling = |settings| -> Box<dyn Engine> {
        let engine = jit_in_parts(|| Ok(lowered.clone()), OptLevel::Speed).unwrap().engine;
        let program = Box::new(checked.clone());
        let compiler = Box::new(PmacRecompiler::new(program, OptLevel::Speed));
        Box::new(Recompiling::new(engine, checked.assumptions(), controller, compiler, settings))
    };
    let every_time = Settings {
        settled_after: 0,
        patience: 99,
        max_recompilations: 999,
        max_per_variable: 255,
        in_thread: false,
    };
    let few_times = Settings {
        settled_after: 2,
        patience: 4,
        max_recompilations: 3,
        max_per_variable: 2,
        in_thread: false,
    };
    let in_thread = Settings { in_thread: true, ..every_time };
    let engines = [
        ("interp", checked.interpreter()),
        ("ir", Box::new(plcc_ir::interp::Interpreter::new(lowered.module.clone()))),
        ("ir optimised", Box::new(plcc_ir::interp::Interpreter::new(optimized))),
        ("jit none", native(PassSet::NONE)),
        ("jit speed", native(PassSet::ALL)),
        ("jit in parts", in_parts(OptLevel::Speed)),
        ("jit in parts, none", in_parts(OptLevel::None)),
        // With bits as bytes also in short programs.
        ("jit, byte-bits", native(PassSet::ALL.without(Pass::ByLength))),
        ("ir, byte-bits", Box::new(plcc_ir::interp::Interpreter::new(bytes))),
        ("aot none", artifact(OptLevel::None)),
        ("aot speed", artifact(OptLevel::Speed)),
        ("recompiled", recompiling(every_time)),
        ("recompiled a few times", recompiling(few_times)),
        ("recompiled in a thread", recompiling(in_thread)),
    ];
    let machine = |(name, engine)| {
        let executive = PmacExecutive::new(&program, PmacOptions::default()).unwrap();
        Machine { name, engine, executive }
    };
    engines.into_iter().map(machine).collect()
}

/// The name of what stands at an offset of the image.
fn place(offset: usize, controller: Controller) -> String {
    let layout = Layout::new(controller);
    let offset = offset as u32;
    let regions = layout.regions();
    let region = regions.iter().rev().find(|r| r.offset <= offset).unwrap();
    format!("{}[{}]", region.name, (offset - region.offset) / 8)
}

/// The offset of the first byte in which two images differ. `recompiled` says that one engine
/// recompiles; then the bytes that describe the state of its code are not compared.
fn difference(ours: &[u8], theirs: &[u8], layout: &Layout, recompiled: bool) -> Option<usize> {
    let all = [(0, layout.size)];
    let state = [
        (0, layout.reference_definitions),
        (layout.thumbwheels, layout.differing_definitions),
        (layout.q_base, layout.size),
    ];
    let stretches = if recompiled { &state[..] } else { &all[..] };
    stretches.iter().find_map(|&(start, end)| {
        let (start, end) = (start as usize, end as usize);
        let (a, b) = (&ours[start..end], &theirs[start..end]);
        (a != b).then(|| start + a.iter().zip(b).position(|(a, b)| a != b).unwrap())
    })
}

/// Runs a download with a stimulus in all engines and compares them after every tick. Gives the
/// events.
pub(super) fn compare(
    source: &str,
    stimulus: &str,
    ticks: u32,
    controller: Controller,
) -> Vec<Event> {
    let mut machines = machines(source, controller);
    let rows: Vec<(u32, &str, &str)> = stimulus
        .lines()
        .skip(1)
        .map(|row| {
            let [tick, name, value] = row.split(',').collect::<Vec<_>>().try_into().unwrap();
            (tick.parse().unwrap(), name, value)
        })
        .collect();
    let layout = Layout::new(controller);
    let mut all = vec![];
    for tick in 0..ticks {
        let mut results = vec![];
        for Machine { engine, executive, .. } in &mut machines {
            for (_, name, value) in rows.iter().filter(|row| row.0 == tick) {
                let variable = executive.find(name, Purpose::Stimulus).unwrap();
                let value = executive.parse(variable, value).unwrap();
                executive.set(variable, value);
            }
            let mut events = vec![];
            let stop = executive.tick(engine.as_mut(), &mut events);
            results.push((stop, events));
        }
        let (first, others) = machines.split_first().unwrap();
        for (machine, result) in others.iter().zip(&results[1..]) {
            let (ours, theirs) = (first.executive.image(), machine.executive.image());
            let recompiled = machine.name.starts_with("recompiled");
            if let Some(at) = difference(ours, theirs, &layout, recompiled) {
                let value = |image: &[u8]| plcc_abi::image::read_f64(image, at as u32 & !7);
                panic!(
                    "tick {tick} {}: {} is {:?}, not {:?}\n{source}",
                    machine.name,
                    place(at, controller),
                    value(theirs),
                    value(ours)
                );
            }
            assert_eq!(*result, results[0], "tick {tick} {}\n{source}", machine.name);
        }
        all.append(&mut results.swap_remove(0).1);
    }
    all
}

#[test]
fn generated_downloads_agree() {
    let mut events = 0;
    for seed in seeds(24) {
        let turbo = seed % 4 == 3;
        let case = generate_for(seed, 20 + seed as usize % 60, turbo);
        let controller = if turbo { Controller::Turbo } else { Controller::Pmac };
        events += compare(&case.source, &case.stimulus, case.ticks, controller).len();
    }
    assert!(events > 0, "no program had an event");
}

/// Nothing that is stored is NaN, infinite or -0, whatever is computed.
#[test]
fn stored_values_are_finite() {
    for seed in 1000..1020 {
        let case = generate(seed, 60);
        for Machine { name, mut engine, mut executive } in machines(&case.source, Controller::Pmac)
        {
            for _ in 0..8 {
                executive.tick(engine.as_mut(), &mut vec![]).unwrap();
            }
            let layout = Layout::new(Controller::Pmac);
            for number in 0..3 * layout.count {
                let value = plcc_abi::image::read_f64(executive.image(), layout.p + 8 * number);
                let odd = !value.is_finite() || (value == 0.0 && value.is_sign_negative());
                assert!(
                    !odd,
                    "{name}: {} is {value}\n{}",
                    place(8 * number as usize, Controller::Pmac),
                    case.source
                );
            }
        }
    }
}
