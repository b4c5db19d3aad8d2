//! For each rule a module that breaks it, and the error that is reported.

use super::{every_scan_ends, verify};
use crate::text::parse;

const HEAD: &str = "image 24\nregion data at 0 size 16\nregion bits at 16 size 8 bits\n";

fn errors(text: &str) -> Vec<String> {
    verify(&parse(text).unwrap()).iter().map(ToString::to_string).collect()
}

/// The errors of a function's body.
fn body(body: &str) -> Vec<String> {
    errors(&format!("{HEAD}task \"scan\" L0\nfn \"f\" {{\nblock0 (L0):\n{body}\n}}\n"))
}

#[test]
fn each_broken_rule_of_functions_is_reported() {
    for (text, message) in [
        (
            "v0: i16 = load data:15\nreturn",
            "f, block0, inst0: accesses bytes 15..17 of data, which has 16 bytes",
        ),
        (
            "v0: i1 = load data:0\nreturn",
            "f, block0, inst0: accesses an i1 in data, which is not a region of bits",
        ),
        (
            "v0: i8 = iconst 2\nstore bits:0, v0\nreturn",
            "f, block0, inst1: stores an i8 in bits, which is a region of bits",
        ),
        (
            "v0: i16 = load data:0\nv1: i8 = load data:0[v0 * 1, 4]\nreturn",
            "f, block0, inst1: its index is i16, not i32",
        ),
        (
            "v0: i32 = load data:0\nv1: i8 = load data:0[v0 * 4, 5]\nreturn",
            "f, block0, inst1: accesses bytes 0..17 of data, which has 16 bytes",
        ),
        (
            "v0: i32 = load data:0\nv1: i8 = load data:0[v0 * 4, 0]\nreturn",
            "f, block0, inst1: its array has no elements",
        ),
        ("v0: i8 = iconst 200\nreturn", "f, block0, inst0: 200 is not a constant of type i8"),
        ("v0: i8 = iconst 1\nv1: i8 = fabs v0\nreturn", "f, block0, inst1: fabs takes no i8"),
        ("v0: i1 = iconst 1\nv1: i1 = add v0, v0\nreturn", "f, block0, inst1: add takes no i1"),
        (
            "v0: i8 = iconst 1\nv1: i16 = add v0, v0\nreturn",
            "f, block0, inst1: its result is i16, but the operation gives i8",
        ),
        (
            "v0: i8 = iconst 1\nv1: i16 = iconst 1\nv2: i8 = add v0, v1\nreturn",
            "f, block0, inst2: its operands are i8 and i16",
        ),
        (
            "v0: i8 = iconst 1\nv1: i8 = sext v0\nreturn",
            "f, block0, inst1: sext cannot convert i8 to i8",
        ),
        (
            "v0: i8 = iconst 1\nv1: i1 = trunc v0\nreturn",
            "f, block0, inst1: trunc cannot convert i8 to i1",
        ),
        (
            "v0: i8 = iconst 1\nv1: i1 = bit v0, 8\nreturn",
            "f, block0, inst1: an i8 has no field of 1 bits from bit 8 on",
        ),
        (
            "v0: i8 = iconst 1\nv1: i8 = extract_s v0, 3, 6\nreturn",
            "f, block0, inst1: an i8 has no field of 6 bits from bit 3 on",
        ),
        (
            "v0: i8 = iconst 1\nv1: i8 = extract_u v0, 3, 0\nreturn",
            "f, block0, inst1: an i8 has no field of 0 bits from bit 3 on",
        ),
        (
            "v0: i1 = iconst 1\nv1: i1 = insert v0, v0, 0, 1\nreturn",
            "f, block0, inst1: an i1 has no field of 1 bits from bit 0 on",
        ),
        (
            "v0: i8 = iconst 1\nv1: i1 = iconst 1\nv2: i8 = insert v0, v1, 0, 2\nreturn",
            "f, block0, inst2: 2 bits of an i8 can't be an i1",
        ),
        (
            "v0: i1 = iconst 1\nv1: i1 = icmp slt v0, v0\nreturn",
            "f, block0, inst1: slt takes no i1",
        ),
        (
            "v0: i8 = neg v1\nv1: i8 = iconst 1\nreturn",
            "f, block0, inst0: v1 is not defined on every path to this use",
        ),
        (
            "v0: i8 = iconst 1\nbrif v0, block1, block1\nblock1:\nreturn",
            "f, block0, v0 is i8, not i1",
        ),
        (
            "v0: i8 = iconst 1\njump block1\nblock1(v1: i8):\nreturn",
            "f, block0, block1 has 1 parameters, but 0 values are passed",
        ),
        (
            "v0: i8 = iconst 1\njump block1(v0)\nblock1(v1: i16):\nreturn",
            "f, block0, block1 takes i16 as v1, not i8",
        ),
        (
            "hostcall pmac_save()\nhostcall pmac_define()\nreturn",
            "f, block0, inst1: these are not the arguments that pmac_define takes",
        ),
        (
            "@3\nv0: i8 = iconst 1\nreturn",
            "f, block0, inst0: belongs to statement @3, which is not there",
        ),
        ("v0: i16 = iconst 0\ngoto_indirect v0", "f, block0, v0 is i16, not i32"),
    ] {
        assert_eq!(body(text).first().map(String::as_str), Some(message), "{text}");
    }
}

