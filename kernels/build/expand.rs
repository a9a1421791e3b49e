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

/// A member of a family, from the first line of its file.
pub struct Member {
    pub name: String,
    pub kind: u32,
    pub signature: String,
    file: String,
}

/// Name of the override that says whether a scene uses a member.
pub fn flag(family: &str, member: &str) -> String {
    format!("{family}_{member}_used").to_uppercase()
}

/// The members of a family, by name.
pub fn members(root: &Path, family: &str) -> Result<Vec<Member>, String> {
    let mut found: Vec<Member> = Vec::new();
    for path in sorted(&root.join(family))? {
        let file = path.display().to_string();
        let text = std::fs::read_to_string(&path).map_err(|e| format!("{file}: {e}"))?;
        let head = text.lines().next().and_then(|l| l.strip_prefix("//! member ")?.split_once(" of fn "));
        let (kind, signature) =
            head.and_then(|(kind, sig)| Some((kind.parse::<u32>().ok()?, sig.to_string()))).ok_or_else(|| {
                format!("{file}:1: a member of a family starts with `//! member K of fn (args) -> T = value`")
            })?;
        if let Some(other) = found.iter().find(|m| m.kind == kind) {
            return Err(format!("{file}:1: member {kind} of `{family}` is {} already", other.file));
        }
        let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        found.push(Member { name, kind, signature, file });
    }
    Ok(found)
}

/// The switch over a family's members: each `FAMILY/NAME.wgsl` exports `fn FAMILY_NAME(…)`; its first line is
/// `//! member K of fn (args) -> T = else-value`. Each member has a constant `FAMILY_NAME` with its number and an
/// override `FAMILY_NAME_USED`, so a scene pays only for the members it uses.
fn family_switch(root: &Path, family: &str) -> Result<String, String> {
    let mut overrides = String::new();
    let mut cases = String::new();
    let mut uses = String::new();
    let members = members(root, family)?;
    let signature = members.first().map(|m| m.signature.clone());
    for Member { name, kind, signature: sig, file } in &members {
        if signature.as_ref() != Some(sig) {
            return Err(format!("{file}:1: its signature differs from the other members of `{family}`"));
        }
        let arguments = argument_names(sig).join(", ");
        let flag = flag(family, name);
        uses += &format!("//! use {family}/{name}\n");
        overrides +=
            &format!("override {flag}: bool = true;\nconst {}: u32 = {kind}u;\n", flag.trim_end_matches("_USED"));
        cases += &format!("    if ({flag} && kind == {kind}u) {{ return {family}_{name}({arguments}); }}\n");
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
