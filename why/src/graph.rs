//! Which conditions decide whether a statement is executed: the control dependences of a program, computed from the ways
//! behind its statements.
//!
//! A statement depends on a condition if it is executed whenever control goes one way behind the condition, and need not
//! be where it goes another way. That is found by post-dominators (Ferrante, Ottenstein and Warren, 1987; the tree as Cooper,
//! Harvey and Kennedy compute it, 2001).

use plcc_frontend::common::Ways;

/// A condition, and which of its ways leads to a statement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Guard {
    /// The number of the condition's statement.
    pub(crate) condition: u32,
    /// The index of the way in [`Ways::to`].
    pub(crate) way: usize,
}

/// The control dependences of a program.
#[derive(Debug)]
pub(crate) struct Graph {
    ways: Vec<Ways>,
    guards: Vec<Vec<Guard>>,
    /// By a statement's number: the statements that call the subroutine that it is in.
    callers: Vec<Vec<u32>>,
}

impl Graph {
    pub(crate) fn new(ways: Vec<Ways>) -> Self {
        let dominators = PostDominators::new(&ways);
        let mut guards: Vec<Vec<Guard>> = vec![vec![]; ways.len()];
        for (condition, node) in ways.iter().enumerate() {
            let Some((first, others)) = node.to.split_first() else { continue };
            if others.iter().all(|other| other == first) {
                continue;
            }
            let end = dominators.of(condition);
            for (way, &to) in node.to.iter().enumerate() {
                let mut at = to as usize;
                // A way back is the end of the round.
                if at <= condition {
                    continue;
                }
                while at != end && at < ways.len() {
                    if let Some(guards) = guards.get_mut(at) {
                        guards.push(Guard { condition: condition as u32, way });
                    }
                    at = dominators.of(at);
                }
            }
        }
        let callers = callers(&ways);
        Self { ways, guards, callers }
    }

    /// The number of statements.
    pub(crate) fn len(&self) -> usize {
        self.ways.len()
    }

    /// The conditions that a statement depends on, each with the way that leads to it.
    pub(crate) fn guards(&self, statement: u32) -> &[Guard] {
        self.guards.get(statement as usize).map_or(&[], Vec::as_slice)
    }

    /// The statements that call the subroutine that a statement is in.
    pub(crate) fn callers(&self, statement: u32) -> &[u32] {
        self.callers.get(statement as usize).map_or(&[], Vec::as_slice)
    }

    /// Which way behind a condition leads to the statement `next`; `None` is the end of the task.
    pub(crate) fn way_to(&self, condition: u32, next: Option<u32>) -> Option<usize> {
        let ways = &self.ways.get(condition as usize)?.to;
        let end = self.ways.len() as u32;
        ways.iter().position(|&to| next.map_or(to >= end, |next| to == next))
    }

    /// Whether a statement, or a subroutine that it is in, depends on a condition, directly or by others.
    pub(crate) fn depends(&self, statement: u32, condition: u32) -> bool {
        let mut seen = vec![];
        let mut open = vec![statement];
        while let Some(at) = open.pop() {
            if seen.contains(&at) {
                continue;
            }
            seen.push(at);
            let guards = self.guards(at).iter().map(|guard| guard.condition);
            for next in guards.chain(self.callers(at).iter().copied()) {
                if next == condition {
                    return true;
                }
                open.push(next);
            }
        }
        false
    }
}

/// By a statement's number: the statements that call a subroutine from whose beginning control comes to it.
fn callers(ways: &[Ways]) -> Vec<Vec<u32>> {
    let mut callers: Vec<Vec<u32>> = vec![vec![]; ways.len()];
    let mut calls: Vec<(u32, u32)> = vec![];
    for (at, node) in (0..).zip(ways) {
        calls.extend(node.calls.iter().map(|&to| (to, at)));
    }
    calls.sort_unstable();
    for group in calls.chunk_by(|a, b| a.0 == b.0) {
        let mut open: Vec<u32> = group.first().map(|call| call.0).into_iter().collect();
        let mut seen = vec![false; ways.len()];
        while let Some(at) = open.pop() {
            let Some(seen) = seen.get_mut(at as usize).filter(|seen| !**seen) else { continue };
            *seen = true;
            if let Some(callers) = callers.get_mut(at as usize) {
                callers.extend(group.iter().map(|call| call.1));
            }
            open.extend(ways.get(at as usize).into_iter().flat_map(|node| &node.to));
        }
    }
    callers
}

