//! The lowering by itself, without the verifier before it: invalid IR gives an error, not code.
#![allow(clippy::unwrap_used)]

use cranelift_codegen::ir::Function;
use cranelift_frontend::FunctionBuilderContext;
use plcc_ir::Module;
use plcc_ir::text::parse;

use crate::{CodegenOptions, InternalError, Target};

fn module(body: &str) -> Module {
    let head = "image 16\nregion data at 0 size 16\ntask \"scan\" L0\n";
    parse(&format!("{head}fn \"f\" {{\nblock0 (L0):\n{body}\n}}\n")).unwrap()
}

fn lower(module: &Module, options: CodegenOptions) -> Result<(), InternalError> {
    clif_with(module, options).map(|_| ())
}

fn clif(module: &Module) -> Result<String, InternalError> {
    clif_with(module, CodegenOptions::NONE)
}

fn clif_with(module: &Module, options: CodegenOptions) -> Result<String, InternalError> {
    let target = Target::host().unwrap();
    let (_, func) = module.funcs().next().unwrap();
    let mut context = FunctionBuilderContext::new();
    let mut function = Function::new();
    super::function(module, func, &*target.isa, options, &mut function, &mut context)?;
    Ok(function.to_string())
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
        let error = lower(&module(body), CodegenOptions::NONE).unwrap_err();
        assert!(error.reason.contains(reason), "{body}: {}", error.reason);
    }
    let valid = "v0: i32 = load data:0\nv1: i8 = load data:3[v0 * 4, 4]\nstore data:15, v1\nreturn";
    assert_eq!(lower(&module(valid), CodegenOptions::NONE), Ok(()));
    let mut short = module(valid);
    short.image_size = 15;
    assert!(
        lower(&short, CodegenOptions::NONE)
            .unwrap_err()
            .reason
            .contains("it leaves its region `data`")
    );
    let mut without = module(valid);
    without.regions.clear();
    assert_eq!(
        lower(&without, CodegenOptions::NONE).unwrap_err().reason,
        "its region is not there"
    );
}

/// An index is compared once more only where no comparison before it shows that it is inside.
#[test]
fn an_index_that_was_checked_is_not_checked_again() {
    let index = "v0: i16 = load data:0\nv1: i32 = zext v0\n";
    let access = "v9: i8 = load data:4[v1 * 2, 5]\nstore data:15, v9\nreturn\n";
    for (head, blocks, again) in [
        ("v2: i32 = iconst 5\nv3: i1 = icmp ult v1, v2\nbrif v3, block1, block2", "", false),
        ("v2: i16 = iconst 5\nv3: i1 = icmp ult v0, v2\nbrif v3, block1, block2", "", false),
        ("v2: i32 = iconst 4\nv3: i1 = icmp ule v1, v2\nbrif v3, block1, block2", "", false),
        ("v2: i32 = iconst 5\nv3: i1 = icmp uge v1, v2\nbrif v3, block2, block1", "", false),
        ("v2: i32 = iconst 3\nv3: i1 = icmp ult v1, v2\nbrif v3, block1, block2", "", false),
        // A block between them.
        (
            "v2: i32 = iconst 5\nv3: i1 = icmp ult v1, v2\nbrif v3, block3, block2",
            "block3:\njump block1\n",
            false,
        ),
        // The limit is too high, the comparison is signed or of another value, or the access is on
        // the other side.
        ("v2: i32 = iconst 6\nv3: i1 = icmp ult v1, v2\nbrif v3, block1, block2", "", true),
        ("v2: i32 = iconst 5\nv3: i1 = icmp ule v1, v2\nbrif v3, block1, block2", "", true),
        ("v2: i32 = iconst 5\nv3: i1 = icmp slt v1, v2\nbrif v3, block1, block2", "", true),
        (
            "v2: i32 = iconst 5\nv4: i32 = load data:8\nv3: i1 = icmp ult v4, v2\n\
             brif v3, block1, block2",
            "",
            true,
        ),
        ("v2: i32 = iconst 5\nv3: i1 = icmp ult v1, v2\nbrif v3, block2, block1", "", true),
        // Another way leads to the access: a jump, or both sides of the branch.
        (
            "v2: i32 = iconst 5\nv3: i1 = icmp ult v1, v2\nbrif v3, block1, block3",
            "block3:\njump block1\n",
            true,
        ),
        ("v2: i32 = iconst 5\nv3: i1 = icmp ult v1, v2\nbrif v3, block1, block1", "", true),
    ] {
        let body = format!("{index}{head}\nblock1:\n{access}block2:\nreturn\n{blocks}");
        let text = clif(&module(&body)).unwrap();
        assert_eq!(text.contains("select"), again, "{body}\n{text}");
    }
}

