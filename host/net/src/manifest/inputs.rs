//! The inputs of the velocity network in a manifest: where each tensor comes from. Fills none.

use super::constant::{constant, shape};
use super::keys::{Item, Keys};
use super::parse::{dtype, layout};
use super::velocity::patch;
use super::{ChunkSpec, Dtype, FirstLatent, LatentSpec, Layout};

/// A tensor the network reads.
#[derive(Debug, Clone, PartialEq)]
pub struct InputSpec {
    /// Its name in the graph.
    pub name: String,
    /// Its numbers.
    pub dtype: Dtype,
    /// Where it comes from.
    pub source: Source,
}

/// Where a tensor comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// Latent-shaped parts.
    Latent(LatentInput),
    /// The noise level, times `scale`.
    Sigma {
        /// Factor.
        scale: f64,
        /// How often.
        per: Per,
    },
    /// The index of the noise level in the table of the schedule, times `scale`.
    Timestep {
        /// Factor.
        scale: f64,
        /// How often.
        per: Per,
    },
    /// The guidance, times `scale`.
    Guidance {
        /// Factor.
        scale: f64,
        /// How often.
        per: Per,
    },
    /// A size of the latents, times `scale`.
    Size {
        /// 0 time, 1 rows, 2 columns.
        axis: usize,
        /// Factor.
        scale: f64,
        /// How often.
        per: Per,
    },
    /// Positions of parts on the model's axis of time.
    Indices {
        /// The parts, in this order.
        of: Vec<Part>,
    },
    /// Numbers of the manifest.
    Constant {
        /// Length of each axis.
        shape: Vec<usize>,
        /// As many as the product, or one for all.
        values: Vec<f64>,
    },
    /// An array of the model folder.
    ConstantFile {
        /// NPY file.
        file: String,
    },
    /// An array of the embeddings.
    Embedding {
        /// Its name there.
        key: String,
        /// Shape of zeros that stand for it when it is absent.
        optional_zeros: Option<Vec<usize>>,
    },
}

/// A latent-shaped tensor.
#[derive(Debug, Clone, PartialEq)]
pub struct LatentInput {
    /// Its parts.
    pub parts: Vec<Part>,
    /// What they are joined along.
    pub over: Axis,
    /// Order of its axes.
    pub layout: Layout,
    /// Copies of the mask.
    pub mask_channels: usize,
    /// The image part after latent 0.
    pub image_fill: ImageFill,
}

/// What parts are joined along.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Channels.
    Channels,
    /// Time.
    Time,
}

/// The image part after latent 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImageFill {
    /// Zeros.
    Zeros,
    /// The latents of the image followed by grey.
    EncodedGrey,
}

/// A part of a latent-shaped tensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// z.
    Latents,
    /// 1 at latent 0, else 0.
    Mask,
    /// The latent of the image at latent 0.
    Image,
    /// The latent of the image alone.
    First,
    /// Neighbours made before.
    History(HistorySlots),
}

/// Neighbours by their distance from the chunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HistorySlots {
    /// The first that is meant, 0 the one beside the chunk.
    pub nearest: usize,
    /// How many, away from the chunk.
    pub count: usize,
}

/// How often a number is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Per {
    /// Once, without axes.
    Scalar,
    /// Once for each of the batch.
    Batch,
    /// For each token of the batch.
    Token {
        /// Latents of a token in time, rows, columns.
        patch: [usize; 3],
    },
}

pub(super) fn inputs(
    item: &Item<'_>,
    latent: Option<&LatentSpec>,
    chunk: Option<&ChunkSpec>,
) -> Option<Vec<InputSpec>> {
    let mut read: Vec<InputSpec> = Vec::new();
    let mut whole = true;
    for item in item.list()? {
        match item.table().and_then(|keys| input(&item, keys, latent, chunk)) {
            Some(input) => {
                if read.iter().any(|other| other.name == input.name) {
                    item.problem(format!("two inputs are named `{}`", input.name));
                }
                read.push(input);
            }
            None => whole = false,
        }
    }
    let takes_z = |input: &InputSpec| matches!(&input.source, Source::Latent(l) if l.parts.contains(&Part::Latents));
    if whole && !read.iter().any(takes_z) {
        item.problem("no input has the part \"latents\"");
    }
    whole.then_some(read)
}

fn input(
    item: &Item<'_>,
    mut keys: Keys<'_>,
    latent: Option<&LatentSpec>,
    chunk: Option<&ChunkSpec>,
) -> Option<InputSpec> {
    let name = keys.need("name").and_then(|i| i.text());
    let dtype = dtype(&mut keys);
    let parts = keys.get("parts");
    let source = match parts {
        Some(list) => parts_of(&list, chunk)
            .map(|parts| (parts, true))
            .and_then(|(parts, joined)| latent_input(item, &mut keys, parts, joined, latent)),
        None => single(item, &mut keys, latent, chunk),
    };
    if source.is_none() {
        keys.give_up();
    }
    if let (Some(dtype @ (Dtype::I64 | Dtype::I32 | Dtype::Bool)), Some(Source::Latent(_))) = (dtype, &source) {
        item.problem(format!("latents are floats, not {}", dtype.name()));
    }
    Some(InputSpec { name: name?, dtype: dtype?, source: source? })
}

