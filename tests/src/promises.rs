//! What the compiler promises for any input at all, as functions that check it: the oracles of
//! fuzzing. Each takes any bytes and returns if all promises are kept; it panics if one is broken.
//! `fuzz/` runs them on inputs that libFuzzer invents, `tests/tests/all_languages/fuzz_replay.rs` on
//! the saved inputs and on random changes of them.

#![allow(clippy::panic)]

use std::path::Path;
use std::sync::OnceLock;

use plcc::compile::{Checked, CompileError, check, code};
use plcc_abi::{Dialect, Program};
use plcc_codegen::{CodegenOptions, OptLevel, Optimization, Target, emit};
use plcc_configuration::Configuration;
use plcc_control::ControlArgs;
use plcc_diag::{Diagnostic, FileId, SourceMap, render};
use plcc_frontend::common::{Controller, Limits, MemoryLoader, Options};
use plcc_host::args::RunArgs;
use plcc_host::socket::Dialogue;
use plcc_host::{configuration, retain};
use plcc_ir::{Module, text, verify};
use plcc_load::Artifact;
use plcc_load::header;
use plcc_load::signature::{self, PublicKey};

use crate::no_fault::faults;

/// Checks the promises for one input; panics if one is broken.
pub type Promise = fn(&[u8]);

/// The promises for each kind of input, with the name of its fuzz target.
pub const PROMISES: [(&str, Promise); 9] = [
    ("parse_pmi", parse_pmi),
    ("parse_nct", parse_nct),
    ("parse_pmac", parse_pmac),
    ("artifact", artifact),
    ("ir_text", ir_text),
    ("retained", retained),
    ("key", key),
    ("configuration", configuration),
    ("socket", socket),
];

/// Takes the bytes as a PMI program: checks it with the limits of the original control and without
/// them; if it has no errors, lowers and optimises it.
pub fn parse_pmi(bytes: &[u8]) {
    for limits in [Limits::Original, Limits::None] {
        source(bytes, Dialect::Pmi, &Options { limits, ..Options::default() });
    }
}

/// Does the same with the bytes as an NCT program.
pub fn parse_nct(bytes: &[u8]) {
    for limits in [Limits::Original, Limits::None] {
        source(bytes, Dialect::Nct, &Options { limits, ..Options::default() });
    }
}

/// Takes the bytes as a PMAC download. Whether it is for PMAC or Turbo PMAC depends on the number
/// of bytes: trying both would take twice the time, since their images are large.
pub fn parse_pmac(bytes: &[u8]) {
    let controller = match bytes.len() % 2 {
        0 => Controller::Pmac,
        _ => Controller::Turbo,
    };
    source(bytes, Dialect::Pmac, &Options { controller, ..Options::default() });
}

fn source(bytes: &[u8], dialect: Dialect, options: &Options) {
    let mut sources = SourceMap::new();
    let file = sources.add("fuzz", bytes);
    let loader = MemoryLoader::new();
    let (checked, found) = check(&mut sources, &[file], dialect, &loader, options);
    let errors = found.iter().filter(|diagnostic| diagnostic.is_error()).count();
    for diagnostic in &found {
        place(&sources, diagnostic);
    }
    for diagnostic in found.iter().take(20) {
        let drawn = render::draw(&sources, diagnostic, false);
        assert!(drawn.contains(diagnostic.code), "{drawn}");
    }
    if checked.is_none() {
        assert!(errors > 0, "there is neither a program nor an error");
    }
    if let Some(checked) = checked {
        program(&checked);
    }
}

/// Checks that a diagnostic points to a place inside the text, and that its code has a page.
fn place(sources: &SourceMap, diagnostic: &Diagnostic) {
    let span = diagnostic.span;
    let text = sources.text(span.file);
    let inside = text.get(span.start as usize..span.end as usize).is_some();
    assert!(inside, "{diagnostic:?} is outside the text, or inside a character");
    in_its_line(sources, span.file, span.start);
    assert!(
        plcc_diag::find_code(diagnostic.code).is_some(),
        "nothing explains {}",
        diagnostic.code
    );
}

