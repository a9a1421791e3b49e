//! The kernel build on small folders made here: what it reads, and that a mistake is shown with file, line and caret.

#[path = "../../kernels/build/emit.rs"]
mod emit;
#[path = "../../kernels/build/expand.rs"]
mod expand;
#[path = "../../kernels/build/layout.rs"]
mod layout;
#[path = "../../kernels/build/reflect.rs"]
mod reflect;

use std::path::Path;

use physvideo_gpu::kernels::KERNELS;
use physvideo_gpu::{Constants, compile};
use rspirv_reflect::{BindingCount, DescriptorType, Reflection};

/// A folder with these files (path without ending, text).
fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let root = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = root.path().join(format!("{name}.wgsl"));
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    root
}

/// As build.rs does it for one kernel.
fn build(root: &Path, name: &str) -> Result<reflect::Kernel, String> {
    expand::expand(root, name).and_then(|source| reflect::reflect(name, &source))
}

/// What the build says about a kernel `a/k` of this text, which must be wrong.
fn complaint(text: &str) -> String {
    build(folder(&[("a/k", text)]).path(), "a/k").err().unwrap_or_else(|| panic!("this was accepted: {text}"))
}

const GOOD: &str = "\
struct Words { d: array<u32> }
@group(0) @binding(0) var<storage, read> a: Words;
@group(0) @binding(1) var<storage, read_write> b: Words;
@compute @workgroup_size(32)
fn main(@builtin(global_invocation_id) id: vec3u) {
    b.d[id.x] = a.d[id.x];
}
";

#[test]
fn a_kernel_is_read_as_it_is() {
    let files = [
        (
            "a/k",
            "//! use lib/more\n//! family kind\nstruct Words { d: array<Row> }\nstruct Row { x: vec3f, n: u32, m: mat2x2f, w: array<vec4f, 2> }\n\
          @group(0) @binding(1) var<storage, read_write> b: Words;\n@group(0) @binding(0) var<storage, read> a: Words;\n\
          struct Bits { d: array<atomic<u32>> }\n@group(0) @binding(2) var<storage, read_write> c: Bits;\n\
          struct Call { size: vec2u, scale: f32 }\nvar<immediate> call: Call;\noverride STEEP: bool = false;\n\
          @compute @workgroup_size(4, 2)\nfn main() { b.d[0].x = a.d[0].x * kind(1u, more(call.scale)); atomicAdd(&c.d[0], 1u); if (STEEP) { b.d[0].n = 1u; } }\n",
        ),
        ("lib/more", "//! use lib/again\nfn more(x: f32) -> f32 { return again(x); }\n"),
        ("lib/again", "//! use lib/more\nfn again(x: f32) -> f32 { return 2.0 * x; }\n"),
        ("kind/one", "//! member 1 of fn (x: f32) -> f32 = 0.0\nfn kind_one(x: f32) -> f32 { return x; }\n"),
        ("kind/two", "//! member 2 of fn (x: f32) -> f32 = 0.0\nfn kind_two(x: f32) -> f32 { return -x; }\n"),
    ];
    let root = folder(&files);
    let kernel = build(root.path(), "a/k").unwrap();
    assert_eq!(kernel.workgroup, [4, 2, 1]);
    let read: Vec<_> = kernel
        .bindings
        .iter()
        .map(|b| (b.name.as_str(), b.element.rust.as_str(), b.element.bytes, b.reads, b.writes))
        .collect();
    // `b` is only stored to, whatever its declaration allows; atomics both read and write.
    assert_eq!(
        read,
        [("a", "crate::Row", 64, true, false), ("b", "crate::Row", 64, false, true), ("c", "u32", 4, true, true)]
    );
    assert_eq!(kernel.immediates.as_ref().map(|e| e.bytes), Some(16));
    let mut overrides: Vec<_> = kernel.overrides.iter().map(|o| (o.0.as_str(), o.1)).collect();
    overrides.sort_unstable();
    assert_eq!(overrides, [("KIND_ONE_USED", "bool"), ("KIND_TWO_USED", "bool"), ("STEEP", "bool")]);
    let text = emit::emit(&[kernel], &[]).unwrap();
    for line in [
        "pub struct Row {",
        "pub x: [f32; 3],",
        "pub m: [f32; 4],",
        "pub w: [[f32; 4]; 2],",
        "pub struct K {",
        "pub b: crate::Buf<crate::Row>,",
    ] {
        assert!(text.contains(line), "no `{line}` in\n{text}");
    }
}

