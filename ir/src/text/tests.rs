//! Texts that are read and printed, and errors in texts.

use super::{parse, print};
use crate::verify::verify;

/// The example of the module's documentation.
fn example() -> String {
    let doc = include_str!("mod.rs");
    let lines = doc.lines().map_while(|line| line.strip_prefix("//!"));
    let text = lines.map(|line| line.strip_prefix(' ').unwrap_or(line));
    let text = text.skip_while(|line| *line != "```text").skip(1);
    text.take_while(|line| *line != "```").map(|line| format!("{line}\n")).collect()
}

#[test]
fn the_documented_example_is_valid_and_comes_out_as_it_went_in() {
    let module = parse(&example()).unwrap();
    assert_eq!(verify(&module), []);
    let bare = |text: &str| -> Vec<String> {
        let code = |line: &str| line.split(';').next().unwrap_or_default().trim_end().to_owned();
        text.lines().map(code).filter(|line| !line.is_empty()).collect()
    };
    let printed = print(&module);
    assert_eq!(bare(&printed), bare(&example()));
    assert!(printed.contains(";; X = A[I] + 1"), "{printed}");
    assert_eq!(print(&parse(&printed).unwrap()), printed);
}

#[test]
fn names_and_text_keep_odd_characters() {
    let mut module = parse(&example()).unwrap();
    module.tasks[0].name = "a \"b\" \\ c\n;".into();
    module.files[0].text = "\r\n | x \\{7}\u{7}\n\n".into();
    let read = parse(&print(&module)).unwrap();
    assert_eq!(read.tasks[0].name, module.tasks[0].name);
    assert_eq!(read.files, module.files);
}

#[test]
fn mistakes_are_told_with_their_place() {
    let head = "image 8\nregion r at 0 size 8\nfn \"f\" {\nblock0 (L0):\n";
    for (body, message) in [
        (
            "v0: i7 = iconst 1\nreturn\n}",
            "5:5: expected a type (i1 i8 i16 i32 i64 f64), found `i7`",
        ),
        (
            "v0: i8 = lode r:0\nreturn\n}",
            "5:10: expected an instruction with a result, found `lode`",
        ),
        (
            "v0: i8 = load q:0\nreturn\n}",
            "5:15: `q` is not a region; regions come before the functions",
        ),
        ("store r:0, v9\nreturn\n}", "5:12: v9 is defined nowhere"),
        ("v0: i8 = iconst 1\nv0: i8 = iconst 1\nreturn\n}", "6:1: v0 is defined twice"),
        ("jump block3\n}", "5:6: block3 is not there; there are 1"),
        ("goto L5\n}", "5:6: L5 is nowhere: there are 1 labels, from L0"),
        ("return\nreturn\n}", "6:1: expected `}` or a block (`block0`), found `return`"),
        (
            "}",
            "5:1: expected a terminator (`jump`, `return` and the like) or an instruction, found `}`",
        ),
        ("return", "5:7: expected `}` or a block (`block0`), found the end of the text"),
        (
            "trap x\n}",
            "5:6: expected a code (internal array_bounds timeout call_depth host_panic watchdog), found `x`",
        ),
        ("return 1\n}", "5:8: expected the end of the line, found `1`"),
        (
            "hostcall pmac_save(\n}",
            "5:20: expected `)` or a value (`v0`), found the end of the line",
        ),
        ("return\nblock2:\nreturn\n}", "6:1: the next block is block1: blocks are in order"),
        ("v0: i1 = icmp le v1, v2\n}", "5:15: expected a comparison (eq ne slt"),
        (
            "v0: f64 = fconst 1e999\n}",
            "5:18: expected a finite number, or bits (`0x0`), found `1e999`",
        ),
        ("store r:0 v0\n}", "5:11: expected `,` or `[`, found `v0`"),
        ("v0: i8 = load r:x\n}", "5:17: expected an offset in bytes, found `x`"),
        ("v0: i8 = load r:4294967296\n}", "5:17: expected an offset in bytes, found `4294967296`"),
        ("hostcall pmac_define(v0, v1, v2, v3, v4)\n}", "5:36: expected"),
        ("@1 @2\n}", "5:4: expected the end of the line, found `@2`"),
    ] {
        let found = parse(&format!("{head}{body}")).unwrap_err().to_string();
        assert!(found.starts_with(message), "{found}\n{message}");
    }
    assert_eq!(
        parse("| x").unwrap_err().to_string(),
        "1:1: expected `file`, `fn`, `image`, `region`, `statement`, `task`, `trap_site` or the end of the text, \
         found a line of text"
    );
    assert_eq!(parse("task \"x").unwrap_err().column, 6);
}
