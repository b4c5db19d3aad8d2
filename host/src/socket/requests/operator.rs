//! The operator's screen: what is on it, and its keys.

use super::{Continuation, RequestState, Requests, refused};
use crate::Peer;
use crate::journal::EntryKind;
use crate::socket::commands::{Batch, Command};
use crate::socket::panel::ServedPanel;
use plcc_protocol::{Assignment, Failure, OperatorScreen, Permission};

impl Requests {
    /// The operator's screen of the program that runs.
    ///
    /// # Errors
    /// When nobody knows it.
    fn panel(&self) -> Result<&ServedPanel, Failure> {
        self.current.panel.as_ref().ok_or_else(|| {
            refused(
                "the artifact has no operator's screen, since it was built before plcc put one into artifacts; build it again \
                 with plcc build",
            )
        })
    }

    /// Has the values of the operator's screen read.
    pub(super) fn operator(&mut self) -> Result<RequestState, Failure> {
        let batch = self.panel()?.batch(&self.current.program);
        self.ask(Command::Read(Box::new(batch)), Continuation::Operator)
    }

    /// The operator's screen with values that were read before a tick.
    pub(super) fn operator_screen(
        &self,
        batch: &Batch,
        ticks: u64,
    ) -> Result<OperatorScreen, Failure> {
        Ok(OperatorScreen {
            state: self.progress.state().name().to_owned(),
            ticks,
            dialect: self.current.program.dialect().name().to_owned(),
            program: self.current.title.clone(),
            may_press: Permission::Operate.is_in(&self.services.allow),
            forces: self.current.shown_forces().len(),
            view: self.panel()?.view(&self.current.program, batch),
        })
    }

    /// Presses a key of the operator's screen, or releases it.
    pub(super) fn press(
        &mut self,
        name: String,
        on: bool,
        by: &Peer,
    ) -> Result<RequestState, Failure> {
        if !self.panel()?.presses(&name) {
            return Err(refused(format!("`{name}` is not a key of the operator's screen")));
        }
        let value = if on { "1" } else { "0" };
        let items = self.current.items_to_write(&[Assignment::new(name.as_str(), value)])?;
        let entry = EntryKind::Write { name: name.clone(), value: value.into(), by: by.clone() };
        let batch = Box::new(Batch::new(items));
        let asked = self.ask(Command::Write(batch), Continuation::Set(vec![entry]))?;
        self.pressed.retain(|(pressed, _)| *pressed != name);
        if on {
            self.pressed.push((name, by.clone()));
        }
        Ok(asked)
    }

    /// Has a key released whose client has left, as if its finger had: nobody else would do it. `is_there` says whether a
    /// process is connected. It is true if an answer will come, for which nobody waits.
    pub(in crate::socket) fn release_key(&mut self, is_there: impl Fn(u32) -> bool) -> bool {
        let Some(at) = self.pressed.iter().position(|(_, by)| !is_there(by.pid)) else {
            return false;
        };
        if !self.takes_requests() || self.check_room().is_err() {
            return false;
        }
        let (name, by) = self.pressed.remove(at);
        // A program that has taken the place of the other one need not have the key.
        self.press(name, false, &by).is_ok()
    }
}