/// An index is compared only where the instructions that compute it do not show that it is inside.
#[test]
fn an_index_that_is_surely_inside_is_not_checked() {
    for (index, count, compared) in [
        ("v1: i32 = iconst 3\nv2: i32 = and v0, v1\nv9: i32 = add v2, v1", 7, false),
        ("v1: i32 = iconst 3\nv2: i32 = and v0, v1\nv9: i32 = add v2, v1", 6, true),
        (
            "v1: i64 = zext v0\nv2: i64 = iconst 3\nv3: i64 = and v1, v2\nv9: i32 = trunc v3",
            4,
            false,
        ),
        (
            "v1: i64 = zext v0\nv2: i64 = iconst 3\nv3: i64 = add v1, v2\nv9: i32 = trunc v3",
            7,
            true,
        ),
        ("v1: i32 = iconst 5\nv9: i32 = urem v0, v1", 5, false),
        ("v1: i32 = iconst -1\nv9: i32 = and v0, v1", 5, true),
        ("v1: i32 = iconst 2147483647\nv2: i32 = and v0, v1\nv9: i32 = add v2, v1", 5, true),
        ("v1: i32 = iconst 3\nv2: i32 = and v0, v1\nv9: i32 = sub v2, v1", 5, true),
    ] {
        let body = format!(
            "v0: i32 = load data:0\n{index}\nv10: i8 = load data:4[v9 * 1, {count}]\n\
             store data:15, v10\nreturn"
        );
        let text = clif(&module(&body)).unwrap();
        assert_eq!(text.contains("select"), compared, "{body}\n{text}");
    }
}

/// A guard of several conditions branches by each of them; other branches join theirs.
#[test]
fn the_conditions_of_a_guard_are_branched_by_one_by_one() {
    for (cold, op, targets, branches) in [
        (" cold", "or", "block1, block2", 3),
        (" cold", "and", "block2, block1", 3),
        (" cold", "and", "block1, block2", 1),
        ("", "or", "block1, block2", 1),
    ] {
        let body = format!(
            "v0: i16 = load data:0\nv1: i16 = load data:2\nv2: i16 = load data:4\n\
             v3: i1 = icmp eq v0, v1\nv4: i1 = icmp slt v1, v2\nv5: i1 = icmp ult v0, v2\n\
             v6: i1 = {op} v3, v4\nv7: i1 = {op} v6, v5\nbrif v7, {targets}\n\
             block1{cold}:\nstore data:8, v0\nreturn\nblock2:\nstore data:10, v1\nreturn"
        );
        let text = clif(&module(&body)).unwrap();
        assert_eq!(text.matches("brif").count(), branches, "{body}\n{text}");
    }
}

/// The index is widened where its narrow value is defined, and compared in the same register.
#[test]
fn an_index_is_widened_once() {
    let body = "v0: i16 = load data:0\nv1: i32 = zext v0\nv2: i32 = iconst 5\n\
                v3: i1 = icmp ult v1, v2\nbrif v3, block1, block2\nblock1:\n\
                v4: i8 = load data:4[v1 * 2, 5]\nstore data:15, v4\nreturn\nblock2:\nreturn";
    let text = clif(&module(body)).unwrap();
    assert_eq!(text.matches("uextend").count(), 1, "{text}");
}

