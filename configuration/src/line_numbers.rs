//! Which line of a text an offset is in.

/// Where the lines of a text begin.
#[derive(Clone, Debug)]
pub struct LineNumbers {
    /// The offsets of all line feeds.
    ends: Vec<usize>,
}

impl LineNumbers {
    /// Finds the lines of a text.
    pub fn new(text: &str) -> Self {
        let ends = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        Self { ends: ends.map(|(at, _)| at).collect() }
    }

    /// The line, from 1, of an offset in bytes; of one beyond the end the last line.
    pub fn line(&self, offset: usize) -> usize {
        self.ends.partition_point(|&end| end < offset) + 1
    }
}

#[cfg(test)]
mod tests {
    use super::LineNumbers;

    #[test]
    fn a_line_ends_with_its_line_feed() {
        let lines = LineNumbers::new("a\n\nbc\n");
        let all: Vec<_> = (0..8).map(|offset| lines.line(offset)).collect();
        assert_eq!(all, [1, 1, 2, 3, 3, 3, 4, 4]);
        assert_eq!(LineNumbers::new("").line(0), 1);
    }
}