/// Checks that the line and column of an offset are where the text has it: the line's characters before the
/// column end in front of it, and the others begin there.
fn in_its_line(sources: &SourceMap, file: FileId, offset: u32) {
    let (line, column) = sources.line_col(file, offset);
    let (text, of_line) = (sources.text(file), sources.line_text(file, line));
    let (before, after) = text.split_at(offset as usize);
    let mut characters = of_line.char_indices();
    let split = characters.nth((column - 1) as usize).map_or(of_line.len(), |(at, _)| at);
    let (head, tail) = of_line.split_at(split);
    // An offset between the two characters of a line end is after the line's text.
    let before = if after.starts_with('\n') { before.trim_end_matches('\r') } else { before };
    let starts = before.strip_suffix(head);
    let starts = starts.is_some_and(|rest| rest.is_empty() || rest.ends_with(['\n', '\r']));
    let is_there = starts && after.starts_with(tail);
    assert!(is_there, "offset {offset} is not at line {line}, column {column}: {of_line:?}");
}

fn program(checked: &Checked) {
    let lowered = match checked.lower() {
        Ok(lowered) => lowered,
        // A long program is refused with a diagnostic.
        Err(CompileError::TooLong(_)) => return,
        Err(error) => panic!("it is not lowered: {error}"),
    };
    let found = verify::verify(&lowered.module);
    assert!(found.is_empty(), "lowered IR breaks a rule: {found:?}");
    let Ok(best) = checked.optimized(OptLevel::Speed) else { panic!("it is not lowered") };
    let found = verify::verify(&best.module);
    assert!(found.is_empty(), "optimised IR breaks a rule: {found:?}");
    drop(checked.interpreter());
    let executive = plcc_control::executive(&lowered.program, &ControlArgs::default(), false, None);
    assert!(executive.is_ok(), "no executive for it: {:?}", executive.err().map(|e| e.to_string()));
}

/// Takes the bytes as an artifact: it is either refused, or reads back the same after it was
/// written again. Its code is never executed.
///
/// The bytes are tried as they are and with corrected checksums. Without these almost every changed
/// artifact would be refused at once, and nothing else of the reader would be tested.
pub fn artifact(bytes: &[u8]) {
    let mut repaired = bytes.to_vec();
    header::reseal(&mut repaired);
    for bytes in [bytes, &repaired] {
        let Ok(read) = Artifact::parse(bytes, None) else { continue };
        let again = plcc_load::encode_with(
            &read.program,
            &read.code,
            plcc_load::Attached {
                debug: &read.debug,
                sources: &read.sources,
                operator: read.operator.as_ref(),
            },
        );
        let again = again.unwrap_or_else(|error| panic!("read, but not written: {error}"));
        assert!(Artifact::parse(&again, None).is_ok_and(|copy| copy == read));
        let executive =
            plcc_control::executive(&read.program, &ControlArgs::default(), false, None);
        if let Ok(executive) = executive {
            for (_, variable) in executive.names().declared() {
                let _ = (executive.read(variable), executive.names().canonical(variable));
            }
        }
        let _ = emit::layout(&read.program);
        for offset in 0..read.code.bytes.len().min(4096) as u32 {
            let _ = read.code.line_at(offset);
        }
    }
}

