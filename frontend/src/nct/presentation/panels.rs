//! The control's own screens as far as the program works with them (NCT 2.2, 2.3, 6.2, 6.5, 6.6): which screen is
//! displayed, messages, softkeys and the machine control board, functions, tables, constants.

use plcc_abi::nct::{NctControl, NctSettings};
use plcc_abi::number;

use crate::presentation::{Announced, Cell, PanelDraft, Shown};

/// The parameters MAGAZINE and PLC_TAB.
const MAGAZINE: u16 = 61;
const PLC_TABLE: u16 = 62;
/// Where the tool pot table begins in F.
const POTS: u32 = 500;
/// The last word of F.
const LAST_WORD: u32 = 998;
/// The most rows of a table that are shown.
const MAX_ROWS: u32 = 250;

/// The screen groups of RH027's low byte, with the screens of its high byte (NCT 6.6). In `NCT98` and `NCT99` the group
/// Operator's Panel comes before them.
const SCREENS: [&[&str]; 7] = [
    &["Absolt", "Relatv", "Machin", "End", "Overll", "Cartsn"],
    &["Text", "Functn", "Last", "Active", "Cntrl Pn", "Message"],
    &["Directory", "View", "Edit", "Block input"],
    &["Work offsts", "Tool offsts", "W. offs measur", "T. leng measur", "Rel. ps offsts"],
    &["Grphcs setting", "Draw"],
    &[
        "#1-#33",
        "#100-#199",
        "#500-#599",
        "Timer/countr",
        "Tool pot",
        "PLC table",
        "User's params",
        "Secrty",
    ],
    &[
        "Params",
        "PLC",
        "Test I/O",
        "Logic anal",
        "Test mes",
        "Scope",
        "Errors",
        "Monitor",
        "Version",
    ],
];

/// What the codes of a screen in RH027 mean.
fn screen_name(code: f64, has_panel: bool) -> String {
    let code = code as i64;
    let (group, screen) = (code & 0xFF, code >> 8 & 0xFF);
    let (group, screen) = (group as usize, screen as usize);
    let hexadecimal = format!("{code:04X}h");
    if has_panel && group == 1 {
        return format!("{hexadecimal} Oprtr's Panel");
    }
    let group = group.checked_sub(if has_panel { 2 } else { 1 });
    // NCT98 and NCT99 have no screen Cntrl Pn, so Message has its number there.
    let screen = match (has_panel, group, screen) {
        (true, Some(1), 5) => 6,
        (_, _, screen) => screen,
    };
    let names = group.and_then(|group| SCREENS.get(group));
    match names.and_then(|names| names.get(screen.checked_sub(1)?)) {
        Some(name) => format!("{hexadecimal} {name}"),
        None => hexadecimal,
    }
}

fn screen_of_nct99(code: f64) -> String {
    screen_name(code, true)
}

fn screen_of_nct2000(code: f64) -> String {
    screen_name(code, false)
}

fn hexadecimal(value: f64) -> String {
    format!("{:04X}h", value as i64 & 0xFFFF)
}

/// A tool pot: the tool's number in 14 bits, and the code of its width (NCT 2.3.2).
fn pot(value: f64) -> String {
    let word = value as i64 & 0xFFFF;
    let width = 2 * (word >> 14) + 1;
    format!("{} L{width}", word & 0x3FFF)
}

/// A program number of a group: 0 is blank (NCT 2.2.3).
fn blank(value: f64) -> String {
    if value == 0.0 { " ".into() } else { number(value) }
}

pub(super) fn panels(
    settings: &NctSettings,
    captions: &[String],
    info: &str,
    messages: &[Announced],
) -> Vec<PanelDraft> {
    let parameter = |number: u16| {
        let found = settings.parameters.iter().find(|(own, _)| *own == number);
        found.map_or(0, |(_, value)| u32::try_from(*value).unwrap_or(0)).min(MAX_ROWS)
    };
    let (pots, rows) = (parameter(MAGAZINE), parameter(PLC_TABLE));
    vec![
        screen(settings.control, messages),
        softkeys(captions),
        board(),
        functions(),
        pot_table(pots),
        plc_table(pots, rows),
        constants(),
        analog(),
        PanelDraft {
            title: "SERVICE PLC".into(),
            columns: 1,
            cells: info
                .lines()
                .map(|line| Cell { label: line.into(), ..Cell::default() })
                .chain([Cell {
                    label: "compiled by plcc".into(),
                    shown: Shown::Text(env!("CARGO_PKG_VERSION").into()),
                    ..Cell::default()
                }])
                .collect(),
            note: Some("the text of :200; an artifact has no date of its compilation".into()),
        },
    ]
}