fn single(
    item: &Item<'_>,
    keys: &mut Keys<'_>,
    latent: Option<&LatentSpec>,
    chunk: Option<&ChunkSpec>,
) -> Option<Source> {
    let known = [
        "latents",
        "mask",
        "image",
        "first",
        "history",
        "sigma",
        "timestep",
        "guidance",
        "frames",
        "height",
        "width",
        "indices",
        "constant",
        "embedding",
    ];
    let Some(source) = keys.get("source") else {
        item.problem("an input has `source`, or `parts` that are joined");
        return None;
    };
    let source = source.choice(&known.map(|name| (name, name)))?;
    let part = match source {
        "latents" => Some(Part::Latents),
        "mask" => Some(Part::Mask),
        "image" => Some(Part::Image),
        "first" => Some(Part::First),
        "history" => Some(Part::History(slots(item, keys, chunk)?)),
        _ => None,
    };
    if let Some(part) = part {
        return latent_input(item, keys, vec![part], false, latent);
    }
    match source {
        "indices" => {
            let of = keys.need("of").and_then(|i| parts_of(&i, chunk))?;
            if of.iter().any(|p| matches!(p, Part::Mask | Part::Image)) {
                item.problem("`of` names first, latents and history");
                return None;
            }
            Some(Source::Indices { of })
        }
        "constant" => constant(item, keys),
        "embedding" => {
            let key = keys.need("key").and_then(|i| i.text());
            let zeros = keys.get("optional_zeros").map(|i| shape(&i));
            Some(Source::Embedding { key: key?, optional_zeros: zeros.map_or(Some(None), |z| z.map(Some))? })
        }
        number => {
            let scale = keys.get("scale").map_or(Some(1.0), |i| i.number());
            let size = matches!(number, "frames" | "height" | "width");
            let usual = if size { "scalar" } else { "batch" };
            let choices = [("scalar", "scalar"), ("batch", "batch"), ("token", "token")];
            let per = keys.get("per").map_or(Some(usual), |i| i.choice(&choices));
            let per = match per? {
                "scalar" => Per::Scalar,
                "batch" => Per::Batch,
                _ => Per::Token { patch: patch(keys)? },
            };
            let scale = scale?;
            Some(match number {
                "sigma" => Source::Sigma { scale, per },
                "timestep" => Source::Timestep { scale, per },
                "guidance" => Source::Guidance { scale, per },
                "frames" => Source::Size { axis: 0, scale, per },
                "height" => Source::Size { axis: 1, scale, per },
                _ => Source::Size { axis: 2, scale, per },
            })
        }
    }
}

fn parts_of(item: &Item<'_>, chunk: Option<&ChunkSpec>) -> Option<Vec<Part>> {
    let choices = [("latents", Part::Latents), ("mask", Part::Mask), ("image", Part::Image), ("first", Part::First)];
    let list = item.list()?;
    if list.is_empty() {
        item.problem("is empty");
        return None;
    }
    let part = |item: &Item<'_>| {
        if item.is_text() {
            return item.choice(&choices);
        }
        let mut keys = item.table()?;
        let source = keys.need("source").and_then(|i| i.choice(&[("history", ())]));
        let slots = slots(item, &mut keys, chunk);
        source.and(slots).map(Part::History)
    };
    list.iter().map(part).collect()
}

fn slots(item: &Item<'_>, keys: &mut Keys<'_>, chunk: Option<&ChunkSpec>) -> Option<HistorySlots> {
    let nearest = keys.get("nearest").map_or(Some(0), |i| i.size(0..=10_000));
    let count = keys.get("count").map_or(Some(1), |i| i.size(1..=10_000));
    let slots = HistorySlots { nearest: nearest?, count: count? };
    let there = chunk.map_or(usize::MAX, |c| c.history);
    if slots.nearest + slots.count > there {
        item.problem(format!("asks for neighbours that chunk.history = {there} does not keep"));
        return None;
    }
    Some(slots)
}

fn latent_input(
    item: &Item<'_>,
    keys: &mut Keys<'_>,
    parts: Vec<Part>,
    joined: bool,
    latent: Option<&LatentSpec>,
) -> Option<Source> {
    let over = if joined {
        keys.get("over")
            .map_or(Some(Axis::Channels), |i| i.choice(&[("channels", Axis::Channels), ("time", Axis::Time)]))
    } else {
        Some(Axis::Channels)
    };
    let layout = layout(keys);
    let mask_channels = if parts.contains(&Part::Mask) {
        keys.get("mask_channels").map_or(Some(1), |i| i.size(1..=64))
    } else {
        Some(1)
    };
    let image_fill = if parts.contains(&Part::Image) {
        let choices = [("zeros", ImageFill::Zeros), ("encoded_grey", ImageFill::EncodedGrey)];
        keys.get("image_fill").map_or(Some(ImageFill::Zeros), |i| i.choice(&choices))
    } else {
        Some(ImageFill::Zeros)
    };
    // Length in time: of the chunk, or a number.
    let length = |part: &Part| match part {
        Part::Latents | Part::Mask | Part::Image => None,
        Part::First => Some(1),
        Part::History(slots) => Some(slots.count),
    };
    let over = over?;
    match over {
        Axis::Channels if parts.iter().any(|p| length(p) != length(&parts[0])) => {
            item.problem("parts joined over channels must have the same length in time");
            return None;
        }
        Axis::Time if parts.contains(&Part::Mask) => {
            item.problem("a mask has other channels than latents: it cannot be joined over time");
            return None;
        }
        _ => {}
    }
    if image_fill == Some(ImageFill::EncodedGrey) && latent.is_some_and(|l| l.first == FirstLatent::Separate) {
        item.problem("an image among grey needs a latent 0 in the tensor, and latent.first is \"separate\"");
        return None;
    }
    Some(Source::Latent(LatentInput {
        parts,
        over,
        layout: layout?,
        mask_channels: mask_channels?,
        image_fill: image_fill?,
    }))
}
