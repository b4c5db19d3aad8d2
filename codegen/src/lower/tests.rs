//! The lowering by itself, without the verifier before it: invalid IR gives an error, not code.
#![allow(clippy::unwrap_used)]

use cranelift_codegen::ir::Function;
use cranelift_frontend::FunctionBuilderContext;
use plcc_ir::Module;
use plcc_ir::text::parse;

use crate::{InternalError, Target};

fn module(body: &str) -> Module {
    let head = "image 16\nregion data at 0 size 16\ntask \"scan\" L0\n";
    parse(&format!("{head}fn \"f\" {{\nblock0 (L0):\n{body}\n}}\n")).unwrap()
}

fn lower(module: &Module) -> Result<(), InternalError> {
    let target = Target::host().unwrap();
    let (_, func) = module.funcs().next().unwrap();
    let mut context = FunctionBuilderContext::new();
    super::function(module, func, &*target.isa, &mut Function::new(), &mut context)
}

#[test]
fn impossible_ir_is_an_internal_error() {
    for (body, reason) in [
        ("v0: i8 = neg v1\nv1: i8 = iconst 1\nreturn", "v1 is used and not defined before"),
        ("v0: f64 = fneg v1\nv1: f64 = fconst 1\nreturn", "v1 is used and not defined before"),
        ("v0: i16 = load data:15\nreturn", "it leaves its region `data`"),
        ("v0: i32 = load data:0\nv1: i8 = load data:1[v0 * 4, 5]\nreturn", "it leaves its region"),
        ("goto_indirect v0\nblock1 (L1):\nv0: i32 = load data:0\nreturn", "v0 is used"),
    ] {
        let error = lower(&module(body)).unwrap_err();
        assert!(error.reason.contains(reason), "{body}: {}", error.reason);
    }
    let valid = "v0: i32 = load data:0\nv1: i8 = load data:3[v0 * 4, 4]\nstore data:15, v1\nreturn";
    assert_eq!(lower(&module(valid)), Ok(()));
    let mut short = module(valid);
    short.image_size = 15;
    assert!(lower(&short).unwrap_err().reason.contains("it leaves its region `data`"));
    let mut without = module(valid);
    without.regions.clear();
    assert_eq!(lower(&without).unwrap_err().reason, "its region is not there");
}