#[test]
fn a_mistake_is_shown_with_file_line_and_caret() {
    let said = complaint(&GOOD.replace("= a.d[id.x];", "= 1.5;"));
    assert!(said.contains(" --> kernels/wgsl/a/k.wgsl:6:"), "{said}");
    assert!(said.contains("  6 |     b.d[id.x] = 1.5;") && said.contains("^"), "{said}");
    let said = complaint(&GOOD.replace("= a.d[id.x];", "= a.e[id.x];"));
    let caret = said.lines().find(|l| l.contains('^')).unwrap();
    let shown = said.lines().find(|l| l.contains("b.d[id.x] = a.e")).unwrap();
    assert_eq!(caret.find('^'), shown.find("e[id.x]"), "the caret is not under the mistake:\n{said}");
    // A type error found by validation, not by the parser.
    let said = complaint(&GOOD.replace("fn main(", "fn wrong() -> u32 { }\n@compute @workgroup_size(0)\nfn main("));
    assert!(said.starts_with("error: "), "{said}");
    // No text at all, and a mistake on the last line.
    assert!(!complaint("").is_empty());
    assert!(complaint("fn main( {").contains("a/k.wgsl:1:"));
}

#[test]
fn a_mistake_in_an_import_is_shown_in_the_import() {
    let files =
        [("a/k", &*format!("//! use lib/more\n{GOOD}")), ("lib/more", "// one\n\nfn more() -> f32 { return true; }\n")];
    let said = build(folder(&files).path(), "a/k").err().unwrap();
    assert!(said.contains(" --> kernels/wgsl/lib/more.wgsl:3:"), "{said}");
    let said = complaint(&format!("//! use lib/none\n{GOOD}"));
    assert!(said.contains("a/k: cannot import") && said.contains("lib/none.wgsl"), "{said}");
}

#[test]
fn house_rules_are_kept() {
    let unused = GOOD.replace("= a.d[id.x];", "= 1u;");
    assert!(complaint(&unused).contains("a/k.wgsl: binding `a` is never used"));
    let two = format!("{GOOD}@compute @workgroup_size(1)\nfn other() {{ }}\n");
    assert!(complaint(&two).contains("exactly one entry point"));
    assert!(complaint(&GOOD.replace("fn main", "fn start")).contains("called `main`"));
    let bare = GOOD.replace("read> a: Words", "read> a: array<u32>").replace("a.d[", "a[");
    assert!(complaint(&bare).contains("binding `a`: wrap storage arrays in a struct"));
    assert!(complaint(&GOOD.replace("@binding(1)", "@binding(2)")).contains("without gaps"));
    let uniform = GOOD.replace("var<storage, read> a: Words", "var<uniform> a: vec4u").replace("a.d[id.x]", "a.x");
    assert!(complaint(&uniform).contains("`a`: kernels bind storage buffers and texels only"));
    let crowd: String = (2..13).map(|i| format!("@group(0) @binding({i}) var<storage, read> c{i}: Words;\n")).collect();
    let uses: String = (2..13).map(|i| format!(" + c{i}.d[0]")).collect();
    let many = GOOD.replace("= a.d[id.x]", &format!("= a.d[id.x]{uses}")) + &crowd;
    assert!(complaint(&many).contains("13 bindings; at most 12 of a kind"));
}

#[test]
fn families_agree_on_their_signature() {
    let kernel = format!("//! family kind\n{}", GOOD.replace("= a.d[id.x]", "= a.d[id.x] + u32(kind(1u, 2.0))"));
    let one = ("kind/one", "//! member 1 of fn (x: f32) -> f32 = 0.0\nfn kind_one(x: f32) -> f32 { return x; }\n");
    let said = |other: &str| {
        build(folder(&[("a/k", &kernel), one, ("kind/two", other)]).path(), "a/k").err().unwrap_or_default()
    };
    assert_eq!(said("//! member 2 of fn (x: f32) -> f32 = 0.0\nfn kind_two(x: f32) -> f32 { return -x; }\n"), "");
    let differs = said("//! member 2 of fn (x: u32) -> f32 = 0.0\nfn kind_two(x: u32) -> f32 { return 1.0; }\n");
    assert!(differs.contains("kind/two.wgsl:1: its signature differs"), "{differs}");
    let bare = said("fn kind_two(x: f32) -> f32 { return -x; }\n");
    assert!(bare.contains("kind/two.wgsl:1: a member of a family starts with"), "{bare}");
    let wrong = said("//! member 2 of fn (x: f32) -> f32 = 0.0\nfn kind_two(x: vec2f) -> f32 { return 1.0; }\n");
    assert!(wrong.starts_with("error: "), "{wrong}");
    let empty = build(folder(&[("a/k", &kernel), ("kind/.keep", "")]).path(), "a/k").err().unwrap();
    assert!(empty.contains("kind"), "{empty}");
}

