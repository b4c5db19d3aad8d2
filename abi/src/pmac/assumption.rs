//! Assumptions: the definitions of M-variables that specialised code is compiled for.
//!
//! Code that names an M-variable assumes its definition and accesses the memory behind it directly,
//! or it calls the host. A count in the image says how many assumed definitions differ from the
//! variables' own. While it is 0, specialised code runs; a guard at the beginning of a scan, at
//! resume points and after statements that may change a definition looks at the count, and where
//! it is not 0, general code goes on. Before each statement it looks whether one of the M-variables that the
//! statement names has another definition than the code assumes, and has the host execute the statement then
//! ([`Statement`](super::Statement)). So a definition that a program changes is noticed by the next statement, and one that comes back to what was
//! assumed makes the specialised code valid again.

use super::definition::{Definition, Field, Format};
use super::layout::{Layout, Place, Space};
use crate::image::{read_u8, read_u32, read_u64, write_u8, write_u32, write_u64};

/// Where code reaches an M-variable without calling the host.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DirectAccess {
    /// A field of a word of the image: offset among the words, address.
    Word(u32, u32, Field),
    /// A P-variable.
    P(u32),
    /// A Q-variable, counted from &1Q0.
    Q(u32),
    /// The 21 bits that an undefined M-variable keeps in place of an address.
    Star,
}

impl DirectAccess {
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
    /// The definition that the code assumes; `None` where the code calls the host.
    pub definition: Option<Definition>,
}

/// Code assumes the definition.
const ASSUMED: u8 = 1;

/// A definition's code as it is compared with others: without the value that the code of a `*`
/// variable also holds, which changes by assignments.
fn without_value(code: u64) -> u64 {
    if Definition::decode(code) == Definition::Star { 0 } else { code }
}

/// The definitions in an image.
pub struct Definitions<'a> {
    image: &'a mut [u8],
    layout: &'a Layout,
}

impl<'a> Definitions<'a> {
    /// The definitions in an image of this layout.
    pub fn new(image: &'a mut [u8], layout: &'a Layout) -> Self {
        Self { image, layout }
    }

    fn code(&self, number: u32) -> u64 {
        read_u64(self.image, self.layout.definition_offset(number))
    }

    /// Whether code assumes an M-variable's definition.
    fn is_assumed(&self, number: u32) -> bool {
        read_u8(self.image, self.layout.assumption_flags + number) & ASSUMED != 0
    }

    fn set_flags(&mut self, number: u32, flags: u8) {
        write_u8(self.image, self.layout.assumption_flags + number, flags);
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
        write_u64(self.image, layout.definition_offset(number), code);
        let (old, new) = (without_value(old), without_value(code));
        if old == new {
            return;
        }
        let reference = without_value(read_u64(self.image, layout.reference_offset(number)));
        write_u8(self.image, layout.differing_definitions + number, u8::from(reference != new));
        if self.is_assumed(number) {
            let invalid = self.invalid_assumptions();
            let invalid = if old == reference { invalid.saturating_add(1) } else { invalid };
            let invalid = if new == reference { invalid.saturating_sub(1) } else { invalid };
            write_u32(self.image, layout.invalid_assumptions, invalid);
        }
    }

    /// The number of M-variables whose definition differs from what code assumes.
    pub fn invalid_assumptions(&self) -> u32 {
        read_u32(self.image, self.layout.invalid_assumptions)
    }

    /// Whether an M-variable's definition differs from its reference: what code assumes, or, where
    /// code assumes nothing, what it was after load. The number wraps.
    pub fn differs_from_reference(&self, number: u32) -> bool {
        read_u8(self.image, self.layout.differing_definitions + (number & (self.layout.count - 1)))
            != 0
    }

    /// Makes the definitions as they are now the reference, as after load; code assumes nothing.
    pub fn set_reference(&mut self) {
        let layout = self.layout;
        for number in 0..layout.count {
            let code = self.code(number);
            write_u64(self.image, layout.reference_offset(number), code);
            write_u8(self.image, layout.differing_definitions + number, 0);
            self.set_flags(number, 0);
        }
        write_u32(self.image, layout.invalid_assumptions, 0);
    }