/// A small artifact of each language, as the compiler makes it now, with the name of its source.
pub fn artifacts() -> Vec<(&'static str, Vec<u8>)> {
    let sources = [
        ("small.pmi", Dialect::Pmi, "$INTEGER\nA,B[3]\n$END\nA=A+1\nB[A%3+1]=A/2\n"),
        ("small.nct", Dialect::Nct, ":000 J0\n:001 I000 U012 E D013 Z\nLF020 + 1 SF020 J1\n"),
        ("small.pmc", Dialect::Pmac, "OPEN PLC 1 CLEAR\nWHILE(P1<5)\nP1=P1+1\nENDWHILE\nCLOSE\n"),
    ];
    let make = |(name, dialect, text): (&'static str, Dialect, &str)| {
        let mut sources = SourceMap::new();
        let file = sources.add(name, text.as_bytes());
        let options = Options::default();
        let (checked, _) = check(&mut sources, &[file], dialect, &MemoryLoader::new(), &options);
        let lowered = checked?.optimized(OptLevel::Speed).ok()?;
        let target = Target::host_baseline().ok()?;
        let code = code(&lowered, &target).ok()?;
        Some((name, plcc_load::encode(&lowered.program, &code).ok()?))
    };
    sources.into_iter().filter_map(make).collect()
}

/// Takes the bytes as a retained file, or, where they are none, as what stands in one: a control of each
/// language and of each PMAC either refuses it, or takes it, can go on, and saves something that it
/// takes completely the next time.
pub fn retained(bytes: &[u8]) {
    static PROGRAMS: OnceLock<Vec<Program>> = OnceLock::new();
    let programs = PROGRAMS.get_or_init(|| {
        let artifacts = artifacts().into_iter();
        let read = artifacts.filter_map(|(_, bytes)| Artifact::parse(&bytes, None).ok());
        let mut programs: Vec<Program> = read.map(|artifact| artifact.program).collect();
        assert_eq!(programs.len(), 3);
        // A program whose former text gave other values, and one for the other controller.
        for (controller, value) in [(Controller::Pmac, 7), (Controller::Turbo, 0)] {
            let mut sources = SourceMap::new();
            let file =
                sources.add("other.pmc", format!("P1={value}\nM1->Y:$C000,0,24\n").as_bytes());
            let options = Options { controller, ..Options::default() };
            let loader = MemoryLoader::new();
            let (checked, _) = check(&mut sources, &[file], Dialect::Pmac, &loader, &options);
            programs.extend(checked.and_then(|it| it.lower().ok()).map(|lowered| lowered.program));
        }
        assert_eq!(programs.len(), 5);
        programs
    });
    let state = retain::decode(bytes);
    if let Ok(state) = &state {
        let again = retain::encode(state.generation, state.dialect, &state.payload);
        assert_eq!(retain::decode(&again).as_ref(), Ok(state));
    }
    let payload = state.as_ref().map_or(bytes, |state| &state.payload);
    let start = |program: &Program| {
        let executive = plcc_control::executive(program, &ControlArgs::default(), false, None);
        executive.unwrap_or_else(|error| panic!("no executive: {error}"))
    };
    for program in programs {
        let mut executive = start(program);
        let Ok(_) = executive.restore(payload) else { continue };
        for (_, variable) in executive.names().declared() {
            let _ = executive.read(variable);
        }
        let Some(saved) = executive.retained() else { continue };
        let mut next = start(program);
        let restored = next.restore(&saved);
        assert!(restored.is_ok_and(|restored| restored.is_complete()), "it does not take its own");
        assert_eq!(next.retained(), Some(saved), "it saves another state than it took");
    }
}

/// Takes the bytes as a file of a public key: it is refused or read. A key accepts no signature that
/// is made of the same bytes.
pub fn key(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let Ok(key) = PublicKey::parse(&text) else { return };
    let (artifact, signature) = signature::split(bytes);
    if let Some(signature) = signature {
        assert!(key.verify(artifact, &signature).is_err());
    }
    assert_eq!(key.to_string().len(), 64);
}

