//! What the machine file says of variables, in columns: another name, what it is, the device, the terminal. In a narrow terminal
//! they give way to everything else.

use plcc_screen::fitted;

use crate::view::Said;

/// The blanks in front of a column.
const GAP: usize = 2;
/// The titles of the columns.
const TITLES: [&str; 4] = ["alias", "text", "device", "at"];
/// How wide each column is at most.
const WIDEST: [usize; 4] = [16, 40, 12, 12];
/// The column of the text, which is cut where there is not room for all of it.
const TEXT: usize = 1;
/// To how many cells the text is cut before another column is left out.
const SHORTEST_TEXT: usize = 8;
/// The columns in the order in which they are left out.
const LEFT_OUT: [usize; 4] = [3, 2, 0, TEXT];

/// The columns that there is room for.
pub(super) struct SaidColumns {
    /// The width of each column; 0 of one that is left out, or of which nothing is said.
    widths: [usize; 4],
}

impl SaidColumns {
    /// The columns of a list's rows, in a width of `room` cells.
    pub(super) fn new<'s>(rows: impl Iterator<Item = &'s Said>, room: usize) -> Self {
        let mut widths = [0; 4];
        for said in rows {
            for (width, text) in widths.iter_mut().zip(texts(said)) {
                *width = text.chars().count().max(*width);
            }
        }
        for ((width, title), widest) in widths.iter_mut().zip(TITLES).zip(WIDEST) {
            if *width > 0 {
                *width = (*width).clamp(title.len(), widest);
            }
        }
        // The whole columns, then fewer and fewer.
        for left_out in LEFT_OUT.map(Some).into_iter().chain([None]) {
            let mut columns = Self { widths };
            let missing = columns.width().saturating_sub(room);
            if let Some(text) = columns.widths.get_mut(TEXT).filter(|text| **text > 0) {
                *text = text.saturating_sub(missing).max(SHORTEST_TEXT.min(*text));
            }
            if columns.width() <= room {
                return columns;
            }
            if let Some(width) = left_out.and_then(|column| widths.get_mut(column)) {
                *width = 0;
            }
        }
        Self { widths: [0; 4] }
    }

    /// How many cells the columns take.
    pub(super) fn width(&self) -> usize {
        self.widths.iter().filter(|width| **width > 0).map(|width| width + GAP).sum()
    }

    /// The titles, each over its column.
    pub(super) fn titles(&self) -> String {
        self.in_columns(TITLES)
    }

    /// What is said of a variable.
    pub(super) fn row(&self, said: &Said) -> String {
        self.in_columns(texts(said))
    }

    fn in_columns(&self, texts: [&str; 4]) -> String {
        let shown = self.widths.iter().zip(texts).filter(|(width, _)| **width > 0);
        shown.map(|(&width, text)| format!("{:GAP$}{}", "", fitted(text, width))).collect()
    }
}

fn texts(said: &Said) -> [&str; 4] {
    [&said.alias, &said.text, &said.device, &said.at]
}