/// Line 2 of every screen, and which one is displayed.
fn screen(control: NctControl, messages: &[Announced]) -> PanelDraft {
    let has_panel = matches!(control, NctControl::Nct98 | NctControl::Nct99);
    let name = if has_panel { screen_of_nct99 } else { screen_of_nct2000 };
    let mut cells = vec![
        Cell::formatted("screen RH027", "RH027", name),
        Cell::formatted("softkeys RH026", "RH026", hexadecimal),
        Cell::formatted("message RH020", "RH020", hexadecimal),
        Cell::light("a message is active (I537)", "I537"),
        Cell::light("INTD (I511)", "I511"),
    ];
    for message in messages {
        // The flag I70n says that the message of Y70n is the one in line 2.
        let flag = format!("I{}", message.name.trim_start_matches('Y'));
        cells.push(Cell::light(format!("{} {}", message.name, message.text), flag));
    }
    PanelDraft {
        title: "Screen and messages".into(),
        columns: 1,
        cells,
        note: Some("the lamp of a message says that it is the one in line 2 of the screens".into()),
    }
}

/// The flag of a push-button, I with a group's digits, and its lamp.
fn key(label: &str, group: u32, at: usize) -> Cell {
    Cell::button(label, format!("I{group:02}{at}"), Some(format!("Y{group:02}{at}")))
}

/// The softkeys of the action menus.
fn softkeys(captions: &[String]) -> PanelDraft {
    let mut cells = vec![];
    let mut group = |title: &str, live: &str, group: u32, labels: &[String]| {
        cells.push(Cell::light(title, live));
        for at in 0..8 {
            cells.push(match labels.get(at).filter(|label| !label.trim().is_empty()) {
                Some(label) => key(label.trim(), group, at),
                None => Cell::gap(),
            });
        }
    };
    let texts = |list: &[&str]| list.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>();
    let modes = ["REF", "HNDL", "INCR", "JOG", "-", "MDI", "AUTO", "EDIT"];
    let states = [
        "TEST",
        "MACHINE LOCK",
        "DRY RUN",
        "BLOCK RESTART",
        "BLOCK RETURN",
        "COND STOP",
        "COND BLOCK",
        "SINGLE BLOCK",
    ];
    let axes: Vec<String> = (1..=8).map(|axis| format!("axis {axis}")).collect();
    group("MODES", "Y520", 40, &texts(&modes));
    group("AXES", "Y521", 41, &axes);
    group("INCR", "Y522", 42, &texts(&["1", "10", "100", "1000"]));
    group("STATES", "Y523", 44, &texts(&states));
    group("MACHINE", "Y524", 50, captions);
    cells.extend([
        Cell::gap(),
        Cell::light("G- G+", "Y525"),
        Cell::number("R% RH039", "RH039"),
        Cell::light("S- S+", "Y526"),
        Cell::number("S% RH029", "RH029"),
        Cell::light("F- F+", "Y527"),
        Cell::number("F% RH028", "RH028"),
    ]);
    PanelDraft {
        title: "Operator's panel softkeys".into(),
        columns: 9,
        cells,
        note: Some("the lamp of the first cell of a row says that its softkeys are live".into()),
    }
}

/// The machine control boards 1 and 2.
fn board() -> PanelDraft {
    let mut cells = vec![Cell::light("board 1", "Y531"), Cell::light("board 2", "Y532")];
    cells.extend((0..8).map(|at| key(&format!("JOG {}", at + 1), 43, at)).map(|cell| {
        // The lamps of I43n are Y45n.
        let light = cell.button.as_ref().map(|name| name.replace("I43", "Y45"));
        Cell { light, ..cell }
    }));
    cells.push(key("rapid", 42, 7));
    for (label, at) in [("START", 0), ("STOP", 1), ("MST lock", 2), ("M3", 4), ("M4", 5), ("M5", 6)]
    {
        cells.push(key(label, 47, at));
    }
    cells.push(Cell::button("RESET", "I477".into(), None));
    cells.extend((0..8).map(|at| key(&format!("user {}", at + 1), 48, at)));
    cells.push(Cell::number("F% RH028", "RH028"));
    PanelDraft {
        title: "Machine control board".into(),
        columns: 4,
        cells,
        note: Some(
            "modes, increments and states are those of the softkeys; board 1 has JOG, rapid, M3 to M5, S%, F% and RESET alone"
                .into(),
        ),
    }
}

