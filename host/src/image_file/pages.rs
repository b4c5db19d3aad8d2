//! Which parts of a process image are copied to the image file after each tick.
//!
//! A small image is copied as a whole. A PMAC's is half a megabyte, a Turbo PMAC's nearly two, of
//! which a program uses a few pages; copying all of it would take longer than a servo cycle. There
//! the pages that the program is known to use are copied after each tick, and a few of the others are
//! compared in turn: a page that has changed counts as used from then on.

use std::ops::Range;

/// Bytes of a page.
pub(super) const PAGE: usize = 4096;
/// Images up to this length are copied as a whole.
const ALWAYS_WHOLE: usize = 64 << 10;
/// How many pages that are not known to be used are compared after each tick.
const COMPARED: usize = 8;

/// The pages of an image.
#[derive(Clone, Debug)]
pub(super) struct Pages {
    /// The numbers of the used pages. There is room for all, so that adding one does not allocate.
    used: Vec<u32>,
    /// For each page whether it is among them.
    is_used: Vec<bool>,
    /// The page that is compared next.
    next: usize,
}

impl Pages {
    /// The pages of an image of `size` bytes; `used` are the ranges that the program is known to use.
    pub(super) fn new(size: usize, used: &[Range<u32>]) -> Self {
        let count = size.div_ceil(PAGE);
        let mut pages =
            Self { used: Vec::with_capacity(count), is_used: vec![false; count], next: 0 };
        if size <= ALWAYS_WHOLE {
            (0..count).for_each(|page| pages.add(page));
        }
        for range in used.iter().filter(|range| !range.is_empty()) {
            let (first, last) = (range.start as usize / PAGE, (range.end as usize - 1) / PAGE);
            (first..=last).for_each(|page| pages.add(page));
        }
        pages
    }

    fn add(&mut self, page: usize) {
        if let Some(is_used) = self.is_used.get_mut(page).filter(|is_used| !**is_used) {
            *is_used = true;
            self.used.push(page as u32);
        }
    }

    /// Calls `copy` with the number of each used page, then `differs` with some of the others; where
    /// that gives true, the page is used from now on and copied too.
    pub(super) fn visit(
        &mut self,
        mut copy: impl FnMut(usize),
        mut differs: impl FnMut(usize) -> bool,
    ) {
        self.used.iter().for_each(|&page| copy(page as usize));
        if self.used.len() == self.is_used.len() {
            return;
        }
        let mut compared = 0;
        for _ in 0..self.is_used.len() {
            let page = self.next;
            self.next = (self.next + 1) % self.is_used.len();
            if self.is_used.get(page).copied().unwrap_or(true) {
                continue;
            }
            if differs(page) {
                self.add(page);
                copy(page);
            }
            compared += 1;
            if compared == COMPARED {
                break;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The pages that a visit copies, where the pages in `changed` differ.
    fn copied(pages: &mut Pages, changed: &[usize]) -> Vec<usize> {
        let copied = std::cell::RefCell::new(vec![]);
        pages.visit(|page| copied.borrow_mut().push(page), |page| changed.contains(&page));
        copied.into_inner()
    }

    #[test]
    fn small_images_are_copied_whole() {
        assert_eq!(copied(&mut Pages::new(2 * PAGE + 1, &[]), &[]), [0, 1, 2]);
        assert!(copied(&mut Pages::new(0, &[]), &[]).is_empty());
    }

    #[test]
    fn of_large_images_the_used_pages_are_copied_and_changed_ones_are_found() {
        let size = 40 * PAGE;
        let mut pages = Pages::new(size, &[10..10, 4090..4100, 8 * PAGE as u32..9 * PAGE as u32]);
        assert_eq!(copied(&mut pages, &[]), [0, 1, 8]);
        // All pages from 2 to 10 except 8 have been compared; page 30 is found in one of the next visits.
        let visits = (1..).find(|_| copied(&mut pages, &[30]).contains(&30));
        assert_eq!(visits, Some(3));
        assert_eq!(copied(&mut pages, &[]), [0, 1, 8, 30]);
    }
}
