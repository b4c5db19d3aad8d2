//! What is shown, what is typed, and what keys do.

use plcc_screen::Operator;
use ratatui::Frame;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::draw;
use super::keys::{self, Action};
use crate::session::{no_machine, no_terminal};
use crate::view::{Body, IoRow, PanelCell, Screen, View};
use crate::{Command, Format, Refusal, Reply, Session};

/// A screen of the terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Page {
    Statements,
    Variables,
    Io,
    Events,
    Tasks,
    Timing,
    Scope,
    Terminal,
    Panels,
    Machine,
    Directory,
    References,
    Why,
    Operator,
    Help,
}

/// The pages that have a number, from 1; the last one has 0.
pub(super) const PAGES: [(Page, &str); 10] = [
    (Page::Statements, "statmnt"),
    (Page::Variables, "var"),
    (Page::Io, "i/o"),
    (Page::Events, "faults"),
    (Page::Tasks, "tasks"),
    (Page::Timing, "time"),
    (Page::Scope, "scope"),
    (Page::Terminal, "terminal"),
    (Page::Panels, "panels"),
    (Page::Machine, "machine"),
];

/// A line that is being typed.
#[derive(Clone, Debug)]
pub(super) struct Prompt {
    pub(super) title: &'static str,
    pub(super) text: String,
    pub(super) action: Action,
}

/// The terminal's own state.
#[derive(Debug)]
pub(super) struct App {
    pub(super) page: Page,
    /// The page to which Esc goes back.
    back: Page,
    pub(super) prompt: Option<Prompt>,
    /// The message for the user, and whether it is a refusal.
    pub(super) message: Option<(String, bool)>,
    /// A warning that waits to be confirmed, and what is done then.
    pub(super) warning: Option<(String, Command)>,
    /// The selected row of lists, and of the two windows of inputs and outputs.
    pub(super) selected: usize,
    pub(super) window: usize,
    /// Which panel is shown, and how many of its cells stand side by side.
    pub(super) panel: usize,
    pub(super) columns: usize,
    /// Which key of the operator's screen is chosen.
    pub(super) operator: Operator,
    /// Which cursor of the scope the arrow keys move.
    pub(super) cursor: Option<u8>,
    /// How many cells a row of the screen has.
    pub(super) width: usize,
    /// What is being typed in the terminal.
    pub(super) line: String,
    pub(super) references: String,
    /// How many rows the list or text has on the screen.
    pub(super) height: usize,
    /// Whether the keys of the statements are those for choosing some of them.
    pub(super) chooses_statements: bool,
    /// Whether the control has a terminal.
    pub(super) has_terminal: bool,
    /// Whether a machine is simulated.
    pub(super) has_machine: bool,
    pub(super) is_left: bool,
}

impl App {
    pub(super) fn new(session: &Session<'_>) -> Self {
        let status = session.status();
        Self {
            page: if status.operator { Page::Operator } else { Page::Statements },
            back: if status.operator { Page::Operator } else { Page::Statements },
            prompt: None,
            message: None,
            warning: None,
            selected: 0,
            window: 0,
            panel: 0,
            columns: 1,
            operator: Operator::default(),
            cursor: None,
            width: 80,
            line: String::new(),
            references: String::new(),
            height: 10,
            chooses_statements: status.chooses_statements,
            has_terminal: status.has_terminal,
            has_machine: status.has_machine,
            is_left: false,
        }
    }

    /// The view of the page, for a screen of this size.
    fn view(&self, session: &mut Session<'_>, width: usize) -> View {
        session.view(&match self.page {
            Page::Statements => Screen::Statements { first: None, count: self.height.max(1) },
            Page::Variables => Screen::Variables,
            Page::Io => Screen::Io,
            Page::Events => Screen::Events,
            Page::Tasks => Screen::Tasks,
            Page::Timing => Screen::Timing,
            Page::Scope => Screen::Scope { samples: width.saturating_sub(2).max(1) },
            Page::Terminal => Screen::Terminal,
            Page::Panels => Screen::Panels,
            Page::Machine => Screen::Machine,
            Page::Directory => Screen::Directory,
            Page::References => Screen::References { name: self.references.clone() },
            Page::Why => Screen::Why,
            Page::Operator => Screen::Operator,
            Page::Help => Screen::Status,
        })
    }

