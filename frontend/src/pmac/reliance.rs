//! Which M-variables code names, and with which definitions built in.

use plcc_abi::pmac::{Direct, Kind, Layout, Memory, Relied};

use super::ast::{Download, Op, Stmt, Target, What};
use super::load::Loaded;
use super::lower::{Runs, tasks};

/// Says the number of every M-variable that stands as such in statements, again and again where
/// it stands there several times.
pub(crate) fn names_of_m(download: &Download, code: &[Stmt], say: &mut impl FnMut(u16)) {
    let reads = |expr, say: &mut dyn FnMut(u16)| {
        for op in download.ops(expr) {
            if let Op::Var(Kind::M, number) = *op {
                say(number);
            }
        }
    };
    for stmt in code {
        if let Some(expr) = Download::computed(&stmt.what) {
            reads(expr, say);
        }
        match stmt.what {
            What::Assign(Target::Var(Kind::M, number), _) => say(number),
            What::Assign(Target::Indirect(_, index), _) => reads(index, say),
            What::Assign(Target::Range { kind: Kind::M, first, count, step }, _) => {
                for k in 0..count {
                    say(first.wrapping_add(k.wrapping_mul(step)));
                }
            }
            _ => {}
        }
    }
}

/// What code relies on that is made for the definitions after load: the M-variables that PLCs
/// name, by rising number.
pub(crate) fn after_load(download: &Download, loaded: &mut Loaded) -> Vec<Relied> {
    let layout = loaded.layout;
    let mut named = vec![false; layout.count as usize];
    for (runs, code) in tasks(download, loaded) {
        if matches!(runs, Runs::Plc { .. }) {
            names_of_m(download, code, &mut |number| {
                if let Some(slot) = named.get_mut(usize::from(number) & (layout.count as usize - 1))
                {
                    *slot = true;
                }
            });
        }
    }
    let memory = Memory { image: &mut loaded.image, layout: &layout, far: &mut loaded.far };
    let built_in = |number| {
        let definition = memory.definition(number);
        Direct::of(&layout, definition).map(|_| definition)
    };
    let numbers = (0..).zip(named).filter(|(_, named)| *named);
    numbers.map(|(number, _)| Relied { number, definition: built_in(number) }).collect()
}

/// Where code goes directly for each M-variable, by number.
pub(crate) fn places(layout: &Layout, relied: &[Relied]) -> Vec<Option<Direct>> {
    let mut places = vec![None; layout.count as usize];
    for relied in relied {
        if let Some(slot) = places.get_mut(relied.number as usize) {
            *slot = relied.definition.and_then(|definition| Direct::of(layout, definition));
        }
    }
    places
}

/// The same for every M-variable with its definition after load, named or not.
pub(crate) fn places_after_load(loaded: &Loaded) -> Vec<Option<Direct>> {
    let layout = loaded.layout;
    let view = plcc_abi::pmac::View { image: &loaded.image, layout: &layout, far: &loaded.far };
    (0..layout.count).map(|number| Direct::of(&layout, view.definition(number))).collect()
}
