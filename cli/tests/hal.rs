//! `plcc hal`: components for LinuxCNC's HAL. The component of an example of each language runs in a session
//! of HAL, where HAL's streamer plays the example's stimulus to its pins: the sampler then sees, tick for
//! tick, what `plcc run` writes into its trace. Skipped, with a word, where LinuxCNC (packages
//! linuxcnc-uspace and linuxcnc-uspace-dev) is missing or no session can be started (`hal/session`).
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing)]

mod support;
#[path = "../../tests/src/tools.rs"]
mod tools;

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Mutex, OnceLock, PoisonError};

use support::Folder;

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// The pins of a component, by their variables: name, type and direction, as the C text has them.
fn pins(folder: &Folder, name: &str) -> BTreeMap<String, [String; 3]> {
    let text = folder.read(&format!("{name}-hal/{name}.c"));
    let lines = text.lines().filter(|line| line.trim_start().starts_with("{ \""));
    lines
        .map(|line| {
            let words: Vec<String> =
                line.split(['{', '}', ',', '"', ' ']).map(str::to_owned).collect();
            let mut words = words.into_iter().filter(|word| !word.is_empty());
            let variable = words.next().unwrap();
            let rest = [words.next().unwrap(), words.next().unwrap(), words.next().unwrap()];
            (variable, rest)
        })
        .collect()
}

#[test]
fn variables_become_pins_by_class_and_direction() {
    let pmi = "$INPUT\nBTN=0/0\nTOOL=0/1-4/BCD\n$OUTPUT\nLAMP=1/0\n$INTEGER\nN,A[2]\n$LONG\nL\n$END\n\
               N=N+TOOL\nLAMP=BTN&/@ESTOP\n@FRO=@FRO+1\n@SPDAC=N\nA[1]=N\nL=N\n";
    let nct =
        ":001\nI000 U010 Z\n(I400 A F0103) U733 Z\nLRH000 SRH060 SF020\nV001 U011 Z\nJ1\n:000 J0\n";
    let pmac = "M1->Y:$FFC2,8\nM2->X:$10,4,8,S\nM11->Y:$FFC2,0\nM7->*\nI5=2\nOPEN PLC 1 CLEAR\n\
                M1=M11\nP1=M2\nM7=1\nCLOSE\n";
    let folder = Folder::with(&[("a.pmi", pmi), ("b.nct", nct), ("c.pmc", pmac)]);
    let check = |name: &str, expected: &[(&str, &str, &str, &str)]| {
        let expected = expected.iter().map(|&(variable, pin, ty, direction)| {
            (
                variable.to_owned(),
                [pin, &format!("HAL_{ty}"), &format!("HAL_{direction}")].map(str::to_owned),
            )
        });
        assert_eq!(pins(&folder, name), expected.collect());
    };
    folder
        .plcc("hal a.pmi --pin N --pin a[1]=out --pin L=in")
        .exits(0)
        .says(&["a-hal has a component"]);
    check(
        "a",
        &[
            ("BTN", "btn", "BIT", "IN"),
            ("TOOL", "tool", "S32", "IN"),
            ("LAMP", "lamp", "BIT", "OUT"),
            ("@ESTOP", "at-estop", "BIT", "IN"),
            ("@FRO", "at-fro", "S32", "IO"),
            ("@SPDAC", "at-spdac", "S32", "OUT"),
            ("N", "n", "S32", "IO"),
            ("A[1]", "a-1", "S32", "OUT"),
            ("L", "l", "S32", "IN"),
        ],
    );
    folder.plcc("hal b.nct").exits(0);
    check(
        "b",
        &[
            ("I000", "i000", "BIT", "IN"),
            ("I001", "i001", "BIT", "IN"),
            ("I400", "i400", "BIT", "IN"),
            ("Y010", "y010", "BIT", "OUT"),
            ("Y011", "y011", "BIT", "OUT"),
            ("Y733", "y733", "BIT", "OUT"),
            ("RH000", "rh000", "S32", "IN"),
            ("RH060", "rh060", "S32", "OUT"),
        ],
    );
    folder.plcc("hal c.pmc --pin P1=out").exits(0);
    check(
        "c",
        &[
            ("M1", "m1", "BIT", "OUT"),
            ("M2", "m2", "S32", "IN"),
            ("M11", "m11", "BIT", "IN"),
            ("P1", "p1", "FLOAT", "OUT"),
        ],
    );
    for file in ["a.plcx", "plcrt.h", "Makefile", "a.hal"] {
        assert!(folder.has(&format!("a-hal/{file}")), "{file}");
    }
}

