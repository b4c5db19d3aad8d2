//! The codes of part programs that a simulated control reads (`--simulate`).

use crate::CodeInfo;

/// Every code of part programs, in order.
pub static CODES: &[CodeInfo] = &[
    CodeInfo {
        code: "SIM-1",
        title: "no word begins here",
        meaning: "A block consists of words, each a letter and a number, and of comments. Here is something else, a letter without a number, or a comment whose `)` is missing.",
        fix: "Wrong: G1 X (to the shoulder\nRight: G1 X12.5 (to the shoulder)",
    },
    CodeInfo {
        code: "SIM-2",
        title: "a word that the control does not have",
        meaning: "The simulated control has no word with this letter, or the table [simulator] has no axis of this name. P belongs to G4 alone.",
        fix: "Give the axis in the machine file:\n[[simulator.axis]]\nname = \"U\"",
    },
    CodeInfo {
        code: "SIM-3",
        title: "a letter twice in a block",
        meaning: "Each letter but G and M can be in a block once.",
        fix: "Wrong: G1 X10 X20 F100\nRight: G1 X10 F100\n       X20",
    },
    CodeInfo {
        code: "SIM-4",
        title: "a number out of range",
        meaning: "A number has at most nine digits before its point and six after it. G (but G81.1), M, N, S, T and functions are whole. F is above 0. Only axes, I, J, K and R may be negative, and go to 99999.999999 at most. S, T and functions go to 65535 on an NCT control and to 2147483647 on a PMI control, M to 299 on a PMI control and 999 on others.",
        fix: "Wrong: M3 S1200.5\nRight: M3 S1200",
    },
    CodeInfo {
        code: "SIM-5",
        title: "a code that is not simulated",
        meaning: "The simulated control takes no codes whose effect it would have to guess: canned cycles but for tapping, offsets, subprograms (M96 to M99) and others. On a PMI control codes that the program declares after $MCODE and $GCODE are taken.",
        fix: "Write the blocks of a subprogram where it is called, and the movements of a cycle one by one.",
    },
    CodeInfo {
        code: "SIM-6",
        title: "two G codes of a group",
        meaning: "G0 and G1 exclude each other, and so do G90 and G91 and the codes of other groups. A block with G4 has no axes, and G28, G74 and G84 share their axes with no other code.",
        fix: "Wrong: G0 G1 X10 F100\nRight: G1 X10 F100",
    },
    CodeInfo {
        code: "SIM-7",
        title: "too many M codes",
        meaning: "An NCT control hands over at most five M codes of a block, in RH000 to RH004 (NCT 2.1).",
        fix: "Write the sixth one into a block of its own.",
    },
    CodeInfo {
        code: "SIM-8",
        title: "a feed without F",
        meaning: "A block is to move the axes at a feed, and no block before it has an F. Blocks that can be skipped count as executed; a block that is entered by hand needs an F of its own.",
        fix: "Wrong: G1 X10\nRight: G1 X10 F200",
    },
    CodeInfo {
        code: "SIM-9",
        title: "an arc that can't be",
        meaning: "An arc needs its centre by I, J and K or its radius by R, not both; and its end must be as far from the centre as its beginning, to 10 µm.",
        fix: "Wrong: G2 X10 Y0 F100\nRight: G2 X10 Y0 I5 J0 F100",
    },
    CodeInfo {
        code: "SIM-10",
        title: "nothing ends the part program",
        meaning: "No block has M2 or M30. The step that finds no further block ends the program as M30 would, and no M code is handed over.",
        fix: "Write M30 at the end.",
    },
    CodeInfo {
        code: "SIM-11",
        title: "an M code that does nothing",
        meaning: "On a PMI control an M code reaches the program only if it is declared after $MCODE. M0, M1, M2, M30 and M90 belong to the control.",
        fix: "Declare it:\n$MCODE\n@M08/P",
    },
    CodeInfo {
        code: "SIM-12",
        title: "`/` that can't be here",
        meaning: "`/` in front of a block lets the operator skip it. An NCT control has /1 to /9, a PMI control `/` alone.",
        fix: "Wrong: G1 X10 /M8\nRight: /G1 X10 M8",
    },
    CodeInfo {
        code: "SIM-13",
        title: "what a G code needs is missing",
        meaning: "G4 needs its time in P, in seconds. G33 needs F and G74 and G84 need Z in their block. G61 to G66 of a PMI control need an entry [[simulator.aux]] for their axis.",
        fix: "Wrong: G4\nRight: G4 P1.5",
    },
];
