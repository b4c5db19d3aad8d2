//! Whether the optimised IR does what the unoptimised IR does is proved, and wrong rewrites are refuted.

#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "tests")]

mod support;

use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::atomic::AtomicU64;
use std::time::{Duration, Instant};

use fastrand::Rng;
use plcc_abi::pmac::pure_functions;
use plcc_abi::{Dialect, Engine, Host, HostFn, Scan, TimeLimit};
use plcc_ir::interp::Interpreter;
use plcc_ir::passes::{OptLevel, optimize};
use plcc_ir::text::{parse, print};
use plcc_ir::{Module, RegionId};
use plcc_prove::validate::{Validation, Verdict};

/// A program before and after the passes; `None` where it has errors.
fn versions(dialect: Dialect, text: &str) -> Option<[Module; 2]> {
    let before = support::Bench::try_new(dialect, text)?.lowered.module;
    let mut after = before.clone();
    optimize(&mut after, OptLevel::Speed);
    Some([before, after])
}

/// What is found out about each function, and the time it took.
fn answers(before: &Module, after: &Module, time: Duration) -> Vec<(String, Verdict, Duration)> {
    let validation = Validation::new(before, after);
    let answer = |number| {
        let begin = Instant::now();
        let answer = validation.function(number, time);
        (answer.function, answer.verdict, begin.elapsed())
    };
    (0..validation.len()).map(answer).collect()
}

const PMI: &str = "$INPUT\nA = 0/0\nB = 0/1\nC = 0/2\n$OUTPUT\nX = 1/0\nY = 1/1\nZ = 1/2\n$INTEGER\nN, M\n$END\n\
                   X = A & B ! C\nIF (A)\nN = N + 1\nY = C\nENDIF\nIF (N > 20)\nM = N / 10\nENDIF\nZ = M = 3\n";

const NCT: &str = ":000\nJ0\n:001\nI510 U547 Z\n(I470AI540) U470 D471 Z\nI520\n  LRH000\n  =6\n    D547 UF0200\n    ,250 ST00\n  Z\nZ\n\
                   LY40 A.FF00 SY40\nLRH028 SRH078\nJ1\n";

const PMAC: &str = "I5=2\nOPEN PLC 1 CLEAR\nP1=P2+P3*2\nIF (P1>10)\nP4=P4+1\nELSE\nP4=0\nENDIF\nWHILE (P5<10)\nP5=P5+1\n\
                    ENDWHILE\nP6=P7/3\nCLOSE\n";

/// Programs of PMAC: steps whose tests are threaded past each other, and become selections; remainders, sums and comparisons that become
/// those of integers; sums of which it is known that they are not -0.
const MORE_OF_PMAC: [&str; 4] = [
    "IF (P1=2 AND M6=1)\nP1=3\nM90=2260\nENDIF\nIF (P1=3 AND M2=1)\nP1=4\nSEND\"RUNNING\"\nENDIF\n\
     IF (P1>0 AND P1<4 AND M90<0)\nIF (P1=2)\nSEND\"HOOD\"\nENDIF\nIF (P1=3)\nSEND\"SPINDLE\"\nENDIF\nP1=0\nENDIF\n\
     IF (P1=4)\nIF (M6=0)\nSEND\"LOST\"\nP1=0\nENDIF\nIF (M2=0)\nSEND\"OPEN\"\nP1=0\nENDIF\nENDIF\n",
    "P3=(P3+1)%3\nP4=P5%4\nP6=P7%3\n",
    "IF (M90>0 OR Q3=P1)\nP5=P4\nELSE\nP6=P4\nENDIF\nP7=P4\n",
    "P4=P4*0.5+P50\nM2=M2\nM6=M6\nM90=M90\n",
];

/// Programs of all languages whose passes are proved to be right: what `PLCC_VALIDATE` names, files divided by blanks (with
/// `PLCC_VALIDATE_SECONDS` for each function), or these.
#[test]
fn what_passes_make_of_programs_is_proved() {
    if let Ok(files) = std::env::var("PLCC_VALIDATE") {
        let seconds = std::env::var("PLCC_VALIDATE_SECONDS").ok();
        let limit = Duration::from_secs(seconds.map_or(20, |text| text.parse().unwrap()));
        for file in files.split(' ') {
            let text = String::from_utf8_lossy(&std::fs::read(file).unwrap()).into_owned();
            let dialect = match file {
                it if it.ends_with(".pmi") => Dialect::Pmi,
                it if it.contains("nct") => Dialect::Nct,
                _ => Dialect::Pmac,
            };
            let Some([before, after]) = versions(dialect, &text) else { continue };
            for (name, verdict, time) in answers(&before, &after, limit) {
                eprintln!("{file} {name} {time:?} {verdict:?}");
                assert!(!matches!(verdict, Verdict::Refuted(_)), "{file} {name}");
            }
        }
        return;
    }
    let more = MORE_OF_PMAC.map(|body| {
        let text = format!(
            "M2->Y:$FFC2,1\nM6->Y:$FFC2,5\nM90->X:$0700,0,24,S\nOPEN PLC 1 CLEAR\n{body}CLOSE\n"
        );
        (Dialect::Pmac, text)
    });
    let programs = [(Dialect::Pmi, PMI), (Dialect::Nct, NCT), (Dialect::Pmac, PMAC)];
    for (dialect, text) in programs.map(|(it, text)| (it, text.to_owned())).into_iter().chain(more)
    {
        let Some([before, after]) = versions(dialect, &text) else { panic!("{text}") };
        for (name, verdict, time) in answers(&before, &after, Duration::from_secs(60)) {
            eprintln!("{dialect:?} {name} {time:?}");
            assert!(matches!(verdict, Verdict::Proved), "{dialect:?} {name}: {verdict:?}");
        }
    }
}

