//! What observers of the statement interpreters are told, and that being observed changes nothing.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing)]

use plcc_abi::engine::NoHost;
use plcc_abi::pmac::Run;
use plcc_abi::{Dialect, Outcome, ResumePoint, Scan, Tables};
use plcc_diag::SourceMap;
use plcc_frontend::common::{Accessed, MemoryLoader, Observer, Options, Value};
use plcc_frontend::{CheckedProgram, language};

/// Notes everything in short lines: `3:` for a statement in line 3, `X=1` for a read, `X:=1` for a
/// write.
struct Notes<'a> {
    program: &'a dyn CheckedProgram,
    lines: Vec<Option<u32>>,
    notes: &'a mut Vec<String>,
}

fn shown(program: &dyn CheckedProgram, variable: Accessed) -> String {
    program.name(variable).unwrap_or_else(|| format!("{variable:?}"))
}

impl Observer for Notes<'_> {
    fn statement(&mut self, statement: u32, _: &[u8]) {
        if let Some(line) = self.lines[statement as usize] {
            self.notes.push(format!("{line}:"));
        }
    }

    fn read(&mut self, variable: Accessed, value: Value) {
        self.notes.push(format!("{}={}", shown(self.program, variable), value.number()));
    }

    fn write(&mut self, variable: Accessed, value: Value) {
        self.notes.push(format!("{}:={}", shown(self.program, variable), value.number()));
    }
}

struct Case {
    program: Box<dyn CheckedProgram>,
    sources: SourceMap,
    image: Vec<u8>,
}

impl Case {
    fn new(dialect: Dialect, text: &str) -> Self {
        let mut sources = SourceMap::new();
        let file = sources.add("a", text.as_bytes());
        let (program, diagnostics) = language(dialect).check(
            &mut sources,
            &[file],
            &MemoryLoader::new(),
            &Options::default(),
        );
        let program = program.unwrap_or_else(|| panic!("{diagnostics:?}"));
        let tables = program.lower().unwrap().program;
        let mut image = vec![0; tables.image_size as usize];
        if let Tables::Pmac(tables) = &tables.tables {
            Run::unpack(&tables.initial, &mut image);
        }
        Self { program, sources, image }
    }

    /// Runs a scan of the first task twice, once observed. Both must end alike.
    fn scan(&mut self, from: Option<ResumePoint>) -> (Outcome, Vec<String>) {
        let mut plain = self.image.clone();
        let mut host = NoHost;
        let mut scan = Scan::new(&mut plain, &mut host);
        let expected = self.program.interpreter().call(0, from, &mut scan);
        let line = |span: plcc_diag::Span| self.sources.line_col(span.file, span.start).0;
        let lines = self.program.statements().into_iter().map(|span| span.map(line)).collect();
        let mut notes = vec![];
        let mut host = NoHost;
        let mut scan = Scan::new(&mut self.image, &mut host);
        let mut interpreter = self.program.statement_interpreter();
        let observer = &mut Notes { program: self.program.as_ref(), lines, notes: &mut notes };
        let outcome = interpreter.call_observed(0, from, &mut scan, observer);
        assert_eq!(outcome, expected);
        assert!(self.image == plain, "being observed has changed the image");
        (outcome, notes)
    }
}

#[test]
fn pmi_tells_statements_reads_writes_and_what_timers_and_flipflops_do() {
    let text = "$TIMER\nE/TC/DC = 5\n$FLIPFLOP\nQ/D/CK/PR/CL\n$INTEGER\nN,A[4]\n$END\n\
                D = 1\nCK = D\nIF (Q)\nA[N+1] = N-1\nENDIF\nIF (DC)\nN = 9\nENDIF\nTC = Q\n";
    let mut case = Case::new(Dialect::Pmi, text);
    let (outcome, mut notes) = case.scan(None);
    assert_eq!(outcome, Outcome::End);
    // The counter of the timer comes last.
    let counter = notes.pop().unwrap();
    assert!(["TC#COUNT:=0", "TC#COUNT:=5"].contains(&counter.as_str()), "{counter}");
    let expected =
        "8: D:=1 9: D=1 CK:=1 Q:=1 10: Q=1 11: N=0 N=0 A[1]:=-1 13: DC=0 16: Q=1 TC:=1 DC:=0";
    assert_eq!(notes.join(" "), expected);
}

#[test]
fn nct_tells_bits_words_op_and_open_calls() {
    let text = ":001\nLF020\n+ 2\nSF020\nNY012 U012 Z\nC010\nJ1\n:000\nJ0\n:010\nUQ03\nR\n";
    let mut case = Case::new(Dialect::Nct, text);
    // The module needs room for its calls: fuel for safepoints.
    let layout = case.program.lower().unwrap().program;
    let context = layout.regions.iter().find(|region| region.name == "context").unwrap();
    let fuel = (context.offset + plcc_abi::nct::context::FUEL) as usize;
    case.image[fuel] = 100;
    let module_1 = layout.tasks.iter().position(|task| task.name.contains("001"));
    assert!(module_1.is_some() || layout.tasks.len() == 2);
    let (_, notes) = case.scan(None);
    assert_eq!(notes.join(" "), "9:", "the first task is :000");
    struct OfModule1<'a>(&'a dyn CheckedProgram, Vec<String>);
    impl Observer for OfModule1<'_> {
        fn statement(&mut self, statement: u32, _: &[u8]) {
            self.1.push(format!("#{statement}"));
        }
        fn read(&mut self, variable: Accessed, value: Value) {
            self.1.push(format!("{}={}", shown(self.0, variable), value.number()));
        }
        fn write(&mut self, variable: Accessed, value: Value) {
            self.1.push(format!("{}:={}", shown(self.0, variable), value.number()));
        }
    }
    let mut notes = OfModule1(case.program.as_ref(), vec![]);
    let mut host = NoHost;
    let mut scan = Scan::new(&mut case.image, &mut host);
    case.program.statement_interpreter().call_observed(1, None, &mut scan, &mut notes);
    let notes: Vec<_> = notes.1.into_iter().filter(|note| !note.starts_with('#')).collect();
    assert_eq!(
        notes.join(" "),
        "F020=0 F0040:=0 F0046:=0 F0047:=0 OP1:=2 F020:=2 Y012=0 Y012:=1 Q03=0 Q03:=1"
    );
}

#[test]
fn pmac_tells_variables_by_their_names_and_words_of_memory() {
    let text = "M11->Y:$FFC2,8\nM50->F:$D200\nI5=2\nOPEN PLC 1 CLEAR\nP1=P1+1\nADDRESS &2\n\
                Q5=P1*2\nIF (P1=1)\nM11=Q5\nELSE\nM11=0\nENDIF\nP(P1+1)=SIN(0)\nM50=2\n\
                WHILE (P1=1)\nENDWHILE\nCLOSE\n";
    let mut case = Case::new(Dialect::Pmac, text);
    let (outcome, notes) = case.scan(None);
    assert_eq!(outcome, Outcome::Suspended(ResumePoint(0)));
    assert_eq!(
        notes.join(" "),
        "5: P1=0 P1:=1 6: 7: P1=1 &2Q5:=2 8: P1=1 9: &2Q5=2 M11:=0 13: P1=1 P2:=0 \
         14: X:$D200:=16384 Y:$D200:=0 M50:=2 15: P1=1 16:"
    );
}
