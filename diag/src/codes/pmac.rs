//! The codes of PMAC: the controller's errors ERR001 to ERR017 (appendix A of its manual), and ours.

use crate::CodeInfo;

const fn code(
    code: &'static str,
    title: &'static str,
    meaning: &'static str,
    fix: &'static str,
) -> CodeInfo {
    CodeInfo { code, title, meaning, fix }
}

/// Every code of PMAC, in order.
pub static CODES: &[CodeInfo] = &[
    code(
        "PMAC-1",
        "not while a program runs (ERR001)",
        "The controller refuses some commands while a motion program is being executed. A file that is compiled never meets this; a command at run time can.",
        "Stop the program first:\n  &1A            ; abort\n  OPEN PROG 1 CLEAR",
    ),
    code(
        "PMAC-2",
        "wrong password (ERR002)",
        "The controller's programs are locked by a password. Files are compiled without it, so this does not come up here.",
        "Send the right one:\n  PASSWORD={Secret}",
    ),
    code(
        "PMAC-3",
        "wrong data or unknown command (ERR003)",
        "The text is neither a statement nor a command: a word that nothing defines, a condition without a comparator, a value that does not fit.",
        "Wrong:\n  IF (M1) P1=1 ENDIF\nRight:\n  IF (M1=1) P1=1 ENDIF",
    ),
    code(
        "PMAC-4",
        "character that the language does not know (ERR004)",
        "Outside comments and quoted texts only plain ASCII characters mean something.",
        "Wrong:\n  P1=P2\u{d7}3\nRight:\n  P1=P2*3",
    ),
    code(
        "PMAC-5",
        "no buffer is open (ERR005)",
        "A statement of a program is where only on-line commands can be: before an OPEN or after a CLOSE.",
        "Wrong:\n  IF (P1=1) P2=3 ENDIF\nRight:\n  OPEN PLC 1 CLEAR\n  IF (P1=1) P2=3 ENDIF\n  CLOSE",
    ),
    code(
        "PMAC-6",
        "no room (ERR006)",
        "Definitions name definitions more than 256 deep.",
        "Wrong:\n  #define A B\n  #define B C     ; and so on\nRight:\n  #define A P1",
    ),
    code(
        "PMAC-7",
        "another buffer is open (ERR007)",
        "An OPEN comes where the buffer that was opened before is not closed yet.",
        "Wrong:\n  OPEN PLC 1 CLEAR\n  P1=1\n  OPEN PLC 2 CLEAR\nRight:\n  OPEN PLC 1 CLEAR\n  P1=1\n  CLOSE\n  OPEN PLC 2 CLEAR",
    ),
    code(
        "PMAC-8",
        "MACRO ring error (ERR008)",
        "A transfer over the MACRO ring failed. There is no ring here: reads give 0, writes become events.",
        "On the machine look at X:$0798, which holds the kind of error.",
    ),
    code(
        "PMAC-9",
        "structure of the program (ERR009)",
        "IF and ENDIF, or WHILE and ENDWHILE, do not match. The error is reported at CLOSE, as by the controller; the message names the line that causes it. With --keep-going the other PLCs can run.",
        "Wrong:\n  OPEN PLC 1 CLEAR\n  IF (P1=1)\n  P2=1\n  CLOSE\nRight:\n  OPEN PLC 1 CLEAR\n  IF (P1=1)\n  P2=1\n  ENDIF\n  CLOSE",
    ),
    code(
        "PMAC-10",
        "both limits set (ERR010)",
        "A motor of the coordinate system has both overtravel limits tripped, so no motion program can start. Motion is not run here.",
        "Look at the limit switches and their wiring, or switch their check off in Ix25.",
    ),
    code(
        "PMAC-11",
        "the move before is not over (ERR011)",
        "A command for a motion program came while a move was under way. Motion is not run here.",
        "Wait for the in-position bit, or abort with A.",
    ),
    code(
        "PMAC-12",
        "a motor is open-loop (ERR012)",
        "A motor of the coordinate system is not under closed-loop control. Motion is not run here.",
        "Close the loop first:\n  #1J/",
    ),
    code(
        "PMAC-13",
        "a motor is not activated (ERR013)",
        "A motor of the coordinate system has Ix00 at 0. Motion is not run here.",
        "Activate it, or take it out of the coordinate system:\n  I100=1",
    ),
    code(
        "PMAC-14",
        "no motors (ERR014)",
        "The coordinate system has no motor. Motion is not run here.",
        "Define an axis:\n  &1#1->1000X",
    ),
    code(
        "PMAC-15",
        "no program to run (ERR015)",
        "R came while the coordinate system points to no valid motion program. Motion is not run here.",
        "Point to one first:\n  &1B1R",
    ),
    code(
        "PMAC-16",
        "a program with wrong structure was run (ERR016)",
        "A motion program that lacks an ENDWHILE or the like was started. Motion is not run here.",
        "Mend the program and download it again.",
    ),
    code(
        "PMAC-17",
        "motors are not where they were stopped (ERR017)",
        "A motion program was resumed though motors were moved after / or \\. Motion is not run here.",
        "Bring them back first:\n  J=",
    ),
    code(
        "PMAC-X1",
        "number beyond the controller",
        "PMAC has variables 0 to 1023, addresses to $FFFF, 8 motors and coordinate systems. Turbo PMAC has variables 0 to 8191, addresses to $FFFFFF, 32 motors, 16 coordinate systems.",
        "A program for Turbo PMAC is compiled with\n  plcc check --controller turbo FILE",
    ),
    code(
        "PMAC-X2",
        "included file not found",
        "The file that #include names is not there, or includes itself. It is looked for beside the including file: first with its path as written, then without the first folder of the path, without the first two, and so on. Upper and lower case make no difference. Then it is looked for in the same way in each folder given with -I. Files that lie neither below the program's folder, nor below the current folder, nor below one given with -I, are not read.",
        "  plcc check -I lib FILE",
    ),
    code(
        "PMAC-X3",
        "template without a value",
        "The text holds a template $(NAME), and nothing says what it means.",
        "  plcc check --define NAME=VALUE FILE",
    ),
    code(
        "PMAC-X4",
        "ranges name too many variables",
        "The ranges of a download, such as P0..1023=0, may name 2 097 152 variables in all. Each of them is looked at when the download is read, so this bounds the time for that.",
        "Assign to each variable once. A Turbo PMAC has 8192 variables of each kind.",
    ),
    code(
        "PMAC-X5",
        "included files are too long",
        "The files that a download includes may have 4 MiB in all, a file that is included several times counting each time, and each as 1 KiB at least. This bounds the time and memory that a small file can take.",
        "Include each file once:\n  #ifndef IO_H\n  #define IO_H\n  …\n  #endif",
    ),
    code(
        "PMAC-X6",
        "replacements are too long",
        "What replaces defined names and templates may have 2 MiB in all. A few definitions that name each other twice can double a text again and again.",
        "Wrong:\n  #define A P1=P1+1\n  #define B A A\n  #define C B B\n  … and so on\nRight: a WHILE that repeats the statement",
    ),
    code(
        "PMAC-X7",
        "program too long to compile",
        "The compiler makes instructions of an intermediate representation (IR) of each statement, before it optimises them: of a usual statement 5 to 50. It takes programs of up to 524 288 such instructions, and single statements of up to 131 072. The place is the statement with which there are too many.",
        "Divide the download among several, or put what is alike into a WHILE.",
    ),
    code(
        "PMAC-X8",
        "machine code too long",
        "The machine code of a program may have 32 MiB. The place is the first statement of the part with which it is longer.",
        "Divide the download among several, or put what is alike into a WHILE.",
    ),
    code(
        "PMAC-W1",
        "the last buffer is not closed",
        "The text ends while a buffer is open. The buffer is taken as closed.",
        "Wrong:\n  OPEN PLC 1 CLEAR\n  P1=1\nRight:\n  OPEN PLC 1 CLEAR\n  P1=1\n  CLOSE",
    ),
    code(
        "PMAC-W2",
        "no PLC will run",
        "I5 says which PLCs run, and it is 0 until something sets it.",
        "  I5=2    ; PLC 1 to 31\n  I5=3    ; PLC0 and PLCC0 as well",
    ),
    code(
        "PMAC-W3",
        "on-line command in an open buffer",
        "A definition or another on-line command is between OPEN and CLOSE. It is executed when the download is loaded and does not become part of the program.",
        "Wrong:\n  OPEN PLC 1 CLEAR\n  M1->Y:$FFC2,8,1\nRight:\n  M1->Y:$FFC2,8,1\n  OPEN PLC 1 CLEAR",
    ),
    code(
        "PMAC-W4",
        "a COMMAND that will be refused",
        "The text of a COMMAND is not an on-line command. When the statement runs, its event carries ERR003 and nothing happens.",
        "Wrong:\n  CMD\"ENABLEPLC\"\nRight:\n  CMD\"ENABLE PLC 2\"",
    ),
    code(
        "PMAC-W5",
        "a constant that an I-variable does not take",
        "The I-variable has a range, and the constant is outside. That is not an error: the variable takes the value modulo its range.",
        "Wrong:\n  I8=256      ; is 0\nRight:\n  I8=255      ; plcc explain I8 has the range",
    ),
    code(
        "PMAC-W6",
        "`==` taken as `=`",
        "In motion programs M…==… waits for the next move. Interpreted PLCs of real controllers stored it too, so that their listings hold it; it is taken as `=`.",
        "Wrong:\n  M1==1\nRight:\n  M1=1",
    ),
    code(
        "PMAC-W7",
        "characters outside ASCII in a text",
        "A text in quotes holds characters that the controller does not have. They are passed on as they are.",
        "Wrong:\n  SEND\"prêt\"\nRight:\n  SEND\"pret\"",
    ),
    code(
        "PMAC-W8",
        "#define without a name",
        "No name follows #define, so it defines nothing.",
        "Wrong:\n  #define ; PUMP P1\nRight:\n  #define PUMP P1",
    ),
    code(
        "PMAC-W9",
        "value that the bits of an M-variable can't hold",
        "Lint value-out-of-range. The definition of the M-variable gives it fewer bits than the constant needs. Its low bits are stored.",
        "Wrong:\n  M1->Y:$FFC2,8,1\n  M1=2\nRight:\n  M1=1",
    ),
    code(
        "PMAC-W10",
        "condition that is always true or always false",
        "Lint constant-condition. The condition consists of constants.",
        "Wrong:\n  IF (1=2)\nRight:\n  IF (P1=2)",
    ),
    code(
        "PMAC-W11",
        "statement that no scan reaches",
        "Lint unreachable. It is after a WHILE that never ends.",
        "Wrong:\n  WHILE (1=1)\n    P1=P1+1\n  ENDWHILE\n  M1=1\nRight:\n  WHILE (P1<100)",
    ),
    code(
        "PMAC-W12",
        "M-variable that is defined nowhere",
        "Lint undefined-m-variable. A PLC names the M-variable, and the download has no definition of it. It is a number of 21 bits then, no input or output. The definition may be in another file of the machine.",
        "Wrong:\n  M1=1\nRight:\n  M1->Y:$FFC2,8,1\n  …\n  M1=1",
    ),
    code(
        "PMAC-W13",
        "sent in every scan",
        "Lint repeats-every-scan. The SEND, DISPLAY or COMMAND is in no IF and after no WHILE, and nothing disables the PLC, so it is executed hundreds of times a second.",
        "Wrong:\n  OPEN PLC 2 CLEAR\n  SEND\"READY\"\n  CLOSE\nRight:\n  SEND\"READY\"\n  DISABLE PLC 2",
    ),
    code(
        "PMAC-W14",
        "timer that two PLCs write",
        "Lint shared-timer. Each PLC that starts the timer changes how long the other one waits.",
        "Wrong: M90 started in PLC 2 and in PLC 3\nRight: M90 in PLC 2 and M91 in PLC 3",
    ),
    code(
        "PMAC-W15",
        "PLC that never runs",
        "Lint plc-never-runs. I5 says which PLCs run: 1 means PLC 0, 2 PLCs 1 to 31, 3 all. With the value that I5 has after the download, this PLC does not run.",
        "Wrong:\n  I5=1\n  OPEN PLC 2 CLEAR\nRight:\n  I5=2",
    ),
    code(
        "PMAC-W16",
        "COMMAND without a command",
        "Lint empty-command. There is nothing between the quotes.",
        "Wrong:\n  CMD\"\"\nRight:\n  CMD\"&1A\"",
    ),
    code(
        "PMAC-W17",
        "text beyond the display",
        "Lint position-beyond-display. The display has two rows of 40 characters, positions 0 to 79, and the text or value reaches further.",
        "Wrong:\n  DISP 75 \"READY NOW\"\nRight:\n  DISP 70 \"READY NOW\"",
    ),
    code(
        "PMAC-W18",
        "WHILE that waits for ever",
        "Lint endless-wait. Nothing in the download changes the variables of the condition, and no input does, so a PLC that enters the WHILE stays there until somebody sends a command.",
        "Wrong:\n  WHILE (P1=0)\n  ENDWHILE          ; nothing sets P1\nRight:\n  WHILE (M11=0)\n  ENDWHILE",
    ),
    code(
        "PMAC-W19",
        "two M-variables for one bit, both written",
        "Lint same-bit-twice. Two M-variables are defined as the same bit, and programs write both, so that the one that is written later in a scan decides. Often one of the definitions was copied and not changed.",
        "Wrong:\n  M1->Y:$C002,8\n  M2->Y:$C002,8     ; copied\n  M1=1 M2=0\nRight:\n  M2->Y:$C002,9",
    ),
    code(
        "PMAC-N1",
        "motion program skipped",
        "OPEN PROG, OPEN ROTARY and their kind hold motion programs. They are not PLC code and are skipped up to their CLOSE.",
        "There is nothing to fix.",
    ),
    code(
        "PMAC-N2",
        "names replaced inside a COMMAND",
        "Names defined with #define are not replaced inside quotes. As written, though, the text of this COMMAND is not a command, and with the names replaced it is one. So here they are replaced.",
        "There is nothing to fix. To make it plain, write the number:\n  #define LAMP M5\n  CMD\"LAMP=1\"    ; is taken as M5=1",
    ),
];
