//! Rules 1 to 5: regions, tasks and labels of the module, and the tables of each function.

use super::error::Errors;
use crate::func::MAX_LOCAL_BITS;
use crate::{FuncData, Module, PrimaryMap};

pub(super) fn check_module(module: &Module, is_whole: bool, errors: &mut Errors) {
    check_regions(module, errors);
    check_labels(module, is_whole, errors);
    let files = module.files.len();
    for (index, statement) in module.statements.iter().enumerate() {
        if statement.file as usize >= files && files > 0 {
            errors.push(format!(
                "statement @{index} is of file {}, but there are {files} files",
                statement.file
            ));
        }
    }
}

fn check_regions(module: &Module, errors: &mut Errors) {
    for &finite in &module.finite_regions {
        match module.region(finite) {
            Some(region) if region.bits => {
                errors.push(format!("region {} holds bits, so it holds no doubles", region.name));
            }
            Some(_) => {}
            None => errors.push(format!("{finite} is to hold doubles, but is not there")),
        }
    }
    for &words in &module.word_regions {
        if module.region(words).is_none_or(|region| region.bits) {
            errors.push(format!("{words} is to hold words, but is not there or holds bits"));
        }
    }
    let mut spans = vec![];
    for region in &module.regions {
        let (start, end) =
            (u64::from(region.offset), u64::from(region.offset) + u64::from(region.size));
        if end > u64::from(module.image_size) {
            errors.push(format!(
                "region {} ends at byte {end}, but the image has {} bytes",
                region.name, module.image_size
            ));
        }
        if start < end {
            spans.push((start, end, &region.name));
        }
    }
    spans.sort_unstable();
    for pair in spans.windows(2) {
        if let [(_, end, first), (start, _, second)] = pair
            && start < end
        {
            errors.push(format!("regions {first} and {second} overlap"));
        }
    }
}

fn check_labels(module: &Module, is_whole: bool, errors: &mut Errors) {
    let mut seen = PrimaryMap::from(vec![0u32; module.label_count as usize]);
    for (_, func) in module.funcs() {
        for &(label, _) in func.entries() {
            match seen.get_mut(label) {
                Some(count) => *count += 1,
                None => {
                    let count = module.label_count;
                    errors.push(format!("{label} is at a block, but there are {count} labels"));
                }
            }
        }
    }
    for (label, &count) in &seen {
        let is_elsewhere = count == 0 && !is_whole;
        if count != 1 && !is_elsewhere {
            errors.push(format!("{label} is at {count} places"));
        }
    }
    for task in &module.tasks {
        if task.entry >= module.label_count {
            errors.push(format!(
                "task {} starts at L{}, which is not a label of the module",
                task.name, task.entry
            ));
        }
        for label in task.resume_points.iter().filter(|&&label| label >= module.label_count) {
            errors.push(format!(
                "task {} goes on at L{label}, which is not a label of the module",
                task.name
            ));
        }
    }
}

/// Checks that everything that a function refers to exists. Returns whether it does; only then can
/// the other rules be checked.
pub(super) fn check_function(func: &FuncData, errors: &mut Errors) -> bool {
    let before = errors.list.len();
    if func.local_bits() > MAX_LOCAL_BITS {
        errors.push(format!("has more local bits than {MAX_LOCAL_BITS}"));
    }
    for (label, block) in func.entries() {
        match func.blocks.get(*block) {
            None => errors.push(format!("{label} is at {block}, which is not there")),
            Some(data) if !data.params.is_empty() => {
                errors.push(format!("{label} is at {block}, which has parameters"));
            }
            Some(_) => {}
        }
    }
    let mut placed = PrimaryMap::from(vec![false; func.insts.len()]);
    let values = &func.values;
    for (block, data) in func.blocks() {
        errors.block = Some(block);
        for param in data.params.iter().filter(|param| !values.is_valid(**param)) {
            errors.push(format!("parameter {param} is not there"));
        }
        for &inst in &data.insts {
            errors.inst = Some(inst);
            let (Some(slot), Some(instruction)) = (placed.get_mut(inst), func.insts.get(inst))
            else {
                errors.push("is not there");
                continue;
            };
            if std::mem::replace(slot, true) {
                errors.push("is listed twice");
            }
            instruction.for_each_arg(|value| {
                if !values.is_valid(value) {
                    errors.push(format!("operand {value} is not there"));
                }
            });
        }
        errors.inst = None;
        let Some(terminator) = &data.terminator else {
            errors.push("has no terminator");
            continue;
        };
        terminator.for_each_arg(|value| {
            if !values.is_valid(value) {
                errors.push(format!("operand {value} is not there"));
            }
        });
        terminator.for_each_block(|target, _| {
            if !func.blocks.is_valid(target) {
                errors.push(format!("goes to {target}, which is not there"));
            }
        });
    }
    errors.block = None;
    errors.list.len() == before
}
