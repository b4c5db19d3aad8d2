//! Assumptions: the definitions of M-variables that specialised code has built in.
//!
//! Code that names an M-variable assumes its definition and accesses the memory behind it directly,
//! or it calls the host. A count in the image says how many assumed definitions are other than the
//! variables' own. While it is 0, specialised code runs; a guard at the beginning of a scan, at
//! resume points and behind statements that may change a definition looks at the count, and where
//! it is not 0, general code goes on, which calls the host for every M-variable. So a definition
//! that a program changes is noticed by the next statement, and one that comes back to what was
//! assumed makes the specialised code valid again.

use super::definition::{Definition, Field, Format};
use super::layout::{Layout, Place, Space};
use crate::image::{read_u8, read_u32, read_u64, write_u8, write_u32, write_u64};

/// Where code reaches an M-variable without asking the host.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Direct {
    /// A field of a word of the image: offset among the words, address.
    Word(u32, u32, Field),
    /// A P-variable.
    P(u32),
    /// A Q-variable, counted from &1Q0.
    Q(u32),
    /// The 21 bits of an undefined one.
    Star,
}

impl Direct {
    /// Where a definition leads; `None` where only the host can follow it.
    pub fn of(layout: &Layout, definition: Definition) -> Option<Self> {
        let word = |space, address, field: Field| match layout.place(space, address) {
            Place::Word(offset) if matches!(field.format, Format::U | Format::S) => {
                Some(Self::Word(offset - layout.words, address, field))
            }
            _ => None,
        };
        match definition {
            Definition::Star => Some(Self::Star),
            Definition::X { address, field } => word(Space::X, address, field),
            Definition::Y { address, field } => word(Space::Y, address, field),
            Definition::L { address } => match layout.place(Space::X, address) {
                Place::P(number) => Some(Self::P(number)),
                Place::Q(number) => Some(Self::Q(number)),
                _ => None,
            },
            _ => None,
        }
    }
}

/// What code assumes of an M-variable that it names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Assumption {
    /// Its number.
    pub number: u32,
    /// The definition that is built in; `None` where the code calls the host.
    pub definition: Option<Definition>,
}

/// Code has the definition built in.
const BUILT_IN: u8 = 1;
/// Code names the variable.
const NAMED: u8 = 2;
/// Its definition has changed since somebody looked.
const CHANGED: u8 = 4;

/// A definition's code without a `*` variable's value, which is no place.
fn place(code: u64) -> u64 {
    if Definition::decode(code) == Definition::Star { 0 } else { code }
}

/// The definitions in an image.
pub struct Definitions<'a> {
    image: &'a mut [u8],
    layout: &'a Layout,
}

impl<'a> Definitions<'a> {
    /// Those of an image.
    pub fn new(image: &'a mut [u8], layout: &'a Layout) -> Self {
        Self { image, layout }
    }

    fn code(&self, number: u32) -> u64 {
        read_u64(self.image, self.layout.mdef + 8 * number)
    }

    fn flags(&self, number: u32) -> u8 {
        read_u8(self.image, self.layout.mwatch + number)
    }

    fn set_flags(&mut self, number: u32, flags: u8) {
        write_u8(self.image, self.layout.mwatch + number, flags);
    }

    /// An M-variable's definition as it is now; the number wraps.
    pub fn get(&self, number: u32) -> Definition {
        Definition::decode(self.code(number & (self.layout.count - 1)))
    }

    /// Sets a definition's [code](Definition::encode), with the value of a `*`; the number wraps.
    pub fn set_code(&mut self, number: u32, code: u64) {
        let layout = self.layout;
        let number = number & (layout.count - 1);
        let old = self.code(number);
        if old == code {
            return;
        }
        write_u64(self.image, layout.mdef + 8 * number, code);
        let (old, new) = (place(old), place(code));
        if old == new {
            return;
        }
        let known = place(read_u64(self.image, layout.mload + 8 * number));
        write_u8(self.image, layout.moved + number, u8::from(known != new));
        let flags = self.flags(number);
        if flags & NAMED == 0 {
            return;
        }
        self.set_flags(number, flags | CHANGED);
        let epoch = read_u32(self.image, layout.epoch);
        write_u32(self.image, layout.epoch, epoch.wrapping_add(1));
        if flags & BUILT_IN != 0 {
            let stale = self.stale();
            let stale = if old == known { stale.saturating_add(1) } else { stale };
            let stale = if new == known { stale.saturating_sub(1) } else { stale };
            write_u32(self.image, layout.stale, stale);
        }
    }

