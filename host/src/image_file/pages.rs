//! Which parts of a process image are looked at after each tick, and the words of the image file that are written since
//! they have changed.
//!
//! Of a small image all pages are looked at. A PMAC's is half a megabyte, a Turbo PMAC's nearly two, of
//! which a program uses a few pages; looking at all of it would take longer than a servo cycle. There
//! the pages that the program is known to use are looked at after each tick, and a few of the others
//! in turn: a page that has changed counts as used from then on.
//!
//! What the file holds is also kept in memory of this process. Pages are compared with that, as blocks of plain bytes, which
//! is much faster than with the file's atomic words one by one. Most of a PMAC's pages are empty and stay so; they are
//! all compared with one empty page, which stays in the processor's cache.
//!
//! One used page in turn is written as a whole, so that nothing stays in the file that another process has put there by
//! mistake.

use std::ops::Range;
use std::sync::atomic::AtomicU64;

use plcc_image::sequence::write_word;

/// Bytes of a page.
pub(super) const PAGE: usize = 4096;
/// All pages of images up to this length are looked at after each tick.
const ALWAYS_WHOLE: usize = 64 << 10;
/// How many pages that are not known to be used are looked at after each tick.
const COMPARED: usize = 8;
/// Bytes of a page that are compared at once where the page has changed.
const BLOCK: usize = 128;

/// A page of zeros.
static EMPTY: [u8; PAGE] = [0; PAGE];

/// The pages of an image.
#[derive(Clone, Debug)]
pub(super) struct Pages {
    /// What the file holds of the image.
    published: Box<[u8]>,
    /// The numbers of the used pages. There is room for all, so that adding one does not allocate.
    used: Vec<u32>,
    /// For each page whether it is among them.
    is_used: Box<[bool]>,
    /// For each page whether all bytes of it were 0 when the file was made. Those that are not used still are in the file.
    began_empty: Box<[bool]>,
    /// The page that is looked at next, of those that are not used.
    next: usize,
    /// The place among the used pages of the one that is written as a whole next.
    next_whole: usize,
}

impl Pages {
    /// The pages of an `image` that the file holds; `used` are the ranges that the program is known to use.
    pub(super) fn new(image: &[u8], used: &[Range<u32>]) -> Self {
        let count = image.len().div_ceil(PAGE);
        let mut pages = Self {
            published: image.into(),
            used: Vec::with_capacity(count),
            is_used: vec![false; count].into(),
            began_empty: image.chunks(PAGE).map(is_empty).collect(),
            next: 0,
            next_whole: 0,
        };
        if image.len() <= ALWAYS_WHOLE {
            (0..count).for_each(|page| pages.add(page));
        }
        for range in used.iter().filter(|range| !range.is_empty()) {
            let (first, last) = (range.start as usize / PAGE, (range.end as usize - 1) / PAGE);
            (first..=last).for_each(|page| pages.add(page));
        }
        pages
    }

    /// Bytes of the image.
    pub(super) fn image_size(&self) -> usize {
        self.published.len()
    }

    fn add(&mut self, page: usize) {
        if let Some(is_used) = self.is_used.get_mut(page).filter(|is_used| !**is_used) {
            *is_used = true;
            self.used.push(page as u32);
        }
    }

    /// Writes the words of the used pages, and of some others, that differ from what the file holds. `words` are the
    /// file's, from the beginning of the image on; `image` has the same length as ever.
    pub(super) fn write_changes(&mut self, image: &[u8], words: &[AtomicU64]) {
        let published = &mut self.published;
        for &page in &self.used {
            write_page(page as usize, image, published, words);
        }
        if let Some(&page) = self.used.get(self.next_whole) {
            rewrite_page(page as usize, image, words);
        }
        self.next_whole =
            if self.next_whole + 1 < self.used.len() { self.next_whole + 1 } else { 0 };
        let unused = self.is_used.len() - self.used.len();
        let mut left = COMPARED.min(unused);
        while left > 0 {
            let page = self.next;
            self.next = (self.next + 1) % self.is_used.len();
            if self.is_used.get(page) == Some(&false) {
                left -= 1;
                let bytes = image.get(page * PAGE..).unwrap_or_default();
                let stays_empty = self.began_empty.get(page) == Some(&true)
                    && is_empty(bytes.get(..PAGE).unwrap_or(bytes));
                if !stays_empty && write_page(page, image, &mut self.published, words) {
                    self.add(page);
                }
            }
        }
    }
}

/// Whether all bytes of a page, or of the part of it that the image has, are 0.
fn is_empty(page: &[u8]) -> bool {
    Some(page) == EMPTY.get(..page.len())
}

