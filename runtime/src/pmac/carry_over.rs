//! Carries what one download has saved over to another, by names and types.
//!
//! A download that was changed and built anew finds a retained file that the former one has left. Of
//! each variable three values are known: the saved one (s), the one after the load of the former
//! download (a), and the one after the load of this one (b). Files of earlier versions of plcc do not
//! hold a.
//!
//! | | P and Q | I | definitions of M |
//! | --- | --- | --- | --- |
//! | s = a: it was never changed in operation | b | b | b |
//! | s ≠ a = b | s | s | s |
//! | s ≠ a ≠ b | s | s | b, and s is gone |
//! | a unknown | s | b, and s is gone if it differs | b, likewise; s where b is `*` |
//!
//! So what was changed in operation stays, and what the download's text has changed applies; only a
//! definition that both have changed goes, since the new text's programs are written for the new one.
//! I-variables and definitions of M do not go over to another type of controller, on which they mean
//! something else.

use plcc_abi::{
    image::{read_u64, write_f64, write_u64},
    pmac::{Definition, Kind, Layout, PmacName, Variable},
};

use crate::Restored;

/// The values of all variables: regions `p q i mdef` of images.
pub(super) struct Variables<'a> {
    /// Those that were saved.
    pub(super) saved: &'a [u8],
    /// Those after the load of the download that saved them, where they are known.
    pub(super) saved_after_load: Option<Vec<u8>>,
    /// Where they stand.
    pub(super) saved_layout: &'a Layout,
    /// Those after the load of this download.
    pub(super) after_load: &'a [u8],
    /// Where these stand.
    pub(super) layout: &'a Layout,
}

/// Which value a variable gets.
enum Choice {
    /// The saved one.
    Saved,
    /// That of this download; it is the same, or the saved one was never changed.
    Loaded,
    /// That of this download, though another one was saved.
    Gone,
}

/// The values that the variables get, and what became of the saved ones.
pub(super) fn carry_over(variables: &Variables<'_>) -> (Vec<u8>, Restored) {
    let Variables { saved, saved_after_load, saved_layout, after_load, layout } = variables;
    let mut image = after_load.to_vec();
    let mut restored = Restored { other_program: true, ..Restored::default() };
    let same_controller = saved_layout.controller == layout.controller;
    let before = |offset| saved_after_load.as_ref().map(|image| read_u64(image, offset));
    for kind in [Kind::I, Kind::M, Kind::P, Kind::Q] {
        for number in 0..saved_layout.count {
            let (name, from, to) = places(kind, number, saved_layout, layout);
            let s = read_u64(saved, from);
            let a = before(from);
            let Some(to) = to.filter(|_| same_controller || matches!(kind, Kind::P | Kind::Q))
            else {
                if s != 0 && a.is_none_or(|a| a != s) {
                    restored.gone.push(name);
                }
                continue;
            };
            let b = read_u64(after_load, to);
            let choice = match kind {
                Kind::M => definition(s, a, b),
                _ => value(kind, s, a, b),
            };
            match choice {
                Choice::Saved => {
                    write(&mut image, kind, to, s);
                    restored.kept += usize::from(s != 0);
                }
                Choice::Loaded if a.is_some_and(|a| a != b) => restored.new.push(name),
                Choice::Loaded => restored.kept += usize::from(s != 0),
                Choice::Gone => restored.gone.push(name),
            }
        }
    }
    (image, restored)
}

fn write(image: &mut [u8], kind: Kind, offset: u32, bits: u64) {
    match kind {
        Kind::M => write_u64(image, offset, bits),
        _ => write_f64(image, offset, f64::from_bits(bits)),
    }
}

/// Which value an I-, P- or Q-variable gets; the values are their bits.
fn value(kind: Kind, s: u64, a: Option<u64>, b: u64) -> Choice {
    match a {
        _ if s == b => Choice::Loaded,
        Some(a) if s == a => Choice::Loaded,
        None if kind == Kind::I => Choice::Gone,
        _ => Choice::Saved,
    }
}

/// Which definition an M-variable gets; the values are codes of definitions. That of a `*` holds a
/// value.
fn definition(s: u64, a: Option<u64>, b: u64) -> Choice {
    let is_value = |code| Definition::decode(code) == Definition::Star;
    match a {
        _ if s == b => Choice::Loaded,
        _ if is_value(s) && is_value(b) => value(Kind::P, s, a, b),
        Some(a) if s == a => Choice::Loaded,
        Some(a) if a == b => Choice::Saved,
        None if b == 0 => Choice::Saved,
        _ => Choice::Gone,
    }
}

/// A variable's name, its offset in the saved image, and its offset in this control's image, where it
/// exists there. Q-variables are counted through all coordinate systems.
fn places(kind: Kind, number: u32, from: &Layout, to: &Layout) -> (String, u32, Option<u32>) {
    let block = from.count / from.systems();
    let (number_in_system, system) = match kind {
        Kind::Q => (number % block, 1 + number / block),
        _ => (number, 1),
    };
    let name = PmacName::Variable(Variable { kind, number: number_in_system, system });
    let exists = match kind {
        Kind::Q => number_in_system < to.count / to.systems() && system <= to.systems(),
        _ => number < to.count,
    };
    let offset = |layout: &Layout| match kind {
        Kind::I | Kind::L => layout.i_offset(number),
        Kind::M => layout.definition_offset(number),
        Kind::P => layout.p_offset(number),
        Kind::Q => layout.q_offset(layout.q_base_of(system) + number_in_system),
    };
    (name.to_string(), offset(from), exists.then(|| offset(to)))
}

