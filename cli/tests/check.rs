//! `plcc check`

#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

mod support;

use support::{BROKEN, COUNTER, Folder, PLC1, SLICES};

#[test]
fn nothing_wrong_is_status_0() {
    let folder = Folder::with(&[("a.pmi", COUNTER)]);
    let done = folder.plcc("check a.pmi").exits(0).says(&["1 file checked: no errors\n"]);
    assert_eq!(done.stdout, "");
}

#[test]
fn every_error_is_drawn_with_its_place_and_help() {
    let folder = Folder::with(&[("a.pmi", BROKEN)]);
    let done = folder.plcc("check a.pmi").exits(1);
    assert_eq!(done.stdout, "");
    let done = done.says(&["[PMI-31]", "a.pmi:4:3", "Help:", "[PMI-30]", "a.pmi:5:3"]);
    assert!(done.stderr.ends_with("1 file checked: 2 errors\n"), "{}", done.stderr);
    assert!(!done.stderr.contains('\u{1b}'), "colours without a terminal");
}

#[test]
fn json_is_an_object_a_line_on_standard_output() {
    let folder = Folder::with(&[("a.pmi", BROKEN)]);
    let done = folder.plcc("check a.pmi --message-format json").exits(1);
    assert_eq!(done.stderr, "");
    let first = done.stdout.lines().next().unwrap();
    let keys = r#"{"code":"PMI-31","severity":"error","message":""#;
    assert!(first.starts_with(keys), "{first}");
    let places = r#","file":"a.pmi","line":4,"column":3,"end_line":4,"end_column":4,"notes":["#;
    assert!(first.contains(places), "{first}");
    let codes: Vec<_> = done.json().iter().map(|d| d["code"].clone()).collect();
    assert_eq!(codes, ["PMI-31", "PMI-30"]);
}

#[test]
fn included_places_say_who_includes_them() {
    let folder =
        Folder::with(&[("a.pmi", "$INCLUDE B.PMI\n$END\nM=NONE\n"), ("b.pmi", "$INTEGER\nM,1N\n")]);
    let done = folder.plcc("check a.pmi --message-format json").exits(1);
    let found = done.json();
    assert_eq!(found[0]["file"], "b.pmi");
    assert_eq!(found[0]["included_from"], serde_json::json!([{"file": "a.pmi", "line": 1}]));
}

#[test]
fn colours_come_when_asked_for() {
    let folder = Folder::with(&[("a.pmi", BROKEN)]);
    folder.plcc("check a.pmi --color always").exits(1).says(&["\u{1b}["]);
    let mut command = folder.command(&["check", "a.pmi", "--color", "always"]);
    let done = support::Done::of(command.env("NO_COLOR", "1").output().unwrap());
    assert!(done.stderr.contains('\u{1b}'), "the option wins over NO_COLOR");
}

#[test]
fn warnings_alone_are_status_0() {
    let long = format!("{COUNTER}N={}1\n", "1+".repeat(40));
    let folder = Folder::with(&[("a.pmi", &long)]);
    folder.plcc("check a.pmi").exits(0).says(&["Warning", "no errors, 1 warning\n"]);
}

#[test]
fn the_first_hundred_are_drawn_and_the_rest_counted() {
    let folder = Folder::with(&[("a.pmi", &format!("$END\n{}", "X=NONE\n".repeat(130)))]);
    let done = folder.plcc("check a.pmi").exits(1);
    assert_eq!(done.stderr.matches("[PMI-31]").count(), 100);
    let done = done.says(&["a.pmi: 30 errors", "130 errors"]);
    assert!(done.stderr.len() < 100_000);
    assert_eq!(folder.plcc("check a.pmi --message-format json").json().len(), 130);
}

#[test]
fn many_files_of_any_language_are_checked_and_all_failures_told() {
    let files = [("a.pmi", COUNTER), ("b.pmi", BROKEN), ("c.plc", SLICES), ("d.plc", PLC1)];
    let folder = Folder::with(&files);
    folder.plcc("check a.pmi c.plc d.plc").exits(0).says(&["3 files checked: no errors"]);
    folder.plcc("check a.pmi b.pmi").exits(1).says(&["2 errors; 1 of 2 programs"]);
    let done = folder.plcc("check none.pmi b.pmi gone.pmi").exits(2);
    done.says(&["none.pmi", "gone.pmi", "no such file", "[PMI-31]"]);
}