/// Takes the bytes as the configuration of a controller. Each mistake is in a line of the text; without
/// mistakes there is an artifact to run.
pub fn configuration(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let (read, findings) = Configuration::read(&text, Path::new("etc/control.toml"));
    let last = text.bytes().filter(|&byte| byte == b'\n').count() + 1;
    let refused = configuration::apply(&read, &mut RunArgs::default());
    for mistake in findings.all().iter().chain(&refused) {
        assert!((1..=last).contains(&mistake.line) && !mistake.message.is_empty(), "{mistake:?}");
    }
    for warning in read.warnings() {
        assert!(warning.line.is_none_or(|line| (1..=last).contains(&line)), "{warning:?}");
    }
    assert!(!findings.for_control().is_empty() || read.artifact.is_some());
}

/// Takes the bytes as lines that a client of the socket sends to a control: each has a reply, which is an
/// object in one line and says whether the request was carried out. A control of PMI, NCT or PMAC is
/// asked, as the number of bytes says.
pub fn socket(bytes: &[u8]) {
    static PROGRAMS: OnceLock<Vec<Program>> = OnceLock::new();
    let programs = PROGRAMS.get_or_init(|| {
        artifacts()
            .into_iter()
            .map(|(name, bytes)| match Artifact::parse(&bytes, None) {
                Ok(artifact) => artifact.program,
                Err(error) => panic!("{name}: {error}"),
            })
            .collect()
    });
    let Some(program) = programs.get(bytes.len() % programs.len()) else { return };
    let make = |program: &Program| {
        plcc_control::executive(program, &ControlArgs::default(), true, None)
            .map_err(|error| error.to_string())
    };
    let dialogue = Dialogue::new(program.clone(), Box::new(make));
    let mut dialogue = dialogue.unwrap_or_else(|error| panic!("{error}"));
    for line in bytes.split(|&byte| byte == b'\n').take(50) {
        let reply = dialogue.reply(line);
        let lines = reply.iter().filter(|&&byte| byte == b'\n').count();
        assert!(lines == 1 && reply.ends_with(b"\n"), "the reply has {lines} lines");
        let reply: serde_json::Value = match serde_json::from_slice(&reply) {
            Ok(reply) => reply,
            Err(error) => panic!("{error}: {}", String::from_utf8_lossy(&reply)),
        };
        let is_result = reply.get("result").is_some_and(serde_json::Value::is_object);
        let is_error = reply.pointer("/error/message").is_some_and(serde_json::Value::is_string);
        let ok = reply.get("ok").and_then(serde_json::Value::as_bool);
        assert!(ok == Some(is_result || !is_error) && is_result != is_error, "{reply}");
    }
}

/// Takes the bytes as IR in its text form: it is either refused with a line and column, or read. If
/// it follows the verifier's rules, it can be printed and read again, optimised, and compiled to
/// code in which no instruction can fault.
pub fn ir_text(bytes: &[u8]) {
    let source = String::from_utf8_lossy(bytes);
    let module = match text::parse(&source) {
        Ok(module) => module,
        Err(error) => {
            assert!(error.line >= 1 && error.column >= 1, "{error:?}");
            return;
        }
    };
    if !verify::verify(&module).is_empty() {
        return;
    }
    let printed = text::print(&module);
    match text::parse(&printed) {
        Ok(copy) => assert_eq!(text::print(&copy), printed),
        Err(error) => panic!("what was printed can't be read: {error:?}\n{printed}"),
    }
    let mut best: Module = module.clone();
    let options = Optimization::from(OptLevel::Speed).run(&mut best).0;
    assert_eq!(verify::verify(&best), [], "optimised IR breaks a rule");
    let target = Target::baseline("x86_64-unknown-linux-gnu");
    let target = target.unwrap_or_else(|error| panic!("no code for x86-64: {error}"));
    for (module, options) in [(&module, CodegenOptions::NONE), (&best, options)] {
        let found = emit::clif(module, &target, options).map(|clif| faults(&clif));
        assert!(matches!(&found, Ok(faults) if faults.is_empty()), "{found:?}");
    }
    let code = plcc_codegen::compile(&best, &target, options);
    assert!(code.is_ok(), "{:?}", code.err());
}
