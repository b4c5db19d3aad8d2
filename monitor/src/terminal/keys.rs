//! Which keys do what on each screen. F-keys are those of the manuals (PMI 5.0 to 5.3, NCT 5); each has a
//! letter besides, for terminals without F-keys.

use super::app::{Page, Todo};

/// A key of a screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Key {
    /// The number of the F-key; 0 for none.
    pub(super) function: u8,
    /// The letter that does the same.
    pub(super) letter: char,
    /// The label.
    pub(super) label: &'static str,
    pub(super) todo: Todo,
}

const fn key(function: u8, letter: char, label: &'static str, todo: Todo) -> Key {
    Key { function, letter, label, todo }
}

const PMI_STATEMENTS: &[Key] = &[
    key(1, 'd', "directory", Todo::Directory),
    key(2, 'n', "next stmt", Todo::NextStatement),
    key(3, 'b', "prev stmt", Todo::PreviousStatement),
    key(4, 'N', "name", Todo::AskName),
    key(5, 'o', "next occr", Todo::FindNext),
    key(6, 'a', "all occr", Todo::AskAll),
    key(7, 'x', "clear", Todo::ClearStatements),
    key(8, 'P', "program", Todo::ShowProgram),
];

const OTHER_STATEMENTS: &[Key] = &[
    key(1, 'h', "HELP", Todo::Help),
    key(3, 'm', "MODUL↓", Todo::ModuleDown),
    key(4, 'M', "MODUL↑", Todo::ModuleUp),
    key(5, 'C', "COND", Todo::Condition),
    key(6, 's', "STAT", Todo::AskReferences),
    key(8, '/', "SEAR↓", Todo::AskSearch),
    key(0, '\\', "SEAR↑", Todo::AskSearchUp),
    key(9, 'v', "VALUE", Todo::ToggleValues),
    key(10, 'q', "QUIT", Todo::Quit),
];

const VARIABLES: &[Key] = &[
    key(1, 'i', "display", Todo::AskWatch),
    key(2, 'x', "clear", Todo::ClearWatch),
    key(3, 'e', "change", Todo::AskChange),
    key(4, 'f', "format", Todo::NextFormat),
    key(5, 'l', "list", Todo::AskList),
    key(6, 'u', "remove", Todo::Unwatch),
    key(7, 'B', "rollback", Todo::AskRollback),
];

const IO: &[Key] = &[
    // Not the digits: 1 is the key of a screen, and must not force anything by mistake.
    key(1, 'z', "ovrride=0", Todo::Force0),
    key(2, 'o', "ovrride=1", Todo::Force1),
    key(3, 'x', "clear", Todo::Release),
    key(4, 'X', "clear all", Todo::ReleaseAll),
    key(5, 'w', "in/output", Todo::OtherWindow),
    key(6, 'e', "override=", Todo::AskForce),
];

const SCOPE: &[Key] = &[
    key(1, 'i', "add", Todo::AskScope),
    key(2, 'u', "remove", Todo::AskScopeRemove),
    key(3, 't', "trigger", Todo::AskTrigger),
    key(4, 'w', "width", Todo::AskWidth),
    key(5, '+', "zoom in", Todo::ZoomIn),
    key(6, '-', "zoom out", Todo::ZoomOut),
    key(7, 'a', "cursor A", Todo::CursorA),
    key(8, 'b', "cursor B", Todo::CursorB),
    key(9, 'e', "export", Todo::AskExport),
    key(0, 'k', "keep", Todo::AskKeep),
    key(0, 'o', "open", Todo::AskOpen),
];

const PANELS: &[Key] = &[
    key(1, 'p', "press", Todo::PressCell),
    key(2, 'e', "set", Todo::AskCell),
    key(5, 'w', "next panel", Todo::NextPanel),
    key(6, 'W', "previous panel", Todo::PreviousPanel),
];

const DIRECTORY: &[Key] =
    &[key(1, 's', "select", Todo::Select), key(2, 'x', "clear", Todo::ClearSelection)];

/// The keys of a page.
pub(super) fn keys(page: Page, is_pmi: bool) -> &'static [Key] {
    match page {
        Page::Statements if is_pmi => PMI_STATEMENTS,
        Page::Statements => OTHER_STATEMENTS,
        Page::Variables => VARIABLES,
        Page::Io => IO,
        Page::Scope => SCOPE,
        Page::Panels => PANELS,
        Page::Directory => DIRECTORY,
        _ => &[],
    }
}

/// The text of the help, a line each.
pub(super) const HELP: &[&str] = &[
    "1 statements  2 variables  3 inputs/outputs  4 faults and messages",
    "5 tasks  6 timing  7 scope  8 PMAC terminal  9 panels    Tab: next screen",
    "",
    "arrows up/down, PgUp/PgDn, Home/End   move the cursor",
    "arrows left/right                     a tick back or on",
    "< >                                   100 ticks back or on",
    "[ ]                                   the previous or next scan of the task",
    "g                                     go to a tick",
    "c                                     back to the previous change of a variable",
    "space                                 stay at this tick, or follow the newest",
    "S                                     the speed of a program (1: real time, 0: as fast as possible)",
    "N a o  /                              name, all and next occurrence; search",
    "Insert, Delete                        add or remove a watched variable",
    "B (with the watched variables)        take the last change of a delay or constant back",
    "",
    "_underlined_ is true. A point before a line: this scan has not executed it.",
    "An override is shown in reverse and with an exclamation mark.",
    "q, F10: leave    Esc: back    ?: this help",
];
