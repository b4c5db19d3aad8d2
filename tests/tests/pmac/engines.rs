//! PMAC downloads in the statement interpreter, the IR interpreter, the JIT and artifacts: the same
//! image, events and stops after every servo cycle, on PMAC and Turbo PMAC.
#![allow(clippy::unwrap_used, clippy::panic)]

use plcc::later_code::jit_in_parts;
use plcc_abi::{Engine, pmac::Layout};
use plcc_codegen::{OptLevel, Optimization, Target, compile};
use plcc_diag::SourceMap;
use plcc_frontend::{
    common::{Controller, MemoryLoader, Options},
    pmac,
};
use plcc_ir_tests::as_if_long;
use plcc_load::Artifact;
use plcc_random::seeds;
use plcc_runtime::native::NativeEngine;
use plcc_runtime::pmac::{PmacExecutive, PmacOptions};
use plcc_runtime::{Event, Executive, Purpose, Value};
use plcc_tests::gen_pmac::{generate, generate_for};
use plcc_tests::idioms::Failure;

/// An engine with its own executive.
struct Machine {
    name: &'static str,
    engine: Box<dyn Engine>,
    executive: PmacExecutive,
}

/// The engines of a download.
///
/// # Errors
/// The download has errors, or the compiler can't make its code.
fn machines(source: &str, controller: Controller, simulate: bool) -> Result<Vec<Machine>, Failure> {
    let mut sources = SourceMap::new();
    let file = sources.add("generated.pmc", source.as_bytes());
    let options = Options { controller, simulate, ..Options::default() };
    let (program, all) = pmac::check(&mut sources, &[file], &MemoryLoader::new(), &options);
    if let Some(error) = all.iter().find(|d| d.is_error()) {
        return Err(Failure::Invalid(plcc_diag::render::draw(&sources, error, false)));
    }
    let checked = program.unwrap();
    let lowered = checked.lower().map_err(Failure::refused)?;
    let program = lowered.program.clone();
    let broken = plcc_ir::verify::verify(&lowered.module);
    if let Some(rule) = broken.first() {
        return Err(Failure::refused(rule));
    }
    let native = |how: Optimization| -> Result<Box<dyn Engine>, Failure> {
        let target = Target::host().unwrap();
        let mut module = lowered.module.clone();
        let options = how.run(&mut module).0;
        let code = compile(&module, &target, options).map_err(Failure::refused)?;
        Ok(Box::new(NativeEngine::new(&code, &program).map_err(Failure::refused)?))
    };
    let artifact = |opt| -> Result<Box<dyn Engine>, Failure> {
        let mut module = lowered.module.clone();
        let options = Optimization::from(opt).run(&mut module).0;
        // As in a long program: code that seldom runs has its registers allocated in a single pass.
        let target = Target::host_baseline().unwrap().with_quick_code_from(0);
        let code = compile(&module, &target, options).map_err(Failure::refused)?;
        let read = Artifact::parse(&plcc_load::encode(&program, &code).unwrap(), None).unwrap();
        assert_eq!(read.program, program);
        Ok(Box::new(NativeEngine::new(&read.code, &read.program).map_err(Failure::refused)?))
    };
    let mut optimized = lowered.module.clone();
    plcc_ir::passes::optimize(&mut optimized, OptLevel::Speed);
    let mut bytes = lowered.module.clone();
    plcc_ir::passes::optimize(&mut bytes, as_if_long().passes);
    let in_parts = |opt| -> Result<Box<dyn Engine>, Failure> {
        Ok(Box::new(jit_in_parts(|| Ok(lowered.clone()), opt).map_err(Failure::refused)?.engine))
    };
    let engines = [
        ("interp", checked.interpreter()),
        ("ir", Box::new(plcc_ir::interp::Interpreter::new(lowered.module.clone()))),
        ("ir optimised", Box::new(plcc_ir::interp::Interpreter::new(optimized))),
        ("jit none", native(Optimization::NONE)?),
        ("jit speed", native(Optimization::ALL)?),
        ("jit in parts", in_parts(OptLevel::Speed)?),
        ("jit in parts, none", in_parts(OptLevel::None)?),
        // With bits as bytes also in short programs.
        ("jit, byte-bits", native(as_if_long())?),
        ("ir, byte-bits", Box::new(plcc_ir::interp::Interpreter::new(bytes))),
        ("aot none", artifact(OptLevel::None)?),
        ("aot speed", artifact(OptLevel::Speed)?),
    ];
    let machine = |(name, engine)| {
        let mut executive = PmacExecutive::new(&program, PmacOptions::default()).unwrap();
        if simulate {
            executive.simulate(&[]).unwrap();
        }
        Machine { name, engine, executive }
    };
    Ok(engines.into_iter().map(machine).collect())
}

/// The name of what stands at an offset of the image.
fn place(offset: usize, controller: Controller) -> String {
    let layout = Layout::new(controller);
    let offset = offset as u32;
    let regions = layout.regions();
    let region = regions.iter().rev().find(|r| r.offset <= offset).unwrap();
    format!("{}[{}]", region.name, (offset - region.offset) / 8)
}

/// Runs a download with a stimulus in all engines and compares them after every tick. Returns the
/// events.
///
/// # Errors
/// How the engines differ; that the download has errors or can't be compiled, too.
pub(super) fn run(
    source: &str,
    stimulus: &str,
    ticks: u32,
    controller: Controller,
) -> Result<Vec<Event>, Failure> {
    run_machines(machines(source, controller, false)?, stimulus, ticks, controller, &mut |_| true)
}