#[test]
fn what_can_be_no_component_is_refused() {
    let folder =
        Folder::with(&[("a.pmi", support::COUNTER), ("plain.pmi", "$INTEGER\nN\n$END\nN=1\n")]);
    folder.plcc("hal a.pmi --name 2a").exits(2).says(&["2a"]);
    folder.plcc("hal a.pmi --pin NOSUCH").exits(2).says(&["NOSUCH"]);
    folder.plcc("hal a.pmi --pin N=up").exits(2).says(&["in, out or io"]);
    folder.plcc("hal plain.pmi").exits(2).says(&["--pin"]);
    folder.plcc("hal missing.pmi").exits(2);
}

/// A run of an example in HAL.
struct Example {
    source: &'static str,
    /// The folder of its stimulus and its arguments.
    run: &'static str,
    /// Options of `plcc hal`.
    hal: &'static str,
    /// Options of the control.
    options: &'static str,
    ticks: usize,
    /// What is compared.
    watched: &'static [&'static str],
}

/// libplcrt as a static library, made from the sources under test.
fn library() -> &'static Path {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    BUILT.get_or_init(|| {
        let profile = Path::new(env!("CARGO_BIN_EXE_plcc")).parent().unwrap();
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args(["build", "--quiet", "--offline", "--package", "libplcrt", "--target-dir"]);
        cargo.arg(profile.parent().unwrap()).current_dir(env!("CARGO_MANIFEST_DIR"));
        if profile.ends_with("release") {
            cargo.arg("--release");
        }
        assert!(cargo.status().unwrap().success());
        profile.join("libplcrt.a")
    })
}

/// Rows `tick,name,value` of a table.
fn rows(text: &str) -> Vec<(usize, String, String)> {
    let lines = text.lines().skip(1).filter(|line| !line.is_empty());
    lines
        .map(|line| {
            let mut cells = line.splitn(3, ',').map(str::to_owned);
            let mut cell = || cells.next().unwrap();
            (cell().parse().unwrap(), cell(), cell())
        })
        .collect()
}

/// A value of a table: decimal, or hexadecimal after `$`.
fn number(text: &str) -> f64 {
    match text.strip_prefix('$') {
        Some(digits) => i64::from_str_radix(digits, 16).unwrap() as f64,
        None => text.parse().unwrap(),
    }
}

/// For each name its value at each of so many ticks; 0 before its first row.
fn by_tick(rows: &[(usize, String, String)], names: &[String], ticks: usize) -> Vec<Vec<f64>> {
    let column = |name: &String| {
        let mut value = 0.0;
        let own: Vec<_> = rows.iter().filter(|(_, row, _)| row == name).collect();
        let at = |tick: usize| {
            for (_, _, text) in own.iter().filter(|(at, ..)| *at == tick) {
                value = number(text);
            }
            value
        };
        (0..ticks).map(at).collect()
    };
    names.iter().map(column).collect()
}

/// How many pins a channel of the streamer or the sampler gets here; it could have 20.
const CHANNEL: usize = 16;

/// Builds the component `example`, and runs a session with what the folder `session` has; gives what was said on standard
/// error, or `None` where no session can be started here.
fn session(folder: &Folder, ticks: &str) -> Option<String> {
    let mut make = Command::new("make");
    make.arg(format!("LIBPLCRT={}", library().display()));
    let made = make.current_dir(folder.path().join("example-hal")).output().unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let inner = folder.path().join("session");
    fs::copy(folder.path().join("example-hal/example.so"), inner.join("example.so")).unwrap();
    let mut open = Command::new("chmod");
    open.arg("-R").arg("a+rX").arg(folder.path());
    assert!(open.status().unwrap().success());
    let mut session = Command::new(root().join("cli/tests/hal/session"));
    let session = session.arg(&inner).arg(ticks).stdin(Stdio::null()).output().unwrap();
    if session.status.code() == Some(77) {
        tools::missing("linuxcnc", "can't have a session here, which takes root, for a name space");
        return None;
    }
    let said = String::from_utf8_lossy(&session.stderr).into_owned();
    assert!(session.status.success(), "{said}");
    Some(said)
}

/// One session at a time.
static SESSION: Mutex<()> = Mutex::new(());

