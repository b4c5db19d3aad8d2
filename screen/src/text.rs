//! Texts in rows of cells.

/// A text in rows of at most `width` cells, divided between words where that is possible; at least one row.
pub fn word_rows(text: &str, width: usize) -> Vec<String> {
    if text.chars().count() <= width {
        return vec![text.to_owned()];
    }
    let mut rows = vec![String::new()];
    for word in text.split(' ') {
        let word: Vec<char> = word.chars().collect();
        for (number, part) in word.chunks(width.max(1)).enumerate() {
            let used = rows.last().map_or(0, |row| row.chars().count());
            let gap = usize::from(number == 0 && used > 0);
            if used > 0 && used + gap + part.len() > width {
                rows.push(part.iter().collect());
            } else if let Some(row) = rows.last_mut() {
                row.extend(std::iter::repeat_n(' ', gap));
                row.extend(part);
            }
        }
    }
    rows
}

/// The first row that is shown of a list, so that the selected one is in sight.
pub fn first_shown(selected: usize, count: usize, height: usize) -> usize {
    let last_first = count.saturating_sub(height);
    selected.saturating_sub(height / 2).min(last_first)
}

/// A text of exactly this many cells.
pub fn fitted(text: &str, width: usize) -> String {
    let count = text.chars().count();
    if count <= width {
        return format!("{text}{}", " ".repeat(width - count));
    }
    let mut cut: String = text.chars().take(width.saturating_sub(1)).collect();
    cut.push('…');
    cut
}
