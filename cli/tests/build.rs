//! `plcc build`, and running what it makes.

#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

mod support;

use std::fs;

use support::{BROKEN, COUNTER, Folder, PLC1, SLICES};

#[test]
fn an_artifact_runs_as_its_source_does() {
    let folder = Folder::with(&[("s/a.pmi", COUNTER), ("b.plc", SLICES), ("c.pmc", PLC1)]);
    for (source, artifact, names) in
        [("s/a.pmi", "a.plcx", "N,OUT"), ("b.plc", "b.plcx", "F020"), ("c.pmc", "c.plcx", "P1")]
    {
        let done = folder.plcc(&format!("build {source}")).exits(0);
        assert_eq!((done.stdout.as_str(), done.stderr.as_str()), ("", ""));
        let run = format!("--ticks 7 --watch {names} --trace - --events e.jsonl --dump");
        let of_source = folder.plcc(&format!("run {source} {run} s.json")).exits(0);
        let of_artifact = folder.plcc(&format!("run {artifact} {run} a.json")).exits(0);
        assert!(of_source.stdout.contains("\n6,"), "{}", of_source.stdout);
        assert_eq!(of_source.stdout, of_artifact.stdout);
        assert_eq!(folder.read("s.json"), folder.read("a.json"));
    }
}

#[test]
fn artifacts_are_known_by_what_they_hold() {
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    folder.plcc("build a.pmi -o odd.pmi.bin").exits(0);
    folder.plcc("run odd.pmi.bin --ticks 3 --engine aot").exits(0);
    folder.plcc("check odd.pmi.bin").exits(2).says(&["artifact"]);
    folder.plcc("build odd.pmi.bin").exits(2).says(&["artifact"]);
    folder.plcc("bench odd.pmi.bin").exits(2).says(&["artifact"]);
    folder.plcc("run odd.pmi.bin a.pmi --ticks 3").exits(2).says(&["together with other files"]);
}

#[test]
fn damaged_artifacts_are_refused() {
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    folder.plcc("build a.pmi").exits(0);
    let good = fs::read(folder.path().join("a.plcx")).unwrap();
    folder.write("cut.plcx", &good[..good.len() / 2]);
    folder.plcc("run cut.plcx --ticks 1").exits(2).says(&["cut.plcx", "truncated"]);
    let mut flipped = good.clone();
    let middle = flipped.len() / 2;
    flipped[middle] ^= 1;
    folder.write("flipped.plcx", &flipped);
    folder.plcc("run flipped.plcx --ticks 1").exits(2).says(&["flipped.plcx"]);
    folder.write("text.plcx", COUNTER);
    folder.plcc("run text.plcx --ticks 1").exits(2).says(&["text.plcx"]);
}

#[test]
fn options_of_compilation_are_refused_when_an_artifact_runs() {
    let folder = Folder::with(&[
        ("a.pmi", COUNTER),
        ("b.plc", SLICES),
        ("types.toml", "[variables]\nOURS = { type = \"integer\" }\n"),
        ("nct.toml", "control = \"nct98\"\n"),
    ]);
    folder.plcc("build a.pmi").exits(0);
    folder.plcc("build b.plc").exits(0);
    for option in [
        "--limits none",
        "--limits original",
        "--define A=1",
        "--controller turbo",
        "--machine types.toml",
    ] {
        let done = folder.plcc(&format!("run a.plcx --ticks 1 {option}")).exits(2);
        done.says(&["a.plcx", "fixed"]);
    }
    folder.plcc("run a.plcx --ticks 1 --opt none --engine jit").exits(0).says(&["warning"]);
    folder.plcc("run a.plcx --ticks 1 --dialect pmi").exits(0);
    folder.plcc("run a.plcx --ticks 1 --dialect nct").exits(2);
    folder.plcc("run b.plcx --ticks 1 --machine nct.toml").exits(0);
}

#[test]
fn listings_go_to_standard_output_with_the_source_in_them() {
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    for form in ["ir", "clif", "asm"] {
        for opt in ["none", "speed"] {
            let done = folder.plcc(&format!("build a.pmi --emit {form} --opt {opt}")).exits(0);
            assert!(done.stdout.contains("N=N+1"), "{form}: {}", done.stdout);
        }
        folder.plcc(&format!("build a.pmi --emit {form} -o out.txt")).exits(0);
        assert!(folder.read("out.txt").contains("N=N+1"));
    }
    assert!(!folder.has("a.plcx"));
}

#[test]
fn build_writes_objects_and_code_for_other_architectures() {
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    folder.plcc("build a.pmi --emit obj").exits(0);
    assert!(fs::read(folder.path().join("a.o")).unwrap().starts_with(b"\x7FELF"));
    let foreign = match std::env::consts::ARCH {
        "aarch64" => "x86_64-unknown-linux-gnu",
        _ => "aarch64-unknown-linux-gnu",
    };
    folder.plcc(&format!("build a.pmi --target {foreign}")).exits(0);
    let architecture = foreign.split('-').next().unwrap();
    assert!(!folder.has("a.plcx"), "an artifact for another machine has its name");
    let artifact = format!("a-{architecture}.plcx");
    folder.plcc(&format!("run {artifact} --ticks 1")).exits(2).says(&[architecture]);
    folder.plcc(&format!("build a.pmi --emit obj --target {foreign}")).exits(0);
    assert!(folder.has(&format!("a-{architecture}.o")));
    folder.plcc(&format!("build a.pmi --target {foreign} -o b.plcx")).exits(0);
    assert!(folder.has("b.plcx"));
    folder.plcc("build a.pmi --target nonsense").exits(2).says(&["nonsense"]);
}

