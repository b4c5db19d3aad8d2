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
}
