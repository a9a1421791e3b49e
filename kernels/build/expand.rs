//! Puts a kernel's imports behind its own text (`//! use lib/bspline`) and writes the switch of a family
//! (`//! family field`). Shared by the build and by reloading from a folder; knows no naga and no Vulkan.

use std::path::{Path, PathBuf};

/// A kernel's whole WGSL text and where each of its lines came from.
pub struct Source {
    pub text: String,
    /// For each line of `text`: file (relative to the WGSL root) and its line number there, from 1.
    #[allow(dead_code, reason = "read by the build; reloading shows errors of the expanded text")]
    pub lines: Vec<(String, usize)>,
}

/// The expanded text of kernel `name` (for example `mpm/p2g`) under `root`.
///
/// WGSL lets declarations come in any order, so imports are appended once each and the kernel's own line
/// numbers stay what its author sees.
pub fn expand(root: &Path, name: &str) -> Result<Source, String> {
    let mut source = Source { text: String::new(), lines: Vec::new() };
    let mut queue = vec![name.to_string()];
    let mut next = 0;
    while next < queue.len() {
        let unit = queue[next].clone();
        next += 1;
        let text = match unit.strip_prefix("family:") {
            Some(family) => family_switch(root, family)?,
            None => {
                let path = root.join(format!("{unit}.wgsl"));
                std::fs::read_to_string(&path).map_err(|e| format!("{name}: cannot import {}: {e}", path.display()))?
            }
        };
        for (number, line) in text.lines().enumerate() {
            for import in imports(line) {
                if !queue.contains(&import) {
                    queue.push(import);
                }
            }
            source.text.push_str(line);
            source.text.push('\n');
            source.lines.push((format!("{unit}.wgsl"), number + 1));
        }
    }
    Ok(source)
}

fn imports(line: &str) -> Vec<String> {
    if let Some(list) = line.strip_prefix("//! use ") {
        return list.split_whitespace().map(str::to_string).collect();
    }
    line.strip_prefix("//! family ").map(|family| vec![format!("family:{}", family.trim())]).unwrap_or_default()
}

/// The switch over a family's members: each `FAMILY/NAME.wgsl` exports `fn FAMILY_NAME(…)`; its first line is
/// `//! member K of fn (args) -> T = else-value`. Each member has an override `FAMILY_NAME_USED`, so a scene
/// pays only for the members it uses.
fn family_switch(root: &Path, family: &str) -> Result<String, String> {
    let mut overrides = String::new();
    let mut cases = String::new();
    let mut signature = None;
    let mut uses = String::new();
    for file in sorted(&root.join(family))? {
        let member = file.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        let text = std::fs::read_to_string(&file).map_err(|e| format!("{}: {e}", file.display()))?;
        let head = text.lines().next().unwrap_or_default();
        let (kind, sig) =
            head.strip_prefix("//! member ").and_then(|rest| rest.split_once(" of fn ")).ok_or_else(|| {
                format!(
                    "{}:1: a member of a family starts with `//! member K of fn (args) -> T = value`",
                    file.display()
                )
            })?;
        if *signature.get_or_insert_with(|| sig.to_string()) != sig {
            return Err(format!("{}:1: its signature differs from the other members of `{family}`", file.display()));
        }
        let arguments = argument_names(sig).join(", ");
        let upper = format!("{family}_{member}_used").to_uppercase();
        uses += &format!("//! use {family}/{member}\n");
        overrides += &format!("override {upper}: bool = true;\n");
        cases += &format!("    if ({upper} && kind == {kind}u) {{ return {family}_{member}({arguments}); }}\n");
    }
    let sig = signature.ok_or_else(|| format!("family `{family}` has no members"))?;
    let (head, fallback) = sig.split_once(" = ").ok_or_else(|| format!("family `{family}`: no value after ` = `"))?;
    let inner = head.trim().trim_start_matches('(');
    Ok(format!("{uses}{overrides}fn {family}(kind: u32, {inner} {{\n{cases}    return {fallback};\n}}\n"))
}

fn argument_names(signature: &str) -> Vec<String> {
    let inside = signature.split_once('(').map(|(_, r)| r).and_then(|r| r.split_once(") ->")).map_or("", |(l, _)| l);
    inside.split(',').filter_map(|a| a.split_once(':')).map(|(n, _)| n.trim().to_string()).collect()
}

/// The entries of a folder by name, so that builds are reproducible.
pub fn sorted(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let read = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut paths: Vec<_> = read.filter_map(|e| e.ok().map(|e| e.path())).collect();
    paths.sort();
    Ok(paths)
}