#[test]
fn nothing_is_left_behind_and_no_source_is_overwritten() {
    let folder = Folder::with(&[
        ("a.pmi", "$INCLUDE B.PMI\n$END\nN=N+1\n"),
        ("b.pmi", "$INTEGER\nN\n"),
        ("m.toml", ""),
        ("a.plcx", "old"),
        ("bad.pmi", BROKEN),
    ]);
    for own in ["a.pmi", "./a.pmi", "b.pmi", "m.toml"] {
        let done = folder.plcc(&format!("build a.pmi --machine m.toml -o {own}")).exits(2);
        done.says(&["not overwritten"]);
    }
    assert_eq!(folder.read("b.pmi"), "$INTEGER\nN\n");
    folder.plcc("build bad.pmi -o a.plcx").exits(1).says(&["[PMI-31]", "2 errors"]);
    assert_eq!(folder.read("a.plcx"), "old");
    folder.plcc("build a.pmi").exits(0);
    folder.plcc("build a.pmi -o none/a.plcx").exits(2).says(&["none/a.plcx"]);
    folder.plcc("build a.pmi -o .").exits(2).says(&["folder"]);
    let mut names: Vec<_> = fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, ["a.plcx", "a.pmi", "b.pmi", "bad.pmi", "m.toml"]);
}

#[test]
fn standard_output_takes_an_artifact_too() {
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    folder.plcc("build a.pmi").exits(0);
    let piped = folder.command(&["build", "a.pmi", "-o", "-"]).output().unwrap();
    assert_eq!(piped.stdout, fs::read(folder.path().join("a.plcx")).unwrap());
    let done = folder.plcc("build a.pmi --emit ir --message-format json").exits(0);
    assert!(done.stdout.starts_with("image "), "{}", done.stdout);
}

#[test]
fn pmac_listings_say_what_the_variables_are() {
    let text = "M1->Y:$FFC2,8\nM2->Y:$800,0\nI5=2\nOPEN PLC 1 CLEAR\nM1=M2\nCLOSE\n";
    let folder = Folder::with(&[("a.pmc", text), ("b.pmi", COUNTER)]);
    for form in ["ir", "clif", "asm"] {
        let done = folder.plcc(&format!("build a.pmc --emit {form}")).exits(0);
        let notes: Vec<_> = done.stdout.lines().take_while(|line| line.starts_with(';')).collect();
        let [i5, m1] = notes[..] else { panic!("{form}: {notes:?}") };
        assert!(i5.starts_with("; I5: which PLCs run"), "{i5}");
        assert_eq!(m1, "; M1->Y:$FFC2,8,1: machine output 1");
        let done = folder.plcc(&format!("build b.pmi --emit {form}")).exits(0);
        assert!(!done.stdout.starts_with('\n'), "{}", done.stdout);
    }
    let listing = folder.plcc("build a.pmc --emit ir").exits(0).stdout;
    plcc_ir::text::parse(&listing).unwrap();
}

#[test]
fn several_files_are_one_pmac_download_and_an_error_elsewhere() {
    let folder = Folder::with(&[
        ("a.pmi", COUNTER),
        ("b.plc", SLICES),
        ("n.h", "#define COUNT P1\n"),
        ("c.pmc", "I5=2\nOPEN PLC 1 CLEAR\nCOUNT=COUNT+1\nCLOSE\n"),
    ]);
    folder.plcc("build n.h c.pmc").exits(0);
    assert!(folder.has("n.plcx"));
    let done = folder.plcc("run n.plcx --ticks 3 --dump -").exits(0);
    assert!(done.stdout.contains("\"P1\":3"), "{}", done.stdout);
    for (command, files) in [
        ("build", "a.pmi a.pmi"),
        ("run --ticks 1", "b.plc b.plc"),
        ("bench", "a.pmi b.plc"),
        ("build", "a.pmi c.pmc"),
    ] {
        folder.plcc(&format!("{command} {files}")).exits(2);
    }
}

#[test]
fn a_range_of_variables_costs_no_more_code_than_one() {
    let line = "P0..1023=P1\n";
    let plc = |body: &str| format!("I5=2\nOPEN PLC 1 CLEAR\n{body}CLOSE\n");
    let folder = Folder::with(&[("ranges.pmc", &plc(&line.repeat(400)))]);
    folder.plcc("build ranges.pmc").exits(0);
    let length = fs::metadata(folder.path().join("ranges.plcx")).unwrap().len();
    assert!(length <= 100_000, "{length} bytes");
    // Turbo PMAC has no ranges in buffers.
    let turbo = folder.plcc("check --controller turbo --message-format json ranges.pmc").exits(1);
    assert_eq!(turbo.json().len(), 400);
}