#[test]
fn each_broken_rule_of_modules_is_reported() {
    for (text, message) in [
        ("image 8\nregion a at 0 size 9\n", "region a ends at byte 9, but the image has 8 bytes"),
        ("image 8\nregion a at 0 size 5\nregion b at 4 size 4\n", "regions a and b overlap"),
        ("fn \"f\" {\nblock0 (L0):\nreturn\nblock1 (L0):\nreturn\n}\n", "L0 is at 2 places"),
        (
            "fn \"f\" {\nblock0(v0: i8) (L0):\nreturn\n}\n",
            "f, L0 is at block0, which has parameters",
        ),
        (
            "task \"a\" L0\nfn \"f\" {\nblock0 (L0):\nsuspend L0\n}\n",
            "a scan is suspended at L0, which no task has as a resume point",
        ),
        (
            "task \"a\" L0\ntask \"b\" L1 resume [L1]\nfn \"f\" {\nblock0 (L0):\njump block1\n\
             block1 (L1):\nsuspend L1\n}\n",
            "task a is suspended at L1, which is not one of its resume points",
        ),
    ] {
        assert!(errors(text).iter().any(|error| error == message), "{:?}", errors(text));
    }
}

#[test]
fn all_errors_are_reported() {
    let found = body("v0: i8 = iconst 200\nv1: i1 = load data:0\nstore data:16, v0\nreturn");
    assert_eq!(found.len(), 3, "{found:?}");
}

#[test]
fn a_value_defined_in_one_arm_is_not_defined_behind_the_branch() {
    let found = body(
        "v0: i1 = load bits:0\nbrif v0, block1, block2\nblock1:\nv1: i8 = iconst 1\njump block3\n\
         block2:\njump block3\nblock3:\nstore data:0, v1\nstore bits:0, v0\nreturn",
    );
    assert_eq!(found, ["f, block3, inst2: v1 is not defined on every path to this use"]);
}

#[test]
fn loops_are_found_across_functions() {
    let ends = |text: &str| every_scan_ends(&parse(&format!("{HEAD}{text}")).unwrap());
    assert!(ends("fn \"f\" {\nblock0 (L0):\ngoto L1\n}\nfn \"g\" {\nblock0 (L1):\nreturn\n}"));
    assert!(!ends("fn \"f\" {\nblock0 (L0):\ngoto L1\n}\nfn \"g\" {\nblock0 (L1):\ngoto L0\n}"));
    assert!(ends("fn \"f\" {\nblock0 (L0):\nsuspend L0\n}"));
    assert!(!ends("fn \"f\" {\nblock0 (L0):\njump block0\n}"));
    assert!(!ends("fn \"f\" {\nblock0 (L0):\nv0: i32 = iconst 0\ngoto_indirect v0\n}"));
    assert!(ends(
        "fn \"f\" {\nblock0 (L0):\nv0: i1 = load bits:0\nbrif v0, block1, block2\nblock1:\n\
         jump block2\nblock2:\nreturn\n}"
    ));
}
