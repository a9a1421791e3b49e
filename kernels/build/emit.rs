//! Writes the one generated Rust file: structs, typed calls and the table of kernels.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::layout::Struct;
use super::reflect::Kernel;

/// Name of a family, and name and number of each of its members.
pub type Family = (String, Vec<(String, u32)>);

pub fn emit(kernels: &[Kernel], families: &[Family]) -> Result<String, String> {
    let mut out = String::from("// Written by build.rs from kernels/wgsl. Do not edit.\n");
    let mut structs: BTreeMap<&str, &Struct> = BTreeMap::new();
    for kernel in kernels {
        for s in &kernel.structs {
            if *structs.entry(&s.name).or_insert(s) != s {
                return Err(format!("{}.wgsl: struct `{}` has another layout in another kernel", kernel.name, s.name));
            }
        }
    }
    for s in structs.values() {
        struct_text(&mut out, s);
    }
    let mut folders: BTreeMap<&str, Vec<&Kernel>> = BTreeMap::new();
    for kernel in kernels {
        let (folder, _) = kernel.name.split_once('/').unwrap_or(("", &kernel.name));
        folders.entry(folder).or_default().push(kernel);
    }
    for (folder, members) in &folders {
        let _ = writeln!(out, "/// Kernels of `wgsl/{folder}`.\npub mod {folder} {{");
        for kernel in members {
            call_text(&mut out, kernel);
        }
        out.push_str("}\n");
    }
    out.push_str("/// Every kernel, by name.\npub static KERNELS: &[&KernelInfo] = &[\n");
    for kernel in kernels {
        let (folder, _) = kernel.name.split_once('/').unwrap_or(("", ""));
        let _ = writeln!(out, "    <{folder}::{} as Kernel>::INFO,", type_name(&kernel.name));
    }
    out.push_str("];\n/// Numbers of the members of each family.\npub mod family {\n");
    let mut flags = String::new();
    for (family, members) in families {
        let _ = writeln!(out, "    /// Family `{family}`.\n    pub mod {family} {{");
        for (name, kind) in members {
            let _ = writeln!(
                out,
                "        /// `{family}/{name}`.\n        pub const {}: u32 = {kind};",
                name.to_uppercase()
            );
            let flag = super::expand::flag(family, name);
            let _ = writeln!(flags, "    Member {{ family: {family:?}, kind: {kind}, flag: {flag:?} }},");
        }
        out.push_str("    }\n");
    }
    let _ = writeln!(out, "}}\n/// Every member of every family.\npub static MEMBERS: &[Member] = &[\n{flags}];");
    Ok(out)
}

fn struct_text(out: &mut String, s: &Struct) {
    let _ = writeln!(out, "/// WGSL struct `{}`, {} bytes.", s.name, s.bytes);
    let _ = writeln!(out, "#[repr(C)]\n#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]");
    let _ = writeln!(out, "pub struct {} {{", s.name);
    let (mut at, mut pads) = (0, 0);
    let mut pad_to = |out: &mut String, to: u32, at: &mut u32| {
        if to > *at {
            let _ = writeln!(out, "    #[doc(hidden)]\n    pub _pad{pads}: [u32; {}],", (to - *at) / 4);
            pads += 1;
            *at = to;
        }
    };
    for (name, element, offset) in &s.fields {
        pad_to(out, *offset, &mut at);
        let _ = writeln!(out, "    pub {name}: {},", element.rust);
        at += element.bytes;
    }
    pad_to(out, s.bytes, &mut at);
    out.push_str("}\n");
    let _ = writeln!(out, "const _: () = assert!(size_of::<{}>() == {});", s.name, s.bytes);
    for (name, _, offset) in &s.fields {
        let _ = writeln!(out, "const _: () = assert!(std::mem::offset_of!({}, {name}) == {offset});", s.name);
    }
    let _ = writeln!(out, "impl Default for {} {{ fn default() -> Self {{ bytemuck::Zeroable::zeroed() }} }}", s.name);
}

fn call_text(out: &mut String, kernel: &Kernel) {
    let ty = type_name(&kernel.name);
    let _ = writeln!(out, "    /// One call of `{}`, workgroups of {:?}.", kernel.name, kernel.workgroup);
    let _ = writeln!(out, "    #[derive(Clone, Copy, Debug)]\n    pub struct {ty} {{");
    for b in &kernel.bindings {
        let access = match (b.reads, b.writes) {
            (true, true) => "Read and written",
            (false, true) => "Written",
            _ => "Read",
        };
        let _ = writeln!(out, "        /// {access}.\n        pub {}: crate::Buf<{}>,", b.name, b.element.rust);
    }
    if let Some(element) = &kernel.immediates {
        let _ = writeln!(out, "        /// Constants of this call.\n        pub immediates: {},", element.rust);
    }
    out.push_str("    }\n");
    let _ = writeln!(
        out,
        "    impl crate::Kernel for {ty} {{\n        const INFO: &'static crate::KernelInfo = &crate::KernelInfo {{"
    );
    let _ = writeln!(
        out,
        "            name: {:?},\n            source: {:?},\n            workgroup: {:?},",
        kernel.name, kernel.text, kernel.workgroup
    );
    out.push_str("            bindings: &[\n");
    for b in &kernel.bindings {
        let _ = writeln!(
            out,
            "                crate::BindingInfo {{ name: {:?}, reads: {}, writes: {}, element: {:?}, bytes: {}, texels: {} }},",
            b.name,
            b.reads,
            b.writes,
            b.element.rust.trim_start_matches("crate::"),
            b.element.bytes,
            b.texels
        );
    }
    let _ = writeln!(out, "            ],\n            overrides: &{:?},", kernel.overrides);
    let _ = writeln!(out, "            immediates: {},", kernel.immediates.as_ref().map_or(0, |e| e.bytes));
    let needs: Vec<_> = kernel.needs.iter().map(|n| format!("crate::Feature::{n}")).collect();
    let _ = writeln!(out, "            needs: &[{}],\n        }};", needs.join(", "));
    let bufs: Vec<_> = kernel.bindings.iter().map(|b| format!("self.{}.erase()", b.name)).collect();
    let _ = writeln!(out, "        fn bufs(&self) -> Vec<crate::AnyBuf> {{ vec![{}] }}", bufs.join(", "));
    if kernel.immediates.is_some() {
        let _ = writeln!(out, "        fn immediates(&self) -> &[u8] {{ bytemuck::bytes_of(&self.immediates) }}");
    } else {
        let _ = writeln!(out, "        fn immediates(&self) -> &[u8] {{ &[] }}");
    }
    out.push_str("    }\n");
}

/// `mpm/p2g_float` → `P2gFloat`.
fn type_name(name: &str) -> String {
    let stem = name.rsplit('/').next().unwrap_or(name);
    stem.split('_')
        .map(|word| {
            let mut letters = word.chars();
            letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
        })
        .collect()
}
