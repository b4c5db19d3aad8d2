//! Parts of a program that are compiled one after the other.
//!
//! Functions that seldom run ([`FuncData::is_optimized_for_size`]) need not be compiled before a program starts. A
//! compiler that compiles just in time takes them out of the module and compiles them when control first comes to one of
//! their labels. Labels, statements and trap sites have the same numbers in both parts.

use crate::{FuncData, Module};

impl Module {
    /// Takes the functions that seldom run out of the module; `None` if it has none. The module and the result are
    /// [parts](Module::is_part) of the program then.
    pub fn split_off_rare(&mut self) -> Option<Self> {
        if !self.funcs.iter().any(FuncData::is_optimized_for_size) {
            return None;
        }
        let all = std::mem::take(&mut self.funcs);
        let (rare, usual) = all.into_iter().partition(FuncData::is_optimized_for_size);
        self.is_part = true;
        // Neither code nor its tables need the texts of the sources, which may be long.
        let files = std::mem::take(&mut self.files);
        let mut rest = self.clone();
        self.files = files;
        (self.funcs, rest.funcs) = (usual, rare);
        Some(rest)
    }
}

#[cfg(test)]
mod tests {
    use crate::{ChunkBuilder, verify};

    #[test]
    fn a_module_is_split_into_functions_that_run_and_such_that_seldom_do() {
        let mut builder = ChunkBuilder::new(8, vec![]);
        let (start, rare) = (builder.place(), builder.place());
        builder.bind(start);
        builder.task("scan", start);
        let cond = builder.ins().iconst(crate::Type::I1, 0);
        let next = builder.place();
        builder.brif(cond, rare, next);
        builder.bind(next);
        builder.ret();
        builder.begin_function();
        builder.bind(rare);
        builder.ins().set_optimize_for_size(true);
        builder.ret();
        let mut module = builder.finish();
        let whole = module.clone();
        let rest = module.split_off_rare().unwrap();
        assert_eq!((module.funcs.len(), rest.funcs.len()), (1, 1));
        for part in [&module, &rest] {
            assert_eq!(verify::verify(part), []);
            let targets = part.label_targets();
            assert_eq!(targets.len(), whole.label_targets().len());
            assert_eq!(targets.iter().filter(|target| target.is_some()).count(), 1);
        }
        assert!(module.split_off_rare().is_none());
        // Both functions have to be somewhere if the module is no part.
        module.is_part = false;
        assert_eq!(verify::verify(&module).len(), 1);
    }
}
