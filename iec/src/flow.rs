//! Control flow: statements in a row, of which some jump, become IFs. Jumps that are not part of an IF, and places where a call
//! begins anywhere but at the first statement, are not in the standard's language: the statements are then blocks of a CASE in a
//! loop, and a variable holds the number of the block that is next. A block's number is that of its first statement, from 1.

use std::collections::BTreeSet;

use crate::expression::Expression;
use crate::text::comment;

/// What an item does.
#[derive(Clone, Debug)]
pub enum Step {
    /// Statements that control runs through, a line each.
    Do(Vec<String>),
    /// Goes on with the next item if the condition holds, otherwise with the later item `otherwise`. `before` is done first.
    Branch {
        /// Lines.
        before: Vec<String>,
        /// A bit.
        condition: Expression,
        /// A number of an item.
        otherwise: usize,
    },
    /// Goes on with another item; `ends_body` says that it is the end of an IF's body, in front of the other body. A jump
    /// after the last item ends the call.
    Jump {
        /// A number of an item.
        to: usize,
        /// Whether no statement says so.
        ends_body: bool,
    },
    /// Lines of which the last ones set the number of the next block.
    Leave(Vec<String>),
}

/// A statement with its comments.
#[derive(Clone, Debug)]
pub struct Item {
    /// Comments in front, a line each.
    pub comments: Vec<String>,
    /// The comment after it, or none.
    pub behind: String,
    /// What it does.
    pub step: Step,
}

impl From<Step> for Item {
    fn from(step: Step) -> Self {
        Self { comments: vec![], behind: String::new(), step }
    }
}

/// The beginning of an IF whose body is executed where a condition does not hold.
fn if_not(condition: &Expression) -> String {
    format!("IF {} THEN", condition.clone().inverted().into_text())
}

/// How deep IFs may stand in one another.
const MAX_DEPTH: usize = 100;

/// The statements of a program.
#[derive(Debug)]
pub struct Flow<'a> {
    items: &'a [Item],
    /// Where blocks begin.
    leaders: BTreeSet<usize>,
    /// For each item that is a branch, and an IF, its end.
    ends: Vec<Option<usize>>,
    /// All those ends.
    joins: BTreeSet<usize>,
    /// The variable with the number of the next block.
    next: &'a str,
}

/// The number of the block that begins with an item.
pub(crate) fn block(item: usize) -> usize {
    item + 1
}

impl<'a> Flow<'a> {
    /// Finds out what are IFs and where blocks begin. `entries` are further items at which blocks have to begin; `next` is
    /// the variable with the number of the next block.
    pub fn new(items: &'a [Item], entries: impl IntoIterator<Item = usize>, next: &'a str) -> Self {
        let mut leaders: BTreeSet<usize> = entries.into_iter().collect();
        leaders.extend(items.iter().filter_map(|item| match item.step {
            Step::Jump { to, ends_body: false } => Some(to),
            _ => None,
        }));
        let mut this =
            Self { items, leaders, ends: vec![None; items.len()], joins: BTreeSet::new(), next };
        while this.find_ends() {}
        this.leaders.retain(|&item| item < items.len());
        this.joins = this.ends.iter().flatten().copied().collect();
        this
    }

    /// Whether there is more than one block, so that the variable with the number of the next one is needed.
    pub fn has_blocks(&self) -> bool {
        self.leaders.iter().any(|&item| item > 0)
    }

    /// Finds the branches that are IFs. Says whether there are more blocks now, because of branches that are not.
    fn find_ends(&mut self) -> bool {
        let before = self.leaders.len();
        // The ends of the IFs around an item, and where their ELSE begins.
        let mut open: Vec<(usize, usize)> = vec![];
        for at in 0..self.items.len() {
            while open.last().is_some_and(|(end, _)| *end <= at) {
                open.pop();
            }
            let Some(Step::Branch { before, otherwise, .. }) =
                self.items.get(at).map(|it| &it.step)
            else {
                continue;
            };
            let (end, jump) = match self.jump_before(*otherwise) {
                Some(to) if *otherwise > at + 1 && to >= *otherwise => (to, true),
                _ => (*otherwise, false),
            };
            let fits = end <= open.last().map_or(self.items.len(), |(end, _)| *end);
            let goes_on = before.is_empty() && open.last() == Some(&(end, at));
            let is_if = *otherwise > at
                && fits
                && self.leaders.range(at + 1..end).next().is_none()
                && (goes_on || open.len() < MAX_DEPTH);
            if let Some(slot) = self.ends.get_mut(at) {
                *slot = is_if.then_some(end);
            }
            if !is_if {
                self.leaders.insert(*otherwise);
                if jump {
                    self.leaders.insert(end);
                }
            } else if goes_on {
                if let Some(last) = open.last_mut() {
                    last.1 = *otherwise;
                }
            } else {
                open.push((end, *otherwise));
            }
        }
        self.leaders.len() > before
    }