    /// How many definitions that code has built in are other now.
    pub fn stale(&self) -> u32 {
        read_u32(self.image, self.layout.stale)
    }

    /// Goes up, around its 32 bits, whenever the definition of a variable that code names changes.
    pub fn epoch(&self) -> u32 {
        read_u32(self.image, self.layout.epoch)
    }

    /// Whether an M-variable's definition is other than code has it built in, or, where it has
    /// not, than it was after load.
    pub fn is_moved(&self, number: u32) -> bool {
        read_u8(self.image, self.layout.moved + (number & (self.layout.count - 1))) != 0
    }

    /// Whether code has an M-variable's definition built in.
    pub fn is_built_in(&self, number: u32) -> bool {
        self.flags(number & (self.layout.count - 1)) & BUILT_IN != 0
    }

    /// Whether a definition that code names has changed since the last time this was asked.
    pub fn take_changed(&mut self, number: u32) -> bool {
        let number = number & (self.layout.count - 1);
        let flags = self.flags(number);
        self.set_flags(number, flags & !CHANGED);
        flags & CHANGED != 0
    }

    /// Passes over an M-variable that code names but has not built in: its definition may change
    /// unseen.
    pub fn ignore(&mut self, number: u32) {
        let number = number & (self.layout.count - 1);
        if self.flags(number) & BUILT_IN == 0 {
            self.set_flags(number, 0);
        }
    }

    /// Makes the definitions as they are now those after load. Nothing is built in anywhere.
    pub fn seal(&mut self) {
        let layout = self.layout;
        for number in 0..layout.count {
            let code = self.code(number);
            write_u64(self.image, layout.mload + 8 * number, code);
            write_u8(self.image, layout.moved + number, 0);
            self.set_flags(number, 0);
        }
        write_u32(self.image, layout.stale, 0);
        write_u32(self.image, layout.epoch, 0);
    }

    /// The code that runs on this image is the code that ran on another one, of the same layout:
    /// takes from there what is built in, and finds out which definitions are other than that.
    pub fn keep_assumptions_of(&mut self, other: &[u8]) {
        let layout = self.layout;
        let mut stale = 0;
        for number in 0..layout.count {
            let built_in = read_u64(other, layout.mload + 8 * number);
            let is_moved = place(built_in) != place(self.code(number));
            write_u64(self.image, layout.mload + 8 * number, built_in);
            write_u8(self.image, layout.moved + number, u8::from(is_moved));
            let names = read_u8(other, layout.mwatch + number) & (NAMED | BUILT_IN);
            let changed = if names & NAMED != 0 { self.flags(number) & CHANGED } else { 0 };
            self.set_flags(number, names | changed);
            stale += u32::from(is_moved && names & BUILT_IN != 0);
        }
        write_u32(self.image, layout.stale, stale);
    }