/// Buffers read as texels: what they hold is said in a line of its own, and nothing else is a texture.
#[test]
fn texels_are_buffers_of_what_is_said() {
    let texels = GOOD
        .replace("var<storage, read> a: Words", "var a: texture_1d<u32>")
        .replace("a.d[id.x]", "textureLoad(a, id.x, 0).x");
    assert!(complaint(&texels).contains("binding `a`: say what its texels hold: `//! texels NAME: TYPE`"));
    assert!(complaint(&format!("//! texels a: Row\n{texels}")).contains("binding `a`: there is no struct `Row`"));
    let root = folder(&[("a/k", &format!("//! texels a: Row\n{texels}struct Row {{ x: vec3f, y: f32 }}\n"))]);
    let kernel = build(root.path(), "a/k").unwrap();
    let a = &kernel.bindings[0];
    assert_eq!(
        (a.element.rust.as_str(), a.element.bytes, a.texels, a.reads, a.writes),
        ("crate::Row", 16, true, true, false)
    );
    assert!(!kernel.bindings[1].texels);
    for other in ["texture_2d<u32>", "texture_1d<f32>", "sampler"] {
        let wrong = format!("//! texels a: u32\n{texels}").replace("texture_1d<u32>", other);
        let said = complaint(&wrong);
        assert!(said.contains("of textures only `texture_1d<u32>`") || said.contains("error: "), "{other}: {said}");
    }
}

#[test]
fn one_struct_name_has_one_layout() {
    let other = GOOD.replace("array<u32>", "array<Row>").replace("b.d[id.x] = a.d[id.x]", "b.d[id.x].x = a.d[id.x].x");
    let root = folder(&[
        ("a/k", &format!("{other}struct Row {{ x: f32 }}\n")),
        ("a/l", &format!("{other}struct Row {{ x: f32, y: f32 }}\n")),
    ]);
    let kernels = ["a/k", "a/l"].map(|name| build(root.path(), name).unwrap());
    assert!(emit::emit(&kernels, &[]).unwrap_err().contains("a/l.wgsl: struct `Row` has another layout"));
}

/// A second reader of the SPIR-V that ships: rspirv-reflect. (spirv-reflect 0.2.3, which the design first named, cannot
/// read it: it stops at an assertion on SPIR-V 1.4, and of 1.3 it finds no descriptor bindings, since it does not know
/// the StorageBuffer class that naga writes.)
#[test]
fn a_second_reader_finds_the_same_bindings() {
    for kernel in KERNELS {
        let words = compile(kernel, kernel.source, &Constants::none(), false, true).unwrap();
        let read = Reflection::new_from_spirv(bytemuck::cast_slice(&words)).unwrap();
        let sets = read.get_descriptor_sets().unwrap();
        assert_eq!(sets.keys().copied().collect::<Vec<_>>(), [0], "{}: sets", kernel.name);
        let found: Vec<_> = sets[&0].iter().map(|(i, b)| (*i as usize, b.name.as_str())).collect();
        let ours: Vec<_> = kernel.bindings.iter().map(|b| b.name).enumerate().collect();
        assert_eq!(found, ours, "{}: bindings", kernel.name);
        for binding in sets[&0].values() {
            let texels = kernel.bindings.iter().any(|b| b.name == binding.name && b.texels);
            let ty = if texels { DescriptorType::UNIFORM_TEXEL_BUFFER } else { DescriptorType::STORAGE_BUFFER };
            assert_eq!(binding.ty, ty, "{} {}", kernel.name, binding.name);
            assert!(matches!(binding.binding_count, BindingCount::One), "{} {}", kernel.name, binding.name);
        }
        let [x, y, z] = kernel.workgroup;
        assert_eq!(read.get_compute_group_size(), Some((x, y, z)), "{}: workgroup", kernel.name);
        let constants = read.get_push_constant_range().unwrap().map_or(0, |r| r.size);
        // It does not count the padding at the end of a struct.
        let padding = kernel.immediates.checked_sub(constants);
        assert!(padding.is_some_and(|p| p < 16), "{}: immediates", kernel.name);
    }
}

/// The build's names are those of the files.
#[test]
fn every_entry_point_is_in_the_table() {
    let root = Path::new(physvideo_tests::folder::KERNELS);
    let mut found = Vec::new();
    for folder in expand::sorted(root).unwrap().into_iter().filter(|p| p.is_dir()) {
        for file in expand::sorted(&folder).unwrap() {
            if std::fs::read_to_string(&file).unwrap().contains("@compute") {
                found.push(file.strip_prefix(root).unwrap().with_extension("").display().to_string());
            }
        }
    }
    assert_eq!(found, KERNELS.iter().map(|k| k.name).collect::<Vec<_>>());
}