fn is_the_same_in_hal(example: &Example) {
    if !Path::new("/usr/include/linuxcnc/hal.h").exists() {
        tools::missing("linuxcnc", "is not installed");
        return;
    }
    let _one = SESSION.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = Folder::with(&[]);
    let examples = root().join("examples");
    let source = examples.join(example.source);
    let stimulus = examples.join(example.run);
    let ticks = example.ticks.to_string();
    let mut run = vec!["run", source.to_str().unwrap(), "--ticks", &ticks];
    run.extend(["--stimulus", stimulus.to_str().unwrap()]);
    let watched = example.watched.join(",");
    run.extend(["--trace", "expected.csv", "--watch", &watched]);
    run.extend(example.options.split_whitespace());
    folder.run(&run).exits(0);
    let mut hal = vec!["hal", source.to_str().unwrap(), "--name", "example"];
    hal.extend(example.hal.split_whitespace());
    folder.run(&hal).exits(0);

    let pins = pins(&folder, "example");
    let played: Vec<_> = rows(&fs::read_to_string(&stimulus).unwrap());
    let played: Vec<_> = played.into_iter().filter(|(tick, ..)| *tick < example.ticks).collect();
    let mut given: Vec<String> = played.iter().map(|(_, name, _)| name.clone()).collect();
    given.sort();
    given.dedup();
    let seen: Vec<String> = example.watched.iter().map(|name| (*name).to_owned()).collect();
    let letter = |name: &String| pins[name][1].trim_start_matches("HAL_")[..1].to_lowercase();
    let cfg = |names: &[String]| {
        let channel = |names: &[String]| names.iter().map(letter).collect::<String>();
        names.chunks(CHANNEL).map(channel).collect::<Vec<_>>().join(",")
    };
    let depths = |names: &[String]| {
        vec![(example.ticks + 100).to_string(); names.chunks(CHANNEL).count()].join(",")
    };
    let example_hal = folder.read("example-hal/example.hal");
    let thread = example_hal.lines().find(|line| line.starts_with("loadrt threads")).unwrap();
    let mut setup = format!("{thread}\nloadrt example \"options={}\"\n", example.options);
    for (part, names) in [("streamer", &given), ("sampler", &seen)] {
        let _ = writeln!(setup, "loadrt {part} depth={} cfg={}", depths(names), cfg(names));
    }
    for channel in 0..given.chunks(CHANNEL).count() {
        let _ = writeln!(setup, "addf streamer.{channel} plc");
    }
    setup.push_str("addf example.tick plc\n");
    for channel in 0..seen.chunks(CHANNEL).count() {
        let _ = writeln!(setup, "addf sampler.{channel} plc");
    }
    for (part, names) in [("streamer", &given), ("sampler", &seen)] {
        for (number, name) in names.iter().enumerate() {
            let (channel, pin) = (number / CHANNEL, number % CHANNEL);
            let arrow = if part == "streamer" { "<=" } else { "=>" };
            let own = &pins[name][0];
            let _ = writeln!(setup, "net {own} example.{own} {arrow} {part}.{channel}.pin.{pin}");
        }
    }
    folder.write("session/setup.hal", setup);
    let columns = by_tick(&played, &given, example.ticks);
    for (channel, columns) in columns.chunks(CHANNEL).enumerate() {
        // The values of the last tick stay; the session goes on for some ticks.
        let line = |tick: usize| {
            let cells: Vec<String> = columns.iter().map(|c| c[tick].to_string()).collect();
            cells.join(" ") + "\n"
        };
        let text: String = (0..example.ticks).map(line).collect();
        folder.write(format!("session/stream.{channel}"), text);
    }

    let Some(said) = session(&folder, &ticks) else { return };

    let expected = by_tick(&rows(&folder.read("expected.csv")), &seen, example.ticks);
    for (channel, names) in seen.chunks(CHANNEL).enumerate() {
        let samples = folder.read(&format!("session/samples.{channel}"));
        let mut count = 0;
        for line in samples.lines() {
            let mut cells = line.split_whitespace();
            let tick: usize = cells.next().unwrap().parse().unwrap();
            assert_eq!(tick, count, "a sample is missing: {said}");
            count += 1;
            for (number, (name, cell)) in names.iter().zip(cells).enumerate() {
                let value = number_of_sample(cell);
                let right = expected[channel * CHANNEL + number][tick];
                assert_eq!(value, right, "{name} in tick {tick}\n{said}");
            }
        }
        assert_eq!(count, example.ticks);
    }
}

/// A sample's value, with six decimals where it is floating point.
fn number_of_sample(cell: &str) -> f64 {
    cell.parse().unwrap()
}

#[test]
fn the_lathe_runs_in_hal_as_in_plcc_run() {
    is_the_same_in_hal(&Example {
        source: "pmi/lathe.pmi",
        run: "pmi/lathe.csv",
        hal: "--pin MINZ=out --pin MCRDY=in",
        options: "",
        ticks: 230,
        watched: &["@MONRQ", "MCHON", "MINZ", "@MCRDY", "@CL115", "@FRO", "BEEPER", "@AXIS"],
    });
}

