//! Natural sort order: the order in which people expect names, with the numbers in them compared by
//! value.

use core::cmp::Ordering;

/// Compares names: digits in a row as one number, all else by its bytes. `P2` comes before `P10`,
/// and `P02` before `P2`, which has the same number. Only names that are the same are equal.
pub fn natural_cmp(a: &str, b: &str) -> Ordering {
    let (mut x, mut y) = (a.as_bytes(), b.as_bytes());
    loop {
        match (x, y) {
            ([], _) | (_, []) => return x.len().cmp(&y.len()).then_with(|| a.cmp(b)),
            ([i, ..], [j, ..]) if i.is_ascii_digit() && j.is_ascii_digit() => {
                let (first, rest_x) = number(x);
                let (second, rest_y) = number(y);
                match first.len().cmp(&second.len()).then_with(|| first.cmp(second)) {
                    Ordering::Equal => (x, y) = (rest_x, rest_y),
                    unequal => return unequal,
                }
            }
            ([i, rest_x @ ..], [j, rest_y @ ..]) => match i.cmp(j) {
                Ordering::Equal => (x, y) = (rest_x, rest_y),
                unequal => return unequal,
            },
        }
    }
}

/// The digits at the front without leading zeros, and what follows them.
fn number(text: &[u8]) -> (&[u8], &[u8]) {
    let len = text.iter().take_while(|b| b.is_ascii_digit()).count();
    let zeros = text.iter().take(len).take_while(|&&b| b == b'0').count();
    let (digits, rest) = text.split_at(len);
    (digits.get(zeros..).unwrap_or(&[]), rest)
}

#[cfg(test)]
mod tests {
    use super::natural_cmp;

    #[test]
    fn digits_in_names_are_ordered_as_numbers() {
        let mut names = alloc::vec!["P10", "P2", "P02", "A", "P", "P2B", "@CP100", "P2A10", "P2A9"];
        names.sort_by(|a, b| natural_cmp(a, b));
        assert_eq!(names, ["@CP100", "A", "P", "P02", "P2", "P2A9", "P2A10", "P2B", "P10"]);
    }
}
