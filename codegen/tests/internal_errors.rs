//! IR that breaks a rule of the verifier, handed to code generation directly: an error that says
//! where, and never code.
#![allow(clippy::unwrap_used, clippy::panic)]

use plcc_codegen::{CodegenError, CodegenOptions, InternalError, Target, compile, emit};
use plcc_ir::Module;
use plcc_ir::text::parse;

/// A module of one function with `body`, whose instructions belong to line 7 of mill.pmc.
fn module(body: &str) -> Module {
    let text = format!(
        "image 24\nregion data at 0 size 16\nregion bits at 16 size 8 bits\ntask \"scan\" L0\n\
         fn \"chunk0\" {{\nblock0 (L0):\n@0\n{body}\n}}\n\
         statement file 0 line 7 from 0 to 1\nfile \"mill.pmc\"\n| x\n"
    );
    parse(&text).unwrap()
}

fn internal(result: Result<impl Sized, CodegenError>, what: &str) -> InternalError {
    match result {
        Err(CodegenError::Internal(error)) => *error,
        Err(error) => panic!("{what}: {error}"),
        Ok(_) => panic!("{what}: there is code"),
    }
}

#[test]
fn invalid_instructions_are_named_with_their_place() {
    for (body, instruction, reason) in [
        ("v0: i8 = neg v1\nv1: i8 = iconst 1\nreturn", "inst0, Unary", "v1 is not defined"),
        ("v0: i16 = load data:15\nreturn", "inst0, Load", "bytes 15..17 of data"),
        ("v0: i8 = iconst 1\nstore data:16, v0\nreturn", "inst1, Store", "bytes 16..17 of data"),
        (
            "v0: i8 = iconst 1\nv1: i16 = iconst 1\nv2: i8 = add v0, v1\nreturn",
            "inst2, Binary",
            "operands are i8 and i16",
        ),
    ] {
        let module = module(body);
        for triple in ["x86_64-unknown-linux-gnu", "aarch64-unknown-linux-gnu"] {
            let target = Target::baseline(triple).unwrap();
            for error in [
                internal(compile(&module, &target, CodegenOptions::NONE), body),
                internal(emit::asm(&module, &target, CodegenOptions::NONE), body),
            ] {
                assert_eq!(error.function.as_deref(), Some("chunk0"), "{body}");
                let found = error.instruction.as_deref().unwrap();
                assert!(found.starts_with(instruction), "{body}: {found}");
                assert_eq!(error.place, Some(("mill.pmc".into(), 7)), "{body}");
                assert!(error.reason.contains(reason), "{body}: {}", error.reason);
                let text = error.to_string();
                assert!(text.contains("`chunk0`") && text.ends_with("(at mill.pmc:7)"), "{text}");
            }
        }
    }
}

#[test]
fn what_belongs_to_no_instruction_is_found_too() {
    type Change = fn(&mut Module);
    let changes: [(&str, Change); 4] = [
        ("region data ends at byte 16", |module| module.image_size = 15),
        ("L1 is at 0 places", |module| module.label_count = 2),
        ("task scan starts at L9", |module| module.tasks[0].entry = 9),
        ("statement", |module| module.statements[0].file = 1),
    ];
    for (reason, change) in changes {
        let mut module = module("v0: i16 = load data:0\nstore data:2, v0\nreturn");
        assert!(compile(&module, &Target::host().unwrap(), CodegenOptions::NONE).is_ok());
        change(&mut module);
        let error =
            internal(compile(&module, &Target::host().unwrap(), CodegenOptions::NONE), reason);
        assert!(error.reason.contains(reason), "{}", error.reason);
    }
}
