//! Pages that are lists.

use plcc_protocol::{TaskSummary, TimesSummary};
use plcc_screen::{first_shown, fitted, word_rows};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::Line;
use ratatui::widgets::Paragraph;

use super::super::app::App;
use super::said::SaidColumns;
use crate::view::{
    Body, DirectoryRow, EventsView, IoRow, IoView, TaskState, TasksView, TimingView, VariableRow,
    VariablesView, WhyView,
};

const SELECTED: Style = Style::new().add_modifier(Modifier::REVERSED);
/// What is forced.
const FORCED: Style = Style::new().fg(Color::Red).add_modifier(Modifier::BOLD);
const STRONG: Style = Style::new().add_modifier(Modifier::BOLD);

/// Rows of a list with titles between them. Only rows can be selected.
#[derive(Default)]
struct List {
    rows: Vec<(String, bool, Style)>,
}

impl List {
    fn title(&mut self, text: impl Into<String>) {
        self.rows.push((text.into(), false, STRONG));
    }

    fn text(&mut self, text: impl Into<String>) {
        self.rows.push((text.into(), false, Style::new()));
    }

    fn row(&mut self, text: impl Into<String>, style: Style) {
        self.rows.push((text.into(), true, style));
    }

    /// Draws the list so that the selected row is in sight; if `selected` is beyond the last row, the
    /// last one is selected.
    fn draw(self, selected: &mut usize, frame: &mut Frame<'_>, area: Rect) {
        let rows: Vec<usize> =
            (0..self.rows.len()).filter(|&at| self.rows.get(at).is_some_and(|row| row.1)).collect();
        *selected = (*selected).min(rows.len().saturating_sub(1));
        let at = rows.get(*selected).copied();
        let height = usize::from(area.height);
        let first = first_shown(at.unwrap_or(0), self.rows.len(), height);
        let width = usize::from(area.width);
        let lines = self.rows.into_iter().enumerate().skip(first).take(height);
        let lines = lines.map(|(number, (text, is_row, style))| {
            let is_selected = Some(number) == at;
            let mark = match (is_row, is_selected) {
                (true, true) => ">",
                (true, false) => " ",
                (false, _) => "",
            };
            let text = fitted(&format!("{mark}{text}"), width);
            Line::styled(text, if is_selected { style.patch(SELECTED) } else { style })
        });
        frame.render_widget(Paragraph::new(lines.collect::<Vec<_>>()), area);
    }
}

pub(super) fn draw(app: &mut App, body: &Body, frame: &mut Frame<'_>, area: Rect) {
    let mut list = List::default();
    match body {
        Body::Variables(view) => variables(view, &mut list, usize::from(area.width)),
        Body::Io(view) => return draw_io(app, view, frame, area),
        Body::Events(view) => events(view, &mut list),
        Body::Tasks(view) => tasks(view, &mut list),
        Body::Timing(view) => timing(view, &mut list),
        Body::Directory(view) => {
            list.title("directory: F1 or Enter selects a statement, Esc shows what is selected");
            for row in &view.rows {
                list.row(directory_row(row), Style::new());
            }
        }
        Body::References(view) => {
            let meaning = view.meaning.clone().unwrap_or_default();
            list.title(format!("{} {meaning}", view.name));
            let kinds = [
                ("written", &view.written),
                ("read", &view.read),
                ("tested", &view.tested),
                ("other", &view.others),
            ];
            for (title, rows) in kinds.into_iter().filter(|(_, rows)| !rows.is_empty()) {
                list.title(title);
                for row in rows {
                    list.row(format!("{:>6}  {}", row.number, row.name), Style::new());
                }
            }
        }
        Body::Why(view) => why(view, &mut list, usize::from(area.width)),
        Body::Terminal(view) => {
            for line in &view.lines {
                let mark = if line.typed { "> " } else { "" };
                list.text(format!("{mark}{}", line.text));
            }
            list.row(format!(" {}_", app.line), Style::new());
        }
        Body::Status { .. }
        | Body::Statements(_)
        | Body::Scope(_)
        | Body::Panels(_)
        | Body::Machine(_)
        | Body::Operator(_) => {}
    }
    list.draw(&mut app.selected, frame, area);
}

fn directory_row(row: &DirectoryRow) -> String {
    let mark = if row.chosen { '*' } else { ' ' };
    format!("{mark}{:>6}  {}", row.number, row.name)
}

