//! Records of controls in real time: what is in them when the process is killed or its program stopped, and
//! that every tick is run again from them as it went, whatever the clock had decided.

use std::fs;
use std::process::Command;

use plcc::compile;
use plcc::disk::Disk;
use plcc::recorded::{Found, ReplayEngine};
use plcc_abi::Dialect;
use plcc_diag::SourceMap;
use plcc_frontend::common::Options;
use plcc_host::session::replay::recorded_executive;
use plcc_record::{RecordedProgram, RecordedRun, Recording, Replayer};
use plcc_runtime::Stop;

use crate::shop::{Shop, loader, wait};

/// Counts scans, and has an output that changes.
const PMI: &str = "$OUTPUT\nLAMP = 1/0\n$INTEGER\nN\n$END\nN = N + 1\nLAMP = N > 100\n";

/// `:000` never comes to its end, so that the clock decides in each slice how far it comes.
const NCT: &str = ":001\nLF500 +1 SF500\nJ1\n:000\n:010\nLF502 +1 SF502\nG010\nJ0\n";

const PMAC: &str = "I5=3\nI8=20\nOPEN PLC 0 CLEAR\nP2=P2+1\nCLOSE\nOPEN PLC 1 CLEAR\nP1=P1+1\nWHILE (P3<50)\n\
                    P3=P3+1\nENDWHILE\nP3=0\nCLOSE\n";

/// The program in a record, or that of these sources, if there are any.
fn program(run: &RecordedRun, source: Option<(Dialect, &str)>) -> Found {
    let Some((dialect, source)) = source else {
        return Found::in_record(run.programs.first().unwrap()).unwrap();
    };
    let mut sources = SourceMap::new();
    let file = sources.add("p", source.as_bytes());
    let (checked, _) = compile::check(&mut sources, &[file], dialect, &Disk, &Options::default());
    Found::of_checked(checked.unwrap(), sources)
        .unwrap()
        .in_place_of(run.programs.first().unwrap())
        .unwrap()
}

/// Runs all ticks of a run again, which must go as recorded. Gives their number, and how the program was
/// stopped, if it was.
fn replay(
    recording: &Recording,
    run: &RecordedRun,
    found: &Found,
    engine: ReplayEngine,
) -> (u64, Option<Stop>) {
    let mut engine = found.engine(engine).unwrap();
    let executive = recorded_executive(&run.header, &found.program).unwrap();
    let mut replayer = Replayer::new(recording, run, 0, executive);
    let (mut ticks, mut stop, mut events) = (0, None, vec![]);
    while let Some(replayed) = replayer.step(engine.as_mut(), &mut events).unwrap() {
        assert!(replayed.matches, "{replayed:?}");
        ticks = replayed.tick + 1;
        stop = replayed.stop.or(stop);
    }
    if let Some((_, matches)) = replayer.end() {
        assert!(matches, "the hash after the last tick");
    }
    (ticks, stop)
}

/// How many ticks the last run of a record has by now.
fn recorded_ticks(shop: &Shop) -> u64 {
    let Ok(recording) = Recording::open(&shop.path("r.plcrec")) else { return 0 };
    let last = recording.last_run().and_then(|run| run.spans.last());
    last.map_or(0, |span| recording.end_of(span).unwrap_or(0))
}

