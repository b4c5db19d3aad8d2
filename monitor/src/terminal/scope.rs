//! The keys of the scope: cursors, zoom, and the stretch of time that is shown.

use super::app::App;
use crate::view::{Body, ScopeState, ScopeView, Screen};
use crate::{Command, Session};

impl App {
    fn scope(&self, session: &mut Session<'_>) -> Option<ScopeView> {
        match session.view(&Screen::Scope { samples: 40 }).body {
            Body::Scope(scope) => Some(scope),
            _ => None,
        }
    }

    /// Chooses a cursor, which the arrow keys move from now on; the one that is chosen already is taken away.
    pub(super) fn choose_cursor(&mut self, session: &mut Session<'_>, cursor: u8) {
        if self.cursor == Some(cursor) {
            self.cursor = None;
            return self.apply(session, Command::ScopeCursor { cursor, tick: None });
        }
        let Some(scope) = self.scope(session) else { return };
        self.cursor = Some(cursor);
        let is_seen = |tick: &u64| (scope.from..=scope.to).contains(tick);
        let old = scope.cursors.get(usize::from(cursor)).copied().flatten().filter(is_seen);
        let middle = scope.from + (scope.to - scope.from) / 2;
        let tick = old.unwrap_or_else(|| Some(scope.tick).filter(is_seen).unwrap_or(middle));
        self.apply(session, Command::ScopeCursor { cursor, tick: Some(tick) });
    }

    /// Moves the chosen cursor by a cell, or by ten; without one the tick that is shown.
    pub(super) fn move_on_scope(&mut self, session: &mut Session<'_>, ticks: i64) {
        let Some(cursor) = self.cursor else {
            return self.apply(session, Command::MoveTicks { by: ticks });
        };
        let Some(scope) = self.scope(session) else { return };
        let cells = self.width.max(1) as u64;
        let cell = ((scope.to - scope.from + 1) / cells).max(1) as i64;
        let by = if ticks.abs() > 1 { 10 * ticks.signum() } else { ticks };
        let now = scope.cursors.get(usize::from(cursor)).copied().flatten();
        let tick = now.unwrap_or(scope.tick).saturating_add_signed(by.saturating_mul(cell));
        let tick = Some(tick.clamp(scope.from, scope.to));
        self.apply(session, Command::ScopeCursor { cursor, tick });
    }

    /// Shows an earlier or a later stretch of time; half of it is seen before and after.
    pub(super) fn scroll_scope(&mut self, session: &mut Session<'_>, by: i64) {
        let Some(scope) = self.scope(session) else { return };
        let span = scope.to - scope.from;
        let by = ((span / 2).max(1) as i64).saturating_mul(by.signum());
        let first = session.status().first_tick;
        let from = scope.from.saturating_add_signed(by).max(first);
        self.apply(session, Command::ScopeRange { from, to: from.saturating_add(span) });
    }

    pub(super) fn zoom(&mut self, session: &mut Session<'_>, times: u64, part: u64) {
        let Some(scope) = self.scope(session) else { return };
        let width = scope.to - scope.from + 1;
        let new = (width * times / part).max(2);
        let chosen = self.cursor.and_then(|cursor| *scope.cursors.get(usize::from(cursor))?);
        let middle = chosen.unwrap_or(scope.from + width / 2);
        let from = middle.saturating_sub(new / 2);
        let command = match scope.state {
            ScopeState::Rolling => Command::ScopeWidth { ticks: new },
            _ => Command::ScopeRange { from, to: from + new - 1 },
        };
        self.apply(session, command);
    }
}