#[test]
fn the_magazine_runs_in_hal_as_in_plcc_run() {
    is_the_same_in_hal(&Example {
        source: "nct/axrandom.plc",
        run: "nct/axrandom/by-hand/stimulus.csv",
        hal: "--pin F500=in --pin F502=in --pin F504=in --pin F506=in --pin F508=in --pin RP037=in \
              --pin RP038=in --pin RP039=in --pin F0132=out --pin F1011=out --pin F1012=out --pin Q01=out \
              --pin Q05=out --pin F526=out --pin RH006=in --pin I541=in",
        options: "--param 61=12 --param 62=2",
        ticks: 100,
        watched: &[
            "Y540", "Y470", "Y471", "Y547", "F0132", "F1011", "F1012", "Q01", "Q05", "RH062",
            "F526", "RH064", "RH093", "Y703",
        ],
    });
}

#[test]
fn the_mill_runs_in_hal_as_in_plcc_run() {
    is_the_same_in_hal(&Example {
        source: "pmac/mill.pmc",
        run: "pmac/mill/lubrication/stimulus.csv",
        hal: "--pin M13=in --pin M14=in --pin Y:$FFC0=in --pin Y:$FFC2=in --pin P23=out --pin P24=out \
              --pin P30=out",
        options: "",
        ticks: 14000,
        watched: &["M9", "M81", "P23", "P24", "P30"],
    });
}

/// The lathe whose axes LinuxCNC moves and whose old program does the rest: each M, S and T is given by MDI.
#[test]
fn the_lathe_of_the_tutorial_runs_with_linuxcnc() {
    if !Path::new("/usr/include/linuxcnc/hal.h").exists() {
        tools::missing("linuxcnc", "is not installed");
        return;
    }
    let library = library();
    let _one = SESSION.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = Folder::with(&[]);
    let lathe = folder.path().join("lathe");
    let mut copied = Command::new("cp");
    copied.arg("-r").arg(root().join("examples/linuxcnc-lathe")).arg(&lathe);
    assert!(copied.status().unwrap().success());
    let mut make = Command::new("make");
    make.arg(format!("LIBPLCRT={}", library.display()));
    make.arg(format!("PLCC={}", env!("CARGO_BIN_EXE_plcc")));
    let made = make.current_dir(&lathe).output().unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    fs::rename(lathe.join("lathe-hal/lathe.so"), lathe.join("lathe.so")).unwrap();
    assert!(Command::new("chmod").arg("a+rx").arg(folder.path()).status().unwrap().success());
    let mut session = Command::new(root().join("cli/tests/hal/linuxcnc"));
    let session = session.arg(&lathe).stdin(Stdio::null()).output().unwrap();
    if session.status.code() == Some(77) {
        tools::missing("linuxcnc", "can't have a session here, which takes root, for a name space");
        return;
    }
    let steps = fs::read_to_string(lathe.join("steps")).unwrap_or_default();
    let said = String::from_utf8_lossy(&session.stderr);
    assert!(steps.ends_with("all steps are done\n"), "{steps}{said}");
    assert!(steps.lines().filter(|line| line.starts_with("ok")).count() > 50, "{steps}");
}

/// M6 of an NCT: a strobe of one slice, and FIN when the tool is changed.
#[test]
fn a_function_is_handed_to_a_program_of_nct_and_its_fin_comes_back() {
    if !Path::new("/usr/include/linuxcnc/hal.h").exists() {
        tools::missing("linuxcnc", "is not installed");
        return;
    }
    let _one = SESSION.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = Folder::with(&[]);
    let source = root().join("examples/desk/changer.nct");
    folder.run(&["hal", source.to_str().unwrap(), "--name", "example"]).exits(0);
    folder.write("session/commands.sh", include_str!("hal/nct_tool_change.sh"));
    let strobe = root().join("examples/linuxcnc-lathe/nct_strobe.comp");
    let inner = folder.path().join("session");
    fs::copy(strobe, inner.join("nct_strobe.comp")).unwrap();
    let mut compile = Command::new("halcompile");
    let compiled = compile.args(["--compile", "nct_strobe.comp"]).current_dir(&inner).output();
    assert!(compiled.unwrap().status.success());
    let Some(said) = session(&folder, "0") else { return };
    let printed = folder.read("session/printed");
    assert_eq!(printed.lines().filter(|line| line.starts_with("ok")).count(), 8, "{printed}{said}");
}

