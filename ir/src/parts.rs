//! Parts of a program that are compiled one after the other.
//!
//! Functions that seldom run ([`FuncData::is_optimized_for_size`]) need not be compiled before a program starts. A
//! compiler that compiles just in time takes them out of the module and compiles them when control first comes to one of
//! their labels. Labels, statements and trap sites have the same numbers in both parts.

use crate::{FuncData, Module};

impl Module {
    /// Takes the functions that seldom run out of the module; `None` if it has none, or if they have more than `most`
    /// instructions. The module and the result are parts of the program then: a label that is in no function of one
    /// of them is in a function of the other.
    pub fn split_off_rare(&mut self, most: usize) -> Option<Self> {
        let mut rare = self.funcs.iter().filter(|func| seldom_runs(func)).peekable();
        rare.peek()?;
        if rare.map(FuncData::inst_count).sum::<usize>() > most {
            return None;
        }
        let all = std::mem::take(&mut self.funcs);
        let (rare, usual) = all.into_iter().partition(seldom_runs);
        // Neither code nor its tables need the texts of the sources, which may be long.
        let files = std::mem::take(&mut self.files);
        let mut rest = self.clone();
        self.files = files;
        (self.funcs, rest.funcs) = (usual, rare);
        Some(rest)
    }
}

/// Whether a function was marked as one that seldom runs. One without instructions, which takes no time to compile, is
/// optimised for size without being marked.
fn seldom_runs(func: &FuncData) -> bool {
    func.is_optimized_for_size() && func.blocks().any(|(_, block)| block.optimize_for_size)
}

#[cfg(test)]
mod tests {
    use crate::InstBuilder;
    use crate::{ChunkBuilder, verify};

    #[test]
    fn a_module_is_split_into_functions_that_run_and_such_that_seldom_do() {
        let mut builder = ChunkBuilder::new(8, vec![]);
        let (start, rare) = (builder.place(), builder.place());
        builder.bind(start);
        builder.task("scan", start);
        let cond = builder.func().constant(crate::Type::I1, 0);
        let next = builder.place();
        builder.brif(cond, rare, next);
        builder.bind(next);
        builder.ret();
        builder.begin_function();
        builder.bind(rare);
        builder.func().set_optimize_for_size(true);
        builder.func().constant(crate::Type::I32, 1);
        builder.ret();
        builder.func().set_optimize_for_size(false);
        // A function without instructions stays.
        builder.begin_function();
        let empty = builder.place();
        builder.bind(empty);
        builder.task("empty", empty);
        builder.ret();
        let mut module = builder.finish();
        let whole = module.clone();
        let rare = whole.funcs[1].inst_count();
        assert!(rare > 0 && module.split_off_rare(rare - 1).is_none());
        let rest = module.split_off_rare(rare).unwrap();
        assert_eq!((module.funcs.len(), rest.funcs.len()), (2, 1));
        for (part, labels) in [(&module, 2), (&rest, 1)] {
            assert_eq!(verify::part(part), []);
            let targets = part.label_targets();
            assert_eq!(targets.len(), whole.label_targets().len());
            assert_eq!(targets.values().filter(|target| target.is_some()).count(), labels);
        }
        assert!(module.split_off_rare(rare).is_none());
        // A whole program has all of its labels.
        assert_eq!(verify::verify(&module).len(), 1);
    }
}
