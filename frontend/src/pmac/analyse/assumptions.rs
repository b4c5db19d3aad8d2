//! What specialised code may assume of the definitions of M-variables.
//!
//! A definition says where in memory an M-variable lies, and a program may change it while it runs.
//! Specialised code assumes the definitions after load and reaches those places directly. The image
//! records whether they still hold: when one has changed, code reaches M-variables through the
//! host.

use plcc_abi::pmac::{
    Assumption, Definition, Definitions, DirectAccess, Kind, Layout, Place, Space, View,
};

use crate::pmac::analyse::load::Loaded;
use crate::pmac::ast::{Download, Op, Stmt, StmtKind};
use crate::pmac::tasks::{TaskKind, tasks};

/// Calls `visit` with the number of each M-variable that statements name by a number, as often as
/// they name it.
pub(crate) fn for_each_named_m(download: &Download, code: &[Stmt], visit: &mut impl FnMut(u16)) {
    let reads = |expr, visit: &mut dyn FnMut(u16)| {
        for op in download.ops(expr) {
            if let Op::Var(Kind::M, number) = *op {
                visit(number);
            }
        }
    };
    for stmt in code {
        if let Some(expr) = Download::computed(&stmt.kind) {
            reads(expr, visit);
        }
        if let StmtKind::Assign(target, _) = stmt.kind {
            if let Some(index) = target.index() {
                reads(index, visit);
            }
            let written = target.named().filter(|(kind, _)| *kind == Kind::M);
            written.for_each(|(_, number)| visit(number));
        }
    }
}

/// Calls `mark` with the number of each M-variable whose definition the statements are seen to
/// change: by a command that defines it, or by an assignment to an M- or L-variable that lies where
/// its definition is stored.
fn mark_changed(download: &Download, view: &View<'_>, code: &[Stmt], mark: &mut impl FnMut(u32)) {
    let layout = view.layout;
    let through = |definition: Definition, mark: &mut dyn FnMut(u32)| {
        if !matches!(definition, Definition::Star | Definition::X { .. } | Definition::Tw { .. })
            && let Place::Definition(number) = layout.place(Space::Y, definition.address())
        {
            mark(number);
        }
    };
    let write = |kind: Kind, number: u16, mark: &mut dyn FnMut(u32)| match kind {
        Kind::M => through(view.definition(u32::from(number)), mark),
        Kind::L => {
            if let Some(definition) = download.l_defs.get(&number) {
                through(*definition, mark);
            }
        }
        Kind::P | Kind::Q | Kind::I => {}
    };
    for stmt in code {
        match stmt.kind {
            StmtKind::Assign(target, _) => {
                target.named().for_each(|(kind, number)| write(kind, number, mark));
            }
            StmtKind::Define(index) => {
                if let Some(define) = download.defines.get(index as usize) {
                    (define.first..=define.last.min(layout.count - 1)).for_each(&mut *mark);
                }
            }
            StmtKind::Word(space, address, _) => {
                if let Place::Definition(number) = layout.place(space, address) {
                    mark(number);
                }
            }
            StmtKind::If(..)
            | StmtKind::Jump(_)
            | StmtKind::While(..)
            | StmtKind::EndWhile(_)
            | StmtKind::Plc(..)
            | StmtKind::Address(..)
            | StmtKind::AddressBy(..)
            | StmtKind::Text(..)
            | StmtKind::Save
            | StmtKind::Motion(..)
            | StmtKind::Loop(..) => {}
        }
    }
}

/// Decides what code for the state after load assumes, and enters it into the image, so that a
/// change of it is noticed.
pub(crate) fn assume(download: &Download, loaded: &mut Loaded) {
    let assumed = after_load(download, loaded);
    let mut definitions = Definitions::new(&mut loaded.image, &loaded.layout);
    definitions.set_reference();
    definitions.assume(&assumed);
    loaded.assumed = assumed;
}

/// What code for the state after load assumes: the M-variables that PLCs name, by rising number. A
/// definition that the program is seen to change is not assumed. The variable is reached through
/// the host instead, so that changing it does not invalidate other code.
fn after_load(download: &Download, loaded: &Loaded) -> Vec<Assumption> {
    let layout = loaded.layout;
    let mut named = vec![false; layout.count as usize];
    for (kind, code) in tasks(download, loaded) {
        if matches!(kind, TaskKind::Plc { .. }) {
            for_each_named_m(download, code, &mut |number| {
                if let Some(slot) = named.get_mut(usize::from(number) & (layout.count as usize - 1))
                {
                    *slot = true;
                }
            });
        }
    }
    let view = View { image: &loaded.image, layout: &layout, sparse: &loaded.sparse };
    let mut changed = vec![false; layout.count as usize];
    for (_, code) in tasks(download, loaded) {
        mark_changed(download, &view, code, &mut |number| {
            if let Some(slot) = changed.get_mut(number as usize) {
                *slot = true;
            }
        });
    }
    let assumed = |number, changed: bool| {
        let definition = view.definition(number);
        DirectAccess::of(&layout, definition).filter(|_| !changed).map(|_| definition)
    };
    let numbers = (0..).zip(named.into_iter().zip(changed)).filter(|(_, (named, _))| *named);
    numbers
        .map(|(number, (_, changed))| Assumption { number, definition: assumed(number, changed) })
        .collect()
}

/// For each M-variable, by number, the place at which code may access it directly under the given
/// assumptions; `None` where it must call the host.
pub(crate) fn places(layout: &Layout, assumed: &[Assumption]) -> Vec<Option<DirectAccess>> {
    let mut places = vec![None; layout.count as usize];
    for assumption in assumed {
        if let Some(slot) = places.get_mut(assumption.number as usize) {
            *slot =
                assumption.definition.and_then(|definition| DirectAccess::of(layout, definition));
        }
    }
    places
}