#[test]
fn named_pmac_files_are_one_download() {
    let folder = Folder::with(&[
        ("names.h", "#define COUNT P1\n"),
        ("more.plc", "P5=1\n"),
        ("a.plc", "OPEN PLC 1 CLEAR\nCOUNT=COUNT+1\nCLOSE\nI5=2\n"),
    ]);
    folder.plcc("check names.h more.plc a.plc").exits(0).says(&["3 files checked"]);
    folder.plcc("check a.plc").exits(1).says(&["COUNT"]);
    folder.plcc("check a.plc names.h").exits(1).says(&["COUNT"]);
    folder.plcc("check more.plc").exits(2).says(&["more.plc", "--dialect"]);
}

#[test]
fn folders_are_searched_for_known_endings_in_any_case() {
    let folder = Folder::with(&[
        ("m/a.PMI", COUNTER),
        ("m/deep/er/b.Plc", SLICES),
        ("m/c.pmac", PLC1),
        ("m/notes.txt", ":000"),
        ("m/.hidden.pmi", BROKEN),
    ]);
    folder.plcc("check m").exits(0).says(&["3 files checked: no errors"]);
    folder.plcc("check m --dialect nct").exits(0).says(&["1 file checked"]);
    folder.plcc("check m --dialect NCT").exits(0);
    let done = folder.plcc("check m/deep/er m/deep m").exits(0);
    done.says(&["checked: no errors"]);
}

#[test]
fn a_folder_without_programs_and_a_file_of_no_language_are_status_2() {
    let folder = Folder::with(&[("m/notes.txt", ""), ("n/a.plc", "what"), ("n/b.pmi", COUNTER)]);
    folder.plcc("check m").exits(2).says(&["m: it holds no .pmi"]);
    folder.plcc("check n").exits(2).says(&["a.plc", "--dialect", "1 file checked"]);
    folder.plcc("check n --dialect pmac").exits(1);
}

#[test]
fn included_files_of_a_folder_are_not_checked_on_their_own() {
    let folder = Folder::with(&[
        ("m/main.pmi", "$INCLUDE PART.PMI\n$END\nN=N+1\n"),
        // Alone it has no $END.
        ("m/part.pmi", "$INTEGER\nN\n"),
    ]);
    folder.plcc("check m").exits(0).says(&["1 file checked: no errors"]);
    folder.plcc("check m/part.pmi").exits(1).says(&["[PMI-2]"]);
}

#[test]
fn files_that_include_each_other_are_still_checked() {
    let folder =
        Folder::with(&[("m/a.pmc", "#include \"b.pmc\"\n"), ("m/b.pmc", "#include \"a.pmc\"\n")]);
    let done = folder.plcc("check m");
    done.says(&["1 file checked"]);
}

#[test]
fn explain_arithmetic_says_how_pmac_statements_are_computed() {
    let folder = Folder::with(&[
        ("a.pmc", "I5=2\nOPEN PLC 1 CLEAR\nM1=1\nP1=SIN(P2)\nCLOSE\n"),
        ("b.pmi", COUNTER),
    ]);
    let done = folder.plcc("check a.pmc --explain-arithmetic").exits(0);
    assert!(done.stdout.contains("floating point"), "{}", done.stdout);
    folder.plcc("check b.pmi --explain-arithmetic").exits(0).says(&["no PMAC program"]);
}

#[cfg(unix)]
#[test]
fn a_link_to_the_parent_folder_is_not_followed_for_ever() {
    let folder = Folder::with(&[("m/a.pmi", COUNTER)]);
    std::os::unix::fs::symlink("..", folder.path().join("m/up")).unwrap();
    folder.plcc("check m").exits(0).says(&["1 file checked"]);
}