    /// Code comes that names and has built in what `on` says, and nothing else.
    pub fn assume(&mut self, on: &[Assumption]) {
        let layout = self.layout;
        for number in 0..layout.count {
            self.set_flags(number, 0);
        }
        let mut stale = 0;
        for assumed in on {
            let number = assumed.number & (layout.count - 1);
            let Some(definition) = assumed.definition else {
                self.set_flags(number, NAMED);
                continue;
            };
            let (built_in, now) = (place(definition.encode()), place(self.code(number)));
            write_u64(self.image, layout.mload + 8 * number, built_in);
            write_u8(self.image, layout.moved + number, u8::from(built_in != now));
            self.set_flags(number, NAMED | BUILT_IN);
            stale += u32::from(built_in != now);
        }
        write_u32(self.image, layout.stale, stale);
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec;

    use super::super::Controller;
    use super::*;

    const P1: Definition = Definition::L { address: 0x1001 };
    const P2: Definition = Definition::L { address: 0x1002 };

    #[test]
    fn a_definition_is_stale_while_it_differs_from_what_code_assumes() {
        let layout = Layout::new(Controller::Pmac);
        let mut image = vec![0; layout.size as usize];
        let mut definitions = Definitions::new(&mut image, &layout);
        for number in 0..4 {
            definitions.set_code(number, P1.encode());
        }
        definitions.seal();
        assert_eq!((definitions.epoch(), definitions.stale()), (0, 0));
        let assumed = |number, definition| Assumption { number, definition };
        definitions.assume(&[assumed(1, Some(P1)), assumed(2, None), assumed(3, Some(P1))]);
        for number in 0..4 {
            definitions.set_code(number, P2.encode());
        }
        // M0 is not named, M2 is not built in.
        assert_eq!((definitions.epoch(), definitions.stale()), (3, 2));
        let changed = [0, 1, 2, 3].map(|number| definitions.take_changed(number));
        assert_eq!(changed, [false, true, true, true]);
        assert!(!definitions.take_changed(1));
        definitions.set_code(1, Definition::Dp { address: 7 }.encode());
        assert_eq!((definitions.epoch(), definitions.stale()), (4, 2));
        definitions.set_code(1, P1.encode());
        assert_eq!((definitions.epoch(), definitions.stale()), (5, 1));
        assert!(!definitions.is_moved(1) && definitions.is_moved(3));
        // New code has what is there now, but for M1, which it took for what it was before.
        definitions.assume(&[assumed(1, Some(P2)), assumed(3, Some(P2))]);
        assert_eq!(definitions.stale(), 1);
        assert!(definitions.is_moved(1) && !definitions.is_moved(3));
        definitions.set_code(1, P2.encode());
        assert_eq!(definitions.stale(), 0);
        assert!(definitions.is_built_in(1) && !definitions.is_built_in(2));
        definitions.assume(&[assumed(1, Some(P2)), assumed(2, None)]);
        let epoch = definitions.epoch();
        definitions.ignore(1);
        definitions.ignore(2);
        for number in [1, 2] {
            definitions.set_code(number, P1.encode());
        }
        assert_eq!((definitions.epoch(), definitions.stale()), (epoch + 1, 1));
    }

    #[test]
    fn storing_a_value_in_an_undefined_variable_invalidates_nothing() {
        let layout = Layout::new(Controller::Pmac);
        let mut image = vec![0; layout.size as usize];
        let mut definitions = Definitions::new(&mut image, &layout);
        definitions.set_code(5, 12);
        definitions.seal();
        definitions.assume(&[Assumption { number: 5, definition: Some(Definition::Star) }]);
        definitions.set_code(5, 13);
        assert_eq!((definitions.epoch(), definitions.stale()), (0, 0));
        definitions.set_code(5, P1.encode());
        definitions.set_code(5, 14);
        assert_eq!((definitions.epoch(), definitions.stale()), (2, 0));
    }

    #[test]
    fn direct_accesses_lead_to_the_offset_of_the_defined_word() {
        let layout = Layout::new(Controller::Pmac);
        let field = Field { offset: 8, width: 1, format: Format::U };
        let y = |address| Definition::Y { address, field };
        let at = |space, address| match layout.place(space, address) {
            Place::Word(offset) => offset - layout.words,
            other => panic!("{other:?}"),
        };
        assert_eq!(
            Direct::of(&layout, y(0xFFC2)),
            Some(Direct::Word(at(Space::Y, 0xFFC2), 0xFFC2, field))
        );
        assert_eq!(Direct::of(&layout, P1), Some(Direct::P(1)));
        assert_eq!(Direct::of(&layout, Definition::L { address: 0x1402 }), Some(Direct::Q(2)));
        assert_eq!(Direct::of(&layout, Definition::Star), Some(Direct::Star));
        for other in [
            y(0xBC22),
            y(0x1001),
            Definition::L { address: 0x822 },
            Definition::F { address: 0x1001 },
            Definition::Y { address: 0xFFC2, field: Field { format: Format::D, ..field } },
        ] {
            assert_eq!(Direct::of(&layout, other), None, "{other:?}");
        }
    }
}