fn wait_for_ticks(shop: &Shop, ticks: u64) {
    while recorded_ticks(shop) < ticks {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
}

/// A control that is killed leaves what it has done, and the next one is appended to that. What the
/// clock decided is in the record: how far a module of NCT came in each slice, say.
#[test]
fn a_killed_control_leaves_its_record() {
    for (dialect, source) in [(Dialect::Pmi, PMI), (Dialect::Nct, NCT), (Dialect::Pmac, PMAC)] {
        let shop = Shop::new(&format!("killed-{}", dialect.name()), dialect, source);
        let options = "--realtime --watchdog 1h --no-supervisor --record r.plcrec";
        for _ in 0..2 {
            let runs = Recording::open(&shop.path("r.plcrec")).map_or(0, |it| it.runs().len());
            let mut child = shop.command(options).spawn().unwrap();
            while Recording::open(&shop.path("r.plcrec")).map_or(0, |it| it.runs().len()) == runs {
                std::thread::sleep(std::time::Duration::from_millis(20));
            }
            wait_for_ticks(&shop, 15);
            child.kill().unwrap();
            wait(&mut child);
        }
        let recording = Recording::open(&shop.path("r.plcrec")).unwrap();
        assert_eq!(recording.runs().len(), 2, "{dialect:?}");
        for run in recording.runs() {
            assert_eq!(run.end, None, "{dialect:?}");
            assert!(matches!(run.programs[..], [RecordedProgram::Artifact(_)]));
            let in_record = program(run, None);
            let (ticks, stop) = replay(&recording, run, &in_record, ReplayEngine::Aot);
            assert!(ticks >= 15 && stop.is_none(), "{dialect:?}: {ticks} {stop:?}");
            let from_disk = program(run, Some((dialect, source)));
            assert_eq!(replay(&recording, run, &from_disk, ReplayEngine::Jit).0, ticks);
            // What compiled code does in 5 ms takes an interpreter much longer.
            let first = if dialect == Dialect::Nct { 2 } else { ticks };
            let mut engine = from_disk.engine(ReplayEngine::Interpreter).unwrap();
            let executive = recorded_executive(&run.header, &from_disk.program).unwrap();
            let mut replayer = Replayer::new(&recording, run, 0, executive);
            let mut done = 0;
            while done < first
                && let Some(replayed) = replayer.step(engine.as_mut(), &mut vec![]).unwrap()
            {
                assert!(replayed.matches, "{dialect:?}: {replayed:?}");
                done = replayed.tick + 1;
            }
            assert!(done >= first, "{dialect:?}: {done}");
        }
    }
}

/// A module that the clock stops is stopped at the same statement again.
#[test]
fn a_module_that_takes_too_long_is_stopped_in_the_replay_too() {
    let source = ":001\n:010\nLF500 +1 SF500\nG010\nJ1\n:000\nJ0\n";
    let shop = Shop::new("too-long", Dialect::Nct, source);
    let options = "--realtime --watchdog 1h --no-supervisor --record r.plcrec";
    let mut child = shop.command(options).spawn().unwrap();
    assert_eq!(wait(&mut child).code(), Some(3));
    let recording = Recording::open(&shop.path("r.plcrec")).unwrap();
    let run = recording.last_run().unwrap();
    for engine in [ReplayEngine::Jit, ReplayEngine::Aot] {
        let found = program(run, Some((Dialect::Nct, source)));
        let (ticks, stop) = replay(&recording, run, &found, engine);
        assert_eq!(ticks, 1);
        assert_eq!(stop.unwrap().code, "PLC TIMEOUT1");
    }
}

/// A record that can't be written is an error in simulated time. In real time it is told, and the control
/// runs all the same.
#[test]
fn a_record_that_can_not_be_written_stops_no_control() {
    let shop = Shop::new("unwritten", Dialect::Pmi, PMI);
    let exit = |args: &str| wait(&mut shop.command(args).spawn().unwrap()).code();
    for path in ["/dev/full", "missing/r.plcrec"] {
        let options = format!("--ticks 5 --period 1 --dump d.json --log log.jsonl --record {path}");
        assert_eq!(exit(&options), Some(2), "{path}");
        let options = format!("{options} --realtime --watchdog 1h --no-supervisor");
        assert_eq!(exit(&options), Some(0), "{path}");
        assert!(shop.read("d.json").contains("\"ticks\":5,"), "{path}");
        assert!(shop.read("log.jsonl").contains("the run is not recorded"), "{path}");
    }
}

/// With a configuration a control is recorded beside its retained file, unless it says otherwise.
#[test]
fn a_control_with_a_configuration_is_recorded() {
    let shop = Shop::new("configured", Dialect::Pmi, PMI);
    let text = "artifact = \"p.plcx\"\nretain = \"kept\"\nkeep = \"1MB\"\nperiod = 1\n";
    fs::write(shop.path("c.toml"), text).unwrap();
    let run = |args: &str| {
        let mut command = Command::new(loader());
        let args = format!("--config c.toml --ticks 20 {args}");
        command.args(args.split_whitespace()).current_dir(shop.path(""));
        assert_eq!(wait(&mut command.spawn().unwrap()).code(), Some(0), "{args}");
    };
    run("--no-record");
    assert!(!shop.path("kept.plcrec").exists());
    run("");
    let recording = Recording::open(&shop.path("kept.plcrec")).unwrap();
    let run = recording.last_run().unwrap();
    assert_eq!(run.end.as_ref().map(|end| end.ticks), Some(20));
    let found = program(run, None);
    assert_eq!(replay(&recording, run, &found, ReplayEngine::Aot).0, 20);
}
