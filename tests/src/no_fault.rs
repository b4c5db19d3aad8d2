//! Checks that no instruction of compiled code can raise a processor exception (a fault), such as a
//! division by zero. It reads Cranelift's IR (CLIF) as text, one instruction a line.
//!
//! It accepts operations that have a result for all operands, loads and stores that are marked as
//! never trapping (the IR verifier checks their addresses), calls of the host, and divisions whose
//! divisor is a constant other than 0 and -1 or was replaced by 1 where it is one of these.

use std::collections::HashMap;

/// Operations of CLIF that have a result for all operands.
const TOTAL: &[&str] = &[
    "iconst",
    "f64const",
    "iadd",
    "isub",
    "imul",
    "umulhi",
    "band",
    "bor",
    "bxor",
    "band_not",
    "bnot",
    "clz",
    "ineg",
    "ishl",
    "ushr",
    "sshr",
    "smin",
    "smax",
    "umin",
    "umax",
    "icmp",
    "fcmp",
    "select",
    "uextend",
    "sextend",
    "ireduce",
    "fcvt_from_sint",
    "fcvt_to_sint_sat",
    "vconst",
    // Its lanes are numbered by a constant, which Cranelift checks.
    "shuffle",
    "extractlane",
    "insertlane",
    "scalar_to_vector",
    "vhigh_bits",
    "bitselect",
    "uwiden_low",
    "splat",
    "vany_true",
    "snarrow",
    "swiden_low",
    // Lanes that do not fit become the least integer.
    "x86_cvtt2dq",
    "bitcast",
    "fadd",
    "fsub",
    "fmul",
    "fdiv",
    "fneg",
    "fabs",
    "sqrt",
    "floor",
    "ceil",
    "trunc",
    // An address in the function's own stack frame, of a slot that is declared.
    "stack_addr",
    "jump",
    "brif",
    "br_table",
    "return",
];

/// The instructions of a text of CLIF that could fault, each with the reason in front.
pub fn faults(clif: &str) -> Vec<String> {
    let mut found = vec![];
    let mut values = HashMap::new();
    for line in clif.lines() {
        if line.starts_with("function ") {
            values.clear();
            continue;
        }
        let code = line.split_once(';').map_or(line, |(code, _)| code).trim();
        // Headers of blocks, declarations, comments, ends.
        if code.is_empty() || code.ends_with(':') || code.ends_with('{') || code == "}" {
            continue;
        }
        let (result, rest) = code.split_once(" = ").map_or(("", code), |(v, rest)| (v, rest));
        // Declarations: what a call passes, slots of the stack frame, and constants that `vconst` takes.
        if ["sig", "ss", "const"].iter().any(|declared| result.starts_with(declared)) {
            continue;
        }
        if let Err(why) = check_instruction(rest, &values) {
            found.push(format!("{why}: {code}"));
        }
        values.insert(result, rest);
    }
    found
}

fn check_instruction(rest: &str, values: &HashMap<&str, &str>) -> Result<(), String> {
    let (word, operands) = rest.split_once(' ').unwrap_or((rest, ""));
    let (name, ty) = word.split_once('.').unwrap_or((word, ""));
    let args: Vec<&str> = operands.split(", ").collect();
    match name {
        // A load or store, of the whole value or of 8, 16 or 32 of its bits; the loads of the deadline.
        "load" | "store" | "atomic_load" | "uload8" | "uload16" | "uload32" | "sload8"
        | "sload16" | "sload32" | "istore8" | "istore16" | "istore32"
            if operands.split(' ').any(|flag| flag == "notrap") =>
        {
            Ok(())
        }
        "sdiv" | "srem" | "udiv" | "urem" => {
            let divisor = args.last().copied().unwrap_or_default();
            divisor_is_harmless(divisor, name.starts_with('s'), values)
        }
        "call_indirect" => {
            let callee = args.get(1).and_then(|arg| arg.split('(').next()).unwrap_or_default();
            match values.get(callee) {
                Some(load) if load.starts_with("load.i64 notrap aligned readonly") => Ok(()),
                _ => Err("calls something other than the host".into()),
            }
        }
        _ if TOTAL.contains(&name) => Ok(()),
        _ => Err(format!("may fault ({name}, {ty})")),
    }
}