    pub(super) fn draw(&mut self, session: &mut Session<'_>, frame: &mut Frame<'_>) {
        let area = frame.area();
        self.width = usize::from(area.width);
        self.height = usize::from(area.height).saturating_sub(draw::rows_around(self, area.width));
        let view = self.view(session, usize::from(area.width));
        self.chooses_statements = view.status.chooses_statements;
        self.has_terminal = view.status.has_terminal;
        self.has_machine = view.status.has_machine;
        draw::draw(self, &view, frame);
    }

    /// Takes a key.
    pub(super) fn key(&mut self, session: &mut Session<'_>, key: KeyEvent) {
        self.message = None;
        let is_control = key.modifiers.contains(KeyModifiers::CONTROL);
        if is_control && matches!(key.code, KeyCode::Char('c' | 'q')) {
            self.is_left = true;
            return;
        }
        if let Some((_, command)) = self.warning.clone() {
            self.warning = None;
            if matches!(key.code, KeyCode::Char('y' | 'Y')) {
                self.apply(session, Command::ConfirmWarning);
                self.apply(session, command);
            }
            return;
        }
        if self.prompt.is_some() {
            self.typed(session, key);
            return;
        }
        if self.page == Page::Operator {
            return self.operator_key(session, key.code);
        }
        if self.page == Page::Terminal && self.terminal_key(session, key) {
            return;
        }
        if self.own_key(session, key.code) {
            return;
        }
        self.general_key(session, key.code);
    }

    /// The keys of the page itself.
    fn own_key(&mut self, session: &mut Session<'_>, code: KeyCode) -> bool {
        let found = keys::keys(self.page, self.chooses_statements).iter().find(|key| match code {
            KeyCode::F(number) => key.function == number,
            KeyCode::Char(letter) => key.letter == letter,
            KeyCode::Insert => {
                matches!(key.action, Action::AskWatch) || matches!(key.action, Action::AskScope)
            }
            KeyCode::Delete => matches!(key.action, Action::Unwatch | Action::AskScopeRemove),
            KeyCode::Enter => {
                matches!(key.action, Action::Select | Action::PressCell | Action::WhyNext)
            }
            _ => false,
        });
        if let Some(key) = found {
            self.run(session, key.action);
        }
        found.is_some()
    }

    fn general_key(&mut self, session: &mut Session<'_>, code: KeyCode) {
        let lines = self.height.max(1) as i64;
        match code {
            KeyCode::Char('q') | KeyCode::F(10) => self.is_left = true,
            KeyCode::Char('?') | KeyCode::F(1) => self.go(Page::Help),
            KeyCode::Esc if self.page == Page::Scope && self.cursor.is_some() => self.cursor = None,
            KeyCode::Esc => self.go(self.back),
            KeyCode::Tab | KeyCode::BackTab => self.next_page(code == KeyCode::Tab),
            KeyCode::Char(digit @ '0'..='9') => {
                let number = digit.to_digit(10).map(|digit| (digit as usize + 9) % 10);
                let page = number.and_then(|number| PAGES.get(number));
                if let Some((page, _)) = page {
                    self.go(*page);
                }
            }
            KeyCode::Up => self.move_cursor(session, -1),
            KeyCode::Down => self.move_cursor(session, 1),
            KeyCode::PageUp => self.move_cursor(session, -lines),
            KeyCode::PageDown => self.move_cursor(session, lines),
            KeyCode::Home => self.move_cursor(session, i64::from(i32::MIN)),
            KeyCode::End => self.move_cursor(session, i64::from(i32::MAX)),
            KeyCode::Left => self.time(session, -1),
            KeyCode::Right => self.time(session, 1),
            KeyCode::Char('<') => self.time(session, -100),
            KeyCode::Char('>') => self.time(session, 100),
            KeyCode::Char('[') => self.apply(session, Command::MoveScans { by: -1 }),
            KeyCode::Char(']') => self.apply(session, Command::MoveScans { by: 1 }),
            KeyCode::Char(' ') => {
                let command = match session.status().following {
                    true => Command::Pause,
                    false => Command::Follow,
                };
                self.apply(session, command);
            }
            KeyCode::Char('g') => self.run(session, Action::AskTick),
            KeyCode::Char('c') => self.run(session, Action::AskPreviousChange),
            KeyCode::Char('y') => self.run(session, Action::AskWhy),
            KeyCode::Char('S') => self.run(session, Action::AskSpeed),
            _ => {}
        }
    }

