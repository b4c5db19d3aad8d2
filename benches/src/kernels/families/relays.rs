//! Relay logic, and a touch panel.

use plcc_random::Rng;

use super::{INPUTS, empty, number};
use crate::kernels::{BitStyle, Expr, Kernel, Language, Stmt};

/// Relay logic: equations of two to nine contacts. Most are relays of equations shortly before,
/// some are inputs, and some are relays of later equations, whose values are from the scan before.
pub(super) fn ladder(language: Language, style: BitStyle, count: usize, seed: u64) -> Kernel {
    let name = match (style, language) {
        (BitStyle::Operators, _) => "operators",
        (_, Language::PmacMixed) => "ladder in M and P",
        _ => "ladder",
    };
    let mut rng = Rng::new(seed);
    let mut kernel = Kernel { style, bits: INPUTS + count, ..empty(name, language) };
    for index in 0..count {
        let groups = 1 + rng.below(3);
        let mut parts: Vec<Expr> = vec![];
        for _ in 0..groups {
            let contacts = if groups == 1 { 2 + rng.below(2) } else { 1 + rng.below(3) };
            let contact = |rng: &mut Rng| {
                let bit = match rng.below(10) {
                    0..3 => rng.below(INPUTS),
                    3..8 => INPUTS + (index + count - 1 - rng.below(40.min(count))) % count,
                    _ => INPUTS + rng.below(count),
                };
                if rng.below(3) == 0 { Expr::NotBit(bit) } else { Expr::Bit(bit) }
            };
            let mut group: Vec<Expr> = (0..contacts).map(|_| contact(&mut rng)).collect();
            match (group.len(), groups) {
                (1, _) => parts.extend(group.pop()),
                (_, 1) => parts.append(&mut group),
                _ => parts.push(Expr::Any(group)),
            }
        }
        let value = match parts.len() {
            1 => parts.remove(0),
            _ => Expr::All(parts),
        };
        kernel.stmts.push(Stmt::SetBit(INPUTS + index, value));
    }
    kernel
}

/// A touch panel: keys with one-shots that toggle lights, lamps that blink, and the number of the
/// text to show.
pub(super) fn touch(language: Language, keys: usize, seed: u64) -> Kernel {
    let mut rng = Rng::new(seed);
    let mut kernel = Kernel { bits: INPUTS + 4 * keys, words: 1, ..empty("touch", language) };
    let part = |part: usize, key: usize| INPUTS + part * keys + key;
    for key in 0..keys {
        let (edge, last, light, lamp) = (part(0, key), part(1, key), part(2, key), part(3, key));
        let pressed = rng.below(INPUTS);
        let once = Expr::All(vec![Expr::Bit(pressed), Expr::NotBit(last)]);
        kernel.stmts.push(Stmt::SetBit(edge, once));
        kernel.stmts.push(Stmt::SetBit(last, Expr::Bit(pressed)));
        let toggled = Expr::Any(vec![
            Expr::All(vec![Expr::Bit(edge), Expr::NotBit(light)]),
            Expr::All(vec![Expr::NotBit(edge), Expr::Bit(light)]),
        ]);
        kernel.stmts.push(Stmt::SetBit(light, toggled));
        let blink = Expr::Any(vec![Expr::Bit(edge), Expr::Bit(rng.below(INPUTS))]);
        kernel.stmts.push(Stmt::SetBit(lamp, Expr::All(vec![Expr::Bit(light), blink])));
        let text = vec![Stmt::SetWord(0, number(100 + key))];
        kernel.stmts.push(Stmt::If(Expr::Bit(edge), text, vec![]));
    }
    kernel
}
