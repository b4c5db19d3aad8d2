//! Names that people gave to variables: `[names]` in the machine file, and a PMAC's `#define`.

#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

mod support;

use support::Folder;

const PUMP: &str = "$INPUT\nDOOR = 0/0  ? door closed\nSTOP = 0/1\n$OUTPUT\nPUMP = 2/0 ? pump\n$FAULT\nFDOOR = \"door open\"\n\
                    $INTEGER\nLIST[3], N\n$END\nPUMP = DOOR & /STOP\nN = N + 1\nLIST[2] = N\nFDOOR = /DOOR\n";

const NAMES: &str = "[names]\nPUMP = { alias = \"Coolant\", text = \"coolant pump\", device = \"-M3\", at = \"X2:4\", drawing = \"14.3\" }\n\
                     N = { alias = \"COUNTER\" }\nLIST = { alias = \"TOOLS\" }\n\"PORT0.0\" = { alias = \"TERMINAL_7\" }\n\
                     FDOOR = { alias = \"ALARM\" }\n";

const MILL: &str = "#define GATE M11 ; gate closed\n#define SPEED P7\n#define FAST SPEED\n#define LIMIT 5\n\
                    M1->Y:$FFC2,8 ; lamp\nM11->Y:$FFC2,0\nI5=2\nOPEN PLC 1 CLEAR\nM1=GATE\nSPEED=LIMIT\nCLOSE\nENABLE PLC 1\n";

const SLICE: &str = "; I012 door closed\n:001\nI012 E D013 Z ; lamp at the door\nJ1\n:000\nJ0\n";

#[test]
fn an_alias_is_a_name_wherever_a_variable_is_named() {
    let folder = Folder::with(&[("p.pmi", PUMP), ("p.machine.toml", NAMES)]);
    folder.write("s.csv", "tick,name,value\n0,terminal_7,1\n2,STOP,1\n3,TOOLS[0],7\n");
    let run = "run p.pmi --ticks 4 --stimulus s.csv --watch Cool*,counter,Tools[2],TOOLS[0]";
    let trace = folder.plcc(run).exits(0).stdout;
    let rows: Vec<&str> = trace.lines().skip(1).collect();
    let expected = [
        "0,PUMP,1",
        "0,N,1",
        "0,LIST[2],1",
        "0,LIST[0],0",
        "1,N,2",
        "1,LIST[2],2",
        "2,PUMP,0",
        "2,N,3",
        "2,LIST[2],3",
        "3,N,4",
        "3,LIST[2],4",
        "3,LIST[0],7",
    ];
    assert_eq!(rows, expected, "a trace has the language's names");
    let events = format!("{run} --aliases --events - --trace t.csv --dump d.json");
    let events = folder.plcc(&events).exits(0).stdout;
    assert_eq!(events, "", "the door is closed");
    assert!(folder.read("t.csv").contains("0,Coolant,1\n0,COUNTER,1\n0,TOOLS[2],1\n"));
    assert!(
        folder.read("d.json").contains("\"ALARM\":0,\"TOOLS\":[7,0,4]"),
        "{}",
        folder.read("d.json")
    );
    let open = folder.plcc("run p.pmi --ticks 1 --events - --aliases").exits(0).stdout;
    assert!(open.contains("\"name\":\"ALARM\""), "{open}");
    // A replay of the record, and what is made of it, have them too.
    let recorded = format!("{run} --aliases --record p.plcrec --trace r.csv --dump d.json");
    folder.plcc(&recorded).exits(0);
    let watch = run.split_once("--watch ").unwrap().1;
    let replayed = format!("replay p.plcrec --aliases --watch {watch} --trace v.csv --dump v.json");
    folder.plcc(&replayed).exits(0);
    assert_eq!(folder.read("v.csv"), folder.read("r.csv"));
    assert_eq!(folder.read("v.json"), folder.read("d.json"));
    let replayed = "replay p.plcrec --aliases --events -";
    assert_eq!(folder.plcc(replayed).exits(0).stdout, events);
    let table = folder.plcc("convert p.plcrec --to csv -o - --aliases").exits(0).stdout;
    assert!(table.contains(",Coolant,1\n") && table.contains(",COUNTER,1\n"), "{table}");
    let table = folder.plcc("convert p.plcrec --to csv -o -").exits(0).stdout;
    assert!(!table.contains(",Coolant,"), "{table}");
    // An artifact holds the names.
    folder.plcc("build p.pmi -o p.plcx").exits(0);
    folder.write("p.machine.toml", "");
    let again = run.replace("p.pmi", "p.plcx");
    assert_eq!(folder.plcc(&again).exits(0).stdout, trace);
    folder.plcc(&format!("{again} --safe coolant=1")).exits(0);
    folder.plcc("run p.plcx --ticks 1 --watch COLANT").exits(2).says(&["did you mean `Coolant`?"]);
    folder.plcc(run).exits(2).says(&["no variable named `terminal_7`"]);
}

