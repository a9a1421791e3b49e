//! What a manifest promises of the tensors of its graphs, and where a graph says otherwise. Loads nothing.

use crate::chain::Graph;
use crate::error::NetError;
use crate::manifest::{Axis, Dtype, Layout, Manifest, Part, Per, Role, Source, TensorSpec};
use crate::onnx::{GraphInfo, Port};

/// A tensor as the manifest means it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Expected {
    pub name: String,
    pub dtype: Dtype,
    /// Length of each axis, `None` where it depends on the clip; `None` for a rank that files decide.
    pub shape: Option<Vec<Option<usize>>>,
}

/// A contradiction: which graph of the chain, which tensor, what.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Contradiction {
    pub graph: usize,
    pub tensor: String,
    pub why: String,
}

/// Inputs and output of a role.
pub(crate) fn expected(manifest: &Manifest, role: Role) -> (Vec<Expected>, Option<Expected>) {
    let latents = sizes(manifest, manifest.latent.channels);
    let frames = [Some(3), None, None, None];
    let of = |spec: &TensorSpec, axes: [Option<usize>; 4]| Expected {
        name: spec.name.clone(),
        dtype: spec.dtype,
        shape: Some(in_layout(axes, spec.layout)),
    };
    if let Some(velocity) = manifest.velocity.as_ref().filter(|_| role == Role::Velocity) {
        let inputs = velocity.inputs.iter().map(|input| Expected {
            name: input.name.clone(),
            dtype: input.dtype,
            shape: of_source(manifest, &input.source),
        });
        return (inputs.collect(), Some(of(&velocity.output, latents)));
    }
    let open = [Some(manifest.latent.channels), None, None, None];
    match (role, manifest.codec(role)) {
        (Role::Encode | Role::EncodeImage, Some(codec)) => {
            (vec![of(&codec.input, frames)], Some(of(&codec.output, open)))
        }
        (_, Some(codec)) => (vec![of(&codec.input, open)], Some(of(&codec.output, frames))),
        _ => (Vec::new(), None),
    }
}

/// The axes of latents of a chunk, as far as the manifest knows them.
fn sizes(manifest: &Manifest, channels: usize) -> [Option<usize>; 4] {
    let size = manifest.latent.size;
    let frames = manifest.chunk.fixed.then(|| frames(manifest));
    [Some(channels), frames, size.map(|s| s[0]), size.map(|s| s[1])]
}

fn frames(manifest: &Manifest) -> usize {
    let after = (manifest.chunk.frames - 1) / manifest.latent.temporal;
    if manifest.latent.first == crate::manifest::FirstLatent::Separate { after } else { 1 + after }
}

fn in_layout(axes: [Option<usize>; 4], layout: Layout) -> Vec<Option<usize>> {
    let [c, t, h, w] = axes;
    match layout {
        Layout::Bcthw => vec![Some(1), c, t, h, w],
        Layout::Btchw => vec![Some(1), t, c, h, w],
        Layout::Bnc => vec![Some(1), t.zip(h).zip(w).map(|((t, h), w)| t * h * w), c],
    }
}

fn of_source(manifest: &Manifest, source: &Source) -> Option<Vec<Option<usize>>> {
    let all = sizes(manifest, manifest.latent.channels);
    let known = |shape: &[usize]| Some(shape.iter().copied().map(Some).collect());
    match source {
        Source::Latent(latent) => {
            let channels = |p: &Part| if *p == Part::Mask { latent.mask_channels } else { manifest.latent.channels };
            let time = |p: &Part| match p {
                Part::Latents | Part::Mask | Part::Image => all[1],
                Part::First => Some(1),
                Part::History(slots) => Some(slots.count),
            };
            let mut axes = all;
            match latent.over {
                Axis::Channels => {
                    axes[0] = Some(latent.parts.iter().map(channels).sum());
                    axes[1] = latent.parts.first().and_then(time);
                }
                Axis::Time => axes[1] = latent.parts.iter().map(time).sum(),
            }
            Some(in_layout(axes, latent.layout))
        }
        Source::Sigma { per, .. }
        | Source::Timestep { per, .. }
        | Source::Guidance { per, .. }
        | Source::Size { per, .. } => Some(match per {
            Per::Scalar => Vec::new(),
            Per::Batch => vec![Some(1)],
            Per::Token { patch } => {
                let [_, t, h, w] = all;
                let tokens = t.zip(h).zip(w).map(|((t, h), w)| t * h * w / patch.iter().product::<usize>());
                vec![Some(1), tokens]
            }
        }),
        Source::Indices { of } => {
            let length = |p: &Part| match p {
                Part::Latents => all[1],
                Part::History(slots) => Some(slots.count),
                _ => Some(1),
            };
            Some(vec![Some(1), of.iter().map(length).sum()])
        }
        Source::Constant { shape, .. } => known(shape),
        Source::ConstantFile { .. } | Source::Embedding { .. } => None,
    }
}