/// Is shown the values of variables after each tick, by their names, and says whether the run goes on.
type See<'a> = &'a mut dyn FnMut(&dyn Fn(&str) -> f64) -> bool;

/// The same with motors and motion programs. `see` is called after every tick with what reads a variable.
///
/// # Errors
/// As for [`run`].
pub(super) fn simulated(
    source: &str,
    stimulus: &str,
    ticks: u32,
    controller: Controller,
    see: See<'_>,
) -> Result<Vec<Event>, Failure> {
    run_machines(machines(source, controller, true)?, stimulus, ticks, controller, see)
}

/// In how many ticks from the first on the images are compared.
const EVERY_IMAGE: u32 = 2000;

/// How often they are compared in those that follow.
const IMAGE_PERIOD: u32 = 100;

fn run_machines(
    mut machines: Vec<Machine>,
    stimulus: &str,
    ticks: u32,
    controller: Controller,
    see: See<'_>,
) -> Result<Vec<Event>, Failure> {
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
                let invalid = |why: &dyn std::fmt::Display| Failure::Invalid(why.to_string());
                let variable =
                    executive.names().find(name, Purpose::Stimulus).map_err(|why| invalid(&why))?;
                let value =
                    executive.names().parse(variable, value).map_err(|why| invalid(&why))?;
                executive.write(variable, value);
            }
            let mut events = vec![];
            let stop = executive.tick(engine.as_mut(), &mut events);
            results.push((stop, events));
        }
        let (first, others) = machines.split_first().unwrap();
        let executive = &first.executive;
        let names = executive.names();
        let goes_on = see(&|name| {
            let key = names.find(name, Purpose::Watch).unwrap();
            match executive.read(key) {
                Value::Float(value) => value,
                other => panic!("{other:?}"),
            }
        });
        // To compare the images takes longer than most ticks. In a long run that is done now and then: what differs in one tick
        // differs in others after it.
        let is_last = !goes_on || tick + 1 == ticks;
        let compares_images = is_last || tick < EVERY_IMAGE || tick % IMAGE_PERIOD == 0;
        for (machine, result) in others.iter().zip(&results[1..]) {
            if *result != results[0] {
                let name = machine.name;
                let what = format!("tick {tick} {name}: {result:?}, not {:?}", results[0]);
                return Err(Failure::Differs(what));
            }
            if !compares_images {
                continue;
            }
            let (ours, theirs) = (first.executive.image(), machine.executive.image());
            if ours != theirs {
                let at = ours.iter().zip(theirs).position(|(a, b)| a != b).unwrap();
                let value = |image: &[u8]| plcc_abi::image::read_f64(image, at as u32 & !7);
                return Err(Failure::Differs(format!(
                    "tick {tick} {}: {} is {:?}, not {:?}",
                    machine.name,
                    place(at, controller),
                    value(theirs),
                    value(ours)
                )));
            }
        }
        all.append(&mut results.swap_remove(0).1);
        if !goes_on {
            break;
        }
    }
    Ok(all)
}

/// Runs a download with motors; before each tick of `cuts` another engine goes on from a checkpoint, and each must do then what the
/// first one does: the same image and events after every tick, and the same checkpoint at the end.
pub(super) fn goes_on_from_checkpoints(
    source: &str,
    ticks: u32,
    controller: Controller,
    cuts: &[u32],
) {
    let mut machines =
        machines(source, controller, true).unwrap_or_else(|why| panic!("{why}\n{source}"));
    let (whole, others) = machines.split_first_mut().unwrap();
    assert!(cuts.len() <= others.len() && cuts.is_sorted());
    let mut going = 0;
    for tick in 0..ticks {
        while cuts.get(going) == Some(&tick) {
            others[going].executive.resume(&whole.executive.checkpoint()).unwrap();
            going += 1;
        }
        let mut expected = vec![];
        whole.executive.tick(whole.engine.as_mut(), &mut expected).unwrap();
        for (other, cut) in others.iter_mut().zip(cuts).take(going) {
            let mut events = vec![];
            other.executive.tick(other.engine.as_mut(), &mut events).unwrap();
            let (ours, theirs) = (whole.executive.image(), other.executive.image());
            if ours != theirs {
                let at = ours.iter().zip(theirs).position(|(a, b)| a != b).unwrap();
                let (name, place) = (other.name, place(at, controller));
                panic!("{name} from {cut} on differs in tick {tick} at {place}\n{source}");
            }
            assert_eq!(events, expected, "{} from {cut} on, tick {tick}\n{source}", other.name);
        }
    }
    let end = whole.executive.checkpoint();
    for (other, cut) in others.iter().zip(cuts) {
        assert!(other.executive.checkpoint() == end, "{} from {cut} on: the end", other.name);
    }
}

/// Runs a download that must do the same in all engines. Returns the events.
pub(super) fn compare(
    source: &str,
    stimulus: &str,
    ticks: u32,
    controller: Controller,
) -> Vec<Event> {
    run(source, stimulus, ticks, controller).unwrap_or_else(|why| panic!("{why}\n{source}"))
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
        for Machine { name, mut engine, mut executive } in
            machines(&case.source, Controller::Pmac, false).unwrap()
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