#[cfg(unix)]
#[test]
fn file_names_need_not_be_utf8() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let folder = Folder::with(&[]);
    let name = |end: &[u8]| [b"m\xFC/".as_slice(), end].concat();
    for (end, text) in [("a.pmi", "$INCLUDE B.PMI\n$END\nN=1\n"), ("b.pmi", "$INTEGER\nN\n")] {
        folder.write(OsStr::from_bytes(&name(end.as_bytes())), text);
    }
    let path = name(b"a.pmi");
    let path = OsStr::from_bytes(&path);
    folder.run(&[OsStr::new("check"), path]).exits(0);
    folder.run(&[OsStr::new("check"), OsStr::from_bytes(b"m\xFC")]).exits(0).says(&["1 file"]);
    let build = ["build", "-o"].map(OsStr::new);
    folder.run(&[build[0], path, build[1], path]).exits(2).says(&["not overwritten"]);
    folder.run(&[OsStr::new("run"), path, OsStr::new("--ticks"), OsStr::new("2")]).exits(0);
}

#[test]
fn a_text_that_looks_like_another_language_is_said_to() {
    let folder = Folder::with(&[("a.pmi", SLICES), ("b.pmi", BROKEN)]);
    let note = "note: a.pmi was read as a program in PMI and looks like one in NCT; --dialect nct";
    for command in ["check a.pmi", "run a.pmi --ticks 1", "build a.pmi"] {
        folder.plcc(command).exits(1).says(&[note]);
    }
    assert_eq!(folder.plcc("check a.pmi --message-format json").exits(1).stderr, "");
    let done = folder.plcc("check b.pmi").exits(1);
    assert!(!done.stderr.contains("looks like"), "{}", done.stderr);
    folder.plcc("run .").exits(2).says(&["it is a folder; name the program's source"]);
}

#[test]
fn the_language_is_told_or_guessed() {
    let folder = Folder::with(&[
        ("a.txt", COUNTER),
        ("b.plc", &format!("{SLICES}{PLC1}")),
        ("c.pmi", PLC1),
        ("d.plc", "; :000\nOPEN PLC 1 CLEAR CLOSE\n"),
    ]);
    folder.plcc("check a.txt").exits(0);
    folder.plcc("check b.plc").exits(2).says(&["nct and", "pmac", "--dialect"]);
    folder.plcc("check c.pmi").exits(1);
    folder.plcc("check c.pmi --dialect pmac").exits(0);
    folder.plcc("check d.plc").exits(0);
}

#[test]
fn options_of_a_compilation_reach_the_front_end() {
    let array = "$INTEGER\nA[300]\n$END\nA[1]=1\n";
    let folder = Folder::with(&[
        ("a.pmi", array),
        ("t.pmc", "M1->Y:$078800,0\nP5000=1\n"),
        ("d.pmc", "P1=$(SPEED)\n"),
        ("i.pmc", "#include \"far.h\"\nP1=FAR\n"),
        ("lib/far.h", "#define FAR 3\n"),
        ("m.pmi", "$END\n@OURS=2\n"),
        ("m.toml", "[variables]\nOURS = { type = \"integer\" }\n"),
        ("bad.toml", "[variables]\nOURS = { type = \"float\" }\n"),
    ]);
    folder.plcc("check a.pmi").exits(1);
    folder.plcc("check a.pmi --limits none").exits(0);
    folder.plcc("check t.pmc").exits(1).says(&["--controller turbo"]);
    folder.plcc("check t.pmc --controller turbo").exits(0);
    folder.plcc("check d.pmc").exits(1).says(&["--define"]);
    folder.plcc("check d.pmc --define SPEED=3").exits(0);
    folder.plcc("check i.pmc").exits(1);
    folder.plcc("check i.pmc -I lib").exits(0);
    folder.plcc("check m.pmi").exits(1);
    folder.plcc("check m.pmi --machine m.toml").exits(0);
    folder.plcc("check m.pmi --machine bad.toml").exits(2).says(&["bad.toml", "float"]);
    folder.plcc("check m.pmi --machine none.toml").exits(2).says(&["none.toml"]);
}

