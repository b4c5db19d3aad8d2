//! The codes of test scripts (`plcc test`).

use crate::CodeInfo;

/// Every code of test scripts, in order.
pub static CODES: &[CodeInfo] = &[
    CodeInfo {
        code: "TEST-1",
        title: "not a statement of a test script",
        meaning: "A line begins with a word that no statement begins with, or a part of the statement is missing or is in the wrong place. Keywords are written in small letters, and each statement has a line of its own.",
        fix: "Wrong: wait until PUMP\nRight: wait until PUMP within 5 s",
    },
    CodeInfo {
        code: "TEST-2",
        title: "statement in the wrong place",
        meaning: "What acts and what is expected is written between `test` and `end`. The program, the machine file, `simulate`, `never`, `always` and `after` are above the tests that they are for. Each test of a script has a name of its own.",
        fix: "Wrong: set DOOR = 1\n       test \"the pump starts\"\n       end\nRight: test \"the pump starts\"\n         set DOOR = 1\n       end",
    },
    CodeInfo {
        code: "TEST-3",
        title: "name that can't be used here",
        meaning: "The program has no variable of that name, or one that can't be set: a constant, a label, a whole array. Only inputs and physical outputs can be forced.",
        fix: "`plcc xref PROGRAM` lists the variables of a program. `set` sets a variable once, where `force` holds it.",
    },
    CodeInfo {
        code: "TEST-4",
        title: "value that does not fit",
        meaning: "Values are those of a stimulus: decimal integers, in PMAC also fractions and hexadecimal digits after `$`. They are converted as in an assignment.",
        fix: "Wrong: set DOOR = open\nRight: set DOOR = 1",
    },
    CodeInfo {
        code: "TEST-5",
        title: "not a condition",
        meaning: "A condition is true or false. A number alone is neither, also where its language would allow it in a watch list.",
        fix: "Wrong: expect TPOS\nRight: expect TPOS = 4",
    },
    CodeInfo {
        code: "TEST-6",
        title: "file that can't be used",
        meaning: "The program or the machine file that a script names can't be read, or its language is not clear. Paths start from the folder of the script.",
        fix: "Wrong: program \"lathe\"\nRight: program \"../pmi/lathe.pmi\"",
    },
];