    /// Where the jump at the end of the body in front of an item goes.
    fn jump_before(&self, item: usize) -> Option<usize> {
        match self.items.get(item.checked_sub(1)?)?.step {
            Step::Jump { to, ends_body: true } => Some(to),
            _ => None,
        }
    }

    /// The text, a line each. `while_true` is the condition on which a loop of blocks goes on, and `first` what it does before
    /// each block.
    pub fn text(&self, while_true: &str, first: &[String]) -> Vec<String> {
        let mut out = Text { lines: vec![], depth: 0 };
        if !self.has_blocks() {
            self.write(&mut out, 0, self.items.len(), true);
            return out.lines;
        }
        out.line(format!("WHILE {while_true} DO"));
        out.depth += 1;
        first.iter().for_each(|line| out.line(line.clone()));
        out.line("REPEAT");
        out.depth += 1;
        out.line(format!("CASE {} OF", self.next));
        out.depth += 1;
        let mut begin = 0;
        let ends = self.leaders.iter().copied().filter(|&item| item > 0);
        for end in ends.chain([self.items.len()]) {
            out.line(format!("{}:", block(begin)));
            out.depth += 1;
            self.write(&mut out, begin, end, true);
            if self.falls_through(end) {
                let next = if end < self.items.len() { block(end) } else { 0 };
                out.line(format!("{} := {next};", self.next));
            }
            out.depth -= 1;
            begin = end;
        }
        out.depth -= 1;
        out.line("END_CASE;");
        out.depth -= 1;
        out.line("UNTIL TRUE");
        out.line("END_REPEAT;");
        out.depth -= 1;
        out.line("END_WHILE;");
        out.lines
    }

    /// Whether control goes from the block in front of an item to it by itself.
    fn falls_through(&self, item: usize) -> bool {
        let last = item.checked_sub(1).and_then(|last| self.items.get(last));
        !matches!(last.map(|item| &item.step), Some(Step::Jump { .. } | Step::Leave(_)))
            // The last statement may be the end of a body.
            || self.joins.contains(&item)
    }

    /// Writes items from one to another. `outside` says that no IF is around them.
    fn write(&self, out: &mut Text, begin: usize, end: usize, outside: bool) {
        let mut at = begin;
        while at < end {
            let Some(item) = self.items.get(at) else { return };
            item.comments.iter().for_each(|it| out.line(comment(it)));
            let from = out.lines.len();
            match &item.step {
                Step::Do(lines) => lines.iter().for_each(|line| out.line(line.clone())),
                Step::Branch { before, condition, otherwise } => {
                    before.iter().for_each(|line| out.line(line.clone()));
                    match self.ends.get(at).copied().flatten() {
                        Some(end) => {
                            self.write_if(out, at, end);
                            at = end;
                            continue;
                        }
                        None => {
                            out.line(if_not(condition));
                            out.behind(from, &item.behind);
                            out.depth += 1;
                            self.jump(out, *otherwise);
                            out.line("EXIT;");
                            out.depth -= 1;
                            out.line("END_IF;");
                        }
                    }
                }
                Step::Jump { to, .. } => {
                    self.jump(out, *to);
                    if !outside || at + 1 < end || !self.has_blocks() {
                        out.line("EXIT;");
                    }
                }
                Step::Leave(lines) => {
                    lines.iter().for_each(|line| out.line(line.clone()));
                    if !outside || at + 1 < end {
                        out.line("EXIT;");
                    }
                }
            }
            if !matches!(item.step, Step::Branch { .. }) {
                out.behind(from, &item.behind);
            }
            at += 1;
        }
    }

    fn jump(&self, out: &mut Text, to: usize) {
        if self.has_blocks() {
            let next = if to < self.items.len() { block(to) } else { 0 };
            out.line(format!("{} := {next};", self.next));
        }
    }