/// The lines of an answer; what is too long for a row goes on in the next one.
fn why(view: &WhyView, list: &mut List, width: usize) {
    for line in &view.lines {
        let mut rows = word_rows(&line.text(), width.saturating_sub(1)).into_iter();
        let is_forced = line.pieces.iter().any(|piece| piece.kind == "forced");
        let style = if is_forced { FORCED } else { Style::new() };
        let first = rows.next().unwrap_or_default();
        match line.name {
            Some(_) => list.row(first, style),
            None => list.rows.push((first, false, style)),
        }
        rows.for_each(|row| list.rows.push((format!("      {row}"), false, style)));
    }
}

/// How many cells a row of the watch list has before what is said of the variable: mark, name, value, whether it has changed or is
/// forced.
const BEFORE_SAID: usize = 1 + 16 + 1 + 20 + 2;

fn variables(view: &VariablesView, list: &mut List, width: usize) {
    list.title(format!(
        "watch list {} ({}), values of {}",
        view.list,
        view.lists.join(", "),
        view.moment
    ));
    if view.rows.is_empty() {
        list.text("no variable is watched: F1, i or Insert adds some");
    }
    // What a row is within its entry has a column of its own in front of what the machine file says.
    let title_of = |row: &VariableRow| row.title.clone().unwrap_or_default();
    let titles = view.rows.iter().map(|row| title_of(row).chars().count()).max().unwrap_or(0);
    let room = width.saturating_sub(BEFORE_SAID + titles);
    let columns = SaidColumns::new(view.rows.iter().map(|row| &row.said), room);
    let titles = if columns.width() > 0 { titles } else { 0 };
    if columns.width() > 0 {
        let gap = BEFORE_SAID + titles + usize::from(titles > 0);
        list.title(format!("{:gap$}{}", "", columns.titles()));
    }
    for row in &view.rows {
        let value = row.value.as_deref().unwrap_or("?");
        let forced = if row.forced { '!' } else { ' ' };
        let changed = if row.changed { '*' } else { ' ' };
        let style = if row.forced { FORCED.patch(SELECTED) } else { Style::new() };
        let title = title_of(row);
        let gap = if titles > 0 || !title.is_empty() { " " } else { "" };
        let said = columns.row(&row.said);
        let value = format!("{:<16} {value:>20}{changed}{forced}", row.name);
        list.row(format!("{value}{gap}{title:titles$}{said}"), style);
    }
}

/// The two windows of PMI 5.3, side by side.
fn draw_io(app: &mut App, view: &IoView, frame: &mut Frame<'_>, area: Rect) {
    let mut area = area;
    if let Some(moment) = &view.moment {
        let text = fitted(&format!("values of {moment}"), usize::from(area.width));
        frame.render_widget(Paragraph::new(text), Rect { height: 1, ..area });
        (area.y, area.height) = (area.y + 1, area.height.saturating_sub(1));
    }
    let half = area.width / 2;
    let places = [
        Rect { width: half.saturating_sub(1), ..area },
        Rect { x: area.x + half, width: area.width - half, ..area },
    ];
    for (number, (window, place)) in view.windows.iter().zip(places).enumerate() {
        let mut list = List::default();
        let width = usize::from(place.width);
        let longest = |of: &dyn Fn(&IoRow) -> usize| window.rows.iter().map(of).max().unwrap_or(0);
        let before = longest(&|row| io_value(row).chars().count());
        let after = longest(&|row| row.place.chars().count());
        let room = width.saturating_sub(before + after + 3);
        let columns = SaidColumns::new(window.rows.iter().map(|row| &row.said), room);
        let title = format!("{:<10} value/line", window.title);
        list.title(match columns.width() {
            0 => title,
            // The columns begin where the values end.
            _ => {
                let title = if title.len() > before { window.title.as_str() } else { &title };
                format!("{}{}", fitted(title, before + 1), columns.titles())
            }
        });
        for row in &window.rows {
            let style = if row.forced.is_some() { FORCED.patch(SELECTED) } else { Style::new() };
            let left = format!("{:before$}{}", io_value(row), columns.row(&row.said));
            let room = width.saturating_sub(row.place.chars().count() + 3);
            list.row(format!("{} {}", fitted(&left, room), row.place), style);
        }
        if number == app.window {
            list.draw(&mut app.selected, frame, place);
        } else {
            // The window without the cursor shows its beginning.
            for row in &mut list.rows {
                row.1 = false;
            }
            list.draw(&mut 0, frame, place);
        }
    }
}

