//! `plcc plot` and `plcc run --plot`

#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

mod support;

use support::{COUNTER, Folder, PLC1, SLICES, STOPS};

#[test]
fn a_run_and_its_trace_are_drawn() {
    let files = [("a.pmi", COUNTER), ("b.plc", SLICES), ("c.pmc", PLC1)];
    let folder = Folder::with(&files);
    for (file, watch) in [("a.pmi", "N,OUT"), ("b.plc", "F020,OP1"), ("c.pmc", "P1")] {
        let mut pictures = vec![];
        for engine in ["interp", "jit", "aot"] {
            let run = format!(
                "run {file} --ticks 40 --engine {engine} --watch {watch} --plot a.svg \
                 --time --trace t.csv"
            );
            let done = folder.plcc(&run).exits(0);
            assert_eq!((done.stdout.as_str(), done.stderr.as_str()), ("", ""));
            pictures.push(folder.read("a.svg"));
        }
        assert!(pictures.windows(2).all(|pair| pair[0] == pair[1]), "{file}");
        let svg = &pictures[0];
        assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"), "{svg}");
        for name in watch.split(',') {
            assert!(svg.contains(&format!(">{name}</text>")), "{name}\n{svg}");
        }
        let run = format!("run {file} --ticks 40 --watch {watch} --plot -");
        assert_eq!(folder.plcc(&run).exits(0).stdout, *svg, "the picture alone");
        folder.plcc("plot t.csv -o b.svg").exits(0);
        let drawn = folder.read("b.svg");
        // What changes in the last tick is in the table, so that the table ends where the run does.
        let polylines = |svg: &str| {
            svg.lines()
                .filter(|line| line.starts_with("<polyline"))
                .map(str::to_owned)
                .collect::<Vec<_>>()
        };
        assert_eq!(polylines(&drawn), polylines(svg));
    }
}

#[test]
fn a_run_that_stops_is_drawn_up_to_its_end() {
    let folder = Folder::with(&[("s.pmi", STOPS)]);
    folder.plcc("run s.pmi --ticks 100 --watch N,A --plot s.svg --trace t.csv").exits(3);
    assert!(folder.read("s.svg").contains(">A[2]</text>"));
}

#[test]
fn mistakes_with_pictures_are_explained() {
    let folder = Folder::with(&[
        ("a.pmi", COUNTER),
        ("t.csv", "tick,name,value\n0,A,1\nx,A,2\n"),
        ("v.vcd", "$date\n"),
        ("empty.csv", "tick,name,value\n"),
    ]);
    for (line, part) in [
        ("plot t.csv -o t.svg", "t.csv:3: `x` is not a tick"),
        ("plot v.vcd -o t.svg", "v.vcd:1: the header `tick,name,value`"),
        ("plot none.csv -o t.svg", "none.csv"),
        ("plot empty.csv -o empty.csv", "it was read"),
        ("plot empty.csv -o no/t.svg", "no/t.svg"),
        ("run a.pmi --ticks 1 --watch N --plot no/t.svg", "no/t.svg"),
        ("run a.pmi --ticks 1 --watch N --plot a.pmi", "--plot would overwrite the program"),
        ("run a.pmi --ticks 1 --watch N --plot t.svg --dump t.svg", "would overwrite"),
        ("run a.pmi --realtime --ticks 1 --watch N --plot t.svg", "--realtime"),
        ("run a.pmi --ticks 1 --watch NONE --plot t.svg", "NONE"),
    ] {
        folder.plcc(line).exits(2).says(&[part]);
    }
    assert!(!folder.path().join("t.svg").exists());
    folder.plcc("plot empty.csv -o empty.svg").exits(0).says(&["the picture is empty"]);
    folder.plcc("run a.pmi --ticks 3 --plot e.svg").exits(0).says(&["--watch"]);
}