fn divisor_is_harmless(
    divisor: &str,
    signed: bool,
    values: &HashMap<&str, &str>,
) -> Result<(), String> {
    let made = values.get(divisor).copied().unwrap_or_default();
    if let Some((ty, number)) = constant(made) {
        let harmful = number == 0 || (signed && is_minus_one(ty, number));
        return if harmful { Err("divides by a harmful constant".into()) } else { Ok(()) };
    }
    let unguarded = || Err("divides by anything".into());
    let Some(args) = operands(made, "select") else { return unguarded() };
    let args: Vec<&str> = args.split(", ").collect();
    let [cond, one, other] = args[..] else { return unguarded() };
    let is_one = values.get(one).and_then(|made| constant(made)).is_some_and(|(_, n)| n == 1);
    let cond = values.get(cond).copied().unwrap_or_default();
    let tests: Vec<&str> = match operands(cond, "bor") {
        Some(both) => both.split(", ").filter_map(|v| values.get(v).copied()).collect(),
        None => vec![cond],
    };
    let compares_with = |wanted: &dyn Fn(&str, i128) -> bool| {
        tests.iter().any(|test| {
            let args = operands(test, "icmp").and_then(|args| args.strip_prefix("eq "));
            let args = args.and_then(|args| args.split_once(", "));
            let number = args.and_then(|(_, limit)| constant(values.get(limit)?));
            args.is_some_and(|(tested, _)| tested == other)
                && number.is_some_and(|(ty, n)| wanted(ty, n))
        })
    };
    if is_one && compares_with(&|_, n| n == 0) && (!signed || compares_with(&is_minus_one)) {
        Ok(())
    } else {
        unguarded()
    }
}

/// The operands of an operation of this name, whether its type is written or not.
fn operands<'a>(made: &'a str, name: &str) -> Option<&'a str> {
    let (word, operands) = made.split_once(' ')?;
    let (op, _) = word.split_once('.').unwrap_or((word, ""));
    (op == name).then_some(operands)
}

/// Type and value of an `iconst`.
fn constant(made: &str) -> Option<(&str, i128)> {
    let (ty, number) = made.strip_prefix("iconst.")?.split_once(' ')?;
    let digits = number.trim().replace('_', "");
    let number = match digits.strip_prefix("0x") {
        Some(hex) => i128::from_str_radix(hex, 16).ok()?,
        None => digits.parse().ok()?,
    };
    Some((ty, number))
}

fn is_minus_one(ty: &str, number: i128) -> bool {
    let width: u32 = ty.trim_start_matches('i').parse().unwrap_or(64);
    number == -1 || number == (1 << width) - 1
}

#[cfg(test)]
mod tests {
    use super::faults;

    fn count(body: &str) -> usize {
        faults(&format!("function %f(i64, i32) -> i64 {{\nblock0(v0: i64, v1: i32):\n{body}\n}}"))
            .len()
    }

    #[test]
    fn operations_that_may_fault_are_found() {
        for body in [
            "    v2 = sdiv v0, v1",
            "    v3 = iconst.i32 0\n    v2 = udiv v0, v3  ; v3 = 0",
            "    v3 = iconst.i32 -1\n    v2 = srem v0, v3",
            "    v3 = iconst.i16 0xffff\n    v2 = sdiv v0, v3",
            "    v2 = fcvt_to_sint.i32 v1",
            "    trap user1",
            "    v2 = load.i32 v0+8",
            "    store v0, v1",
            "    call fn0(v1)",
            "    v2 = call_indirect sig0, v1(v0)",
            "    v2 = iconst.i8 1\n    v3 = select v0, v2, v1\n    v4 = udiv v0, v3",
            "    v2 = iconst.i8 1\n    v5 = iconst.i8 0\n    v6 = icmp eq v1, v5\n    \
             v3 = select v6, v2, v1\n    v4 = sdiv v0, v3",
        ] {
            assert_eq!(count(body), 1, "{body}");
        }
    }

    #[test]
    fn guarded_operations_are_accepted() {
        for body in [
            "    v3 = iconst.i32 7\n    v2 = sdiv v0, v3  ; v3 = 7",
            "    v3 = iconst.i16 0xffff\n    v2 = udiv v0, v3",
            "    v2 = iconst.i8 1\n    v5 = iconst.i8 0\n    v6 = icmp eq v1, v5\n    \
             v3 = select v6, v2, v1\n    v4 = urem v0, v3",
            "    v2 = iconst.i8 1\n    v5 = iconst.i8 0\n    v6 = icmp.i8 eq v1, v5\n    \
             v3 = select.i8 v6, v2, v1\n    v4 = urem.i8 v0, v3",
            "    v2 = load.i64 notrap aligned readonly v0+8\n    v3 = call_indirect sig0, v2(v0, v1)",
            "    sig0 = (i64) -> i64 system_v",
            "    const0 = 0x00000000000000003ff0000000000000\n    v2 = vconst.f64x2 const0\n    \
             v3 = extractlane v2, 0",
            "    v2 = load.i16 notrap little v0+4\n    ; a.pmi:3  A = B / C",
            "    return v1",
        ] {
            assert_eq!(count(body), 0, "{body}");
        }
    }
}
