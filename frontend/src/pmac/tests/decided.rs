//! What the rulings decided where the guide is silent, and what real files showed.

use super::{codes, codes_for, plc};
use crate::common::{Controller, MemoryLoader, Options};
use crate::pmac::{Program, check};

/// A program for a PMAC, and what is wrong with it.
fn checked(text: &str) -> (Option<Program>, Vec<plcc_diag::Diagnostic>) {
    let mut map = plcc_diag::SourceMap::new();
    let file = map.add("m.pmc", text.as_bytes());
    check(&mut map, &[file], &MemoryLoader::new(), &Options::default())
}

#[test]
fn double_equals_after_an_m_variable_is_taken_as_equals_in_a_plc() {
    assert_eq!(plc("M1==1"), [("PMAC-W6", 2)]);
    assert_eq!(plc("M(P1)==P2+1 M1=1"), [("PMAC-W6", 2)]);
    assert_eq!(plc("P1==1"), [("PMAC-3", 2)]);
    assert_eq!(codes("I5=2\nOPEN PLCC 1 CLEAR\nM1==1\nCLOSE\n"), [("PMAC-3", 3)]);
    assert_eq!(codes("I5=2\nM1==1\n"), [("PMAC-3", 2)]);
    assert_eq!(plc("CMD\"M1==1\""), [("PMAC-W4", 2)]);
}

#[test]
fn assignments_to_lists_of_variables_in_buffers_are_for_pmac_only() {
    let turbo = |text: &str| {
        let found = codes_for(text, Controller::Turbo);
        found.into_iter().map(|(code, line, _)| (code, line)).collect::<Vec<_>>()
    };
    assert_eq!(plc("P101..108=0 I5,2,1=3"), []);
    let text = "I5=2 P1..4=0\nOPEN PLC 1 CLEAR\nP101..108=0\nM1,2,3=1 CMD\"P1..5=1\"\nCLOSE\n";
    assert_eq!(turbo(text), [("PMAC-3", 3), ("PMAC-3", 4)]);
}

#[test]
fn an_open_buffer_is_reported_and_nothing_is_dropped() {
    let text = "I5=2\nOPEN PROG 1 CLEAR X10\nOPEN PLC 2 CLEAR P1=1 CLOSE\n";
    assert_eq!(codes(text), [("PMAC-7", 3)]);
    let text = "I5=2\nOPEN PROG 1 CLEAR X10 CMD\"OPEN PLC 1\" OPENING=1\nOPEN PROG 2 Y20\nCLOSE\n\
                OPEN PLC 1 P1=+1 CLOSE\n";
    assert_eq!(codes(text), [("PMAC-W19", 2), ("PMAC-7", 3), ("PMAC-3", 5)]);
}

#[test]
fn l_variables_are_parts_of_words_wherever_they_are_defined() {
    assert_eq!(codes("I5=2\nL1->D:$100\n"), [("PMAC-3", 2)]);
    let text = "I5=2\nOPEN PLCC 1 CLEAR\nL1->D:$100\nL2->X:$100,0,8\nL2=5\nCLOSE\n";
    assert_eq!(codes(text), [("PMAC-3", 3), ("PMAC-W3", 4)]);
}

#[test]
fn a_refused_open_takes_its_buffer_with_it() {
    let body = "P1=+1\nFOO=1\nIF (P1)\nCLOSE\nP2=+2\n";
    for open in ["OPEN PLC 32", "OPEN PLC PUMPS CLEAR", "OPEN PROG MOVES", "OPEN FOO"] {
        let text = format!("I5=2\n{open}\n{body}");
        assert_eq!(codes(&text), [("PMAC-3", 2), ("PMAC-3", 7)], "{open}");
    }
    // It ends at the next OPEN too.
    let text = "I5=2\nOPEN PLC PUMPS\nP1=+1\nOPEN PLC 2 CLEAR\nP1=+1\nCLOSE\n";
    assert_eq!(codes(text), [("PMAC-3", 2), ("PMAC-3", 5)]);
    for open in ["OPEN PROG 5", "OPEN PROG5CLEAR"] {
        assert_eq!(codes(&format!("{open}\nX10\nCLOSE\n")), [], "{open}");
    }
    for open in ["OPEN PROG CLEAR", "OPEN ROTARY", "OPEN PROG"] {
        assert_eq!(codes(&format!("{open}\nX10\nCLOSE\n")), [("PMAC-N1", 1)], "{open}");
    }
}

#[test]
fn macro_names_in_a_command_are_replaced_if_it_is_no_command_without() {
    let text = "#define LAMP M5\n#define A P7=1\nI5=2\nOPEN PLC 1 CLEAR\nCMD\"LAMP=1\"\nCMD\"A\"\n\
                CMD\"LAMPS=1\"\nCMD\"LAMP=+1\"\nCLOSE\n";
    assert_eq!(codes(text), [("PMAC-N2", 5), ("PMAC-W4", 7), ("PMAC-W4", 8)]);
    let (program, _) = checked(text);
    let texts = program.unwrap().download.texts;
    let commands: Vec<_> = texts
        .iter()
        .filter_map(|text| match text {
            plcc_abi::pmac::Text::Command { text, steps, .. } => {
                Some((text.as_str(), steps.as_slice()))
            }
            _ => None,
        })
        .collect();
    use plcc_abi::pmac::CommandStep::{Motion, Task};
    let expected: [(&str, &[_]); 4] =
        [("M5=1", &[Task(0)]), ("A", &[Motion(0)]), ("LAMPS=1", &[]), ("LAMP=+1", &[])];
    assert_eq!(commands, expected);
}

