//! Random changes (mutations) of sources and artifacts, the same for the same seed.

use plcc_random::Rng;

/// The greatest length of a mutation in bytes.
const LONGEST: usize = 1 << 16;

/// Takes one of the inputs and changes it in one to six steps, some of which take parts of another
/// input.
pub fn mutate(inputs: &[Vec<u8>], seed: u64) -> Vec<u8> {
    let mut rng = Rng::new(seed);
    let empty = vec![];
    let mut bytes = pick_input(&mut rng, inputs).unwrap_or(&empty).clone();
    let other = pick_input(&mut rng, inputs).unwrap_or(&empty).clone();
    for _ in 0..1 + rng.below(6) {
        step(&mut rng, &mut bytes, &other);
    }
    bytes.truncate(LONGEST);
    bytes
}

fn pick_input<'a>(rng: &mut Rng, inputs: &'a [Vec<u8>]) -> Option<&'a Vec<u8>> {
    if inputs.is_empty() { None } else { Some(rng.pick(inputs)) }
}

fn step(rng: &mut Rng, bytes: &mut Vec<u8>, other: &[u8]) {
    let at = rng.below(bytes.len() + 1);
    match rng.below(9) {
        // Changes a bit or a byte.
        0 => {
            let bit = 1 << rng.below(8);
            bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte ^= bit);
        }
        1 => {
            let new = *rng.pick(b"\0\x01\x7F\x80\xFF0A \"'()[]{};#?%=+-*/<>&|!^~,.:$@\r\n\t\x1A");
            bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte = new);
        }
        // Removes a stretch of bytes, doubles it, or repeats it many times.
        2 => {
            let end = (at + 1 + rng.below(12)).min(bytes.len());
            bytes.drain(at..end);
        }
        3 => {
            let end = (at + 1 + rng.below(40)).min(bytes.len());
            let copy = bytes[at..end].to_vec();
            insert(bytes, at, &copy);
        }
        4 => {
            let end = (at + 1 + rng.below(8)).min(bytes.len());
            let most = if rng.chance(5) { 700 } else { 20 };
            let copy = bytes[at..end].repeat(1 + rng.below(most));
            insert(bytes, at, &copy);
        }
        // Replaces a word by one of the other input, or inserts a line of that.
        5 | 6 => {
            let new = around(other, rng.below(other.len() + 1), is_word).1;
            let (range, _) = around(bytes, at, is_word);
            bytes.splice(range, new);
        }
        7 => {
            let new = around(other, rng.below(other.len() + 1), |byte| byte != b'\n').1;
            insert(bytes, at, &new);
        }
        // Joins the beginning of this input and the end of the other.
        _ => {
            bytes.truncate(at);
            bytes.extend(other.iter().skip(rng.below(other.len() + 1)));
        }
    }
}

fn insert(bytes: &mut Vec<u8>, at: usize, new: &[u8]) {
    if bytes.len() < LONGEST {
        bytes.splice(at..at, new.iter().copied());
    }
}

fn is_word(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'@' || byte == b'$'
}

/// The longest stretch around the place `at` whose bytes all satisfy `inside`: where it is, and its
/// bytes.
fn around(
    bytes: &[u8],
    at: usize,
    inside: impl Fn(u8) -> bool,
) -> (std::ops::Range<usize>, Vec<u8>) {
    let at = at.min(bytes.len());
    let start = bytes[..at].iter().rposition(|&byte| !inside(byte)).map_or(0, |last| last + 1);
    let length = bytes[at..].iter().position(|&byte| !inside(byte)).unwrap_or(bytes.len() - at);
    (start..at + length, bytes[start..at + length].to_vec())
}
