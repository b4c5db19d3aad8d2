//! Reduces a program that fails a test to the lines that matter.

/// Removes lines of a text as long as `holds` is still true of the rest: halves first, then ever
/// smaller stretches, single lines and pairs of lines last.
pub fn lines(text: &str, holds: impl Fn(&str) -> bool) -> String {
    let mut kept: Vec<&str> = text.lines().collect();
    let mut size = kept.len().div_ceil(2);
    while size > 0 {
        let mut at = 0;
        let mut removed = false;
        while at < kept.len() {
            let mut fewer = kept.clone();
            fewer.drain(at..(at + size).min(kept.len()));
            if holds(&joined(&fewer)) {
                kept = fewer;
                removed = true;
            } else {
                at += size;
            }
        }
        if size == 1 && (removed || pairs(&mut kept, &holds)) {
            continue;
        }
        size /= 2;
    }
    joined(&kept)
}

/// Removes two lines that can only be removed together, as IF and ENDIF. False if there are none.
fn pairs(kept: &mut Vec<&str>, holds: &impl Fn(&str) -> bool) -> bool {
    for first in 0..kept.len() {
        for second in first + 1..kept.len() {
            let mut fewer = kept.clone();
            fewer.remove(second);
            fewer.remove(first);
            if holds(&joined(&fewer)) {
                *kept = fewer;
                return true;
            }
        }
    }
    false
}

/// Removes words and signs within the lines of a text, or writes 1 for several, as long as `holds` is still
/// true of the text: for a program that [`lines`] has made short.
pub fn words(text: &str, holds: impl Fn(&str) -> bool) -> String {
    let mut kept: Vec<Vec<&str>> = text.lines().map(split).collect();
    let whole = |lines: &[Vec<&str>]| -> String {
        lines.iter().map(|words| words.concat() + "\n").collect()
    };
    let mut smaller = true;
    while smaller {
        smaller = false;
        for line in 0..kept.len() {
            let mut size = kept[line].len();
            while size > 0 {
                let mut at = 0;
                while at + size <= kept[line].len() {
                    let one = ["1"];
                    let shorter: [&[&str]; 2] = [&[], &one];
                    let ways = if size > 1 { &shorter[..] } else { &shorter[..1] };
                    let found = ways.iter().find_map(|instead| {
                        let mut fewer = kept.clone();
                        fewer[line].splice(at..at + size, instead.iter().copied());
                        holds(&whole(&fewer)).then_some(fewer)
                    });
                    match found {
                        Some(fewer) => (kept, smaller) = (fewer, true),
                        None => at += 1,
                    }
                }
                size -= 1;
            }
        }
    }
    whole(&kept)
}

/// The words and signs of a line.
fn split(line: &str) -> Vec<&str> {
    let mut words = vec![];
    let mut rest = line;
    while let Some(first) = rest.chars().next() {
        let word = |c: char| c.is_alphanumeric() || matches!(c, '.' | '_' | '$');
        let length = match word(first) {
            true => rest.find(|c| !word(c)).unwrap_or(rest.len()),
            false => first.len_utf8(),
        };
        let (next, others) = rest.split_at(length);
        words.push(next);
        rest = others;
    }
    words
}

fn joined(lines: &[&str]) -> String {
    lines.iter().flat_map(|line| [line, "\n"]).collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn only_the_lines_that_matter_are_left() {
        let text: String = (0..100).map(|i| format!("{i}\n")).collect();
        let holds = |text: &str| {
            let has = |line| text.lines().any(|l| l == line);
            // 17 matters; 30 and 40 stand or fall together.
            has("17") && has("30") == has("40")
        };
        assert_eq!(super::lines(&text, holds), "17\n");
    }

    #[test]
    fn only_the_words_that_matter_are_left() {
        let holds = |text: &str| text.contains("M7") && text.matches('(').count() == 1;
        assert_eq!(super::words("P1=INT(P2+M7)\nM7=3\n", holds), "(\nM7\n");
    }
}