/// A text of IR with one line changed, for each line in which that can be done.
fn changed(text: &str, from: &str, to: &str) -> Vec<String> {
    let lines: Vec<&str> = text.lines().collect();
    let places = lines.iter().enumerate().filter(|(_, line)| line.contains(from));
    let change = |(at, line): (usize, &&str)| {
        let new = line.replacen(from, to, 1);
        let mut all: Vec<&str> = lines.clone();
        all[at] = &new;
        all.join("\n") + "\n"
    };
    places.map(change).collect()
}

/// Ten kinds of wrong rewrites: what is proved of one is found to be the same by no run, and most are refuted.
#[test]
fn wrong_rewrites_are_refuted() {
    const KINDS: [(&str, &str); 10] = [
        (" = and ", " = or "),
        (" = or ", " = xor "),
        (" = add ", " = sub "),
        ("icmp sgt", "icmp sge"),
        ("icmp slt", "icmp ult"),
        (" = ashr ", " = lshr "),
        (" = fadd ", " = fsub "),
        ("    store ", "    ;; store "),
        ("iconst 1\u{0}", "iconst 2\u{0}"),
        (" = sext ", " = zext "),
    ];
    let (mut refuted, mut proved, mut open) = (0, 0, vec![]);
    for (dialect, text) in [(Dialect::Pmi, PMI), (Dialect::Nct, NCT), (Dialect::Pmac, PMAC)] {
        let [before, after] = versions(dialect, text).unwrap();
        let text = print(&after).replace('\n', "\u{0}\n");
        for (from, to) in KINDS {
            for wrong in changed(&text, from, to) {
                let Ok(wrong) = parse(&wrong.replace('\u{0}', "")) else { continue };
                for (name, verdict, _) in answers(&before, &wrong, Duration::from_secs(4)) {
                    match verdict {
                        Verdict::Refuted(difference) => {
                            refuted += 1;
                            assert!(!difference.what.is_empty());
                        }
                        Verdict::Proved => {
                            eprintln!("same: {from} to {to}");
                            proved += 1;
                        }
                        Verdict::Undecided(reason) => {
                            open.push(format!("{dialect:?} {from} {name} {reason:?}"));
                        }
                    }
                }
            }
        }
    }
    eprintln!("{refuted} refuted, {proved} proved, {open:#?}");
    assert!(refuted >= 20, "{refuted} refuted, {proved} proved, {open:#?}");
    assert!(open.len() <= refuted / 4, "{open:#?}");
}

/// Random programs: none is refuted. `PLCC_SEEDS` says how many of each language.
#[test]
fn passes_do_not_change_what_random_programs_do() {
    type Make = fn(&mut Rng) -> (String, String);
    let pmac: Make = |rng| support::pmac::program(rng, support::pmac::Kind::All);
    let languages =
        [(Dialect::Pmi, support::pmi as Make), (Dialect::Nct, support::nct), (Dialect::Pmac, pmac)];
    let mut all = 0;
    for (dialect, make) in languages {
        let (mut proved, mut open) = (0, 0);
        for seed in support::seeds(8) {
            let (text, _) = make(&mut Rng::with_seed(seed));
            let Some([before, after]) = versions(dialect, &text) else { continue };
            for (name, verdict, _) in answers(&before, &after, Duration::from_millis(400)) {
                match verdict {
                    Verdict::Proved => proved += 1,
                    Verdict::Undecided(_) => open += 1,
                    Verdict::Refuted(found) => panic!("seed {seed}: {name} {found:?}\n{text}"),
                }
            }
        }
        eprintln!("{dialect:?}: {proved} functions proved, {open} undecided");
        all += proved;
    }
    assert!(all > 0, "nothing is proved");
}

/// A host whose answers depend on all that it was asked, and on the image then. Each scan is late, and may go on some times.
#[derive(Default)]
struct Mixer(u64, u32);

impl Host for Mixer {
    fn call(&mut self, image: &mut [u8], function: HostFn, args: [u64; 4]) -> u64 {
        if let Some(result) = pure_functions::call(function, args) {
            return result;
        }
        if function == HostFn::Fmod {
            return (f64::from_bits(args[0]) % f64::from_bits(args[1])).to_bits();
        }
        assert!(!function.is_pure(), "{function:?} has no value here");
        let mut hasher = DefaultHasher::new();
        (self.0, function as u32, args, &*image).hash(&mut hasher);
        self.0 = hasher.finish();
        self.0 % 4
    }

