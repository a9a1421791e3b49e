//! Memory layout of WGSL types as Rust types with explicit padding. Knows nothing of kernels.

use naga::{ArraySize, Handle, ImageClass, ImageDimension, Module, Scalar, ScalarKind, Type, TypeInner, VectorSize};

/// The Rust type of one element of a buffer and its size in bytes.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Element {
    pub rust: String,
    pub bytes: u32,
}

/// A struct to emit: fields with offsets, padding filled in by the emitter.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Struct {
    pub name: String,
    pub bytes: u32,
    pub fields: Vec<(String, Element, u32)>,
}

/// Element of a storage buffer: `struct S { d: array<T> }` holds elements of T, any other struct is one element.
///
/// Bare runtime arrays are refused: drivers' validation misses hazards and out-of-bounds writes in them.
pub fn element(module: &Module, ty: Handle<Type>, structs: &mut Vec<Struct>) -> Result<Element, String> {
    match &module.types[ty].inner {
        TypeInner::Struct { members, .. } => {
            if let [only] = members.as_slice()
                && let TypeInner::Array { base, size: ArraySize::Dynamic, stride } = module.types[only.ty].inner
            {
                let inner = plain(module, base, structs)?;
                if inner.bytes != stride {
                    return Err(format!("array stride {stride} differs from the element's {} bytes", inner.bytes));
                }
                return Ok(inner);
            }
            plain(module, ty, structs)
        }
        _ => Err("wrap storage arrays in a struct: `struct Cells { d: array<u32> }`".into()),
    }
}

/// Element of a binding read as texels, `texture_1d<u32>`: what its directive says the words are.
pub fn texels(
    module: &Module,
    ty: Handle<Type>,
    of: Option<&str>,
    structs: &mut Vec<Struct>,
) -> Result<Element, String> {
    match &module.types[ty].inner {
        TypeInner::Image {
            dim: ImageDimension::D1,
            arrayed: false,
            class: ImageClass::Sampled { kind: ScalarKind::Uint, multi: false },
        } => {}
        _ => return Err("of textures only `texture_1d<u32>` is bound, as texels of a buffer".into()),
    }
    let of = of.ok_or("say what its texels hold: `//! texels NAME: TYPE` on a line of its own")?;
    let plain_type = |rust: &str, bytes| Ok(Element { rust: rust.into(), bytes });
    match of {
        "u32" => plain_type("u32", 4),
        "f32" => plain_type("f32", 4),
        "vec2u" => plain_type("[u32; 2]", 8),
        "vec4f" => plain_type("[f32; 4]", 16),
        name => {
            let found = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name));
            plain(module, found.ok_or_else(|| format!("there is no struct `{name}`"))?.0, structs)
        }
    }
}

pub fn plain(module: &Module, ty: Handle<Type>, structs: &mut Vec<Struct>) -> Result<Element, String> {
    let of = &module.types[ty];
    let scalars = |count: u32, s: Scalar| -> Result<Element, String> {
        let one = scalar(s)?;
        let bytes = count * u32::from(s.width);
        Ok(Element { rust: if count == 1 { one.into() } else { format!("[{one}; {count}]") }, bytes })
    };
    match &of.inner {
        TypeInner::Scalar(s) | TypeInner::Atomic(s) => scalars(1, *s),
        TypeInner::Vector { size, scalar } => scalars(*size as u32, *scalar),
        TypeInner::Matrix { columns, rows, scalar } => {
            let padded = if *rows == VectorSize::Bi { 2 } else { 4 };
            scalars(*columns as u32 * padded, *scalar)
        }
        TypeInner::Array { base, size: ArraySize::Constant(n), .. } => {
            let inner = plain(module, *base, structs)?;
            Ok(Element { rust: format!("[{}; {n}]", inner.rust), bytes: inner.bytes * n.get() })
        }
        TypeInner::Struct { members, span } => {
            let name = of.name.clone().ok_or("a struct without a name")?;
            let mut fields = Vec::new();
            for member in members {
                let field = plain(module, member.ty, structs)?;
                fields.push((member.name.clone().unwrap_or_default(), field, member.offset));
            }
            let made = Struct { name: name.clone(), bytes: *span, fields };
            if !structs.contains(&made) {
                structs.push(made);
            }
            Ok(Element { rust: format!("crate::{name}"), bytes: *span })
        }
        _ => Err("a type that cannot live in a storage buffer".into()),
    }
}

fn scalar(s: Scalar) -> Result<&'static str, String> {
    Ok(match (s.kind, s.width) {
        (ScalarKind::Float, 4) => "f32",
        (ScalarKind::Float, 8) => "f64",
        (ScalarKind::Sint, 4) => "i32",
        (ScalarKind::Uint, 4) => "u32",
        (ScalarKind::Uint, 8) => "u64",
        (ScalarKind::Sint, 8) => "i64",
        _ => return Err("a scalar that cannot live in a storage buffer".into()),
    })
}

/// WGSL name of an override's type.
pub fn scalar_name(module: &Module, ty: Handle<Type>) -> &'static str {
    match module.types[ty].inner {
        TypeInner::Scalar(s) if s.kind == ScalarKind::Bool => "bool",
        TypeInner::Scalar(s) => scalar(s).unwrap_or("f32"),
        _ => "f32",
    }
}
