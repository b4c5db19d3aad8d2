//! Why a variable has its value, at the tick that is shown.

use plcc_protocol::Status;
use plcc_replay::forced_by;
use plcc_why::{Explanation, PieceKind, Question, explain};

use super::Session;
use crate::view::{WhyLine, WhyPiece, WhyView};
use crate::{Refusal, Reply};

impl Session<'_> {
    pub(super) fn why_view(&self) -> Result<WhyView, Refusal> {
        let nothing = || Refusal::new("nothing was asked yet: choose a variable, and press y");
        self.why.clone().ok_or_else(nothing)
    }

    /// Finds out why a variable has its value at a tick, which is shown from now on; without one at the tick that is shown.
    pub(super) fn ask_why(&mut self, name: &str, tick: Option<u64>) -> Result<Reply, Refusal> {
        if self.debugger.is_none() {
            self.why = Some(self.value_alone(name.trim())?);
            return Ok(Reply::default());
        }
        let is_newest = self.time.following && tick.is_none();
        let looks_back = tick.is_none();
        self.go_to_tick(tick.unwrap_or(self.time.shown))?;
        self.enter_version_of(self.time.shown)?;
        self.executive_tick = None;
        let tick = self.time.shown;
        let (program, history) = self.debugger()?.program_and_history();
        let question = Question { looks_back, ..Question::new(name.trim(), tick) };
        let mut explanation = explain(program, history, &question)?;
        if is_newest && let Some(status) = self.link.as_ref().and_then(|link| link.status()) {
            explanation.note_forces(&|name| forced_by(status, name));
        }
        self.why = Some(view(&explanation));
        let (name, tick) = (&explanation.name, explanation.tick);
        Ok(Reply::message(format!("{name} at the end of tick {tick}")))
    }

    /// What a control tells of a variable without a record: its value now, and who forces it.
    fn value_alone(&mut self, name: &str) -> Result<WhyView, Refusal> {
        let moment = self.read(&[name.to_owned()])?;
        let Some(value) = moment.values.get(name) else { return Err(self.unknown(name)) };
        let piece = |kind: &str, text: String| WhyPiece { text, kind: kind.into() };
        let mut pieces = vec![
            piece("name", name.into()),
            piece("plain", " is ".into()),
            piece("value", plcc_runtime::value::number(*value)),
            piece("plain", format!(" ({})", moment.text)),
        ];
        let status = self.link.as_ref().and_then(|link| link.status());
        if let Some(text) = status.and_then(|status| forced(status, name)) {
            pieces.push(piece("forced", format!("   {text}")));
        }
        let hint = "what holds it is in the program: start the monitor with --record";
        let hint = WhyLine { pieces: vec![piece("plain", hint.into())], name: None, tick: None };
        let line = WhyLine { pieces, name: None, tick: None };
        Ok(WhyView { name: name.into(), tick: None, lines: vec![line, hint] })
    }
}

/// That a variable is forced, and by whom.
fn forced(status: &Status, name: &str) -> Option<String> {
    status.forces.iter().find(|force| force.name == name)?;
    Some(match forced_by(status, name) {
        Some((by, tick)) => format!("forced by {by} since tick {tick}"),
        None => "forced".to_owned(),
    })
}

/// An answer as it is shown.
fn view(explanation: &Explanation) -> WhyView {
    let kind = |kind| match kind {
        PieceKind::Plain => "plain",
        PieceKind::Name => "name",
        PieceKind::Value => "value",
        PieceKind::Forced => "forced",
        PieceKind::Place => "place",
        PieceKind::Wish => "wish",
    };
    let lines = explanation.lines().into_iter().map(|line| {
        let pieces = line.pieces.into_iter();
        let pieces = pieces.map(|piece| WhyPiece {
            text: plcc_abi::printable(&piece.text).into_owned(),
            kind: kind(piece.kind).into(),
        });
        let (name, tick) = line.next.unzip();
        WhyLine { pieces: pieces.collect(), name, tick }
    });
    WhyView { name: explanation.name.clone(), tick: Some(explanation.tick), lines: lines.collect() }
}
