//! What naga knows of a kernel: bindings with their real access, overrides, struct layouts, needed features.

use naga::valid::{Capabilities, GlobalUse, ModuleInfo, ValidationFlags, Validator};
use naga::{AddressSpace, Module};

use super::expand::Source;
use super::layout::{self, Element};

pub struct Kernel {
    pub name: String,
    pub text: String,
    pub workgroup: [u32; 3],
    pub bindings: Vec<Binding>,
    pub immediates: Option<Element>,
    pub overrides: Vec<(String, &'static str)>,
    pub needs: Vec<&'static str>,
    pub structs: Vec<layout::Struct>,
}

pub struct Binding {
    pub name: String,
    pub index: u32,
    pub element: Element,
    pub reads: bool,
    pub writes: bool,
    pub texels: bool,
}

/// Optional capabilities, by the name of the device feature each asks for.
const OPTIONAL: [(Capabilities, &str); 5] = [
    (Capabilities::SUBGROUP, "Subgroup"),
    (Capabilities::SHADER_INT64, "Int64"),
    (Capabilities::SHADER_INT64_ATOMIC_ALL_OPS, "Int64Atomic"),
    (Capabilities::SHADER_FLOAT32_ATOMIC, "FloatAtomic"),
    (Capabilities::SHADER_FLOAT16, "Float16"),
];

pub fn reflect(name: &str, source: &Source) -> Result<Kernel, String> {
    let module = naga::front::wgsl::parse_str(&source.text).map_err(|e| {
        let at = e.location(&source.text);
        shown(source, at, e.message(), &e.labels().map(|l| l.1.to_string()).collect::<Vec<_>>())
    })?;
    let info = validate(&module, Capabilities::all()).map_err(|e| {
        let mut chain = vec![];
        let mut cause: Option<&dyn std::error::Error> = std::error::Error::source(e.as_inner());
        while let Some(inner) = cause {
            chain.push(inner.to_string());
            cause = inner.source();
        }
        shown(source, e.location(&source.text), &e.as_inner().to_string(), &chain)
    })?;
    let needs = OPTIONAL
        .iter()
        .filter(|(flag, _)| {
            let mut without = Capabilities::all() - *flag;
            if *flag == Capabilities::SHADER_INT64_ATOMIC_ALL_OPS {
                without -= Capabilities::SHADER_INT64_ATOMIC_MIN_MAX;
            }
            validate(&module, without).is_err()
        })
        .map(|(_, name)| *name)
        .collect();
    let [entry] = module.entry_points.as_slice() else {
        return Err(format!("{name}.wgsl: a kernel file has exactly one entry point"));
    };
    if entry.name != "main" {
        return Err(format!("{name}.wgsl: the entry point of a kernel is called `main`"));
    }
    let use_of = info.get_entry_point(0);
    let mut structs = Vec::new();
    let mut bindings = Vec::new();
    let mut immediates = None;
    for (handle, global) in module.global_variables.iter() {
        let access = use_of[handle];
        let global_name = global.name.clone().unwrap_or_default();
        match global.space {
            AddressSpace::Storage { .. } | AddressSpace::Handle => {
                let Some(binding) = &global.binding else { continue };
                if access.is_empty() {
                    return Err(format!("{name}.wgsl: binding `{global_name}` is never used; remove it"));
                }
                let texels = global.space == AddressSpace::Handle;
                let element = if texels {
                    layout::texels(&module, global.ty, texel_type(&source.text, &global_name), &mut structs)
                } else {
                    layout::element(&module, global.ty, &mut structs)
                };
                let element = element.map_err(|why| format!("{name}.wgsl: binding `{global_name}`: {why}"))?;
                let atomic = access.contains(GlobalUse::ATOMIC);
                bindings.push(Binding {
                    name: global_name,
                    index: binding.binding,
                    element,
                    reads: atomic || access.contains(GlobalUse::READ),
                    writes: atomic || access.contains(GlobalUse::WRITE),
                    texels,
                });
            }
            AddressSpace::Immediate if !access.is_empty() => {
                immediates = Some(layout::plain(&module, global.ty, &mut structs)?);
            }
            AddressSpace::Uniform => {
                return Err(format!("{name}.wgsl: `{global_name}`: kernels bind storage buffers and texels only"));
            }
            _ => {}
        }
    }
    bindings.sort_by_key(|b| b.index);
    if bindings.iter().enumerate().any(|(i, b)| b.index as usize != i) {
        return Err(format!("{name}.wgsl: bindings of group 0 must be numbered 0, 1, 2, … without gaps"));
    }
    let stored = bindings.iter().filter(|b| !b.texels).count();
    if stored > 12 || bindings.len() - stored > 12 {
        return Err(format!("{name}.wgsl: {} bindings; at most 12 of a kind keep every device happy", bindings.len()));
    }
    let overrides = module
        .overrides
        .iter()
        .map(|(_, o)| (o.name.clone().unwrap_or_default(), layout::scalar_name(&module, o.ty)))
        .collect();
    Ok(Kernel {
        name: name.to_string(),
        text: source.text.clone(),
        workgroup: entry.workgroup_size,
        bindings,
        immediates,
        overrides,
        needs,
        structs,
    })
}

/// What `//! texels NAME: TYPE` says of a binding.
fn texel_type<'a>(text: &'a str, binding: &str) -> Option<&'a str> {
    let said = text.lines().filter_map(|line| line.strip_prefix("//! texels ")?.split_once(':'));
    said.map(|(name, of)| (name.trim(), of.trim())).find(|(name, _)| *name == binding).map(|(_, of)| of)
}

fn validate(
    module: &Module,
    allowed: Capabilities,
) -> Result<ModuleInfo, Box<naga::WithSpan<naga::valid::ValidationError>>> {
    let mut validator = Validator::new(ValidationFlags::all(), allowed);
    validator.validate(module).map_err(Box::new)
}

/// File, line and caret of a mistake, in the file its author wrote.
fn shown(source: &Source, at: Option<naga::SourceLocation>, message: &str, notes: &[String]) -> String {
    let Some(at) = at else {
        let file = source.lines.first().map_or("", |line| line.0.as_str());
        return format!("error: {message}\n  --> kernels/wgsl/{file}\n  {}", notes.join("\n  "));
    };
    let index = (at.line_number as usize).saturating_sub(1);
    let (file, line) = source.lines.get(index).cloned().unwrap_or_default();
    let text = source.text.lines().nth(index).unwrap_or_default();
    let column = (at.line_position as usize).max(1);
    let caret =
        " ".repeat(column - 1) + &"^".repeat((at.length as usize).clamp(1, text.len().max(column) + 1 - column));
    format!(
        "error: {message}\n  --> kernels/wgsl/{file}:{line}:{column}\n    |\n{line:>3} | {text}\n    | {caret} {}\n",
        notes.join("; ")
    )
}