#[test]
fn pause_and_resume_are_for_plcs() {
    for line in ["PAUSE PLCC 1", "RES PLCC 3"] {
        assert_eq!(plc(line), [("PMAC-3", 2)], "{line}");
        assert_eq!(codes(&format!("I5=2\n{line}\n")), [("PMAC-3", 2)], "{line}");
    }
    assert_eq!(plc("DIS PLCC 3 ENA PLCC 3 PAU PLC 1 RES PLC 1 CMD\"PAUSE PLC 1\""), []);
}

#[test]
fn what_the_controller_does_not_have_is_a_warning_or_an_error() {
    assert_eq!(plc("SEND\"prêt\""), [("PMAC-W7", 2)]);
    assert_eq!(plc("DISP 1 \"µm\" CMD\"#1K\""), [("PMAC-W7", 2)]);
    assert_eq!(
        codes("#define ; nothing\nI5=2\n#define \"x\" 1\n"),
        [("PMAC-W8", 1), ("PMAC-W8", 3)]
    );
    for line in ["<", ">", "!", "{", "}", "M1->Y:$FFC2,8,S", "P1=1>2", "DELETE PLCC 32"] {
        assert_eq!(codes(&format!("I5=2\n{line}\n")), [("PMAC-3", 2)], "{line}");
    }
    assert_eq!(codes("I5=2\nCLEAR\n"), [("PMAC-5", 2)]);
    assert_eq!(codes("I5=2\nOPEN PLC 1\nCLEAR CLOSE\nDELETE PLCC 31\n"), []);
    let text = "I5=2 L1->Y:$FFC2,8\nOPEN PLCC 1 CLEAR\nL1&=1\nCLOSE\n";
    assert_eq!(codes(text), [("PMAC-3", 3)]);
}

#[test]
fn motion_commands_in_a_command_text_get_no_warning() {
    assert_eq!(plc("CMD\"&1MOVETIME\" CMD\"&1!X10Y20\" CMD\"!X-1.5Y(P1)\""), []);
    assert_eq!(plc("CMD\"&1!\""), [("PMAC-W4", 2)]);
}

#[test]
fn a_control_character_of_a_command_stands_without_quotes() {
    assert_eq!(plc("CMD^D COMMAND ^a, CMD^K"), []);
    for text in ["^D", " ^D", "P1=1 ^D", "^", "^DD"] {
        assert_eq!(plc(&format!("CMD\"{text}\"")), [("PMAC-W4", 2)], "{text}");
    }
    let (program, _) = checked("I5=2\nOPEN PLC 1 CLEAR\nCMD^D\nCMD\"^D\"\nCLOSE\n");
    let texts = program.unwrap().download.texts;
    let acts = texts.iter().map(|text| match text {
        plcc_abi::pmac::Text::Command { text, error, steps } => {
            (text.as_str(), error.as_deref(), !steps.is_empty())
        }
        other => panic!("{other:?}"),
    });
    assert_eq!(acts.collect::<Vec<_>>(), [("^D", None, true), ("^D", Some("ERR003"), false)]);
}

#[test]
fn no_field_reaches_beyond_the_word() {
    for field in ["24", "24,S", "24,0", "0,24", "20,4,S", "23,1", "23"] {
        assert_eq!(codes(&format!("M4->Y:$FFC2,{field}\n")), [], "{field}");
    }
    for field in ["24,1", "24,24", "24,1,S", "23,2", "20,8", "25", "0,25"] {
        assert_eq!(codes(&format!("M4->Y:$FFC2,{field}\n")), [("PMAC-3", 1)], "{field}");
    }
}

#[test]
fn a_constant_with_a_written_point_is_no_integer_constant() {
    let text =
        "I5=2 L1->Y:$FFC2,8,8\nOPEN PLCC 1 CLEAR\nL1=7/2.0\nL1=7/2\nIF (L1=1.)\nENDI\nL1=2\nCLOSE";
    let (program, found) = checked(text);
    let download = program.unwrap_or_else(|| panic!("{found:?}")).download;
    let integer: Vec<bool> = download.plccs[1].code.iter().map(|stmt| stmt.integer).collect();
    assert_eq!(integer, [false, true, false, true]);
}

#[test]
fn the_format_of_a_single_bit_is_ignored() {
    let text = "M1->Y:$FFC2,8,1,S\nM2->Y:$FFC2,8,1,C\nM3->X:$FFC2,8,2,S\nL1->Y:$FFC2,8,1,D\n";
    let (program, found) = checked(text);
    let program = program.unwrap_or_else(|| panic!("{found:?}"));
    let formats = program.download.l_defs.values().chain(
        program.download.online.iter().filter_map(|online| match &online.action {
            crate::pmac::ast::Action::Define(_, _, definition) => Some(definition),
            _ => None,
        }),
    );
    let formats: Vec<_> = formats
        .map(|definition| match definition {
            plcc_abi::pmac::Definition::X { field, .. }
            | plcc_abi::pmac::Definition::Y { field, .. } => field.format,
            other => panic!("{other:?}"),
        })
        .collect();
    use plcc_abi::pmac::Format::{S, U};
    assert_eq!(formats, [U, U, U, S]);
}