/// Of each statement the next one that every way behind it comes to; the end of the task stands behind all statements.
struct PostDominators {
    immediate: Vec<usize>,
    end: usize,
}

impl PostDominators {
    fn of(&self, statement: usize) -> usize {
        self.immediate.get(statement).copied().unwrap_or(self.end)
    }

    fn new(ways: &[Ways]) -> Self {
        let end = ways.len();
        // A way back ends the round: what stands behind a loop is not executed as long as the loop goes on.
        let to = |at: usize| -> Vec<usize> {
            let targets = ways.get(at).map_or(&[][..], |node| node.to.as_slice());
            let mut to: Vec<usize> = targets.iter().map(|&to| to as usize).collect();
            to.iter_mut().for_each(|to| *to = if *to <= at { end } else { (*to).min(end) });
            if to.is_empty() {
                to.push(end);
            }
            to
        };
        // All ways lead forwards, so that the statements from the last to the first are in an order in which all that follow
        // one are known when it is looked at.
        let mut immediate = vec![end; end];
        for at in (0..end).rev() {
            let common = to(at).into_iter().reduce(|mut a, mut b| {
                while a != b {
                    let lower = if a < b { &mut a } else { &mut b };
                    *lower = immediate.get(*lower).copied().unwrap_or(end);
                }
                a
            });
            if let Some(slot) = immediate.get_mut(at) {
                *slot = common.unwrap_or(end);
            }
        }
        Self { immediate, end }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guards(graph: &Graph, statement: u32) -> Vec<(u32, usize)> {
        graph.guards(statement).iter().map(|guard| (guard.condition, guard.way)).collect()
    }

    #[test]
    fn a_statement_depends_on_the_conditions_around_it() {
        // 0 IF a; 1 IF b; 2 x; (ELSE) 3 jump 5; 4 y; (ENDIF) 5 z
        let ways = [
            Ways::to([1, 5]),
            Ways::to([2, 4]),
            Ways::to([3]),
            Ways::to([5]),
            Ways::to([5]),
            Ways::to([6]),
        ];
        let graph = Graph::new(ways.to_vec());
        assert_eq!(guards(&graph, 2), [(1, 0)]);
        assert_eq!(guards(&graph, 4), [(1, 1)]);
        assert_eq!(guards(&graph, 1), [(0, 0)]);
        assert!(guards(&graph, 5).is_empty());
        assert!(graph.depends(2, 0) && !graph.depends(5, 0));
        assert_eq!((graph.way_to(1, Some(4)), graph.way_to(0, None)), (Some(1), None));
    }

    #[test]
    fn what_stands_behind_a_loop_depends_on_its_condition() {
        // 0 WHILE a; 1 x; 2 ENDWHILE; 3 y
        let ways = [Ways::to([1, 3]), Ways::to([2]), Ways::to([0]), Ways::to([4])];
        let graph = Graph::new(ways.to_vec());
        assert_eq!(guards(&graph, 1), [(0, 0)]);
        assert_eq!(guards(&graph, 3), [(0, 1)]);
    }

    #[test]
    fn a_subroutine_depends_on_its_callers() {
        // 0 IF a; 1 call 3; 2 end; 3 x; 4 return
        let call = Ways { to: vec![2], calls: vec![3] };
        let ways = [Ways::to([1, 2]), call, Ways::default(), Ways::to([4]), Ways::default()];
        let graph = Graph::new(ways.to_vec());
        assert_eq!((graph.callers(3), graph.callers(4)), (&[1][..], &[1][..]));
        assert!(graph.depends(4, 0) && graph.callers(1).is_empty());
    }
}