/// Writes the words of a page that differ from what the file holds. Returns whether there are any.
fn write_page(page: usize, image: &[u8], published: &mut [u8], words: &[AtomicU64]) -> bool {
    let (from, end) = (page * PAGE, image.len().min((page + 1) * PAGE));
    let (Some(image), Some(published)) = (image.get(from..end), published.get_mut(from..end))
    else {
        return false;
    };
    if image == published {
        return false;
    }
    let words = words.get(from / 8..).unwrap_or_default();
    let blocks = image.chunks(BLOCK).zip(published.chunks_mut(BLOCK)).zip(words.chunks(BLOCK / 8));
    for ((image, published), words) in blocks.filter(|((image, published), _)| image != published) {
        for ((image, published), word) in image.chunks(8).zip(published.chunks_mut(8)).zip(words) {
            if image != published {
                published.copy_from_slice(image);
                write_word(word, word_of(image));
            }
        }
    }
    true
}

/// Writes all words of a page.
fn rewrite_page(page: usize, image: &[u8], words: &[AtomicU64]) {
    let page = page * PAGE..image.len().min((page + 1) * PAGE);
    let words = words.get(page.start / 8..).unwrap_or_default();
    for (bytes, word) in image.get(page).unwrap_or_default().chunks(8).zip(words) {
        write_word(word, word_of(bytes));
    }
}

/// The word that holds up to eight bytes in their order; missing ones are 0.
fn word_of(bytes: &[u8]) -> u64 {
    let mut whole = [0; 8];
    whole.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
    u64::from_ne_bytes(whole)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::Ordering;

    use super::*;

    /// A file with the words of an image of zeros, and that image.
    fn empty(size: usize) -> (Vec<AtomicU64>, Vec<u8>) {
        ((0..size.div_ceil(8)).map(|_| AtomicU64::new(0)).collect(), vec![0; size])
    }

    fn bytes(words: &[AtomicU64]) -> Vec<u8> {
        words.iter().flat_map(|word| word.load(Ordering::Relaxed).to_ne_bytes()).collect()
    }

    #[test]
    fn small_images_are_written_whole() {
        let (words, mut image) = empty(2 * PAGE + 3);
        let mut pages = Pages::new(&image, &[]);
        image.iter_mut().zip(1..=u8::MAX).for_each(|(byte, number)| *byte = number);
        image[2 * PAGE..].copy_from_slice(&[7, 8, 9]);
        pages.write_changes(&image, &words);
        assert_eq!(bytes(&words)[..image.len()], image);
        assert_eq!(bytes(&words)[image.len()..], [0; 5]);
        Pages::new(&[], &[]).write_changes(&[], &[]);
    }

    /// Each word is marked before, so that it shows whether it was written.
    #[test]
    fn only_words_that_differ_are_written_and_those_of_one_page() {
        let (_, mut image) = empty(2 * PAGE);
        let mut pages = Pages::new(&image, &[]);
        let words: Vec<AtomicU64> = (0..image.len() / 8).map(|_| AtomicU64::new(9)).collect();
        (image[8], image[PAGE + 1023]) = (1, 2);
        pages.write_changes(&image, &words);
        let written: Vec<usize> =
            (0..words.len()).filter(|&at| words[at].load(Ordering::Relaxed) != 9).collect();
        let first_page = (0..PAGE / 8).collect::<Vec<_>>();
        assert_eq!(written, [first_page, vec![PAGE / 8 + 127]].concat());
    }

    #[test]
    fn what_another_process_has_written_does_not_stay() {
        let (words, image) = empty(3 * PAGE);
        let mut pages = Pages::new(&image, &[]);
        for at in [5, PAGE / 8, 3 * PAGE / 8 - 1] {
            words[at].store(9, Ordering::Relaxed);
        }
        (0..3).for_each(|_| pages.write_changes(&image, &words));
        assert_eq!(bytes(&words), image);
    }

    #[test]
    fn of_large_images_the_used_pages_are_written_and_changed_ones_are_found() {
        let (words, mut image) = empty(40 * PAGE);
        let used = [10..10, 4090..4100, 8 * PAGE as u32..9 * PAGE as u32];
        let mut pages = Pages::new(&image, &used);
        for page in [0, 1, 8, 30] {
            image[page * PAGE] = 1;
        }
        let shown = |words: &[AtomicU64]| -> Vec<usize> {
            let bytes = bytes(words);
            (0..40)
                .filter(|page| bytes[page * PAGE] == image[page * PAGE] && image[page * PAGE] != 0)
                .collect()
        };
        pages.write_changes(&image, &words);
        assert_eq!(shown(&words), [0, 1, 8]);
        // The pages from 2 to 10 except 8 have been compared; page 30 is found in one of the next calls.
        pages.write_changes(&image, &words);
        assert_eq!(shown(&words), [0, 1, 8]);
        pages.write_changes(&image, &words);
        pages.write_changes(&image, &words);
        assert_eq!(shown(&words), [0, 1, 8, 30]);
        image[30 * PAGE] = 2;
        pages.write_changes(&image, &words);
        assert_eq!(bytes(&words), image, "a page that was found is current");
    }
}