#[cfg(unix)]
#[test]
fn a_closed_standard_output_is_no_trouble() {
    use std::process::Stdio;
    let folder = Folder::with(&[("a.pmi", &format!("$END\n{}", "X=NONE\n".repeat(3000)))]);
    for (args, status) in
        [(&["check", "a.pmi", "--message-format", "json"][..], 1), (&["explain", "PMI-31"], 0)]
    {
        let mut command = folder.command(args);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let done = support::Done::of(child.wait_with_output().unwrap());
        assert_eq!((done.status, done.stderr.as_str()), (status, ""), "{args:?}");
    }
}

#[test]
fn standard_input_is_checked() {
    let folder = Folder::with(&[("b.pmi", "$INTEGER\nN\n")]);
    let check = |args: &[&str], text: &str| folder.run_with(args, text);
    let done = check(&["check", "-"], COUNTER).exits(0);
    done.says(&["1 file checked: no errors"]);
    let done = check(&["check", "-", "--message-format", "json"], BROKEN).exits(1);
    let first = &done.json()[0];
    assert_eq!((&first["code"], &first["file"]), (&"PMI-31".into(), &"-".into()));
    // Files are included from the current folder.
    check(&["check", "-"], "$INCLUDE B.PMI\n$END\nN=1\n").exits(0);
    check(&["check", "-"], "what").exits(2).says(&["--dialect"]);
    check(&["check", "-", "--dialect", "pmac"], PLC1).exits(0);
    let done = check(&["run", "-", "--ticks", "3", "--dump", "-"], PLC1).exits(0);
    assert!(done.stdout.contains("\"P1\":3"), "{}", done.stdout);
    check(&["build", "-"], PLC1).exits(0);
    assert!(folder.has("program.plcx"));
}

#[test]
fn a_download_that_enables_no_plc_gets_a_note() {
    let folder = Folder::with(&[("a.pmc", "OPEN PLC 1 CLEAR\nP1=P1+1\nCLOSE\n")]);
    let found = folder.plcc("check a.pmc --message-format json").exits(0).json();
    assert_eq!((&found[0]["code"], &found[0]["severity"]), (&"PMAC-W2".into(), &"note".into()));
    folder.plcc("check a.pmc").exits(0).says(&["checked: no errors\n"]);
    folder.plcc("run a.pmc --ticks 1").exits(0).says(&["1 warning"]);
}

#[test]
fn a_machine_file_beside_the_source_is_taken() {
    let machine = "[variables]\nOURS = { type = \"integer\" }\n";
    let folder = Folder::with(&[
        ("m/a.pmi", "$END\n@OURS=2\n"),
        ("m/a.machine.toml", machine),
        ("m/b.pmi", "$END\n@OURS=2\n"),
        ("other.toml", ""),
    ]);
    let done = folder.plcc("check m/a.pmi").exits(0);
    let done = done.says(&["note: m/a.machine.toml is used as the machine file", "no errors"]);
    assert_eq!(done.stderr.matches("note:").count(), 1);
    folder.plcc("check m/a.pmi --no-machine").exits(1).says(&["[PMI-31]"]);
    folder.plcc("check m/a.pmi --machine other.toml").exits(1);
    folder.plcc("check m/b.pmi").exits(1);
    // Each source has its own.
    folder.plcc("check m").exits(1).says(&["a.machine.toml", "1 of 2 programs"]);
    folder.plcc("run m/a.pmi --ticks 1").exits(0).says(&["note:"]);
    folder.plcc("build m/a.pmi -o m/a.machine.toml").exits(2).says(&["not overwritten"]);
    folder.plcc("run m/a.pmi --ticks 1 --dump m/a.machine.toml").exits(2).says(&["overwrite"]);
    assert_eq!(folder.read("m/a.machine.toml"), machine);
    folder.plcc("build m/a.pmi").exits(0);
    let done = folder.plcc("run a.plcx --ticks 1").exits(0);
    assert_eq!(done.stderr, "", "an artifact has no machine file");
    folder.write("m/a.machine.toml", "nonsense");
    folder.plcc("check m/a.pmi").exits(2).says(&["a.machine.toml"]);
}
