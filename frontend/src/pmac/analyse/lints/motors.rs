//! A lint about motors: `motor-not-activated`.

use plcc_abi::image::read_f64;
use plcc_abi::pmac::Kind;
use plcc_abi::pmac::motion::MotionAction;
use plcc_diag::Diagnostic;

use super::Checked;
use crate::pmac::ast::{Action, StmtKind, Target};

/// Motors that have axes where there are motion programs, and whose Ix00 is 0 after load.
pub(super) fn not_activated(checked: &mut Checked<'_>) {
    if checked.download.progs.is_empty() {
        return;
    }
    let layout = checked.loaded.layout;
    for &motor in checked.loaded.motion.definitions.keys() {
        let number = 100 * u32::from(motor);
        if read_f64(&checked.loaded.image, layout.i_offset(number)) != 0.0 {
            continue;
        }
        let may_be_set = |target: Target| match target {
            Target::Indirect(kind, _) => kind == Kind::I,
            _ => target.named().any(|own| own == (Kind::I, number as u16)),
        };
        let by_program = checked
            .download
            .statements()
            .any(|stmt| matches!(stmt.kind, StmtKind::Assign(target, _) if may_be_set(target)));
        let definition = checked.download.online.iter().rev().find(|online| {
            let Action::Motion(command) = &online.action else { return false };
            matches!(command.action, MotionAction::Define { motor: own, .. } if own == motor)
        });
        let Some(at) = definition.map(|online| online.at).filter(|_| !by_program) else { continue };
        let message = format!("motor {motor} is not activated: I{number} is 0 after this download");
        checked.add(at, |span| {
            Diagnostic::warning("PMAC-W25", span, message)
                .note("no motion program runs in a coordinate system with such a motor (ERR013)")
                .help(format!("I{number}=1 activates it"))
        });
    }
}