    fn extend_time(&mut self) -> Option<u64> {
        self.1 += 1;
        (!self.1.is_multiple_of(50)).then_some(1)
    }
}

/// An image in which all is kept up that the executive keeps up.
fn random_image(module: &Module, rng: &mut Rng) -> Vec<u8> {
    let mut image = vec![0; module.image_size as usize];
    for (number, region) in module.regions.iter().enumerate() {
        let id = RegionId(number as u32);
        let bytes = &mut image[region.offset as usize..(region.offset + region.size) as usize];
        if region.bits {
            bytes.iter_mut().for_each(|byte| *byte = rng.u8(0..2));
        } else if module.finite_regions.contains(&id) {
            for double in bytes.chunks_exact_mut(8) {
                let value = match rng.u8(0..5) {
                    0 => 0.0,
                    1 => f64::from(rng.i32(..)) / 16.0,
                    2 => f64::from(rng.i32(..)),
                    3 => f64::from(rng.i32(..)) * 65536.0,
                    _ => f64::from(rng.i8(-20..20)),
                };
                double.copy_from_slice(&value.to_le_bytes());
            }
        } else {
            let is_words = module.word_regions.contains(&id);
            for word in bytes.chunks_mut(4) {
                let value = match rng.u8(0..4) {
                    0 => 0,
                    1 => rng.i32(-9..200),
                    _ => rng.i32(..),
                };
                let value = if is_words { value & 0xff_ffff } else { value };
                word.copy_from_slice(&value.to_le_bytes()[..word.len()]);
            }
        }
    }
    image
}

/// Whether two versions of a module differ in runs in the interpreter, each of three scans of a task with random images. It takes a
/// second at most.
fn runs_differ(before: &Module, after: &Module) -> bool {
    let trace = |engine: &mut Interpreter, seed: u64, task: usize| {
        let (mut rng, mut host) = (Rng::with_seed(seed), Mixer::default());
        let (mut rows, mut from) = (vec![], None);
        for _ in 0..3 {
            let mut image = random_image(before, &mut rng);
            let limit = TimeLimit { epoch: &AtomicU64::new(1), limit: 1 };
            let mut scan = Scan { image: &mut image, host: &mut host, limit };
            let outcome = engine.call(task, from, &mut scan);
            from = outcome.resume_point();
            rows.push((image, format!("{outcome:?}"), host.0));
        }
        rows
    };
    let mut engines = [before, after].map(|module| Interpreter::new(module.clone()));
    let begin = Instant::now();
    let seeds = (0..300).take_while(|_| begin.elapsed() < Duration::from_secs(1));
    let mut all = seeds.flat_map(|seed| (0..before.tasks.len()).map(move |task| (seed, task)));
    all.any(|(seed, task)| {
        let [one, other] = engines.each_mut().map(|engine| trace(engine, seed, task));
        one != other
    })
}

/// Two versions of modules in the folder that `PLCC_VALIDATE_PAIRS` names: `X.ir`, and `X.after` that passes have made of it. Gives how
/// many functions are proved, undecided and refuted. `scripts/full validate` looks at what passes with mistakes make. What is proved of all
/// functions of a module is tried in the interpreter, too.
#[test]
fn pairs_of_versions() {
    let Some(folder) = std::env::var_os("PLCC_VALIDATE_PAIRS") else { return };
    let seconds = std::env::var("PLCC_VALIDATE_SECONDS").ok();
    let limit = Duration::from_secs(seconds.map_or(2, |text| text.parse().unwrap()));
    let mut files: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| file.extension().is_some_and(|ending| ending == "after"));
    files.sort();
    let (mut proved, mut open, mut refuted) = (0, 0, vec![]);
    for file in files {
        let read = |file: &std::path::Path| {
            parse(&std::fs::read_to_string(file).unwrap())
                .unwrap_or_else(|error| panic!("{}: {error}", file.display()))
        };
        let (before, after) = (read(&file.with_extension("ir")), read(&file));
        let mut is_proved = true;
        for (name, verdict, _) in answers(&before, &after, limit) {
            is_proved &= matches!(verdict, Verdict::Proved);
            match verdict {
                Verdict::Proved => proved += 1,
                Verdict::Undecided(reason) => {
                    open += 1;
                    eprintln!("{} {name}: {reason:?}", file.display());
                }
                Verdict::Refuted(found) => {
                    refuted.push(format!("{} {name}: {}", file.display(), found.what));
                }
            }
        }
        let differs = is_proved && runs_differ(&before, &after);
        assert!(!differs, "{} is proved, but runs differ", file.display());
    }
    println!("{proved} proved, {open} undecided, {} refuted", refuted.len());
    refuted.iter().for_each(|line| println!("{line}"));
}