/// Runs commands in a session that has a component of a program, which the program stops when N is not an index of A. Gives
/// what they print, and what was said on standard error.
fn in_a_session(commands: &str) -> Option<(String, String)> {
    if !Path::new("/usr/include/linuxcnc/hal.h").exists() {
        tools::missing("linuxcnc", "is not installed");
        return None;
    }
    let _one = SESSION.lock().unwrap_or_else(PoisonError::into_inner);
    let program = "$OUTPUT\nLAMP = 1/0\n$LOGICAL\nOFF\n$INTEGER\nN, M, A[2]\n$END\n\
                   LAMP = /OFF\nM = N\nA[N] = 1\n";
    let folder = Folder::with(&[("example.pmi", program)]);
    folder.plcc("hal example.pmi --pin N=in --pin M=out").exits(0);
    // A value that does not come ends the script by its own time, and the test with it.
    let head = "until_is() { for _ in $(seq 6000); do [ \"$(halcmd getp $1)\" != $2 ] || return 0; sleep 0.01; done; \
                echo \"$1 does not become $2\" >&2; return 1; }\n";
    folder.write("session/commands.sh", format!("{head}{commands}"));
    let said = session(&folder, "0")?;
    Some((folder.read("session/printed"), said))
}

const LOADED: &str = "halcmd loadrt threads name1=plc period1=1000000\nhalcmd loadrt example\n\
                      halcmd addf example.tick plc\nhalcmd net lamp example.lamp\nhalcmd start\n\
                      until_is example.lamp TRUE\n";

#[test]
fn outputs_in_hal_are_safe_when_the_program_stops_and_when_the_component_is_unloaded() {
    let stop = "halcmd setp example.n 7\nuntil_is example.stopped TRUE\nuntil_is example.lamp FALSE\n\
                halcmd gets lamp >printed\n";
    let unload = "halcmd unload example\nhalcmd gets lamp >printed\n";
    for commands in [stop, unload] {
        let Some((printed, said)) = in_a_session(&format!("{LOADED}{commands}")) else { return };
        assert_eq!(printed.trim(), "FALSE", "{said}");
    }
}

#[test]
fn what_a_variable_cannot_have_is_not_taken_from_a_pin_and_a_message_says_so() {
    let commands = "halcmd setp example.n 1\nuntil_is example.m 1\nhalcmd setp example.n 40000\n\
                    ticks=$(halcmd getp example.ticks)\n\
                    until [ $(halcmd getp example.ticks) -gt $((ticks + 2)) ]; do sleep 0.01; done\n\
                    halcmd getp example.m >printed\nhalcmd setp example.n 0\nuntil_is example.m 0\n";
    let Some((printed, said)) = in_a_session(&format!("{LOADED}{commands}")) else { return };
    assert_eq!(printed.trim(), "1", "{said}");
    let message =
        "the pin example.n is 40000, which N can't be (-32768 to 32767); N keeps its last value";
    assert_eq!(said.matches(message).count(), 1, "{said}");
}

#[test]
fn a_retained_file_that_could_not_be_written_or_read_is_refused_when_the_component_is_loaded() {
    let commands = "head -c 2000000 /dev/zero >long\n\
                    for file in /nonexistent/x $PWD/nowhere/x $PWD/long $PWD; do\n\
                      halcmd loadrt example retain=$file && echo loaded >>printed || echo refused >>printed\n\
                    done\n\
                    halcmd loadrt example retain=$PWD/new\nhalcmd unload example\n\
                    ls new* >>printed\nhalcmd loadrt example retain=$PWD/new\n";
    let Some((printed, said)) = in_a_session(commands) else { return };
    assert_eq!(printed, "refused\nrefused\nrefused\nrefused\nnew\n", "{said}");
    for why in
        ["/nonexistent/x.new can't be written: No such file", "long can't be read: it is too long"]
    {
        assert!(said.contains(why), "{why}: {said}");
    }
}

#[test]
fn pins_know_what_their_variables_can_have() {
    let pmi = "$INPUT\nTOOL=0/1-4/BCD\n$INTEGER\nN\n$LONG\nL\n$END\nN=TOOL\nL=N\n";
    let folder = Folder::with(&[("a.pmi", pmi)]);
    folder.plcc("hal a.pmi --pin N=in --pin L=in").exits(0);
    let text = folder.read("a-hal/a.c");
    for (name, low, high) in [
        ("TOOL", "0.0", "9.0"),
        ("N", "-32768.0", "32767.0"),
        ("L", "-2147483648.0", "2147483647.0"),
    ] {
        let line = text.lines().find(|line| line.contains(&format!("{{ \"{name}\","))).unwrap();
        assert!(line.ends_with(&format!("HAL_IN, {low}, {high} }},")), "{line}");
    }
}
