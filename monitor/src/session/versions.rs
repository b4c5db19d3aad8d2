//! Online changes: each tick is shown with the version of the program that ran it.

use super::Session;
use super::costs::Costs;
use super::machine::MachineState;
use super::statements::StatementState;
use crate::Refusal;
use crate::text::ProgramText;

impl Session<'_> {
    /// Goes over to the version of the program that ran a tick, if another one is shown.
    pub(super) fn enter_version_of(&mut self, tick: u64) -> Result<(), Refusal> {
        let Some(debugger) = &mut self.debugger else { return Ok(()) };
        debugger.enter_version_of(tick)?;
        self.show_version();
        Ok(())
    }

    /// Whether a tick was run by the version of the program that is shown.
    pub(super) fn is_of_version(&self, tick: u64) -> bool {
        let debugger = self.debugger.as_ref();
        debugger.is_none_or(|debugger| debugger.generation_of(tick) == self.generation)
    }

    /// Shows the version of the program to which the debugger has gone over: its text takes the place of that of the
    /// version before, and what was computed from that is forgotten.
    pub(super) fn show_version(&mut self) {
        let Some(debugger) = &self.debugger else { return };
        if debugger.generation() == self.generation {
            return;
        }
        self.generation = debugger.generation();
        let program = debugger.program();
        let number = self.cursor_row().and_then(|row| self.text.rows.get(row));
        let number = number.map(|row| row.number.clone());
        self.text = ProgramText::new(program);
        self.interpreter = Some(program.checked().statement_interpreter());
        self.placed = program.places().placed();
        (self.executive_tick, self.flow) = (None, None);
        self.traces.clear();
        self.costs = Costs::default();
        self.statements = StatementState::new(&self.text, self.store.statements());
        let row = self.text.rows.iter().position(|row| Some(&row.number) == number.as_ref());
        if let Some(row) = row {
            self.statements.go_to(row);
        }
        self.io.forget_points();
        self.scope.move_to(program);
        self.find_machine();
    }

    /// Looks the simulated machine up again.
    fn find_machine(&mut self) {
        let Some(debugger) = &mut self.debugger else { return };
        let names = debugger.history_mut().executive().names();
        self.machine = MachineState::new(&*names);
    }
}
