//! PMAC downloads in the statement interpreter, the IR interpreter, the JIT and artifacts: the same
//! image, events and stops after every servo cycle, on PMAC and Turbo PMAC.
#![allow(clippy::unwrap_used, clippy::panic)]

use plcc_abi::{Engine, pmac::Layout};
use plcc_codegen::{OptLevel, Target, compile};
use plcc_diag::SourceMap;
use plcc_frontend::{
    common::{Controller, MemoryLoader, Options},
    pmac,
};
use plcc_runtime::{
    Artifact, Event, Executive, Purpose, artifact,
    native::NativeEngine,
    pmac::{PmacExecutive, PmacOptions},
};
use plcc_tests::gen_pmac::generate;

/// An engine in its own machine.
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
    let lowered = checked.lower();
    let program = lowered.program;
    let native = |opt| -> Box<dyn Engine> {
        let target = Target::host(opt).unwrap();
        assert_eq!(plcc_ir::verify::verify(&lowered.module), []);
        let mut module = lowered.module.clone();
        plcc_ir::passes::optimize(&mut module, opt);
        let code = compile(&module, &target).unwrap();
        Box::new(NativeEngine::new(&code, &program).unwrap())
    };
    let artifact = |opt| -> Box<dyn Engine> {
        let mut module = lowered.module.clone();
        plcc_ir::passes::optimize(&mut module, opt);
        let code = compile(&module, &Target::host_baseline(opt).unwrap()).unwrap();
        let read = Artifact::parse(&artifact::encode(&program, &code).unwrap()).unwrap();
        assert_eq!(read.program, program);
        Box::new(NativeEngine::new(&read.code, &read.program).unwrap())
    };
    let mut optimized = lowered.module.clone();
    plcc_ir::passes::optimize(&mut optimized, OptLevel::Speed);
    let engines = [
        ("interp", checked.interpreter()),
        ("ir", Box::new(plcc_ir::interp::Interpreter::new(lowered.module.clone()))),
        ("ir optimised", Box::new(plcc_ir::interp::Interpreter::new(optimized))),
        ("jit none", native(OptLevel::None)),
        ("jit speed", native(OptLevel::Speed)),
        ("aot none", artifact(OptLevel::None)),
        ("aot speed", artifact(OptLevel::Speed)),
    ];
    let machine = |(name, engine)| {
        let executive = PmacExecutive::new(&program, PmacOptions::default()).unwrap();
        Machine { name, engine, executive }
    };
    engines.into_iter().map(machine).collect()
}

/// The name of what stands at an offset of the image.
fn place(offset: usize, controller: Controller) -> String {
    let layout = Layout::new(controller == Controller::Turbo);
    let offset = offset as u32;
    let regions = layout.regions();
    let region = regions.iter().rev().find(|r| r.offset <= offset).unwrap();
    format!("{}[{}]", region.name, (offset - region.offset) / 8)
}

/// Runs a download with a stimulus in all engines.
fn compare(source: &str, stimulus: &str, ticks: u32, controller: Controller) -> Vec<Event> {
    let mut machines = machines(source, controller);
    let rows: Vec<(u32, &str, &str)> = stimulus
        .lines()
        .skip(1)
        .map(|row| {
            let [tick, name, value] = row.split(',').collect::<Vec<_>>().try_into().unwrap();
            (tick.parse().unwrap(), name, value)
        })
        .collect();
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
            if let Some(at) = ours.iter().zip(theirs).position(|(a, b)| a != b) {
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
    let seeds = std::env::var("PLCC_SEEDS").ok().and_then(|n| n.parse().ok()).unwrap_or(24);
    let mut events = 0;
    for seed in 0..seeds {
        let case = generate(seed, 20 + seed as usize % 60);
        let turbo = seed % 4 == 3;
        let controller = if turbo { Controller::Turbo } else { Controller::Pmac };
        events += compare(&case.source, &case.stimulus, case.ticks, controller).len();
    }
    assert!(events > 0, "nothing was ever said");
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
            let layout = Layout::new(false);
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