/// All traps of a function leave it in one block.
#[test]
fn traps_of_a_function_share_their_exit() {
    let head = "image 16\nregion data at 0 size 16\ntask \"scan\" L0\nfn \"f\" {\nblock0 (L0):\n";
    let text = format!(
        "{head}v0: i32 = load data:0\nv1: i1 = bit v0, 0\nbrif v1, block1, block2\nblock1:\n\
         v2: i32 = iconst 0\ntrap_at v2, v0\nblock2:\nv3: i32 = iconst 1\ntrap_at v3, v0\n}}\n\
         trap_site timeout file 0 line 1\ntrap_site call_depth file 0 line 2\n"
    );
    let text = clif(&parse(&text).unwrap()).unwrap();
    assert_eq!(text.matches("return").count(), 1, "{text}");
}

/// A guard's conditions have branches of their own unless they were joined in 32 bits, where the load of one
/// of them is part of the instruction that joins them.
#[test]
fn conditions_of_a_guard_that_were_joined_in_32_bits_are_not_computed_again() {
    let text = "image 16\nregion bits at 0 size 16 bits\ntask \"scan\" L0\nfn \"f\" {\nblock0 (L0):\n\
                v0: i1 = iconst 0\nv1: i1 = load bits:12\nv2: i1 = and v0, v1\nbrif v2, block1, block2\n\
                block1:\nreturn\nblock2 cold:\nreturn\n}\n";
    let module = parse(text).unwrap();
    let wide_bits = CodegenOptions { wide_bits: true, ..CodegenOptions::NONE };
    assert_eq!(lower(&module, wide_bits), Ok(()));
}

/// A constant that is often used is loaded once, where the function is entered, and in cold code that calls the host.
#[test]
fn doubles_that_are_used_often_are_loaded_once() {
    let multiply = |count: usize| {
        let one = |n: usize| {
            format!(
                "v{}: f64 = load data:0\nv{}: f64 = fmul v{0}, v0\nstore data:8, v{1}\n",
                2 * n + 1,
                2 * n + 2
            )
        };
        let body: String = (0..count).map(one).collect();
        format!("v0: f64 = fconst 0.3\n{body}return")
    };
    let loads = |body: &str, options: CodegenOptions| {
        clif_with(&module(body), options).unwrap().matches("vconst").count()
    };
    if cfg!(target_arch = "x86_64") {
        assert_eq!(loads(&multiply(6), CodegenOptions::ALL), 1);
        assert_eq!(
            loads(&multiply(6), CodegenOptions { double_constants: false, ..CodegenOptions::ALL }),
            6
        );
        assert_eq!(loads(&multiply(5), CodegenOptions::ALL), 5);
    }
}

/// Checks of variables at a function's entry are made in vectors, of neighbours and of others.
#[test]
fn checks_of_variables_are_made_in_vectors() {
    let text = |count: usize, finite: &str| {
        let check = |n: usize| {
            let (at, v) = (if n == 2 { 40 } else { 8 * n }, 4 * n);
            let label = if n == 0 { " (L0)" } else { "" };
            format!(
                "block{n}{label}:\nv{v}: f64 = load data:{at}\nv{}: i32 = ftoi v{v}\n\
                 v{}: i1 = is_integer_or_nan v{v}\nbrif v{1}, block{}, block{}\n",
                v + 1,
                v + 3,
                n + 1,
                count + 1
            )
        };
        let checks: String = (0..count).map(check).collect();
        format!(
            "image 64\nregion data at 0 size 64{finite}\ntask \"scan\" L0\nfn \"f\" {{\n{checks}\
             block{count}:\nv90: i64 = sext v1\nstore data:48, v90\nv91: i32 = add v5, v9\nstore data:56, v91\nreturn\n\
             block{} cold:\nreturn\n}}\n",
            count + 1
        )
    };
    let has_vectors = |text: &str, options: CodegenOptions| {
        clif_with(&parse(text).unwrap(), options).unwrap().contains("vany_true")
    };
    if cfg!(target_arch = "x86_64") {
        assert!(has_vectors(&text(4, " finite"), CodegenOptions::ALL));
        assert!(!has_vectors(&text(3, " finite"), CodegenOptions::ALL));
        assert!(!has_vectors(&text(4, ""), CodegenOptions::ALL));
        assert!(!has_vectors(
            &text(4, " finite"),
            CodegenOptions { vectors: false, ..CodegenOptions::ALL }
        ));
    }
}
