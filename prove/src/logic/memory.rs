//! A process image whose bits are literals. A copy shares what has not changed since.

use std::rc::Rc;

use super::{FALSE, Graph, Lit};

/// Bytes of a page.
const PAGE: usize = 64;

/// A process image of literals.
#[derive(Clone, Debug)]
pub struct Memory {
    pages: Vec<Rc<Vec<[Lit; 8]>>>,
}

impl Memory {
    /// An image that holds these bytes.
    pub fn of_bytes(bytes: &[u8]) -> Self {
        let zero = Rc::new(vec![[FALSE; 8]; PAGE]);
        let page = |chunk: &[u8]| {
            if chunk.iter().all(|byte| *byte == 0) {
                return Rc::clone(&zero);
            }
            let mut page = vec![[FALSE; 8]; PAGE];
            for (slot, &byte) in page.iter_mut().zip(chunk) {
                *slot = std::array::from_fn(|bit| Lit::constant(byte >> bit & 1 == 1));
            }
            Rc::new(page)
        };
        Self { pages: bytes.chunks(PAGE).map(page).collect() }
    }

    /// The same image, longer: `size` bytes at least, those that are new 0.
    pub fn grow(&mut self, size: usize) {
        let pages = size.div_ceil(PAGE);
        if self.pages.len() < pages {
            let zero = Rc::new(vec![[FALSE; 8]; PAGE]);
            self.pages.resize(pages, zero);
        }
    }

    /// The bits of a byte, the lowest first; of one outside the image all are false.
    pub fn byte(&self, offset: usize) -> [Lit; 8] {
        let page = self.pages.get(offset / PAGE);
        page.and_then(|page| page.get(offset % PAGE)).copied().unwrap_or([FALSE; 8])
    }

    /// Puts a byte.
    pub fn set_byte(&mut self, offset: usize, bits: [Lit; 8]) {
        if self.byte(offset) == bits {
            return;
        }
        if let Some(page) = self.pages.get_mut(offset / PAGE)
            && let Some(slot) = Rc::make_mut(page).get_mut(offset % PAGE)
        {
            *slot = bits;
        }
    }

    /// A bit of a byte.
    pub fn bit(&self, offset: usize, bit: u8) -> Lit {
        self.byte(offset).get(usize::from(bit)).copied().unwrap_or(FALSE)
    }

    /// Puts a bit of a byte.
    pub fn set_bit(&mut self, offset: usize, bit: u8, value: Lit) {
        let mut bits = self.byte(offset);
        if let Some(slot) = bits.get_mut(usize::from(bit)) {
            *slot = value;
        }
        self.set_byte(offset, bits);
    }

    /// The bits of a number of `bytes` bytes.
    pub fn load(&self, offset: usize, bytes: usize) -> Vec<Lit> {
        (offset..offset + bytes).flat_map(|at| self.byte(at)).collect()
    }

    /// Puts a number; a bit alone makes a byte of 0 or 1.
    pub fn store(&mut self, offset: usize, bits: &[Lit]) {
        for (index, bits) in bits.chunks(8).enumerate() {
            let byte = std::array::from_fn(|bit| bits.get(bit).copied().unwrap_or(FALSE));
            self.set_byte(offset + index, byte);
        }
    }

    /// An image made of several: each bit that is not the same in all is what `choose` makes of them.
    pub fn joined(all: &[&Self], choose: &mut dyn FnMut(&[Lit]) -> Lit) -> Self {
        let Some((first, rest)) = all.split_first() else { return Self { pages: vec![] } };
        let mut this = (*first).clone();
        let mut lits = Vec::with_capacity(all.len());
        for (number, page) in this.pages.iter_mut().enumerate() {
            let mut others = rest.iter().filter_map(|it| it.pages.get(number));
            if others.all(|other| Rc::ptr_eq(page, other) || page == other) {
                continue;
            }
            for (place, byte) in Rc::make_mut(page).iter_mut().enumerate() {
                if rest.iter().all(|it| it.byte(PAGE * number + place) == *byte) {
                    continue;
                }
                for (bit, mine) in byte.iter_mut().enumerate() {
                    lits.clear();
                    lits.push(*mine);
                    lits.extend(rest.iter().map(|it| it.bit(PAGE * number + place, bit as u8)));
                    *mine = choose(&lits);
                }
            }
        }
        this
    }

    /// This image where `cond` is true, else the other one.
    pub fn choose(&mut self, graph: &mut Graph, cond: Lit, other: &Self) {
        for (page, other) in self.pages.iter_mut().zip(&other.pages) {
            if Rc::ptr_eq(page, other) || page == other {
                continue;
            }
            for (mine, theirs) in Rc::make_mut(page).iter_mut().zip(other.iter()) {
                for (mine, &theirs) in mine.iter_mut().zip(theirs) {
                    *mine = graph.choose(cond, *mine, theirs);
                }
            }
        }
    }
}