#[cfg(test)]
mod tests {
    use plcc_abi::image::read_f64;
    use plcc_abi::pmac::{Controller, Space};

    use super::*;

    /// An image of a controller, in which some variables are set.
    fn image(controller: Controller, values: &[(Kind, u32, u64)]) -> (Vec<u8>, Layout) {
        let layout = Layout::new(controller);
        let mut image = vec![0; layout.reference_definitions as usize];
        for &(kind, number, bits) in values {
            let (_, offset, _) = places(kind, number, &layout, &layout);
            write_u64(&mut image, offset, bits);
        }
        (image, layout)
    }

    /// What a variable gets, and what is gone and new, by its saved value, the value after the load of
    /// the former download and that after the load of this one.
    fn carried(kind: Kind, s: u64, a: Option<u64>, b: u64) -> (u64, Vec<String>, Vec<String>) {
        let (saved, layout) = image(Controller::Pmac, &[(kind, 5, s)]);
        let variables = Variables {
            saved: &saved,
            saved_after_load: a.map(|a| image(Controller::Pmac, &[(kind, 5, a)]).0),
            saved_layout: &layout,
            after_load: &image(Controller::Pmac, &[(kind, 5, b)]).0,
            layout: &layout,
        };
        let (image, restored) = carry_over(&variables);
        assert!(restored.other_program);
        let (_, offset, _) = places(kind, 5, &layout, &layout);
        (read_u64(&image, offset), restored.gone, restored.new)
    }

    fn number(value: f64) -> u64 {
        value.to_bits()
    }

    fn defined(address: u32) -> u64 {
        Definition::word(Space::Y, address, plcc_abi::pmac::Field::WORD).encode()
    }

    #[test]
    fn values_that_were_changed_in_operation_stay() {
        let [one, two, three] = [1.0, 2.0, 3.0].map(number);
        for (kind, name) in [(Kind::P, "P5"), (Kind::Q, "Q5"), (Kind::I, "I5")] {
            let new = vec![name.to_owned()];
            assert_eq!(carried(kind, one, Some(one), two), (two, vec![], new), "the text's value");
            assert_eq!(carried(kind, one, Some(two), two), (one, vec![], vec![]));
            assert_eq!(carried(kind, one, Some(two), three), (one, vec![], vec![]));
        }
        assert_eq!(carried(Kind::P, one, None, two), (one, vec![], vec![]));
        assert_eq!(carried(Kind::I, one, None, two), (two, vec!["I5".into()], vec![]));
    }

    #[test]
    fn a_definition_stays_unless_the_text_gives_another_one() {
        let [a, b, c] = [0xC000, 0xC001, 0xC002].map(defined);
        let m5 = || vec!["M5".to_owned()];
        assert_eq!(carried(Kind::M, a, Some(a), b), (b, vec![], m5()));
        assert_eq!(carried(Kind::M, a, Some(b), b), (a, vec![], vec![]));
        assert_eq!(carried(Kind::M, a, Some(b), c), (c, m5(), vec![]));
        assert_eq!(carried(Kind::M, a, None, b), (b, m5(), vec![]));
        assert_eq!(carried(Kind::M, a, None, 0), (a, vec![], vec![]));
        // Values of `*`.
        assert_eq!(carried(Kind::M, 7, Some(0), 0), (7, vec![], vec![]));
        assert_eq!(carried(Kind::M, 7, None, 0), (7, vec![], vec![]));
        assert_eq!(carried(Kind::M, 7, Some(0), b), (b, m5(), vec![]));
    }

    #[test]
    fn another_controller_takes_what_means_the_same_there() {
        let one = number(1.0);
        // &2Q0 is the first after 512 of a Turbo's, and after 128 of a PMAC's.
        let values =
            [(Kind::P, 9, one), (Kind::P, 5000, one), (Kind::Q, 512, one), (Kind::I, 5, one)];
        let (saved, saved_layout) = image(Controller::Turbo, &values);
        let (after_load, layout) = image(Controller::Pmac, &[]);
        let variables = Variables {
            saved: &saved,
            saved_after_load: None,
            saved_layout: &saved_layout,
            after_load: &after_load,
            layout: &layout,
        };
        let (image, restored) = carry_over(&variables);
        assert_eq!(read_f64(&image, layout.p_offset(9)), 1.0);
        assert_eq!(read_f64(&image, layout.q_offset(128)), 1.0);
        assert_eq!(read_f64(&image, layout.i_offset(5)), 0.0);
        assert_eq!(restored.gone, ["I5", "P5000"]);
        assert_eq!(restored.kept, 2);
    }
}
