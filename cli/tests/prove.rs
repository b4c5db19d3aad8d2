//! `plcc prove`: what is proved, what refutes, what can't be decided, and its exit status.

#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

mod support;

use serde_json::Value as Json;
use support::Folder;

/// Two valves that exclude each other, and a lamp behind a timer of 500 scans.
const VALVES: &str = "$INPUT\nA=0/0\nB=0/1\n$OUTPUT\nX=1/0\nY=1/1\nLAMP=1/2\n$TIMER\nE/TC/DC=500\n\
                      $INTEGER\nN, S[3]\n$END\n\
                      X = A & /B\nY = B & /A\nTC = A\nLAMP = DC & B\n\
                      IF (A)\nN = (N + 1) % 4\nENDIF\n";

fn folder() -> Folder {
    let folder = Folder::with(&[]);
    folder.write("valves.pmi", VALVES);
    folder
}

fn answers(folder: &Folder, command: &str, status: i32) -> Vec<Json> {
    let done = folder.plcc(&format!("prove {command} --message-format json")).exits(status);
    done.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn what_holds_for_all_inputs_is_proved() {
    let folder = folder();
    let all = answers(&folder, "valves.pmi --never X&Y --always N<4 --never TC#COUNT>500", 0);
    assert_eq!(all.len(), 3);
    assert!(all.iter().all(|answer| answer["result"] == "proved"), "{all:?}");
    assert_eq!(all[0]["condition"], "never X&Y");
}

#[test]
fn a_refutation_is_a_stimulus_that_the_interpreter_has_run() {
    let folder = folder();
    let all = answers(&folder, "valves.pmi --never LAMP --never X&Y --never N=3", 1);
    assert_eq!(all[0]["result"], "refuted");
    assert_eq!(all[0]["scans"], 501);
    assert_eq!(all[0]["stimulus"], "valves-refuted-1.csv");
    assert_eq!(all[1]["result"], "proved");
    assert_eq!((&all[2]["result"], &all[2]["scans"]), (&"refuted".into(), &3.into()));
    let run =
        "run valves.pmi --engine interp --ticks 501 --watch LAMP --stimulus valves-refuted-1.csv";
    let done = folder.plcc(run).exits(0);
    assert_eq!(done.stdout.lines().last(), Some("500,LAMP,1"));
}

#[test]
fn people_read_the_same_answers() {
    let folder = folder();
    let done = folder.plcc("prove valves.pmi --never X&Y --never LAMP -o found").exits(1);
    let expected = "proved     never X&Y\nrefuted    never LAMP\n           in scan 500 with \
                    found/valves-refuted-1.csv\n";
    assert_eq!(done.stdout, expected);
    assert_eq!(folder.read("found/valves-refuted-1.csv"), "tick,name,value\n0,A,1\n500,B,1\n");
}

#[test]
fn the_lines_of_a_script_are_asked_and_aliases_are_names() {
    let folder = folder();
    folder.write("valves.machine.toml", "[names]\n\"X\" = { alias = \"OPEN\" }\n");
    folder.write(
        "v.plctest",
        "program \"valves.pmi\"\nnever OPEN & Y\nalways /LAMP ! B\ntest \"t\"\n  expect LAMP\nend\n",
    );
    let all = answers(&folder, "valves.pmi --script v.plctest", 0);
    assert_eq!(all.len(), 2);
    assert_eq!(all[1]["condition"], "always /LAMP ! B");
}

#[test]
fn what_has_to_follow_is_proved_or_refuted() {
    let folder = folder();
    folder.write(
        "late.pmi",
        "$INPUT\nA=0/0\n$OUTPUT\nX=1/0\nY=1/1\n$TIMER\nE/TC/DC=500\nE/TD/DD=700\n$LOGICAL\nON\n$END\n\
         IF (A)\nON = T\nENDIF\nTC = ON\nX = DC\nTD = A\nY = DD\n",
    );
    let lines = "after A, X within 499 ticks\nafter A, Y within 20 s\nafter A, ON, /@IPL within 1 tick\n\
                 after A, X within 10 s\n";
    folder.write("late.plctest", format!("program \"late.pmi\"\n{lines}"));
    let all = answers(&folder, "late.pmi --script late.plctest", 1);
    let found: Vec<_> =
        all.iter().map(|it| (it["result"].as_str().unwrap(), &it["scans"])).collect();
    assert_eq!(all[0]["condition"], "after A, X within 499 ticks");
    assert_eq!(found[0], ("refuted", &500.into()));
    // A lets go before Y has come.
    assert_eq!(found[1], ("refuted", &1001.into()));
    assert_eq!((found[2].0, found[3].0), ("proved", "proved"));
    let stimulus = folder.read("late-refuted-2.csv");
    assert!(stimulus.lines().count() <= 3, "{stimulus}");
    let done = folder.plcc("prove late.pmi --after A").exits(2);
    assert!(done.stderr.contains("`within` is expected here"), "{}", done.stderr);
    folder.plcc("prove late.pmi --script late.plctest --emit aiger").exits(0);
    let after = "A, X within 10 s";
    let done = folder.run(&["prove", "late.pmi", "--after", after]).exits(0);
    assert_eq!(done.stdout, "proved     after A, X within 10 s\n");
}

#[test]
fn what_survives_power_off_is_anything_unless_it_is_as_declared() {
    let folder = Folder::with(&[]);
    folder.write("kept.nct", ":000 J0\n:001 F5000 U012 E D012 Z I000 UF5000 Z I001 DF5000 Z J1\n");
    let first = answers(&folder, "kept.nct --never (Y012AI510)", 1);
    assert_eq!((&first[0]["result"], &first[0]["scans"]), (&"refuted".into(), &1.into()));
    answers(&folder, "kept.nct --never (Y012AI510) --retained-as-declared", 0);
}

#[test]
fn what_is_not_followed_is_undecided_with_its_line() {
    let folder = Folder::with(&[]);
    folder.write("area.nct", ":000 J0\n:001\nADD100\nF9007 U012 E D012 Z\nJ1\n");
    let all = answers(&folder, "area.nct --never Y012 --retained-as-declared", 5);
    assert_eq!(all[0]["result"], "undecided");
    let reason = all[0]["reason"].as_str().unwrap();
    assert!(reason.starts_with("area.nct:3 "), "{reason}");
}

#[test]
fn questions_are_written_for_other_model_checkers() {
    let folder = folder();
    let done = folder.plcc("prove valves.pmi --never LAMP --always N<4 --emit aiger").exits(0);
    assert_eq!((done.stdout.as_str(), done.stderr.as_str()), ("", ""));
    let bytes = std::fs::read(folder.path().join("valves.aig")).unwrap();
    assert!(bytes.starts_with(b"aig "), "{bytes:?}");
    folder.plcc("prove valves.pmi --never LAMP --always N<4 --emit aiger -o v.aag").exits(0);
    let text = folder.read("v.aag");
    for expected in ["aag ", "\ni0 A\n", "TC#COUNT.8\n", "\nb0 never LAMP\n", "\nb1 always N<4\n"] {
        assert!(text.contains(expected), "{text}");
    }
    // What is not followed is told, and may be anything in the file.
    folder.write("area.nct", ":000 J0\n:001\nADD100\nF9007 U012 E D012 Z\nJ1\n");
    std::fs::create_dir(folder.path().join("out")).unwrap();
    let done = folder.plcc("prove area.nct --never Y012 --emit aiger -o out").exits(0);
    assert!(done.stderr.contains("area.nct:3 "), "{}", done.stderr);
    let bytes = std::fs::read(folder.path().join("out/area.aig")).unwrap();
    assert!(bytes.windows(12).any(|part| part == b"not followed"), "{bytes:?}");
}

#[test]
fn contrary_outputs_are_told_and_asked() {
    let folder = folder();
    folder.write("slide.pmi", "$INPUT\nA=0/0\nB=0/1\nUP=0/2\n$OUTPUT\nVUP=1/0\nVDOWN=1/1 ? TO PUMP\nX=1/2\nY=1/3\n\
                 DOWN=1/4\n$END\nVUP = A & /VDOWN\nVDOWN = B\nX = A & /Y\nY = B & /A & /UP\nDOWN = B\n");
    // Of UP and DOWN only one is an output.
    let told = answers(&folder, "slide.pmi --contrary", 0);
    assert_eq!(told.len(), 1);
    assert_eq!(told[0]["condition"], "never VDOWN & VUP");
    assert_eq!(told[0]["outputs"], serde_json::json!(["VDOWN", "VUP"]));
    assert_eq!(told[0]["because"], "DOWN and UP in the names VDOWN and VUP");
    folder.write(
        "slide.machine.toml",
        "[names]\n\"X\" = { text = \"Futter öffnen\" }\n\"Y\" = { text = \"Futter schließen\" }\n",
    );
    let done = folder.plcc("prove slide.pmi --contrary=ask -o found").exits(1);
    assert_eq!(
        done.stdout,
        "refuted    never VDOWN & VUP\n           in scan 0 with found/slide-refuted-1.csv\n           \
         DOWN and UP in the names VDOWN and VUP\nproved     never X & Y\n           OFFNEN and SCHLIESSEN in the texts \
         \"Futter öffnen\" and \"Futter schließen\"\n"
    );
    let asked = answers(&folder, "slide.pmi --contrary=ask --never X", 1);
    assert!(asked[0].get("because").is_none(), "{asked:?}");
    assert_eq!((&asked[2]["result"], asked[2]["because"].is_string()), (&"proved".into(), true));
    let done = folder.plcc("prove valves.pmi --contrary").exits(0);
    assert!(done.stdout.is_empty() && done.stderr.contains("no outputs"), "{}", done.stderr);
    folder.plcc("prove valves.pmi --contrary --emit aiger").exits(2);
}

#[test]
fn the_examples_have_the_contrary_outputs_that_people_see_in_them() {
    let folder = folder();
    let examples = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    let mut found = vec![];
    for entry in std::fs::read_dir(examples).unwrap().map(|entry| entry.unwrap().path()) {
        let files = entry.read_dir().into_iter().flatten().map(|file| file.unwrap().path());
        for file in files.filter(|file| {
            let ending = file.extension().unwrap_or_default();
            ["pmi", "nct", "plc", "pmc"].iter().any(|known| ending == *known)
        }) {
            let told = answers(&folder, &format!("{} --contrary", file.display()), 0);
            found.extend(told.iter().map(|pair| pair["condition"].as_str().unwrap().to_owned()));
        }
    }
    found.sort();
    let of_nct = ["Y430AY434", "Y431AY435", "Y432AY436", "Y433AY437", "Y470AY471", "Y474AY475"];
    // The programs of mills have both directions of each axis, the states of start and stop, and the lamps of M3 and M4; the one of a
    // tool changer has start and stop.
    let mut expected: Vec<String> =
        of_nct.iter().chain(&of_nct).map(|pair| format!("never ({pair})")).collect();
    expected.push("never (Y470AY471)".into());
    expected.extend(["never GHIGH & GLOW".into(), "never LEFT & RIGHT".into()]);
    expected.sort();
    assert_eq!(found, expected);
}

#[test]
fn contrary_outputs_of_each_language_are_asked_in_it() {
    let folder = folder();
    folder.write("turn.nct", ":000 J0\n:001\nI000 U012 D013 Z\nI001 U013 D012 Z\nJ1\n");
    folder.write(
        "turn.machine.toml",
        "[names]\n\"Y012\" = { alias = \"TURN_CW\" }\n\"Y013\" = { alias = \"TURN_CCW\" }\n",
    );
    let asked = answers(&folder, "turn.nct --contrary=ask", 0);
    assert_eq!(asked[0]["condition"], "never (Y012AY013)");
    assert_eq!(asked[0]["result"], "proved");
    assert_eq!(asked[0]["because"], "CW and CCW in the names TURN_CW and TURN_CCW");
    let source = "#define OPEN_CLAMP M11\n#define CLOSE_CLAMP M12\nM11->Y:$FFC2,8\nM12->Y:$FFC2,9\nI5=2\n\
                  OPEN PLC 1 CLEAR\nM11=1\nM12=0\nCLOSE\n";
    folder.write("clamp.pmc", source);
    let told = answers(&folder, "clamp.pmc --contrary", 0);
    assert_eq!(told[0]["condition"], "never M11=1 AND M12=1");
}

#[test]
fn wrong_usage_is_exit_2() {
    let folder = folder();
    let done = folder.plcc("prove valves.pmi").exits(2);
    assert!(done.stderr.contains("--never"), "{}", done.stderr);
    folder.plcc("prove valves.pmi --never NOWHERE").exits(2);
    folder.plcc("prove valves.pmi --never X+Y").exits(2);
    folder.write("wrong.pmi", "$END\nX = = Y\n");
    folder.plcc("prove wrong.pmi --never X").exits(1);
}

#[test]
fn two_versions_are_proved_the_same_or_told_apart() {
    let folder = folder();
    let other = VALVES.replace("X = A & /B", "X = /(/A ! B)").replace("Y = B", "Y = A ! B");
    folder.write("new.pmi", other);
    let done = folder.plcc("diff valves.pmi new.pmi --prove --message-format json").exits(1);
    let all: Vec<Json> =
        done.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let found: Vec<_> = all.iter().map(|it| (it["name"].as_str(), it["result"].as_str())).collect();
    assert_eq!(
        found,
        [(Some("LAMP"), Some("same")), (Some("X"), Some("same")), (Some("Y"), Some("different"))]
    );
    let stimulus = all[2]["stimulus"].as_str().unwrap();
    let last = |program: &str| {
        let ticks = all[2]["scans"].as_u64().unwrap();
        let run = format!(
            "run {program} --engine interp --ticks {ticks} --watch Y --stimulus {stimulus}"
        );
        folder
            .plcc(&run)
            .exits(0)
            .stdout
            .lines()
            .last()
            .unwrap()
            .rsplit(',')
            .next()
            .unwrap()
            .to_owned()
    };
    assert_ne!(last("valves.pmi"), last("new.pmi"));
    let done = folder.plcc("diff valves.pmi valves.pmi --prove").exits(0);
    assert_eq!(done.stdout, "same       LAMP\nsame       X\nsame       Y\n");
}

/// A PMAC whose slide goes up while a key is pressed, and down when it has been let go for ten servo cycles.
const SLIDE: &str = "I5=2\nM1->Y:$FFC2,0\nM11->Y:$FFC2,8\nM12->Y:$FFC2,9\nM70->X:$700,0,24,S\n#define UP M11\n#define DOWN M12\n\
                     OPEN PLC 1 CLEAR\nIF (M1=1)\nDISABLE PLC 2\nDOWN=0\nUP=1\nELSE\nIF (UP=1)\nUP=0\nENABLE PLC 2\nENDIF\nENDIF\nCLOSE\n\
                     OPEN PLC 2 CLEAR\nM70=10\nWHILE (M70>0)\nENDWHILE\nDOWN=1\nDISABLE PLC 2\nCLOSE\nDISABLE PLC 2\n";

#[test]
fn a_pmac_is_asked_as_the_others_are() {
    let folder = Folder::with(&[("slide.pmc", SLIDE)]);
    let command = ["prove", "slide.pmc", "--never", "UP=1 AND DOWN=1", "--always", "M70<41"];
    let after = ["--after", "M1=1, UP=1 OR M1=0 within 1 tick", "--contrary=ask"];
    let done = folder.run(&[&command[..], &after[..]].concat()).exits(0);
    assert_eq!(
        done.stdout,
        "proved     never UP=1 AND DOWN=1\nproved     always M70<41\nproved     after M1=1, UP=1 OR M1=0 within 1 tick\n\
         proved     never M11=1 AND M12=1\n           UP and DOWN in the names\n"
    );
}

#[test]
fn what_refutes_a_pmac_comes_about_when_it_is_run() {
    let hasty = SLIDE.replacen("DISABLE PLC 2\n", "", 1);
    let folder = Folder::with(&[("slide.pmc", &hasty)]);
    let conditions = "--never DOWN=1 --never PLC2=1 --always P1=0";
    let all = answers(&folder, &format!("slide.pmc {conditions}"), 1);
    for (answer, watched) in all.iter().zip(["M12", "PLC2", "P1"]) {
        assert_eq!(answer["result"], "refuted", "{answer}");
        let (scans, stimulus) = (&answer["scans"], answer["stimulus"].as_str().unwrap());
        let run = format!("run slide.pmc --ticks {scans} --watch {watched} --stimulus {stimulus}");
        let last =
            folder.plcc(&run).exits(0).stdout.trim_end().rsplit(',').next().unwrap().to_owned();
        assert_ne!(last, "0", "{answer}");
    }
    let command = ["prove", "slide.pmc", "--never", "UP=1 AND DOWN=1"];
    let done = folder.run(&command).exits(1);
    assert!(
        done.stdout.starts_with("refuted    never UP=1 AND DOWN=1\n           in scan 1"),
        "{}",
        done.stdout
    );
}

#[test]
fn what_a_pmac_does_that_is_not_followed_is_told_with_its_line() {
    let text = "I5=2\nM1->Y:$FFC2,0\nM11->Y:$FFC2,8\nM12->Y:$FFC2,9\nOPEN PLC 1 CLEAR\nIF (M1=1)\nCMD\"M11->Y:$FFC2,10\"\nENDIF\n\
                M11=0\nIF (SIN(P1)>2)\nM12=1\nENDIF\nCLOSE\n";
    let folder = Folder::with(&[("a.pmc", text)]);
    let command = ["prove", "a.pmc", "--never", "M11=1", "--never", "M12=1"];
    let done = folder.run(&command).exits(5);
    let lines: Vec<&str> = done.stdout.lines().collect();
    assert!(lines[1].contains("a.pmc:7 defines an M-variable anew"), "{}", done.stdout);
    assert!(lines[3].contains("a.pmc:10 computes a function"), "{}", done.stdout);
    let done = folder.plcc("prove a.pmc --never M11=1 --background-steps 100").exits(5);
    assert!(done.stdout.contains("more than 32 background steps"), "{}", done.stdout);
}

#[test]
fn two_versions_for_a_pmac_are_compared() {
    let short = SLIDE.replace("M70=10", "M70=2");
    let folder = Folder::with(&[("old.pmc", &short)]);
    folder.write("same.pmc", short.replace("M1=1", "M1!=0"));
    folder.write("new.pmc", short.replacen("DOWN=0\n", "", 1));
    folder.plcc("diff old.pmc same.pmc --prove").exits(0);
    let done = folder.plcc("diff old.pmc new.pmc --prove").exits(1);
    let found = |line: &str| done.stdout.lines().any(|it| it == line);
    assert!(found("same       M11") && found("different  M12"), "{}", done.stdout);
}

#[test]
fn what_a_pmac_keeps_by_a_command_save_is_anything_at_first() {
    let text = "I5=2\nM1->Y:$FFC2,0\nM30->*\nOPEN PLC 1 CLEAR\nIF (M1=1) P1=2 M30=-1 CMD\"SAVE\" ENDIF\nCLOSE\n";
    let folder = Folder::with(&[("a.pmc", text)]);
    folder.write("b.pmc", text.replace("CMD\"SAVE\"", ""));
    for (condition, row) in [("P1=1", "0,P1,1\n"), ("M30=-7", "0,M30,-7\n")] {
        let answer = answers(&folder, &format!("a.pmc --never {condition}"), 1).remove(0);
        let stimulus = folder.read(answer["stimulus"].as_str().unwrap());
        assert!(stimulus.ends_with(row), "{stimulus}");
        answers(&folder, &format!("a.pmc --never {condition} --retained-as-declared"), 0);
        answers(&folder, &format!("b.pmc --never {condition}"), 0);
    }
}

/// A host call may change each bit of the image, here arrays of 8192 doubles: what depends on one bit is listed with all others once.
#[cfg(target_os = "linux")]
#[test]
fn validation_needs_little_memory_where_calls_may_change_the_whole_image() {
    let folder = Folder::with(&[]);
    folder.write("calls.pmc", "I5=2\nOPEN PLC 8 CLEAR\nCMD\"J/\"\nP(P2)=P1\nP3=P(P2)\nCLOSE\n");
    let mut shell = std::process::Command::new("sh");
    let line = format!(
        "ulimit -v 2000000; exec {} build calls.pmc --validate --timeout 5s",
        env!("CARGO_BIN_EXE_plcc")
    );
    shell.args(["-c", &line]).current_dir(folder.path());
    let done = support::Done::of(shell.output().unwrap());
    // What is asked is not whether it is proved.
    let done = done.exits(0);
    assert!(done.stdout.contains("1 function: "), "{}", done.stdout);
}