    /// On the scope the chosen cursor moves, on panels the cursor by a cell, elsewhere the tick.
    fn time(&mut self, session: &mut Session<'_>, ticks: i64) {
        if self.has_cells() && ticks.abs() == 1 {
            // Drawing keeps it within the panel.
            self.selected = (self.selected as u64).saturating_add_signed(ticks) as usize;
            return;
        }
        match self.page {
            Page::Scope => self.move_on_scope(session, ticks),
            _ => self.apply(session, Command::MoveTicks { by: ticks }),
        }
    }

    /// Whether the page is a grid of cells, of which one is selected.
    fn has_cells(&self) -> bool {
        matches!(self.page, Page::Panels | Page::Machine)
    }

    /// The pages that a number key shows, with their numbers.
    pub(super) fn pages(&self) -> impl Iterator<Item = (usize, (Page, &'static str))> + use<> {
        let (has_terminal, has_machine) = (self.has_terminal, self.has_machine);
        let is_there = move |page: Page| match page {
            Page::Terminal => has_terminal,
            Page::Machine => has_machine,
            _ => true,
        };
        (1..).zip(PAGES).filter(move |(_, (page, _))| is_there(*page))
    }

    pub(super) fn go(&mut self, page: Page) {
        if page == Page::Terminal && !self.has_terminal {
            self.message = Some((no_terminal(), true));
            return;
        }
        if page == Page::Machine && !self.has_machine {
            self.message = Some((no_machine(), true));
            return;
        }
        let is_list =
            matches!(self.page, Page::Directory | Page::References | Page::Why | Page::Help);
        if !is_list {
            self.back = self.page;
        }
        if self.page != page {
            self.selected = 0;
        }
        self.page = page;
    }

    fn next_page(&mut self, forward: bool) {
        let pages: Vec<Page> = self.pages().map(|(_, (page, _))| page).collect();
        let at = pages.iter().position(|page| *page == self.page).unwrap_or(0);
        let step = if forward { 1 } else { pages.len().saturating_sub(1) };
        if let Some(page) = pages.get((at + step) % pages.len().max(1)) {
            self.go(*page);
        }
    }

    fn move_cursor(&mut self, session: &mut Session<'_>, by: i64) {
        if self.page == Page::Statements {
            return self.apply(session, Command::MoveCursor { by });
        }
        if self.page == Page::Scope {
            return self.scroll_scope(session, by);
        }
        let by = if self.has_cells() { by.saturating_mul(self.columns as i64) } else { by };
        // Drawing keeps it within the list.
        self.selected = (self.selected as u64).saturating_add_signed(by) as usize;
    }

    /// Applies a command, and shows its message or refusal.
    pub(super) fn apply(&mut self, session: &mut Session<'_>, command: Command) {
        match session.apply(command.clone()) {
            Ok(Reply { message, .. }) => {
                if let Some(message) = message {
                    self.message = Some((message, false));
                }
            }
            Err(Refusal { message, warning }) => {
                self.message = Some((message, true));
                if let Some(warning) = warning {
                    self.warning = Some((warning, command));
                }
            }
        }
    }

    pub(super) fn ask(&mut self, title: &'static str, text: String, action: Action) {
        self.prompt = Some(Prompt { title, text, action });
    }

    fn run(&mut self, session: &mut Session<'_>, action: Action) {
        let none = String::new;
        match action {
            Action::Quit => self.is_left = true,
            Action::Help => self.go(Page::Help),
            Action::Directory => self.go(Page::Directory),
            Action::NextStatement => self.apply(session, Command::NextStatement),
            Action::PreviousStatement => self.apply(session, Command::PreviousStatement),
            Action::FindNext => self.apply(session, Command::FindNext),
            Action::ClearStatements | Action::ClearSelection => {
                self.apply(session, Command::ClearStatements);
            }
            Action::ShowProgram => self.apply(session, Command::ShowProgram),
            Action::ModuleDown => self.apply(session, Command::Module { down: true }),
            Action::ModuleUp => self.apply(session, Command::Module { down: false }),
            Action::Condition => self.apply(session, Command::Condition),
            Action::ToggleValues => self.apply(session, Command::ToggleValues),
            Action::ClearWatch => self.apply(session, Command::ClearWatch),
            Action::NextFormat => self.next_format(session),
            Action::Unwatch => {
                if let Some(row) = self.watched(session) {
                    self.apply(session, Command::Unwatch { name: row.0 });
                }
            }
            Action::Force0 => self.force(session, "0"),
            Action::Force1 => self.force(session, "1"),
            Action::Release => {
                if let Some(row) = self.io_row(session) {
                    self.apply(session, Command::Release { name: row.name });
                }
            }
            Action::ReleaseAll => self.apply(session, Command::ReleaseAll),
            Action::OtherWindow => {
                self.window = 1 - self.window.min(1);
                self.selected = 0;
            }
            Action::NextPanel => self.choose_panel(1),
            Action::PreviousPanel => self.choose_panel(-1),
            Action::PressCell => self.press(session),
            Action::HoldCell => self.hold(session),
            Action::AskCell => self.ask("value", none(), action),
            Action::ZoomIn => self.zoom(session, 1, 2),
            Action::ZoomOut => self.zoom(session, 2, 1),
            Action::CursorA => self.choose_cursor(session, 0),
            Action::CursorB => self.choose_cursor(session, 1),
            Action::NextTrigger => self.apply(session, Command::ScopeNextTrigger),
            Action::Select => self.select(session),
            Action::AskName => self.ask("name", none(), action),
            Action::AskAll => self.ask("all occurrences of", none(), action),
            Action::AskReferences => self.ask("statement, label or variable", none(), action),
            Action::AskSearch => self.ask("search downwards", none(), action),
            Action::AskSearchUp => self.ask("search upwards", none(), action),
            Action::AskWatch => self.ask("variables", none(), action),
            Action::AskChange => {
                let name = self.watched(session).map_or_else(none, |row| format!("{}=", row.1));
                self.ask("NAME=VALUE", name, action);
            }
            Action::AskRollback => {
                self.ask("run the program before the last change again? yes or no", none(), action)
            }
            Action::AskList => self.ask("watch list", none(), action),
            Action::AskForce => self.ask("value", none(), action),
            Action::AskScope => self.ask("variables", none(), action),
            Action::AskScopeRemove => self.ask("variable", none(), action),
            Action::AskTrigger => {
                self.ask("expression [rising|falling|both] (empty: none)", none(), action);
            }
            Action::AskWidth => self.ask("ticks", none(), action),
            Action::AskExport => self.ask("file (.csv or .svg)", none(), action),
            Action::AskKeep => self.ask("keep as", none(), action),
            Action::AskOpen => self.ask("open", none(), action),
            Action::AskTick => self.ask("tick", none(), action),
            Action::AskWhy => self.ask_why(session),
            Action::WhyNext => self.why_next(session),
            Action::AskPreviousChange => self.ask("previous change of", none(), action),
            Action::AskSpeed => self.ask("speed", none(), action),
        }
    }

    fn next_format(&mut self, session: &mut Session<'_>) {
        let Some((name, _, format)) = self.watched(session) else { return };
        let format = match format {
            Format::Decimal => Format::Hexadecimal,
            Format::Hexadecimal => Format::Binary,
            Format::Binary => Format::Decimal,
        };
        self.apply(session, Command::SetFormat { name, format });
    }

    /// The selected row of the watch list: entry, variable and format.
    pub(super) fn watched(
        &mut self,
        session: &mut Session<'_>,
    ) -> Option<(String, String, Format)> {
        let Body::Variables(view) = session.view(&Screen::Variables).body else { return None };
        let row = view.rows.get(self.selected.min(view.rows.len().saturating_sub(1)))?;
        Some((row.entry.clone(), row.name.clone(), row.format))
    }

    pub(super) fn io_row(&mut self, session: &mut Session<'_>) -> Option<IoRow> {
        let Body::Io(view) = session.view(&Screen::Io).body else { return None };
        let window = view.windows.into_iter().nth(self.window)?;
        let last = window.rows.len().saturating_sub(1);
        window.rows.into_iter().nth(self.selected.min(last))
    }

    pub(super) fn force(&mut self, session: &mut Session<'_>, value: &str) {
        if let Some(row) = self.io_row(session) {
            self.apply(session, Command::Force { name: row.name, value: value.into() });
        }
    }

    /// The next or the previous panel; their number is that of the last view, so drawing takes the rest of it.
    fn choose_panel(&mut self, by: isize) {
        self.panel = self.panel.wrapping_add_signed(by);
        self.selected = 0;
    }

    /// The selected cell of the panel, or the selected key of the machine.
    pub(super) fn cell(&mut self, session: &mut Session<'_>) -> Option<PanelCell> {
        if self.page == Page::Machine {
            let Body::Machine(view) = session.view(&Screen::Machine).body else { return None };
            return view.keys.into_iter().nth(self.selected);
        }
        let Body::Panels(view) = session.view(&Screen::Panels).body else { return None };
        let count = view.panels.len();
        let panel = view.panels.into_iter().nth(self.panel % count.max(1))?;
        panel.cells.into_iter().nth(self.selected)
    }

    /// Presses or releases a push-button; of another cell asks for the value.
    fn press(&mut self, session: &mut Session<'_>) {
        let cell = self.cell(session).unwrap_or_default();
        match (cell.press(), cell.variable) {
            (Some((name, value)), _) => self.apply(session, Command::Change { name, value }),
            (None, Some(_)) => self.run(session, Action::AskCell),
            (None, None) => self.message = Some(("nothing can be set here".into(), true)),
        }
    }

    /// Holds a key, or lets it go.
    fn hold(&mut self, session: &mut Session<'_>) {
        let cell = self.cell(session).unwrap_or_default();
        match (cell.variable, cell.pressed) {
            (Some(name), Some(pressed)) => {
                let value = if pressed { "0" } else { "1" }.to_owned();
                self.apply(session, Command::Change { name, value });
            }
            _ => self.message = Some(("this key can't be held here".into(), true)),
        }
    }

    /// Shows the selected statement of the directory besides those that were selected before.
    fn select(&mut self, session: &mut Session<'_>) {
        if let Body::Directory(view) = session.view(&Screen::Directory).body
            && let Some(row) = view.rows.get(self.selected.min(view.rows.len().saturating_sub(1)))
        {
            // While the whole program is shown, the first selected statement replaces it.
            if view.rows.iter().all(|row| row.chosen) && view.rows.len() > 1 {
                self.apply(session, Command::ClearStatements);
            }
            self.apply(session, Command::ChooseStatements { rows: vec![row.row] });
        }
    }
}