/// Everything in which graphs contradict what is expected of them, or each other.
pub(crate) fn contradictions(
    graphs: &[&GraphInfo],
    inputs: &[Expected],
    output: Option<&Expected>,
) -> Vec<Contradiction> {
    let mut found = Vec::new();
    let last = graphs.len().saturating_sub(1);
    let mut add = |graph: usize, tensor: &str, why: String| {
        found.push(Contradiction { graph, tensor: tensor.to_owned(), why });
    };
    for (i, info) in graphs.iter().enumerate() {
        for port in &info.outputs {
            if !(1..=16).contains(&port.element) {
                add(i, &port.name, format!("is {}, not a tensor of a known type", port.element_text()));
            }
        }
        for port in &info.inputs {
            let earlier = || graphs[..i].iter().flat_map(|g| &g.outputs).find(|o| o.name == port.name);
            if let Some(expected) = inputs.iter().find(|e| e.name == port.name) {
                disagree(port, expected).into_iter().for_each(|why| add(i, &port.name, why));
            } else if let Some(made) = earlier() {
                if made.element != port.element {
                    let (have, want) = (made.element_text(), port.element_text());
                    add(i, &port.name, format!("is {want} here, and an earlier graph makes {have}"));
                }
                if !matches!(made.element, 1 | 6 | 7 | 10 | 16) {
                    let have = made.element_text();
                    add(i, &port.name, format!("is {have}; only f32, f16, bf16, i64 and i32 are passed on"));
                }
            } else if !port.optional {
                let why = "is needed by the graph, and neither the manifest nor an earlier graph gives it";
                add(i, &port.name, why.into());
            }
        }
    }
    for expected in inputs {
        if !graphs.iter().any(|g| g.inputs.iter().any(|p| p.name == expected.name)) {
            let known: Vec<_> = graphs.iter().flat_map(|g| &g.inputs).map(|p| p.name.as_str()).collect();
            add(last, &expected.name, format!("is no input of any graph; there are: {}", known.join(", ")));
        }
    }
    if let Some(expected) = output {
        let made = graphs.iter().enumerate().flat_map(|(i, g)| g.outputs.iter().map(move |p| (i, p)));
        match made.clone().rfind(|(_, p)| p.name == expected.name) {
            Some((i, port)) => disagree(port, expected).into_iter().for_each(|why| add(i, &port.name, why)),
            None => {
                let known: Vec<_> = made.map(|(_, p)| p.name.as_str()).collect();
                add(last, &expected.name, format!("is no output of any graph; there are: {}", known.join(", ")));
            }
        }
    }
    found
}

fn disagree(port: &Port, expected: &Expected) -> Vec<String> {
    let mut found = Vec::new();
    let number = match expected.dtype {
        Dtype::F32 => 1,
        Dtype::I32 => 6,
        Dtype::I64 => 7,
        Dtype::Bool => 9,
        Dtype::F16 => 10,
        Dtype::Bf16 => 16,
    };
    if port.element != number {
        found.push(format!("is {} in the graph and {} in the manifest", port.element_text(), expected.dtype.name()));
    }
    if let (Some(have), Some(want)) = (&port.shape, &expected.shape) {
        let fits = have.len() == want.len()
            && have.iter().zip(want).all(|(h, w)| h.zip(*w).is_none_or(|(h, w)| h as u64 == w as u64));
        if !fits {
            let axes: Vec<_> = want.iter().map(|d| d.map_or("?".into(), |d| d.to_string())).collect();
            let want = axes.join(", ");
            found.push(format!("has shape {} in the graph and [{want}] by the manifest", port.shape_text()));
        }
    }
    found
}

/// Refuses graphs that contradict the manifest, with the first contradiction.
pub(crate) fn agree(manifest: &Manifest, role: Role, graphs: &[Graph]) -> Result<(), NetError> {
    let (inputs, output) = expected(manifest, role);
    let infos: Vec<_> = graphs.iter().map(|g| &g.info).collect();
    match contradictions(&infos, &inputs, output.as_ref()).into_iter().next() {
        None => Ok(()),
        Some(Contradiction { graph, tensor, why }) => {
            let path = graphs.get(graph).map(|g| g.path.clone()).unwrap_or_default();
            Err(NetError::Contract { path, tensor, why })
        }
    }
}