/// The screen FUNCTION.
fn functions() -> PanelDraft {
    let mut cells: Vec<Cell> = (0..8)
        .map(|group| {
            Cell::formatted(format!("M group {}", group + 1), format!("RH07{group}"), blank)
        })
        .collect();
    for (label, register) in [
        ("S", "RH060"),
        ("S current", "RH010"),
        ("S modified", "RH011"),
        ("rotation", "RH062"),
        ("range", "RH063"),
        ("T", "RH064"),
        ("A", "RH057"),
        ("B", "RH058"),
        ("C", "RH059"),
    ] {
        cells.push(Cell::number(label, register));
    }
    PanelDraft { title: "FUNCTION".into(), columns: 4, cells, note: None }
}

/// The tool pot table: row 0 is the spindle.
fn pot_table(pots: u32) -> PanelDraft {
    let row = |pot_number: u32| {
        let label = match pot_number {
            0 => "0 spindle".to_owned(),
            _ => pot_number.to_string(),
        };
        let word = (POTS + 2 * pot_number).min(LAST_WORD);
        Cell::formatted(label, format!("F{word:03}"), pot).editable()
    };
    let cells = if pots == 0 { vec![] } else { (0..=pots).map(row).collect() };
    PanelDraft {
        title: "Tool pot table".into(),
        columns: 4,
        cells,
        note: Some(
            "tool and width; the parameter MAGAZINE (61) says how many pots there are. A new value is the whole word: \
             the tool, and 0, 16384, 32768 or 49152 for L1, L3, L5, L7"
                .into(),
        ),
    }
}

/// The PLC table, behind the tool pot table.
fn plc_table(pots: u32, rows: u32) -> PanelDraft {
    let first = if pots == 0 { POTS } else { POTS + 2 * pots + 2 };
    let row = |row: u32| {
        let word = first + 2 * (row - 1);
        (word <= LAST_WORD).then(|| Cell::number(row.to_string(), format!("F{word:03}")).editable())
    };
    PanelDraft {
        title: "PLC table".into(),
        columns: 4,
        cells: (1..=rows).filter_map(row).collect(),
        note: Some("the parameter PLC_TAB (62) says how many rows there are".into()),
    }
}

/// The parameters CONST1 to CONST40. They are constants of the machine, so nothing sets them here.
fn constants() -> PanelDraft {
    let constant = |at: u32| Cell::number(format!("CONST{at:03}"), format!("RP{at:03}"));
    PanelDraft {
        title: "PLC constants".into(),
        columns: 4,
        cells: (1..=40).map(constant).collect(),
        note: Some(
            "they come from the machine file, [constants], when the program is built".into(),
        ),
    }
}

/// The analog inputs of the first interface board.
fn analog() -> PanelDraft {
    let cells = (1..=4).map(|at| Cell::number(format!("A{at}"), format!("RH03{}", at + 4)));
    PanelDraft { title: "Analog inputs".into(), columns: 4, cells: cells.collect(), note: None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn screens_are_named_as_in_6_6() {
        // "RH027=0104h, then screen DIRECTORY in case of NCT99, Work offsts in NCT2000".
        assert_eq!(screen_of_nct99(f64::from(0x0104)), "0104h Directory");
        assert_eq!(screen_of_nct2000(f64::from(0x0104)), "0104h Work offsts");
        assert_eq!(screen_of_nct2000(f64::from(0x0101)), "0101h Absolt");
        assert_eq!(screen_of_nct99(f64::from(0x0102)), "0102h Absolt");
        assert_eq!(screen_of_nct99(f64::from(0x0503)), "0503h Message");
        assert_eq!(screen_of_nct99(f64::from(0x0101)), "0101h Oprtr's Panel");
        assert_eq!(screen_of_nct2000(f64::from(0xFF09)), "FF09h");
        assert_eq!(pot(f64::from(0xC005)), "5 L7");
    }
}
