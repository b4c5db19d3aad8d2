//! Which keys do what on each screen. F-keys are those of the manuals (PMI 5.0 to 5.3, NCT 5); each has a
//! letter besides, for terminals without F-keys.

use super::app::Page;

/// What a key does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Action {
    Quit,
    Help,
    Directory,
    NextStatement,
    PreviousStatement,
    FindNext,
    ClearStatements,
    ShowProgram,
    ModuleDown,
    ModuleUp,
    Condition,
    ToggleValues,
    ClearWatch,
    NextFormat,
    Unwatch,
    Force0,
    Force1,
    Release,
    ReleaseAll,
    OtherWindow,
    NextPanel,
    PreviousPanel,
    PressCell,
    HoldCell,
    AskCell,
    ZoomIn,
    ZoomOut,
    CursorA,
    CursorB,
    NextTrigger,
    Select,
    ClearSelection,
    AskName,
    AskAll,
    AskReferences,
    AskSearch,
    AskSearchUp,
    AskWatch,
    AskChange,
    AskRollback,
    AskList,
    AskForce,
    AskScope,
    AskScopeRemove,
    AskTrigger,
    AskWidth,
    AskExport,
    AskKeep,
    AskOpen,
    AskTick,
    AskPreviousChange,
    AskSpeed,
    AskWhy,
    WhyNext,
}

/// A key of a screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Key {
    /// The number of the F-key; 0 for none.
    pub(super) function: u8,
    /// The letter that does the same.
    pub(super) letter: char,
    /// The label.
    pub(super) label: &'static str,
    pub(super) action: Action,
}

const fn key(function: u8, letter: char, label: &'static str, action: Action) -> Key {
    Key { function, letter, label, action }
}

/// The keys of PMI 5.1.
const CHOSEN_STATEMENTS: &[Key] = &[
    key(1, 'd', "directory", Action::Directory),
    key(2, 'n', "next stmt", Action::NextStatement),
    key(3, 'b', "prev stmt", Action::PreviousStatement),
    key(4, 'N', "name", Action::AskName),
    key(5, 'o', "next occr", Action::FindNext),
    key(6, 'a', "all occr", Action::AskAll),
    key(7, 'x', "clear", Action::ClearStatements),
    key(8, 'P', "program", Action::ShowProgram),
];

/// The keys of NCT 5.
const STATEMENTS: &[Key] = &[
    key(1, 'h', "HELP", Action::Help),
    key(3, 'm', "MODUL↓", Action::ModuleDown),
    key(4, 'M', "MODUL↑", Action::ModuleUp),
    key(5, 'C', "COND", Action::Condition),
    key(6, 's', "STAT", Action::AskReferences),
    key(8, '/', "SEAR↓", Action::AskSearch),
    key(0, '\\', "SEAR↑", Action::AskSearchUp),
    key(9, 'v', "VALUE", Action::ToggleValues),
    key(10, 'q', "QUIT", Action::Quit),
];

const VARIABLES: &[Key] = &[
    key(1, 'i', "display", Action::AskWatch),
    key(2, 'x', "clear", Action::ClearWatch),
    key(3, 'e', "change", Action::AskChange),
    key(4, 'f', "format", Action::NextFormat),
    key(5, 'l', "list", Action::AskList),
    key(6, 'u', "remove", Action::Unwatch),
    key(7, 'B', "rollback", Action::AskRollback),
];

const IO: &[Key] = &[
    // Not the digits: 1 is the key of a screen, and must not force anything by mistake.
    key(1, 'z', "ovrride=0", Action::Force0),
    key(2, 'o', "ovrride=1", Action::Force1),
    key(3, 'x', "clear", Action::Release),
    key(4, 'X', "clear all", Action::ReleaseAll),
    key(5, 'w', "in/output", Action::OtherWindow),
    key(6, 'e', "override=", Action::AskForce),
];

const SCOPE: &[Key] = &[
    key(1, 'i', "add", Action::AskScope),
    key(2, 'u', "remove", Action::AskScopeRemove),
    key(3, 't', "trigger", Action::AskTrigger),
    key(4, 'w', "width", Action::AskWidth),
    key(5, '+', "zoom in", Action::ZoomIn),
    key(6, '-', "zoom out", Action::ZoomOut),
    key(7, 'a', "cursor A", Action::CursorA),
    key(8, 'b', "cursor B", Action::CursorB),
    key(9, 'e', "export", Action::AskExport),
    key(0, 'n', "next trigger", Action::NextTrigger),
    key(0, 'k', "keep", Action::AskKeep),
    key(0, 'o', "open", Action::AskOpen),
];

const PANELS: &[Key] = &[
    key(1, 'p', "press", Action::PressCell),
    key(2, 'e', "set", Action::AskCell),
    key(5, 'w', "next panel", Action::NextPanel),
    key(6, 'W', "previous panel", Action::PreviousPanel),
];

const MACHINE: &[Key] = &[
    key(1, 'p', "press", Action::PressCell),
    key(2, 'e', "hold or let go", Action::HoldCell),
    key(3, 'n', "set a number", Action::AskCell),
];

const DIRECTORY: &[Key] =
    &[key(1, 's', "select", Action::Select), key(2, 'x', "clear", Action::ClearSelection)];

const WHY: &[Key] = &[key(1, 's', "why this", Action::WhyNext)];

/// The keys of a page.
pub(super) fn keys(page: Page, chooses_statements: bool) -> &'static [Key] {
    match page {
        Page::Statements if chooses_statements => CHOSEN_STATEMENTS,
        Page::Statements => STATEMENTS,
        Page::Variables => VARIABLES,
        Page::Io => IO,
        Page::Scope => SCOPE,
        Page::Panels => PANELS,
        Page::Machine => MACHINE,
        Page::Directory => DIRECTORY,
        Page::Why => WHY,
        _ => &[],
    }
}

/// What the terminal has in the place of keys.
pub(super) const LEAVE_TERMINAL: &str = "Enter sends the line  Esc, Tab, Shift-Tab: another screen";

/// The text of the help, a line each.
pub(super) const HELP: &[&str] = &[
    "1 statements  2 variables  3 inputs/outputs  4 faults and messages",
    "5 tasks  6 timing  7 scope  8 PMAC terminal  9 panels  0 machine  Tab: the next",
    "arrows up/down, PgUp/PgDn, Home/End   move the cursor",
    "arrows left/right                     a tick back or on",
    "< >                                   100 ticks back or on",
    "[ ]                                   the previous or next scan of the task",
    "g                                     go to a tick",
    "c                                     back to the previous change of a variable",
    "y                                     why a variable has its value",
    "space                                 stay at this tick, or follow the newest",
    "S                                     speed of a program (1: real time, 0: most)",
    "N a o  /                              name, all and next occurrence; search",
    "Insert, Delete                        add or remove a watched variable",
    "B (on screen 2)                       take the last online change back",
    "",
    "_underlined_ is true. A full stop before a line: this scan has not executed it.",
    "An override is shown in reverse and with an exclamation mark.",
    "* follows a value that has just changed.",
    "q, F10: leave    Esc: back    ?: this help",
];