#[test]
fn a_define_of_one_variable_is_an_alias() {
    let folder = Folder::with(&[("mill.pmc", MILL)]);
    let run = "run mill.pmc --ticks 40 --watch gate,FAST,SPEED,M1";
    let trace = folder.plcc(run).exits(0).stdout;
    assert_eq!(trace.lines().skip(1).take(3).collect::<Vec<_>>(), ["0,M11,0", "0,P7,5", "0,P7,5"]);
    let trace = folder.plcc(&format!("{run} --aliases")).exits(0).stdout;
    assert!(trace.contains("0,GATE,0\n0,SPEED,5\n0,SPEED,5\n0,M1,0\n"), "{trace}");
    folder.plcc("run mill.pmc --ticks 1 --watch LIMIT").exits(2);
    folder.write(
        "mill.machine.toml",
        "[names]\nP8 = { alias = \"SPEED\" }\nM11 = { alias = \"DOOR\" }\n",
    );
    let trace = folder.plcc(&format!("{run},DOOR --aliases")).exits(0).stdout;
    assert!(trace.contains("0,DOOR,0\n0,FAST,5\n0,SPEED,0\n0,M1,0\n0,DOOR,0\n"), "{trace}");
    let xref = folder.plcc("xref mill.pmc").exits(0).stdout;
    assert!(xref.contains("DOOR: gate closed;") && xref.contains("lamp;"), "{xref}");
}

#[test]
fn xref_shows_what_is_said() {
    let folder = Folder::with(&[("p.pmi", PUMP), ("p.machine.toml", NAMES), ("s.nct", SLICE)]);
    let rows = folder.plcc("xref p.pmi --message-format json").exits(0).json();
    let row = |name: &str| rows.iter().find(|row| row["name"] == name).unwrap();
    let pump = row("PUMP");
    assert_eq!(
        [&pump["alias"], &pump["text"], &pump["device"], &pump["at"], &pump["drawing"]],
        ["Coolant", "coolant pump", "-M3", "X2:4", "14.3"]
    );
    assert_eq!(row("DOOR")["text"], "door closed", "the comment of its declaration");
    assert_eq!(row("STOP")["text"], serde_json::Value::Null);
    let table = folder.plcc("xref s.nct").exits(0).stdout;
    assert!(table.contains("door closed; input line"), "{table}");
    assert!(table.contains("lamp at the door; output line"), "{table}");
}

#[test]
fn a_wrong_name_is_refused_with_its_line() {
    let folder = Folder::with(&[("p.pmi", PUMP), ("s.nct", SLICE), ("mill.pmc", MILL)]);
    for (program, names, part) in [
        ("p.pmi", "N = { alias = \"door\" }", "line 2: [names]: `door` can't be an alias of N"),
        ("p.pmi", "N = { alias = \"endif\" }", "a word of the language"),
        ("p.pmi", "N = { alias = \"1ST\" }", "line 2: `1ST` is not an alias"),
        ("p.pmi", "NN = { alias = \"COUNT\" }", "no variable named `NN`; did you mean `N`?"),
        ("p.pmi", "\"n\" = {}\nN = {}", "line 3: [names]: N is there twice, first in line 2"),
        ("s.nct", "I012 = { alias = \"RH060\" }", "line 2: [names]: `RH060`"),
        ("s.nct", "I012 = { alias = \"V013\" }", "line 2: [names]: `V013`"),
        ("s.nct", "I012 = { alias = \"A\" }\nI013 = { alias = \"a\" }", "line 3: the alias a"),
        ("mill.pmc", "P1 = { alias = \"ENDIF\" }", "a word of the language"),
        ("mill.pmc", "P1 = { alias = \"M5\" }", "already the name of a variable"),
        ("mill.pmc", "P1 = { alais = \"X\" }", "alais"),
    ] {
        folder.write("m.toml", format!("[names]\n{names}\n"));
        for command in ["check", "run --ticks 1", "build", "xref"] {
            let done = folder.plcc(&format!("{command} {program} --machine m.toml"));
            done.exits(2).says(&["m.toml", part]);
        }
    }
}

/// A bit of a word of a PMAC's memory: in lists, in CSV files, as a safe value.
#[test]
fn bits_of_words_are_names() {
    let folder = Folder::with(&[(
        "byte.pmc",
        "M9->Y:$FFC2,8,8\nM2->Y:$FFC2,0\nI5=2\nOPEN PLC 1 CLEAR\nIF (M2=1)\nM9=5\nENDIF\nCLOSE\nENABLE PLC 1\n",
    )]);
    folder.write("s.csv", "tick,name,value\n3,\"y:$ffc2, 0\",1\n");
    let run = "run byte.pmc --ticks 40 --stimulus s.csv --watch Y:$FFC2,8,M9,Y:$FFC2,8,4,y:$ffc2,9";
    let trace = folder.plcc(run).exits(0).stdout;
    assert!(trace.contains("0,\"Y:$FFC2,8\",0\n0,M9,0\n0,\"Y:$FFC2,8,4\",0\n"), "{trace}");
    assert!(trace.contains(",\"Y:$FFC2,8\",1\n") && trace.contains(",M9,5\n"), "{trace}");
    assert!(trace.contains(",\"Y:$FFC2,8,4\",5\n"), "{trace}");
    folder.plcc("run byte.pmc --ticks 1 --safe Y:$FFC2,8=1").exits(0);
    folder
        .plcc("run byte.pmc --ticks 1 --safe Y:$FFC2,24=1")
        .exits(2)
        .says(&["beyond those of a word"]);
    // A picture of such a trace has the name.
    folder.plcc(&format!("{run} --trace t.csv")).exits(0);
    folder.plcc("plot t.csv -o t.svg").exits(0);
    assert!(folder.read("t.svg").contains("Y:$FFC2,8"));
}