/// An input or output with its value, and the one to which it is forced.
fn io_value(row: &IoRow) -> String {
    let lines = row.physical.as_deref().map(|lines| format!("/{lines}")).unwrap_or_default();
    let forced = row.forced.as_deref().map(|value| format!(" !{value}!")).unwrap_or_default();
    let changed = if row.changed { "*" } else { "" };
    format!("{:<8} {}{lines}{changed}{forced}", row.name, row.logical)
}

fn events(view: &EventsView, list: &mut List) {
    list.title(format!("active: {}", view.active.len()));
    for one in &view.active {
        let since = one.since.map(|tick| format!(" since tick {tick}")).unwrap_or_default();
        list.row(format!("{:<8} {}{since}", one.name, one.text), STRONG);
    }
    if !view.display.is_empty() {
        list.title("display");
        view.display.iter().for_each(|line| list.text(format!("|{line}|")));
    }
    list.title("log, the newest first");
    for event in view.log.iter().rev() {
        let time = event.time.as_ref().map(|time| format!("{time}  ")).unwrap_or_default();
        list.row(format!("{:>8}  {time}{}", event.tick, event.text), Style::new());
    }
}

fn tasks(view: &TasksView, list: &mut List) {
    list.title(format!(
        "{:<10} {:<9} {:>9} {:>6} {:>8}  place",
        "task", "state", "scans/s", "stmts", "tick"
    ));
    for row in &view.rows {
        let state = match row.state {
            TaskState::Running => "running",
            TaskState::Waiting => "waiting",
            TaskState::Paused => "paused",
            TaskState::Disabled => "disabled",
            TaskState::Empty => "empty",
            TaskState::Idle => "idle",
        };
        let tick = row.tick.map_or_else(|| "-".into(), |tick| tick.to_string());
        let place = row.place.as_deref().unwrap_or_default();
        list.row(
            format!(
                "{:<9} {state:<9} {:>9.1} {:>6} {tick:>8}  {place}",
                row.name, row.scans_per_second, row.statements
            ),
            Style::new(),
        );
    }
    for fact in &view.facts {
        list.text(format!("{:<14} {}", fact.title, fact.value));
    }
}

fn timing(view: &TimingView, list: &mut List) {
    if !view.times.is_empty() {
        list.title(format!(
            "{:<10} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9}",
            "us", "count", "last", "mean", "p50", "p99", "max"
        ));
    }
    for TaskSummary { name, times } in &view.times {
        let TimesSummary { count, last_us, mean_us, p50_us, p99_us, p999_us: _, max_us } = times;
        list.text(format!(
            "{name:<10} {count:>9} {last_us:>9.1} {mean_us:>9.1} {p50_us:>9.1} {p99_us:>9.1} {max_us:>9.1}"
        ));
    }
    if let (Some(overruns), Some(skipped)) = (view.overruns, view.skipped) {
        list.text(format!("overruns {overruns}, ticks skipped {skipped}"));
    }
    list.title(format!(
        "time of the statement interpreter (not of the control), {} ticks",
        view.ticks
    ));
    if view.ticks < view.enough {
        list.text(format!("lines are shown as soon as {} ticks were run again", view.enough));
    }
    for line in &view.lines {
        let percent = line.share * 100.0;
        list.row(
            format!(
                "{percent:>5.1} % {:>8.0} ns {:>7}x {:>6} {}",
                line.nanoseconds, line.executions, line.number, line.text
            ),
            Style::new(),
        );
    }
    if !view.recorded_overruns.is_empty() {
        list.title("overruns in the record, the newest first");
    }
    for one in view.recorded_overruns.iter().rev() {
        let statements = match one.statements {
            Some(count) => format!("{count} statements before it, {:.0} as a rule", one.usual),
            None => "a scan was stopped".to_owned(),
        };
        let line = one.line.as_deref().map(|line| format!(", most often {line}"));
        list.row(
            format!(
                "tick {}: {} skipped, {statements}{}",
                one.tick,
                one.skipped,
                line.unwrap_or_default()
            ),
            Style::new(),
        );
    }
}