    /// Writes an IF with its ELSIFs. The standard has no IF without a statement in it.
    fn write_if(&self, out: &mut Text, mut at: usize, end: usize) {
        let mut word = "IF";
        loop {
            let Some(item) = self.items.get(at) else { return };
            let Step::Branch { condition, otherwise, .. } = &item.step else { return };
            let other = *otherwise;
            let has_other = other < end;
            // The jump in front of an ELSE, also of an empty one, is not a statement.
            let jumps = other > at + 1 && self.jump_before(other) == Some(end);
            let mut body = self.body(out.depth, at + 1, other - usize::from(jumps));
            if !has_statements(&body) && word == "IF" {
                let rest = self.body(out.depth, other, end);
                if !has_statements(&rest) {
                    out.lines.extend(body.into_iter().chain(rest));
                    return;
                }
                let from = out.lines.len();
                out.line(if_not(condition));
                out.behind(from, &item.behind);
                out.lines.extend(body.into_iter().chain(rest));
                break;
            }
            if !has_statements(&body) {
                body.push(format!("{}{NOTHING}", "  ".repeat(out.depth + 1)));
            }
            let from = out.lines.len();
            out.line(format!("{word} {} THEN", condition.clone().into_text()));
            out.behind(from, &item.behind);
            out.lines.extend(body);
            if !has_other {
                break;
            }
            match self.items.get(other).map(|it| (&it.step, &it.comments)) {
                Some((Step::Branch { before, .. }, comments))
                    if before.is_empty()
                        && comments.is_empty()
                        && self.ends.get(other) == Some(&Some(end)) =>
                {
                    (word, at) = ("ELSIF", other);
                }
                _ => {
                    let rest = self.body(out.depth, other, end);
                    if has_statements(&rest) {
                        out.line("ELSE");
                    }
                    out.lines.extend(rest);
                    break;
                }
            }
        }
        out.line("END_IF;");
    }

    /// The lines of a body.
    fn body(&self, depth: usize, begin: usize, end: usize) -> Vec<String> {
        let mut out = Text { lines: vec![], depth: depth + 1 };
        self.write(&mut out, begin, end, false);
        out.lines
    }
}

/// A statement that does nothing, where one has to stand.
pub const NOTHING: &str = "NOTHING := FALSE;";

fn has_statements(lines: &[String]) -> bool {
    lines.iter().any(|line| !line.trim_start().starts_with("(*"))
}

/// Lines that are written.
struct Text {
    lines: Vec<String>,
    depth: usize,
}

impl Text {
    fn line(&mut self, text: impl Into<String>) {
        let text: String = text.into();
        self.lines.push(format!("{}{text}", "  ".repeat(self.depth)));
    }

    /// Puts a comment after the first line that was written from `from` on.
    fn behind(&mut self, from: usize, text: &str) {
        if let Some(line) = self.lines.get_mut(from).filter(|_| !text.is_empty()) {
            line.push(' ');
            line.push_str(&comment(text));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn items(steps: Vec<Step>) -> Vec<Item> {
        steps.into_iter().map(Item::from).collect()
    }

    fn does(text: &str) -> Step {
        Step::Do(vec![format!("{text};")])
    }

    fn branch(condition: &str, otherwise: usize) -> Step {
        Step::Branch { before: vec![], condition: Expression::name(condition), otherwise }
    }

    fn text(steps: Vec<Step>) -> String {
        let items = items(steps);
        Flow::new(&items, [], "NEXT").text("NEXT <> 0", &[]).join("\n")
    }

    #[test]
    fn branches_become_if_elsif_and_else() {
        let end = |to| Step::Jump { to, ends_body: true };
        let steps = vec![
            branch("A", 3),
            does("X"),
            end(7),
            branch("B", 6),
            does("Y"),
            end(7),
            does("Z"),
            does("LAST"),
        ];
        assert_eq!(text(steps), "IF A THEN\n  X;\nELSIF B THEN\n  Y;\nELSE\n  Z;\nEND_IF;\nLAST;");
        assert_eq!(text(vec![branch("A", 1)]), "");
        let end = |to| Step::Jump { to, ends_body: true };
        let steps = vec![branch("A", 2), end(3), does("X")];
        assert_eq!(text(steps), "IF NOT A THEN\n  X;\nEND_IF;");
        let steps = vec![branch("A", 3), does("X"), end(6), branch("B", 5), end(6), does("Y")];
        assert_eq!(
            text(steps),
            "IF A THEN\n  X;\nELSIF B THEN\n  NOTHING := FALSE;\nELSE\n  Y;\nEND_IF;"
        );
    }

    #[test]
    fn a_jump_into_an_if_makes_blocks() {
        let go = Step::Jump { to: 3, ends_body: false };
        let end = Step::Jump { to: 6, ends_body: true };
        let steps =
            vec![branch("A", 2), go, branch("B", 5), does("X"), end, does("Y"), does("LAST")];
        assert_eq!(
            text(steps),
            "WHILE NEXT <> 0 DO\n  REPEAT\n    CASE NEXT OF\n      1:\n        IF A THEN\n          NEXT := 4;\n          EXIT;\n\
             \x20       END_IF;\n        IF NOT B THEN\n          NEXT := 6;\n          EXIT;\n        END_IF;\n        NEXT := 4;\n\
             \x20     4:\n        X;\n        NEXT := 7;\n      6:\n        Y;\n        NEXT := 7;\n      7:\n        LAST;\n\
             \x20       NEXT := 0;\n    END_CASE;\n  UNTIL TRUE\n  END_REPEAT;\nEND_WHILE;"
        );
    }
}