    /// Takes over what code assumes from another image of the same layout, on which the same code
    /// ran, and finds out which definitions here differ from that.
    pub fn keep_assumptions_of(&mut self, other: &[u8]) {
        let layout = self.layout;
        let mut invalid = 0;
        for number in 0..layout.count {
            let assumed_code = read_u64(other, layout.reference_offset(number));
            let differs = without_value(assumed_code) != without_value(self.code(number));
            write_u64(self.image, layout.reference_offset(number), assumed_code);
            write_u8(self.image, layout.differing_definitions + number, u8::from(differs));
            let kept = read_u8(other, layout.assumption_flags + number) & ASSUMED;
            self.set_flags(number, kept);
            invalid += u32::from(differs && kept & ASSUMED != 0);
        }
        write_u32(self.image, layout.invalid_assumptions, invalid);
    }

    /// Records that the code that runs from now on assumes these definitions, and no others.
    pub fn assume(&mut self, assumptions: &[Assumption]) {
        let layout = self.layout;
        for number in 0..layout.count {
            self.set_flags(number, 0);
        }
        let mut invalid = 0;
        for assumed in assumptions {
            let number = assumed.number & (layout.count - 1);
            let Some(definition) = assumed.definition else { continue };
            let (assumed_code, now) =
                (without_value(definition.encode()), without_value(self.code(number)));
            write_u64(self.image, layout.reference_offset(number), assumed_code);
            write_u8(
                self.image,
                layout.differing_definitions + number,
                u8::from(assumed_code != now),
            );
            self.set_flags(number, ASSUMED);
            invalid += u32::from(assumed_code != now);
        }
        write_u32(self.image, layout.invalid_assumptions, invalid);
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
    fn an_assumption_is_invalid_while_the_definition_differs() {
        let layout = Layout::new(Controller::Pmac);
        let mut image = vec![0; layout.size as usize];
        let mut definitions = Definitions::new(&mut image, &layout);
        for number in 0..4 {
            definitions.set_code(number, P1.encode());
        }
        definitions.set_reference();
        assert_eq!(definitions.invalid_assumptions(), 0);
        let assumed = |number, definition| Assumption { number, definition };
        definitions.assume(&[assumed(1, Some(P1)), assumed(2, None), assumed(3, Some(P1))]);
        for number in 0..4 {
            definitions.set_code(number, P2.encode());
        }
        // Nothing is assumed of M0 and M2.
        assert_eq!(definitions.invalid_assumptions(), 2);
        definitions.set_code(1, Definition::Dp { address: 7 }.encode());
        assert_eq!(definitions.invalid_assumptions(), 2);
        definitions.set_code(1, P1.encode());
        assert_eq!(definitions.invalid_assumptions(), 1);
        assert!(!definitions.differs_from_reference(1) && definitions.differs_from_reference(3));
    }

    #[test]
    fn storing_a_value_in_an_undefined_variable_invalidates_nothing() {
        let layout = Layout::new(Controller::Pmac);
        let mut image = vec![0; layout.size as usize];
        let mut definitions = Definitions::new(&mut image, &layout);
        definitions.set_code(5, 12);
        definitions.set_reference();
        definitions.assume(&[Assumption { number: 5, definition: Some(Definition::Star) }]);
        definitions.set_code(5, 13);
        assert_eq!(definitions.invalid_assumptions(), 0);
        definitions.set_code(5, P1.encode());
        assert_eq!(definitions.invalid_assumptions(), 1);
        definitions.set_code(5, 14);
        assert_eq!(definitions.invalid_assumptions(), 0);
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
            DirectAccess::of(&layout, y(0xFFC2)),
            Some(DirectAccess::Word(at(Space::Y, 0xFFC2), 0xFFC2, field))
        );
        assert_eq!(DirectAccess::of(&layout, P1), Some(DirectAccess::P(1)));
        assert_eq!(
            DirectAccess::of(&layout, Definition::L { address: 0x1402 }),
            Some(DirectAccess::Q(2))
        );
        assert_eq!(DirectAccess::of(&layout, Definition::Star), Some(DirectAccess::Star));
        for other in [
            y(0xBC22),
            y(0x1001),
            Definition::L { address: 0x822 },
            Definition::F { address: 0x1001 },
            Definition::Y { address: 0xFFC2, field: Field { format: Format::D, ..field } },
        ] {
            assert_eq!(DirectAccess::of(&layout, other), None, "{other:?}");
        }
    }
}
