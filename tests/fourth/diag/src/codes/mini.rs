//! The codes of MINI.

use crate::CodeInfo;

/// Every code of MINI, in order.
pub static CODES: &[CodeInfo] = &[
    CodeInfo {
        code: "MINI-1",
        title: "no statement",
        meaning: "A line is a declaration, an assignment, COUNT, IF or END.",
        fix: "wrong: LAMP START\nright: LAMP = START",
    },
    CodeInfo {
        code: "MINI-2",
        title: "unknown name",
        meaning: "A variable is declared in a line above its use.",
        fix: "wrong: LAMP = START\nright: INPUT START",
    },
    CodeInfo {
        code: "MINI-3",
        title: "IF and END do not match",
        meaning: "Each IF has an END below it.",
        fix: "wrong: IF START\nright: IF START ... END",
    },
    CodeInfo {
        code: "MINI-X1",
        title: "too many instructions",
        meaning: "The program is longer than the compiler takes.",
        fix: "Split the program.",
    },
    CodeInfo {
        code: "MINI-X2",
        title: "too much machine code",
        meaning: "The machine code is longer than the compiler makes it.",
        fix: "Split the program.",
    },
];
